/* SPDX-License-Identifier: GPL-2.0-or-later */
/* dempm-rve: one packing through a loading path (an element test), and failures of packings repeated. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <math.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "../base/tensor.h"
#include "rve_element.h"
#include "rve_packing.h"
#include "rve_replay.h"

static const char usage[] =
    "dempm-rve run PACKING --path PATH --dimension 2|3 --out FILE.csv --set NAME=VALUE ...   an element test\n"
    "  PACKING: LIGGGHTS data file, text dump, restart, or a packing of dempm\n"
    "  PATH:    FILE.csv (columns time and Lxx ... Lzz, sxx ... syz, T), isotropic, oedometer, biaxial, triaxial,\n"
    "           simple-shear\n"
    "  --set    required: density kn kt mu thickness (2D); of paths: pressure rate strain duration start\n"
    "           optional: grain gamman gammat damping/local damping/viscous rotation precision expansion Tref alpha\n"
    "           direct area indirect fluid porosity core reach layer minimum_gap grain_conductivity\n"
    "           conductivity network_change conductivity_every\n"
    "           bond_strength bond_shear_ratio bond_melting timestep timestep_fraction substeps skin threads\n"
    "           backend servo_rate servo_steps stress_tolerance approach_steps\n"
    "  --every N     a line of the answer every N DEM steps (else 200 lines)\n"
    "  --copies N    N copies of the packing, and their speed\n"
    "  --plot FILE   a picture of the answer (PNG, PDF, SVG); needs python3 with matplotlib\n"
    "dempm-rve replay FILE.replay [--out FILE.csv] [--every N]    repeats the failure of a packing\n";

extern char **environ;

typedef struct Arguments {
  const char *file; /* packing or replay */
  const char *path, *out, *plot;
  double dimension, copies, every; /* NAN: not given */
  int sets;
  char **set; /* [sets] */
} Arguments;

/* ------------------------------------------------------------------------------------------------------ arguments */

static BaseStatus read_whole(const char *option, const char *text, double low, double high, double *value) {
  char *end;
  const double number = strtod(text, &end);
  if (end == text || *end != '\0' || !(number >= low && number <= high) || number != floor(number))
    return base_error(BASE_ERROR_ARGUMENT, "%s: found '%s'; an integer from %.9g to %.9g is needed", option, text, low,
                      high);
  *value = number;
  return BASE_OK;
}

static BaseStatus take_text(const char *option, const char *text, const char **value) {
  if (*value) return base_error(BASE_ERROR_ARGUMENT, "%s is given twice", option);
  if (!*text) return base_error(BASE_ERROR_ARGUMENT, "%s: an empty name", option);
  *value = text;
  return BASE_OK;
}

static BaseStatus take_number(const char *option, const char *text, double low, double high, double *value) {
  if (!isnan(*value)) return base_error(BASE_ERROR_ARGUMENT, "%s is given twice", option);
  return read_whole(option, text, low, high, value);
}

static BaseStatus read_option(const char *option, char *text, int replay, Arguments *a) {
  if (strcmp(option, "--out") == 0) return take_text(option, text, &a->out);
  if (strcmp(option, "--every") == 0) return take_number(option, text, 1.0, 1e12, &a->every);
  if (replay) return base_error(BASE_ERROR_ARGUMENT, "unknown option '%s'; replay has --out and --every", option);
  if (strcmp(option, "--path") == 0) return take_text(option, text, &a->path);
  if (strcmp(option, "--plot") == 0) return take_text(option, text, &a->plot);
  if (strcmp(option, "--dimension") == 0) return take_number(option, text, 2.0, 3.0, &a->dimension);
  if (strcmp(option, "--copies") == 0) return take_number(option, text, 1.0, 1e6, &a->copies);
  if (strcmp(option, "--set") != 0)
    return base_error(BASE_ERROR_ARGUMENT,
                      "unknown option '%s'; there are --path --dimension --out --set --every --copies --plot", option);
  a->set[a->sets++] = text;
  return BASE_OK;
}

