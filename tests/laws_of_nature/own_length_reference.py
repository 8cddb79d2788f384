"""A separate computation of an orthosis whose muscles have their own length: ordinary differential equations.

    found = solve(device, drive, start, times)  # Device, Drive, the states at the first time: a Solution

Nothing here is shared with the program but numbers: the muscle's law, the air, the valves, the passive ankle,
the geometry and the equation of motion are written again, and scipy integrates them. The law is
`tondu_lopez_2000_bladder`; the muscles run between two anchors, without friction.

States: ankle angle θ, its rate ω, then of each group the contraction κ, then of each chamber σ = p_abs V^γ
and the air's mass m, and last, of a foot with toes, their extension and its rate (`toe_reference.py`). Cuff
and plate have no mass: their displacement follows from the tensions.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from air.reference import iso_flow
from laws_of_nature.toe_reference import Toes, accelerations
from scipy.integrate import solve_ivp

GRAVITY, GAS, GAMMA = 9.80665, 287.05, 1.4  # [m/s²], [J/(kg·K)], [-]
AMBIENT, WARMTH = 101_325.0, 293.15  # absolute [Pa], [K]
SPREAD = 5e-4  # stretch over which a negative law fades out
BLEND = 5e-3  # stretch over which the braid's stiffness sets in
FADING = 1e5  # gauge pressure at which the return force has faded out [Pa]
DEGREE = math.pi / 180.0
TINY = 1e-12  # beside a jump [s]


@dataclass(frozen=True)
class Muscle:
    """`count` alike parallel muscles. Points are (x, z) in the axes of shank and foot from the ankle [m]."""

    count: int
    chamber: int
    origin: tuple[float, float]
    insertion: tuple[float, float]
    series: float  # ends, link, slack and offset [m]
    cable: float  # stiffness [N/m]
    length: float  # L0 [m]
    radius: float  # r0 [m]
    angle: float  # α0 [rad]
    end_correction: float  # k [-]
    bladder_force: float  # [N]
    bladder_stiffness: float  # [N]
    lowest: float  # gauge pressure of the law's range [Pa]
    return_stiffness: float  # [N]
    damping: float  # R [m²·s]
    braid: float  # stiffness [N]
    dead: float  # volume [m³]

    @cached_property
    def area(self) -> float:
        """Of the braid's cross section at rest [m²]."""
        return math.pi * self.radius**2

    @cached_property
    def b(self) -> float:
        """1/sin²α0 [-]."""
        return 1.0 / math.sin(self.angle) ** 2

    @cached_property
    def full(self) -> float:
        """Volume of the cylinder at rest [m³]."""
        return self.area * self.length

    def volume(self, contraction: float) -> float:
        """Of the air in one muscle [m³]: a cylinder of the braid's length and diameter."""
        x = 1.0 - contraction
        return self.dead + max(self.full * x * (self.b - (self.b - 1.0) * x * x), 0.05 * self.full)

    def is_free(self, contraction: float) -> bool:
        """Whether the braid is not so near its lock that the program has another volume."""
        return self.volume(contraction) > self.dead + 0.1 * self.full

    def swelling(self, contraction: float) -> float:
        """dV/dκ of one muscle [m³]."""
        x = 1.0 - contraction
        return self.full * (3.0 * (self.b - 1.0) * x * x - self.b)

    def law(self, contraction: float, pressure: float) -> float:
        """Tondu & Lopez less the bladder, signed, at κ ≥ 0 and p ≥ 0 [N]."""
        x = 1.0 - self.end_correction * contraction
        shape = 3.0 * (self.b - 1.0) * x * x - self.b
        bladder = self.bladder_force + self.bladder_stiffness * contraction
        force = self.area * pressure * shape - bladder
        if pressure < self.lowest:
            return min(force, (self.area * self.lowest * shape - bladder) * pressure / self.lowest)
        return force

    def spring(self, contraction: float, pressure: float) -> float:
        """All that one muscle pulls with at rest, signed, at any κ and gauge pressure [N]."""
        pressure = max(pressure, 0.0)
        back = -self.return_stiffness * contraction * max(0.0, 1.0 - pressure / FADING)
        if contraction >= 0.0:
            return self.law(contraction, pressure) + back
        law = self.law(0.0, pressure)
        work = pressure * (self.swelling(contraction) - self.swelling(0.0)) / self.length
        pressed = max(law, 0.0) + work - max(-law, 0.0) * max(0.0, 1.0 + contraction / SPREAD)
        stretch = -contraction
        if stretch < BLEND:
            return pressed + back + self.braid * stretch * stretch / (2.0 * BLEND)
        return pressed + back + self.braid * (stretch - 0.5 * BLEND)

    def path(self, angle: float) -> tuple[float, float]:
        """Length from origin to insertion and its moment arm −dx/dθ [m]."""
        cosine, sine = math.cos(angle), math.sin(angle)
        x, z = self.insertion
        foot = (x * cosine - z * sine, x * sine + z * cosine)
        away = (foot[0] - self.origin[0], foot[1] - self.origin[1])
        length = math.hypot(*away)
        return length, (away[0] * foot[1] - away[1] * foot[0]) / length


