"""Torque available over joint angle and pressure, and the torque that a patient's walk needs."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, JsonDict, JsonMapping, Notice, Shown, gauge, si
from afo_sim.description import Scenario, load
from afo_sim.metrics import SIDES, Need, needs
from afo_sim.metrics.strides import strides
from afo_sim.model import ANKLE, IMPLAUSIBLE, JOINTS, UNDRIVEN, Built, TorqueMap, person_of, two_strides
from afo_sim.model import torque_map as static
from afo_sim.model.build import build
from afo_sim.simulation.columns import columns_of
from afo_sim.simulation.reference_walk import OPEN
from afo_sim.simulation.rollout import Rollout

OF_WALK = ("gait", "ground", "patient", "shoe")  # tables of who walks how
OTHER_SIZE = 0.05  # of the body's height, beyond which the device's moment arms are another person's
DEVICE = ("leg", "orthosis", "supply", "timestep")  # what is worn in another walk


@dataclass(frozen=True, eq=False, repr=False)
class TorqueMaps(Shown):
    """A map of each chamber alone; what each phase needs, and what the chambers of its side lack of it.

    They pull together, against the empty muscles of the other side.

    scenario : whose body wears the device
    maps : of each chamber
    needs : of each phase; empty where nobody walks
    lacking : chambers at the supply's pressure [N·m] (n,)
    warnings : pressures beyond a limit, what building found
    """

    scenario: Scenario
    maps: list[TorqueMap]
    needs: list[Need]
    lacking: list[tuple[tuple[str, ...], Need, np.ndarray]]
    warnings: list[Notice]


def torque_map(
    scenario: str | os.PathLike[str] | Scenario | JsonMapping = "walk-dropfoot-afo",
    sets: Mapping[str, object] | None = None,
    *,
    walk: str | os.PathLike[str] | Scenario | JsonMapping | None = None,
    angles: Sequence[float | str] | np.ndarray | None = None,
    pressures: Sequence[float | str] = (1e5, 2e5, 3e5, 4e5),
) -> TorqueMaps:
    """Compare available and needed torque: is the device strong enough for this patient's walk?

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it; those of gait, ground, patient and shoe over `walk`
    walk : a walk on the same leg that gives the needed torque; by default the scenario's own
    angles : of the joint [rad] (n,), or as "10 deg"; by default the orthosis' range of motion
    pressures : gauge [Pa] (m,), or as "3 bar"; the supply's is added

    Returns
    -------
    TorqueMaps; the peaks of its needs are metrics of the walk, unknown for a patient's own walk. The
    available torque is static, as if filled instantly; a run shows what valves leave of it

    Raises
    ------
    InputError
        There is no chamber; angles exceed the stops; `walk` is not a walk on the same leg.

    Examples
    --------
    >>> found = torque_map("walk-dropfoot-afo", angles=[-0.1, 0.0, 0.1])
    >>> [need.phase for need in found.needs], found.maps[0].torque.shape
    (['initial and mid swing', 'terminal swing', 'loading response', 'push-off'], (3, 4))
    """
    own = dict(sets or {})
    of_walk = {key: own.pop(key) for key in [*own] if walk is not None and key.split(".")[0] in OF_WALK}
    described = load("scenario", scenario, own)
    if not described.orthosis.chamber:
        problem = "has no chamber: there is no torque to map"
        raise InputError(problem, field="orthosis", value=described.orthosis.name)
    if walk is not None:
        try:
            other = load("scenario", walk, of_walk)
        except InputError as error:
            raise (error.replaced(field="walk") if error.field == "scenario" else error) from None
        leg, joint = described.leg.name, described.leg.joint
        if not other.walking or (other.leg.name, other.leg.joint) != (leg, joint):
            problem, allowed = "is not a walk on the same leg", f"a walk of the ankle on {leg}"
            raise InputError(problem, field="walk", value=other.name, allowed=allowed)
        worn: JsonDict = {name: getattr(described, name) for name in DEVICE}
        worn["phases"] = dict.fromkeys(described.orthosis.chamber, OPEN)
        described = other.with_values(**{**UNDRIVEN, **worn})
    built, needed = needs_of(described)
    if angles is None:
        low, high = described.orthosis.range_of_motion
        angles = low + np.radians(np.arange(int(np.degrees(high - low) + 1.0 + 1e-9)))
    supply, asked = described.supply.pressure, [gauge(one, "pressures") for one in pressures]
    angles = np.array([si(angle, "rad", "angles") for angle in angles])
    stops = built.model.joint(ANKLE).range
    least, most = np.degrees([angles.min(initial=np.inf), angles.max(initial=-np.inf)])
    lower, upper = np.degrees(stops)
    if not lower - 1e-6 <= least <= most <= upper + 1e-6:
        problem, value = f"goes beyond the {described.leg.joint}'s stops", f"{least:g} to {most:g} deg"
        raise InputError(problem, field="angles", value=value, allowed=f"{lower:g} deg to {upper:g} deg")
    maps = static.torque_map(built, angles, np.array(sorted({*asked, supply})))
    strongest = static.torque_map(built, stops, maps[0].pressures[-1:])
    sides = {one.chamber: np.sign(one.torque.sum()) for one in strongest}
    lacking: list[tuple[tuple[str, ...], Need, np.ndarray]] = []
    for need in needed:
        side, given, pulling = SIDES[need.side], np.zeros(len(need.angle)), []
        for one in static.torque_map(built, need.angle, np.array([0.0, supply])):
            empty, full = side * one.torque.T
            if sides[one.chamber] == side:  # a stretched braid counts for nothing
                pulling.append(one.chamber)
                given += np.where(one.contraction[:, 1] >= 0.0, full, 0.0)
            else:
                given += np.minimum(empty, 0.0)
        short = np.where(need.torque > 0.0, need.torque - given, 0.0)
        lacking.append((tuple(pulling), need, short))
    warnings = list(_warnings(built, float(maps[0].pressures.max()), whose=bool(needed)))
    return TorqueMaps(described, maps, needed, lacking, warnings)


def _warnings(built: Built, highest: float, *, whose: bool) -> Iterator[Notice]:
    """Of a person or device that cannot be, of another person's device, of pressures beyond muscle or law."""
    scenario = built.scenario
    for notice in built.warnings:
        if isinstance(notice, Notice) and notice.code == IMPLAUSIBLE:
            yield notice
    height, fits = person_of(scenario).body_height, scenario.leg.body_height
    if whose and abs(math.log(height / fits)) > OTHER_SIZE:
        text = "the device is placed for a body of {fits:.3g} m, the patient is {height:.3g} m tall: refit it"
        yield Notice("device-of-another-size", text, subject="patient.body_height", height=height, fits=fits)
    for name, group in scenario.orthosis.muscle.items():
        yield from static.beyond_pressure(name, group, highest)
        lower, upper = (1e-5 * bound for bound in group.type.law_set.pressure_range)
        if not lower <= 1e-5 * scenario.supply.pressure <= upper:
            text = f"{{subject}}: its law holds from {lower:g} to {upper:g} bar, not at the supply's pressure"
            yield Notice("law-outside-its-pressure", text, subject=name)


def needs_of(scenario: Scenario) -> tuple[Built, list[Need]]:
    """A compiled scenario, and what its mean stride needs as recorded: nothing is simulated."""
    gait = scenario.gait
    if gait is None:
        return build(scenario), []
    even = gait.model_copy(update={"variability": 0.0, "pace": ()})
    built = build(two_strides(scenario.model_copy(update={"gait": even})))
    assert built.walk is not None
    n, timestep = built.scenario.n_step, built.scenario.timestep
    qpos = np.zeros((n, built.model.nq))
    qpos[:, built.model.joint(JOINTS[2]).qposadr[0]] = built.walk.pose[1:-1, 2]
    columns = columns_of(built, Rollout({"time": np.arange(n), "qpos": qpos}, np.empty((n, 0))))
    return built, needs(strides(columns, timestep, built.body_mass)[-1])
