"""The settled stride, solved: the air that every chamber has at heel strike, so that the next stride repeats.

A stride maps mass and σ of the chambers at one heel strike to those at the next. Its fixed point is sought
by Newton's method, with the slopes of the air along the stride just walked (`stride_search.py`). Ankle,
valves, own lengths and cuff are carried by walking. So is friction that remembers: two strides are walked
after each jump of the air before it is judged. Where it can be, the search begins in longer steps
(`coarse_stride.py`), and goes on in the asked ones with their air and slopes.
"""

import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import accumulate

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, Doubles, SimulationError
from afo_sim.model import AFTER, JOINTS, Built, cooled
from afo_sim.model.prefill import prefill
from afo_sim.native.between_strides import compiled_between
from afo_sim.native.stride_numbers import AT, GONE
from afo_sim.physics import kernels, valve_flow
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
    widths,
)
from afo_sim.simulation.simulate import GONE as THROUGH
from afo_sim.simulation.simulate import begun_case
from afo_sim.simulation.stepping import Rows, one_of, stepper_of
from afo_sim.simulation.stride_search import in_steps, numbers_of, sticks, with_slopes

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
    builts: Sequence[Built], controls: Sequence[np.ndarray], *, mode: native.Mode = "native",
    fields: tuple[str, ...] = METRIC_FIELDS, workspace: Workspace | None = None,
) -> list[Settled]:  # fmt: skip
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
            n = (len(controls[0]) - AFTER) // 2
            numbers = [numbers_of(builts[k], controls[k], n) for k in cases]
            walks = [
                _Walk(builts[k], controls[k], cases[k], row) for k, row in zip(cases, numbers, strict=True)
            ]
            searches = _Searches(_begun_near(walks, mode, workspace), mode, fields)
            found |= dict(zip(cases, searches.settled(workspace), strict=True))
    return [found[k] for k in range(len(builts))]


@dataclass(frozen=True)
class _Walk:
    """A scenario's strides, inputs, start and search; how many longer steps were taken before."""

    built: Built
    control: np.ndarray
    case: Case
    numbers: np.ndarray
    steps: int = 0


def _begun_near(walks: list[_Walk], mode: native.Mode, workspace: Workspace) -> list[_Walk]:
    """The walks from where a search in longer steps has ended; where that finds nothing, as they are."""
    found = list(walks)
    longer: dict[int, dict[int, _Walk]] = {}  # by its steps a stride: as many steps may last a bit longer
    for k, walk in enumerate(walks):
        if (there := coarse(walk.built, walk.control)) is not None:
            built, control = there
            state = at_heel_strike(walk.built, walk.case.state, built.scenario.timestep)
            case, n = Case(built.model, state, walk.case.policy), len(control) // 2
            numbers = in_steps(walk.numbers, n, built.scenario.timestep, ROUGH)
            longer.setdefault(n, {})[k] = _Walk(built, control, case, numbers)
    for alike in longer.values():
        # their models take the longer steps meanwhile: a copy of one costs as much as a hundred steps
        for near in alike.values():
            near.case.model.opt.timestep = near.built.scenario.timestep
        searches, places = _Searches(list(alike.values()), mode, ("userdata",)), list(alike)
        try:
            ended = dict(searches.ended(workspace))
        finally:
            for k in places:
                walks[k].case.model.opt.timestep = walks[k].built.scenario.timestep
        for place, failure in ended.items():
            k, walk = places[place], walks[places[place]]
            found[k] = dataclasses.replace(walk, steps=searches.steps(place))
            if failure is None and searches.numbers[place, AT.found]:
                state = at_heel_strike(
                    walk.built, searches.stepper.state(place), walk.built.scenario.timestep
                )
                case = dataclasses.replace(walk.case, state=state)
                numbers = with_slopes(walk.numbers, searches.numbers[place])
                found[k] = dataclasses.replace(found[k], case=case, numbers=numbers)
    return found


