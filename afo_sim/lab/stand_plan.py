"""A test on the stand as it is planned: what is set, curve by curve, and refusals of what is impossible."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, GRAVITY, InputError
from afo_sim.description import Muscle, provenance_note
from afo_sim.description import load as load_description
from afo_sim.description.orthosis import Valve
from afo_sim.physics import FRICTIONS, crossing

Kind = Literal["isobaric", "isotonic", "isometric", "auxotonic", "sealed", "step", "release"]
KINDS: tuple[Kind, ...] = ("isobaric", "isotonic", "isometric", "auxotonic", "sealed", "step", "release")
LOSS = 0.002  # of the greatest force: what the dampers may add at a sweep's mean speed
SHORTEST_SWEEP = 8.0  # of one branch [s]
ROWS = 400  # that are kept of a branch, about
USUAL_LOAD = 0.2  # of the strength, where no load is given
LEAST_LOAD = 1.0  # [N]: an unloaded muscle has no definite length
STIFFEST = 1e6  # spring of the stand [N/m]; its frame has ten times that
PULLING = 10.0  # force at zero contraction from which a muscle counts as pulling [N]
LONGEST, SHORTEST = -0.5, 0.7  # contraction ratios between which anything is looked for
Ends = tuple[float | Sequence[float] | np.ndarray, float | Sequence[float] | np.ndarray]


@dataclass(frozen=True)
class Laboratory:
    """Surroundings of the muscle on the stand."""

    supply: float | None = None  # gauge pressure that no test goes beyond [Pa]; the muscle's limit by default
    valve: Valve | None = None  # fills and vents it in `step`, and feeds it in `release` where given
    tube_volume: float = 4e-6  # between valve and muscle [m³]
    wall_conductance: float = 0.5  # heat to the wall [W/K]
    wall_conductance_by_flow: float = 0.0  # by which that grows with what flows in [J/(kg·K)]
    line_bore: float = 4e-3  # of a line whose air has inertia, from the gauge to the muscle [m]
    line_length: float = 0.0  # 0 for none [m]
    gauge_volume: float = 0.0  # of the gauge at the valves' end of that line [m³]
    leak_conductance: float = 0.0  # free air that the muscle loses, by its gauge pressure [m³/(s·Pa)]
    mounting_stiffness: float | None = None  # of frame and hook [N/m]; by default they hardly give
    timestep: float | None = None  # [s]; by default 2 ms, `step` 1, `release` 0.1, or less by the braid


USUAL = Laboratory()


@dataclass(frozen=True)
class StandPlan:
    """One test of one muscle: per curve, how pressure and length go between two values and back.

    A branch takes `duration`; "up" goes from the first value to the second, "down" back, along half a
    cosine, so that motion starts and ends at rest. With a solenoid valve the pressure is the supply's:
    up opens the inlet, down the outlet.
    """

    kind: Kind
    muscle: Muscle
    laboratory: Laboratory
    set_points: np.ndarray  # what tells the curves apart [Pa], [N], [-], [N/m] (n,)
    pressure: np.ndarray  # gauge, from and to [Pa] (n, 2)
    contraction: np.ndarray  # from and to [-] (n, 2); of a free carriage, its start only
    load: np.ndarray  # weight on the carriage [N] (n,); NaN where the length is prescribed
    spring: np.ndarray  # between frame and muscle, pulls from rest length on [N/m] (n,)
    start_pressure: np.ndarray  # in the chamber before the test [Pa] (n,)
    timestep: float  # [s]
    duration: float  # of one branch [s]
    branches: int
    stride: int = 1  # steps between kept rows; turning points are kept
    valve: Valve | native.CircuitValve | None = field(default=None)  # at inlet and outlet; None: regulator
    outlet: native.CircuitValve | None = None  # another valve at the outlet

    @property
    def inertia(self) -> float:
        """Mass that moves with a hanging carriage beside the load's own: half the muscle's [kg]."""
        return max(0.5 * self.muscle.whole_mass, 1e-3)

    @property
    def held(self) -> bool:
        """Whether the length is prescribed; otherwise a weight hangs on the muscle."""
        return bool(np.isnan(self.load[0]))

    def carried(self, curve: int, contraction: np.ndarray) -> np.ndarray:
        """Weight and spring on the muscle of a curve [N], at contractions [-]; NaN where it is held."""
        return np.asarray(self.load[curve] + self.spring[curve] * self.muscle.nominal_length * contraction)

    def wave(self, time: np.ndarray) -> np.ndarray:
        """Share of the way from the first value to the second [-], over time [s]."""
        inside = np.clip(time, 0.0, self.duration * self.branches)
        return 0.5 - 0.5 * np.cos(np.pi * inside / self.duration)

    def supply(self, curve: int, time: np.ndarray) -> np.ndarray:
        """Gauge pressure of a curve's supply [Pa] over time [s]."""
        low, high = self.pressure[curve]
        return low + (high - low) * self.wave(time)

    def coils(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Shares of steps from times [s] with inlet's and outlet's coil on [-]; regulators are open."""
        if self.kind == "sealed":
            return np.zeros_like(time), np.zeros_like(time)
        if self.kind != "step":
            return np.ones_like(time), np.zeros_like(time)
        venting = self.branch(time + 0.5 * self.timestep) % 2.0  # a branch is of whole steps
        return 1.0 - venting, venting

    def branch(self, time: np.ndarray) -> np.ndarray:
        """Number of the branch at times [s], from 0; a turning point belongs to the branch that it ends."""
        number = np.ceil(np.round(time / self.duration, 9)).astype(int) - 1
        return np.clip(number, 0, self.branches - 1)


def plan_isobaric(
    muscle: Muscle,
    pressures: Sequence[float] | None = None,
    span: tuple[float, float | None] | None = None,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Length from `span[0]` to `span[1]` [-] and back at constant pressures [Pa]."""
    points = _pulling(muscle, pressures, laboratory)
    low, high = span or (0.0, None)
    ends = np.array([_until_slack(muscle, p) if high is None else high for p in points])
    _check_contractions(muscle, [low, *([] if high is None else [high])], float(points.max()))
    _check_rise("contraction", low, ends.min(), f"{low:g} to {ends.min():.3g}")
    if duration is None:
        duration = max(_slow(muscle, p, float(end - low)) for p, end in zip(points, ends, strict=True))
    return _plan("isobaric", muscle, laboratory, points, (points, points), (low, ends), duration)


def plan_isometric(
    muscle: Muscle,
    contractions: Sequence[float] | None = None,
    span: tuple[float, float] | None = None,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Pressure from `span[0]` to `span[1]` [Pa] and back at constant contractions [-]."""
    low, high = span or (0.0, highest(muscle, laboratory))
    _check_span(muscle, low, high, laboratory.supply)
    points = _points(contractions, np.arange(0.0, _until_slack(muscle, high) - 0.01, 0.05))
    _check_contractions(muscle, points, high)
    duration = duration or SHORTEST_SWEEP
    return _plan("isometric", muscle, laboratory, points, (low, high), (points, points), duration)


def plan_isotonic(
    muscle: Muscle,
    loads: Sequence[float] | None = None,
    span: tuple[float | None, float] | None = None,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Pressure from `span[0]` to `span[1]` [Pa] and back under constant loads [N]."""
    low, high = span or (None, highest(muscle, laboratory))
    _check_span(muscle, low or 0.0, high, laboratory.supply)
    strength = force_at(muscle, 0.0, high)
    points = _points(loads, np.array([_two_digits(s * strength) for s in (0.05, 0.1, 0.2, 0.4, 0.6)]))
    _check_loads(muscle, points, high)
    limit = muscle.limits.contraction_min
    lows = [_lifting(muscle, load, limit, high) if low is None else low for load in points]
    lows = [0.0 if p < 1.0 else p for p in lows]
    start = np.array([hanging(muscle, load, p) for load, p in zip(points, lows, strict=True)])
    for load, p, kappa in zip(points, lows, start, strict=True):
        _check_lock(muscle, load, p, kappa, high)
    if duration is None:
        way = max(hanging(muscle, load, high) - x for load, x in zip(points, start, strict=True))
        duration = 3.0 * _slow(muscle, high, way)
    return _plan("isotonic", muscle, laboratory, points, (lows, high), (start, start), duration, points)


def plan_auxotonic(
    muscle: Muscle,
    stiffnesses: Sequence[float] | None = None,
    span: tuple[float, float] | None = None,
    load: float | None = None,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Pressure from `span[0]` to `span[1]` [Pa] and back against springs [N/m], under one load [N]."""
    low, high = span or (0.0, highest(muscle, laboratory))
    _check_span(muscle, low, high, laboratory.supply)
    hung = LEAST_LOAD if load is None else load
    _check_loads(muscle, [hung], high)
    slope = force_at(muscle, 0.0, high) / (muscle.nominal_length * _until_slack(muscle, high))
    points = _points(stiffnesses, np.array([_two_digits(s * slope) for s in (0.1, 0.3, 1.0, 3.0, 10.0)]))
    if wrong := [k for k in points if not 0.0 <= k <= STIFFEST]:
        value, allowed = f"{1e-3 * wrong[0]:g} N/mm", f"0 to {1e-3 * STIFFEST:g} N/mm"
        raise InputError("is out of range", field="stiffness", value=value, allowed=allowed)
    start = np.array([hanging(muscle, hung, low, k) for k in points])
    _check_lock(muscle, hung, low, float(start.min()), high)
    if duration is None:
        way = max(hanging(muscle, hung, high, k) - x for k, x in zip(points, start, strict=True))
        duration = 3.0 * _slow(muscle, high, way)
    return _plan("auxotonic", muscle, laboratory, points, (low, high), (start, start), duration, hung, points)


def plan_sealed(
    muscle: Muscle,
    pressures: Sequence[float] | None = None,
    span: tuple[float, float | None] | None = None,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Filled to pressures [Pa] at `span[1]` [-] and shut in, then stretched to `span[0]` and back."""
    plan = plan_isobaric(muscle, pressures, span, laboratory, duration)
    ends = plan.contraction if span else plan.contraction[:, 1:] * np.array([0.4, 0.5])  # of the way to slack
    return dataclasses.replace(plan, kind="sealed", contraction=ends[:, ::-1])


def plan_step(
    muscle: Muscle,
    pressures: Sequence[float] | None = None,
    load: float | None = None,
    contraction: float | None = None,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Fill through the inlet valve from supplies at `pressures` [Pa], then vent, each for `duration` [s]."""
    valve = laboratory.valve or load_description("valve", "mh1")
    points = _pulling(muscle, pressures, laboratory)
    hung, start = np.nan, contraction
    if start is None:
        hung = _hung(muscle, points, load, 0.0)
        start = hanging(muscle, hung, 0.0)
    elif load is not None:
        raise InputError("goes without a held contraction", field="load", value=f"{load:g} N")
    else:
        _check_contractions(muscle, [start], float(points.max()))
    if start <= muscle.braid.lock:
        problem = "the empty muscle's braid would lock under it"
        allowed = f"at most {math.floor(force_at(muscle, muscle.braid.lock, 0.0))} N"
        raise InputError(problem, field="load", value=f"{hung:g} N", allowed=allowed)
    if duration is None:
        volume = laboratory.tube_volume + float(muscle.volume(contraction=0.6))
        duration = max(1.0, math.ceil(5.0 * volume / (valve.conductance * 1e5)))
    plan = _plan("step", muscle, laboratory, points, (points, points), (start, start), duration, hung)
    return dataclasses.replace(plan, start_pressure=np.zeros(len(points)), stride=1, branches=2, valve=valve)


def plan_release(
    muscle: Muscle,
    pressures: Sequence[float] | None = None,
    load: float | None = None,
    contraction: float = 0.0,
    laboratory: Laboratory = USUAL,
    duration: float | None = None,
) -> StandPlan:
    """Held at a contraction [-] under pressures [Pa], then let go against a load [N], for `duration` [s]."""
    points = _pulling(muscle, pressures, laboratory)
    _check_contractions(muscle, [contraction], float(points.min()))
    hung, held = _hung(muscle, points, load, contraction), (contraction, contraction)
    plan = _plan("release", muscle, laboratory, points, (points, points), held, duration or 2.0, hung)
    return dataclasses.replace(plan, stride=1, branches=1, valve=laboratory.valve)


def highest(muscle: Muscle, laboratory: Laboratory) -> float:
    """Highest gauge pressure of a test: the law's range, the muscle's limit, the supply [Pa]."""
    top = min(muscle.limits.pressure, muscle.law_set.pressure_range[1])
    return top if laboratory.supply is None else min(top, laboratory.supply)


def _pulling(muscle: Muscle, pressures: Sequence[float] | None, laboratory: Laboratory) -> np.ndarray:
    """Gauge pressures at which a muscle pulls: as given, else the whole bars of its law's range [Pa]."""
    low, top = muscle.law_set.pressure_range[0], highest(muscle, laboratory)
    bars = 1e5 * np.arange(max(math.ceil(low * 1e-5 - 1e-9), 1), math.floor(top * 1e-5 + 1e-9) + 1)
    usual = [p for p in bars if force_at(muscle, 0.0, p) > PULLING] if pressures is None else []
    points = _points(pressures, np.array(usual or [top]))
    _check_pressures(muscle, points, laboratory.supply, pulls=True)
    return points


def _hung(muscle: Muscle, points: np.ndarray, load: float | None, held_at: float) -> float:
    """The load of a step or release [N]."""
    weakest = float(points.min())
    usual = max(_two_digits(USUAL_LOAD * force_at(muscle, held_at, weakest)), LEAST_LOAD)
    hung = usual if load is None else load
    _check_loads(muscle, [hung], weakest, held_at)
    return hung


def _plan(
    kind: Kind,
    muscle: Muscle,
    laboratory: Laboratory,
    points: np.ndarray,
    pressure: Ends,
    contraction: Ends,
    duration: float,
    load: float | np.ndarray = np.nan,
    spring: float | np.ndarray = 0.0,
) -> StandPlan:
    """A plan of whole cycles; a friction that remembers is run in for one more."""
    remembers = muscle.friction != "none" and FRICTIONS[muscle.friction].n_state > 0
    rows = np.array(np.broadcast_arrays(*pressure, *contraction, load, spring, points)[:6], float)
    ways = (rows[:2].T, rows[2:4].T, rows[4], rows[5], rows[0])
    plan = StandPlan(kind, muscle, laboratory, points, *ways, 1.0, duration, 4 if remembers else 2)
    step = laboratory.timestep or _usual_step(plan)
    if not 10.0 * step <= duration <= 1e4:
        allowed = f"{10.0 * step:g} s to 10000 s"
        raise InputError("is out of range", field="time", value=f"{duration:g} s", allowed=allowed)
    steps = math.ceil(duration / step - 1e-9)
    stride = max(1, steps // ROWS)
    whole = math.ceil(steps / stride) * stride * step
    return dataclasses.replace(plan, timestep=step, duration=whole, stride=stride)


def _usual_step(plan: StandPlan) -> float:
    """2 ms, 1 ms for the air of a step, 0.1 ms for a release; less where braid and inertia would ring."""
    step = {"step": 1e-3, "release": 1e-4}.get(plan.kind, 2e-3)
    if plan.held:
        return step
    mass = plan.inertia + float(plan.load.min()) / GRAVITY
    stiffness = plan.muscle.braid_stiffness / plan.muscle.nominal_length + float(plan.spring.max())
    rate = math.sqrt(stiffness / mass)
    while step * rate > 0.7:
        step /= 2.0
    return step


def _points(given: Sequence[float] | None, usual: np.ndarray) -> np.ndarray:
    return np.array(usual if given is None else list(given), float)


def _until_slack(muscle: Muscle, pressure: float) -> float:
    """End of a sweep of the length [-]: slack, or the limit of muscle or law if that comes first."""
    known = min(muscle.limits.contraction_max, muscle.contraction_range[1])
    return min(slack(muscle, pressure), known)


def _slow(muscle: Muscle, pressure: float, way: float) -> float:
    """Time in which dampers add at most `LOSS` of the strength over a contraction of `way` [s]."""
    mean = _damping(muscle, pressure) * way / (LOSS * force_at(muscle, 0.0, pressure))
    return float(math.ceil(max(mean, SHORTEST_SWEEP)))


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def _check_contractions(muscle: Muscle, contractions: Sequence[float] | np.ndarray, pressure: float) -> None:
    """Refuse contraction ratios [-] beyond the lock, or where a muscle at a gauge pressure [Pa] is slack."""
    low, high = muscle.braid.lock, slack(muscle, pressure)
    for value in contractions:
        if not low < value <= high + 1e-9:
            problem = "the braid locks before that" if value <= low else "the muscle is slack"
            ends = [f"{100.0 * muscle.nominal_length * (1.0 - x):.2f}" for x in (high, low)]
            allowed = f"above {low:.3f} (lock) and at most {math.floor(1e4 * high) * 1e-4:.4f} (slack): "
            allowed += f"lengths of {ends[0]} to {ends[1]} cm"
            problem += f" at {pressure * 1e-5:g} bar"
            raise InputError(problem, field="contraction", value=f"{value:.4g}", allowed=allowed)


def _check_loads(
    muscle: Muscle, loads: Sequence[float] | np.ndarray, pressure: float, contraction: float = 0.0
) -> None:
    """Refuse loads beyond the muscle's strength at a contraction [-] and a pressure [Pa]."""
    strength = force_at(muscle, contraction, pressure)
    for load in loads:
        if not LEAST_LOAD <= load < strength:
            weak = "the muscle cannot lift it" if load >= strength else "is less than the stand can hang on"
            problem, value = f"{weak} at {pressure * 1e-5:g} bar", f"{load:g} N"
            allowed = f"{LEAST_LOAD:g} N to {math.floor(strength * 0.999):g} N"
            raise InputError(problem, field="load", value=value, allowed=allowed)


def _check_lock(muscle: Muscle, load: float, pressure: float, contraction: float, highest: float) -> None:
    """Refuse a gauge pressure [Pa] at which a load [N] stretches the braid to its lock."""
    if contraction <= muscle.braid.lock:
        problem, value = f"the braid would lock under {load:g} N", f"{pressure * 1e-5:g} bar"
        allowed = f"from {_lifting(muscle, load, muscle.limits.contraction_min, highest) * 1e-5:.3g} bar"
        raise InputError(problem, field="pressure", value=value, allowed=allowed)


def _check_pressures(muscle: Muscle, pressures: np.ndarray, supply: float | None, *, pulls: bool) -> None:
    """Refuse gauge pressures [Pa] above supply or limit, or (`pulls`) at which the muscle does not pull."""
    top, told = muscle.limits.pressure, provenance_note(muscle.limits, "pressure")

    def refused(problem: str, value: float, low: float = 0.0, field: str = "pressure") -> InputError:
        allowed = f"{math.ceil(low * 1e-3) * 1e-2:g} bar to {top * 1e-5:.4g} bar"
        return InputError(problem, field=field, value=f"{value * 1e-5:g} bar", allowed=allowed)

    whose = f"the muscle's limit{told}"
    if supply is not None:
        if supply > top:
            raise refused(f"is more than the muscle bears{told}", supply, field="supply")
        top, whose = supply, "the supply's pressure"
    for pressure in pressures:
        if not 0.0 <= pressure <= top * (1.0 + 1e-9):
            raise refused(f"is beyond {whose}", pressure)
        if pulls and force_at(muscle, 0.0, pressure) < PULLING:
            enough = _lifting(muscle, PULLING, 0.0, top)
            raise refused("is too little for this muscle to pull", pressure, enough)


def _check_span(muscle: Muscle, low: float, high: float, supply: float | None) -> None:
    """Refuse a span of gauge pressures [Pa] that does not rise, or that supply or muscle do not bear."""
    _check_pressures(muscle, np.array([low]), supply, pulls=False)
    _check_pressures(muscle, np.array([high]), supply, pulls=True)
    _check_rise("pressure", low, high, f"{low * 1e-5:g} bar to {high * 1e-5:g} bar")


def _check_rise(name: str, low: float, high: float, shown: str) -> None:
    if not low < high:
        raise InputError("does not rise", field=name, value=shown, allowed="FROM < TO")


def force_at(muscle: Muscle, contraction: float, pressure: float) -> float:
    """Tension at rest and without friction, at one contraction [-] and gauge pressure [Pa]."""
    return float(muscle.force(pressure, contraction=contraction))


def slack(muscle: Muscle, pressure: float) -> float:
    """Contraction ratio from which a muscle at a gauge pressure [Pa] carries nothing [-]."""
    return _crossing(lambda x: force_at(muscle, x, pressure) - 1e-9, 0.0, SHORTEST)


def hanging(muscle: Muscle, load: float, pressure: float, spring: float = 0.0) -> float:
    """Contraction ratio at which a load [N] and a spring [N/m] rest on a muscle at a gauge pressure [Pa]."""
    rise = spring * muscle.nominal_length
    return _crossing(lambda x: force_at(muscle, x, pressure) - load - rise * x, LONGEST, SHORTEST)


def _lifting(muscle: Muscle, load: float, contraction: float, highest: float) -> float:
    """Lowest gauge pressure, up to `highest` [Pa], that carries a load [N] at a contraction [-]."""
    return _crossing(lambda p: load - force_at(muscle, contraction, p), 0.0, highest)


def _damping(muscle: Muscle, pressure: float) -> float:
    """Largest dF/dκ̇ of a muscle's dampers at a gauge pressure [N·s]."""
    total = muscle.damping * (pressure + AMBIENT_PRESSURE)
    if muscle.damper is not None:
        above = muscle.damper.relaxing_above or muscle.damper.relaxing
        lines = (muscle.damper.contracting, muscle.damper.relaxing, above)
        total += muscle.nominal_length * max(b0 + b1 * pressure for b0, b1 in lines)
    return total


def _crossing(falling: Callable[[float], float], low: float, high: float) -> float:
    """Zero of a function that falls from low to high; one ulp of the interval is left after 52 halvings."""
    return crossing(falling, (), low, high, 52)
