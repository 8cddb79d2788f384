"""Rigid fit of markers, against rotations that the test made itself."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from afo_sim.gait_lab.trial.clusters import fit_rigid

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


def test_a_quarter_turn_about_z():
    fit = fit_rigid(BODY, (BODY @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))[None])
    np.testing.assert_allclose(fit.place(np.array([1.0, 0.0, 0.0])), [[0.0, 1.0, 0.0]], atol=1e-12)


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
