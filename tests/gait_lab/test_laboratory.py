"""The known walker and its laboratory are what they say, by laws that do not depend on how they were made."""

import dataclasses
import pathlib
from xml.etree import ElementTree

import numpy as np
import pytest
from gait_lab.c3d_writer import write_c3d
from gait_lab.known_walker import FOOT_CENTRE, FOOT_GYRATION, FOOT_MASS, HIP_Z, SIGN, SOLE, Walker
from gait_lab.laboratory import Laboratory
from gait_lab.marker_sets import SETS, in_world
from gait_lab.osim_writer import write_osim
from scipy.spatial.transform import Rotation
from walking import SHANK, THIGH

from afo_sim.common import GRAVITY

TIME = np.arange(0.0, 2.6, 0.001)


@pytest.fixture(scope="module")
def walker() -> Walker:
    return Walker()


def test_segments_are_rigid_and_joined(walker: Walker) -> None:
    segments = walker.segments(TIME)
    for rotation, _ in segments.values():
        assert np.allclose(np.swapaxes(rotation, 1, 2) @ rotation, np.eye(3), atol=1e-12)
        assert np.allclose(np.linalg.det(rotation), 1.0)
    for side in SIGN:
        hip, knee, ankle = walker.centres(side, TIME).values()
        assert np.ptp(np.linalg.norm(hip - knee, axis=1)) < 1e-12
        assert np.ptp(np.linalg.norm(knee - ankle, axis=1)) < 1e-12
        assert np.hypot(*(knee - ankle)[:, :2].T) == pytest.approx(SHANK, abs=1e-12)
        assert np.hypot(*(hip - knee)[:, :2].T) == pytest.approx(THIGH, abs=1e-12)
        assert ankle[:, :2] == pytest.approx(walker.ankle_plane(side, TIME), abs=1e-12)


def test_angles_are_those_of_the_centres(walker: Walker) -> None:
    """From positions alone: shank from the vertical, knee between the bones, foot from heel to toe."""
    for side in SIGN:
        hip, knee, ankle = (p[:, :2] for p in walker.centres(side, TIME).values())
        shank = np.arctan2(*(knee - ankle).T)
        assert shank == pytest.approx(walker.angle(side, "shank", TIME), abs=1e-12)
        bend = shank - np.arctan2(*(hip - knee).T)
        assert bend == pytest.approx(walker.angle(side, "knee", TIME), abs=1e-12)
        seen = in_world(walker, "opensim c3d", TIME)
        letter = side[0].upper()
        foot = (seen[f"{letter}MT2"] - seen[f"{letter}CAL"])[:, :2]
        pitch = np.unwrap(np.arctan2(foot[:, 1], foot[:, 0]))
        flat = walker.phase(side, TIME) % 1.0
        flat = walker.walk.cycle.flat.holds(flat)
        pitch -= pitch[flat].mean()
        expected = walker.angle(side, "ankle", TIME) - walker.angle(side, "shank", TIME)
        assert pitch == pytest.approx(expected - expected[flat].mean(), abs=1e-9)
        assert abs(np.degrees(expected[flat].mean())) < 0.1
        assert ankle[flat, 1].mean() == pytest.approx(SOLE, abs=1e-4)


def test_left_is_right_half_a_stride_later(walker: Walker) -> None:
    later = TIME + 0.5 * walker.stride_time
    for name, points in in_world(walker, "cast", TIME).items():
        if name.startswith("R"):
            other = in_world(walker, "cast", later)["L" + name[1:]]
            ahead = points + np.array([0.5 * walker.stride_length, 0.0, 0.0])
            assert other == pytest.approx(ahead * [1.0, 1.0, -1.0], abs=1e-9)


def test_harringtons_regression_gives_the_hip(walker: Walker) -> None:
    """Harrington 2007, one-variable, in the pelvis' frame from the four markers."""
    seen = in_world(walker, "plug-in gait", TIME)
    front = 0.5 * (seen["RASI"] + seen["LASI"])
    back = 0.5 * (seen["RPSI"] + seen["LPSI"])
    z = seen["RASI"] - seen["LASI"]
    width, depth = np.linalg.norm(z, axis=1)[:, None], np.linalg.norm(front - back, axis=1)[:, None]
    z = z / width
    x = front - back
    x -= (x * z).sum(axis=1)[:, None] * z
    x /= np.linalg.norm(x, axis=1)[:, None]
    y = np.cross(z, x)
    front = front - 0.007 * x  # from the markers' centres to the skin
    for side, sign in SIGN.items():
        hip = front + (-0.24 * depth - 0.0099) * x + (-0.30 * width - 0.0109) * y
        hip = hip + sign * (0.33 * width + 0.0073) * z
        assert hip == pytest.approx(walker.centres(side, TIME)["hip"], abs=1e-6)
    assert pytest.approx(float((0.33 * width + 0.0073)[0, 0]), abs=1e-9) == HIP_Z


