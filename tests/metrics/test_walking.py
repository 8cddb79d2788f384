"""Metrics of walking against recordings whose numbers are known beforehand."""

import json
import math
import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic_walk import AMPLITUDE, MASS, OMEGA, SHANK, STEP, STRIDE, TOE_OFF, walk_columns, with_orthosis

import afo_sim
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics import METRICS, Metric, WalkMetrics, ankle_metrics, settled, walk_metrics, walking
from afo_sim.metrics.peak import MEANING
from afo_sim.metrics.strides import strides


def metrics(columns: dict[str, np.ndarray]) -> WalkMetrics:
    return walk_metrics(columns, STEP, MASS)


def values(columns: dict[str, np.ndarray]) -> dict[str, float]:
    return {name: metric.value for name, metric in metrics(columns).totals.items()}


def test_strides_run_from_heel_strike_to_heel_strike_and_the_first_is_not_counted() -> None:
    columns = walk_columns(4.2)
    whole = strides(columns, STEP, MASS)
    assert [stride.number for stride in whole] == [0, 1, 2, 3]
    assert [stride.number for stride in settled(columns, whole)] == [1, 2, 3]
    assert all(abs(len(stride.phase) * STEP - STRIDE) < 1.5 * STEP for stride in whole)
    for stride in whole:
        assert stride.phase.min() >= -1e-9
        assert stride.phase.max() < 1.0


@pytest.mark.parametrize(("start", "counted"), [(0.0, [1, 2]), (0.3, [1, 2]), (0.9, [1, 2, 3])])
def test_a_run_that_starts_within_a_stride_leaves_that_one_out(start: float, counted: list[int]) -> None:
    columns = walk_columns(3.2, start=start)
    assert [s.number for s in settled(columns, strides(columns, STEP, MASS))] == counted


def test_a_stride_that_ends_with_the_last_row_is_whole() -> None:
    assert len(strides(walk_columns(3.0), STEP, MASS)) == 3
    short = {name: column[:-2] for name, column in walk_columns(3.0).items()}
    assert len(strides(short, STEP, MASS)) == 2


def test_the_first_stride_stands_in_the_table_but_not_in_the_totals() -> None:
    columns = walk_columns(4.2)
    columns["sole/height"] = columns["sole/height"] - 0.1 * (columns["gait/stride"] == 0)
    found = metrics(columns)
    assert found.strides[0]["toe_clearance"].value == pytest.approx(-90.0, abs=0.01)
    assert found.totals["toe_clearance"].value == pytest.approx(10.0, abs=0.01)
    assert found.totals["lowest_toe_clearance"].value == pytest.approx(10.0, abs=0.01)
    assert found.totals["strides_counted"] == Metric(3.0, "")


@pytest.mark.parametrize(("lasts", "counted"), [(3.5, [1, 2]), (0.5, [1, 2, 3, 4]), (9.0, [1, 2, 3, 4])])
def test_strides_on_an_empty_source_count_where_there_are_no_others(lasts: float, counted: list[int]) -> None:
    columns = walk_columns(5.2)
    columns["supply/set_pressure"] = np.full(len(columns["time"]), 4e5)
    columns["store/source/pressure"] = np.where(columns["time"] < lasts * STRIDE, 5e5, 3e5)
    assert [stride.number for stride in settled(columns, strides(columns, STEP, MASS))] == counted


def test_with_air_few_strides_cannot_tell_that_it_has_settled() -> None:
    told = "too few to tell whether the orthosis' air has settled"
    for strides_walked, warned in ((4.2, True), (12.2, False)):
        columns = walk_columns(strides_walked)
        assert not any(told in text for text in metrics(columns).warnings)
        for name in ("mass", "pressure"):
            columns[f"chamber/dorsiflexor/{name}"] = np.full(len(columns["time"]), 1e-4)
        assert any(told in text for text in metrics(columns).warnings) == warned


def test_without_a_whole_stride_after_the_first_there_is_a_warning_and_no_number() -> None:
    found = metrics(walk_columns(1.5))
    assert found.totals == {}
    assert list(found.strides) == [0]
    assert "no whole stride" in found.warnings[0]


def test_stance_ends_where_the_ground_force_does() -> None:
    found = values(walk_columns())
    assert found["stance"] == pytest.approx(100.0 * TOE_OFF, abs=0.1)
    assert found["stride_time"] == pytest.approx(STRIDE, abs=1e-6)


def test_what_rises_before_the_next_heel_strike_is_still_swing() -> None:
    columns = walk_columns()
    columns["ground/force/z"] = columns["ground/force/z"] + 100.0 * (columns["gait/phase"] > 0.99)
    assert values(columns)["stance"] == pytest.approx(100.0 * TOE_OFF, abs=0.1)


# --- contact and ankle


