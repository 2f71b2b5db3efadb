/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RVEs that began with the same packing and were asked the same ever since are the same to the last bit: one of them is
 * computed, the others are copies. Histories are compared exactly: RVEs that share a number and are asked the same share the
 * next number too. */
#include <stdlib.h>
#include <string.h>

#include "rve_batch_private.h"

static int compare(const void *a, const void *b) {
  const RveTwin *x = a, *y = b;
  if (x->history != y->history) return x->history < y->history ? -1 : 1;
  const int input = memcmp(x->input, y->input, sizeof *x->input);
  return input ? input : (x->rve > y->rve) - (x->rve < y->rve);
}

void rve_twins_sort(RveBatch *batch, int n, const int *index, const RveInput *input) {
  RveTwin *twin = batch->twin;
  for (int k = 0; k < n; k++) {
    const int rve = index ? index[k] : k;
    const RveRecord *record = &batch->record[rve];
    twin[k] = (RveTwin){batch->history[rve], &input[k], rve, rve, (const char *)record->arena, record->bytes};
  }
  qsort(twin, (size_t)n, sizeof *twin, compare);
  for (int k = 1; k < n && batch->scene.share; k++)
    if (twin[k].history == twin[k - 1].history && memcmp(twin[k].input, twin[k - 1].input, sizeof *twin->input) == 0)
      twin[k].leader = twin[k - 1].leader;
}

void rve_twins_renew(RveBatch *batch, int n) {
  for (int k = 0; k < n; k++) {
    const RveTwin *twin = &batch->twin[k];
    batch->history[twin->rve] = twin->leader == twin->rve ? ++batch->histories : batch->histories;
  }
}

void rve_twins_leave(RveBatch *batch, int rve) { batch->history[rve] = ++batch->histories; }

BaseStatus rve_twins_copy(RveBatch *batch, int from, int to) {
  const RveRecord *model = &batch->record[from];
  RveRecord *copy = &batch->record[to];
  if (copy->bytes != model->bytes) {
    RveRecord fresh;
    TRY(rve_record_alloc(&model->counts, &fresh));
    rve_record_destroy(copy);
    *copy = fresh;
  }
  memcpy(copy->arena, model->arena, model->bytes);
  copy->counts = model->counts;
  copy->last = model->last;
  copy->conduction = model->conduction;
  rve_layout(&copy->counts, copy->arena, &copy->arrays);
  return BASE_OK;
}
