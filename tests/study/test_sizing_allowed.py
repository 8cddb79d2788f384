"""What a sizing refuses to call sufficient, and what it refuses before anything is run."""

import math
from typing import Any

import pytest

from afo_sim import run
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.study import Candidate, Sizing
from afo_sim.study.sizing import sizes
from afo_sim.study.sizing.candidates import DERIVED, UPPER_BOUND, doubt_of, exceeded, highest_allowed
from afo_sim.study.sizing.limits import read_requirements
from afo_sim.study.sizing.sizes import size

SHORT = {"duration": "2 s"}
ANGLE = "peak_dorsiflexion_angle"


def test_a_pressure_that_the_muscles_are_not_allowed_never_suffices() -> None:
    found = size("pressure", "seated", SHORT, limits=[f"{ANGLE} >= 2 deg"], at="9 bar")
    lowest = min(group.type.limits.pressure for group in load("scenario", "seated").orthosis.muscle.values())
    says = (
        f"9 bar is beyond what the muscles are allowed ({1e-5 * lowest:.4g} bar): dorsiflexion angle, peak "
    )
    assert not found.holds and found.answer.startswith(says)
    assert found.to_json()["holds"] is False
    assert found.asked is not None and found.asked.values[ANGLE] >= 2.0  # that it would do is not the point
    assert found.best is not None and found.best.size <= lowest


def test_the_least_pressure_is_never_beyond_a_limit() -> None:
    limits = ["peak_pressure_dorsiflexor >= 3.6 bar"]  # which some 4.5 bar reach in 2 s
    found = size("pressure", "seated", SHORT, limits=limits, between=("3 bar", "6 bar"))
    assert found.best is None and not found.holds
    assert max(each.size for each in found.tried) == 4.2e5
    assert all(f"{said} 4.2 bar" in found.answer for said in ("from 3 bar to", "the closest is"))
    assert [note for note in found.notes if "4.2 bar" in note and "muscles" in note]  # 6 bar was asked for
    none = size("pressure", "seated", SHORT, limits=limits, between=("5 bar", "6 bar"))
    assert none.best is None and none.answer.endswith(
        "5 bar is beyond what the muscles are allowed (4.2 bar)"
    )
    high = size("pressure", "seated", SHORT | {"supply.pressure": "6 bar"}, limits=limits)
    assert high.best is None and max(each.size for each in high.tried) <= 4.2e5


def test_a_pressure_that_suffices_at_the_lowest_tried_is_not_called_the_least_there_is() -> None:
    limits, between = [f"{ANGLE} >= -60 deg"], ("1 bar", "2 bar")
    found = size("pressure", "seated", SHORT, limits=limits, between=between)
    assert found.best is found.tried[0] and found.answer.endswith(", the lowest tried")
    asked = size("pressure", "seated", SHORT, limits=limits, between=between, at="1.5 bar")
    assert "the lowest that suffices is 1 bar, the lowest tried" in asked.answer


def test_a_valve_has_its_limit_too() -> None:
    scenario = load("scenario", "seated").set(
        {"orthosis.chamber.dorsiflexor.inlet.working_pressure": ["0 bar", "3 bar"]}
    )
    assert exceeded(scenario, 3e5) is None and highest_allowed(scenario, 9e5) == 3e5
    limit = exceeded(scenario, 5e5)
    assert limit is not None and limit[0] == 3e5 and limit[1].startswith("valve dorsiflexor_inlet")
    found = size("pressure", scenario, SHORT, limits=[f"{ANGLE} >= 2 deg"], at="4 bar")
    assert not found.holds and "beyond what valve dorsiflexor_inlet" in found.answer


