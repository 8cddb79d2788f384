"""A walker whose every number is known: legs, pelvis and trunk in space, forces, ankle moments.

The world is OpenSim's: x forward, y up, z to the walker's right. The legs move in sagittal planes, the feet
as those of the known walk of `walking`, the left one half a stride later. The pelvis turns and lists so that
both hip centres lie on it. The walker obeys Newton: the plates' whole force is the mass times gravity and the
acceleration of the centre of mass, about which pelvis and trunk sway by millimetres. Nothing here uses
`afo_sim.gait_lab.trial`.
"""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from walking import SHANK, THIGH, TILT, Walk, known_walk

from afo_sim.common import GRAVITY

SIDES = ("right", "left")
SIGN = {"right": 1.0, "left": -1.0}  # of z

HIP_Z, KNEE_Z, ANKLE_Z = 0.085, 0.075, 0.065  # half distances of the joint centres [m]
# Harrington et al. 2007, one-variable regressions, solved for the distances: the hip centre is exact.
PELVIS_DEPTH = 0.160  # between the markers' midpoints, PSIS to ASIS [m]
PELVIS_WIDTH = (1e3 * HIP_Z - 7.3) / 0.33 / 1e3  # between the ASIS [m]
HIP = (-0.24 * PELVIS_DEPTH - 0.0099, -0.30 * PELVIS_WIDTH - 0.0109)  # from mid-ASIS: forward, up [m]

SOLE = 0.07  # of the ankle centre above the flat sole [m]
MTP = np.array([0.135, -0.055, 0.0])  # from the ankle, in the foot's frame [m]
HEEL_END, TOE_END = -0.06, 0.19  # of the sole, ahead of the ankle [m]
# Winter 2009, table 4.1: foot 0.0145 of the body's mass, radius of gyration about its centre 0.475 of its
# length.
FOOT_MASS, FOOT_GYRATION = 0.0145, 0.475 * (TOE_END - HEEL_END)
FOOT_CENTRE = np.array([0.05, -0.035, 0.0])  # assumed [m]
INWARD = 0.05  # force toward the other leg, share of the upward one, assumed
LEAST = 0.0075  # of the recorded force: below it there is none, and by it there is less [body weights]
PELVIS_SHARE = 0.25  # of the mass of pelvis and trunk that the pelvis has, assumed
SWAY = 0.3  # of what the recorded hips leave the centre of mass by, that this walker's do, assumed
STRAIGHT = np.radians(4.0)  # least flexion of the knee, for which the hips go lower
TRUNK_UP = 0.30  # of the trunk's centre above the hips' middle [m]
WHOLE = np.linspace(0.0, 1.0, 1001)[:-1]  # phases of a stride
KNOTS = 0.0025  # of the courses that are differentiated, as parts of a stride
KNOWN = (-3.0, 15.0)  # strides from `start` on that the walker knows
# Strides differ, so far from stride to stride as healthy adults' do: 2 % of the time, 1 to 2 cm of the length
# (Hausdorff 2005; Owings, Grabiner 2004), likewise the way of the foot through the air.
LENGTH_VARIES, HEIGHT_VARIES, PITCH_VARIES = 0.008, 0.004, np.radians(1.5)  # SD [m, m, rad]
TIME_VARIES = 0.007  # SD of a heel strike from the even one [s]


