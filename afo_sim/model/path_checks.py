"""Checks of the muscles' paths over the ankle's angle: size limits, side, stretch, and surfaces on the way.

A muscle that cannot work is refused: one that is too long for its path, that passes through the ankle, whose
braid locks, or whose path jumps through a surface. Of others that are doubtful a notice warns.
"""

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping

import mujoco
import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.description import Muscle, MuscleGroup, Orthosis, at_rest
from afo_sim.model.mounting import contractions, muscle_names, postures
from afo_sim.model.paths import Paths, paths_of, route_of
from afo_sim.physics import root

LEAST_ARM = 1e-3  # moment arm on either side that counts as a change of its sign [m]
APART = np.radians(0.5)  # between the angles that are looked at
TOUCHING = 1e-9  # sine of a wrapped angle from which on a side is known


def check_paths(angles: np.ndarray, lengths: np.ndarray, muscles: Iterable[str], orthosis: Orthosis) -> None:
    """Refuse paths whose moment arm changes its sign, and paths too short for the muscle on them."""
    slope = np.diff(lengths, axis=0) / np.diff(angles)[:, None]
    turns = (slope.min(axis=0) < -LEAST_ARM) & (slope.max(axis=0) > LEAST_ARM)
    ends = lengths.max(axis=0).tolist()
    bodies = {role: _body(group.type) for role, group in orthosis.muscle.items()}
    for column, (name, longest) in enumerate(zip(muscles, ends, strict=True)):
        role = name.rsplit("_", 1)[0]
        group, body = orthosis.muscle[role], bodies[role]
        if group.pulley is not None:
            continue
        if turns[column] or longest < body + (group.link_length or 0.0):
            _check_sign(name, angles, lengths[:, column], orthosis)
            _check_length(name, angles, lengths[:, column], group, orthosis.name)


def _body(muscle: Muscle) -> float:
    """Fittings and the muscle at its shortest [m]."""
    return muscle.end_length + muscle.nominal_length * (1.0 - muscle.limits.contraction_max)


def _check_sign(name: str, angles: np.ndarray, length: np.ndarray, orthosis: Orthosis) -> None:
    """The moment arm r = −dL/dθ must not change its sign; between two angles it is −ΔL/Δθ."""
    arm = -np.diff(length) / np.diff(angles)
    low, high = float(arm.min()), float(arm.max())
    if not (low < -LEAST_ARM and high > LEAST_ARM):
        return
    raises = high > -low  # which way the muscle is meant to turn the joint
    forward = raises == (orthosis.words.turn > 0.0)
    turn = int(np.flatnonzero((arm[1:] > 0.0) != (arm[:-1] > 0.0))[0]) + 1
    missing = -low if raises else high
    raise InputError(
        f"{name} passes through the {orthosis.joint}: at {np.degrees(angles[turn]):.0f} deg, within the "
        f"range of motion, its moment arm changes its sign (it is {1e3 * low:.0f} to {1e3 * high:.0f} mm)",
        file=orthosis.name,
        field=f"orthosis.muscle.{name.rsplit('_', 1)[0]}.origin.from_joint",
        allowed=f"origin and insertion, or a point of the path, at least {math.ceil(1e3 * missing)} mm "
        f"further {'forward' if forward else 'back'}, or a narrower range_of_motion",
    )


def _check_length(name: str, angles: np.ndarray, length: np.ndarray, group: MuscleGroup, file: str) -> None:
    """Fittings, link and the muscle at its shortest must fit where the path is longest."""
    body, link = _body(group.type), group.link_length or 0.0
    long = int(np.argmax(length))
    if length[long] >= body + link:
        return
    role, alone = f"orthosis.muscle.{name.rsplit('_', 1)[0]}", length[long] < body
    what = "fittings and muscle at its shortest" if alone else "fittings, link and muscle at its shortest"
    longest = math.floor(1e3 * (length[long] - body))
    raise InputError(
        f"{name} does not fit on its path: even where it is longest, at {np.degrees(angles[long]):.0f} deg, "
        f"the path is {1e3 * length[long]:.0f} mm long, and {what} take "
        f"{1e3 * (body + (0.0 if alone else link)):.0f} mm",
        file=file,
        field=f"{role}.origin.from_joint" if alone else f"{role}.link_length",
        value=None if alone else f"{1e3 * link:g} mm",
        allowed="anchors further apart, or a shorter muscle"
        if alone
        else f"at most {longest} mm, or a shorter muscle",
    )


