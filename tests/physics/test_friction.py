"""Friction beside the static force: signs, memory, energy, and what the published formulas say."""

import itertools
import math

import numba
import numpy as np
import pytest

from afo_sim.physics import FRICTIONS, Braid, register_all
from afo_sim.physics.friction.hunt import hunt_friction
from afo_sim.physics.friction.maxwell_slip import (
    ELEMENT_SHARES,
    maxwell_slip_force,
    maxwell_slip_rates,
    presliding_stiffness,
)
from afo_sim.physics.friction.tondu_lopez import SURFACE_LIMIT, contact_surface, tondu_lopez_friction
from afo_sim.physics.laws.tondu_lopez import tondu_lopez_2000

BRAID = Braid(0.1631, 5.75e-3, math.radians(22.0))  # S1's long muscle
GEOMETRY = (BRAID.nominal_length, BRAID.nominal_radius, BRAID.b)
FS, FK, VS, VR = 0.015, 0.105, 0.15, 1e-4  # Tondu & Lopez 2000; the creep velocity is this project's
STRIBECK = (*GEOMETRY, FS, FK, VS, VR)
Q = 16e3  # half loop of a Festo Ø10 [Pa]
S = 0.02  # pre-sliding contraction [-]
W = math.pi * BRAID.nominal_radius**2 * (2.0 * BRAID.b - 3.0) * Q  # what Q weakens it by at rest [N]
K = W / (2.5 * S)  # stiffness of one element [N]
LIMITS = W * np.array(ELEMENT_SHARES)
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
MAXWELL = FRICTIONS["maxwell_slip"]
every_friction = pytest.mark.parametrize("model", list(FRICTIONS.values()), ids=list(FRICTIONS))
with_memory = pytest.mark.parametrize(
    "model", [f for f in FRICTIONS.values() if f.n_state], ids=lambda f: f.name
)


def _tried(model):
    return {p.name: TRIED.get(p.name, p.typical) for p in model.parameters}


def _coefficients(model):
    return model.coefficients(BRAID, _tried(model))


def _answer(model, rate, state, coefficients, timestep=H, kappa=0.1, pressure=4e5, yields=W):
    """Friction at the end of a step, and its derivative by κ̇ or, of a model with a memory, by Δκ."""
    moved = rate * timestep if model.n_state else rate
    motion = (kappa, rate, pressure) if model.unit == "N" else (yields, moved)
    return model.kernel(*motion, *state, *coefficients)


def _rates(model, rate, state, coefficients, timestep=H, yields=W):
    """Rates of the states, as many as there are."""
    if not model.n_state:
        return ()
    found = model.rate_kernel(yields, rate * timestep, *state, *coefficients, timestep)
    return found if model.n_state > 1 else (found,)


def _walk(model, turning_points, step, timestep=H, coefficients=None, yields=W):
    """Along straight lines between turning points of κ, from rest: (κ, friction, states) at each step."""
    coefficients = coefficients or _coefficients(model)
    z = [0.0] * model.n_state
    rows = []
    for start, end in itertools.pairwise(turning_points):
        n = max(1, round(abs(end - start) / step))
        rate = (end - start) / n / timestep
        for i in range(n):
            value, _ = _answer(model, rate, z, coefficients, timestep, start, yields=yields)
            rates = _rates(model, rate, z, coefficients, timestep, yields)
            z = [a + timestep * b for a, b in zip(z, rates, strict=True)]
            rows.append((start + (end - start) * (i + 1) / n, value, *z))
    return np.array(rows)


def _virgin(travel):
    """Four elements of equal stiffness, slipping at 1/4 … 4/4 of S: 0.4, 0.7, 0.9, 1 of the yield force."""
    return W * np.interp(travel / S, [0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 0.4, 0.7, 0.9, 1.0])


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
            _answer(model, s * rate, s * contracting[2:] / 2.0, _coefficients(model))[0] for s in (1.0, -1.0)
        )
        assert back == pytest.approx(-there, rel=1e-12)


@pytest.mark.parametrize("name", ["tondu_lopez_2000_stribeck", "hunt_2017"])
def test_friction_without_memory_never_drives(name):
    model = FRICTIONS[name]
    for kappa in (-0.2, 0.0, 0.1, 0.3, 1.0, 2.0):
        for rate in (-10.0, -0.3, -1e-4, -1e-9, 0.0, 1e-9, 1e-4, 0.3, 10.0):
            for pressure in (-5e4, 0.0, 1e5, 6e5):
                value, slope = _answer(model, rate, (), _coefficients(model), kappa=kappa, pressure=pressure)
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


