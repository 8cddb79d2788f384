"""Checks say what is wrong, where, and by how much; and never pass by accident."""

import dataclasses
import itertools
import math
import os
import pathlib
import re
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import afo_sim
from afo_sim.common import InputError
from afo_sim.metrics import Metric
from afo_sim.simulation import Recording, read_checks, run_checks
from afo_sim.simulation.checks import CheckEntry, Expectation, check_metric, expect

CHECKS = pathlib.Path(__file__).parents[2] / "models" / "checks"
PERIOD, STEP = 2.0, 0.01
TIME = np.arange(600) * STEP  # three cycles
ANGLE, PRESSURE, FLOW = "ankle/angle", "chamber/dorsiflexor/pressure", "valve/dorsiflexor_inlet/mass_flow"
FORCES = ["muscle/dorsiflexor_1/force", "muscle/dorsiflexor_2/force"]
WARMTH, RATIO = "chamber/dorsiflexor/temperature", "muscle/dorsiflexor_1/contraction"

quiet = settings(deadline=None, derandomize=True, max_examples=60)
degrees = st.floats(-90.0, 90.0)
signals = st.lists(degrees, min_size=2, max_size=40).map(np.array)
cycles = st.lists(degrees, min_size=24, max_size=24).map(np.array)  # three, of 80 ms


def made(column: str = ANGLE, values: np.ndarray | None = None, **others: object) -> Recording:
    """A recording of one column [SI] besides the time."""
    values = np.zeros(len(TIME)) if values is None else np.asarray(values, dtype=float)
    facts: dict = {
        "columns": {"time": TIME[: len(values)], column: values},
        "metrics": {"range_of_motion": Metric(20.0, "deg"), "rise_time": Metric(math.nan, "s")},
        "described": {"timer": {"period": f"{PERIOD} s"}},
        "model_xml": "",
        "status": "ok",
        "warnings": (),
        "timing": {},
        "versions": {},
        "parameters": {},
    }
    return Recording(**(facts | others))


def in_degrees(values: np.ndarray) -> Recording:
    return made(ANGLE, np.radians(values))


def short_cycles(values: np.ndarray) -> Recording:
    return made(ANGLE, np.radians(values), described={"timer": {"period": "0.08 s"}})


def bump(at: float, height: float) -> np.ndarray:
    """0, and `height` in the one sample at `at` [s]."""
    values = np.zeros(len(TIME))
    values[round(at / STEP)] = height
    return values


# --- what is said ---------------------------------------------------------------------------------------


def test_the_message_names_column_worst_sample_time_limit_and_first_violation() -> None:
    values = bump(2.34, 31.2) + bump(1.5, 29.0)
    result = expect(in_degrees(values), ANGLE).between("-15 deg", "28 deg").after("1 s").check()
    assert result.message == (
        "ankle/angle: 31.2 deg at 2.34 s is 3.2 deg above the limit of 28 deg "
        "(between -15 deg and 28 deg, after 1 s); 2 of 500 samples fail, the first at 1.5 s"
    )
    assert not result.ok
    assert (result.column, result.time) == (ANGLE, pytest.approx(2.34))
    assert (result.value, result.limit) == (np.radians(31.2), np.radians(28.0))


PULSES = bump(1.0, 4.5e5) - bump(3.0, 5e4)  # [Pa]


@pytest.mark.parametrize(
    ("column", "values", "ask", "words"),
    [
        (PRESSURE, PULSES, lambda e: e.below("4 bar"), "4.5 bar at 1 s is 0.5 bar above the limit of 4 bar"),
        (
            PRESSURE,
            PULSES,
            lambda e: e.above("-10 kPa"),
            "-50 kPa at 3 s is 40 kPa below the limit of -10 kPa (above -10 kPa)",
        ),
        (WARMTH, np.full(len(TIME), 313.15), lambda e: e.below("30 degC"), "40 degC at 0 s is 10 degC above"),
        (RATIO, bump(1.0, 0.4), lambda e: e.below(0.37), "0.4 at 1 s is 0.03 above the limit of 0.37 (below"),
    ],
)
def test_each_limit_is_told_in_the_unit_it_was_written_in(
    column: str, values: np.ndarray, ask: Callable[[Expectation], Expectation], words: str
) -> None:
    assert words in repr(ask(expect(made(column, values), column)))


