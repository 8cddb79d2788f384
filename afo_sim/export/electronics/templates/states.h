#define VALVES_STATES @COUNT@
enum { @STATE_ENUM@ };
static const char *const valves_state_names[VALVES_STATES] = { @STATE_NAMES@ };

/* Coils that a state commands, and those of them that have current; the others keep theirs. */
static const uint32_t valves_named[VALVES_STATES] = { @NAMED@ };
static const uint32_t valves_coils[VALVES_STATES] = {
@COILS@
};

#define VALVES_STATE_TIME 255u /* instead of an input: the time in the state, in steps */
#define VALVES_END 255u /* instead of a state: end of the table */

/* Transitions in the order in which they are looked at: the first that holds is taken, one in a step. */
typedef struct {
    uint8_t source, to;
    uint8_t input;
    uint8_t above;         /* 1: from the threshold on; 0: below it */
    VALVES_REAL threshold; /* of the input, SI */
    uint32_t steps;        /* threshold of the time in the state */
    uint32_t after;        /* least steps in the state */
} valves_rule_t;
static const valves_rule_t valves_rules[] = {
@RULES@
    { VALVES_END, 0, 0, 0, 0, 0u, 0u }
};

typedef struct {
    uint32_t coils;
    uint32_t steps; /* in the state */
    uint8_t state;
} valves_t;

static inline void valves_begin(valves_t *v, uint32_t now)
{
    (void)now;
    v->coils = 0u;
    v->steps = 0u;
    v->state = @START@;
}

static inline int valves_holds(const valves_rule_t *rule, uint32_t steps, const VALVES_REAL *inputs)
{
    if (steps < rule->after)
        return 0;
    if (rule->input == VALVES_STATE_TIME)
        return rule->above ? steps >= rule->steps : steps < rule->steps;
    return rule->above ? inputs[rule->input] >= rule->threshold : inputs[rule->input] < rule->threshold;
}

static inline uint32_t valves_at(valves_t *v, uint32_t now, const VALVES_REAL *inputs)
{
    const valves_rule_t *rule;
    const uint32_t steps = v->steps;
    (void)now; /* it counts its own steps */
    if (v->steps < UINT32_MAX)
        v->steps++;
    for (rule = valves_rules; rule->source != VALVES_END; rule++) {
        if (rule->source == v->state && valves_holds(rule, steps, inputs)) {
            v->state = rule->to;
            v->steps = 1u;
            break;
        }
    }
    v->coils = (v->coils & ~valves_named[v->state]) | valves_coils[v->state];
    return v->coils;
}
