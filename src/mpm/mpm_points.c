/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The core's own arrays of points: growth, order by (cell, tag), copies in that order. */
#include <math.h>
#include <string.h>

#include "mpm_core.h"

static BaseStatus grow_sorted(Mpm *mpm, size_t old, size_t room) {
  MpmPoints *p = &mpm->points;
  const MpmScene *scene = &mpm->scene;
  TRY(BASE_GROW(old, room, &p->item)); /* the last order is worth keeping: see mpm_points_sort */
  TRY(BASE_GROW(0, room, &p->spare));
  TRY(BASE_GROW(0, room, &p->mover));
  TRY(BASE_GROW(0, room, &p->place));
  TRY(BASE_GROW(0, room, &p->motion));
  if (scene->shape == MPM_SHAPE_GIMP) TRY(BASE_GROW(0, room, &p->half));
  if (scene->transfer == MPM_TRANSFER_APIC) TRY(BASE_GROW(0, room, &p->affine));
  if (scene->thermal) TRY(BASE_GROW(0, room, &p->heat));
  if (scene->transfer == MPM_TRANSFER_XPIC) TRY(BASE_GROW(0, room, &p->gathered));
  return BASE_OK;
}

static BaseStatus grow_slots(Mpm *mpm, size_t room) {
  MpmPoints *p = &mpm->points;
  MpmLawBatch *batch = &p->batch;
  TRY(BASE_GROW(0, room, &p->cell));
  TRY(BASE_GROW(0, room, &p->placed));
  TRY(BASE_GROW(0, room * (size_t)mpm_load_width(mpm), &p->load));
  TRY(BASE_GROW(0, 12 * room, &p->carry));
  TRY(BASE_GROW(0, room, &p->law_tag));
  TRY(BASE_GROW(0, 9 * room, &p->law_velocity_gradient));
  TRY(BASE_GROW(0, 9 * room, &p->law_deformation_gradient));
  TRY(BASE_GROW(0, 6 * room, &batch->stress));
  TRY(BASE_GROW(0, room, &batch->modulus));
  TRY(BASE_GROW(0, MPM_LAW_SCALARS * room, &batch->scalars));
  if (mpm->scene.thermal || mpm->law->thermal) {
    TRY(BASE_GROW(0, room, &p->law_temperature));
    TRY(BASE_GROW(0, room, &p->law_temperature_rate));
    TRY(BASE_GROW(0, room, &batch->heat));
    TRY(BASE_GROW(0, 6 * room, &batch->conductivity));
  }
  batch->tag = p->law_tag;
  batch->velocity_gradient = p->law_velocity_gradient;
  batch->deformation_gradient = p->law_deformation_gradient;
  batch->temperature = p->law_temperature;
  batch->temperature_rate = p->law_temperature_rate;
  return BASE_OK;
}

BaseStatus mpm_points_reserve(Mpm *mpm, int count) {
  MpmPoints *p = &mpm->points;
  if (count <= p->room) return BASE_OK;
  const size_t old = (size_t)p->room, room = (size_t)count + (size_t)count / 4 + 16;
  TRY(grow_sorted(mpm, old, room));
  TRY(grow_slots(mpm, room));
  p->room = (int)room;
  return BASE_OK;
}

void mpm_points_free(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  void *const memory[] = {p->item, p->spare, p->mover, p->cell, p->placed, p->place, p->motion, p->half, p->affine,
                          p->heat, p->load, p->carry, p->gathered, p->law_tag, p->law_velocity_gradient,
                          p->law_deformation_gradient, p->law_temperature, p->law_temperature_rate,
                          p->batch.stress, p->batch.heat, p->batch.conductivity,
                          p->batch.modulus, p->batch.scalars};
  for (size_t k = 0; k < sizeof memory / sizeof *memory; k++) base_free(memory[k]);
  memset(p, 0, sizeof *p);
}

/* Half of the point's domain over h. Clamped: size0 may exceed the spacing by round-off. A domain that follows the
 * stretch has the length of F's row, weighted by the edges: right for any stretch along the axes, and the same after a
 * rotation. */
static double half_edge(const Mpm *mpm, const MpmPoint *point, int axis) {
  double half = 0.5 * point->size0[axis] * mpm->inverse_spacing;
  if (mpm->scene.gimp_stretch) {
    double square = 0.0;
    for (int j = 0; j < mpm->scene.dimension; j++) {
      const double edge = point->deformation_gradient[3 * axis + j] * point->size0[j];
      square += edge * edge;
    }
    half = fmax(0.5 * sqrt(square) * mpm->inverse_spacing, 1e-6);
  }
  return half < 0.5 ? half : 0.5;
}

