"""A separate computation of a foot that walks on a floor registered to its recording: differential equations.

Of the program are numbers: masses, points, parameters, recorded samples, and what the patient's muscles give.
Points x + i z of the plane turn toe up by e^{iα}. States: the leg's sink, ankle and toes, each with its rate.
"""

from dataclasses import dataclass, replace

import numpy as np
from laws_of_nature.own_length_case import device_of, size_of
from laws_of_nature.own_length_reference import Device, Surroundings
from laws_of_nature.patient_case import shank_of
from laws_of_nature.toe_case import Stride, sole_of, stack_of
from laws_of_nature.toe_reference import GRAVITY, Point, Sole, rest_extension, series, smoothed
from scipy.integrate import solve_ivp

from afo_sim.description import Ground
from afo_sim.model import Built

PHASE = np.linspace(0.0, 1.0, 20_001)  # of the tables
STANDS, LATE = 0.05, 0.9  # force of stance [body weights]; phase from which on it is the next one's
LEAVES, COMES = 0.15, 0.1  # phases in which the ankle goes back to its recorded path, and comes from it
SHARP = 20  # harmonics of that movement
NEAR, FAR, RAMP, LEAST = 0.003, 0.010, 0.02, 0.1  # [m], [m], [s], share of a pad's force
SAME = 1e-5  # of states at both ends of a settled stride
Motion = tuple  # of an angle [rad] or place [m]: itself, rate and acceleration


@dataclass(frozen=True, eq=False)
class Recorded:
    """A stride of `time` [s] on this leg: samples of angles [rad], the ankle's place, force [weights].

    lift is a series of how far the ankle is raised beside its samples [m].
    """

    time: float
    harmonics: int
    samples: dict[str, np.ndarray]
    lift: tuple[np.ndarray, np.ndarray] = (np.zeros(1), np.zeros(1))

    def closed(self, name: str) -> np.ndarray:
        """Samples without their drift."""
        values = self.samples[name]
        return values - (values[-1] - values[0]) * (self.samples["phase"] - 0.5)

    def at(self, name: str, phase: np.ndarray) -> Motion:
        """The signal's harmonics and two derivatives by time."""
        parts = [smoothed(self.closed(name)[:-1], self.harmonics)]
        parts += [self.lift] if name == "height" else []
        return tuple(sum(series(w, phase, k) for w in parts) / self.time**k for k in range(3))

    def force(self) -> list[np.ndarray]:
        """At PHASE, straight between samples: forward, upward, and where it is ahead of the ankle."""
        phase, known = self.samples["phase"], np.isfinite(self.samples["place"])
        place = np.interp(PHASE, phase[known], self.samples["place"][known], period=1.0)
        return [*(np.interp(PHASE, phase, self.samples[name]) for name in ("forward", "upward")), place]


def fitted(built: Built, sole: Sole) -> Recorded:
    """The recorded stride, its ankle moved along the shank until heel or ball of the flat foot stand."""
    stride, gait = Stride.of(built), built.scenario.gait
    read, taller = stride.recorded, stride.taller
    assert read.walker == "healthy"
    columns = {"phase": read.phase, "lean": read.shank_angle, "knee": read.knee_angle}
    columns |= {"ankle": read.ankle_angle + sole.level + gait.ankle_offset}
    columns |= {"way": taller * read.ankle_x, "height": taller * read.ankle_z, "place": taller * read.cop_x}
    columns |= {"forward": read.grf_x, "upward": read.grf_z}
    found, flat = Recorded(stride.time, read.harmonics, columns), read.flat.holds(read.phase)
    lean, ankle, height = (found.closed(name)[flat] for name in ("lean", "ankle", "height"))
    low = sole.heights(height, ankle - lean, 0.0 * lean)
    thicker = stack_of(built) - taller * (gait.sole_thickness or read.sole_thickness or 0.0)
    along = -(np.minimum(low["heel"], low["ball"]).mean() + thicker) / np.cos(lean).mean()
    ahead, above = along * np.sin(read.shank_angle), along * np.cos(read.shank_angle) + thicker
    new = {"way": columns["way"] + ahead, "height": columns["height"] + above}
    return replace(found, samples=columns | new | {"place": columns["place"] - ahead})


