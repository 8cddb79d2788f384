"""Friction beside the static force: signs, memory, energy, and what the published formulas say."""

import itertools
import math

import numba
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from afo_sim.physics import FRICTIONS, Braid, register_all
from afo_sim.physics.friction.bouc_wen import bouc_wen_pressure, bouc_wen_rate
from afo_sim.physics.friction.hunt import hunt_dead_band
from afo_sim.physics.friction.maxwell_slip import (
    maxwell_slip_elements,
    maxwell_slip_pressure,
    maxwell_slip_rates,
)
from afo_sim.physics.friction.tondu_lopez import SURFACE_LIMIT, contact_surface, tondu_lopez_friction
from afo_sim.physics.laws.tondu_lopez import tondu_lopez_2000

BRAID = Braid(0.1631, 5.75e-3, math.radians(22.0))  # S1's long muscle
GEOMETRY = (BRAID.nominal_length, BRAID.nominal_radius, BRAID.b)
FS, FK, VS, VR = 0.015, 0.105, 0.15, 1e-4  # Tondu & Lopez 2000; the creep velocity is this project's
STRIBECK = (*GEOMETRY, FS, FK, VS, VR)
Q = 16e3  # half loop of a Festo Ø10 [Pa]
S = 0.02  # pre-sliding contraction [-]
K = Q / (2.5 * S)  # stiffness of one element
H = 1e-3  # [s]

# Values that every model is tried with; of a parameter of another name the typical one.
TRIED = {
    "static_coefficient": FS,
    "kinetic_coefficient": FK,
    "stribeck_velocity": VS,
    "creep_velocity": VR,
    "dead_band": Q,
    "presliding_contraction": S,
    "creep_rate": 1e-3,
}
every_friction = pytest.mark.parametrize("model", list(FRICTIONS.values()), ids=list(FRICTIONS))
with_memory = pytest.mark.parametrize(
    "model", [f for f in FRICTIONS.values() if f.n_state], ids=lambda f: f.name
)


def _tried(model):
    return {p.name: TRIED.get(p.name, p.typical) for p in model.parameters}


def _coefficients(model):
    return model.coefficients(BRAID, _tried(model))


def _walk(model, turning_points, step, timestep=H, state=None, coefficients=None):
    """Along straight lines between turning points of κ, from rest: (κ, friction, states) at each step."""
    coefficients = coefficients or _coefficients(model)
    z = [0.0] * model.n_state if state is None else list(state)
    rows = []
    for start, end in itertools.pairwise(turning_points):
        n = max(1, round(abs(end - start) / step))
        rate = (end - start) / n / timestep
        for i in range(n):
            value, _ = model.evaluate(start, rate, 4e5, z, coefficients, timestep)
            rates = model.rates(rate, z, coefficients, timestep)
            z = [a + timestep * b for a, b in zip(z, rates, strict=True)]
            rows.append((start + (end - start) * (i + 1) / n, value, *z))
    return np.array(rows)


def _virgin(travel):
    """Four elements of equal stiffness, slipping at 1/4 … 4/4 of S: 0.4, 0.7, 0.9, 1 of the dead band."""
    return Q * np.interp(travel / S, [0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 0.4, 0.7, 0.9, 1.0])


def _random_paths(n, seed, closed):
    random = np.random.default_rng(seed)
    for _ in range(n):
        points = np.concatenate([[0.0], random.uniform(-2.5 * S, 2.5 * S, random.integers(3, 9))])
        yield (*points, 0.0) if closed else tuple(points)


# --- signs ------------------------------------------------------------------------------------------


@every_friction
def test_a_contracting_muscle_pulls_with_less_force(model):
    contracting = _walk(model, (0.1 - 2.0 * S, 0.1), S / 50.0)[-1]
    extending = _walk(model, (0.1 + 2.0 * S, 0.1), S / 50.0)[-1]
    assert contracting[1] > 0.0 > extending[1]
    # the way there and back are alike: friction is odd in rate and state together
    for rate in (1e-5, 0.02, 1.0):
        there, back = (
            model.evaluate(0.1, s * rate, 4e5, s * contracting[2:] / 2.0, _coefficients(model), H)[0]
            for s in (1.0, -1.0)
        )
        assert back == pytest.approx(-there, rel=1e-12)


