/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The answer of dempm-rve: CSV, one line per state. */
#include <math.h>

#include "rve_element.h"
#include "rve_replay.h"

BaseStatus element_overlap(const RveBatch *batch, double *overlap) {
  RveView view;
  RveFailure failure;
  if (rve_batch_failure(batch, 0, &failure) == BASE_OK) return BASE_OK;
  *overlap = 0.0;
  TRY(rve_batch_view(batch, 0, &view));
  for (int c = 0; c < view.contacts; c++) {
    const double *b = view.branch + 3 * (size_t)c;
    const double ri = view.radius[view.pair[2 * c]], rj = view.radius[view.pair[2 * c + 1]];
    const double depth = ri + rj - sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    *overlap = fmax(*overlap, depth / fmin(ri, rj));
  }
  rve_view_destroy(&view);
  return BASE_OK;
}

static void head_symmetric(FILE *out, int dimension, const char *name) {
  for (int k = 0; k < 6; k++)
    if (element_in_plane(dimension, k))
      fprintf(out, ",%s%c%c", name, element_axis[element_row[k]], element_axis[element_column[k]]);
}

static void line_symmetric(FILE *out, int dimension, const double value[6]) {
  for (int k = 0; k < 6; k++)
    if (element_in_plane(dimension, k)) fprintf(out, ",%.12g", value[k]);
}

void element_table_head(FILE *out, const RveScene *scene) {
  const int dimension = scene->dimension;
  fprintf(out, "time");
  for (int k = 0; k < 9; k++)
    if (dimension == 3 || (k / 3 < 2 && k % 3 < 2)) fprintf(out, ",F%c%c", element_axis[k / 3], element_axis[k % 3]);
  head_symmetric(out, dimension, "s");
  if (scene->thermal) {
    fprintf(out, ",T");
    head_symmetric(out, dimension, "K");
    if (scene->network) head_symmetric(out, dimension, "Kaffine_");
  }
  fprintf(out, ",heat,void_ratio,solid_fraction,coordination");
  head_symmetric(out, dimension, "fabric_");
  fprintf(out, ",bond_fraction,overlap,kinetic_energy,elastic_energy,friction_work,damping_work,unbalanced,volume,steps,status\n");
}

void element_table_line(FILE *out, const RveScene *scene, const ElementState *state) {
  const int dimension = scene->dimension;
  const RveAnswer *a = &state->answer;
  fprintf(out, "%.12g", state->time);
  for (int k = 0; k < 9; k++)
    if (dimension == 3 || (k / 3 < 2 && k % 3 < 2)) fprintf(out, ",%.15g", state->gradient[k]);
  line_symmetric(out, dimension, a->stress);
  if (scene->thermal) {
    fprintf(out, ",%.12g", state->temperature);
    line_symmetric(out, dimension, a->conductivity);
    if (scene->network) line_symmetric(out, dimension, a->conductivity_affine);
  }
  fprintf(out, ",%.9g,%.12g,%.12g,%.9g", state->heat, 1.0 / a->solid_fraction - 1.0, a->solid_fraction, a->coordination);
  line_symmetric(out, dimension, a->fabric);
  fprintf(out, ",%.9g,%.6g,%.9g,%.9g,%.9g,%.9g,%.6g,%.12g,%lld,%d\n", a->bond_fraction, state->overlap,
          a->kinetic_energy, a->elastic_energy, state->friction_work, state->damping_work, a->unbalanced, a->volume, (long long)a->steps, a->status);
}
