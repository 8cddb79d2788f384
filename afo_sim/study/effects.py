"""What to change first: the effect of each of a design's own parameters on a walk, from runs, ranked."""

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Self

from afo_sim.common import InputError, JsonDict, JsonMapping, Notice, Shown, SimulationError, in_unit, titles
from afo_sim.description import Limits, Scenario, load
from afo_sim.metrics import AGAINST, Metric, Status
from afo_sim.model import as_run, with_person
from afo_sim.simulation import Asked, Recording, as_taken, limits_of, run_at_step
from afo_sim.study.effect import AIR, CLEARANCE, HEIGHTS, METRICS, NOTICED, PITCH, Effect, defined, number
from afo_sim.study.effects_parameters import steps
from afo_sim.study.engine import INFEASIBLE, OK, Outcome
from afo_sim.study.pool import Report, pool

if TYPE_CHECKING:
    import pandas


# {metric: whose limit it is a share of}; beyond 100 % the limit is left
SHARES = {
    "muscle_share_of_pressure": "the muscles' limit of pressure",
    "muscle_share_of_force": "the muscles' limit of force",
    "muscle_share_of_contraction": "the muscles' limit of contraction",
    "muscle_share_of_stretch": "the muscles' limit of stretch",
    "cuff_share_of_pain": "the pressure at which the cuff becomes painful",
    "plate_share_of_pain": "the pressure at which the strap becomes painful",
}

BEYOND_LIMIT = "beyond-limit"
Aim = Literal["lift", "heel", "push_off", "air", "spare"]
ORDER: tuple[Aim, ...] = ("lift", "heel", "push_off", "air")  # among answers that are alike bad
_GRAIN = 0.01  # of a limit, to which hindrances count as equal [-]
_DOING = "trying changes"
_PULLS = 1.0  # [N]
_WORSE = 1.0  # by which a share of a limit that is left already must grow to be reported [percent]


def beyond_limit(share: str, percent: float) -> Notice:
    """That a share of a limit, a metric of SHARES, is beyond it."""
    text = "{percent:.0f} % of {limit}"
    return Notice(BEYOND_LIMIT, text, subject=share, percent=percent, limit=SHARES[share])


def _hindrance(values: Mapping[str, float], limits: Limits) -> float:
    """Torque and work against push-off by what is wanted, the larger of the two [-]."""
    firsts = {name: max(getattr(limits, key)[0], 1e-12) for name, key in AGAINST.items()}  # one may be zero
    return max(values.get(name, 0.0) / first for name, first in firsts.items())


def _lowest(values: Mapping[str, float]) -> float:
    """The lowest known toe clearance [mm]: settled, of the first stride, of all; NaN where one is."""
    heights = [values[name] for name in HEIGHTS if name in values]
    return math.nan if not heights or any(map(math.isnan, heights)) else min(heights)


def aim_of(statuses: Mapping[str, Status]) -> Aim:
    """What is to be bettered first."""
    worst = (aim for status in ("bad", "doubtful") for aim in ORDER if statuses.get(aim) == status)
    return next(worst, "spare")


def rank(effects: Sequence[Effect], base: Mapping[str, float], limits: Limits, aim: Aim) -> list[Effect]:
    """Effects with what helps most first, those that help marked; wanted is the first of each two limits."""
    marked = []
    least = {"lift": NOTICED[CLEARANCE], "heel": NOTICED[PITCH], "air": NOTICED[AIR]}.get(aim, 0.99 * _GRAIN)
    for each in effects:
        effect, gain = each, _gain(each, base, limits, aim)
        saves_air = aim == "spare" and gain[0] == 0.0  # alone
        if effect.status == "run" and (gain[1] >= NOTICED[AIR] if saves_air else gain[0] >= least):
            lost = _lost(effect, base, limits, aim)  # what it breaks, where it would help
            effect = dataclasses.replace(effect, helps=not (lost or effect.beyond), reason=lost)
        place = 3 if effect.status != "run" else 0 if effect.helps else 1 if effect.noticed else 2
        marked.append(((place, *(-part for part in gain)), effect))
    return [effect for _, effect in sorted(marked, key=lambda pair: pair[0])]  # stable


