"""Legs of a model: a plane chain that the test sums up itself, and the shared recordings where they are."""

import pathlib

import numpy as np
import osim_text
import pytest
from real_trials import FOLDER, MOCO, SUBJECT01, where_recorded

from afo_sim.common import InputError, with_code
from afo_sim.gait_lab import Choices, Markers
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel, read_opensim_model
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable, read_opensim_table
from afo_sim.gait_lab.readers.trc import read_trc
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.model_legs import legs_from_angles, legs_from_model_markers

TIME = np.linspace(0.0, 1.0, 41)
RECORDINGS = {  # folder: model, joint angles, whether in degrees
    "moco_3d_walking": ("subject_walk_scaled.osim", "coordinates.sto", False),
    "subject01_walk1": ("subject01.osim", "subject01_walk1_ik.mot", True),
}
OPENSIM = {  # what OpenSim 4.6 itself computes: (folder, row): origins of bodies in ground [m]
    ("moco_3d_walking", 0): {
        "femur_r": (-0.04207, 0.88346, -0.13998),
        "tibia_l": (-0.04208, 0.47057, -0.33605),
        "calcn_r": (0.04799, -0.00402, -0.1869),
        "toes_l": (-0.43594, 0.07626, -0.27806),
    },
    ("moco_3d_walking", 540): {
        "femur_r": (0.63495, 0.85885, -0.18306),
        "tibia_l": (0.80823, 0.51234, -0.32973),
        "calcn_r": (0.16387, 0.19773, -0.19824),
        "toes_l": (0.94183, -0.00506, -0.30617),
    },
    ("subject01_walk1", 0): {
        "femur_r": (0.5342, 0.97417, 0.06498),
        "tibia_l": (0.52471, 0.5148, -0.08178),
        "calcn_r": (0.45138, 0.1719, 0.08425),
        "toes_l": (0.58938, 0.03883, -0.06875),
    },
    ("subject01_walk1", 40): {
        "femur_r": (0.51871, 0.96934, 0.13541),
        "tibia_l": (0.71831, 0.55264, -0.06329),
        "calcn_r": (0.34001, 0.05694, 0.09906),
        "toes_l": (0.74171, 0.06367, -0.07618),
    },
}


def walk() -> dict[str, np.ndarray]:
    """Coordinates in rad and m; the sides differ."""
    phase = 2.0 * np.pi * TIME
    found = {
        "pelvis_tilt": 0.1 * np.sin(phase),
        "pelvis_tx": 1.3 * TIME,
        "pelvis_ty": 0.95 + 0.02 * np.cos(phase),
    }
    for side, shift in (("r", 0.0), ("l", np.pi)):
        found[f"hip_flexion_{side}"] = 0.5 * np.cos(phase + shift)
        found[f"knee_angle_{side}"] = -0.5 + 0.4 * np.cos(phase + shift + 1.0)
        found[f"ankle_angle_{side}"] = 0.2 * np.sin(phase + shift)
    return found


def table(columns: dict[str, np.ndarray]) -> OpenSimTable:
    return OpenSimTable(pathlib.Path("walk.mot"), TIME, columns, None)


def model(tmp_path, layout=osim_text.version_4, **options) -> OpenSimModel:
    return read_opensim_model(osim_text.write(tmp_path / "walker.osim", layout(*osim_text.walker(**options))))


def turned(angle: np.ndarray, x: float, y: float) -> np.ndarray:
    """A vector of the sagittal plane, turned about z (n, 2)."""
    return np.column_stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)])


def plane_chain(side: str) -> dict[str, np.ndarray]:
    """Points of a leg in the sagittal plane (n, 2), summed up from pelvis to toe."""
    q = walk()
    pelvis = np.column_stack([q["pelvis_tx"], q["pelvis_ty"]])
    tilt = q["pelvis_tilt"]
    thigh = tilt + q[f"hip_flexion_{side}"]
    shank = thigh + q[f"knee_angle_{side}"]
    foot = shank + q[f"ankle_angle_{side}"]
    hip = pelvis + turned(tilt, osim_text.HIP_AT[0], osim_text.HIP_AT[1])
    knee = hip + turned(thigh, 0.0, -osim_text.THIGH)
    ankle = knee + turned(shank, 0.0, -osim_text.SHANK)
    origin = ankle - turned(foot, osim_text.ANKLE_ON_FOOT[0], osim_text.ANKLE_ON_FOOT[1])
    heel, toe = origin + turned(foot, -0.02, 0.02), origin + turned(foot, osim_text.TOES_AT + 0.08, 0.005)
    return {"hip": hip, "knee": knee, "ankle": ankle, "heel": heel, "toe": toe}


