"""Gait cycles: Fourier kinematics, sampled forces, the file, and what is refused."""

import dataclasses
import pathlib
from collections.abc import Callable

import numpy as np
import pytest

from afo_sim.common import GRAVITY, InputError, assets
from afo_sim.gait import KINEMATICS, GaitCycle, closing_errors, examine, findings, stance
from afo_sim.gait import file as gait
from afo_sim.gait.cycle import COLUMNS
from afo_sim.gait.fourier import FourierSeries

STRIDES = ("gatk_stride1", "gatk_stride2")


@pytest.fixture(scope="module")
def stride() -> GaitCycle:
    return gait.read(assets.find_gait("gatk_stride1"))


def test_series_recovers_an_analytic_signal_and_its_derivatives() -> None:
    phase = np.linspace(0.0, 1.0, 121)
    w = 2.0 * np.pi

    def signal(p: np.ndarray, d: int = 0) -> np.ndarray:
        turn = 0.5 * np.pi * d
        return (
            0.3 * w**d * np.cos(w * p + turn)
            - 0.1 * (3 * w) ** d * np.sin(3 * w * p + turn)
            + 0.02 * (11 * w) ** d * np.cos(11 * w * p + turn)
        )

    series = FourierSeries.fit(phase, 0.7 + signal(phase), 12)
    where = np.linspace(-1.3, 12.7, 557)
    assert np.abs(series(where) - 0.7 - signal(where)).max() < 1e-12
    assert np.abs(series(where, 1) - signal(where, 1)).max() < 1e-10
    assert np.abs(series(where, 2) - signal(where, 2)).max() < 1e-8
    assert series.closing_error == pytest.approx(0.0, abs=1e-12)
    assert series(0.25).shape == ()


def test_drift_is_taken_out_about_mid_stride_and_reported() -> None:
    phase = np.linspace(0.0, 1.0, 201)
    series = FourierSeries.fit(phase, np.sin(2 * np.pi * phase) + 0.04 * phase, 12)
    assert series.closing_error == pytest.approx(0.04)
    assert series(0.0) == pytest.approx(0.02, abs=1e-3)  # the sine's own zero, and half the drift's
    assert series(1.0) == pytest.approx(float(series(0.0)))
    assert np.mean(series(phase[:-1])) == pytest.approx(0.02, abs=2e-4)  # the mean stays


def test_progress_goes_on_stride_after_stride() -> None:
    phase = np.linspace(0.0, 1.0, 101)
    series = FourierSeries.fit(phase, 1.2 * phase + 0.1 * np.cos(2 * np.pi * phase), 10, progressing=True)
    assert series(7.25) - series(0.25) == pytest.approx(7 * 1.2)
    assert series(0.3, 1) == pytest.approx(1.2 - 0.2 * np.pi * np.sin(0.6 * np.pi))
    assert series.closing_error == 0.0


@pytest.mark.parametrize("name", KINEMATICS)
def test_velocity_and_acceleration_are_those_of_the_pose(stride: GaitCycle, name: str) -> None:
    phase = np.linspace(0.0, 3.0, 700)
    step = 1e-4
    ahead, behind = (stride.signal(name, phase + s * step) for s in (1.0, -1.0))
    here = stride.signal(name, phase)
    h = step * stride.stride_time
    for found, expected in (
        (stride.signal(name, phase, 1), (ahead - behind) / (2 * h)),
        (stride.signal(name, phase, 2), (ahead - 2 * here + behind) / h**2),
    ):
        assert np.abs(found - expected).max() < 2e-5 * np.abs(expected).max()


def test_ground_is_interpolated_from_samples_and_never_rings(stride: GaitCycle) -> None:
    middle = 0.5 * (stride.phase[1:] + stride.phase[:-1])
    forward, upward, cop = stride.ground(middle)
    assert np.allclose(upward, 0.5 * (stride.grf_z[1:] + stride.grf_z[:-1]))
    assert np.allclose(forward, 0.5 * (stride.grf_x[1:] + stride.grf_x[:-1]))
    swing = (middle > 0.72) & (middle < 0.9)
    assert np.abs(upward[swing]).max() < 2e-3
    assert np.all(np.isfinite(cop))
    assert np.allclose(stride.ground(middle + 5.0), stride.ground(middle))