def test_hunt_weakens_by_its_dead_band_either_way():
    # P = … + 15.6 kPa S: shortening as at p − Q, lengthening as much stronger, at rest in the middle
    assert hunt_friction(12.0, 0.1, 15.6e3, 1e-3)[0] == pytest.approx(12.0)
    assert hunt_friction(12.0, -0.1, 15.6e3, 1e-3)[0] == pytest.approx(-12.0)
    assert hunt_friction(12.0, 0.0, 15.6e3, 1e-3) == (0.0, pytest.approx(12.0 / 1e-3))
    assert hunt_friction(12.0, 1e-3, 15.6e3, 1e-3)[0] == pytest.approx(12.0 * math.tanh(1.0))


# --- Maxwell slip -----------------------------------------------------------------------------------


def test_elements_share_stiffness_slip_at_quarters_and_add_up():
    stiffness = presliding_stiffness(BRAID, Q, S)
    assert stiffness == pytest.approx(K, rel=1e-14)
    assert LIMITS.sum() == pytest.approx(W, rel=1e-14)
    for i, limit in enumerate(LIMITS, start=1):
        assert limit / stiffness == pytest.approx(i / 4 * S, rel=1e-12)
    # the force that Q takes from the muscle at rest, by a law
    at, less = (tondu_lopez_2000(0.0, p, BRAID.nominal_radius, BRAID.b, 1.0) for p in (4e5, 4e5 - Q))
    assert at - less == pytest.approx(W, rel=1e-12)


def test_virgin_curve_and_saturation():
    rows = _walk(MAXWELL, (0.0, 3.0 * S), S / 40.0)
    assert rows[:, 1] == pytest.approx(_virgin(rows[:, 0]), abs=1e-9 * W)
    assert rows[-1, 1] == pytest.approx(W, rel=1e-12)
    assert np.max(rows[:, 1]) <= W * (1.0 + 1e-12)


@pytest.mark.parametrize("peak", [0.3, 0.6, 1.0, 1.7])
def test_masing(peak):
    """After a turning point the path is the virgin curve at twice its size; so is the way back."""
    peak *= S
    top = float(_virgin(peak))
    down, up = (_walk(MAXWELL, points, S / 40.0) for points in ((0.0, peak, -peak), (0.0, peak, -peak, peak)))
    down = down[-round(2.0 * peak / (S / 40.0)) :]
    assert down[:, 1] == pytest.approx(top - 2.0 * _virgin((peak - down[:, 0]) / 2.0), abs=1e-9 * W)
    up = up[-round(2.0 * peak / (S / 40.0)) :]
    assert up[:, 1] == pytest.approx(-top + 2.0 * _virgin((up[:, 0] + peak) / 2.0), abs=1e-9 * W)
    assert up[-1, 1] == pytest.approx(top, rel=1e-9)


def test_a_closed_minor_loop_leaves_no_trace():
    """Non-local memory: minor loops, also nested ones, are wiped out when they close."""
    model, step = MAXWELL, S / 40.0
    outer = _walk(model, (0.0, 1.5 * S, -1.5 * S, 0.2 * S, 1.5 * S), step)
    for detour in (
        (0.2, -0.3, 0.2),
        (0.2, -0.5, 0.1, -0.2, 0.1, -0.5, 0.2),  # a loop within a loop
        (0.2, -1.4, 0.2),
    ):
        points = (0.0, 1.5 * S, -1.5 * S, *(S * d for d in detour), 1.5 * S)
        inner = _walk(model, points, step)
        n = round(1.3 * S / step)
        assert inner[-n:] == pytest.approx(outer[-n:], abs=1e-9 * W)
    # and a minor loop that has not closed does show
    open_loop = _walk(model, (0.0, 1.5 * S, -1.5 * S, 0.2 * S, -0.3 * S, 0.1 * S), step)
    on_the_way = outer[
        np.argmin(np.abs(outer[-round(3.0 * S / step) :, 0] - 0.1 * S)) - round(3.0 * S / step)
    ]
    assert on_the_way[0] == pytest.approx(0.1 * S, abs=1e-12)
    assert abs(open_loop[-1, 1] - on_the_way[1]) > 0.01 * W


def test_small_motion_sticks():
    """Within S/4 of rest all four elements stick: an elastic spring, no loop at all."""
    rows = _walk(MAXWELL, (0.0, 0.2 * S, -0.2 * S, 0.1 * S), S / 40.0)
    assert rows[:, 1] == pytest.approx(4.0 * K * rows[:, 0], abs=1e-9 * W)


