/* MuJoCo as this process has it: found when it is needed, by its version's layout. */
#ifndef AFO_ENGINE_H
#define AFO_ENGINE_H

#include <setjmp.h>
#include <stdint.h>
#include "places.h" /* made at the build: number of each field; layouts of the versions that are known */

typedef struct mjModel_ mjModel;
typedef struct mjData_ mjData;
typedef double (*afo_callback)(const mjModel *, const mjData *, int);

/* Functions and variables of MuJoCo; the order is that of NAMES in engine.c. */
typedef struct {
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
  void (*error)(const char *, ...);
  void (*default_plugin)(void *);
  int (*register_plugin)(const void *);
  afo_callback *bias, *dyn;
  void (**user_error)(const char *);
  void (**user_warning)(const char *);
} afo_engine;

/* A call that a complaint jumps out of, in this thread. */
typedef struct {
  jmp_buf jump;
  char text[400];
} afo_guard;

extern _Thread_local afo_guard *afo_guarded;
extern int64_t afo_sim_places[AFO_PLACES];

/* MuJoCo's functions; NULL where this process has no MuJoCo whose layout is known, and why in `why`. */
const afo_engine *afo_mujoco(char *why, int size);
/* Whether the actuator i has its parameters from this package. */
int afo_ours(const mjModel *m, int i);

#define AFO_FIELD(type, owner, name) (*(type *)((char *)(owner) + afo_sim_places[name]))

#endif