def test_what_passes_says_how_close_it_came() -> None:
    result = expect(in_degrees(bump(2.0, 20.0)), ANGLE).below("28 deg").check()
    assert result.ok
    assert "20 deg at 2 s is 8 deg below the limit of 28 deg" in result.message


def test_the_truth_and_the_face_of_an_expectation_are_its_results() -> None:
    good, bad = (expect(in_degrees(bump(2.0, peak)), ANGLE).below("28 deg") for peak in (20.0, 30.0))
    assert good
    assert good.check()
    assert not bad
    assert not bad.check()
    assert repr(bad) == bad.check().message
    good.verify()
    for failing in (bad, bad.check()):
        with pytest.raises(AssertionError, match=re.escape(bad.check().message)):
            failing.verify()


# --- every check passes and fails where it should -------------------------------------------------------

RAMP = np.minimum(TIME * 10.0, 20.0)  # [deg], up to 20 deg at 2 s

CASES: list[tuple[str, Callable[[Expectation], Expectation], Callable[[Expectation], Expectation], str]] = [
    (
        "between",
        lambda e: e.between("0 deg", "20.1 deg"),
        lambda e: e.between("1 deg", "30 deg"),
        "0 deg at 0 s",
    ),
    ("above", lambda e: e.above("-1 deg"), lambda e: e.above("1 deg"), "0 deg at 0 s is 1 deg below"),
    ("below", lambda e: e.below("21 deg"), lambda e: e.below("19 deg"), "20 deg at 2 s is 1 deg above"),
    (
        "peak",
        lambda e: e.peak_between("19 deg", "21 deg"),
        lambda e: e.peak_between("21 deg", "25 deg"),
        "peak of 20 deg at 2 s is 1 deg below the limit of 21 deg",
    ),
    (
        "trough",
        lambda e: e.after("1 s").trough_between("9 deg", "11 deg"),
        lambda e: e.after("1 s").trough_between("0 deg", "9 deg"),
        "trough of 10 deg at 1 s is 1 deg above the limit of 9 deg",
    ),
    (
        "range",
        lambda e: e.range_between("19 deg", "21 deg"),
        lambda e: e.range_between("10 deg", "19 deg"),
        "range of 20 deg from 0 s to 5.99 s is 1 deg above the limit of 19 deg",
    ),
    (
        "final",
        lambda e: e.before("1.51 s").final_between("14.9 deg", "15.1 deg"),
        lambda e: e.before("1.51 s").final_between("16 deg", "17 deg"),
        "final of 15 deg at 1.5 s is 1 deg below the limit of 16 deg",
    ),
    (
        "integral",
        lambda e: e.after("2 s").integral_between("79 deg*s", "81 deg*s"),
        lambda e: e.after("2 s").integral_between("70 deg*s", "78 deg*s"),
        "integral of 80 deg*s from 2 s to 5.99 s is 2 deg*s above the limit of 78 deg*s",
    ),
    (
        "rise time",
        lambda e: e.rise_time_below("1.7 s"),
        lambda e: e.rise_time_below("1500 ms"),
        "rise time of 1600 ms from 0 s to 5.99 s is 100 ms above the limit of 1500 ms",
    ),
    (
        "settling",
        lambda e: e.settles_to("20 deg", within="1 deg", by="2 s"),
        lambda e: e.settles_to("20 deg", within="1 deg", by="1.5 s"),
        "15 deg at 1.5 s is 4 deg below the limit of 19 deg (settles to 20 deg within 1 deg by 1.5 s)",
    ),
    (
        "rate",
        lambda e: e.rate().between("-1 deg/s", "11 deg/s"),
        lambda e: e.rate().before("1 s").below("8 deg/s"),
        "rate of ankle/angle: 10 deg/s",
    ),
]


@pytest.mark.parametrize(("good", "bad", "words"), [case[1:] for case in CASES], ids=[c[0] for c in CASES])
def test_each_check_passes_and_fails(
    good: Callable[[Expectation], Expectation], bad: Callable[[Expectation], Expectation], words: str
) -> None:
    start = expect(in_degrees(RAMP), ANGLE)
    assert good(start).check().ok, good(start)
    result = bad(start).check()
    assert not result.ok
    assert words in result.message