def test_loss_per_cycle_is_that_of_the_blocks():
    # In a cycle of amplitude a ≥ S block i slides 4 (a − W_i/K) against W_i.
    amplitude = 1.5 * S
    expected = sum(4.0 * w * (amplitude - w / K) for w in LIMITS)
    rows = _walk(MAXWELL, (0.0, amplitude, -amplitude, amplitude), S / 40.0)
    cycle = rows[round(amplitude / (S / 40.0)) - 1 :]
    assert np.trapezoid(cycle[:, 1], cycle[:, 0]) == pytest.approx(expected, rel=1e-9)


@with_memory
def test_euler_is_exact_at_any_step(model):
    """At the turning points the states do not depend on the steps in between, nor on their size."""
    points = tuple(S * x for x in (0.0, 1.5, -0.4, 0.3, -0.2, 1.1, -2.0, 0.0))
    ends = [_walk(model, points, step)[-1, 1:] for step in (10.0 * S, 0.1 * S, 0.0125 * S)]
    assert ends[1] == pytest.approx(ends[0], abs=1e-10 * W)
    assert ends[2] == pytest.approx(ends[0], abs=1e-10 * W)


def test_maxwell_rates_give_the_clamped_update():
    random = np.random.default_rng(3)
    for _ in range(300):
        yields = W * random.uniform(0.0, 2.0)
        f, limits = random.uniform(-1.5, 1.5, 4) * LIMITS, yields * np.array(ELEMENT_SHARES)
        timestep = 10.0 ** random.uniform(-5.0, 0.0)
        moved = random.normal() * S
        new = f + timestep * np.array(maxwell_slip_rates(yields, moved, *f, Q, K, timestep))
        expected = np.clip(f + K * moved, -limits, limits)
        assert new == pytest.approx(expected, abs=1e-11 * W)
        force, slope = maxwell_slip_force(yields, moved, *f, Q, K)
        assert force == pytest.approx(expected.sum(), abs=1e-11 * W)
        assert slope == K * np.count_nonzero(np.abs(f + K * moved) < limits)


@pytest.mark.parametrize("size", [1e-3, 0.1, 3.0])
def test_maxwell_gives_no_energy_whatever_the_pressure_does(size):
    """Σ F Δκ covers what the springs hold, over paths of κ and of W, which rises and falls to nothing."""
    random = np.random.default_rng(6)
    for swing in (0.0, 0.1, 1.0):
        f, work, phase = np.zeros(4), 0.0, 0.0
        for moved in S * size * random.normal(size=4000):
            phase += swing * random.normal()
            yields = W * (1.0 + math.sin(phase)) * (random.uniform() > 0.02)
            force, _ = maxwell_slip_force(yields, moved, *f, Q, K)
            f = f + H * np.array(maxwell_slip_rates(yields, moved, *f, Q, K, H))
            work += force * moved
            assert work >= np.sum(f**2) / (2.0 * K) - 1e-9 * W * S
        assert work > 0.0


@pytest.mark.parametrize("pressed", [0.0, 0.3, 1.0, 10.0])
def test_what_is_stretched_pressed_and_released_gives_back_no_more(pressed):
    """A spring that grew stiffer with the pressure would give what it was never given."""
    way, n = 0.2 * S, 400  # all blocks stick
    f, works = np.zeros(4), []
    for yields, moved in [(W, way / n)] * n + [(pressed * W, 0.0)] + [(pressed * W, -way / n)] * n:
        works.append(maxwell_slip_force(yields, moved, *f, Q, K)[0] * moved)
        f = f + H * np.array(maxwell_slip_rates(yields, moved, *f, Q, K, H))
    into, back = sum(works[:n]), -sum(works[n:])
    assert into == pytest.approx(0.5 * 4.0 * K * way**2, rel=2.0 / n)
    if pressed >= 1.0:
        assert back == pytest.approx(0.5 * 4.0 * K * way**2, rel=2.0 / n)
    else:  # blocks slip as their limits fall: springs hold 0.68 of it at the most
        assert back < 0.68 * into
    assert back <= into


