"""A standing posture gives joint centres, carried into the walk by the markers of each segment."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skin_markers import SHANK_CLUSTER, body, markers_of

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, Markers
from afo_sim.gait_lab.trial.clusters import fit_rigid
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers, quiet_part, standing_posture

TIME = np.arange(0.0, 2.0, 0.01)
STAND = np.arange(0.0, 3.0, 0.01)
WALKED = {
    "asis": "{S}ASI",
    "psis": "{S}PSI",
    "knee_lateral": "{S}KNE",
    "ankle_lateral": "{S}ANK",
    "heel": "{S}HEE",
    "metatarsal_1": "{S}MT1",
    "metatarsal_5": "{S}MT5",
    **{f"thigh_{k}": f"{{S}}TH{k}" for k in range(4)},
    **{f"shank_{k}": f"{{S}}SH{k}" for k in range(len(SHANK_CLUSTER))},
}
MEDIAL = {"knee_medial": "{S}KNEM", "ankle_medial": "{S}ANKM"}
LEFT_HANDED = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])  # z up


def standing(names: dict[str, str], axes: np.ndarray, noise: float = 0.0) -> Markers:
    """A person who stands askew to the walkway."""
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])  # about the vertical
    return markers_of(body(STAND, walks=False), names, STAND, axes=axes @ turn, noise=noise)


@pytest.mark.parametrize("axes", [np.eye(3), LEFT_HANDED])
def test_centres_are_carried_through_a_walk(axes: np.ndarray) -> None:
    true = body(TIME)
    walk = markers_of(true, WALKED, TIME, axes=axes)
    legs = legs_from_markers(walk, Choices(), standing(WALKED | MEDIAL, axes))
    for side in ("right", "left"):
        for role in ("knee", "ankle"):
            point = legs[side].points[role]
            assert "standing, carried by" in point.how
            if role == "ankle":  # the knee moves with thigh and shank both
                assert f"{side[0].upper()}SH0" in point.how
            assert np.allclose(point.path, true[side][f"{role}_centre"] @ axes.T, atol=1e-9), point.how


def test_noise_leaves_a_few_millimetres() -> None:
    """A millimetre on each coordinate: the centre is within the markers' reach, so it has a few."""
    true = body(TIME)
    walk = markers_of(true, WALKED, TIME, noise=0.001)
    legs = legs_from_markers(walk, Choices(), standing(WALKED | MEDIAL, np.eye(3), noise=0.001))
    for role in ("knee", "ankle"):
        off = legs["right"].points[role].path - true["right"][f"{role}_centre"]
        assert np.sqrt((off**2).sum(axis=1).mean()) < 0.004
        assert np.abs(off.mean(axis=0)).max() < 0.001


def test_clusters_alone_are_enough_in_the_walk() -> None:
    """No marker of knee and ankle in the walk, as where they are taken off after standing."""
    true = body(TIME)
    names = {mark: name for mark, name in WALKED.items() if mark not in ("knee_lateral", "ankle_lateral")}
    with pytest.raises(InputError, match=r"right knee .* ankle"):
        legs_from_markers(markers_of(true, names, TIME), Choices())
    legs = legs_from_markers(markers_of(true, names, TIME), Choices(), standing(WALKED | MEDIAL, np.eye(3)))
    for side in ("right", "left"):
        for role in ("knee", "ankle"):
            assert np.allclose(legs[side].points[role].path, true[side][f"{role}_centre"], atol=1e-9)


def test_plug_in_gait_is_carried_from_joint_to_joint() -> None:
    """One wand on each segment: the centre above is the third point of thigh and shank."""
    true = body(TIME)
    names = {mark: name for mark, name in WALKED.items() if not mark.startswith(("thigh_", "shank_"))}
    names |= {"thigh_1": "{S}THI", "shank_2": "{S}TIB"}
    legs = legs_from_markers(markers_of(true, names, TIME), Choices(), standing(names | MEDIAL, np.eye(3)))
    for side in ("right", "left"):
        for role in ("knee", "ankle"):
            point = legs[side].points[role]
            assert np.allclose(point.path, true[side][f"{role}_centre"], atol=1e-9), point.how
    assert "the knee centre" in legs["right"].points["ankle"].how


def test_too_few_markers_are_told_and_the_walk_decides() -> None:
    true = body(TIME)
    few = {mark: name for mark, name in WALKED.items() if not mark.startswith(("thigh_", "shank_"))}
    few.pop("metatarsal_1")
    still = standing(few | MEDIAL, np.eye(3))
    leg = legs_from_markers(markers_of(true, few, TIME), Choices(), still)["right"]
    told = "the right ankle of the standing posture is not used: both trials see RANK on the shank"
    assert any(told in remark for remark in leg.remarks)
    assert "forward" in leg.points["ankle"].how
    off = leg.points["ankle"].path - true["right"]["ankle_centre"]
    assert leg.points["ankle"].error is not None
    assert np.linalg.norm(off[:, :2], axis=1).max() < leg.points["ankle"].error