static BaseStatus read_arguments(int count, char **text, int replay, Arguments *a) {
  *a = (Arguments){.dimension = NAN, .copies = NAN, .every = NAN};
  TRY(BASE_ALLOC((size_t)count + 1, &a->set));
  for (int at = 0; at < count; at++) {
    if (text[at][0] != '-') {
      if (a->file) return base_error(BASE_ERROR_ARGUMENT, "'%s' and '%s': one file is allowed", a->file, text[at]);
      a->file = text[at];
      continue;
    }
    if (at + 1 == count) return base_error(BASE_ERROR_ARGUMENT, "%s: a value must follow", text[at]);
    TRY(read_option(text[at], text[at + 1], replay, a));
    at++;
  }
  if (!a->file) return base_error(BASE_ERROR_ARGUMENT, "the name of a %s file is missing", replay ? "replay" : "packing");
  if (replay) return BASE_OK;
  if (!a->path)
    return base_error(BASE_ERROR_ARGUMENT, "--path is missing (allowed: FILE.csv, %s)", element_path_names);
  if (isnan(a->dimension)) return base_error(BASE_ERROR_ARGUMENT, "--dimension is missing (allowed: 2 or 3)");
  if (!a->out) return base_error(BASE_ERROR_ARGUMENT, "--out is missing: the file that the answer goes to");
  return BASE_OK;
}

static BaseStatus open_out(const char *name, FILE **out) {
  *out = fopen(name, "w");
  return *out ? BASE_OK : base_error(BASE_ERROR_FILE, "cannot open %s for writing: %s", name, strerror(errno));
}

static BaseStatus close_out(const char *name, FILE *out, BaseStatus status) {
  const int bad = ferror(out) != 0;
  if ((fclose(out) != 0 || bad) && status == BASE_OK)
    return base_error(BASE_ERROR_FILE, "cannot write %s: %s", name, strerror(errno));
  return status;
}

/* ------------------------------------------------------------------------------------------------------------ plot */

/* Beside the sources (build/dempm-rve), or where `make install` puts it. */
static BaseStatus find_script(size_t room, char *name) {
  static const char *const places[] = {"../examples/element_tests/plot.py", "../../examples/element_tests/plot.py",
                                       "../share/dempm/element_plot.py"};
  char program[1024];
  const ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
  if (length > 0) {
    program[length] = '\0';
    char *slash = strrchr(program, '/');
    if (slash) slash[1] = '\0';
    for (size_t k = 0; k < sizeof places / sizeof *places; k++)
      if (snprintf(name, room, "%s%s", program, places[k]) < (int)room && access(name, R_OK) == 0) return BASE_OK;
  }
  return base_error(BASE_ERROR_FILE,
                    "--plot: element_tests/plot.py is not beside the program; run it yourself: plot.py ANSWER.csv --out "
                    "PICTURE");
}

static BaseStatus plot(const char *answer, const char *picture) {
  char script[2048];
  const char *wanted = getenv("PYTHON"), *debian = "/usr/bin/python3"; /* another one in PATH may lack matplotlib */
  const char *python = wanted && *wanted ? wanted : access(debian, X_OK) == 0 ? debian : "python3";
  TRY(find_script(sizeof script, script));
  char *const words[] = {(char *)python, script, (char *)answer, (char *)"--out", (char *)picture, NULL};
  pid_t child;
  int state = 0;
  const int error = posix_spawnp(&child, python, NULL, NULL, words, environ);
  if (error)
    return base_error(BASE_ERROR_FILE, "--plot: cannot start %s: %s (Debian: python3, python3-matplotlib)", python,
                      strerror(error));
  while (waitpid(child, &state, 0) < 0)
    if (errno != EINTR) return base_error(BASE_ERROR_FILE, "--plot: %s", strerror(errno));
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) return BASE_OK;
  return base_error(BASE_ERROR_FILE, "--plot: %s %s failed, see above; the answer is in %s", python, script, answer);
}

/* ------------------------------------------------------------------------------------------------------------- run */

static BaseStatus make_path(const Arguments *a, const ElementSettings *settings, RveBatch *batch, ElementPath *path) {
  RveInput input;
  RveAnswer answer;
  memset(path, 0, sizeof *path);
  if (!element_path_is_builtin(a->path)) return element_path_read(a->path, &settings->scene, path);
  memset(&input, 0, sizeof input);
  TRY(rve_batch_step(batch, 1, NULL, &input, 0.0, &answer));
  return element_path_make(a->path, settings, answer.stress, path);
}

