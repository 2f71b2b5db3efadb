/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Feeds mutations of the files in tests/data to the packing readers; meant to run under the address and
 * undefined-behaviour sanitizers. The same arguments give the same mutations. fuzz_packing [mutations of each file =
 * 2000] [seed = 1] */
#include "../unit/packing_help.h"

int main(int count, char **text) {
  const long mutations = count > 1 ? strtol(text[1], NULL, 10) : 2000;
  const uint64_t seed = count > 2 ? strtoull(text[2], NULL, 10) : 1;
  const double start = base_seconds();
  const long accepted = fuzz_readers(mutations, seed);
  printf("fuzz_packing: %ld mutations, %ld accepted as packings, %.1f s\n", mutations * FIXTURES, accepted,
         base_seconds() - start);
  return 0;
}
