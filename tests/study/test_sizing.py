"""The smallest component, or the least pressure: each answer against runs of its own."""

import json
import math
import pathlib
from typing import Any

import pytest

import afo_sim as afo
from afo_sim.common import with_code
from afo_sim.description import load
from afo_sim.model import fits
from afo_sim.study import Requirement
from afo_sim.study.sizing.candidates import link_for, why_not
from afo_sim.study.sizing.limits import read_requirements, shown, usual
from afo_sim.study.sizing.sizes import _chamber_of, size
from afo_sim.study.sizing.three_way import one_coil, times_for, two_coils, within

SHORT = {"duration": "2 s"}
ANGLE = "peak_dorsiflexion_angle"
PUSH_OFF = "torque_against_push_off_per_mass"


def kept(requirements: tuple[Requirement, ...], scenario: str, sets: dict[str, Any]) -> bool:
    """Whether a run of its own meets all."""
    metrics = afo.run(scenario, sets).metrics
    return all(r.met(float(metrics.get(r.metric, math.nan))) for r in requirements)


def test_the_least_pressure_holds_and_just_below_it_does_not() -> None:
    found = size("pressure", "seated", SHORT, limits=[f"{ANGLE} >= 2 deg"])
    assert found.holds and found.best is not None and found.interval is not None
    low, high = found.interval
    assert 0.0 < high - low <= 5.01e3 and found.best.size == high
    for pressure, holds in ((low, False), (high, True)):
        assert kept(found.requirements, "seated", SHORT | {"supply.pressure": f"{pressure} Pa"}) is holds
    assert found.answer.startswith(found.best.name)


def test_whether_a_pressure_suffices_is_one_sentence() -> None:
    enough = size("pressure", "seated", SHORT, limits=[f"{ANGLE} >= 2 deg"], at="4 bar")
    assert enough.holds and enough.answer.startswith("4 bar suffices: dorsiflexion angle, peak ")
    little = size("pressure", "seated", SHORT, limits=[f"{ANGLE} >= 2 deg"], at="1.5 bar")
    assert not little.holds and "1.5 bar does not suffice" in little.answer
    assert little.best is not None and f"the lowest that suffices is {little.best.name}" in little.answer


@pytest.mark.slow
def test_a_pressure_suffices_where_its_run_says_good() -> None:
    """By runs of their own: the least pressure lifts well, the next lower one does not; what else is told."""
    found = size("pressure", "walk-dropfoot-afo", at="4.2 bar")
    assert found.interval is not None and found.asked is not None and found.asked.said is not None
    runs = [afo.run("walk-dropfoot-afo", {"supply.pressure": f"{p} Pa"}) for p in (*found.interval, 4.2e5)]
    lifts = [{answer.name: answer for answer in run.verdict}["lift"].status for run in runs]
    assert lifts == ["doubtful", "good", "good"]
    worse = {answer.name for answer in runs[-1].verdict if answer.status != "good"}
    assert "push_off" in worse and found.asked.said.keys() == worse


def test_a_pressure_beyond_a_laws_range_does_not_suffice() -> None:
    law = "orthosis.muscle.dorsiflexor.type.laws.tondu_lopez_2000_bladder.pressure_range"
    sets: dict[str, Any] = {law: ["1.2 bar", "3.6 bar"]}
    found = size("pressure", "walk-dropfoot-afo", sets, limits=["toe_clearance >= 10 mm"], at="4 bar")
    run = afo.run("walk-dropfoot-afo", {**sets, "supply.pressure": "4 bar"})
    assert with_code(run.warnings, "law-outside-its-pressure")
    assert found.asked is not None and not found.holds
    assert all(requirement.met(found.asked.values["toe_clearance"]) for requirement in found.requirements)
    assert found.best is not None and found.best.size <= 3.65e5


@pytest.mark.slow
def test_more_pressure_is_told_to_be_worse_where_it_holds_push_off_back() -> None:
    limits = ["toe_clearance >= 5 mm", f"{PUSH_OFF} <= 0.07 N*m/kg"]
    found = size("pressure", "walk-dropfoot-afo", limits=limits)
    assert found.best is not None
    meets = [each.meets for each in found.tried]
    assert meets.index(True) > 0 and not meets[-1]
    assert found.worse() and set(found.worse()) <= set(found.notes)
    last = max(each.size for each in found.tried if each.meets)
    next_one = min(each.size for each in found.tried if each.size > last)
    assert next_one - last <= 5.01e3  # the upper end is found as closely


@pytest.mark.slow
def test_a_window_between_two_pressures_of_the_scan_is_found() -> None:
    # 3.25 bar lifts too little, 3.7 bar holds push-off back too much
    limits = ["toe_clearance >= 10 mm", f"{PUSH_OFF} <= 0.0725 N*m/kg"]
    found = size("pressure", "walk-dropfoot-afo", limits=limits)
    assert found.best is not None and 3.25e5 < found.best.size < 3.7e5
    sets = {"supply.pressure": f"{found.best.size} Pa"}
    assert kept(found.requirements, "walk-dropfoot-afo", sets)


