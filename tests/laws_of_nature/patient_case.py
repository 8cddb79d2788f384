"""A patient with a drop foot whose every number is known, what a laboratory writes of her, and a device."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from laws_of_nature.own_length_case import device_of, filled, hanging, together
from laws_of_nature.patient_truth import PHASE, Instant, Truth, Walked
from laws_of_nature.toe_reference import GRAVITY, rest_extension, series

from afo_sim.common import assets
from afo_sim.gait import GaitCycle
from afo_sim.gait import file as gait_file
from afo_sim.model import Built

MASS, HEIGHT = 75.0, 1.75  # the leg's own [kg], [m]
LEFT, FADES = 0.1, (0.48, 0.64)  # share of her dorsiflexors; phases in which her push-off ends
LOWERED, LIFTED = 0.014, 0.045  # of the ankle onto this leg, and by her own hip in mid-swing [m]
PRESSED = 20.0  # force from which on a plate knows its centre of pressure [N]


@dataclass(frozen=True, eq=False)
class Her:
    """`hip` is what shank and hip do; bare is her walk without a device, on toes that her muscles hold."""

    hip: GaitCycle
    bare: Walked

    @classmethod
    def of(cls, built: Built) -> "Her":
        """On the bare leg of a built scenario.

        Her muscles give what the mean adult's do, her dorsiflexors a tenth of it, and push-off ends early.
        """
        mean = gait_file.read(assets.find_gait("bovi2011_natural"))
        lifted = LIFTED * np.sin(np.pi * np.clip((mean.phase - 0.60) / 0.38, 0.0, 1.0)) ** 2
        high = mean.ankle_z - LOWERED + lifted
        hip = dataclasses.replace(mean, body_mass=MASS, body_height=HEIGHT, ankle_z=high)
        device, rows = device_of(built), driven(hip)
        held = dataclasses.replace(device.foot.toes, stiffness=5e3, damping=5.0)
        device = dataclasses.replace(device, foot=dataclasses.replace(device.foot, toes=held))
        adult = Truth(device, shank_of(built), np.array(rows), hip.stride_time)
        bends = rows.rest, rows.rest_rate, np.gradient(rows.rest_rate, hip.stride_time * PHASE)
        turns = np.stack([*(hip.signal("ankle_angle", PHASE, k) for k in range(3)), *bends])
        need, (_, force, place) = needed(adult, turns), hip.ground(PHASE)
        force = MASS * GRAVITY * force
        own = need[:, 1] - force * (place + rows.slope * rows.height)
        own -= [adult.relaxed(at, *turn[:2]) for at, turn in zip(adult.instants, turns.T, strict=True)]
        fade = np.cos(0.5 * np.pi * np.clip((PHASE - FADES[0]) / (FADES[1] - FADES[0]), 0.0, 1.0)) ** 2
        own *= np.where(own > 0.0, LEFT, fade)
        hers = dataclasses.replace(adult, given=np.array(rows._replace(own=own, support=need[:, 0] - force)))
        return cls(hip, hers.walk(2, [*turns[[0, 1, 3, 4], 0], 0.0, 0.0]))

    @cached_property
    def given(self) -> Instant:
        """Rows of her walk: the ankle as it went, her toes' muscles beside their own spring."""
        rows, bare, (*_, y, up) = Instant(*self.bare.truth.given), self.bare, self.bare.states
        held, bending = bare.truth.device.foot.toes, (*bare.states[-4:-2], rows.rest, rows.rest_rate)
        soft = dataclasses.replace(held, stiffness=25.0, damping=0.2)
        return rows._replace(
            height=rows.height + y,
            rising=rows.rising + up,
            upward=rows.upward + bare.rates[-1],
            flexors=held.moment(*bending) - soft.moment(*bending),
        )

    def wearing(self, built: Built, pressure: float, strides: int) -> Walked:
        """With a built scenario's device or none; its dorsiflexors are at a gauge pressure [Pa].

        Her body bears the device's weight.
        """
        device, bare = device_of(built), self.bare
        seats = (True, False, False, True) if device.chambers else ()
        truth = Truth(device, shank_of(built), np.array(self.given), bare.truth.time, seats)
        turns = np.stack([*bare.states[:2], bare.rates[1], *bare.states[2:4], bare.rates[3]])
        support = needed(truth, turns)[:, 0] - bare.ground[0]
        truth = dataclasses.replace(truth, given=np.array(self.given._replace(support=support)))
        start = bare.states[:, 0].tolist()
        inside = hanging(device, start[0]) if device.chambers else []
        air = [*filled(device, inside, pressure)[:2], *filled(device, inside)[2:]]
        return truth.walk(strides, [*start[:2], *inside, *air, *start[-4:-2], 0.0, 0.0])

    @property
    def recording(self) -> GaitCycle:
        """What a laboratory writes of her walk without a device."""
        rows, (force, moment, _) = self.given, self.bare.ground
        place = moment / np.maximum(force, PRESSED) - rows.slope * rows.height
        weights = force / (MASS * GRAVITY)
        columns = {
            "phase": PHASE,
            "shank_angle": rows.lean,
            "knee_angle": rows.knee,
            "ankle_angle": self.bare.states[0],
            "ankle_x": self.hip.signal("ankle_x", PHASE),
            "ankle_z": rows.height,
            "grf_x": rows.slope * weights,
            "grf_z": weights,
            "cop_x": np.where(force > PRESSED, place, np.nan),
            "ankle_moment": -moment / MASS,  # of a massless foot
        }
        seldom = {name: values[::4] for name, values in columns.items()}
        return dataclasses.replace(self.hip, ankle_height=0.068, walker="patient", notes={}, **seldom)


def driven(hip: GaitCycle) -> Instant:
    """Rows of what hip and shank give."""
    stands = hip.grf_z > 0.15
    slope = np.interp(PHASE, hip.phase[stands], hip.grf_x[stands] / hip.grf_z[stands], period=1.0)
    lean, high = ([hip.signal(name, PHASE, k) for k in range(3)] for name in ("shank_angle", "ankle_z"))
    rest = [series(rest_extension(np.radians(11.0)), PHASE, k) / hip.stride_time**k for k in range(2)]
    forward, knee = hip.signal("ankle_x", PHASE, 2), hip.signal("knee_angle", PHASE)
    return Instant(*lean, forward, *high, knee, slope, *rest, *np.zeros((3, len(PHASE))))


def needed(truth: Truth, turns: np.ndarray) -> np.ndarray:
    """Forces on (y, θ, q) (n, 3) for angle, rate and acceleration of the ankle and of the toes (6, n)."""
    found = []
    for at, (angle, rate, spin, *bend) in zip(truth.instants, turns.T, strict=True):
        matrix, need = truth.inertia(at, (angle, rate, *bend[:2]))
        found.append(need + matrix @ (0.0, spin, bend[2]))
    return np.array(found)


def shank_of(built: Built) -> tuple[float, complex]:
    """Mass of the shank with what it carries [kg], its centre from the ankle [m]."""
    pivot = built.model.joint("ankle").pos
    (whole, at, _), (foot, below, _) = (together(built, name, pivot) for name in ("shank", "foot"))
    mass = whole - foot
    return mass, (whole * complex(*at) - foot * complex(*below)) / mass
