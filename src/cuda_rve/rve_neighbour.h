/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Neighbour lists: when one is spent, and how the next is built. Every pair within reach is found through every
 * periodic image, for any cell. Run by a team's leader; rare (every few hundred to several thousand steps). */
#ifndef DEMPM_RVE_NEIGHBOUR_H
#define DEMPM_RVE_NEIGHBOUR_H

#include "rve_cell.h"

enum { RVE_SEARCH_CHUNK = 32 };
#define RVE_NEAR_SKIN 0.02 /* of the skin: pairs closer than this share rows with contacts */

/* How far two grains may move towards each other before a pair outside the list can touch. A pair outside was farther
 * than (Ri + Rj) g0 + skin; it is now farther than stretch ((Ri + Rj) g0 + skin) - movement and touches at (Ri + Rj) g.
 */
RVE_FN double rve_room(const RveHead *head) {
  const double grown = head->scale - head->stretch * head->scale_at_list;
  return head->stretch * head->skin - (grown > 0.0 ? grown : 0.0) * 2.0 * head->radius_max;
}
RVE_FN int rve_list_is_spent(const RveHead *head) { return !(2.0 * head->reach <= rve_room(head)); }

/* Largest true fluctuation displacement since the list, m. */
RVE_FN double rve_farthest(int dim, const RveTeam *team, const RveHead *head, const RveCounts *n, const RveArrays *a) {
  rve_real farthest = rve_set(0.0);
  for (int span = team->pack; span < n->blocks * RVE_PARTS; span += team->packs) {
    rve_real x[3], square = rve_set(0.0);
    for (int k = 0; k < dim; k++)
      x[k] = rve_real_from_int(rve_int_subtract(rve_load_int(a->position[k], span * RVE_SPAN),
                                                rve_load_int(a->position_at_list[k], span * RVE_SPAN)));
    for (int i = 0; i < dim; i++) {
      rve_real d = rve_set(0.0);
      for (int k = 0; k < dim; k++) d = d + rve_set(head->cell[3 * i + k] * RVE_UNIT) * x[k];
      square = square + d * d;
    }
    farthest = rve_max(farthest, square);
  }
  return sqrt(rve_team_max(team, farthest));
}

/* -------------------------------------------------------------------------------------------------------------
 * histories */

/* Copies every contact that has something to remember out of the list. */
RVE_FN int rve_save_contacts(const RveCounts *n, const RveArrays *a, RveScratch *s) {
  const int stride = n->row ? n->row : 1, spins = n->dimension == 2 ? 1 : 3;
  int count = 0;
  for (int i = 0; i < n->blocks * RVE_PACK; i++) s->chain[i] = -1;
  for (int block = 0; block < n->blocks; block++)
    for (int row = a->slot_first[block]; row < a->slot_first[block + 1]; row++)
      for (int lane = 0; lane < RVE_PACK; lane++) {
        const int slot = row * RVE_PACK + lane, i = block * RVE_PACK + lane;
        const uint16_t image = a->image[slot];
        int something = image & RVE_IMAGE_BOND;
        for (int k = 0; k < spins; k++) something |= a->shear[k][slot] != 0.0;
        if ((image & RVE_IMAGE_VOID) || !something) continue;
        s->old_second[count] = (int)a->neighbour[slot] / stride;
        s->old_image[count] = image;
        for (int k = 0; k < spins; k++) s->old_shear[k][count] = a->shear[k][slot];
        s->old_next[count] = s->chain[i];
        s->chain[i] = count++;
      }
  return count;
}

/* Saved contact of (i, j, P), or -1; *flipped = 1 if it was stored as (j, i, -P). */
RVE_FN int rve_find_saved(const RveScratch *s, int i, int j, const int p[3], int *flipped) {
  const int minus[3] = {-p[0], -p[1], -p[2]};
  const uint16_t image = rve_image_pack(p), back = rve_image_pack(minus);
  *flipped = 0;
  for (int c = s->chain[i]; c >= 0; c = s->old_next[c])
    if (s->old_second[c] == j && (s->old_image[c] & 0xfff) == image) return c;
  *flipped = 1;
  for (int c = s->chain[j]; c >= 0; c = s->old_next[c])
    if (s->old_second[c] == i && (s->old_image[c] & 0xfff) == back) return c;
  return -1;
}

