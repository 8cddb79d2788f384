/* Each function of afo_sim.h, and each way in which it refuses, for checkers of memory: careful FOLDER. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "afo_sim.h"

#define CHECK(what) if (!(what)) return fprintf(stderr, "line %d: %s is false\n", __LINE__, #what), 1

int main(int count, char **words) {
  char error[400] = "", tiny[4];
  CHECK(count == 2 && !afo_open("/nowhere", error, sizeof error) && strstr(error, "/nowhere"));
  CHECK(!afo_open("/nowhere", tiny, sizeof tiny) && strlen(tiny) == 3 && !afo_open(NULL, NULL, 0));
  afo_sim *one = afo_open(words[1], error, sizeof error), *two = afo_open(words[1], NULL, 0);
  CHECK(one && two && !*error);
  int angle = afo_find(one, "ankle/angle"), coil = afo_find(one, "valve/dorsiflexor_inlet/coil");
  int supply = afo_find(one, "supply/pressure"), size = afo_state(one, NULL);
  CHECK(angle > 0 && coil >= 0 && supply >= 0 && afo_find(one, "angle") == -1 && afo_find(one, "") != angle);
  CHECK(!afo_describe(one, -1) && !afo_describe(one, 1 << 30) && isnan(afo_get(one, -1)));
  CHECK(afo_set(one, angle, 0.0) && afo_set(one, -1, 0.0) && afo_set(one, coil, INFINITY));
  CHECK(!afo_step(one, 0) && !afo_step(one, -3) && !afo_step(one, 100));
  double *kept = malloc(size * sizeof *kept), *other = malloc(size * sizeof *other);
  CHECK(afo_state(one, kept) == size && !afo_set(one, coil, 1.0) && !afo_step(one, 100));
  double there = afo_get(one, angle);
  for (int k = 0; k < 200; k++) CHECK(!afo_step(two, 1)); /* the scenario's own timer opens the valve, too */
  CHECK(afo_get(two, angle) == there);
  CHECK(!afo_restore(two, kept) && !afo_step(two, 100) && afo_get(two, angle) == there);
  CHECK(!afo_set(one, supply, -5e5) && afo_step(one, 1) && strstr(afo_error(one), "'chamber_dorsiflexor'"));
  afo_state(one, other);
  CHECK(afo_step(one, 1) && afo_restore(one, other));
  other[0] = NAN;
  CHECK(afo_restore(one, other) && !afo_restore(one, kept) && !*afo_error(one));
  CHECK(!afo_step(one, 100) && afo_get(one, angle) == there);
  CHECK(!afo_reset(one) && isfinite(afo_get(one, angle)) && !afo_step(one, 200) && afo_get(one, angle) == there);
  CHECK(afo_timestep(one) > 0.0);
  free(kept), free(other), afo_close(one), afo_close(two), afo_close(NULL);
  return 0;
}
