/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The critical DEM time step of a packing.
 *
 * Leapfrog whose dashpots lag half a step: a mode x is stable while dt^2 x'Kx + 2 dt x'Cx <= 4 x'Mx (its own Rayleigh quotients enter its
 * quadratic, so K and C need not commute). A contact strains b_i x_i - b_j x_j between two grains' displacements and rotations, so
 * x'Kx <= 2 sum_i x_i' K_ii x_i, and C likewise: it suffices that twice the largest eigenvalue of every single grain's block
 * dt^2 K_ii + 2 dt C_ii, neighbours held, is below 4 M_i. Without dashpots that gives W = 4 + 4r and 16r (square), 6 + 6r and
 * 24r (hexagonal; exact 6 + 2r for r < 1/3), 4 + 8r and 20r (simple cubic) of verification A: met exactly or from below.
 * Neighbours count from a gap of 5 % of the radii on, because grains arrange themselves anew; a grain with few neighbours is given a
 * square (cubic) surrounding of its equals. */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "rve_backend.h"

enum { MOTIONS = 6 }; /* 2D: x y and rotation about z use the first three */

/* Largest eigenvalue of a symmetric n x n matrix, by cyclic Jacobi rotations. Destroys a. */
static double largest_eigenvalue(int n, double a[MOTIONS][MOTIONS]) {
  for (int sweep = 0; sweep < 12; sweep++)
    for (int p = 0; p < n; p++)
      for (int q = p + 1; q < n; q++) {
        if (a[p][q] == 0.0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        const double t = (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
        const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < n; k++) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < n; k++) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
        }
      }
  double largest = a[0][0];
  for (int k = 1; k < n; k++) largest = fmax(largest, a[k][k]);
  return largest;
}

/* One contact's part of its grain's block, already divided by sqrt(mass or inertia) on both sides; r_over = R / sqrt(I/m). */
static void add_contact(int dim, const double n[3], double kn, double kt, double r_over, double block[MOTIONS][MOTIONS]) {
  const int spins = dim == 2 ? 1 : 3;
  double b[3][MOTIONS]; /* rows: tangential displacement components per motion */
  memset(b, 0, sizeof b);
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < dim; j++) b[i][j] = (i == j) - n[i] * n[j];
  const double cross[3][3] = {{0.0, n[2], -n[1]}, {-n[2], 0.0, n[0]}, {n[1], -n[0], 0.0}}; /* omega x n = cross omega */
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < spins; j++) b[i][dim + j] = r_over * cross[i][spins == 1 ? 2 : j];
  for (int p = 0; p < dim + spins; p++)
    for (int q = 0; q < dim + spins; q++) {
      for (int i = 0; i < dim; i++) block[p][q] += kt * b[i][p] * b[i][q];
      if (p < dim && q < dim) block[p][q] += kn * n[p] * n[q];
    }
}

/* Contacts of one grain. */
enum { MOST_CONTACTS = 256 }; /* a small grain among large ones has few, a large one among grains of 1/40 of its size 250 */
typedef struct Surrounding {
  int contacts;
  double normal[MOST_CONTACTS][3];
  double effective_mass[MOST_CONTACTS]; /* kg */
} Surrounding;

static double grain_mass(const RveScene *scene, double r) {
  const double pi = 3.14159265358979323846;
  return scene->density * (scene->grain == RVE_DISK ? pi * r * r * scene->thickness : 4.0 / 3.0 * pi * r * r * r);
}

static void add_neighbour(Surrounding *around, const double n[3], double effective_mass) {
  if (around->contacts == MOST_CONTACTS) return;
  memcpy(around->normal[around->contacts], n, 3 * sizeof *n);
  around->effective_mass[around->contacts++] = effective_mass;
}

