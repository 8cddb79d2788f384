"""Times to fill and to vent against closed forms of a chamber that follows an exponential."""

import numpy as np
import pytest

from afo_sim.metrics.valves import filling

STEP, SUPPLY, TAU = 1e-4, 4e5, 0.05  # [s], [Pa], [s]
Columns = dict[str, np.ndarray]


def chamber(*turns: tuple[str, float], three_way: bool = False, start: float = 0.0) -> Columns:
    """Columns of a chamber that is filled, vented or held for times [s], each along its own exponential."""
    pressure, coils = [start], {"inlet": [], "outlet": []}  # type: ignore[var-annotated]
    for what, duration in turns:
        end = {"fill": SUPPLY, "vent": 0.0, "hold": pressure[-1]}[what]
        n = round(duration / STEP)
        times = STEP * np.arange(1, n + 1)
        pressure += list(end + (pressure[-1] - end) * np.exp(-times / TAU))
        coils["inlet"] += [float(what == "fill")] * n
        coils["outlet"] += [float(what == "vent" and not three_way)] * n
    n = len(coils["inlet"])
    opening = 1.0 - np.array(coils["inlet"]) if three_way else np.array(coils["outlet"])
    return {
        "time": STEP * np.arange(n),
        "supply/pressure": np.full(n, SUPPLY),
        "chamber/calf/mass": np.zeros(n),
        "chamber/calf/pressure": np.array(pressure[:n]),
        "valve/calf_inlet/coil": np.array(coils["inlet"]),
        "valve/calf_outlet/coil": np.array(coils["outlet"]),
        "valve/calf_outlet/opening": opening,
    }


@pytest.mark.parametrize("three_way", [False, True])
def test_an_exponential_takes_its_time_constant_times_the_logarithm_of_ten(three_way: bool) -> None:
    found = dict(filling(chamber(("fill", 0.4), ("vent", 0.4), three_way=three_way)))
    full = SUPPLY * (1.0 - np.exp(-0.4 / TAU))
    assert found["fill_time_calf"] == pytest.approx(TAU * np.log(10.0), abs=2 * STEP)
    assert found["vent_time_calf"] == pytest.approx(TAU * np.log(10.0 * full / SUPPLY), abs=2 * STEP)


def test_the_longest_counts_and_pulses_of_one_filling_are_one() -> None:
    pulses = ("fill", 0.03), ("hold", 0.1), ("fill", 0.4)
    columns = chamber(("fill", 0.4), ("vent", 0.4), *pulses)
    found = dict(filling(columns))
    assert found["fill_time_calf"] == pytest.approx(0.1 + TAU * np.log(10.0), abs=5 * STEP)


def test_what_falls_short_has_no_time_and_what_is_cut_off_does_not_count() -> None:
    assert "fill_time_calf" not in dict(filling(chamber(("fill", 0.05), ("vent", 0.4))))
    found = dict(filling(chamber(("fill", 0.4), ("vent", 0.4), ("fill", 0.05))))
    assert found["fill_time_calf"] == pytest.approx(TAU * np.log(10.0), abs=2 * STEP)
    assert not dict(filling(chamber(("hold", 0.2))))


def test_what_began_before_the_first_row_is_left_out() -> None:
    columns = chamber(("fill", 0.2), ("vent", 0.4), ("fill", 0.4), start=0.5 * SUPPLY)
    assert dict(filling(columns, from_rest=False))["fill_time_calf"] == pytest.approx(
        TAU * np.log(10.0), rel=0.01
    )
    only = chamber(("fill", 0.4), start=0.5 * SUPPLY)
    assert not dict(filling(only, from_rest=False)) and dict(filling(only))
