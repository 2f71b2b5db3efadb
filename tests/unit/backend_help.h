/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Where the tests of the RVE engine run: DEMPM_BACKEND=cuda takes a device, anything else the CPU. */
#ifndef DEMPM_BACKEND_HELP_H
#define DEMPM_BACKEND_HELP_H

#include <stdlib.h>
#include <string.h>

#include "cuda_rve/rve.h"

__attribute__((unused)) static RveBackend help_backend(void) {
  const char *const name = getenv("DEMPM_BACKEND");
  return name && strcmp(name, "cuda") == 0 ? RVE_BACKEND_CUDA : RVE_BACKEND_CPU;
}

#endif
