"""The compiled air network against closed forms, laws of nature, scipy and a one-dimensional tube."""

import itertools

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
    Solution,
    Volume,
    adiabatic_fill,
    adiabatic_vent,
    isothermal_fill,
    isothermal_vent,
    network_reference,
    time_to,
)
from air.tube_1d import HALVES, Tube, Valve, segments, tube_1d

ML, MS = 1e-6, 1e-3
CV, CP = GAS / (GAMMA - 1.0), GAMMA * GAS / (GAMMA - 1.0)


def fixed(supply: float) -> dict[str, Volume | Fixed]:
    return {"supply": Fixed(supply), "ambient": Fixed()}


def worst(stepped: Stepped, found: Solution, span: float) -> float:
    """Largest difference of pressure in any volume at the times of the reference, as a share of a span."""
    every = round((found.times[1] - found.times[0]) / stepped.step)
    return max(
        float(np.max(np.abs(stepped.pressure[name][::every] - found.pressure[name]))) / span
        for name in found.pressure
    )


def filled(c: float, b: float, volume: float, supply: float, wall: float, steps: list[float]) -> list[float]:
    """Errors of the pressure during a fill from ambient pressure, as shares of the step, by time step."""
    nodes = {**fixed(supply), "v": Volume(volume, AMBIENT, wall=wall)}
    edges = [Edge("supply", "v", c, b)]
    duration = 2 * MS * min(max(round(1.8 * volume / (c * BAR) / (2 * MS)), 5), 100)
    found = network_reference(nodes, edges, np.linspace(0.0, duration, round(duration / (2 * MS)) + 1))
    return [worst(NativeNetwork(nodes, edges, h).run(duration), found, supply - AMBIENT) for h in steps]


# One volume


@pytest.mark.parametrize("isothermal", [True, False])
def test_choked_fill_and_vent_of_100_ml(isothermal):
    volume, c, source = 100.0 * ML, 0.39 * LITRE, 7.0 * BAR
    fill = NativeNetwork(
        {**fixed(source), "v": Volume(volume, AMBIENT, isothermal=isothermal)}, [Edge("supply", "v", c, 0.5)]
    ).run(0.05)
    closed = isothermal_fill if isothermal else adiabatic_fill
    expected = closed(fill.times, volume, AMBIENT, source, c)
    assert fill.pressure["v"][-1] < 0.5 * source
    assert np.max(np.abs(fill.pressure["v"] - expected)) < 1e-3 * (expected[-1] - AMBIENT)
    vent = NativeNetwork(
        {**fixed(source), "v": Volume(volume, source, isothermal=isothermal)}, [Edge("v", "ambient", c, 0.5)]
    ).run(0.2)
    expected = (isothermal_vent if isothermal else adiabatic_vent)(vent.times, volume, source, c)
    assert vent.pressure["v"][-1] > 2.0 * AMBIENT
    assert vent.pressure["v"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("conductance", "volume"),
    [
        (0.055, 30.0),
        (0.39, 4.0),
        (0.39, 30.0),
        (0.86, 30.0),
        (2.8, 30.0),
        (10.0, 30.0),
        (0.39, 100.0),
        (2.8, 100.0),
    ],
)
def test_fills_follow_the_reference_at_any_step(conductance, volume):
    steps = [0.25 * MS, 0.5 * MS, 1.0 * MS, 2.0 * MS]
    cases = itertools.product((0.1, 0.5), (3.0 * BAR, 8.0 * BAR), (0.0, 0.5))
    found = np.array([filled(conductance * LITRE, b, volume * ML, p, w, steps) for b, p, w in cases])
    assert np.max(found[:, 0]) < 1e-4
    assert np.max(found) < 2e-4  # longer steps are divided where the estimate of their error asks for it