def test_a_mass_flow_adds_up_to_the_air_that_passed() -> None:
    run = made(FLOW, np.where(TIME < 1.0, 1e-3, 0.0))  # 1 g in the first second
    assert expect(run, FLOW).integral_between("0.999 g", "1.001 g")
    halves = [
        expect(run, FLOW).during(a, b).integral_between("0 g", "9 g")
        for a, b in (("0 s", "0.5 s"), ("0.5 s", "6 s"))
    ]
    assert sum(half.check().value for half in halves) == pytest.approx(1e-3)


def test_a_sum_is_of_all_its_columns() -> None:
    run = made(FORCES[0], bump(1.0, 30.0))
    run.columns[FORCES[1]] = bump(1.0, 12.0)
    message = repr(expect(run, FORCES).below("40 N"))
    assert f"{FORCES[0]} + {FORCES[1]}: 42 N at 1 s is 2 N above the limit of 40 N" in message
    assert expect(run, FORCES).below("43 N")


def test_several_checks_of_one_expectation_must_all_hold_and_all_are_told() -> None:
    start = expect(in_degrees(bump(1.0, 30.0) - bump(2.0, 30.0)), ANGLE)
    assert start.above("-31 deg").below("31 deg")
    assert not start.above("-31 deg").below("29 deg")
    message = repr(start.below("29 deg").above("-29 deg"))
    assert "above the limit of 29 deg" in message
    assert "below the limit of -29 deg" in message


def test_a_signal_that_never_rises_has_no_rise_time() -> None:
    result = expect(in_degrees(-TIME), ANGLE).rise_time_below("9 s").check()
    assert not result.ok
    assert "there is no rise time" in result.message


# --- never by accident ----------------------------------------------------------------------------------


