/* The valves of @NAME@ on a PC: prints their switchings as CSV.
 *
 *     cc -std=c99 -o host host.c
 *     ./host @USAGE@ > host.csv
 *
 * A second argument is the clock's tick at the beginning, such as 4294967000 to see it wrap around.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "valves/valves.h"

static valves_t valves;
static uint32_t before;

static void print_chamber(uint64_t elapsed, int chamber, uint32_t coils)
{
    const uint64_t us = elapsed * VALVES_TICK_US;
    printf("%" PRIu64 ".%03u,%s,%d,%d\n", us / 1000u, (unsigned)(us % 1000u), valves_chamber_names[chamber],
           (coils & VALVES_INLET(chamber)) != 0, (coils & VALVES_OUTLET(chamber)) != 0);
}

/* Print the chambers whose coils changed, or all. */
static void print_coils(uint64_t elapsed, uint32_t coils, int all)
{
    int chamber;
    for (chamber = 0; chamber < VALVES_CHAMBERS; chamber++) {
        const uint32_t both = VALVES_INLET(chamber) | VALVES_OUTLET(chamber);
        if (all || ((coils ^ before) & both))
            print_chamber(elapsed, chamber, coils);
    }
    before = coils;
}
@MAIN@
int main(int count, char **arguments)
{
    uint32_t start = 0;
    if (count != 2 && count != 3) {
        fprintf(stderr, "usage: %s @USAGE@ [START_TICK]\n", arguments[0]);
        return 2;
    }
    if (count == 3)
        start = (uint32_t)strtoul(arguments[2], NULL, 10);
    return play(arguments[1], start);
}
