"""Commands as they were logged: a CSV of switched valves, played again."""

import os
import pathlib
from bisect import bisect_right
from collections.abc import Mapping, Sequence

from afo_sim.control.command import Command
from afo_sim.control.controller import Observation
from afo_sim.control.switch_log import Switch, read_log


class RecordedController:
    """A controller: the coils of a log, on average over each control period.

    At a rate of a command in each step it switches within steps, as the scenario's own `[timer]` does. A
    chamber without a row is shut, and after the log's end each keeps its coils.
    """

    def __init__(self, file: str | os.PathLike[str], chambers: Sequence[str]):
        self.log = read_log(pathlib.Path(file), chambers)

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The coils' mean from now to the next command."""
        return {
            chamber: (
                _mean(told, 0, seen.time, seen.period),
                _mean(told, 1, seen.time, seen.period),
            )
            for chamber, told in self.log.switches.items()
        }


def _mean(told: Sequence[Switch], side: int, start: float, period: float) -> float:
    """Share of a period from `start` for which a coil has current [-]."""
    total = 0.0
    first = max(bisect_right(told, start, key=lambda switch: switch.time) - 1, 0)
    for k in range(first, len(told)):
        if told[k].time >= start + period:
            break
        until = told[k + 1].time if k + 1 < len(told) else float("inf")
        if told[k].coils[side]:
            total += max(min(until, start + period) - max(told[k].time, start), 0.0)
    return round(min(total / period, 1.0), 9)  # to a billionth, so that an event on a step's edge is one
