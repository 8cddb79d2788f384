// An Arduino for the host: its clock and pins are variables of the test.
#pragma once
#include <cstdint>
#include <cstdio>

typedef uint8_t byte;
enum { LOW = 0, HIGH = 1, INPUT = 0, OUTPUT = 1, INPUT_PULLUP = 2, A0 = 54, A1, A2, A3, A4, A5 };

extern uint64_t board_us;  // since the program began, from which both clocks wrap
extern int levels[64], modes[64], counts[16], run_switch;

inline unsigned long millis() { return (uint32_t)(board_us / 1000); }
inline unsigned long micros() { return (uint32_t)board_us; }
inline void pinMode(int pin, int mode) { modes[pin] = mode; }
inline void digitalWrite(int pin, int level) { levels[pin] = level; }
inline int digitalRead(int) { return run_switch; }
inline int analogRead(int pin) { return counts[pin - A0]; }

struct SerialPort {
  void begin(long) {}
  void print(const char *text) { std::printf("%s", text); }
  void print(char letter) { std::printf("%c", letter); }
  void print(unsigned long number) { std::printf("%lu", number); }
  void print(unsigned number) { std::printf("%u", number); }
  void println(const char *text) { std::printf("%s\n", text); }
};
extern SerialPort Serial;
