#include "Arduino.h"
#include <cstdlib>
#include <cstring>

uint64_t board_us;
int levels[64], modes[64], counts[16], run_switch = LOW;
SerialPort Serial;

#include SKETCH

static int coils_on() {
  int on = 0;
  for (int pin = 0; pin < 64; pin++) on += modes[pin] == OUTPUT && levels[pin] == HIGH;
  return on;
}

static void rest(int level, long ms) {  // the run switch, in loops of a millisecond
  run_switch = level;
  for (; ms > 0; ms--, board_us += 1000) loop();
}

// play SECONDS START_US [late|open|broken|closed|bounce AT_MS]; the run switch closes 20 ms after START_US
int main(int count, char **arguments) {
  const long end = (long)(1000.0 * std::atof(arguments[1]));
  const char *what = count > 4 ? arguments[3] : "";
  const long at = count > 4 ? std::atol(arguments[4]) : -1;
  board_us = std::strtoull(arguments[2], nullptr, 10);
  for (int &level : levels) level = HIGH;  // what the pins hold before the program says
  for (int &value : counts) value = 512;
  if (std::strcmp(what, "closed")) run_switch = HIGH;
  setup();
  std::fprintf(stderr, "boot %d\n", coils_on());
  rest(run_switch, 21);
  rest(LOW, 20);
  const bool bounces = !std::strcmp(what, "bounce");
  int before = coils_on();
  for (long ms = 0; ms < end; ms++) {
    if (ms == at && !std::strcmp(what, "late")) board_us += 200000;
    if (ms == at && !std::strcmp(what, "open")) run_switch = HIGH;
    if (ms == at && !std::strcmp(what, "broken")) counts[0] = -1;
    const long since = bounces ? ms - at : -1;  // it opens, and closes 50 ms later, each with 10 ms of bounces
    if (since >= 0 && since < 60) run_switch = since % 50 >= 10 || since % 2 == 0;
    loop();
    if (bounces && coils_on() != before) std::fprintf(stderr, "%ld:%d ", ms, coils_on());
    before = coils_on();
    board_us += 1000;
  }
  std::fprintf(stderr, "end %d\n", coils_on());
}
