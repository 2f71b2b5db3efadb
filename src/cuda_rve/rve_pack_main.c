/* SPDX-License-Identifier: GPL-2.0-or-later */
/* dempm-pack: makes, converts and describes periodic packings. Keywords and values as in a LIGGGHTS command. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rve_packing.h"
#include "rve_packing_pairs.h"

static const char usage[] =
    "dempm-pack generate FILE keyword values ...   a packing by isotropic compression\n"
    "  required: radius MIN MAX [m]  pressure P [Pa]  preparation_friction MU  density RHO [kg/m3]  kn K  kt K [N/m]\n"
    "            thickness Z [m] (2D only)\n"
    "  optional: dimension 2|3 (2)  grain disk|sphere (2D: disk)  grains N (400)  seed S (5)\n"
    "            solid_fraction F (of the initial gas; 0.74 in 2D, 0.35 in 3D)  stress_tolerance T (1e-3)\n"
    "            unbalanced_tolerance T (1e-3)  max_steps N (2000000)\n"
    "dempm-pack convert IN OUT dimension 2|3 [kt K]   IN: LIGGGHTS data file, text dump, restart, or a packing of "
    "dempm;\n"
    "            kt: makes tangential forces of a restart's contact history\n"
    "dempm-pack info FILE dimension 2|3               grains, cell, solid fraction, void ratio, radii, coordination\n";

typedef enum ValueKind { VALUE_REAL, VALUE_INTEGER, VALUE_SEED, VALUE_GRAIN } ValueKind;

typedef struct Keyword {
  const char *name;
  ValueKind kind;
  void *value[2]; /* one or two values follow the keyword */
  int required;
  int met;
} Keyword;

static BaseStatus parse_value(const Keyword *keyword, void *value, const char *text) {
  char *end;
  if (keyword->kind == VALUE_GRAIN) {
    const int sphere = strcmp(text, "sphere") == 0;
    if (!sphere && strcmp(text, "disk") != 0)
      return base_error(BASE_ERROR_ARGUMENT, "%s: found '%s'; disk or sphere is allowed", keyword->name, text);
    *(RveGrain *)value = sphere ? RVE_SPHERE : RVE_DISK;
    return BASE_OK;
  }
  const double number = strtod(text, &end);
  if (end == text || *end != '\0' || !isfinite(number))
    return base_error(BASE_ERROR_ARGUMENT, "%s: found '%s'; a number is needed", keyword->name, text);
  if (keyword->kind == VALUE_REAL) {
    *(double *)value = number;
    return BASE_OK;
  }
  const double most = keyword->kind == VALUE_SEED ? 9e15 : 2e9;
  if (number != floor(number) || number < 0.0 || number > most)
    return base_error(BASE_ERROR_ARGUMENT, "%s: found '%s'; an integer from 0 to %g is needed", keyword->name, text,
                      most);
  if (keyword->kind == VALUE_SEED) *(uint64_t *)value = (uint64_t)number;
  else *(int *)value = (int)number;
  return BASE_OK;
}

/* Parses "keyword value(s) ..." into the table. */
static BaseStatus parse(int count, char **text, Keyword *table, int keywords) {
  for (int at = 0; at < count;) {
    Keyword *keyword = NULL;
    for (int k = 0; k < keywords; k++)
      if (strcmp(text[at], table[k].name) == 0) keyword = table + k;
    if (!keyword) return base_error(BASE_ERROR_ARGUMENT, "unknown keyword '%s'", text[at]);
    if (keyword->met++) return base_error(BASE_ERROR_ARGUMENT, "keyword %s is given twice", keyword->name);
    const int values = keyword->value[1] ? 2 : 1;
    if (at + values >= count)
      return base_error(BASE_ERROR_ARGUMENT, "%s: %d value(s) must follow", keyword->name, values);
    for (int k = 0; k < values; k++) TRY(parse_value(keyword, keyword->value[k], text[at + 1 + k]));
    at += values + 1;
  }
  for (int k = 0; k < keywords; k++)
    if (table[k].required && !table[k].met)
      return base_error(BASE_ERROR_ARGUMENT, "keyword %s is missing", table[k].name);
  return BASE_OK;
}

typedef struct Count {
  int contacts;
  double deepest; /* overlap over the mean of the two radii */
} Count;

static BaseStatus count_contact(void *context, int i, int j, const int image[3], const double branch[3],
                                double distance) {
  Count *count = ((void **)context)[0];
  const RvePacking *packing = ((void **)context)[1];
  (void)image, (void)branch;
  const double touch = packing->radius[i] + packing->radius[j];
  count->contacts++;
  count->deepest = fmax(count->deepest, 2.0 * (touch - distance) / touch);
  return BASE_OK;
}

