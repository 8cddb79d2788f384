"""Statics of an orthosis about its joint: paths and moment arms over angle, and the tensions that balance.

    L(φ) = |i(φ) − o|,  r = −dL/dφ         path between two anchors and its moment arm; round guides by MuJoCo
    di/dφ = y × (i − c(φ))                  with a joint whose centre c moves
    x(φ) = −r φ,        r constant          path over a pulley, from angle zero
    κ_path = (L0 + s − L)/L0                contraction ratio that the path leaves, s all that is in series
    κ = κ_path + [F/k + Σ z(P)]/L0          own contraction: cable k, anchors z under the pull P = Σ F
    M = Σ r F                               torque, positive as the joint's angle: dorsiflexion, flexion

The same balance as in a run at rest; here from the description alone, without leg. Friction at guides
is left out: at rest it acts either way.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from afo_sim.common import InputError, Json, JsonDict, format_quantity
from afo_sim.description import Joint, Mounting, MuscleGroup, Orthosis, at_rest, reader
from afo_sim.model import paths_of
from afo_sim.physics import LAWS, anchor_displacement, on_anchors, row, tensions

BESIDE = np.radians(2.0)  # beyond the described centres of the joint, up to which they are continued
FINE = 501  # angles by which they are integrated
HALVINGS = 50  # of the pull on the anchors, where several groups share them
# Stiffness [N/m], or 0 and then force [N] and length [m] of one that stiffens.
Anchor = tuple[float, float, float]
Values = Mapping[str, float]  # of what a fit searches, by name [SI]
Tension = Callable[[Sequence[Anchor], np.ndarray | float], np.ndarray]
ANCHORS = ("cuff_stiffness", "plate_stiffness")  # of the joint's segments, in this order
CABLE = {"series_stiffness": ("stiffness", "N/m"), "offset": ("offset", "m")}


@dataclass(frozen=True, eq=False)
class Path:
    """One muscle's path over a set of angles: length [m] (n,), moment arm [m] (n,), and how many have it."""

    group: str  # of muscles
    length: np.ndarray  # of the path [m] (n,)
    arm: np.ndarray  # moment arm [m] (n,)
    count: int  # muscles that have it


def paths(
    orthosis: Orthosis, angle: np.ndarray, measured: Mapping[str, np.ndarray] | None = None
) -> list[Path]:
    """The paths of an orthosis' muscles, alike ones together."""
    found = []
    guided, carried = {}, _carried(orthosis, angle)
    if any(group.path for group in orthosis.muscle.values()):  # over points or surfaces
        known = paths_of(orthosis)
        columns = zip(known.lengths(angle).T, known.moment_arms(angle).T, strict=True)
        guided = dict(zip(known.tendons, columns, strict=True))
    for name, group in orthosis.muscle.items():
        if measured and name in measured:
            length, arm = measured[name]
            found.append(Path(name, length, arm, group.count))
        elif group.pulley is not None:
            arm = np.full(len(angle), group.pulley.moment_arm)
            found.append(Path(name, -arm * angle, arm, group.count))
        else:
            for k in range(1 if group.alike else group.count):
                own = (orthosis.words, group, k, angle, *carried)
                length, arm = guided[f"{name}_{k + 1}"] if group.path else _between(*own)
                found.append(Path(name, length, arm, group.count if group.alike else 1))
    return found


