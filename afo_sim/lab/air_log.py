"""Air per stride in a log of a worn device, compared with the predicted band."""

import pathlib
from collections.abc import Sequence

import numpy as np

from afo_sim.common import (
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    STANDARD_DENSITY,
    InputError,
    number,
    read_facts,
    read_table,
    scale_of,
    split_title,
)
from afo_sim.lab.ledger import LedgerRow

EXAMPLE = "time [s], heel strike [-], bottle mass [g]"
WAYS = {"bottle mass": "kg", "tank pressure": "Pa", "flow": "m^3/s"}
COLUMNS = {"time": "s", "heel strike": "", **WAYS}
FACTS: dict[str, str | None] = {"tank volume": "m^3", "error": "kg"}
LEAST = 20  # strides, whose mean says something
SHORTEST = 0.4  # stride [s]


def air_row(file: pathlib.Path, band: Sequence[float]) -> LedgerRow:
    """The mean air per stride of a log, and its predicted 5, 50, 95 % [g]."""
    table, columns = read_table(file, EXAMPLE), {}
    for k, title in enumerate(table.titles):
        name = split_title(title)[0]
        if name in COLUMNS:
            scale, _ = scale_of(file, name, title, (COLUMNS[name],), EXAMPLE)
            columns[name] = scale * np.array([number(file, line, name, row[k]) for line, row in table.rows])
    facts, ways = read_facts(table, FACTS), [name for name in WAYS if name in columns]
    known = len(ways) == 1 and {"time", "heel strike"} <= columns.keys()
    if not known or (ways == ["tank pressure"] and "tank volume" not in facts):
        allowed = f"time, heel strike and one of {', '.join(WAYS)} (with # tank volume: 2 l): {EXAMPLE}"
        raise InputError("does not state air by strides", file=file, field="header", allowed=allowed)
    down = columns["heel strike"] > 0.5
    starts = 1 + np.flatnonzero(down[1:] & ~down[:-1])
    apart = np.diff(columns["time"][starts], prepend=-np.inf)
    starts = starts[apart > SHORTEST]  # a switch that chatters is not another stride
    if len(starts) <= LEAST:
        raise InputError(f"holds {len(starts)} heel strikes", file=file, allowed=f"more than {LEAST}")
    first, last, x = starts[0], starts[-1], columns[ways[0]]
    air = x[first] - x[last]
    if ways == ["tank pressure"]:
        air *= facts["tank volume"] / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
    elif ways == ["flow"]:
        air = STANDARD_DENSITY * np.trapezoid(x[first : last + 1], columns["time"][first : last + 1])
    mean, error = (float(1e3 * x / (len(starts) - 1)) for x in (air, facts.get("error", 0.0)))
    if mean <= 0.0 or error < 0.0 or np.diff(columns["time"]).min() <= 0.0:
        allowed = "air that is taken, an error that is not negative, and times that increase"
        raise InputError("is no log of consumed air", file=file, value=f"{mean:.3g} g", allowed=allowed)
    beyond = max(band[0] - mean, mean - band[2])  # of the band; within the error nothing is refuted
    words = "not distinguishable from" if abs(beyond) < error else "inside" if beyond <= 0.0 else "outside"
    told = f"{words} the predicted band ({file})"
    return LedgerRow(file.stem, "air per stride", "g", tuple(band), mean, error, told)
