"""What to change first: each told effect is the difference of two runs, and none is told without a run."""

import dataclasses
import json
import math
import pathlib
from typing import Any

import pytest

import afo_sim as afo
from afo_sim.common import InputError, SimulationError
from afo_sim.description import load
from afo_sim.metrics import Status
from afo_sim.simulation import Recording
from afo_sim.study import AIR, CLEARANCE, EFFECTS, FIRST, LEFT_OUT, PITCH, WORK, Effects, with_studies
from afo_sim.study.effect import METRICS, TORQUE_PER_MASS, Effect, Run
from afo_sim.study.effects import Aim, aim_of, rank

WALK, TIMER = "walk-dropfoot-afo", "walk-dropfoot-afo-timer"
FAST: dict[str, Any] = {"timestep": "4 ms", "duration": "6.1 s"}
TIMED: dict[str, Any] = {"timestep": "4 ms", "duration": "4.6 s"}
BOTH: dict[str, Any] = FAST | {
    "phases.plantarflexor": {"inlet": [[0.5, 0.55]], "outlet": [[0.6, 0.4]]},
    "orthosis.muscle.plantarflexor.slack": "0 cm",
}


@pytest.fixture(scope="module")
def walked() -> Recording:
    return afo.run(WALK, FAST)


@pytest.fixture(scope="module")
def found(walked: Recording) -> Effects:
    return afo.effects(WALK, FAST, recording=walked)


def step(found: Effects, name: str, after: str) -> Effect:
    return next(effect for effect in found.ranked if (effect.name, effect.after) == (name, after))


@pytest.mark.parametrize(
    ("name", "after"),
    [
        ("supply pressure", "3.5 bar"),
        ("dorsiflexor link length", "10.7 cm"),
        ("dorsiflexor count", "4"),
        ("dorsiflexor insertion forward, link to match", "5.5 cm"),
        ("dorsiflexor outlet opens", "0.1"),
        ("dorsiflexor fill time", "2 s"),
        ("cuff stiffness", "2 kN/m"),
    ],
)
def test_an_effect_is_the_difference_of_two_runs(
    found: Effects, walked: Recording, name: str, after: str
) -> None:
    effect = step(found, name, after)
    changed = afo.run(WALK, FAST | effect.sets)
    for metric in METRICS:
        by = changed.metrics[metric].value - walked.metrics[metric].value
        assert effect.differences[metric] == pytest.approx(by, abs=1e-9), metric


@pytest.mark.slow
def test_of_a_timer_too() -> None:
    one = afo.run(TIMER, TIMED)
    found, other = (
        afo.effects(TIMER, TIMED, recording=one),
        afo.run(TIMER, TIMED | {"timer.dorsiflexor.inlet[0][0]": "0.6 s"}),
    )
    effect = step(found, "dorsiflexor inlet opens", "0.6 s")
    for metric in effect.differences:
        by = other.metrics[metric].value - one.metrics[metric].value
        assert effect.differences[metric] == pytest.approx(by, abs=1e-9), metric
    assert effect.noticed
    assert found.timestep == 0.004  # walked there, so the step is not fitted to the stride


def test_what_is_told_to_have_an_effect_changes_something_else_is_told(found: Effects) -> None:
    for effect in found.ranked:
        if effect.status == "run":
            assert set(effect.differences) == set(found.base)
            assert effect.noticed or effect.name in found.idle or _partner(found, effect).noticed
        else:
            assert effect.reason and not effect.differences and not effect.helps
    dead = {e.name for e in found.ranked if e.status == "run" and not any(e.differences.values())}
    assert dead <= {"plantarflexor link length"}  # its muscles hang through, whatever their link


def _partner(found: Effects, effect: Effect) -> Effect:
    return next(e for e in found.ranked if e.name == effect.name and e.after != effect.after)


def test_idle_muscles_go_last_and_their_valves_are_told_to_be_without_air(found: Effects) -> None:
    names = [effect.name for effect in found.ranked if effect.status == "run" and effect.noticed]
    assert all(name.startswith("plantarflexor count") for name in names if name.startswith("plantar"))
    assert step(found, "plantarflexor tube volume", "6 ml").status == "no air"
    assert {"plantarflexor tube volume", "plantarflexor link length"} <= set(found.idle)
    assert not set(found.idle) & {effect.name for effect in found.helping}


@pytest.mark.slow
def test_a_chamber_that_is_filled_has_no_idle_valves() -> None:
    found = afo.effects(WALK, BOTH)
    plantar = [effect for effect in found.ranked if effect.name.startswith("plantarflexor")]
    assert plantar and all(effect.status != "no air" for effect in plantar)
    assert any(effect.noticed for effect in plantar if "inlet" in effect.name)


def test_nature_s_signs(found: Effects) -> None:
    """A tighter link, a stiffer cuff and more air lift the toe, and hold push-off back more."""
    for name, after, sign in (
        ("dorsiflexor link length", "10.7 cm", 1),
        ("dorsiflexor link length", "11.7 cm", -1),
        ("cuff stiffness", "8 kN/m", 1),
        ("supply pressure", "3.5 bar", -1),
    ):
        effect = step(found, name, after)
        assert sign * effect.differences["toe_clearance"] > 0.0
        assert sign * effect.differences["torque_against_push_off"] > 0.0
    assert step(found, "supply pressure", "3.5 bar").differences["air_per_stride"] < 0.0


