/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A seal at the end of restart files that hold material points: length and checksum of all that stands before it. LIGGGHTS
 * reads restart files without looking whether they are whole; half a file makes it read on at random, or wait for ever on
 * several ranks. LIGGGHTS itself ignores what follows its own data, so sealed files stay readable for everybody. */
#ifndef LMP_RESTART_SEAL_H
#define LMP_RESTART_SEAL_H

#include <string>

#include "../base/base.h"

namespace LAMMPS_NS {

/* Appends the seal and syncs the file to disk. One rank calls. BASE_ERROR_FILE. */
BaseStatus restart_seal(const char *file);

/* BASE_ERROR_FORMAT if the file holds material points (names one of our fixes) and has no seal, or not the right one; also if it
 * ends before it could name a fix (LIGGGHTS would read its end over and over). Files of other programs pass, and so does one that
 * cannot be opened: LIGGGHTS says so itself. One rank calls. */
BaseStatus restart_check(const char *file);

/* The file that LIGGGHTS' read_restart means: `name`, or, if it has a *, the one with the largest number in its place. "" if none. */
std::string restart_find(const std::string &name);

}  // namespace LAMMPS_NS

#endif