@pytest.mark.parametrize("hole", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("check", CASES, ids=[case[0] for case in CASES])
def test_a_hole_in_the_window_fails_every_check(check: tuple, hole: float) -> None:
    values = RAMP.copy()
    values[[120, 250]] = hole
    result = check[1](expect(made(ANGLE, np.radians(values)), ANGLE)).check()
    assert not result.ok
    first = "1.19 s" if check[0] == "rate" else "2.5 s" if check[0] == "integral" else "1.2 s"
    assert f" at {first} is not a finite number" in result.message
    assert math.isnan(result.limit)


@pytest.mark.parametrize("sample", [7, 8, 9])
@pytest.mark.parametrize("step", [0.01, 0.125])  # the steps of the second are equal to the last bit
def test_a_hole_is_lost_in_no_rate(step: float, sample: int) -> None:
    values = np.zeros(20)
    values[8] = math.nan
    run = dataclasses.replace(made(), columns={"time": np.arange(20) * step, PRESSURE: values})
    window = expect(run, PRESSURE).rate().during(f"{sample * step} s", f"{(sample + 1) * step} s")
    assert f"at {sample * step:g} s is not a finite number" in repr(window.below("1 Pa/s"))


def test_a_hole_outside_the_window_does_not_matter() -> None:
    run = made(ANGLE, np.where(TIME < 1.0, math.nan, 0.0))
    assert expect(run, ANGLE).below("1 deg").after("1 s")
    assert not expect(run, ANGLE).below("1 deg").after("0.99 s")


def test_a_run_that_stopped_early_fails() -> None:
    run = made(status="failed: unstable at 3 s")
    for result in (
        expect(run, ANGLE).below("1 deg").check(),
        check_metric(run, "range_of_motion", "0 deg", "90 deg"),
    ):
        assert not result.ok
        assert "did not reach its end: failed: unstable at 3 s" in result.message


@pytest.mark.parametrize(
    "window",
    [
        lambda e: e.after("6 s"),
        lambda e: e.before("0 s"),
        lambda e: e.during("3 s", "2 s"),
        lambda e: e.per_cycle().after("2 s"),
    ],
)
def test_an_empty_window_is_refused(window: Callable[[Expectation], Expectation]) -> None:
    with pytest.raises(InputError, match="lies in the window") as caught:
        window(expect(made(), ANGLE)).below("1 deg").check()
    assert caught.value.field in ("after", "before")
    assert "times up to" in caught.value.allowed


def test_settling_later_than_the_window_is_refused() -> None:
    with pytest.raises(InputError, match="that late"):
        expect(made(), ANGLE).settles_to("0 deg", within="1 deg", by="6 s").check()


def test_an_expectation_without_a_check_is_refused() -> None:
    with pytest.raises(InputError, match="no expectation"):
        bool(expect(made(), ANGLE).after("1 s"))


@pytest.mark.parametrize(
    ("ask", "field", "words"),
    [
        (lambda e: e.between("1 bar", "2 bar"), "between", "does not convert to rad"),
        (lambda e: e.between(1.0, 2.0), "between", "has no unit"),
        (lambda e: e.between("1 deg", "2"), "between", "has no unit"),
        (lambda e: e.between("2 deg", "1 deg"), "between", "empty range"),
        (lambda e: e.above("nan deg"), "above", "not finite"),
        (lambda e: e.rate().below("1 deg"), "below", "does not convert to rad/s"),
        (lambda e: e.below("1 deg").rate(), "rate", "before the checks"),
        (lambda e: e.integral_between("1 deg", "2 deg"), "integral_between", "does not convert to rad*s"),
        (lambda e: e.rise_time_below("1 deg"), "rise_time_below", "does not convert to s"),
        (lambda e: e.settles_to("1 deg", within="-1 deg", by="1 s"), "settles_to", "negative"),
        (lambda e: e.settles_to("1 deg", within="1 deg", by="1"), "settles_to", "has no unit"),
        (lambda e: e.after("1 deg"), "after", "does not convert to s"),
        (lambda e: e.before(3), "before", "has no unit"),
    ],
)
def test_a_wrong_limit_is_refused_at_once(
    ask: Callable[[Expectation], Expectation], field: str, words: str
) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        ask(expect(made(), ANGLE))
    assert caught.value.field == field


def test_a_tolerance_in_degrees_celsius_is_refused() -> None:
    with pytest.raises(InputError, match="not a difference"):
        expect(made(WARMTH), WARMTH).range_between("0 degC", "5 degC")


def test_a_ratio_has_no_unit() -> None:
    of = expect(made(RATIO, bump(1.0, 0.4)), RATIO)
    assert of.below("0.41")
    with pytest.raises(InputError, match="has no unit"):
        of.below("41 deg")
    assert of.rate().below("21 s^-1")
    assert not of.rate().below("19 s^-1")


def test_an_unknown_column_or_metric_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError) as caught:
        expect(made(), "ankle/angel")
    assert (caught.value.field, caught.value.nearest, caught.value.allowed) == ("column", ANGLE, ANGLE)
    with pytest.raises(InputError) as caught:
        expect(made(), [ANGLE, "ankle/angel"])
    assert caught.value.field == "sum"
    with pytest.raises(InputError) as caught:
        check_metric(made(), "range_of_motoin", "1 deg", "2 deg")
    assert (caught.value.field, caught.value.nearest) == ("metric", "range_of_motion")
    with pytest.raises(InputError, match="different units"):
        expect(made(), [ANGLE, "time"])
    with pytest.raises(InputError, match="names no column"):
        expect(made(), [])


def test_a_metric_is_checked_in_its_own_unit() -> None:
    assert check_metric(made(), "range_of_motion", "0.1 rad", "45 deg")
    result = check_metric(made(), "range_of_motion", "25 deg", "45 deg")
    assert result.message == (
        "range_of_motion: 20 deg is 5 deg below the limit of 25 deg (between 25 deg and 45 deg)"
    )
    assert (result.ok, result.value, result.limit) == (False, 20.0, 25.0)
    assert not check_metric(made(), "rise_time", "0 s", "9 s")  # is NaN
    with pytest.raises(InputError, match="does not convert to deg"):
        check_metric(made(), "range_of_motion", "1 bar", "2 bar")


# --- windows and cycles ---------------------------------------------------------------------------------


@quiet
@given(st.integers(0, 599), st.integers(1, 600))
def test_a_window_holds_its_first_time_and_not_its_last(first: int, length: int) -> None:
    last = min(first + length, 600)
    window = expect(made(PRESSURE, TIME), PRESSURE).during(f"{first / 100} s", f"{last / 100} s")
    result = window.trough_between("0 Pa", "9 Pa").check()
    assert result.value == TIME[first]
    assert window.final_between("0 Pa", "9 Pa").check().value == TIME[last - 1]


