"""Lines whose air has inertia: steady flow, ring, balances, scipy, a one-dimensional tube, descriptions."""

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest
from air.native_network import NativeNetwork, Stepped
from air.reference import (
    AMBIENT,
    BAR,
    GAMMA,
    GAS,
    LITRE,
    WARMTH,
    Edge,
    Fixed,
    Volume,
    iso_flow,
    network_reference,
    time_to,
)
from air.test_network_physics import CP, CV, ML, MS, fixed, random_network, worst
from air.tube_1d import Tube, Valve, tube_1d

import afo_sim as afo
from afo_sim import native
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.model import check_air, circuit_of
from afo_sim.model.air_path import least_volume
from afo_sim.native import slots
from afo_sim.physics import INERTIAL, flow_edge, line_flow

TUBES = [Tube(2.5e-3, 1.0), Tube(4e-3, 2.0), Tube(4e-3, 0.3)]


def line(tube: Tube, origin: str, end: str) -> Edge:
    c, b = tube.eckersten()
    return Edge(origin, end, c, b, inertance=tube.length / tube.area)


@pytest.mark.parametrize("tube", TUBES)
@pytest.mark.parametrize("ratio", [1.0, 0.995, 0.97, 0.8, 0.5, 0.1])
def test_a_steady_line_passes_what_a_tube_without_inertia_does(tube: Tube, ratio: float) -> None:
    (c, b), warm = tube.eckersten(), 320.0
    for p1, t1, p2, t2 in ((6e5, warm, ratio * 6e5, WARMTH), (ratio * 6e5, WARMTH, 6e5, warm)):
        for flow in (0.0, 1e-2, -1e-2):
            for _ in range(8000):
                flow = line_flow(flow, p1, t1, p2, t2, c, b, 1e-4 * tube.area / tube.length)
            assert flow == pytest.approx(iso_flow(p1, t1, p2, t2, c, b), rel=1e-6, abs=1e-12)


# A ring: a small difference of pressure between two adiabatic volumes

SMALL, LARGE, LEVEL = 5 * ML, 30 * ML, 4 * BAR


@functools.cache
def rings(tube: Tube, step: float, difference: float = 1e-4) -> Stepped:
    nodes = {**fixed(7e5), "a": Volume(SMALL, LEVEL * (1.0 + difference)), "b": Volume(LARGE, LEVEL)}
    return NativeNetwork(nodes, [line(tube, "a", "b")], step, chambers=("b",)).run(0.1)


@pytest.mark.parametrize("tube", TUBES)
@pytest.mark.parametrize("step", [0.2 * MS, 1 * MS, 2 * MS])
def test_a_line_between_two_volumes_rings_as_a_helmholtz_resonator(tube: Tube, step: float) -> None:
    """p1 − p2 follows s² + a r s + ω0² = 0, a = A/L, ω0² = a γ R T (1/V1 + 1/V2), r as friction begins."""
    found, (c, b), a = rings(tube, step), tube.eckersten(), tube.area / tube.length
    x = (0.98 - b) / (1.0 - b)
    rate = 0.5 * a * 0.02 / (math.sqrt(1.0 - x * x) * c * 1.185)
    own = math.sqrt(a * GAMMA * GAS * WARMTH * (1.0 / SMALL + 1.0 / LARGE))
    damped = math.sqrt(own * own - rate * rate)
    difference = (found.pressure["a"] - found.pressure["b"]) / (1e-4 * LEVEL)
    expected = np.exp(-rate * found.times) * (
        np.cos(damped * found.times) + rate / damped * np.sin(damped * found.times)
    )
    assert rate < 0.15 * own
    assert np.max(np.abs(difference - expected)) < 0.012
    # period by where it crosses zero; decay by the air that the line has moved at last
    k = np.flatnonzero(np.diff(np.sign(difference)))[:8]
    if step < 1 * MS:
        crossings = found.times[k] + step * difference[k] / (difference[k] - difference[k + 1])
        assert math.pi / np.diff(crossings).mean() == pytest.approx(damped, rel=0.01)
        peaks = [np.abs(difference[i:j]).max() for i, j in itertools.pairwise(k)]
        decay = np.log(peaks[0] / peaks[-1]) / (crossings[-2] - crossings[0])
        assert decay == pytest.approx(rate, rel=0.03)


