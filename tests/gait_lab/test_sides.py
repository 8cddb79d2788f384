"""Each side of one trial: the strides that the sides alone give, and what differs between them."""

import dataclasses
import pathlib

import numpy as np
import pytest
from gait_lab.known_walker import SOLE
from gait_lab.patients import LameWalker, laboratory
from gait_lab.trial_files import write_forces, write_trial

from afo_sim.common import InputError
from afo_sim.gait import TwoSides, asymmetry
from afo_sim.gait_lab import Choices, import_gait, import_sides
from afo_sim.gait_lab.trial import importing

SET = "opensim c3d"
LAME = LameWalker(right_load=0.9, seed=None)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[pathlib.Path]:
    return write_trial(tmp_path_factory.mktemp("lame"), laboratory(LAME), SET)


def test_each_side_is_the_stride_of_its_side_alone(
    files: list[pathlib.Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = {side: import_gait(files, Choices(side=side)).cycle for side in ("right", "left")}
    read: list[object] = []
    own = importing.read_trial
    monkeypatch.setattr(importing, "read_trial", lambda each: (read.append(each), own(each))[1])
    sides = import_sides(files, Choices(each=True))
    assert len(read) == 1 and list(sides) == ["right", "left"]
    for side, done in sides.items():
        cycle = dataclasses.asdict(dataclasses.replace(done.cycle, notes={}))
        for name, value in dataclasses.asdict(dataclasses.replace(alone[side], notes={})).items():
            np.testing.assert_array_equal(cycle[name], value, name)
        assert dict(done.cycle.notes) | alone[side].notes == dict(done.cycle.notes)


def test_what_differs_is_what_the_walker_does(files: list[pathlib.Path]) -> None:
    """Times, moments, angle and toe of the walker himself, at 2,000 phases of a stride; filtered by 10 Hz."""
    sides = import_sides(files, Choices(each=True))
    found = {row.name: row for row in asymmetry(sides["right"].cycle, sides["left"].cycle)}
    reach = max(np.nanmax(done.cycle.cop_x) for done in sides.values())
    phase, period = np.linspace(0.0, 1.0, 2001), LAME.stride_time
    strikes = {"right": 1.0 - LAME.left_strike, "left": LAME.left_strike}
    for side, step in strikes.items():
        time = LAME.start + (phase + (LAME.left_strike if side == "left" else 0.0)) * period
        force, _ = LAME.force(side, time)
        share = phase[(force[:, 1] > 0.05 * LAME.mass * 9.81) & (phase < 0.9)][-1]
        moment, swing = LAME.moment(side, time, foot=False)[phase < share] / LAME.mass, phase > share
        foot, ankle = LAME.segments(time)[f"foot_{side[0]}"]
        middle = np.argmin(np.abs(phase - 0.5 * (1.0 + share)))
        toe = (ankle + foot @ [reach / np.cos(LAME.toe_out), -SOLE, 0.0])[:, 1]
        speed = LAME.ankle_plane(side, time, 1)[:, 0]
        fast = swing & (phase < 0.9) & (speed >= np.quantile(speed, 0.75))
        truth = {
            "stance": (100.0 * share, 1.0),
            "step time": (step * period, 0.01),
            "swing time": ((1.0 - share) * period, 0.012),
            "peak plantarflexor moment": (-moment.min(), 0.03),
            "dorsiflexion in mid-swing": (np.degrees(LAME.angle(side, "ankle", time))[middle], 1.0),
            "lowest toe height in swing": (1e3 * toe[fast].min(), 6.0),
        }
        for name, (value, error) in truth.items():
            assert getattr(found[name], side) == pytest.approx(value, abs=error), (name, side)
    right, left = (-LAME.moment(side, np.arange(0.4, 1.6, 1e-3), foot=False).min() for side in strikes)
    index = 2.0 * (left - right) / (left + right)
    assert index > 0.03
    assert found["peak plantarflexor moment"].index == pytest.approx(index, abs=0.02)
    assert found["step time"].index == pytest.approx(2.0 * (0.45 - 0.55), abs=0.02)


@pytest.mark.parametrize("right, left, index", [(1.0, 3.0, 1.0), (2.0, 2.0, 0.0), (-4.0, -2.0, None)])
def test_index_is_the_difference_over_the_mean(right: float, left: float, index: float | None) -> None:
    assert TwoSides("", "", right, left).index == index


@pytest.mark.parametrize("plate, other", [("r", "left"), ("l", "right")])
def test_a_side_without_a_loaded_stride_is_refused_with_the_side_that_has_one(
    files: list[pathlib.Path], tmp_path: pathlib.Path, plate: str, other: str
) -> None:
    plates = [each for each in laboratory(LAME).plates() if each.name == plate]
    forces = write_forces(tmp_path / "grf.mot", plates)
    have = "right" if other == "left" else "left"
    with pytest.raises(InputError) as refused:
        import_sides([files[0], forces], Choices(each=True))
    assert other in refused.value.problem and f"the {have} side alone" in refused.value.allowed
