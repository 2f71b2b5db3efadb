/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The settings of dempm-rve: name=value. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "rve_element.h"

typedef enum SettingKind { SETTING_REAL, SETTING_INTEGER, SETTING_CHOICE } SettingKind;
typedef enum SettingRange { ANY, POSITIVE, NOT_NEGATIVE, BELOW_ONE, UP_TO_ONE, AT_LEAST_ONE } SettingRange;

typedef struct Setting {
  const char *name;
  SettingKind kind;
  SettingRange range;
  void *value;              /* double, int, or an int or enum that counts the words of a choice */
  const char *const *words; /* of a choice, NULL at the end */
  const char *paths; /* built-in paths that use it; NULL: no matter of paths */
  int given;
} Setting;

enum { MOST_SETTINGS = 64 };
typedef struct Table {
  int count;
  Setting setting[MOST_SETTINGS];
} Table;

static const char *allowed(SettingRange range) {
  static const char *const text[] = {"a number", "a number > 0", "a number >= 0", "0 <= number < 1", "0 < number <= 1",
                                     "a number >= 1"};
  return text[range];
}

static int is_in_range(SettingRange range, double x) {
  switch (range) {
    case POSITIVE: return x > 0.0;
    case NOT_NEGATIVE: return x >= 0.0;
    case BELOW_ONE: return x >= 0.0 && x < 1.0;
    case UP_TO_ONE: return x > 0.0 && x <= 1.0;
    case AT_LEAST_ONE: return x >= 1.0;
    default: return 1;
  }
}

ElementSettings element_settings_default(int dimension) {
  ElementSettings settings;
  memset(&settings, 0, sizeof settings);
  settings.scene = rve_scene_default();
  settings.scene.dimension = dimension;
  settings.scene.grain = dimension == 2 ? RVE_DISK : RVE_SPHERE;
  settings.scene.conduction.fluid = NAN;
  settings.scene.reference_temperature = settings.scene.bond_strength = NAN;
  settings.backend = RVE_BACKEND_CPU;
  settings.pressure = settings.start = settings.duration = settings.rate = settings.strain = NAN;
  settings.servo_rate = NAN;
  settings.servo_steps = 10;
  settings.stress_tolerance = 0.03;
  settings.most_steps = 2e6;
  return settings;
}

static void add(Table *table, const char *name, SettingKind kind, SettingRange range, void *value, const char *paths) {
  table->setting[table->count++] = (Setting){name, kind, range, value, NULL, paths, 0};
}
static void add_real(Table *table, const char *name, SettingRange range, double *value) {
  add(table, name, SETTING_REAL, range, value, NULL);
}

static void add_choice(Table *table, const char *name, const char *const *words, void *value) {
  table->setting[table->count++] = (Setting){name, SETTING_CHOICE, ANY, value, words, NULL, 0};
}

/* In the order of their enumerations. */
static const char *const flags[] = {"no", "yes", NULL}, *const grains[] = {"disk", "sphere", NULL},
                         *const backends[] = {"auto", "cpu", "cuda", NULL},
                         *const precisions[] = {"double", "mixed", NULL},
                         *const directs[] = {"none", "batchelor", "liggghts", "pipe", NULL},
                         *const indirects[] = {"none", "voronoi_a", "voronoi_b", "layer", NULL},
                         *const areas[] = {"geometric", "hertz", NULL}, *const networks[] = {"affine", "network", NULL};

static void add_conduction(RveScene *scene, Table *table) {
  GrainHeat *model = &scene->conduction;
  add_choice(table, "direct", directs, &model->direct);
  add_choice(table, "area", areas, &model->area);
  add_choice(table, "indirect", indirects, &model->indirect);
  add_real(table, "fluid", POSITIVE, &model->fluid);
  add_real(table, "porosity", BELOW_ONE, &model->porosity);
  add_real(table, "core", BELOW_ONE, &model->core);
  add_real(table, "reach", POSITIVE, &model->reach);
  add_real(table, "layer", POSITIVE, &model->layer);
  add_real(table, "minimum_gap", POSITIVE, &model->minimum_gap);
  add_real(table, "grain_conductivity", POSITIVE, &scene->grain_conductivity);
  add_choice(table, "conductivity", networks, &scene->network);
  add_real(table, "network_change", NOT_NEGATIVE, &scene->network_change);
  add(table, "conductivity_every", SETTING_INTEGER, AT_LEAST_ONE, &scene->conductivity_every, NULL);
}

