"""The design's own parameters and the steps that a builder could make, as the description has them.

Each parameter is changed alone, by one step to either side. Where that alone would only tighten or loosen the
muscles, as `link_length` does, the link follows: a muscle's anchors move, and its length changes, at the
same tautness at an ankle angle of zero. The sole's stacks under heel and ball go together.
"""

import dataclasses
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Literal

from afo_sim.common import JsonDict, Mixed, in_unit
from afo_sim.description import WORN, MuscleGroup, Scenario
from afo_sim.model import mean_length
from afo_sim.study.effect import Effect

PRESSURE, LINK, MUSCLE, ANCHOR, STACK = 0.5e5, 0.005, 0.02, 0.01, 0.005  # [Pa], [m]
TIME, FILL, PHASE = 0.05, 0.5, 0.05  # [s], [s], [-]
RADIUS, CONTRACTION = 0.005, 0.02  # of a pulley [m], [-]
STIFFNESS, FLOW = 2.0, 1.5  # factors; FLOW of valves and tubes
_LIMIT = 1.0 + 1e-9  # rounding of a pressure beside a limit [-]
_WAYS = {0: "forward", 2: "up"}  # axes of an anchor's place
SIDES: tuple[Literal["inlet", "outlet"], ...] = ("inlet", "outlet")


@dataclass(frozen=True)
class _Amount:
    """A number of the description: its key, value [SI], SI unit, and the unit that people use."""

    key: str
    value: float
    si: str = ""
    unit: str = ""

    def text(self, value: float, digits: int = 6) -> str:
        """A value [SI] as `--set` takes it."""
        number = in_unit(value, self.si, self.unit) if self.unit else value
        return f"{round(number, 9) + 0.0:.{digits}g} {self.unit}".rstrip()

    def written(self, value: float) -> Mixed:
        """The same; a bare number where there is no unit."""
        return self.text(value) if self.unit else round(value, 9)


def steps(scenario: Scenario, hanging: Collection[str] = ()) -> list[Effect]:
    """Both steps of every parameter of a scenario's orthosis, its air and its valves' timing, not yet run."""
    pressure = _Amount("supply.pressure", scenario.supply.pressure, "Pa", "bar")
    lower, upper = _added("supply pressure", pressure, PRESSURE)
    for chamber in [n for n in scenario.orthosis.chamber if takes_air(scenario, n)]:
        for name, group in scenario.orthosis.muscles_of(chamber).items():
            limit = group.type.limits.pressure
            if pressure.value + PRESSURE > limit * _LIMIT:
                reason = f"the muscles of {name} are limited to {1e-5 * limit:g} bar"
                upper = upper.barred("forbidden", reason)
    found = [lower, upper]
    for name in scenario.orthosis.muscle:
        found += _group(scenario, name, name in hanging)
    for of_chamber in (_timing, _start, _air):
        for name in scenario.orthosis.chamber:
            own, reason = of_chamber(scenario, name), f"no air enters {name}"
            found += own if takes_air(scenario, name) else (step.barred("no air", reason) for step in own)
    return [*found, *_structure(scenario)]


def takes_air(scenario: Scenario, chamber: str) -> bool:
    """Whether air can enter a chamber: its inlet opens, a controller may open it, or it is filled before."""
    if scenario.controller is not None:
        return True
    times_of, start = (scenario.phases or scenario.timer), scenario.start
    times = times_of.chambers.get(chamber) if times_of else None
    return bool(times and times.inlet) or bool(start and chamber in start.chambers)


def _added(name: str, amount: _Amount, by: float, *along: tuple[_Amount, int]) -> Iterator[Effect]:
    """A step down and one up by a difference [SI]; `along` goes the same way (+1) or the other (−1)."""
    for sign in (-1, 1):
        value = amount.value + sign * by
        sets = {amount.key: amount.written(value)}
        sets |= {other.key: other.written(other.value + sign * way * by) for other, way in along}
        yield Effect(name, amount.text(amount.value), amount.text(value), sets)