def test_half_the_step_changes_a_ring_by_little() -> None:
    """A large one, beyond linear friction: by less than half a per cent of what it begins with."""
    for tube in TUBES:
        coarse, fine = rings(tube, 1 * MS, 0.3), rings(tube, 0.5 * MS, 0.3)
        assert np.max(np.abs(coarse.pressure["a"] - fine.pressure["a"][::2])) < 0.005 * 0.3 * LEVEL


def with_lines(seed: int) -> tuple[dict[str, Volume | Fixed], list[Edge]]:
    """A random network whose open restrictions between volumes are lines of half a metre."""
    nodes, edges = random_network(seed)
    inner = [
        dataclasses.replace(e, inertance=0.5 / (math.pi / 4.0 * 3e-3**2))
        if e.cracking is None and not {"supply", "ambient"} & {e.origin, e.end}
        else e
        for e in edges
    ]
    return nodes, inner


@pytest.mark.parametrize("seed", range(5))
def test_networks_of_lines_keep_mass_and_energy_and_follow_the_reference(seed: int) -> None:
    nodes, edges = with_lines(seed)
    lines = [k for k, edge in enumerate(edges) if edge.inertance is not None]
    assert lines
    stepped = NativeNetwork(nodes, edges, MS, chambers=("v0", "v2")).run(0.2)
    found = network_reference(nodes, edges, stepped.times[::10], rtol=1e-8)
    assert worst(stepped, found, 5.0 * BAR) < 3e-3
    moved = sum(float(np.sum(np.abs(flow))) * MS for flow in stepped.flow)
    for name, mass in stepped.mass.items():
        into = sum(
            (e.end == name) * p[-1] - (e.origin == name) * p[-1]
            for e, p in zip(edges, stepped.passed, strict=True)
        )
        assert mass[-1] - mass[0] == pytest.approx(into, abs=1e-9 * moved)


def test_two_volumes_and_a_line_keep_their_air_and_energy_to_rounding() -> None:
    """The line's kinetic energy ½ (L/A) ṁ²/ρ is not taken from the air: 1 % of it where 8 bar meet 4 bar, and
    2 % while a valve begins to fill what is behind the line."""
    for tube in TUBES:
        found = rings(tube, 1 * MS, 1.0)
        mass = found.mass["a"] + found.mass["b"]
        energy = CV * (found.mass["a"] * found.temperature["a"] + found.mass["b"] * found.temperature["b"])
        assert np.ptp(mass) < 1e-14 * mass[0]
        assert np.ptp(energy) < 1e-9 * energy[0]
        inertance, density = tube.length / tube.area, LEVEL / (GAS * WARMTH)
        assert 1e-3 * energy[0] < 0.5 * inertance * np.max(found.flow[0]) ** 2 / density < 1e-2 * energy[0]
        nodes = {**fixed(7e5), "a": Volume(SMALL), "b": Volume(LARGE)}
        edges = [Edge("supply", "a", 0.4 * LITRE), line(tube, "a", "b")]
        fill = NativeNetwork(nodes, edges, MS, chambers=("a",)).run(0.1)
        kinetic = 0.5 * inertance * fill.flow[1] ** 2 * GAS * fill.temperature["a"] / fill.pressure["a"]
        air = (fill.pressure["a"] * SMALL + fill.pressure["b"] * LARGE) / (GAMMA - 1.0)
        assert np.max(kinetic / air) < 2e-2


