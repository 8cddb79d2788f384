"""The least clearance of the outsole while the foot is fast, against heights that are known beforehand."""

import numpy as np
import pytest
from synthetic_walk import MASS, STEP, TOE_OFF, UPRIGHT, walk_columns

from afo_sim.metrics import Stride, WalkMetrics, walk_metrics
from afo_sim.metrics.clearance import lowest_minimum
from afo_sim.metrics.strides import strides

Columns = dict[str, np.ndarray]


def metrics(columns: Columns) -> WalkMetrics:
    return walk_metrics(columns, STEP, MASS)


def values(columns: Columns) -> dict[str, float]:
    return {name: metric.value for name, metric in metrics(columns).totals.items()}


def second(columns: Columns) -> Stride:
    return strides(columns, STEP, MASS)[1]


def one_dip(columns: Columns, place: float, depth: float) -> np.ndarray:
    """A height of 50 mm with one round dip of 4 % of the stride [m]."""
    reach = (columns["gait/phase"] - place) / 0.02
    dip: np.ndarray = 0.05 - depth * np.where(np.abs(reach) < 1.0, 0.5 + 0.5 * np.cos(np.pi * reach), 0.0)
    return dip


def test_a_quarter_of_the_stride_is_fast() -> None:
    stride = second(walk_columns())
    fast = stride.phase[stride.fast]
    assert (fast[0], fast[-1]) == (pytest.approx(0.675, abs=2e-3), pytest.approx(0.925, abs=2e-3))
    assert stride.fast.mean() == pytest.approx(0.25, abs=2e-3)
    assert stride.upright == pytest.approx(UPRIGHT, abs=1e-3)


def test_a_shank_that_is_never_upright_ends_with_the_swing() -> None:
    columns = walk_columns()
    columns["shank/angle"] = np.full_like(columns["time"], 0.2)
    assert second(columns).upright == 1.0


def test_clearance_is_the_lowest_minimum_while_the_foot_is_fast() -> None:
    columns = walk_columns()
    columns["sole/height"] = columns["sole/height"] - 0.002 * (columns["gait/phase"] > 0.8)
    found = values(columns)
    assert found["toe_clearance"] == pytest.approx(8.0, abs=1e-3)
    assert found["toe_clearance_phase"] == pytest.approx(90.0, abs=0.1)
    assert found["toe_clearance_to_recorded"] == pytest.approx(8.0 - 14.0, abs=1e-3)
    assert found["swings_without_toe_event"] == 0.0


def test_what_a_floor_catches_is_read_without_it_and_drags() -> None:
    columns = walk_columns()
    free = columns["sole/height"] - 0.02
    columns |= {f"{name}/height_without_floor": free for name in ("sole", "ball", "toe")}
    columns["gait/ground_force_z"] = columns["ground/force/z"]
    phase = columns["gait/phase"]
    columns["foot/toe_load"] = np.where((phase > 0.8) & (phase < 0.84), 30.0 * (phase - 0.8) / 0.04, 0.0)
    found = values(columns)
    assert found["toe_clearance"] == pytest.approx(values(walk_columns())["toe_clearance"] - 20.0, abs=1e-3)
    assert found["swings_with_toe_contact"] == 100.0
    assert found["toe_drag"] == pytest.approx(100.0 * 0.04 / (1.0 - TOE_OFF), rel=0.02)
    assert found["toe_drag_force"] == pytest.approx(27.0, rel=0.03)  # mean of the last 10 of 50 ms


@pytest.mark.parametrize(("place", "counts"), [(0.65, False), (0.70, True), (0.90, True), (0.95, False)])
def test_a_dip_of_a_slow_foot_is_none(place: float, counts: bool) -> None:
    columns = walk_columns()
    columns["sole/height"] = one_dip(columns, place, 0.04)
    found = values(columns)
    assert found["swings_without_toe_event"] == (0.0 if counts else 100.0)
    assert (found["toe_clearance"] == pytest.approx(10.0, abs=0.05)) == counts


def test_without_an_event_the_ankles_greatest_speed_counts() -> None:
    """Whatever other strides and the recorded foot do: a sine of speed in swing is greatest at its middle."""
    columns = walk_columns(4.2)
    ramp = 0.1 * columns["gait/phase"]
    columns["gait/sole_height"] = one_dip(columns, 0.85, 0.04)
    columns["sole/height"] = np.where(columns["gait/stride"] == 2, ramp, one_dip(columns, 0.75, 0.04))
    one = metrics(columns)
    assert one.strides[2]["toe_clearance"].value == pytest.approx(80.0, abs=0.1)
    assert one.strides[2]["toe_clearance_phase"].value == pytest.approx(80.0, abs=0.1)
    assert one.strides[2]["swings_without_toe_event"].value == 100.0
    assert one.strides[1]["toe_clearance"].value == pytest.approx(10.0, abs=0.05)
    assert one.totals["swings_without_toe_event"].value == pytest.approx(100.0 / 3.0)
    assert any(w.startswith("toe clearance: 33 % of the swings") for w in one.warnings)


