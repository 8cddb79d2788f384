"""The fixed clock of a controller: events at ticks, and a foot switch that starts it anew."""

import math
from typing import Any

import numpy as np
import pytest
from control.samples import commands, made, walker

import afo_sim
from afo_sim.common import InputError
from afo_sim.control import coils

CLOCK: dict[str, Any] = {
    "period": "50 ms",
    "dorsiflexor": {"inlet": [["20 ms", "35 ms"]], "outlet": [["0 s", "10 ms"], ["45 ms", "50 ms"]]},
}
FILL, SHUT, VENT = (1.0, 0.0), (0.0, 0.0), (0.0, 1.0)


def test_coils_are_those_of_the_tick() -> None:
    found = commands(made({"timer": CLOCK}), 0.01, x=[0.0] * 11)
    # at 0, 10, …, 100 ms: the events at 35 and 45 ms wait for the next tick, which the second never gets
    expected = [VENT, SHUT, FILL, FILL, SHUT] * 2 + [VENT]
    assert [command["dorsiflexor"] for command in found] == expected


def test_a_foot_switch_starts_it_anew_and_it_waits_for_the_next() -> None:
    restart = {"column": "foot/heel_load", "above": "0.03 kN", "after": "40 ms"}
    clock = made({"timer": CLOCK | {"restart": restart}})
    heel = [50.0, 0.0, 30.0, 30.0, 0.0, 40.0, 0.0, 0.0, 0.0, 0.0, 0.0, 40.0]
    found = commands(clock, 0.01, foot__heel_load=heel)
    # closed at first: no heel strike seen, the clock runs from 0. Strikes in samples 2 and 11; the switch
    # bounces in 5. From sample 7 on the clock stands at its period.
    since = [0, 1, 0, 1, 2, 3, 4, 5, 5, 5, 5, 0]
    by_tick = [VENT, SHUT, FILL, FILL, SHUT, SHUT]
    assert [command["dorsiflexor"] for command in found] == [by_tick[tick] for tick in since]


def test_a_reset_sets_the_clock_to_zero() -> None:
    clock: Any = made({"timer": CLOCK | {"restart": {}}})
    before = commands(clock, 0.01, foot__heel_load=[0.0, 90.0, 90.0])
    clock.reset()
    assert commands(clock, 0.01, foot__heel_load=[0.0, 90.0, 90.0]) == before


def test_it_does_what_the_exact_timer_does_on_a_grid_of_ticks() -> None:
    times = {
        "period": "0.2 s",
        "dorsiflexor": {"inlet": [["0.05 s", "0.12 s"]], "outlet": [["0.15 s", "0.2 s"]]},
    }
    sets = {"duration": "0.5 s", "reference": None}
    looped = afo_sim.run(walker({"timer": times, "rate": "100 Hz"}, **sets))
    exact = afo_sim.run(
        "walk-dropfoot-afo", sets | {"phases": None, "timer": times, "gait.settled": "walked"}
    )
    for column in ("valve/dorsiflexor_inlet/coil", "valve/dorsiflexor_outlet/coil", "ankle/angle"):
        assert np.array_equal(looped[column], exact[column]), column
    assert looped["controller/phase"][125] == pytest.approx(0.6, abs=1e-6)


@pytest.mark.parametrize("command", [(1.05, 0.0), (0.0, 1.05), (-0.05, 0.0), (0.0, -0.05), (math.nan, 0.0)])
def test_coils_beyond_their_range_are_refused(command: tuple[float, float]) -> None:
    ends = {"front": (0.0, 1.0), "back": (1.0, 0.0)}
    assert coils(ends, ends) == ends
    with pytest.raises(InputError, match="outside a coil's range"):
        coils({"front": command}, ["front"])
