"""Multi-body inverse kinematics: known coordinates come back; OpenSim's own, where the recordings are."""

import pathlib

import numpy as np
import pytest
from osim_text import LAYOUTS, version_4, walker, write
from real_trials import MOCO, SUBJECT01, where_recorded

from afo_sim.gait_lab import Choices, Markers
from afo_sim.gait_lab.readers.opensim_joint import Pose
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel, read_opensim_model
from afo_sim.gait_lab.readers.opensim_table import read_opensim_table
from afo_sim.gait_lab.readers.trc import read_trc
from afo_sim.gait_lab.trial.inverse_kinematics import Posed, pose_over, skeleton_of
from afo_sim.gait_lab.trial.model_legs import legs_from_model_markers

TIME = np.linspace(0.0, 1.0, 41)
ENDS = ("toes_r", "toes_l")
LAST = 1e-5  # the search ends with a step below this [rad] or [m]


def walk() -> dict[str, np.ndarray]:
    """Coordinates of both legs [rad]; the sides differ."""
    phase, found = 2.0 * np.pi * TIME, {}
    for side, shift in (("r", 0.0), ("l", np.pi)):
        found[f"hip_flexion_{side}"] = 0.5 * np.cos(phase + shift)
        found[f"knee_angle_{side}"] = -0.6 + 0.5 * np.cos(phase + shift + 1.0)
        found[f"ankle_angle_{side}"] = 0.2 * np.sin(phase + shift)
        found[f"mtp_angle_{side}"] = 0.3 * np.sin(phase + shift + 0.5)
    return found


def pelvis() -> Pose:
    """A pelvis that walks backwards along y of a laboratory whose z is up, and turns about all axes."""
    from scipy.spatial.transform import Rotation

    turns = np.column_stack([0.1 * np.sin(6.0 * TIME), 0.2 * np.cos(6.0 * TIME), -1.6 + 0.1 * TIME])
    upright = Rotation.from_euler("x", np.pi / 2.0)
    places = np.column_stack([0.1 * TIME, -1.3 * TIME, 0.95 + 0.02 * np.sin(12.0 * TIME)])
    return Pose((Rotation.from_euler("xyz", turns) * upright).as_matrix(), places)


def model(tmp_path, layout=version_4, change=("", "")) -> OpenSimModel:
    return read_opensim_model(write(tmp_path / "walker.osim", layout(*walker()).replace(*change)))


def seen_markers(made: OpenSimModel) -> dict[str, np.ndarray]:
    """Where the markers are in the walk; other tests check the forward kinematics against OpenSim's."""
    places, values = pelvis(), walk()
    return {
        name: (places @ made.pose("pelvis", body, values)).point(place)
        for name, (body, place) in made.markers.items()
    }


def posed_over(made: OpenSimModel, seen: dict[str, np.ndarray]) -> Posed:
    return pose_over(skeleton_of(made, "pelvis", ENDS, list(seen)), seen, pelvis())


def coordinates(posed: Posed) -> dict[str, np.ndarray]:
    return {name: posed.q[:, k] for k, (name, _) in enumerate(posed.skeleton.free)}


def noisy(seen: dict[str, np.ndarray], size: float) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(5)
    return {name: path + size * rng.standard_normal(path.shape) for name, path in seen.items()}


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_known_coordinates_come_back(tmp_path, layout):
    made = model(tmp_path, layout)
    posed = posed_over(made, seen_markers(made))
    found, expected = coordinates(posed), walk()
    assert set(found) == set(expected)
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, atol=LAST, err_msg=name)
    np.testing.assert_allclose(posed.bodies["pelvis"].rotation, pelvis().rotation, atol=LAST)


def test_noise_moves_the_coordinates_as_far_as_theory_says(tmp_path):
    """Of N values with U unknowns, (N − U)/N of the squared noise is left; the ankle moves by its dilution.

    41 frames tell a root mean square to 1/√82 = 11 %, the residual of 63 values each to 1.7 %.
    """
    made, size = model(tmp_path), 0.004
    seen = seen_markers(made)
    posed = posed_over(made, noisy(seen, size))
    count, unknowns = 3 * len(seen), 6 + len(walk())
    assert posed.cost.mean() == pytest.approx(size**2 * (count - unknowns), rel=0.1)
    assert posed.error == pytest.approx(size, rel=0.05)
    truth = (pelvis() @ made.pose("pelvis", "tibia_r", walk())).point(np.array([0.0, -0.41, 0.0]))
    off = posed.bodies["tibia_r"].point(np.array([0.0, -0.41, 0.0])) - truth
    expected = size * posed.dilution("tibia_r", np.array([0.0, -0.41, 0.0])).mean()
    assert np.sqrt(2.0 / 3.0 * np.mean(np.sum(off**2, axis=1))) == pytest.approx(expected, rel=0.3)


