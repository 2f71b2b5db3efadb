/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The estimate: last stress, plus an isotropic elastic part with the affine modulus (TM-DEMPM eq. 58, an upper bound, so that
 * changes are rather over- than underestimated), plus rotation. How far it may go follows from how far it was off before. */
#include "rve_rest.h"

#include <math.h>
#include <string.h>

enum {
  CALM_NEEDED = 3,  /* evaluations in a row without surprise before a packing is believed to rest */
  LONGEST = 1000    /* calls: a packing is looked at now and then, whatever its point does */
};
static const double LEAST_DISTRUST = 0.1, LARGEST_UNBALANCED = 0.01, LARGEST_ROTATION = 1e-3,
                    LEAST_PRESSURE = 0.01;

static double mean_pressure(const double stress[6], int dimension) {
  return -(stress[0] + stress[1] + (dimension == 3 ? stress[2] : 0.0)) / dimension;
}

void rve_rest_wake(RveRest *rest, const RveScene *scene, const RveAnswer *answer, double temperature) {
  const double prepared =
      rest->prepared > 0.0 ? rest->prepared : fmax(0.0, mean_pressure(answer->stress, scene->dimension));
  *rest = (RveRest){.evaluated_temperature = temperature, .temperature = temperature, .distrust = 1.0,
                    .prepared = prepared};
  memcpy(rest->stress, answer->stress, sizeof rest->stress);
}

/* What errors of the stress are measured by, Pa. A packing that bears next to nothing need not be known better than the others. */
static double stress_scale(const RveRest *rest, const RveScene *scene, const RveAnswer *answer) {
  return fmax(mean_pressure(answer->stress, scene->dimension), LEAST_PRESSURE * rest->prepared);
}

/* Strain that has not been evaluated yet, as far as it changes forces: of the deformation, of the grains' expansion, and of what
 * bonds can bear (errata to eq. 40). */
static double open_strain(const RveRest *rest, const RveScene *scene, const double total[9], double temperature) {
  double square = 0.0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) square += pow(0.5 * (total[3 * i + j] + total[3 * j + i]), 2);
  double strain = sqrt(square);
  if (!scene->thermal) return strain;
  const double heating = fabs(temperature - rest->evaluated_temperature);
  strain += sqrt(scene->dimension) * scene->expansion * heating;
  if (scene->bonds && isfinite(scene->bond_melting_temperature))
    strain += scene->bond_strength * heating / fabs(scene->bond_melting_temperature - scene->reference_temperature);
  return strain;
}

/* sigma + C : (D dt - beta dT I) + W sigma - sigma W. C: all directions of contacts alike. */
static void estimate(const RveRest *rest, const RveScene *scene, const RveAnswer *last, const RveInput *input,
                     double duration, double stress[6]) {
  static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2}, voigt[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
  const int dimension = scene->dimension, flat = dimension == 2;
  const double ratio = scene->tangential_stiffness / scene->normal_stiffness;
  const double whole = 3.0 + (flat ? 1.0 : 2.0) * ratio, lambda = last->modulus * (1.0 - ratio) / whole;
  const double two_mu = last->modulus * (2.0 + (flat ? 2.0 : 3.0) * ratio) / whole;
  const double *L = input->velocity_gradient;
  const double expansion = scene->thermal ? scene->expansion * (input->temperature - rest->temperature) : 0.0;
  const double volumetric = duration * (L[0] + L[4] + (flat ? 0.0 : L[8])) - dimension * expansion;
  for (int k = 0; k < 6; k++) {
    const int i = row[k], j = column[k], is_flat_place = flat && (i == 2 || j == 2);
    double rate = 0.0;
    stress[k] = rest->stress[k];
    if (is_flat_place) continue;
    for (int l = 0; l < dimension; l++) {
      const double w_il = 0.5 * (L[3 * i + l] - L[3 * l + i]), w_lj = 0.5 * (L[3 * l + j] - L[3 * j + l]);
      rate += w_il * rest->stress[voigt[l][j]] - rest->stress[voigt[i][l]] * w_lj;
    }
    const double strain = 0.5 * duration * (L[3 * i + j] + L[3 * j + i]) - (i == j ? expansion : 0.0);
    stress[k] += two_mu * strain + (i == j ? lambda * volumetric : 0.0) + duration * rate;
  }
}

int rve_rest_skips(RveRest *rest, const RveScene *scene, const RveAnswer *last, double error, double duration,
                   RveInput *input) {
  if (duration <= 0.0 || (error <= 0.0 && rest->skipped == 0)) return 0;
  double total[9], stress[6];
  for (int k = 0; k < 9; k++) total[k] = rest->deformation[k] + duration * input->velocity_gradient[k];
  const double rotation =
      0.5 * fmax(fabs(total[1] - total[3]), fmax(fabs(total[2] - total[6]), fabs(total[5] - total[7])));
  const double scale = stress_scale(rest, scene, last), pressure = mean_pressure(last->stress, scene->dimension);
  estimate(rest, scene, last, input, duration, stress);
  memcpy(rest->stress, stress, sizeof stress);
  rest->temperature = input->temperature;
  rest->elastic = last->modulus * open_strain(rest, scene, total, input->temperature);
  if (rest->calm >= CALM_NEEDED && rest->skipped < LONGEST && last->coordination > 0.0 &&
      last->unbalanced * pressure <= LARGEST_UNBALANCED * scale && rotation <= LARGEST_ROTATION &&
      rest->distrust * rest->elastic <= error * scale) {
    memcpy(rest->deformation, total, sizeof total);
    rest->skipped++;
    return 1;
  }
  /* All that was skipped comes in this call; nothing skipped: not a bit changes. */
  for (int k = 0; k < 9 && rest->skipped > 0; k++) input->velocity_gradient[k] = total[k] / duration;
  return 0;
}

void rve_rest_judge(RveRest *rest, const RveScene *scene, const RveAnswer *answer, double error, double temperature) {
  double surprise = 0.0;
  for (int k = 0; k < 6; k++) surprise = fmax(surprise, fabs(answer->stress[k] - rest->stress[k]));
  const int met = surprise <= error * stress_scale(rest, scene, answer);
  const double shown = rest->elastic > 0.0 ? surprise / rest->elastic : 0.0;
  rest->distrust = fmin(1.0, fmax(LEAST_DISTRUST, fmax(shown, 0.5 * rest->distrust)));
  rest->calm = met ? rest->calm + 1 : 0;
  rest->skipped = 0;
  memset(rest->deformation, 0, sizeof rest->deformation);
  memcpy(rest->stress, answer->stress, sizeof rest->stress);
  rest->evaluated_temperature = rest->temperature = temperature;
}
