/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The headers of LIGGGHTS' walls, primitive ones and meshes. */
#ifndef LMP_LIGGGHTS_WALLS_H
#define LMP_LIGGGHTS_WALLS_H

/* An installed LIGGGHTS lacks the generated list of contact models that the headers of its walls ask for. All they use
 * of it, in templates that are not instantiated here, are names for "no model"; the rest counts as read. */
#define CONTACT_MODEL_CONSTANTS_H_
namespace LIGGGHTS {
namespace ContactModels {
static const int NORMAL_OFF = 9, TANGENTIAL_OFF = 0, COHESION_OFF = 0, ROLLING_OFF = 0;
}
}  // namespace LIGGGHTS

#include "fix_contact_history_mesh.h"
#include "fix_mesh_surface.h"
#include "fix_neighlist_mesh.h"
#include "fix_wall_gran.h"
#include "primitive_wall.h"

#endif
