"""The rule by which steps are ranked, with numbers made by hand."""

import math

import pytest

from afo_sim.description.reader import load
from afo_sim.metrics.verdict import Status
from afo_sim.study.effects import (
    AIR,
    CLEARANCE,
    FIRST,
    PITCH,
    TORQUE_PER_MASS,
    WORK,
    Aim,
    Effect,
    Run,
    Wanted,
    aim_of,
    rank,
    wanted_of,
)

WANTED = Wanted(clearance=10.0, pitch=8.0, torque=0.07, work=0.016)
BASE = {CLEARANCE: 12.0, FIRST: 12.0, PITCH: 16.0, TORQUE_PER_MASS: 0.05, WORK: 0.01, AIR: 0.05}


def effect(name: str, status: Run = "run", **by: float) -> Effect:
    short = {
        "toe": CLEARANCE,
        "first": FIRST,
        "pitch": PITCH,
        "torque": TORQUE_PER_MASS,
        "work": WORK,
        "air": AIR,
    }
    differences = dict.fromkeys(BASE, 0.0) | {short[key]: value for key, value in by.items()}
    return Effect(name, "1", "2", status=status, differences=differences if status == "run" else {})


def ranked(aim: Aim, *effects: Effect, **base: float) -> list[tuple[str, bool]]:
    return [(e.name, e.helps) for e in rank(effects, BASE | base, WANTED, aim)]


@pytest.mark.parametrize(
    ("statuses", "aim"),
    [
        ({"lift": "good", "heel": "good", "push_off": "good", "air": "good"}, "spare"),
        ({"lift": "doubtful", "heel": "good", "push_off": "doubtful", "air": "doubtful"}, "lift"),
        ({"lift": "doubtful", "heel": "good", "push_off": "bad", "air": "good"}, "push_off"),
        ({"lift": "good", "heel": "doubtful", "push_off": "doubtful", "air": "good"}, "heel"),
        ({"lift": "good", "heel": "good", "push_off": "good", "air": "bad"}, "air"),
        ({"lift": "unknown", "heel": "good", "push_off": "good", "air": "unknown"}, "spare"),
        ({}, "spare"),
    ],
)
def test_what_is_worst_is_bettered_first(statuses: dict[str, Status], aim: Aim) -> None:
    assert aim_of(statuses) == aim


def test_a_toe_that_trips_ranks_by_clearance_whatever_it_costs() -> None:
    found = ranked(
        "lift",
        effect("little", toe=1.0, first=1.0),
        effect("worse", toe=-2.0, first=-2.0),
        effect("much", toe=6.0, first=6.0, torque=0.05),
        effect("unnoticed", toe=0.01, first=0.01),
        **{CLEARANCE: -5.0, FIRST: -5.0},
    )
    assert found == [("much", True), ("little", True), ("worse", False), ("unnoticed", False)]


def test_the_lowest_clearance_counts_be_it_settled_or_of_the_first_stride() -> None:
    found = ranked("lift", effect("settled", toe=5.0), effect("first", first=3.0), **{FIRST: 4.0})
    assert found == [("first", True), ("settled", False)]


def test_a_hindered_push_off_ranks_by_relief_of_what_is_furthest_beyond() -> None:
    """The work is at 1.5 of what is wanted, the torque at 1.0."""
    found = ranked(
        "push_off",
        effect("torque", torque=-0.03),
        effect("work", work=-0.002),
        effect("more work", work=-0.006),
        **{TORQUE_PER_MASS: 0.07, WORK: 0.024},
    )
    assert found == [("more work", True), ("work", True), ("torque", False)]


def test_relief_that_costs_the_clearance_is_no_help_and_says_so() -> None:
    costly = effect("costly", torque=-0.04, toe=-2.5, first=-2.5)
    fair = effect("fair", torque=-0.01, toe=-1.0, first=-1.0)
    first, second = rank([costly, fair], BASE | {TORQUE_PER_MASS: 0.1}, WANTED, "push_off")
    assert (first.name, first.helps, second.name, second.helps) == ("fair", True, "costly", False)
    assert "9.5 mm" in second.reason and "10 mm" in second.reason and not first.reason


