"""One cycle of either leg, the air that both draw from one source, and the worse leg's verdict."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from afo_sim.common import InputError
from afo_sim.description import Side, Source, Supply, body_mass
from afo_sim.metrics import (
    AIR,
    FLOW,
    QUESTIONS,
    SOLVED,
    Answer,
    Metric,
    Status,
    air_given,
    capped,
    compressor_metrics,
    progress,
    settled,
    whole_cycles,
)
from afo_sim.metrics.strides import strides
from afo_sim.metrics.verdict import verdict
from afo_sim.model import SOURCE
from afo_sim.physics import gas
from afo_sim.simulation.examine import described_cycle
from afo_sim.simulation.recording import Recording, feed_of, limits_of

SAGGING = {"lowest_supply_pressure": min, "supply_sag": max, "source_empty_after": min}  # the worse leg's

Legs = Mapping[Side, Recording]


def supply_of(legs: Legs) -> Supply:
    """The supply that both legs are fed from."""
    return legs["right"].scenario.supply


def litres_a_minute(legs: Legs) -> float:
    """Free gas (ANR) per mass flow [(l/min)/(kg/s)]."""
    source = supply_of(legs).source
    return 60.0 * 1e3 / (gas.AIR if source is None else source.real_gas).free_density


def on_source(
    legs: Legs,
    air: Mapping[str, float],
    means: Mapping[str, float],
    flows: Mapping[str, Metric],
    length: float | None,
) -> dict[str, Metric]:
    """What either leg and both ask of the source."""
    supply = supply_of(legs)
    found: dict[str, Metric] = {}
    if supply.source is not None or supply.regulator is not None:
        for name, worse in SAGGING.items():  # together it falls at least as far
            worst = [leg.metrics[name] for leg in legs.values() if name in leg.metrics]
            found |= {f"{name}_alone": worse(worst)} if worst else {}
    if (source := supply.source) is not None and source.kind == "compressor":
        delivery = source.delivery(supply.pressure) * 60e3 / gas.AIR.free_density
        for who, mean in means.items():
            flow, peak = flows[f"mean_flow_{who}"].value, flows[f"peak_flow_{who}"].value
            asked = compressor_metrics(flow, peak, delivery, source.duty(mean), source.electric_power)
            found |= {f"{name}_{who}": metric for name, metric in asked.items()}
        return found
    if length is not None:  # of whole strides; the means are of some phases of one
        stride_time = legs["right"].metrics["stride_time"].value
        means = {who: 1e-3 * grams / stride_time for who, grams in air.items()}
    seconds = {} if source is None else _lasting(legs, source, supply.pressure, means)
    if seconds.get("both", math.inf) <= legs["right"]["time"][-1]:
        found["source_empty_after_both"] = Metric(seconds["both"], "s")
    if length is not None:
        return found | _strides(legs["right"], supply, air, length, seconds)
    return found | {f"hours_per_bottle_{who}": Metric(each / 3600.0, "h") for who, each in seconds.items()}


def _lasting(legs: Legs, source: Source, pressure: float, means: Mapping[str, float]) -> dict[str, float]:
    """How long the source lasts for either leg and for both, cooling [s]; no entry of who takes nothing."""
    flow, filled, starved = dict(means), dict.fromkeys(means, 0.0), False
    for side, leg in legs.items():
        mass = leg.columns.get(f"store/{SOURCE}/mass")
        if mass is None:
            continue
        filled[side] = source.full_mass - float(mass[0])
        if "source_empty_after" in leg.metrics and not np.any(leg.columns.get(SOLVED, 0.0)):
            after, starved = float(leg.metrics["source_empty_after"]), True
            left = float(np.interp(after, leg["time"], mass))
            flow[side] = (float(mass[0]) - left) / after if after > 0.0 else 0.0
    if starved:
        flow["both"] = sum(flow[side] for side in legs)
    filled["both"] = sum(filled[side] for side in legs)
    return {
        who: source.given_at(pressure, mean, source.full_mass - filled[who]) / mean
        for who, mean in flow.items()
        if mean > 0.0
    }


def _strides(
    recording: Recording,
    supply: Supply,
    air: Mapping[str, float],
    length: float,
    seconds: Mapping[str, float],
) -> dict[str, Metric]:
    """Strides, way and hours that the source, or a bottle of the limits, lasts."""
    stride_time = recording.metrics["stride_time"].value
    hours = stride_time / 3600.0
    if supply.source is not None:
        lasts = {who: each / stride_time for who, each in seconds.items()}
    else:
        limits = limits_of(recording)
        given = 1e3 * air_given(limits.bottle_volume, limits.bottle_pressure, supply.pressure)
        lasts = {who: given / grams for who, grams in air.items() if grams > 0.0}
    found = {f"strides_per_bottle_{who}": Metric(strides, "") for who, strides in lasts.items()}
    found |= {f"way_per_bottle_{who}": Metric(strides * length, "m") for who, strides in lasts.items()}
    found |= {f"hours_per_bottle_{who}": Metric(strides * hours, "h") for who, strides in lasts.items()}
    return found | {"stride_length": Metric(length, "m")}


SIDES: tuple[Side, Side] = ("right", "left")
RANKS: tuple[Status, ...] = ("good", "doubtful", "unknown", "bad")  # the later, the worse, as of a verdict


@dataclass(frozen=True, eq=False)
class Cycle:
    """Rows of one cycle: the last settled stride, or the last whole period of what switches the valves."""

    phase: np.ndarray
    columns: Mapping[str, np.ndarray]
    length: float | None = None

    def at(self, column: str, phase: np.ndarray, behind: float = 0.0) -> np.ndarray:
        """A column as it is when another leg is at `phase`, this one being `behind` by a share of a cycle."""
        return np.interp(np.mod(phase - behind, 1.0), self.phase, self.columns[column], period=1.0)


def cycle_of(recording: Recording) -> Cycle:
    """The representative cycle of a recording."""
    if not recording.described.get("gait"):
        return _period_of(recording)
    columns, time = recording.columns, recording["time"]
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    counted = settled(columns, strides(columns, step, body_mass(recording.described)))
    if not counted:
        raise _too_short(
            recording, "no complete stride follows the first one, which is the starting transient"
        )
    last = counted[-1]
    begun = np.interp([last.number - 1.0, float(last.number)], progress(columns), columns["ankle/position/x"])
    rows = {name: values[last.rows] for name, values in columns.items()}
    return Cycle(last.phase, rows, float(begun[1] - begun[0]))


def _period_of(recording: Recording) -> Cycle:
    time = recording["time"]
    period = described_cycle(recording.scenario)
    assert period is not None  # else there are no two legs
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    number, part = whole_cycles(len(time), step, period)
    if part.end * step < period * (1.0 - 1e-8):
        raise _too_short(recording, f"is shorter than the period of {period:g} s, over which air is counted")
    phase = time / period - (number - 1)
    inside = (phase > -1e-9) & (phase < 1.0 - 1e-9)
    rows = {name: values[inside] for name, values in recording.columns.items()}
    return Cycle(np.abs(phase[inside]), rows)


def _too_short(recording: Recording, problem: str) -> InputError:
    return InputError(
        problem, field="duration", value=recording.described["duration"], allowed="a longer one"
    )


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
    """Air and flow of either leg and of both, and how far both come on one bottle."""
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
    """One question of a verdict, answered for two legs."""

    name: str  # of the question
    question: str  # in words
    status: Status  # the worse: "good", "doubtful", "bad" or "unknown"
    leg: Literal["right", "left", "both"]  # whose answer is the worse
    answers: dict[str, Answer]  # by side

    @property
    def word(self) -> str:
        """The status for people, as of the worse answer."""
        return max((a.word for a in self.answers.values() if a.status == self.status), key=len)


def worse_of(right: Recording, left: Recording, numbers: Mapping[str, Metric]) -> tuple[Worse, ...]:
    """The verdict of two legs: of each question the worse one's, of the air that of both together."""
    found = []
    pair = zip(SIDES, (right.verdict, left.verdict), strict=True)
    by_name = {side: {answer.name: answer for answer in answers} for side, answers in pair}
    for name in QUESTIONS:
        answers: dict[str, Answer] = {side: each[name] for side, each in by_name.items() if name in each}
        if len(answers) < 2:
            alone = [(side, each[name]) for side, each in by_name.items() if name in each]
            found += [Worse(name, one.question, one.status, side, answers) for side, one in alone]
            continue
        one, other = answers["right"], answers["left"]
        if one.name == AIR:
            answer = _air_of_both(right, left, numbers)
            found.append(Worse(one.name, one.question, answer.status, "both", answers | {"both": answer}))
            continue
        rank = RANKS.index(one.status) - RANKS.index(other.status)
        leg: Literal["right", "left", "both"] = "right" if rank > 0 else "left" if rank < 0 else "both"
        found.append(Worse(one.name, one.question, other.status if rank < 0 else one.status, leg, answers))
    return tuple(found)


def _air_of_both(right: Recording, left: Recording, numbers: Mapping[str, Metric]) -> Answer:
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
        for who in ("alone", "both"):  # together it falls at least as far
            if f"{name}_{who}" in numbers:
                summed[name] = numbers[f"{name}_{who}"]
    answers = capped(verdict(summed, {}, limits_of(right), feed_of(right)), (*right.warnings, *left.warnings))
    return next(answer for answer in answers if answer.name == AIR)
