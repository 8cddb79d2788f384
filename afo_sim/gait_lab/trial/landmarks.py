"""Landmarks of both legs over time, and the ways in which they give the points of a leg."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial import joint_centres
from afo_sim.gait_lab.trial.choices import SIDES, axis_vector, nearest_axis
from afo_sim.gait_lab.trial.clusters import completed
from afo_sim.gait_lab.trial.leg_points import LegPoint, mean_place
from afo_sim.gait_lab.trial.marker_sets import LANDMARKS
from afo_sim.gait_lab.trial.roles import Roles

_MODEL = "the person's scaled model"
_STATIC = f"a standing trial with medial markers, or {_MODEL}"

# The ways to each point, the best first: landmarks whose midpoint counts.
_WAYS = {
    "knee": (("knee_centre",), ("knee_lateral", "knee_medial"), ("knee_lateral",), ("knee_medial",)),
    "ankle": (("ankle_centre",), ("ankle_lateral", "ankle_medial"), ("ankle_lateral",), ("ankle_medial",)),
    "heel": (("heel",),),
    "toe": (
        ("metatarsal_1", "metatarsal_5"),
        ("metatarsal_2",),
        ("metatarsal_5",),
        ("metatarsal_1",),
        ("toe_tip",),
    ),
}
# Landmarks of which one or more would give a point, for the message that it is missing.
NEEDED = {
    role: tuple(dict.fromkeys(mark for group in ways for mark in group)) for role, ways in _WAYS.items()
}
NEEDED["hip"] = ("hip_centre", "asis", "psis", "trochanter")
_PELVIS = ("asis", "psis", "sacrum")
# From a marker, beyond which a given centre is none: half a joint's width and a third more (assumed) [m]
_REACH = {
    "hip_centre": ("asis", 0.2),
    "knee_centre": ("knee_lateral", 0.1),
    "ankle_centre": ("ankle_lateral", 0.08),
}


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Paths of landmarks by side [m] (n, 3), with the markers' names."""

    names: Mapping[str, Mapping[str, tuple[str, ...]]]  # side → landmark → markers
    paths: Mapping[str, Mapping[str, np.ndarray]]
    up: str | None = None  # the laboratory's axis upward, where a person says it
    notices: tuple[Notice, ...] = ()

    def ways(self, side: str, role: str) -> list[LegPoint | None]:
        """Ways to a point of a leg, the best first; None where a landmark is missing."""
        if role == "hip":
            marks = ("hip_centre",), ("trochanter",)
            given, trochanter = (self._midpoint(side, "hip", mark) for mark in marks)
            return [given, self._harrington(side), self._hara(side), trochanter]
        return [self._midpoint(side, role, group) for group in _WAYS[role]]

    def pelvis(self) -> np.ndarray | None:
        """Mean of the pelvis' markers [m] (n, 3); None if it has none."""
        marks = [(side, mark) for side in SIDES for mark in _PELVIS if mark in self.paths[side]]
        paths = {self.names[side][mark]: self.paths[side][mark] for side, mark in marks}  # the sacrum once
        return np.mean(list(paths.values()), axis=0) if paths else None

    def vertical(self) -> np.ndarray | None:
        """The laboratory's axis nearest to the shanks' direction upward, a unit vector (3,)."""
        if self.up is not None:
            return axis_vector(self.up)
        shanks = [
            knee.path - ankle.path
            for side in SIDES
            if (knee := first(self.ways(side, "knee"))) and (ankle := self._lowest(side))
        ]
        mean = mean_place(np.concatenate([np.zeros((0, 3)), *shanks]))
        return axis_vector(nearest_axis(mean)) if np.isfinite(mean).all() else None

    def _lowest(self, side: str) -> LegPoint | None:
        return first([self._plain(side, group) for group in (*_WAYS["ankle"], *_WAYS["heel"])])

    def _plain(self, side: str, group: tuple[str, ...]) -> LegPoint | None:
        paths, names = self.paths[side], self.names[side]
        if not all(landmark in paths for landmark in group):
            return None
        markers = " and ".join(name for landmark in group for name in names[landmark])
        path = np.mean([paths[landmark] for landmark in group], axis=0)
        midpoint = len(group) > 1 or len(names[group[0]]) > 1
        return LegPoint(path, f"midpoint of {markers}" if midpoint else markers)

    def _midpoint(self, side: str, role: str, group: tuple[str, ...]) -> LegPoint | None:
        """A point by landmarks, with its error and what would be better."""
        point = self._plain(side, group)
        if point is None or role in ("heel", "toe"):
            return point
        if group[0].endswith("centre"):
            return replace(point, way="a centre given in the file")
        if role == "hip":
            way, better = "the greater trochanter for the centre", f"markers on the pelvis, or {_MODEL}"
            return replace(point, way=way, error=joint_centres.TROCHANTER_ERROR, better=better)
        if len(group) == 2:
            return replace(point, error=joint_centres.MIDPOINT_ERROR)
        if group[0].endswith("medial"):
            return replace(point, way="medial alone", error=joint_centres.MEDIAL_ERROR, better=_STATIC)
        if role == "knee":
            return replace(point, way="lateral alone", error=joint_centres.KNEE_LATERAL_ERROR, better=_STATIC)
        return self._by_malleolus(side, point)

    def _by_malleolus(self, side: str, lateral: LegPoint) -> LegPoint:
        knee, heel, toe = (first(self.ways(side, role)) for role in ("knee", "heel", "toe"))
        if heel is None:
            heel = lateral  # as good for the foot's direction across the shank
        if knee is None or toe is None:
            return replace(lateral, way="lateral alone", error=joint_centres.MEDIAL_ERROR, better=_STATIC)
        ahead, above = (1e3 * offset for offset in joint_centres.ANKLE_FROM_MALLEOLUS)
        path = joint_centres.ankle_by_malleolus(lateral.path, knee.path, heel.path, toe.path)
        way, error = f"{ahead:.1f} mm forward, {above:.1f} up", joint_centres.ANKLE_LATERAL_ERROR
        return LegPoint(path, lateral.source, error, _STATIC, way=way)

    def _harrington(self, side: str) -> LegPoint | None:
        right, left = (self.paths[each].get("asis") for each in SIDES)
        spines = [self.paths[each]["psis"] for each in SIDES if "psis" in self.paths[each]]
        back = np.mean(spines, axis=0) if len(spines) == 2 else self.paths["right"].get("sacrum")
        if right is None or left is None or back is None:
            return None
        legs = (self.paths[each].items() for each in SIDES)
        below = [path for leg in legs for mark, path in leg if LANDMARKS[mark][0] not in ("pelvis", "hip")]
        frame = joint_centres.pelvis_frame(right, left, back, np.stack(below or [np.nan * right]))
        width = _middle(np.linalg.norm(right - left, axis=1))
        depth = _middle(np.linalg.norm(frame.origin - back, axis=1))
        path = frame.place(joint_centres.hip_by_harrington(width, depth, side))
        way, error = f"pelvis {1e3 * width:.0f} × {1e3 * depth:.0f} mm", joint_centres.HARRINGTON_ERROR
        return LegPoint(path, "Harrington 2007", error, _MODEL, way=way)

    def _hara(self, side: str) -> LegPoint | None:
        right, left = (self.paths[each].get("asis") for each in SIDES)
        knee, ankle, vertical = first(self.ways(side, "knee")), self._lowest(side), self.vertical()
        if right is None or left is None or knee is None or ankle is None or vertical is None:
            return None
        heels_toes = [(first(self.ways(each, "heel")), first(self.ways(each, "toe"))) for each in SIDES]
        feet = [toe.path - heel.path for heel, toe in heels_toes if heel and toe]
        if not feet:
            return None
        frame = joint_centres.level_pelvis_frame(right, left, vertical, feet[0])
        spine = right if side == "right" else left
        length = _middle(np.linalg.norm(spine - knee.path, axis=1))
        length += _middle(np.linalg.norm(knee.path - ankle.path, axis=1))
        path = frame.place(joint_centres.hip_by_hara(length, side))
        error = joint_centres.hara_error_without_back(length)
        source = f"Hara 2016 from a leg {1e2 * length:.0f} cm long"
        better = f"markers at the back of the pelvis, or {_MODEL}"
        return LegPoint(path, source, error, better, way="the pelvis' tilt assumed")