@dataclass(frozen=True)
class Valve:
    """Sonic conductance [m³/(s·Pa)], critical ratio, delays [s]."""

    conductance: float
    critical: float
    opening: float
    closing: float

    def flow(self, upstream: float, downstream: float, warmth: float) -> float:
        """Mass flow of the open valve from the higher absolute pressure to the lower, ISO 6358 [kg/s]."""
        return iso_flow(upstream, warmth, downstream, warmth, self.conductance, self.critical)

    def travels(self, on: Sequence[tuple[float, float]], end: float) -> Iterator[tuple[float, bool]]:
        """Times [s] up to `end` at which the seat opens (True) or shuts, from the coil's intervals.

        The armature leaves the shut seat at time 0, travels at 1/delay and back, and the seat follows it
        when it arrives.
        """
        place, seat, clock = 0.0, False, 0.0
        switches = [(time, coil) for pair in on for time, coil in zip(pair, (True, False), strict=True)]
        coil = False
        for time, after in [*switches, (end, False)]:
            delay = self.opening if coil else self.closing
            left = (1.0 - place if coil else place) * delay
            if clock + left <= time and seat is not coil:
                seat = coil
                yield clock + left, seat
            moved = min(left, time - clock)
            place += (moved / delay if delay > 0.0 else 1.0) * (1.0 if coil else -1.0)
            place, clock, coil = min(max(place, 0.0), 1.0), time, after


@dataclass(frozen=True)
class Chamber:
    """Air of some muscles. Tube [m³], heat conductance of the wall [W/K]."""

    name: str
    tube: float
    wall: float
    inlet: Valve
    outlet: Valve


@dataclass(frozen=True)
class Anchor:
    """Cuff or plate: P = k z where a stiffness [N/m] is told, or else P = a (e^(z/x0) − 1)."""

    stiffness: float = 0.0
    force: float = 0.0  # a [N]
    scale: float = 0.0  # x0 [m]

    def displacement(self, pull: float) -> tuple[float, float]:
        """Displacement z [m] under a pull [N], and dz/dP [m/N]."""
        if self.stiffness > 0.0:
            return pull / self.stiffness, 1.0 / self.stiffness
        return self.scale * math.log1p(pull / self.force), self.scale / (pull + self.force)


@dataclass(frozen=True)
class Foot:
    """All that turns about the ankle: mass [kg], centre (x, z) [m], inertia about the ankle [kg·m²], tissue.

    With `toes` on a hinge, mass, centre and inertia are of the hindfoot alone. `armature` [kg·m²] turns with
    the ankle's angle, not with the foot in space; damping [N·m·s/rad]; `scale` and `offset` [rad] of the
    passive moment; `load` against dorsiflexion [N·m].
    """

    mass: float
    centre: tuple[float, float]
    inertia: float
    armature: float
    damping: float
    scale: float
    offset: float
    load: float
    stops: tuple[float, float]
    toes: Toes | None = None

    def passive(self, angle: float, knee: float) -> float:
        """Moment of relaxed tissue, Riener & Edrich 1999, linear outside −40…20° [N·m]."""
        a, k = (angle - self.offset) / DEGREE, knee / DEGREE
        inside = min(max(a, -40.0), 20.0)
        first = math.exp(-7.9763 - 0.1949 * inside + 0.0008 * k)
        second = math.exp(2.1016 + 0.0843 * inside - 0.0176 * k)
        beyond = (a - inside) * (-0.1949 * first - 0.0843 * second)
        return self.scale * (first - second + 1.792 + beyond)