@pytest.mark.parametrize("name", ["tondu_lopez_2000_stribeck", "hunt_2017"])
def test_friction_without_memory_never_drives(name):
    model = FRICTIONS[name]
    for kappa in (-0.2, 0.0, 0.1, 0.3, 1.0, 2.0):
        for rate in (-10.0, -0.3, -1e-4, -1e-9, 0.0, 1e-9, 1e-4, 0.3, 10.0):
            for pressure in (-5e4, 0.0, 1e5, 6e5):
                value, slope = model.evaluate(kappa, rate, pressure, (), _coefficients(model), H)
                assert value * rate >= 0.0
                assert slope >= 0.0


# --- Tondu & Lopez ----------------------------------------------------------------------------------


def test_contact_surface_is_that_of_a_constant_number_of_rhombi():
    # Threads of width d crossing at 2α share d²/sin 2α; at rest the contact is the whole mantle.
    alpha0 = BRAID.braid_angle
    mantle = 2.0 * math.pi * BRAID.nominal_radius * BRAID.nominal_length
    for alpha in np.radians(np.linspace(12.0, 75.0, 64)):
        kappa = 1.0 - math.cos(alpha) / math.cos(alpha0)
        expected = mantle * math.sin(2.0 * alpha0) / math.sin(2.0 * alpha)
        assert contact_surface(kappa, *GEOMETRY) == pytest.approx(expected, rel=1e-12)
        x = 1.0 - kappa  # as published
        printed = mantle * math.sin(alpha0) / (x * math.sqrt(1.0 - math.cos(alpha0) ** 2 * x * x))
        assert contact_surface(kappa, *GEOMETRY) == pytest.approx(printed, rel=1e-12)
    assert contact_surface(0.0, *GEOMETRY) == pytest.approx(mantle, rel=1e-14)


def test_contact_surface_is_bounded_and_continuous_beyond_lock_and_at_no_length():
    limit = SURFACE_LIMIT * contact_surface(0.0, *GEOMETRY)
    lock = 1.0 - 1.0 / math.cos(BRAID.braid_angle)
    for kappa in (lock, lock - 1e-9, -1.0, -1e300, 1.0, 1.0 + 1e-9, 1.5, 5.0, 1e300):
        assert contact_surface(kappa, *GEOMETRY) == pytest.approx(limit, rel=1e-14)

    def largest_jump(n):
        return np.max(np.abs(np.diff([contact_surface(k, *GEOMETRY) for k in np.linspace(-0.2, 1.2, n)])))

    assert largest_jump(64_001) < 0.51 * largest_jump(32_001)


@pytest.mark.parametrize("degrees", [10.0, 20.0, 37.0, 45.0, 50.0])
def test_the_bound_on_the_surface_is_out_of_reach_of_a_working_muscle(degrees):
    braid = Braid(0.2, 5e-3, math.radians(degrees))
    slack = 1.0 - math.sqrt(1.0 / 3.0) / math.cos(braid.braid_angle)  # κ at 54.74°
    geometry = (braid.nominal_length, braid.nominal_radius, braid.b)
    rest = contact_surface(0.0, *geometry)
    for kappa in np.linspace(0.0, slack, 51):
        assert contact_surface(kappa, *geometry) <= 1.0607 * rest


@pytest.mark.parametrize(("static", "kinetic"), [(0.015, 0.105), (0.2, 0.1)])
def test_stribeck_limits(static, kinetic):
    """f_s far below v_s, f_k far above it, and the e-fold in between."""

    def coefficient(velocity):
        args = (*GEOMETRY, static, kinetic, VS, 1e-7)
        force, _ = tondu_lopez_friction(0.1, velocity / BRAID.nominal_length, 4e5, *args)
        return force / (contact_surface(0.1, *GEOMETRY) * 4e5)

    for sign in (1.0, -1.0):
        assert coefficient(sign * 1e-5) == pytest.approx(sign * static, rel=1e-3)
        assert coefficient(sign * 50.0 * VS) == pytest.approx(sign * kinetic, rel=1e-12)
        between = kinetic + (static - kinetic) / math.e
        assert coefficient(sign * VS) == pytest.approx(sign * between, rel=1e-12)
    assert coefficient(0.0) == 0.0


