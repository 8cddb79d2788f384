"""A person in MJCF by construction: each hinge's coordinate rises in flexion, or falls in it."""

import numpy as np

FORWARD, LEFT, UP = np.eye(3)
SIDES = {"left": 1.0, "right": -1.0}
# {how the arms are: upper arm, forearm, the palm's way, of a left arm (forward, left, up); it is mirrored}
ARMS = {
    "hanging": ((0, 0, -1), (0, 0, -1), (0, -1, 0)),
    "bent by 90 deg": ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
    "spread": ((0, 1, 0), (0, 1, 0), (0, 0, -1)),
    "oblique": ((1, 1, -1), (1, -1, 1), (-1, -2, -1)),
}


def _numbers(values: object) -> str:
    return " ".join(f"{value:.17g}" for value in np.ravel(np.asarray(values, float)) + 0.0)


def _body(name: str, at: np.ndarray, mass: float, reach: np.ndarray, joint: str, inner: str = "") -> str:
    return (
        f'<body name="{name}" pos="{_numbers(at)}"><inertial pos="{_numbers(0.5 * reach)}" mass="{mass}" '
        f'diaginertia="0.01 0.01 0.01"/>{joint}{inner}</body>'
    )


def _hinge(
    name: str, axis: np.ndarray, stops: tuple[float, float] | None = (-60.0, 60.0), at: object = 0.0
) -> str:
    """A hinge; its stops [deg] are those of the turn about the axis."""
    limits = "" if stops is None else f'range="{_numbers(stops)}"'
    return f'<joint name="{name}" axis="{_numbers(axis)}" {limits} damping="0.05"/>'


def person(
    arms: str = "hanging",
    way: int = 1,
    turn: np.ndarray | None = None,
    elbow: tuple[float, float] | None = (-5.0, 150.0),
    knee: tuple[float, float] | None = (-5.0, 140.0),
    sides: tuple[str, ...] = ("left", "right"),
    backward: bool = False,
) -> str:
    """The text; stops of elbow and knee count from straight [deg], `way` is each hinge's sense.

    `backward` has knees as a bird's ankles; `turn` is where forward, left and up of the body lie (3, 3).
    """

    def flexor(name: str, axis: np.ndarray, stops: tuple[float, float] | None, stands: float = 0.0) -> str:
        ends = None if stops is None else tuple(sorted(way * (stop - stands) for stop in stops))
        return _hinge(name, way * axis, ends)  # type: ignore[arg-type]

    def digit(name: str, at: np.ndarray, along: np.ndarray, axis: np.ndarray) -> str:
        tip = _body(f"{name}_tip", 0.04 * along, 0.02, 0.03 * along, flexor(f"{name}_pip", axis, (0.0, 90.0)))
        return _body(f"{name}_base", at, 0.03, 0.04 * along, flexor(f"{name}_mcp", axis, (-20.0, 90.0)), tip)

    def arm(side: str) -> str:
        mirror = np.array([1.0, SIDES[side], 1.0])
        upper, fore, palm = (mirror * way / np.linalg.norm(way) for way in ARMS[arms])
        folded = float(np.degrees(np.arccos(np.clip(upper @ fore, -1.0, 1.0))))
        bends = np.cross(fore, -upper) if folded > 1.0 else np.cross(fore, FORWARD)
        bends, palms = bends / np.linalg.norm(bends), np.cross(fore, palm)
        aside = SIDES[side] * np.cross(palm, fore)
        fingers = "".join(
            digit(f"{side}_{name}", 0.09 * fore + k * 0.02 * aside, fore, palms)
            for k, name in enumerate(("index", "middle", "ring"))
        )
        thumb = digit(f"{side}_thumb", 0.03 * fore + 0.03 * aside, fore, -palms)
        hand = _body(
            f"{side}_hand",
            0.02 * fore,
            0.4,
            0.1 * fore,
            flexor(f"{side}_wrist", palms, None),
            fingers + thumb,
        )
        wrist = _body(
            f"{side}_carpus", 0.25 * fore, 1e-3, 0.01 * fore, _hinge(f"{side}_wrist_deviation", palm), hand
        )
        forearm = _body(
            f"{side}_forearm",
            0.3 * upper,
            1.2,
            0.25 * fore,
            flexor(f"{side}_elbow", bends, elbow, folded),
            wrist,
        )
        yaw = _body(
            f"{side}_upper_arm",
            0.09 * upper,
            2.0,
            0.2 * upper,
            _hinge(f"{side}_shoulder_yaw", upper),
            forearm,
        )
        roll = _body(f"{side}_arm_2", np.zeros(3), 1e-3, upper, _hinge(f"{side}_shoulder_roll", FORWARD), yaw)
        return _body(
            f"{side}_arm_1", (0.0, 0.2 * SIDES[side], 0.5), 1e-3, upper,  # type: ignore[arg-type]
            flexor(f"{side}_shoulder_pitch", -LEFT, (-160.0, 160.0)), roll,
        )  # fmt: skip

    def leg(side: str) -> str:
        down, sense = -UP, -1.0 if backward else 1.0
        box = '<geom type="box" size="0.12 0.04 0.03" pos="0.05 0 -0.05" contype="0" conaffinity="0"/>'
        foot = _body(
            f"{side}_foot", 0.4 * down, 1.0, 0.1 * FORWARD, flexor(f"{side}_ankle", -LEFT, (-45.0, 35.0)), box
        )
        shank = _body(
            f"{side}_shank", 0.3 * down, 3.5, 0.4 * down, flexor(f"{side}_knee", sense * LEFT, knee), foot
        )
        yaw = _body(f"{side}_thigh", 0.1 * down, 7.0, 0.3 * down, _hinge(f"{side}_hip_yaw", UP), shank)
        roll = _body(f"{side}_hip_2", 0.03 * down, 1e-3, down, _hinge(f"{side}_hip_roll", FORWARD), yaw)
        at = np.array([0.0, 0.1 * SIDES[side], 0.0])
        return _body(
            f"{side}_hip_1", at, 1e-3, down, flexor(f"{side}_hip_pitch", -LEFT, (-130.0, 130.0)), roll
        )

    frame = np.eye(3) if turn is None else turn
    limbs = "".join(arm(side) + leg(side) for side in sides)
    return f"""<mujoco><compiler angle="degree" autolimits="true"/><option timestep="0.001"/><worldbody>
      <body name="trunk" pos="0 0 1" xyaxes="{_numbers(frame[:, :2].T)}"><freejoint/>
      <inertial pos="0 0 0.3" mass="30" diaginertia="1 1 1"/>{limbs}</body></worldbody></mujoco>"""
