/* The sketch on a simulated ATmega328P, as a program in the loop: -DELF, -DSERIAL; -DCOLUMN at A0 with -DVOLTS per
 * unit; -DHANG, when A5 hangs it for 0.4 s [ms]. The run begins when the run switch has been closed. */
#include <simavr/avr_adc.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdio.h>

#include "board.h"

static avr_t *avr;
static uint64_t zero; /* cycle of the beginning */
static FILE *serial;

static void on_byte(struct avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq, (void)unused;
    if (value == 't' && zero == 0)
        zero = avr->cycle - 800; /* so that pins move between two looks at them */
    fputc((int)value, serial);
    fflush(serial);
}

static void pin(char port, int number, unsigned level)
{
    avr_ioport_external_t held = { port, 1u << number, level << number }; /* against the pull-up */
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &held);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), number), level);
}

static void sense(const board_t *board)
{
#ifdef COLUMN
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0),
                  (uint32_t)(1000.0 * VOLTS * board->read(COLUMN)) + 2); /* mV, within a count of 4.9 mV */
#endif
    (void)board;
}

void setup(const board_t *board)
{
    elf_firmware_t firmware = { 0 };
    uint32_t quiet = 0;

    elf_read_firmware(ELF, &firmware);
    serial = fopen(SERIAL, "w");
    avr = avr_make_mcu_by_name("atmega328p");
    avr_init(avr);
    avr_load_firmware(avr, &firmware);
    avr->frequency = 16000000;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr_extint_set_strict_lvl_trig(avr, 0, 0); /* else pins 2 and 3 are polled in each cycle */
    avr_extint_set_strict_lvl_trig(avr, 1, 0);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &quiet);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte, NULL);
    pin('D', 6, 1);
    sense(board);
    while (avr->cycle < 480000)
        avr_run(avr);
    pin('D', 6, 0);
    while (zero == 0 && avr->cycle < 2000000)
        avr_run(avr);
}

void loop(const board_t *board)
{
    const uint64_t now = board->micros();
    avr_ioport_state_t d;
    sense(board);
#ifdef HANG
    pin('C', 5, now >= 1000u * HANG && now < 1000u * HANG + 400000u);
#endif
    while (avr->cycle < zero + 16u * now)
        avr_run(avr);
    avr_ioctl(avr, AVR_IOCTL_IOPORT_GETSTATE('D'), &d);
    board->write("dorsiflexor", d.port & d.ddr & 4, d.port & d.ddr & 8);
    board->write("plantarflexor", d.port & d.ddr & 16, d.port & d.ddr & 32);
}