/* Neighbours of grain i within 5 % of touching, through all images. */
static void find_neighbours(const RveScene *scene, const RvePacking *packing, const double inverse[9], int i, double radius_max,
                            Surrounding *around) {
  const int dim = scene->dimension;
  const double *h = packing->cell, reach = 1.05 * (packing->radius[i] + radius_max), mass = grain_mass(scene, packing->radius[i]);
  double window[3] = {0.0, 0.0, 0.0};
  for (int k = 0; k < dim; k++) window[k] = reach * sqrt(inverse[3 * k] * inverse[3 * k] + inverse[3 * k + 1] * inverse[3 * k + 1] +
                                                        inverse[3 * k + 2] * inverse[3 * k + 2]);
  for (int j = 0; j < packing->grains; j++) {
    double x[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < dim; k++) x[k] = packing->position[3 * j + k] - packing->position[3 * i + k];
    const double touch = 1.05 * (packing->radius[i] + packing->radius[j]);
    for (int px = (int)ceil(-window[0] - x[0]); px <= (int)floor(window[0] - x[0]); px++)
      for (int py = (int)ceil(-window[1] - x[1]); py <= (int)floor(window[1] - x[1]); py++)
        for (int pz = dim == 3 ? (int)ceil(-window[2] - x[2]) : 0; pz <= (dim == 3 ? (int)floor(window[2] - x[2]) : 0); pz++) {
          if (i == j && px == 0 && py == 0 && pz == 0) continue;
          double d[3] = {0.0, 0.0, 0.0};
          for (int k = 0; k < dim; k++)
            d[k] = h[3 * k] * (x[0] + px) + h[3 * k + 1] * (x[1] + py) + h[3 * k + 2] * (x[2] + pz);
          const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
          if (!(length < touch && length > 0.0)) continue;
          const double n[3] = {d[0] / length, d[1] / length, d[2] / length}, other = grain_mass(scene, packing->radius[j]);
          add_neighbour(around, n, mass * other / (mass + other));
        }
  }
  if (around->contacts >= 2 * dim) return;
  around->contacts = 0;
  for (int k = 0; k < dim; k++) {
    double n[3] = {0.0, 0.0, 0.0};
    n[k] = 1.0;
    for (int side = 0; side < 2; side++, n[k] = -n[k]) add_neighbour(around, n, 0.5 * mass);
  }
}

/* Twice the largest eigenvalue of dt^2 K_ii + 2 dt C_ii, over 4 m: above 1 is unstable. */
static double grain_excess(const RveScene *scene, const Surrounding *around, double mass, double dt) {
  const double r_over = scene->rotation ? 1.0 / sqrt(scene->grain == RVE_DISK ? 0.5 : 0.4) : 0.0;
  double block[MOTIONS][MOTIONS];
  memset(block, 0, sizeof block);
  for (int c = 0; c < around->contacts; c++) {
    const double m = around->effective_mass[c];
    const double cn = scene->normal_viscosity * m + 2.0 * scene->critical_damping * sqrt(m * scene->normal_stiffness);
    const double ct = scene->tangential_stiffness > 0.0 ? scene->tangential_viscosity * m : 0.0;
    add_contact(scene->dimension, around->normal[c], dt * (dt * scene->normal_stiffness + 2.0 * cn),
                dt * (dt * scene->tangential_stiffness + 2.0 * ct), r_over, block);
  }
  return 0.5 * largest_eigenvalue(scene->dimension == 2 ? 3 : 6, block) / mass;
}

double rve_critical_time_step(const RveScene *scene, const RvePacking *packing) {
  double inverse[9], radius_max = 0.0, critical = HUGE_VAL;
  tensor_inverse(packing->cell, inverse);
  for (int i = 0; i < packing->grains; i++) radius_max = fmax(radius_max, packing->radius[i]);
  for (int i = 0; i < packing->grains; i++) {
    const double mass = grain_mass(scene, packing->radius[i]);
    Surrounding around;
    around.contacts = 0;
    find_neighbours(scene, packing, inverse, i, radius_max, &around);
    if (critical == HUGE_VAL) critical = 2.0 * sqrt(mass / scene->normal_stiffness); /* no block is softer than one contact */
    double high = critical, low = 0.0;
    if (grain_excess(scene, &around, mass, high) <= 1.0) continue;
    for (int round = 0; round < 60 && high - low > 1e-14 * high; round++) {
      const double middle = 0.5 * (low + high);
      if (grain_excess(scene, &around, mass, middle) <= 1.0) low = middle;
      else high = middle;
    }
    critical = low;
  }
  return critical;
}
