/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A packing through a loading path. Velocity gradients are passed on; stresses are held by a proportional and integral
 * servo. Its plant is the packing: d sigma/dt = C D, C unknown but bounded by the affine modulus M that every answer
 * reports, so the gains follow from M and a time tau: D = I - e / (M tau), dI/dt = -e / (M 4 tau tau), e = sigma -
 * wanted. tau is a quarter of the time of a compression wave through the cell, at least two calls. A packing that has
 * become softer than M (g = C/M) is damped by sqrt(g): 0.3 at g = 0.1. Measured on biaxial tests of 400 disks at an
 * inertial number of 6e-4, dense and loose, local damping 0 to 0.7: running mean of the stress within 2 %; with the whole
 * wave time 7 %, with an eighth 1 %, but there two calls are longer. */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "rve_element.h"
#include "rve_replay.h"

static const double wave_share = 0.25, integral_time = 4.0; /* tau over the wave's time; over tau */
static const double approach_share = 0.25;                  /* of the tolerance */

typedef struct Servo {
  int active[6];
  double wanted[6];    /* Pa */
  double slope[6];     /* of wanted, Pa/s */
  double integral[6];  /* part of D, 1/s */
  double feed[6];      /* part of D that foresees the prescribed strain, 1/s */
  double deviation[6]; /* running mean of sigma - wanted, Pa */
  double scale;        /* Pa: what deviations are compared with */
  double fastest;      /* 1/s */
  double last[6];      /* D asked for */
} Servo;

typedef struct Driver {
  const ElementRun *run;
  const RveScene *scene;
  RveBatch *batch;
  ElementFigures *figures;
  RveInput *input;   /* [copies] */
  RveAnswer *answer; /* [copies] */
  double time_step;  /* s, of the DEM */
  double diameter;   /* m, mean */
  double gradient[9];
  double friction, damping; /* J at time 0 */
  double friction_last;     /* J at the last line */
  double time, time_last;
  double overlap; /* of the last line */
  double temperature;
  Servo servo;
} Driver;

/* ----------------------------------------------------------------------------------------------------------- calls */

static BaseStatus compare_copies(const Driver *d) {
  for (int k = 1; k < d->run->copies; k++)
    if (memcmp(&d->answer[k], &d->answer[0], sizeof *d->answer) != 0)
      return base_error(BASE_ERROR_UNSTABLE, "copies 1 and %d of the packing answer differently: a defect of the engine",
                        k + 1);
  return BASE_OK;
}

static void deform(double gradient[9], const double rate[9], double duration) {
  double step[9], product[9];
  tensor_exponential(rate, duration, step);
  tensor_multiply(step, gradient, product);
  memcpy(gradient, product, sizeof product);
}

/* After a failure: the message says where the replay is. */
static BaseStatus failed(const Driver *d, BaseStatus status) {
  char text[1024];
  snprintf(text, sizeof text, "%s", base_error_message());
  if (status != BASE_ERROR_UNSTABLE || !d->run->replay_file) return status;
  if (rve_batch_write_replay(d->batch, 0, NULL, d->run->replay_file) == BASE_OK)
    return base_error(status, "at time %g s: %s. Repeat it with: dempm-rve replay %s", d->time, text,
                      d->run->replay_file);
  return base_error(status, "at time %g s: %s", d->time, text);
}

static BaseStatus call(Driver *d, const double rate[9], double temperature, double duration) {
  for (int k = 0; k < d->run->copies; k++) {
    memcpy(d->input[k].velocity_gradient, rate, 9 * sizeof *rate);
    d->input[k].temperature = temperature;
  }
  const int64_t steps = d->answer[0].steps;
  const double start = base_seconds();
  const BaseStatus status = rve_batch_step(d->batch, d->run->copies, NULL, d->input, duration, d->answer);
  if (duration > 0.0) d->figures->seconds += base_seconds() - start;
  if (status != BASE_OK) return failed(d, status);
  if (d->scene->thermal) d->temperature = temperature;
  d->figures->particle_steps += (double)(d->answer[0].steps - steps) * d->run->copies;
  deform(d->gradient, rate, duration);
  return compare_copies(d);
}

