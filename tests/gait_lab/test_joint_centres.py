"""Regressions of joint centres against the papers' formulas, in axes of either handedness."""

import math

import numpy as np
import pytest
from skin_markers import DEPTH, HIP, WIDTH, body, markers_of

from afo_sim.gait_lab import Choices
from afo_sim.gait_lab.trial.joint_centres import hip_by_hara, hip_by_harrington, pelvis_frame
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers

TIME = np.arange(0.0, 1.5, 0.01)
NAMES = {
    "asis": "{S}ASI",
    "psis": "{S}PSI",
    "knee_lateral": "{S}KNE",
    "knee_medial": "{S}KNEM",
    "ankle_lateral": "{S}ANK",
    "ankle_medial": "{S}MED",
    "heel": "{S}HEE",
    "metatarsal_2": "{S}TOE",
}
# Where x forward, y up and z right are in the laboratory; the last two are left-handed.
AXES = {
    "y up": np.eye(3),
    "z up": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z up, walks along -y": np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "z up, walks obliquely": np.array([[0.8, 0.0, 0.6], [0.6, 0.0, -0.8], [0.0, 1.0, 0.0]]),
    "x up": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y up, left-handed": np.diag([1.0, 1.0, -1.0]),
    "z up, left-handed": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]),
}


def without(*landmarks: str) -> dict[str, str]:
    return {mark: name for mark, name in NAMES.items() if mark not in landmarks}


def test_harrington_by_hand() -> None:
    """A pelvis 240 mm wide and 160 mm deep; the numbers are worked out beside `HIP`."""
    assert hip_by_harrington(WIDTH, DEPTH, "right") == pytest.approx(HIP, abs=1e-12)
    assert hip_by_harrington(WIDTH, DEPTH, "left") == pytest.approx((HIP[0], HIP[1], -HIP[2]), abs=1e-12)


def test_hara_by_hand() -> None:
    """A leg of 900 mm: 11 - 56.7 - 7, -9 - 70.2, 8 + 77.4 mm."""
    assert hip_by_hara(0.9, "right") == pytest.approx((-0.0527, -0.0792, 0.0854), abs=1e-12)
    assert hip_by_hara(0.9, "left")[2] == pytest.approx(-0.0854, abs=1e-12)


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES)
def test_pelvis_axes_do_not_depend_on_handedness(axes: np.ndarray) -> None:
    points = body(TIME, walks=False)
    right, left = points["right"], points["left"]
    back = 0.5 * (right["psis"] + left["psis"])
    four = (right["asis"], left["asis"], back, right["knee_centre"])
    frame = pelvis_frame(*(path @ axes.T for path in four))
    for found, axis in ((frame.forward, 0), (frame.up, 1), (frame.right, 2)):
        assert np.allclose(found, axes[:, axis])


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES)
def test_centres_come_back_in_any_axes(axes: np.ndarray) -> None:
    true = body(TIME)
    legs = legs_from_markers(markers_of(true, NAMES, TIME, axes=axes), Choices())
    for side in ("right", "left"):
        for role in ("hip", "knee", "ankle"):
            assert np.allclose(legs[side].points[role].path, true[side][f"{role}_centre"] @ axes.T), role
        pelvis = legs[side].pelvis
        assert pelvis is not None
        middle = np.mean([true[s][mark] for s in true for mark in ("asis", "psis")], axis=0)
        assert np.allclose(pelvis, middle @ axes.T)


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES)
def test_lateral_malleolus_alone_is_moved_forward_and_up(axes: np.ndarray) -> None:
    """Where the foot is at right angles to the shank, by 6.3 and 6.4 mm in the shank's own axes."""
    true = body(TIME, walks=False)
    names = without("ankle_medial", "knee_medial")
    legs = legs_from_markers(markers_of(true, names, TIME, axes=axes), Choices())
    for side in ("right", "left"):
        ankle = legs[side].points["ankle"]
        knee, malleolus = true[side]["knee_lateral"], true[side]["ankle_lateral"]
        moved = (ankle.path @ axes - malleolus)[0]  # back into x forward, y up, z right
        up = (knee - malleolus)[0] / np.linalg.norm((knee - malleolus)[0])
        assert moved @ up == pytest.approx(0.0064, abs=1e-12)
        assert moved[0] == pytest.approx(0.0063, abs=4e-4)
        assert np.linalg.norm(moved) == pytest.approx(math.hypot(0.0063, 0.0064), abs=1e-12)
        assert ankle.error is not None
        off = ankle.path @ axes - true[side]["ankle_centre"]
        assert np.linalg.norm(off[0, :2]) < ankle.error
        assert ankle.better


@pytest.mark.parametrize("axes", [AXES["y up"], AXES["z up, left-handed"]])
def test_hip_without_the_back_of_the_pelvis(axes: np.ndarray) -> None:
    """Hara's point, in axes that lean forward by 10 deg at a level pelvis."""
    true = body(TIME, walks=False)
    legs = legs_from_markers(markers_of(true, without("psis"), TIME, axes=axes), Choices())
    for side, sign in (("right", 1.0), ("left", -1.0)):
        leg = true[side]
        length = np.linalg.norm(leg["asis"] - leg["knee_centre"], axis=1)[0]
        length += np.linalg.norm(
            leg["knee_centre"] - 0.5 * (leg["ankle_lateral"] + leg["ankle_medial"]), axis=1
        )[0]
        forward, up, out = 0.004 - 0.063 * length, -0.009 - 0.078 * length, 0.008 + 0.086 * length
        tilt = math.radians(10.0)
        x = forward * math.cos(tilt) + up * math.sin(tilt)
        y = -forward * math.sin(tilt) + up * math.cos(tilt)
        middle = 0.5 * (true["right"]["asis"] + true["left"]["asis"])[0]
        hip = legs[side].points["hip"]
        assert np.allclose(hip.path[0] @ axes, middle + np.array([x, y, sign * out]), atol=1e-9)
        assert "Hara 2016" in hip.how and hip.error is not None and hip.error > 0.012


def test_trochanter_is_a_poor_hip() -> None:
    true = body(TIME)
    names = without("asis", "psis") | {"trochanter": "{S}GTR"}
    hip = legs_from_markers(markers_of(true, names, TIME), Choices())["left"].points["hip"]
    assert np.array_equal(hip.path, true["left"]["trochanter"])
    assert hip.error == 0.025 and "pelvis" in hip.better


def test_a_lost_pelvis_marker_is_placed_by_the_others() -> None:
    true = body(TIME)
    markers = markers_of(true, NAMES, TIME)
    markers.positions["RASI"][40:80] = np.nan
    markers.positions["LPSI"][100:120] = np.nan
    legs = legs_from_markers(markers, Choices())
    assert np.allclose(legs["right"].points["hip"].path, true["right"]["hip_centre"])
