/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a material point learns from its RVE, computed once per call: stress, conductivity, fabric, energies, modulus.
 */
#ifndef DEMPM_RVE_MEASURE_H
#define DEMPM_RVE_MEASURE_H

#include "rve_kernel.h"

/* Sums over contacts or grains, one per lane until the team adds them up. */
typedef union RveSums {
  struct {
    rve_real stress[6], conductivity[6], fabric[6]; /* xx yy zz xy xz yz */
    rve_real fourth[15];                            /* sum l^2 n_x^a n_y^b n_z^c, a + b + c = 4, a falling, then b */
    rve_real contacts, bonds, elastic, force, kinetic, resultant, solid;
  } of;
  rve_real all[3 * 6 + 15 + 7];
} RveSums;
enum { RVE_SUMS = 3 * 6 + 15 + 7 };

typedef union RveTotals {
  struct {
    double stress[6], conductivity[6], fabric[6], fourth[15];
    double contacts, bonds, elastic, force, kinetic, resultant, solid;
  } of;
  double all[RVE_SUMS];
} RveTotals;

/* sum += a (x) b, symmetrised. */
RVE_FN void rve_add_dyad(int dim, rve_real sum[6], const rve_real a[3], const rve_real b[3]) {
  const rve_real half = rve_set(0.5);
  for (int k = 0; k < dim; k++) sum[k] = sum[k] + a[k] * b[k];
  sum[3] = sum[3] + half * (a[0] * b[1] + a[1] * b[0]);
  if (dim == 3) {
    sum[4] = sum[4] + half * (a[0] * b[2] + a[2] * b[0]);
    sum[5] = sum[5] + half * (a[1] * b[2] + a[2] * b[1]);
  }
}

RVE_FN void rve_add_fourth(int dim, rve_real sum[15], const rve_real n[3], rve_real weight) {
  rve_real power[3][5];
  for (int k = 0; k < dim; k++) {
    power[k][0] = rve_set(1.0);
    for (int e = 1; e < 5; e++) power[k][e] = power[k][e - 1] * n[k];
  }
  int at = 0;
  for (int x = 4; x >= 0; x--)
    for (int y = 4 - x; y >= 0; y--, at++) {
      const int z = 4 - x - y;
      if (dim == 2 && z > 0) continue;
      rve_real product = weight * power[0][x] * power[1][y];
      if (dim == 3) product = product * power[2][z];
      sum[at] = sum[at] + product;
    }
}

/* |a|, also of 0. Roots and quotients would take longer than all else here. */
RVE_FN rve_real rve_norm(int dim, const rve_real a[3]) {
  const rve_real square = rve_dot(dim, a, a);
  return rve_keep(rve_less(rve_set(0.0), square), square * rve_inverse_sqrt(square));
}

/* One row of slots. The force is that of the last contact pass, read back from the reactions. */
RVE_FN void rve_sum_contact(RveFeatures ft, const RveCall *call, const rve_real h[9], const RveArrays *a,
                            const RveBody *own, int lane0, RveSums *sum) {
  const int dim = ft.dimension;
  const RveBody other = rve_neighbour_body(ft, a, lane0);
  const rve_int image = rve_load_short(a->image, lane0);
  const rve_real zero = rve_set(0.0), one = rve_set(1.0);
  rve_real d[3], n[3], f[3];
  rve_branch(dim, h, own->s, other.s, image, d);
  const rve_real square = rve_dot(dim, d, d), inverse = rve_inverse_sqrt(square), length = square * inverse;
  const rve_real overlap = own->r + other.r - length;
  const rve_mask bonded = rve_int_any_bit(image, rve_set_int(RVE_IMAGE_BOND));
  const rve_mask touch = rve_or(rve_less(zero, overlap), bonded);
  for (int k = 0; k < dim; k++) n[k] = rve_keep(touch, d[k] * inverse), d[k] = rve_keep(touch, d[k]);
  rve_read_reaction(dim, a, lane0, f);
  for (int k = 0; k < dim; k++) f[k] = zero - f[k];
  rve_add_dyad(dim, sum->of.stress, f, d);
  sum->of.force = sum->of.force + rve_norm(dim, f);
  rve_add_dyad(dim, sum->of.fabric, n, n);
  const rve_real l = rve_keep(touch, length);
  if (call->thermal) { /* h l l with h = 1/(alpha |l|) */
    rve_real ln[3];
    for (int k = 0; k < dim; k++) ln[k] = d[k] * rve_set(1.0 / call->pipe_resistance);
    rve_add_dyad(dim, sum->of.conductivity, ln, n);
  }
  rve_add_fourth(dim, sum->of.fourth, n, l * l);
  sum->of.contacts = sum->of.contacts + rve_keep(touch, one);
  sum->of.bonds = sum->of.bonds + rve_keep(bonded, one);
  sum->of.elastic = sum->of.elastic + rve_keep(touch, rve_set(0.5 * call->normal_stiffness) * overlap * overlap);
  if (ft.tangential && call->tangential_stiffness > 0.0)
    for (int k = 0; k < rve_spins(ft); k++) {
      const rve_real shear = rve_load(a->shear[k], lane0);
      sum->of.elastic = sum->of.elastic + rve_set(0.5 / call->tangential_stiffness) * shear * shear;
    }
}

