/* Plays an exported scenario to its end, and prints time and outputs every 10 ms. */
#include <math.h>
#include <stdio.h>
#include "afo_sim.h"

#define END @END@ /* of the scenario [s] */

int main(int count, char **words) {
  char error[400];
  afo_sim *sim = afo_open(count > 1 ? words[1] : ".", error, sizeof error);
  const afo_variable *v;
  if (!sim) return fprintf(stderr, "%s\n", error), 1;
  int every = (int)fmax(1.0, round(0.01 / afo_timestep(sim))), steps = (int)round(END / afo_timestep(sim));
  int failed = 0;
  printf("time [s]");
  for (int k = 0; (v = afo_describe(sim, k)); k++)
    if (!v->input && *v->name) printf(",%s [%s]", v->name, v->unit);
  for (int done = 0; done <= steps && !failed; done += every) {
    printf("\n%.9g", done * afo_timestep(sim));
    for (int k = 0; (v = afo_describe(sim, k)); k++)
      if (!v->input && *v->name) printf(",%.9g", afo_get(sim, k));
    if (done + every <= steps) failed = afo_step(sim, every);
  }
  printf("\n");
  if (failed) fprintf(stderr, "%s\n", afo_error(sim));
  afo_close(sim);
  return -failed;
}
