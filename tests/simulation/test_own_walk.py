"""A patient's own recorded walk as the baseline: it comes back, and only what is added moves the ankle."""

import dataclasses
import pathlib

import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError, assets, with_code
from afo_sim.description import load
from afo_sim.gait import GaitCycle, at_speed, stance, write
from afo_sim.gait import file as gait
from afo_sim.gait_lab.trial.plausibility import walker_doubts
from afo_sim.metrics import Answer, capped, decides
from afo_sim.metrics.verdict import ENOUGH
from afo_sim.model import own_tissue, with_person
from afo_sim.model.build import build
from afo_sim.physics import passive_moments
from afo_sim.show import of_walker
from afo_sim.show.run_names import in_words

SETS: dict[str, object] = {"timestep": "1 ms", "duration": "4.6 s"}


def drop_foot() -> GaitCycle:
    """A recorded adult whose ankle hangs by up to 15° more in swing, as a patient's own walk, barefoot."""
    cycle = gait.read(assets.find_gait("opensim_walk"))
    hangs = np.sin(np.pi * np.clip((cycle.phase - 0.55) / 0.43, 0.0, 1.0)) ** 2
    angle = cycle.ankle_angle - np.radians(15.0) * hangs
    return dataclasses.replace(cycle, ankle_angle=angle, walker="patient", sole_thickness=0.0)


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """The keys of a scenario that walks with that recording."""
    file = tmp_path_factory.mktemp("own") / "own.csv"
    write(file, drop_foot())
    return {**SETS, "gait.cycle": str(file)}


@pytest.mark.parametrize("shod", [False, True])
@pytest.mark.parametrize("mode", ["recorded", "contact", None])
def test_without_a_device_the_recorded_ankle_comes_back(
    own: dict[str, object], mode: str | None, shod: bool
) -> None:
    """Within 0.05° in what was worn, and no further off in half the step; None is contact."""
    worn: dict[str, object] = {"shoe": "trainer", "gait.sole_thickness": "20 mm"} if shod else {}
    ground: dict[str, object] = {} if mode is None else {"ground.mode": mode}
    found = []
    for step in ("1 ms", "0.5 ms"):
        run = afo_sim.run("walk-dropfoot", own | worn | ground | {"timestep": step})
        assert run.ok and "strides_solved" in run.metrics
        assert ("shank/sink" in run.columns) is (mode != "recorded")
        assert not {"gait/needed_moment", "torque_covered", "needed_swing_torque_mean"} & {
            *run.columns,
            *run.metrics,
        }
        rows = run["gait/solved"] > 0.5
        off = np.degrees(run["ankle/angle"] - run["gait/ankle_angle"])[rows]
        found.append(float(np.sqrt(np.mean(off**2))))
    assert found[0] < 0.05 and found[1] < max(found[0], 0.006)


def test_a_small_torque_moves_the_ankle_by_the_tissue_alone(own: dict[str, object]) -> None:
    """A dorsiflexing torque ε all the time: I θ̈ + c θ̇ + k θ = ε beside the walk.

    k is the slope of tissue, weight and the moment of the driven shank's acceleration. The equation is
    integrated by itself, in quarters of a step, with straight toes (1.4 % of θ). Were the muscles to hold the
    recorded angle, or a reflex to brake, θ would be smaller. On the floor the pads hold the foot, too.
    """
    added, small, sets = 0.005, 1e-4, own | {"ground.mode": "recorded", "gait.settled": "walked"}
    built = build("walk-dropfoot", sets)
    foot, tissue = built.foot, own_tissue(built.scenario)
    push = {"load_moment": f"{-added} N*m"}  # stands against positive angles
    plain, moved = (afo_sim.run("walk-dropfoot", sets | load) for load in ({}, push))
    angle = plain["ankle/angle"]
    n, pitch = len(angle), angle - plain["shank/angle"]
    driven, knee = built.walk.acceleration[:n], built.walk.knee[1 : 1 + n]
    below, above = (
        passive_moments(angle + by, knee, tissue.scale, tissue.offset)
        + foot.gravity_moment(pitch + by)
        + foot.frame_moment(pitch + by, driven[:, :2], driven[:, 2])
        for by in (-small, small)
    )
    expected, part, theta, speed = [], 0.25e-3, 0.0, 0.0
    for stiffness in (below - above) / (2.0 * small):
        expected.append(theta)
        for _ in range(4):
            speed += part * (added - tissue.damping * speed - stiffness * theta) / foot.inertia
            theta += part * speed
    gained = moved["ankle/angle"] - angle
    assert np.degrees(gained.max()) > 0.05
    assert gained[1000:] == pytest.approx(np.array(expected)[1000:], rel=0.02)
    walked = own | {"gait.settled": "walked"}
    first, second = (afo_sim.run("walk-dropfoot", walked | load)["ankle/angle"] for load in ({}, push))
    stance = (plain["time"] > 1.0) & (plain["gait/phase"] > 0.1) & (plain["gait/phase"] < 0.5)
    assert (second - first)[stance].max() < 0.5 * gained[stance].max()


