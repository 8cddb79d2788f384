"""The separate computation of a foot with toes against closed forms: energy, momentum, work, frequencies."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from laws_of_nature.own_length_reference import Foot, Surroundings
from laws_of_nature.toe_reference import (
    EXTENSION,
    FLAT,
    GRAVITY,
    Sole,
    Toes,
    accelerations,
    rest_extension,
    series,
    shod,
    turned,
)
from scipy.integrate import solve_ivp

TOES = Toes((0.115, -0.05), 0.161, (0.0346, 0.004), 1e-4, 0.0, 0.0, 0.0, 0.0)
HEAVY = Toes((0.115, -0.05), 0.6, (0.05, 0.02), 2e-3, 0.0, 0.0, 0.0, 0.0)
FOOT = Foot(0.929, (0.039, -0.027), 0.0063, 0.0, 0.0, 0.0, 0.0, 0.0, (-10.0, 10.0))
STILL = Surroundings(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
FALLING = Surroundings(0.0, 0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0)
BARE = Sole((-0.06, -0.068), (0.12, -0.068), (0.175, -0.068), (0.19, -0.06), (0.115, -0.05))


@dataclass(frozen=True)
class Swing:
    """A foot on an ankle that moves as x = a sin ωt, z = b sin ωt, under a shank that leans by d sin ωt."""

    toes: Toes
    ahead: float = 0.0
    above: float = 0.0
    lean: float = 0.0
    rate: float = 7.0
    foot: Foot = field(default=FOOT)

    def around(self, time: float) -> Surroundings:
        sine, cosine = math.sin(self.rate * time), math.cos(self.rate * time)
        falling = -(self.rate**2) * sine
        return Surroundings(
            self.lean * sine,
            self.lean * falling,
            self.ahead * falling,
            self.above * falling,
            0.0,
            0.0,
            0.0,
            self.lean * self.rate * cosine,
        )

    def rates(self, time: float, state: np.ndarray, moment: float = 0.0) -> list[float]:
        around = self.around(time)
        found = accelerations(self.foot, self.toes, state[:2], state[2:4], moment, around)
        return [state[1], found[0], state[3], found[1]]

    def power(self, time: float, state: np.ndarray) -> float:
        """Of the ankle's force on the foot [W]: the bodies' momenta by positions of their own."""
        h = 1e-4
        second = [0.0, 0.0]
        places = [self.places(t, self.near(time, state, t - time)) for t in (time - h, time, time + h)]
        for mass, k in ((self.foot.mass, 0), (self.toes.mass, 1)):
            for axis in (0, 1):
                change = places[0][k][axis] - 2.0 * places[1][k][axis] + places[2][k][axis]
                second[axis] += mass * (change / h**2 + (GRAVITY if axis else 0.0))
        speed = self.rate * math.cos(self.rate * time)
        return second[0] * self.ahead * speed + second[1] * self.above * speed

    def near(self, time: float, state: np.ndarray, after: float) -> tuple[float, float]:
        """Angles a little later [rad]."""
        rates = self.rates(time, state)
        return tuple(state[k] + after * state[k + 1] + 0.5 * after**2 * rates[k + 1] for k in (0, 2))

    def places(self, time: float, angles: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        """Centres of hindfoot and toes [m]."""
        sine = math.sin(self.rate * time)
        pitch = angles[0] - self.lean * sine
        hinge, toes = turned(self.toes.hinge, pitch), turned(self.toes.centre, pitch + angles[1])
        hind = turned(self.foot.centre, pitch)
        at = (self.ahead * sine, self.above * sine)
        return (at[0] + hind[0], at[1] + hind[1]), (at[0] + hinge[0] + toes[0], at[1] + hinge[1] + toes[1])

    def energy(self, time: float, state: np.ndarray, gravity: float = GRAVITY) -> float:
        """Kinetic and potential [J], from the velocities of the two centres."""
        around = self.around(time)
        pitch = state[0] - around.shank
        turning, bent = state[1] - around.shank_rate, state[1] - around.shank_rate + state[3]
        hinge, toes = turned(self.toes.hinge, pitch), turned(self.toes.centre, pitch + state[2])
        hind = turned(self.foot.centre, pitch)
        sine, cosine = math.sin(self.rate * time), self.rate * math.cos(self.rate * time)
        carried = (self.ahead * cosine, self.above * cosine)
        first = (carried[0] - turning * hind[1], carried[1] + turning * hind[0])
        second = (
            carried[0] - turning * hinge[1] - bent * toes[1],
            carried[1] + turning * hinge[0] + bent * toes[0],
        )
        about = self.foot.inertia - self.foot.mass * (hind[0] ** 2 + hind[1] ** 2)
        kinetic = self.foot.mass * (first[0] ** 2 + first[1] ** 2) + about * turning**2
        kinetic += self.toes.mass * (second[0] ** 2 + second[1] ** 2) + self.toes.inertia * bent**2
        height = self.foot.mass * hind[1] + self.toes.mass * (hinge[1] + toes[1])
        height += (self.foot.mass + self.toes.mass) * self.above * sine
        spring = 0.5 * (self.toes.stiffness + self.toes.sole_stiffness) * state[2] ** 2
        return 0.5 * kinetic + gravity * height + spring


def free(toes: Toes, around: Surroundings) -> Callable[[float, np.ndarray], list[float]]:
    """Rates of a foot with these toes on which no moment acts about the ankle."""

    def rates(time: float, state: np.ndarray) -> list[float]:
        found = accelerations(FOOT, toes, state[:2], state[2:], 0.0, around)
        return [state[1], found[0], state[3], found[1]]

    return rates


def swung(swing: Swing, start: list[float], end: float, moment: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    found = solve_ivp(
        lambda t, y: swing.rates(t, y, moment), (0.0, end), start, method="DOP853", rtol=1e-11, atol=1e-12,
        t_eval=np.linspace(0.0, end, 2001),
    )  # fmt: skip
    return found.t, found.y.T


@pytest.mark.parametrize("stiffness", [0.0, 3.0])
def test_a_double_pendulum_keeps_its_energy(stiffness: float) -> None:
    toes = Toes(HEAVY.hinge, HEAVY.mass, HEAVY.centre, HEAVY.inertia, 0.0, stiffness, 0.5 * stiffness, 0.0)
    swing = Swing(toes)
    time, states = swung(swing, [1.2, 0.0, -0.9, 4.0], 3.0)
    assert np.ptp(states[:, 2]) > 1.0
    energy = [swing.energy(t, state) for t, state in zip(time, states, strict=True)]
    assert np.ptp(energy) < 1e-8


def test_a_falling_foot_keeps_its_angular_momentum() -> None:
    """In free fall nothing turns a foot about an ankle without moment; the toes' spring turns within it."""
    toes = Toes(HEAVY.hinge, HEAVY.mass, HEAVY.centre, HEAVY.inertia, 0.0, 2.0, 0.0, 0.05)
    found = solve_ivp(
        free(toes, FALLING), (0.0, 2.0), [0.0, 3.0, 0.8, -5.0], rtol=1e-11, atol=1e-12, method="DOP853"
    )

    def momentum(state: np.ndarray) -> float:
        hinge, centre = turned(toes.hinge, state[0]), turned(toes.centre, state[0] + state[2])
        speed = (
            -state[1] * hinge[1] - (state[1] + state[3]) * centre[1],
            state[1] * hinge[0] + (state[1] + state[3]) * centre[0],
        )
        x, z = hinge[0] + centre[0], hinge[1] + centre[1]
        own = FOOT.inertia * state[1] + toes.inertia * (state[1] + state[3])
        return own + toes.mass * (x * speed[1] - z * speed[0])

    assert np.ptp([momentum(state) for state in found.y.T]) < 1e-10