def _scaled(name: str, amount: _Amount, by: float) -> Iterator[Effect]:
    for factor in (1.0 / by, by):
        text = amount.text(amount.value * factor, 4)
        yield Effect(name, amount.text(amount.value), text, {amount.key: text})


def _group(scenario: Scenario, name: str, hangs: bool) -> Iterator[Effect]:
    """Steps of a muscle group: its length, its number, its muscle, its mounting, its cable."""
    at, group = f"orthosis.muscle.{name}", scenario.orthosis.muscle[name]
    if group.link_length is not None:
        link = _Amount(f"{at}.link_length", group.link_length, "m", "cm")
        slack = _Amount(f"{at}.slack", group.slack, "m", "cm")
        loose = group.link_length < LINK <= group.slack  # both act alike: one of them is stepped
        yield from _added(f"{name} slack" if loose else f"{name} link length", slack if loose else link, LINK)
    for count in (group.count - 1, group.count + 1):
        yield Effect(f"{name} count", f"{group.count}", f"{count}", {f"{at}.count": count})
    reason = f"no air enters {name}, and its muscles stay slack throughout"
    idle = hangs and not takes_air(scenario, group.chamber or name)
    for step in (*_mounting(name, at, group), *_pulley(name, at, group)):
        yield step.barred("no air", reason) if idle else step


def _mounting(name: str, at: str, group: MuscleGroup) -> Iterator[Effect]:
    """Anchors further forward or up, with the link as much longer as the path between them at angle zero."""
    if group.origin is None or group.insertion is None:
        return
    link = _Amount(f"{at}.link_length", group.link_length or 0.0, "m", "cm")
    for end, anchor in (("origin", group.origin), ("insertion", group.insertion)):
        for place, step in _moves(f"{name} {end}", f"{at}.{end}", anchor):
            yield _matched(step, group, {end: place}, link)
    for number, guide in enumerate(group.path):
        for place, step in _moves(f"{name} guide {number}", f"{at}.path[{number}]", guide):
            path = (*group.path[:number], place, *group.path[number + 1 :])
            yield _matched(step, group, {"path": path}, link)
    muscle = _Amount(f"{at}.type.total_length", group.type.total_length, "m", "cm")
    yield from _added(f"{name} muscle length, link to match", muscle, MUSCLE, (link, -1))


def _moves(name: str, key: str, place: Mixed) -> Iterator[tuple[Mixed, Effect]]:
    """A place of the path further back, forward, down and up, and the step that moves it there."""
    for axis, way in _WAYS.items():
        amount = _Amount(f"{key}.from_joint[{axis}]", place.from_joint[axis], "m", "cm")
        both = _added(f"{name} {way}, link to match", amount, ANCHOR)
        for step, by in zip(both, (-ANCHOR, ANCHOR), strict=True):
            there = tuple(x + by if k == axis else x for k, x in enumerate(place.from_joint))
            yield place.model_copy(update={"from_joint": there}), step


def _matched(step: Effect, group: MuscleGroup, moved: JsonDict, link: _Amount) -> Effect:
    """The step with the link as much longer as the path at angle zero."""
    longer = mean_length(group.model_copy(update=moved)) - mean_length(group)
    return dataclasses.replace(step, sets=step.sets | {link.key: link.text(link.value + longer)})


def _pulley(name: str, at: str, group: MuscleGroup) -> Iterator[Effect]:
    if group.pulley is not None:
        radius = _Amount(f"{at}.pulley.radius", group.pulley.radius, "m", "cm")
        begun = _Amount(f"{at}.pulley.initial_contraction", group.pulley.initial_contraction)
        yield from _added(f"{name} pulley radius", radius, RADIUS)
        yield from _added(f"{name} initial contraction", begun, CONTRACTION)
    cable = _Amount(f"{at}.cable.stiffness", group.cable.stiffness, "N/m", "kN/m")
    yield from _scaled(f"{name} cable stiffness", cable, STIFFNESS)