def check_stretch(
    rows: np.ndarray, angles: np.ndarray, lengths: np.ndarray, muscles: Mapping[str, int], orthosis: Orthosis
) -> list[Notice]:
    """Refuse a braid that locks in the range of motion; warn of one beyond its limits of length."""
    contraction = contractions(rows, list(muscles.values()), lengths)
    known: dict[tuple[str, float], float] = {}  # parallel muscles are stretched alike
    warnings: list[Notice] = []
    groups = muscle_names(orthosis)
    for column, name in enumerate(muscles):
        group, worst = groups[name], int(np.argmin(contraction[:, column]))
        path, angle = contraction[worst, column], np.degrees(angles[worst])
        role = name.rsplit("_", 1)[0]
        if (role, path) not in known:
            known[role, path] = _own_contraction(group, orthosis, path)
        least = known[role, path]
        lock = group.type.braid.lock
        if least <= lock:
            problem = f"{name} is mounted too taut: at {angle:.0f} deg, within the range of motion, its "
            problem += f"braid would be stretched by {-100 * least:.1f} %, and it locks at {-100 * lock:.1f} "
            problem += "%"
            would_do = path_contraction(group, orthosis)(group.type.limits.contraction_min)
            raise _too_taut(problem, orthosis.name, role, group, would_do - path)
        if name.endswith("_1"):  # its neighbours say the same
            warnings += _beyond_limits(role, group, least, float(contraction[:, column].max()), angle)
    return warnings


def _beyond_limits(
    role: str, group: MuscleGroup, least: float, most: float, angle: float
) -> Iterator[Notice]:
    """Warnings of least and most contraction ratios beyond a muscle's limits; the least at an angle [deg]."""
    limits, length = group.type.limits, group.type.nominal_length
    if least < limits.contraction_min:
        text = "{subject} muscles are stretched to a contraction of {contraction:.3f} at {angle:.0f} deg, "
        text += "beyond their limit of {limit:g}"
        limit = limits.contraction_min
        yield Notice("muscle-stretched", text, subject=role, contraction=least, angle=angle, limit=limit)
    if most <= limits.contraction_max:
        return
    travel, shortest = (most - least) * length, limits.contraction_max * length
    if travel > shortest:
        text = (
            "{subject} muscles cannot follow the whole range of motion: it takes up "
            f"{100.0 * travel:.1f} cm, they shorten by {100.0 * shortest:.1f} cm at most; a longer muscle, a "
            "shorter moment arm or a narrower range_of_motion would do"
        )
        yield Notice("muscle-too-short", text, subject=role, travel=travel, shortening=shortest)
    else:
        text = "{subject} muscles are mounted too slack to follow the whole range of motion: at its end they "
        text += "would need a contraction of {contraction:.3f}, but their limit is "
        text += "{limit:g}; shorten link_length by {shorter:.0f} mm"
        limit = limits.contraction_max
        by = math.ceil(1e3 * (most - limit) * length)
        yield Notice("muscle-too-slack", text, subject=role, contraction=most, shorter=by, limit=limit)