static void report(const Arguments *a, const RvePacking *packing, const RveBatch *batch, RveBackend asked, const ElementPath *path,
                   const ElementFigures *f) {
  const int dim = packing->dimension;
  printf("packing          %s: %d grains\n", a->file, packing->grains);
  printf("path             %s: %.6g s\n", a->path, path->row[path->rows - 1].time);
  if (f->approach_steps > 0) {
    printf("approach         %lld DEM steps, %.4g s, F =", (long long)f->approach_steps, f->approach_time);
    for (int i = 0; i < dim; i++)
      for (int j = 0; j < dim; j++) printf(" %.6g", f->approach[3 * i + j]);
    printf("\n");
  }
  printf("stress control   worst deviation %.3g of the largest stress asked for\n", f->worst_stress);
  printf("overlap          at most %.3g of the smaller radius%s\n", f->worst_overlap,
         f->worst_overlap > 0.3 ? ": more than linear contacts are meant for (0.3)" : "");
  printf("answer           %s: %d lines\n", a->out, f->lines);
  int64_t solved, kept;
  rve_batch_network_counts(batch, &solved, &kept);
  if (solved > 0)
    printf("conductivity     networks: %lld solved, %lld carried along\n", (long long)solved, (long long)kept);
  printf("backend          %s, %d %s%s\n", rve_batch_backend_name(batch), rve_batch_count(batch),
         rve_batch_count(batch) == 1 ? "copy" : "copies",
         asked == RVE_BACKEND_CUDA && !rve_batch_is_on_device(batch) ? ": the GPU's memory is too small" : "");
  printf("speed            %.4g particle-steps in %.3f s: %.4g particle-steps/s\n", f->particle_steps, f->seconds,
         f->seconds > 0.0 ? f->particle_steps / f->seconds : 0.0);
}

static BaseStatus run_batch(const Arguments *a, const ElementSettings *settings, const RvePacking *packing,
                            RveBatch *batch) {
  ElementPath path;
  ElementFigures figures;
  FILE *out = NULL;
  char replay[1024];
  if (settings->scene.bonds) TRY(rve_batch_install_bonds(batch, 0, NULL));
  TRY(make_path(a, settings, batch, &path));
  snprintf(replay, sizeof replay, "%s.replay", a->out);
  BaseStatus status = open_out(a->out, &out);
  if (status == BASE_OK) {
    const ElementRun run = {.settings = settings,
                            .path = &path,
                            .copies = rve_batch_count(batch),
                            .every = isnan(a->every) ? 0 : (int64_t)a->every,
                            .out = out,
                            .replay_file = replay};
    status = close_out(a->out, out, element_run(&run, packing, batch, &figures));
  }
  if (status == BASE_OK) report(a, packing, batch, settings->backend, &path, &figures);
  element_path_destroy(&path);
  if (status == BASE_OK && a->plot) {
    fflush(stdout);
    status = plot(a->out, a->plot);
  }
  return status;
}

static BaseStatus check_time_step(const ElementSettings *settings, const RvePacking *packing) {
  const double critical = rve_critical_time_step(&settings->scene, packing);
  if (settings->scene.time_step <= critical) return BASE_OK;
  return base_error(BASE_ERROR_ARGUMENT, "--set timestep: found '%g'; allowed: at most the critical one, %.6g s",
                    settings->scene.time_step, critical);
}

static BaseStatus run(const Arguments *a) {
  const int dimension = (int)a->dimension;
  ElementSettings settings = element_settings_default(dimension);
  RvePacking packing = {0};
  RveBatch *batch = NULL;
  BaseStatus status;
  TRY(element_settings_read(a->sets, a->set, element_path_is_builtin(a->path) ? a->path : NULL, &settings));
  TRY(rve_packing_read_history(a->file, dimension, settings.scene.tangential_stiffness, &packing));
  const int copies = isnan(a->copies) ? 1 : (int)a->copies;
  settings.scene.share = 0; /* copies are for timing */
  if (copies == 1) settings.scene.threads = 1; /* a packing runs on one thread: others would only wait for it */
  TRY_GOTO(check_time_step(&settings, &packing), status, done);
  TRY_GOTO(rve_batch_create(&settings.scene, &packing, 1, NULL, copies, settings.backend, &batch), status, done);
  status = run_batch(a, &settings, &packing, batch);
done:
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  return status;
}

/* ---------------------------------------------------------------------------------------------------------- replay */

static void print_failure(const char *when, const RveFailure *failure) {
  printf("%s DEM step %lld (%lld of %lld of the call): %s\n", when, (long long)failure->step,
         (long long)failure->call_step, (long long)failure->call_steps, failure->cause);
}

static BaseStatus replay_line(FILE *out, const RveReplay *replay, const RveBatch *batch, const RveAnswer *answer,
                              const double gradient[9], double time, double *overlap) {
  ElementState state = {.time = time,
                        .temperature = replay->input.temperature,
                        .heat = answer->heat,
                        .answer = *answer,
                        .friction_work = answer->friction_work,
                        .damping_work = answer->damping_work};
  memcpy(state.gradient, gradient, sizeof state.gradient);
  TRY(element_overlap(batch, overlap));
  state.overlap = *overlap;
  element_table_line(out, &replay->scene, &state);
  return BASE_OK;
}