@dataclass(frozen=True)
class Surroundings:
    """What comes from outside at one moment: the shank's motion and the moments on the ankle.

    Shank angle [rad], its acceleration [rad/s²], acceleration of the ankle point (x, z) [m/s²], knee angle
    [rad], moment on the foot [N·m], stiffness about angle zero [N·m/rad], the shank's rate [rad/s], rest
    extension of the toes [rad] and its rate [rad/s].
    """

    shank: float
    shank_acceleration: float
    ankle_x: float
    ankle_z: float
    knee: float
    moment: float
    stiffness: float
    shank_rate: float = 0.0
    toe_rest: float = 0.0
    toe_rest_rate: float = 0.0


@dataclass(frozen=True)
class Device:
    """Muscles, chambers, anchors and foot; supply absolute [Pa]; `reflex` of spasticity [N·m·s/rad]."""

    muscles: tuple[Muscle, ...]
    chambers: tuple[Chamber, ...]
    anchors: tuple[Anchor, ...]
    foot: Foot
    supply: float
    reflex: float = 0.0

    def tensions(self, angle: float, contractions: Sequence[float]) -> tuple[list[float], list[float], float]:
        """Tension of one muscle of each group [N], its moment arm [m], and what the anchors give way [m]."""
        reach, arms = [], []
        for muscle, contraction in zip(self.muscles, contractions, strict=True):
            length, arm = muscle.path(angle)
            reach.append(length - muscle.series - muscle.length * (1.0 - contraction))
            arms.append(arm)
        given = self.given_way(reach) if self.anchors else 0.0
        pulls = [m.cable * max(e - given, 0.0) for m, e in zip(self.muscles, reach, strict=True)]
        return pulls, arms, given

    def given_way(self, reach: Sequence[float]) -> float:
        """Z where the anchors hold what the cables pull: Z = Σ z_a(P), P = Σ n k (reach − Z)⁺ [m]."""
        low, high = 0.0, max(*reach, 0.0)
        z = low
        while high - low > 1e-15:
            taut = [(m.count * m.cable, e - z) for m, e in zip(self.muscles, reach, strict=True) if e > z]
            pull, stiffness = sum(k * e for k, e in taut), sum(k for k, _ in taut)
            parts = [anchor.displacement(pull) for anchor in self.anchors]
            excess = z - sum(part for part, _ in parts)
            slope = 1.0 + stiffness * sum(part for _, part in parts)
            low, high = (z, high) if excess <= 0.0 else (low, z)
            step = z - excess / slope
            if abs(step - z) <= 1e-15:
                return step
            z = step if low <= step <= high else 0.5 * (low + high)
        return z

    def volumes(self, contractions: Sequence[float]) -> list[float]:
        """Of the chambers [m³]."""
        total = [chamber.tube for chamber in self.chambers]
        for muscle, contraction in zip(self.muscles, contractions, strict=True):
            total[muscle.chamber] += muscle.count * muscle.volume(contraction)
        return total

    def pressures(self, state: Sequence[float]) -> tuple[list[float], list[float]]:
        """Absolute pressures [Pa] and volumes [m³] of the chambers."""
        n = len(self.muscles)
        volumes = self.volumes(state[2 : 2 + n])
        sigmas = state[2 + n : 2 + n + 2 * len(self.chambers) : 2]
        return [s / v**GAMMA for s, v in zip(sigmas, volumes, strict=True)], volumes

    def rates(self, state: Sequence[float], around: Surroundings, seats: Sequence[bool]) -> list[float]:
        """Of the states; `seats` are inlet and outlet of each chamber in turn."""
        angle, speed = state[:2]
        moment, inside = self.inside(state, seats)
        bending = state[-2:] if self.foot.toes is not None else []
        accelerations = self.accelerations(angle, speed, bending, moment, around)
        rates = [speed, accelerations[0], *inside]
        if bending:
            rates += [bending[1], accelerations[1]]
        return rates

    def inside(self, state: Sequence[float], seats: Sequence[bool]) -> tuple[float, list[float]]:
        """Moment of the muscles about the ankle [N·m], and the rates of contractions and air."""
        n = len(self.muscles)
        pulls, arms, _ = self.tensions(state[0], state[2 : 2 + n])
        pressures, volumes = self.pressures(state)
        moment = sum(m.count * t * arm for m, t, arm in zip(self.muscles, pulls, arms, strict=True))
        rates = []
        for muscle, contraction, pull in zip(self.muscles, state[2 : 2 + n], pulls, strict=True):
            p = pressures[muscle.chamber]
            rates.append((muscle.spring(contraction, p - AMBIENT) - pull) / (muscle.damping * p))
        for j, chamber in enumerate(self.chambers):
            mass = state[2 + n + 2 * j + 1]
            rates += self.air(chamber, pressures[j], volumes[j], mass, seats[2 * j : 2 * j + 2])
        return moment, rates

    def air(
        self, chamber: Chamber, pressure: float, volume: float, mass: float, seats: Sequence[bool]
    ) -> list[float]:
        """Rates of σ and m of one chamber, from the first law and the flows."""
        warmth = pressure * volume / (mass * GAS)
        come = gone = 0.0
        for valve, seat, outside in zip(
            (chamber.inlet, chamber.outlet), seats, (self.supply, AMBIENT), strict=True
        ):
            if seat and outside >= pressure:
                come += valve.flow(outside, pressure, WARMTH)
            elif seat:
                gone += valve.flow(pressure, outside, warmth)
        heat = GAMMA * GAS * (come * WARMTH - gone * warmth) + (GAMMA - 1.0) * chamber.wall * (
            WARMTH - warmth
        )
        return [volume ** (GAMMA - 1.0) * heat, come - gone]

    def accelerations(
        self, angle: float, speed: float, bending: Sequence[float], orthosis: float, around: Surroundings
    ) -> tuple[float, float]:
        """θ̈ and q̈ [rad/s²] of the foot on its shank, the orthosis pulling with a moment [N·m].

        `bending` are extension [rad] and rate [rad/s] of the toes, or nothing of a rigid foot.
        """
        foot = self.foot
        moment = orthosis + around.moment - around.stiffness * angle - foot.load
        moment += foot.passive(angle, around.knee) - foot.damping * speed - self.reflex * max(speed, 0.0)
        if foot.toes is not None:
            return accelerations(foot, foot.toes, (angle, speed), bending, moment, around)
        pitch = angle - around.shank
        x, z = foot.centre
        ahead = x * math.cos(pitch) - z * math.sin(pitch)
        above = x * math.sin(pitch) + z * math.cos(pitch)
        moment += foot.mass * (above * around.ankle_x - ahead * (around.ankle_z + GRAVITY))
        return (moment + foot.inertia * around.shank_acceleration) / (foot.inertia + foot.armature), 0.0


