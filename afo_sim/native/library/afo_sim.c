/* The muscles outside Python: a plugin of MuJoCo's, and simulations of exported folders. */
#define _GNU_SOURCE
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#if defined(__APPLE__)
#include <mach-o/dyld.h>
#else
#include <link.h>
#endif
#endif
#include "afo_sim.h"
#include "places.h" /* made at the build: number of each field, layouts of MuJoCo's versions */

typedef struct mjModel_ mjModel;
typedef struct mjData_ mjData;
typedef double (*callback)(const mjModel *, const mjData *, int);
enum { TIME = 1 << 0, QPOS = 1 << 1, QVEL = 1 << 2, ACT = 1 << 3, CTRL = 1 << 6, USERDATA = 1 << 12 }; /* mjtState */
enum { TEXT = 400, PATH = 4096, LARGEST = 1 << 28, PASSIVE = 1 << 2 };
#define MOST 1e10 /* that MuJoCo takes of a number: of a larger input it sets all inputs to 0 */
#define AT(type, owner, field) (*(type *)((char *)(owner) + afo_sim_places[field]))

AFO_API int64_t afo_sim_user_kernels[AFO_USER_KERNELS]; /* laws and frictions of a user's: afo_sim/physics/user_kernels.py */
AFO_API int64_t afo_sim_places[AFO_PLACES]; /* where MuJoCo's fields stand; the Python package writes them too */
double afo_sim_callbacks_0(const mjModel *, const mjData *, int); /* the kernels: act_bias, act_dyn */
double afo_sim_callbacks_1(const mjModel *, const mjData *, int);

static int say(char *text, int size, const char *format, ...) { /* a sentence; -1, which says that there is one */
  va_list told;
  va_start(told, format);
  vsnprintf(text, size, format, told);
  va_end(told);
  return -1;
}

static int within(const double *values, size_t count, double most) { /* which no NaN is */
  for (size_t k = 0; k < count; k++)
    if (!(fabs(values[k]) <= most)) return 0;
  return 1;
}

/* ---- MuJoCo as this process has it */

static struct { /* in the order of NAMES */
  int (*version)(void);
  mjModel *(*load_xml)(const char *, const void *, char *, int);
  void (*delete_model)(mjModel *);
  mjData *(*make_data)(const mjModel *);
  void (*delete_data)(mjData *);
  void (*reset_data)(const mjModel *, mjData *);
  int (*state_size)(const mjModel *, int);
  void (*get_state)(const mjModel *, const mjData *, double *, int);
  void (*set_state)(const mjModel *, mjData *, const double *, int);
  void (*step)(const mjModel *, mjData *);
  void (*forward)(const mjModel *, mjData *);
  const char *(*name_of)(const mjModel *, int, int);
  int (*id_of)(const mjModel *, int, const char *);
  void (*error)(const char *, ...);
  const void *(*get_plugin)(const char *, int *);
  int (*register_plugin)(const void *);
  const char *(*config)(const mjModel *, int, const char *);
  callback *bias, *dyn;
  void (**user_error)(const char *);
} mj;
static const char *const NAMES[] = {
    "mj_version", "mj_loadXML", "mj_deleteModel", "mj_makeData", "mj_deleteData", "mj_resetData", "mj_stateSize",
    "mj_getState", "mj_setState", "mj_step", "mj_forward", "mj_id2name", "mj_name2id", "mju_error", "mjp_getPlugin",
    "mjp_registerPlugin", "mj_getPluginConfig", "mjcb_act_bias", "mjcb_act_dyn", "mju_user_error"};
enum { COUNT = sizeof NAMES / sizeof *NAMES };
_Static_assert(sizeof mj == COUNT * sizeof(void *), "a name for each member");

static atomic_flag busy = ATOMIC_FLAG_INIT;
static void lock(void) { while (atomic_flag_test_and_set_explicit(&busy, memory_order_acquire)) {} }
static void unlock(void) { atomic_flag_clear_explicit(&busy, memory_order_release); }

