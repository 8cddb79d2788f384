"""The references of the air network agree with closed forms, with laws of nature and with each other."""

import dataclasses
import math

import numpy as np
import pytest
from air.reference import (
    AMBIENT,
    BAR,
    DENSITY,
    GAMMA,
    GAS,
    LITRE,
    WARMTH,
    Edge,
    Fixed,
    Volume,
    adiabatic_fill,
    adiabatic_vent,
    choked_rate,
    iso_flow,
    isothermal_fill,
    isothermal_vent,
    network_reference,
    time_to,
)
from air.test_network_physics import random_network
from air.tube_1d import HALVES, Lumping, Tube, Valve, lumped, matched_friction, segments, steady_flow, tube_1d

ML = 1e-6
TUBES = [
    Tube(bore * 1e-3, length) for bore in (2.0, 2.5, 4.0, 6.0, 8.0) for length in (0.3, 1.0, 2.0, 5.0, 10.0)
]


# Flow and closed forms


def test_flow_of_makers_that_print_c_b_and_flow_together():
    # SMC SY series (EUS11-83B-UK): 7 → 6 bar absolute at 20 °C, l/min ANR.
    for c, b, printed in ((1.1, 0.28, 276.0), (2.8, 0.37, 746.0), (4.5, 0.28, 1130.0), (10.0, 0.29, 2527.0)):
        flow = iso_flow(7.0 * BAR, WARMTH, 6.0 * BAR, WARMTH, c * LITRE, b)
        assert flow / DENSITY * 60_000.0 == pytest.approx(printed, rel=2e-3)
        back = iso_flow(6.0 * BAR, 400.0, 7.0 * BAR, WARMTH, c * LITRE, b)
        assert back == -flow  # the temperature it leaves at counts


@pytest.mark.parametrize("isothermal", [True, False])
def test_choked_fill_and_vent(isothermal):
    volume, c, b = 100.0 * ML, 0.39 * LITRE, 0.5
    # a source of 7 bar chokes up to 3.5 bar; a vent to ambient from 7 bar down to 2.03 bar
    fill, vent = np.linspace(0.0, 0.05, 26), np.linspace(0.0, 0.2, 26)
    for source_warmth in (WARMTH, 350.0):
        found = network_reference(
            {"supply": Fixed(7.0 * BAR, source_warmth), "v": Volume(volume, BAR, isothermal=isothermal)},
            [Edge("supply", "v", c, b)],
            fill,
        )
        if isothermal:
            expected = isothermal_fill(fill, volume, BAR, 7.0 * BAR, c) - BAR
            expected = BAR + expected * math.sqrt(WARMTH / source_warmth)
        else:  # √T_s: γ R T_s ṁ, and ṁ goes with √(T0/T_s)
            expected = adiabatic_fill(fill, volume, BAR, 7.0 * BAR, c) - BAR
            expected = BAR + expected * math.sqrt(source_warmth / WARMTH)
        assert found.pressure["v"] == pytest.approx(expected, rel=1e-8)
        assert found.pressure["v"][-1] < b * 7.0 * BAR
    for warm in (WARMTH, 350.0):
        found = network_reference(
            {"v": Volume(volume, 7.0 * BAR, warm, isothermal=isothermal), "out": Fixed()},
            [Edge("v", "out", c, b)],
            vent,
        )
        if isothermal:  # held at T0 from the start on: as much air as at `warm`
            expected = isothermal_vent(vent, volume, 7.0 * BAR * WARMTH / warm, c)
            reached = found.mass["v"] * GAS * WARMTH / volume
        else:
            expected, reached = adiabatic_vent(vent, volume, 7.0 * BAR, c, warm), found.pressure["v"]
        assert reached == pytest.approx(expected, rel=1e-8)
        assert reached[-1] > AMBIENT / b


def test_isothermal_vent_of_a_known_time_constant():
    # τ = V/C · T0 R ρ0 in bar: 30 ml behind C = 0.39: 77 ms/1.0 (ρ0 R T0 = 0.997 bar)
    tau = 30.0 * ML / (0.39 * LITRE * DENSITY * GAS * WARMTH)
    assert tau == pytest.approx(77e-3, abs=0.5e-3)
    assert isothermal_vent(tau, 30.0 * ML, 7.0 * BAR, 0.39 * LITRE) == pytest.approx(7.0 * BAR / math.e)


def test_walls_join_the_adiabatic_and_the_isothermal_fill():
    times = np.linspace(0.0, 0.05, 11)

    def filled(**how):
        nodes = {"supply": Fixed(7.0 * BAR), "v": Volume(100.0 * ML, BAR, **how)}
        return network_reference(nodes, [Edge("supply", "v", 0.39 * LITRE, 0.5)], times).pressure["v"]

    assert filled(wall=1e4) == pytest.approx(filled(isothermal=True), rel=1e-4)
    assert np.all(filled(wall=5.0)[1:] < filled(wall=0.0)[1:])
    assert np.all(filled(wall=5.0)[1:] > filled(isothermal=True)[1:])


