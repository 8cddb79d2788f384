/* Finding MuJoCo, and being its plugin: the muscles' callbacks are in force while data of such models live. */
#if !defined(_WIN32)
#define _GNU_SOURCE
#include <dlfcn.h>
#if defined(__APPLE__)
#include <mach-o/dyld.h>
#else
#include <link.h>
#endif
#else
#include <windows.h>
#endif
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include "engine.h"

/* Where MuJoCo's fields stand; the package writes them too. */
#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
int64_t afo_sim_places[AFO_PLACES];
_Thread_local afo_guard *afo_guarded;
extern double afo_sim_callbacks_0(const mjModel *, const mjData *, int);
extern double afo_sim_callbacks_1(const mjModel *, const mjData *, int);

static const char *const NAMES[] = {
    "mj_version", "mj_loadXML", "mj_deleteModel", "mj_makeData", "mj_deleteData", "mj_resetData",
    "mj_stateSize", "mj_getState", "mj_setState", "mj_step", "mj_forward", "mj_id2name", "mju_error",
    "mjp_defaultPlugin", "mjp_registerPlugin", "mjcb_act_bias", "mjcb_act_dyn", "mju_user_error",
    "mju_user_warning"};
enum { COUNT = sizeof NAMES / sizeof *NAMES };
_Static_assert(sizeof(afo_engine) == COUNT * sizeof(void *), "a name for each member");

static afo_engine engine;
static atomic_flag busy = ATOMIC_FLAG_INIT;
static void lock(void) { while (atomic_flag_test_and_set_explicit(&busy, memory_order_acquire)) {} }
static void unlock(void) { atomic_flag_clear_explicit(&busy, memory_order_release); }

/* ---- libraries: MuJoCo beside this one, in the process as a whole, or among what it has loaded */

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
static int is_mujoco(const char *path) {
  const char *name = path ? strrchr(path, '/') : NULL;
  return name && !strncmp(name + 1, "libmujoco.", 10);
}
static void *beside(const char *name, int how) { /* what an export brings: the process's may be another version */
  Dl_info own;
  char path[4096];
  if (!dladdr((void *)NAMES, &own) || !is_mujoco(name)) return NULL;
  const char *end = strrchr(own.dli_fname, '/');
  int length = end ? (int)(end - own.dli_fname) : 0;
  if (snprintf(path, sizeof path, "%.*s%s", length, end ? own.dli_fname : "", name + !end) >= (int)sizeof path) return NULL;
  return dlopen(path, RTLD_NOW | RTLD_LOCAL | how);
}
#if defined(__APPLE__)
static void *find_library(void) {
  void *found = beside("/libmujoco.dylib", 0);
  for (uint32_t k = 0; !found && k < _dyld_image_count(); k++)
    if (is_mujoco(_dyld_get_image_name(k))) found = dlopen(_dyld_get_image_name(k), RTLD_NOW);
  return found ? found : RTLD_DEFAULT; /* perhaps the program has MuJoCo in itself */
}
#else
static int look(struct dl_phdr_info *info, size_t size, void *found) {
  (void)size;
  if (is_mujoco(info->dlpi_name)) *(void **)found = dlopen(info->dlpi_name, RTLD_NOW | RTLD_NOLOAD);
  return *(void **)found != NULL;
}
static void *find_library(void) {
  void *found = beside("/libmujoco.so", RTLD_DEEPBIND);
  if (!found) dl_iterate_phdr(look, &found);
  return found; /* RTLD_DEFAULT is NULL: perhaps the program has MuJoCo in itself */
}
#endif
#endif

const afo_engine *afo_mujoco(char *why, int size) {
  lock();
  if (!engine.version) {
    void *library = find_library();
    afo_engine found;
    int missing = -1;
    for (int k = COUNT - 1; k >= 0; k--) {
      void *address = symbol(library, NAMES[k]);
      memcpy((char *)&found + k * sizeof address, &address, sizeof address);
      if (!address) missing = k;
    }
    if (missing < 0) engine = found;
    else if (why) snprintf(why, size, "no MuJoCo is loaded in this process: %s is not found", NAMES[missing]);
  }
  int version = engine.version ? engine.version() : 0, known = afo_sim_places[0] != 0;
  for (int k = 0; version && !known && k < AFO_LAYOUTS; k++)
    if ((known = AFO_LAYOUT[k].version == version)) memcpy(afo_sim_places, AFO_LAYOUT[k].places, sizeof afo_sim_places);
  unlock();
  if (version && !known && why)
    snprintf(why, size, "MuJoCo %d.%d.%d lays its structs out in a way that this library does not know; it knows %s",
             version / 1000000, version / 1000 % 1000, version % 1000, AFO_KNOWN);
  return version && known ? &engine : NULL;
}