def test_stribeck_friction_of_s1_muscle():
    # By hand: mantle 2π · 5.75 mm · 163.1 mm = 58.92 cm², times 4 bar, times 0.015 = 35.4 N, against
    # π r0² p (a − b) = 467.6 N of static force: the creeping muscle loses 7.6 %.
    creeping, _ = tondu_lopez_friction(0.0, 1e-3 / BRAID.nominal_length, 4e5, *GEOMETRY, FS, FS, VS, VR)
    assert creeping == pytest.approx(35.4, abs=0.05)
    static = tondu_lopez_2000(0.0, 4e5, BRAID.nominal_radius, BRAID.b, 1.0)
    assert creeping / static == pytest.approx(0.076, abs=0.001)


def test_no_friction_without_pressure():
    assert tondu_lopez_friction(0.1, 0.3, 0.0, *STRIBECK) == (0.0, 0.0)
    assert tondu_lopez_friction(0.1, 0.3, -1e4, *STRIBECK) == (0.0, 0.0)


# --- Hunt -------------------------------------------------------------------------------------------


def test_hunt_needs_more_pressure_to_shorten():
    # P = … + 15.6 kPa S: between shortening and lengthening 31.2 kPa, at rest in the middle.
    assert hunt_dead_band(0.1, 15.6e3, 1e-3)[0] - hunt_dead_band(-0.1, 15.6e3, 1e-3)[0] == pytest.approx(
        31.2e3
    )
    assert hunt_dead_band(0.0, 15.6e3, 1e-3)[0] == 0.0
    assert hunt_dead_band(1e-3, 15.6e3, 1e-3)[0] == pytest.approx(15.6e3 * math.tanh(1.0))


# --- Maxwell slip -----------------------------------------------------------------------------------


def test_elements_share_stiffness_slip_at_quarters_and_add_up():
    stiffness, *limits = maxwell_slip_elements(Q, S)
    assert sum(limits) == pytest.approx(Q, rel=1e-14)
    for i, limit in enumerate(limits, start=1):
        assert limit / stiffness == pytest.approx(i / 4 * S, rel=1e-12)


def test_virgin_curve_and_saturation():
    rows = _walk(FRICTIONS["vo_minh_2011"], (0.0, 3.0 * S), S / 40.0)
    assert rows[:, 1] == pytest.approx(_virgin(rows[:, 0]), abs=1e-9 * Q)
    assert rows[-1, 1] == pytest.approx(Q, rel=1e-12)
    assert np.max(rows[:, 1]) <= Q * (1.0 + 1e-12)


@pytest.mark.parametrize("peak", [0.3, 0.6, 1.0, 1.7])
def test_masing(peak):
    """After a turning point the path is the virgin curve at twice its size; so is the way back."""
    peak *= S
    top = float(_virgin(peak))
    down, up = (
        _walk(FRICTIONS["vo_minh_2011"], points, S / 40.0)
        for points in ((0.0, peak, -peak), (0.0, peak, -peak, peak))
    )
    down = down[-round(2.0 * peak / (S / 40.0)) :]
    assert down[:, 1] == pytest.approx(top - 2.0 * _virgin((peak - down[:, 0]) / 2.0), abs=1e-9 * Q)
    up = up[-round(2.0 * peak / (S / 40.0)) :]
    assert up[:, 1] == pytest.approx(-top + 2.0 * _virgin((up[:, 0] + peak) / 2.0), abs=1e-9 * Q)
    assert up[-1, 1] == pytest.approx(top, rel=1e-9)


