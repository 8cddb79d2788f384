"""What the mounting of every muscle group does over the ankle's angle: lengths, arm, slack, torque.

One function computes it for the design picture and for `afo-sim check`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import InputError, Shown
from afo_sim.description import MuscleGroup
from afo_sim.model.build import Built
from afo_sim.model.mounting import chamber_of, muscle_names, sweep_ankle, sweep_lengths
from afo_sim.model.path_checks import path_contraction
from afo_sim.physics import root

Span = tuple[float, float]  # from, to [rad]
ANGLE_TOLERANCE = 1e-9  # of an angle [rad]
ANGLE_COUNT = 161  # over the ankle's stops
ALIKE = 1e-9  # difference of path lengths below which muscles are alike [m]
PRESSURE_SHARES = (0.0, 0.5, 1.0)  # of the pressure, at which force and torque are given
NAMED = np.radians([-20.0, 0.0, 20.0])  # angles at which the text gives them [rad]


@dataclass(frozen=True, eq=False, repr=False)
class PathFacts(Shown):
    """The alike muscles of one group, over the ankle's angle, at rest and without friction."""

    muscles: tuple[str, ...]  # their names
    group: MuscleGroup  # as the orthosis describes it
    chamber: str  # on which they hang
    angles: np.ndarray  # over the ankle's stops, with the ends of the range of motion, and zero [rad] (n,)
    range: Span  # of motion [rad]
    length: np.ndarray  # of the path [m] (n,); over a pulley, of muscle and path that is left to it
    hardware: float  # of what is in series and does not contract: fittings, link, slack [m]
    path: np.ndarray  # contraction ratio that the path leaves the muscle [-] (n,)
    arm: np.ndarray  # moment arm −dL/dθ [m] (n,)
    pressures: np.ndarray  # gauge: none, half, full [Pa] (3,)
    own: np.ndarray  # contraction ratio of a muscle itself at these pressures [-] (n, 3)
    force: np.ndarray  # tension of one muscle [N] (n, 3)
    torque: np.ndarray  # of all of them, dorsiflexion positive [N·m] (n, 3)
    slack: tuple[tuple[Span, ...], tuple[Span, ...]]  # hanging through without air, at full pressure
    locked: tuple[Span, ...]  # where without air the braid would lock
    stretched: tuple[Span, ...]  # or be stretched beyond its limit
    short: tuple[Span, ...]  # or have to be shorter than its limit

    @property
    def role(self) -> str:
        """The muscle group's name."""
        return self.muscles[0].rsplit("_", 1)[0]

    @property
    def name(self) -> str:
        """The group's name; of some of its muscles, their numbers too."""
        if len(self.muscles) == self.group.count:
            return self.role
        return f"{self.role} {', '.join(m.rsplit('_', 1)[1] for m in self.muscles)}"

    @property
    def inside(self) -> np.ndarray:
        """Which angles are within the range of motion (n,)."""
        low, high = self.range
        return (self.angles >= low) & (self.angles <= high)

    @property
    def chain_length(self) -> np.ndarray:
        """Length of muscle, link and slack at each pressure [m] (n, 3); beyond the path's, it hangs."""
        return self.hardware + self.group.type.nominal_length * (1.0 - self.own)

    def at(self, angle: float) -> int:
        """The row of the angle [rad] that is nearest."""
        return int(np.argmin(np.abs(self.angles - angle)))

    def peak(self, column: int = -1) -> tuple[float, float]:
        """Torque of largest amount within the range of motion [N·m], and its angle [rad]."""
        torque = np.where(self.inside, self.torque[:, column], 0.0)
        row = int(np.argmax(np.abs(torque)))
        return float(torque[row]), float(self.angles[row])


def path_facts(built: Built, pressure: float | None = None) -> list[PathFacts]:
    """Facts of every muscle group of a compiled scenario; of muscles that differ, an entry each."""
    scenario, index = built.scenario, built.index
    if not index.muscles:
        raise InputError("has no muscle", field="orthosis", value=scenario.orthosis.name)
    full = scenario.supply.pressure if pressure is None else pressure
    if not 0.0 < full <= 2e6:
        shown = f"{full * 1e-5:g} bar"
        raise InputError("is out of range", field="pressure", value=shown, allowed="above 0 bar, to 20 bar")
    # Angles over the ankle's stops, with the ends of the range of motion and those named in words [rad]
    lower, upper = map(float, built.model.joint("ankle").range)
    named = np.r_[NAMED, built.scenario.orthosis.range_of_motion]
    within = named[(named >= lower) & (named <= upper)]
    angles = np.unique(np.r_[np.linspace(lower, upper, ANGLE_COUNT), within])
    contraction, arm, _ = sweep_ankle(built.model, index, angles)
    pressures = full * np.array(PRESSURE_SHARES)
    own, force = _at_pressures(built, angles, pressures)
    groups = muscle_names(scenario.orthosis)
    columns = {name: k for k, name in enumerate(index.muscles)}
    found = []
    for muscles in _alike(list(groups), groups, contraction, columns):
        k = columns[muscles[0]]
        rows = contraction[:, k], arm[:, k], own[:, :, k], force[:, :, k]
        found.append(_facts(built, muscles, groups[muscles[0]], angles, pressures, *rows))
    return found