def find_landmarks(markers: Markers, roles: Roles, up: str | None) -> Landmarks:
    """The paths of landmarks; a gap of a pelvis marker is filled where three others are seen."""
    paths = {
        side: {landmark: markers.point(names) for landmark, names in roles.sides[side].items()}
        for side in SIDES
    }
    keys = [(side, landmark) for side in SIDES for landmark in _PELVIS if landmark in paths[side]]
    keys = [key for key in keys if key != ("left", "sacrum")]
    whole = completed({f"{side} {landmark}": paths[side][landmark] for side, landmark in keys})
    for side, landmark in keys:
        paths[side][landmark] = whole[f"{side} {landmark}"]
    if "sacrum" in paths["right"] and "sacrum" in paths["left"]:
        paths["left"]["sacrum"] = paths["right"]["sacrum"]
    notices = []
    for side, (centre, (mark, reach)) in itertools.product(SIDES, _REACH.items()):
        if centre in paths[side] and mark in paths[side]:
            off = _middle(np.linalg.norm(paths[side][centre] - paths[side][mark], axis=1))
            if off > reach:
                del paths[side][centre]
                text = "{subject} lies {off_mm:.0f} mm from {marker}: it is no joint centre, and not used"
                names, marker = (" and ".join(roles.sides[side][which]) for which in (centre, mark))
                notices.append(Notice("centre-far", text, subject=names, off_mm=1e3 * off, marker=marker))
    return Landmarks(roles.sides, paths, up, tuple(notices))


def first(ways: list[LegPoint | None]) -> LegPoint | None:
    """The best way that is there."""
    return next((way for way in ways if way is not None), None)


def _middle(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")
