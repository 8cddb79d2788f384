"""The settled stride, solved: the air that every chamber has at heel strike, so that the next stride repeats.

A stride maps mass and σ of the chambers at one heel strike to those at the next. Its fixed point is sought
by Newton's method, with the slopes of the air along the stride just walked (`stride_search.py`). Ankle,
valves, own lengths and cuff are carried by walking. So is friction that remembers: two strides are walked
after each jump of the air before it is judged. Where it can be, the search begins in longer steps
(`coarse_stride.py`), and goes on in the asked ones with their air and slopes.
"""

import ctypes
import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, SimulationError
from afo_sim.model import AFTER, JOINTS, Built, cooled, steps_of_stride
from afo_sim.model.prefill import prefill
from afo_sim.physics import compiled_functions, valve_flow
from afo_sim.simulation.coarse_stride import at_heel_strike, coarse
from afo_sim.simulation.rollout import (
    METRIC_FIELDS,
    STATE,
    Case,
    Rollout,
    Workspace,
    failed,
    limp,
    not_begun,
    state_parts,
    widths,
)
from afo_sim.simulation.simulate import GONE, begun_case, first_beyond
from afo_sim.simulation.stepping import Rows, one_of, stepper_of
from afo_sim.simulation.stride_search import StrideSearch, sticks

ROUGH = 10.0  # times the distances within which a stride in long steps is settled [-]


@dataclass(frozen=True)
class Settled:
    """The settled stride of one scenario."""

    rollout: Rollout
    strides: int = 0
    steps: int = 0
    air: float = math.nan
    angle: float = math.nan
    found: bool = False
    slowest: float = math.nan


def settle(
    builts: Sequence[Built],
    controls: Sequence[np.ndarray],
    *,
    mode: native.Mode = "native",
    fields: tuple[str, ...] = METRIC_FIELDS,
    workspace: Workspace | None = None,
) -> list[Settled]:
    """Solve for settled strides side by side, each exactly as it is solved alone."""
    workspace = workspace or Workspace()
    found: dict[int, Settled] = {}
    with native.installed(mode), native.without_clock():
        begun = [
            # friction that keeps the past keeps that of this start
            begun_case(built, control, air=None if sticks(built) else partial(first_air, control=control))
            for built, control in zip(builts, controls, strict=True)
        ]
        cases: dict[int, Case] = {}
        for k, reason in enumerate(limp(begun)):
            if reason is None:
                cases[k] = begun[k]
            else:
                found[k] = Settled(not_begun(builts[k].model, reason))
        if cases:
            walks = [_Walk(builts[k], controls[k], case) for k, case in cases.items()]
            party = _Party(_begun_near(walks, mode, workspace), mode, fields)
            found |= dict(zip(cases, party.settled(workspace), strict=True))
    return [found[k] for k in range(len(builts))]


@dataclass(frozen=True)
class _Walk:
    """A scenario's strides, inputs and start; of longer steps before, how many, and slopes of the air."""

    built: Built
    control: np.ndarray
    case: Case
    steps: int = 0
    slopes: np.ndarray | None = None


