"""Plan of a test on the stand: settings curve by curve, and refusals of what is impossible."""

import dataclasses
import math
from collections.abc import Sequence
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
HALVINGS = 52  # of an interval, which leave one ulp of it
Given = Sequence[float] | None
Span = tuple[float | None, float | None] | None
Ends = tuple[float | Sequence[float] | np.ndarray, float | Sequence[float] | np.ndarray]
# Set points, pressures, contractions, a branch's usual duration [s], loads, springs: of all curves.
Ways = tuple[np.ndarray, Ends, Ends, float, float | np.ndarray, float | np.ndarray]


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


def plan(
    kind: Kind, muscle: Muscle, given: Given = None, span: Span = None, laboratory: Laboratory = USUAL, *,
    load: float | None = None, contraction: float | None = None, duration: float | None = None,
) -> StandPlan:  # fmt: skip
    """A test whose curves are at the `given` points, or the usual ones; in whole cycles, SI.

    isobaric    length from `span[0]` to `span[1]` [-] and back at constant pressures
    sealed      filled to pressures at `span[1]` [-] and shut in, then stretched to `span[0]` and back
    isometric   pressure from `span[0]` to `span[1]` and back at constant contractions
    isotonic, auxotonic   the same under constant loads, or against springs under one `load`
    step        filled through the inlet valve from supplies, then vented, under a `load` or held
    release     held at a `contraction` under pressures, then let go against a `load`
    """
    if kind == "step" and laboratory.valve is None:
        laboratory = dataclasses.replace(laboratory, valve=load_description("valve", "mh1"))
    if switched := kind in ("step", "release"):
        ways = _switched(kind, muscle, given, laboratory, load, contraction)
    elif kind in ("isobaric", "sealed"):
        ways = _stretched(kind, muscle, given, span, laboratory)
    else:
        ways = _filled(kind, muscle, given, span, laboratory, load)
    points, pressure, held, usual, hung, spring = ways
    remembers = muscle.friction != "none" and FRICTIONS[muscle.friction].n_state > 0  # and is run in first
    rows = np.array(np.broadcast_arrays(*pressure, *held, hung, spring, points)[:6], float)
    sides = (rows[:2].T, rows[2:4].T, rows[4], rows[5], np.zeros(len(points)) if kind == "step" else rows[0])
    duration = usual if duration is None else duration
    branches = {"step": 2, "release": 1}.get(kind, 4 if remembers else 2)
    found = StandPlan(kind, muscle, laboratory, points, *sides, 1.0, duration, branches)
    step = laboratory.timestep or _usual_step(found)
    if not 10.0 * step <= duration <= 1e4:
        allowed = f"{10.0 * step:g} s to 10000 s"
        raise InputError("is out of range", field="time", value=f"{duration:g} s", allowed=allowed)
    steps = math.ceil(duration / step - 1e-9)
    stride = max(1, steps // ROWS)
    whole, valve = math.ceil(steps / stride) * stride * step, laboratory.valve if switched else None
    stride = 1 if switched else stride
    return dataclasses.replace(found, timestep=step, duration=whole, stride=stride, valve=valve)


def _stretched(kind: Kind, muscle: Muscle, given: Given, span: Span, laboratory: Laboratory) -> Ways:
    """Of a test whose length is moved."""
    points = _pulling(muscle, given, laboratory)
    low, high = span or (None, None)
    low = low or 0.0
    ends = np.array([_until_slack(muscle, p) if high is None else high for p in points])
    _check_contractions(muscle, [low, *([] if high is None else [high])], float(points.max()))
    _check_rise("contraction", low, ends.min(), f"{low:g} to {ends.min():.3g}")
    usual = max(_slow(muscle, p, float(end - low)) for p, end in zip(points, ends, strict=True))
    moved: Ends = (low, ends)
    if kind == "sealed":
        moved = (ends, low) if span else (0.5 * ends, 0.4 * ends)  # of the way to slack
    return points, (points, points), moved, usual, np.nan, 0.0


def _filled(
    kind: Kind, muscle: Muscle, given: Given, span: Span, laboratory: Laboratory, load: float | None
) -> Ways:
    """Of a test whose pressure is moved, held, under loads or against springs."""
    low, high = span or (None, None)
    high = highest(muscle, laboratory) if high is None else high
    least, supply = low or 0.0, laboratory.supply
    _check_pressures(muscle, np.array([least]), supply, pulls=False)
    _check_pressures(muscle, np.array([high]), supply, pulls=True)
    _check_rise("pressure", least, high, f"{least * 1e-5:g} bar to {high * 1e-5:g} bar")
    strength, way = force_at(muscle, 0.0, high), _until_slack(muscle, high)
    if kind == "isometric":
        points = _points(given, np.arange(0.0, way - 0.01, 0.05))
        _check_contractions(muscle, points, high)
        return points, (least, high), (points, points), SHORTEST_SWEEP, np.nan, 0.0
    size, shares = strength, (0.05, 0.1, 0.2, 0.4, 0.6)
    if kind == "auxotonic":
        size, shares = strength / (muscle.nominal_length * way), (0.1, 0.3, 1.0, 3.0, 10.0)
    points = _points(given, np.array([_two_digits(share * size) for share in shares]))
    loads, springs = points, np.zeros(len(points))
    if kind == "auxotonic":
        loads, springs = np.full(len(points), LEAST_LOAD if load is None else load), points
    _check_loads(muscle, loads, high)
    if wrong := [k for k in springs if not 0.0 <= k <= STIFFEST]:
        value, allowed = f"{1e-3 * wrong[0]:g} N/mm", f"0 to {1e-3 * STIFFEST:g} N/mm"
        raise InputError("is out of range", field="stiffness", value=value, allowed=allowed)
    limit, usual, lows, starts = muscle.limits.contraction_min, SHORTEST_SWEEP, [], []
    for hung, spring in zip(loads, springs, strict=True):
        lifts = kind == "isotonic" and low is None
        first = _lifting(muscle, hung, limit, high) if lifts else least
        lows.append(0.0 if first < 1.0 else first)
        starts.append(hanging(muscle, hung, lows[-1], spring))
        if starts[-1] <= muscle.braid.lock:
            problem, value = f"the braid would lock under {hung:g} N", f"{lows[-1] * 1e-5:g} bar"
            allowed = f"from {_lifting(muscle, hung, limit, high) * 1e-5:.3g} bar"
            raise InputError(problem, field="pressure", value=value, allowed=allowed)
        shortening = hanging(muscle, hung, high, spring) - starts[-1]
        usual = max(usual, 3.0 * _slow(muscle, high, shortening))
    return points, (lows, high), (starts, starts), usual, loads, springs


def _switched(
    kind: Kind, muscle: Muscle, given: Given, laboratory: Laboratory, load: float | None,
    contraction: float | None,
) -> Ways:  # fmt: skip
    """Of a test that valves begin, or a carriage that is let go."""
    points, start, hung = _pulling(muscle, given, laboratory), contraction or 0.0, np.nan
    weakest, lets_go = float(points.min()), kind == "release"
    if contraction is not None and load is not None and not lets_go:
        raise InputError("is not compatible with a held contraction", field="load", value=f"{load:g} N")
    if contraction is not None or lets_go:
        _check_contractions(muscle, [start], weakest if lets_go else float(points.max()))
    if contraction is None or lets_go:
        light = max(_two_digits(USUAL_LOAD * force_at(muscle, start, weakest)), LEAST_LOAD)
        hung = light if load is None else load
        _check_loads(muscle, [hung], weakest, start)
    if lets_go:
        return points, (points, points), (start, start), 2.0, hung, 0.0
    start = hanging(muscle, hung, 0.0) if contraction is None else contraction
    if start <= muscle.braid.lock:
        problem = "the empty muscle's braid would lock under it"
        allowed = f"at most {math.floor(force_at(muscle, muscle.braid.lock, 0.0))} N"
        raise InputError(problem, field="load", value=f"{hung:g} N", allowed=allowed)
    assert laboratory.valve is not None
    volume = laboratory.tube_volume + float(muscle.volume(contraction=0.6))
    usual = max(1.0, math.ceil(5.0 * volume / (laboratory.valve.conductance * 1e5)))
    return points, (points, points), (start, start), usual, hung, 0.0


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
    largest = muscle.damping * (pressure + AMBIENT_PRESSURE)  # dF/dκ̇ [N·s]
    if muscle.damper is not None:
        above = muscle.damper.relaxing_above or muscle.damper.relaxing
        lines = (muscle.damper.contracting, muscle.damper.relaxing, above)
        largest += muscle.nominal_length * max(b0 + b1 * pressure for b0, b1 in lines)
    mean = largest * way / (LOSS * force_at(muscle, 0.0, pressure))
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
            weak = "the muscle cannot lift it" if load >= strength else "is less than the stand can attach"
            problem, value = f"{weak} at {pressure * 1e-5:g} bar", f"{load:g} N"
            allowed = f"{LEAST_LOAD:g} N to {math.floor(strength * 0.999):g} N"
            raise InputError(problem, field="load", value=value, allowed=allowed)


def _check_pressures(muscle: Muscle, pressures: np.ndarray, supply: float | None, *, pulls: bool) -> None:
    """Refuse gauge pressures [Pa] above supply or limit, or (`pulls`) at which the muscle does not pull."""
    top, told = muscle.limits.pressure, provenance_note(muscle.limits, "pressure")

    def refused(problem: str, value: float, low: float = 0.0, field: str = "pressure") -> InputError:
        allowed = f"{math.ceil(low * 1e-3) * 1e-2:g} bar to {top * 1e-5:.4g} bar"
        return InputError(problem, field=field, value=f"{value * 1e-5:g} bar", allowed=allowed)

    whose = f"the muscle's limit{told}"
    if supply is not None:
        if supply > top:
            raise refused(f"is more than the muscle withstands{told}", supply, field="supply")
        top, whose = supply, "the supply's pressure"
    for pressure in pressures:
        if not 0.0 <= pressure <= top * (1.0 + 1e-9):
            raise refused(f"is beyond {whose}", pressure)
        if pulls and force_at(muscle, 0.0, pressure) < PULLING:
            enough = _lifting(muscle, PULLING, 0.0, top)
            raise refused("is too low for this muscle to pull", pressure, enough)


def _check_rise(name: str, low: float, high: float, shown: str) -> None:
    if not low < high:
        raise InputError("does not rise", field=name, value=shown, allowed="FROM < TO")


def force_at(muscle: Muscle, contraction: float, pressure: float) -> float:
    """Tension at rest and without friction, at one contraction [-] and gauge pressure [Pa]."""
    return float(muscle.force(pressure, contraction=contraction))


def slack(muscle: Muscle, pressure: float) -> float:
    """Contraction ratio from which a muscle at a gauge pressure [Pa] carries nothing [-]."""
    return crossing(lambda x: force_at(muscle, x, pressure) - 1e-9, (), 0.0, SHORTEST, HALVINGS)


def hanging(muscle: Muscle, load: float, pressure: float, spring: float = 0.0) -> float:
    """Contraction ratio at which a load [N] and a spring [N/m] rest on a muscle at a gauge pressure [Pa]."""
    rise = spring * muscle.nominal_length
    return crossing(
        lambda x: force_at(muscle, x, pressure) - load - rise * x, (), LONGEST, SHORTEST, HALVINGS
    )


def _lifting(muscle: Muscle, load: float, contraction: float, highest: float) -> float:
    """Lowest gauge pressure, up to `highest` [Pa], that carries a load [N] at a contraction [-]."""
    return crossing(lambda p: load - force_at(muscle, contraction, p), (), 0.0, highest, HALVINGS)
