/* The exported valves as a program in the loop of a simulated run. */
#include "board.h"
#include "valves/valves.h"

static valves_t valves;
static uint32_t due;

static uint32_t tick_of(const board_t *board)
{
    return (uint32_t)(board->micros() / VALVES_TICK_US); /* wraps around, as a board's clock does */
}

void setup(const board_t *board)
{
    due = tick_of(board);
    valves_begin(&valves, due);
}

void loop(const board_t *board)
{
    VALVES_REAL inputs[VALVES_INPUTS + 1] = { 0 };
    uint32_t tick = tick_of(board), coils;
    int k;
#if VALVES_STEP > 0
    if (tick - due >= 0x80000000u)
        return; /* not yet due */
    tick = due;
    due += VALVES_STEP;
#endif
#if VALVES_INPUTS > 0
    for (k = 0; k < VALVES_INPUTS; k++)
        inputs[k] = (VALVES_REAL)board->read(valves_input_names[k]);
#endif
    coils = valves_at(&valves, tick, inputs);
    for (k = 0; k < VALVES_CHAMBERS; k++)
        board->write(valves_chamber_names[k], (coils & VALVES_INLET(k)) != 0, (coils & VALVES_OUTLET(k)) != 0);
}