def test_a_driven_foot_gains_what_the_ankle_and_the_moment_work() -> None:
    """Ankle and shank move; a constant moment M works M ψ̇ on the foot."""
    swing, moment = Swing(HEAVY, 0.2, 0.1, 0.6), 0.4
    time, states = swung(swing, [0.2, 1.0, 0.3, -2.0], 1.0, 0.0)
    energy = np.array([swing.energy(t, state) for t, state in zip(time, states, strict=True)])
    power = np.array([swing.power(t, state) for t, state in zip(time, states, strict=True)])
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))])
    assert np.ptp(energy) > 0.5
    assert energy - energy[0] == pytest.approx(work, abs=2e-4 * np.ptp(energy))
    still = Swing(HEAVY)
    time, states = swung(still, [0.2, 1.0, 0.3, -2.0], 1.0, moment)
    energy = np.array([still.energy(t, state) for t, state in zip(time, states, strict=True)])
    assert energy - energy[0] == pytest.approx(moment * (states[:, 0] - states[0, 0]), abs=1e-8)


def test_the_shanks_turning_is_felt_only_through_the_foots_own() -> None:
    """Without a moment about the ankle a foot moves in space as if the shank stood still."""
    start = [0.2, 1.0, 0.3, -2.0]
    _, states = swung(Swing(HEAVY), start, 1.0)
    turning = Swing(HEAVY, lean=0.6)
    time, other = swung(turning, [0.2, 1.0 + 0.6 * 7.0, 0.3, -2.0], 1.0)
    lean = 0.6 * np.sin(7.0 * time)
    assert other[:, 0] - lean == pytest.approx(states[:, 0], abs=1e-8)
    assert other[:, 2] == pytest.approx(states[:, 2], abs=1e-8)


def test_toes_on_a_held_foot_ring_at_their_own_rate() -> None:
    """√(k/I) of the toes about their hinge, and they decay with c/2I."""
    stiffness, sole, damping = 25.0, 7.0, 0.01
    toes = Toes(TOES.hinge, TOES.mass, TOES.centre, TOES.inertia, 0.0, stiffness, sole, damping)
    held = Foot(**{**vars(FOOT), "armature": 1e6})
    about = TOES.inertia + TOES.mass * (TOES.centre[0] ** 2 + TOES.centre[1] ** 2)
    decay = damping / (2.0 * about)
    rate = math.sqrt((stiffness + sole) / about - decay**2)
    swing = Swing(toes, foot=held)
    found = solve_ivp(
        lambda t, y: [y[1], accelerations(swing.foot, toes, (0.0, 0.0), y, 0.0, FALLING)[1]],
        (0.0, 0.05), [0.1, 0.0], rtol=1e-10, atol=1e-12, method="DOP853", t_eval=np.linspace(0.0, 0.05, 501),
    )  # fmt: skip
    wave = np.cos(rate * found.t) + decay / rate * np.sin(rate * found.t)
    assert found.y[0] == pytest.approx(0.1 * np.exp(-decay * found.t) * wave, abs=1e-7)


