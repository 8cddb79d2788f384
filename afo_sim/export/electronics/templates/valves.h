/* Valves of @NAME@, exported by afo_sim.
 * Change the scenario and export again, rather than this file.
@NOTES@ *
 * valves_begin(&v, now)       once, before the first look
 * valves_at(&v, now, inputs)  @WHEN@; returns the coils as bits:
 *                             VALVES_INLET(chamber), VALVES_OUTLET(chamber)
 *
 * `now` counts ticks of VALVES_TICK_US microseconds in 32 bits and may wrap around.
 */
#ifndef VALVES_H
#define VALVES_H

#include <stdint.h>

#ifndef VALVES_REAL
#define VALVES_REAL float /* of the inputs, SI */
#endif

#define VALVES_TICK_US @TICK@u /* a tick of the clock [us] */
#define VALVES_STEP @STEP@u /* ticks from one look to the next; 0: as often as the loop comes round */
#define VALVES_CHAMBERS @CHAMBERS@
#define VALVES_INPUTS @INPUTS@
#define VALVES_INLET(chamber) ((uint32_t)1u << (2 * (chamber)))
#define VALVES_OUTLET(chamber) ((uint32_t)2u << (2 * (chamber)))

enum { @CHAMBER_ENUM@ };
static const char *const valves_chamber_names[VALVES_CHAMBERS] = { @CHAMBER_NAMES@ };
@INPUT_NAMES@
@LOGIC@
#endif