def test_other_extensions_have_no_event_of_their_own_where_the_toe_has_none() -> None:
    """A toe that is nowhere higher when it extends less does not clear by more."""
    columns = walk_columns(4.2)
    columns["sole/height"] = 0.1 * columns["gait/phase"]
    bump = 0.05 - one_dip(columns, 0.90, 1.0)
    columns["sole/height_less_extended"] = columns["sole/height"] - 0.006 * bump
    found = values(columns)
    assert found["swings_without_toe_event"] == 100.0
    assert found["toe_clearance_less_extended"] == pytest.approx(found["toe_clearance"], abs=1e-6)


@pytest.mark.parametrize("step", [1e-3, 2.3e-3, 3.1e-3])
def test_the_greatest_speed_does_not_move_with_the_time_step(step: float) -> None:
    stride = strides(walk_columns(step=step), step, MASS)[1]
    assert stride.fastest == pytest.approx(0.8, abs=5e-5)


def test_the_ball_has_its_own_event() -> None:
    columns = walk_columns()
    columns["ball/height"] = one_dip(columns, 0.86, 0.02)
    found = values(columns)
    assert found["ball_clearance"] == pytest.approx(30.0, abs=0.05)
    assert found["ball_clearance_phase"] == pytest.approx(86.0, abs=0.1)
    assert found["toe_clearance"] == pytest.approx(10.0, abs=1e-3)


def test_ripple_on_a_slope_is_no_minimum() -> None:
    """Ripple that turns the slope, with twelve rows to a period; a step on the way down; a flat floor."""
    row = np.arange(1250)

    def lowest(height: np.ndarray) -> int:
        return lowest_minimum(np.concatenate([height, np.ones(1250)]), 0, 1250, 1250)

    rippled = 1.3e-5 * row + 5e-5 * np.sin(2.0 * np.pi * row / 12.0)
    assert np.diff(rippled).min() < 0.0
    assert lowest(rippled) == -1
    assert lowest(np.interp(row, [0, 500, 510, 1249], [9.0, 5.0, 5.0, 2.0])) == -1
    assert lowest(np.interp(row, [0, 500, 700, 1249], [9.0, 3.0, 3.0, 6.0])) == 500


@pytest.mark.parametrize("stride", [1, 2])
def test_the_share_of_swings_with_contact_counts_forefeet_at_the_floor(stride: int) -> None:
    columns = walk_columns(5.0)
    columns["ball/height"] = columns["ball/height"] + 0.05
    for name in ("toe/height", "sole/height"):
        columns[name] = columns[name] - 0.001 - 0.011 * (columns["gait/stride"] == stride)
    found = values(columns)
    assert found["swings_with_toe_contact"] == 25.0
    assert found["swings_with_ball_contact"] == 0.0
    assert found["swings_within_10mm"] == 100.0  # the others' are 9 mm
    assert found["lowest_toe_clearance"] == pytest.approx(-2.0, abs=1e-3)


@pytest.mark.parametrize(
    ("start", "end", "contact"),
    [(0.0, TOE_OFF + 0.039, 0.0), (0.0, TOE_OFF + 0.041, 100.0), (0.901, 1.0, 0.0), (0.899, 1.0, 100.0)],
)
def test_where_the_foot_is_on_the_floor_anyway_there_is_no_trip(
    start: float, end: float, contact: float
) -> None:
    """The first tenth of the swing, and what follows the upright shank."""
    columns = walk_columns()
    down = (columns["gait/phase"] > start) & (columns["gait/phase"] < end)
    columns["toe/height"] = np.where(down, -0.05, columns["toe/height"])
    assert values(columns)["swings_with_toe_contact"] == contact


def test_the_heel_on_its_way_to_the_floor_is_no_trip() -> None:
    columns = walk_columns()
    columns["sole/height"] = np.where(columns["gait/phase"] > 0.88, -0.001, columns["sole/height"])
    assert values(columns)["swings_with_toe_contact"] == 0.0


def test_the_band_of_the_toes_extension_stands_beside_the_clearance() -> None:
    columns = walk_columns()
    rigid = values(columns)
    assert not [name for name in rigid if name.endswith("extended")]
    columns["sole/height_less_extended"] = columns["sole/height"] - 0.004
    columns["sole/height_more_extended"] = 0.1 * columns["gait/phase"]  # no event: at that of the clearance
    found = values(columns)
    assert found["toe_clearance_less_extended"] == pytest.approx(6.0, abs=1e-3)
    phase = found["toe_clearance_phase"]
    assert found["toe_clearance_more_extended"] == pytest.approx(phase, abs=1e-6)  # 0.1 m is 1 mm a percent


def test_a_ball_that_slides_on_the_floor_touches_it() -> None:
    columns = walk_columns(5.0)
    columns["ball/height"] = np.zeros_like(columns["ball/height"])
    found = values(columns)
    assert found["swings_with_ball_contact"] == found["swings_with_toe_contact"] == 100.0
