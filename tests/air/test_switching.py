"""Valves that switch within a step, against scipy from one switching to the next."""

import numpy as np
import pytest
from air.native_network import NativeNetwork
from air.reference import AMBIENT, LITRE, Edge, Fixed, Volume, network_reference

PERIOD, CYCLES = 0.08, 5
INLET, OUTLET = (0.0064, 0.0412), (0.0424, 0.0788)  # with current within the period [s]
RATIO = 0.3


def on(time: np.ndarray | float, interval: tuple[float, float]) -> np.ndarray:
    """For how long a coil has had current until a time [s]."""
    turns, beyond = np.divmod(time, PERIOD)
    return turns * (interval[1] - interval[0]) + np.clip(beyond, *interval) - interval[0]


@pytest.mark.parametrize("step", [4e-3, 2.5e-3, 8e-3])
@pytest.mark.parametrize("conductance", [0.1, 0.6])  # midpoints, and stages of stiff air
def test_an_inlet_and_an_outlet_that_switch_in_one_step_do_not_leak_across(step, conductance) -> None:
    nodes = {"supply": Fixed(5e5), "ambient": Fixed(), "air": Volume(3e-5, AMBIENT, wall=0.5)}
    ends = {INLET: ("supply", "air"), OUTLET: ("air", "ambient")}
    edges = [Edge(*ends[coil], conductance * LITRE, RATIO) for coil in (INLET, OUTLET)]
    rig = NativeNetwork(nodes, edges, step, chambers=("air",))

    def switch(time, data, ids) -> None:
        for coil, key in ((INLET, "air_inlet"), (OUTLET, "air_outlet")):
            data.ctrl[ids.valves[key]] = np.round((on(time + step, coil) - on(time, coil)) / step, 9)

    found = rig.run(CYCLES * PERIOD, switch)
    breaks = tuple(float(k * PERIOD + t) for k in range(CYCLES) for t in (*INLET, *OUTLET))
    exact = network_reference(
        nodes,
        [
            Edge(*ends[coil], conductance * LITRE, RATIO, breaks=breaks,
                 opening=lambda t, coil=coil: float(coil[0] <= t % PERIOD < coil[1]))
            for coil in (INLET, OUTLET)
        ],
        found.times,
    )  # fmt: skip
    for k in range(2):  # each cycle's air
        cycles = np.diff(np.interp(np.arange(CYCLES + 1) * PERIOD, found.times, found.passed[k]))
        expected = np.diff(np.interp(np.arange(CYCLES + 1) * PERIOD, found.times, exact.passed[k]))
        assert cycles == pytest.approx(expected, rel=1e-3)
    kept = found.mass["air"][0] + found.passed[0] - found.passed[1]
    assert found.mass["air"] == pytest.approx(kept, rel=1e-12)