/* First what an export brings beside this library, since the process's MuJoCo may be of another version. */
#if defined(_WIN32)
static void *symbol(void *library, const char *name) { return (void *)GetProcAddress(library, name); }
static void *find_library(void) {
  HMODULE own, found = NULL;
  char path[MAX_PATH], *end;
  if (GetModuleHandleExA(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS, (const char *)NAMES, &own) &&
      GetModuleFileNameA(own, path, MAX_PATH - 12) && (end = strrchr(path, '\\')))
    strcpy(end + 1, "mujoco.dll"), found = LoadLibraryA(path);
  return found ? found : GetModuleHandleA("mujoco.dll");
}
#else
static void *symbol(void *library, const char *name) { return dlsym(library, name); }
static void *beside(const char *name, int how) {
  Dl_info own;
  char path[PATH];
  const char *end = dladdr((void *)NAMES, &own) ? strrchr(own.dli_fname, '/') : NULL;
  if (!end || snprintf(path, PATH, "%.*s/%s", (int)(end - own.dli_fname), own.dli_fname, name) >= PATH) return NULL;
  return dlopen(path, RTLD_NOW | RTLD_LOCAL | how);
}
static int is_mujoco(const char *path) {
  const char *name = path ? strrchr(path, '/') : NULL;
  return name && !strncmp(name, "/libmujoco.", 11);
}
#if defined(__APPLE__)
static void *find_library(void) {
  void *found = beside("libmujoco.dylib", 0);
  for (uint32_t k = 0; !found && k < _dyld_image_count(); k++)
    if (is_mujoco(_dyld_get_image_name(k))) found = dlopen(_dyld_get_image_name(k), RTLD_NOW);
  return found ? found : RTLD_DEFAULT; /* perhaps the program has MuJoCo in itself */
}
#else
static int look(struct dl_phdr_info *info, size_t size, void *found) {
  if (is_mujoco(info->dlpi_name)) *(void **)found = dlopen(info->dlpi_name, RTLD_NOW | RTLD_NOLOAD);
  return *(void **)found != NULL;
}
static void *find_library(void) {
  void *found = beside("libmujoco.so", RTLD_DEEPBIND);
  if (!found && !dlsym(RTLD_DEFAULT, NAMES[0])) dl_iterate_phdr(look, &found);
  return found; /* RTLD_DEFAULT is NULL: a program that is linked with MuJoCo may hold a copy of its callbacks */
}
#endif
#endif

/* Find MuJoCo and its layout; 0, or -1 and why. */
static int found_mujoco(char *why, int size) {
  lock();
  const char *missing = NULL;
  if (!mj.version) {
    void *library = find_library(), *found[COUNT];
    for (int k = COUNT - 1; k >= 0; k--)
      if (!(found[k] = symbol(library, NAMES[k]))) missing = NAMES[k];
    if (!missing) memcpy(&mj, found, sizeof mj);
  }
  int version = missing ? 0 : mj.version(), known = afo_sim_places[0] != 0;
  for (int k = 0; version && !known && k < AFO_LAYOUTS; k++)
    if ((known = AFO_LAYOUT[k].version == version))
      memcpy(afo_sim_places, AFO_LAYOUT[k].places, sizeof afo_sim_places);
#if !defined(_WIN32)
  void *user = afo_sim_user_kernels[0] ? NULL : beside("afo_sim_user.so", 0); /* what an export brings */
  void (*fill)(int64_t *) = user ? (void (*)(int64_t *))symbol(user, "afo_sim_user") : NULL;
  if (fill) fill(afo_sim_user_kernels);
#endif
  unlock();
  if (missing) return say(why, size, "there is no MuJoCo in this process, and none beside this library: %s is not found", missing);
  if (known) return 0;
  return say(why, size, "this library does not know how MuJoCo %d.%d.%d lays out its structs; it knows %s",
             version / 1000000, version / 1000 % 1000, version % 1000, AFO_KNOWN);
}

/* ---- complaints: they leave a guarded call with an error, and are MuJoCo's own errors elsewhere */

typedef struct {
  jmp_buf jump;
  char text[TEXT];
} guard;
static _Thread_local guard *guarded;

static void leave(const char *text) {
  if (!guarded) return;
  snprintf(guarded->text, TEXT, "%s", text);
  longjmp(guarded->jump, 1);
}

static void leave_or_end(const char *text) { /* MuJoCo's errors, which end the process where nobody else minds */
  leave(text);
  fprintf(stderr, "ERROR: %s\n", text);
  exit(EXIT_FAILURE);
}

void afo_sim_mju_error(const char *format, ...) {
  char text[TEXT];
  va_list told;
  va_start(told, format);
  vsnprintf(text, TEXT, format, told);
  va_end(told);
  leave(text);
  mj.error("%s", text);
}

/* ---- the plugin: callbacks that are in force while data of models with muscles live */

static callback before[2]; /* whose turn it is with all other actuators */
static int living;         /* data of such models */