def test_two_windows_are_what_both_hold() -> None:
    run = made(PRESSURE, TIME)
    for one, other in ((("1 s", "4 s"), ("2 s", "5 s")), (("2 s", "5 s"), ("1 s", "4 s"))):
        both = expect(run, PRESSURE).during(*one).during(*other).range_between("0 Pa", "9 Pa")
        assert both.check().value == pytest.approx(4.0 - STEP - 2.0)


@pytest.mark.slow
@quiet
@given(cycles, degrees, degrees)
def test_per_cycle_is_each_cycle_alone(values: np.ndarray, one: float, other: float) -> None:
    low, high = sorted((one, other))
    start = expect(short_cycles(values), ANGLE)
    for kind in ("between", "peak_between", "trough_between", "final_between", "range_between"):
        limits = [f"{low!r} deg", f"{high!r} deg"]
        alone = [
            start.during(f"{k * 80} ms", f"{(k + 1) * 80} ms").expecting(kind, limits).check()
            for k in range(3)
        ]
        together = start.per_cycle().expecting(kind, limits).check()
        assert together.ok == all(result.ok for result in alone)
        assert (together.value, together.time) in [(result.value, result.time) for result in alone]
        if not together.ok:
            assert f"{sum(not result.ok for result in alone)} of 3 cycles fail" in together.message


def test_the_worst_cycle_is_named_and_times_count_from_its_start() -> None:
    run = in_degrees(bump(3.5, 30.0) + bump(5.2, 40.0))
    result = expect(run, ANGLE).below("28 deg").per_cycle().check()
    assert "ankle/angle, cycle 3: 40 deg at 5.2 s is 12 deg above" in result.message
    assert "2 of 3 cycles fail" in result.message
    late = expect(run, ANGLE).below("28 deg").per_cycle().after("1.3 s").check()
    assert "cycle 2: 30 deg at 3.5 s" in late.message
    assert "1 of 3 cycles fail" in late.message
    assert expect(run, ANGLE).below("28 deg").per_cycle().during("0.5 s", "1.1 s")
    assert expect(run, ANGLE).settles_to("0 deg", within="1 deg", by="1.6 s").per_cycle()
    assert not expect(run, ANGLE).settles_to("0 deg", within="1 deg", by="1.4 s").per_cycle()


def test_a_cycle_that_was_only_begun_counts_and_one_before_the_recording_does_not() -> None:
    values = np.radians(bump(3.0, 40.0))
    begun = made(ANGLE, values[:301])
    assert "cycle 2" in repr(expect(begun, ANGLE).per_cycle().final_between("0 deg", "1 deg"))
    later = dataclasses.replace(begun, columns={"time": TIME[250:], ANGLE: values[250:]})
    message = repr(expect(later, ANGLE).per_cycle().below("1 deg"))
    assert "cycle 2: 40 deg at 3 s" in message
    assert "1 of 2 cycles fail" in message


def test_a_last_sample_at_the_very_end_of_a_cycle_is_no_cycle_of_its_own() -> None:
    time = np.arange(401) * STEP
    run = dataclasses.replace(made(), columns={"time": time, PRESSURE: np.sin(time)})
    assert expect(run, PRESSURE).per_cycle().range_between("0.5 Pa", "2 Pa")


def test_per_cycle_needs_a_period() -> None:
    with pytest.raises(InputError, match="no timer period"):
        expect(made(described={}), ANGLE).below("1 deg").per_cycle().check()


# --- of any signal --------------------------------------------------------------------------------------


@quiet
@given(signals, degrees, degrees)
def test_between_is_numpys_comparison_and_reports_the_worst_sample(
    values: np.ndarray, one: float, other: float
) -> None:
    low, high = sorted((one, other))
    radians, low_radians, high_radians = (values / 57.0, low / 57.0, high / 57.0)
    result = (
        expect(made(ANGLE, radians), ANGLE).between(f"{low_radians!r} rad", f"{high_radians!r} rad").check()
    )
    inside = (radians >= low_radians) & (radians <= high_radians)
    assert result.ok == inside.all()
    outside = np.maximum(radians - high_radians, low_radians - radians)
    k = int(np.argmax(outside))
    assert (result.time, result.value) == (TIME[k], radians[k])
    assert result.limit in (low_radians, high_radians)
    assert abs(result.value - result.limit) == abs(outside[k])
    if not result.ok:
        assert f"{(~inside).sum()} of {len(values)} samples fail" in result.message
        first = TIME[np.flatnonzero(~inside)[0]]
        assert f"the first at {first:.6g} s" in result.message