def _gain(effect: Effect, base: Mapping[str, float], limits: Limits, aim: Aim) -> tuple[float, ...]:
    """What a step gives of what is aimed at, the first of all first."""
    if aim == "lift":
        gain = _lowest(effect.after_it(base)) - _lowest(base)
        return (-math.inf if math.isnan(gain) else gain,)
    if aim == "heel":
        return (effect.by(PITCH),)
    if aim == "air":
        return (-effect.by(AIR),)
    relief = _hindrance(base, limits) - _hindrance(effect.after_it(base), limits)
    relief = -math.inf if math.isnan(relief) else relief
    if aim == "push_off" or math.isinf(relief):
        return relief, -effect.by(AIR)
    return round(relief / _GRAIN) * _GRAIN, -effect.by(AIR)


def _lost(effect: Effect, base: Mapping[str, float], limits: Limits, aim: Aim) -> str:
    """What a step takes of what goes before the aim: worse than what is wanted, and worse than now."""
    after, before = effect.after_it(base), len(ORDER) if aim == "spare" else ORDER.index(aim)
    clearance = "toe clearance {:.1f} mm is below the target of {:g} mm"
    landing = "foot pitch at contact {:.1f}° is below the target of {:g}°"
    push_off = "push-off is resisted {:.2f} times as much as the target allows"
    height = in_unit(limits.toe_clearance[0], "m", "mm")
    pitch = in_unit(limits.contact_pitch[0], "rad", "deg")
    kept = (
        (clearance, 1.0, _lowest(base), _lowest(after), height),
        (landing, 1.0, base.get(PITCH, math.inf), after.get(PITCH, math.inf), pitch),
        (push_off, -1.0, _hindrance(base, limits), _hindrance(after, limits), 1.0),
    )
    for text, sign, was, now, limit in kept[:before]:
        if math.isnan(now) or (sign * now < sign * limit and sign * now < sign * was):
            return text.format(now, limit)
    return ""


