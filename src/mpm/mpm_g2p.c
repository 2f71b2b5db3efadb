/* SPDX-License-Identifier: GPL-2.0-or-later */
/* G2P: gradients for the law, new velocity and position. Each own row is written by one thread only, in any order. */
#include <math.h>
#include <string.h>

#include "mpm_kernel.h"

/* Cells in chunks, for threads. */
static int chunk_end(const Mpm *mpm, int chunk) {
  return (chunk + 1) * MPM_CHUNK < mpm->grid.cells ? (chunk + 1) * MPM_CHUNK : mpm->grid.cells;
}
#define FOR_CHUNKS(mpm, call)                                                                                    \
  mpm_share_start(mpm);                                                                                          \
  _Pragma("omp parallel num_threads((mpm)->threads) if (mpm_is_parallel(mpm))")                                  \
  for (int q; (q = mpm_share_next(mpm, MPM_SHARE_CHUNKS)) >= 0;) {                                               \
    const int first = q * MPM_CHUNK, end = chunk_end(mpm, q);                                                    \
    call;                                                                                                        \
  }

/* --------------------------------------------------------------------------------------------------- gradients */

MPM_INLINE void velocity_gradient_row(Mpm *mpm, int k, const int *row, const MpmWeights *w, int dimension, int width) {
  double *const *result = mpm->points.velocity_gradient;
  if (dimension == 2) {
    const MpmVec per_length = __builtin_shufflevector(mpm->per_length, mpm->per_length, 1, 1, 2, 2);
    const MpmVec rate = per_length * mpm_gather_plane(mpm->grid.state, row, w, width);
    result[0][k] = rate[0], result[1][k] = rate[2], result[3][k] = rate[1], result[4][k] = rate[3];
    return;
  }
  MpmVec gradient[3];
  mpm_gather_gradient(mpm->grid.state, row, w, w->slope, dimension, width, gradient);
  for (int j = 0; j < 3; j++) {
    gradient[j] *= mpm->per_length[1 + j];
    for (int i = 0; i < 3; i++) result[3 * i + j][k] = gradient[j][1 + i];
  }
}

MPM_INLINE void temperature_gradient_row(Mpm *mpm, int k, const int *row, const MpmWeights *w, int dimension, int width) {
  double *result = mpm->points.home[mpm->points.slot[k]].temperature_gradient;
  MpmVec gradient[3];
  mpm_gather_gradient(mpm->grid.state, row, w, w->slope, dimension, width, gradient);
  for (int j = 0; j < 3; j++) result[j] = j < dimension ? mpm->per_length[1 + j] * gradient[j][0] : 0.0;
}

MPM_INLINE void gradient_body(Mpm *mpm, int first, int end, int of_temperature, int dimension, MpmShape shape) {
  const MpmGrid *grid = &mpm->grid;
  const int width = mpm_shape_width(shape);
  for (int cell = first; cell < end; cell++) {
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      MpmWeights w;
      mpm_find_weights(mpm, k, &base, shape, &w);
      if (of_temperature) temperature_gradient_row(mpm, k, grid->cell_row[cell], &w, dimension, width);
      else velocity_gradient_row(mpm, k, grid->cell_row[cell], &w, dimension, width);
    }
  }
}

MPM_CLONES static void temperature_gradient_cells(Mpm *mpm, int first, int end) {
  MPM_SPECIALISE(mpm, gradient_body, mpm, first, end, 1)
}
MPM_CLONES void mpm_g2p_velocity_gradient_cells(Mpm *mpm, int first, int end) {
  MPM_SPECIALISE(mpm, gradient_body, mpm, first, end, 0)
}

void mpm_g2p_temperature_gradient(Mpm *mpm) { FOR_CHUNKS(mpm, temperature_gradient_cells(mpm, first, end)) }
void mpm_g2p_velocity_gradient(Mpm *mpm) { FOR_CHUNKS(mpm, mpm_g2p_velocity_gradient_cells(mpm, first, end)) }

