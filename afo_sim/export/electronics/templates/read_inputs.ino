
static bool read_inputs(VALVES_REAL *inputs) {
  for (uint8_t k = 0; k < VALVES_INPUTS; k++) {
    const int count = analogRead(CHANNELS[k].pin);
    if (count < CHANNELS[k].lowest || count > CHANNELS[k].highest) {
      stop("an input is outside its range");
      return false;
    }
    inputs[k] = CHANNELS[k].scale * (VOLTS_PER_COUNT * count) + CHANNELS[k].offset;
  }
  return true;
}