def _begun_near(walks: list[_Walk], mode: native.Mode, workspace: Workspace) -> list[_Walk]:
    """The walks from where a search in longer steps has ended; where that finds nothing, as they are."""
    found = list(walks)
    longer: dict[int, dict[int, _Walk]] = {}  # by its steps a stride: as many steps may last a bit longer
    for k, walk in enumerate(walks):
        if (there := coarse(walk.built, walk.control)) is not None:
            built, control = there
            state = at_heel_strike(walk.built, walk.case.state, built.scenario.timestep)
            near = _Walk(built, control, Case(built.model, state, walk.case.policy))
            longer.setdefault(len(control) // 2, {})[k] = near
    for alike in longer.values():
        # their models take the longer steps meanwhile: a copy of one costs as much as a hundred steps
        for near in alike.values():
            near.case.model.opt.timestep = near.built.scenario.timestep
        party, places = _Party(list(alike.values()), mode, ("userdata",), ROUGH), list(alike)
        for place, search, failure in party.ended(workspace):
            k, walk = places[place], walks[places[place]]
            walk.case.model.opt.timestep = walk.built.scenario.timestep
            found[k] = dataclasses.replace(walk, steps=search.strides * party.n)
            if failure is None and search.found:
                state = at_heel_strike(walk.built, party.stepper.state(place), walk.built.scenario.timestep)
                case = dataclasses.replace(walk.case, state=state)
                found[k] = dataclasses.replace(
                    found[k], case=case, slopes=search.slopes() if search.chambers else None
                )
    return found


class _Party:
    """Searches that walk side by side, stride by stride."""

    def __init__(
        self, walks: Sequence[_Walk], mode: native.Mode, fields: tuple[str, ...], within: float = 1.0
    ):
        cases = [walk.case for walk in walks]
        models, states = [case.model for case in cases], [case.state for case in cases]
        self.stepper = stepper_of(models, states, mode)
        self.n = steps_of_stride(walks[0].built.scenario)
        self.widths = widths(models[0], fields)
        starts = state_parts(models[0], states)
        self.walks = walks
        self.searches = [
            StrideSearch(walk.built, walk.control, one_of(starts, k), near=walk.slopes, within=within)
            for k, walk in enumerate(walks)
        ]

    def ended(self, workspace: Workspace) -> Iterator[tuple[int, StrideSearch, Exception | None]]:
        """Walk until every search has ended: each, as it does, with what failed; its rows are good then."""
        going, turn = list(range(len(self.searches))), 0
        while going:
            failures = self._stride(going, turn, workspace)
            for k in tuple(going):
                search = self.searches[k]
                failure, last = failures.get(k), search.last
                if failure is None and last and first_beyond(search.built, search.ankle(last)) is not None:
                    failure = self._failed(k, GONE)
                if failure is not None or search.done:
                    going.remove(k)
                    yield k, search, failure
                elif search.may_jump:
                    search.jump(self.stepper.act(k))
                else:
                    search.refill(self.stepper.act(k))
            turn = 1 - turn

    def settled(self, workspace: Workspace) -> list[Settled]:
        """Walk until every search has ended, and two strides of each."""
        rows = workspace.rows("settled ", (len(self.searches), 2 * self.n + AFTER), self.widths)
        found: dict[int, Settled] = {}
        for k, search, failure in self.ended(workspace):
            steps = self.walks[k].steps + search.strides * self.n
            if failure is not None:
                found[k] = Settled(not_begun(search.built.model, failure), search.strides, steps)
                continue
            rollout = self._rollout(k, one_of(rows, k))
            found[k] = Settled(
                rollout, search.strides, steps, search.air, search.angle, search.found, search.slowest
            )
        return [found[k] for k in range(len(found))]

    def _stride(self, going: list[int], turn: int, workspace: Workspace) -> dict[int, Exception]:
        """Walk a stride of every search that goes on; memory of the stride before stays."""
        firsts = [0 if self.searches[k].strides == 0 else self.n for k in going]
        inputs = [self.searches[k].control[a : a + self.n] for k, a in zip(going, firsts, strict=True)]
        out = workspace.rows(f"stride {turn} ", (len(going), self.n), self.widths)
        stopped = self.stepper.advance(going, np.ascontiguousarray(inputs), out)
        for place, k in enumerate(going):
            if k not in stopped:
                self.searches[k].walked(one_of(out, place))
        return {k: self._failed(k, stop.reason) for k, stop in stopped.items()}

    def _failed(self, k: int, reason: str) -> SimulationError:
        return failed(self.searches[k].built.model, reason, self.searches[k].strides * self.n)

    def _rollout(self, k: int, rows: Rows) -> Rollout:
        """Aligned rows of a search's last two strides and of the steps after them, into `rows`."""
        search, n = self.searches[k], self.n
        last, before = search.last, search.before if search.paired else search.last
        assert before is not None and last is not None
        inputs = search.control[2 * n :]
        out = {name: np.empty((1, AFTER, width)) for name, width in self.widths.items()}
        stopped = self.stepper.advance([k], np.ascontiguousarray(inputs[np.newaxis]), out)
        if k in stopped:
            return not_begun(search.built.model, self._failed(k, stopped[k].reason))
        for name, values in rows.items():
            parts = [before.out[name], last.out[name], out[name][0]]
            if name in STATE:  # after a step; the rows want it before
                begun = [stride.start[name][np.newaxis] for stride in (before, last)]
                parts = [begun[0], before.out[name][:-1], begun[1], last.out[name], out[name][0, :-1]]
            np.concatenate(parts, out=values)
        # the shank has walked on, while the first strides are reported
        assert search.built.walk is not None
        forward = rows["qpos"][:, search.built.model.joint(JOINTS[0]).qposadr[0]]
        for first, stride in ((0, slice(n)), (n, slice(n, None))):
            forward[stride] -= forward[first] - search.built.walk.pose[1 + first, 0]
        return Rollout(rows, search.control, final={name: out[name][0, -1] for name in STATE})


FILLED = 0.5  # share of the supply's pressure at which the volume is taken, and from which it begins
PARTS, STRIDES = 60, 3  # coarse steps of a stride, strides


def first_air(built: Built, data: mujoco.MjData, control: np.ndarray) -> dict[int, float]:
    """Gauge pressure of every chamber at the start of a stride [Pa], by its actuator.

    What no valve opens keeps the air with which the wearer starts.
    """
    assert built.walk is not None
    index, n = built.index, built.walk.steps_of_stride
    set_to = built.scenario.supply.pressure  # a line before a regulator has more
    supply = {i: min(float(control[n, i]), set_to) for i in index.chambers.values()}
    native.fill_chambers(built.model, data, {i: FILLED * pressure for i, pressure in supply.items()})
    cuts = _cuts(n)
    found, shut = {}, []
    (filled,) = compiled_filling()
    for name, chamber in built.scenario.orthosis.chamber.items():
        actuator = index.chambers[name]
        coils = control[n : 2 * n, [index.valves[f"{name}_inlet"], index.valves[f"{name}_outlet"]]]
        if not coils.any():
            shut.append(actuator)
            continue
        opened = np.add.reduceat(coils, cuts[:-1]) / (cuts[1:] - cuts[:-1])[:, np.newaxis]
        if not opened[:, 0].any():  # never filled
            found[actuator] = 0.0
            continue
        volume = float(native.read_flows(built.model, data.userdata, actuator).volume)
        per_mass = GAS_CONSTANT * AMBIENT_TEMPERATURE / volume * built.scenario.timestep * n / PARTS
        inlet, outlet = chamber.inlet, chamber.vent
        valves = inlet.conductance, inlet.critical_ratio, outlet.conductance, outlet.critical_ratio
        found[actuator] = filled(opened.ctypes.data, STRIDES * PARTS, supply[actuator], per_mass, *valves)
    if shut:
        prefill(built, data)
        held = [float(native.read_held(built.model, data.act, k)[0]) for k in shut]
        for k, mass in zip(shut, held, strict=True):
            found[k] = cooled(built.model, data, k, mass) - AMBIENT_PRESSURE
    return found


@lru_cache(maxsize=8)
def _cuts(n: int) -> np.ndarray:
    return np.linspace(0, n, PARTS + 1).astype(int)


def _filled(
    opened: Any,
    parts: float,
    supply: float,
    per_mass: float,
    inlet: float,
    inlet_ratio: float,
    outlet: float,
    outlet_ratio: float,
) -> float:
    """Gauge pressure after a few strides [Pa], from the valves' openings in each part of one (PARTS, 2)."""
    ambient, warm = AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
    fed = supply + ambient
    pressure = ambient + FILLED * (fed - ambient)
    for part in range(int(parts)):
        k = 2 * (part % PARTS)
        entering = valve_flow(fed, warm, pressure, warm, opened[k], inlet, inlet_ratio)
        leaving = valve_flow(pressure, warm, ambient, warm, opened[k + 1], outlet, outlet_ratio)
        pressure += per_mass * (entering - leaving)
        pressure = min(max(pressure, ambient), fed)  # a coarse step may overshoot
    return pressure - ambient


_ARGUMENTS = (ctypes.c_void_p, *(ctypes.c_double,) * 7)
compiled_filling = partial(compiled_functions, "first_air", _ARGUMENTS, _filled)