static BaseStatus write_line(Driver *d) {
  const RveAnswer *answer = &d->answer[0];
  const double span = d->time - d->time_last;
  ElementState state = {.time = d->time,
                        .temperature = d->temperature,
                        .answer = *answer,
                        .friction_work = answer->friction_work - d->friction,
                        .damping_work = answer->damping_work - d->damping};
  memcpy(state.gradient, d->gradient, sizeof state.gradient);
  if (span > 0.0) state.heat = (answer->friction_work - d->friction_last) / (answer->volume * span);
  d->friction_last = answer->friction_work;
  d->time_last = d->time;
  TRY(element_overlap(d->batch, &d->overlap));
  state.overlap = d->overlap;
  d->figures->worst_overlap = fmax(d->figures->worst_overlap, d->overlap);
  element_table_line(d->run->out, d->scene, &state);
  d->figures->lines++;
  return BASE_OK;
}

/* ----------------------------------------------------------------------------------------------------------- servo */

static int is_controlled(const Servo *servo) {
  int any = 0;
  for (int k = 0; k < 6; k++) any |= servo->active[k];
  return any;
}

static double reaction_time(const Driver *d, double modulus, double duration) {
  const RveAnswer *answer = &d->answer[0];
  const double depth = d->scene->dimension == 2 ? d->scene->thickness : 1.0;
  const double edge = pow(answer->volume / depth, 1.0 / d->scene->dimension);
  return fmax(wave_share * edge * sqrt(d->scene->density * answer->solid_fraction / modulus), 2.0 * duration);
}

/* What an isotropic packing with the affine moduli C11 = M, C12 = C44 = M/3 would need so that the wanted stresses keep
 * their slope: at a corner of the path the integral would learn it too late. */
static void foresee(const Driver *d, const double rate[9], double modulus, double feed[6]) {
  const Servo *servo = &d->servo;
  const int n = d->scene->dimension;
  double prescribed = 0.0, slopes = 0.0, controlled = 0.0;
  int count = 0;
  for (int k = 0; k < n; k++) {
    if (servo->active[k]) slopes += servo->slope[k] / modulus, count++;
    else prescribed += rate[4 * k];
  }
  if (count) controlled = (3.0 * slopes - count * prescribed) / (2.0 + count);
  for (int k = 0; k < 6; k++) {
    feed[k] = 0.0;
    if (!servo->active[k]) continue;
    feed[k] = k < 3 ? 1.5 * servo->slope[k] / modulus - 0.5 * (controlled + prescribed) : 1.5 * servo->slope[k] / modulus;
  }
}

/* Adds the servo's strain rates to `rate`. duration: of the call that will follow. */
static void ask(Driver *d, double duration, double rate[9]) {
  Servo *servo = &d->servo;
  const RveAnswer *answer = &d->answer[0];
  const double modulus = fmax(answer->modulus, servo->scale); /* without contacts: closes at the fastest rate */
  if (!(modulus > 0.0)) return;
  const double tau = reaction_time(d, modulus, duration);
  double feed[6];
  foresee(d, rate, modulus, feed);
  for (int k = 0; k < 6; k++) {
    if (!servo->active[k]) continue;
    const double lack = answer->stress[k] - servo->wanted[k];
    servo->integral[k] += feed[k] - servo->feed[k];
    servo->feed[k] = feed[k];
    const double integral = servo->integral[k] - lack / (modulus * integral_time * tau * tau) * duration;
    const double asked = integral - lack / (modulus * tau);
    if (fabs(asked) <= servo->fastest) servo->integral[k] = integral; /* else it would wind up */
    else servo->integral[k] = fmax(-servo->fastest, fmin(servo->fastest, servo->integral[k]));
    servo->last[k] = fmax(-servo->fastest, fmin(servo->fastest, asked));
    const int i = element_row[k], j = element_column[k];
    rate[3 * i + j] = rate[3 * j + i] = servo->last[k];
  }
}

/* Starts to hold `stress` (NAN: free); components that were held before keep what they have learnt. */
static void take_control(Driver *d, const double stress[6]) {
  Servo *servo = &d->servo;
  for (int k = 0; k < 6; k++) {
    const int now = !isnan(stress[k]);
    if (!now || !servo->active[k]) servo->integral[k] = servo->feed[k] = servo->deviation[k] = servo->last[k] = 0.0;
    servo->active[k] = now;
    servo->wanted[k] = now ? stress[k] : 0.0;
    servo->slope[k] = 0.0;
  }
}