/* ------------------------------------------------------------------------------------------------- XPIC's field */

MPM_INLINE void velocity_body(Mpm *mpm, const MpmVec *field, int first, int end, int dimension, MpmShape shape) {
  const MpmGrid *grid = &mpm->grid;
  for (int cell = first; cell < end; cell++) {
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      MpmWeights w;
      mpm_find_weights(mpm, k, &base, shape, &w);
      MpmVec value = mpm_gather_value(field, grid->cell_row[cell], &w, dimension, mpm_shape_width(shape));
      value[0] = 1.0;
      mpm->points.gathered[k] = value;
    }
  }
}

MPM_CLONES static void velocity_cells(Mpm *mpm, const MpmVec *field, int first, int end) {
  MPM_SPECIALISE(mpm, velocity_body, mpm, field, first, end)
}

void mpm_g2p_velocity(Mpm *mpm, const MpmVec *field) { FOR_CHUNKS(mpm, velocity_cells(mpm, field, first, end)) }

/* ------------------------------------------------------------------------------------------------------ update */

/* Velocity and position from Sv = sum S v_I, Sa = sum S a_I, and for XPIC Sv* (TM-DEMPM eq. 26-27 corrected: damping
 * rates in 1/s; the position moves by dt Sv + dt/2 times the change of the point's velocity, so uniform motion is
 * exact). APIC moves with the updated grid velocity. Lanes 0 keep mass and 1. */
MPM_INLINE void update_motion(Mpm *mpm, int k, MpmVec sv, MpmVec sa, MpmVec extended) {
  const MpmScene *scene = &mpm->scene;
  MpmPoints *p = &mpm->points;
  const double dt = mpm->dt;
  const MpmMask axes = {0, -1, -1, -1};
  const MpmVec old = p->motion[k], place = p->position[k];
  const MpmVec damping = dt * (scene->point_damping * old + scene->grid_damping * sv);
  MpmVec velocity, position;
  if (scene->transfer == MPM_TRANSFER_FLIP) velocity = old + dt * sa - scene->pic_fraction * (old - sv) - damping;
  else if (scene->transfer == MPM_TRANSFER_APIC) velocity = sv + dt * sa - damping;
  else velocity = extended + dt * sa - damping;
  if (scene->transfer == MPM_TRANSFER_APIC) position = place + dt * (sv + dt * sa);
  else position = place + (dt * sv + 0.5 * dt * (velocity - old));
  p->motion[k] = mpm_vec_select(axes, velocity, old), p->position[k] = mpm_vec_select(axes, position, place);
  if (p->old_position) p->old_position[k] = place;
}

MPM_INLINE void update_affine(const Mpm *mpm, int k, const int *row, const MpmWeights *w, int dimension,
                              MpmShape shape) {
  const int width = mpm_shape_width(shape);
  double *affine = mpm->points.affine[k];
  MpmVec slope[MPM_WIDTH_MAX], before[3], change[3];
  for (int i = 0; i < dimension; i++) {
    double value[MPM_WIDTH_MAX], of_axis[MPM_WIDTH_MAX];
    for (int a = 0; a < width; a++) value[a] = w->value[a][1 + i];
    mpm_shape_affine(shape, w->f[1 + i], value, of_axis);
    for (int a = 0; a < width; a++) slope[a][1 + i] = of_axis[a];
  }
  mpm_gather_gradient(mpm->grid.state, row, w, slope, dimension, width, before);
  mpm_gather_gradient(mpm->grid.rate, row, w, slope, dimension, width, change);
  for (int i = 0; i < dimension; i++)
    for (int j = 0; j < dimension; j++)
      affine[3 * i + j] = mpm->per_length[1 + j] * (before[j][1 + i] + mpm->dt * change[j][1 + i]);
}

