"""What the intervals of a torque fit do not hold: errors that all readings share, and held stiffnesses.

An angle's zero that is off moves every reading alike. The fit then lies as close as before, at other
parameters, and no scatter tells. So the fit is done again with each such error, of a usual size.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.lab.fitting.torque_data import WITHOUT_AIR, Readings
from afo_sim.lab.fitting.torque_problem import Group, TorqueProblem
from afo_sim.lab.fitting.torque_search import Solution, solve

ANGLE, TORQUE, PRESSURE = np.radians(1.0), 1.02, 5e3  # a goniometer's zero, a scale, a gauge's zero
STIFFER = 1.1  # a held stiffness; one of a calf cuff is known far less well


@dataclass(frozen=True)
class SharedError:
    """A fit done again as if something were off: what, and the parameters [SI] that come out.

    `held` is the name of a stiffness that the fit holds, "" for an error of the readings.
    """

    cause: str
    values: dict[str, float]
    held: str = ""


def shared_errors(solution: Solution) -> tuple[SharedError, ...]:
    """Fits with an error that all readings share, and with another value of what the fit holds."""
    return tuple(
        SharedError(cause, solve(problem, solution.x).values, held)
        for cause, problem, held in _problems(solution.problem)
    )


def doubts(solution: Solution, told: Sequence[str], shared: Sequence[SharedError]) -> Iterator[str]:
    """A sentence on each told parameter that a held stiffness moves by more than its interval."""
    for k, p in enumerate(solution.problem.free):
        for each in shared:
            x = p.coordinate(max(each.values[p.name], p.lower))
            if each.held and p.name in told and abs(x - solution.x[k]) > solution.half[k]:
                yield (
                    f"{p.name} stands on {each.held}, which is the orthosis' own and was not fitted: with "
                    f"{each.cause} it is {p.text(each.values[p.name])}, beyond its interval"
                )


def _problems(problem: TorqueProblem) -> Iterator[tuple[str, TorqueProblem, str]]:
    yield "all angles 1 deg higher", _reread(problem, lambda r: replace(r, angle=r.angle + ANGLE)), ""
    yield "all torques 2 % larger", _reread(problem, lambda r: replace(r, torque=TORQUE * r.torque)), ""
    yield "all pressures 0.05 bar higher", _reread(problem, _more_pressure), ""
    for name, values in _held(problem).items():
        if name not in problem.names and len(values) == 1:
            stiffer = replace(problem, held={**problem.held, name: STIFFER * min(values)})
            yield f"a {name} 10 % higher", stiffer, name


def _more_pressure(readings: Readings) -> Readings:
    """Without air a gauge is set to zero."""
    pressure = readings.pressure
    return replace(readings, pressure=pressure + np.where(pressure > WITHOUT_AIR, PRESSURE, 0.0))


def _reread(problem: TorqueProblem, change: Callable[[Readings], Readings]) -> TorqueProblem:
    return replace(problem, groups=tuple(Group.of(change(g.readings), g.orthosis) for g in problem.groups))


def _held(problem: TorqueProblem) -> dict[str, set[float]]:
    """The finite stiffnesses [N/m] of the orthoses by the parameter that would fit them."""
    found: dict[str, set[float]] = {
        "series_stiffness": set(),
        "cuff_stiffness": set(),
        "plate_stiffness": set(),
    }
    for orthosis in (group.orthosis for group in problem.groups):
        cables = {muscle.cable.stiffness for muscle in orthosis.muscles_of(problem.chamber).values()}
        found["series_stiffness"] |= {float(k) for k in cables if np.isfinite(k)}
        for name, segment in (("cuff_stiffness", "shank"), ("plate_stiffness", "foot")):
            anchor = orthosis.anchor.get(segment)  # type: ignore[call-overload]
            if anchor is not None and anchor.stiffness is not None:
                found[name].add(float(anchor.stiffness))
    return found
