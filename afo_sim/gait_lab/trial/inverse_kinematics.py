"""A model posed as a whole over a trial's markers (inverse kinematics), and the legs that it then has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.opensim_joint import Pose
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.readers.signals import nearest_of
from afo_sim.gait_lab.trial.clusters import fit_rigid
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.model_leg import ModelLeg, find_leg
from afo_sim.gait_lab.trial.model_segments import MISFIT, UNSEEN

_STEPS = 100  # of the search, which takes about ten (assumed)
_LARGEST = 0.5  # step of a coordinate: a joint far from its place would else turn right round [rad] (assumed)
_SMALL = 1e-5  # step that counts as none [rad] or [m] (assumed)
_PROBE = 1e-6  # by which a coordinate is moved for a derivative [rad] or [m] (assumed)
_WEAK = 1e-9  # added to the normal matrix: what a marker 0.03 mm off an axis gives [m²] (assumed)

_DILUTION = 5.0  # error of a point over that of a marker, above which a frame does not show it (assumed)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree of bodies, its free coordinates, and the markers that a trial has of it."""

    model: OpenSimModel
    links: Mapping[str, str]  # body: the one that carries it; those nearer to the root come first
    free: tuple[tuple[str, str], ...] = ()  # (coordinate, the body that it moves)
    markers: tuple[str, ...] = ()

    @property
    def root(self) -> str:
        """The body that no other one carries."""
        return next(iter(self.links.values()))

    @property
    def places(self) -> list[tuple[str, np.ndarray]]:
        """The markers: their bodies, and their places there [m] (3,)."""
        return [self.model.markers[name] for name in self.markers]

    def beyond(self, body: str) -> set[str]:
        """A body and all that it carries."""
        found = {body}
        for far, near in self.links.items():
            if near in found:
                found.add(far)
        return found

    def joint(self, far: str, q: np.ndarray) -> Pose:
        """A body in the one that carries it, at the free coordinates (n, free)."""
        values = {name: q[:, k] for k, (name, body) in enumerate(self.free) if body == far}
        return self.model.pose(self.links[far], far, values)

    def bodies(self, q: np.ndarray, root: Pose) -> dict[str, Pose]:
        """Every body in the laboratory, at the free coordinates (n, free)."""
        found = {self.root: root}
        for far, near in self.links.items():
            found[far] = found[near] @ self.joint(far, q)
        return found