def _carried(orthosis: Orthosis, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ankle and joint's centre on the shank [m] (n,): q = e^(iφ) (q(0) − i ∫ e^(−is) c(s) ds), φ toes up."""
    if not orthosis.joint_centre:
        return np.zeros(len(angle), complex), np.zeros(len(angle), complex)
    known, forward, up = np.transpose(orthosis.joint_centre)
    if angle.min() < known[0] - BESIDE or angle.max() > known[-1] + BESIDE:
        asked = f"rows from {np.degrees(angle.min()):.4g} to {np.degrees(angle.max()):.4g} deg"
        raise InputError("ends within the readings", field="orthosis.joint_centre", allowed=asked)
    turn = orthosis.words.turn
    angle, order = turn * angle, np.argsort(turn * known)
    known, middle = turn * known[order], (forward + 1j * up)[order]
    centre, fine = CubicSpline(known, middle), np.linspace(known[0], known[-1], FINE)
    turned = CubicSpline(fine, np.exp(-1j * fine) * centre(fine)).antiderivative()
    return -1j * np.exp(1j * angle) * (turned(angle) - turned(0.0)), centre(angle)


def _between(
    joint: Joint, group: MuscleGroup, number: int, angle: np.ndarray, moved: np.ndarray, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Length and moment arm of one muscle between two anchors."""
    assert group.origin is not None and group.insertion is not None
    side = number - 0.5 * (group.count - 1)
    ends = {}
    for end in (group.origin, group.insertion):
        x, y, z = end.from_joint
        ends[end.segment] = (x, y + side * end.spacing, z)
    (shank_x, shank_y, shank_z), (x, y, z) = (ends[segment] for segment in joint.segments)
    cos, sin = np.cos(angle), joint.turn * np.sin(angle)  # toes up
    turned_x, turned_z = x * cos - z * sin + moved.real, x * sin + z * cos + moved.imag
    forward, aside, up = turned_x - shank_x, y - shank_y, turned_z - shank_z
    length = np.sqrt(forward**2 + aside**2 + up**2)
    arm = (forward * (turned_z - centre.imag) - up * (turned_x - centre.real)) / length
    return length, joint.turn * arm


def statics(
    orthosis: Orthosis, geometry: Sequence[Path], chamber: str, pressure: np.ndarray, fitted: Values
) -> tuple[np.ndarray, np.ndarray]:
    """Torque and pull on the anchors at rest, with fitted values in place of the orthosis' own."""
    anchors = _anchors(orthosis, fitted)
    pulling, torque, pull = [], np.zeros(len(pressure)), np.zeros(len(pressure))
    for path in geometry:
        tension = _of_path(orthosis, path, chamber, pressure, fitted)
        anchored = orthosis.muscle[path.group].pulley is None
        alone = tension((), 0.0)
        if anchors and anchored and alone.any():  # slack on rigid anchors is slack on any
            pulling.append((path, tension))
        else:
            torque += path.count * alone * path.arm
            pull += path.count * alone * anchored
    for (path, _), shared in zip(pulling, _shared(pulling, anchors), strict=True):
        torque += path.count * shared * path.arm
        pull += path.count * shared
    return torque, pull


def _anchors(orthosis: Orthosis, fitted: Values) -> tuple[Anchor, ...]:
    """The anchors that give: as described, or with the stiffness of a fit."""
    found: list[Anchor] = []
    for segment, name in zip(orthosis.words.segments, ANCHORS, strict=True):
        described: Mounting | None = orthosis.anchor.get(segment)
        if name in fitted:
            found.append((fitted[name], 0.0, 0.0))
        elif described is not None and described.stiffening is not None:
            found.append((0.0, described.stiffening.force, described.stiffening.length))
        elif described is not None and described.stiffness is not None:
            found.append((described.stiffness, 0.0, 0.0))
    return tuple(found)


def _of_path(orthosis: Orthosis, path: Path, chamber: str, pressure: np.ndarray, fitted: Values) -> Tension:
    """The tension of a path's muscle [N]: alone on anchors, or on ones that have given a length [m]."""
    group = orthosis.muscle[path.group]
    filled = (group.chamber or path.group) == chamber
    fitted = fitted if filled else {}
    law = {name: value for name, value in fitted.items() if name not in (*CABLE, *ANCHORS)}
    bare, cable = at_rest(group.type, law), fitted.get("series_stiffness", group.cable.stiffness)
    more = fitted.get("offset", group.cable.offset) - group.cable.offset
    left = group.series_length + more - path.length
    own, nominal = row(bare, cable, path.count), group.type.nominal_length
    room, gauge = 1.0 + left / nominal, pressure if filled else np.zeros(len(pressure))
    return lambda anchors, given: tensions(room + given / nominal, gauge, on_anchors(own, anchors))


def _shared(pulling: Sequence[tuple[Path, Tension]], anchors: tuple[Anchor, ...]) -> list[np.ndarray]:
    """Tension of each muscle where all pull on the same anchors."""
    if len(pulling) < 2:
        return [tension(anchors, 0.0) for _, tension in pulling]

    def of(pull: np.ndarray) -> list[np.ndarray]:
        def displaced(p: float) -> float:
            return math.fsum(anchor_displacement(p, *a, 0.0, 0.0, 0.0, 1.0)[0] for a in anchors)

        given = np.array([displaced(float(p)) for p in pull])
        return [tension((), given) for _, tension in pulling]

    def total(found: list[np.ndarray]) -> np.ndarray:
        return np.sum([path.count * f for (path, _), f in zip(pulling, found, strict=True)], axis=0)

    high = total([tension((), 0.0) for _, tension in pulling])
    low = np.zeros(len(high))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        more = total(of(middle)) > middle
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return of(0.5 * (low + high))


def fitted_orthosis(
    orthosis: Orthosis, chamber: str, values: Mapping[str, float], sources: Mapping[str, str]
) -> Orthosis:
    """An orthosis with fitted values in place of its own."""
    table = orthosis.model_dump(mode="json", exclude_none=True)
    for name, value in values.items():
        if name in ANCHORS:
            segment = orthosis.words.segments[ANCHORS.index(name)]
            anchor = table.setdefault("anchor", {}).setdefault(segment, {})
            anchor.pop("stiffening", None)  # a stiffness in its place; its damping stays
            _put(anchor, "stiffness", format_quantity(value, "N/m"), sources[name])
            continue
        for group in orthosis.muscles_of(chamber):
            muscle = table["muscle"][group]
            if name in CABLE:
                key, unit = CABLE[name]
                _put(muscle.setdefault("cable", {}), key, format_quantity(value, unit), sources[name])
            else:
                law = orthosis.muscle[group].type.law
                unit = LAWS[law].parameter(name).unit
                _put(muscle["type"]["laws"][law], name, format_quantity(value, unit), sources[name])
                muscle["type"].pop("covariance", None)  # of another fit, about another value
    table["name"] = f"{orthosis.name or 'orthosis'}-fitted"
    try:
        found: Orthosis = reader.load("orthosis", table)
    except InputError as error:
        problem = f"the fit is not a valid orthosis: {error.field} {error.problem}"
        raise InputError(problem, value=error.value, allowed=error.allowed) from None
    return found


def _put(table: JsonDict, key: str, value: Json, source: str) -> None:
    table[key] = value
    table["provenance"] = table.get("provenance", {}) | {key: {"kind": "fitted", "source": source}}