@dataclass(frozen=True)
class Drive:
    """What drives a device: surroundings by time, the valves' events, and times where something jumps [s]."""

    around: Callable[[float], Surroundings]
    events: tuple[tuple[float, int, bool], ...] = ()  # (time, valve, open), valves as `seats` of `rates`
    jumps: tuple[float, ...] = ()


@dataclass(frozen=True)
class Solution:
    """States over time (n, n_state), of a device."""

    device: Device
    time: np.ndarray
    states: np.ndarray
    evaluations: int

    def refuse_what_is_not_written(self) -> None:
        """ArithmeticError where the ankle meets a stop, or a braid its lock."""
        low, high = self.device.foot.stops
        if not (low < self.angle.min() and self.angle.max() < high):
            raise ArithmeticError("the ankle is at a stop")
        for group, muscle in enumerate(self.device.muscles):
            if not muscle.is_free(self.contraction(group).min()):
                raise ArithmeticError("a braid locks")

    @property
    def angle(self) -> np.ndarray:
        """Ankle angle [rad] (n,)."""
        return self.states[:, 0]

    @property
    def extension(self) -> np.ndarray:
        """Of the toes against the foot, of a foot that has toes [rad] (n,)."""
        return self.states[:, -2]

    def contraction(self, group: int) -> np.ndarray:
        """κ of a group [-] (n,)."""
        return self.states[:, 2 + group]

    def mass(self, chamber: int) -> np.ndarray:
        """Air in a chamber [kg] (n,)."""
        return self.states[:, 2 + len(self.device.muscles) + 2 * chamber + 1]

    def pressure(self, chamber: int) -> np.ndarray:
        """Gauge [Pa] (n,)."""
        return (
            np.array([self.device.pressures(state)[0][chamber] for state in self.states.tolist()]) - AMBIENT
        )

    def tension(self, group: int) -> np.ndarray:
        """Of one muscle of a group [N] (n,)."""
        return np.array([pulls[group] for pulls, _, _ in self._tensions])

    def given_way(self) -> np.ndarray:
        """Displacement of all anchors together [m] (n,)."""
        return np.array([given for _, _, given in self._tensions])

    def moment(self) -> np.ndarray:
        """Of all muscles about the ankle, dorsiflexion positive [N·m] (n,)."""
        counts = [muscle.count for muscle in self.device.muscles]
        return np.array(
            [
                sum(n * t * arm for n, t, arm in zip(counts, pulls, arms, strict=True))
                for pulls, arms, _ in self._tensions
            ]
        )

    @property
    def _tensions(self) -> list[tuple[list[float], list[float], float]]:
        n = len(self.device.muscles)
        return [self.device.tensions(state[0], state[2 : 2 + n]) for state in self.states.tolist()]