int afo_ours(const mjModel *m, int i) {
  int width = AFO_FIELD(int, m, mjModel_nuser_actuator);
  return width >= AFO_ROW && AFO_FIELD(double *, m, mjModel_actuator_user)[(size_t)width * i] == AFO_ROWS_LAYOUT;
}

/* What the kernels complain by: it leaves a guarded call with an error, and is MuJoCo's own error elsewhere. */
void afo_sim_mju_error(const char *format, ...) {
  char text[sizeof afo_guarded->text];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  if (afo_guarded) {
    memcpy(afo_guarded->text, text, sizeof text);
    longjmp(afo_guarded->jump, 1);
  }
  if (afo_mujoco(NULL, 0)) engine.error("%s", text);
}

/* ---- the plugin */

static struct { afo_callback bias, dyn; } before; /* whose turn it is with all other actuators */
static int living;                                /* data of models with muscles */

static double bias(const mjModel *m, const mjData *d, int i) {
  if (afo_ours(m, i)) return afo_sim_callbacks_0(m, d, i);
  return before.bias ? before.bias(m, d, i) : 0.0;
}

static double dyn(const mjModel *m, const mjData *d, int i) {
  if (afo_ours(m, i)) return afo_sim_callbacks_1(m, d, i);
  return before.dyn ? before.dyn(m, d, i) : 0.0;
}

static int is_own(void) {
  return (*engine.bias == bias || *engine.bias == afo_sim_callbacks_0) &&
         (*engine.dyn == dyn || *engine.dyn == afo_sim_callbacks_1);
}

static int number_of_states(const mjModel *m, int instance) { (void)m; (void)instance; return 0; }

static int begin(const mjModel *m, mjData *d, int instance) {
  char why[300];
  (void)d; (void)instance; (void)m;
  if (!afo_mujoco(why, sizeof why)) engine.error("%s", why);
  lock();
  if (!is_own()) {
    before.bias = *engine.bias, before.dyn = *engine.dyn;
    *engine.bias = bias, *engine.dyn = dyn;
  }
  living++;
  unlock();
  return 0;
}

static void end(mjData *d, int instance) {
  (void)d; (void)instance;
  lock();
  if (--living == 0) { /* what somebody else has put there meanwhile is not ours to take away */
    if (*engine.bias == bias) *engine.bias = before.bias;
    if (*engine.dyn == dyn) *engine.dyn = before.dyn;
  }
  unlock();
}

static void reset(const mjModel *m, double *state, void *data, int instance) { (void)m; (void)state; (void)data; (void)instance; }

/* Before the actuators of each step: data that were reset without a keyframe get air from the model's first one. */
static void compute(const mjModel *m, mjData *d, int instance, int capability) {
  (void)instance; (void)capability;
  if (!is_own()) engine.error("another library has replaced the muscles' callbacks: the muscles would be limp");
  int count = engine.state_size(m, 1 << 3); /* mjSTATE_ACT */
  double *act = AFO_FIELD(double *, d, mjData_act);
  if (AFO_FIELD(double, d, mjData_time) != 0.0 || !AFO_FIELD(int, m, mjModel_nkey)) return;
  for (int k = 0; k < count; k++) if (act[k] != 0.0) return;
  memcpy(act, AFO_FIELD(double *, m, mjModel_key_act), count * sizeof *act);
}

static const struct { /* mjpPlugin, which 3.17 and 4.0 have alike */
  const char *name;
  int attributes;
  const char *const *names;
  int capabilities, stage;
  int (*states)(const mjModel *, int);
  int (*sensed)(const mjModel *, int, int);
  int (*init)(const mjModel *, mjData *, int);
  void (*destroy)(mjData *, int);
  void (*copy)(mjData *, const mjModel *, const mjData *, int);
  void (*reset)(const mjModel *, double *, void *, int);
  void (*compute)(const mjModel *, mjData *, int, int);
  void *others[8]; /* advance, visualize, actuator_act_dot, sdf_… */
} PLUGIN = {.name = "afo_sim.muscles", .capabilities = 1 << 2 /* passive */, .states = number_of_states,
            .init = begin, .destroy = end, .reset = reset, .compute = compute};

#if defined(__GNUC__)
__attribute__((constructor))
#endif
static void registered(void) {
  if (afo_mujoco(NULL, 0) || engine.version) engine.register_plugin(&PLUGIN);
}
