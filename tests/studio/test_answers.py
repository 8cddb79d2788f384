"""What a page shows of a design: its figure, its numbers and the reasons of its controls."""

import dataclasses
import json
import math

import numpy as np
import pytest
from installed import needs

import afo_sim as afo
from afo_sim.common import InputError, JsonDict, assets
from afo_sim.metrics.strides import strides
from afo_sim.model import person_of
from afo_sim.studio import Design, controls, opened
from afo_sim.studio.answers import FRAMES, PHASES, Answers, Settled, _rounded
from afo_sim.studio.controls import idle, values

pytestmark = needs("uvicorn", "websockets")
WALK = "walk-dropfoot-afo"
CONTROLLED = {
    "phases": None,
    "controller": {
        "rate": "100 Hz",
        "pid": {
            "raises": "dorsiflexor",
            "lowers": "plantarflexor",
            "angle": {"proportional_band": "1 deg", "reference": {"table": [["0 s", "0 deg"]]}},
        },
    },
}
VARIED = {"gait.variability": 0.03, "duration": "4 s"}


def silent(done: int, total: int, what: str = "") -> None:
    """Of how far a run is."""


@pytest.fixture(scope="module")
def settled() -> Settled:
    return Settled.of(Design(WALK).scenario)


def test_the_figure_is_rigid_and_its_joints_have_the_angles_of_the_curves(settled: Settled) -> None:
    told = settled.message()
    poses = {name: np.array(points) for name, points in told["poses"].items() if name != "muscles"}
    assert len(FRAMES) == len(poses["ankle"]) == len(told["poses"]["muscles"][0])
    shank, foot = poses["knee"] - poses["ankle"], poses["sole"][:, 1] - poses["sole"][:, 0]
    assert np.linalg.norm(shank, axis=1) == pytest.approx(
        0.246 * person_of(settled.scenario).body_height, abs=2e-4
    )
    assert np.ptp(np.linalg.norm(foot, axis=1)) < 4e-4
    lean, pitch = np.arctan2(shank[:, 0], shank[:, 1]), np.arctan2(foot[:, 1], foot[:, 0])
    ankle = np.radians(np.interp(FRAMES, PHASES, told["curves"]["ankle"]))
    assert np.ptp(pitch + lean - ankle) < 3e-3  # the ankle's angle less the shank's lean
    assert np.ptp(ankle) > 0.1 and np.ptp(lean) > 0.5
    flat = np.abs(pitch) < 0.02
    assert flat.any() and np.abs(poses["sole"][flat][:, :2, 1]).min() < 5e-3  # it stands on the floor
    assert poses["sole"][..., 1].min() > -0.02


def test_a_clearance_that_is_not_known_is_none_and_no_sentence_of_it(settled: Settled) -> None:
    known = settled.message()
    assert known["clearance"] == settled.clearance and known["lowest"] != "not known"
    unknown = dataclasses.replace(settled, clearance=math.nan).message()
    assert (unknown["clearance"], unknown["lowest"]) == (None, "not known")
    assert unknown["curves"] == known["curves"]


def test_numbers_of_a_page_are_rounded_finite_and_never_minus_nothing() -> None:
    told = json.dumps(_rounded([np.array([-1e-9, 1.23456, np.nan, -np.inf]), [np.array([-2.0004])]]))
    assert json.loads(told) == [[0.0, 1.235, 0.0, 0.0], [[-2.0]]]
    assert "-0" not in told


@pytest.fixture(scope="module")
def varied(tmp_path_factory: pytest.TempPathFactory) -> tuple[Answers, Design, list[JsonDict]]:
    """Strides that do not repeat, and the answers of their whole run."""
    answers, design = Answers(tmp_path_factory.mktemp("session")), Design(WALK, VARIED)
    return answers, design, list(answers.run(design, silent))


def test_of_strides_that_do_not_repeat_the_last_one_is_shown(
    varied: tuple[Answers, Design, list[JsonDict]],
) -> None:
    answers, design, (walked, run) = varied
    assert answers.settled(design)["kind"] == "unsettled"
    found = answers._recording(design, silent)
    step = float(np.diff(found["time"][:2])[0])
    *_, last = strides(found.columns, step, person_of(found.scenario).body_mass)
    assert walked["stride_time"] == last.duration and walked["toe_off"] == last.toe_off
    angle = np.degrees(last.at("ankle/angle", PHASES))
    assert walked["curves"]["ankle"] == pytest.approx(angle, abs=1e-3)
    rows = {label: (value, status) for label, value, status in run["results"]}
    assert rows["Toe clearance"] == (str(found.metrics["toe_clearance"]), "")
    for answer in found.verdict:  # the metrics first, then every question with its mark
        assert rows[answer.question][1] == answer.status