def seen_markers(made: OpenSimModel, lost: tuple[str, ...] = (), scale: float = 1.0) -> Markers:
    """Where the model's markers are in the walk; another test checks the forward kinematics itself."""
    positions = {
        name: made.pose("ground", body, walk()).point(scale * place)
        for name, (body, place) in made.markers.items()
        if name not in lost
    }
    return Markers(pathlib.Path("walk.trc"), TIME, positions)


def assert_chain(leg: LegPoints, atol: float = 1e-12) -> None:
    for role, expected in plane_chain(leg.side[0]).items():
        np.testing.assert_allclose(leg.points[role].path[:, :2], expected, atol=atol, err_msg=role)


@pytest.mark.parametrize("layout", osim_text.LAYOUTS.values(), ids=osim_text.LAYOUTS)
@pytest.mark.parametrize("degrees", [False, True], ids=["rad", "deg"])
def test_joint_angles_place_both_legs(tmp_path, layout, degrees):
    made = model(tmp_path, layout)
    columns = walk()
    if degrees:  # translations stay in metres
        columns = {
            n: v if n.startswith("pelvis_t") and n != "pelvis_tilt" else np.degrees(v)
            for n, v in columns.items()
        }
    legs = legs_from_angles(made, table(columns), degrees)
    assert set(legs) == {"right", "left"}
    for side, out in (("right", 1.0), ("left", -1.0)):
        assert_chain(legs[side])
        np.testing.assert_allclose(
            legs[side].points["knee"].path[:, 2], out * osim_text.HIP_AT[2], atol=1e-12
        )
    np.testing.assert_allclose(legs["left"].pelvis[:, 0], 1.3 * TIME, atol=1e-12)


def test_markers_place_both_legs(tmp_path):
    made = model(tmp_path)
    legs = legs_from_model_markers(made, seen_markers(made), Choices())
    for leg in legs.values():
        assert_chain(leg, atol=1e-9)
        assert not leg.warnings
        assert "residual 0.0 mm" in leg.remarks[0]


def test_what_the_foot_tells(tmp_path):
    """Heel and toe markers 0.28 m apart, the toe's 15 mm lower; no sole without contact spheres."""
    leg = legs_from_angles(model(tmp_path), table(walk()), False)["right"]
    assert leg.sole == pytest.approx(np.arctan2(-0.015, 0.28))
    assert leg.outline == pytest.approx({"heel": -0.07, "toe": 0.21})
    assert leg.ankle_height is None
    under = legs_from_angles(model(tmp_path, spheres=True), table(walk()), False)["right"]
    assert under.ankle_height == pytest.approx(0.045 + 0.02)  # the heel's sphere reaches lower than the toes'


def test_names_need_not_be_written_alike(tmp_path):
    made = model(tmp_path)
    seen = seen_markers(made)
    other = {f"subject:{name.replace('.', ' ').lower()}": path for name, path in seen.positions.items()}
    legs = legs_from_model_markers(made, Markers(seen.file, TIME, other), Choices())
    assert_chain(legs["left"], atol=1e-9)


def test_two_markers_and_a_joint_centre_are_enough(tmp_path):
    """As in Plug-in Gait, which has two on thigh, shank and foot each."""
    made = model(tmp_path)
    lost = tuple(f"{s}.{m}" for s in "RL" for m in ("Thigh.Upper", "Shank.Upper", "Midfoot.Lat"))
    # on this foot heel, toe and ankle lie in a plane of their own, but off a line
    leg = legs_from_model_markers(made, seen_markers(made, lost), Choices())["right"]
    assert_chain(leg, atol=1e-7)
    assert "posed with the whole model" in leg.points["knee"].how
    assert "R.Shank.Upper" in leg.points["knee"].better