/* Eq. 28 and 29. */
static void update_temperature(Mpm *mpm, int k, double mapped, double rate) {
  MpmPoint *point = &mpm->points.home[mpm->points.slot[k]];
  if (mpm->heat_duration >= 0.0) { /* mpm_heat_carry() does the rest */
    point->temperature_mapped = mapped;
    point->temperature_rate = rate;
    return;
  }
  point->temperature += mpm->dt * rate;
  point->temperature_mapped = mapped + mpm->dt * rate;
  if (!isfinite(point->temperature)) mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag, "temperature is not finite");
}

static void note_faults(Mpm *mpm, int first, int end) {
  const MpmPoints *p = &mpm->points;
  for (int k = first; k < end; k++) {
    double velocity = 0.0, position = 0.0;
    for (int i = 0; i < 4; i++) velocity += p->motion[k][i], position += p->position[k][i];
    if (isfinite(velocity) && isfinite(position)) continue;
    mpm_note_point(mpm, BASE_ERROR_UNSTABLE, p->tag[k],
                   !isfinite(velocity) ? "velocity is not finite" : "position is not finite");
  }
}

MPM_INLINE void update_body(Mpm *mpm, int first, int end, int is_flip, int dimension, MpmShape shape) {
  MpmPoints *p = &mpm->points;
  const MpmGrid *grid = &mpm->grid;
  const MpmScene *scene = &mpm->scene;
  const int width = mpm_shape_width(shape);
  MpmVec fault = {0.0, 0.0, 0.0, 0.0};
  for (int cell = first; cell < end; cell++) {
    const int *row = grid->cell_row[cell];
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    MpmMask stay = {-1, -1, -1, -1};
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      MpmWeights w;
      MpmVec extended = {0.0, 0.0, 0.0, 0.0};
      mpm_find_weights(mpm, k, &base, shape, &w);
      const MpmVec value = mpm_gather_value(grid->state, row, &w, dimension, width);
      const MpmVec rate = mpm_gather_value(grid->rate, row, &w, dimension, width);
      if (!is_flip && mpm->heats) update_temperature(mpm, k, value[0], rate[0]);
      if (!is_flip && !scene->mechanical) continue;
      if (!is_flip && scene->transfer == MPM_TRANSFER_XPIC)
        extended = mpm_gather_value(grid->extended, row, &w, dimension, width);
      update_motion(mpm, k, value, rate, extended);
      if (!is_flip && scene->transfer == MPM_TRANSFER_APIC) update_affine(mpm, k, row, &w, dimension, shape);
      const MpmVec position = p->position[k], sum = position + p->motion[k];
      fault += sum - sum; /* 0, or NaN */
      const MpmVec half = shape != MPM_SHAPE_GIMP || p->equal_domains ? base.half : p->half[k];
      stay &= mpm_is_in_cell(mpm, shape, position, half, &base);
    }
    if (!mpm_axes_all(stay, dimension)) mpm_mark_cell(mpm, cell);
  }
  if (!(fault[0] + fault[1] + fault[2] + fault[3] == 0.0))
    note_faults(mpm, grid->cell_first[first], grid->cell_first[end]);
}

/* The plain case without the others' branches. */
MPM_CLONES static void update_flip(Mpm *mpm, int first, int end) {
  MPM_SPECIALISE(mpm, update_body, mpm, first, end, 1)
}
MPM_CLONES static void update_any(Mpm *mpm, int first, int end) {
  MPM_SPECIALISE(mpm, update_body, mpm, first, end, 0)
}

void mpm_g2p_update(Mpm *mpm) {
  const MpmScene *scene = &mpm->scene;
  if (scene->transfer == MPM_TRANSFER_FLIP && scene->mechanical && !mpm->heats) {
    FOR_CHUNKS(mpm, update_flip(mpm, first, end))
  } else {
    FOR_CHUNKS(mpm, update_any(mpm, first, end))
  }
  mpm->points.movers_known = 1;
}
