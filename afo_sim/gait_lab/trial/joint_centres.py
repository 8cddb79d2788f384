"""Joint centres from markers on the skin: regressions and offsets, with their errors."""

import math
from dataclasses import dataclass

import numpy as np

_MARKER_RADIUS = 0.007  # centre of a 14 mm marker above the skin (assumed) [m]
_MM = 1e-3

# Standard errors in the sagittal plane [m]. The regressions' own are leave-one-out errors forward and upward;
# they were found on landmarks in images, and markers on the skin lie a centimetre off them (assumed).
_PALPATION = 0.010
HARRINGTON_ERROR = math.hypot(5.2 * _MM, 3.6 * _MM, _PALPATION)  # Harrington et al. 2007, 32 persons
_HARA_ERROR = math.hypot(5.2 * _MM, 4.4 * _MM, _PALPATION)  # Hara et al. 2016, 180 persons
TROCHANTER_ERROR = 0.025  # of the greater trochanter as the hip centre (assumed) [m]

# The plane of the iliac spines in standing leans forward and down; about 10 deg, 5 deg from person to person
# (assumed, for marker sets without any marker at the back of the pelvis).
_PELVIC_TILT, _PELVIC_TILT_SPREAD = math.radians(10.0), math.radians(5.0)

# From the lateral malleolus' marker to the midpoint of both malleoli, forward and up: 10.5 and 9.5 mm in the
# example walk of BMClab, 6.7 and -1.4 mm in OpenSim's example of 3-D walking, 7.2 and 9.4 mm in subject01 of
# gait2354, 1.0 and 7.9 mm in OpenSim's example C3D files: their mean, and their standard deviation (derived).
ANKLE_FROM_MALLEOLUS = (0.0063, 0.0064)
ANKLE_LATERAL_ERROR = math.hypot(3.9 * _MM, 5.2 * _MM)
# The knee's lateral marker lies 5 mm behind to 11 mm ahead of the midpoint in these persons (derived).
KNEE_LATERAL_ERROR = 0.008
MEDIAL_ERROR = 0.015  # of the medial marker alone (assumed) [m]
MIDPOINT_ERROR = 0.005  # of palpation (assumed) [m]


@dataclass(frozen=True, eq=False)
class PelvisFrame:
    """Origin midway between the anterior iliac spines, and unit vectors; each (n, 3)."""

    origin: np.ndarray
    forward: np.ndarray
    up: np.ndarray
    right: np.ndarray

    def place(self, offset: tuple[float, float, float]) -> np.ndarray:
        """A point by its way forward, up and to the right [m] → its path (n, 3) [m]."""
        forward, up, right = offset
        return np.asarray(self.origin + forward * self.forward + up * self.up + right * self.right)


def pelvis_frame(right: np.ndarray, left: np.ndarray, back: np.ndarray, below: np.ndarray) -> PelvisFrame:
    """The pelvis' own axes: its plane holds spines and back; `below` are points of the legs (k, n, 3)."""
    origin = 0.5 * (right + left)
    across = _unit(right - left)
    forward = _unit(without(origin - back, across))
    up = np.cross(across, forward)
    if _mostly_negative(np.sum(up * (origin - below), axis=-1)):
        up = -up  # the laboratory's axes are left-handed
    return PelvisFrame(origin, forward, up, across)


def level_pelvis_frame(
    right: np.ndarray, left: np.ndarray, vertical: np.ndarray, ahead: np.ndarray
) -> PelvisFrame:
    """The pelvis' axes where nothing marks its back: `_PELVIC_TILT` is assumed."""
    across = _unit(right - left)
    up = _unit(without(np.broadcast_to(vertical, across.shape), across))
    forward = np.cross(up, across)
    if _mostly_negative(np.sum(forward * ahead, axis=-1)):
        forward = -forward
    cosine, sine = math.cos(_PELVIC_TILT), math.sin(_PELVIC_TILT)
    ahead, above = cosine * forward - sine * up, cosine * up + sine * forward
    return PelvisFrame(0.5 * (right + left), ahead, above, across)


def hip_by_harrington(width: float, depth: float, side: str) -> tuple[float, float, float]:
    """The hip centre by the width and depth of the pelvis."""
    forward = -0.24 * depth - 9.9 * _MM - _MARKER_RADIUS
    up = -0.30 * width - 10.9 * _MM
    right = 0.33 * width + 7.3 * _MM
    return forward, up, right if side == "right" else -right


def hip_by_hara(leg_length: float, side: str) -> tuple[float, float, float]:
    """The hip centre by the length of the leg."""
    forward = 11.0 * _MM - 0.063 * leg_length - _MARKER_RADIUS
    up = -9.0 * _MM - 0.078 * leg_length
    right = 8.0 * _MM + 0.086 * leg_length
    return forward, up, right if side == "right" else -right


def hara_error_without_back(leg_length: float) -> float:
    """Standard error of Hara's hip where the pelvis' tilt is assumed [m]."""
    forward, up, _ = hip_by_hara(leg_length, "right")
    return math.hypot(_HARA_ERROR, _PELVIC_TILT_SPREAD * math.hypot(forward, up))


def ankle_by_malleolus(
    malleolus: np.ndarray, knee: np.ndarray, heel: np.ndarray, toe: np.ndarray
) -> np.ndarray:
    """The ankle centre by the lateral malleolus alone: moved forward and up by the usual offset."""
    up = _unit(knee - malleolus)
    foot = _unit(toe - heel)
    unseen = ~np.isfinite(foot).all(axis=1)
    foot[unseen] = np.median(foot[~unseen], axis=0) if not unseen.all() else np.nan
    ahead, above = ANKLE_FROM_MALLEOLUS
    return np.asarray(malleolus + ahead * _unit(without(foot, up)) + above * up)


def _mostly_negative(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(len(known)) and float(np.median(known)) < 0.0


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (…, 3) at length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def without(vectors: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Vectors (…, 3) less their part along a unit direction."""
    return np.asarray(vectors - np.sum(vectors * direction, axis=-1, keepdims=True) * direction)
