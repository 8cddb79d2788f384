// Valves of @NAME@, exported by afo_sim. No medical device: see "What is not covered" in docs/electronics.md.
//
// All coils are off from boot until the run switch was opened and closed, while it is open, and for good
// after a fault: a loop that comes round too late, an input outside its range, an input without a
// calibration. A board that was reset does not begin again by itself. Coils off leave a normally closed
// valve shut: the air stays in the muscle. Wire an outlet valve that is normally open where the muscle is to
// empty without power; its coil's sense is then turned in OUTLET_OPEN.
#include "valves.h"
#if defined(__AVR__)
#include <avr/wdt.h>
#elif defined(ARDUINO_ARCH_ESP32)
#include <esp_system.h>
#elif defined(ARDUINO_ARCH_RP2040)
#include <hardware/watchdog.h>
#endif

// ---- Wiring: to be edited -------------------------------------------------------------------------
static const uint8_t PINS[VALVES_CHAMBERS][2] = {  // inlet, outlet: gate of each coil's MOSFET
@PINS@
};
static const uint8_t INLET_OPEN = HIGH;   // level that opens the valve: HIGH of a normally closed one
static const uint8_t OUTLET_OPEN = HIGH;
static const uint8_t RUN_PIN = @RUN_PIN@;  // run switch to ground; open: all coils off, the clock is set back
static const uint32_t LATE_MS = 100;  // longest time between two loops
// The run switch counts as closed, or as open since boot, once its contact rested for so long; an open one
// switches off at once. Assumed: three times Ganssle's longest bounce, 6.2 ms (A Guide to Debouncing, 2004).
static const uint32_t DEBOUNCE_MS = 20;
@CHANNELS@
// ---------------------------------------------------------------------------------------------------

static valves_t valves;
static uint32_t last_ms, last_tick, next_tick, coils_put;
static uint64_t elapsed;  // ticks since the beginning
static uint32_t moved_ms;  // when the contact of the run switch last moved
static bool contact;  // closed
static bool running = false;
static bool armed = false;  // the run switch was open since boot
static const char *fault = NULL;

static uint32_t board_tick() {
  return VALVES_TICK_US == 1000u ? (uint32_t)millis() : (uint32_t)micros();
}

static void write_valve(uint8_t pin, uint8_t open, bool on) {
  const bool high = on == (open == HIGH);
  digitalWrite(pin, high ? HIGH : LOW);
}

static void write_valves(uint32_t coils) {
  for (uint8_t k = 0; k < VALVES_CHAMBERS; k++) {
    write_valve(PINS[k][0], INLET_OPEN, (coils & VALVES_INLET(k)) != 0);
    write_valve(PINS[k][1], OUTLET_OPEN, (coils & VALVES_OUTLET(k)) != 0);
  }
}

static void all_off() {  // no current in any coil
  for (uint8_t k = 0; k < VALVES_CHAMBERS; k++)
    for (uint8_t side = 0; side < 2; side++) digitalWrite(PINS[k][side], LOW);
}

static void stop(const char *why) {
  all_off();
  if (fault == NULL) {
    fault = why;
    Serial.print("# stopped: ");
    Serial.println(why);
  }
}

static void print_chamber(uint8_t k, uint32_t coils) {  // a row as host.c prints it
  const uint64_t us = elapsed * VALVES_TICK_US;
  const unsigned beyond = (unsigned)(us % 1000u);
  Serial.print((unsigned long)(us / 1000u));
  Serial.print(beyond < 10 ? ".00" : beyond < 100 ? ".0" : ".");
  Serial.print(beyond);
  Serial.print(',');
  Serial.print(valves_chamber_names[k]);
  Serial.print((coils & VALVES_INLET(k)) ? ",1" : ",0");
  Serial.println((coils & VALVES_OUTLET(k)) ? ",1" : ",0");
}

static void put(uint32_t coils, bool all) {
  if (!all && coils == coils_put) return;
  write_valves(coils);  // before the slow port
  if (all) Serial.println("time_ms,chamber,inlet,outlet");
  for (uint8_t k = 0; k < VALVES_CHAMBERS; k++)
    if (all || ((coils ^ coils_put) & (VALVES_INLET(k) | VALVES_OUTLET(k)))) print_chamber(k, coils);
  coils_put = coils;
}
@READ@
static bool watchdog_reset() {  // whether it was the watchdog that reset the board
#if defined(__AVR__)
  const bool found = (MCUSR & _BV(WDRF)) != 0;  // where the bootloader leaves it
  MCUSR = 0;  // else the watchdog stays on
  wdt_disable();
  return found;
#elif defined(ARDUINO_ARCH_ESP32)
  const esp_reset_reason_t why = esp_reset_reason();
  return why == ESP_RST_INT_WDT || why == ESP_RST_TASK_WDT;  // by others it begins after an upload, too
#elif defined(ARDUINO_ARCH_RP2040)
  return watchdog_enable_caused_reboot();
#else
  return false;  // not known here
#endif
}

void setup() {
  const bool by_watchdog = watchdog_reset();
  all_off();  // before the pins drive: a gate is never high for a moment
  for (uint8_t k = 0; k < VALVES_CHAMBERS; k++)
    for (uint8_t side = 0; side < 2; side++) pinMode(PINS[k][side], OUTPUT);
  all_off();
  pinMode(RUN_PIN, INPUT_PULLUP);
  Serial.begin(115200);
  if (by_watchdog) stop("the watchdog reset the board");
  contact = digitalRead(RUN_PIN) == LOW;
  if (contact && fault == NULL) Serial.println("# open the run switch, then close it");
@CALIBRATED@  last_ms = moved_ms = millis();
#if defined(__AVR__)
  wdt_enable(WDTO_250MS);
#endif
}

static void begin(uint32_t tick) {
  running = true;
  elapsed = 0;
  last_tick = next_tick = tick;
  valves_begin(&valves, tick);
}

static bool still(uint32_t ms) {  // whether the run switch's contact is at rest
  const bool closed = digitalRead(RUN_PIN) == LOW;
  if (closed != contact) moved_ms = ms;
  contact = closed;
  return (uint32_t)(ms - moved_ms) >= DEBOUNCE_MS;
}

void loop() {
#if defined(__AVR__)
  wdt_reset();
#endif
  const uint32_t ms = millis();
  if ((uint32_t)(ms - last_ms) > LATE_MS) stop("the loop came round too late");
  last_ms = ms;
  if (fault != NULL) {
    all_off();
    return;
  }
  const bool rests = still(ms);
  if (!contact) {
    all_off();
    running = false;
    armed = armed || rests;
    return;
  }
  if (!armed || (!running && !rests)) return;
  const bool first = !running;
  uint32_t tick = board_tick();
  if (first) begin(tick);
#if VALVES_STEP > 0
  if ((uint32_t)(tick - next_tick) >= 0x80000000u) return;  // not yet due
  tick = next_tick;  // the time that is due, so that looks do not drift
  next_tick += VALVES_STEP;
#endif
  elapsed += (uint32_t)(tick - last_tick);
  last_tick = tick;
  VALVES_REAL inputs[VALVES_INPUTS + 1] = { 0 };
  if (!read_inputs(inputs)) return;
  put(valves_at(&valves, tick, inputs), first);
}
