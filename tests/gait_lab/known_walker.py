"""A walker whose every number is known: both legs and the pelvis in space, forces, ankle moments.

The world is OpenSim's: x forward, y up, z to the walker's right. The legs move in sagittal planes as the
known walk of `walking` does, the left one half a stride later. The pelvis turns and lists so that both hip
centres lie on it. Nothing here uses `afo_sim.gait_lab.trial`.
"""

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


@dataclass(frozen=True)
class Walker:
    """Strides without end, the right foot's first at `start` [s]; SI, angles in rad."""

    mass: float = 67.2
    toe_out: float = np.radians(7.0)  # of the feet
    start: float = 0.4
    way: float = 0.3  # the right ankle's x at its first heel strike [m]

    @cached_property
    def walk(self) -> Walk:
        return known_walk()

    @property
    def stride_time(self) -> float:
        return self.walk.cycle.stride_time

    @cached_property
    def stride_length(self) -> float:
        first, last = self.walk.cycle.signal("ankle_x", np.array([0.0, 1.0]))
        return float(last - first) - self._creep[0]

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
    def _load(self) -> float:
        """Factor of the force, so that two feet carry the weight over a stride."""
        phase = np.linspace(0.0, 1.0, 20_001)[:-1]
        return 0.5 / float(self.walk.cycle.ground(phase)[1].mean())

    def phase(self, side: str, time: np.ndarray) -> np.ndarray:
        return (time - self.start) / self.stride_time - (0.0 if side == "right" else 0.5)

    # ---- motion ------------------------------------------------------------------------------------------

    def angle(self, side: str, name: str, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        """shank (knee ahead), knee (flexion), ankle (dorsiflexion), pitch (toe up), mtp (up) [rad] (n,)."""
        cycle, phase = self.walk.cycle, self.phase(side, time)
        if name == "pitch":
            return self.angle(side, "ankle", time, derivative) - self.angle(side, "shank", time, derivative)
        if name == "mtp":  # toes bent up about toe-off
            return np.radians(30.0) * np.exp(-(((phase % 1.0 - 0.58) / 0.07) ** 2))
        return cycle.signal(f"{name}_angle", phase, derivative)

    def ankle_plane(self, side: str, time: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Forward and up [m, m/s, m/s²] (n, 2)."""
        cycle, phase = self.walk.cycle, self.phase(side, time)
        plane = np.column_stack([cycle.signal(f"ankle_{a}", phase, derivative) for a in "xz"])
        slope, rest = self._creep
        creep = rest(phase % 1.0, derivative) + (slope * phase, slope, 0.0)[derivative]
        plane[:, 0] -= creep / self.stride_time**derivative
        if derivative == 0:
            ahead = 0.0 if side == "right" else 0.5 * self.stride_length
            plane = plane + np.array([self.way + ahead, self._lift])
        return plane

    def _hip_plane(self, side: str, time: np.ndarray) -> np.ndarray:
        shank = self.angle(side, "shank", time)
        thigh = shank - self.angle(side, "knee", time)
        knee = self.ankle_plane(side, time) + SHANK * np.column_stack([np.sin(shank), np.cos(shank)])
        return knee + THIGH * np.column_stack([np.sin(thigh), np.cos(thigh)])

    def segments(self, time: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Rotation (n, 3, 3) and origin (n, 3) of pelvis, femur_r, tibia_r, talus_r, foot_r, toes_r, …_l.

        Origins: mid-ASIS, hip, knee, ankle, ankle, metatarsophalangeal joint. A point of a segment is
        `rotation @ local + origin`; locally x is forward, y up, z to the right.
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
        return found

    def centres(self, side: str, time: np.ndarray) -> dict[str, np.ndarray]:
        """Hip, knee and ankle centre, each (n, 3) [m]."""
        found, letter = self.segments(time), side[0]
        return {
            "hip": found[f"femur_{letter}"][1],
            "knee": found[f"tibia_{letter}"][1],
            "ankle": found[f"talus_{letter}"][1],
        }

    # ---- forces ------------------------------------------------------------------------------------------

    def force(self, side: str, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ground on foot [N] (n, 3), and its place on the floor [m] (n, 3); no force below 5 N."""
        phase = self.phase(side, time)
        forward, upward, ahead = self.walk.cycle.ground(phase)
        weight = self._load * self.mass * GRAVITY
        force = weight * np.column_stack([forward, upward, -SIGN[side] * INWARD * upward])
        force[force[:, 1] < 5.0] = 0.0
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
        local = about_y(-SIGN[side] * self.toe_out) @ FOOT_CENTRE
        to = np.column_stack([np.cos(pitch), np.sin(pitch)]) * local[0]
        to += np.column_stack([-np.sin(pitch), np.cos(pitch)]) * local[1]
        turned = np.column_stack([-to[:, 1], to[:, 0]])
        drive = self.ankle_plane(side, time, 2) + jerk[:, None] * turned - (spin**2)[:, None] * to
        drive = mass * (drive + np.array([0.0, GRAVITY]))
        inertia = mass * FOOT_GYRATION**2
        return moment + inertia * jerk + to[:, 0] * drive[:, 1] - to[:, 1] * drive[:, 0]

    # ---- events ------------------------------------------------------------------------------------------

    def heel_strike(self, side: str, number: int) -> float:
        """When the upward force passes 20 N about heel strike `number` of this foot, from 0 [s]."""
        middle = self.start + (number + (0.0 if side == "right" else 0.5)) * self.stride_time
        time = np.linspace(middle - 0.1, middle + 0.05, 15_001)
        weight = self._load * self.mass * GRAVITY
        return float(time[np.argmax(weight * self.walk.cycle.ground(self.phase(side, time))[1] > 20.0)])


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
