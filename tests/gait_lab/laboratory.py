"""A laboratory that records the known walker: its axes, belt and plates."""

import dataclasses
from dataclasses import dataclass, field

import numpy as np
from gait_lab.known_walker import SIDES, SOLE, Walker, about_y, ankle_in_tibia, knee_in_femur
from gait_lab.marker_sets import in_world
from scipy.spatial.transform import Rotation

LONG_PLATE = 1.3  # a longer one is the sum of a walkway's, each of which was zeroed [m]


@dataclass(frozen=True)
class Recorded:
    """One force plate: ground on whoever stands there, in the laboratory's axes."""

    name: str
    time: np.ndarray  # [s] (n,)
    force: np.ndarray  # [N] (n, 3)
    place: np.ndarray  # [m] (n, 3)
    corners: np.ndarray  # [m] (4, 3)


@dataclass(frozen=True)
class Laboratory:
    """Where things are written down: the world's x, y, z are forward, up and right, in these axes."""

    walker: Walker = field(default_factory=Walker)
    forward: str = "x"
    up: str = "y"
    turn: float = 0.0  # of the way about up, from `forward` to the left [rad]
    mirrored: bool = False  # a left-handed frame
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of the world [m]; along up it must be 0
    belt: float = 0.0  # of a treadmill [m/s]
    seconds: float = 3.2
    rate: float = 100.0  # of the cameras [Hz]
    plate_rate: float = 500.0  # [Hz]
    began: float = 0.0  # the recording's first moment, on the walker's clock [s]
    # ---- what errs
    ideal: bool = False  # nothing does, and strides are alike
    seed: int = 0  # of what follows
    noise: float = 0.0005  # SD of a marker's coordinate, from sample to sample [m]
    blinks: int = 3  # short times, of 20 to 80 ms, in which one marker or another is not seen
    ends: float = 0.1  # longest time for which a marker is not yet, or no more, in view [s]
    unseen: float = np.nan  # coordinate of a marker that is not seen: not a number, or 0
    offset: float = 2.0  # SD of what a plate reads with nobody on it [N], and its moments by 50 mm of that
    late: float = 0.0  # what the plates show after the cameras [s]
    gains: tuple[float, ...] = (1.0,)  # of the plates' forces in turn: right and left foot's, or one by one

    def __post_init__(self) -> None:
        if self.ideal:
            for field_, value in {"noise": 0.0, "blinks": 0, "ends": 0.0, "offset": 0.0}.items():
                object.__setattr__(self, field_, value)
            object.__setattr__(self, "walker", dataclasses.replace(self.walker, seed=None))

    @property
    def time(self) -> np.ndarray:
        return self.began + np.arange(round(self.seconds * self.rate)) / self.rate

    @property
    def plate_time(self) -> np.ndarray:
        each = round(self.plate_rate / self.rate)
        return self.began + np.arange(round(self.seconds * self.rate) * each) / self.plate_rate

    @property
    def axes(self) -> np.ndarray:
        """Columns: forward, up, right in the laboratory's axes (3, 3)."""
        ahead, above = _axis(self.forward), _axis(self.up)
        ahead = Rotation.from_rotvec(self.turn * above).apply(ahead)
        right = np.cross(ahead, above) * (-1.0 if self.mirrored else 1.0)
        return np.column_stack([ahead, above, right])

    def seen(self, points: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Points of the world as the laboratory has them: (n, 3) → (n, 3) [m]."""
        back = np.column_stack([self.belt * time, 0.0 * time, 0.0 * time])
        return (points - back) @ self.axes.T + self.origin

    # ---- what is recorded --------------------------------------------------------------------------------

    def markers(self, name: str, prefix: str = "") -> dict[str, np.ndarray]:
        """A set's trajectories, each (n, 3) [m]."""
        found = in_world(self.walker, name, self.time)
        return self._erring({prefix + label: self.seen(p, self.time) for label, p in found.items()})

    def _erring(self, points: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Markers as cameras have them: shaken, and out of view at times."""
        rng, span = np.random.default_rng(self.seed), self.time - self.began
        found = {name: p + rng.normal(0.0, self.noise, p.shape) for name, p in points.items()}
        for path in found.values():
            first, last = self.ends * np.clip(rng.uniform(-1.0, 1.0, 2), 0.0, None)
            path[(span < first) | (span > span[-1] - last)] = self.unseen
        for name in rng.choice(list(found), self.blinks):
            start, lasting = rng.uniform(0.0, span[-1]), rng.uniform(0.02, 0.08)
            found[name][(span >= start) & (span < start + lasting)] = self.unseen
        return found

    def standing(self, name: str, prefix: str = "", seconds: float = 1.5) -> dict[str, np.ndarray]:
        """The set and its medial markers of the upright walker, who sways 2 mm, each (n, 3) [m]."""
        time = np.arange(round(seconds * self.rate)) / self.rate
        found = in_world(self.walker, name, time, segments=upright(self.walker, time), standing=True)
        sway = 0.002 * np.sin(2.0 * np.pi * 0.4 * time)
        shift = np.column_stack([sway, 0.0 * time, 0.5 * sway])
        still = dataclasses.replace(self, belt=0.0)
        return {prefix + label: still.seen(p + shift, time) for label, p in found.items()}

    def plates(self, kind: str = "feet") -> list[Recorded]:
        """Plates: "feet" one a side for the whole way, "steps" one a contact, "single" one contact a side,
        "both" one plate under both feet, "none".
        """
        time, walker = self.plate_time, self.walker
        if kind == "none":
            return []
        time = time - self.late
        feet = {side: walker.force(side, time) for side in SIDES}
        if kind == "both":
            total = feet["right"][0] + feet["left"][0]
            weighted = sum(f[:, 1:2] * p for f, p in feet.values())
            place = weighted / np.maximum(total[:, 1:2], 1e-6)
            return self._reading([self._plate("1", total, np.where(total[:, 1:2] > 0.0, place, 0.0))])
        if kind == "feet":
            return self._reading([self._plate(side[0], *feet[side]) for side in SIDES])
        found = []
        for side in SIDES:
            force, place = feet[side]
            number = np.floor(walker.phase(side, time) + 0.1)  # the force is 0 about 90 % of the stride
            for k in np.unique(number):
                own = number == k
                whole = force[own][0, 1] == 0.0 == force[own][-1, 1]
                if force[own, 1].max() < 50.0 or (kind == "single" and not whole):
                    continue
                found.append((time[own][0], self._plate("", force * own[:, None], place)))
                if kind == "single":
                    break
        order = [plate for _, plate in sorted(found, key=lambda pair: pair[0])]
        return self._reading([dataclasses.replace(plate, name=str(k)) for k, plate in enumerate(order, 1)])

    def _reading(self, plates: list[Recorded]) -> list[Recorded]:
        """Plates as they read: with another gain, and something with nobody on them."""
        rng, up, found = np.random.default_rng([self.seed, 1]), self.axes[:, 1], []
        for k, plate in enumerate(plates):
            gain, middle = self.gains[k % len(self.gains)], plate.corners.mean(axis=0)
            idle = self.axes @ (self.offset * rng.normal(0.0, 1.0, 3) * [0.3, 1.0, 0.3])
            lever = 0.05 * self.offset * rng.normal(0.0, 1.0, 3)
            lever -= (lever @ up) * up
            plate = dataclasses.replace(plate, force=gain * plate.force)
            if self.offset and np.ptp(plate.corners, axis=0).max() < LONG_PLATE:
                force = plate.force + idle
                carried = (force @ up)[:, None]
                carried = np.where(np.abs(carried) < 0.5, 0.5, carried)
                place = middle + ((plate.force @ up)[:, None] * (plate.place - middle) + lever) / carried
                plate = dataclasses.replace(plate, force=force, place=place)
            found.append(plate)
        return found

    def _plate(self, name: str, force: np.ndarray, place: np.ndarray) -> Recorded:
        time = self.plate_time
        loaded = force[:, 1] > 0.0
        on_belt = place - self.belt * np.outer(time - self.late, [1.0, 0.0, 0.0])
        low = on_belt[loaded].min(axis=0) - 0.15
        high = on_belt[loaded].max(axis=0) + 0.15
        corners = np.array(
            [[high[0], 0, high[2]], [low[0], 0, high[2]], [low[0], 0, low[2]], [high[0], 0, low[2]]]
        )
        fixed = dataclasses.replace(self, belt=0.0)
        return Recorded(
            name,
            time,
            force @ self.axes.T,
            fixed.seen(on_belt, time),
            fixed.seen(corners, np.zeros(4)),
        )

    def angles(self, knee: float = 1.0) -> dict[str, np.ndarray]:
        """Coordinates of the matching model [rad, m], `knee` −1 for models with flexion negative.

        The laboratory must have OpenSim's axes, y up; the walker may go any way on the floor.
        """
        time = self.time
        segments = self.walker.segments(time)
        tilt, list_, rotation = _euler(self.axes @ segments["pelvis"][0])
        place = self.seen(segments["pelvis"][1], time)
        found = {"pelvis_tilt": tilt, "pelvis_list": list_, "pelvis_rotation": rotation}
        found |= {f"pelvis_t{axis}": place[:, k] for k, axis in enumerate("xyz")}
        for side in SIDES:
            s, sign = side[0], 1.0 if side == "right" else -1.0
            hip = np.swapaxes(segments["pelvis"][0], 1, 2) @ segments[f"femur_{s}"][0]
            flexion, adduction, turn = _euler(hip)
            found |= {
                f"hip_flexion_{s}": flexion,
                f"hip_adduction_{s}": sign * adduction,
                f"hip_rotation_{s}": sign * turn,
                f"knee_angle_{s}": knee * self.walker.angle(side, "knee", time),
                f"ankle_angle_{s}": self.walker.angle(side, "ankle", time),
                f"subtalar_angle_{s}": np.zeros_like(time),
                f"mtp_angle_{s}": self.walker.angle(side, "mtp", time),
            }
        return found

    def moments(self) -> dict[str, np.ndarray]:
        """Inverse dynamics of both ankles, dorsiflexion positive [N·m]."""
        return {f"ankle_angle_{s[0]}_moment": self.walker.moment(s, self.time) for s in SIDES}


def upright(walker: Walker, time: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Segments of the walker who stands still, legs straight, feet flat and toeing out."""
    from gait_lab.known_walker import HIP, HIP_Z, MTP, SIGN, TRUNK_UP

    whole = np.ones((len(time), 1))
    eye = np.tile(np.eye(3), (len(time), 1, 1))
    height = SOLE - ankle_in_tibia("right")[1] - knee_in_femur("right")[1]
    found = {"pelvis": (eye, whole * [-HIP[0], height - HIP[1], 0.0])}
    found["trunk"] = eye, whole * [0.0, height + TRUNK_UP, 0.0]
    for side, sign in SIGN.items():
        s = side[0]
        hip = np.array([0.0, height, sign * HIP_Z])
        knee = hip + knee_in_femur(side)
        ankle = knee + ankle_in_tibia(side)
        foot = about_y(-sign * walker.toe_out)
        found |= {f"femur_{s}": (eye, whole * hip), f"tibia_{s}": (eye, whole * knee)}
        found |= {f"talus_{s}": (eye, whole * ankle), f"foot_{s}": (eye @ foot, whole * ankle)}
        found[f"toes_{s}"] = eye @ foot, whole * (ankle + foot @ MTP)
    return {name: (turned, walker.size * origin) for name, (turned, origin) in found.items()}


def _axis(name: str) -> np.ndarray:
    vector = np.zeros(3)
    vector["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return vector


def _euler(rotation: np.ndarray) -> np.ndarray:
    """OpenSim's order about the body's own z, x, y (3, n) [rad]."""
    return Rotation.from_matrix(rotation).as_euler("ZXY").T
