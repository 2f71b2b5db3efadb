/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Fixtures (tests/data) and mutations of them, for the tests and the fuzzer of the packing readers. */
#ifndef DEMPM_PACKING_HELP_H
#define DEMPM_PACKING_HELP_H

#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cuda_rve/rve_packing_file.h"

#define PACKING_HELP __attribute__((unused)) static

typedef struct Fixture {
  const char *name;
  int dimension, grains;
} Fixture;
static const Fixture fixtures[] = {{"layer.data", 2, 40},     {"layer.dump", 2, 40},   {"layer.restart", 2, 40},
                                   {"ranks.restart", 2, 40},  {"spheres.data", 3, 64}, {"spheres.dump", 3, 64},
                                   {"spheres.restart", 3, 64}};
enum { FIXTURES = sizeof fixtures / sizeof *fixtures };

/* Full name of a fixture: in $DEMPM_TEST_DATA, else below the current directory, else seen from the executable. */
PACKING_HELP FILE *open_fixture(const char *name, char path[4096]) {
  const char *data = getenv("DEMPM_TEST_DATA");
  char program[2048];
  const ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
  program[length > 0 ? length : 0] = '\0';
  char *slash = strrchr(program, '/');
  if (slash) *slash = '\0';
  const char *const pattern[] = {"%s/%s", "%.0stests/data/%s", "%s/../../tests/data/%s", "%s/../../../tests/data/%s"};
  for (int k = 0; k < 4; k++) {
    const char *base = k == 0 ? data : program;
    if (!base) continue;
    snprintf(path, 4096, pattern[k], base, name);
    FILE *file = fopen(path, "rb");
    if (file) return file;
  }
  fprintf(stderr, "cannot find tests/data/%s; set DEMPM_TEST_DATA to that directory\n", name);
  exit(1);
}

/* The bytes of a fixture; free with free(). */
PACKING_HELP char *load_fixture(const char *name, size_t *size) {
  char path[4096];
  FILE *file = open_fixture(name, path);
  char *bytes = malloc(1 << 20);
  *size = bytes ? fread(bytes, 1, 1 << 20, file) : 0;
  fclose(file);
  if (*size > 0) return bytes;
  fprintf(stderr, "cannot read %s\n", path);
  exit(1);
}

/* Reads bytes from a copy of exactly their size, so that the address sanitizer sees a read beyond them. */
PACKING_HELP BaseStatus read_copy(const char *bytes, size_t size, int dimension, RvePacking *packing) {
  char *copy = malloc(size ? size : 1);
  if (!copy) exit(1);
  memcpy(copy, bytes, size);
  const PackingFile file = {.name = "mutated", .bytes = copy, .size = size};
  const BaseStatus status = packing_read_bytes(&file, dimension, 1e6, packing);
  free(copy);
  return status;
}

PACKING_HELP size_t pick(uint64_t *random, size_t count) { return (size_t)(base_random(random) * (double)count); }

/* Changes the first *size of bytes (room for 2 * *size + 64) in one of several ways. */
PACKING_HELP void mutate(char *bytes, size_t *size, uint64_t *random) {
  static const char *const word[] = {"nan",   "-1", "1e308", "99999999999", "0",      "ITEM: ATOMS",
                                     "Atoms", "\n", "#",     "inf",         "-1e-320"};
  const size_t n = *size, at = pick(random, n), length = 1 + pick(random, n - at < 64 ? n - at : 64);
  switch (pick(random, 7)) {
  case 0:
    bytes[at] = (char)pick(random, 256);
    break;
  case 1:
    bytes[at] = (char)(bytes[at] ^ (1 << pick(random, 8)));
    break;
  case 2:
    *size = at;
    break;
  case 3: /* a piece is cut out */
    memmove(bytes + at, bytes + at + length, n - at - length);
    *size = n - length;
    break;
  case 4: /* a piece is there twice */
    memmove(bytes + at + length, bytes + at, n - at);
    *size = n + length;
    break;
  case 5: { /* a word in the place of what is there */
    const char *text = word[pick(random, sizeof word / sizeof *word)];
    const size_t bytes_of_text = strlen(text) < n - at ? strlen(text) : n - at;
    memcpy(bytes + at, text, bytes_of_text);
    break;
  }
  default: { /* an integer, where binary files have their lengths */
    static const int32_t value[] = {-1, 0, 1, 0x7fffffff, -0x7fffffff, 65536, 2, 1000};
    if (n - at >= sizeof *value) memcpy(bytes + at, value + pick(random, 8), sizeof *value);
  }
  }
}

/* Reads `count` mutations of each fixture in both dimensions. Returns how many were accepted as packings. */
PACKING_HELP long fuzz_readers(long count, uint64_t seed) {
  long accepted = 0;
  for (int f = 0; f < FIXTURES; f++) {
    size_t size;
    char *original = load_fixture(fixtures[f].name, &size), *bytes = malloc(64 * (2 * size + 64));
    if (!bytes) exit(1);
    for (long k = 0; k < count; k++) {
      uint64_t random = seed + (uint64_t)k * 1000 + (uint64_t)f;
      size_t now = size;
      memcpy(bytes, original, size);
      for (size_t changes = 1 + pick(&random, 4); changes > 0 && now > 0; changes--) mutate(bytes, &now, &random);
      RvePacking packing;
      if (read_copy(bytes, now, 2 + (int)pick(&random, 2), &packing) == BASE_OK) {
        accepted++;
        if (rve_packing_check(&packing) != BASE_OK)
          fprintf(stderr, "accepted, but: %s\n", base_error_message()), abort();
        rve_packing_destroy(&packing);
      }
    }
    free(bytes);
    free(original);
  }
  return accepted;
}

#endif
