"""A patient who walks on a floor, without and with a device: ordinary differential equations.

Nothing here is shared with the program but numbers. What her hip and shank do is given over the phase, and so
is what her muscles give. Many springs under the sole bear her on the floor at z = 0, and never pull; the
ground's force leans as the phase says. The leg gives way upward by y against a spring.

Points x + i z of the plane turn toe up by e^{iα}. The shank leans by φ, the foot is pitched by ψ = θ − φ, the
toes by ψ + q. With the ankle at A = x + i (z + y), the centres of shank, foot and toes are A + s e^{−iφ},
A + c e^{iψ} and A + h e^{iψ} + t e^{i(ψ+q)}. Of u = (y, θ, q) they have Jacobians J, and j of their angles,
and accelerations J ü + β and j ü + β′, so that under forces Q

    Σ (m Re(J*ᵀJ) + I jᵀj) ü = Q − Σ (m Re(J*ᵀ(β + i g)) + I jᵀβ′).
"""

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from laws_of_nature.own_length_reference import Device
from laws_of_nature.toe_reference import GRAVITY
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

SOLE = np.linspace(-0.060, 0.120, 10) - 0.068j  # springs from heel to ball, from the ankle [m]
TOES = np.append(np.linspace(0.005, 0.060, 6) - 0.018j, 0.075 - 0.010j)  # to pulp and tip, from the hinge [m]
STIFF, BRAKE = 2e5, 1.0  # of one of them [N/m], share of its force by velocity [s/m]
LEG, LEG_BRAKE = 2e4, 400.0  # against which the leg gives way [N/m], [N·s/m]
PHASE = np.linspace(0.0, 1.0, 2049)

# What is given at an instant, SI, moments and angles toe up: the shank's lean; the ankle's forward
# acceleration, and its height while the leg does not give way; the knee's angle; forward over upward force of
# the ground; the toes' rest extension; moment of her muscles about the ankle; force of the body above; moment
# of her muscles about the toes' hinge.
Instant = namedtuple(
    "Instant",
    "lean lean_rate lean_spin forward height rising upward knee slope rest rest_rate own support flexors",
)