static void fill_table(ElementSettings *s, Table *table) {
  RveScene *scene = &s->scene;
  table->count = 0;
  add_real(table, "density", POSITIVE, &scene->density);
  add_real(table, "kn", POSITIVE, &scene->normal_stiffness);
  add_real(table, "kt", NOT_NEGATIVE, &scene->tangential_stiffness);
  add_real(table, "mu", NOT_NEGATIVE, &scene->friction);
  add_real(table, "thickness", POSITIVE, &scene->thickness);
  add_choice(table, "grain", grains, &scene->grain);
  add_real(table, "gamman", NOT_NEGATIVE, &scene->normal_viscosity);
  add_real(table, "gammat", NOT_NEGATIVE, &scene->tangential_viscosity);
  add_real(table, "damping/local", BELOW_ONE, &scene->local_damping);
  add_real(table, "damping/viscous", NOT_NEGATIVE, &scene->critical_damping);
  add_choice(table, "rotation", flags, &scene->rotation);
  add_real(table, "expansion", NOT_NEGATIVE, &scene->expansion);
  add_real(table, "Tref", ANY, &scene->reference_temperature);
  add_real(table, "alpha", POSITIVE, &scene->pipe_resistance);
  add_conduction(scene, table);
  add_real(table, "bond_strength", NOT_NEGATIVE, &scene->bond_strength);
  add_real(table, "bond_shear_ratio", NOT_NEGATIVE, &scene->bond_shear_ratio);
  add_real(table, "bond_melting", ANY, &scene->bond_melting_temperature);
  add_real(table, "timestep", POSITIVE, &scene->time_step);
  add_real(table, "timestep_fraction", UP_TO_ONE, &scene->time_step_fraction);
  add(table, "substeps", SETTING_INTEGER, NOT_NEGATIVE, &scene->substeps, NULL);
  add_real(table, "skin", UP_TO_ONE, &scene->skin);
  add(table, "threads", SETTING_INTEGER, AT_LEAST_ONE, &scene->threads, NULL);
  add_choice(table, "backend", backends, &s->backend);
  add_choice(table, "precision", precisions, &scene->mixed);
  add(table, "pressure", SETTING_REAL, POSITIVE, &s->pressure, "isotropic biaxial triaxial simple-shear");
  add(table, "start", SETTING_REAL, POSITIVE, &s->start, "isotropic");
  add(table, "duration", SETTING_REAL, POSITIVE, &s->duration, "isotropic");
  add(table, "rate", SETTING_REAL, POSITIVE, &s->rate, "oedometer biaxial triaxial simple-shear");
  add(table, "strain", SETTING_REAL, POSITIVE, &s->strain, "oedometer biaxial triaxial simple-shear");
  add_real(table, "servo_rate", POSITIVE, &s->servo_rate);
  add(table, "servo_steps", SETTING_INTEGER, AT_LEAST_ONE, &s->servo_steps, NULL);
  add_real(table, "stress_tolerance", POSITIVE, &s->stress_tolerance);
  add_real(table, "approach_steps", AT_LEAST_ONE, &s->most_steps);
}

static BaseStatus read_choice(const Setting *setting, const char *text) {
  char list[128] = "";
  for (int k = 0; setting->words[k]; k++) {
    if (strcmp(text, setting->words[k]) == 0) {
      memcpy(setting->value, &k, sizeof k);
      return BASE_OK;
    }
    strcat(strcat(list, k ? ", " : ""), setting->words[k]);
  }
  return base_error(BASE_ERROR_ARGUMENT, "--set %s: found '%s'; allowed: %s", setting->name, text, list);
}

static BaseStatus read_value(const Setting *setting, const char *text) {
  char *end;
  if (setting->kind == SETTING_CHOICE) return read_choice(setting, text);
  const double number = strtod(text, &end);
  if (end == text || *end != '\0' || !isfinite(number) || !is_in_range(setting->range, number))
    return base_error(BASE_ERROR_ARGUMENT, "--set %s: found '%s'; allowed: %s", setting->name, text,
                      allowed(setting->range));
  if (setting->kind == SETTING_REAL) *(double *)setting->value = number;
  else if (number == floor(number) && fabs(number) <= 1e9) *(int *)setting->value = (int)number;
  else return base_error(BASE_ERROR_ARGUMENT, "--set %s: found '%s'; allowed: an integer up to 1e9", setting->name, text);
  return BASE_OK;
}