def test_a_closed_minor_loop_leaves_no_trace():
    """Non-local memory: minor loops, also nested ones, are wiped out when they close."""
    model, step = FRICTIONS["vo_minh_2011"], S / 40.0
    outer = _walk(model, (0.0, 1.5 * S, -1.5 * S, 0.2 * S, 1.5 * S), step)
    for detour in (
        (0.2, -0.3, 0.2),
        (0.2, -0.5, 0.1, -0.2, 0.1, -0.5, 0.2),  # a loop within a loop
        (0.2, -1.4, 0.2),
    ):
        points = (0.0, 1.5 * S, -1.5 * S, *(S * d for d in detour), 1.5 * S)
        inner = _walk(model, points, step)
        n = round(1.3 * S / step)
        assert inner[-n:] == pytest.approx(outer[-n:], abs=1e-9 * Q)
    # and a minor loop that has not closed does show
    open_loop = _walk(model, (0.0, 1.5 * S, -1.5 * S, 0.2 * S, -0.3 * S, 0.1 * S), step)
    on_the_way = outer[
        np.argmin(np.abs(outer[-round(3.0 * S / step) :, 0] - 0.1 * S)) - round(3.0 * S / step)
    ]
    assert on_the_way[0] == pytest.approx(0.1 * S, abs=1e-12)
    assert abs(open_loop[-1, 1] - on_the_way[1]) > 0.01 * Q


def test_small_motion_sticks():
    """Within S/4 of rest all four elements stick: an elastic spring, no loop at all."""
    rows = _walk(FRICTIONS["vo_minh_2011"], (0.0, 0.2 * S, -0.2 * S, 0.1 * S), S / 40.0)
    assert rows[:, 1] == pytest.approx(4.0 * K * rows[:, 0], abs=1e-9 * Q)


def test_loss_per_cycle_is_that_of_the_blocks():
    # In a cycle of amplitude a ≥ S block i slides 4 (a − W_i/k) against W_i.
    amplitude = 1.5 * S
    stiffness, *limits = maxwell_slip_elements(Q, S)
    expected = sum(4.0 * w * (amplitude - w / stiffness) for w in limits)
    rows = _walk(FRICTIONS["vo_minh_2011"], (0.0, amplitude, -amplitude, amplitude), S / 40.0)
    cycle = rows[round(amplitude / (S / 40.0)) - 1 :]
    assert np.trapezoid(cycle[:, 1], cycle[:, 0]) == pytest.approx(expected, rel=1e-9)


@with_memory
def test_euler_is_exact_at_any_step(model):
    """At the turning points the states do not depend on the steps in between, nor on their size."""
    points = tuple(S * x for x in (0.0, 1.5, -0.4, 0.3, -0.2, 1.1, -2.0, 0.0))
    ends = [_walk(model, points, step)[-1, 1:] for step in (10.0 * S, 0.1 * S, 0.0125 * S)]
    assert ends[1] == pytest.approx(ends[0], abs=1e-10 * Q)
    assert ends[2] == pytest.approx(ends[0], abs=1e-10 * Q)


def test_maxwell_rates_give_the_clamped_update():
    random = np.random.default_rng(3)
    stiffness, *limits = maxwell_slip_elements(Q, S)
    for _ in range(300):
        q = random.uniform(-1.0, 1.0, 4) * limits
        timestep = 10.0 ** random.uniform(-5.0, 0.0)
        rate = random.normal() * S / timestep
        new = q + timestep * np.array(maxwell_slip_rates(rate, *q, stiffness, Q, timestep))
        expected = np.clip(q + stiffness * rate * timestep, -np.array(limits), limits)
        assert new == pytest.approx(expected, abs=1e-11 * Q)
        assert maxwell_slip_pressure(rate, *q, stiffness, Q, timestep)[0] == pytest.approx(
            expected.sum(), abs=1e-11 * Q
        )


# --- Bouc and Wen -----------------------------------------------------------------------------------


def test_bouc_wen_rate_is_the_published_equation():
    """ż = A κ̇ − β |κ̇| |z|^(n−1) z − γ κ̇ |z|^n, n = 1, A = Q/s, β = γ = A/(2 Q), for small steps."""
    a, beta = Q / S, 0.5 / S
    for z in np.linspace(-1.0, 1.0, 9) * Q:
        for rate in (-0.7, -0.01, 0.01, 0.7):
            expected = a * rate - beta * abs(rate) * z - beta * rate * abs(z)
            assert bouc_wen_rate(rate, z, Q, S, 1e-9) == pytest.approx(
                expected, abs=2e-6 * a * abs(rate) + 1e-2
            )


