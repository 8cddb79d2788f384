"""The whole walker: its segments, its soles, its other leg, and the reference beside it."""

import dataclasses

import numpy as np
import pytest

import afo_sim
from afo_sim.metrics import Metric
from afo_sim.show import RunView
from afo_sim.show.run_view import alone
from afo_sim.show.walking_figure import SHANK, THIGH, TRUNK, Pose, WalkingFigure, reference_view
from afo_sim.simulation import Recording

PHASES = np.linspace(0.0, 0.98, 50)
TALLER = {"patient.body_height": "1.9 m"}


@pytest.fixture(scope="module")
def tall() -> WalkingFigure:
    return WalkingFigure.of(alone(afo_sim.run("walk-dropfoot", {"duration": "3 s"} | TALLER)))


@pytest.fixture(scope="module")
def worn(walks: dict[str, Recording]) -> WalkingFigure:
    return WalkingFigure.of(alone(walks["worn"]))


def poses(figure: WalkingFigure) -> list[Pose]:
    return [figure.pose(float(phase)) for phase in PHASES]


def test_segments_have_their_shares_of_the_patients_height(tall: WalkingFigure) -> None:
    for pose in poses(tall):
        for ends, share in (
            ((pose.ankle, pose.knee), SHANK),
            ((pose.knee, pose.hip), THIGH),
            ((pose.hip, pose.neck), TRUNK),
            ((pose.other_ankle, pose.other_knee), SHANK),
            ((pose.other_knee, pose.hip), THIGH),
        ):
            assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(1.9 * share)


def test_own_sole_is_where_the_recording_has_it_and_the_other_never_below_the_floor(
    worn: WalkingFigure,
) -> None:
    for phase, pose in zip(PHASES, poses(worn), strict=True):
        heights = [float(worn.stride.at(f"{name}/height", float(phase))) for name in ("toe", "ball")]
        assert worn.lowest(float(phase)) == min(heights)
        assert pose.sole[1:, 1].min() == pytest.approx(min(heights), abs=2e-4)  # between two rows
        assert pose.other_sole[:, 1].min() > -1e-9


def test_other_leg_is_half_a_stride_behind(tall: WalkingFigure) -> None:
    """Where it needs no bend of the knee, its thigh and shank have the own leg's directions."""
    compared = 0
    for phase in PHASES[:25]:
        own, other = tall.pose(float(phase)), tall.pose(float(phase) + 0.5)
        if other.other_sole[:, 1].min() > 1e-6:
            compared += 1
            assert own.knee - own.hip == pytest.approx(other.other_knee - other.hip, abs=2e-3)
            assert own.ankle - own.hip == pytest.approx(other.other_ankle - other.hip, abs=2e-3)
    assert compared > 3


def test_reference_walks_as_a_run_of_its_own(walks: dict[str, Recording]) -> None:
    view = reference_view(walks["worn"], "without", "k")
    assert view is not None
    assert view.label == "without"
    alike = {"shoe": "trainer", "gait.settled": "solved", "duration": "4 s"}
    separate = WalkingFigure.of(RunView("", "k", afo_sim.run("walk-dropfoot", alike)))
    for one, other in zip(poses(WalkingFigure.of(view)), poses(separate), strict=True):
        assert one.sole - one.hip == pytest.approx(other.sole - other.hip, abs=1e-4)


def test_reference_that_walks_otherwise_is_not_shown(walks: dict[str, Recording]) -> None:
    run = walks["worn"]
    before = run.metrics["reference_toe_clearance"]
    for apart, shown in ((0.05, True), (0.2, False)):  # [mm]
        changed = {"reference_toe_clearance": Metric(before.value + apart, before.unit)}
        other = dataclasses.replace(run, metrics={**run.metrics, **changed})
        assert (reference_view(other, "", "k") is not None) is shown
    assert reference_view(walks["bare"], "", "k") is None
