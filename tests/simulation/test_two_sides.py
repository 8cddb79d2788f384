"""The affected side in the device, the other side as recorded: runs, pace, asymmetry, report."""

import dataclasses
import json
import pathlib
from typing import Any

import numpy as np
import pytest
from command import call
from gait_lab.patients import LameWalker, laboratory
from gait_lab.trial_files import write_forces, write_trc

import afo_sim as afo
from afo_sim.common import Notice, with_code
from afo_sim.gait import asymmetry, file
from afo_sim.gait_lab import Choices, import_sides
from afo_sim.simulation import Both, described
from afo_sim.simulation.bilateral import copied

WALK = "walk-dropfoot-afo"


@pytest.fixture(scope="module")
def sides(tmp_path_factory: pytest.TempPathFactory) -> dict[str, pathlib.Path]:
    """Strides of both sides of one walk of a patient whose right foot drops."""
    folder, recorded = tmp_path_factory.mktemp("lame"), laboratory(LameWalker(right_load=0.9, seed=None))
    markers = write_trc(folder / "walk.trc", recorded.time, recorded.markers("opensim c3d"))
    forces = write_forces(folder / "grf.mot", recorded.plates())
    found = {}
    for side, done in import_sides([markers, forces], Choices(each=True, walker="patient")).items():
        file.write(found.setdefault(side, folder / f"her_{side}.csv"), done.cycle)
    return found


def given(sides: dict[str, pathlib.Path], affected: str) -> dict[str, Any]:
    return {
        "sets": {"gait.cycle": str(sides["right"])},
        "left_sets": {"gait.cycle": str(sides["left"])},
        "affected": affected,
    }


@pytest.fixture(scope="module")
def legs(sides: dict[str, pathlib.Path]) -> Both:
    return afo.both(WALK, **given(sides, "right"))


@pytest.mark.slow
def test_the_affected_side_runs_as_alone_and_the_other_one_as_recorded(
    legs: Both, sides: dict[str, pathlib.Path]
) -> None:
    alone = afo.run(WALK, {"gait.cycle": str(sides["right"]), "side": "right"})
    for name, values in alone.columns.items():
        np.testing.assert_array_equal(legs.right[name], values, name)
    last = legs.left["gait/stride"] == legs.left["gait/stride"][-2]
    off = (legs.left["ankle/angle"] - legs.left["gait/ankle_angle"])[last]
    assert np.degrees(np.abs(off).max()) < 0.5
    assert legs.left.scenario["orthosis"]["name"] == "none"
    assert [w.code for w in legs.warnings] == ["ankle-low-in-swing"]  # the constructed drop foot
    assert {worse.leg for worse in legs.verdict} == {"right"}


def test_what_differs_before_is_the_recordings_own_and_with_the_device_the_runs(
    legs: Both, sides: dict[str, pathlib.Path]
) -> None:
    """At the middle of the swing the device run's ankle itself is read, less the sole's drop."""
    before, after = ({row.name: row for row in rows} for rows in legs.asymmetry.values())
    own = {side: file.read(path) for side, path in sides.items()}
    for row in asymmetry(**own):
        assert dataclasses.astuple(before[row.name]) == pytest.approx(dataclasses.astuple(row))
    middle = 0.5 + 0.5 * after["stance"].right / 100.0
    recorded, walked = (legs.over_stride("right", name) for name in ("gait/ankle_angle", "ankle/angle"))
    angle = np.interp(middle, own["right"].phase, own["right"].ankle_angle)
    angle += np.interp(middle, legs.phase, walked - recorded)
    found = after["dorsiflexion in mid-swing"]
    assert found.right == pytest.approx(np.degrees(angle), abs=0.05)
    assert found.right > before[found.name].right + 10.0
    assert found.left == pytest.approx(before[found.name].left, abs=0.5)


@pytest.mark.parametrize("affected, other", [("right", "left"), ("left", "right")])
def test_two_paces_become_that_of_the_affected_side(
    sides: dict[str, pathlib.Path], tmp_path: pathlib.Path, affected: str, other: str
) -> None:
    own, cycle = (file.read(sides[side]) for side in (affected, other))
    for slower, walks in ((1.02, True), (1.08, False)):
        speed = cycle.walking_speed / slower
        changed = dataclasses.replace(cycle, stride_time=slower * own.stride_time, walking_speed=speed)
        file.write(tmp_path / "slow.csv", changed)
        chosen = given(sides | {other: tmp_path / "slow.csv"}, affected)
        right, left = described(WALK, None, **chosen)
        assert (bool(right.orthosis.chamber), bool(left.orthosis.chamber))[affected == "left"]
        times = {"right": right.gait.stride_time, "left": left.gait.stride_time}
        assert times == {affected: None, other: pytest.approx(own.stride_time, rel=1e-6) if walks else None}
    with pytest.raises(afo.InputError, match="stride of the left leg is"):
        afo.both(WALK, **chosen)


@pytest.mark.slow
def test_paces_are_noted_and_exchanged_sides_warned_of(sides: dict[str, pathlib.Path], legs: Both) -> None:
    (note,) = with_code([each for each in legs.notes if isinstance(each, Notice)], "leg-paced")
    assert note.subject == "left" and note.data["walked"] == pytest.approx(legs.cycle)
    found = afo.both(WALK, **given({"right": sides["left"], "left": sides["right"]}, "left"))
    assert with_code([each for each in found.warnings if isinstance(each, Notice)], "legs-exchanged")


def test_one_recording_for_both_sides_of_a_patient_is_warned_of(sides: dict[str, pathlib.Path]) -> None:
    one = dict.fromkeys(sides, sides["right"])
    for recorded, others in ((one, ["left"]), (sides, [])):
        pair = described(WALK, None, **given(recorded, "right"))
        assert [warning.subject for warning in copied(pair, "right")] == others


@pytest.mark.parametrize(
    "scenario, side, says", [(WALK, "rigth", "did you mean"), ("seated", "left", "sits")]
)
def test_what_is_no_side_of_a_walk_is_refused(scenario: str, side: Any, says: str) -> None:
    with pytest.raises(afo.InputError, match=says):
        afo.both(scenario, affected=side)


@pytest.mark.slow
def test_one_command_and_one_report(
    sides: dict[str, pathlib.Path], tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "both"
    cycles = (f"gait.cycle={sides['right']}", f"gait.cycle={sides['left']}")
    command = ("both", WALK, "--affected", "right", "--set", cycles[0], "--left-set", cycles[1], "--no-rrd")
    for _ in range(2):  # the same legs are written again
        code, printed, complaint = call(capsys, *command, "--out", str(out), "--numbers")
        assert code == 0, complaint
    assert "affected side: right" in printed and printed.count("dorsiflexion in mid-swing") == 2
    code, printed, complaint = call(capsys, "report", str(out))
    assert code == 0, complaint
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "<h1>Affected side (right) and other side (left)</h1>" in page
    told = json.loads((out / "both.json").read_text(encoding="utf-8"))
    assert page.count('class="verdict-answer') == len(told["verdict"])  # of the affected side alone
    for rows in told["asymmetry"].values():
        assert all(f'<td class="number">{row["right"]:.3g}</td>' in page for row in rows)
