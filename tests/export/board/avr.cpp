// An Arduino on an ATmega328P at 16 MHz: the calls that the sketch makes, of pins 0 to 7 and A0 to A5.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdlib.h>
#include <util/atomic.h>

enum { LOW = 0, HIGH = 1, INPUT = 0, OUTPUT = 1, INPUT_PULLUP = 2, A0 = 14, A1, A2, A3, A4, A5 };

static volatile uint32_t ticks;  // of timer 0 [ms]
ISR(TIMER0_COMPA_vect) { ticks++; }

static uint32_t millis() {
  while (PINC & _BV(5)) {}  // A5 hangs the board
  uint32_t found;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) found = ticks;
  return found;
}
static uint32_t micros() { return 1000u * millis(); }

static void put_bit(volatile uint8_t &port, uint8_t pin, bool on) { port = on ? port | _BV(pin) : port & ~_BV(pin); }
static void digitalWrite(uint8_t pin, uint8_t level) { put_bit(PORTD, pin, level); }
static void pinMode(uint8_t pin, uint8_t mode) {
  put_bit(DDRD, pin, mode == OUTPUT);
  if (mode == INPUT_PULLUP) put_bit(PORTD, pin, true);
}
static int digitalRead(uint8_t pin) { return PIND >> pin & 1; }
static int __attribute__((unused)) analogRead(uint8_t pin) {
  ADMUX = _BV(REFS0) | (pin - A0);
  ADCSRA = _BV(ADEN) | _BV(ADSC) | 7;
  while (ADCSRA & _BV(ADSC)) {}
  return ADC;
}

static struct {
  void begin(long) { UBRR0 = 16, UCSR0A = _BV(U2X0), UCSR0B = _BV(TXEN0); }
  void print(char letter) {
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = letter;
  }
  void print(const char *text) { while (*text) print(*text++); }
  void print(unsigned long number) { char text[11]; print(ultoa(number, text, 10)); }
  void print(unsigned number) { print((unsigned long)number); }
  void println(const char *text) { print(text), print('\n'); }
} Serial;

#include SKETCH

int main() {
  TCCR0A = _BV(WGM01), TCCR0B = _BV(CS01) | _BV(CS00), OCR0A = 249, TIMSK0 = _BV(OCIE0A);
  sei();
  setup();
  for (;;) loop();
}
