/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What one core can do at most, for the roofline in doc/performance.md. One line of JSON, the best of some tries:
 *   gflops       FP64 multiply-adds in registers, two operations each
 *   read_gbs     read from working sets of 16, 256 and 4096 KiB: the caches' bandwidth
 *   row_ns       one row of four numbers at a random place among 512, transposed into lanes: how neighbours are read */
#include <math.h>
#include <stdio.h>

#include "isa.h"

enum { TRIES = 9, MOST_KIB = 4096, ROWS = 512, PICKS = 8192 };

int main(void) {
  static const long kib[3] = {16, 256, MOST_KIB};
  const RveKernels *kernels;
  const RveScene scene = rve_scene_default();
  const BenchIsa *isa = bench_isa(&scene, &kernels);
  double *numbers = NULL, gflops = 0.0, gbs[3] = {0.0, 0.0, 0.0}, row = INFINITY;
  uint32_t *offset = NULL;
  if (BASE_ALLOC(MOST_KIB * 128, &numbers) != BASE_OK || BASE_ALLOC(PICKS, &offset) != BASE_OK) {
    fprintf(stderr, "bench_peak: %s\n", base_error_message());
    return 1;
  }
  uint64_t seed = 1;
  for (int k = 0; k < PICKS; k++) offset[k] = 4 * (uint32_t)(ROWS * base_random(&seed));
  for (int t = 0; t < TRIES; t++) {
    double flop;
    const double seconds = isa->multiply_add(2000000, &flop);
    gflops = fmax(gflops, 1e-9 * flop / seconds);
    for (int k = 0; k < 3; k++) {
      const long sweeps = 400000 / kib[k];
      gbs[k] = fmax(gbs[k], 1.024e-6 * (double)(kib[k] * sweeps) / isa->read(numbers, kib[k] * 128, sweeps));
    }
    row = fmin(row, 1e9 * isa->gather(numbers, offset, PICKS, 500) / (500.0 * PICKS));
  }
  printf("{\"isa\": \"%s\", \"gflops\": %.4g, \"read_gbs\": {\"16\": %.4g, \"256\": %.4g, \"4096\": %.4g}, \"row_ns\": %.4g}\n",
         isa->name, gflops, gbs[0], gbs[1], gbs[2], row);
  base_free(numbers);
  base_free(offset);
  return 0;
}
