"""Facts of a compiled scenario that metrics need, among them the muscles' pull on cuff and plate."""

import functools
from collections.abc import Mapping

import numpy as np

from afo_sim.description import WORN, Joint, MuscleGroup, Orthosis, Scenario, Segment
from afo_sim.metrics import Facts, MuscleLimits, Skin, Supply
from afo_sim.model import Built, chamber_of, content_at_start, muscle_names, paths_of, side
from afo_sim.physics import AIR, Gas

LEFT = 1  # place in forward, left, up
APART = np.radians(0.05)  # between angles at which the pieces of a guided path are looked at, at most


def facts_of(built: Built) -> Facts:
    """The facts of a compiled scenario."""
    scenario, orthosis = built.scenario, built.scenario.orthosis
    muscles = {}
    for name, group in muscle_names(orthosis).items():
        limits, chamber = group.type.limits, chamber_of(name, group)
        reach = limits.contraction_max, limits.contraction_min
        muscles[name] = MuscleLimits(chamber, limits.pressure, limits.force, *reach)
    rated = {
        f"{name}_{side}": valve.rated_switches
        for name, chamber in orthosis.chamber.items()
        for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.vent))
        if valve.rated_switches is not None
    }
    skins = {
        WORN[segment]: Skin(interface.area, interface.friction, functools.partial(pull_on, orthosis, segment))
        for segment, interface in orthosis.interface.items()
        if orthosis.anchored
    }
    walks, source = built.walk is not None, scenario.supply.source

    def content() -> float:  # of a source that begins full where nobody walks
        assert source is not None
        return content_at_start(built) if walks else source.full_mass

    sags = source is not None or scenario.supply.regulator is not None
    supply = Supply(scenario.supply.pressure, sags, gas_of(scenario).free_density, source, content)
    mass = built.body_mass if walks else 0.0
    laid = None if built.walk is None or built.contact is None else built.walk.laid
    return Facts(scenario.timestep, mass, walks, supply, scenario.limits, skins, muscles, rated, laid)


def gas_of(scenario: Scenario) -> Gas:
    """The gas that a scenario's orthosis is driven with."""
    source = None if scenario.supply is None else scenario.supply.source
    return AIR if source is None else source.real_gas


def pull_on(orthosis: Orthosis, segment: Segment, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Force of all muscles between two anchors on one segment, in its own axes."""
    angle = columns["ankle/angle"]
    total = np.zeros((3, len(angle)))
    guided = _guided(orthosis, angle, segment)
    for name, group in muscle_names(orthosis).items():
        if group.pulley is not None:
            continue
        force = columns[f"muscle/{name}/force"]
        if name in guided:
            force = columns.get(f"muscle/{name}/joint_force", force)
            for axis in range(3):
                total[axis] += guided[name][:, axis] * force
            continue
        path = _straight(name, group, angle, segment, orthosis.words)
        over_length = force / np.sqrt(path[0] ** 2 + path[1] ** 2 + path[2] ** 2)
        for axis, along in enumerate(path):
            total[axis] += along * over_length
    return total.T


def _straight(
    name: str, group: MuscleGroup, angle: np.ndarray, segment: Segment, joint: Joint
) -> tuple[np.ndarray, float, np.ndarray]:
    """From a straight path's end on the segment to its other end, in the segment's axes [m]."""
    assert group.origin is not None and group.insertion is not None
    cosine, sine = np.cos(angle), joint.turn * np.sin(angle)
    above, below = joint.segments
    turn = sine if segment == above else -sine  # of the other segment in this one's axes: the foot, toe up
    ends: dict[Segment, np.ndarray] = {}
    for anchor in (group.origin, group.insertion):
        ends[anchor.segment] = np.array(anchor.from_joint)
        ends[anchor.segment][LEFT] += side(name, group) * anchor.spacing
    x, y, z = ends[below if segment == above else above]
    forward, left, up = ends[segment]
    return x * cosine - z * turn - forward, y - left, x * turn + z * cosine - up


def _guided(orthosis: Orthosis, angle: np.ndarray, segment: Segment) -> dict[str, np.ndarray]:
    """Pull per unit of tension of each muscle whose path has points or surfaces (n, 3), by name."""
    names = [name for name, group in muscle_names(orthosis).items() if group.path]
    if not names or not len(angle):
        return {}
    paths = paths_of(orthosis)
    columns = [list(paths.tendons).index(name) for name in names]
    low, high = float(angle.min()), float(angle.max())
    number = int((high - low) / APART) + 2
    if number >= len(angle):
        found = paths.directions(angle, segment)[:, columns]
        return {name: found[:, k] for k, name in enumerate(names)}
    grid = np.linspace(low, high, number)
    at = paths.directions(grid, segment)[:, columns]
    return {
        name: np.column_stack([np.interp(angle, grid, at[:, k, axis]) for axis in range(3)])
        for k, name in enumerate(names)
    }