def laid(walk: Recorded, sole: Sole, rest: np.ndarray) -> Recorded:
    """The same with the sole's lowest point on the floor in stance; the force keeps its moment."""
    phase, forward, upward = (walk.samples[name] for name in ("phase", "forward", "upward"))
    lean, ankle, height = (walk.at(name, phase)[0] for name in ("lean", "ankle", "height"))
    low = np.min(list(sole.heights(height, ankle - lean, rest).values()), axis=0)
    loaded = np.flatnonzero((upward > STANDS) & (phase < LATE))
    (on, off), (first, last) = phase[loaded[[0, -1]]], low[loaded[[0, -1]]]
    # after toe-off what is left of the last height, before heel strike what comes of the first
    s = np.clip([(phase - off) / LEAVES, (phase - on - 1.0 + COMES) / COMES], 0.0, 1.0)
    left, come = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    early = np.clip((phase - on + COMES) / COMES, 0.0, 1.0)
    come = np.where(phase < on, early**3 * (10.0 - 15.0 * early + 6.0 * early**2), come)
    away = np.where(phase < on, first * come, np.where(phase > off, last * (1.0 - left) + first * come, low))
    lift = smoothed(-away[:-1], SHARP)
    slope = np.divide(forward, upward, out=np.zeros_like(low), where=upward > STANDS)
    place = walk.samples["place"] - series(lift, phase) * slope
    return replace(walk, lift=lift, samples=walk.samples | {"place": place})


def borne(place: np.ndarray, ahead: np.ndarray, height: np.ndarray, taller: float) -> np.ndarray:
    """Shares of the force on pads: of a beam from heel to ball or ball to pulp, less on one high up."""
    found = np.zeros_like(ahead)
    for back, on in ((0, place < ahead[1]), (1, place >= ahead[1])):
        lever, high = ahead[back : back + 2, on], height[back : back + 2, on]
        front = np.clip((place[on] - lever[0]) / (lever[1] - lever[0]), 0.0, 1.0)
        beam, over = np.array([1.0 - front, front]), high - np.maximum(high[::-1], 0.0)
        up = np.clip((over / taller - NEAR) / (FAR - NEAR), 0.0, 1.0)
        given = beam * up**2 * (3.0 - 2.0 * up)
        found[back : back + 2, on] = beam - given + given[::-1]
    return found


def near_load(over: np.ndarray, ramp: float) -> np.ndarray:
    """1 where a load is over its least, and a half wave to 0 within a ramp [phase] beside (n_pad, n)."""
    found = np.zeros_like(over)
    for pad, load in enumerate(over):
        at = np.flatnonzero((load[1:] > 0.0) != (load[:-1] > 0.0))
        edges = PHASE[at] + load[at] / (load[at] - load[at + 1]) * PHASE[1]
        away = np.abs(PHASE[:, None] - np.concatenate([edges - 1.0, edges, edges + 1.0, [9.0]])).min(axis=1)
        found[pad] = 0.5 + 0.5 * np.cos(np.pi * np.where(load > 0.0, 0.0, np.minimum(away / ramp, 1.0)))
    return found


def swung(point: Point, turn: Motion) -> np.ndarray:
    """Acceleration of a point that turns about the origin [m/s²]."""
    return complex(*point) * np.exp(1j * turn[0]) * (1j * turn[2] - turn[1] ** 2)


