
typedef struct {
    uint32_t begun; /* present period, ticks */
} valves_t;

static inline void valves_begin(valves_t *v, uint32_t now)
{
    v->begun = now - VALVES_PLACE;
}

/* To be asked at least once in 2^32 ticks less a period: the wrap of the clock is then of no account. */
static inline uint32_t valves_at(valves_t *v, uint32_t now, const VALVES_REAL *inputs)
{
    uint32_t place = now - v->begun; /* modulo 2^32, so that the clock may have wrapped in between */
    (void)inputs;
    if (place >= VALVES_PERIOD) {
        v->begun += place / VALVES_PERIOD * VALVES_PERIOD;
        place %= VALVES_PERIOD;
    }
    return valves_coils_at(place);
}