def test_the_midpoint_rule_is_of_second_order():
    steps = [0.25 * MS, 0.5 * MS, 1.0 * MS, 2.0 * MS]  # slow air: no step is divided
    cases = itertools.product((0.1, 0.5), (3.0 * BAR, 8.0 * BAR))
    found = np.array([filled(0.39 * LITRE, b, 100.0 * ML, p, 0.5, steps) for b, p in cases])
    typical = np.median(found, axis=0)
    assert typical[1:] / typical[:-1] == pytest.approx(np.full(3, 4.0), rel=0.3)


@pytest.mark.parametrize("volume", [2.0, 4.0, 10.0, 30.0])
def test_stiff_valves_at_the_default_step(volume):
    """Every conductance of a valve that is sold, on small volumes: within 0.1 % of the step of pressure."""
    times = np.arange(31) * MS
    for c, b in ((0.055, 0.3), (0.39, 0.3), (0.86, 0.31), (1.7, 0.4), (2.8, 0.37), (4.4, 0.4), (10.0, 0.29)):
        for pressure, wall in ((7.0 * BAR, 0.5), (7.0 * BAR, 0.0), (4.0 * BAR, 0.5)):
            for origin, end, start in (("supply", "v", AMBIENT), ("v", "ambient", pressure)):
                nodes = {**fixed(pressure), "v": Volume(volume * ML, start, wall=wall)}
                edges = [Edge(origin, end, c * LITRE, b)]
                found = network_reference(nodes, edges, times)
                stepped = NativeNetwork(nodes, edges, MS).run(30 * MS)
                assert worst(stepped, found, pressure - AMBIENT) < 1e-3, (c, pressure, wall, origin)


def test_stiffest_valve_on_the_smallest_volume_against_short_steps():
    # SY9000 on the 2 ml of half a shipped tube: 1 ms against 10 µs, and these against scipy
    nodes = {**fixed(7.0 * BAR), "v": Volume(2.0 * ML, AMBIENT, wall=0.5)}
    edges = [Edge("supply", "v", 10.0 * LITRE, 0.29)]
    found = network_reference(nodes, edges, np.arange(11) * MS)
    assert worst(NativeNetwork(nodes, edges, 0.01 * MS).run(10 * MS), found, 6.0 * BAR) < 1e-4
    assert worst(NativeNetwork(nodes, edges, MS).run(10 * MS), found, 6.0 * BAR) < 2e-4


# Several


def random_network(seed: int) -> tuple[dict[str, Volume | Fixed], list[Edge]]:
    """Four volumes on a supply, each with one or two restrictions or check valves to those before it."""
    random = np.random.default_rng(seed)
    nodes = fixed(random.uniform(4.0, 8.0) * BAR)
    for k in range(4):
        start, warm = random.uniform(1.1, 6.0) * BAR, random.uniform(280.0, 320.0)
        nodes[f"v{k}"] = Volume(random.uniform(5.0, 100.0) * ML, start, warm, random.choice([0.0, 0.5]))
    names = list(nodes)
    edges = [Edge("supply", "v0", 0.3 * LITRE, 0.3), Edge("v0", "ambient", 0.1 * LITRE, 0.3)]
    for k in range(3, 6):
        for other in sorted({int(random.integers(0, k)), k - 1}):
            c, b = random.uniform(0.05, 1.0) * LITRE, random.uniform(0.1, 0.5)
            cracking = 0.1 * BAR if random.random() < 0.4 else None
            edges.append(Edge(names[other], names[k], c, b, cracking=cracking))
    return nodes, edges


