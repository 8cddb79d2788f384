"""Marker sets as laboratories name them, each marker a point of a segment of the known walker.

`{S}` stands for R or L, `{s}` for r or L (OpenCap's). Places are the right leg's; the left one's are
mirrored. The lateral malleolus lies 10 mm behind and 9.5 mm below the ankle centre, the medial one as much
before and above, so that their midpoint is the centre; the epicondyles' is the knee centre.
"""

import numpy as np
from gait_lab import known_walker

Place = tuple[str, tuple[float, float, float]]


def _at(segment: str, centre: np.ndarray, *offset: float) -> Place:
    x, y, z = centre + np.array(offset)
    return segment, (float(x), float(y), float(z))


_KNEE, _ANKLE = known_walker.knee_in_femur("right"), known_walker.ankle_in_tibia("right")
RADIUS = 0.007  # of a marker, whose centre is so far ahead of the iliac spine [m]
ASIS: Place = ("pelvis", (RADIUS, 0.0, 0.5 * known_walker.PELVIS_WIDTH))
PSIS: Place = ("pelvis", (RADIUS - known_walker.PELVIS_DEPTH, 0.0, 0.045))
SACRUM: Place = ("pelvis", (RADIUS - known_walker.PELVIS_DEPTH, 0.0, 0.0))
HIP_CENTRE: Place = ("pelvis", (*known_walker.HIP, known_walker.HIP_Z))
KNEE_CENTRE, ANKLE_CENTRE = _at("femur", _KNEE, 0, 0, 0), _at("tibia", _ANKLE, 0, 0, 0)
TROCHANTER: Place = ("femur", (-0.01, -0.01, 0.075))
KNEE_LATERAL, KNEE_MEDIAL = _at("femur", _KNEE, 0, 0, 0.05), _at("femur", _KNEE, 0, 0, -0.05)
ANKLE_LATERAL = _at("tibia", _ANKLE, -0.010, -0.0095, 0.035)
ANKLE_MEDIAL = _at("tibia", _ANKLE, 0.010, 0.0095, -0.035)
THIGH_MARKERS: tuple[Place, ...] = tuple(
    ("femur", p) for p in ((0.08, -0.15, 0.05), (0.05, -0.22, 0.09), (0.09, -0.28, 0.04))
)
SHANK_MARKERS: tuple[Place, ...] = tuple(
    ("tibia", p) for p in ((0.05, -0.12, 0.04), (0.03, -0.2, 0.06), (0.05, -0.28, 0.02))
)
HEEL: Place = ("foot", (-0.06, -0.045, 0.0))
MT1: Place = ("foot", (0.135, -0.045, -0.04))
MT2: Place = ("foot", (0.14, -0.035, 0.0))
MT5: Place = ("foot", (0.115, -0.05, 0.05))
MIDFOOT: Place = ("foot", (0.07, 0.0, 0.0))
MIDFOOT_LATERAL: Place = ("foot", (0.05, -0.045, 0.04))
TOE_TIP: Place = ("toes", (0.05, 0.0, 0.0))
C7: Place = ("trunk", (-0.09, 0.21, 0.0))
T10: Place = ("trunk", (-0.10, -0.05, 0.0))
CLAVICLE: Place = ("trunk", (0.06, 0.16, 0.0))
STERNUM: Place = ("trunk", (0.10, 0.03, 0.0))
SHOULDER: Place = ("trunk", (-0.02, 0.19, 0.18))
HEAD: Place = ("trunk", (-0.02, 0.48, 0.0))

_CLUSTERS = {f"{{S}}.TH{k}": p for k, p in enumerate(THIGH_MARKERS, 1)} | {
    f"{{S}}.SH{k}": p for k, p in enumerate(SHANK_MARKERS, 1)
}