def test_two_feet_carry_the_weight(walker: Walker) -> None:
    time = np.linspace(0.0, walker.stride_time, 20_001)[:-1]
    total = sum(walker.force(side, time)[0] for side in SIGN)
    assert total[:, 1].mean() == pytest.approx(walker.mass * GRAVITY, rel=1e-3)
    assert np.abs(total[:, [0, 2]].mean(axis=0)).max() < 0.003 * walker.mass * GRAVITY


def test_moment_balances_the_foot_about_the_laboratorys_origin(walker: Walker) -> None:
    """Angular momentum of the foot about a fixed point, by differences of time, not about the ankle."""
    step = TIME[1] - TIME[0]
    mass = FOOT_MASS * walker.mass
    for side in SIGN:
        rotation, ankle = walker.segments(TIME)[f"foot_{side[0]}"]
        centre = (rotation @ FOOT_CENTRE + ankle)[:, :2]
        speed = np.gradient(centre, step, axis=0, edge_order=2)
        spin = np.gradient(np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])), step, edge_order=2)
        momentum = mass * (_cross(centre, speed) + FOOT_GYRATION**2 * spin)
        change = np.gradient(momentum, step, edge_order=2)
        push = mass * np.gradient(speed, step, axis=0, edge_order=2)  # of all forces
        force, place = walker.force(side, TIME)
        shank = push - force[:, :2] + [0.0, mass * GRAVITY]  # of the shank on the foot
        weight = np.tile([0.0, -mass * GRAVITY], (len(TIME), 1))
        rest = _cross(place[:, :2], force[:, :2]) + _cross(centre, weight) + _cross(ankle[:, :2], shank)
        expected = (change - rest)[5:-5]
        assert walker.moment(side, TIME)[5:-5] == pytest.approx(expected, abs=0.02)
        light = walker.moment(side, TIME, foot=False)
        assert 0.5 < np.abs(light - walker.moment(side, TIME)).max() < 4.0  # N·m: the foot is not massless


def test_the_pressure_is_under_the_foot(walker: Walker) -> None:
    """The centre of pressure lies within the sole."""
    for side in SIGN:
        force, place = walker.force(side, TIME)
        loaded = force[:, 1] > 50.0
        ahead = (place - walker.centres(side, TIME)["ankle"])[loaded, 0]
        assert -0.06 < ahead.min() < ahead.max() < 0.19


def test_the_standing_foot_does_not_slide(walker: Walker) -> None:
    straight = dataclasses.replace(walker, toe_out=0.0)
    for side in SIGN:
        ball = straight.segments(TIME)[f"toes_{side[0]}"][1]
        phase = straight.phase(side, TIME)
        for number in (0, 1):
            stands = (phase > number + 0.09) & (phase < number + 0.55)
            assert np.ptp(ball[stands, 0]) < 5e-4
            assert np.ptp(ball[stands, 2]) < 10e-3  # with the hip, when the pelvis turns


@pytest.mark.parametrize("kind", [2, 3, 4])
def test_c3d_is_what_ezc3d_computes(walker: Walker, tmp_path: pathlib.Path, kind: int) -> None:
    """An independent reader turns the channels into the plates' forces and places."""
    ezc3d = pytest.importorskip("ezc3d")
    laboratory = Laboratory(walker, forward="-y", up="z", seconds=2.2, origin=(0.4, 0.7, 0.0))
    plates = laboratory.plates("steps")
    file = write_c3d(tmp_path / "walk.c3d", laboratory.time, laboratory.markers("cast"), plates, kind)
    read = ezc3d.c3d(str(file), extract_forceplat_data=True)
    assert len(read["data"]["platform"]) == len(plates)
    for plate, seen in zip(plates, read["data"]["platform"], strict=True):
        assert pytest.approx(-plate.force, abs=0.01) == np.asarray(seen["force"]).T
        loaded = plate.force[:, 2] > 50.0
        place = np.asarray(seen["center_of_pressure"]).T[loaded] / 1e3
        assert place == pytest.approx(plate.place[loaded], abs=1e-4)


def test_steps_are_one_contact_a_plate(walker: Walker) -> None:
    laboratory = Laboratory(walker)
    feet = {plate.name: plate for plate in laboratory.plates("feet")}
    steps, single = laboratory.plates("steps"), laboratory.plates("single")
    assert len(single) == 2
    total = sum(plate.force for plate in steps)
    assert total == pytest.approx(sum(plate.force for plate in feet.values()), abs=1e-9)
    for plate in steps:
        inside = plate.force[:, 1] > 0.0
        assert np.all(plate.place[inside] < plate.corners.max(axis=0) + 1e-9)
        assert inside.sum() < 0.9 * laboratory.plate_rate


