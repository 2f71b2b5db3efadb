/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The way from a BaseStatus to LIGGGHTS' error classes. LIGGGHTS' error->all() starts with a barrier: it must be called
 * on all ranks or on none, hence an agreement first. */
#ifndef LMP_RANK_ERROR_H
#define LMP_RANK_ERROR_H

#include <string>

#include "../base/base.h"
#include "pointers.h"

namespace LAMMPS_NS {

class Fix;

/* Ends the program with "ERROR: Fix STYLE (id ID): message". Called on all ranks with the same message. */
[[noreturn]] void fix_failed(LAMMPS *lmp, const Fix *fix, const std::string &message);

/* Collective. Returns if `status` is BASE_OK on all ranks; else ends the program with the message of the lowest failing
 * rank. */
void fix_check(LAMMPS *lmp, const Fix *fix, BaseStatus status);

/* A warning on rank 0, to screen and log. */
void fix_warning(LAMMPS *lmp, const Fix *fix, const std::string &message);

/* printf into a string. */
std::string format_text(const char *format, ...) __attribute__((format(printf, 1, 2)));

}  // namespace LAMMPS_NS

#endif
