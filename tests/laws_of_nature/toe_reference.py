"""A separate computation of a foot with toes on a hinge, in a shoe: equations of motion and the outsole.

Nothing here is shared with the program but numbers.

The ankle A moves as it is driven, with acceleration a. The shank leans by φ, the foot's pitch is ψ = θ − φ,
the toes' is χ = ψ + q. R turns by a pitch, ⊥ by a right angle more. The hindfoot has the mass m₁ at
C₁ = R(ψ) c₁ and the inertia I₁ about the ankle. The toes have m₂ and J about their own centre, which is at
H + C with H = R(ψ) h, the hinge, and C = R(χ) c. With g upward in a, since weight is felt as acceleration,

    r̈₂ = a + g + ψ̈ ⊥H − ψ̇² H + χ̈ ⊥C − χ̇² C,   ∂r₂/∂θ = ⊥(H + C),   ∂r₂/∂q = ⊥C.

Lagrange's equations are the momenta along those directions. With S = m₂ (H × C) = m₂ ⊥H·C they are

    (I₁ + J + m₂ |H + C|²) ψ̈ + (J + m₂ C·(H + C)) q̈ + A θ̈ = M_θ + S (χ̇² − ψ̇²) − (m₁ ⊥C₁ + m₂ ⊥(H + C))·(a + g)
    (J + m₂ C·(H + C)) ψ̈ + (J + m₂ |C|²) q̈ + A_q q̈ = M_q − S ψ̇² − m₂ ⊥C·(a + g)

with ψ̈ = θ̈ − φ̈ and the armatures A and A_q, which turn with the joints alone. M_θ and M_q are the moments
about ankle and hinge. The toes' spring rests at the extension r, the sole's at 0, and the damper at the ρ of
both: M_q = −K (q − ρ) − c (q̇ − ρ̇) with K = k + k_sole and ρ = k r/K.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from laws_of_nature.own_length_reference import Foot, Surroundings

GRAVITY = 9.80665  # [m/s²]
Point = tuple[float, float]

# Hallux against forefoot over the stride, mean of adults, Oxford foot model: extension [deg] by phase [%].
EXTENSION = {
    0: 14.6, 4: 10.3, 8: 3.7, 12: -0.5, 20: 0.0, 28: -0.9, 36: -1.1, 44: 2.3, 48: 6.8, 52: 14.5, 56: 27.2,
    60: 33.2, 64: 27.8, 68: 18.1, 72: 12.3, 76: 10.2, 80: 9.0, 84: 8.2, 86: 8.0, 90: 8.7, 94: 11.4, 98: 12.7,
    100: 14.6,
}  # fmt: skip
FLAT = -0.67  # of it with the sole flat [deg]
TOLD = 0.86  # phase of the swing's extension
FADES = (0.12, 0.50, 0.68)  # in stance, between the first two, the curve is not shifted
HARMONICS, SAMPLES = 10, 400


@dataclass(frozen=True)
class Toes:
    """On a hinge (x, z) in the foot's axes from the ankle [m]; the rest in the toes' axes, where q = 0.

    mass [kg]; centre from the hinge [m]; inertia about that centre [kg·m²]; armature [kg·m²]; stiffness about
    the rest extension, and about zero that of the sole [N·m/rad]; damping [N·m·s/rad].
    """

    hinge: Point
    mass: float
    centre: Point
    inertia: float
    armature: float
    stiffness: float
    sole_stiffness: float
    damping: float

    def moment(self, extension: float, rate: float, rest: float, rest_rate: float) -> float:
        """Of spring, sole and damper, extending positive [N·m]."""
        both = self.stiffness + self.sole_stiffness
        share = self.stiffness / both if both else 0.0
        return both * (share * rest - extension) + self.damping * (share * rest_rate - rate)


def accelerations(
    foot: "Foot",
    toes: Toes,
    ankle: Sequence[float],
    bending: Sequence[float],
    moment: float,
    around: "Surroundings",
) -> tuple[float, float]:
    """θ̈ and q̈ [rad/s²], of the equations above.

    Parameters
    ----------
    foot : of its hindfoot alone
    ankle, bending : angle and rate of ankle and hinge [rad], [rad/s]
    moment : about the ankle, dorsiflexion positive, without weight [N·m]
    around : what drives the foot
    """
    angle, speed = ankle
    extension, rate = bending
    pitch, turning = angle - around.shank, speed - around.shank_rate
    bent = turning + rate
    first = turned(foot.centre, pitch)
    hinge, centre = turned(toes.hinge, pitch), turned(toes.centre, pitch + extension)
    far = (hinge[0] + centre[0], hinge[1] + centre[1])
    x, z = around.ankle_x, around.ankle_z + GRAVITY
    both = toes.inertia + toes.mass * (centre[0] * far[0] + centre[1] * far[1])
    whole = foot.inertia + toes.inertia + toes.mass * (far[0] ** 2 + far[1] ** 2)
    own = toes.inertia + toes.mass * (centre[0] ** 2 + centre[1] ** 2)
    cross = toes.mass * (hinge[0] * centre[1] - hinge[1] * centre[0])
    on_ankle = moment + cross * (bent**2 - turning**2) + whole * around.shank_acceleration
    on_ankle -= foot.mass * (first[0] * z - first[1] * x) + toes.mass * (far[0] * z - far[1] * x)
    on_toes = toes.moment(extension, rate, around.toe_rest, around.toe_rest_rate) - cross * turning**2
    on_toes += both * around.shank_acceleration - toes.mass * (centre[0] * z - centre[1] * x)
    whole, own = whole + foot.armature, own + toes.armature
    determinant = whole * own - both * both
    return (
        (own * on_ankle - both * on_toes) / determinant,
        (whole * on_toes - both * on_ankle) / determinant,
    )


def turned(point: Point, angle: float) -> Point:
    """A point turned toe up by an angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return point[0] * cosine - point[1] * sine, point[0] * sine + point[1] * cosine


