/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_conduction.h"

#include <math.h>
#include <string.h>

#include "rve_contacts.h"
#include "rve_packing_pairs.h"

static int has_pipes(const RveScene *scene) {
  return scene->conduction.direct == GRAIN_DIRECT_NONE && scene->conduction.indirect == GRAIN_INDIRECT_NONE;
}

int rve_conduction_is_own(const RveScene *scene) {
  return scene->thermal && (!has_pipes(scene) || scene->network || scene->conductivity_every > 1);
}

int rve_conduction_is_same(const RveScene *a, const RveScene *b) {
  const GrainHeat *x = &a->conduction, *y = &b->conduction;
  if (a->network != b->network || a->conductivity_every != b->conductivity_every || has_pipes(a) != has_pipes(b)) return 0;
  if (a->network && a->network_change != b->network_change) return 0;
  if (has_pipes(a)) return a->pipe_resistance == b->pipe_resistance;
  return a->grain_conductivity == b->grain_conductivity && x->area == y->area && x->direct == y->direct &&
         x->indirect == y->indirect && x->fluid == y->fluid && x->porosity == y->porosity && x->core == y->core &&
         x->layer == y->layer && x->minimum_gap == y->minimum_gap && x->reach == y->reach;
}

void rve_conduction_forget(RveConduction *conduction) {
  memset(conduction, 0, sizeof *conduction);
  conduction->age = -1;
}

/* ---------------------------------------------------------------------------------------------------------- links */

static double pair_conductance(const RveScene *scene, double r1, double r2, double distance) {
  const GrainPair pair = {{r1, r2}, {scene->grain_conductivity, scene->grain_conductivity}, distance};
  return grain_heat_conductance(&scene->conduction, &pair);
}

/* Contacts and bonds, in the order of the list. */
static BaseStatus gather_contacts(const RveRecord *record, const RveScene *scene, RveNetwork *network) {
  const RveArrays *a = &record->arrays;
  const int pipes = has_pipes(scene);
  RveSlot slot;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);) {
    if (!(slot.overlap > 0.0 || (*slot.image_word & RVE_IMAGE_BOND))) continue;
    RveLink link = {{a->id[slot.i], a->id[slot.j]}, {slot.branch[0], slot.branch[1], slot.branch[2]}, 0.0};
    link.conductance = pipes ? 1.0 / (scene->pipe_resistance * slot.length)
                             : pair_conductance(scene, a->radius[slot.i], a->radius[slot.j], slot.length);
    if (link.conductance > 0.0) TRY(rve_network_add(network, &link));
  }
  return BASE_OK;
}

typedef struct Gathering {
  const RveScene *scene;
  const RvePacking *packing;
  RveNetwork *network;
} Gathering;

static BaseStatus gather_pair(void *context, int i, int j, const int image[3], const double branch[3], double distance) {
  const Gathering *to = context;
  const double *radius = to->packing->radius;
  RveLink link = {{i, j}, {branch[0], branch[1], branch[2]}, pair_conductance(to->scene, radius[i], radius[j], distance)};
  (void)image;
  if (to->scene->dimension == 2) link.branch[2] = 0.0;
  return link.conductance > 0.0 ? rve_network_add(to->network, &link) : BASE_OK;
}

/* All pairs within the model's reach: the neighbour list of the contacts knows them only up to its skin. */
static BaseStatus gather_near(const RveRecord *record, const RveScene *scene, RveNetwork *network) {
  RvePacking packing;
  TRY(rve_record_packing(record, &packing));
  const double scale = rve_head(record->arena)->scale;
  for (int i = 0; i < packing.grains; i++) packing.radius[i] *= scale;
  Gathering to = {scene, &packing, network};
  const double reach = grain_heat_reach(&scene->conduction, packing_largest_radius(&packing));
  const BaseStatus status = packing_visit_pairs(&packing, reach, gather_pair, &to);
  rve_packing_destroy(&packing);
  return status;
}

static BaseStatus gather(const RveRecord *record, const RveScene *scene, RveNetwork *network) {
  network->links = 0;
  return scene->conduction.indirect == GRAIN_INDIRECT_NONE ? gather_contacts(record, scene, network)
                                                           : gather_near(record, scene, network);
}

/* ------------------------------------------------------------------------------------------ from solution to solution */

