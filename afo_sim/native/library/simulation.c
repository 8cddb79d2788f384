/* A simulation of an exported folder: model, start, the scenario's own inputs, variables by name. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "afo_sim.h"
#include "engine.h"

#if defined(_WIN32) && !defined(NAN)
#define NAN nan("")
#endif
enum { LARGEST = 1 << 28, FIELDS = 8, LETTERS = 4096 };

/* Where a variable stands: an array of mjData, a place in it; its value is scale · (number + offset). */
typedef struct {
  afo_variable said;
  int field, at;
  double scale, offset, set;
} variable;

struct afo_sim {
  const afo_engine *mujoco;
  mjModel *model;
  mjData *data;
  int states, controls, rows, count;
  double *start, *inputs; /* (states), (rows, controls) */
  variable *variables;
  char *words;
  long long taken;
  char error[400];
};

static const struct { const char *name; int place; } ARRAYS[] = {
    {"ctrl", mjData_ctrl}, {"qfrc_applied", mjData_qfrc_applied}, {"qpos", mjData_qpos}, {"qvel", mjData_qvel},
    {"act", mjData_act}, {"userdata", mjData_userdata}, {"actuator_force", mjData_actuator_force},
    {"time", mjData_time}};
enum { CTRL, APPLIED, ARRAY_COUNT = sizeof ARRAYS / sizeof *ARRAYS, TIME = ARRAY_COUNT - 1 };

static char *whole(const char *folder, const char *name, size_t *size, char *error, int letters) {
  char path[LETTERS];
  FILE *file = NULL;
  char *content = NULL;
  long length = -1;
  if (snprintf(path, sizeof path, "%s/%s", folder, name) < (int)sizeof path) file = fopen(path, "rb");
  if (file && !fseek(file, 0, SEEK_END)) length = ftell(file);
  if (length >= 0 && length <= LARGEST && !fseek(file, 0, SEEK_SET) && (content = malloc(length + 1))) {
    if (fread(content, 1, length, file) == (size_t)length) content[*size = length] = 0;
    else free(content), content = NULL;
  }
  if (file) fclose(file);
  if (!content) snprintf(error, letters, "%.300s: cannot be read", path);
  return content;
}

static int number(const char *text, double *value) {
  char *end;
  *value = strtod(text, &end);
  return *text && !*end && isfinite(*value);
}

/* Lines of: input|output, array, place, scale, offset, name, unit, description; with tabs between them. */
static int read_variables(afo_sim *sim) {
  int lines = 0;
  for (char *c = sim->words; *c; c++) lines += *c == '\n';
  sim->variables = calloc(lines + 1, sizeof *sim->variables);
  if (!sim->variables) return -1;
  char *line = sim->words, *next;
  for (; *line; line = next) {
    char *part[FIELDS], *rest = line;
    double at;
    variable *v = &sim->variables[sim->count];
    if (!(next = strchr(line, '\n'))) return -1;
    *next++ = 0;
    if (next - line > 1 && next[-2] == '\r') next[-2] = 0;
    for (int k = 0; k < FIELDS; k++) {
      part[k] = rest;
      if (k < FIELDS - 1 && !(rest = strchr(rest, '\t'))) return -1;
      if (k < FIELDS - 1) *rest++ = 0;
    }
    for (v->field = 0; v->field < ARRAY_COUNT && strcmp(ARRAYS[v->field].name, part[1]); v->field++) {}
    v->said = (afo_variable){part[5], part[6], part[7], !strcmp(part[0], "input")};
    if (v->field == ARRAY_COUNT || !number(part[2], &at) || !number(part[3], &v->scale) || !number(part[4], &v->offset)) return -1;
    int size = v->field == TIME ? 1 : v->field == APPLIED ? sim->mujoco->state_size(sim->model, 1 << 2)
             : v->field == CTRL || !strcmp(part[1], "actuator_force") ? sim->controls
             : v->field == 5 ? sim->mujoco->state_size(sim->model, 1 << 12)
             : sim->mujoco->state_size(sim->model, 1 << (v->field - 1));
    if (at != floor(at) || at < 0 || at >= size || v->scale == 0.0) return -1;
    if (v->said.input && v->field > APPLIED) return -1;
    v->at = (int)at, v->set = NAN;
    sim->count++;
  }
  return 0;
}

static double *place_of(const afo_sim *sim, const variable *v) {
  char *at = (char *)sim->data + afo_sim_places[ARRAYS[v->field].place];
  return v->field == TIME ? (double *)at : *(double **)at + v->at;
}