static BaseStatus describe(const char *name, const RvePacking *packing) {
  Count count = {0};
  void *context[2] = {&count, (void *)packing};
  double smallest = INFINITY, sum = 0.0, height[3];
  TRY(packing_visit_pairs(packing, 0.0, count_contact, context));
  for (int i = 0; i < packing->grains; i++) smallest = fmin(smallest, packing->radius[i]), sum += packing->radius[i];
  const double solid = packing_grain_measure(packing), cell = packing_cell_measure(packing);
  packing_heights(packing->cell, height);
  printf("file             %s\n", name);
  printf("dimension        %d\n", packing->dimension);
  printf("grains           %d\n", packing->grains);
  for (int i = 0; i < packing->dimension; i++) {
    printf(i == 0 ? "cell vectors     " : "                 ");
    for (int k = 0; k < packing->dimension; k++) printf(" %.9g", packing->cell[3 * k + i]);
    printf(" m, height %.6g m\n", height[i]);
  }
  printf("radii            %.6g to %.6g m, mean %.6g m\n", smallest, packing_largest_radius(packing),
         sum / packing->grains);
  printf("solid fraction   %.6f (overlaps not removed)\n", solid / cell);
  printf("void ratio       %.6f\n", cell / solid - 1.0);
  printf("contacts         %d\n", count.contacts);
  printf("coordination     %.4f\n", 2.0 * count.contacts / packing->grains);
  printf("largest overlap  %.3g of the mean radius\n", count.deepest);
  printf("history          %d tangential forces\n", packing->contacts);
  printf("motion           %s\n", packing->velocity ? "velocities and spins" : "at rest");
  return BASE_OK;
}

static BaseStatus run_generate(const char *file, int count, char **text) {
  RveScene scene = rve_scene_default();
  RveGenerator generator = rve_generator_default();
  int max_steps = (int)generator.max_steps;
  Keyword table[] = {
      {"dimension", VALUE_INTEGER, {&scene.dimension, NULL}, 0, 0},
      {"grain", VALUE_GRAIN, {&scene.grain, NULL}, 0, 0},
      {"thickness", VALUE_REAL, {&scene.thickness, NULL}, 0, 0},
      {"density", VALUE_REAL, {&scene.density, NULL}, 1, 0},
      {"kn", VALUE_REAL, {&scene.normal_stiffness, NULL}, 1, 0},
      {"kt", VALUE_REAL, {&scene.tangential_stiffness, NULL}, 1, 0},
      {"grains", VALUE_INTEGER, {&generator.grains, NULL}, 0, 0},
      {"radius", VALUE_REAL, {&generator.radius_min, &generator.radius_max}, 1, 0},
      {"pressure", VALUE_REAL, {&generator.pressure, NULL}, 1, 0},
      {"preparation_friction", VALUE_REAL, {&generator.preparation_friction, NULL}, 1, 0},
      {"solid_fraction", VALUE_REAL, {&generator.solid_fraction, NULL}, 0, 0},
      {"stress_tolerance", VALUE_REAL, {&generator.stress_tolerance, NULL}, 0, 0},
      {"unbalanced_tolerance", VALUE_REAL, {&generator.unbalanced_tolerance, NULL}, 0, 0},
      {"max_steps", VALUE_INTEGER, {&max_steps, NULL}, 0, 0},
      {"seed", VALUE_SEED, {&generator.seed, NULL}, 0, 0},
  };
  TRY(parse(count, text, table, (int)(sizeof table / sizeof *table)));
  generator.max_steps = max_steps;
  if (scene.dimension == 2 && isnan(scene.thickness))
    return base_error(BASE_ERROR_ARGUMENT, "keyword thickness is missing (required in 2D)");
  if (scene.dimension == 3 && !table[1].met) scene.grain = RVE_SPHERE;
  RvePacking packing = {0};
  const double start = base_seconds();
  TRY(rve_packing_generate(&scene, &generator, &packing));
  const double seconds = base_seconds() - start;
  BaseStatus status = rve_packing_write(file, &packing);
  if (status == BASE_OK) status = describe(file, &packing);
  if (status == BASE_OK) printf("made in          %.2f s\n", seconds);
  rve_packing_destroy(&packing);
  return status;
}

/* Reads `in`; writes `out` if there is one, else describes. */
static BaseStatus run_read(const char *in, const char *out, int count, char **text) {
  int dimension = 0;
  double kt = 0.0;
  Keyword table[] = {{"dimension", VALUE_INTEGER, {&dimension, NULL}, 1, 0}, {"kt", VALUE_REAL, {&kt, NULL}, 0, 0}};
  TRY(parse(count, text, table, 2));
  if (kt < 0.0) return base_error(BASE_ERROR_ARGUMENT, "kt = %g (allowed: >= 0)", kt);
  RvePacking packing = {0};
  TRY(rve_packing_read_history(in, dimension, kt, &packing));
  const BaseStatus status = out ? rve_packing_write(out, &packing) : describe(in, &packing);
  rve_packing_destroy(&packing);
  return status;
}

int main(int count, char **text) {
  BaseStatus status;
  if (count >= 3 && strcmp(text[1], "generate") == 0) status = run_generate(text[2], count - 3, text + 3);
  else if (count >= 4 && strcmp(text[1], "convert") == 0) status = run_read(text[2], text[3], count - 4, text + 4);
  else if (count >= 3 && strcmp(text[1], "info") == 0) status = run_read(text[2], NULL, count - 3, text + 3);
  else {
    const int asked =
        count == 2 && (strcmp(text[1], "help") == 0 || strcmp(text[1], "-h") == 0 || strcmp(text[1], "--help") == 0);
    fputs(usage, asked ? stdout : stderr);
    return asked ? 0 : 2;
  }
  if (status == BASE_OK) return 0;
  fprintf(stderr, "dempm-pack: ERROR: %s\n", base_error_message());
  return 1;
}