@pytest.mark.parametrize("depth", [0.0, 0.5])
def test_the_loss_of_a_slipping_loop_converges_with_the_step(depth):
    """Of κ = a sin φ, at a constant and at a pulsing pressure: half the error with half the step."""
    amplitude = 1.5 * S

    def lost(n):
        phase = 2.0 * math.pi / n * np.arange(2 * n + 1)
        kappa, f, work = amplitude * np.sin(phase), np.zeros(4), 0.0
        for k in range(1, 2 * n + 1):
            yields, moved = W * (1.0 + depth * math.sin(phase[k] + 0.7)), kappa[k] - kappa[k - 1]
            force, _ = maxwell_slip_force(yields, moved, *f, Q, K)
            f = f + H * np.array(maxwell_slip_rates(yields, moved, *f, Q, K, H))
            work += force * moved * (k > n)  # of the second cycle
        return work

    exact = lost(10_000)
    if not depth:
        assert exact == pytest.approx(sum(4.0 * w * (amplitude - w / K) for w in LIMITS), rel=1e-3)
    errors = [abs(lost(n) - exact) for n in (50, 100, 200, 400)]
    assert errors[-1] < 0.02 * exact
    assert errors[0] / errors[-1] == pytest.approx(8.0, rel=0.15)


# --- laws for every model ---------------------------------------------------------------------------


@with_memory
@pytest.mark.parametrize("amplitude", [0.5, 2.0])
def test_cyclic_loops_close_and_do_not_know_speed(model, amplitude):
    points = (0.0, *(s * amplitude * S for _ in range(30) for s in (1.0, -1.0)))
    slow, fast = (_walk(model, points, S / 20.0, timestep) for timestep in (0.1, 1e-3))
    assert slow == pytest.approx(fast, abs=1e-9 * W)
    n = 2 * round(2.0 * amplitude * 20.0)
    assert slow[-n:] == pytest.approx(slow[-2 * n : -n], abs=1e-6 * W)
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
    """Passive at any step: Σ F Δκ with F at the end of the step covers what the springs still hold."""
    for points in _random_paths(60, 2, closed=False):
        rows = np.vstack([np.zeros(2 + model.n_state), _walk(model, points, step * S)])
        work = np.cumsum(rows[1:, 1] * np.diff(rows[:, 0]))
        stored = np.sum(rows[1:, 2:] ** 2, axis=1) / (2.0 * K)
        assert np.all(work - stored >= -1e-9 * W * S)


@with_memory
def test_a_body_held_by_friction_does_not_gain_energy(model):
    """A mass on the stuck muscle swings on; with friction from the start of the step it would swing up.

    With a = h² k/m: friction at the end of the step bounds |v|² by v0²/(1 − a/4), and with its
    derivative taken implicitly by v0²/(1 − a/(4 (1 + a))) ≤ 4/3 v0², whatever the step.
    """
    coefficients = _coefficients(model)

    def swing(a, at_end, implicit):
        mass, v0 = H * H * 4.0 * K / a, 0.02 * S / H  # a push that the elements can take without slipping
        v, z, fastest = v0, [0.0] * model.n_state, 0.0
        for _ in range(300):
            value, stiffness = _answer(model, v if at_end else 0.0, z, coefficients)
            z = [f + H * r for f, r in zip(z, _rates(model, v, z, coefficients), strict=True)]
            v -= H * value / (mass + H * H * stiffness * implicit)
            fastest = max(fastest, abs(v))
        return fastest / v0

    assert swing(0.5, at_end=False, implicit=False) > 2.0
    assert swing(0.5, at_end=True, implicit=False) <= math.sqrt(1.0 / (1.0 - 0.5 / 4.0))
    for a in (0.5, 5.0, 100.0):
        assert swing(a, at_end=True, implicit=True) <= math.sqrt(1.0 / (1.0 - a / 4.0 / (1.0 + a)))


@every_friction
def test_derivative_is_the_slope_by_what_moves(model):
    random = np.random.default_rng(4)
    coefficients, h = _coefficients(model), 0.03
    by = h if model.n_state else 1.0  # Δκ of a step, or κ̇
    for _ in range(200):
        z = random.uniform(-0.1, 0.1, 4)[: model.n_state] * W
        rate = random.choice([1e-4, 1e-3, 3e-2, 1.0]) * random.normal()
        kappa = random.uniform(-0.1, 0.4)
        step = 1e-5 * abs(rate)
        above, below = (_answer(model, rate + s * step, z, coefficients, h, kappa)[0] for s in (1.0, -1.0))
        slope = _answer(model, rate, z, coefficients, h, kappa)[1]
        steepest = abs(_answer(model, 0.0, 0.0 * z, coefficients, h, kappa)[1])
        assert slope == pytest.approx((above - below) / (2.0 * step * by), rel=1e-5, abs=1e-6 * steepest)