@pytest.mark.parametrize("seed", range(5))
def test_random_networks_keep_mass_and_energy_and_follow_the_reference(seed):
    nodes, edges = random_network(seed)
    stepped = NativeNetwork(nodes, edges, MS, chambers=("v0", "v2")).run(0.2)
    passed, flow = stepped.passed, [f[1:] for f in stepped.flow]
    moved = sum(float(np.sum(np.abs(f))) * MS for f in flow)
    for name, mass in stepped.mass.items():
        into = sum(
            (e.end == name) * p[-1] - (e.origin == name) * p[-1] for e, p in zip(edges, passed, strict=True)
        )
        assert mass[-1] - mass[0] == pytest.approx(into, abs=1e-9 * moved)
    # energy of all volumes: what came in and went out at given nodes, and the walls' heat
    middle = {name: 0.5 * (t[1:] + t[:-1]) for name, t in stepped.temperature.items()}
    stored = sum(CV * stepped.mass[n] * stepped.temperature[n] for n in stepped.mass)
    heat = sum(nodes[n].wall * np.sum(WARMTH - t) * MS for n, t in middle.items())
    carried = 0.0
    for edge, f in zip(edges, flow, strict=True):
        for inner, outer, inward in ((edge.end, edge.origin, f), (edge.origin, edge.end, -f)):
            if isinstance(nodes[outer], Fixed):
                carried += CP * MS * np.sum(np.where(inward > 0.0, WARMTH * inward, middle[inner] * inward))
    assert stored[-1] - stored[0] == pytest.approx(carried + heat, abs=1e-3 * CP * WARMTH * moved)
    found = network_reference(nodes, edges, stepped.times[::10], rtol=1e-8)
    assert worst(stepped, found, 5.0 * BAR) < 1e-3
    for ours, theirs in zip(passed, found.passed, strict=True):
        assert ours[::10] == pytest.approx(theirs, abs=1e-3 * moved)


RESERVOIR = {
    "manifold": Volume(20.0 * ML, 4.0 * BAR, wall=0.1),
    "a": Volume(40.0 * ML, 1.2 * BAR, wall=0.5),
    "b": Volume(25.0 * ML, AMBIENT, wall=0.5),
}
LINES = [
    Edge("supply", "manifold", 0.28 * LITRE, 0.215),  # 2 m of tube
    Edge("manifold", "a", 0.39 * LITRE, 0.3),
    Edge("manifold", "b", 0.055 * LITRE, 0.3),
    Edge("b", "ambient", 0.02 * LITRE, 0.3),
]


def test_two_chambers_on_one_small_reservoir():
    """The fast chamber drains the manifold, so that the slow one fills later: as scipy says."""
    nodes = {**fixed(6.0 * BAR), **RESERVOIR}
    stepped = NativeNetwork(nodes, LINES, MS, chambers=("a", "b")).run(0.3)
    found = network_reference(nodes, LINES, stepped.times[::10])
    assert min(found.pressure["manifold"]) < 3.8 * BAR
    assert worst(stepped, found, 5.0 * BAR) < 1e-4
    for name in found.temperature:
        assert stepped.temperature[name][::10] == pytest.approx(found.temperature[name], abs=0.02)
    for ours, theirs in zip(stepped.passed, found.passed, strict=True):
        assert ours[-1] == pytest.approx(theirs[-1], rel=1e-4)


def test_order_of_chambers_and_volumes_changes_nothing():
    nodes = {**fixed(6.0 * BAR), **RESERVOIR}
    ways = [("a", "b"), ("b", "a"), ("manifold", "a", "b"), ("a",), ("b", "manifold")]
    ends = [NativeNetwork(nodes, LINES, MS, chambers=way).run(0.1) for way in ways]
    for name in RESERVOIR:
        for end in ends[1:]:
            assert end.pressure[name] == pytest.approx(ends[0].pressure[name], rel=1e-9)


