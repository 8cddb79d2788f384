"""The search for one scenario's settled stride: how far it is, and where its air jumps next.

It is found when a stride ends as it began: within `AIR` in mass and σ of every chamber and rigid volume, and
within `ANGLE` in the ankle's angle. Where more is carried on (`remembers`), two strides in a row, without a
jump between, have to differ by less than `ANGLE` in the ankle's angle everywhere.
"""

import math
from dataclasses import dataclass

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.model import ANKLE, OFF, SINK, Built, beyond_chambers
from afo_sim.physics import FRICTIONS
from afo_sim.simulation.air_slopes import GIVING, AirRows, air_slopes, giving
from afo_sim.simulation.network_slopes import NetworkRows, network_rows, network_slopes
from afo_sim.simulation.rollout import STATE
from afo_sim.simulation.stepping import Rows

AIR = 1e-4  # change of mass and σ over a settled stride [-]
ANGLE = math.radians(0.005)  # over a settled stride, or between two [rad]
JUMPS = 12  # of the air, after which strides are only walked
STRIDES = 60  # that are walked at most
NEAR = 10.0 * AIR  # step of Newton's method that is still to go, at most [-]
OF_FLOW, LEAST = 2e-3, 1e-6  # and at most so much of the air that flows in; less is not asked for [-]
LARGEST = 1.0  # change of ln m and ln σ in a jump [-]
FORGOTTEN = 12e-3  # time for which a velocity counts that differs [s]
LEVER = 0.1  # between ankle and sole, roughly: at its end an angle is a height [m]
TRUSTED = 3  # strides for which slopes of longer steps are taken
COARSE = 12e-3  # between the rows that the slopes are taken from [s]
TINY = 1e-9  # change of ln m and ln σ that tells nothing [-]
REFILLED = 0.5  # share of a store's content below which it is filled again [-]
STILL = 1e-6  # share of the largest slope below which a chamber's air has nothing that brings it back


@dataclass
class Stride:
    """A stride that was walked."""

    start: Rows
    out: Rows
    ended: np.ndarray
    control: np.ndarray
    air: AirRows | NetworkRows | None = None
    slopes: np.ndarray | None = None