@pytest.mark.slow
def test_the_search_ends_where_another_minimiser_does(tmp_path):
    """scipy's least squares over one frame, from the truth."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    made = model(tmp_path)
    seen = noisy(seen_markers(made), 0.01)
    posed = posed_over(made, seen)
    names, start = list(walk()), pelvis()

    def missed(x: np.ndarray) -> np.ndarray:
        root = Pose(
            Rotation.from_rotvec(x[3:6]).as_matrix() @ start.rotation[7:8], start.position[7:8] + x[:3]
        )
        values = {name: x[6 + k : 7 + k] for k, name in enumerate(names)}
        return np.concatenate(
            [
                (root @ made.pose("pelvis", body, values)).point(place)[0] - seen[name][7]
                for name, (body, place) in made.markers.items()
            ]
        )

    x = np.r_[np.zeros(6), [walk()[name][7] for name in names]]
    best = least_squares(missed, x, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert posed.cost[7] == pytest.approx(2.0 * best.cost, rel=1e-9)
    np.testing.assert_allclose([coordinates(posed)[name][7] for name in names], best.x[6:], atol=LAST)


def test_a_lost_marker_drops_out_of_its_frames(tmp_path):
    made = model(tmp_path)
    seen = seen_markers(made)
    for name in ("R.ASIS", "V.Sacral", "R.Shank.Upper", "R.Ankle.Lat", "L.Heel"):
        seen[name][5:20] = np.nan
    found = coordinates(posed_over(made, seen))
    for name, value in walk().items():
        np.testing.assert_allclose(found[name], value, atol=LAST, err_msg=name)


def test_a_frame_that_does_not_show_the_foot_is_a_gap_of_the_foot(tmp_path):
    made = model(tmp_path)
    seen = seen_markers(made)
    for name in ("R.Heel", "R.Midfoot.Lat", "R.Toe.Tip"):
        seen[name][5:8] = np.nan
    for path in seen.values():
        path[30] = np.nan
    leg = legs_from_model_markers(made, Markers(pathlib.Path("w.trc"), TIME, seen), Choices())["right"]
    gaps = {
        role: list(np.flatnonzero(np.isnan(point.path).any(axis=1))) for role, point in leg.points.items()
    }
    assert gaps == {"hip": [30], "knee": [30], "ankle": [30], "heel": [5, 6, 7, 30], "toe": [5, 6, 7, 30]}
    assert np.flatnonzero(np.isnan(leg.pelvis).any(axis=1)) == [30]


def test_a_coordinate_that_nothing_shows_or_that_is_locked_keeps_its_default(tmp_path):
    change = ('<Coordinate name="ankle_angle_l">', '<Coordinate name="ankle_angle_l"><locked>true</locked>')
    made = model(tmp_path, change=change)
    seen = [name for name in made.markers if name != "R.Toe.Tip"]
    free = [name for name, _ in skeleton_of(made, "pelvis", ENDS, seen).free]
    assert set(walk()) - set(free) == {"mtp_angle_r", "ankle_angle_l"}


OVERGROUND = {  # OpenSim 4.6, InverseKinematicsTool, accuracy 1e-7, of moco_3d_walking's markers on pelvis
    # and legs, weight 1 each: {row: coordinates [deg]}
    60: {
        "hip_flexion_r": 3.746,
        "hip_adduction_r": 4.273,
        "hip_rotation_r": -7.111,
        "knee_angle_r": 14.812,
        "ankle_angle_r": 11.517,
        "mtp_angle_r": -6.497,
        "ankle_angle_l": 4.822,
    },
    100: {"hip_flexion_r": -2.422, "knee_angle_r": 51.432, "ankle_angle_r": -10.517, "mtp_angle_r": 16.140},
    140: {"hip_flexion_l": -9.933, "knee_angle_l": 11.296, "ankle_angle_l": 18.762, "mtp_angle_l": -2.182},
    180: {"hip_flexion_l": 26.018, "knee_angle_l": 54.699, "ankle_angle_l": 8.509, "mtp_angle_l": -9.306},
}
TREADMILL = {
    0: 0.00227009,
    24: 0.00105170,
    48: 0.00229647,
    72: 0.00211154,
}  # likewise of subject01's: the sum
# of squared distances that the tool reports in a row [m²]; its search ends up to 1.2 % above the least


@where_recorded
def test_coordinates_are_those_of_opensims_own_inverse_kinematics():
    folder = MOCO
    made = read_opensim_model(folder / "subject_walk_scaled.osim")
    positions = read_trc(folder / "markers_walk.trc").positions
    seen = {name: path for name, path in positions.items() if name in made.markers}
    skeleton = skeleton_of(made, "pelvis", ENDS, list(seen))
    assert len(skeleton.markers) == 29
    rotation = np.tile(np.eye(3), (238, 1, 1))  # the pelvis faces along x here
    found = coordinates(pose_over(skeleton, seen, Pose(rotation, seen["S2"])))
    for row, expected in OVERGROUND.items():
        got = [np.degrees(found[name][row]) for name in expected]
        np.testing.assert_allclose(got, list(expected.values()), atol=0.1)


@where_recorded
def test_the_squared_error_is_at_most_that_of_opensims_own():
    folder = SUBJECT01
    made = read_opensim_model(folder / "subject01.osim")
    columns = read_opensim_table(folder / "subject01_walk1_ik.mot").columns
    seen = {
        name: np.column_stack([columns[f"{name}_t{axis}"] for axis in "xyz"])
        for name in made.markers
        if f"{name}_tx" in columns
    }
    skeleton = skeleton_of(made, "pelvis", ENDS, list(seen))
    posed = pose_over(skeleton, seen, Pose(np.tile(np.eye(3), (73, 1, 1)), seen["V.Sacral"]))
    for row, least in TREADMILL.items():
        assert 0.985 * least < posed.cost[row] <= least