/* ----------------------------------------------------------------------------------------------------------------
 * search */

RVE_FN int rve_add_pair(RveScratch *s, int count, int i, int j, const int p[3], int far) {
  if (count < s->pairs) {
    s->first[count] = i;
    s->second[count] = j;
    s->image[count] = (uint16_t)(rve_image_pack(p) | (far ? RVE_IMAGE_FAR : 0));
  }
  return count + 1;
}

/* Grains sorted along the first direction (buckets, then insertion): order, and coordinates and radii in this order,
 * twice over so that a window may run past the cell's end. */
RVE_FN void rve_sort_along(const RveHead *head, const RveCounts *n, const RveArrays *a, RveScratch *s) {
  const int grains = n->grains;
  for (int b = 0; b <= grains; b++) s->bucket[b] = 0;
  for (int i = 0; i < grains; i++) {
    const double x = (double)a->position[0][i] * RVE_UNIT + 0.5;
    int b = (int)(x * grains);
    s->place[i] = b = b < 0 ? 0 : b >= grains ? grains - 1 : b;
    s->bucket[b + 1]++;
  }
  for (int b = 0; b < grains; b++) s->bucket[b + 1] += s->bucket[b];
  for (int i = 0; i < grains; i++) s->order[s->bucket[s->place[i]]++] = i;
  for (int q = 1; q < grains; q++) {
    const int i = s->order[q];
    int to = q;
    for (; to > 0 && a->position[0][s->order[to - 1]] > a->position[0][i]; to--) s->order[to] = s->order[to - 1];
    s->order[to] = i;
  }
  for (int q = 0; q < grains; q++) {
    const int i = s->order[q];
    for (int k = 0; k < 3; k++) {
      const double x = k < n->dimension ? (double)a->position[k][i] * RVE_UNIT : 0.0;
      s->sorted[k][q] = x;
      s->sorted[k][q + grains] = k == 0 ? x + 1.0 : x;
    }
    s->sorted[3][q] = s->sorted[3][q + grains] = a->reference_radius[i] * head->scale_at_list;
  }
  for (int q = 2 * grains; q < 2 * grains + RVE_SEARCH_CHUNK; q++)
    for (int k = 0; k < 4; k++) s->sorted[k][q] = k == 0 ? 1e9 : 0.0;
}

RVE_FN double rve_round(double x) { return (x + 0x1.8p52) - 0x1.8p52; }

/* Cells wider than twice the longest reach: the nearest image in fractional coordinates is the only candidate. */
RVE_FN int rve_search_wide(const RveHead *head, const RveCounts *n, RveScratch *s, double window) {
  const int grains = n->grains;
  const double *x = s->sorted[0], *y = s->sorted[1], *z = s->sorted[2], *r = s->sorted[3], *h = head->cell;
  const double shell = (1.0 - RVE_NEAR_SKIN) * head->skin;
  int count = 0;
  for (int p = 0; p < grains; p++) {
    const double xp = x[p], yp = y[p], zp = z[p], rp = r[p] + head->skin;
    for (int q0 = p + 1; x[q0] - xp <= window; q0 += RVE_SEARCH_CHUNK) {
      int hit[RVE_SEARCH_CHUNK], far[RVE_SEARCH_CHUNK], any = 0;
      for (int l = 0; l < RVE_SEARCH_CHUNK; l++) {
        const double u = x[q0 + l] - xp;
        double v = y[q0 + l] - yp, w = z[q0 + l] - zp;
        v -= rve_round(v), w -= rve_round(w);
        const double dx = h[0] * u + h[1] * v + h[2] * w, dy = h[3] * u + h[4] * v + h[5] * w;
        const double dz = h[6] * u + h[7] * v + h[8] * w, reach = rp + r[q0 + l], inner = reach - shell;
        const double square = dx * dx + dy * dy + dz * dz;
        hit[l] = square < reach * reach;
        far[l] = square >= inner * inner;
        any |= hit[l];
      }
      if (!any) continue;
      for (int l = 0; l < RVE_SEARCH_CHUNK; l++)
        if (hit[l]) {
          const int q = q0 + l, image[3] = {q >= grains, -(int)rve_round(y[q] - yp), -(int)rve_round(z[q] - zp)};
          count = rve_add_pair(s, count, s->order[p], s->order[q >= grains ? q - grains : q], image, far[l]);
        }
    }
  }
  return count;
}