static void full(const double k[6], double a[3][3]) {
  a[0][0] = k[0], a[1][1] = k[1], a[2][2] = k[2];
  a[0][1] = a[1][0] = k[3], a[0][2] = a[2][0] = k[4], a[1][2] = a[2][1] = k[5];
}

/* k = l l^T, l lower triangular; 0 if a direction does not conduct. */
static int factorise(int dimension, const double k[6], double l[3][3]) {
  double a[3][3], trace = 0.0;
  full(k, a);
  memset(l, 0, 9 * sizeof l[0][0]);
  for (int i = 0; i < dimension; i++) trace += a[i][i];
  for (int i = 0; i < dimension; i++)
    for (int j = 0; j <= i; j++) {
      double sum = a[i][j];
      for (int m = 0; m < j; m++) sum -= l[i][m] * l[j][m];
      if (i == j && !(sum > 1e-9 * trace)) return 0;
      l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
    }
  return 1;
}

/* What the network's k has become since it was solved, if in the frame in which the affine k is the unit tensor it has not
 * changed: m k_solved m^T, m the triangular map that makes the affine k of then that of now. It stays below the affine k, and
 * is exact while the packing deforms affinely as a crystal does. 0 if there is no such map. */
static int carry(int dimension, const RveConduction *conduction, const double affine[6], double k[6]) {
  double then[3][3], now[3][3], solved[3][3], map[3][3] = {{0.0}}, half[3][3] = {{0.0}}, result[3][3] = {{0.0}};
  if (!factorise(dimension, conduction->solved_affine, then) || !factorise(dimension, affine, now)) return 0;
  full(conduction->solved_network, solved);
  for (int i = 0; i < dimension; i++)
    for (int j = i; j >= 0; j--) {
      double sum = now[i][j];
      for (int m = j + 1; m <= i; m++) sum -= map[i][m] * then[m][j];
      map[i][j] = sum / then[j][j];
    }
  for (int i = 0; i < dimension; i++)
    for (int j = 0; j < dimension; j++)
      for (int m = 0; m <= i; m++) half[i][j] += map[i][m] * solved[m][j];
  for (int i = 0; i < dimension; i++)
    for (int j = 0; j < dimension; j++)
      for (int m = 0; m <= j; m++) result[i][j] += half[i][m] * map[j][m];
  const double packed[6] = {result[0][0], result[1][1], result[2][2], result[1][0], result[2][0], result[2][1]};
  memcpy(k, packed, sizeof packed);
  return 1;
}

/* |a - b| over |b|, of tensors. */
static double relative_change(const double a[6], const double b[6]) {
  double apart = 0.0, size = 0.0;
  for (int m = 0; m < 6; m++) {
    const double weight = m < 3 ? 1.0 : 2.0;
    apart += weight * (a[m] - b[m]) * (a[m] - b[m]), size += weight * b[m] * b[m];
  }
  return apart > 0.0 ? sqrt(apart / size) : 0.0;
}

/* Whether the last solution still serves; then *k. */
static int keeps_solution(const RveScene *scene, const RveConduction *conduction, const double affine[6], double k[6]) {
  const double allowed = scene->network_change;
  return conduction->has_solution && conduction->path <= allowed &&
         relative_change(affine, conduction->solved_affine) <= allowed && carry(scene->dimension, conduction, affine, k);
}

static BaseStatus work_out(RveRecord *record, const RveScene *scene, RveConductionWork *work) {
  RveConduction *conduction = &record->conduction;
  const double volume = record->last.volume;
  int gathered = !has_pipes(scene);
  if (gathered) {
    TRY(gather(record, scene, &work->network));
    rve_network_affine(&work->network, scene->dimension, volume, conduction->affine);
  } else memcpy(conduction->affine, record->last.conductivity, sizeof conduction->affine);
  memcpy(conduction->tensor, conduction->affine, sizeof conduction->tensor);
  if (!scene->network) return BASE_OK;
  if (keeps_solution(scene, conduction, conduction->affine, conduction->tensor)) {
    work->kept++;
    return BASE_OK;
  }
  if (!gathered) TRY(gather(record, scene, &work->network));
  TRY(rve_network_solve(&work->network, record->counts.grains, scene->dimension, volume, conduction->tensor));
  memcpy(conduction->solved_affine, conduction->affine, sizeof conduction->affine);
  memcpy(conduction->solved_network, conduction->tensor, sizeof conduction->tensor);
  conduction->has_solution = 1;
  conduction->path = 0.0;
  work->solved++;
  return BASE_OK;
}