/* Call `act` with what MuJoCo or the kernels complain of as an error of the simulation. */
static int guarded(afo_sim *sim, void (*act)(afo_sim *, const void *), const void *told) {
  afo_guard guard, *outer = afo_guarded;
  int failed = setjmp(guard.jump);
  if (!failed) {
    afo_guarded = &guard;
    act(sim, told);
  } else {
    int actuator;
    const char *last = strrchr(guard.text, ' '), *name = NULL;
    if (last && sscanf(last, " %d", &actuator) == 1 && sim->model)
      name = sim->mujoco->name_of(sim->model, AFO_ACTUATOR, actuator);
    if (name) snprintf(sim->error, sizeof sim->error, "%.*s '%.60s'", (int)(last - guard.text), guard.text, name);
    else snprintf(sim->error, sizeof sim->error, "%s", guard.text);
  }
  afo_guarded = outer;
  return failed ? -1 : 0;
}

static void complain(const char *text) {
  if (!afo_guarded) return;
  snprintf(afo_guarded->text, sizeof afo_guarded->text, "%s", text);
  longjmp(afo_guarded->jump, 1);
}

static void make(afo_sim *sim, const void *told) {
  const char *path = told;
  sim->model = sim->mujoco->load_xml(path, NULL, sim->error, sizeof sim->error);
  if (sim->model) sim->data = sim->mujoco->make_data(sim->model);
}

static int opened(afo_sim *sim, const char *folder, char *error, int size) {
  char path[LETTERS];
  size_t length = 0;
  if (!(sim->mujoco = afo_mujoco(error, size))) return -1;
  if (!*sim->mujoco->user_error) *sim->mujoco->user_error = complain; /* else a process ends */
  snprintf(path, sizeof path, "%s/model.xml", folder);
  if (guarded(sim, make, path) || !sim->data) return snprintf(error, size, "%.300s: %s", path, sim->error), -1;
  sim->states = sim->mujoco->state_size(sim->model, (int)afo_sim_places[AFO_STATE]);
  sim->controls = sim->mujoco->state_size(sim->model, 1 << 6);
  sim->start = (double *)whole(folder, "start.bin", &length, error, size);
  if (!sim->start) return -1;
  if (length != sim->states * sizeof(double)) return snprintf(error, size, "%.300s/start.bin: has %zu bytes where the model's state has %zu", folder, length, sim->states * sizeof(double)), -1;
  if (!(sim->inputs = (double *)whole(folder, "inputs.bin", &length, error, size))) return -1;
  size_t row = sim->controls * sizeof(double);
  if (!row || length % row || !length) return snprintf(error, size, "%.300s/inputs.bin: has %zu bytes, which are no rows of %d inputs", folder, length, sim->controls), -1;
  sim->rows = (int)(length / row);
  if (!(sim->words = whole(folder, "variables.txt", &length, error, size))) return -1;
  if (strlen(sim->words) != length || read_variables(sim)) return snprintf(error, size, "%.300s/variables.txt: line %d is no variable of this model", folder, sim->count + 1), -1;
  if (afo_reset(sim)) return snprintf(error, size, "%.300s: %s", folder, sim->error), -1;
  return 0;
}

afo_sim *afo_open(const char *folder, char *error, int size) {
  char unheard[2];
  if (!error || size < 1) error = unheard, size = sizeof unheard;
  *error = 0;
  afo_sim *sim = calloc(1, sizeof *sim);
  if (sim && folder && !opened(sim, folder, error, size)) return sim;
  afo_close(sim);
  return NULL;
}

void afo_close(afo_sim *sim) {
  if (!sim) return;
  if (sim->data) sim->mujoco->delete_data(sim->data);
  if (sim->model) sim->mujoco->delete_model(sim->model);
  free(sim->start), free(sim->inputs), free(sim->variables), free(sim->words), free(sim);
}

const char *afo_error(const afo_sim *sim) { return sim ? sim->error : "no simulation is open"; }

int afo_find(const afo_sim *sim, const char *name) {
  for (int k = 0; k < sim->count; k++)
    if (!strcmp(sim->variables[k].said.name, name)) return k;
  return -1;
}

const afo_variable *afo_describe(const afo_sim *sim, int number) {
  return number >= 0 && number < sim->count ? &sim->variables[number].said : NULL;
}

static int refused(afo_sim *sim, const char *why, int number) {
  return snprintf(sim->error, sizeof sim->error, "variable %d %s", number, why), -1;
}

int afo_set(afo_sim *sim, int number, double value) {
  if (number < 0 || number >= sim->count || !sim->variables[number].said.input) return refused(sim, "is no input", number);
  if (isinf(value)) return refused(sim, "is set to no finite number", number);
  sim->variables[number].set = value;
  return 0;
}

