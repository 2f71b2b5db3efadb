/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Adds the fix styles of this directory to a stock LIGGGHTS library. Not needed inside a LIGGGHTS source tree, where
 * the FixStyle lines of the headers do it. */
#ifndef LMP_STYLE_REGISTRY_H
#define LMP_STYLE_REGISTRY_H

namespace LAMMPS_NS {

class LAMMPS;

/* May be called again, e.g. after the command `clear`. */
void register_styles(LAMMPS *lmp);

}  // namespace LAMMPS_NS

#endif