def solve(
    device: Device,
    drive: Drive,
    start: Sequence[float],
    time: np.ndarray,
    method: str = "LSODA",
    rtol: float = 1e-8,
) -> Solution:
    """Integrate from `start`, which stands at the first of the times [s], and give the states at all of them.

    The integration begins anew at every event and jump, so that no step runs across one.
    """
    n_valve = 2 * len(device.chambers)
    seats = [False] * n_valve
    for _, valve, opened in (event for event in drive.events if event[0] <= time[0]):
        seats[valve] = opened
    later = [event for event in drive.events if time[0] < event[0] < time[-1]]
    jumps = [jump for jump in drive.jumps if time[0] < jump < time[-1]]
    edges = sorted({float(time[0]), *(event[0] for event in later), *jumps, float(time[-1])})
    size = np.array([1.0, 10.0, *[1.0] * len(device.muscles), *[1.0, 1e-3] * len(device.chambers)])
    if device.foot.toes is not None:
        size = np.append(size, [1.0, 10.0])
    state, states, evaluations = np.array(start, dtype=float), [np.array(start, dtype=float)[None]], 0
    for low, high in itertools.pairwise(edges):
        inside = time[(time > low) & (time <= high)]
        asked = np.unique(np.append(inside, high))
        found = solve_ivp(
            lambda t, y, low=low + TINY, high=high - TINY: device.rates(
                y.tolist(), drive.around(min(max(t, low), high)), seats
            ),
            (low, high),
            state,
            method=method,
            t_eval=asked,
            rtol=rtol,
            atol=0.1 * rtol * size,
        )
        if not found.success:
            raise ArithmeticError(f"{method} stopped at {found.t[-1]} s: {found.message}")
        state, evaluations = found.y[:, -1], evaluations + found.nfev
        states.append(found.y.T[: len(inside)])
        for _, valve, opened in (event for event in later if event[0] == high):
            seats[valve] = opened
    solution = Solution(device, time, np.concatenate(states), evaluations)
    solution.refuse_what_is_not_written()
    return solution
