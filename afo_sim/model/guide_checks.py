"""What only the ankle's motion tells of a path: surfaces that it would jump through, or never touches."""

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.model.paths import Paths, paths_of, route_of

APART = np.radians(0.5)  # between the angles that are looked at
TOUCHING = 1e-9  # sine of a wrapped angle from which on a side is told


@dataclass(frozen=True)
class _Seen:
    """A surface of one muscle at one ankle angle.

    inside : distance of the nearer neighbouring point from axis or centre where it is inside, or None [m]
    normal : of the wrapped arc, in the surface's frame, its length the sine of the angle; zero where the path
        passes it by
    """

    inside: float | None
    normal: np.ndarray


def check_guides(orthosis: Orthosis, stops: tuple[float, float]) -> list[str]:
    """Refuse paths that MuJoCo would take through a surface within the range of motion; warn of others.

    A path bends around a surface on the shorter side. Where the straight line comes to pass its axis, the
    shorter side changes, and the path jumps through it. Where a neighbouring point comes to lie inside, the
    path runs straight through. No cable does either.

    Parameters
    ----------
    orthosis : described
    stops : the lowest and the highest angle that the ankle reaches [rad]

    Returns
    -------
    warnings

    Raises
    ------
    InputError
        Such a surface, with the angle; or a cable's offset that is not shorter than the path.
    """
    guided = {name: group for name, group in orthosis.anchored.items() if group.path}
    if not guided:
        return []
    paths = paths_of(orthosis)
    low, high = orthosis.range_of_motion
    within = _angles(low, high)
    # from the range of motion outwards, each way
    beyond = [
        _angles(end, stop)[1:] for end, stop in ((low, min(stops[0], low)), (high, max(stops[1], high)))
    ]
    found: list[str] = []
    for name, group in guided.items():
        _check_offset(orthosis, name, group, paths)
        found += _muscle_that_bends(name, group, paths, within)
        for number, place in enumerate(group.path):
            if place.surface is not None:
                found += _surface(orthosis, paths, name, number, within, beyond)
    return found


def _angles(first: float, last: float) -> np.ndarray:
    """Angles from the first to the last [rad], at most APART."""
    return np.linspace(first, last, int(abs(last - first) / APART) + 2)


def _surface(
    orthosis: Orthosis, paths: Paths, name: str, number: int, within: np.ndarray, beyond: list[np.ndarray]
) -> Iterator[str]:
    """Warnings of one surface of a group's path; refuses it as `check_guides`."""
    touched = False
    for k in range(1, orthosis.muscle[name].count + 1):
        seen = _over(paths, f"{name}_{k}", number, within)
        problem = _problem(within, seen)
        if problem:
            raise InputError(
                f"{problem}, within the range of motion: no cable does that",
                file=orthosis.name,
                field=f"orthosis.muscle.{name}.path[{number}].surface",
                allowed="a surface further to one side, a smaller radius, a point of the path before or "
                "behind it, or a narrower range_of_motion",
            )
        touched = touched or any(np.linalg.norm(s.normal) > TOUCHING for s in seen)
    for angles in beyond:
        problem = _problem(angles, _over(paths, f"{name}_1", number, angles))
        if problem:
            yield f"{name}, path[{number}]: {problem}; forces beyond that angle are wrong"
    if not touched:
        yield (
            f"{name} touches the surface path[{number}] nowhere in the range of motion: it acts as if it "
            "were not there"
        )


def _problem(angles: np.ndarray, seen: list[_Seen]) -> str:
    """What is wrong with a surface over successive angles, with the first angle; "" for nothing."""
    last: np.ndarray | None = None
    for angle, now in zip(np.degrees(angles), seen, strict=True):
        if now.inside is not None:
            return (
                f"at {angle:.0f} deg a neighbouring point of the path is {100.0 * now.inside:.2g} cm from "
                "its middle, inside it, and the path would run through it"
            )
        if np.linalg.norm(now.normal) > TOUCHING:
            if last is not None and last @ now.normal < 0.0:
                return f"at {angle:.0f} deg the path would jump through it to its other side"
            last = now.normal
    return ""


def _over(paths: Paths, muscle: str, place: int, angles: np.ndarray) -> list[_Seen]:
    """A surface of a single muscle's path over the ankle's angles."""
    model, data, tendon = paths.model, native.scratch(paths.model), paths.tendons[muscle]
    number = model.geom(f"{muscle}_path{place}").id
    entries = slice(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    types, ids = model.wrap_type[entries], model.wrap_objid[entries]
    at = next(k for k in range(len(ids)) if ids[k] == number and types[k] != mujoco.mjtWrap.mjWRAP_SITE)
    found = []
    for angle in angles:
        data.qpos[0] = angle
        mujoco.mj_fwdPosition(model, data)
        centre, turn = data.geom_xpos[number], data.geom_xmat[number].reshape(3, 3)
        cylinder = types[at] == mujoco.mjtWrap.mjWRAP_CYLINDER
        flat = np.array([1.0, 1.0, 0.0 if cylinder else 1.0])  # across a cylinder's axis
        away = [
            float(np.linalg.norm((data.site_xpos[ids[k]] - centre) @ turn * flat)) for k in (at - 1, at + 1)
        ]
        route = route_of(model, data, tendon)
        on = (route.points[route.surfaces == number] - centre) @ turn * flat / model.geom_size[number, 0]
        inside = min(away) if min(away) <= model.geom_size[number, 0] else None
        found.append(_Seen(inside, np.cross(*on) if len(on) == 2 else np.zeros(3)))
    return found


def _check_offset(orthosis: Orthosis, name: str, group: MuscleGroup, paths: Paths) -> None:
    """Refuse a cable's offset that is not shorter than the path, which surfaces make longer than straight."""
    columns = [list(paths.tendons).index(f"{name}_{k}") for k in range(1, group.count + 1)]
    shortest = float(paths.lengths(np.zeros(1))[0, columns].min())
    if group.cable.offset >= shortest:
        raise InputError(
            f"is not shorter than the path, {100.0 * shortest:.3g} cm at an angle of zero",
            file=orthosis.name,
            field=f"orthosis.muscle.{name}.cable.offset",
            value=f"{100.0 * group.cable.offset:g} cm",
            allowed=f"less than {100.0 * shortest:.3g} cm",
        )


def _muscle_that_bends(name: str, group: MuscleGroup, paths: Paths, angles: np.ndarray) -> Iterator[str]:
    """A warning where the muscle itself, which hangs on its origin, would reach the first guide."""
    data, room = native.scratch(paths.model), np.inf
    for angle in angles:
        data.qpos[0] = angle
        mujoco.mj_fwdPosition(paths.model, data)
        points = route_of(paths.model, data, paths.tendons[f"{name}_1"]).points
        room = min(room, float(np.linalg.norm(points[1] - points[0])))
    if room < group.type.total_length:
        yield (
            f"{name}: the muscle, {100.0 * group.type.total_length:.3g} cm long, does not fit on the "
            f"{100.0 * room:.3g} cm between its origin and the first guide; it is computed as if only its "
            "cable bent"
        )