@pytest.mark.slow
@pytest.mark.parametrize("key", ["dorsiflexor_strength", "plantarflexor_strength", "stiffness", "spasticity"])
def test_nothing_is_weakened_a_second_time(own: dict[str, object], key: str) -> None:
    """What a description says of the muscles changes nothing, on either ground, and a warning says so."""
    values = {"spasticity": "3 N*m*s/rad"}
    for mode in ("recorded", "contact"):
        sets = own | {"patient": "healthy", "ground.mode": mode, "duration": "2.4 s"}
        plain = afo_sim.run("walk-dropfoot-afo", sets)
        other = afo_sim.run("walk-dropfoot-afo", sets | {f"patient.{key}": values.get(key, 0.2)})
        assert np.array_equal(plain["ankle/angle"], other["ankle/angle"])
        for run in (plain, other):  # whose patient was set, too
            assert with_code(of_walker(run.described), "own-walk")
            told = with_code(run.warnings, "strength-not-applied")
            assert f"patient.{key}" in [notice.subject for notice in told]


@pytest.mark.slow
def test_the_reference_of_an_own_walk_is_walked_on_its_floor(own: dict[str, object]) -> None:
    """It is the recorded walk itself, as a described patient's is that of her weakened foot on her floor."""
    run = afo_sim.run("walk-dropfoot-afo", own | {"reference": "barefoot"})
    recorded = afo_sim.run("walk-dropfoot", own)
    lift = run.metrics["toe_clearance"].value - recorded.metrics["toe_clearance"].value
    assert run.metrics["lift_over_reference"].value == pytest.approx(lift, abs=1e-6)
    assert recorded.metrics["toe_clearance_to_recorded"].value == pytest.approx(0.0, abs=0.1)
    weak = afo_sim.run("walk-dropfoot-afo", SETS | {"reference": "barefoot"})
    alone = afo_sim.run("walk-dropfoot", SETS)
    lift = weak.metrics["toe_clearance"].value - alone.metrics["toe_clearance"].value
    assert weak.metrics["lift_over_reference"].value == pytest.approx(lift, abs=1e-6)


def test_who_does_not_say_whose_walk_it_is_is_refused(own: dict[str, object], tmp_path: pathlib.Path) -> None:
    """With both ways out, in every path; the scenario's key counts before the file's."""
    file = tmp_path / "silent.csv"
    write(file, dataclasses.replace(drop_foot(), walker=None))
    silent = own | {"gait.cycle": str(file)}
    for go in (
        lambda: afo_sim.run("walk-dropfoot", silent),
        lambda: afo_sim.both("walk-dropfoot-afo", sets=silent),
        lambda: afo_sim.sweep("walk-dropfoot", {"gait.ankle_offset": ["0 deg", "1 deg"]}, silent),
    ):
        with pytest.raises(InputError, match=r"whose walk.*# walker: .*gait\.walker"):
            go()
    said = afo_sim.run("walk-dropfoot", silent | {"gait.walker": "patient"})
    assert np.array_equal(said["ankle/angle"], afo_sim.run("walk-dropfoot", own)["ankle/angle"])
    assert said.scenario["gait"]["walker"] == "patient" and said.scenario["ground"]["mode"] == "contact"


@pytest.mark.parametrize("word", ["patients", ""])
def test_a_file_that_names_no_walker_is_refused(word: str, tmp_path: pathlib.Path) -> None:
    text = assets.find_gait("opensim_walk").read_text(encoding="utf-8")
    (tmp_path / "odd.csv").write_text(text.replace("walker: healthy", f"walker: {word}"), encoding="utf-8")
    with pytest.raises(InputError, match=r"walker.*healthy, patient"):
        gait.read(tmp_path / "odd.csv")


def test_a_family_of_two_walkers_says_nothing(tmp_path: pathlib.Path) -> None:
    for name, walker in (("bovi2011_s", "healthy"), ("bovi2011_m", "patient")):
        cycle = dataclasses.replace(gait.read(assets.find_gait(name)), walker=walker)
        write(tmp_path / f"{name}.csv", cycle)
    assert at_speed(tmp_path / "bovi2011_s.csv", 1.3).walker is None


