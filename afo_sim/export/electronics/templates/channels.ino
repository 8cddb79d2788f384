typedef struct {
  uint8_t pin;
  float scale, offset;  // value [SI] = scale * volts + offset; scale 0 is not calibrated and stops the valves
  int lowest, highest;  // counts outside of which the sensor or its wire is broken
} channel_t;
static const channel_t CHANNELS[VALVES_INPUTS] = {
@ROWS@
};
static const float VOLTS_PER_COUNT = 5.0f / 1023.0f;  // of the board's converter: 3.3 V and 4095 on many