@dataclass(frozen=True, eq=False)
class Truth:
    """Her with a device, whose foot is hers with all that it carries.

    shank is its mass [kg] and its centre from the ankle [m]; `given` are rows of `Instant` at `PHASE`, of a
    stride of `time` [s]; `seats` are the open valves. States: θ, θ̇, the device's, q, q̇, y, ẏ.
    """

    device: Device
    shank: tuple[float, complex]
    given: np.ndarray
    time: float
    seats: tuple[bool, ...] = ()

    @cached_property
    def _table(self) -> CubicSpline:
        return CubicSpline(self.time * PHASE, self.given, axis=1)

    @property
    def instants(self) -> list[Instant]:
        return [Instant(*row) for row in self.given.T.tolist()]

    def inertia(self, at: Instant, turns: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix of u, and the forces that need no ü; turns are θ, θ̇, q, q̇."""
        foot, toes, spin = self.device.foot, self.device.foot.toes, -at.lean_spin
        pitch, turning = turns[0] - at.lean, turns[1] - at.lean_rate
        shank, (sole, hinge) = self.shank[1] * np.exp(-1j * at.lean), self.turned(pitch)
        tip = complex(*toes.centre) * np.exp(1j * (pitch + turns[2]))
        places = np.array([[1j, 0.0, 0.0], [1j, 1j * sole, 0.0], [1j, 1j * (hinge + tip), 1j * tip]])
        angles = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
        mass = np.array([self.shank[0], foot.mass, toes.mass])
        about = np.array([0.0, foot.inertia - foot.mass * abs(sole) ** 2, toes.inertia])
        free = 1j * spin * np.array([shank, sole, hinge + tip])
        free -= at.lean_rate**2 * np.array([shank, 0.0, 0.0]) + turning**2 * np.array([0.0, sole, hinge])
        free += (
            at.forward + 1j * (at.upward + GRAVITY) - (turning + turns[3]) ** 2 * np.array([0.0, 0.0, tip])
        )
        matrix = np.real(places.conj().T @ (mass[:, None] * places)) + angles.T @ (about[:, None] * angles)
        need = np.real(places.conj().T @ (mass * free)) + angles.T @ about * spin
        return matrix + np.diag([0.0, foot.armature, toes.armature]), need

    def turned(self, pitch: float) -> tuple[complex, complex]:
        """The foot's centre and the toes' hinge from the ankle [m]."""
        turn = np.exp(1j * pitch)
        return complex(*self.device.foot.centre) * turn, complex(*self.device.foot.toes.hinge) * turn

    def sole(self, at: Instant, state: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Places of the springs from the ankle, and of those under the toes from the hinge [m]."""
        pitch = state[0] - at.lean
        toes = TOES * np.exp(1j * (pitch + state[-4]))
        return np.append(SOLE * np.exp(1j * pitch), self.turned(pitch)[1] + toes), toes

    def ground(self, at: Instant, state: Sequence[float]) -> np.ndarray:
        """Upward force [N], and its moments about ankle and toes' hinge [N·m]."""
        (place, toes), height = self.sole(at, state), at.height + state[-2]
        speed = at.rising + state[-1] + place.real * (state[1] - at.lean_rate)
        speed[len(SOLE) :] += toes.real * state[-3]
        force = STIFF * np.maximum(-height - place.imag, 0.0) * np.maximum(1.0 - BRAKE * speed, 0.0)
        on_toes, above = force[len(SOLE) :], height + (place[-1] - toes[-1]).imag
        forward = at.slope * np.array([force.sum(), on_toes.sum()])
        moments = force @ place.real + forward[0] * height, on_toes @ toes.real + forward[1] * above
        return np.array([force.sum(), *moments])

    def relaxed(self, at: Instant, angle: float, rate: float) -> float:
        """Moment of tissue and damping about the ankle [N·m]."""
        return self.device.foot.passive(angle, at.knee) - self.device.foot.damping * rate

    def rates(self, time: float, state: list[float]) -> list[float]:
        at = Instant(*self._table(time % self.time).tolist())
        (angle, rate), (q, bend, y, up) = state[:2], state[-4:]
        pull, inside = self.device.inside(state, self.seats)
        on_ankle = at.own + self.relaxed(at, angle, rate) + pull
        on_toes = at.flexors + self.device.foot.toes.moment(q, bend, at.rest, at.rest_rate)
        matrix, need = self.inertia(at, (angle, rate, q, bend))
        forces = np.add(self.ground(at, state), (at.support - LEG * y - LEG_BRAKE * up, on_ankle, on_toes))
        lift, spin, unbend = np.linalg.solve(matrix, forces - need).tolist()
        return [rate, spin, *inside, bend, unbend, up, lift]

    def walk(self, strides: int, start: Sequence[float], rtol: float = 1e-6) -> "Walked":
        """The last of so many strides from a heel strike on."""
        muscles, chambers = len(self.device.muscles), len(self.device.chambers)
        size = np.array([1.0, 10.0, *[1.0] * muscles, *[1.0, 1e-3] * chambers, 1.0, 10.0, 1.0, 10.0])
        state, how = np.array(start), {"method": "LSODA", "rtol": rtol, "atol": 0.1 * rtol * size}
        for _ in range(strides):
            found = solve_ivp(
                lambda t, y: self.rates(t, y.tolist()),
                (0.0, self.time), state, t_eval=self.time * PHASE, max_step=0.005, **how,
            )  # fmt: skip
            state = found.y[:, -1]
        rows = list(zip(self.instants, found.y.T.tolist(), strict=True))
        return Walked(
            self,
            found.y,
            np.array([self.rates(time, row) for time, (_, row) in zip(found.t, rows, strict=True)]).T,
            np.array([self.ground(*row) for row in rows]).T,
            np.array([at.height + row[-2] + self.sole(at, row)[0][-2:].imag.min() for at, row in rows]),
            np.array([self.device.inside(row, self.seats)[0] for _, row in rows]),
        )


@dataclass(frozen=True, eq=False)
class Walked:
    """A stride at `PHASE`: states, their rates, `ground`, height of the toe [m], device's moment [N·m]."""

    truth: Truth
    states: np.ndarray
    rates: np.ndarray
    ground: np.ndarray
    toe: np.ndarray
    moment: np.ndarray