@pytest.mark.parametrize(
    ("pitch", "kind"), [(15.0, "heel"), (8.1, "heel"), (7.9, "flat"), (-1.5, "flat"), (-1.7, "forefoot")]
)
def test_the_pitch_at_contact_has_its_class(pitch: float, kind: str) -> None:
    columns = walk_columns()
    columns["shank/angle"] = np.full_like(columns["time"], -np.radians(pitch))  # never upright in swing
    found = values(columns)
    assert found["foot_pitch_at_contact"] == pytest.approx(pitch, abs=1e-6)
    shares = {name: found[f"contacts_with_{name}"] for name in ("heel", "flat", "forefoot")}
    assert shares == {name: 100.0 * (name == kind) for name in shares}


def test_a_drop_is_the_zero_of_pitch_and_norm() -> None:
    """Who stands upright in a shoe of some drop has a plantarflexed ankle and a flat sole."""
    columns = walk_columns()
    level = np.radians(-3.0)
    barefoot = values(columns)
    columns["sole/pitch"] = columns["ankle/angle"] - columns["shank/angle"]
    for name in ("ankle/angle", "gait/ankle_angle"):
        columns[name] = columns[name] + level
    found = values(columns)
    for name in ("foot_pitch_at_contact", "angle_error_norm", "gvs_norm", "angle_error_recorded"):
        assert found[name] == pytest.approx(barefoot[name], abs=1e-9)
    assert found["mid_swing_angle"] == pytest.approx(barefoot["mid_swing_angle"] - 3.0)


def test_foot_slap_is_the_fall_after_heel_strike_and_not_a_later_one() -> None:
    columns = walk_columns()
    phase = columns["gait/phase"]
    # down by 10 degrees until 5 %, then up again by twice as much, and a faster fall at 11 %
    angle = np.interp(phase, [0.0, 0.05, 0.10, 0.11, 1.0], np.radians([0.0, -10.0, 10.0, 0.0, 0.0]))
    columns["ankle/angle"], columns["ankle/velocity"] = angle, np.gradient(angle, STEP)
    assert values(columns)["foot_slap_velocity"] == pytest.approx(10.0 / (0.05 * STRIDE), rel=1e-6)


def test_an_ankle_that_only_rises_slaps_not() -> None:
    assert values(walk_columns())["foot_slap_velocity"] == 0.0


def test_angles_of_a_sine() -> None:
    found = values(walk_columns())
    degrees = math.degrees(AMPLITUDE)
    assert found["ankle_range"] == pytest.approx(2.0 * degrees, rel=1e-4)
    # in swing, 60 to 100 %, the sine is below zero: highest at its end; half-way at 80 %
    assert found["peak_swing_dorsiflexion"] == pytest.approx(0.0, abs=0.1)
    assert found["mid_swing_angle"] == pytest.approx(degrees * math.sin(1.6 * math.pi), abs=0.05)
    assert found["foot_pitch_at_contact"] == pytest.approx(-math.degrees(SHANK), abs=1e-6)


def test_errors_of_a_shifted_ankle_are_the_shift() -> None:
    found = values(walk_columns())
    assert found["angle_error_recorded"] == pytest.approx(3.0, abs=1e-9)
    assert found["gvs_recorded"] == pytest.approx(3.0, abs=1e-9)


def test_errors_against_the_norm_are_zero_on_it_and_the_amplitude_over_root_two_beside_it() -> None:
    columns = walk_columns()
    on_it = gait_norm.read().at("ankle_angle", columns["gait/phase"])
    columns["ankle/angle"] = on_it
    # between the rows a stride's first and last angle differ, so that the last of 51 points is off a little
    assert values(columns)["gvs_norm"] < 0.02
    assert values(columns)["angle_error_norm"] < 1e-9
    columns["ankle/angle"] = on_it + AMPLITUDE * np.sin(2.0 * np.pi * columns["gait/phase"])
    effective = math.degrees(AMPLITUDE) / math.sqrt(2.0)
    assert values(columns)["angle_error_norm"] == pytest.approx(effective, rel=1e-3)
    assert values(columns)["gvs_norm"] == pytest.approx(effective * math.sqrt(50.0 / 51.0), rel=3e-3)


# --- torque, work, air


def test_a_steady_torque_against_a_need_in_swing() -> None:
    columns = walk_columns()
    found = values(with_orthosis(columns, np.full_like(columns["time"], 3.0)))
    assert found["needed_dorsiflexion_torque"] == found["needed_swing_torque"] == 4.0
    assert found["needed_swing_torque_mean"] == pytest.approx(4.0)
    assert found["orthosis_swing_torque_mean"] == pytest.approx(3.0)
    assert found["needed_plantarflexion_torque"] == 0.0
    assert found["orthosis_peak_dorsiflexion_torque"] == 3.0
    assert found["orthosis_mean_dorsiflexion_torque"] == pytest.approx(3.0)
    assert found["orthosis_peak_plantarflexion_torque"] == 0.0
    assert found["torque_covered"] == pytest.approx(75.0)
    assert found["torque_missing"] == pytest.approx(1.0)
    assert found["torque_unneeded"] == pytest.approx(3.0)  # all of it in stance, nothing in swing