def test_a_marker_of_another_segment_is_not_used() -> None:
    """In standing a hand hangs beside the thigh; it moves by itself in the walk."""
    true = body(TIME)
    still = standing(WALKED | MEDIAL, np.eye(3))
    walk = markers_of(true, WALKED, TIME)
    still.positions["RWRIST"] = still.positions["RTH1"] + [0.0, 0.02, 0.05]
    swing = 0.3 * np.sin(2.0 * np.pi * TIME / 1.1)
    walk.positions["RWRIST"] = true["right"]["asis"] + np.stack(
        [swing, -0.2 + 0.0 * TIME, 0.1 + 0.0 * TIME], axis=1
    )
    without_shank = {n for n in walk.positions if "SH" in n}  # so that the thigh has to carry the knee
    for name in without_shank:
        del walk.positions[name]
    knee = legs_from_markers(walk, Choices(), still)["right"].points["knee"]
    assert "RWRIST" not in knee.how and "RTH1" in knee.how
    assert np.allclose(knee.path, true["right"]["knee_centre"], atol=1e-9)


def test_another_persons_standing_trial_is_doubted() -> None:
    still = standing(WALKED | MEDIAL, np.eye(3))
    taller = Markers(still.file, still.time, {name: 1.3 * path for name, path in still.positions.items()})
    legs = legs_from_markers(markers_of(body(TIME), WALKED, TIME), Choices(), taller)
    assert any("the same person" in warning for warning in legs["right"].warnings)


def test_standing_tells_the_flat_foot() -> None:
    """Heel at (-70, -45), forefoot at (120, -60, 5) mm from the ankle, which is 80 mm above the floor."""
    true = body(STAND, walks=False)
    lift = 0.08 - true["right"]["ankle_centre"][0, 1]
    lifted = np.array([0.0, lift, 0.0])
    points = {side: {name: path + lifted for name, path in each.items()} for side, each in true.items()}
    still = markers_of(points, WALKED | MEDIAL, STAND, axes=LEFT_HANDED)
    walk = markers_of(body(TIME), WALKED, TIME, axes=LEFT_HANDED)
    leg = legs_from_markers(walk, Choices(), still)["right"]
    assert leg.sole == pytest.approx(np.arctan2(-0.015, np.hypot(0.19, 0.005)), abs=1e-9)
    assert leg.ankle_height == pytest.approx(0.08, abs=1e-9)


def test_the_quiet_part_is_found() -> None:
    """One second of standing between two walks."""
    moving, still = body(TIME), body(np.arange(0.0, 1.0, 0.01), walks=False)
    names = WALKED | MEDIAL
    walk, stand = markers_of(moving, names, TIME), markers_of(still, names, np.arange(0.0, 1.0, 0.01))
    positions = {
        n: np.concatenate([walk.positions[n], stand.positions[n], walk.positions[n]]) for n in walk.positions
    }
    time = 0.01 * np.arange(500)
    trial = Markers(walk.file, time, positions)
    quiet = quiet_part(trial)
    assert quiet is not None
    assert 200 <= quiet.start <= 215 and 285 <= quiet.stop <= 300
    posture = standing_posture(trial)
    assert np.allclose(posture.positions["RHEE"][0], stand.positions["RHEE"][0])
    with pytest.raises(InputError, match="nobody stands still"):
        standing_posture(walk)


def test_medial_markers_seen_only_in_a_quiet_part_of_the_walk() -> None:
    """The person stands for a second, then walks, and the medial markers fall off at the first step."""
    start = np.arange(0.0, 1.0, 0.01)
    still, moving = body(start, walks=False), body(TIME)
    names = WALKED | MEDIAL
    first, then = markers_of(still, names, start), markers_of(moving, names, TIME)
    positions = {
        name: np.concatenate([first.positions[name], then.positions[name]]) for name in names_of(names)
    }
    for name in names_of(MEDIAL):
        positions[name][100:] = np.nan
    trial = Markers(first.file, 0.01 * np.arange(300), positions)
    leg = legs_from_markers(trial, Choices())["right"]
    for role in ("knee", "ankle"):
        true = np.concatenate([still["right"][f"{role}_centre"], moving["right"][f"{role}_centre"]])
        assert np.allclose(leg.points[role].path, true, atol=1e-9), leg.points[role].how
    assert leg.sole is not None
    assert any("standing from 0.0" in remark for remark in leg.remarks)


def names_of(names: dict[str, str]) -> list[str]:
    return [name.format(S=letter, s=letter.lower()) for name in names.values() for letter in "RL"]


