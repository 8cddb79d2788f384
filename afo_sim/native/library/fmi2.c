/* FMI 2.0 for co-simulation over the functions of afo_sim.h: value references are the variables' numbers. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "afo_sim.h"

typedef void *component;
typedef enum { OK, WARNING, DISCARD, ERROR } status;
typedef struct {
  void (*log)(void *, const char *, status, const char *, const char *, ...);
  void *(*allocate)(size_t, size_t);
  void (*release)(void *);
  void (*finished)(void *, status);
  void *environment;
} callbacks;
typedef struct {
  afo_sim *sim;
  const callbacks *told;
  char name[80];
  double start, now; /* [s] */
} instance;

static status failed(instance *at, const char *why) {
  if (at->told && at->told->log) at->told->log(at->told->environment, at->name, ERROR, "logStatusError", "%s", why);
  return ERROR;
}

static void path_of(const char *uri, char *path, size_t size) { /* of file:///… with %20 and the like */
  size_t used = 0;
  if (!strncmp(uri, "file:", 5)) for (uri += 5; !strncmp(uri, "//", 2); uri++) {}
  while (*uri && used + 1 < size) {
    unsigned letter = (unsigned char)*uri++;
    if (letter == '%' && sscanf(uri, "%2x", &letter) == 1) uri += 2;
    path[used++] = (char)letter;
  }
  path[used] = 0;
#if defined(_WIN32)
  if (path[0] == '/' && path[2] == ':') memmove(path, path + 1, used);
#endif
}

AFO_API const char *fmi2GetTypesPlatform(void) { return "default"; }
AFO_API const char *fmi2GetVersion(void) { return "2.0"; }

AFO_API component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                                  const callbacks *told, int visible, int logging) {
  char path[4096], error[400] = "it is given no folder of resources";
  instance *at = calloc(1, sizeof *at);
  (void)guid, (void)visible, (void)logging;
  if (!at) return NULL;
  at->told = told;
  snprintf(at->name, sizeof at->name, "%s", name ? name : "");
  if (resources) path_of(resources, path, sizeof path);
  if (type == 1 && resources && (at->sim = afo_open(path, error, sizeof error))) return at;
  failed(at, type == 1 ? error : "it is for co-simulation alone");
  free(at);
  return NULL;
}
AFO_API void fmi2FreeInstance(component c) {
  if (c) afo_close(((instance *)c)->sim);
  free(c);
}
AFO_API status fmi2SetDebugLogging(component c, int on, size_t n, const char *const *which) { (void)c, (void)on, (void)n, (void)which; return OK; }
AFO_API status fmi2SetupExperiment(component c, int known, double tolerance, double start, int ends, double stop) {
  (void)known, (void)tolerance, (void)ends, (void)stop;
  ((instance *)c)->start = ((instance *)c)->now = start;
  return OK;
}
AFO_API status fmi2EnterInitializationMode(component c) { (void)c; return OK; }
AFO_API status fmi2ExitInitializationMode(component c) { (void)c; return OK; }
AFO_API status fmi2Terminate(component c) { (void)c; return OK; }
AFO_API status fmi2Reset(component c) {
  instance *at = c;
  at->now = at->start = 0.0;
  return afo_reset(at->sim) ? failed(at, afo_error(at->sim)) : OK;
}

AFO_API status fmi2GetReal(component c, const unsigned *which, size_t n, double *values) {
  instance *at = c;
  for (size_t k = 0; k < n; k++) {
    if (!afo_describe(at->sim, (int)which[k])) return failed(at, "there is no such value reference");
    values[k] = afo_get(at->sim, (int)which[k]);
  }
  return OK;
}
AFO_API status fmi2SetReal(component c, const unsigned *which, size_t n, const double *values) {
  instance *at = c;
  for (size_t k = 0; k < n; k++)
    if (isnan(values[k]) || afo_set(at->sim, (int)which[k], values[k])) return failed(at, isnan(values[k]) ? "an input is no number" : afo_error(at->sim));
  return OK;
}
#define NONE(kind, type)                                                                                              \
  AFO_API status fmi2Get##kind(component c, const unsigned *which, size_t n, type *values) {                          \
    return (void)which, (void)values, n ? failed(c, "it has variables of type Real alone") : OK;                      \
  }                                                                                                                   \
  AFO_API status fmi2Set##kind(component c, const unsigned *which, size_t n, const type *values) {                    \
    return (void)which, (void)values, n ? failed(c, "it has variables of type Real alone") : OK;                      \
  }