# Networks


@pytest.mark.parametrize("seed", range(3))
def test_mass_and_energy_of_a_network_close(seed):
    nodes, edges = random_network(seed)
    # half way all are shut by two thirds
    edges = [
        dataclasses.replace(e, opening=lambda t: 1.0 if t < 0.05 else 0.3, breaks=(0.05,)) for e in edges
    ]
    found = network_reference(nodes, edges, np.linspace(0.0, 0.1, 11), rtol=1e-9)
    moved = sum(np.abs(passed[-1]) for passed in found.passed)
    for name in found.mass:
        inward = [(1.0 if e.end == name else -1.0 if e.origin == name else 0.0) for e in edges]
        mass = sum(sign * passed for sign, passed in zip(inward, found.passed, strict=True))
        energy = sum(sign * h for sign, h in zip(inward, found.enthalpy, strict=True)) + found.heat[name]
        assert found.mass[name] - found.mass[name][0] == pytest.approx(mass, abs=1e-9 * moved)
        gained = found.energy[name] - found.energy[name][0]
        assert gained == pytest.approx(energy, abs=1e-9 * moved * GAMMA / (GAMMA - 1.0) * GAS * WARMTH)
    for passed, edge in zip(found.passed, edges, strict=True):
        if edge.cracking is not None:
            assert np.all(np.diff(passed) >= -1e-12 * moved)


def test_two_volumes_meet_where_mass_and_energy_say():
    # Adiabatic, through one restriction: p = Σ p V/Σ V; and a check valve keeps its cracking pressure.
    for cracking, kept in ((None, 0.0), (0.3 * BAR, 0.3 * BAR)):
        found = network_reference(
            {"a": Volume(20.0 * ML, 6.0 * BAR), "b": Volume(50.0 * ML, 2.0 * BAR)},
            [Edge("a", "b", 0.4 * LITRE, 0.3, cracking=cracking)],
            [0.0, 3.0],
        )
        a, b = found.pressure["a"][-1], found.pressure["b"][-1]
        assert a - b == pytest.approx(kept, abs=1e-5 * BAR)
        assert (20.0 * a + 50.0 * b) / 70.0 == pytest.approx((6.0 * 20.0 + 2.0 * 50.0) / 70.0 * BAR, rel=1e-9)


# The tube


@pytest.mark.parametrize(
    ("bore", "length", "conductance", "critical"),
    [(2.5, 0.8, 0.411, 0.312), (4.0, 2.0, 0.928, 0.275), (6.0, 0.3, 3.98, 0.523), (8.0, 5.0, 3.64, 0.270)],
)
def test_eckerstens_formula(bore, length, conductance, critical):
    # Worked out by hand at printed precision.
    c, b = Tube(bore * 1e-3, length).eckersten()
    assert c / LITRE == pytest.approx(conductance, rel=2e-3)
    assert b == pytest.approx(critical, rel=4e-3)


def test_steady_tube_has_eckerstens_characteristic():
    """Matched at the choked end, the formula's C and b are those of a tube with friction and acceleration."""
    for tube in TUBES:
        c, b = tube.eckersten()
        friction = matched_friction(tube)
        assert 0.8 < friction / tube.friction < 0.98
        for ratio in (0.0, 0.3, 0.5, 0.7, 0.9, 0.98):
            x = max(0.0, (ratio - b) / (1.0 - b))
            iso = c * math.sqrt(1.0 - x * x)
            flow = steady_flow(tube, max(ratio, 1e-6), friction)
            assert -0.032 < flow / iso - 1.0 < 0.016
            # the friction that stands in the formula without acceleration gives less
            assert -0.085 < steady_flow(tube, max(ratio, 1e-6), tube.friction) / iso - 1.0 < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("tube", [Tube(2.5e-3, 0.8), Tube(4e-3, 0.3), Tube(4e-3, 2.0)])
@pytest.mark.parametrize(("ratio", "tolerance"), [(0.95, 2e-3), (0.6, 7e-3), (0.3, 7e-3), (0.02, 7e-3)])
def test_one_dimensional_tube_becomes_steady(tube, ratio, tolerance):
    # Into a tank of 10 m³, below and above the ratio at which its end chokes.
    found = tube_1d(
        tube, Valve(5.0 * tube.eckersten()[0]), 10.0, start=ratio * 7e5, cells=60,
        longest=0.03 + 0.04 * tube.length, upto=0.5,
    )  # fmt: skip
    before = found.behind_valve[-1]
    steady = steady_flow(tube, found.pressure[-1] / before, matched_friction(tube))
    assert found.inflow[-1] / (DENSITY * before) == pytest.approx(steady, rel=tolerance)