@pytest.mark.parametrize("conductance", [0.39, 2.8, 10.0])
@pytest.mark.parametrize("start", [2.0 * BAR, 5.0 * BAR])
def test_nothing_chatters_at_equal_pressures(conductance, start):
    """Small volumes that meet through a large restriction: the flow dies away and never turns."""
    nodes = {**fixed(6.0 * BAR), "a": Volume(5.0 * ML, start), "b": Volume(3.0 * ML, 2.0 * BAR)}
    edges = [Edge("a", "b", conductance * LITRE, 0.3)]
    stepped = NativeNetwork(nodes, edges, MS, chambers=("a",)).run(0.1)
    flow = stepped.flow[0][1:]
    loud = np.sign(flow[np.abs(flow) > 1e-12])  # a thousandth of a microgram per step
    assert np.count_nonzero(np.diff(loud)) == 0
    assert np.all(flow >= -1e-12)
    assert abs(flow[-1]) < 1e-9
    together = (5.0 * start + 3.0 * 2.0 * BAR) / 8.0
    for name in ("a", "b"):
        assert stepped.pressure[name][-1] == pytest.approx(together, rel=1e-6)


def test_switched_valves_lose_no_air():
    """Coils that open and shut in the midst of flows: mass closes, and all of it has passed the valves."""
    nodes = {**fixed(6.0 * BAR), **RESERVOIR}
    rig = NativeNetwork(nodes, LINES, MS, chambers=("a", "b"))

    def switch(time, data, ids):
        for k, name in enumerate(sorted(rig.open)):
            data.ctrl[ids.valves[name]] = float((time / 0.007 + 0.3 * k) % 1.0 < 0.5)

    stepped = rig.run(0.2, switch)
    moved = sum(float(np.sum(np.abs(f))) * MS for f in stepped.flow)
    total = sum(mass[-1] - mass[0] for mass in stepped.mass.values())
    assert moved > 1e-4
    assert total == pytest.approx(stepped.passed[0][-1] - stepped.passed[3][-1], abs=1e-9 * moved)


# A tube

CASES = [  # valve C [dm³/(s·bar)], tube, volume [ml], largest error of the times to 10, 50, 90 % of the step
    (0.055, Tube(2.5e-3, 0.8), 30.0, (0.03, 0.03, 0.03)),
    (0.4, Tube(4e-3, 2.0), 60.0, (0.03, 0.03, 0.03)),
    (0.2, Tube(2.5e-3, 0.8), 30.0, (0.03, 0.03, 0.03)),
    (0.4, Tube(2.5e-3, 0.8), 30.0, (0.07, 0.03, 0.03)),  # alike: the wave's travel is missing
]


@pytest.mark.parametrize(("conductance", "tube", "volume", "limits"), CASES)
@pytest.mark.parametrize("isothermal", [True, False])
def test_tube_between_halves_of_its_volume(conductance, tube, volume, limits, isothermal):
    valve = Valve(conductance * LITRE)
    truth = tube_1d(tube, valve, volume * ML, isothermal=isothermal)
    for lumping in (HALVES, segments(2)):
        last = len(lumping.volumes) - 1
        nodes = fixed(7e5)
        for k, share in enumerate(lumping.volumes):
            size = share * tube.volume + (volume * ML if k == last else 0.0)
            nodes[str(k)] = Volume(size, 1e5, isothermal=isothermal)
        edges = [Edge("supply", "0", valve.conductance, valve.critical)]
        for k, (length, entry) in enumerate(lumping.parts):
            c, b = tube.eckersten(length, entry)
            edges.append(Edge(str(k), str(k + 1), c, b if entry else 0.0))
        duration = round(1.2 * float(truth.times[-1]), 3)
        stepped = NativeNetwork(nodes, edges, MS, chambers=("0",)).run(duration)
        found = network_reference(nodes, edges, stepped.times, rtol=1e-8)
        assert worst(stepped, found, 6.0 * BAR) < 2e-3
        if lumping is HALVES:
            for share, limit in zip((0.1, 0.5, 0.9), limits, strict=True):
                level = 1e5 + share * 6e5
                expected = time_to(truth.times, truth.pressure, level)
                assert time_to(stepped.times, stepped.pressure[str(last)], level) == pytest.approx(
                    expected, rel=limit
                )