TWO_SIDED = ("between", "peak_between", "trough_between", "range_between", "final_between")


@pytest.mark.slow
@quiet
@given(signals, degrees, degrees, st.floats(0.0, 20.0), st.floats(0.0, 20.0), st.sampled_from(TWO_SIDED))
def test_a_wider_limit_never_turns_good_to_bad(
    values: np.ndarray, one: float, other: float, down: float, up: float, kind: str
) -> None:
    low, high = sorted((one, other))
    start = expect(in_degrees(values), ANGLE)
    if start.expecting(kind, [f"{low!r} deg", f"{high!r} deg"]):
        assert start.expecting(kind, [f"{low - down!r} deg", f"{high + up!r} deg"])


@quiet
@given(signals, degrees, st.floats(0.0, 90.0), st.floats(0.0, 20.0))
def test_a_wider_tolerance_never_turns_good_to_bad(
    values: np.ndarray, value: float, within: float, more: float
) -> None:
    start, by = expect(in_degrees(values), ANGLE), f"{len(values) // 2} cs"
    if start.settles_to(f"{value!r} deg", within=f"{within!r} deg", by=by):
        assert start.settles_to(f"{value!r} deg", within=f"{within + more!r} deg", by=by)


CALLS: list[Callable[[Expectation], Expectation]] = [
    lambda e: e.below("20 deg"),
    lambda e: e.trough_between("-60 deg", "60 deg"),
    lambda e: e.after("20 ms"),
    lambda e: e.before("70 ms"),
    lambda e: e.per_cycle(),
]


@pytest.mark.slow
@settings(quiet, max_examples=15)
@given(cycles)
def test_the_order_of_the_calls_does_not_matter(values: np.ndarray) -> None:
    run = short_cycles(values)
    found = set()
    for order in itertools.permutations(CALLS):
        expectation = expect(run, ANGLE)
        for call in order:
            expectation = call(expectation)
        found.add(expectation.check())
    assert len(found) == 1


@quiet
@given(st.floats(0.1, 50.0))
def test_a_rate_is_the_slope(slope: float) -> None:
    run = made(PRESSURE, slope * TIME)
    limits = (f"{slope * (1 - 1e-6)!r} Pa/s", f"{slope * (1 + 1e-6)!r} Pa/s")
    assert expect(run, PRESSURE).rate().between(*limits)


# --- checks files ---------------------------------------------------------------------------------------


def write(folder: pathlib.Path, *entries: str) -> pathlib.Path:
    path = folder / "checks.toml"
    path.write_text("".join(f"[[check]]\n{entry}\n" for entry in entries), encoding="utf-8")
    return path


def test_a_file_asks_what_python_asks(tmp_path: pathlib.Path) -> None:
    run = in_degrees(bump(3.5, 30.0))
    path = write(
        tmp_path,
        'column = "ankle/angle"\nbetween = ["-1 deg", "28 deg"]\nafter = "1 s"\nbefore = "1.9 s"\n'
        'per_cycle = true\nwhy = "no stop is hit"',
        'column = "ankle/angle"\nrate = true\nbelow = "1e6 deg/s"',
        'sum = ["ankle/angle", "ankle/angle"]\npeak_between = ["59 deg", "61 deg"]',
        'column = "ankle/angle"\nsettles_to = { value = "0 deg", within = "1 deg", by = "3.6 s" }',
        'metric = "range_of_motion"\nabove = "21 deg"\nwhy = "it lifts"',
    )
    assert len(read_checks(path)) == 5
    results = run_checks(run, path)
    assert [result.ok for result in results] == [False, True, True, True, False]
    same = expect(run, ANGLE).between("-1 deg", "28 deg").during("1 s", "1.9 s").per_cycle().check()
    assert results[0].message == same.message + "; why: no stop is hit"
    assert results[4].message == (
        "range_of_motion: 20 deg is 1 deg below the limit of 21 deg (above 21 deg); why: it lifts"
    )