SETS: dict[str, dict[str, Place]] = {
    "plug-in gait": {
        "{S}ASI": ASIS, "{S}PSI": PSIS, "{S}THI": THIGH_MARKERS[1], "{S}KNE": KNEE_LATERAL,
        "{S}TIB": SHANK_MARKERS[1], "{S}ANK": ANKLE_LATERAL, "{S}HEE": HEEL, "{S}TOE": MT2,
        "C7": C7, "T10": T10, "CLAV": CLAVICLE, "STRN": STERNUM, "{S}SHO": SHOULDER,
    },
    "helen hayes": {
        "{S}ASI": ASIS, "SACR": SACRUM, "{S}KNE": KNEE_LATERAL, "{S}ANK": ANKLE_LATERAL, "{S}HEE": HEEL,
        "{S}TOE": MT2,
    },
    "gait2392": {
        "{S}.ASIS": ASIS, "V.Sacral": SACRUM, "{S}.Thigh.Upper": THIGH_MARKERS[0],
        "{S}.Thigh.Front": THIGH_MARKERS[1], "{S}.Thigh.Rear": THIGH_MARKERS[2], "{S}.Knee.Lat": KNEE_LATERAL,
        "{S}.Shank.Upper": SHANK_MARKERS[0], "{S}.Shank.Front": SHANK_MARKERS[1],
        "{S}.Shank.Rear": SHANK_MARKERS[2], "{S}.Ankle.Lat": ANKLE_LATERAL, "{S}.Heel": HEEL,
        "{S}.Midfoot.Sup": MIDFOOT, "{S}.Midfoot.Lat": MIDFOOT_LATERAL, "{S}.Toe.Tip": TOE_TIP,
        "{S}.Toe.Lat": MT5, "{S}.Toe.Med": MT1,
        "Sternum": STERNUM, "{S}.Acromium": SHOULDER, "Top.Head": HEAD,
    },
    "rajagopal": {
        "{S}ASI": ASIS, "{S}PSI": PSIS, "{S}LFC": KNEE_LATERAL, "{S}MFC": KNEE_MEDIAL,
        "{S}LMAL": ANKLE_LATERAL, "{S}MMAL": ANKLE_MEDIAL, "{S}CAL": HEEL, "{S}TOE": MT2, "{S}MT5": MT5,
        "C7": C7, "CLAV": CLAVICLE, "{S}ACR": SHOULDER,
    },
    "rajagopal, joint centres": {
        "{S}ASI": ASIS, "{S}PSI": PSIS, "{S}HJC": HIP_CENTRE, "{S}KJC": KNEE_CENTRE, "{S}AJC": ANKLE_CENTRE,
        "{S}CAL": HEEL, "{S}TOE": MT2, "{S}MT5": MT5,
    },
    "moco": {
        "{S}.ASIS": ASIS, "{S}.PSIS": PSIS, "S2": SACRUM, "{S}.Knee": KNEE_LATERAL,
        "{S}.Ankle": ANKLE_LATERAL, "{S}.Heel": HEEL, "{S}.MT5": MT5, "{S}.Toe": TOE_TIP, **_CLUSTERS,
        "C7": C7, "CLAV": CLAVICLE, "{S}.Shoulder": SHOULDER,
    },
    "opensim c3d": {
        "{S}ASI": ASIS, "{S}PSI": PSIS, "{S}LFC": KNEE_LATERAL, "{S}MFC": KNEE_MEDIAL,
        "{S}LMAL": ANKLE_LATERAL, "{S}MMAL": ANKLE_MEDIAL, "{S}CAL": HEEL, "{S}MT1": MT1, "{S}MT2": MT2,
        "C7": C7, "CLAV": CLAVICLE, "{S}ACR": SHOULDER,
    },
    "bmc": {
        "{S}.ASIS": ASIS, "{S}.PSIS": PSIS, "{S}.GTR": TROCHANTER, "{S}.Knee": KNEE_LATERAL,
        "{S}.Knee.Medial": KNEE_MEDIAL, "{S}.Ankle": ANKLE_LATERAL, "{S}.Ankle.Medial": ANKLE_MEDIAL,
        "{S}.Heel": HEEL, "{S}.MT1": MT1, "{S}.MT2": MT2, "{S}.MT5": MT5,
    },
    "isb": {
        "{S}ASIS": ASIS, "{S}PSIS": PSIS, "{S}LE": KNEE_LATERAL, "{S}ME": KNEE_MEDIAL, "{S}LM": ANKLE_LATERAL,
        "{S}MM": ANKLE_MEDIAL, "{S}CA": HEEL, "{S}FM": MT1, "{S}VM": MT5,
    },
    "opencap": {
        "{s}.ASIS_study": ASIS, "{s}.PSIS_study": PSIS, "{s}_knee_study": KNEE_LATERAL,
        "{s}_mknee_study": KNEE_MEDIAL, "{s}_ankle_study": ANKLE_LATERAL, "{s}_mankle_study": ANKLE_MEDIAL,
        "{s}_calc_study": HEEL, "{s}_5meta_study": MT5, "{s}_toe_study": MT2,
        "C7_study": C7, "{s}_shoulder_study": SHOULDER,
    },
    "cast": {
        "{S}_IAS": ASIS, "{S}_IPS": PSIS, "{S}_FLE": KNEE_LATERAL, "{S}_FME": KNEE_MEDIAL,
        "{S}_FAL": ANKLE_LATERAL, "{S}_TAM": ANKLE_MEDIAL, "{S}_FCC": HEEL, "{S}_FM1": MT1, "{S}_FM2": MT2,
        "{S}_FM5": MT5,
    },
}  # fmt: skip
# What a standing trial of a set has beside it: the inner side's markers.
STANDING: dict[str, dict[str, Place]] = {
    "plug-in gait": {"{S}KNEM": KNEE_MEDIAL, "{S}MED": ANKLE_MEDIAL},
    "helen hayes": {"{S}KNEM": KNEE_MEDIAL, "{S}MED": ANKLE_MEDIAL},
    "gait2392": {"{S}.Knee.Med": KNEE_MEDIAL, "{S}.Ankle.Med": ANKLE_MEDIAL},
    "moco": {"{S}.Knee.Medial": KNEE_MEDIAL, "{S}.Ankle.Medial": ANKLE_MEDIAL},
}


def placed(name: str, *, standing: bool = False) -> dict[str, tuple[str, np.ndarray]]:
    """Markers of both sides of a set: name → (segment with its side, local place (3,) [m])."""
    found: dict[str, tuple[str, np.ndarray]] = {}
    extra = STANDING.get(name, {}) if standing else {}
    for pattern, (segment, place) in (SETS[name] | extra).items():
        for side, sign in known_walker.SIGN.items():
            letter = side[0]
            label = pattern.format(S=letter.upper(), s=letter if letter == "r" else "L")
            part = segment if segment in ("pelvis", "trunk") else f"{segment}_{letter}"
            found[label] = part, np.array(place) * [1.0, 1.0, sign]
    return found


def in_world(
    walker: known_walker.Walker,
    name: str,
    time: np.ndarray,
    *,
    segments: dict | None = None,
    standing: bool = False,
) -> dict[str, np.ndarray]:
    """Trajectories of a set's markers in the world, each (n, 3) [m]."""
    segments = segments or walker.segments(time)
    found = {}
    for label, (segment, place) in placed(name, standing=standing).items():
        rotation, origin = segments[segment]
        found[label] = rotation @ (walker.size * place) + origin
    return found