def test_bouc_wen_step_is_the_solution_of_the_equation():
    a, beta = Q / S, 0.5 / S
    for z0 in (-Q, -0.3 * Q, 0.0, 0.8 * Q):
        for travel in (-1.7 * S, -0.2 * S, 0.2 * S, 1.7 * S):
            solution = solve_ivp(
                lambda _, z, v=travel: a * v - beta * abs(v) * z - beta * v * np.abs(z),
                (0.0, 1.0),
                [z0],
                rtol=1e-10,
                atol=1e-8 * Q,
                max_step=0.01,
            )
            assert bouc_wen_pressure(travel, z0, Q, S, 1.0)[0] == pytest.approx(
                solution.y[0, -1], abs=1e-5 * Q
            )


def test_bouc_wen_saturates_and_never_overshoots():
    assert bouc_wen_pressure(1.0, 0.0, Q, S, S)[0] == pytest.approx(Q * (1.0 - 1.0 / math.e), rel=1e-12)
    for z in np.linspace(-1.0, 1.0, 21) * Q:
        for travel in (1e-6, 0.1, 1.0, 30.0, 1e6):
            for sign in (1.0, -1.0):
                end = bouc_wen_pressure(sign * travel * S / H, z, Q, S, H)[0]
                assert abs(end) <= Q * (1.0 + 1e-15)
                assert sign * (end - z) >= 0.0  # always against the motion's further course
                if travel >= 30.0 + 2.0:
                    assert end == pytest.approx(sign * Q, rel=1e-12)


def test_bouc_wen_steady_loop():
    # From −y to +y over 2 a: straight for y s, then y = 1 − e^(y − 2 a/s).
    for amplitude in (0.3, 1.0, 3.0):
        y = brentq(lambda y, a=amplitude: y - 1.0 + math.exp(y - 2.0 * a), 0.0, 1.0 - 1e-9)
        points = (0.0, *(s * amplitude * S for _ in range(60) for s in (1.0, -1.0)))
        rows = _walk(FRICTIONS["bouc_wen_1976"], points, S / 4.0)
        assert rows[-1, 1] == pytest.approx(-y * Q, rel=1e-6)


# --- laws for every model ---------------------------------------------------------------------------


@with_memory
@pytest.mark.parametrize("amplitude", [0.5, 2.0])
def test_cyclic_loops_close_and_do_not_know_speed(model, amplitude):
    points = (0.0, *(s * amplitude * S for _ in range(30) for s in (1.0, -1.0)))
    slow, fast = (_walk(model, points, S / 20.0, timestep) for timestep in (0.1, 1e-3))
    assert slow == pytest.approx(fast, abs=1e-9 * Q)
    n = 2 * round(2.0 * amplitude * 20.0)
    assert slow[-n:] == pytest.approx(slow[-2 * n : -n], abs=1e-6 * Q)
    assert np.trapezoid(slow[-n - 1 :, 1], slow[-n - 1 :, 0]) > 0.0


@every_friction
def test_a_closed_path_costs_work(model):
    for points in _random_paths(40, 1, closed=True):
        rows = np.vstack([np.zeros(2 + model.n_state), _walk(model, points, S / 30.0)])
        # a memory is taken at both ends of a step; what knows the rate alone is constant over it
        work = np.sum(rows[1:, 1] * np.diff(rows[:, 0]))
        if model.n_state:
            work = min(work, np.trapezoid(rows[:, 1], rows[:, 0]))
        assert work >= 0.0


@with_memory
@pytest.mark.parametrize("step", [1.0, 0.03])
def test_never_more_energy_out_than_in(model, step):
    """Passive at any step: Σ q Δκ with q at the end of the step covers what the springs still hold."""
    for points in _random_paths(60, 2, closed=False):
        rows = np.vstack([np.zeros(2 + model.n_state), _walk(model, points, step * S)])
        work = np.cumsum(rows[1:, 1] * np.diff(rows[:, 0]))
        stiffness = K if model.n_state == 4 else Q / S
        stored = np.sum(rows[1:, 2:] ** 2, axis=1) / (2.0 * stiffness)
        assert np.all(work - stored >= -1e-9 * Q * S)