def test_one_dimensional_tube_keeps_mass_and_hears_with_the_speed_of_sound():
    tube = Tube(4e-3, 2.0)
    for isothermal, sound in ((True, math.sqrt(GAS * WARMTH)), (False, math.sqrt(GAMMA * GAS * WARMTH))):
        found = tube_1d(tube, Valve(0.004 * LITRE), 0.1 * ML, longest=0.01, cells=240, isothermal=isothermal)
        gained = found.contained - 1e5 * (tube.volume + 0.1 * ML) / (GAS * WARMTH)
        assert gained == pytest.approx(found.entered, rel=1e-9)
        # at the closed end the wave is doubled: half of its front is one ρ c u
        speed = choked_rate(7e5, WARMTH, 0.004 * LITRE) / (tube.area * 1e5 / (GAS * WARMTH))
        front = 1e5 + 1e5 / (GAS * WARMTH) * sound * speed
        arrives = time_to(found.times, found.pressure, front)
        assert arrives == pytest.approx(tube.length / sound, rel=0.03)


# valve C [dm³/(s·bar)], tube, volume [ml]
CASES = {
    "valve_far_smaller": (0.055, Tube(2.5e-3, 0.8), 30.0),
    "valve_smaller": (0.4, Tube(4e-3, 2.0), 60.0),
    "valve_half": (0.2, Tube(2.5e-3, 0.8), 30.0),
    "valve_half_short": (0.86, Tube(4e-3, 0.3), 30.0),
    "alike": (0.4, Tube(2.5e-3, 0.8), 30.0),
    "valve_larger": (2.0, Tube(2.5e-3, 0.8), 30.0),
}
SHARES = (0.1, 0.5, 0.9)


def _times(times, pressure):
    return np.array([time_to(times, pressure, 1e5 + share * 6e5) for share in SHARES])


def errors(case: str, lumping: Lumping, **how: float | bool) -> tuple[np.ndarray, np.ndarray]:
    """Times to 10, 50 and 90 % of the step by the one-dimensional tube [s]; the lumped one's errors [-]."""
    conductance, tube, volume = CASES[case]
    valve = Valve(conductance * LITRE)
    found = tube_1d(tube, valve, volume * ML, **how)
    truth = _times(found.times, found.pressure)
    times = np.linspace(0.0, 1.3 * found.times[-1], 2000)
    return truth, _times(times, lumped(tube, valve, volume * ML, times, lumping=lumping, **how)) / truth - 1.0


@pytest.mark.parametrize("case", ["valve_far_smaller", "valve_smaller", "alike", "valve_larger"])
def test_one_dimensional_tube_is_converged(case):
    conductance, tube, volume = CASES[case]
    found = [tube_1d(tube, Valve(conductance * LITRE), volume * ML, cells=n) for n in (30, 60, 120)]
    coarse, middle, fine = (_times(f.times, f.pressure) for f in found)
    assert coarse == pytest.approx(fine, rel=3e-3)
    assert middle == pytest.approx(fine, rel=1.5e-3)


@pytest.mark.parametrize("isothermal", [True, False])
@pytest.mark.parametrize("case", ["valve_far_smaller", "valve_smaller", "valve_half", "valve_half_short"])
def test_two_halves_are_a_tube_behind_a_smaller_valve(case, isothermal):
    assert np.max(np.abs(errors(case, HALVES, isothermal=isothermal)[1])) < 0.03


@pytest.mark.parametrize("isothermal", [True, False])
def test_where_the_tube_counts_halves_begin_too_soon(isothermal):
    """They know no travelling wave: half and end of the fill are right, its first tenth is not."""
    travel = 0.8 / math.sqrt(GAS * WARMTH)
    for case, worst in (("alike", 0.07), ("valve_larger", 0.20)):
        times, (tenth, half, most) = errors(case, HALVES, isothermal=isothermal)
        assert abs(half) < 0.02 and abs(most) < 0.04
        assert -worst < tenth < 0.0
        assert -0.7 * travel < tenth * times[0]
        # a second segment takes more than half of that away
        assert errors(case, segments(2), isothermal=isothermal)[1][0] > 0.5 * tenth


def test_segments_in_series_are_the_whole_tube():
    """The choked flow of segments that share the friction, with 510 in the last one, is that of the whole."""
    for tube in TUBES:
        whole = tube.eckersten()[0]
        for n in (2, 3):
            shares = segments(n)
            assert sum(shares.volumes) == pytest.approx(1.0, rel=1e-12)
            nodes = {"0": Fixed(7.0 * BAR), str(n): Fixed(1.0)}
            nodes |= {str(k): Volume(10.0 * ML, 1.0 * BAR, isothermal=True) for k in range(1, n)}
            edges = []
            for k, (length, entry) in enumerate(shares.parts):
                c, b = tube.eckersten(length, entry)
                edges.append(Edge(str(k), str(k + 1), c, b if entry else 0.0))
            found = network_reference(nodes, edges, [0.0, 4.0, 4.01], rtol=1e-9)
            flow = (found.passed[0][2] - found.passed[0][1]) / 0.01
            assert flow / (DENSITY * 7.0 * BAR) == pytest.approx(whole, rel=0.01)
