"""Which step helps most: the rule by which effects are ranked, from what the walk as it is lacks."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from afo_sim.common.units import in_unit
from afo_sim.description.walking import Limits
from afo_sim.metrics.verdict import Status
from afo_sim.study.effect import AIR, CLEARANCE, HEIGHTS, NOTICED, PITCH, TORQUE_PER_MASS, WORK, Effect

Aim = Literal["lift", "heel", "push_off", "air", "spare"]
ORDER: tuple[Aim, ...] = ("lift", "heel", "push_off", "air")  # among answers that are alike bad
GRAIN = 0.01  # of a limit, to which hindrances count as equal [-]


@dataclass(frozen=True)
class Wanted:
    """What is wanted of a walk, in the metrics' units: clearance and pitch at least, the others at most."""

    clearance: float
    pitch: float
    torque: float
    work: float

    def hindrance(self, values: Mapping[str, float]) -> float:
        """Torque and work against push-off by what is wanted, the larger of the two [-]."""
        return max(values.get(TORQUE_PER_MASS, 0.0) / self.torque, values.get(WORK, 0.0) / self.work)


def lowest(values: Mapping[str, float]) -> float:
    """The lowest toe clearance that is told [mm]: settled, of the first stride, of all; NaN where one is."""
    heights = [values[name] for name in HEIGHTS if name in values]
    return math.nan if not heights or any(map(math.isnan, heights)) else min(heights)


def wanted_of(limits: Limits) -> Wanted:
    """The first of each pair of limits, in the metrics' units."""
    tiny = 1e-12  # a limit may be zero
    return Wanted(
        clearance=in_unit(limits.toe_clearance[0], "m", "mm"),
        pitch=in_unit(limits.contact_pitch[0], "rad", "deg"),
        torque=max(limits.torque_against_push_off[0], tiny),
        work=max(limits.work_against_push_off[0], tiny),
    )


def aim_of(statuses: Mapping[str, Status]) -> Aim:
    """What is to be bettered first.

    What is bad goes before what is doubtful; among alike ones a toe that trips before a foot that does not
    land on its heel, that before a hindered push-off, and that before air.
    """
    for status in ("bad", "doubtful"):
        for aim in ORDER:
            if statuses.get(aim) == status:
                return aim
    return "spare"


def rank(effects: Sequence[Effect], base: Mapping[str, float], wanted: Wanted, aim: Aim) -> list[Effect]:
    """Effects with what helps most first, those that help marked.

    - "lift", "heel": by the gain in the lowest toe clearance, or in the foot's pitch at contact. What that
      costs in push-off and air is told, and does not count.
    - "push_off": by the relief, of torque or work, whichever is further beyond what is wanted.
    - "air": by the air saved.
    - "spare" (all is good): by the relief of push-off, to a hundredth of what is wanted; among alike ones by
      the air saved.

    A step does not help that costs the walk what is asked before: clearance, then heel contact, then
    push-off (worse than what is wanted, and worse than now). Nor does a step of any kind that leaves a limit
    of the muscles, or that makes cuff or strap hurt, where the walk as it is does not. What helps stands
    first, then what was run and is noticed, then what makes no noticed difference, then what was not run.

    Units: base [metric's unit].
    """
    marked = [_marked(effect, _gain(effect, base, wanted, aim), base, wanted, aim) for effect in effects]
    marked.sort(key=lambda pair: (_class(pair[0]), tuple(-part for part in pair[1])))  # stable
    return [effect for effect, _ in marked]


def _marked(
    effect: Effect, gain: tuple[float, ...], base: Mapping[str, float], wanted: Wanted, aim: Aim
) -> tuple[Effect, tuple[float, ...]]:
    """The effect, marked where it helps, with the reason where it would but breaks something; its gain."""
    if effect.status != "run" or not _gains(gain, aim):
        return effect, gain
    lost = _lost(effect, base, wanted, aim)
    helps = not (lost or effect.beyond)
    return dataclasses.replace(effect, helps=helps, reason=lost), gain


def _gain(effect: Effect, base: Mapping[str, float], wanted: Wanted, aim: Aim) -> tuple[float, ...]:
    """What a step gives of what is aimed at, the first of all first."""
    if aim == "lift":
        gain = lowest(_after(effect, base)) - lowest(base)
        return (-math.inf if math.isnan(gain) else gain,)
    if aim == "heel":
        return (effect.by(PITCH),)
    if aim == "air":
        return (-effect.by(AIR),)
    relief = wanted.hindrance(base) - wanted.hindrance(_after(effect, base))
    relief = -math.inf if math.isnan(relief) else relief
    if aim == "push_off" or math.isinf(relief):
        return relief, -effect.by(AIR)
    return round(relief / GRAIN) * GRAIN, -effect.by(AIR)


def _gains(gain: tuple[float, ...], aim: Aim) -> bool:
    """Whether a step gives something that is noticed."""
    least = {"lift": NOTICED[CLEARANCE], "heel": NOTICED[PITCH], "air": NOTICED[AIR]}.get(aim, 0.99 * GRAIN)
    if aim == "spare" and gain[0] == 0.0:
        return gain[1] >= NOTICED[AIR]
    return gain[0] >= least


def _lost(effect: Effect, base: Mapping[str, float], wanted: Wanted, aim: Aim) -> str:
    """What a step takes of what goes before the aim: worse than what is wanted, and worse than now."""
    after, before = _after(effect, base), len(ORDER) if aim == "spare" else ORDER.index(aim)
    kept = (
        ("the toe clears {:.1f} mm, {:g} mm are wanted", 1.0, lowest(base), lowest(after), wanted.clearance),
        (
            "the foot lands at {:.1f}°, {:g}° are wanted",
            1.0,
            base.get(PITCH, math.inf),
            after.get(PITCH, math.inf),
            wanted.pitch,
        ),
        (
            "push-off is hindered {:.2f} times as much as is wanted",
            -1.0,
            wanted.hindrance(base),
            wanted.hindrance(after),
            1.0,
        ),
    )
    for told, sign, was, now, limit in kept[:before]:
        if math.isnan(now) or (sign * now < sign * limit and sign * now < sign * was):
            return told.format(now, limit)
    return ""


def _after(effect: Effect, base: Mapping[str, float]) -> dict[str, float]:
    """Metrics with the step; NaN where the step leaves one undefined."""
    return {name: value + effect.differences.get(name, 0.0) for name, value in base.items()}


def _class(effect: Effect) -> int:
    if effect.status != "run":
        return 3
    return 0 if effect.helps else 1 if effect.noticed else 2