@dataclass(frozen=True)
class Walker:
    """Strides without end, the right foot's first at about `start` [s]; SI, angles in rad.

    `seed` makes each stride another, None all alike. `slower` and `size` make the walk of another body: the
    same ways over the body's size in another time, so that the force's swing goes with `size / slower**2`.
    """

    mass: float = 67.2
    toe_out: float = np.radians(7.0)  # of the feet
    start: float = 0.4
    way: float = 0.3  # the right ankle's x at its first heel strike [m]
    slower: float = 1.0  # factor of the stride's time
    size: float = 1.0  # factor of every length
    seed: int | None = 1
    uneven: float = 1.0  # factor of what strides differ by
    gait: str = "gatk_stride1"  # shipped cycle that moves the feet
    left_strike: float = 0.5  # of the right foot's stride [-]
    calm: float = 0.84  # of the trunk's rise and fall that the centre of mass has; legs move less (measured)

    @cached_property
    def walk(self) -> Walk:
        return known_walk(self.gait)

    @property
    def stride_time(self) -> float:
        """Mean over the strides [s]."""
        return self.walk.cycle.stride_time * self.slower

    @cached_property
    def stride_length(self) -> float:
        """Mean over the strides [m]."""
        first, last = self.walk.cycle.signal("ankle_x", np.array([0.0, 1.0]))
        return self.size * (float(last - first) - self._creep[0])

    @property
    def speed(self) -> float:
        return self.stride_length / self.stride_time

    @cached_property
    def _lift(self) -> float:
        """From the known walk's ankle to one that is `SOLE` above the floor with the foot flat [m]."""
        phase = np.linspace(self.walk.cycle.flat.start, self.walk.cycle.flat.end, 41)
        return SOLE - float(self.walk.cycle.signal("ankle_z", phase).mean())

    @cached_property
    def _creep(self) -> tuple[float, Any]:
        """How the recorded foot creeps over the floor: per stride [m], and a periodic rest over phase [m].

        The known walk's foot gains 5 cm a stride while it stands (its belt was slower than stated). This
        walker's heel stands from heel strike on, its ball until toe-off.
        """
        cycle = self.walk.cycle
        early, late = np.arange(0.0, 0.08, 0.02), np.arange(0.08, 0.58, 0.02)
        phase = np.r_[early, late]
        pitch = cycle.signal("ankle_angle", phase) - cycle.signal("shank_angle", phase)
        ankle = cycle.signal("ankle_x", phase)
        ball = ankle + MTP[0] * np.cos(pitch) - MTP[1] * np.sin(pitch)
        heel = ankle + HEEL_END * np.cos(pitch) + SOLE * np.sin(pitch)
        slid = np.where(phase < 0.079, heel - heel[4] + ball[4], ball)
        slope = float(np.polyfit(late, ball[4:], 1)[0])
        rest = slid - slope * phase
        rest -= rest[4:].mean()
        place, value = np.r_[phase, 0.72, 0.80, 0.88, 1.0], np.r_[rest, 0.0, 0.0, 0.0, rest[0]]
        return slope, CubicSpline(place, value, bc_type="periodic")

    @cached_property
    def _heel(self) -> float:
        """Point of the sole that presses while the foot rolls over its heel, ahead of the ankle [m]."""
        phase = np.arange(0.02, 0.07, 0.01)
        pitch = self.recorded("right", "ankle", phase) - self.recorded("right", "shank", phase)
        ahead = self.walk.cycle.ground(phase)[2]
        return float(np.mean((ahead - SOLE * np.sin(pitch)) / np.cos(pitch)))

    @cached_property
    def _load(self) -> float:
        """Factor of the force, so that two feet carry the weight over a stride."""
        phase = np.linspace(0.0, 1.0, 20_001)[:-1]
        return 0.5 / float(self.walk.cycle.ground(phase)[1].mean())

    # ---- how strides differ ------------------------------------------------------------------------------

    @cached_property
    def _varied(self) -> dict[str, np.ndarray]:
        """Of each contact of the right foot, then of the left one: length, height, pitch; a wave of time."""
        count = int(KNOWN[1] - KNOWN[0]) + 2
        if self.seed is None:
            return {"length": np.zeros((2, count)), "height": np.zeros((2, count)),
                    "pitch": np.zeros((2, count)), "wave": np.zeros((2, 4))}  # fmt: skip
        rng, far = np.random.default_rng(self.seed), self.uneven * self.size
        return {
            "length": far * LENGTH_VARIES * _bounded(rng, (2, count)),
            "height": far * HEIGHT_VARIES * _bounded(rng, (2, count)),
            "pitch": self.uneven * PITCH_VARIES * _bounded(rng, (2, count)),
            "wave": np.array(
                [self.uneven * rng.normal(0.0, TIME_VARIES / 2.0, 4), rng.uniform(0.0, 2.0 * np.pi, 4)]
            ),
        }

    def phase(self, side: str, time: np.ndarray) -> np.ndarray:
        """Strides since `start`, of this foot (n,) [-]."""
        even = (time - self.start) / self.stride_time
        size, late = self._varied["wave"]
        slow = 2.0 * np.pi / np.array([2.3, 3.1, 4.7, 7.3])  # per stride: waves that do not repeat
        even = even + np.sin(np.multiply.outer(even, slow) + late) @ size / self.stride_time
        return even - (0.0 if side == "right" else self.left_strike)

    def _of_contact(self, name: str, side: str, phase: np.ndarray, offset: int = 0) -> np.ndarray:
        number = np.clip(np.floor(phase).astype(int) - int(KNOWN[0]) + 1 + offset, 0, None)
        values = self._varied[name][SIDES.index(side)]
        return values[np.minimum(number, len(values) - 1)]

    # ---- motion ------------------------------------------------------------------------------------------

    def angle(self, side: str, name: str, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        """shank (knee ahead), knee (flexion), ankle (dorsiflexion), pitch (toe up), mtp (up) [rad] (n,)."""
        if name == "mtp":  # toes bent up about toe-off
            return np.radians(30.0) * np.exp(-(((self.phase(side, time) % 1.0 - 0.58) / 0.07) ** 2))
        if name == "ankle":
            return self.angle(side, "pitch", time, derivative) + self.angle(side, "shank", time, derivative)
        return self._course(side)(time, derivative)[:, ("pitch", "x", "y", "shank", "knee").index(name)]

    def ankle_plane(self, side: str, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Forward and up [m, m/s, m/s²] (n, 2)."""
        return np.asarray(self._course(side)(time, derivative)[:, 1:3])

    def _course(self, side: str) -> CubicSpline:
        """Pitch, ankle forward and up, shank, knee over time."""
        return self._courses[side]

    @cached_property
    def _time(self) -> np.ndarray:
        """Knots of the courses [s]."""
        return self.start + self.stride_time * np.arange(*KNOWN, KNOTS)

    @cached_property
    def _courses(self) -> dict[str, CubicSpline]:
        time, found = self._time, {}
        middle = self._hips(time)
        recorded = {side: self._recorded_leg(side, self.phase(side, time)) for side in SIDES}
        hips = {side: _hip(*leg) for side, leg in recorded.items()}
        moved = middle - 0.5 * (hips["right"] + hips["left"])
        legs = {side: hips[side] + moved - leg[1] for side, leg in recorded.items()}
        high = np.sqrt(_length(STRAIGHT) ** 2 - np.array([leg[:, 0] for leg in legs.values()]) ** 2)
        lower = max(0.0, float((np.array([leg[:, 1] for leg in legs.values()]) - high).max()))
        for side, (pitch, ankle, _, _) in recorded.items():
            shank, knee = _reach(legs[side] - [0.0, lower])
            found[side] = CubicSpline(time, np.column_stack([pitch, self.size * ankle, shank, knee]))
        return found

    def recorded(self, side: str, name: str, phase: np.ndarray) -> np.ndarray:
        """shank, knee, ankle of the known walk's leg, which moves this walker's foot [rad]."""
        return self.walk.cycle.signal(f"{name}_angle", phase)

    def raised(self) -> float:
        """Of the ankle above its place with the foot flat [m]."""
        return 0.0

    def _recorded_leg(self, side: str, phase: np.ndarray) -> tuple[np.ndarray, ...]:
        """Pitch, ankle (n, 2), shank, knee at the size of the known walk."""
        shank, knee, ankle = (self.recorded(side, name, phase) for name in ("shank", "knee", "ankle"))
        cycle, (slope, rest) = self.walk.cycle, self._creep
        plane = np.column_stack([cycle.signal(f"ankle_{a}", phase) for a in "xz"])
        ahead = 0.0 if side == "right" else self.left_strike * self.stride_length / self.size
        plane += [self.way / self.size + ahead, self._lift + self.raised()]
        plane[:, 0] -= rest(phase % 1.0) + slope * phase
        swing = np.clip((phase % 1.0 - 0.62) / 0.36, 0.0, 1.0)
        before, after = (self._of_contact("length", side, phase, k) for k in (0, 1))
        plane[:, 0] += (before + (after - before) * _step(swing)) / self.size
        hump = np.sin(np.pi * swing) ** 4
        plane[:, 1] += self._of_contact("height", side, phase) * hump / self.size
        pitch = ankle - shank + self._of_contact("pitch", side, phase) * hump
        if not self.raised():  # a foot that lands on its heel rolls about where it presses
            rolls = SOLE * np.cos(pitch) - self._heel * np.sin(pitch)
            share = _step(np.clip(((phase + 0.5) % 1.0 - 0.42) / 0.08, 0.0, 1.0))
            share *= 1.0 - _step(np.clip(((phase + 0.5) % 1.0 - 0.57) / 0.06, 0.0, 1.0))
            plane[:, 1] += share * (rolls - plane[:, 1])
        return pitch, plane, shank, knee

    # ---- the body ----------------------------------------------------------------------------------------

    @cached_property
    def _swing_of_mass(self) -> tuple[CubicSpline, CubicSpline]:
        """Over a stride of the known walk, periodic: centre of mass (3), hips' middle (2) from its mean [m].

        The centre of mass is the whole force's, integrated twice.
        """
        cycle, count = self.walk.cycle, 4000
        phase = np.arange(count) / count
        weights, middle = np.zeros((count, 3)), np.zeros((count, 2))
        for side in SIDES:  # whoever limps keeps the even swing of the mass
            forward, upward, _ = cycle.ground(phase - (0.0 if side == "right" else 0.5))
            weights += np.column_stack([forward, upward, -SIGN[side] * INWARD * upward])
            own = phase - (0.0 if side == "right" else self.left_strike)
            middle += 0.5 * _hip(*self._plain._recorded_leg(side, own))
        series = np.fft.rfft(GRAVITY * self._load * weights, axis=0)
        order = np.arange(len(series))[:, None]
        series[1:] /= -((2.0 * np.pi * order[1:] / cycle.stride_time) ** 2)
        series[0] = 0.0
        centre = self._share * np.fft.irfft(series, count, axis=0)
        middle[:, 0] -= phase * self.stride_length / self.size
        closed = np.r_[phase, 1.0]
        return tuple(CubicSpline(closed, np.vstack([x, x[:1]]), bc_type="periodic") for x in (centre, middle))

    @property
    def _share(self) -> float:
        """Of the centre of mass's ways, by what the steps are shorter."""
        return 1.0

    @cached_property
    def _plain(self) -> "Walker":
        """The same with strides all alike."""
        return dataclasses.replace(self, seed=None)

    def _placed(self, phase: np.ndarray) -> np.ndarray:
        """How far ahead the body is since its steps were longer: a smooth mean over some contacts [m]."""
        if self.seed is None:
            return np.zeros_like(phase)
        total, weights = np.zeros_like(phase), np.zeros_like(phase)
        for side, lengths in zip(SIDES, self._varied["length"], strict=True):
            late = 0.3 + (0.0 if side == "right" else self.left_strike)
            for k, length in enumerate(lengths):
                weight = np.exp(-(((phase - (k - 1 + KNOWN[0] + late)) / 0.4) ** 2))
                total, weights = total + weight * length, weights + weight
        return total / weights

    @cached_property
    def _mass_course(self) -> CubicSpline:
        phase = self.phase("right", self._time)
        centre, middle = self._swing_of_mass
        course = self.size * centre(phase % 1.0)
        course[:, :2] += self.size * middle(WHOLE).mean(axis=0)
        course[:, 0] += self.stride_length * phase + self._placed(phase)
        return CubicSpline(self._time, course)

    def mass_centre(self, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        """The body's: forward, up from an unknown height, right [m, m/s, m/s²] (n, 3).

        Hips and trunk stay by it within millimetres, but that they rise and fall by more and that the hips do
        not sway aside.
        """
        return np.asarray(self._mass_course(time, derivative))

    def _body(self, time: np.ndarray) -> np.ndarray:
        """The centre of mass, but rising and falling as pelvis and trunk do (n, 3) [m]."""
        course = self.mass_centre(time)
        middle = self.size * self._swing_of_mass[1](WHOLE).mean(axis=0)[1]
        course[:, 1] = middle + (course[:, 1] - middle) / self.calm
        return course

    def _off(self, time: np.ndarray) -> np.ndarray:
        """The hips' middle from the centre of mass, forward and up (n, 2) [m]."""
        centre, middle = self._swing_of_mass
        phase = self.phase("right", time) % 1.0
        return self.size * SWAY * (middle(phase) - middle(WHOLE).mean(axis=0) - centre(phase)[:, :2])

    def _hips(self, time: np.ndarray) -> np.ndarray:
        """Middle of the hips in the plane, at the known walk's size (n, 2) [m]."""
        return (self._body(time)[:, :2] + self._off(time)) / self.size

    def _trunk(self, time: np.ndarray) -> np.ndarray:
        """Centre of the trunk above the pelvis (n, 3) [m]."""
        centre = self._body(time)
        centre[:, :2] -= PELVIS_SHARE / (1.0 - PELVIS_SHARE) * self._off(time)
        return centre + self.size * np.array([0.0, TRUNK_UP, 0.0])

    def _hip_plane(self, side: str, time: np.ndarray) -> np.ndarray:
        shank, knee = (self.angle(side, name, time) for name in ("shank", "knee"))
        return _hip(shank, self.ankle_plane(side, time) / self.size, shank, knee)

    def segments(self, time: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Rotation (n, 3, 3) and origin (n, 3) of trunk, pelvis, femur_r, tibia_r, talus_r, foot_r, toes_r, …

        Origins: the trunk's centre, mid-ASIS, hip, knee, ankle, ankle, metatarsophalangeal joint. A point of
        a segment is `rotation @ (size * local) + origin`; locally x is forward, y up, z to the right.
        """
        right, left = (self._hip_plane(side, time) for side in SIDES)
        apart = right - left
        wide = np.sqrt((2.0 * HIP_Z) ** 2 - (apart**2).sum(axis=1))  # the hips keep their distance
        across = np.column_stack([apart, wide]) / (2.0 * HIP_Z)
        tilt = np.tile([np.cos(TILT), np.sin(TILT), 0.0], (len(time), 1))
        up = np.cross(across, tilt)
        up /= np.linalg.norm(up, axis=1)[:, None]
        pelvis = np.stack([np.cross(up, across), up, across], axis=-1)
        middle = np.column_stack([0.5 * (right + left), np.zeros_like(time)])
        found = {"pelvis": (pelvis, middle - pelvis @ np.array([*HIP, 0.0]))}
        for side, hip, sign in (("right", right, 1.0), ("left", left, -1.0)):
            shank = self.angle(side, "shank", time)
            femur = about_z(self.angle(side, "knee", time) - shank)
            tibia, talus = about_z(-shank), about_z(self.angle(side, "pitch", time))
            foot = talus @ about_y(-sign * self.toe_out)
            at_hip = np.column_stack([hip, 0.5 * sign * wide])
            at_knee = at_hip + femur @ knee_in_femur(side)
            at_ankle = at_knee + tibia @ ankle_in_tibia(side)
            letter = side[0]
            found |= {
                f"femur_{letter}": (femur, at_hip),
                f"tibia_{letter}": (tibia, at_knee),
                f"talus_{letter}": (talus, at_ankle),
                f"foot_{letter}": (foot, at_ankle),
                f"toes_{letter}": (foot @ about_z(self.angle(side, "mtp", time)), at_ankle + foot @ MTP),
            }
        found = {name: (turned, self.size * origin) for name, (turned, origin) in found.items()}
        return found | {"trunk": (np.tile(np.eye(3), (len(time), 1, 1)), self._trunk(time))}

    def centres(self, side: str, time: np.ndarray) -> dict[str, np.ndarray]:
        """Hip, knee and ankle centre, each (n, 3) [m]."""
        found, letter = self.segments(time), side[0]
        return {
            "hip": found[f"femur_{letter}"][1],
            "knee": found[f"tibia_{letter}"][1],
            "ankle": found[f"talus_{letter}"][1],
        }

    # ---- forces ------------------------------------------------------------------------------------------

    def _loads(self, side: str, time: np.ndarray) -> np.ndarray:
        """The known walk's force of a foot in this walker's weights (n, 3)."""
        forward, upward, _ = self.walk.cycle.ground(self.phase(side, time))
        loads = self._load * np.column_stack([forward, upward, -SIGN[side] * INWARD * upward])
        return loads * np.maximum(0.0, 1.0 - LEAST / np.maximum(loads[:, 1:2], 1e-9))

    def bears(self, side: str) -> float:
        """How much sooner a foot takes its part of the weight while both stand."""
        return 1.0

    def force(self, side: str, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ground on foot [N] (n, 3), and its place on the floor [m] (n, 3); none while the foot swings.

        Newton: both feet's force is what moves the centre of mass and carries it. Its upward part is shared
        as the known walk's feet do; the level parts are theirs, and what lacks is shared likewise.
        """
        weight, calm = self.mass * GRAVITY, self._share * self.size / self.slower**2
        loads = {each: self._loads(each, time) * [calm, self.bears(each), calm] for each in SIDES}
        total = loads["right"] + loads["left"]
        part = loads[side][:, 1:2] / total[:, 1:2]
        whole = self.mass * (self.mass_centre(time, 2) + np.array([0.0, GRAVITY, 0.0]))
        level = np.array([1.0, 0.0, 1.0])
        force = weight * level * loads[side] + part * (whole - weight * level * total)
        ahead = self.size * self.walk.cycle.ground(self.phase(side, time))[2]
        ankle = self.centres(side, time)["ankle"]
        place = np.column_stack(
            [
                ankle[:, 0] + ahead,
                np.zeros_like(time),
                ankle[:, 2] + SIGN[side] * ahead * np.tan(self.toe_out),
            ]
        )
        return force, place

    def moment(self, side: str, time: np.ndarray, *, foot: bool = True) -> np.ndarray:
        """The shank's moment on the foot about the ankle's axis, dorsiflexion positive [N·m] (n,).

        By Newton and Euler for a rigid foot, or with `foot=False` for one without mass. It is what inverse
        dynamics writes for a coordinate whose positive sense is dorsiflexion.
        """
        force, place = self.force(side, time)
        ankle = self.ankle_plane(side, time)
        arm = place[:, :2] - ankle
        moment = -(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])
        if not foot:
            return moment
        mass = FOOT_MASS * self.mass
        pitch, spin, jerk = (self.angle(side, "pitch", time, k) for k in range(3))
        local = self.size * about_y(-SIGN[side] * self.toe_out) @ FOOT_CENTRE
        to = np.column_stack([np.cos(pitch), np.sin(pitch)]) * local[0]
        to += np.column_stack([-np.sin(pitch), np.cos(pitch)]) * local[1]
        turned = np.column_stack([-to[:, 1], to[:, 0]])
        drive = self.ankle_plane(side, time, 2) + jerk[:, None] * turned - (spin**2)[:, None] * to
        drive = mass * (drive + np.array([0.0, GRAVITY]))
        inertia = mass * (self.size * FOOT_GYRATION) ** 2
        return moment + inertia * jerk + to[:, 0] * drive[:, 1] - to[:, 1] * drive[:, 0]

    # ---- events ------------------------------------------------------------------------------------------

    def heel_strike(self, side: str, number: int) -> float:
        """When the upward force passes 20 N about heel strike `number` of this foot, from 0 [s]."""
        wanted = float(number)
        near = self.start + (wanted + np.linspace(-0.2, 0.7, 901)) * self.stride_time
        middle = float(np.interp(wanted, self.phase(side, near), near))
        time = np.linspace(middle - 0.1 * self.slower, middle + 0.05 * self.slower, 15_001)
        return float(time[np.argmax(self.force(side, time)[0][:, 1] > 20.0)])


def _hip(pitch: Any, ankle: np.ndarray, shank: np.ndarray, knee: np.ndarray) -> np.ndarray:
    """Hip of a leg in its plane (n, 2) [m]."""
    thigh = shank - knee
    at_knee = ankle + SHANK * np.column_stack([np.sin(shank), np.cos(shank)])
    return at_knee + THIGH * np.column_stack([np.sin(thigh), np.cos(thigh)])


def _length(knee: float) -> float:
    """Hip to ankle [m]."""
    return float(np.sqrt(THIGH**2 + SHANK**2 + 2.0 * THIGH * SHANK * np.cos(knee)))


def _reach(hip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shank and knee angle of a leg whose hip is there from its ankle."""
    knee = np.arccos(((hip**2).sum(axis=1) - THIGH**2 - SHANK**2) / (2.0 * THIGH * SHANK))
    ahead = np.arctan2(THIGH * np.sin(knee), SHANK + THIGH * np.cos(knee))
    return np.arctan2(hip[:, 0], hip[:, 1]) + ahead, knee


def _step(part: np.ndarray) -> np.ndarray:
    """From 0 to 1, with no speed and no acceleration at either end."""
    return part**3 * (10.0 + part * (6.0 * part - 15.0))


def _bounded(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Normal deviates, none beyond two."""
    return np.clip(rng.normal(0.0, 1.0, shape), -2.0, 2.0)


def about_z(angle: np.ndarray | float) -> np.ndarray:
    """Rotation (…, 3, 3): x toward y."""
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return np.stack([np.stack([c, -s, o], -1), np.stack([s, c, o], -1), np.stack([o, o, o + 1.0], -1)], -2)


def about_y(angle: np.ndarray | float) -> np.ndarray:
    """Rotation (…, 3, 3): z toward x."""
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return np.stack([np.stack([c, o, s], -1), np.stack([o, o + 1.0, o], -1), np.stack([-s, o, c], -1)], -2)


def knee_in_femur(side: str) -> np.ndarray:
    return np.array([0.0, -THIGH, SIGN[side] * (KNEE_Z - HIP_Z)])


def ankle_in_tibia(side: str) -> np.ndarray:
    return np.array([0.0, -SHANK, SIGN[side] * (ANKLE_Z - KNEE_Z)])