@with_memory
def test_a_body_held_by_friction_does_not_gain_energy(model):
    """A mass on the stuck muscle swings on; with friction from the start of the step it would swing up.

    With a = h² k/m: friction at the end of the step bounds |v|² by v0²/(1 − a/4), and with its
    derivative taken implicitly by v0²/(1 − a/(4 (1 + a))) ≤ 4/3 v0², whatever the step.
    """
    coefficients = _coefficients(model)
    stiffness = 4.0 * K if model.n_state == 4 else Q / S

    def swing(a, at_end, implicit):
        mass, v0 = H * H * stiffness / a, 0.02 * S / H  # a push that the elements can take without slipping
        v, z, fastest = v0, [0.0] * model.n_state, 0.0
        for _ in range(300):
            value, damping = model.evaluate(0.0, v if at_end else 0.0, 4e5, z, coefficients, H)
            z = [q + H * r for q, r in zip(z, model.rates(v, z, coefficients, H), strict=True)]
            v -= H * value / (mass + H * damping * implicit)
            fastest = max(fastest, abs(v))
        return fastest / v0

    assert swing(0.5, at_end=False, implicit=False) > 2.0
    assert swing(0.5, at_end=True, implicit=False) <= math.sqrt(1.0 / (1.0 - 0.5 / 4.0))
    for a in (0.5, 5.0, 100.0):
        assert swing(a, at_end=True, implicit=True) <= math.sqrt(1.0 / (1.0 - a / 4.0 / (1.0 + a)))


@every_friction
def test_derivative_is_the_slope_by_contraction_rate(model):
    random = np.random.default_rng(4)
    coefficients = _coefficients(model)
    for _ in range(200):
        z = random.uniform(-0.1, 0.1, 4)[: model.n_state] * Q
        rate = random.choice([1e-4, 1e-3, 3e-2, 1.0]) * random.normal()
        kappa = random.uniform(-0.1, 0.4)
        step = 1e-5 * abs(rate)
        above, below = (
            model.evaluate(kappa, rate + s * step, 4e5, z, coefficients, 0.03)[0] for s in (1.0, -1.0)
        )
        slope = model.evaluate(kappa, rate, 4e5, z, coefficients, 0.03)[1]
        steepest = abs(model.evaluate(kappa, 0.0, 4e5, 0.0 * z, coefficients, 0.03)[1])
        assert slope == pytest.approx((above - below) / (2.0 * step), rel=1e-5, abs=1e-6 * steepest)


@every_friction
def test_friction_falls_no_faster_than_stated(model):
    for tried in ({}, {"static_coefficient": FK, "kinetic_coefficient": FS}):  # the second falls with speed
        values = _tried(model) | {name: v for name, v in tried.items() if name in _tried(model)}
        coefficients, z = model.coefficients(BRAID, values), [0.0] * model.n_state
        slopes = [
            model.evaluate(0.0, rate, 4e5, z, coefficients, H)[1] for rate in np.geomspace(1e-6, 1e2, 400)
        ]
        fall, found = model.steepest_fall(BRAID, values, 4e5), -min(slopes) / BRAID.nominal_length
        assert found <= fall * (1.0 + 1e-9)
        if fall > 0.0:
            assert found > 0.95 * fall  # and not much slower either


def test_only_a_falling_coefficient_falls():
    model = FRICTIONS["tondu_lopez_2000_stribeck"]
    values = _tried(model)
    assert model.steepest_fall(BRAID, values, 4e5) == 0.0
    values["static_coefficient"] = FK + 0.015
    expected = 0.015 / VS * contact_surface(0.0, *GEOMETRY) * 4e5
    assert model.steepest_fall(BRAID, values, 4e5) == pytest.approx(expected, rel=1e-12)


@every_friction
def test_nan_comes_out(model):
    """Of every argument and coefficient, moving, at rest, stuck and slipping."""
    good = [0.1, 0.3, 4e5, *[0.05 * Q] * model.n_state, *_coefficients(model), H]
    n = 3 + model.n_state
    used = {0, 2} if model.unit == "Pa" else set()  # κ and p have no say in a friction pressure
    used |= {len(good) - 1} if not model.n_state else set()  # nor the step where there is no memory
    for rate in (0.0, 0.3, -0.3, 1e6, -1e6):
        good[1] = rate
        for i in set(range(len(good))) - used:
            bad = [*good[:i], math.nan, *good[i + 1 :]]
            value, _ = model.evaluate(*bad[:3], bad[3:n], tuple(bad[n:-1]), bad[-1])
            assert math.isnan(value), (i, rate)
            if model.n_state and i not in (0, 2):
                rates = model.rates(bad[1], bad[3:n], tuple(bad[n:-1]), bad[-1])
                if 3 <= i < n:
                    assert math.isnan(rates[i - 3])
                else:
                    assert all(map(math.isnan, rates)), (i, rate)


