"""Valve times of two 2/2 valves as those of one 3/2 valve, and back."""

import pytest

from afo_sim.description.reader import load
from afo_sim.study.sizing.air_parts import one_coil, times_for, two_coils, within


@pytest.mark.parametrize(
    ("inlets", "outlets", "coil"),
    [
        ([(0.5, 0.95)], [(0.15, 0.45)], [(0.5, 0.15)]),  # held over the heel strike, until the outlet opens
        ([(0.1, 0.2)], [(0.4, 0.9)], [(0.1, 0.4)]),
        ([(0.1, 0.2), (0.25, 0.3)], [(0.4, 0.9)], [(0.1, 0.4)]),  # two pulses of one filling
        ([(0.1, 0.2), (0.6, 0.7)], [(0.4, 0.5), (0.8, 0.9)], [(0.1, 0.4), (0.6, 0.8)]),
        ([(0.1, 0.2)], [], [(0.1, 0.2)]),
        ([], [(0.0, 1.0)], []),
    ],
)
def test_a_coil_stays_on_until_the_outlet_would_open(
    inlets: list[tuple[float, float]], outlets: list[tuple[float, float]], coil: list[tuple[float, float]]
) -> None:
    assert one_coil(inlets, outlets, 1.0) == coil


def test_the_outlet_is_open_where_the_coil_is_off() -> None:
    assert two_coils([(0.5, 0.15)], 1.0) == [(0.15, 0.5)]
    assert two_coils([(0.1, 0.4), (0.6, 0.8)], 1.0) == [(0.4, 0.6), (0.8, 0.1)]
    assert two_coils([], 8.0) == [(0.0, 8.0)]
    assert two_coils([(0.0, 1.0)], 1.0) == []
    assert within([(6.0, 1.0), (2.0, 3.0)], 8.0) == [(0.0, 1.0), (2.0, 3.0), (6.0, 8.0)]


def test_a_timer_keeps_its_unit_and_does_not_run_over_its_period() -> None:
    seated = load("scenario", "seated")  # filled from 0 to 4 s, vented from 4 to 8 s
    assert times_for(seated, "dorsiflexor", three_way=True) == {
        "timer.dorsiflexor.inlet": [["0.0 s", "4.0 s"]],
        "timer.dorsiflexor.outlet": [],
    }
    one = seated.set({"timer.dorsiflexor.outlet": []})
    assert times_for(one, "dorsiflexor", three_way=False)["timer.dorsiflexor.outlet"] == [["4.0 s", "8.0 s"]]
    walk = times_for(load("scenario", "walk-dropfoot-afo"), "dorsiflexor", three_way=True)
    assert walk["phases.dorsiflexor.inlet"] == [[0.5, 0.15]]