/* Fastest strain rate: ten times the path's own, or an inertial number of 1e-3. */
static void set_scale(Driver *d, const double low[6], const double high[6], const double rate[9]) {
  Servo *servo = &d->servo;
  double path = 0.0;
  servo->scale = 0.0;
  for (int k = 0; k < 6; k++) {
    if (!isnan(low[k])) servo->scale = fmax(servo->scale, fabs(low[k]));
    if (!isnan(high[k])) servo->scale = fmax(servo->scale, fabs(high[k]));
  }
  if (servo->scale == 0.0)
    for (int k = 0; k < 3; k++) servo->scale = fmax(servo->scale, fabs(d->answer[0].stress[k]));
  for (int k = 0; k < 9; k++) path = fmax(path, fabs(rate[k]));
  servo->fastest = d->run->settings->servo_rate;
  if (isnan(servo->fastest))
    servo->fastest = fmax(10.0 * path, 1e-3 / (d->diameter * sqrt(d->scene->density / fmax(servo->scale, 1e-30))));
}

/* Worst |sigma - wanted| over the scale; *which: its component. */
static double worst(const Servo *servo, const double deviation[6], int *which) {
  double largest = 0.0;
  *which = 0;
  for (int k = 0; k < 6; k++)
    if (servo->active[k] && fabs(deviation[k]) > largest * servo->scale)
      largest = fabs(deviation[k]) / servo->scale, *which = k;
  return largest;
}

static BaseStatus not_followed(const Driver *d, int k, const char *phase) {
  const Servo *servo = &d->servo;
  return base_error(BASE_ERROR_UNSTABLE,
                    "the stress s%c%c cannot be followed %s: at time %g s it is %g Pa (mean deviation %g Pa), asked for "
                    "are %g Pa +- %g Pa (--set stress_tolerance=%g); the servo strains by %g 1/s, at most %g 1/s is "
                    "allowed (--set servo_rate)",
                    element_axis[element_row[k]], element_axis[element_column[k]], phase, d->time,
                    d->answer[0].stress[k], servo->deviation[k], servo->wanted[k],
                    servo->scale * d->run->settings->stress_tolerance, d->run->settings->stress_tolerance,
                    servo->last[k], servo->fastest);
}

/* An avalanche of grains must not end a test: the mean over 40 tau counts. */
static BaseStatus watch_stress(Driver *d, double duration) {
  Servo *servo = &d->servo;
  const double modulus = fmax(d->answer[0].modulus, servo->scale);
  if (!(modulus > 0.0)) return BASE_OK;
  const double tau = reaction_time(d, modulus, duration), weight = 1.0 - exp(-duration / (40.0 * tau));
  int which;
  for (int k = 0; k < 6; k++)
    if (servo->active[k])
      servo->deviation[k] += weight * (d->answer[0].stress[k] - servo->wanted[k] - servo->deviation[k]);
  const double now = worst(servo, servo->deviation, &which);
  d->figures->worst_stress = fmax(d->figures->worst_stress, now);
  return now <= d->run->settings->stress_tolerance ? BASE_OK : not_followed(d, which, "along the path");
}

/* ------------------------------------------------------------------------------------------------------------ path */

/* Brings the packing to the stresses at which the path begins, before time runs. */
static BaseStatus approach(Driver *d) {
  enum { CALLS_HELD = 20 };
  static const double still[9] = {0.0};
  const double *target = d->run->path->approach;
  const ElementSettings *settings = d->run->settings;
  const int64_t from = d->answer[0].steps;
  const double duration = (settings->servo_steps - 0.5) * d->time_step, tolerance = approach_share * settings->stress_tolerance;
  take_control(d, target);
  if (!is_controlled(&d->servo)) return BASE_OK;
  set_scale(d, target, target, still);
  for (int held = 0; held < CALLS_HELD;) {
    double rate[9] = {0.0}, deviation[6];
    int which;
    ask(d, duration, rate);
    TRY(call(d, rate, d->temperature, duration));
    d->figures->approach_time += duration;
    for (int k = 0; k < 6; k++) deviation[k] = d->servo.active[k] ? d->answer[0].stress[k] - target[k] : 0.0;
    held = worst(&d->servo, deviation, &which) <= tolerance ? held + 1 : 0;
    memcpy(d->servo.deviation, deviation, sizeof deviation);
    if (held == 0 && (double)(d->answer[0].steps - from) > settings->most_steps)
      return not_followed(d, which, "before the path begins (--set approach_steps)");
  }
  d->figures->approach_steps = d->answer[0].steps - from;
  memcpy(d->figures->approach, d->gradient, sizeof d->gradient);
  memset(d->servo.deviation, 0, sizeof d->servo.deviation);
  return BASE_OK;
}