GOOD = 'column = "ankle/angle"\nbelow = "1 deg"'


@pytest.mark.parametrize(
    ("entry", "field", "words", "nearest"),
    [
        ('column = "ankle/angle"\nbelwo = "1 deg"', "check[2].belwo", "is an unknown key", "below"),
        ('column = "ankle/angle"', "check[2]", "has no check", None),
        (GOOD + '\nabove = "1 deg"', "check[2]", "has more than one check", None),
        ('below = "1 deg"', "check[2]", "has no column, metric or sum", None),
        (GOOD + '\nmetric = "rise_time"', "check[2].column", "does not go with a metric", None),
        ('column = "ankle/angel"\nbelow = "1 deg"', "check[2].column", "no such column", ANGLE),
        ('sum = ["ankle/angel"]\nbelow = "1 deg"', "check[2].sum", "no such column", ANGLE),
        ('sum = []\nbelow = "1 deg"', "check[2].sum", "names no column", None),
        ('sum = [1]\nbelow = "1 deg"', "check[2].sum", "has another type", None),
        ('metric = "rise_tiem"\nbelow = "1 s"', "check[2].metric", "no such metric", "rise_time"),
        ('metric = "rise_time"\nbelow = "1 deg"', "check[2].below", "does not convert to s", None),
        ('metric = "rise_time"\nbelow = "1 s"\nafter = "1 s"', "check[2].after", "does not go with", None),
        (
            'column = "ankle/angle"\nbetween = ["1 bar", "2 deg"]',
            "check[2].between",
            "does not convert",
            None,
        ),
        ('column = "ankle/angle"\nbetween = "1 deg"', "check[2].between", "is not a range", None),
        ('column = "ankle/angle"\nbetween = ["1 deg"]', "check[2].between", "is not a range", None),
        (
            'column = "ankle/angle"\nsettles_to = { value = "1 deg" }',
            "check[2].settles_to",
            "not a settl",
            None,
        ),
        (GOOD + "\nafter = 1", "check[2].after", "has no unit", None),
        (GOOD + '\nafter = "9 s"', "check[2].after", "lies in the window", None),
        (GOOD + '\nper_cycle = "yes"', "check[2].per_cycle", "has another type", None),
        (GOOD + "\nrate = 1", "check[2].rate", "has another type", None),
        (GOOD + "\nwhy = 1", "check[2].why", "has another type", None),
        ("column = 1\nbelow = '1 deg'", "check[2].column", "has another type", None),
    ],
)
def test_what_is_wrong_with_an_entry_is_said(
    tmp_path: pathlib.Path, entry: str, field: str, words: str, nearest: str | None
) -> None:
    path = write(tmp_path, GOOD, entry)
    with pytest.raises(InputError, match=words) as caught:
        run_checks(made(), path)
    assert (caught.value.file, caught.value.field, caught.value.nearest) == (path, field, nearest)
    assert str(caught.value).startswith(f"{path}: {field}")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("check = [", "is not valid TOML"),
        ("", "has no checks"),
        ("check = 1", "has no checks"),
        ("[check]\nbelow = 1", "has no checks"),
        ('[[chekc]]\ncolumn = "ankle/angle"', "is an unknown key"),
    ],
)
def test_a_file_that_is_no_checks_file_is_refused(tmp_path: pathlib.Path, text: str, words: str) -> None:
    path = tmp_path / "checks.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        read_checks(path)
    assert caught.value.file == path


# --- the shipped checks ---------------------------------------------------------------------------------


def distorted(run: Recording, factor: float, offset: float) -> Recording:
    """The run with every value but the time distorted."""
    columns = {n: v if n == "time" else factor * v + offset for n, v in run.columns.items()}
    metrics = {n: Metric(factor * m.value + offset, m.unit) for n, m in run.metrics.items()}
    return dataclasses.replace(run, columns=columns, metrics=metrics)


def shipped() -> list[CheckEntry]:
    return [
        entry for name in ("seated", "seated-antagonist") for entry in read_checks(CHECKS / f"{name}.toml")
    ]