def test_a_lost_pelvis_leaves_the_hip_to_the_thigh(tmp_path):
    made = model(tmp_path)
    leg = legs_from_model_markers(made, seen_markers(made, ("V.Sacral",)), Choices())["right"]
    assert_chain(leg, atol=1e-9)
    assert "thigh" in leg.points["hip"].how
    assert leg.remarks[0].endswith("cannot be posed: of the pelvis, only R.ASIS, L.ASIS is seen")


def test_missing_markers_are_told_in_a_sentence(tmp_path):
    made = model(tmp_path)
    markers = seen_markers(made, ("R.Heel", "R.Midfoot.Lat", "R.Toe.Tip"))
    with pytest.raises(InputError, match=r"too little of the right foot: seen ankle centre; missing R\.Heel"):
        legs_from_model_markers(made, markers, Choices())
    legs = legs_from_model_markers(made, markers, Choices(side="left"))
    assert set(legs) == {"left"}
    assert "no right leg: " in legs["left"].remarks[-1]


def test_a_trial_without_a_marker_of_the_model(tmp_path):
    markers = Markers(pathlib.Path("walk.trc"), TIME, {"A1": np.zeros((41, 3))})
    with pytest.raises(InputError, match="has no marker of the model"):
        legs_from_model_markers(model(tmp_path), markers, Choices())


def test_a_model_of_another_size_is_doubted(tmp_path):
    made = model(tmp_path)
    for scale, doubted in ((1.10, True), (1.03, False)):
        leg = legs_from_model_markers(made, seen_markers(made, scale=scale), Choices())["right"]
        assert any(f"{scale:.3g} times" in line for line in leg.warnings) == doubted


def test_swapped_markers_are_doubted(tmp_path):
    made = model(tmp_path)
    seen = seen_markers(made).positions
    seen["R.Knee.Lat"], seen["R.Thigh.Front"] = seen["R.Thigh.Front"], seen["R.Knee.Lat"]
    leg = legs_from_model_markers(made, Markers(pathlib.Path("walk.trc"), TIME, seen), Choices())["right"]
    assert any("right thigh misses the trial's markers by" in line for line in leg.warnings)


def test_a_gap_stays_a_gap(tmp_path):
    made = model(tmp_path)
    markers = seen_markers(made)
    for name in ("R.Heel", "R.Midfoot.Lat", "R.Toe.Tip"):
        markers.positions[name][10:15] = np.nan
    legs = legs_from_model_markers(made, markers, Choices())
    assert np.isnan(legs["right"].points["toe"].path[10:15]).all()
    np.testing.assert_allclose(legs["right"].points["knee"].path[:, :2], plane_chain("r")["knee"], atol=1e-9)


def test_angles_that_are_missing(tmp_path):
    made, columns = model(tmp_path), walk()
    del columns["knee_angle_r"], columns["pelvis_tilt"]
    legs = legs_from_angles(made, table(columns), False)
    assert set(legs) == {"left"}
    assert "no right leg: walk.mot: has no column for the right tibia_r_joint" in legs["left"].remarks[-1]
    assert any("pelvis_tilt" in line for line in legs["left"].warnings)


def test_angles_of_another_model_are_doubted(tmp_path):
    """A knee that bends to the other side leaves the model's range; 9 deg beyond are no doubt."""
    parts, markers, extra = osim_text.walker()
    knees = {f"knee_angle_{side}": walk()[f"knee_angle_{side}"] for side in "rl"}
    low, high = (float(end(knees["knee_angle_l"])) for end in (np.min, np.max))
    for below, above, told in ((9.0, 9.0, False), (11.0, 9.0, True), (9.0, 11.0, True)):
        text = osim_text.version_3(parts, markers, extra)
        limits = low + np.radians(below), high - np.radians(above)
        text = text.replace("<range>-2.0 2.0", "<range>{} {}".format(*limits))
        made = read_opensim_model(osim_text.write(tmp_path / "walker.osim", text))
        legs = legs_from_angles(made, table(walk() | {"knee_angle_r": -knees["knee_angle_r"]}), False)
        odd = {n.subject for leg in legs.values() for n in with_code(leg.notices, "beyond-model-range")}
        assert odd & knees.keys() == {"knee_angle_r", *["knee_angle_l"][:told]}