/* From the state at d->time to `end`, within one row. */
static BaseStatus advance(Driver *d, const ElementRow *row, const ElementRow *next, double end) {
  const ElementSettings *settings = d->run->settings;
  const double begin = d->time, span = end - begin;
  double nominal = span;
  if (d->scene->substeps > 0) nominal = span / (double)(d->run->every > 0 ? d->run->every : 1);
  else if (is_controlled(&d->servo)) nominal = settings->servo_steps * d->time_step;
  const int64_t calls = (int64_t)fmax(1.0, ceil(span / nominal * (1.0 - 1e-9)));
  for (int64_t c = 0; c < calls; c++) {
    const double after = c + 1 == calls ? end : begin + span * (double)(c + 1) / (double)calls;
    const double part = (after - row->time) / (next->time - row->time);
    double rate[9], temperature = d->temperature;
    memcpy(rate, row->gradient, sizeof rate);
    for (int k = 0; k < 6; k++)
      if (d->servo.active[k]) d->servo.wanted[k] = row->stress[k] + d->servo.slope[k] * (after - row->time);
    if (d->scene->thermal && !isnan(row->temperature))
      temperature = row->temperature + (next->temperature - row->temperature) * part;
    if (is_controlled(&d->servo)) ask(d, span / (double)calls, rate);
    TRY(call(d, rate, temperature, span / (double)calls));
    d->time = after;
    if (is_controlled(&d->servo)) TRY(watch_stress(d, span / (double)calls));
  }
  return BASE_OK;
}

/* The last line of a run that failed, without touching its message. */
static BaseStatus end_early(Driver *d, BaseStatus status) {
  char text[1024];
  snprintf(text, sizeof text, "%s", base_error_message());
  (void)write_line(d);
  return base_error(status, "%s", text);
}

static BaseStatus run_row(Driver *d, const ElementRow *row, const ElementRow *next, double line) {
  const double span = next->time - row->time;
  const int64_t pieces = (int64_t)fmax(1.0, rint(span / line));
  take_control(d, row->stress);
  set_scale(d, row->stress, next->stress, row->gradient);
  for (int k = 0; k < 6; k++)
    if (d->servo.active[k] && !isnan(next->stress[k])) d->servo.slope[k] = (next->stress[k] - row->stress[k]) / span;
  for (int64_t p = 0; p < pieces; p++) {
    const double end = p + 1 == pieces ? next->time : row->time + span * (double)(p + 1) / (double)pieces;
    const BaseStatus status = advance(d, row, next, end);
    if (status == BASE_OK) TRY(write_line(d));
    else return end_early(d, status);
  }
  return BASE_OK;
}

static BaseStatus run_path(Driver *d) {
  const ElementPath *path = d->run->path;
  static const double still[9] = {0.0};
  tensor_identity(d->gradient);
  TRY(call(d, still, d->temperature, 0.0));
  TRY(approach(d));
  tensor_identity(d->gradient);
  d->friction = d->friction_last = d->answer[0].friction_work;
  d->damping = d->answer[0].damping_work;
  if (d->scene->thermal && !isnan(path->row[0].temperature) && path->row[0].temperature != d->temperature)
    TRY(call(d, still, path->row[0].temperature, d->time_step));
  element_table_head(d->run->out, d->scene);
  TRY(write_line(d));
  const double whole = path->row[path->rows - 1].time;
  const int by_steps = d->run->every > 0 && d->scene->substeps == 0;
  const double line = by_steps ? (double)d->run->every * d->time_step : whole / 200.0;
  for (int r = 0; r + 1 < path->rows; r++) TRY(run_row(d, &path->row[r], &path->row[r + 1], line));
  return BASE_OK;
}

BaseStatus element_run(const ElementRun *run, const RvePacking *packing, RveBatch *batch, ElementFigures *figures) {
  Driver d = {.run = run, .scene = &run->settings->scene, .batch = batch, .figures = figures};
  BaseStatus status;
  memset(figures, 0, sizeof *figures);
  tensor_identity(figures->approach);
  d.time_step = d.scene->time_step > 0.0 ? d.scene->time_step
                                         : d.scene->time_step_fraction * rve_critical_time_step(d.scene, packing);
  for (int i = 0; i < packing->grains; i++) d.diameter += 2.0 * packing->radius[i] / packing->grains;
  d.temperature = d.scene->thermal ? d.scene->reference_temperature : 0.0;
  rve_batch_keep_states(batch, run->replay_file != NULL);
  TRY(BASE_ALLOC((size_t)run->copies, &d.input));
  TRY_GOTO(BASE_ALLOC((size_t)run->copies, &d.answer), status, done);
  status = run_path(&d);
  figures->particle_steps *= packing->grains;
done:
  base_free(d.input);
  base_free(d.answer);
  return status;
}
