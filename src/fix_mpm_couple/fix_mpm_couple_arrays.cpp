/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Per-point state on its way through LIGGGHTS: growth, sorting, exchange between ranks, restart files. */
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "fix_mpm_couple.h"
#include "memory.h"
#include "rank_error.h"
#include "restart_seal.h"

using namespace LAMMPS_NS;

void FixMPMCouple::grow_arrays(int rows) {
  memory->grow(state_, rows, (int)STATE_COLUMNS, "mpm/couple:state");
  memory->grow(array_atom, rows, (int)OUTPUT_COLUMNS, "mpm/couple:array_atom");
  if (rows > state_rows_) {
    memset(state_[state_rows_], 0, (size_t)(rows - state_rows_) * STATE_COLUMNS * sizeof(double));
    memset(array_atom[state_rows_], 0, (size_t)(rows - state_rows_) * OUTPUT_COLUMNS * sizeof(double));
  }
  state_rows_ = rows;
}

void FixMPMCouple::copy_arrays(int from, int to, int) {
  detach();
  memcpy(state_[to], state_[from], STATE_COLUMNS * sizeof(double));
  memcpy(array_atom[to], array_atom[from], OUTPUT_COLUMNS * sizeof(double));
}

/* A new particle: STAGE_NEW is 0. Its radius is set here, before pair styles look for the largest. */
void FixMPMCouple::set_arrays(int i) {
  detach();
  memset(state_[i], 0, STATE_COLUMNS * sizeof(double));
  memset(array_atom[i], 0, OUTPUT_COLUMNS * sizeof(double));
  if (!(atom->mask[i] & groupbit)) return;
  double edge = size0_[0];
  for (int k = 1; k < scene_.dimension; k++) edge = MIN(edge, size0_[k]);
  atom->radius[i] = 0.5 * edge;
}

int FixMPMCouple::pack_exchange(int i, double *buffer) {
  detach();
  memcpy(buffer, state_[i], STATE_COLUMNS * sizeof(double));
  memcpy(buffer + STATE_COLUMNS, array_atom[i], OUTPUT_COLUMNS * sizeof(double));
  return STATE_COLUMNS + OUTPUT_COLUMNS;
}

int FixMPMCouple::unpack_exchange(int i, double *buffer) {
  detach();
  memcpy(state_[i], buffer, STATE_COLUMNS * sizeof(double));
  memcpy(array_atom[i], buffer + STATE_COLUMNS, OUTPUT_COLUMNS * sizeof(double));
  return STATE_COLUMNS + OUTPUT_COLUMNS;
}

int FixMPMCouple::size_restart(int) { return STATE_COLUMNS + 1; }
int FixMPMCouple::maxsize_restart() { return STATE_COLUMNS + 1; }

int FixMPMCouple::pack_restart(int i, double *buffer) {
  write_state();
  buffer[0] = STATE_COLUMNS + 1;
  memcpy(buffer + 1, state_[i], STATE_COLUMNS * sizeof(double));
  return STATE_COLUMNS + 1;
}

/* The nth fix's values follow those of the n fixes before it, each of which starts with its length. */
void FixMPMCouple::unpack_restart(int i, int nth) {
  detach();
  const double *extra = atom->extra[i];
  int start = 0;
  for (int k = 0; k < nth; k++) start += (int)extra[start];
  memcpy(state_[i], extra + start + 1, STATE_COLUMNS * sizeof(double));
}

/* The global record says how a point's record looks. */
struct CoupleRecord {
  char magic[8];
  int64_t columns, last_number;
  int64_t heat_apart, heat_left, heat_steps;
};
static const char RECORD_MAGIC[8] = {'m', 'p', 'm', 'c', 'o', 'u', 'p', '2'};

/* LIGGGHTS has closed the file. A file that cannot be sealed is no reason to lose the run, but to warn. */
void FixMPMCouple::write_restart_file(char *file) {
  int failed = 0;
  if (comm->me == 0 && !strchr(file, '%')) failed = restart_seal(file) != BASE_OK;
  MPI_Bcast(&failed, 1, MPI_INT, 0, world);
  if (failed) fix_warning(lmp, this, base_error_message());
}

void FixMPMCouple::write_restart(FILE *file) {
  if (comm->me != 0) return;
  CoupleRecord record;
  memcpy(record.magic, RECORD_MAGIC, sizeof record.magic);
  record.columns = STATE_COLUMNS;
  record.last_number = last_number_;
  record.heat_apart = heat_apart_;
  record.heat_left = heat_left_;
  record.heat_steps = heat_steps_;
  const int size = sizeof record;
  fwrite(&size, sizeof size, 1, file);
  fwrite(&record, sizeof record, 1, file);
}

void FixMPMCouple::restart(char *bytes) {
  CoupleRecord record;
  memcpy(&record, bytes, sizeof record);
  if (memcmp(record.magic, RECORD_MAGIC, sizeof record.magic) != 0 || record.columns != STATE_COLUMNS)
    fix_failed(lmp, this, "the restart file holds no points of this fix, or those of another version");
  last_number_ = record.last_number;
  heat_apart_ = heat_apart_ || record.heat_apart; /* what waits must still be given */
  heat_left_ = record.heat_left;
  heat_steps_ = record.heat_steps;
}

double FixMPMCouple::memory_usage() {
  return (double)state_rows_ * (STATE_COLUMNS + OUTPUT_COLUMNS) * sizeof(double) +
         (double)points_.capacity() * sizeof(MpmPoint);
}
