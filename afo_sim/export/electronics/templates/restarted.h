
#define VALVES_CLOSED ((VALVES_REAL)@THRESHOLD@) /* the foot switch is closed from here on */
#define VALVES_AFTER @AFTER@u /* least ticks from one heel strike to the next */

typedef struct {
    uint32_t begun;  /* the clock, ticks */
    uint32_t struck; /* last heel strike, ticks */
    uint8_t closed;  /* the foot switch */
    uint8_t ready;   /* for a heel strike */
    uint8_t ended;   /* the clock stands at its period */
} valves_t;

static inline void valves_begin(valves_t *v, uint32_t now)
{
    v->begun = v->struck = now;
    v->closed = 1; /* a switch that is closed at first was not seen to close */
    v->ready = 1;
    v->ended = 0;
}

/* To be asked at least once in 2^32 ticks less a period: the wrap of the clock is then of no account. */
static inline uint32_t valves_at(valves_t *v, uint32_t now, const VALVES_REAL *inputs)
{
    const uint8_t closed = inputs[0] >= VALVES_CLOSED;
    if (!v->ready && now - v->struck >= VALVES_AFTER)
        v->ready = 1;
    if (closed && !v->closed && v->ready) {
        v->begun = v->struck = now;
        v->ready = v->ended = 0;
    }
    v->closed = closed;
    if (now - v->begun >= VALVES_PERIOD)
        v->ended = 1; /* and stays so, also when the clock has wrapped */
    return v->ended ? 0u : valves_coils_at(now - v->begun);
}
