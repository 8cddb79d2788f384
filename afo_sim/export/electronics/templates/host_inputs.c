
#define LINE 4096
static const char header[] = "time_ms@COLUMNS@";

/* Play a CSV of inputs, a row a step; the last rows repeat the coils, and tell where it ends. */
static int play(const char *file, uint32_t start)
{
    static char line[LINE];
    VALVES_REAL inputs[VALVES_INPUTS ? VALVES_INPUTS : 1] = { 0 };
    uint64_t elapsed = 0;
    int rows = 0, k;
    FILE *opened = fopen(file, "r");
    if (opened == NULL || fgets(line, LINE, opened) == NULL) {
        fprintf(stderr, "%s: cannot be read\n", file);
        return 2;
    }
    line[strcspn(line, "\r\n")] = '\0';
    if (strcmp(line, header) != 0) {
        fprintf(stderr, "%s: its first line is not %s\n", file, header);
        return 2;
    }
    printf("time_ms,chamber,inlet,outlet\n");
    valves_begin(&valves, start);
    for (; fgets(line, LINE, opened) != NULL; rows++) {
        char *at = line, *end;
        elapsed = (uint64_t)(strtod(at, &end) * 1000.0 / VALVES_TICK_US + 0.5);
        for (k = 0; k < VALVES_INPUTS && end != at && *end == ','; k++) {
            at = end + 1;
            inputs[k] = (VALVES_REAL)strtod(at, &end);
        }
        if (k < VALVES_INPUTS || end == at) {
            fprintf(stderr, "%s: row %d is not complete\n", file, rows + 1);
            return 2;
        }
        print_coils(elapsed, valves_at(&valves, start + (uint32_t)elapsed, inputs), rows == 0);
    }
    print_coils(elapsed + VALVES_STEP, before, 1);
    fclose(opened);
    return 0;
}
