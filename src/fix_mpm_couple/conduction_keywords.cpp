/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "conduction_keywords.h"

using namespace LAMMPS_NS;

const std::vector<std::string> LAMMPS_NS::CONDUCTION_KEYWORDS = {"direct", "area", "indirect", "fluid", "porosity",
                                                                 "core",   "reach", "layer",   "minimum_gap"};

bool LAMMPS_NS::read_conduction(KeywordParser &parser, GrainHeat &model, bool collisional) {
  if (parser.is("direct")) {
    std::vector<std::string> models = {"none", "batchelor", "liggghts", "pipe"};
    if (collisional) models.push_back("collisional");
    model.direct = (GrainDirect)parser.choice(models);
  } else if (parser.is("area")) model.area = (GrainArea)parser.choice({"geometric", "hertz"});
  else if (parser.is("indirect"))
    model.indirect = (GrainIndirect)parser.choice({"none", "voronoi_a", "voronoi_b", "layer"});
  else if (parser.is("fluid")) model.fluid = parser.number(NumberRange::positive());
  else if (parser.is("porosity")) model.porosity = parser.number(NumberRange::inside(0.0, 1.0));
  else if (parser.is("core")) model.core = parser.number(NumberRange::inside(0.0, 1.0));
  else if (parser.is("reach")) model.reach = parser.number(NumberRange::positive());
  else if (parser.is("layer")) model.layer = parser.number(NumberRange::positive());
  else if (parser.is("minimum_gap")) model.minimum_gap = parser.number(NumberRange::positive());
  else return false;
  return true;
}

/* A keyword that the model does not use is a mistake in the script. */
void LAMMPS_NS::check_conduction(const KeywordParser &parser, const GrainHeat &model) {
  const GrainIndirect a = GRAIN_INDIRECT_VORONOI_A, b = GRAIN_INDIRECT_VORONOI_B, layer = GRAIN_INDIRECT_LAYER;
  const struct {
    const char *keyword, *models;
    bool used;
  } uses[] = {{"area", "'direct batchelor', 'liggghts', 'pipe' or 'collisional'", model.direct != GRAIN_DIRECT_NONE},
              {"fluid", "'indirect voronoi_a', 'voronoi_b' or 'layer'", model.indirect != GRAIN_INDIRECT_NONE},
              {"porosity", "'indirect voronoi_a' or 'voronoi_b'", model.indirect == a || model.indirect == b},
              {"reach", "'indirect voronoi_a' or 'voronoi_b'", model.indirect == a || model.indirect == b},
              {"core", "'indirect voronoi_b'", model.indirect == b},
              {"layer", "'indirect layer'", model.indirect == layer},
              {"minimum_gap", "'indirect layer'", model.indirect == layer}};
  for (const auto &use : uses)
    if (parser.given(use.keyword) && !use.used)
      parser.fail(std::string("keyword '") + use.keyword + "' has a meaning with " + use.models + " only");
  if (model.indirect != GRAIN_INDIRECT_NONE) parser.require("fluid", "fluid K, the conductivity of the fluid");
}