static Setting *find(Table *table, const char *name, size_t length) {
  for (int k = 0; k < table->count; k++)
    if (strlen(table->setting[k].name) == length && memcmp(table->setting[k].name, name, length) == 0)
      return &table->setting[k];
  return NULL;
}

static BaseStatus unknown(const Table *table, const char *word, size_t length) {
  char names[1024] = "";
  for (int k = 0; k < table->count; k++) {
    if (k) strcat(names, " ");
    strcat(names, table->setting[k].name);
  }
  return base_error(BASE_ERROR_ARGUMENT, "--set %.*s: unknown; there are: %s", (int)length, word, names);
}

static BaseStatus read_words(int words, char *const *word, Table *table) {
  for (int k = 0; k < words; k++) {
    const char *equal = strchr(word[k], '=');
    const size_t length = equal ? (size_t)(equal - word[k]) : strlen(word[k]);
    Setting *setting = find(table, word[k], length);
    if (!setting) return unknown(table, word[k], length < 40 ? length : 40);
    if (!equal) return base_error(BASE_ERROR_ARGUMENT, "--set %s: no value; write --set %s=VALUE", word[k], word[k]);
    if (setting->given++) return base_error(BASE_ERROR_ARGUMENT, "--set %s is given twice", setting->name);
    TRY(read_value(setting, equal + 1));
  }
  return BASE_OK;
}

static int is_given(Table *table, const char *name) { return find(table, name, strlen(name))->given > 0; }

static BaseStatus need(Table *table, const char *name, const char *meaning, const char *why) {
  if (is_given(table, name)) return BASE_OK;
  const Setting *setting = find(table, name, strlen(name));
  return base_error(BASE_ERROR_ARGUMENT, "--set %s=... is missing: %s%s (allowed: %s)", name, meaning, why,
                    allowed(setting->range));
}

static BaseStatus check_grains(Table *table, RveScene *scene) {
  TRY(need(table, "density", "of the grains' matter, kg/m3", ""));
  TRY(need(table, "kn", "normal stiffness of contacts, N/m", ""));
  TRY(need(table, "kt", "tangential stiffness of contacts, N/m", ", 0 = frictionless"));
  if (scene->tangential_stiffness > 0.0) TRY(need(table, "mu", "Coulomb's friction", " (kt > 0)"));
  if (scene->dimension == 2) TRY(need(table, "thickness", "depth of the packing, m", " (2D)"));
  else {
    if (is_given(table, "thickness")) return base_error(BASE_ERROR_ARGUMENT, "--set thickness is for dimension 2 only");
    if (scene->grain == RVE_DISK)
      return base_error(BASE_ERROR_ARGUMENT, "--set grain: found 'disk'; allowed in dimension 3: sphere");
  }
  if (is_given(table, "timestep") && is_given(table, "timestep_fraction"))
    return base_error(BASE_ERROR_ARGUMENT, "--set timestep and timestep_fraction exclude each other");
  return BASE_OK;
}

/* A setting that the model does not use is a mistake. */
static BaseStatus check_conduction(Table *table, RveScene *scene) {
  const GrainHeat *model = &scene->conduction;
  const GrainIndirect indirect = model->indirect;
  const int voronoi = indirect == GRAIN_INDIRECT_VORONOI_A || indirect == GRAIN_INDIRECT_VORONOI_B;
  const int has_model = model->direct != GRAIN_DIRECT_NONE || indirect != GRAIN_INDIRECT_NONE;
  const struct {
    const char *name, *needed;
    int used;
  } uses[] = {{"area", "direct", model->direct != GRAIN_DIRECT_NONE},
              {"fluid", "indirect", indirect != GRAIN_INDIRECT_NONE},
              {"porosity", "indirect=voronoi_a or voronoi_b", voronoi},
              {"reach", "indirect=voronoi_a or voronoi_b", voronoi},
              {"core", "indirect=voronoi_b", indirect == GRAIN_INDIRECT_VORONOI_B},
              {"layer", "indirect=layer", indirect == GRAIN_INDIRECT_LAYER},
              {"minimum_gap", "indirect=layer", indirect == GRAIN_INDIRECT_LAYER},
              {"grain_conductivity", "direct or indirect", has_model},
              {"conductivity", "heat: expansion, Tref, and alpha or a conduction model", scene->thermal},
              {"conductivity_every", "heat: expansion, Tref, and alpha or a conduction model", scene->thermal},
              {"network_change", "conductivity=network", scene->network}};
  for (size_t k = 0; k < sizeof uses / sizeof *uses; k++)
    if (is_given(table, uses[k].name) && !uses[k].used)
      return base_error(BASE_ERROR_ARGUMENT, "--set %s needs %s", uses[k].name, uses[k].needed);
  if (!has_model) return BASE_OK;
  if (is_given(table, "alpha"))
    return base_error(BASE_ERROR_ARGUMENT, "--set alpha (heat pipes) and direct or indirect exclude each other");
  if (indirect != GRAIN_INDIRECT_NONE) TRY(need(table, "fluid", "conductivity of the fluid, W/(m K)", " (indirect)"));
  return need(table, "grain_conductivity", "of the grains' matter, W/(m K)", " (direct or indirect)");
}

