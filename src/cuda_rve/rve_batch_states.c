/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RVEs of a batch by themselves: bonds, rest, states in and out, views. */
#include <string.h>

#include "rve_batch_private.h"

/* RVEs that are changed alone part from their twins. */
static void leave_twins(RveBatch *batch, int n, const int *index) {
  for (int k = 0; k < n && (index || n < batch->count); k++) rve_twins_leave(batch, index ? index[k] : k);
}

BaseStatus rve_batch_install_bonds(RveBatch *batch, int n, const int *index) {
  if (!batch->scene.bonds) return base_error(BASE_ERROR_ARGUMENT, "bonds = 0 (allowed: scenes with bonds)");
  if (!index && n == 0) n = batch->count;
  TRY(rve_batch_check_index(batch, n, index));
  for (int k = 0; k < n; k++) {
    const int rve = index ? index[k] : k;
    TRY(rve_batch_download(batch, rve));
    rve_record_install_bonds(&batch->record[rve]);
  }
  leave_twins(batch, n, index);
  return rve_batch_refresh(batch, n, index);
}

BaseStatus rve_batch_rest(RveBatch *batch, int n, const int *index) {
  if (!index && n == 0) n = batch->count;
  TRY(rve_batch_check_index(batch, n, index));
  for (int k = 0; k < n; k++) {
    const int rve = index ? index[k] : k;
    TRY(rve_batch_download(batch, rve));
    rve_record_rest(&batch->record[rve]);
  }
  leave_twins(batch, n, index);
  return rve_batch_refresh(batch, n, index);
}

/* ---------------------------------------------------------------------------------------------- states in and out */

static BaseStatus check_rve(const RveBatch *batch, int rve) {
  if (rve < 0 || rve >= batch->count)
    return base_error(BASE_ERROR_ARGUMENT, "RVE %d (allowed: 0 to %d)", rve, batch->count - 1);
  return BASE_OK;
}

size_t rve_batch_state_bytes(const RveBatch *batch, int rve) {
  return rve < 0 || rve >= batch->count ? 0 : rve_record_state_bytes(&batch->record[rve]);
}

BaseStatus rve_batch_pack(const RveBatch *batch, int rve, void *bytes, size_t *written) {
  TRY(check_rve(batch, rve));
  TRY(rve_batch_download(batch, rve));
  return rve_record_pack(&batch->record[rve], rve_scene_hash(&batch->scene), bytes, written);
}

BaseStatus rve_batch_unpack(RveBatch *batch, int rve, const void *bytes, size_t size) {
  int canonical;
  TRY(check_rve(batch, rve));
  TRY(rve_record_unpack(batch->kernels, rve_scene_hash(&batch->scene), bytes, size, &batch->record[rve], &canonical));
  rve_forget_failure(batch, rve);
  rve_twins_leave(batch, rve);
  if (canonical) return rve_batch_refresh(batch, 1, &rve);
  return rve_batch_upload(batch, rve);
}

BaseStatus rve_batch_view(const RveBatch *batch, int rve, RveView *view) {
  memset(view, 0, sizeof *view);
  TRY(check_rve(batch, rve));
  TRY(rve_batch_download(batch, rve));
  return rve_record_view(&batch->record[rve], view);
}

BaseStatus rve_batch_packing(const RveBatch *batch, int rve, RvePacking *packing) {
  memset(packing, 0, sizeof *packing);
  TRY(check_rve(batch, rve));
  TRY(rve_batch_download(batch, rve));
  return rve_record_packing(&batch->record[rve], packing);
}

BaseStatus rve_batch_conduct(const RveBatch *batch, int rve, double time_step, int64_t steps, double *temperature) {
  TRY(check_rve(batch, rve));
  TRY(rve_batch_download(batch, rve));
  return rve_record_conduct(&batch->record[rve], &batch->scene, time_step, steps, temperature);
}