/* Any cell: all images within reach, also of a grain with itself, each pair once: shifts P_x >= 0, then order of
 * grains, and for a grain with itself the half space of shifts. Returns -1 if a shift does not fit. */
RVE_FN int rve_search_narrow(const RveHead *head, const RveCounts *n, RveScratch *s, const double window[3]) {
  const int grains = n->grains;
  const double *h = head->cell, shell = (1.0 - RVE_NEAR_SKIN) * head->skin;
  int count = 0;
  for (int p = 0; p < grains; p++)
    for (int wraps = 0; wraps <= (int)window[0] + 1; wraps++)
      for (int q = wraps == 0 ? p : 0; q < grains; q++) {
        const double u = s->sorted[0][q] - s->sorted[0][p] + wraps;
        if (!(u <= window[0])) break;
        if (u < 0.0 && wraps == 0) continue;
        if (wraps > 0 && u < -window[0]) continue;
        const double v0 = s->sorted[1][q] - s->sorted[1][p], w0 = s->sorted[2][q] - s->sorted[2][p];
        const int py1 = (int)floor(window[1] - v0), pz1 = n->dimension == 3 ? (int)floor(window[2] - w0) : 0;
        for (int py = (int)ceil(-window[1] - v0); py <= py1; py++)
          for (int pz = n->dimension == 3 ? (int)ceil(-window[2] - w0) : 0; pz <= pz1; pz++) {
            if (p == q && wraps == 0 && (py < 0 || (py == 0 && pz <= 0))) continue;
            const double v = v0 + py, w = w0 + pz, reach = s->sorted[3][p] + s->sorted[3][q] + head->skin;
            const double dx = h[0] * u + h[1] * v + h[2] * w, dy = h[3] * u + h[4] * v + h[5] * w;
            const double dz = h[6] * u + h[7] * v + h[8] * w;
            const double square = dx * dx + dy * dy + dz * dz, inner = reach - shell;
            if (!(square < reach * reach)) continue;
            const int image[3] = {wraps, py, pz};
            if (!rve_image_fits(image)) return -1;
            count = rve_add_pair(s, count, s->order[p], s->order[q], image, square >= inner * inner);
          }
      }
  return count;
}

/* All pairs closer than (Ri + Rj) scale + skin. -1: the cell is too narrow. */
RVE_FN int rve_search(const RveHead *head, const RveCounts *n, const RveArrays *a, RveScratch *s) {
  double window[3];
  const double longest = (2.0 * head->radius_max * head->scale_at_list + head->skin) * (1.0 + 1e-9);
  for (int k = 0; k < 3; k++) window[k] = k < n->dimension ? longest * rve_row_norm(head->inverse, k) : 0.0;
  if (!(window[0] < 8.0 && window[1] < 8.0 && window[2] < 8.0)) return -1;
  rve_sort_along(head, n, a, s);
  if (window[0] < 0.499 && window[1] < 0.499 && window[2] < 0.499) return rve_search_wide(head, n, s, window[0]);
  return rve_search_narrow(head, n, s, window);
}

/* -------------------------------------------------------------------------------------------------------------- new
 * list */

/* Gives each pair to one of its grains so that out-degrees differ little, of near and of far pairs. */
RVE_FN void rve_balance(const RveCounts *n, RveScratch *s, int pairs) {
  for (int i = 0; i < n->blocks * RVE_PACK; i++) s->out[i] = s->out_far[i] = s->in[i] = s->in_far[i] = 0;
  for (int pass = 0; pass < 4; pass++)
    for (int c = 0; c < pairs; c++) {
      const int i = s->first[c], j = s->second[c];
      const int far = s->image[c] & RVE_IMAGE_FAR;
      int32_t *const out = far ? s->out_far : s->out, *const in = far && n->dimension == 3 ? s->in_far : s->in;
      const int swap = pass == 0 ? out[j] < out[i] : out[i] > out[j] + 1;
      if (swap) {
        int p[3];
        rve_image_unpack(s->image[c], p);
        for (int k = 0; k < 3; k++) p[k] = -p[k];
        s->first[c] = j, s->second[c] = i;
        s->image[c] = (uint16_t)(rve_image_pack(p) | (s->image[c] & 0xf000));
      }
      if (pass > 0 && swap) out[i]--, in[j]--;
      if (pass == 0 || swap) out[s->first[c]]++, in[s->second[c]]++;
    }
}

