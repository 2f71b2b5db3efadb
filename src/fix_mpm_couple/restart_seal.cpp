/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "restart_seal.h"

#include <glob.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

using namespace LAMMPS_NS;

namespace {

const char MAGIC[8] = {'D', 'E', 'M', 'P', 'M', 'E', 'N', 'D'};
struct Seal {
  char magic[8];
  uint64_t size, hash;
};

bool read_whole(const char *file, std::vector<char> &bytes) {
  FILE *stream = fopen(file, "rb");
  if (!stream) return false;
  char block[1 << 16];
  for (size_t got; (got = fread(block, 1, sizeof block, stream)) > 0;) bytes.insert(bytes.end(), block, block + got);
  const bool good = !ferror(stream);
  fclose(stream);
  return good;
}

bool holds_points(const std::vector<char> &bytes) {
  static const char *const styles[] = {"mpm/couple", "mpm/rve", "mpm/wall"}; /* with their final zero, as LIGGGHTS writes them */
  for (const char *style : styles)
    if (memmem(bytes.data(), bytes.size(), style, strlen(style) + 1)) return true;
  return false;
}

Seal seal_of(const char *bytes, size_t size) {
  Seal seal;
  memcpy(seal.magic, MAGIC, sizeof MAGIC);
  seal.size = size;
  seal.hash = base_hash(bytes, size, BASE_HASH_SEED);
  return seal;
}

/* Kinds of the header's values by flag, as LIGGGHTS' WriteRestart::header writes them: string, int, bigint, double. */
const char HEADER_KINDS[] = "siiisbiiiiiiiiiiiiiiiisbibiibiibiibiiddddddddddddddd";
const int ATOM_STYLE_FLAG = 22, NATOMS_FLAG = 23;
const size_t LEAST_BYTES_PER_ATOM = 11 * sizeof(double); /* size, x, tag, type, mask, image, v: every atom style packs these */

template <typename T>
bool take(const std::vector<char> &bytes, size_t &at, T &value) {
  if (bytes.size() - at < sizeof value) return false;
  memcpy(&value, bytes.data() + at, sizeof value);
  at += sizeof value;
  return true;
}

/* Whether the file ends inside the header of a LIGGGHTS restart file, or is too short for the atoms that the header announces.
 * This is all that shows of a file that ends before the names of its fixes. What is not understood counts as whole. */
bool ends_early(const std::vector<char> &bytes) {
  size_t at = 0;
  int64_t atoms = 0;
  for (;;) {
    int32_t flag = 0, value = 0;
    int64_t wide = 0;
    if (!take(bytes, at, flag)) return true;
    if (flag == -1) break;
    if (flag < 0 || flag >= (int)strlen(HEADER_KINDS)) return false;
    const char kind = HEADER_KINDS[flag];
    if (kind != 's') {
      if (!(kind == 'i' ? take(bytes, at, value) : take(bytes, at, wide))) return true;
      if (flag == NATOMS_FLAG) atoms = wide;
      continue;
    }
    if (!take(bytes, at, value)) return true;
    if (value <= 0) return false;
    if ((size_t)value > bytes.size() - at) return true;
    if (flag == ATOM_STYLE_FLAG && strncmp(bytes.data() + at, "hybrid", (size_t)value) == 0) return false;
    at += (size_t)value;
  }
  return atoms > 0 && (bytes.size() - at) / LEAST_BYTES_PER_ATOM < (uint64_t)atoms;
}

}  // namespace

BaseStatus LAMMPS_NS::restart_seal(const char *file) {
  std::vector<char> bytes;
  if (!read_whole(file, bytes))
    return base_error(BASE_ERROR_FILE, "restart file %s cannot be read back: %s", file, strerror(errno));
  const Seal seal = seal_of(bytes.data(), bytes.size());
  FILE *stream = fopen(file, "ab");
  bool good = stream && fwrite(&seal, sizeof seal, 1, stream) == 1;
  good = good && fflush(stream) == 0 && fsync(fileno(stream)) == 0;
  if (stream && fclose(stream) != 0) good = false;
  return good ? BASE_OK : base_error(BASE_ERROR_FILE, "restart file %s cannot be sealed: %s", file, strerror(errno));
}

BaseStatus LAMMPS_NS::restart_check(const char *file) {
  std::vector<char> bytes;
  if (!read_whole(file, bytes) || !(holds_points(bytes) || ends_early(bytes))) return BASE_OK;
  Seal found;
  if (bytes.size() > sizeof found) {
    const size_t size = bytes.size() - sizeof found;
    memcpy(&found, bytes.data() + size, sizeof found);
    const Seal right = seal_of(bytes.data(), size);
    if (memcmp(&found, &right, sizeof found) == 0) return BASE_OK;
    if (memcmp(found.magic, MAGIC, sizeof MAGIC) == 0)
      return base_error(BASE_ERROR_FORMAT, "restart file %s is altered: its checksum is not that of its content", file);
  }
  return base_error(BASE_ERROR_FORMAT,
                    "restart file %s is not whole (%zu bytes, no seal at its end): its writing was interrupted or it was cut; "
                    "use an earlier one",
                    file, bytes.size());
}

std::string LAMMPS_NS::restart_find(const std::string &name) {
  const size_t star = name.find('*');
  if (star == std::string::npos) return name;
  glob_t matches;
  std::string best;
  long long largest = -1;
  if (glob(name.c_str(), 0, NULL, &matches) == 0) {
    for (size_t k = 0; k < matches.gl_pathc; k++) {
      const std::string path = matches.gl_pathv[k];
      const std::string number = path.substr(star, path.size() - (name.size() - 1));
      if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos) continue;
      if (atoll(number.c_str()) > largest) largest = atoll(number.c_str()), best = path;
    }
    globfree(&matches);
  }
  return best;
}