static int is_ours(const mjModel *m, int i) {
  int64_t width = AT(int64_t, m, mjModel_nuser_actuator);
  return width >= AFO_ROW && AT(double *, m, mjModel_actuator_user)[width * i] == AFO_ROWS_LAYOUT;
}
static double bias(const mjModel *m, const mjData *d, int i) {
  return is_ours(m, i) ? afo_sim_callbacks_0(m, d, i) : before[0] ? before[0](m, d, i) : 0.0;
}
static double dyn(const mjModel *m, const mjData *d, int i) {
  return is_ours(m, i) ? afo_sim_callbacks_1(m, d, i) : before[1] ? before[1](m, d, i) : 0.0;
}
static int in_force(void) { /* these, or the kernels that the Python package installs */
  return (*mj.bias == bias || *mj.bias == afo_sim_callbacks_0) && (*mj.dyn == dyn || *mj.dyn == afo_sim_callbacks_1);
}

static void keep(int k, callback *at, callback mine, callback kernel) {
  if (living && *at != mine && *at != kernel) before[k] = *at, *at = mine;
  if (!living && *at == mine) *at = before[k]; /* what somebody else has put there is not ours to take away */
}
/* Count such data; the callbacks follow. Whether they stood there, as the Python package asks. */
AFO_API int afo_sim_settle(int change) {
  lock();
  int stood = mj.version && *mj.bias == bias && *mj.dyn == dyn;
  living += change;
  if (mj.version) keep(0, mj.bias, bias, afo_sim_callbacks_0), keep(1, mj.dyn, dyn, afo_sim_callbacks_1);
  unlock();
  return stood;
}

/* CRC-32 of our rows and of their actuators' numbers: with others a kernel would read beyond the arrays. */
static unsigned sum_of_rows(const mjModel *m) {
  unsigned sum = ~(unsigned)mj.state_size(m, USERDATA);
  for (int i = 0; i < mj.state_size(m, CTRL); i++)
    for (size_t bit = 0; is_ours(m, i) && bit < 8 * sizeof(double) * AFO_ROW; bit++) {
      const double *row = AT(double *, m, mjModel_actuator_user) + AT(int64_t, m, mjModel_nuser_actuator) * i;
      if (bit % 8 == 0) sum ^= ((const unsigned char *)row)[bit / 8] ^ (bit ? 0 : (unsigned)i);
      sum = sum >> 1 ^ (sum & 1 ? 0xEDB88320u : 0);
    }
  return ~sum;
}
static int plugin_states(const mjModel *m, int instance) { return 0; }
static int plugin_init(const mjModel *m, mjData *d, int instance) {
  char why[TEXT];
  if (found_mujoco(why, TEXT)) mj.error("%s", why);
  const char *sum = mj.config(m, instance, "rows"); /* looked at while MuJoCo compiles: later they may be changed */
  if (!AT(uint64_t, m, mjModel_signature) && (!sum || strtoul(sum, NULL, 10) != sum_of_rows(m)))
    mj.error("the muscles' parameters are damaged, of another version, or their actuators have other numbers");
  afo_sim_settle(1);
  return 0;
}
static void plugin_destroy(mjData *d, int instance) { afo_sim_settle(-1); }
static void plugin_reset(const mjModel *m, double *s, void *p, int k) {}
/* Before the actuators of each step: data that were reset without a keyframe get the air of the model's key. */
static void plugin_compute(const mjModel *m, mjData *d, int instance, int capability) {
  if (!in_force()) mj.error("other callbacks stand where those of the muscles stood, and these may be limp");
  int count = mj.state_size(m, ACT);
  double *act = AT(double *, d, mjData_act);
  if (AT(double, d, mjData_time) != 0.0 || !AT(int64_t, m, mjModel_nkey) || !within(act, count, 0.0)) return;
  int key = mj.id_of(m, AFO_KEY, "afo_start");
  if (key >= 0) memcpy(act, AT(double *, m, mjModel_key_act) + (size_t)key * count, count * sizeof *act);
}
static const struct { /* mjpPlugin, which all known versions have alike */
  const char *name;
  int attributes;
  const char *const *names;
  int capabilities, stage;
  int (*states)(const mjModel *, int), (*sensed)(const mjModel *, int, int), (*init)(const mjModel *, mjData *, int);
  void (*destroy)(mjData *, int), (*copy)(mjData *, const mjModel *, const mjData *, int);
  void (*reset)(const mjModel *, double *, void *, int), (*compute)(const mjModel *, mjData *, int, int);
  void *others[8];
} PLUGIN = {.name = "afo_sim.muscles", .attributes = 1, .names = (const char *const[]){"rows"}, .capabilities = PASSIVE,
            .states = plugin_states, .init = plugin_init, .destroy = plugin_destroy, .reset = plugin_reset,
            .compute = plugin_compute};

