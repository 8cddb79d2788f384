/* Plays an exported folder to its end: play FOLDER OUT, which gets every output after every step. */
#include <stdio.h>
#include <time.h>
#include "afo_sim.h"

int main(int count, char **words) {
  char error[400];
  afo_sim *sim = count == 3 ? afo_open(words[1], error, sizeof error) : NULL;
  FILE *out = sim ? fopen(words[2], "wb") : NULL;
  if (!out) return fprintf(stderr, "%s\n", error), 1;
  clock_t begun = clock();
  long steps = 0;
  while (!afo_step(sim, 1)) steps++;
  clock_t took = clock() - begun;
  fprintf(stderr, "%.3f %s\n", 1e6 * took / CLOCKS_PER_SEC / steps, afo_error(sim));
  if (afo_reset(sim)) return 1;
  for (const afo_variable *v; steps-- && !afo_step(sim, 1);)
    for (int k = 0; (v = afo_describe(sim, k)); k++)
      if (!v->input && *v->name) {
        double value = afo_get(sim, k);
        if (fwrite(&value, sizeof value, 1, out) != 1) return 1;
      }
  fclose(out), afo_close(sim);
  return 0;
}