def test_a_torque_against_the_need_covers_nothing() -> None:
    columns = walk_columns()
    found = values(with_orthosis(columns, np.full_like(columns["time"], -2.0)))
    assert found["torque_covered"] == 0.0
    assert found["torque_missing"] == 4.0
    assert found["torque_unneeded"] == 2.0
    assert found["orthosis_peak_plantarflexion_torque"] == 2.0
    assert found["orthosis_mean_plantarflexion_torque"] == pytest.approx(2.0)
    assert found["orthosis_mean_dorsiflexion_torque"] == 0.0


PEAKS = (
    *(f"orthosis_peak_{side}_torque" for side in ("dorsiflexion", "plantarflexion")),
    *(f"needed_{side}_torque" for side in ("dorsiflexion", "plantarflexion")),
    *(f"needed_{part}_torque" for part in ("swing", "terminal_swing", "loading", "push_off")),
    "torque_against_push_off",
    "push_off_torque",
    "torque_missing",
    "torque_unneeded",
    "peak_inversion_moment",
    "peak_eversion_moment",
)


def test_every_peak_of_a_torque_is_one_over_10_ms() -> None:
    columns = walk_columns()
    columns["ankle/moment/inversion"] = np.sin(columns["time"])
    assert set(PEAKS) <= values(with_orthosis(columns, np.full_like(columns["time"], 3.0))).keys()
    of_torques = {row.name: row for row in METRICS.values() if row.unit == "N*m" and "peak" in row.label}
    assert of_torques.keys() == {*PEAKS, "peak_{}_torque"}
    assert all("over 10 ms" in row.label and MEANING in row.meaning for row in of_torques.values())


def test_an_impact_counts_by_its_mean_over_10_ms() -> None:
    """A triangle of 2 ms and 50 N·m on a plateau of 4 N·m: 50 ms·N·m more in 10 ms."""
    columns = walk_columns()
    torque = np.full_like(columns["time"], 4.0)
    torque[700::1250] += 50.0  # once a stride
    found = values(with_orthosis(columns, torque))
    assert found["orthosis_peak_dorsiflexion_torque"] == pytest.approx(4.0 + 50.0 * 1e-3 / 10e-3)
    sitting = ankle_metrics(with_orthosis(columns, -torque), STEP, STRIDE)
    assert sitting["peak_plantarflexion_torque"] == pytest.approx(9.0)
    assert sitting["peak_dorsiflexion_torque"] == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_work_of_a_torque_in_step_with_velocity(sign: float) -> None:
    columns = walk_columns()
    found = values(with_orthosis(columns, sign * 5.0 * columns["ankle/velocity"]))
    instant = 5.0 * (AMPLITUDE * OMEGA) ** 2 / MASS
    work, window = 0.5 * instant * STRIDE, OMEGA * 0.010
    peak = 0.5 * instant * (1.0 + math.sin(window) / window)  # mean of cos² over 10 ms about its peak
    given, taken = (work, 0.0) if sign > 0.0 else (0.0, work)
    assert found["orthosis_positive_work"] == pytest.approx(given, rel=2e-3)
    assert found["orthosis_negative_work"] == pytest.approx(-taken, rel=2e-3)
    assert found["orthosis_peak_power"] == pytest.approx(peak if sign > 0.0 else 0.0, rel=1e-5)
    assert found["orthosis_peak_absorption"] == pytest.approx(0.0 if sign > 0.0 else peak, rel=1e-5)
    # the healthy ankle's moment is 20 times its velocity
    assert found["share_of_positive_work"] == pytest.approx(25.0 if sign > 0.0 else 0.0, rel=2e-3)


def test_air_is_what_the_inlet_takes_from_the_supply() -> None:
    columns = walk_columns()
    found = metrics(with_orthosis(columns, np.zeros_like(columns["time"]))).totals
    grams = 2.0 * (1.0 - TOE_OFF) * STRIDE
    assert found["air_per_stride"].value == pytest.approx(grams, rel=3e-3)
    assert found["air_per_stride_front"].value == found["air_per_stride"].value
    for name, value, unit in (
        ("free_air_per_stride", found["air_per_stride"].value / 1.185, "l"),  # ISO 8778
        ("normal_litres_per_stride", found["air_per_stride"].value / 1.293, "l"),  # DIN 1343
        ("peak_pressure_front", 3.0, "bar"),
        ("lowest_pressure_front", 0.5, "bar"),
    ):
        assert (found[name].value, found[name].unit) == (pytest.approx(value), unit)