def test_the_report_and_what_to_change_are_of_the_run_that_is_shown(
    varied: tuple[Answers, Design, list[JsonDict]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a study there is nothing that would help; the report stands where the page looks for it."""
    answers, design, _ = varied
    asked: list[JsonDict] = []
    reported = {}
    monkeypatch.setattr(
        "afo_sim.studio.answers.with_studies", lambda run, *_, **more: asked.append(more) or run
    )
    monkeypatch.setattr(
        "afo_sim.studio.answers.write_report", lambda runs, file: reported.update({file: runs})
    )
    assert answers.effects(design, silent)["steps"] == []
    (told,) = answers.further(design, "report", {}, silent)
    assert asked == [{"effects": True, "report": silent}] * 2
    assert reported == {answers.folder / told["file"]: [answers.folder / "run"]}
    kept, shown = afo.read_recording(answers.folder / "run"), answers._recording(design, silent)
    np.testing.assert_array_equal(kept["ankle/angle"], shown["ankle/angle"])


def test_only_a_chamber_that_nothing_fills_has_idle_valves() -> None:
    """A timer or gait phases that leave a chamber out; a controller may fill any."""
    seen = set()
    walks = [Design(name) for name in assets.names("scenario") if name.startswith("walk-")]
    for design in (*walks, Design(WALK, CONTROLLED)):
        scenario, reasons = design.scenario, idle(design)
        switched = scenario.timer or scenario.phases
        begun = scenario.start.chambers if scenario.start else {}
        for name in scenario.orthosis.chamber:
            times = switched.chambers.get(name) if switched else None
            filled = not switched or name in begun or bool(times and times.inlet)
            opened_too = not switched or bool(times and times.outlet)
            valve = f"orthosis.chamber.{name}"
            assert (f"{valve}.inlet" in reasons) is not filled, (design, name)
            assert (f"{valve}.outlet" in reasons) is not (filled and opened_too), (design, name)
            seen.add((bool(switched), filled, opened_too))
        assert ("timing" in reasons) is not bool(scenario.orthosis.chamber and switched)
    assert {taken for taken, *_ in seen} == {True, False}


def test_keys_are_called_as_their_controls_and_else_by_themselves() -> None:
    design = opened(WALK).design
    told = values(design.changed({"supply.pressure": "3 bar"}))
    assert told["supply.pressure"][1:] == ("3 bar", True)
    labels = {control["key"]: control["label"] for control in controls(design)}
    assert {key: told[key][0] for key in labels} == labels
    place = "orthosis.muscle.dorsiflexor.insertion.from_joint"
    assert [told[f"{place}[{k}]"][0].rpartition(", ")[2] for k in range(3)] == ["forward", "sideways", "up"]
    assert told["duration"][0] == "duration" and told["duration"][2] is False
    assert all(label for label, *_ in told.values())


def test_variants_have_slots_names_and_an_end() -> None:
    document = opened(WALK)
    start = document.design
    for pressure in (3.0, 3.1, 3.2):
        document.change({"supply.pressure": f"{pressure} bar"})
        document.keep()
    assert {slot: kept.name for slot, kept in document.variants.items()} == {"A": "A", "B": "B", "C": "C"}
    with pytest.raises(InputError) as full:
        document.keep()
    assert full.value.field == "variant"
    document.rename("B", "low")
    document.rename("B", "B")  # its own letter is free, another slot's is not, kept or not
    document.remove("C")
    for taken in ("A", "C"):
        with pytest.raises(InputError) as refused:
            document.rename("B", taken)
        assert refused.value.field == "name"
    with pytest.raises(InputError):
        document.show("C")
    document.keep()
    assert [*document.variants] == ["A", "B", "C"]
    document.show("A")
    assert document.design.scenario.supply.pressure == pytest.approx(3.0e5)
    assert document.steps == (4, 0)
    document.show("A")  # the very same design is no step
    assert document.steps == (4, 0)
    for _ in range(6):
        document.undo()
    assert document.design == start and document.steps == (0, 4)
    document.redo()
    document.change({"supply.pressure": "2 bar"}, join=True)  # one step back with the one before
    assert document.steps == (1, 0)
    document.undo()
    assert document.design == start