def test_a_treadmill_keeps_the_walker_in_place(walker: Walker) -> None:
    laboratory = Laboratory(walker, belt=walker.speed, seconds=6.0)
    for name, points in laboratory.markers("cast").items():
        assert np.ptp(points[:, 0]) < 1.3, name


def test_oblique_and_mirrored_frames_keep_distances(walker: Walker) -> None:
    plain = Laboratory(walker).markers("cast")
    for laboratory in (
        Laboratory(walker, forward="-y", up="z", turn=np.radians(37.0)),
        Laboratory(walker, forward="z", up="x", mirrored=True),
        Laboratory(walker, forward="y", up="-z", origin=(1.0, 2.0, 0.0)),
    ):
        seen = laboratory.markers("cast")
        for name, points in seen.items():
            assert np.linalg.norm(points - seen["R_IAS"], axis=1) == pytest.approx(
                np.linalg.norm(plain[name] - plain["R_IAS"], axis=1)
            )
        handed = np.linalg.det(laboratory.axes)
        assert handed == pytest.approx(-1.0 if laboratory.mirrored else 1.0)


def test_every_set_has_both_sides() -> None:
    for name in SETS:
        seen = in_world(Walker(), name, TIME[:3])
        assert len(seen) >= 2 * (len(SETS[name]) - 1) + 1


def test_without_toe_out_the_foot_points_forward() -> None:
    straight = dataclasses.replace(Walker(), toe_out=0.0)
    seen = in_world(straight, "cast", TIME)
    assert (seen["R_FM2"] - seen["R_FCC"])[:, 2] == pytest.approx(0.0 * TIME, abs=1e-12)


@pytest.mark.parametrize(("version", "knee"), [(3, -1.0), (4, 1.0), (4, -1.0)])
def test_model_and_angles_give_the_markers(
    walker: Walker, tmp_path: pathlib.Path, version: int, knee: float
) -> None:
    """Forward kinematics of the written text, joint after joint, puts the markers where they were seen."""
    laboratory = Laboratory(walker, seconds=1.5)
    file = write_osim(tmp_path / "scaled.osim", walker, "gait2392", version=version, knee=knee)
    tree = ElementTree.parse(file)
    angles = laboratory.angles(knee)
    poses = {"ground": (np.eye(3), np.zeros(3))}
    joints = [j for kind in ("CustomJoint", "PinJoint") for j in tree.iter(kind)]
    while joints:
        joint = joints.pop(0)
        parent, child, at, turn = _joint(joint, tree)
        if parent not in poses:
            joints.append(joint)
            continue
        rotation, origin = poses[parent]
        origin = origin + rotation @ at
        rotation = rotation @ Rotation.from_euler("XYZ", turn).as_matrix()
        axes = [
            (a.findtext("coordinates"), _numbers(a.findtext("axis"))) for a in joint.iter("TransformAxis")
        ]
        axes = axes or [(joint.find(".//Coordinate").get("name"), np.array([0.0, 0.0, 1.0]))]
        for coordinate, axis in axes:
            if (coordinate and not coordinate.startswith("pelvis_t")) or coordinate == "pelvis_tilt":
                rotation = rotation @ Rotation.from_rotvec(angles[coordinate][:, None] * axis).as_matrix()
            elif coordinate:
                origin = origin + angles[coordinate][:, None] * axis
        poses[child] = rotation, origin
    seen = laboratory.markers("gait2392")
    found = 0
    for marker in tree.iter("Marker"):
        body = (marker.findtext("body") or marker.findtext("socket_parent_frame")).split("/")[-1]
        rotation, origin = poses[body]
        if marker.get("name") in seen:
            place = rotation @ _numbers(marker.findtext("location")) + origin
            assert place == pytest.approx(seen[marker.get("name")], abs=1e-6), marker.get("name")
            found += 1
    assert found == len(seen)
    masses = sum(float(m.text) for m in tree.iter("mass"))
    assert masses == pytest.approx(walker.mass)


def _joint(joint, tree):
    if joint.find("parent_body") is not None:
        child = next(b.get("name") for b in tree.iter("Body") if joint in list(b.iter()))
        names = ("location_in_parent", "orientation_in_parent")
        return joint.findtext("parent_body"), child, *(_numbers(joint.findtext(n)) for n in names)
    parent, child = (f.findtext("socket_parent").split("/")[-1] for f in joint.iter("PhysicalOffsetFrame"))
    frame = joint.find(".//PhysicalOffsetFrame")
    return parent, child, _numbers(frame.findtext("translation")), _numbers(frame.findtext("orientation"))


def _numbers(text: str) -> np.ndarray:
    return np.array([float(word) for word in text.split()])


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
