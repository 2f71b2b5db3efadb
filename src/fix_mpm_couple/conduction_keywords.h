/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The keywords of a conduction model, the same in fix heat/gran/grain and fix mpm/rve. */
#ifndef LMP_CONDUCTION_KEYWORDS_H
#define LMP_CONDUCTION_KEYWORDS_H

#include "../grain_heat/grain_heat.h"
#include "keyword_parser.h"

namespace LAMMPS_NS {

extern const std::vector<std::string> CONDUCTION_KEYWORDS;

/* Reads the present keyword's values if it is one of them; false if not. collisional: that model is allowed. */
bool read_conduction(KeywordParser &parser, GrainHeat &model, bool collisional);
/* Refuses keywords that the model does not use; asks for those that it needs. */
void check_conduction(const KeywordParser &parser, const GrainHeat &model);

}  // namespace LAMMPS_NS

#endif
