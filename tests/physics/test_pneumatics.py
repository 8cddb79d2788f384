"""Air: valve flow after ISO 6358, volume of a muscle, energy balance of a chamber, a valve's delays."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from afo_sim.physics import (
    NEVER,
    Braid,
    chamber_pressure,
    muscle_volume,
    seat_switches,
    sigma_rate,
    valve_flow,
)
from afo_sim.physics.law_volume import GEOMETRIC
from afo_sim.physics.pneumatics import LAMINAR_RATIO, braid_volume, iso_6358_flow

T0 = 293.15  # ambient and ISO 6358 reference temperature [K]
RHO0 = 1.185  # ISO 8778 [kg/m³]
R = 287.05  # dry air [J/(kg·K)]
GAMMA = 1.4
C, B = 0.39e-8, 0.3  # a 100 l/min solenoid valve [m³/(s·Pa)], [-]


# Flow through a valve


def test_choked_flow_does_not_know_what_is_downstream():
    # ISO 6358: ṁ = C ρ0 p, and √(T0/T) less when the air is hot.
    for downstream in (0.0, 1e3, 1e5, B * 5e5):
        assert iso_6358_flow(5e5, downstream, T0, C, B) == pytest.approx(C * RHO0 * 5e5, rel=1e-14)
        assert iso_6358_flow(5e5, downstream, 4.0 * T0, C, B) == pytest.approx(C * RHO0 * 2.5e5, rel=1e-14)


def test_elliptic_flow_by_hand():
    # b = 0.2 and r = 0.6: √(1 − 0.5²) = 0.8660254 of the choked 1e-8 · 1.185 · 5e5 = 5.925e-3 kg/s.
    assert iso_6358_flow(5e5, 3e5, T0, 1e-8, 0.2) == pytest.approx(5.1312005e-3, rel=1e-7)


def test_laminar_end_is_linear_in_the_pressure_difference():
    # So that the slope at equal pressures is finite, unlike that of the ellipse.
    at_end = iso_6358_flow(5e5, LAMINAR_RATIO * 5e5, T0, C, B)
    for part in (0.75, 0.5, 0.01, 1e-9):
        downstream = 5e5 * (1.0 - part * (1.0 - LAMINAR_RATIO))
        assert iso_6358_flow(5e5, downstream, T0, C, B) == pytest.approx(part * at_end, rel=1e-6)
    assert iso_6358_flow(5e5, 5e5, T0, C, B) == 0.0


@pytest.mark.parametrize("critical", [0.0, 0.1, 0.3, 0.528, 0.9])
def test_flow_is_continuous_and_falls_as_downstream_rises(critical):
    for ratio in (critical, LAMINAR_RATIO):
        below, above = (iso_6358_flow(5e5, 5e5 * (ratio + d), T0, C, critical) for d in (-1e-10, 1e-10))
        assert above == pytest.approx(below, rel=1e-7)
    flow = [iso_6358_flow(5e5, 5e5 * ratio, T0, C, critical) for ratio in np.linspace(0.0, 1.0, 501)]
    assert np.all(np.diff(flow) <= 0.0)
    assert min(flow) == 0.0


@pytest.mark.parametrize(
    ("conductance", "fill", "vent"),
    [(0.055, "1.58", "2.81"), (0.39, "0.223", "0.396"), (1.0, "0.087", "0.154")],
)
def test_fill_and_vent_times_of_a_bottle(conductance, fill, vent):
    # Computed apart from this code, at printed precision: 130 ml, polytropic exponent 1.2, b = 0.3; filled
    # from 7 bar 1 → 6 bar, vented to 1 bar 6 → 1.5 bar (absolute); C in dm³/(s·bar), times in s.
    def per_pascal(pressure, upstream, downstream):
        flow = valve_flow(upstream, T0, downstream, T0, 1.0, conductance * 1e-8, 0.3)
        return 130e-6 / (1.2 * R * T0 * flow)

    times = (
        quad(lambda p: per_pascal(p, 7e5, p), 1e5, 6e5, points=[2.1e5])[0],
        quad(lambda p: per_pascal(p, p, 1e5), 1.5e5, 6e5, points=[1e5 / 0.3])[0],
    )
    for time, printed in zip(times, (fill, vent), strict=True):
        assert time == pytest.approx(float(printed), abs=0.5 * 10.0 ** -len(printed.partition(".")[2]))


def test_flow_runs_from_high_to_low_pressure_either_way():
    # Exchanging the sides turns the sign, and the temperature of the side it leaves counts.
    for first, second in ((5e5, 1e5), (5e5, 4e5), (5e5, 4.99e5), (2e5, 2e5)):
        there = valve_flow(first, 350.0, second, 280.0, 0.7, C, B)
        back = valve_flow(second, 280.0, first, 350.0, 0.7, C, B)
        assert there == -back
        assert there >= 0.0
    assert valve_flow(1e5, 350.0, 5e5, T0, 1.0, C, B) == pytest.approx(-C * RHO0 * 5e5, rel=1e-14)
    assert valve_flow(5e5, 4.0 * T0, 1e5, T0, 1.0, C, B) == pytest.approx(C * RHO0 * 2.5e5, rel=1e-14)
    assert valve_flow(4e5, 350.0, 4e5, 280.0, 1.0, C, B) == 0.0


def test_opening_scales_the_conductance():
    # Two half-open valves pass what one open valve does; a shut one passes nothing.
    whole, half = (valve_flow(5e5, T0, 4e5, T0, opening, C, B) for opening in (1.0, 0.5))
    assert 2.0 * half == pytest.approx(whole, rel=1e-14)
    assert valve_flow(5e5, T0, 4e5, T0, 0.0, C, B) == 0.0


# Volume of a muscle: the S1 muscle, its limits, and a wider braid

L0, R0, DEAD = 0.1631, 5.75e-3, 1e-6
ANGLES = (15.0, 22.0, 37.0, 49.0)


def _fattest(degrees):
    """κ at which the braid angle is 54.7356°, cos² = 1/3: the volume is greatest there."""
    return 1.0 - 1.0 / (math.sqrt(3.0) * math.cos(math.radians(degrees)))


def _volume(kappa, degrees):
    b = 1.0 / math.sin(math.radians(degrees)) ** 2
    return geometric(kappa, 3e5, L0, R0, b, 0.0, DEAD, 0.0, 0.0)[:2]


def test_braid_volume_of_s1s_simulated_muscle():
    # 21.5 cm, 37°, r0 = 5 mm: 16.9, 20.3, 22.1, 22.4 ml at κ = 0, 0.1, 0.2, 0.3; and 12 cm.
    b = 1.0 / math.sin(math.radians(37.0)) ** 2
    for length, printed in ((0.215, (16.9, 20.3, 22.1, 22.4)), (0.12, (9.4, 11.3, 12.3, 12.5))):
        for kappa, millilitres in zip((0.0, 0.1, 0.2, 0.3), printed, strict=True):
            assert round(braid_volume(kappa, length, 5e-3, b)[0] * 1e6, 1) == millilitres


@pytest.mark.parametrize("degrees", ANGLES)
def test_braid_volume_is_zero_where_the_braid_locks(degrees):
    # Stretched until the fibres lie along the axis.
    lock = 1.0 - 1.0 / math.cos(math.radians(degrees))
    b = 1.0 / math.sin(math.radians(degrees)) ** 2
    assert Braid(L0, R0, math.radians(degrees)).lock == lock < 0.0
    volume, slope = braid_volume(lock, L0, R0, b)
    assert volume == pytest.approx(0.0, abs=1e-18) and slope > 0.0
    assert _volume(lock - 0.05, degrees) == (DEAD, 0.0)


@pytest.mark.parametrize("degrees", ANGLES)
def test_muscle_volume_has_the_slope_it_says(degrees):
    # From past the lock, through its blend, to a length of zero: finite differences across every joint.
    lock = 1.0 - 1.0 / math.cos(math.radians(degrees))
    full = math.pi * R0 * R0 * L0
    near_lock = np.linspace(lock - 0.02, lock + 0.1, 601)
    step, slopes = 1e-9, []
    for kappa in (*near_lock, *np.linspace(lock + 0.1, 1.0, 601)[1:-1]):
        volume, slope = _volume(kappa, degrees)
        difference = (_volume(kappa + step, degrees)[0] - _volume(kappa - step, degrees)[0]) / (2.0 * step)
        assert slope == pytest.approx(difference, abs=1e-4 * full)
        assert volume >= DEAD
        assert slope >= 0.0 or kappa > _fattest(degrees)
        slopes.append(slope)
    assert np.max(slopes) > full  # the range did contain a muscle that fills


@pytest.mark.parametrize("degrees", ANGLES)
def test_muscle_volume_is_smooth(degrees):
    # C1: where the grid is twice as fine, the largest jump of the slope is half as large.
    def largest_jump(n):
        grid = np.linspace(1.0 - 1.0 / math.cos(math.radians(degrees)) - 0.05, 1.0, n)
        return np.max(np.abs(np.diff([_volume(kappa, degrees)[1] for kappa in grid])))

    assert largest_jump(16_001) < 0.52 * largest_jump(8001)


@pytest.mark.parametrize("degrees", ANGLES)
def test_a_muscle_is_fattest_at_54_74_degrees(degrees):
    # The braid angle of greatest volume is 54.7356°, cos² = 1/3: V = (2/3) π (D90/2)² L of that cylinder.
    alpha = math.radians(degrees)
    thread, turns = L0 / math.cos(alpha), L0 * math.tan(alpha) / (2.0 * math.pi * R0)
    length, diameter = thread / math.sqrt(3.0), thread * math.sqrt(2.0 / 3.0) / (math.pi * turns)
    greatest = math.pi / 4.0 * diameter**2 * length
    volume, slope = _volume(1.0 - length / L0, degrees)
    assert volume == pytest.approx(greatest + DEAD, rel=1e-10)
    assert slope == pytest.approx(0.0, abs=1e-12 * greatest)
    # shorter or longer it holds less
    for away in (-0.05, -1e-3, 1e-3, 0.05):
        assert _volume(1.0 - length / L0 + away, degrees)[0] < greatest + DEAD


def test_inside_its_range_the_volume_is_the_braids_plus_the_dead_volume():
    # Otherwise the force would no longer be the virtual work of this air.
    b = 1.0 / math.sin(math.radians(22.0)) ** 2
    for kappa in np.linspace(-0.07, 0.9, 98):
        volume, slope = braid_volume(kappa, L0, R0, b)
        assert _volume(kappa, 22.0) == (
            pytest.approx(volume + DEAD, rel=1e-14),
            pytest.approx(slope, rel=1e-14),
        )


# A chamber: states are air mass and σ = p V^γ

V0 = 50e-6  # [m³]


def _chamber(volume, supply, exhaust, wall, end, start=None):
    """Integrate a chamber between a supply and an exhaust (absolute pressures, None: shut).

    Returns mass, pressure and temperature over time.
    """
    mass, pressure = start or (101_325.0 * volume(0.0) / (R * T0), 101_325.0)
    scale = np.array([mass, pressure * volume(0.0) ** GAMMA])  # both states of size one, for the integrator

    def rates(time, scaled):
        m, sigma = scaled * scale
        p = chamber_pressure(sigma, volume(time))
        temperature = p * volume(time) / (m * R)
        flow_in = valve_flow(supply, T0, p, temperature, 1.0, C, B) if supply else 0.0
        flow_out = valve_flow(p, temperature, exhaust, T0, 1.0, C, B) if exhaust else 0.0
        rate = sigma_rate(temperature, volume(time), flow_in, flow_out, wall)
        return np.array([flow_in - flow_out, rate]) / scale

    run = solve_ivp(rates, (0.0, end), (1.0, 1.0), method="LSODA", rtol=1e-10, atol=1e-12)
    assert run.success
    m, sigma = run.y * scale[:, None]
    volumes = np.array([volume(t) for t in run.t])
    p = sigma / volumes**GAMMA
    return m, p, p * volumes / (m * R)


def _rigid(_time):
    return V0


def _stroke(time):
    return V0 * (1.0 - 0.4 * math.sin(10.0 * time))


def test_sealed_adiabatic_compression_keeps_p_v_to_the_gamma():
    mass, pressure, temperature = _chamber(_stroke, None, None, 0.0, 0.5)
    volume = mass * R * temperature / pressure
    assert volume.min() < 0.61 * V0 < 1.38 * V0 < volume.max()
    assert np.ptp(mass) == 0.0
    assert pressure * volume**GAMMA == pytest.approx(101_325.0 * V0**GAMMA, rel=1e-12)
    # nothing flows and no heat passes: σ has no rate at any temperature and volume
    for warm in (200.0, T0, 500.0):
        assert sigma_rate(warm, V0, 0.0, 0.0, 0.0) == 0.0


def test_first_law_in_energy_and_volume():
    """U = p V/(γ − 1): U̇ = −p V̇ + c_p (ṁ_in T0 − ṁ_out T) + hA (T0 − T), with a moving wall."""
    cp = GAMMA * R / (GAMMA - 1.0)
    for volume, pressure, temperature, moved in ((V0, 3e5, 350.0, 2e-4), (2.0 * V0, 9e4, 270.0, -5e-4)):
        flow_in, flow_out, wall = 3e-4, 2e-4, 0.7
        step = 1e-7
        sigma = pressure * volume**GAMMA
        rate = sigma_rate(temperature, volume, flow_in, flow_out, wall)
        energies = [
            chamber_pressure(sigma + s * step * rate, volume + s * step * moved)
            * (volume + s * step * moved)
            / (GAMMA - 1.0)
            for s in (-1.0, 1.0)
        ]
        gained = (energies[1] - energies[0]) / (2.0 * step)
        enthalpy = cp * (flow_in * T0 - flow_out * temperature)
        assert gained == pytest.approx(-pressure * moved + enthalpy + wall * (T0 - temperature), rel=1e-7)


def test_pressure_of_no_volume_is_not_a_number():
    assert chamber_pressure(3.0, 1.0) == 3.0
    for volume in (0.0, -1e-6, math.nan):
        assert math.isnan(chamber_pressure(3.0, volume))


def test_sealed_compression_with_cold_walls_is_isothermal():
    # 1 kW/K on 0.06 g of air; Boyle's law is left by no more than the heat that has to pass.
    mass, pressure, temperature = _chamber(_stroke, None, None, 1e3, 0.5)
    assert temperature == pytest.approx(T0, rel=1e-4)
    volume = mass * R * temperature / pressure
    assert pressure * volume == pytest.approx(101_325.0 * V0, rel=1e-4)


def test_filling_from_vacuum_heats_the_air_to_gamma_times_ambient():
    # Classic: the supply's flow work stays in the bottle, T = γ T0 = 410 K, at any pressure on the way.
    nothing = (1.0 * V0 / (R * T0), 1.0)
    _, pressure, temperature = _chamber(_rigid, 5e5, None, 0.0, 2.0, start=nothing)
    assert pressure[-1] == pytest.approx(5e5, rel=1e-6)
    assert temperature[pressure > 1e5] == pytest.approx(GAMMA * T0, rel=1e-5)


def test_rigid_fill_ends_where_the_first_law_says():
    # Adiabatic: m gains ΔpV/(γ R T0), so T = γ T0/(1 + (γ − 1) p0/p); isothermal: ΔpV/(R T0), T = T0.
    p0, p1 = 101_325.0, 5e5
    for wall, gained, final in (
        (0.0, (p1 - p0) * V0 / (GAMMA * R * T0), GAMMA * T0 / (1.0 + (GAMMA - 1.0) * p0 / p1)),
        (1e3, (p1 - p0) * V0 / (R * T0), T0),
    ):
        mass, pressure, temperature = _chamber(_rigid, p1, None, wall, 2.0)
        assert pressure[-1] == pytest.approx(p1, rel=1e-6)
        assert mass[-1] - mass[0] == pytest.approx(gained, rel=1e-5)
        assert temperature[-1] == pytest.approx(final, rel=1e-5)


def test_a_hot_sealed_chamber_cools_to_ambient_at_constant_volume():
    # Newton cooling with m c_v = hA τ: after 5 τ the excess has fallen by e^5.
    mass, hot = 2e-4, 400.0
    tau = mass * R / (GAMMA - 1.0) / 0.5
    start = (mass, mass * R * hot / V0)
    _, pressure, temperature = _chamber(_rigid, None, None, 0.5, 5.0 * tau, start=start)
    assert temperature[-1] - T0 == pytest.approx((hot - T0) * math.exp(-5.0), rel=1e-6)
    assert pressure[-1] == pytest.approx(mass * R * temperature[-1] / V0, rel=1e-9)


def test_adiabatic_venting_expands_isentropically():
    # What stays behind has done the pushing: T = T0 (p/p0)^((γ−1)/γ).
    start = (6e5 * V0 / (R * T0), 6e5)
    _, pressure, temperature = _chamber(_rigid, None, 101_325.0, 0.0, 0.5, start=start)
    assert pressure[-1] < 1.02e5
    assert temperature == pytest.approx(T0 * (pressure / 6e5) ** (1.0 - 1.0 / GAMMA), rel=1e-7)


# A solenoid valve: armature, seat and coil, one step at a time as the engine takes them


def _opening(
    coil, opening_delay, closing_delay, timestep, armature=0.0, opening=0.0, switches=None, threshold=0.0
):
    """Mean opening over each step, for a list of coil commands; its coil was what opened it."""
    out, on, delays = [], opening, (opening_delay, closing_delay, threshold)
    for k, command in enumerate(coil):
        start, first, second, armature, opening, on = seat_switches(
            command, on, armature, opening, *delays, timestep
        )
        out.append(abs(start - (min(second, 1.0) - min(first, 1.0))))
        if switches is not None:
            switches += [(k + at) * timestep for at in (first, second) if at < 1.0]
    return np.array(out)


# delay [s] and time step [s]: the step divides it 4, 1 and 40 times, and does not divide it
DELAYS = [
    (4e-3, 1e-3),
    (1e-3, 1e-3),
    (4e-3, 1e-4),
    (3.3e-3, 1e-3),
    (4e-3, 3e-3),
    (4e-3, 0.7e-3),
    (1.5e-3, 1e-3),
]


@pytest.mark.parametrize(("delay", "timestep"), DELAYS)
def test_dead_time_is_exact(delay, timestep):
    # By the integral of the opening, so that an arrival between two steps must weigh what is left of it.
    opening = _opening([1.0] * 100, delay, 9.0, timestep)
    assert 100 * timestep - timestep * opening.sum() == pytest.approx(delay, abs=1e-12)
    assert np.all(opening[: int(delay / timestep - 1e-9)] == pytest.approx(0.0, abs=1e-12))
    assert np.all(np.diff(opening) >= -1e-15)
    assert opening[-1] == 1.0


@pytest.mark.parametrize(("delay", "timestep"), [*DELAYS, (0.3e-3, 1e-3)])
@pytest.mark.parametrize("longer", [0.999, 1.001])
def test_a_pulse_shorter_than_the_delay_does_nothing(delay, timestep, longer):
    # However little; a longer one opens for what it is longer, and the closing delay.
    steps = longer * delay / timestep
    pulse = [1.0] * int(steps) + [steps % 1.0]
    opening = _opening(pulse + [0.0] * 50, delay, 4e-3, timestep)
    expected = 0.0 if longer < 1.0 else (longer - 1.0) * delay + 4e-3
    assert timestep * opening.sum() == pytest.approx(expected, abs=1e-12)
    shut = _opening([1.0 - on for on in pulse] + [1.0] * 50, 4e-3, delay, timestep, armature=1.0, opening=1.0)
    assert timestep * (1.0 - shut).sum() == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("command", "clamped"), [(1.7, 1.0), (-0.4, 0.0)])
def test_an_overdriven_coil_is_clamped(command, clamped):
    start = 1.0 - clamped
    over = _opening([command] * 30, 3.3e-3, 2.6e-3, 1e-3, armature=start, opening=start)
    plain = _opening([clamped] * 30, 3.3e-3, 2.6e-3, 1e-3, armature=start, opening=start)
    assert np.array_equal(over, plain)
    assert over.min() >= 0.0
    assert over.max() <= 1.0
    assert over[-1] == clamped


@pytest.mark.parametrize("share", [0.01, 0.4, 0.99])
def test_a_valve_without_delays_is_open_for_as_long_as_its_coil_is_on(share):
    # A pulse within one step, and pulses that begin and end within steps.
    for coil in ([share], [share, 1.0, 1.0, 0.3], 10 * [1.0, 1.0, share, 0.0, 0.0]):
        opening = _opening(coil + [0.0] * 3, 0.0, 0.0, 1e-3)
        assert opening.sum() == pytest.approx(sum(coil), abs=1e-12)


def test_a_switch_faster_than_the_armature_moves_nothing():
    # Half of each step: the armature trembles, the seat stays.
    assert _opening([0.5] * 50, 4e-3, 4e-3, 1e-3) == pytest.approx(0.0)
    shut = _opening([0.5] * 50, 4e-3, 4e-3, 1e-3, armature=1.0, opening=1.0)
    assert shut == pytest.approx(1.0)


def test_a_valve_at_rest_rests():
    for seat in (0.0, 1.0):
        assert seat_switches(*[seat] * 4, 4e-3, 4e-3, 0.0, 1e-3) == (seat, NEVER, NEVER, seat, seat, seat)


@pytest.mark.parametrize("threshold", [0.0, 0.3])
@pytest.mark.parametrize("delays", [(0.0, 0.0), (0.4e-3, 0.7e-3), (3.3e-3, 0.0), (5e-3, 2.6e-3)])
def test_the_seat_switches_at_its_own_time(delays, threshold):
    # Against an armature followed in continuous time from one event to the next, through pulses and gaps
    # of one to six steps that begin anywhere.
    step, random = 1e-3, np.random.default_rng(1)
    edges = np.cumsum(random.uniform(1.0, 6.0, 400)) * step
    expected, place, seat = [], 0.0, 0.0
    strokes = (delays[0] / (threshold or 1.0), delays[1] / (1.0 - threshold))
    for k, (begin, end) in enumerate(itertools.pairwise([0.0, *edges])):
        aim, delay = float(k % 2), strokes[1 - k % 2]
        arrives = begin + abs(aim - place) * delay
        passes = begin + max((2.0 * aim - 1.0) * ((threshold or aim) - place), 0.0) * delay
        if passes <= end and seat != aim:
            seat = aim
            expected.append(passes)
        place = aim if arrives <= end else place + (2.0 * aim - 1.0) * (end - begin) / delay
    starts = np.arange(int(edges[-1] / step)) * step
    on = np.minimum(edges[1::2, None], starts + step) - np.maximum(edges[::2, None], starts)
    found = []
    on = np.maximum(on, 0.0).sum(axis=0) / step
    _opening(on, *delays, step, switches=found, threshold=threshold)
    count = len(found)
    assert count > 50 and found == pytest.approx(expected[:count], abs=1e-9)


def test_a_short_pulse_opens_for_longer_than_its_excess_over_the_threshold():
    """Armature up in 10 ms, back in 20 ms, seat at 0.2 of it: open for (w − 2 ms)(1 + 20/10)."""
    for width in (1.9e-3, 3e-3, 5e-3, 9e-3):
        coil = np.clip(width / 1e-3 - np.arange(60), 0.0, 1.0)
        # the last share of a coil that was on lies at the step's start
        open_for = 1e-3 * _opening(coil, 2e-3, 16e-3, 1e-3, threshold=0.2).sum()
        assert open_for == pytest.approx(max(width - 2e-3, 0.0) * 3.0, abs=1e-12), width


# Every kernel


def geometric(*arguments):
    return muscle_volume(*arguments, GEOMETRIC, 0)


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        (iso_6358_flow, (5e5, 4e5, T0, C, B)),
        (iso_6358_flow, (5e5, 4.95e5, T0, C, B)),
        (valve_flow, (5e5, T0, 4e5, T0, 1.0, C, B)),
        (braid_volume, (0.1, L0, R0, 7.0)),
        (geometric, (0.1, 3e5, L0, R0, 7.0, 0.0, DEAD, 1e-6, 0.0)),
        (geometric, (0.9, 3e5, L0, R0, 7.0, 0.0, DEAD, 1e-6, 0.0)),
        (sigma_rate, (T0, V0, 1e-4, 1e-4, 0.5)),
        (chamber_pressure, (0.3, V0)),
    ],
)
def test_nan_comes_out(kernel, arguments):
    def first(values):
        result = kernel(*values)
        return result[0] if isinstance(result, tuple) else result

    assert math.isfinite(first(arguments))
    unused = {3} if kernel is valve_flow else set()  # the temperature downstream
    for i in set(range(len(arguments))) - unused:
        assert math.isnan(first((*arguments[:i], math.nan, *arguments[i + 1 :]))), i


def test_closed_valve_hides_no_nan():
    assert np.isnan(valve_flow(np.nan, 293.15, 1e5, 293.15, 0.0, 1e-8, 0.3))
    for valve in ((np.nan, 0.0, 0.0, 0.0), (0.0, 0.0, np.nan, 0.0), (1.0, 1.0, 0.0, np.nan)):
        assert np.isnan(seat_switches(*valve, 4e-3, 4e-3, 0.0, 1e-3)[4])


def test_no_muscle_is_shorter_than_nothing():
    for kappa in (1.0, 1.7, 3.0):
        braid = 0.1631, 0.00575, 7.126, 0.0
        assert geometric(kappa, 3e5, *braid, 1e-6, 0.0, 0.0) == (1e-6, 0.0, 0.0)