def test_a_model_without_legs(tmp_path):
    parts, _, extra = osim_text.walker()
    made = read_opensim_model(
        osim_text.write(tmp_path / "bust.osim", osim_text.version_4(parts[:1], {}, extra))
    )
    with pytest.raises(InputError, match=r"has no right leg: no body for thigh \(femur_r\)"):
        legs_from_angles(made, table(walk()), False)


def ankle_angle(leg: LegPoints) -> np.ndarray:
    """Between foot and shank in the sagittal plane [deg] (n,)."""
    foot, shank = (leg.points[a].path - leg.points[b].path for a, b in (("toe", "heel"), ("knee", "ankle")))
    return np.degrees(np.arctan2(foot[:, 1], foot[:, 0]) - np.arctan2(shank[:, 1], shank[:, 0]))


@where_recorded
@pytest.mark.parametrize("recording", RECORDINGS)
def test_the_foot_turns_against_the_shank_as_the_recordings_coordinate_says(recording):
    """The ankle's axis is oblique, so that the plane angle follows the coordinate within 1 deg only."""
    osim, angles, degrees = RECORDINGS[recording]
    made = read_opensim_model(FOLDER / recording / osim)
    coordinates = read_opensim_table(FOLDER / recording / angles)
    for side, leg in legs_from_angles(made, coordinates, degrees).items():
        stated = coordinates.columns[f"ankle_angle_{side[0]}"] * (1.0 if degrees else 180.0 / np.pi)
        assert np.std(ankle_angle(leg) - stated) < 1.0
        length = np.linalg.norm(leg.points["knee"].path - leg.points["ankle"].path, axis=1)
        assert np.ptp(length) < 1e-9
        assert not leg.warnings


@where_recorded
@pytest.mark.parametrize(("recording", "row"), OPENSIM)
def test_bodies_stand_where_opensim_has_them(recording, row):
    """Body origins in ground within 0.1 mm."""
    osim, angles, degrees = RECORDINGS[recording]
    made = read_opensim_model(FOLDER / recording / osim)
    columns = read_opensim_table(FOLDER / recording / angles).columns
    coordinates = [c for joint in made.joints for c in joint.coordinates if c.name in columns]
    values = {
        c.name: columns[c.name][[row]] * (np.pi / 180.0 if degrees and c.rotational else 1.0)
        for c in coordinates
    }
    for body, place in OPENSIM[recording, row].items():
        np.testing.assert_allclose(made.pose("ground", body, values).position[0], place, atol=1e-4)


@where_recorded
def test_subject01s_markers_agree_with_its_inverse_kinematics():
    """Its file of joint angles holds the recorded markers, too; knee and ankle have none in the trial."""
    osim, angles, degrees = RECORDINGS["subject01_walk1"]
    made = read_opensim_model(SUBJECT01 / osim)
    coordinates = read_opensim_table(SUBJECT01 / angles)
    columns = coordinates.columns
    positions = {
        name: np.column_stack([columns[f"{name}_t{axis}"] for axis in "xyz"])
        for name in made.markers
        if f"{name}_tx" in columns
    }
    found = legs_from_model_markers(made, Markers(coordinates.file, coordinates.time, positions), Choices())
    for side, reference in legs_from_angles(made, coordinates, degrees).items():
        assert not found[side].warnings
        assert np.std(ankle_angle(found[side]) - ankle_angle(reference)) < 3.0
        for role, point in found[side].points.items():
            off = point.path[:, :2] - reference.points[role].path[:, :2]
            assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 2.0 * point.error, role


@where_recorded
def test_markers_agree_with_the_recordings_inverse_kinematics():
    """Within 3 deg RMS of the ankle angle after the offset, though that fit misses markers by 20 to 45 mm."""
    folder = MOCO
    made = read_opensim_model(folder / "subject_walk_scaled.osim")
    coordinates, markers = (
        read_opensim_table(folder / "coordinates.sto"),
        read_trc(folder / "markers_walk.trc"),
    )
    reference, found = (
        legs_from_angles(made, coordinates, False),
        legs_from_model_markers(made, markers, Choices()),
    )
    for side in ("right", "left"):
        angle = np.interp(coordinates.time, markers.time, ankle_angle(found[side]))
        assert np.std(angle - ankle_angle(reference[side])) < 3.0