@dataclass(frozen=True, eq=False)
class Posed:
    """A skeleton over time. Its unknowns are way and turn of the root, six in all, and the coordinates."""

    skeleton: Skeleton
    q: np.ndarray  # the free coordinates [rad] or [m] (n, free)
    bodies: Mapping[str, Pose]  # in the laboratory
    missed: np.ndarray  # seen minus posed markers, 0 where not seen [m] (n, markers, 3)
    known: np.ndarray  # whether a marker was seen (n, markers)

    @property
    def cost(self) -> np.ndarray:
        """Sum of the squared distances [m²] (n,)."""
        return np.asarray((self.missed**2).sum(axis=(1, 2)))

    @property
    def error(self) -> float:
        """Standard error of a marker's coordinate that the residual shows [m]."""
        excess = 3 * self.known.sum(axis=1) - 6 - len(self.skeleton.free)
        return float(np.sqrt(self.cost.sum() / max(excess[excess > 0].sum(), 1)))

    def rms(self, bodies: Sequence[str]) -> float:
        """Distance between seen and posed markers of some bodies, root of the mean square [m]."""
        kept = np.array([body in bodies for body, _ in self.skeleton.places])
        return float(np.sqrt((self.missed[:, kept] ** 2).sum() / max(self.known[:, kept].sum(), 1)))

    def dilution(self, body: str, point: np.ndarray) -> np.ndarray:
        """Standard error of a point of a body in a plane, over that of a marker's coordinate (n,)."""
        normal, _ = self.equations
        moves = self._moves([(body, self.bodies[body].point(point))])[:, 0]
        spread = np.linalg.solve(normal + _WEAK * np.eye(normal.shape[1]), np.swapaxes(moves, 1, 2))
        return np.asarray(np.sqrt(2.0 / 3.0 * np.einsum("nic,nci->n", moves, spread)))

    @cached_property
    def equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix (n, unknowns, unknowns) and right side (n, unknowns) of the least squares."""
        posed = [(body, self.bodies[body].point(place)) for body, place in self.skeleton.places]
        moves = self._moves(posed) * self.known[:, :, None, None]
        flat = moves.reshape(len(moves), -1, moves.shape[-1])
        turned = np.swapaxes(flat, 1, 2)
        return turned @ flat, (turned @ self.missed.reshape(len(moves), -1, 1))[..., 0]

    def where(self, kept: np.ndarray, other: "Posed") -> "Posed":
        """This in some frames (n,), another in the rest."""

        def either(mine: np.ndarray, its: np.ndarray) -> np.ndarray:
            return np.where(kept.reshape(-1, *[1] * (mine.ndim - 1)), mine, its)

        bodies = {
            name: Pose(
                either(pose.rotation, other.bodies[name].rotation),
                either(pose.position, other.bodies[name].position),
            )
            for name, pose in self.bodies.items()
        }
        q, missed = either(self.q, other.q), either(self.missed, other.missed)
        return Posed(self.skeleton, q, bodies, missed, self.known)

    def _moves(self, points: Sequence[tuple[str, np.ndarray]]) -> np.ndarray:
        """How points of bodies, at (n, 3) in the laboratory, follow the unknowns (n, points, 3, unknowns)."""
        paths = np.stack([path for _, path in points], axis=1)
        found = np.zeros((*paths.shape, 6 + len(self.skeleton.free)))
        found[..., :3] = np.eye(3)
        arms = paths - self.bodies[self.skeleton.root].position[:, None]
        found[..., 3:6] = np.swapaxes(np.cross(np.eye(3), arms[:, :, None]), 2, 3)
        for k, (_, far) in enumerate(self.skeleton.free):
            beyond = self.skeleton.beyond(far)
            carried = np.array([body in beyond for body, _ in points])
            # the displacement in the laboratory of this body and all beyond as the coordinate moves a little
            probe = self.skeleton.joint(far, self.q + _PROBE * np.eye(self.q.shape[1])[k])
            there = self.bodies[self.skeleton.links[far]] @ probe @ self.bodies[far].inverse()
            moved = paths[:, carried] @ np.swapaxes(there.rotation, 1, 2) + there.position[:, None]
            found[..., 6 + k][:, carried] = (moved - paths[:, carried]) / _PROBE
        return found


def skeleton_of(model: OpenSimModel, root: str, ends: Sequence[str], seen: Sequence[str]) -> Skeleton:
    """The bodies from a root to some ends; free is what the model does not lock and a seen marker shows."""
    links: dict[str, str] = {}
    moved: list[tuple[str, str]] = []
    for end in ends:
        for joint, outward in model.path(root, end):
            near, far = (joint.parent, joint.child) if outward else (joint.child, joint.parent)
            if far not in links:
                links[far] = near
                moved += [(c.name, far) for c in joint.coordinates if not c.locked]
    bare = Skeleton(model, links)
    markers = tuple(name for name in seen if model.markers[name][0] in bare.beyond(root))
    marked = {model.markers[name][0] for name in markers}
    free = tuple((name, far) for name, far in moved if marked & bare.beyond(far))
    return Skeleton(model, links, free, markers)


def pose_over(skeleton: Skeleton, seen: Mapping[str, np.ndarray], start: Pose) -> Posed:
    """Find the pose of least squares over the markers, each of equal weight, in all frames at once."""
    paths = np.stack([seen[name] for name in skeleton.markers], axis=1)
    default = {c.name: c.default for joint in skeleton.model.joints for c in joint.coordinates}
    usual = [default[name] for name, _ in skeleton.free]
    best = _try(skeleton, np.tile(usual, (len(paths), 1)), start, paths)
    damping = np.full(len(paths), 1e-3)
    for _ in range(_STEPS):
        normal, right = best.equations
        ridge = damping[:, None] * np.einsum("ncc->nc", normal) + _WEAK
        step = np.linalg.solve(normal + ridge[:, :, None] * np.eye(ridge.shape[1]), right[..., None])[..., 0]
        moving = np.abs(step).max(axis=1) >= _SMALL
        if not moving.any():
            return best
        step = step / np.maximum(np.abs(step[:, 3:]).max(axis=1, keepdims=True) / _LARGEST, 1.0)
        new = _try(skeleton, best.q + step[:, 6:], _moved(best.bodies[skeleton.root], step), paths)
        better = new.cost < best.cost
        best = new.where(better, best)
        damping = np.clip(np.where(better, damping / 10.0, damping * 10.0), 1e-9, 1e9)
    raise InputError(f"inverse kinematics did not settle in {moving.sum()} of {len(paths)} frames")


def _try(skeleton: Skeleton, q: np.ndarray, root: Pose, paths: np.ndarray) -> Posed:
    bodies = skeleton.bodies(q, root)
    missed = paths - np.stack([bodies[body].point(place) for body, place in skeleton.places], axis=1)
    known = np.isfinite(missed).all(axis=2)
    return Posed(skeleton, q, bodies, np.where(known[..., None], missed, 0.0), known)


def _moved(root: Pose, step: np.ndarray) -> Pose:
    """The root after a way along the laboratory's axes [m] and a turn about them [rad]."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(step[:, 3:6]).as_matrix()
    return Pose(turn @ root.rotation, root.position + step[:, :3])