def test_a_toe_that_is_low_already_may_stay_as_low() -> None:
    """Push-off is bad and the toe doubtful: relief helps as long as it takes no height."""
    low = {CLEARANCE: 6.0, FIRST: 6.0, TORQUE_PER_MASS: 0.2}
    assert ranked("push_off", effect("a", torque=-0.05), **low) == [("a", True)]
    assert ranked("push_off", effect("a", torque=-0.05, toe=-0.2, first=-0.2), **low) == [("a", False)]


def test_the_heel_contact_may_not_be_lost_either() -> None:
    assert ranked("air", effect("a", air=-0.02, pitch=-9.0)) == [("a", False)]


def test_air_ranks_by_air_saved() -> None:
    found = ranked("air", effect("a", air=-0.01), effect("b", air=-0.02), effect("c", air=0.02, toe=9.0))
    assert found == [("b", True), ("a", True), ("c", False)]


def test_where_all_is_good_push_off_goes_before_air_and_air_decides_among_alike_ones() -> None:
    found = ranked(
        "spare",
        effect("air", air=-0.02),
        effect("push-off", torque=-0.02),
        effect("both", torque=-0.02, air=-0.01),
        effect("costs push-off", torque=0.02, air=-0.04),
    )
    assert found == [("both", True), ("push-off", True), ("air", True), ("costs push-off", False)]


def test_what_was_not_run_goes_last_and_never_helps() -> None:
    found = ranked(
        "lift", effect("refused", "refused"), effect("dead"), effect("worse", toe=-3.0, first=-3.0)
    )
    assert [name for name, _ in found] == ["worse", "dead", "refused"]
    assert not any(helps for _, helps in found)


def test_a_step_beyond_a_limit_of_the_muscles_does_not_help() -> None:
    strong = Effect(
        "strong", "1", "2", differences={CLEARANCE: 9.0, FIRST: 9.0}, beyond=("104 % of the force",)
    )
    assert ranked("lift", strong, effect("weak", toe=1.0, first=1.0)) == [("weak", True), ("strong", False)]


@pytest.mark.parametrize("aim", ["lift", "heel", "push_off", "air", "spare"])
def test_a_step_that_leaves_a_metric_undefined_does_not_help(aim: Aim) -> None:
    lost = Effect("lost", "1", "2", differences=dict.fromkeys(BASE, math.nan))
    assert ranked(aim, lost) == [("lost", False)]
    assert lost.noticed  # it is not one of those without an effect


def test_what_is_wanted_stands_in_the_metrics_units() -> None:
    found = wanted_of(load("limits", "usual"))
    assert (found.clearance, found.pitch) == pytest.approx((10.0, 8.0))
    assert (found.torque, found.work) == pytest.approx((0.07, 0.016))


def test_air_is_not_saved_at_the_cost_of_push_off_that_is_good() -> None:
    found = ranked(
        "air",
        effect("hinders", air=-0.03, torque=0.03),
        effect("takes work", air=-0.03, work=0.01),
        effect("stays", air=-0.01, torque=0.01),
    )
    assert [name for name, helps in found if helps] == ["stays"]
    # push-off that is hindered already may not be hindered more, yet what spares both helps
    found = ranked(
        "air",
        effect("more", air=-0.02, torque=0.01),
        effect("both", air=-0.01, torque=-0.01),
        **{TORQUE_PER_MASS: 0.08},
    )
    assert [name for name, helps in found if helps] == ["both"]


def test_a_heel_that_lands_does_not_cost_the_clearance() -> None:
    found = ranked("heel", effect("low", pitch=4.0, toe=-5.0), effect("high", pitch=1.0), **{PITCH: 5.0})
    assert [name for name, helps in found if helps] == ["high"]
    # what is asked later may be paid with
    found = ranked("heel", effect("hinders", pitch=4.0, torque=0.1), **{PITCH: 5.0})
    assert [name for name, helps in found if helps] == ["hinders"]