def test_a_wish_beyond_all_is_answered_by_the_best_found(tmp_path: pathlib.Path) -> None:
    found = size("pressure", "seated", SHORT, limits=[f"{ANGLE} >= 25 deg"])
    assert found.best is None and not found.holds
    highest = max(found.tried, key=lambda each: each.values[ANGLE])
    assert (
        f"the closest is {highest.name}" in found.answer
        and "no tried pressure from 0.5 bar to 4.2 bar" in found.answer
    )
    told = json.loads((found.save(tmp_path / "out") / "size.json").read_text())
    assert told["best"] is None and not told["holds"] and len(told["tried"]) == len(found.tried)


def test_one_case_that_is_refused_does_not_end_the_others() -> None:
    sets = SHORT | {
        "supply.source": "bottle_0_5l_10bar",
        "supply.source.filling_pressure": "3.6 bar",
        "supply.pressure": "2 bar",
    }
    found = size("pressure", "seated", sets, limits=[f"{ANGLE} >= 1 deg"], between=("1 bar", "4 bar"))
    refused = [each for each in found.tried if each.status == "refused"]
    assert found.best is not None and refused and all(each.size >= 3.6e5 for each in refused)
    assert all("its full source has" in each.reason for each in refused)


def test_the_next_smaller_valve_fails() -> None:
    sets = {"duration": "6 s"}
    found = size("valve", "seated", sets, limits=["fill_time <= 2.5 s"], side="inlet")
    assert found.best is not None and found.best.name == "mh1"
    ran = [each for each in found.tried if each.status == "run"]
    assert [each.size for each in ran] == sorted(each.size for each in ran)
    key = "orthosis.chamber.dorsiflexor.inlet"
    assert kept(found.requirements, "seated", sets | {key: "mh1"})
    tight = size("valve", "seated", sets, limits=["fill_time <= 2 s"], side="inlet")
    assert tight.best is not None and tight.best.name == "matrix_821"
    assert not kept(tight.requirements, "seated", sets | {key: "mh1"})
    assert kept(tight.requirements, "seated", sets | {key: "matrix_821"})
    reasons = {each.name: each.reason for each in found.tried if each.status == "excluded"}
    assert "--proportional" in reasons["mpye_m5"] and "--side both" in reasons["mha2"]
    assert next(each for each in ran if each.name == "mh1").facts["b"] == "0.3 *"


def test_a_valve_is_kept_within_its_working_pressure_and_its_time_step() -> None:
    # above the 6 bar that the Matrix 821 is made for; large valves need a finer step
    sets = {"duration": "1 s", "supply.pressure": "7 bar"}
    found = size("valve", "seated", sets, limits=["peak_pressure_dorsiflexor >= 1 bar"])
    each = {tried.name: tried for tried in found.tried}
    assert each["matrix_821"].status == "excluded" and "made for 6 bar" in each["matrix_821"].reason
    assert each["sy9000"].status == "run" and "time step" in " ".join(each["sy9000"].notes)
    piloted = load("valve", "vuvs_lt25").with_values(working_pressure=("2.5 bar", "10 bar"))
    low = load("scenario", "seated").set({"supply.pressure": "2 bar"})
    assert (
        why_not(low, "both", False, piloted) == "its pilot needs at least 2.5 bar, but the supply has 2 bar"
    )
    assert not why_not(load("scenario", "seated"), "both", False, piloted)


def test_a_wider_tube_takes_more_air() -> None:
    found = size("tube", "seated", SHORT, limits=["peak_pressure_dorsiflexor >= 3 bar"], length="2 m")
    air = [each.values[found.air] for each in found.tried]
    assert air == sorted(air) and found.best == found.tried[0]
    chamber = found.tried[-1].sets
    run = afo.run("seated", SHORT | dict(chamber))
    assert float(run.metrics[found.air]) == pytest.approx(air[-1], rel=1e-9)
    assert any("sound takes 5.8 ms" in note for note in found.notes)  # 2 m at 343 m/s
    assert any("takes the place of tube_volume" in note for note in found.notes)


@pytest.mark.slow
def test_a_source_lasts_as_long_as_its_content() -> None:
    found = size("supply", "walk-dropfoot-afo", {"gait.settled": "walked"}, strides=1500)
    each = {tried.name: tried for tried in found.tried}
    bottle, source = each["bottle_0_5l"], load("source", "bottle_0_5l")
    content = 1e3 * source.given(4e5)  # [g]
    assert bottle.values["strides_of_source"] == pytest.approx(
        content / bottle.values["air_per_stride"], rel=0.03
    )
    assert bottle.values["strides_of_source"] < content / bottle.values["air_per_stride"]  # it cools
    assert found.best is not None and found.best.name == "bottle_0_5l"
    assert "stops at 1.8 bar, and the supply is set to 4 bar" in each["vn_c1"].reason
    assert not each["co2_16g"].meets