/* flew: there are no forces. */
RVE_FN void rve_sum_grains(RveFeatures ft, const RveHead *head, const RveArrays *a, int lane0, const RveBody *own,
                           int flew, RveSums *sum) {
  const int dim = ft.dimension;
  rve_real f[3], t[3], p[3];
  const rve_real m = rve_load(a->mass, lane0), im = rve_load(a->inverse_inertia, lane0), half = rve_set(0.5);
  for (int k = 0; k < dim; k++) p[k] = rve_set(0.0) - m * own->v[k];
  if (!flew) {
    rve_sum_reactions(ft, head, a, lane0, f, t);
    for (int k = 0; k < dim; k++) f[k] = f[k] + rve_load(a->force[k], lane0);
    sum->of.resultant = sum->of.resultant + rve_norm(dim, f);
  }
  rve_add_dyad(dim, sum->of.stress, p, own->v);
  sum->of.kinetic = sum->of.kinetic - half * rve_dot(dim, p, own->v);
  const rve_mask turns = rve_less(rve_set(0.0), im);
  const rve_real inertia = rve_keep(turns, rve_set(1.0) / im);
  for (int k = 0; k < (ft.tangential ? rve_spins(ft) : 0); k++)
    sum->of.kinetic = sum->of.kinetic + half * inertia * own->w[k] * own->w[k];
  rve_real size = own->r * own->r;
  if (dim == 3) size = size * own->r;
  sum->of.solid = sum->of.solid + size;
}

/* Where rve_add_fourth() puts the sum with n_x^x n_y^y. */
RVE_FN int rve_fourth_at(int x, int y) { return (4 - x) * (5 - x) / 2 + 4 - x - y; }

/* Sums of l^2 n_i n_j: traces of the fourth moments. */
RVE_FN void rve_second_moments(const double fourth[15], double second[9]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      second[3 * i + j] = 0.0;
      for (int k = 0; k < 3; k++) {
        int e[3] = {0, 0, 0};
        e[i]++, e[j]++, e[k] += 2;
        second[3 * i + j] += fourth[rve_fourth_at(e[0], e[1])];
      }
    }
}

/* C_mmmm of the affine moduli C (eq. 58), times the volume: (kn - kt) sum l^2 (n m)^4 + kt sum l^2 (n m)^2. */
RVE_FN double rve_modulus_along(const RveCall *call, const double fourth[15], const double second[9], const double m[3]) {
  const double many[15] = {1.0, 4.0, 4.0, 6.0, 12.0, 6.0, 4.0, 12.0, 12.0, 4.0, 1.0, 4.0, 6.0, 4.0, 1.0}; /* 4!/(x! y! z!) */
  double power[3][5], four = 0.0, two = 0.0;
  for (int k = 0; k < 3; k++) {
    power[k][0] = 1.0;
    for (int e = 1; e < 5; e++) power[k][e] = power[k][e - 1] * m[k];
  }
  int at = 0;
  for (int x = 4; x >= 0; x--)
    for (int y = 4 - x; y >= 0; y--, at++) four += many[at] * power[0][x] * power[1][y] * power[2][4 - x - y] * fourth[at];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) two += m[i] * m[j] * second[3 * i + j];
  return (call->normal_stiffness - call->tangential_stiffness) * four + call->tangential_stiffness * two;
}

/* The largest over axes, face and space diagonals. */
RVE_FN double rve_largest_modulus(const RveCall *call, int dim, const double fourth[15], double volume) {
  double second[9], largest = 0.0;
  rve_second_moments(fourth, second);
  for (int x = 0; x <= 1; x++)
    for (int y = -1; y <= 1; y++)
      for (int z = dim == 3 ? -1 : 0; z <= (dim == 3 ? 1 : 0); z++) {
        if (x == 0 && y == 0 && z == 0) continue;
        const double norm = 1.0 / sqrt((double)(x * x + y * y + z * z)), m[3] = {x * norm, y * norm, z * norm};
        const double c = rve_modulus_along(call, fourth, second, m) / volume;
        largest = c > largest ? c : largest;
      }
  return largest;
}