@every_friction
def test_friction_falls_no_faster_than_stated(model):
    for tried in ({}, {"static_coefficient": FK, "kinetic_coefficient": FS}):  # the second falls with speed
        values = _tried(model) | {name: v for name, v in tried.items() if name in _tried(model)}
        coefficients, z = model.coefficients(BRAID, values), [0.0] * model.n_state
        rates = np.geomspace(1e-6, 1e2, 400)
        slopes = [_answer(model, rate, z, coefficients, kappa=0.0)[1] for rate in rates]
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
    first = [0.1, 0.0, 4e5] if model.unit == "N" else [W, 0.0]
    n = len(first) + model.n_state
    good = [*first, *[0.02 * W] * model.n_state, *_coefficients(model)]
    unused = {n} if model.unit == "Pa" else set()  # the dead band, which W stands for
    for moved in (0.0, 0.3, -0.3, 1e6, -1e6):
        good[1] = moved
        for i in set(range(len(good))) - unused:
            bad = [*good[:i], math.nan, *good[i + 1 :]]
            assert math.isnan(model.kernel(*bad)[0]), (i, moved)
            if model.n_state:
                rates = model.rate_kernel(*bad, H)
                own = rates[i - len(first) : i - len(first) + 1] if len(first) <= i < n else rates
                assert all(map(math.isnan, own)), (i, moved)


@every_friction
def test_finite_at_any_finite_state_of_motion(model):
    extremes = (-1e308, -1e12, -1.0, -1e-308, 0.0, 1e-308, 1.0, 1e12, 1e308)
    corners = [{p.name: getattr(p, side) for p in model.parameters} for side in ("lower", "upper")]
    for values in corners:
        coefficients = model.coefficients(BRAID, values)
        for kappa in extremes:
            for rate in extremes:
                for pressure in (-1e9, 0.0, 1e9):
                    yields = max(pressure, 0.0)  # [N]
                    for z in (-1e12, 0.0, 0.3 * W, 1e12):
                        state = [z] * model.n_state
                        result = _answer(model, rate, state, coefficients, H, kappa, pressure, yields)
                        rates = _rates(model, rate, state, coefficients, H, yields)
                        assert all(map(math.isfinite, (*result, *rates)))


@with_memory
def test_a_state_beyond_the_dead_band_comes_back_in_one_step(model):
    for z in (-1e6, 1e6):
        for rate in (-1e-3, 0.0, 1e-3):
            state = [z] * model.n_state
            value, _ = _answer(model, rate, state, _coefficients(model))
            assert value == pytest.approx(math.copysign(W, z), rel=1e-12)
            rates = _rates(model, rate, state, _coefficients(model))
            assert z * model.n_state + H * sum(rates) == pytest.approx(value, abs=1e-8)


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
            hunt_friction(c[0], c[1], c[6], c[8]),
            maxwell_slip_rates(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]),
            maxwell_slip_force(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]),
        )

    for _ in range(200):
        kappa, rate = random.uniform(-0.2, 1.1), random.choice([1e-4, 1e-2, 1.0]) * random.normal()
        f = random.uniform(-0.4, 0.4, 4) * W
        a = (kappa, *GEOMETRY)
        b = (kappa, rate, random.uniform(-1e4, 6e5), *STRIBECK)
        c = (W * random.uniform(0.0, 1.5), rate, *map(float, f), Q, K, 10.0 ** random.uniform(-4.0, 0.0))
        for native, plain in zip(compiled(a, b, c), compiled.py_func(a, b, c), strict=True):
            assert native == pytest.approx(plain, rel=1e-12, abs=1e-12 * W)


# --- registry ---------------------------------------------------------------------------------------


@every_friction
def test_a_friction_says_what_it_is_and_has_as_many_rates_as_states(model):
    assert model.formula and model.validity and model.source
    state = [0.0] * model.n_state
    assert len(_rates(model, 0.1, state, _coefficients(model))) == model.n_state


@every_friction
def test_every_parameter_is_live(model):
    values = _tried(model)
    z = [0.02 * W] * model.n_state

    def answers(changed):
        coefficients = model.coefficients(BRAID, changed)
        yields = W * changed.get("dead_band", Q) / Q  # as the muscle's law has it
        return [_answer(model, rate, z, coefficients, 5e-3, yields=yields)[0] for rate in (1e-4, 0.02, 0.9)]

    for name in values:
        assert answers(values) != answers({**values, name: 1.1 * values[name]}), name


@with_memory
def test_zero_dead_band_is_no_friction(model):
    coefficients = model.coefficients(BRAID, {"dead_band": 0.0, "presliding_contraction": S})
    rows = _walk(model, (0.0, S, -S), S / 3.0, coefficients=coefficients, yields=0.0)
    assert np.all(rows[:, 1:] == 0.0)