@pytest.mark.parametrize("entry", shipped(), ids=lambda e: f"{e.file.stem}-{e.number}")
def test_every_shipped_check_can_fail(entry: CheckEntry, seated: Recording, antagonist: Recording) -> None:
    run = seated if entry.file.stem == "seated" else antagonist
    assert entry.check(run).ok
    assert not all(
        entry.check(distorted(run, factor, offset)).ok
        for factor, offset in ((0.0, 0.0), (1e4, 0.0), (-1e4, 0.0), (1.0, 1e7), (1.0, -1e7))
    )


# --- the pytest plugin ----------------------------------------------------------------------------------

CONFTEST = """
import pathlib, sys
heavy = {"afo_sim.simulation.recording", "numpy"}
assert not heavy & set(sys.modules), "the plugin imports too much"
import afo_sim
real, here = afo_sim.run, pathlib.Path(__file__).parent
def counted(scenario, sets):
    with (here / "runs.txt").open("a") as file:
        file.write(f"{scenario} {sorted(sets.items())}\\n")
    return real(scenario, sets)
afo_sim.run = counted
"""
TESTS = """
import pytest
from afo_sim import expect

short = pytest.mark.afo_scenario("seated", {"duration": "0.2 s", "supply.pressure": "3 bar"})

@short
def test_good(afo_run):
    assert expect(afo_run, "ankle/angle").between("-50 deg", "30 deg")

@pytest.mark.afo_scenario("seated", {"supply.pressure": "3 bar", "duration": "0.2 s"})
@pytest.mark.parametrize("limit", ["-20 deg"], ids=["a/b"])
def test_bad(afo_run, limit):
    assert expect(afo_run, "ankle/angle").below(limit).after("0.1 s")

@short
def test_bad_without_a_word_of_it(afo_run):
    with pytest.raises(ValueError, match="read-only"):
        afo_run["ankle/angle"][0] = 1.0
    assert False

@pytest.mark.afo_scenario("seated", {"duration": "0.1 s"})
def test_another(afo_run):
    assert afo_run["time"][-1] < 0.1

def test_unmarked(afo_run):
    pass

@pytest.mark.afo_scenario({"duration": "0.1 s"})
def test_misread(afo_run):
    pass

@pytest.mark.afo_scenario("seatde")
def test_unknown(afo_run):
    pass

def test_bad_without_a_run():
    assert False
"""


@pytest.mark.slow
def test_the_plugin_runs_once_and_keeps_what_failed(tmp_path: pathlib.Path) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST, encoding="utf-8")
    (tmp_path / "test_it.py").write_text(TESTS, encoding="utf-8")
    options = "-p afo_sim.pytest_plugin -p no:cacheprovider --strict-markers --afo-failures kept test_it.py"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options.split()],
        cwd=tmp_path,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert "2 passed" in done.stdout, done.stdout + done.stderr
    assert "3 failed" in done.stdout
    assert "3 errors" in done.stdout
    assert "ankle/angle: -5" in done.stdout
    assert "above the limit of -20 deg (below -20 deg, after 0.1 s); 50 of 50 samples fail" in done.stdout
    assert "test_unmarked: afo_run needs a scenario, such as @pytest.mark.afo_scenario(" in done.stdout
    assert "test_misread: the marker takes a scenario and values by key" in done.stdout
    assert "there is no such scenario" in done.stdout
    ran = (tmp_path / "runs.txt").read_text(encoding="utf-8").splitlines()
    assert sorted(line.split(" [")[0] for line in ran) == ["seatde", "seated", "seated"]
    kept = tmp_path / "kept"
    folders = ["test_it.py_test_bad[a_b]", "test_it.py_test_bad_without_a_word_of_it"]
    assert sorted(path.name for path in kept.iterdir()) == folders
    for folder in folders:
        assert f"recording and figure (figure.png) are in {kept / folder}" in done.stdout
        assert (kept / folder / "figure.png").read_bytes().startswith(b"\x89PNG")
        assert len(afo_sim.read_recording(kept / folder)[ANGLE]) == 100


def test_a_recording_that_cannot_be_kept_does_not_hide_the_failure(tmp_path: pathlib.Path) -> None:
    from afo_sim.pytest_plugin import _keep

    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    assert "could not be saved whole" in _keep(made(), blocked / "folder")