def test_a_line_begins_closer_to_a_one_dimensional_tube() -> None:
    """Where the tube counts, the first 2 and 10 % of a fill come less early than without inertia."""
    for conductance, tube, volume in ((2.0, Tube(2.5e-3, 0.8), 30 * ML), (0.4, Tube(2.5e-3, 0.8), 30 * ML)):
        truth = tube_1d(tube, Valve(conductance * LITRE), volume)
        half = 0.5 * tube.volume
        nodes = {**fixed(7e5), "0": Volume(half, 1e5, isothermal=True)}
        nodes["1"] = Volume(half + volume, 1e5, isothermal=True)
        early = []
        for edge in (Edge("0", "1", *tube.eckersten()), line(tube, "0", "1")):
            edges = [Edge("supply", "0", conductance * LITRE, 0.3), edge]
            stepped = NativeNetwork(nodes, edges, 0.1 * MS, chambers=("0",)).run(0.12)
            levels = [1e5 + share * 6e5 for share in (0.02, 0.1, 0.5, 0.9)]
            early.append(
                [
                    time_to(truth.times, truth.pressure, p) - time_to(stepped.times, stepped.pressure["1"], p)
                    for p in levels
                ]
            )
        without, inertial = np.array(early)
        assert np.all(inertial[:2] > 0.0) and np.all(inertial[:2] < 0.8 * without[:2])
        assert np.all(np.abs(inertial[2:]) < 1.5e-3)


def test_plain_python_steps_the_same() -> None:
    nodes, edges = with_lines(1)
    rig, ends = NativeNetwork(nodes, edges, MS, chambers=("v0", "v2")), []
    for mode in ("native", "python"):
        with native.installed(mode):
            ends.append(rig.run(0.02))
    for name in ends[0].mass:
        assert ends[1].mass[name] == pytest.approx(ends[0].mass[name], rel=1e-12)


# Heat by flow


@pytest.mark.parametrize("by_flow", [0.0, 100.0, 1000.0])
def test_heat_grows_with_what_flows_in(by_flow: float) -> None:
    """Filled by choked flow: m c_v dT/dt = ṁ (c_p T0 − c_v T) − k ṁ (T − T0), so that T − T_end, with
    T_end = T0 (c_p + k)/(c_v + k), goes as m^(−(c_v + k)/c_v)."""
    volume, c, supply = 20 * ML, 0.2 * LITRE, 40 * BAR
    nodes = {**fixed(supply), "v": Volume(volume, 0.02 * BAR)}
    rig = NativeNetwork(nodes, [Edge("supply", "v", c, 0.5)])
    rig.model.actuator_user[rig.actuators["v"], slots.AIR_ROW.wall_conductance_by_flow] = by_flow
    found = rig.run(0.03)
    assert found.pressure["v"][-1] < 0.5 * supply
    grown = found.mass["v"] / found.mass["v"][0]
    end = WARMTH * (CP + by_flow) / (CV + by_flow)
    expected = end + (WARMTH - end) * grown ** (-(CV + by_flow) / CV)
    assert grown[-1] > 100.0
    assert found.temperature["v"][5:] == pytest.approx(expected[5:], rel=2e-3)


# Descriptions

INERTIA = "orthosis.chamber.dorsiflexor.tube_inertia"
BETWEEN = {
    "kind": "tube",
    "tube": "pun_6x4",
    "length": "1 m",
    "upstream": "manifold",
    "downstream": "exhaust",
}