@pytest.mark.parametrize(
    ("kind", "scenario", "options", "says"),
    [
        ("valves", "seated", {}, "did you mean 'valve'"),
        ("pressure", "seated", {"at": "1e4 bar"}, "'1e4 bar': is out of range; allowed: above 0, to 20 bar"),
        ("pressure", "seated", {"at": "-3 bar"}, "at = '-3 bar'"),
        ("pressure", "seated", {"at": "0 bar"}, "at = '0 bar'"),
        ("pressure", "seated", {"at": "21 bar"}, "to 20 bar"),
        ("pressure", "seated", {"at": "3"}, "has no unit"),
        ("pressure", "seated", {"between": ("1 bar", "1e4 bar")}, "between = '1e4 bar'"),
        ("pressure", "seated", {"between": ("3 bar", "2 bar")}, "is not a valid range"),
        ("pressure", "seated", {"limits": ()}, "peak_dorsiflexion_angle >= 5 deg"),
        ("pressure", "seated", {"limits": [f"{ANGLE} > 1 deg"]}, "is not a valid limit"),
        ("pressure", "seated", {"limits": [f"{ANGLE} >= 1 mm"]}, ANGLE),
        ("pressure", "seated", {"limits": ["peak_dorsiflexion_angel >= 1 deg"]}, f"did you mean '{ANGLE}'"),
        ("pressure", "seated", {"limits": ["fill_time_foo <= 3 s"]}, "fill_time_foo': is not of a chamber"),
        ("pressure", "seated", {"limits": ["fill_time_dorsiflex <= 3 s"]}, "mean 'fill_time_dorsiflexor'"),
        ("pressure", "seated", {"limits": ["peak_pressure_calf >= 3 bar"]}, "peak_pressure_dorsiflexor"),
        ("pressure", "seated", {"threads": -1}, "threads = -1: is out of range"),
        ("pressure", "seated", {"length": "2 m"}, "is an option of tube"),
        ("pressure", "walk-dropfoot-afo", {"cadence": 1000}, "30 to 240 steps/min"),
        ("pressure", "walk-dropfoot-afo", {"colour": 1}, "is not a valid option"),
        ("pressure", "walk-healthy", {}, "nothing to size"),
        ("valve", "seated", {"chamber": "dorsiflex"}, "did you mean 'dorsiflexor'"),
        ("valve", "seated", {"side": "in"}, "did you mean 'inlet'"),
        ("tube", "seated", {}, "is needed: nothing states how long"),
        ("tube", "seated", {"length": "-2 m"}, "is out of range"),
        ("tube", "seated", {"length": "1000 m"}, "'1000 m': is out of range; allowed: above 0, to 100 m"),
        ("supply", "seated", {"strides": 10}, "are of walking"),
        ("supply", "seated", {"hours": 0}, "is out of range"),
        ("muscle", "seated", {"group": "calf"}, "is not a group of muscles"),
        ("muscle", "seated", {"count": (3, 2)}, "1 to 8"),
        ("muscle", "seated", {"count": "1-9"}, "1 to 8"),
        ("muscle", "seated", {"count": "many"}, "is not a whole number"),
    ],
)
def test_what_is_wrong_is_refused_before_anything_runs(
    kind: str, scenario: str, options: dict[str, Any], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sizes.Request, "run", lambda *_: pytest.fail("something was run"))
    with pytest.raises(InputError) as caught:
        size(kind, scenario, **{"limits": [f"{ANGLE} >= 2 deg"], **options})
    assert says in str(caught.value)


def test_a_metric_that_no_run_has_is_refused() -> None:
    with pytest.raises(InputError, match="is reported by no run"):
        size("pressure", "seated", SHORT, limits=["toe_clearance >= 10 mm"])


@pytest.mark.parametrize("limit", ["needed_swing_torque <= 5 N*m", "stride_time <= 1 s"])
def test_a_metric_that_does_not_depend_on_what_is_sized_is_refused(limit: str) -> None:
    """What it names instead does: two walks by themselves differ in it."""
    walk, coarse, ends = "walk-dropfoot-afo", {"timestep": "4 ms"}, ("2 bar", "3.5 bar")
    with pytest.raises(InputError, match="does not depend on the pressure") as caught:
        size("pressure", walk, coarse, limits=[limit], between=ends)
    named = caught.value.allowed.split(", ")
    low, high = (run(walk, coarse | {"supply.pressure": end}).metrics for end in ends)
    assert caught.value.field == "limit" and len(named) == 8
    for one, other in ((float(low[name]), float(high[name])) for name in named):
        assert abs(one - other) > 0.005 * abs(one)
    if limit.startswith("needed"):
        assert "orthosis_mean_dorsiflexion_torque" in named  # one in N·m comes first
        assert all(high[name].unit == "N*m" for name in named[:4])


def test_a_share_that_no_candidate_moves_from_its_end_is_no_refusal() -> None:
    """At 0.5 to 0.9 bar each swing touches the floor, and at more none does."""
    limits, coarse = ["swings_with_toe_contact <= 0 percent"], {"timestep": "4 ms", "duration": "2.5 s"}
    assert (
        size("pressure", "walk-dropfoot-afo", coarse, limits=limits, between=("0.5 bar", "0.9 bar")).best
        is None
    )