RVE_FN double rve_cell_volume(const RveCall *call, const double h[9]) {
  const double v =
      h[0] * (h[4] * h[8] - h[5] * h[7]) - h[1] * (h[3] * h[8] - h[5] * h[6]) + h[2] * (h[3] * h[7] - h[4] * h[6]);
  return fabs(v) * call->thickness;
}

RVE_FN void rve_fill_answer(RveFeatures ft, const RveCall *call, const RveHead *head, const RveCounts *n,
                            const RveTotals *total, double work_before, double duration, RveAnswer *answer) {
  const double volume = rve_cell_volume(call, head->cell), contacts = total->of.contacts;
  const double per_contact = contacts > 0.0 ? 1.0 / contacts : 0.0;
  for (int k = 0; k < 6; k++) {
    answer->stress[k] = total->of.stress[k] / volume;
    answer->conductivity[k] = total->of.conductivity[k] / volume;
    answer->fabric[k] = total->of.fabric[k] * per_contact;
  }
  answer->heat = duration > 0.0 ? (head->friction_work - work_before) / (volume * duration) : 0.0;
  answer->friction_work = head->friction_work;
  answer->solid_fraction =
      total->of.solid * 3.14159265358979323846 * (ft.dimension == 2 ? call->thickness : 4.0 / 3.0) / volume;
  answer->coordination = 2.0 * contacts / n->grains;
  answer->bond_fraction = head->bonds_installed > 0 ? total->of.bonds / head->bonds_installed : 0.0;
  answer->kinetic_energy = total->of.kinetic;
  answer->elastic_energy = total->of.elastic;
  answer->damping_work = head->damping_work;
  answer->unbalanced = total->of.force > 0.0 ? total->of.resultant / n->grains / (total->of.force * per_contact) : 0.0;
  answer->modulus = contacts > 0.0 ? rve_largest_modulus(call, ft.dimension, total->of.fourth, volume) : 0.0;
  answer->volume = volume;
  answer->steps = head->steps;
  answer->rebuilds = head->rebuilds;
  answer->status = BASE_OK;
  answer->flew = head->flew;
}

RVE_FN int rve_answer_is_finite(const RveAnswer *x) {
  double sum = x->heat + x->friction_work + x->kinetic_energy + x->elastic_energy + x->damping_work + x->modulus +
               x->volume + x->unbalanced;
  for (int k = 0; k < 6; k++) sum += x->stress[k] + x->conductivity[k] + x->fabric[k];
  return sum - sum == 0.0;
}

/* Measures and answers. A state that is not finite leaves *answer as it was, but for its status, and fails the RVE. */
RVE_FN void rve_measure(RveFeatures ft, const RveTeam *team, const RveCall *call, RveHead *head, const RveCounts *n,
                        const RveArrays *a, double work_before, double duration, RveAnswer *answer) {
  const RveFeatures all = {ft.dimension, ft.tangential, 1, ft.bonds}; /* velocities are needed below */
  const int flew = head->flew;
  rve_real h[9];
  for (int k = 0; k < 9; k++) h[k] = rve_set(head->cell[k] * RVE_UNIT);
  RveSums sum;
  for (int k = 0; k < RVE_SUMS; k++) sum.all[k] = rve_set(0.0);
  for (int span = team->pack; span < n->blocks * RVE_PARTS; span += team->packs) {
    const int block = span / RVE_PARTS, part = span % RVE_PARTS * RVE_SPAN;
    const RveBody own = rve_own_body(all, a, span * RVE_SPAN);
    for (int row = a->slot_first[block]; row < a->slot_first[block + 1] && !flew; row++)
      if (!(head->approach < a->idle_until[row])) rve_sum_contact(ft, call, h, a, &own, row * RVE_PACK + part, &sum);
    rve_sum_grains(ft, head, a, span * RVE_SPAN, &own, flew, &sum);
  }
  RveTotals total;
  for (int k = 0; k < RVE_SUMS; k++) total.all[k] = rve_team_sum(team, sum.all[k]);
  if (team->leader) {
    RveAnswer fresh;
    memset(&fresh, 0, sizeof fresh); /* also its padding: answers are compared and stored as bytes */
    rve_fill_answer(ft, call, head, n, &total, work_before, duration, &fresh);
    if (rve_answer_is_finite(&fresh)) *answer = fresh;
    else head->failed = BASE_ERROR_UNSTABLE, answer->status = BASE_ERROR_UNSTABLE;
    head->apart = total.of.contacts == 0.0 && total.of.force == 0.0 && total.of.elastic == 0.0;
  }
  rve_sync();
}

#endif