NONE(Integer, int)
NONE(Boolean, int)
NONE(String, char *)

AFO_API status fmi2DoStep(component c, double at_time, double length, int no_return) {
  instance *at = c;
  double step = afo_timestep(at->sim), count = floor((at_time - at->start + length) / step + 0.5);
  double done = floor((at->now - at->start) / step + 0.5);
  (void)no_return;
  if (!(length >= 0.0) || !(count - done < 2e9)) return failed(at, "the communication step is no length of time");
  if (fabs((at_time - at->start + length) / step - count) > 1e-6 * fmax(1.0, count)) return failed(at, "the communication step is no multiple of the time step");
  if (afo_step(at->sim, (int)(count - done))) return failed(at, afo_error(at->sim));
  at->now = at_time + length;
  return OK;
}

/* A state: the simulation's numbers, then start and present time. */
static size_t size_of(instance *at) { return (size_t)afo_state(at->sim, NULL); }
AFO_API status fmi2GetFMUstate(component c, void **state) {
  instance *at = c;
  double *numbers = *state ? *state : malloc((size_of(at) + 2) * sizeof(double));
  if (!numbers) return failed(at, "there is no memory for a state");
  afo_state(at->sim, numbers);
  numbers[size_of(at)] = at->start, numbers[size_of(at) + 1] = at->now;
  return *state = numbers, OK;
}
AFO_API status fmi2SetFMUstate(component c, void *state) {
  instance *at = c;
  double *numbers = state;
  if (!numbers || afo_restore(at->sim, numbers)) return failed(at, numbers ? afo_error(at->sim) : "there is no state");
  at->start = numbers[size_of(at)], at->now = numbers[size_of(at) + 1];
  return OK;
}
AFO_API status fmi2FreeFMUstate(component c, void **state) { (void)c; free(*state); *state = NULL; return OK; }
AFO_API status fmi2SerializedFMUstateSize(component c, void *state, size_t *size) { (void)state; *size = (size_of(c) + 2) * sizeof(double); return OK; }
AFO_API status fmi2SerializeFMUstate(component c, void *state, char *bytes, size_t size) {
  if (size != (size_of(c) + 2) * sizeof(double)) return failed(c, "the state has another size");
  return memcpy(bytes, state, size), OK;
}
AFO_API status fmi2DeSerializeFMUstate(component c, const char *bytes, size_t size, void **state) {
  if (size != (size_of(c) + 2) * sizeof(double)) return failed(c, "the state has another size");
  if (!*state && !(*state = malloc(size))) return failed(c, "there is no memory for a state");
  return memcpy(*state, bytes, size), OK;
}

/* What this FMU does not do, as its description says. */
AFO_API status fmi2GetDirectionalDerivative(component c, const unsigned *u, size_t n, const unsigned *k, size_t m, const double *d, double *r) { (void)u, (void)n, (void)k, (void)m, (void)d, (void)r; return failed(c, "it has no derivatives"); }
AFO_API status fmi2SetRealInputDerivatives(component c, const unsigned *r, size_t n, const int *o, const double *v) { (void)r, (void)n, (void)o, (void)v; return failed(c, "inputs are held over a step"); }
AFO_API status fmi2GetRealOutputDerivatives(component c, const unsigned *r, size_t n, const int *o, double *v) { (void)r, (void)n, (void)o, (void)v; return failed(c, "it has no derivatives"); }
AFO_API status fmi2CancelStep(component c) { return failed(c, "no step is under way"); }
#define ASKED(kind, type) \
  AFO_API status fmi2Get##kind##Status(component c, int which, type *value) { (void)c, (void)which, (void)value; return DISCARD; }
ASKED(, status)
ASKED(Real, double)
ASKED(Integer, int)
ASKED(Boolean, int)
ASKED(String, const char *)