class _Searches:
    """Searches that walk side by side, stride by stride."""

    def __init__(self, walks: Sequence[_Walk], mode: native.Mode, fields: tuple[str, ...]):
        models, states = [walk.case.model for walk in walks], [walk.case.state for walk in walks]
        self.walks, self.everyone = walks, list(range(len(walks)))
        self.stepper = stepper_of(models, states, mode)
        self.n = int(walks[0].numbers[AT.steps])
        self.widths = widths(models[0], fields)
        ends = list(accumulate(self.widths[name] for name in STATE))
        self.parts = {
            name: slice(end - self.widths[name], end) for name, end in zip(STATE, ends, strict=True)
        }
        self.numbers = np.zeros((len(walks), max(len(walk.numbers) for walk in walks)))
        for row, walk in zip(self.numbers, walks, strict=True):
            row[: len(walk.numbers)] = walk.numbers
        # how the stride before last, the last and the next one begin; whose rows of the former two are where
        self.begun = [self.stepper.begun(self.everyone)] * 3
        self.walked: list[tuple[list[int], Rows]] = []

    def steps(self, k: int) -> int:
        """Steps that were taken for a search, with those of longer ones before."""
        return self.walks[k].steps + int(self.numbers[k, AT.strides]) * self.n

    def ended(self, workspace: Workspace) -> Iterator[tuple[int, Exception | None]]:
        """Walk until every search has ended: each, as it does, with what failed; its rows are good then."""
        going, turn, inputs = self.everyone, 0, np.empty(0)
        pairs = bool(self.numbers[:, AT.paired].any())  # rows of the stride before stay for them
        while going:
            if turn < 2 or len(going) < len(inputs):
                first = min(turn, 1) * self.n  # every stride but the first is walked as the second
                inputs = workspace.take("inputs", (len(going), self.n, self.walks[0].control.shape[1]))
                for place, k in enumerate(going):
                    inputs[place] = self.walks[k].control[first : first + self.n]
            out = workspace.rows(f"stride {turn % 2 * pairs} ", (len(going), self.n), self.widths)
            stopped = self.stepper.advance(going, inputs, out)
            self.begun = [*self.begun[1:], self.begun[2].copy()]
            self.begun[2][going] = self.stepper.begun(going)
            walked = np.array([-1.0 if k in stopped else k for k in going], dtype=float)
            arrays = (self.numbers, walked, *self.begun[1:], out["qpos"], out["act"], out["userdata"], inputs)
            sizes = len(going), self.numbers.shape[1], self.begun[2].shape[1]
            compiled_between()[0](*(array.ctypes.data for array in arrays), *sizes)
            self.stepper.begin(going, self.begun[2][going])
            self.walked = [*self.walked[-1:], (going, out)]
            ended, turn = self.numbers[going, AT.ended].tolist(), turn + 1
            for k, end in zip(going, ended, strict=True):
                if k in stopped:
                    yield k, self._failed(k, stopped[k].reason)
                elif end:
                    yield k, self._failed(k, THROUGH) if end == GONE else None
            going = [k for k, end in zip(going, ended, strict=True) if not end and k not in stopped]

    def settled(self, workspace: Workspace) -> list[Settled]:
        """Walk until every search has ended, and two strides of each."""
        rows = workspace.rows("settled ", (len(self.walks), 2 * self.n + AFTER), self.widths)
        failures: dict[int, Exception] = {}
        for k, failure in self.ended(workspace):
            if failure is None:
                self._keep(k, one_of(rows, k))
            else:
                failures[k] = failure
        ends = self._walk_on([k for k in self.everyone if k not in failures], rows, failures)
        # share of a distance from the settled air that a stride leaves, where it was asked [-]
        asked = [k for k, row in enumerate(self.numbers) if row[AT.asked]]
        slowest, size = np.full(len(self.numbers), math.nan), 2 * int(self.numbers[:, AT.nodes].max())
        slopes = np.zeros((len(asked), size, size))
        for own, row in zip(slopes, self.numbers[asked], strict=True):
            n = 2 * int(row[AT.nodes])
            own[:n, :n] = row[int(row[AT.told]) : int(row[AT.flowing])].reshape(n, n)
        slowest[asked] = np.abs(np.linalg.eigvals(slopes)).max(axis=1, initial=0.0)
        found = []
        for k, (walk, row) in enumerate(zip(self.walks, self.numbers, strict=True)):
            told = int(row[AT.strides]), self.steps(k)
            if k in failures:
                found.append(Settled(not_begun(walk.built.model, failures[k]), *told))
                continue
            rollout = Rollout(one_of(rows, k), walk.control, final=ends[k])
            air, angle, good = row[[AT.air, AT.angle, AT.found]].tolist()
            found.append(Settled(rollout, *told, air, angle, good > 0.0, float(slowest[k])))
        return found

    def _failed(self, k: int, reason: str) -> SimulationError:
        return failed(self.walks[k].built.model, reason, int(self.numbers[k, AT.strides]) * self.n)

    def _keep(self, k: int, rows: Rows) -> None:
        """Aligned rows of a search's last two strides, into `rows`: states before each step, forces in it."""
        n, pair = self.n, []
        for place in (0, 1) if self.numbers[k, AT.paired] else (-1, -1):
            going, walked = self.walked[place]
            pair.append((one_of(walked, going.index(k)), self.begun[1 if place else 0][k]))
        for name, values in rows.items():
            for first, (walked, begun) in zip((0, n), pair, strict=True):
                if name in STATE:
                    values[first] = begun[self.parts[name]]
                    values[first + 1 : first + n + 1] = walked[name]
                else:
                    values[first : first + n] = walked[name]

    def _walk_on(self, going: list[int], rows: Rows, failures: dict[int, Exception]) -> dict[int, Rows]:
        """The steps after the last strides, into their rows, and the states that they end with."""
        n, out = self.n, {name: np.empty((len(going), AFTER, width)) for name, width in self.widths.items()}
        if going:
            inputs = np.array([self.walks[k].control[2 * n :] for k in going])
            stopped = self.stepper.advance(going, inputs, out)
            failures |= {k: self._failed(k, stop.reason) for k, stop in stopped.items()}
        for name, values in rows.items():
            values[going, 2 * n + (name in STATE) :] = out[name][:, : AFTER - (name in STATE)]
        for k in going:  # the shank has walked on, while the first strides are reported
            built = self.walks[k].built
            assert built.walk is not None
            joint = mujoco.mj_name2id(built.model, mujoco.mjtObj.mjOBJ_JOINT, JOINTS[0])
            forward = rows["qpos"][k, :, built.model.jnt_qposadr[joint]]
            for first, stride in ((0, slice(n)), (n, slice(n, None))):
                forward[stride] -= forward[first] - built.walk.pose[1 + first, 0]
        return {k: {name: out[name][at, -1] for name in STATE} for at, k in enumerate(going)}


FILLED = 0.5  # share of the supply's pressure at which the volume is taken, and from which it begins
PARTS, STRIDES = 60, 3  # coarse steps of a stride, strides


def first_air(built: Built, data: mujoco.MjData, control: np.ndarray) -> dict[int, float]:
    """Gauge pressure of every chamber at the start of a stride [Pa], by its actuator."""
    # What no valve opens keeps the air with which the wearer starts.
    assert built.walk is not None
    index, n = built.index, built.walk.steps_of_stride
    set_to = built.scenario.supply.pressure  # a line before a regulator has more
    supply = {i: min(float(control[n, i]), set_to) for i in index.chambers.values()}
    native.fill_chambers(built.model, data, {i: FILLED * pressure for i, pressure in supply.items()})
    cuts = np.linspace(0, n, PARTS + 1).astype(int)
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


def _filled(
    opened: Doubles, parts: float, supply: float, per_mass: float, inlet: float, inlet_ratio: float,
    outlet: float, outlet_ratio: float,
) -> float:  # fmt: skip
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


compiled_filling = kernels("first_air", _filled, rooms=("simulation",))
