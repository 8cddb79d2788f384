"""One cycle of either leg, the air that both draw from the source in it, and the worse leg's verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.description.attachment import Side
from afo_sim.description.reader import load
from afo_sim.description.scenario_text import body_mass
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.strides import progress, settled, strides
from afo_sim.metrics.supply import FLOW
from afo_sim.metrics.verdict import AIR, Answer, Status, verdict
from afo_sim.simulation.both_source import SAGGING, litres_a_minute, on_source
from afo_sim.simulation.examine import described_cycle
from afo_sim.simulation.judged import feed_of, limits_of
from afo_sim.simulation.recording import Recording

SIDES: tuple[Side, Side] = ("right", "left")
RANKS: tuple[Status, ...] = ("good", "doubtful", "unknown", "bad")  # the later, the worse, as of a verdict


@dataclass(frozen=True, eq=False)
class Cycle:
    """Rows of one cycle: the last settled stride, or the last whole period of what switches the valves.

    phase : of each row, 0 to below 1 (n,)
    columns : of the recording at these rows
    length : way of a stride [m]; None where nobody walks
    """

    phase: np.ndarray
    columns: Mapping[str, np.ndarray]
    length: float | None = field(default=None)

    def at(self, column: str, phase: np.ndarray, behind: float = 0.0) -> np.ndarray:
        """A column as it is when another leg is at `phase`, this one being `behind` by a share of a cycle.

        Linear between rows, and periodic: at phase 0 the cycle goes on from its own end.
        """
        return np.interp(np.mod(phase - behind, 1.0), self.phase, self.columns[column], period=1.0)


def cycle_of(recording: Recording) -> Cycle:
    """The cycle of a recording that stands for all."""
    return _stride_of(recording) if recording.scenario.get("gait") else _period_of(recording)


def _stride_of(recording: Recording) -> Cycle:
    columns, time = recording.columns, recording["time"]
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    whole = strides(columns, step, body_mass(recording.scenario))
    counted = settled(columns, whole)
    if not counted:
        problem = "no whole stride follows the first, which is the start's transient"
        raise InputError(
            problem, field="duration", value=recording.scenario["duration"], allowed="a longer one"
        )
    last = counted[-1]
    begun = np.interp([last.number - 1.0, float(last.number)], progress(columns), columns["ankle/position/x"])
    rows = {name: values[last.rows] for name, values in columns.items()}
    return Cycle(last.phase, rows, float(begun[1] - begun[0]))


def _period_of(recording: Recording) -> Cycle:
    time = recording["time"]
    period = described_cycle(load("scenario", recording.scenario))
    assert period is not None  # else there are no two legs
    end = 2.0 * time[-1] - time[-2] if len(time) > 1 else 0.0
    last = int(np.floor(end / period + 1e-9)) - 1
    if last < 0:
        problem = f"is shorter than the period of {period:g} s, over which air is told"
        raise InputError(
            problem, field="duration", value=recording.scenario["duration"], allowed="a longer one"
        )
    phase = time / period - last
    inside = (phase > -1e-9) & (phase < 1.0 - 1e-9)
    rows = {name: values[inside] for name, values in recording.columns.items()}
    return Cycle(np.abs(phase[inside]), rows)


def flow_of(cycle: Cycle, phase: np.ndarray, behind: float) -> np.ndarray:
    """Mass flow that a leg takes from the source [kg/s] (n,)."""
    if FLOW not in cycle.columns:  # it wears nothing
        return np.zeros(len(phase))
    return np.maximum(cycle.at(FLOW, phase, behind), 0.0)


def mean_over(phase: np.ndarray, values: np.ndarray) -> float:
    """Mean over a periodic cycle of values at phases from 0 to below 1: the trapezoidal rule."""
    width = np.diff(phase, append=phase[0] + 1.0)
    return float(np.sum(0.5 * width * (values + np.roll(values, -1))))


def numbers_of(
    legs: Mapping[Side, Recording],
    cycles: Mapping[Side, Cycle],
    phase: np.ndarray,
    flow: Mapping[str, np.ndarray],
) -> dict[str, Metric]:
    """Air and flow of either leg and of both, and how far both come on one bottle.

    Units: phase (n,), flow [kg/s] (n,).
    """
    walks = cycles["right"].length is not None
    air_name = "air_per_stride" if walks else "air_per_cycle"
    air = {
        side: float(leg.metrics[air_name]) if air_name in leg.metrics else 0.0 for side, leg in legs.items()
    }
    whole = {str(side): grams for side, grams in air.items()} | {"both": air["right"] + air["left"]}
    found = {f"{air_name}_{who}": Metric(grams, "g") for who, grams in whole.items()}
    litres = litres_a_minute(legs)
    means = {who: mean_over(phase, values) for who, values in flow.items()}
    for who, mean in means.items():
        found[f"mean_flow_{who}"] = Metric(litres * mean, "l/min")
    for who, values in flow.items():
        found[f"peak_flow_{who}"] = Metric(litres * float(values.max()), "l/min")
    return found | on_source(legs, whole if walks else {}, means, found, cycles["right"].length)


@dataclass(frozen=True)
class Worse:
    """One question of a verdict, answered for two legs.

    question, name : as of the verdict
    status : the worse one
    leg : "right" or "left", whichever has it; "both" where they are alike, or for the air of both
    answers : by leg; of the air also "both"
    """

    name: str
    question: str
    status: Status
    leg: Literal["right", "left", "both"]
    answers: dict[str, Answer]


def worse_of(right: Recording, left: Recording, numbers: Mapping[str, Metric]) -> tuple[Worse, ...]:
    """The verdict of two legs: of each question the worse one's, of the air that of both together."""
    found = []
    for one, other in zip(right.verdict, left.verdict, strict=True):
        answers = {"right": one, "left": other}
        if one.name == AIR:
            told = _air_of_both(right, numbers)
            found.append(Worse(one.name, one.question, told.status, "both", answers | {"both": told}))
            continue
        rank = RANKS.index(one.status) - RANKS.index(other.status)
        leg: Literal["right", "left", "both"] = "right" if rank > 0 else "left" if rank < 0 else "both"
        found.append(Worse(one.name, one.question, other.status if rank < 0 else one.status, leg, answers))
    return tuple(found)


def _air_of_both(right: Recording, numbers: Mapping[str, Metric]) -> Answer:
    """What the air of both legs costs, held against the right leg's limits."""
    summed = {
        "strides_counted": Metric(1.0, ""),
        "air_per_stride": numbers["air_per_stride_both"],
        "free_air_per_minute": numbers["mean_flow_both"],
        "stride_time": right.metrics["stride_time"],
    }
    for name in ("strides_per_bottle", "source_share", "compressor_duty", "compressor_power"):
        if f"{name}_both" in numbers:
            summed[name] = numbers[f"{name}_both"]
    for name in SAGGING:
        if f"{name}_alone" in numbers:  # together it falls at least as far
            summed[name] = numbers[f"{name}_alone"]
    answers = verdict(summed, {}, limits_of(right), feed_of(right))
    return next(answer for answer in answers if answer.name == AIR)
