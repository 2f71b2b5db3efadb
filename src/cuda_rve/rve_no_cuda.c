/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The device's functions when no CUDA compiler was there. The CUDA build defines DEMPM_CUDA and brings
 * rve_backend_cuda.cu. */
#include "rve_backend.h"

#if !defined(DEMPM_CUDA)

static BaseStatus absent(void) {
  return base_error(BASE_ERROR_DEVICE, "backend cuda: this program was built without CUDA (allowed: auto, cpu)");
}

int rve_device_present(void) { return 0; }
void rve_device_share(int process) { (void)process; }
BaseStatus rve_device_create(const RveKernels **layout, RveDevice **device) {
  *layout = NULL, *device = NULL;
  return absent();
}
void rve_device_destroy(RveDevice *device) { (void)device; }
BaseStatus rve_device_upload(RveDevice *device, int rve, const RveCounts *counts, size_t bytes, const void *arena) {
  (void)device, (void)rve, (void)counts, (void)bytes, (void)arena;
  return absent();
}
int rve_device_holds(const RveDevice *device, int rve) {
  (void)device, (void)rve;
  return 0;
}
BaseStatus rve_device_download(RveDevice *device, int rve, void *arena) {
  (void)device, (void)rve, (void)arena;
  return absent();
}
BaseStatus rve_device_run(RveDevice *device, RveFeatures features, RveDeviceJob *jobs, int count) {
  (void)device, (void)features, (void)jobs, (void)count;
  return absent();
}

#endif