def test_the_better_step_of_each_parameter_is_told_once(found: Effects) -> None:
    names = [effect.name for effect in found.helping]
    assert names and len(names) == len(set(names))
    assert list(found.ranked).index(found.helping[0]) == 0


@pytest.mark.slow
def test_what_cannot_be_is_told_with_the_reason() -> None:
    sets = FAST | {
        "orthosis.muscle.plantarflexor.count": 1,
        "start.dorsiflexor.fill_time": "0.3 s",
        "start.plantarflexor.pressure": "4 bar",
    }
    found = afo.effects(WALK, sets)
    none = step(found, "plantarflexor count", "0")
    assert none.status == "refused" and "count" in none.reason
    assert step(found, "dorsiflexor fill time", "-0.2 s").status == "refused"
    over = step(found, "supply pressure", "4.5 bar")
    assert over.status == "forbidden" and "4.2 bar" in over.reason
    under = step(found, "supply pressure", "3.5 bar")
    assert under.status == "refused" and "supply" in under.reason


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.01, 0.9])
def test_a_limit_that_the_step_leaves_or_leaves_further_is_told(walked: Recording, share: float) -> None:
    """The muscles' limit of force is put beside what they pull with; on a stiffer cuff they pull more."""
    limit = "orthosis.muscle.dorsiflexor.type.limits.force"
    held = 5.0 * walked.metrics["muscle_share_of_force"].value
    found = afo.effects(WALK, FAST | {limit: f"{share * held:.4f} N"})
    stiffer, softer = (step(found, "cuff stiffness", k) for k in ("8 kN/m", "2 kN/m"))
    assert any("force" in text for text in stiffer.beyond) and not stiffer.helps
    assert not softer.beyond


def test_json_gives_back_all_of_it(found: Effects) -> None:
    text = json.dumps(found.to_json(), allow_nan=False)
    again = Effects.from_json(json.loads(text))
    assert again == found
    assert again.base["toe_clearance"].unit == "mm"


def test_a_table_of_all_steps(found: Effects) -> None:
    table = found.to_pandas()
    assert len(table) == len(found.ranked)
    assert table.attrs["units"]["toe_clearance"] == "mm" and "toe_clearance [mm]" in table
    assert "steps run" in repr(found)


@pytest.mark.slow
def test_threads_change_nothing_nor_does_who_runs_the_walk_and_progress_is_reported() -> None:
    """By itself it walks with its step controlled."""
    seen: list[tuple[int, int]] = []
    alone = afo.effects(WALK, FAST, threads=1, progress=lambda done, total, what: seen.append((done, total)))
    controlled = afo.run(WALK, FAST, step="controlled")
    assert alone.to_json() == afo.effects(WALK, FAST, recording=controlled).to_json()
    assert alone.timestep == pytest.approx(controlled.studies["time_step"]["step"])
    assert [done for done, _ in seen] == list(range(1, seen[0][1] + 1))


@pytest.mark.parametrize("scenario", ["seated", "walk-dropfoot"])
def test_only_a_walk_with_muscles_has_effects(scenario: str) -> None:
    with pytest.raises(InputError, match=r"does not walk|has no muscles"):
        afo.effects(scenario)


def test_the_recording_must_be_of_the_scenario(walked: Recording) -> None:
    with pytest.raises(InputError, match="another scenario"):
        afo.effects(WALK, FAST | {"supply.pressure": "3 bar"}, recording=walked)


def test_a_walk_that_fails_has_none() -> None:
    with pytest.raises(SimulationError, match="failed"):
        afo.effects(WALK, FAST | {"load_moment": "1000 N*m"})


# --- told with a run


@pytest.mark.slow
def test_a_run_is_told_with_them_and_a_file_keeps_them(
    walked: Recording, found: Effects, tmp_path: pathlib.Path
) -> None:
    told = with_studies(walked, afo.load("scenario", WALK, FAST), effects=True)
    told.save(tmp_path / "run", rrd=False)
    assert afo.read_recording(tmp_path / "run").studies == walked.studies | {EFFECTS: found.to_json()}
    assert EFFECTS not in walked.studies


def test_what_has_none_stays_as_it_is(walked: Recording, seated: Recording) -> None:
    scenario = afo.load("scenario", WALK, FAST)
    assert with_studies(walked, scenario).studies == walked.studies
    assert with_studies(seated, afo.load("scenario", "seated"), effects=True).studies == seated.studies
    failed = dataclasses.replace(walked, status="failed: no")
    assert with_studies(failed, scenario, effects=True).studies == walked.studies
    bare = afo.run("walk-dropfoot", {"timestep": "4 ms", "duration": "2.3 s"})
    assert with_studies(bare, afo.load("scenario", "walk-dropfoot"), effects=True).studies == bare.studies


def test_a_run_that_would_take_minutes_says_so_instead(walked: Recording) -> None:
    slow = dataclasses.replace(walked, timing=walked.timing | {"wall_seconds": 30.0})
    told = with_studies(slow, afo.load("scenario", WALK, FAST), effects=True)
    assert "min" in told.studies[EFFECTS][LEFT_OUT]


WANTED = load("limits", "usual")  # 10 mm, 8°, 0.07 N·m/kg, 0.016 J/kg
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
