/* FMI 2.0 for co-simulation over the functions of afo_sim.h: value references are the variables' numbers. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "afo_sim.h"

typedef enum { OK, WARNING, DISCARD, ERROR } status;
typedef const unsigned *references;
typedef struct {
  void (*log)(void *, const char *, status, const char *, const char *, ...);
  void *others[3], *environment;
} callbacks;
typedef struct {
  afo_sim *sim;
  const callbacks *told;
  double start, now; /* [s] */
  char name[80];
} instance;

static status failed(const instance *at, const char *why) {
  if (at->told && at->told->log) at->told->log(at->told->environment, at->name, ERROR, "logStatusError", "%s", why);
  return ERROR;
}

static void path_of(const char *uri, char *path, size_t size) { /* of file:///… with %20 and the like */
  size_t used = 0;
  if (!strncmp(uri, "file:", 5)) for (uri += 5; !strncmp(uri, "//", 2); uri++) {}
  while (*uri && used + 1 < size) {
    unsigned letter = (unsigned char)*uri++;
    if (letter == '%' && strspn(uri, "0123456789abcdefABCDEF") > 1 && sscanf(uri, "%2x", &letter)) uri += 2;
    path[used++] = (char)letter;
  }
  path[used] = 0;
#if defined(_WIN32)
  if (path[0] == '/' && path[2] == ':') memmove(path, path + 1, used);
#endif
}

AFO_API const char *fmi2GetTypesPlatform(void) { return "default"; }
AFO_API const char *fmi2GetVersion(void) { return "2.0"; }
AFO_API instance *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                                  const callbacks *told, int visible, int logging) {
  char path[4096], error[400] = "it is for co-simulation, and from its folder of resources, alone";
  instance *at = calloc(1, sizeof *at);
  if (!at) return NULL;
  at->told = told;
  snprintf(at->name, sizeof at->name, "%s", name ? name : "");
  if (resources) path_of(resources, path, sizeof path);
  if (type == 1 && resources && (at->sim = afo_open(path, error, sizeof error))) return at;
  failed(at, error);
  free(at);
  return NULL;
}
AFO_API void fmi2FreeInstance(instance *at) {
  if (at) afo_close(at->sim);
  free(at);
}
AFO_API status fmi2SetDebugLogging(instance *at, int on, size_t n, const char *const *which) { return OK; }
AFO_API status fmi2SetupExperiment(instance *at, int known, double tolerance, double start, int ends, double stop) {
  at->start = at->now = start;
  return OK;
}
AFO_API status fmi2EnterInitializationMode(instance *at) { return OK; }
AFO_API status fmi2ExitInitializationMode(instance *at) { return OK; }
AFO_API status fmi2Terminate(instance *at) { return OK; }
AFO_API status fmi2Reset(instance *at) {
  at->now = at->start = 0.0;
  return afo_reset(at->sim) ? failed(at, afo_error(at->sim)) : OK;
}

AFO_API status fmi2GetReal(instance *at, references which, size_t n, double *values) {
  for (size_t k = 0; k < n; k++) {
    if (!afo_describe(at->sim, (int)which[k])) return failed(at, "there is no such value reference");
    values[k] = afo_get(at->sim, (int)which[k]);
  }
  return OK;
}
AFO_API status fmi2SetReal(instance *at, references which, size_t n, const double *values) {
  for (size_t k = 0; k < n; k++) {
    if (isnan(values[k])) return failed(at, "an input is set to what is no number");
    if (afo_set(at->sim, (int)which[k], values[k])) return failed(at, afo_error(at->sim));
  }
  return OK;
}
#define NONE(get, kind, type) \
  AFO_API status fmi2##get##kind(instance *at, references which, size_t n, type *values) { \
    return n ? failed(at, "its variables are of type Real") : OK; \
  }
NONE(Get, Integer, int) NONE(Get, Boolean, int) NONE(Get, String, const char *)
NONE(Set, Integer, const int) NONE(Set, Boolean, const int) NONE(Set, String, const char *const)

AFO_API status fmi2DoStep(instance *at, double now, double length, int no_return) {
  double step = afo_timestep(at->sim), count = length / step, off = fabs(now - at->now) / step; /* in steps */
  if (!(count >= 0.0 && count < 2e9 && fabs(count - round(count)) < 1e-6 && off < 1e-6))
    return failed(at, "a communication step begins where the last has ended, and is of whole time steps");
  if (afo_step(at->sim, (int)round(count))) return failed(at, afo_error(at->sim));
  at->now = now + length;
  return OK;
}

/* A state is that of the simulation, then start and present time. */
static size_t size_of(const instance *at) { return (afo_state(at->sim, NULL) + 2) * sizeof(double); }
AFO_API status fmi2GetFMUstate(instance *at, double **state) {
  if (!*state && !(*state = malloc(size_of(at)))) return failed(at, "there is no memory for a state");
  int count = afo_state(at->sim, *state);
  (*state)[count] = at->start, (*state)[count + 1] = at->now;
  return OK;
}
AFO_API status fmi2SetFMUstate(instance *at, const double *state) {
  if (!state || afo_restore(at->sim, state)) return failed(at, state ? afo_error(at->sim) : "there is no state");
  int count = afo_state(at->sim, NULL);
  at->start = state[count], at->now = state[count + 1];
  return OK;
}
AFO_API status fmi2FreeFMUstate(instance *at, double **state) {
  free(*state), *state = NULL;
  return OK;
}
AFO_API status fmi2SerializedFMUstateSize(instance *at, const double *state, size_t *size) {
  *size = size_of(at);
  return OK;
}
AFO_API status fmi2SerializeFMUstate(instance *at, const double *state, char *bytes, size_t size) {
  if (!state || size < size_of(at)) return failed(at, "there is no state, or no room for one");
  memcpy(bytes, state, size_of(at));
  return OK;
}
AFO_API status fmi2DeSerializeFMUstate(instance *at, const char *bytes, size_t size, double **state) {
  if (size != size_of(at)) return failed(at, "this is no state of this FMU");
  if (!*state && !(*state = malloc(size))) return failed(at, "there is no memory for a state");
  memcpy(*state, bytes, size);
  return OK;
}

/* What this FMU does not do, as its description says. */
#define NEVER(name, ...) \
  AFO_API status fmi2##name(instance *at, __VA_ARGS__) { return failed(at, #name " is not for this FMU"); }
NEVER(GetDirectionalDerivative, references u, size_t n, references k, size_t m, const double *d, double *r)
NEVER(SetRealInputDerivatives, references r, size_t n, const int *order, const double *values)
NEVER(GetRealOutputDerivatives, references r, size_t n, const int *order, double *values)
NEVER(GetStatus, int kind, status *value) NEVER(GetRealStatus, int kind, double *value)
NEVER(GetIntegerStatus, int kind, int *value) NEVER(GetBooleanStatus, int kind, int *value)
NEVER(GetStringStatus, int kind, const char **value)
AFO_API status fmi2CancelStep(instance *at) { return failed(at, "no step is under way"); }
