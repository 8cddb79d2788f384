"""Least-squares place of a rigid body from its markers, frame by frame."""

from dataclasses import dataclass

import numpy as np

OFF_LINE = 0.01  # spread of markers across their line, over the spread along it, below which the turn
# about the line counts as unknown (assumed)


@dataclass(frozen=True, eq=False)
class RigidFit:
    """Place of a body over time; NaN in a frame that shows too few of its markers."""

    rotation: np.ndarray  # from the body's axes to the laboratory's (n, 3, 3)
    position: np.ndarray  # of the body's origin, in the laboratory's axes [m] (n, 3)
    rms: np.ndarray  # distance between seen and fitted markers, root of the mean square [m] (n,)

    def place(self, point: np.ndarray) -> np.ndarray:
        """A point of the body (3,) [m] → its path in the laboratory (n, 3) [m]."""
        return np.asarray(self.rotation @ point + self.position)


def fit_rigid(local: np.ndarray, seen: np.ndarray) -> RigidFit:
    """Find `rotation` and `position` so that seen = rotation @ local + position, at best.

    The rotation is proper: mirrored markers give a bad fit, never a reflection. Method of Kabsch (1976)
    and Arun, Huang and Blostein (1987): singular values of the 3 by 3 cross-covariance.

    Units: local [m] (k, 3), seen [m] (n, k, 3).
    """
    local, seen = np.asarray(local, dtype=float), np.asarray(seen, dtype=float)
    known = np.all(np.isfinite(seen), axis=2) & np.all(np.isfinite(local), axis=1)  # (n, k)
    weight = known[..., None].astype(float)
    count = known.sum(axis=1)
    share = 1.0 / np.maximum(count, 1)[:, None]
    body = np.where(known[..., None], local, 0.0)  # (n, k, 3)
    laboratory = np.where(known[..., None], seen, 0.0)
    middle, centre = body.sum(axis=1) * share, laboratory.sum(axis=1) * share
    body = weight * (body - middle[:, None])
    laboratory = weight * (laboratory - centre[:, None])
    left, spread, right = np.linalg.svd(np.einsum("nki,nkj->nij", laboratory, body))
    left[:, :, 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))[:, None]
    rotation = left @ right
    position = centre - np.einsum("nij,nj->ni", rotation, middle)
    missed = laboratory - body @ rotation.transpose(0, 2, 1)
    rms = np.sqrt((missed**2).sum(axis=(1, 2)) * share[:, 0])
    known_turn = spread[:, 1] > OFF_LINE**2 * spread[:, 0]  # of the cross-covariance: squares of spreads
    lost = ~((count >= 3) & known_turn)
    rotation[lost], position[lost], rms[lost] = np.nan, np.nan, np.nan
    return RigidFit(rotation, position, rms)
