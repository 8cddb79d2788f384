#define VALVES_PERIOD @PERIOD@u /* ticks */
#define VALVES_PLACE @PLACE@u /* on the clock at the beginning, ticks */

/* The coils from each place on the clock on, up to the next. */
typedef struct {
    uint32_t at; /* ticks */
    uint32_t coils;
} valves_change_t;
static const valves_change_t valves_changes[@COUNT@] = {
@CHANGES@
};

static inline uint32_t valves_coils_at(uint32_t place)
{
    uint32_t coils = valves_changes[0].coils;
    uint16_t k;
    for (k = 1; k < @COUNT@ && valves_changes[k].at <= place; k++)
        coils = valves_changes[k].coils;
    return coils;
}