def _too_taut(problem: str, file: str, role: str, group: MuscleGroup, missing: float) -> InputError:
    """With what would do: `missing` is the contraction ratio of the path that the mounting lacks."""
    if group.pulley is not None:
        kappa = group.pulley.initial_contraction
        field, value = "pulley.initial_contraction", f"{kappa:g}"
        enough = f"at least {math.ceil(1000 * (kappa + missing)) / 1000:g}"
    else:
        field, value = "slack", f"{group.slack * 1000:g} mm"
        length = group.slack + missing * group.type.nominal_length
        enough = f"at least {math.ceil(1000 * length)} mm, or as much more link_length"
    allowed = f"{enough}, or a narrower range_of_motion"
    return InputError(
        problem, file=file, field=f"orthosis.muscle.{role}.{field}", value=value, allowed=allowed
    )


def path_contraction(group: MuscleGroup, orthosis: Orthosis) -> Callable[[float], float]:
    """Contraction ratio of the path [-] that stretches a muscle without air to its own [-]."""
    anchors = tuple(orthosis.anchor.values()) if group.pulley is None else ()
    bare, cable, length = at_rest(group.type), group.cable.stiffness, group.type.nominal_length

    def of(kappa: float) -> float:
        pull = bare.force(float(kappa), 0.0)
        yielding = pull / cable + sum(a.displacement(group.count * pull) for a in anchors)
        return kappa - yielding / length

    return of


def _own_contraction(group: MuscleGroup, orthosis: Orthosis, path: float) -> float:
    """Contraction ratio of a muscle without air, where that of its path is `path` [-]."""
    if path >= 0.0:
        return path
    of = path_contraction(group, orthosis)

    def too_long(kappa: float) -> float:
        return of(kappa) - path

    if too_long(path) >= 0.0:
        return path
    if too_long(0.0) <= 0.0:
        return 0.0
    return root(too_long, path, 0.0)


# Of a surface of one muscle at one ankle angle: how far inside it a neighbouring point is, and its normal
_Seen = tuple[float | None, np.ndarray]


@functools.lru_cache(maxsize=4)  # cases of a sweep share it
def check_guides(orthosis: Orthosis, stops: tuple[float, float]) -> tuple[Notice, ...]:
    """Refuse paths that MuJoCo would take through a surface within the range of motion; warn of others."""
    guided = {name: group for name, group in orthosis.anchored.items() if group.path}
    if not guided:
        return ()
    paths = paths_of(orthosis)
    low, high = orthosis.range_of_motion
    within = _angles(low, high)
    # from the range of motion outwards, each way
    beyond = [
        _angles(end, stop)[1:] for end, stop in ((low, min(stops[0], low)), (high, max(stops[1], high)))
    ]
    found: list[Notice] = []
    for name, group in guided.items():
        columns = [list(paths.tendons).index(f"{name}_{k}") for k in range(1, group.count + 1)]
        shortest = float(paths.lengths(np.zeros(1))[0, columns].min())
        if group.cable.offset >= shortest:  # which surfaces make longer than straight
            problem = f"is not shorter than the path, {100.0 * shortest:.3g} cm at an angle of zero"
            value, allowed = f"{100.0 * group.cable.offset:g} cm", f"less than {100.0 * shortest:.3g} cm"
            field = f"orthosis.muscle.{name}.cable.offset"
            raise InputError(problem, file=orthosis.name, field=field, value=value, allowed=allowed)
        found += _muscle_that_bends(name, group, paths, within)
        for number, point in enumerate(group.path):
            if point.surface is not None:
                found += _surface(orthosis, paths, name, number, within, beyond)
    return tuple(found)


def _angles(first: float, last: float) -> np.ndarray:
    """Angles from the first to the last [rad], at most APART."""
    return np.linspace(first, last, int(abs(last - first) / APART) + 2)