/* Largest degree among a block's grains. */
RVE_FN int rve_most(const RveScratch *s, const int32_t *degree, int block) {
  int most = 0;
  for (int lane = 0; lane < RVE_PACK; lane++) {
    const int here = degree[s->rank[block * RVE_PACK + lane]];
    most = here > most ? here : most;
  }
  return most;
}

/* rank[new] = old grain, by out-degree (near, then far pairs), then in-degree, all falling; stable. place[old] = new.
 * Returns rows needed. */
RVE_FN void rve_rank(const RveCounts *n, RveScratch *s, int *slot_rows, int *incoming_rows) {
  const int grains = n->grains, padded = n->blocks * RVE_PACK;
  const int32_t *const key[3] = {s->in, s->out_far, s->out};
  int32_t *from = s->order, *to = s->rank;
  for (int i = 0; i < grains; i++) from[i] = i;
  for (int round = 0; round < 3; round++) { /* counting sort, least significant key first */
    int most = 0;
    for (int i = 0; i < grains; i++) most = key[round][i] > most ? key[round][i] : most;
    most = most < grains ? most : grains; /* buckets: higher degrees share the last one */
    for (int b = 0; b <= most; b++) s->bucket[b] = 0;
    for (int i = 0; i < grains; i++) s->bucket[most - (key[round][i] < most ? key[round][i] : most)]++;
    for (int b = 0, sum = 0; b <= most; b++) {
      const int here = s->bucket[b];
      s->bucket[b] = sum;
      sum += here;
    }
    for (int q = 0; q < grains; q++) {
      const int i = from[q];
      to[s->bucket[most - (key[round][i] < most ? key[round][i] : most)]++] = i;
    }
    int32_t *const swap = from;
    from = to, to = swap;
  }
  /* after three rounds the result is in `rank` */
  for (int q = grains; q < padded; q++) s->rank[q] = q;
  for (int q = 0; q < padded; q++) s->place[s->rank[q]] = q;
  *slot_rows = *incoming_rows = 0;
  for (int block = 0; block < n->blocks; block++) {
    s->out_rows[block] = rve_most(s, s->out, block), s->in_rows[block] = rve_most(s, s->in, block);
    if (s->in_rows[block] == 0) s->in_rows[block] = 1; /* rve_sum_reactions() asks for one */
    *slot_rows += s->out_rows[block] + rve_most(s, s->out_far, block);
    *incoming_rows += s->in_rows[block] + rve_most(s, s->in_far, block);
  }
}

RVE_FN void rve_permute(const int32_t *rank, int n, double *x, double *swap) {
  for (int q = 0; q < n; q++) swap[q] = x[rank[q]];
  for (int q = 0; q < n; q++) x[q] = swap[q];
}
RVE_FN void rve_permute_int(const int32_t *rank, int n, int64_t *x, double *swap) {
  for (int q = 0; q < n; q++) memcpy(&swap[q], &x[rank[q]], 8);
  for (int q = 0; q < n; q++) memcpy(&x[q], &swap[q], 8);
}

/* Puts the grains in their new order. Forces are not moved: the contact pass that follows writes them. */
RVE_FN void rve_reorder(const RveCounts *n, const RveArrays *a, RveScratch *s) {
  const int padded = n->blocks * RVE_PACK;
  for (int k = 0; k < n->dimension; k++) {
    rve_permute_int(s->rank, padded, a->position[k], s->swap);
    rve_permute(s->rank, padded, a->velocity[k], s->swap);
  }
  for (int k = 0; k < (n->dimension == 2 ? 1 : 3); k++) rve_permute(s->rank, padded, a->spin[k], s->swap);
  double *const other[] = {a->radius, a->reference_radius, a->mass, a->inverse_mass, a->inverse_inertia};
  for (int k = 0; k < 5; k++) rve_permute(s->rank, padded, other[k], s->swap);
  for (int q = 0; q < padded; q++) s->bucket[q] = a->id[s->rank[q]];
  for (int q = 0; q < padded; q++) a->id[q] = s->bucket[q];
  for (int k = 0; k < n->dimension; k++)
    for (int q = 0; q < padded; q++) a->position_at_list[k][q] = a->position[k][q];
}