@every_friction
def test_finite_at_any_finite_state_of_motion(model):
    extremes = (-1e308, -1e12, -1.0, -1e-308, 0.0, 1e-308, 1.0, 1e12, 1e308)
    corners = [{p.name: getattr(p, side) for p in model.parameters} for side in ("lower", "upper")]
    for values in corners:
        coefficients = model.coefficients(BRAID, values)
        for kappa in extremes:
            for rate in extremes:
                for pressure in (-1e9, 0.0, 1e9):
                    for z in (-1e12, 0.0, 0.3 * Q, 1e12):
                        state = [z] * model.n_state
                        result = model.evaluate(kappa, rate, pressure, state, coefficients, H)
                        assert all(map(math.isfinite, (*result, *model.rates(rate, state, coefficients, H))))


@with_memory
def test_a_state_beyond_the_dead_band_comes_back_in_one_step(model):
    for z in (-1e9, 1e9):
        for rate in (-1e-3, 0.0, 1e-3):
            value, _ = model.evaluate(0.1, rate, 4e5, [z] * model.n_state, _coefficients(model), H)
            assert abs(value) == pytest.approx(Q, rel=1e-3)
            rates = model.rates(rate, [z] * model.n_state, _coefficients(model), H)
            assert z * model.n_state + H * sum(rates) == pytest.approx(value, abs=1e-5)


# --- compiled ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_compiled_is_python():
    random = np.random.default_rng(5)
    register_all()

    @numba.njit
    def compiled(a, b, c):
        return (
            (contact_surface(a[0], a[1], a[2], a[3]),),
            tondu_lopez_friction(b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8], b[9]),
            hunt_dead_band(c[0], c[5], c[6]),
            maxwell_slip_elements(c[5], c[6]),
            maxwell_slip_rates(c[0], c[1], c[2], c[3], c[4], c[7], c[5], c[8]),
            maxwell_slip_pressure(c[0], c[1], c[2], c[3], c[4], c[7], c[5], c[8]),
            bouc_wen_pressure(c[0], c[1], c[5], c[6], c[8]),
            (bouc_wen_rate(c[0], c[1], c[5], c[6], c[8]),),
        )

    for _ in range(200):
        kappa, rate = random.uniform(-0.2, 1.1), random.choice([1e-4, 1e-2, 1.0]) * random.normal()
        q = random.uniform(-0.4, 0.4, 4) * Q
        a = (kappa, *GEOMETRY)
        b = (kappa, rate, random.uniform(-1e4, 6e5), *STRIBECK)
        c = (rate, *map(float, q), Q, S, K, 10.0 ** random.uniform(-4.0, 0.0))
        for native, plain in zip(compiled(a, b, c), compiled.py_func(a, b, c), strict=True):
            assert native == pytest.approx(plain, rel=1e-12, abs=1e-12 * Q)


# --- registry ---------------------------------------------------------------------------------------


@every_friction
def test_a_friction_says_what_it_is_and_has_as_many_rates_as_states(model):
    assert model.formula and model.validity and model.source
    state = [0.0] * model.n_state
    assert len(model.rates(0.1, state, _coefficients(model), H)) == model.n_state


@every_friction
def test_every_parameter_is_live(model):
    values = _tried(model)
    z = [0.02 * Q] * model.n_state

    def answers(changed):
        coefficients = model.coefficients(BRAID, changed)
        return [model.evaluate(0.1, rate, 4e5, z, coefficients, 5e-3)[0] for rate in (1e-4, 0.02, 0.9)]

    for name in values:
        assert answers(values) != answers({**values, name: 1.1 * values[name]}), name


@with_memory
def test_zero_dead_band_is_no_friction(model):
    coefficients = model.coefficients(BRAID, {"dead_band": 0.0, "presliding_contraction": S})
    rows = _walk(model, (0.0, S, -S), S / 3.0, coefficients=coefficients)
    assert np.all(rows[:, 1:] == 0.0)