@dataclass(frozen=True, repr=False)
class Effects(Shown):
    """The effects of one step of each parameter, what helps most first.

    aim : what the ranking is for: "lift", "heel", "push_off", "air", or "spare" where all is good
    base : metrics of the walk as it is, by name, with their units
    ranked : Effect of every step, also of those that could not be run
    timestep : of all runs [s]

    Each step was run alone; nothing is known of two steps together, nor of a step twice as large.
    """

    aim: Aim
    base: dict[str, Metric]
    ranked: tuple[Effect, ...]
    timestep: float

    @property
    def helping(self) -> tuple[Effect, ...]:
        """The steps that help, the better one of each parameter, the best first."""
        best: dict[str, Effect] = {}
        for effect in self.ranked:
            if effect.helps:
                best.setdefault(effect.name, effect)
        return tuple(best.values())

    @property
    def idle(self) -> tuple[str, ...]:
        """Names of the parameters of which no step makes a noticed difference."""
        done = [effect for effect in self.ranked if effect.status in ("run", "no air")]
        noticed = {effect.name for effect in done if effect.noticed}
        return tuple(dict.fromkeys(effect.name for effect in done if effect.name not in noticed))

    def to_json(self) -> JsonDict:
        """As plain data; what is not defined is None."""
        return {
            "aim": self.aim,
            "timestep": self.timestep,
            "base": {name: [defined(metric.value), metric.unit] for name, metric in self.base.items()},
            "ranked": [effect.to_json() for effect in self.ranked],
        }

    @classmethod
    def from_json(cls, table: JsonMapping) -> Self:
        """Of what `to_json` gave."""
        base = {name: Metric(number(value), unit) for name, (value, unit) in table["base"].items()}
        return cls(table["aim"], base, tuple(map(Effect.from_json, table["ranked"])), table["timestep"])

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each step, ranked; columns of differences such as "toe_clearance [mm]" (needs pandas).

        `attrs["units"]` holds the units by metric.
        """
        import pandas

        plain = ("name", "before", "after", "status", "reason", "helps")
        rows = [{key: getattr(e, key) for key in plain} | e.differences for e in self.ranked]
        units = {name: metric.unit for name, metric in self.base.items()}
        found = pandas.DataFrame(rows, columns=[*plain, *units]).rename(columns=titles(units))
        found.attrs["units"] = units
        return found

    def __repr__(self) -> str:
        run = sum(effect.status == "run" for effect in self.ranked)
        best = [f"{effect.name} {effect.before} → {effect.after}" for effect in self.helping[:3]]
        steps = "; ".join(best) or "no single step helps"
        return f"<Effects for {self.aim!r}, {run} steps run: {steps}>"


def effects(
    scenario: str | os.PathLike[str] | Scenario | JsonMapping,
    sets: Mapping[str, object] | None = None,
    *,
    recording: Recording | None = None,
    progress: Report | None = None,
    threads: int = 0,
) -> Effects:
    """Change each parameter of an orthosis alone, one step up and one down, and simulate the walk.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict of the same shape, or a Scenario; walking with muscles
    sets : dotted keys and values laid over it
    recording : of the unchanged walk, if it has been simulated already
    progress : called with (done, in all, what)
    threads : as many as processors if 0

    Returns
    -------
    Effects. Each difference is between two runs at the walk's time step.

    Raises
    ------
    InputError
        The description is wrong, does not walk, or has no muscles; the recording is of another scenario.
    SimulationError
        The unchanged walk fails.

    Examples
    --------
    >>> found = effects("walk-dropfoot-afo", {"timestep": "4 ms"})
    >>> found.aim in ("lift", "heel", "push_off", "air", "spare"), found.base["toe_clearance"].unit
    (True, 'mm')
    >>> shorter = [e for e in found.ranked if e.name == "dorsiflexor link length" and e.after == "10.7 cm"]
    >>> shorter[0].differences["toe_clearance"] > 0.0  # [mm]
    True
    """
    description = load("scenario", scenario, sets)
    if not description.walking or not description.orthosis.muscle:
        missing = "does not walk" if not description.walking else "has no muscles: there is nothing to change"
        allowed = "walking with an orthosis"
        raise InputError(missing, field="scenario", value=description.name, allowed=allowed)
    walk = recording or run_at_step(description)
    if walk.described != with_person(description).resolved():
        raise InputError("is of another scenario", field="recording", value=walk.described["name"])
    if not walk.ok:
        raise SimulationError(f"the walk as it is {walk.status}")
    hanging = [  # groups whose muscles never pull
        name
        for name, group in description.orthosis.muscle.items()
        if all(walk[f"muscle/{name}_{k}/force"].max() < _PULLS for k in range(1, group.count + 1))
    ]
    offered = steps(description, hanging)
    cases = [step.sets for step in offered if step.status == "run"]
    asked = Asked(frozenset({*METRICS, *SHARES}), doubts=False)
    with pool(threads) as who:
        outcome = iter(who.in_order(as_taken(description, walk), cases, asked, _DOING, progress))
    base = {name: walk.metrics[name] for name in METRICS if name in walk.metrics}
    tried = [_tried(step, next(outcome), base, walk) if step.status == "run" else step for step in offered]
    by_numbers = dataclasses.replace(walk, warnings=()).verdict  # no step betters what a warning doubts
    aim = aim_of({answer.name: answer.status for answer in by_numbers})
    ranked = rank(tried, {name: metric.value for name, metric in base.items()}, limits_of(walk), aim)
    return Effects(aim, base, tuple(ranked), as_run(as_taken(description, walk)).timestep)


def _tried(step: Effect, outcome: Outcome, base: Mapping[str, Metric], walk: Recording) -> Effect:
    """What a step has done."""
    if outcome.status != OK:
        return step.barred("refused" if outcome.status == INFEASIBLE else "failed", outcome.reason)
    undefined = Metric(math.nan)
    differences = {name: outcome.metrics.get(name, undefined).value - was.value for name, was in base.items()}
    beyond = tuple(
        beyond_limit(name, outcome.metrics[name].value)
        for name in SHARES
        if name in outcome.metrics and outcome.metrics[name] > max(100.0, walk.metrics[name].value + _WORSE)
    )
    notes = tuple(warning for warning in outcome.warnings if warning not in walk.warnings)
    return dataclasses.replace(step, differences=differences, beyond=beyond, notes=notes)
