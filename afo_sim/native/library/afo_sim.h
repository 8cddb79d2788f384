/* A pneumatic orthosis outside Python: what `afo-sim export --to c` writes, stepped by MuJoCo.
 *
 * Every function that can fail says so by its result, and `afo_error` says why. A simulation that has failed
 * goes on after `afo_reset` or `afo_restore`. Simulations are independent of each other; one is used by one
 * thread at a time. No argument may be NULL but where it is said. Units are SI: Pa (gauge), N, rad, kg;
 * dorsiflexion is positive. */
#ifndef AFO_SIM_H
#define AFO_SIM_H

#if defined(_WIN32)
#define AFO_API __declspec(dllexport)
#else
#define AFO_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef struct afo_sim afo_sim;

typedef struct {
  const char *name, *unit, *description;
  int input; /* 1 of what may be set, 0 of what is only read */
} afo_variable;

/* Open an exported folder, at its start; NULL and a sentence in `error` (of `size` letters) where it cannot. */
AFO_API afo_sim *afo_open(const char *folder, char *error, int size);
/* Take so many time steps; 0, or -1 where one failed, which is then not counted. */
AFO_API int afo_step(afo_sim *sim, int steps);
/* The number of a variable; -1 where there is none of this name. */
AFO_API int afo_find(const afo_sim *sim, const char *name);
/* What a variable is; NULL beyond the last one. */
AFO_API const afo_variable *afo_describe(const afo_sim *sim, int number);
/* Set an input from here on; NAN gives it back to the scenario's own timer, walk or recorded commands. */
AFO_API int afo_set(afo_sim *sim, int number, double value);
/* The value of a variable: forces and pressures of the step that was taken last. */
AFO_API double afo_get(const afo_sim *sim, int number);
/* Write the whole state into `state`, unless it is NULL; how many numbers it has. */
AFO_API int afo_state(const afo_sim *sim, double *state);
/* Go on from a state; 0, or -1 where a number of it is not finite. */
AFO_API int afo_restore(afo_sim *sim, const double *state);
/* Go back to the start, all inputs the scenario's own. */
AFO_API int afo_reset(afo_sim *sim);
AFO_API void afo_close(afo_sim *sim);
AFO_API double afo_timestep(const afo_sim *sim); /* [s] */
AFO_API const char *afo_error(const afo_sim *sim);

#ifdef __cplusplus
}
#endif
#endif