def _timing(scenario: Scenario, chamber: str) -> Iterator[Effect]:
    """Begin and end of every interval in which a chamber's valves are open."""
    kind = "phases" if scenario.phases is not None else "timer"
    times_of = scenario.phases or scenario.timer
    times = times_of.chambers.get(chamber) if times_of is not None else None
    for side in SIDES if times is not None else ():
        intervals = getattr(times, side)
        for k in range(len(intervals)):
            number = f" {k + 1}" if len(intervals) > 1 else ""
            for end, word in enumerate(("opens", "closes")):
                name = f"{chamber} {side}{number} {word}"
                key = f"{kind}.{chamber}.{side}[{k}][{end}]"
                yield from _interval(name, key, intervals[k], end, kind)


def _interval(name: str, key: str, interval: tuple[float, float], end: int, kind: str) -> Iterator[Effect]:
    """Earlier and later begin or end; of gait phases the stride goes round."""
    if kind == "timer":
        yield from _added(name, _Amount(key, interval[end], "s", "s"), TIME)
        return
    begin, close = interval
    open_for = 1.0 if close - begin == 1.0 else (close - begin) % 1.0
    for sign in (-1, 1):
        amount = _Amount(key, interval[end])
        value = round((interval[end] + sign * PHASE) % 1.0, 9)
        value = 1.0 if end == 1 and value == 0.0 else value
        length = round(open_for + (sign if end == 1 else -sign) * PHASE, 9)
        reason = "the valve would never open" if length <= 0.0 else ""
        reason = "the valve would never shut" if length > 1.0 or length == 1.0 > open_for else reason
        step = Effect(name, amount.text(interval[end]), amount.text(value), {key: value})
        yield step.barred("forbidden", reason) if reason else step


def _start(scenario: Scenario, chamber: str) -> Iterator[Effect]:
    begun = scenario.start.chambers.get(chamber) if scenario.start is not None else None
    if begun is None:
        return
    at = f"start.{chamber}"
    if begun.fill_time is not None:
        yield from _added(f"{chamber} fill time", _Amount(f"{at}.fill_time", begun.fill_time, "s", "s"), FILL)
    if begun.pressure is not None:
        pressure = _Amount(f"{at}.pressure", begun.pressure, "Pa", "bar")
        yield from _added(f"{chamber} pressure at the start", pressure, PRESSURE)


def _air(scenario: Scenario, name: str) -> Iterator[Effect]:
    at, chamber = f"orthosis.chamber.{name}", scenario.orthosis.chamber[name]
    if chamber.tube_volume > 0.0:
        volume = _Amount(f"{at}.tube_volume", chamber.tube_volume, "m^3", "ml")
        yield from _scaled(f"{name} tube volume", volume, FLOW)
    for side in SIDES:
        conductance, unit = getattr(chamber, side).conductance, "dm^3/(s*bar)"
        flow = _Amount(f"{at}.{side}.conductance", conductance, "m^3/(s*Pa)", unit)
        yield from _scaled(f"{name} {side} conductance", flow, FLOW)


def _structure(scenario: Scenario) -> Iterator[Effect]:
    """How cuff and plate give, and the thickness of the plate's sole."""
    for segment, mounting in scenario.orthosis.anchor.items():
        at, name = f"orthosis.anchor.{segment}", f"{WORN[segment]} stiffness"
        assumed = any(source.kind == "assumed" for source in mounting.provenance.values())
        found: list[Effect] = []
        if mounting.stiffness is not None:
            found += _scaled(name, _Amount(f"{at}.stiffness", mounting.stiffness, "N/m", "kN/m"), STIFFNESS)
        if mounting.stiffening is not None:  # F = a (e^(x/x0) − 1): all of it goes with a
            force = _Amount(f"{at}.stiffening.force", mounting.stiffening.force, "N", "N")
            found += _scaled(f"{name}, its force", force, STIFFNESS)
        yield from (dataclasses.replace(step, assumed=assumed) for step in found)
    sole = scenario.orthosis.outsole
    if sole is not None:
        heel = _Amount("orthosis.outsole.heel_stack", sole.heel_stack, "m", "mm")
        ball = _Amount("orthosis.outsole.ball_stack", sole.ball_stack, "m", "mm")
        yield from _added("sole thickness, heel and ball", heel, STACK, (ball, 1))
