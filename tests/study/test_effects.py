"""What to change first: each told effect is the difference of two runs, and none is told without a run."""

import dataclasses
import json
import pathlib
from typing import Any

import pytest

import afo_sim as afo
from afo_sim.common.errors import InputError, SimulationError
from afo_sim.simulation.recording import Recording
from afo_sim.study.effects import METRICS, Effect, Effects
from afo_sim.study.run_studies import EFFECTS, LEFT_OUT, with_studies

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
        ("dorsiflexor link_length", "10.7 cm"),
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


def test_of_a_timer_too() -> None:
    found = afo.effects(TIMER, TIMED)
    one, other = afo.run(TIMER, TIMED), afo.run(TIMER, TIMED | {"timer.dorsiflexor.inlet[0][0]": "0.6 s"})
    effect = step(found, "dorsiflexor inlet opens", "0.6 s")
    for metric in effect.differences:
        by = other.metrics[metric].value - one.metrics[metric].value
        assert effect.differences[metric] == pytest.approx(by, abs=1e-9), metric
    assert effect.noticed
    assert found.timestep == 0.004  # walked there, so the step is not fitted to the stride


def test_the_walk_as_it_is_is_run_where_it_has_not_run(found: Effects) -> None:
    assert afo.effects(WALK, FAST).to_json() == found.to_json()


def test_what_is_told_to_have_an_effect_changes_something_else_is_told(found: Effects) -> None:
    for effect in found.ranked:
        if effect.status == "run":
            assert set(effect.differences) == set(found.base)
            assert effect.noticed or effect.name in found.idle or _partner(found, effect).noticed
        else:
            assert effect.reason and not effect.differences and not effect.helps
    dead = {e.name for e in found.ranked if e.status == "run" and not any(e.differences.values())}
    assert dead <= {"plantarflexor link_length"}  # its muscles hang through, whatever their link


def _partner(found: Effects, effect: Effect) -> Effect:
    return next(e for e in found.ranked if e.name == effect.name and e.after != effect.after)


def test_idle_muscles_go_last_and_their_valves_are_told_to_be_without_air(found: Effects) -> None:
    names = [effect.name for effect in found.ranked if effect.status == "run" and effect.noticed]
    assert all(name.startswith("plantarflexor count") for name in names if name.startswith("plantar"))
    assert step(found, "plantarflexor tube volume", "6 ml").status == "no air"
    assert {"plantarflexor tube volume", "plantarflexor link_length"} <= set(found.idle)
    assert not set(found.idle) & {effect.name for effect in found.helping}


def test_a_chamber_that_is_filled_has_no_idle_valves() -> None:
    found = afo.effects(WALK, BOTH)
    plantar = [effect for effect in found.ranked if effect.name.startswith("plantarflexor")]
    assert plantar and all(effect.status != "no air" for effect in plantar)
    assert any(effect.noticed for effect in plantar if "inlet" in effect.name)


def test_nature_s_signs(found: Effects) -> None:
    """A tighter link, a stiffer cuff and more air lift the toe, and hold push-off back more."""
    for name, after, sign in (
        ("dorsiflexor link_length", "10.7 cm", 1),
        ("dorsiflexor link_length", "11.7 cm", -1),
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


def test_a_limit_that_only_the_step_leaves_is_told() -> None:
    """The muscles' limit of force is put just above what they pull with; on a stiffer cuff they pull more."""
    limit = "orthosis.muscle.dorsiflexor.type.limits.force"
    share = afo.run(WALK, FAST).metrics["muscle_share_of_force"].value
    held = 500.0 * share / 100.0
    found = afo.effects(WALK, FAST | {limit: f"{1.01 * held:.4f} N"})
    stiffer = step(found, "cuff stiffness", "8 kN/m")
    assert any("force" in text for text in stiffer.beyond) and not stiffer.helps
    softer = step(found, "cuff stiffness", "2 kN/m")
    assert not softer.beyond


def test_a_limit_that_is_left_already_and_left_further_is_told() -> None:
    limit = "orthosis.muscle.dorsiflexor.type.limits.force"
    held = 5.0 * afo.run(WALK, FAST).metrics["muscle_share_of_force"].value
    found = afo.effects(WALK, FAST | {limit: f"{0.9 * held:.4f} N"})
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
    assert table.attrs["units"]["toe_clearance"] == "mm"
    assert "steps run" in repr(found)


def test_threads_change_nothing(found: Effects, walked: Recording) -> None:
    assert afo.effects(WALK, FAST, recording=walked, threads=1).to_json() == found.to_json()


def test_progress_is_reported(walked: Recording) -> None:
    seen: list[tuple[int, int]] = []
    afo.effects(WALK, FAST, recording=walked, report=lambda done, total, what: seen.append((done, total)))
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


def test_a_run_is_told_with_them_and_a_file_keeps_them(
    walked: Recording, found: Effects, tmp_path: pathlib.Path
) -> None:
    told = with_studies(walked, afo.load("scenario", WALK, FAST), effects=True)
    told.save(tmp_path / "run", rrd=False)
    assert afo.read_recording(tmp_path / "run").studies == {EFFECTS: found.to_json()}
    assert walked.studies == {}


def test_what_has_none_stays_as_it_is(walked: Recording, seated: Recording) -> None:
    scenario = afo.load("scenario", WALK, FAST)
    assert with_studies(walked, scenario).studies == {}
    assert with_studies(seated, afo.load("scenario", "seated"), effects=True).studies == {}
    failed = dataclasses.replace(walked, status="failed: no")
    assert with_studies(failed, scenario, effects=True).studies == {}
    bare = afo.run("walk-dropfoot", {"timestep": "4 ms", "duration": "2.3 s"})
    assert with_studies(bare, afo.load("scenario", "walk-dropfoot"), effects=True).studies == {}


def test_a_run_that_would_take_minutes_says_so_instead(walked: Recording) -> None:
    slow = dataclasses.replace(walked, timing=walked.timing | {"wall_seconds": 30.0})
    told = with_studies(slow, afo.load("scenario", WALK, FAST), effects=True)
    assert "min" in told.studies[EFFECTS][LEFT_OUT]