def posed_legs(
    model: OpenSimModel, legs: Mapping[str, LegPoints], seen: Mapping[str, np.ndarray]
) -> dict[str, LegPoints]:
    """Pose pelvis and legs with the model's joints; where that fails, leave the segments as they are."""
    found = {side: find_leg(model, side) for side in legs}
    bodies = [leg.bodies for leg in found.values()]
    root, ends = bodies[0]["pelvis"], [each.get("toes", each["foot"]) for each in bodies]
    try:
        posed = pose_over(skeleton_of(model, root, ends, list(seen)), seen, _start(model, root, seen))
        return {side: _leg(posed, found[side], legs[side]) for side in legs}
    except InputError as error:
        text = "every segment is laid over its own markers, as the whole model cannot be posed: {reason}"
        why = note("model-not-posed", text, reason=str(error))
        return {side: replace(leg, notices=(why, *leg.notices)) for side, leg in legs.items()}


def _start(model: OpenSimModel, root: str, seen: Mapping[str, np.ndarray]) -> Pose:
    """The root laid over its own markers; in a gap, where it stands in the nearest frame."""
    names = [name for name in seen if model.markers[name][0] == root]
    if len(names) < 3:
        raise InputError(f"of the {root}, only {', '.join(names) or 'nothing'} is seen")
    own = np.array([model.markers[name][1] for name in names])
    fit = fit_rigid(own, np.stack([seen[name] for name in names], axis=1))
    shown = np.flatnonzero(np.isfinite(fit.rms))
    if not len(shown):
        raise InputError(f"no frame shows three markers of the {root} off a line")
    near = nearest_of(shown, len(fit.rms))
    return Pose(fit.rotation[near], fit.position[near])


def _leg(posed: Posed, leg: ModelLeg, laid: LegPoints) -> LegPoints:
    """The points of a leg, in place of those of segments laid one by one."""
    points = {}
    for role, (segment, place) in leg.points.items():
        path, error = _shown(posed, leg.bodies[segment], place)
        if not np.isfinite(path).any():
            raise InputError(f"no frame shows the {leg.side} {role}")
        how = leg.foot.sources.get(role, "posed with the whole model")
        off = float(np.hypot(error, leg.foot.error.get(role, UNSEEN)))
        points[role] = LegPoint(path, how, off, laid.points[role].better)
    pelvis, _ = _shown(posed, leg.bodies["pelvis"], np.zeros(3))
    notices = *laid.warnings, *_residuals(posed, leg)
    return replace(laid, points=points, pelvis=pelvis, notices=notices)


def _shown(posed: Posed, body: str, place: np.ndarray) -> tuple[np.ndarray, float]:
    """Path of a point of a body, NaN where too little is seen (n, 3) [m], and its standard error [m]."""
    dilution = posed.dilution(body, place)
    shown = dilution < _DILUTION
    error = posed.error * float(np.median(dilution[shown])) if shown.any() else float("nan")
    return np.where(shown[:, None], posed.bodies[body].point(place), np.nan), error


def _residuals(posed: Posed, leg: ModelLeg) -> tuple[Notice, ...]:
    """How well the whole model meets the markers, and the leg's parts of it; a warning where badly."""
    bodies = {s if s == "pelvis" else f"{leg.side} {s}": [body] for s, body in leg.bodies.items()}
    bodies[f"{leg.side} foot"] += bodies.pop(f"{leg.side} toes", [])
    parts_mm = ", ".join(f"{part} {1e3 * posed.rms(of):.1f}" for part, of in bodies.items())
    rms = posed.rms(list(posed.bodies))
    text = "whole model posed over {markers} markers (inverse kinematics): residual {rms_mm:.1f} mm RMS"
    whole = note("model-posed", text, markers=len(posed.skeleton.markers), rms_mm=1e3 * rms)
    text = "residuals of the posed model [mm]: {parts}"
    each = note("model-parts-posed", text, subject=leg.side, parts=parts_mm)
    if not rms > MISFIT:
        return whole, each
    text = "the posed model misses the trial's markers by {rms_mm:.0f} mm RMS: another person's model?"
    return whole, each, Notice("model-misfit", text, rms_mm=1e3 * rms)
