
/* Play so many seconds; the last rows repeat the coils, and tell where it ends. */
static int play(const char *seconds, uint32_t start)
{
    const double asked = strtod(seconds, NULL);
    const uint64_t step = VALVES_STEP ? VALVES_STEP : 1u;
    uint64_t end, elapsed;
    if (!(asked > 0.0 && asked <= 1e6)) {
        fprintf(stderr, "%s: is no duration; allowed: seconds, up to 1e6\n", seconds);
        return 2;
    }
    end = (uint64_t)(asked * 1e6 / VALVES_TICK_US + 0.5);
    printf("time_ms,chamber,inlet,outlet\n");
    valves_begin(&valves, start);
    for (elapsed = 0; elapsed < end; elapsed += step) {
        const uint32_t coils = valves_at(&valves, start + (uint32_t)elapsed, NULL);
        print_coils(elapsed, coils, elapsed == 0);
    }
    print_coils(end, before, 1);
    return 0;
}