BaseStatus rve_conduction_answer(RveRecord *record, const RveScene *scene, const RveInput *input, double duration,
                                 RveConductionWork *work) {
  RveConduction *conduction = &record->conduction;
  RveAnswer *last = &record->last;
  if (!rve_conduction_is_own(scene)) {
    memcpy(last->conductivity_affine, last->conductivity, sizeof last->conductivity);
    return BASE_OK;
  }
  double square = 0.0;
  for (int k = 0; k < 9; k++) square += input->velocity_gradient[k] * input->velocity_gradient[k];
  conduction->path += sqrt(square) * duration;
  if (conduction->age >= 0 && duration > 0.0) conduction->age++;
  if (conduction->age < 0 || conduction->age >= scene->conductivity_every) {
    TRY(work_out(record, scene, work));
    conduction->age = 0;
  }
  memcpy(last->conductivity, conduction->tensor, sizeof conduction->tensor);
  memcpy(last->conductivity_affine, conduction->affine, sizeof conduction->affine);
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------- conduction in the RVE */

typedef struct Conductor {
  RveNetwork network;
  double *capacity, *outflow; /* [grains] J/K; W */
} Conductor;

/* limit: the largest stable time step, s. */
static BaseStatus conductor_create(const RveRecord *record, const RveScene *scene, Conductor *conductor, double *limit) {
  const RveArrays *a = &record->arrays;
  const int grains = record->counts.grains;
  memset(conductor, 0, sizeof *conductor);
  TRY(gather(record, scene, &conductor->network));
  TRY(BASE_ALLOC((size_t)grains, &conductor->capacity));
  TRY(BASE_ALLOC((size_t)grains, &conductor->outflow));
  for (int l = 0; l < conductor->network.links; l++) {
    const RveLink *link = &conductor->network.link[l];
    for (int side = 0; side < 2 && link->pair[0] != link->pair[1]; side++)
      conductor->outflow[link->pair[side]] += link->conductance;
  }
  *limit = INFINITY;
  for (int q = 0; q < grains; q++) {
    const int i = a->id[q];
    conductor->capacity[i] = a->mass[q] * scene->grain_heat_capacity;
    if (conductor->outflow[i] > 0.0) *limit = fmin(*limit, conductor->capacity[i] / conductor->outflow[i]);
  }
  return BASE_OK;
}

static void conductor_destroy(Conductor *conductor) {
  rve_network_destroy(&conductor->network);
  base_free(conductor->capacity), base_free(conductor->outflow);
}

static void conductor_step(const Conductor *conductor, int grains, double dt, double *temperature) {
  memset(conductor->outflow, 0, (size_t)grains * sizeof *conductor->outflow);
  for (int l = 0; l < conductor->network.links; l++) {
    const RveLink *link = &conductor->network.link[l];
    const int i = link->pair[0], j = link->pair[1];
    const double q = link->conductance * (temperature[i] - temperature[j]);
    conductor->outflow[i] += q, conductor->outflow[j] -= q;
  }
  for (int i = 0; i < grains; i++) temperature[i] -= dt * conductor->outflow[i] / conductor->capacity[i];
}

BaseStatus rve_record_conduct(const RveRecord *record, const RveScene *scene, double time_step, int64_t steps,
                              double *temperature) {
  Conductor conductor;
  double limit;
  if (!scene->thermal) return base_error(BASE_ERROR_ARGUMENT, "thermal = 0 (allowed: thermal scenes)");
  if (!(scene->grain_heat_capacity > 0.0))
    return base_error(BASE_ERROR_ARGUMENT, "grain_heat_capacity = %g (allowed: > 0)", scene->grain_heat_capacity);
  if (!(time_step > 0.0) || steps < 0)
    return base_error(BASE_ERROR_ARGUMENT, "time_step = %g, steps = %lld (allowed: > 0, >= 0)", time_step,
                      (long long)steps);
  BaseStatus status = conductor_create(record, scene, &conductor, &limit);
  if (status == BASE_OK && time_step > limit)
    status =
        base_error(BASE_ERROR_ARGUMENT, "time_step = %g s (allowed: at most min m c / sum h = %g s)", time_step, limit);
  if (status == BASE_OK)
    for (int64_t k = 0; k < steps; k++) conductor_step(&conductor, record->counts.grains, time_step, temperature);
  conductor_destroy(&conductor);
  return status;
}