/* Of another MuJoCo's plugins no model can be made. The Python package looks again: MuJoCo may have come later. */
AFO_API __attribute__((constructor)) void afo_sim_look(void) {
  int slot;
  found_mujoco(NULL, 0);
  if (mj.version && !mj.get_plugin(PLUGIN.name, &slot)) mj.register_plugin(&PLUGIN); /* else a copy has done it */
}

/* ---- simulations of exported folders */

static const struct { const char *name; int field, counts; } ARRAYS[] = { /* counted as a part of the state is */
    {"ctrl", mjData_ctrl, CTRL}, {"qfrc_applied", mjData_qfrc_applied, QVEL}, {"qpos", mjData_qpos, QPOS},
    {"qvel", mjData_qvel, QVEL}, {"act", mjData_act, ACT}, {"userdata", mjData_userdata, USERDATA},
    {"actuator_force", mjData_actuator_force, CTRL}, {"qfrc_actuator", mjData_qfrc_actuator, QVEL}};
enum { APPLIED = 1, ARRAY_COUNT = sizeof ARRAYS / sizeof *ARRAYS, PARTS = 8 };

typedef struct { /* its value is scale · (array[place] + offset); those behind it without a name are added to it, or set with it */
  afo_variable said;
  int array, place;
  double scale, offset, set;
} variable;
struct afo_sim {
  mjModel *model;
  mjData *data;
  int states, controls, count, taken, rows;
  double *start, *inputs; /* (states), (rows, controls) */
  char *changes;          /* whether an input does (controls) */
  variable *variables;
  char *words, error[TEXT];
};

static char *content_of(const char *folder, const char *name, size_t unit, size_t *length, char *error, int size) {
  char path[PATH], *content = NULL;
  long bytes = -1;
  FILE *file = snprintf(path, PATH, "%s/%s", folder, name) < PATH ? fopen(path, "rb") : NULL;
  if (file && !fseek(file, 0, SEEK_END)) bytes = ftell(file);
  if (bytes > 0 && unit && (size_t)bytes / unit <= *length && bytes % (long)unit == 0 && !fseek(file, 0, SEEK_SET)) {
    content = calloc(bytes + 1, 1);
    if (content && fread(content, 1, bytes, file) != (size_t)bytes) free(content), content = NULL;
  }
  if (file) fclose(file);
  if (!content) say(error, size, "%.300s: is missing, damaged or of another model", path);
  *length = content ? (size_t)bytes / unit : 0;
  return content;
}

static int number(const char *text, double *value) {
  char *end;
  *value = strtod(text, &end);
  return *text && !*end && isfinite(*value);
}

/* One line: input|output, array, place, scale, offset, name, unit, description; with tabs between them. */
static int read_variable(afo_sim *sim, char *line, variable *v) {
  char *part[PARTS] = {line};
  double place;
  for (int k = 1; k < PARTS; k++) {
    if (!(part[k] = strchr(part[k - 1], '\t'))) return -1;
    *part[k]++ = 0;
  }
  for (v->array = 0; v->array < ARRAY_COUNT && strcmp(ARRAYS[v->array].name, part[1]); v->array++) {}
  v->said = (afo_variable){part[5], part[6], part[7], !strcmp(part[0], "input")}, v->set = NAN;
  if (v->array == ARRAY_COUNT || (v->said.input && v->array > APPLIED)) return -1;
  if (!number(part[2], &place) || !number(part[3], &v->scale) || !number(part[4], &v->offset)) return -1;
  v->place = (int)fmin(fmax(place, -1.0), 1e9);
  return v->place < 0 || v->place >= mj.state_size(sim->model, ARRAYS[v->array].counts) || v->scale == 0.0 ? -1 : 0;
}

static double *number_of(const afo_sim *sim, const variable *v) {
  return AT(double *, sim->data, ARRAYS[v->array].field) + v->place;
}