static double grid_coordinate(const Mpm *mpm, const MpmPoint *point, int axis) {
  return (point->position[axis] - mpm->scene.origin[axis]) * mpm->inverse_spacing;
}

/* What is wrong with the constants of a point, or NULL. */
static const char *find_argument_fault(const Mpm *mpm, const MpmPoint *point) {
  if (point->tag <= 0) return "tag must be > 0";
  if (!(point->mass > 0.0 && point->mass < INFINITY)) return "mass must be finite and > 0";
  if (!(point->volume0 > 0.0 && point->volume0 < INFINITY)) return "volume0 must be finite and > 0";
  if (mpm->scene.thermal && !(point->heat_capacity > 0.0 && point->heat_capacity < INFINITY))
    return "heat_capacity must be finite and > 0";
  for (int i = 0; i < mpm->scene.dimension; i++)
    if (mpm->scene.shape == MPM_SHAPE_GIMP &&
        !(point->size0[i] > 0.0 && point->size0[i] * mpm->inverse_spacing <= 1.0 + 1e-9))
      return "size0 must be > 0 and at most the grid's spacing (uGIMP)";
  return NULL;
}

/* What is not finite in the state of a point, or NULL. */
static const char *find_state_fault(const Mpm *mpm, const MpmPoint *point) {
  for (int i = 0; i < mpm->scene.dimension; i++) {
    if (!isfinite(point->position[i])) return "position is not finite";
    if (!isfinite(point->velocity[i])) return "velocity is not finite";
    if (!isfinite(point->force[i])) return "force is not finite";
  }
  if (!mpm->scene.thermal) return NULL;
  if (!isfinite(point->temperature)) return "temperature is not finite";
  if (!isfinite(point->heat_external)) return "external heat is not finite";
  return NULL;
}

/* The key of the first node of the point's support; 0 if the point is not usable. */
static uint64_t find_cell(Mpm *mpm, const MpmPoint *point) {
  const char *fault = find_argument_fault(mpm, point);
  const BaseStatus status = fault ? BASE_ERROR_ARGUMENT : BASE_ERROR_UNSTABLE;
  if (!fault) fault = find_state_fault(mpm, point);
  if (fault) {
    mpm_note_point(mpm, status, point->tag, fault);
    return 0;
  }
  uint64_t key = 0;
  for (int i = mpm->scene.dimension - 1; i >= 0; i--) {
    const double u = grid_coordinate(mpm, point, i);
    const double base = floor(mpm_shape_anchor(mpm->scene.shape, u, half_edge(mpm, point, i)));
    if (!(fabs(base) < MPM_KEY_BIAS - 8)) {
      mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag,
                     "position is more than 1,000,000 cells away from the grid's origin");
      return 0;
    }
    key = key << MPM_KEY_BITS | (uint64_t)((int)base + MPM_KEY_BIAS);
  }
  return key;
}

static int precedes(const MpmItem *a, const MpmItem *b) {
  if (a->cell != b->cell) return a->cell < b->cell;
  if (a->tag != b->tag) return a->tag < b->tag;
  return a->slot < b->slot;
}

static void insertion_sort(MpmItem *item, int n) {
  for (int i = 1; i < n; i++) {
    const MpmItem moving = item[i];
    int j = i;
    for (; j > 0 && precedes(&moving, &item[j - 1]); j--) item[j] = item[j - 1];
    item[j] = moving;
  }
}

/* Merges sorted a [na] and b [nb] into out [na + nb]. */
static void merge(const MpmItem *a, int na, const MpmItem *b, int nb, MpmItem *out) {
  int i = 0, j = 0;
  while (i < na && j < nb) *out++ = precedes(&b[j], &a[i]) ? b[j++] : a[i++];
  while (i < na) *out++ = a[i++];
  while (j < nb) *out++ = b[j++];
}

/* Sorts *item [n]; *spare is memory of the same size. The two may change places. */
static void merge_sort(MpmItem **item, MpmItem **spare, int n) {
  enum { RUN = 16 };
  for (int i = 0; i < n; i += RUN) insertion_sort(*item + i, n - i < RUN ? n - i : RUN);
  for (int64_t run = RUN; run < n; run *= 2) {
    for (int64_t i = 0; i < n; i += 2 * run) {
      const int na = (int)(n - i < run ? n - i : run);
      const int nb = (int)(n - i - na < run ? n - i - na : run);
      merge(*item + i, na, *item + i + na, nb, *spare + i);
    }
    MpmItem *swap = *item;
    *item = *spare, *spare = swap;
  }
}