/* The same call in calls of one DEM step each, to see what grows. */
static BaseStatus replay_slowly(const RveReplay *replay, RveBatch *batch, int64_t every, FILE *out, RveFailure *failure) {
  const int64_t steps = replay->failure.call_steps;
  RveInput input = replay->input;
  RveAnswer answer;
  BaseStatus status = BASE_OK;
  double gradient[9], overlap = 0.0;
  const double duration = replay->duration / (double)steps;
  if (every == 0) every = steps > 1000 ? steps / 1000 : 1;
  element_table_head(out, &replay->scene);
  for (int64_t k = 1; k <= steps && status == BASE_OK; k++) {
    status = rve_batch_step(batch, 1, NULL, &input, duration, &answer);
    tensor_exponential(input.velocity_gradient, duration * (double)k, gradient);
    if (k % every && status == BASE_OK) continue;
    TRY(replay_line(out, replay, batch, &answer, gradient, duration * (double)k, &overlap));
  }
  if (status != BASE_ERROR_UNSTABLE) return status;
  TRY(rve_batch_failure(batch, 0, failure));
  failure->call_step = failure->step - (replay->failure.step - replay->failure.call_step);
  failure->call_steps = steps;
  return BASE_OK;
}

static BaseStatus repeat(const RveReplay *replay, const Arguments *a, RveFailure *failure) {
  RveBatch *batch;
  RveAnswer answer;
  FILE *out;
  RveScene scene = replay->scene;
  const int slowly = a->out && replay->failure.call_steps > 0;
  scene.threads = 1;
  if (slowly && scene.substeps > 0) scene.substeps = 1;
  TRY(rve_replay_start(replay, &scene, &batch));
  printf("backend          %s, the failing run had %s%s\n", rve_batch_backend_name(batch), replay->backend,
         strcmp(replay->backend, rve_batch_backend_name(batch)) ? ": the failure may come at another step" : "");
  BaseStatus status = BASE_OK;
  if (slowly) {
    status = open_out(a->out, &out);
    if (status == BASE_OK)
      status = close_out(a->out, out, replay_slowly(replay, batch, isnan(a->every) ? 0 : (int64_t)a->every, out, failure));
  } else {
    status = rve_batch_step(batch, 1, NULL, &replay->input, replay->duration, &answer);
    if (status == BASE_ERROR_UNSTABLE) status = rve_batch_failure(batch, 0, failure);
  }
  rve_batch_destroy(batch);
  return status;
}

static BaseStatus replay(const Arguments *a) {
  RveReplay stored;
  RveFailure failure;
  memset(&failure, 0, sizeof failure);
  TRY(rve_replay_read(a->file, &stored));
  printf("packing          %s\n", *stored.name ? stored.name : "without a name");
  printf("velocity gradient");
  for (int k = 0; k < 9; k++) printf(" %.6g", stored.input.velocity_gradient[k]);
  printf(" 1/s for %.6g s\n", stored.duration);
  print_failure("recorded        ", &stored.failure);
  BaseStatus status = repeat(&stored, a, &failure);
  if (status == BASE_OK && failure.step > 0) {
    print_failure("replayed        ", &failure);
    printf("the failure %s\n", failure.step == stored.failure.step ? "is repeated at the same step" : "came at another step");
  } else if (status == BASE_OK)
    status = base_error(BASE_ERROR_UNSTABLE, "the failure is not repeated: the call ended well");
  rve_replay_destroy(&stored);
  return status;
}

int main(int count, char **text) {
  const int is_replay = count >= 2 && strcmp(text[1], "replay") == 0;
  if (count < 3 || (!is_replay && strcmp(text[1], "run") != 0)) {
    const int asked =
        count == 2 && (strcmp(text[1], "help") == 0 || strcmp(text[1], "-h") == 0 || strcmp(text[1], "--help") == 0);
    fputs(usage, asked ? stdout : stderr);
    return asked ? 0 : 2;
  }
  Arguments arguments;
  BaseStatus status = read_arguments(count - 2, text + 2, is_replay, &arguments);
  if (status == BASE_OK) status = is_replay ? replay(&arguments) : run(&arguments);
  base_free(arguments.set);
  if (status == BASE_OK) return 0;
  fflush(stdout);
  fprintf(stderr, "dempm-rve: ERROR: %s\n", base_error_message());
  return 1;
}