def test_a_metric_that_all_candidates_meet_alike_is_no_trouble() -> None:
    coarse = {"timestep": "4 ms"}
    found = size(
        "pressure", "walk-dropfoot-afo", coarse, limits=["stride_time <= 2 s"], between=("2 bar", "3 bar")
    )
    assert found.best is not None and found.best.size == 2e5


def test_limits_and_counts_as_people_write_them_in_python() -> None:
    walk = "walk-dropfoot-afo"
    for nothing in (None, (), []):
        asked = sizes.requested("pressure", walk, limits=nothing)
        assert [each.metric for each in asked.requirements] == ["toe_clearance", "toe_clearance_stride_1"]
    one = sizes.requested("pressure", walk, limits="fill_time <= 3 s")
    assert [str(each) for each in one.requirements] == ["fill_time_dorsiflexor <= 3 s"]
    for count, ends in (("1-3", (1, 3)), ("2", (2, 2)), (2, (2, 2)), ((1, 3), (1, 3))):
        assert sizes.requested("muscle", walk, count=count).options["count"] == ends


def test_a_muscle_that_nobody_measured_is_not_crowned_without_a_word() -> None:
    doubts = {
        name: doubt_of(load("muscle", name)) for name in ("handmade_10mm", "dmsp_40", "dmsp_10", "s1_215mm")
    }
    assert doubts == {"handmade_10mm": "not measured", "dmsp_40": DERIVED, "dmsp_10": "", "s1_215mm": ""}
    ideal = {"law": "chou_hannaford_1996"}
    assert doubt_of(load("muscle", "handmade_10mm", ideal)) == "not measured"
    for bare in ({"tube": None}, ideal | {"tube": None}):
        assert doubt_of(load("muscle", "handmade_10mm", bare)) == UPPER_BOUND
    sets = {"supply.pressure": "3.8 bar"}  # at which the hand-made one keeps its own limit
    found = size("muscle", "walk-dropfoot-afo", sets, limits="toe_clearance >= 10 mm", count=1)
    each = {tried.name: tried for tried in found.tried}
    guessed = each["1 × handmade_10mm"]
    assert guessed.meets and found.best is not None and not found.best.doubt
    assert found.best.size > guessed.size
    assert f"1 × handmade_10mm would also suffice, but: {guessed.doubt}" in found.answer
    assert "for dorsiflexor that meets" in found.answer
    grades = {row[0][2:]: row[found.table[1].index("grade")] for row in found.table[2]}
    assert grades["1 × handmade_10mm"] == grades["1 × dmsp_40"] == "D *" and grades["1 × dmsp_10"] == "B"
    assert any(UPPER_BOUND in line and "shadow_30mm" in line for line in found.remarks)


def test_one_in_doubt_is_named_with_its_doubt_where_nothing_else_does() -> None:
    doubtful = Candidate("guess", 1.0, doubt="not measured")
    failing = Candidate("sure", 2.0, short={"Toe clearance": "too low"})
    found = Sizing("muscle", "seated", (), (doubtful, failing), "air_per_cycle")
    assert found.best is doubtful and found.answer.startswith("guess (not measured) is the smallest")


def test_sources_of_unknown_mass_are_named_beside_the_lightest() -> None:
    found = size("supply", "seated", SHORT, hours=0.1)
    assert found.best is not None and found.best.name == "bottle_0_5l"
    unknown = [t.name for t in found.tried if t.meets and load("source", t.name).mass is None]
    assert unknown and all(name in found.answer.partition("; ")[2] for name in unknown)
    masses = {row["name"]: row["mass of the source [kg]"] for row in found.rows()}
    assert all(math.isnan(masses[name]) for name in unknown)
    long = size("supply", "seated", SHORT, hours=0.3)
    assert long.best is not None and load("source", long.best.name).mass is None
    assert long.best.doubt in long.answer


def test_what_leaves_its_own_limits_comes_closest_only_where_nothing_keeps_them() -> None:
    wanted = read_requirements(["toe_clearance >= 10 mm"], "")
    broken = Candidate("broken", 1.0, values={"toe_clearance": 12.0}, short={"limit": "too far"})
    low = Candidate("low", 2.0, values={"toe_clearance": 4.0}, short={wanted[0].label: "short"})
    found, only = (
        Sizing("muscle", "walk", wanted, tried, "air_per_stride") for tried in ((broken, low), (broken,))
    )
    assert "the closest is low: toe clearance 4.0 mm" in found.answer
    assert only.answer.endswith("(target ≥ 10 mm), but too far")