def rest_extension(swing: float) -> tuple[np.ndarray, np.ndarray]:
    """Rest extension of the toes over the stride: coefficients of cos and sin of 2π n phase, n = 0… [rad].

    The curve against the flat foot is lifted in swing so that it is `swing` [rad] at 86 %, and smoothed.
    """
    phase = np.arange(SAMPLES) / SAMPLES
    curve = np.interp(phase, 0.01 * np.array(list(EXTENSION)), list(EXTENSION.values())) - FLAT
    shares = np.interp(phase, [0.0, *FADES, 1.0], [1.0, 0.0, 0.0, 1.0, 1.0])
    lift = math.degrees(swing) - (EXTENSION[round(100 * TOLD)] - FLAT)
    return smoothed(np.radians(curve + lift * shares), HARMONICS)


def smoothed(samples: np.ndarray, harmonics: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest harmonics of even samples of one cycle, the first not again at the end (n,)."""
    waves = np.fft.rfft(samples)[: harmonics + 1] / len(samples)
    waves[1:] *= 2.0
    return waves.real, -waves.imag


def series(waves: tuple[np.ndarray, np.ndarray], phase: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Such a series, or a derivative by phase, at phases (n,)."""
    order = 2j * np.pi * np.arange(len(waves[0]))
    return np.real(np.exp(np.outer(phase, order)) @ ((waves[0] - 1j * waves[1]) * order**derivative))


@dataclass(frozen=True)
class Sole:
    """Points on which a foot stands, in its axes from the ankle [m]; pulp and tip turn with the toes."""

    heel: Point
    ball: Point
    pulp: Point
    tip: Point
    hinge: Point

    @property
    def level(self) -> float:
        """Pitch of the foot at which heel and ball are at one height [rad]."""
        return math.atan((self.heel[1] - self.ball[1]) / (self.ball[0] - self.heel[0]))

    @property
    def ankle_height(self) -> float:
        """Of the ankle above the floor on which heel and ball stand [m]: its distance from their line."""
        (x, z), (ahead, high) = self.heel, self.ball
        return abs(x * high - z * ahead) / math.hypot(ahead - x, high - z)

    def heights(self, ankle: np.ndarray, pitch: np.ndarray, extension: np.ndarray) -> dict[str, np.ndarray]:
        """Of the points above the floor [m] (n,), at heights of the ankle [m] and angles [rad] (n,)."""
        found = {}
        for name in ("heel", "ball"):
            x, z = getattr(self, name)
            found[name] = ankle + x * np.sin(pitch) + z * np.cos(pitch)
        hinge = ankle + self.hinge[0] * np.sin(pitch) + self.hinge[1] * np.cos(pitch)
        for name in ("pulp", "tip"):
            x, z = (getattr(self, name)[k] - self.hinge[k] for k in (0, 1))
            found[name] = hinge + x * np.sin(pitch + extension) + z * np.cos(pitch + extension)
        return found


def shod(bare: Sole, stacks: Mapping[str, float]) -> Sole:
    """The points of a shoe's outsole, from those of the bare foot in it.

    `stacks` [m]: heel_stack and ball_stack thick, heel_behind the heel, tip_ahead of the toes' tip. From heel
    to ball it is straight, from there a parabola that rises by toe_spring above that line at its tip.
    """
    heel = (bare.heel[0] - stacks["heel_behind"], bare.heel[1] - stacks["heel_stack"])
    ball = (bare.ball[0], bare.ball[1] - stacks["ball_stack"])
    end = bare.tip[0] + stacks["tip_ahead"]

    def at(x: float) -> Point:
        along = (x - heel[0]) / (ball[0] - heel[0])
        line = (1.0 - along) * heel[1] + along * ball[1]
        return x, line + stacks["toe_spring"] * ((x - ball[0]) / (end - ball[0])) ** 2

    return Sole(heel, ball, at(bare.pulp[0]), at(end), bare.hinge)