double afo_get(const afo_sim *sim, int number) {
  if (number < 0 || number >= sim->count) return NAN;
  const variable *v = &sim->variables[number];
  return v->said.input && !isnan(v->set) ? v->set : v->scale * (*place_of(sim, v) + v->offset);
}

static void put_inputs(afo_sim *sim) {
  long long row = sim->taken < sim->rows ? sim->taken : sim->rows - 1;
  memcpy(AFO_FIELD(double *, sim->data, mjData_ctrl), sim->inputs + row * sim->controls, sim->controls * sizeof(double));
  for (int k = 0; k < sim->count; k++) {
    const variable *v = &sim->variables[k];
    if (!v->said.input) continue;
    if (!isnan(v->set)) *place_of(sim, v) = v->set / v->scale - v->offset;
    else if (v->field == APPLIED) *place_of(sim, v) = 0.0;
  }
}

static void step(afo_sim *sim, const void *told) {
  (void)told;
  put_inputs(sim);
  sim->mujoco->step(sim->model, sim->data);
}

int afo_step(afo_sim *sim, int steps) {
  if (*sim->error && sim->taken < 0) return -1; /* it has failed, and nothing has taken it back */
  int places = sim->mujoco->state_size(sim->model, 1 << 1), speeds = sim->mujoco->state_size(sim->model, 1 << 2);
  for (; steps > 0; steps--) {
    int bad = guarded(sim, step, NULL);
    for (int k = 0; !bad && k < places + speeds; k++) {
      double value = k < places ? AFO_FIELD(double *, sim->data, mjData_qpos)[k] : AFO_FIELD(double *, sim->data, mjData_qvel)[k - places];
      if (!(fabs(value) < 1e10)) bad = 1, snprintf(sim->error, sizeof sim->error, "a position or velocity is no number, or is too large");
    }
    if (bad) return sim->taken = -1;
    sim->taken++;
  }
  return 0;
}

/* A state: MuJoCo's, then how many steps are taken, then of each variable what it is set to, and its number,
 * since MuJoCo's has no forces. */
int afo_state(const afo_sim *sim, double *state) {
  if (state) {
    sim->mujoco->get_state(sim->model, sim->data, state, (int)afo_sim_places[AFO_STATE]);
    state += sim->states;
    *state++ = (double)sim->taken;
    for (int k = 0; k < sim->count; k++) {
      *state++ = sim->variables[k].set;
      *state++ = *place_of(sim, &sim->variables[k]);
    }
  }
  return sim->states + 1 + 2 * sim->count;
}

static void put(afo_sim *sim, const void *state) {
  sim->mujoco->set_state(sim->model, sim->data, state, (int)afo_sim_places[AFO_STATE]);
}

static void begin(afo_sim *sim, const void *told) { /* with the forces in the state of the start */
  (void)told;
  sim->mujoco->reset_data(sim->model, sim->data);
  put(sim, sim->start);
  put_inputs(sim);
  sim->mujoco->forward(sim->model, sim->data);
  put(sim, sim->start);
}

int afo_restore(afo_sim *sim, const double *state) {
  const double *rest = state + sim->states;
  int fit = *rest >= 0.0 && *rest < 9e15;
  for (int k = 0; k < sim->states; k++) fit = fit && isfinite(state[k]);
  for (int k = 0; k < 2 * sim->count; k++) fit = fit && (isnan(rest[1 + k]) ? k % 2 == 0 : isfinite(rest[1 + k]));
  if (!fit) return snprintf(sim->error, sizeof sim->error, "this is no state: a number of it is not finite"), -1;
  if (guarded(sim, put, state)) return -1;
  sim->taken = (long long)*rest++, *sim->error = 0;
  for (int k = 0; k < sim->count; k++) {
    sim->variables[k].set = *rest++;
    *place_of(sim, &sim->variables[k]) = *rest++;
  }
  return 0;
}

int afo_reset(afo_sim *sim) {
  for (int k = 0; k < sim->states; k++)
    if (!isfinite(sim->start[k])) return snprintf(sim->error, sizeof sim->error, "start.bin: a number is not finite"), -1;
  for (int k = 0; k < sim->count; k++) sim->variables[k].set = NAN;
  sim->taken = 0, *sim->error = 0;
  return guarded(sim, begin, NULL);
}

double afo_timestep(const afo_sim *sim) {
  return *(double *)((char *)sim->model + afo_sim_places[mjModel_opt] + afo_sim_places[mjOption_timestep]);
}