@dataclass(frozen=True, eq=False)
class Walker:
    """pads: stiffness [N/m], brake [s/m]; leg: stiffness [N/m], damping [N·s/m]; rows at PHASE (n_row, n).

    shank is its mass [kg] and centre from the ankle [m]; start is the recorded posture; `off` is when nothing
    recorded presses any more [s].
    """

    device: Device
    sole: Sole
    shank: tuple[float, complex]
    pads: tuple[float, float]
    leg: tuple[float, float]
    walk: Recorded
    rows: np.ndarray
    start: np.ndarray
    off: float

    @classmethod
    def of(cls, built: Built) -> "Walker":
        """The floor, and all that acts as recorded, from the recorded motion and force."""
        device, sole, (heavier, taller) = device_of(built), sole_of(built), size_of(built)
        toes, patient, ground = device.foot.toes, built.scenario.patient, built.scenario.ground or Ground()
        waves, walk = rest_extension(built.scenario.leg.toes.swing_extension), fitted(built, sole)
        share, stiffer = toes.stiffness / (toes.stiffness + toes.sole_stiffness), heavier / taller
        walk = laid(walk, sole, share * series(waves, walk.samples["phase"]))
        pads = ground.stiffness * stiffer, ground.damping / taller**0.5
        leg = ground.body_stiffness * stiffer, ground.body_damping * stiffer * taller**0.5
        self = cls(device, sole, shank_of(built), pads, leg, walk, *np.empty((2, 0)), 0.0)

        lean, ankle, height, way = (walk.at(name, PHASE) for name in ("lean", "ankle", "height", "way"))
        free = [series(waves, PHASE, k) / walk.time**k for k in range(3)]
        pitch = tuple(a - b for a, b in zip(ankle, lean, strict=True))
        bent = tuple(a + share * b for a, b in zip(pitch, free, strict=True))
        places, far = self.points(pitch[0], bent[0])
        high, speed = height[0] + places.imag, height[1] + places.real * pitch[1] + far.real * share * free[1]
        weight, (forward, upward, place) = built.body_mass * GRAVITY, walk.force()
        pressed = weight * np.maximum(upward, 0.0) * borne(place, places.real, high, taller)
        stood = near_load(pressed - heavier, RAMP * taller**0.5 / walk.time)  # 1 N of the leg's own person
        above, lasting = np.maximum(high, 0.0) * (1.0 - stood), 1.0 - pads[1] * speed
        stiff = pads[0] * np.maximum(lasting, LEAST)
        load = np.maximum(pressed - stiff * above, 0.0)
        bears = load * np.maximum(lasting, 0.0) / np.maximum(lasting, LEAST)

        toe = complex(*toes.centre) * np.exp(1j * bent[0])
        pulled = way[2] + 1j * (height[2] + GRAVITY) + swung(toes.hinge, pitch) + swung(toes.centre, bent)
        flexors = toes.inertia * bent[2] + toes.armature * share * free[2]
        flexors += toes.mass * (toe.conj() * pulled).imag
        flexors -= patient.plantarflexor_strength * np.sum(bears * far.real, axis=0)
        support = self.lift(lean, pitch, bent, height[2]) - bears.sum(axis=0)
        beside = weight * (place * upward + height[0] * forward) - np.sum(bears * places.real, axis=0)
        steps = np.arange(len(built.active.moment)) * built.walk.timestep
        own = (built.active.moment, built.active.stiffness)
        moment, stiffness = (np.interp((1.0 + PHASE) * walk.time, steps, each) for each in own)
        # a moment about the hinge is a shift of its spring's rest
        rest, knee = (free[0] + flexors / toes.stiffness, free[1]), walk.at("knee", PHASE)[0]
        around = lean[0], lean[2], way[2], height[2], knee, moment + beside, stiffness, lean[1], *rest
        rows = np.array([*around, *height[:2], support, *(high - above + pressed / stiff)])
        last = np.flatnonzero(load.any(axis=0) & (PHASE < LATE))[-1]
        start = np.array([0.0, 0.0, ankle[0][0], ankle[1][0], share * free[0][0], share * free[1][0]])
        return replace(self, rows=rows, start=start, off=float(PHASE[last + 1] * walk.time))

    def points(self, pitch: np.ndarray | float, bent: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """The sole's points from the ankle, and those that turn with the toes from the hinge, else 0 [m]."""
        heel, ball, pulp, tip, hinge = (complex(*getattr(self.sole, n)) for n in Sole.__dataclass_fields__)
        far = np.multiply.outer([0.0, 0.0, pulp - hinge, tip - hinge], np.exp(1j * bent))
        return np.multiply.outer([heel, ball, hinge, hinge], np.exp(1j * pitch)) + far, far

    def lift(self, lean: Motion, pitch: Motion, bent: Motion, upward: np.ndarray | float) -> np.ndarray:
        """Upward force that shank, foot and toes need where the ankle's acceleration is `upward` [N]."""
        (shank, at), foot, toes = self.shank, self.device.foot, self.device.foot.toes
        turns = foot.mass * swung(foot.centre, pitch) + shank * swung((at.real, at.imag), [-v for v in lean])
        turns += toes.mass * (swung(toes.hinge, pitch) + swung(toes.centre, bent))
        return (shank + foot.mass + toes.mass) * (upward + GRAVITY) + turns.imag

    def rates(self, time: float, state: np.ndarray, floored: bool) -> list[float]:
        """Of the states; without a floor no pad presses."""
        at = time / self.walk.time % 1.0 * (len(PHASE) - 1)
        k = min(int(at), len(PHASE) - 2)
        row = (self.rows[:, k] + (at - k) * (self.rows[:, k + 1] - self.rows[:, k])).tolist()
        lean, (height, rising, support), toes = (row[0], row[7], row[1]), row[10:13], self.device.foot.toes
        sink, sinking, angle, rate, extension, bending = state.tolist()
        pitch, turning = angle - lean[0], rate - lean[1]
        places, far = self.points(pitch, pitch + extension)
        depth = np.maximum(np.array(row[13:]) - height - sink - places.imag, 0.0) * floored
        speed = rising + sinking + places.real * turning + far.real * bending
        force = self.pads[0] * depth * np.maximum(1.0 - self.pads[1] * speed, 0.0)
        row[8] += float(force @ far.real) / toes.stiffness
        given = support + force.sum() - self.leg[0] * sink - self.leg[1] * sinking

        def short(upward: float) -> np.ndarray:
            """Force that lacks for the leg to sink with an acceleration; those of ankle and toes then."""
            around = Surroundings(*row[:3], row[3] + upward, *row[4:10])
            bend = extension, bending
            spin, unbend = self.device.accelerations(angle, rate, bend, float(force @ places.real), around)
            foot = pitch, turning, spin - lean[2]
            bent = pitch + extension, turning + bending, foot[2] + unbend
            return np.array([self.lift(lean, foot, bent, around.ankle_z) - given, spin, unbend])

        still, unit = short(0.0), short(1.0)  # linear in the acceleration
        upward = still[0] / (still[0] - unit[0])
        spin, unbend = (still + upward * (unit - still))[1:]
        return [sinking, upward, rate, spin, bending, unbend]

    def walked(self, start: np.ndarray, begin: float, *, floored: bool = True) -> np.ndarray:
        """States at the times of PHASE from `begin` [s] to heel strike (6, n)."""
        times = PHASE * self.walk.time
        found = solve_ivp(
            self.rates, (begin, times[-1]), start, "LSODA", times[times >= begin], args=(floored,),
            rtol=1e-6, atol=1e-7, max_step=1e-3,
        )  # fmt: skip
        assert found.success
        return found.y

    def settled(self) -> np.ndarray:
        """States of the stride that repeats (6, n), walked to from the recorded posture."""
        stride = self.walked(self.start, 0.0)
        for _ in range(6):
            if np.abs(stride[:, -1] - stride[:, 0]).max() < SAME:
                return stride
            stride = self.walked(stride[:, -1], 0.0)
        raise ArithmeticError("the stride does not repeat")

    def heights(self, states: np.ndarray) -> dict[str, np.ndarray]:
        """Of the sole's points over the last of the times [m] (n,), and of the lowest as "sole"."""
        lean, height = self.rows[[0, 10], -states.shape[1] :]
        found = self.sole.heights(height + states[0], states[2] - lean, states[4])
        return found | {"sole": np.min(list(found.values()), axis=0)}
