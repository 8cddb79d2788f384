"""Switched valves as a CSV logs them: read, compared, and played again as commands."""

import math
import os
import pathlib
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest

from afo_sim.common import InputError, Table, read_table, unknown
from afo_sim.control.command import COILS, Command
from afo_sim.control.controller import Observation

TITLES = ("time_ms", "chamber", "inlet", "outlet")
EXAMPLE = "time_ms,chamber,inlet,outlet"
Coils = tuple[bool, bool]  # inlet, outlet


@dataclass(frozen=True)
class Switch:
    """A chamber's coils from a time on [s]."""

    time: float
    coils: Coils


@dataclass(frozen=True)
class Log:
    """Switchings by chamber in the order of time, the first at the beginning; `end` is the last time [s]."""

    switches: Mapping[str, tuple[Switch, ...]]
    end: float

    @classmethod
    def of(cls, rows: Iterable[tuple[float, str, Coils]], end: float, chambers: Sequence[str]) -> "Log":
        """From rows in the order of time; rows that change nothing are left out."""
        found: dict[str, list[Switch]] = {chamber: [] for chamber in chambers}
        for time, chamber, coils in rows:
            before = found[chamber]
            if not before or before[-1].coils != coils:
                before.append(Switch(time, coils))
        return cls({chamber: tuple(switches) for chamber, switches in found.items()}, end)

    def text(self) -> str:
        """As CSV: in order of time, with a last row for each chamber that marks the log's end."""
        rows = []
        for k, (name, switches) in enumerate(self.switches.items()):
            rows += [(s.time, k, name, s.coils) for s in switches]
            rows += [(self.end, k, name, s.coils) for s in switches[-1:]]
        rows.sort(key=lambda row: row[:2])
        lines = [f"{1e3 * time:.6f},{name},{on[0]:d},{on[1]:d}" for time, _, name, on in rows]
        return "\n".join([",".join(TITLES), *lines, ""])


def read_log(file: pathlib.Path, chambers: Sequence[str]) -> Log:
    """Read a CSV of switchings, as the host program and the sketch print it."""
    if not file.is_file():
        raise InputError("there is no such file", file=file, field="--read", allowed="a log in CSV")
    table = read_table(file, EXAMPLE)
    titles = [title.strip() for title in table.titles]
    for title in TITLES:
        if title not in titles:
            problem = f"the column {title!r} is missing"
            raise InputError(problem, file=file, field="header", value=",".join(titles), allowed=EXAMPLE)
    rows = [_row(table, number, dict(zip(titles, cells, strict=True))) for number, cells in table.rows]
    if not rows:
        raise InputError("holds no switching", file=file, allowed=EXAMPLE)
    for (number, _), (row, after) in zip(table.rows[1:], pairwise(rows), strict=True):
        if after[0] < row[0]:
            problem = f"line {number}: the time falls"
            allowed = "one run, in the order of time"
            raise InputError(problem, file=file, field="time_ms", value=1e3 * after[0], allowed=allowed)
    for (number, _), row in zip(table.rows, rows, strict=True):
        if row[1] not in chambers:
            problem = f"line {number}: the orthosis has no such chamber"
            raise unknown(row[1], chambers, file=file, field="chamber", problem=problem)
    return Log.of(rows, rows[-1][0], chambers)


def _row(table: Table, number: int, cells: Mapping[str, str]) -> tuple[float, str, Coils]:
    try:
        time = float(cells["time_ms"])
    except ValueError:
        time = math.nan
    if not 0.0 <= time < 1e12:
        problem, allowed = f"line {number}: is not a valid time", "milliseconds from 0 on"
        raise InputError(problem, file=table.file, field="time_ms", value=cells["time_ms"], allowed=allowed)
    coils = []
    for side in ("inlet", "outlet"):
        text = cells[side].strip()
        if text not in ("0", "1"):
            problem = f"line {number}: is not a coil that is on or off"
            raise InputError(problem, file=table.file, field=side, value=text, allowed="0 or 1")
        coils.append(text == "1")
    return round(1e-3 * time, 9), cells["chamber"].strip(), (coils[0], coils[1])


@dataclass(frozen=True)
class Difference:
    """How a chamber's switchings differ from the simulation's."""

    chamber: str
    counts: tuple[int, int]
    first: str
    largest: float


def differences(log: Log, simulated: Log, within: float) -> list[Difference]:
    """Each chamber's switchings, one by one, in the time that both have."""
    end = min(log.end, simulated.end)
    return [
        _difference(name, log.switches.get(name, ()), simulated.switches[name], end, within)
        for name in simulated.switches
    ]


def _difference(
    name: str, logged: Sequence[Switch], simulated: Sequence[Switch], end: float, within: float
) -> Difference:
    one_count, other_count = (sum(s.time < end for s in each[1:]) for each in (logged, simulated))
    largest, first = 0.0, ""
    for number, (one, other) in enumerate(zip_longest(logged, simulated)):
        if min(switch.time for switch in (one, other) if switch is not None) >= end - within:
            break  # one of the two had ended
        if one is None or other is None or one.coils != other.coils:
            first = first or _told(number, one, other)
            break
        largest = max(largest, abs(one.time - other.time))
        if abs(one.time - other.time) > within and not first:
            first = _told(number, one, other)
    return Difference(name, (one_count, other_count), first, largest)


def _told(number: int, one: Switch | None, other: Switch | None) -> str:
    place = f"switching {number}" if number else "at the beginning"
    return f"{place}: {_said(one)}, simulated {_said(other)}"


def _said(switch: Switch | None) -> str:
    if switch is None:
        return "nothing"
    word = next(word for word, coils in COILS.items() if coils == switch.coils)
    return f"{word} at {1e3 * switch.time:.3f} ms"


class RecordedController:
    """A controller: the coils of a log, on average over each control period."""

    def __init__(self, file: str | os.PathLike[str], chambers: Sequence[str]):
        self.log = read_log(pathlib.Path(file), chambers)

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The coils' mean from now to the next command."""
        return {
            chamber: (_mean(switches, 0, seen.time, seen.period), _mean(switches, 1, seen.time, seen.period))
            for chamber, switches in self.log.switches.items()
        }


def _mean(switches: Sequence[Switch], side: int, start: float, period: float) -> float:
    """Share of a period from `start` for which a coil has current [-]."""
    total, end = 0.0, start + period
    first = max(bisect_right(switches, start, key=lambda switch: switch.time) - 1, 0)
    last = bisect_left(switches, end, key=lambda switch: switch.time)
    for one, after in zip_longest(switches[first:last], switches[first + 1 : last]):
        if one.coils[side]:
            total += max((end if after is None else after.time) - max(one.time, start), 0.0)
    return round(min(total / period, 1.0), 9)  # to a billionth, so that an event on a step's edge is one