@pytest.mark.parametrize(
    ("walker", "lower", "code"),
    [
        ("healthy", 15.0, "walker-not-usual"),
        ("healthy", 0.0, ""),
        ("patient", 15.0, ""),
        ("patient", 0.0, "trial-looks-healthy"),
        (None, 15.0, ""),
    ],
)
def test_a_walker_who_does_not_look_so_is_doubted(walker: str | None, lower: float, code: str) -> None:
    """A mean adult whose ankle hangs by 15° in swing is no healthy one; one within the norm no patient's."""
    cycle = gait.read(assets.find_gait("bovi2011_natural"))
    angle = cycle.ankle_angle - np.radians(lower) * (cycle.phase > stance(cycle))
    doubted = walker_doubts(dataclasses.replace(cycle, ankle_angle=angle, walker=walker))
    assert [each.code for each in doubted] == [code] * bool(code)


@pytest.mark.parametrize(
    ("said", "doubted"),
    [("doubted: force's clock; passed: plates alike", True), ("passed: plates alike", False)],
)
def test_a_doubted_trial_leaves_no_good_answer_on_its_moment(
    said: str, doubted: bool, tmp_path: pathlib.Path
) -> None:
    cycle = gait.read(assets.find_gait("opensim_walk"))
    write(tmp_path / "walk.csv", dataclasses.replace(cycle, notes={**cycle.notes, "quality": said}))
    built = build("walk-dropfoot-afo", {**SETS, "gait.cycle": str(tmp_path / "walk.csv")})
    warned = with_code(built.warnings, "trial-doubted")
    assert [notice.data["faults"] for notice in warned] == ["force's clock"] * doubted
    (moves,) = capped([Answer("push_off", "", "good", "", "")], warned)
    assert moves.status == ("doubtful" if doubted else "good")


@pytest.mark.parametrize("walk", ["gatk_stride1", "opensim_walk", "bovi2011_natural"])
def test_a_healthy_walk_said_to_be_a_patients_is_not_helped(walk: str) -> None:
    """Whatever file says so, no answer on its swing is good, nor says that it helps; push-off's may be."""
    sets: dict[str, object] = {**SETS, "gait.cycle": walk, "gait.walker": "patient"}
    (doubt,) = with_code(build("walk-dropfoot-afo", sets).warnings, "trial-looks-healthy")
    good = [Answer(name, "", "good", f"toe passes: {ENOUGH}.", "") for name in ("help", "lift", "push_off")]
    helps, lifts, hinders = capped(good, [doubt])
    assert (helps.status, lifts.status, hinders.status) == ("doubtful", "doubtful", "good")
    assert ENOUGH not in helps.text
    assert not with_code(
        build("walk-dropfoot", sets).warnings, "trial-looks-healthy"
    )  # nothing is worn there


@pytest.mark.parametrize("drop", [8.0, 15.0])
def test_a_patients_walk_is_not_taken_for_a_healthy_one(drop: float, tmp_path: pathlib.Path) -> None:
    for walk in ("gatk_stride1", "opensim_walk", "bovi2011_natural"):
        cycle = gait.read(assets.find_gait(walk))
        share = np.clip((cycle.phase - stance(cycle)) / (1.0 - stance(cycle)), 0.0, 1.0)
        angle = cycle.ankle_angle - np.radians(drop) * np.sin(np.pi * share)
        write(tmp_path / "own.csv", dataclasses.replace(cycle, ankle_angle=angle, walker="patient"))
        warned = build("walk-dropfoot-afo", {**SETS, "gait.cycle": str(tmp_path / "own.csv")}).warnings
        assert not with_code(warned, "trial-looks-healthy"), walk


@pytest.mark.parametrize(("walker", "idle"), [("patient", True), ("healthy", False)])
def test_a_strength_that_is_not_applied_is_told_as_a_warning_and_in_the_report(
    walker: str, idle: bool, own: dict[str, object]
) -> None:
    """Whoever sets it believes it simulated; what a preset says of strength is nobody's wish."""
    sets = own | {"gait.walker": walker, "patient.dorsiflexor_strength": 0.3, "patient.body_mass": "72 kg"}
    built = build("walk-dropfoot-afo", sets)
    told = with_code(built.warnings, "strength-not-applied")
    assert [each.subject for each in told] == ["patient.dorsiflexor_strength"] * idle
    assert all(map(decides, told))  # however short the terminal is
    changed = in_words(with_person(built.scenario).resolved())[1]
    assert [each.endswith("(not applied)") for each in changed if "strength" in each] == [idle]
    assert not any("not applied" in each for each in changed if "strength" not in each)
    assert not with_code(build("walk-dropfoot-afo", own).warnings, "strength-not-applied")


def test_a_strength_written_by_hand_that_an_own_walk_leaves_out_is_warned_of(own: dict[str, object]) -> None:
    """A patient in the scenario's own file is somebody's wish, as healthy people are nobody's."""
    weak = load("scenario", "walk-dropfoot-afo", own).with_values(
        patient={"name": "mine", "dorsiflexor_strength": 0.1, "plantarflexor_strength": 1.0}
    )
    told = with_code(build(weak).warnings, "strength-not-applied")
    assert [each.subject for each in told] == ["patient.dorsiflexor_strength"]
