/* Plays an exported scenario, and prints time and outputs every 10 ms. */
#include <math.h>
#include <stdio.h>
#include "afo_sim.h"

int main(int count, char **words) {
  char error[400];
  afo_sim *sim = afo_open(count > 1 ? words[1] : ".", error, sizeof error);
  const afo_variable *v;
  if (!sim) return fprintf(stderr, "%s\n", error), 1;
  int every = (int)fmax(1.0, round(0.01 / afo_timestep(sim))), failed = 0;
  printf("time [s]");
  for (int k = 0; (v = afo_describe(sim, k)); k++)
    if (!v->input && *v->name) printf(",%s [%s]", v->name, v->unit);
  for (int row = 0; !failed; row++) {
    printf("\n%.9g", row * every * afo_timestep(sim));
    for (int k = 0; (v = afo_describe(sim, k)); k++)
      if (!v->input && *v->name) printf(",%.9g", afo_get(sim, k));
    failed = afo_step(sim, every);
  }
  fprintf(stderr, "\n%s\n", afo_error(sim)); /* the scenario's own inputs have ended, or what went wrong */
  afo_close(sim);
  return 0;
}