static BaseStatus check_heat_and_bonds(Table *table, RveScene *scene) {
  static const char *const heat[3] = {"expansion", "Tref", "alpha"};
  static const char *const meaning[3] = {"linear expansion of the grains, 1/K",
                                         "temperature at which the packing's radii hold",
                                         "resistance of a heat pipe per length, K/(W m)"};
  const int pipes = scene->conduction.direct == GRAIN_DIRECT_NONE && scene->conduction.indirect == GRAIN_INDIRECT_NONE;
  scene->thermal = !pipes;
  for (int k = 0; k < 3; k++) scene->thermal |= is_given(table, heat[k]);
  for (int k = 0; k < 2 + pipes && scene->thermal; k++) TRY(need(table, heat[k], meaning[k], " (heat)"));
  TRY(check_conduction(table, scene));
  if (!scene->thermal) scene->reference_temperature = 0.0;
  scene->bonds = is_given(table, "bond_strength");
  if (!scene->bonds && (is_given(table, "bond_shear_ratio") || is_given(table, "bond_melting")))
    TRY(need(table, "bond_strength", "F_n = B kn (Ri + Rj)/2", " (bonds)"));
  if (!scene->bonds) {
    scene->bond_strength = 0.0;
    return BASE_OK;
  }
  TRY(need(table, "bond_shear_ratio", "shear over tensile strength", " (bonds)"));
  if (is_given(table, "bond_melting") && !scene->thermal)
    return base_error(BASE_ERROR_ARGUMENT, "--set bond_melting needs heat: expansion, Tref and alpha");
  return BASE_OK;
}

/* The settings of built-in paths: those that belong to another path are refused. */
static BaseStatus check_path(Table *table, const char *path) {
  for (int k = 0; k < table->count; k++) {
    const Setting *setting = &table->setting[k];
    if (!setting->given || !setting->paths) continue;
    if (!path)
      return base_error(BASE_ERROR_ARGUMENT, "--set %s is for the paths %s; the path file says it itself", setting->name,
                        setting->paths);
    const char *at = strstr(setting->paths, path);
    if (!at) return base_error(BASE_ERROR_ARGUMENT, "--set %s is for the paths %s, not for %s", setting->name,
                               setting->paths, path);
  }
  if (!path) return BASE_OK;
  if (strcmp(path, "isotropic") == 0) {
    TRY(need(table, "pressure", "pressure at the end, Pa", " (path isotropic)"));
    return need(table, "duration", "time that the pressure takes to get there, s", " (path isotropic)");
  }
  if (strcmp(path, "biaxial") == 0 || strcmp(path, "triaxial") == 0)
    TRY(need(table, "pressure", "lateral pressure, Pa", ""));
  TRY(need(table, "rate", "of compression or shear, 1/s", ""));
  return need(table, "strain", "at the end", "");
}

BaseStatus element_settings_read(int words, char *const *word, const char *path, ElementSettings *settings) {
  Table table;
  fill_table(settings, &table);
  TRY(read_words(words, word, &table));
  TRY(check_grains(&table, &settings->scene));
  TRY(check_heat_and_bonds(&table, &settings->scene));
  TRY(check_path(&table, path));
  return rve_scene_check(&settings->scene);
}