/* Keeps the lines of the last list whose point is still in its cell, in place. Returns their number. */
static int keep_placed(Mpm *mpm, const MpmPoint *own) {
  MpmPoints *p = &mpm->points;
  int kept = 0;
  memset(p->placed, 0, (size_t)(p->own + p->foreign));
  for (int k = 0; k < p->items; k++) {
    MpmItem line = p->item[k];
    const int is_own = line.slot < p->items_own;
    const int index = is_own ? line.slot : line.slot - p->items_own;
    if (index >= (is_own ? p->own : p->foreign)) continue;
    line.slot = is_own ? index : p->own + index;
    if (p->cell[line.slot] != line.cell || mpm_slot_point(mpm, own, line.slot)->tag != line.tag) continue;
    p->placed[line.slot] = 1;
    p->item[kept++] = line;
  }
  return kept;
}

/* The same tag twice in one cell would make the order of sums ambiguous. */
static BaseStatus check_unique(const MpmPoints *p, int count) {
  for (int k = 1; k < count; k++)
    if (p->item[k].cell == p->item[k - 1].cell && p->item[k].tag == p->item[k - 1].tag)
      return base_error(BASE_ERROR_ARGUMENT, "point %lld: its tag occurs twice; tags must be unique",
                        (long long)p->item[k].tag);
  return BASE_OK;
}

/* Few points change their cell in a step: only those are sorted, then merged with the rest. */
BaseStatus mpm_points_sort(Mpm *mpm, const MpmPoint *own) {
  MpmPoints *p = &mpm->points;
  const int count = p->own + p->foreign;
#pragma omp parallel for num_threads(mpm->threads) if (count > MPM_PARALLEL_POINTS)
  for (int s = 0; s < count; s++) p->cell[s] = find_cell(mpm, mpm_slot_point(mpm, own, s));

  const int kept = keep_placed(mpm, own);
  p->items = 0; /* until the list is whole again */
  int movers = 0;
  for (int s = 0; s < count; s++)
    if (!p->placed[s]) p->mover[movers++] = (MpmItem){p->cell[s], mpm_slot_point(mpm, own, s)->tag, s};
  if (movers > 0) {
    merge_sort(&p->mover, &p->spare, movers);
    merge(p->item, kept, p->mover, movers, p->spare);
    MpmItem *swap = p->item;
    p->item = p->spare, p->spare = swap;
  }
  TRY(check_unique(p, count));
  p->items = count;
  p->items_own = p->own;
  return BASE_OK;
}

enum { AHEAD = 8 /* points ahead in the sorted order that are fetched */ };

void mpm_points_load(Mpm *mpm, const MpmPoint *own) {
  MpmPoints *p = &mpm->points;
  const MpmScene *scene = &mpm->scene;
  const int has_z = scene->dimension == 3;
#pragma omp parallel for num_threads(mpm->threads) if (p->count > MPM_PARALLEL_POINTS)
  for (int k = 0; k < p->count; k++) {
    const MpmPoint *point = mpm_slot_point(mpm, own, p->item[k].slot);
    if (k + AHEAD < p->count) {
      const char *next = (const char *)mpm_slot_point(mpm, own, p->item[k + AHEAD].slot);
      __builtin_prefetch(next);
      __builtin_prefetch(next + 64);
      __builtin_prefetch(next + 128);
    }
    for (int i = 0; i < scene->dimension; i++) p->place[k][i] = grid_coordinate(mpm, point, i);
    p->place[k][3] = point->mass;
    p->motion[k] = (MpmVec){1.0, point->velocity[0], point->velocity[1], has_z ? point->velocity[2] : 0.0};
    if (scene->shape == MPM_SHAPE_GIMP)
      for (int i = 0; i < scene->dimension; i++) p->half[k][i] = half_edge(mpm, point, i);
    if (scene->transfer == MPM_TRANSFER_APIC) memcpy(p->affine[k], point->affine, sizeof point->affine);
    if (scene->thermal) {
      p->heat[k][0] = point->mass * point->heat_capacity;
      p->heat[k][1] = p->heat[k][0] * point->temperature;
    }
  }
}