/* Writes slots, histories and incoming lists of the new order. */
RVE_FN void rve_fill_slots(const RveCounts *n, const RveArrays *a, RveScratch *s, int pairs) {
  const int stride = n->row ? n->row : 1;
  const int spins = n->dimension == 2 ? 1 : 3;
  int slots = 0, incoming = 0;
  for (int block = 0; block < n->blocks; block++) {
    const int out = s->out_rows[block] + rve_most(s, s->out_far, block);
    const int in = s->in_rows[block] + rve_most(s, s->in_far, block);
    a->slot_first[block] = slots, a->incoming_first[block] = incoming;
    a->incoming_far[block] = incoming + s->in_rows[block];
    for (int row = slots; row < slots + out; row++) a->idle_until[row] = 0.0;
    for (int row = incoming; row < incoming + in; row++) a->incoming_idle[row] = 0.0;
    for (int slot = slots * RVE_PACK; slot < (slots + out) * RVE_PACK; slot++) {
      a->neighbour[slot] = (uint32_t)((block * RVE_PACK + slot % RVE_PACK) * stride);
      a->image[slot] = RVE_IMAGE_EMPTY | RVE_IMAGE_VOID;
      for (int k = 0; k < spins; k++) a->shear[k][slot] = 0.0;
    }
    for (int e = incoming * RVE_PACK; e < (incoming + in) * RVE_PACK; e++) /* the reaction that stays zero */
      a->incoming[e] = (uint32_t)rve_reaction_at(n, n->slot_rows * RVE_PACK);
    slots += out, incoming += in;
  }
  a->slot_first[n->blocks] = slots, a->incoming_first[n->blocks] = incoming;
  a->idle_until[n->slot_rows] = 1e300;
  for (int slot = slots * RVE_PACK; slot < (slots + 1) * RVE_PACK; slot++) a->neighbour[slot] = 0; /* RveRows reads on */
  for (int i = 0; i < n->blocks * RVE_PACK; i++) s->out[i] = s->out_far[i] = s->in[i] = s->in_far[i] = 0;
  for (int c = 0; c < pairs; c++) {
    const int i = s->place[s->first[c]], j = s->place[s->second[c]], old = s->history[c];
    const int far = s->image[c] & RVE_IMAGE_FAR;
    const int row = far ? s->out_rows[i / RVE_PACK] + s->out_far[i]++ : s->out[i]++;
    const int slot = (a->slot_first[i / RVE_PACK] + row) * RVE_PACK + i % RVE_PACK;
    const int in = far && n->dimension == 3 ? s->in_rows[j / RVE_PACK] + s->in_far[j]++ : s->in[j]++;
    a->neighbour[slot] = (uint32_t)(j * stride);
    a->image[slot] = s->image[c] & (uint16_t)~RVE_IMAGE_FAR;
    a->incoming[(a->incoming_first[j / RVE_PACK] + in) * RVE_PACK + j % RVE_PACK] =
        (uint32_t)rve_reaction_at(n, slot);
    if (old < 0) continue;
    /* Seen from the other grain the force changes sign; in 2D the tangent (-n_y, n_x) does too. */
    const double sign = n->dimension == 3 && s->first[c] == s->old_second[old] &&
                                (s->first[c] != s->second[c] || (s->image[c] & 0xfff) != (s->old_image[old] & 0xfff))
                            ? -1.0
                            : 1.0;
    for (int k = 0; k < spins; k++) a->shear[k][slot] = sign * s->old_shear[k][old];
  }
}

/* Attaches saved histories and bonds to the found pairs; an intact bond stretched out of reach becomes a pair of its
 * own. */