def test_a_compressor_that_keeps_up_lasts_without_end() -> None:
    sets = {"supply.pressure": "1.5 bar", "duration": "8 s"}
    found = size("supply", "seated", sets, hours=1)
    each = {tried.name: tried for tried in found.tried}
    pump, bottle = each["vn_c4"], each["bottle_0_5l"]
    assert pump.values["hours_of_source"] == math.inf and pump.meets
    assert any("keeps up" in note for note in pump.notes) and any("sags" in note for note in pump.notes)
    source = load("source", "bottle_0_5l")
    minutes = source.free_litres(1.5e5) / float(
        afo.run("seated", sets | {"supply.source": source}).metrics["mean_flow"]
    )
    assert bottle.values["hours_of_source"] == pytest.approx(minutes / 60.0, rel=0.03)  # it hardly cools
    assert bottle.values["hours_of_source"] < minutes / 60.0


@pytest.mark.slow
def test_another_muscle_is_taut_at_the_same_angle() -> None:
    limits = ["toe_clearance >= 10 mm"]
    found = size("muscle", "walk-dropfoot-afo", limits=limits, group="dorsiflexor", count=(2, 3))
    each = {tried.name: tried for tried in found.tried}
    assert len(each) == 2 * len({name.partition(" × ")[2] for name in each})
    walk = load("scenario", "walk-dropfoot-afo")
    before = fits(walk.orthosis)["dorsiflexor"].taut
    for name in ("3 × dmsp_10", "3 × s1_120mm"):
        after = fits(walk.set(each[name].sets).orthosis)["dorsiflexor"].taut
        assert after == pytest.approx(before, abs=1e-6)
    assert "too long for the path" in each["3 × dmsp_20_400n"].reason
    link = link_for(walk.orthosis.muscle["dorsiflexor"], load("muscle", "dmsp_20_400n"))
    assert link is not None and link < 0.0


def test_a_muscle_that_may_not_hold_the_pressure_is_told() -> None:
    sets = {"duration": "0.5 s", "supply.pressure": "5 bar"}
    found = size("muscle", "seated", sets, limits=["peak_pressure_dorsiflexor >= 1 bar"])
    low = [each for each in found.tried if "may hold" in each.reason]
    assert low and all(load("muscle", e.name.partition(" × ")[2]).limits.pressure < 5e5 for e in low)


def test_a_faster_cadence_shortens_the_stride() -> None:
    limits = ["stride_time <= 1 s"]
    found = size("pressure", "walk-dropfoot-afo", limits=limits, cadence=120, between=("3 bar", "3.1 bar"))
    assert found.tried[0].values["stride_time"] == pytest.approx(1.0, abs=1e-6)


def test_limits_by_default_and_as_they_are_written() -> None:
    walk, seated = (load("scenario", name) for name in ("walk-dropfoot-afo", "seated"))
    assert [str(r) for r in usual(walk)] == ["toe_clearance >= 10 mm", "toe_clearance_stride_1 >= 10 mm"]
    assert usual(seated) == ()
    fill, share = read_requirements(["fill_time <= 150 ms", "muscle_share_of_force <= 80 %"], "calf")
    assert (fill.metric, fill.bound, share.bound) == ("fill_time_calf", pytest.approx(0.15), 80.0)


def test_by_default_the_first_chamber_that_is_filled_is_sized() -> None:
    walk = load("scenario", "walk-dropfoot-afo")
    vented = {"phases.dorsiflexor.inlet": [], "phases.plantarflexor.inlet": [[0.4, 0.6]]}
    for sets, chamber in (
        ({}, "dorsiflexor"),
        ({"phases.plantarflexor.inlet": [[0.4, 0.6]]}, "dorsiflexor"),
        (vented, "plantarflexor"),
        ({"phases.dorsiflexor.inlet": []}, "dorsiflexor"),  # none is
    ):
        assert _chamber_of(walk.set(sets), None, None) == chamber
    assert (
        _chamber_of(walk, "plantarflexor", None)
        == _chamber_of(walk, None, "plantarflexor")
        == "plantarflexor"
    )


@pytest.mark.parametrize(("value", "unit"), [(0.012, "s"), (12.0, "s"), (0.5, "h"), (30.0, "h"), (3.0, "mm")])
def test_a_negative_number_is_shown_in_the_unit_of_a_positive_one(value: float, unit: str) -> None:
    assert shown(-value, unit) == f"−{shown(value, unit)}"
    assert shown(0.012, "s") == "12 ms" and shown(0.5, "h") == "30 min"


def test_the_answer_as_a_table_a_frame_and_html() -> None:
    found = size("pressure", "seated", SHORT, limits=[f"{ANGLE} >= 2 deg"], between=("2 bar", "4 bar"))
    title, header, rows = found.table
    assert header[0] == "pressure" and len(rows) == len(found.tried) and "margins" in title
    assert sum(row[0].startswith("▶") for row in rows) == 1
    frame = found.to_pandas()
    assert list(frame.columns) == list(found.rows()[0]) and len(frame) == len(rows)
    assert frame["meets"].sum() == sum(e.meets for e in found.tried)
    assert found.answer.split(":")[0] in repr(found) and "<table" in found._repr_html_()


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