def test_given_centres_seen_in_part_are_carried_over_their_gaps() -> None:
    """A centre that another program wrote only where it saw all markers."""
    true = body(TIME)
    names = WALKED | {"hip_centre": "{S}HJC", "knee_centre": "{S}KJC", "ankle_centre": "{S}AJC"}
    walk = markers_of(true, names, TIME)
    for name in ("RHJC", "RKJC", "RAJC"):
        walk.positions[name][60:] = np.nan
    leg = legs_from_markers(walk, Choices())["right"]
    for role in ("hip", "knee", "ankle"):
        assert "given in the file" in leg.points[role].how
        assert np.allclose(leg.points[role].path, true["right"][f"{role}_centre"], atol=1e-9)
    assert "right ankle: seen in 60 of 200 frames, in 140 more by its segment's markers" in leg.remarks


BODY = np.array([[0.1, 0.0, 0.02], [-0.05, 0.12, 0.0], [0.0, -0.2, 0.03], [0.04, 0.05, -0.06]])
FRAMES = 200


def moved(body: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotations, positions, and the markers that they give; turns up to half a revolution, any axis."""
    turn = Rotation.random(FRAMES, rng=np.random.default_rng(3)).as_matrix()
    way = np.random.default_rng(4).normal(size=(FRAMES, 3))
    return turn, way, np.einsum("nij,kj->nki", turn, body) + way[:, None]


@pytest.mark.parametrize("body", [BODY, BODY[:3]], ids=["in space", "in a plane"])
def test_a_rigid_motion_comes_back(body):
    turn, way, seen = moved(body)
    fit = fit_rigid(body, seen)
    np.testing.assert_allclose(fit.rotation, turn, atol=1e-12)
    np.testing.assert_allclose(fit.position, way, atol=1e-12)
    np.testing.assert_allclose(fit.rms, 0.0, atol=1e-12)


def test_lost_markers_leave_the_rest_to_be_fitted():
    turn, way, seen = moved(BODY)
    seen[:100, 2] = np.nan
    seen[150, 0, 1] = np.nan  # one coordinate of a marker is none of it
    fit = fit_rigid(BODY, seen)
    np.testing.assert_allclose(fit.rotation, turn, atol=1e-12)
    np.testing.assert_allclose(fit.position, way, atol=1e-12)


def test_too_few_markers_are_no_place():
    _, _, seen = moved(BODY)
    seen[5, :2] = np.nan
    fit = fit_rigid(BODY, seen)
    assert np.isnan(fit.rotation[5]).all() and np.isnan(fit.position[5]).all() and np.isnan(fit.rms[5])
    assert np.isfinite(np.delete(fit.rms, 5)).all()


def test_markers_on_a_line_are_no_place():
    line = np.outer([0.0, 0.1, 0.3, 0.4], [1.0, 2.0, -1.0])
    _, _, seen = moved(line)
    noisy = seen + np.random.default_rng(5).normal(scale=1e-3, size=seen.shape)
    assert np.isnan(fit_rigid(line, noisy).rotation).all()


def test_noise_leaves_the_residual_that_theory_says():
    """3k numbers, 6 of them used by the fit: mean square distance (3k − 6)/k σ² (linear least squares)."""
    sigma, frames = 1e-3, 4000
    rng = np.random.default_rng(6)
    seen = np.tile(BODY, (frames, 1, 1)) + rng.normal(scale=sigma, size=(frames, 4, 3))
    rms = np.sqrt(np.mean(fit_rigid(BODY, seen).rms ** 2))
    assert rms == pytest.approx(sigma * np.sqrt((3 * 4 - 6) / 4), rel=0.02)


def test_the_fit_is_the_best_one():
    """An independent search by scipy finds the same rotation in noisy markers."""
    _, _, seen = moved(BODY)
    seen = seen + np.random.default_rng(7).normal(scale=0.01, size=seen.shape)
    fit = fit_rigid(BODY, seen)
    for frame in range(0, FRAMES, 20):
        there = seen[frame] - seen[frame].mean(axis=0)
        expected, _ = Rotation.align_vectors(there, BODY - BODY.mean(axis=0))
        np.testing.assert_allclose(fit.rotation[frame], expected.as_matrix(), atol=1e-9)


@pytest.mark.parametrize("body", [BODY, BODY[:3]], ids=["in space", "in a plane"])
def test_mirrored_markers_never_give_a_reflection(body):
    _, _, seen = moved(body)
    fit = fit_rigid(body, seen * [1.0, 1.0, -1.0])
    np.testing.assert_allclose(np.linalg.det(fit.rotation), 1.0, atol=1e-12)
    if len(body) > 3:
        assert fit.rms.min() > 0.01  # three markers lie in a plane: their mirror image is a rotation