@dataclass
class StrideSearch:
    """The search for one scenario's stride: how far it is."""

    built: Built
    control: np.ndarray
    start: Rows  # of the next stride
    strides: int = 0
    jumps: int = 0
    since_jump: int = 0  # strides
    air: float = math.inf
    angle: float = math.inf
    found: bool = False
    slowest: float = math.nan  # share of a distance from the settled air that a stride leaves [-]
    giving: np.ndarray | float = GIVING
    near: np.ndarray | None = None
    within: float = 1.0
    last: Stride | None = None
    before: Stride | None = None

    def __post_init__(self) -> None:
        self.chambers = list(self.built.index.chambers.values())  # their actuators
        # of all that holds air and is solved for: chambers, then rigid volumes
        self.nodes = [*self.chambers, *self.built.index.volumes.values()]
        numbers = np.arange(self.built.model.na)
        rows = [native.read_held(self.built.model, numbers, node) for node in self.nodes]
        self.places = np.array(rows, dtype=int).reshape(-1, 2)  # of mass and σ in `act`
        self.first = self.change = self.held(self.start)
        self.paired = remembers(self.built, self.control)
        # Places in `qpos` and `qvel` of what moves by itself, and how much of each counts as 1 rad
        toes, model = self.built.scenario.leg.toes, self.built.model
        joints = {ANKLE: 1.0} | ({toes.joint: 1.0} if toes else {})
        joints |= {SINK: LEVER} if self.built.contact else {}
        places = [(model.joint(n).qposadr[0], model.joint(n).dofadr[0]) for n in joints]
        self.free = *np.transpose(places), np.array(list(joints.values()))

    @property
    def done(self) -> bool:
        """Whether no more strides are to be walked."""
        return self.found or self.strides >= STRIDES

    def walked(self, out: Rows) -> None:
        """Take a stride that was walked."""
        n, first = len(out["time"]), len(out["time"]) if self.strides else 0  # later ones as the second
        ended = {name: out[name][-1].copy() for name in STATE}
        stride = Stride(self.start, out, self.held(ended), self.control[first : first + n])
        self.before, self.last = self.last, stride
        self.start = ended
        self.strides += 1
        self.since_jump += 1
        self.change = np.log(stride.ended / self.held(stride.start))  # of ln m and ln σ of each node (c, 2)
        self.air = float(np.max(np.abs(self.change), initial=0.0))
        self.angle = self._apart(stride)
        settled = self.air <= self.within * AIR and self.angle <= self.within * ANGLE
        self.found = settled and self.since_jump > self.paired
        if self.found and self.within == 1.0 and self.jumps < JUMPS and not sticks(self.built):
            self.found = self._is_near()

    def _apart(self, stride: Stride) -> float:
        """Distance of the ankle at a stride's end from its start [rad]; of a pair, largest between the
        two."""
        if self.paired:
            if self.before is None:
                return math.inf
            return float(np.max(np.abs(self.ankle(stride) - self.ankle(self.before))))
        start, out, (qpos, dof, scale) = stride.start, stride.out, self.free
        place = np.abs(out["qpos"][-1, qpos] - start["qpos"][qpos])
        velocity = np.abs(out["qvel"][-1, dof] - start["qvel"][dof])
        return float(np.max(np.maximum(place, FORGOTTEN * velocity) / scale))

    def _is_near(self) -> bool:
        """Whether Newton's method would not go far from here; what changes slowly may have far to go."""
        last = self.last
        if last is None or not self.chambers:
            return True
        own = self._own_slopes()
        step = np.abs(_step(self.slopes(), self.change.ravel())).reshape(-1, 2)
        air = self._air(last)  # that flows into each node over a stride, by what it began with [-] (c,)
        if isinstance(air, NetworkRows):
            flowing = air.entering()
        else:
            inlet = np.maximum(air.inlet, 0.0).sum(axis=1)
            flowing = inlet * air.step / self.held(last.start)[:, 0]
        filled = np.repeat(flowing > 0.0, 2)  # where nothing flows, a flow's slope is not known
        shares = np.abs(np.linalg.eigvals(own[np.ix_(filled, filled)]))
        self.slowest = float(np.max(shares, initial=0.0))
        enough = np.where(flowing > 0.0, np.clip(OF_FLOW * flowing, LEAST, NEAR), NEAR)
        return bool((step <= enough[:, np.newaxis]).all())

    def held(self, state: Rows) -> np.ndarray:
        """Mass [kg] and σ of each node in a state (c, 2)."""
        found: np.ndarray = state["act"][self.places]
        return found

    def ankle(self, stride: Stride) -> np.ndarray:
        """Ankle angle after each step of a stride [rad] (n,)."""
        found: np.ndarray = stride.out["qpos"][:, self.built.index.ankle_qpos]
        return found

    def jump(self, act: np.ndarray) -> None:
        """Put the air that should repeat into `act` (na,), by one step of Newton's method."""
        assert self.last is not None
        wanted = self.first
        if self.jumps < JUMPS:
            begun = np.log(self.held(self.last.start)).ravel()
            wanted = np.exp(begun + _bounded(self.slopes(), self.change.ravel())).reshape(-1, 2)
        for row, node in enumerate(self.nodes):
            native.write_held(self.built.model, act, node, wanted[row])
        for store in self.built.index.stores.values():
            native.fill_store(self.built.model, act, store)
        self.start["act"] = act.copy()
        self.jumps += 1
        self.since_jump = 0

    def refill(self, act: np.ndarray) -> None:
        """Fill stores in `act` (na,) before the search runs them empty."""
        for store in self.built.index.stores.values():
            if native.store_left(self.built.model, act, store) < REFILLED:
                native.fill_store(self.built.model, act, store)
                self.start["act"] = act.copy()

    def slopes(self) -> np.ndarray:
        """∂(ln m, ln σ) of all nodes at the last stride's end by those at its start (2c, 2c)."""
        last, before, own = self.last, self.before, self._own_slopes()
        assert last is not None
        # the first stride from rest has not the past of one
        if before is None or (self.strides < 3 and self.near is None):
            return own
        moved = np.log(self.held(last.start) / self.held(before.start)).ravel()
        if not np.max(np.abs(moved)) > TINY:
            return own
        became = np.log(self.held(self.start) / before.ended).ravel()
        found: np.ndarray = own + np.outer(became - own @ moved, moved) / (moved @ moved)
        return found

    def _own_slopes(self) -> np.ndarray:
        """The slopes along the last stride, of each chamber by itself or of a network (2c, 2c)."""
        last, before = self.last, self.before
        assert last is not None
        if self.near is not None and self.strides <= TRUSTED:
            return self.near
        if last.slopes is not None:
            return last.slopes
        air = self._air(last)
        self.giving = giving(air, None if before is None else self._air(before), self.giving)
        if isinstance(air, NetworkRows):
            rigid = np.arange(len(self.nodes)) >= len(self.chambers)
            self.giving = np.where(rigid[:, np.newaxis], 0.0, self.giving)
            last.slopes = network_slopes(air, self.giving)
            return last.slopes
        last.slopes = np.zeros((2 * len(self.chambers),) * 2)
        for k, own in enumerate(air_slopes(air, self.giving)):
            last.slopes[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = own
        return last.slopes

    def _air(self, stride: Stride) -> AirRows | NetworkRows:
        """The air in some rows of a stride."""
        if stride.air is not None:
            return stride.air
        built, index = self.built, self.built.index
        coarse = max(round(COARSE / built.scenario.timestep), 1)
        rows = {name: values[::coarse] for name, values in stride.out.items()}
        inputs, step = stride.control[::coarse], coarse * built.scenario.timestep
        if beyond_chambers(built.scenario):
            stride.air = network_rows(built, self.nodes, rows, inputs, step)
            return stride.air
        air, parts = np.empty((5, len(self.chambers), len(inputs))), np.empty((3, len(self.chambers), 1))
        for k, (name, chamber) in enumerate(index.chambers.items()):
            held = native.read_air(built.model, rows["act"], rows["userdata"], chamber)
            flows = native.read_flows(built.model, rows["userdata"], chamber)
            described = built.scenario.orthosis.chamber[name]
            air[:, k] = held.mass, held.absolute_pressure, held.volume, flows.inlet, flows.outlet
            ratios = described.inlet.critical_ratio, described.vent.critical_ratio
            parts[:, k, 0] = *ratios, described.wall_conductance
        mass, pressure, volume, inlet, outlet = air
        supply = inputs[:, self.chambers].T + AMBIENT_PRESSURE
        stride.air = AirRows(
            mass, pressure, volume, inlet, outlet, supply, parts[0], parts[1], parts[2], step
        )
        return stride.air

    @property
    def may_jump(self) -> bool:
        """Whether the air is to jump: where it has not settled, and friction has followed the last jump."""
        if sticks(self.built) or self.jumps > JUMPS or not self.chambers:
            return False
        if self.paired and self.air <= AIR and not (self.angle <= ANGLE and self.since_jump > 1):
            return False  # it only has to be confirmed
        return self.since_jump > (1 if self.built.index.frictions else 0)


def sticks(built: Built) -> bool:
    """Whether friction keeps the past: then only that of walking from rest is one, and no air may jump."""
    frictions = {group.type.friction for group in built.scenario.orthosis.muscle.values()} - {"none"}
    return any(FRICTIONS[friction].sticks for friction in frictions)


def remembers(built: Built, control: np.ndarray) -> bool:
    """Whether more goes on between strides than chambers' air and ankle, with these inputs (n_step, nu)."""
    driven = bool((control[:, list(built.index.drives.values())] != OFF).any())
    slow = sticks(built) or bool(built.index.frictions)
    return beyond_chambers(built.scenario) or slow or driven


def _step(slopes: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Step of Newton's method in ln m and ln σ (n,): (1 − slopes) step = change."""
    return np.linalg.lstsq(np.eye(len(change)) - slopes, change, rcond=STILL)[0]


def _bounded(slopes: np.ndarray, change: np.ndarray) -> np.ndarray:
    """The same, by at most `LARGEST`."""
    step = _step(slopes, change)
    if step @ change >= 0.0:
        return step * min(1.0, LARGEST / max(float(np.max(np.abs(step))), LARGEST))
    ratio = np.exp(change)
    step = np.linalg.lstsq(np.eye(len(change)) - ratio[:, np.newaxis] * slopes, ratio - 1.0, rcond=STILL)[0]
    low, high = math.expm1(-LARGEST), math.expm1(LARGEST)
    found: np.ndarray = np.log1p(step * min(1.0, low / min(step.min(), low), high / max(step.max(), high)))
    return found