@pytest.mark.parametrize(
    ("sets", "field"),
    [
        ({"orthosis": "s1", INERTIA: True}, "tube_inertia"),  # no tube
        ({"orthosis": "s1", INERTIA.replace("tube_inertia", "port_volume"): "1 ml"}, "port_volume"),
        ({"orthosis.restriction.feed.inertia": True}, "inertia"),  # its supply has no air of its own
        ({"orthosis.restriction.silencer.inertia": True}, "inertia"),
    ],
)
def test_inertia_is_refused_where_there_is_none(sets: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as raised:
        load("scenario", "seated", {"orthosis": "s1_waist"} | sets)
    assert raised.value.field is not None and raised.value.field.endswith(field)


def test_a_line_of_the_stand_is_that_of_a_description_but_for_the_shortest() -> None:
    for length in (0.01, 0.05, 1.0):
        found = flow_edge.line("x", "a", "b", 4e-3, length)
        c, b = Tube(4e-3, length).eckersten()
        assert (found.conductance, found.critical_ratio) == pytest.approx((c, b))
        assert found.parameters == pytest.approx((math.pi / 4.0 * 4e-3**2 / max(length, 0.05),))


def test_a_described_line_is_the_tube_with_inertia() -> None:
    sets = {"orthosis": "s1_waist", INERTIA: True, "orthosis.chamber.dorsiflexor.port_volume": "1.5 ml"}
    sets |= {"orthosis.restriction.new": BETWEEN | {"inertia": True}}
    plain = circuit_of(load("scenario", "seated", {"orthosis": "s1_waist"}).orthosis)
    found = circuit_of(load("scenario", "seated", sets).orthosis)
    before, after = ({r.name: r for r in circuit.restrictions} for circuit in (plain, found))
    tube, name = before["dorsiflexor_tube"], "dorsiflexor_tube"
    area = math.pi / 4.0 * 2.5e-3**2
    assert after[name].law == INERTIAL and after[name].parameters == pytest.approx((area / 1.0,))
    assert (after[name].conductance, after[name].critical_ratio) == (tube.conductance, tube.critical_ratio)
    assert (after[name].forth, after[name].back) == (tube.forth, tube.back)
    assert after["new"].law == INERTIAL and after["plantarflexor_tube"] == before["plantarflexor_tube"]
    rooms = [{v.name: v.volume for v in c.volumes}["dorsiflexor_valve_end"] for c in (plain, found)]
    assert rooms == pytest.approx([0.5 * area, 0.5 * area + 1.5 * ML])


def test_a_time_step_is_judged_by_the_ring_where_that_is_slower_than_friction() -> None:
    """ω = √(A/L γ R T/V) of the muscles' least volume, beside heat (γ − 1) hA T/(p V)."""
    both = {f"orthosis.chamber.{name}.tube_inertia": True for name in ("dorsiflexor", "plantarflexor")}
    plain, inertial = (
        load("scenario", "seated", {"orthosis": "s1_waist"} | sets).orthosis for sets in ({}, both)
    )
    rates = []
    for name, chamber in inertial.chamber.items():
        volume = least_volume(inertial, name)
        ring = math.sqrt(math.pi / 4.0 * 2.5e-3**2 * GAMMA * GAS * WARMTH / volume)
        rates.append(ring + (GAMMA - 1.0) * chamber.wall_conductance * WARMTH / (AMBIENT * volume))
    number = check_air(inertial, 1e-3)[0]
    assert number == pytest.approx(1e-3 * max(rates), rel=1e-6)
    assert number < 0.8 * check_air(plain, 1e-3)[0]


def test_a_run_rings_where_its_tube_has_inertia() -> None:
    """S1's dorsiflexor on a wide valve and 1 m of tube: as much air in the end, and an overshoot before."""
    timer = {"period": "0.6 s", "dorsiflexor": {"inlet": [["50 ms", "80 ms"]]}}
    sets: dict[str, object] = {"orthosis": "s1_waist", "duration": "0.6 s", "timer": timer}
    sets |= {f"orthosis.chamber.dorsiflexor.{side}": "mha2" for side in ("inlet", "outlet")}
    plain, found = afo.run("seated", sets), afo.run("seated", sets | {INERTIA: True})
    ends = [run["chamber/dorsiflexor/mass"][-1] for run in (plain, found)]
    assert ends[1] == pytest.approx(ends[0], rel=0.01)
    flows = [run["restriction/dorsiflexor_tube/mass_flow"] for run in (plain, found)]
    assert np.min(flows[0]) > -1e-9 and np.min(flows[1]) < -0.05 * np.max(flows[1])
