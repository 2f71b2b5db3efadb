/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rank_error.h"

#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "comm.h"
#include "error.h"
#include "fix.h"
#include "lammps.h"
#include "rank_agree.h"

using namespace LAMMPS_NS;

void LAMMPS_NS::fix_failed(LAMMPS *lmp, const Fix *fix, const std::string &message) {
  lmp->error->fix_error(FLERR, const_cast<Fix *>(fix), message.c_str());
  abort(); /* not reached: fix_error ends the program */
}

void LAMMPS_NS::fix_check(LAMMPS *lmp, const Fix *fix, BaseStatus status) {
  if (rank_agree(lmp->world, status, lmp->comm->me) != BASE_OK) fix_failed(lmp, fix, base_error_message());
}

void LAMMPS_NS::fix_warning(LAMMPS *lmp, const Fix *fix, const std::string &message) {
  if (lmp->comm->me == 0)
    lmp->error->warning(FLERR, format_text("Fix %s (id %s): %s", fix->style, fix->id, message.c_str()).c_str());
}

std::string LAMMPS_NS::format_text(const char *format, ...) {
  char text[2048];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}