def test_round_trip_keeps_everything(stride: GaitCycle, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    gait.write(path, stride)
    again = gait.read(path)
    for item in dataclasses.fields(GaitCycle):
        before, after = getattr(stride, item.name), getattr(again, item.name)
        if isinstance(before, np.ndarray):
            assert np.allclose(before, after, rtol=1e-6, atol=1e-9, equal_nan=True), item.name
        elif isinstance(before, float):
            assert after == pytest.approx(before, rel=1e-5)
        else:
            assert after == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


def test_height_and_sole_are_written_where_they_are_known(stride: GaitCycle, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    for height, sole in ((1.72, 0.025), (None, 0.0), (1.72, None), (None, None)):
        gait.write(path, dataclasses.replace(stride, body_height=height, sole_thickness=sole))
        again, text = gait.read(path), path.read_text()
        assert (again.body_height, again.sole_thickness) == (height, sole)
        assert ("body_height_m: 1.72" in text) == (height is not None)
        assert ("sole_thickness_m: " in text) == (sole is not None)
        told = findings(again)
        assert (("body height", "1.72 m") in told) == (height is not None)
        worn = [found for subject, found in told if subject == "sole worn"]
        assert worn == ([] if sole is None else [f"{1e3 * sole:.0f} mm under the ankle"])
    gait.write(path, dataclasses.replace(stride, body_height=172.0))
    with pytest.raises(InputError) as caught:
        gait.read(path)
    assert (caught.value.field, caught.value.value) == ("body_height_m", "172")


def test_moment_is_turned_to_the_house_sign(stride: GaitCycle) -> None:
    push_off = (stride.phase > 0.4) & (stride.phase < 0.55)
    assert np.all(stride.ankle_moment[push_off] < -1.0)  # plantarflexor: negative inside
    text = assets.find_gait("gatk_stride1").read_text().splitlines()
    (row,) = (line for line in text if line.startswith("0.5,"))
    assert float(row.split(",")[-1]) > 1.5  # and positive in the file, as laboratories publish it


@pytest.mark.parametrize("name", STRIDES)
def test_ground_force_asks_for_the_toolkits_moment(name: str) -> None:
    """The package's own inverse dynamics against force × arm: 0.05 N·m/kg and 4 % of the peak."""
    cycle = gait.read(assets.find_gait(name))
    error = cycle.ankle_moment - cycle.ground_moment()
    assert np.sqrt(np.mean(error**2)) < 0.05
    assert cycle.ground_moment().min() == pytest.approx(cycle.ankle_moment.min(), rel=0.04)


@pytest.mark.parametrize("name", STRIDES)
def test_shipped_stride_is_a_stride(name: str) -> None:
    cycle = gait.read(assets.find_gait(name))
    assert 1.15 < cycle.stride_time < 1.25
    assert stance(cycle) == pytest.approx(0.64, abs=0.02)
    assert cycle.grf_z[0] * cycle.body_mass * GRAVITY < 60.0
    assert np.degrees(cycle.ankle_angle.max()) == pytest.approx(21.1, abs=0.5)  # 21.4 from 15-35 %'s zero
    assert 100 * cycle.phase[cycle.ankle_angle.argmax()] == pytest.approx(49, abs=1)
    closing = closing_errors(cycle)
    assert all(abs(closing[f"{n}_angle_deg"]) < 2.1 for n in ("shank", "knee", "ankle"))
    assert abs(closing["ankle_z_m"]) < 0.002
    for angle in ("shank_angle", "knee_angle", "ankle_angle"):
        assert np.degrees(cycle.series[angle].residual) < 0.1
    pitch = np.degrees(cycle.foot_pitch()[cycle.foot_flat()])
    assert np.abs(pitch).max() < 1.0


def test_ankle_moment_about_another_point_is_analytic(stride: GaitCycle) -> None:
    """One body weight up and a tenth forward, 10 cm ahead of an ankle 8 cm high."""
    n = len(stride.phase)
    pushed = dataclasses.replace(
        stride, grf_x=np.full(n, 0.1), grf_z=np.ones(n), cop_x=np.full(n, 0.1), ankle_z=np.full(n, 0.08)
    )
    assert np.allclose(pushed.ground_moment(), -(0.1 + 0.008) * GRAVITY)


Columns = dict[str, np.ndarray]
Change = Callable[[Columns], Columns]  # of a good file's columns, those that are changed


def scaled(column: str, factor: float) -> Change:
    return lambda c: {column: c[column] * factor}


def swapped(a: str, b: str) -> Change:
    return lambda c: {a: c[b], b: c[a]}


def drifting(column: str, amount: float) -> Change:
    return lambda c: {column: c[column] + amount * c["phase"]}


def gap(column: str, first: float, last: float) -> Change:
    return lambda c: {
        column: np.where((c["phase"] >= first) & (c["phase"] <= last), np.nan, c[column]),
    }


def late_start(c: Columns) -> Columns:
    return {n: np.roll(c[n], 60) for n in ("grf_x_bw", "grf_z_bw", "cop_x_m", "ankle_moment_nm_per_kg")}


def back_and_forth(c: Columns) -> Columns:
    order = np.arange(len(c["phase"]))
    order[[50, 51]] = 51, 50
    return {"phase": c["phase"][order]}


def on_a_treadmill(c: Columns) -> Columns:
    return {"ankle_x_m": c["ankle_x_m"] - c["ankle_x_m"][-1] * c["phase"]}


def never_in_swing(c: Columns) -> Columns:
    return {"grf_z_bw": np.maximum(c["grf_z_bw"], 0.2), "cop_x_m": np.nan_to_num(c["cop_x_m"])}


# What is wrong: (the change to a good file, the column named, what was seen, what was expected).
BAD: list[tuple[Change, str, str, str]] = [
    (scaled("knee_angle_deg", np.pi / 180), "knee_angle_deg", "looks like radians", "degrees"),
    (
        lambda c: {f"{n}_angle_deg": np.radians(c[f"{n}_angle_deg"]) for n in ("shank", "knee", "ankle")},
        "shank_angle_deg",
        "looks like radians",
        "a walking shank goes through some 60",
    ),
    (scaled("shank_angle_deg", 180 / np.pi), "shank_angle_deg", "converted twice", "-90"),
    (scaled("ankle_z_m", 1e3), "ankle_z_m", "millimetres", "-0.1 to 1.5"),
    (scaled("grf_z_bw", 659.0), "grf_z_bw", "newtons", "-4 to 4"),
    (scaled("ankle_moment_nm_per_kg", 67.2), "ankle_moment_nm_per_kg", "N·m, not", "-4 to 4"),
    (scaled("grf_z_bw", 0.3), "grf_z_bw", "no stance: its peak is 0.32", "some 1.1"),
    (scaled("grf_z_bw", -1.0), "grf_z_bw", "force of the foot", "upward positive"),
    (late_start, "grf_z_bw", "begins to rise at phase", "heel strike at phase 0"),
    (never_in_swing, "grf_z_bw", "of the stride", "a swing without force"),
    (drifting("knee_angle_deg", 11.0), "knee_angle_deg", "ends +11 deg", "within 10 deg"),
    (drifting("ankle_z_m", 0.04), "ankle_z_m", "ends +0.0", "within 0.03 m"),
    (swapped("grf_x_bw", "grf_z_bw"), "grf_x_bw", "swapped axes?", "x forward"),
    (swapped("ankle_x_m", "ankle_z_m"), "ankle_z_m", "swapped axes?", "x forward"),
    (gap("shank_angle_deg", 0.3, 0.33), "shank_angle_deg", "7 rows between phase 0.3 and 0.33", "each"),
    (gap("cop_x_m", 0.2, 0.25), "cop_x_m", "between phase 0.2 and 0.25", "above 0.1"),
    (scaled("ankle_moment_nm_per_kg", -1.0), "ankle_moment_nm_per_kg", "wrong sign?", "internal"),
    (scaled("ankle_moment_nm_per_kg", 0.3), "ankle_moment_nm_per_kg", "is +0.5", "ask for +1.8"),
    (scaled("shank_angle_deg", -1.0), "shank_angle_deg", "wrong sign?", "ahead of the ankle"),
    (scaled("knee_angle_deg", -1.0), "knee_angle_deg", "wrong sign?", "flexion positive"),
    (scaled("ankle_angle_deg", -1.0), "ankle_angle_deg", "lie flat", "dorsiflexion positive"),
    (scaled("grf_x_bw", -1.0), "grf_x_bw", "wrong sign?", "braking (negative) first"),
    (on_a_treadmill, "ankle_x_m", "treadmill without the belt's travel?", "speed × stride time"),
    (scaled("ankle_x_m", -1.0), "ankle_x_m", "x backward?", "overground"),
    (scaled("ankle_x_m", 1.6), "ankle_x_m", "goes 1.88 m forward", "= 1.18 m"),
    (
        lambda c: {"ankle_x_m": c["ankle_x_m"] + 0.1 * np.cos(2 * np.pi * c["phase"])},
        "ankle_x_m",
        "goes -0.1",
        "stays where it stands",
    ),
    (lambda c: {"ankle_z_m": c["ankle_z_m"] + 0.05}, "ankle_z_m", "0.146 m", "0.0962 there"),
    (scaled("phase", 100.0), "phase", "from 0 to 100 (percent?)", "0 at heel strike to 1"),
    (back_and_forth, "phase", "does not increase", "from 0 to 1"),
    (scaled("phase", 0.995), "phase", "from 0 to 0.995", "both with a row"),
]


def write_changed(path: pathlib.Path, change: Change) -> None:
    from afo_sim.common import read_phase_table, write_phase_table

    table = read_phase_table(assets.find_gait("gatk_stride1"), tuple(COLUMNS))
    write_phase_table(path, table.header, table.columns | change(table.columns))


@pytest.mark.parametrize(("change", "column", "seen", "expected"), BAD)
def test_bad_numbers_say_what_was_seen_and_expected(
    change: Change, column: str, seen: str, expected: str, tmp_path: pathlib.Path
) -> None:
    path = tmp_path / "mine.csv"
    write_changed(path, change)
    with pytest.raises(InputError) as caught:
        gait.read(path)
    error = caught.value
    assert (error.file, error.field) == (path, column)
    assert seen in error.problem
    assert expected in error.allowed
    assert "\n" not in str(error)


def test_small_drift_is_repaired_and_told(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "mine.csv"
    write_changed(path, drifting("knee_angle_deg", 4.0))
    cycle = gait.read(path)
    assert closing_errors(cycle)["knee_angle_deg"] == pytest.approx(3.95, abs=0.01)
    assert cycle.signal("knee_angle", 1.0) == pytest.approx(float(cycle.signal("knee_angle", 0.0)))


def test_a_patients_gait_is_not_refused(stride: GaitCycle) -> None:
    """Toe walking, no push-off force, hyperextended stiff knee: unusual, but no contradiction."""
    equinus = dataclasses.replace(
        stride, ankle_angle=stride.ankle_angle - np.radians(20.0), knee_angle=0.1 * stride.knee_angle - 0.15
    )
    examine(equinus)
    examine(dataclasses.replace(stride, grf_x=np.minimum(stride.grf_x, 0.0)))


TEXT = [
    ("knee_angle_deg", "kne_angle_deg", "knee_angle_deg", "there is 'kne_angle_deg'"),
    ("shank_angle_deg", "shank_angle_rad", "shank_angle_deg", "shank_angle_rad"),
    ("ankle_x_m,ankle_z_m", "ankle_z_m,ankle_z_m", "ankle_x_m", "missing"),
    ("# stride_time_s:", "# stridetime_s:", "stride_time_s", "there is 'stridetime_s'"),
    ("# body_mass_kg: 67.2", "# body_mass_kg: heavy", "body_mass_kg", "is not a number"),
    ("# body_mass_kg: 67.2", "# body_mass_kg: 67200", "body_mass_kg", "out of range"),
    ("# side: right", "# side: R", "side", "is not a valid side"),
    ("\n0.5,", "\nhalf,", "phase", "is not a number (line"),
    ("\n0.5,", "\n0,5,", "", "has 11 values where the header names 10"),
    ("\n0.5,", "\n0.5,1,", "", "has 11 values where the header names 10"),
]


@pytest.mark.parametrize(("old", "new", "field", "expected"), TEXT)
def test_bad_text_names_what_is_wrong(
    old: str, new: str, field: str, expected: str, tmp_path: pathlib.Path
) -> None:
    text = assets.find_gait("gatk_stride1").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.csv"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        gait.read(path)
    assert caught.value.field == field
    assert expected in str(caught.value)


def test_the_norm_is_the_published_points_with_a_band() -> None:
    from afo_sim.gait import norm as gait_norm

    norm = gait_norm.read()
    assert np.degrees(norm.at("ankle_angle", 0.45)) == pytest.approx(13.4)
    assert np.degrees(norm.at("knee_angle", 0.75)) == pytest.approx(61.9)
    phase = np.linspace(0.0, 1.0, 301)
    low, mean, high = (norm.at(f"ankle_{n}", phase) for n in ("low", "angle", "high"))
    assert np.all(low <= mean)
    assert np.all(mean <= high)
    assert norm.header["licence"] == "CC BY 4.0"
    # The two published means at two phases [N·m/kg], plantarflexion positive.
    for phase, published in ((0.45, (1.18, 1.28)), (0.05, (-0.12, -0.15))):
        given = [float(norm.at(f"moment_{end}", phase)) for end in ("low", "high")]
        assert given == pytest.approx(sorted(-moment for moment in published))
    assert "children" in norm.header["ankle_moment_low_nm_per_kg"]
    assert norm.at("ankle_angle", 1.25) == pytest.approx(float(norm.at("ankle_angle", 0.25)))


def test_warnings_travel_with_the_file(stride: GaitCycle, tmp_path: pathlib.Path) -> None:
    told = ("the mass, 60 kg, is a guess", "walk.trc: has 3 columns")
    path = tmp_path / "a.csv"
    gait.write(path, stride.with_warnings(("an old one",)).with_warnings(told))
    again = gait.read(path)
    assert again.warnings == told
    assert {key: text for key, text in again.notes.items() if "warning" not in key} == stride.notes
    assert ("warning 2", told[1]) in findings(again)
