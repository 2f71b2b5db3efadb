/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Which device answers. After rve_help.h or farm_help.h. */
#ifndef DEMPM_DEVICE_HELP_H
#define DEMPM_DEVICE_HELP_H

#include <stdlib.h>

#include "cuda_rve/rve.h"

#define SKIP_WITHOUT(there, what)                    \
  do {                                               \
    if (!(there)) {                                  \
      print_message("           no %s\n", what);     \
      skip();                                        \
    }                                                \
  } while (0)
#define NEED_A_DEVICE() SKIP_WITHOUT(rve_device_present(), "device")
#define NEED_A_DEVICE_THAT_REFUSES() SKIP_WITHOUT(help_device_is_on_host(), "device that refuses memory")

/* 1 if the device is its source on the host (tests/cuda_host), which refuses memory when asked to: it alone can be made to say that it
 * is not there. */
static inline int help_device_is_on_host(void) {
  setenv("DEMPM_CUDA_HOST_DEVICES", "0", 1);
  const int vanishes = !rve_device_present();
  unsetenv("DEMPM_CUDA_HOST_DEVICES");
  return vanishes && rve_device_present();
}

#endif