/* Call a function that may complain; 0, or -1 and the complaint as the simulation's error. */
static int attempt(afo_sim *sim, void (*act)(afo_sim *, const void *), const void *told) {
  guard own, *outer = guarded;
  int failed = setjmp(own.jump), actuator;
  guarded = failed ? outer : &own;
  if (!failed) act(sim, told);
  guarded = outer;
  if (!failed) return 0;
  const char *end = strrchr(own.text, ' '), *name = NULL;
  if (end && sscanf(end, "%d", &actuator) == 1 && sim->model) name = mj.name_of(sim->model, AFO_ACTUATOR, actuator);
  if (name) return say(sim->error, TEXT, "%.*s '%.60s'", (int)(end - own.text), own.text, name);
  return say(sim->error, TEXT, "%s", own.text);
}

static void make(afo_sim *sim, const void *path) {
  sim->model = mj.load_xml(path, NULL, sim->error, TEXT);
  if (sim->model) sim->data = mj.make_data(sim->model);
}

static int opened(afo_sim *sim, const char *folder, char *error, int size) {
  char path[PATH];
  size_t states = 1, rows = LARGEST / sizeof(double), length = LARGEST; /* at most */
  if (found_mujoco(error, size)) return -1;
  if (!*mj.user_error) *mj.user_error = leave_or_end;
  snprintf(path, PATH, "%s/model.xml", folder);
  if (attempt(sim, make, path) || !sim->data) return say(error, size, "%.300s: %s", path, sim->error);
  sim->states = mj.state_size(sim->model, (int)afo_sim_places[AFO_STATE]);
  sim->controls = mj.state_size(sim->model, CTRL);
  sim->start = (double *)content_of(folder, "start.bin", sim->states * sizeof(double), &states, error, size);
  sim->inputs = (double *)content_of(folder, "inputs.bin", sim->controls * sizeof(double), &rows, error, size);
  if (!sim->start || !sim->inputs || !(sim->words = content_of(folder, "variables.txt", 1, &length, error, size)))
    return -1;
  if (!within(sim->start, sim->states, 1e300) || !within(sim->inputs, rows * sim->controls, MOST))
    return say(error, size, "%.300s: a number of start.bin or inputs.bin is not finite, or too large", folder);
  sim->changes = calloc(sim->controls + 1, 1);
  for (size_t k = 0; sim->changes && k < rows * sim->controls; k++)
    if (sim->inputs[k] != sim->inputs[k % sim->controls]) sim->changes[k % sim->controls] = 1;
  sim->rows = (int)rows;
  sim->variables = calloc(length / PARTS + 1, sizeof *sim->variables); /* each has as many tabs, and an end */
  for (char *line = sim->words, *next; sim->changes && sim->variables && line < sim->words + length; line = next) {
    if ((next = strchr(line, '\n'))) *next++ = 0;
    if (!next || read_variable(sim, line, &sim->variables[sim->count++]))
      return say(error, size, "%.300s/variables.txt: line %d is no variable of this model", folder, sim->count);
  }
  return afo_reset(sim) ? say(error, size, "%.300s: %s", folder, sim->error) : 0;
}

afo_sim *afo_open(const char *folder, char *error, int size) {
  char unheard[TEXT];
  if (!error || size < 1) error = unheard, size = TEXT;
  say(error, size, "there is no folder, or no memory");
  afo_sim *sim = calloc(1, sizeof *sim);
  if (sim && folder && !opened(sim, folder, error, size)) return *error = 0, sim;
  afo_close(sim);
  return NULL;
}

void afo_close(afo_sim *sim) {
  if (!sim) return;
  if (sim->data) mj.delete_data(sim->data);
  if (sim->model) mj.delete_model(sim->model);
  free(sim->start), free(sim->inputs), free(sim->changes), free(sim->variables), free(sim->words), free(sim);
}

const char *afo_error(const afo_sim *sim) { return sim->error; }
double afo_timestep(const afo_sim *sim) {
  return *(double *)((char *)sim->model + afo_sim_places[mjModel_opt] + afo_sim_places[mjOption_timestep]);
}
const afo_variable *afo_describe(const afo_sim *sim, int number) {
  return number >= 0 && number < sim->count ? &sim->variables[number].said : NULL;
}
int afo_find(const afo_sim *sim, const char *name) {
  for (int k = 0; k < sim->count; k++) if (*name && !strcmp(sim->variables[k].said.name, name)) return k;
  return -1;
}