RVE_FN int rve_attach_saved(const RveCounts *n, RveScratch *s, int pairs, int saved) {
  for (int c = 0; c < pairs && saved > 0; c++) {
    int p[3], flipped;
    rve_image_unpack(s->image[c], p);
    const int old = s->history[c] = rve_find_saved(s, s->first[c], s->second[c], p, &flipped);
    if (old < 0) continue;
    s->image[c] = (uint16_t)((s->image[c] & ~RVE_IMAGE_FAR) | (s->old_image[old] & RVE_IMAGE_BOND));
    s->old_image[old] |= RVE_IMAGE_VOID; /* found */
  }
  if (saved == 0) {
    for (int c = 0; c < pairs; c++) s->history[c] = -1;
    return pairs;
  }
  for (int i = 0; i < n->grains; i++)
    for (int old = s->chain[i]; old >= 0; old = s->old_next[old]) {
      if ((s->old_image[old] & RVE_IMAGE_VOID) || !(s->old_image[old] & RVE_IMAGE_BOND)) continue;
      if (pairs < s->pairs) {
        s->first[pairs] = i, s->second[pairs] = s->old_second[old], s->history[pairs] = old;
        s->image[pairs] = s->old_image[old];
      }
      pairs++;
    }
  return pairs;
}

enum { RVE_LIST_BUILT, RVE_LIST_TOO_SMALL, RVE_LIST_FAILED };

/* The width of the shell of neighbours: fixed, or halved and doubled until lists last some hundred steps. */
RVE_FN void rve_choose_skin(const RveCall *call, RveHead *head, int dimension) {
  const double r = head->radius_max, lasted = (double)(head->steps - head->steps_at_list);
  if (call->skin_fraction > 0.0) head->skin = call->skin_fraction * r;
  else if (head->rebuilds == 0) head->skin = (dimension == 2 ? 0.08 : 0.05) * r;
  else if (lasted < 100.0) head->skin = head->skin * 1.5 < 0.5 * r ? head->skin * 1.5 : 0.5 * r;
  else if (lasted > 4000.0) head->skin = head->skin / 1.5 > 0.02 * r ? head->skin / 1.5 : 0.02 * r;
}

/* Reduces the cell, finds all pairs, carries histories over, orders grains. Changes nothing that matters (only wraps)
 * if it returns RVE_LIST_TOO_SMALL with the head's need_* set. */
RVE_PART int rve_build_list(const RveCall *call, RveHead *head, const RveCounts *n, const RveArrays *a, RveScratch *s) {
  int slot_rows, incoming_rows;
  if (!rve_reduce_cell(head, n, a)) return RVE_LIST_FAILED;
  if (head->need_pairs == 0) rve_choose_skin(call, head, n->dimension); /* else: second try of the same list */
  head->scale_at_list = head->scale;
  const int saved = rve_save_contacts(n, a, s);
  int pairs = rve_search(head, n, a, s);
  if (pairs < 0) return RVE_LIST_FAILED;
  if (pairs <= s->pairs) pairs = rve_attach_saved(n, s, pairs, saved);
  if (pairs > s->pairs) {
    head->need_pairs = pairs + pairs / 4 + 64;
    head->need_slot_rows = n->slot_rows, head->need_incoming_rows = n->incoming_rows;
    return RVE_LIST_TOO_SMALL;
  }
  rve_balance(n, s, pairs);
  rve_rank(n, s, &slot_rows, &incoming_rows);
  slot_rows++; /* the one behind the last */
  if (slot_rows > n->slot_rows || incoming_rows > n->incoming_rows) {
    head->need_pairs = s->pairs;
    head->need_slot_rows = slot_rows > n->slot_rows ? slot_rows + slot_rows / 4 + 4 : n->slot_rows;
    head->need_incoming_rows =
        incoming_rows > n->incoming_rows ? incoming_rows + incoming_rows / 4 + 4 : n->incoming_rows;
    return RVE_LIST_TOO_SMALL;
  }
  rve_reorder(n, a, s);
  rve_fill_slots(n, a, s, pairs);
  for (int k = 0; k < 9; k++) head->cell_at_list[k] = head->cell[k];
  head->reach = 0.0;
  head->approach = call->resting ? 0.0 : 1e300; /* later than any row rests */
  head->stretch = 1.0;
  head->rebuilds++;
  head->steps_at_list = head->steps;
  head->carried = 0;
  head->list_due = RVE_LIST_GOOD;
  head->need_pairs = head->need_slot_rows = head->need_incoming_rows = 0;
  return RVE_LIST_BUILT;
}

#endif