def _facts(
    built: Built, muscles: tuple[str, ...], group: MuscleGroup, angles: np.ndarray, pressures: np.ndarray,
    path: np.ndarray, arm: np.ndarray, own: np.ndarray, force: np.ndarray,
) -> PathFacts:  # fmt: skip
    """Facts of alike muscles; contraction of path and muscle, moment arm and force are those of one."""
    kind, orthosis, model, index = group.type, built.scenario.orthosis, built.model, built.index
    # contraction ratios at which it hangs freely; without air 0
    natural = np.array(
        [float(kind.contraction(p, force=0.0)) if p > 0.0 else 0.0 for p in pressures.tolist()]
    )
    row = model.actuator_user[index.muscles[muscles[0]]]
    nominal, series = row[native.MUSCLE_NOMINAL_LENGTH], row[native.MUSCLE_SERIES_LENGTH]
    hardware = kind.end_length if group.pulley is not None else group.series_length

    def exact(angle: float) -> float:
        lengths = sweep_lengths(model, [index.muscles[muscles[0]]], index.ankle_qpos, np.array([angle]))
        return float((nominal + series - lengths[0, 0]) / nominal)

    def above(level: float) -> tuple[Span, ...]:
        return spans_above(angles, path - level, lambda angle: exact(angle) - level)

    def below(kappa: float) -> tuple[Span, ...]:
        level = path_contraction(group, orthosis)(kappa)
        return spans_above(angles, -(path - level), lambda angle: -(exact(angle) - level))

    return PathFacts(
        muscles=muscles,
        group=group,
        chamber=chamber_of(muscles[0], group),
        angles=angles,
        range=orthosis.range_of_motion,
        length=hardware + kind.nominal_length * (1.0 - path),
        hardware=hardware,
        path=path,
        arm=arm,
        pressures=pressures,
        own=np.where(force > 0.0, np.minimum(own, natural), natural),
        force=force,
        torque=len(muscles) * force * arm[:, None],
        slack=(above(float(natural[0])), above(float(natural[-1]))),
        locked=below(kind.braid.lock),
        stretched=below(kind.limits.contraction_min),
        short=above(kind.limits.contraction_max),
    )


def _alike(
    names: list[str], groups: dict[str, MuscleGroup], contraction: np.ndarray, columns: dict[str, int]
) -> list[tuple[str, ...]]:
    """The muscles, those of a group together whose paths are as long at every angle."""
    found: list[list[str]] = []
    for name in names:
        for others in found:
            first = others[0]
            gap = np.abs(contraction[:, columns[name]] - contraction[:, columns[first]]).max()
            if groups[first] is groups[name] and gap * groups[name].type.nominal_length < ALIKE:
                others.append(name)
                break
        else:
            found.append([name])
    return [tuple(muscles) for muscles in found]


def _at_pressures(built: Built, angles: np.ndarray, pressures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Own contraction ratios [-] and tensions [N] at rest, (angles, pressures, muscles)."""
    model, index = built.model, built.index
    names, groups = list(index.muscles), muscle_names(built.scenario.orthosis)
    own = np.zeros((len(angles), len(pressures), len(names)))
    force = np.zeros_like(own)
    data = mujoco.MjData(model)
    with native.installed(built.scenario.callback):
        for chamber, number in index.chambers.items():
            members = [k for k, name in enumerate(names) if chamber_of(name, groups[name]) == chamber]
            for row, angle in enumerate(angles):
                for column, pressure in enumerate(pressures):
                    data.qpos[index.ankle_qpos] = angle
                    native.fill_chambers(model, data, {number: float(pressure)})
                    mujoco.mj_forward(model, data)
                    for k in members:
                        muscle = index.muscles[names[k]]
                        own[row, column, k] = native.read_own(model, data.userdata, muscle).contraction
                        force[row, column, k] = -data.actuator_force[muscle]
    return own, force


def spans_above(angles: np.ndarray, values: np.ndarray, of: Callable[[float], float]) -> tuple[Span, ...]:
    """Ranges of angles in which a function is positive."""

    def edge(k: int) -> float:
        if k in (0, len(angles)):
            return float(angles[max(k - 1, 0)])
        return root(of, angles[k - 1], angles[k], ANGLE_TOLERANCE)

    above = np.r_[False, values > 0.0, False]
    return tuple((edge(a), edge(b)) for a, b in np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2))