int afo_set(afo_sim *sim, int number, double value) {
  const afo_variable *said = afo_describe(sim, number);
  if (!said || !said->input || !*said->name) return say(sim->error, TEXT, "%.60s is no input", said ? said->name : "this number");
  if (fabs(value) > MOST) return say(sim->error, TEXT, "%.60s is set to %g, beyond ±%g", said->name, value, MOST);
  do sim->variables[number].set = value; while (++number < sim->count && !*sim->variables[number].said.name);
  return 0;
}

double afo_get(const afo_sim *sim, int number) {
  const afo_variable *said = afo_describe(sim, number);
  if (!said) return NAN;
  if (!isnan(sim->variables[number].set)) return sim->variables[number].set;
  double value = 0.0;
  do {
    const variable *v = &sim->variables[number++];
    value += v->scale * (*number_of(sim, v) + v->offset);
  } while (!said->input && number < sim->count && !*sim->variables[number].said.name);
  return value;
}

/* The scenario's own inputs, over them those that are set; behind the last row what does not change is held. */
static void put_inputs(afo_sim *sim, const void *told) {
  const double *row = sim->inputs + (size_t)sim->controls * (sim->taken < sim->rows ? sim->taken : sim->rows - 1);
  double *ctrl = AT(double *, sim->data, mjData_ctrl);
  for (int k = 0; k < sim->controls; k++)
    ctrl[k] = sim->taken < sim->rows || !sim->changes[k] ? row[k] : NAN;
  for (int k = 0; k < sim->count; k++) {
    const variable *v = &sim->variables[k];
    if (v->said.input && !isnan(v->set)) *number_of(sim, v) = v->set / v->scale - v->offset;
    else if (v->said.input && v->array == APPLIED) *number_of(sim, v) = 0.0;
  }
  for (int k = 0; k < sim->controls; k++)
    if (isnan(ctrl[k])) leave("the scenario's own inputs have ended: export it with a longer duration, or set them");
}

static void step(afo_sim *sim, const void *told) {
  mj.step(sim->model, sim->data);
  if (!within(AT(double *, sim->data, mjData_qpos), mj.state_size(sim->model, QPOS), MOST) ||
      !within(AT(double *, sim->data, mjData_qvel), mj.state_size(sim->model, QVEL), MOST))
    leave("a position or velocity is no number, or too large");
}

int afo_step(afo_sim *sim, int steps) {
  for (; steps > 0; steps--, sim->taken++) {
    if (sim->taken < 0 || attempt(sim, put_inputs, NULL)) return -1;
    if (attempt(sim, step, NULL)) return sim->taken = -1; /* until it is reset or restored */
  }
  return 0;
}

/* A state: MuJoCo's; how many steps are taken; of each variable what it is set to, and its number. */
int afo_state(const afo_sim *sim, double *state) {
  if (state) {
    mj.get_state(sim->model, sim->data, state, (int)afo_sim_places[AFO_STATE]);
    *(state += sim->states) = sim->taken;
    for (int k = 0; k < sim->count; k++)
      *++state = sim->variables[k].set, *++state = *number_of(sim, &sim->variables[k]);
  }
  return sim->states + 1 + 2 * sim->count;
}

static void put(afo_sim *sim, const void *state) {
  mj.set_state(sim->model, sim->data, state, (int)afo_sim_places[AFO_STATE]);
}

int afo_restore(afo_sim *sim, const double *state) {
  const double *rest = state + sim->states;
  int fit = *rest >= 0.0 && *rest < 2147483647.0 && within(state, sim->states, 1e300);
  for (int k = 0; k < sim->count; k++) fit = fit && !isinf(rest[2 * k + 1]) && isfinite(rest[2 * k + 2]);
  if (!fit) return say(sim->error, TEXT, "this state is of a step that failed, or a number of it is not finite");
  if (attempt(sim, put, state)) return -1;
  sim->taken = (int)*rest, *sim->error = 0;
  for (int k = 0; k < sim->count; k++)
    sim->variables[k].set = *++rest, *number_of(sim, &sim->variables[k]) = *++rest;
  return 0;
}

static void begin(afo_sim *sim, const void *told) { /* with the forces in the state of the start */
  mj.reset_data(sim->model, sim->data);
  put(sim, sim->start);
  put_inputs(sim, told);
  mj.forward(sim->model, sim->data);
  put(sim, sim->start);
}

int afo_reset(afo_sim *sim) {
  for (int k = 0; k < sim->count; k++) sim->variables[k].set = NAN;
  sim->taken = 0, *sim->error = 0;
  return attempt(sim, begin, NULL);
}