def _surface(
    orthosis: Orthosis, paths: Paths, name: str, number: int, within: np.ndarray, beyond: list[np.ndarray]
) -> Iterator[Notice]:
    """Warnings of one surface of a group's path; refuses it as `check_guides`."""
    touched = False
    for k in range(1, orthosis.muscle[name].count + 1):
        seen = _over(paths, f"{name}_{k}", number, within)
        problem = _problem(within, seen)
        if problem:
            problem += ", within the range of motion: no cable does that"
            field = f"orthosis.muscle.{name}.path[{number}].surface"
            allowed = "a surface further to one side, a smaller radius, a point of the path before or behind "
            allowed += "it, or a narrower range_of_motion"
            raise InputError(problem, file=orthosis.name, field=field, allowed=allowed)
        touched = touched or any(np.linalg.norm(normal) > TOUCHING for _, normal in seen)
    for angles in beyond:
        problem = _problem(angles, _over(paths, f"{name}_1", number, angles))
        if problem:
            code = f"path-jumps-{'below' if angles[-1] < within[0] else 'above'}-range"
            text = "{subject}: {problem}; forces beyond that angle are wrong"
            yield Notice(code, text, subject=f"{name}, path[{number}]", problem=problem)
    if not touched:
        text = (
            f"{name} never touches the surface path[{number}] in the range of motion: the surface has no "
            "effect"
        )
        yield Notice("surface-not-touched", text, subject=f"{name}, path[{number}]")


def _problem(angles: np.ndarray, seen: list[_Seen]) -> str:
    """What is wrong with a surface over successive angles, with the first angle; "" for nothing."""
    last: np.ndarray | None = None
    for angle, (inside, normal) in zip(np.degrees(angles), seen, strict=True):
        if inside is not None:
            return (
                f"at {angle:.0f} deg a neighbouring point of the path is {100.0 * inside:.2g} cm from "
                "its middle, inside it, and the path would run through it"
            )
        if np.linalg.norm(normal) > TOUCHING:
            if last is not None and last @ normal < 0.0:
                return f"at {angle:.0f} deg the path would jump through it to its other side"
            last = normal
    return ""


def _over(paths: Paths, muscle: str, point: int, angles: np.ndarray) -> list[_Seen]:
    """A surface of a single muscle's path over the ankle's angles."""
    model, tendon = paths.model, paths.tendons[muscle]
    number = model.geom(f"{muscle}_path{point}").id
    entries = slice(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    types, ids = model.wrap_type[entries], model.wrap_objid[entries]
    at = next(k for k in range(len(ids)) if ids[k] == number and types[k] != mujoco.mjtWrap.mjWRAP_SITE)
    found: list[_Seen] = []
    for data in postures(model, 0, angles):
        centre, turn = data.geom_xpos[number], data.geom_xmat[number].reshape(3, 3)
        cylinder = types[at] == mujoco.mjtWrap.mjWRAP_CYLINDER
        flat = np.array([1.0, 1.0, 0.0 if cylinder else 1.0])  # across a cylinder's axis
        away = [
            float(np.linalg.norm((data.site_xpos[ids[k]] - centre) @ turn * flat)) for k in (at - 1, at + 1)
        ]
        route = route_of(model, data, tendon)
        on = (route.points[route.surfaces == number] - centre) @ turn * flat / model.geom_size[number, 0]
        inside = min(away) if min(away) <= model.geom_size[number, 0] else None
        found.append((inside, np.cross(*on) if len(on) == 2 else np.zeros(3)))
    return found


def _muscle_that_bends(name: str, group: MuscleGroup, paths: Paths, angles: np.ndarray) -> Iterator[Notice]:
    """A warning where the muscle itself, which hangs from its origin, would reach the first guide."""
    straight = np.inf
    for data in postures(paths.model, 0, angles):
        points = route_of(paths.model, data, paths.tendons[f"{name}_1"]).points
        straight = min(straight, float(np.linalg.norm(points[1] - points[0])))
    length = group.type.total_length
    if straight < length:
        text = (
            f"{{subject}}: the muscle, {100.0 * length:.3g} cm long, does not fit on the "
            f"{100.0 * straight:.3g} cm between its origin and the first guide; it is simulated as if only "
            "its cable were bent"
        )
        yield Notice("muscle-bends", text, subject=name, length=length, straight=straight)
