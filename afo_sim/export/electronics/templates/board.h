/* The board of a program in the loop of a simulated run; the program defines setup and loop. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

typedef struct {
    uint64_t (*micros)(void);                                   /* since the beginning; a call takes 1 us */
    double (*read)(const char *column);                         /* the last sample, SI */
    void (*write)(const char *chamber, int inlet, int outlet);  /* coils with current: 0 or 1 */
} board_t;

void setup(const board_t *board);  /* once, at the beginning */
void loop(const board_t *board);   /* again and again; a wait ends, but writes count from the loop's beginning */

#endif
