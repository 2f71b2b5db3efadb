/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fix bond/gran/thermal: how bonds follow their grains, through memory, to other ranks and into restart files. */
#include <algorithm>
#include <cstdio>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "fix_bond_gran_thermal.h"
#include "memory.h"

using namespace LAMMPS_NS;

/* Of one bond in messages and files: partner, gap, spring. */
enum { BOND_WORDS = 5 };

void FixBondGranThermal::grow_arrays(int nmax) {
  bonds_.resize(nmax);
  const int before = vector_atom ? grown_ : 0;
  memory->grow(vector_atom, nmax, "bond/gran/thermal:vector_atom");
  for (int i = before; i < nmax; i++) vector_atom[i] = 0.0;
  grown_ = nmax;
}

void FixBondGranThermal::copy_arrays(int i, int j, int) {
  bonds_[j] = bonds_[i];
  vector_atom[j] = vector_atom[i];
}

void FixBondGranThermal::set_arrays(int i) {
  bonds_[i].clear();
  vector_atom[i] = 0.0;
}

int FixBondGranThermal::pack_exchange(int i, double *buf) {
  int n = 0;
  buf[n++] = (double)bonds_[i].size();
  for (const Bond &bond : bonds_[i]) {
    buf[n++] = (double)bond.partner;
    buf[n++] = bond.bond.gap;
    for (int a = 0; a < 3; a++) buf[n++] = bond.bond.spring[a];
  }
  return n;
}

int FixBondGranThermal::unpack_exchange(int i, double *buf) {
  int n = 0;
  bonds_[i].assign((size_t)buf[n++], Bond{});
  for (Bond &bond : bonds_[i]) {
    bond.partner = (int)buf[n++];
    bond.bond.gap = buf[n++];
    for (int a = 0; a < 3; a++) bond.bond.spring[a] = buf[n++];
  }
  vector_atom[i] = (double)bonds_[i].size();
  return n;
}

int FixBondGranThermal::size_restart(int i) { return 2 + BOND_WORDS * (int)bonds_[i].size(); }

int FixBondGranThermal::maxsize_restart() {
  int most = 0, all;
  for (int i = 0; i < atom->nlocal; i++) most = std::max(most, size_restart(i));
  MPI_Allreduce(&most, &all, 1, MPI_INT, MPI_MAX, world);
  return std::max(all, 2);
}

/* A fix's values of a grain begin with their number. */
int FixBondGranThermal::pack_restart(int i, double *buf) {
  buf[0] = size_restart(i);
  return 1 + pack_exchange(i, buf + 1);
}

void FixBondGranThermal::unpack_restart(int i, int nth) {
  double *values = atom->extra[i];
  for (int k = 0; k < nth; k++) values += (int)values[0];
  unpack_exchange(i, values + 1);
}

/* Collective, though only rank 0 writes. */
void FixBondGranThermal::write_restart(FILE *file) {
  double sums[COUNTS];
  MPI_Reduce(count_, sums, COUNTS, MPI_DOUBLE, MPI_SUM, 0, world);
  if (comm->me != 0) return;
  const int size = sizeof sums;
  fwrite(&size, sizeof size, 1, file);
  fwrite(sums, sizeof sums, 1, file);
}

void FixBondGranThermal::restart(char *buf) {
  if (comm->me == 0) memcpy(count_, buf, sizeof count_);
}

double FixBondGranThermal::memory_usage() {
  double bytes = (double)bonds_.capacity() * (sizeof bonds_[0] + sizeof(double));
  for (const std::vector<Bond> &bonds : bonds_) bytes += (double)bonds.capacity() * sizeof(Bond);
  return bytes;
}