# --- what cannot be told


def test_without_an_orthosis_nothing_is_said_of_one() -> None:
    found = metrics(walk_columns())
    assert not [name for name in found.totals if "orthosis" in name or "air" in name or "share_of" in name]
    assert found.totals["needed_swing_torque"].value == 4.0


def test_a_share_of_nothing_is_left_out_with_a_warning() -> None:
    columns = walk_columns()
    columns["gait/ankle_moment"] = np.zeros_like(columns["time"])
    found = metrics(with_orthosis(columns, np.ones_like(columns["time"])))
    assert not [name for name in found.totals if name.startswith("share_of")]
    assert any("share_of_positive_work is undefined" in warning for warning in found.warnings)


def test_what_is_no_number_is_left_out_with_a_warning() -> None:
    columns = walk_columns()
    columns["sole/height"] = np.where(columns["gait/stride"] == 2, np.nan, columns["sole/height"])
    found = metrics(columns)
    assert any("toe_clearance is undefined in 1 of 3 strides" in warning for warning in found.warnings)
    assert found.totals["toe_clearance"].value == pytest.approx(10.0, abs=1e-3)
    columns["sole/height"] = np.full_like(columns["time"], np.nan)
    found = metrics(columns)
    assert "toe_clearance" not in found.totals
    assert any("toe_clearance is undefined and left out" in warning for warning in found.warnings)
    every = [m.value for row in (found.totals, *found.strides.values()) for m in row.values()]
    assert np.isfinite(every).all()


def test_strides_that_drift_are_told() -> None:
    columns = walk_columns(4.0)
    columns["sole/height"] = columns["sole/height"] + 0.002 * columns["gait/stride"]
    columns = with_orthosis(columns, np.zeros_like(columns["time"]))
    columns["valve/front_inlet/mass_flow"] *= 1.0 + 0.1 * columns["gait/stride"]  # 1.2, then 1.3
    found = metrics(columns)
    assert any("+2.0 mm" in warning for warning in found.warnings)
    assert found.totals["walked_clearance_change"].value == pytest.approx(2.0, abs=1e-6)
    assert found.totals["walked_air_change"].value == pytest.approx(100.0 / 12.0, rel=1e-3)
    solved = walk_metrics(columns, STEP, MASS, solved=True)
    assert not [name for name in solved.totals if name.startswith("walked_")]


def test_one_stride_does_not_tell_a_change() -> None:
    assert not [name for name in metrics(walk_columns(2.2)).totals if name.startswith("walked_")]


# --- simulated


def test_a_healthy_run_walks_as_recorded() -> None:
    found = afo_sim.run("walk-healthy", {"duration": "3 s"})
    assert found.metrics["angle_error_recorded"].value < 1.0
    assert abs(found.metrics["toe_clearance_to_recorded"].value) < 1.0
    assert abs(found.metrics["ball_clearance_to_recorded"].value) < 1.0
    assert found.metrics["contacts_with_heel"].value == 100.0
    assert found.metrics["needed_swing_torque"].value == 0.0


def test_the_moment_balance_of_a_walking_run_holds_without_the_columns_to_compare_with() -> None:
    run = afo_sim.run("walk-dropfoot-afo", {"duration": "1 s"})
    assert "gait/needed_moment" in run.columns
    assert not [name for name in run.columns if name.startswith("ankle/moment/") and "needed" in name]
    # the drop foot lacks all of the dorsiflexors and none of the plantarflexors
    assert run["gait/needed_moment"].min() >= -1e-9
    assert run["gait/needed_moment"].max() > 2.0


def test_strides_are_kept_in_the_files(tmp_path: pathlib.Path) -> None:
    run = afo_sim.run("walk-dropfoot", {"duration": "3.7 s"})  # one stride from the start, two settled ones
    assert list(run.strides) == [0, 1, 2]
    run.save(tmp_path, rrd=False)
    assert afo_sim.read_recording(tmp_path).strides == run.strides
    told = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["strides"]
    assert [row["stride"] for row in told] == [0, 1, 2]
    assert told[1]["metrics"]["toe_clearance"]["unit"] == "mm"


@pytest.mark.parametrize(
    ("durations", "change", "differ"),
    [((1.5, 1.2, 1.2), 2.0, True), ((1.5, 1.2, 1.2), -0.9, False), ((1.2, 1.2, 1.5), 2.0, False)],
)
def test_strides_of_equal_duration_alone_are_said_not_to_repeat(
    durations: tuple[float, ...], change: float, differ: bool
) -> None:
    walked: Any = [SimpleNamespace(duration=duration, timestep=STEP) for duration in durations]
    said = list(walking._unsettled(walked, {"walked_clearance_change": Metric(change, "mm")}))
    assert [notice.code for notice in said] == ["strides-differ"] * differ