def test_a_free_foot_rings_with_its_toes() -> None:
    """The small motions of the two hinges: roots of det(K − ω² M), the bodies' masses written out."""
    toes = Toes(TOES.hinge, TOES.mass, TOES.centre, TOES.inertia, 1e-5, 25.0, 0.0, 0.0)
    x, z = (h + c for h, c in zip(toes.hinge, toes.centre, strict=True))
    about = toes.inertia + toes.mass * (toes.centre[0] ** 2 + toes.centre[1] ** 2)
    mixed = toes.inertia + toes.mass * (toes.centre[0] * x + toes.centre[1] * z)
    whole = FOOT.inertia + toes.inertia + toes.mass * (x**2 + z**2)
    rigid = mixed**2 / whole
    expected = math.sqrt(toes.stiffness / (about + toes.armature - rigid))  # without weight, the foot free
    found = solve_ivp(
        free(toes, FALLING), (0.0, 0.1), [0.0, 0.0, 1e-4, 0.0], rtol=1e-10, atol=1e-14, method="DOP853",
        t_eval=np.linspace(0.0, 0.1, 1001),
    )  # fmt: skip
    assert found.y[2] == pytest.approx(1e-4 * np.cos(expected * found.t), abs=1e-8)


def test_the_weight_of_resting_toes_is_on_both_hinges() -> None:
    """At rest the hinge carries m g x of the toes about it, the ankle all of the foot's."""
    toes = Toes(TOES.hinge, TOES.mass, TOES.centre, TOES.inertia, 0.0, 25.0, 7.0, 0.2)
    q = 0.1
    for _ in range(30):
        q = -toes.mass * GRAVITY * turned(toes.centre, q)[0] / 32.0
    far = toes.hinge[0] + turned(toes.centre, q)[0]
    weight = GRAVITY * (FOOT.mass * FOOT.centre[0] + toes.mass * far)
    assert accelerations(FOOT, toes, (0.0, 0.0), (q, 0.0), weight, STILL) == pytest.approx(
        (0.0, 0.0), abs=1e-9
    )
    assert math.degrees(q) == pytest.approx(-0.1, abs=0.03)


def test_the_rest_extension_is_the_published_curve_lifted_in_swing() -> None:
    waves = rest_extension(math.radians(11.0))
    degrees = np.degrees(series(waves, np.array(list(EXTENSION)) / 100.0))
    published = np.array(list(EXTENSION.values())) - FLAT
    flat = np.abs(np.array(list(EXTENSION)) - 28) <= 8
    assert np.abs(degrees[flat]).max() < 1.0
    assert degrees[list(EXTENSION).index(86)] == pytest.approx(11.0, abs=0.5)
    assert degrees[list(EXTENSION).index(60)] == pytest.approx(published.max() + 1.3, abs=1.5)
    h = 1e-6
    slope = (series(waves, np.array([0.3 + h])) - series(waves, np.array([0.3 - h]))) / (2.0 * h)
    assert series(waves, np.array([0.3]), 1) == pytest.approx(slope, rel=1e-5)


def test_a_shoe_stands_flat_at_its_level() -> None:
    """A drop of 10 mm turns the foot toe down inside the shoe: −3.1° on 185 mm; all stands at the floor."""
    stacks = {
        "heel_stack": 0.03,
        "ball_stack": 0.02,
        "heel_behind": 0.005,
        "tip_ahead": 0.012,
        "toe_spring": 0.015,
    }
    sole = shod(BARE, stacks)
    assert BARE.level == 0.0
    assert BARE.ankle_height == pytest.approx(0.068)
    assert math.degrees(sole.level) == pytest.approx(-math.degrees(math.atan2(0.01, 0.185)))
    pitch, straight = np.array([sole.level]), np.zeros(1)
    heights = sole.heights(np.array([sole.ankle_height]), pitch, straight)
    assert heights["heel"] == pytest.approx(0.0, abs=1e-12)
    assert heights["ball"] == pytest.approx(0.0, abs=1e-12)
    assert heights["tip"] == pytest.approx(0.015 * math.cos(sole.level), abs=1e-12)
    bent = sole.heights(np.array([sole.ankle_height]), pitch, np.array([0.3]))
    reach = math.hypot(sole.tip[0] - sole.hinge[0], sole.tip[1] - sole.hinge[1])
    slope = math.atan2(sole.tip[1] - sole.hinge[1], sole.tip[0] - sole.hinge[0]) + sole.level
    assert bent["tip"] - heights["tip"] == pytest.approx(reach * (math.sin(slope + 0.3) - math.sin(slope)))
