"""What static torques determine of each parameter: an interval, or why there is none; and doubts.

No interval holds an error that all readings share, or another value of a stiffness that is held: an angle's
zero that is off moves every reading alike. So the fit is done again with each such error (`shared_errors`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t

from afo_sim.common import Notice
from afo_sim.lab.identifiability import refused, rms, unidentified
from afo_sim.lab.solution import HeldOut, Solution, verdict
from afo_sim.lab.torque_data import WITHOUT_AIR, Readings
from afo_sim.lab.torque_device import ANCHORS
from afo_sim.lab.torque_problem import Group, TorqueProblem, arms_off, errors, predict
from afo_sim.lab.torque_solution import Alternative, Apart, solve

TIGHT = 0.2  # half an interval, in a parameter's size or as a ratio, that tells even what nothing needs
CONTRADICT = 0.05  # chance that groups share a value, below which their scatter is the interval
ANGLE, TORQUE, PRESSURE = np.radians(1.0), 1.02, 5e3  # a goniometer's zero, a scale, a gauge's zero
STIFFER = 1.1  # a held stiffness; one of a calf cuff is known far less well
COARSE = 0.3  # of the mean torque: errors larger than this leave little of the model
AIRLESS = 0.1  # of the largest torque: more without air is the limb's own
RIGID = 0.5  # of the stiffest that is searched: beyond, nothing gives
PULL = 0.02  # of the largest torque: more than this, and than scatter, is a pull
HANGING_TOGETHER = 0.5  # correlation of neighbouring errors that is no scatter


def scattered(solution: Solution, groups: Apart | None) -> tuple[Solution, list[Notice]]:
    """The solution with intervals as wide as contradicting groups make them, and a sentence on each."""
    if groups is None:
        return solution, []
    half = solution.half.copy()
    said: list[Notice] = []
    count = len(groups.x)
    scatter = t.ppf(0.975, count - 1) * np.std(groups.x, axis=0, ddof=1) / np.sqrt(count)
    for k, p in enumerate(solution.problem.free):
        if groups.chance[p.name] < CONTRADICT and scatter[k] > half[k]:
            half[k] = scatter[k]
            own = [values[p.name] for values in groups.values.values()]
            text = "{subject}: the groups contradict each other ({least} to {largest} when fitted alone); "
            text += "the interval is their scatter"
            least, largest = p.text(min(own)), p.text(max(own))
            said.append(Notice("groups-contradict", text, subject=p.name, least=least, largest=largest))
    return replace(solution, half=half), said


def unknowns(
    solution: Solution, kind: str, others: Sequence[Alternative], held: dict[str, HeldOut]
) -> list[Notice]:
    """A notice for each group of parameters that the readings do not identify."""
    lines = _as_well_without(solution, kind, others, held)
    lines += verdict(solution)
    # at one pressure a law's strength and its dependence on pressure are one, and so is the compliance
    one = len(np.unique(solution.problem.levels)) == 1 and any(p.of_law for p in solution.problem.free)
    if one and not set(solution.problem.names) <= refused(lines):
        why = "not identifiable one by one: the readings are at one pressure, "
        why += "where the law's strength is mistaken for stiffness"
        lines.append(unidentified("one-pressure", solution.problem.names, why))
    return lines


def _as_well_without(
    solution: Solution, kind: str, others: Sequence[Alternative], held: dict[str, HeldOut]
) -> list[Notice]:
    """Parameters that do not lower the error of what was left out, with those whose value they change."""
    lines = []
    for other in others:
        if not other.beaten or solution.half[solution.problem.names.index(other.dropped)] <= TIGHT:
            continue
        names = [
            p.name
            for k, p in enumerate(solution.problem.free)
            if p.name == other.dropped
            or abs(p.coordinate(other.values[p.name]) - solution.x[k]) > 0.5 * solution.half[k]
        ]
        left = [p for p in solution.problem.free if p.name != other.dropped]
        rest = ", ".join(f"{p.name} {p.text(other.values[p.name])}" for p in left)
        words = "not identifiable one by one" if len(names) > 1 else "not identifiable"
        why = f"{words}: without {other.dropped} ({rest}) the {kind} that is left out is predicted as well, "
        why += f"to {other.rms:.3g} N·m against {held[kind].rms:.3g} N·m with it, "
        why += "which is within the scatter"
        lines.append(unidentified("as-well-without", names, why))
    return lines


@dataclass(frozen=True)
class SharedError:
    """A fit done again as if something were off: what, and the parameters [SI] that come out."""

    cause: str  # in words
    values: dict[str, float]  # by parameter [SI]
    held: str = ""  # parameter that the fit holds and that was changed; ""


def shared_errors(solution: Solution) -> tuple[SharedError, ...]:
    """Fits with an error that all readings share, and with another value of what the fit holds."""
    return tuple(
        SharedError(cause, solve(problem, solution.x).values, held)
        for cause, problem, held in _problems(solution.problem)
    )


def doubts(solution: Solution, told: Sequence[str], shared: Sequence[SharedError]) -> Iterator[Notice]:
    """A notice on each parameter that a held stiffness changes by more than its interval."""
    for k, p in enumerate(solution.problem.free):
        for each in shared:
            x = p.coordinate(max(each.values[p.name], p.lower))
            if each.held and p.name in told and abs(x - solution.x[k]) > solution.half[k]:
                text = (
                    "{subject} depends on {held}, which is taken from the orthosis and was not fitted: with "
                )
                text += "{cause} it is {value}, outside its interval"
                told_of = {"subject": p.name, "held": each.held, "cause": each.cause}
                yield Notice("depends-on-held", text, value=p.text(each.values[p.name]), **told_of)


def _problems(problem: TorqueProblem) -> Iterator[tuple[str, TorqueProblem, str]]:
    yield "all angles 1 deg higher", _reread(problem, lambda r: replace(r, angle=r.angle + ANGLE)), ""
    yield "all torques 2 % larger", _reread(problem, lambda r: replace(r, torque=TORQUE * r.torque)), ""

    def filled(r: Readings) -> Readings:  # without air a gauge is set to zero
        return replace(r, pressure=r.pressure + np.where(r.pressure > WITHOUT_AIR, PRESSURE, 0.0))

    yield "all pressures 0.05 bar higher", _reread(problem, filled), ""
    for name, values in _held(problem).items():
        if name not in problem.names and len(values) == 1:
            stiffer = replace(problem, fixed={**problem.fixed, name: STIFFER * min(values)})
            yield f"a {name} 10 % higher", stiffer, name


def _reread(problem: TorqueProblem, change: Callable[[Readings], Readings]) -> TorqueProblem:
    return replace(problem, groups=tuple(Group(change(g.readings), g.orthosis) for g in problem.groups))


def _held(problem: TorqueProblem) -> dict[str, set[float]]:
    """The finite stiffnesses [N/m] of the orthoses by the parameter that would fit them."""
    found = {name: set[float]() for name in ("series_stiffness", *ANCHORS)}
    for orthosis in (group.orthosis for group in problem.groups):
        cables = {muscle.cable.stiffness for muscle in orthosis.muscles_of(problem.chamber).values()}
        found["series_stiffness"] |= {float(k) for k in cables if np.isfinite(k)}
        for name, segment in zip(ANCHORS, orthosis.words.segments, strict=True):
            anchor = orthosis.anchor.get(segment)
            if anchor is not None and anchor.stiffness is not None:
                found[name].add(float(anchor.stiffness))
    return found


def warnings_of(solution: Solution, added: Sequence[str]) -> Iterator[Notice]:
    """Warnings of a fit; `added` are parameters that were fitted without a request."""
    problem = solution.problem
    for name in added:
        yield Notice("fitted-too", "{subject} is fitted too: a column `cuff` would measure it", subject=name)
    angle = np.degrees(problem.column("angle"))
    pressure, torque = problem.column("pressure"), problem.column("torque")
    lower, upper = np.degrees(np.array([g.orthosis.range_of_motion for g in problem.groups])).T
    if angle.min() < lower.min() - 0.1 or angle.max() > upper.max() + 0.1:
        text = f"angles go from {angle.min():.3g} to {angle.max():.3g} deg, beyond the orthosis' "
        yield Notice("beyond-motion", f"{text}range_of_motion: check unit and zero")
    for group in problem.groups:
        yield from arms_off(group.readings)
    yield from beyond_law(solution)
    found = predict(problem, solution.values)["torque"]
    taut = found != 0.0
    scatter = float(np.sqrt(np.mean((found - torque)[taut] ** 2))) if taut.any() else 0.0
    slack = int(np.sum(~taut & (np.abs(torque) > max(PULL * np.abs(found).max(), 4.0 * scatter))))
    if slack:
        text = "at {settings} the fitted muscle is slack where a torque was measured"
        yield Notice("slack", text, settings="1 setting" if slack == 1 else f"{slack} settings")
    yield from _held_soft(solution)
    if len(np.unique(problem.levels)) == 1:
        text = "the readings are at one pressure: an error of the law's force is mistaken for stiffness or "
        yield Notice("one-pressure", f"{text}offset; readings at three pressures distinguish them")
    missed = errors(problem, solution.values)["torque"]
    share = rms(missed) / float(np.abs(torque).mean())
    if share > COARSE:
        text = f"the errors are {100 * share:.0f} % of the mean torque: the model lacks something, such as "
        yield Notice("coarse", f"{text}friction, a moment arm or the angle's zero", share=share)
    if solution.memory > HANGING_TOGETHER:
        text = "errors at neighbouring angles are correlated ({memory:.2f}): they are the "
        text += "model's, not the gauge's; the intervals count them as fewer points"
        yield Notice("errors-correlated", text, memory=solution.memory)
    airless = (pressure <= WITHOUT_AIR) & (np.abs(missed) > AIRLESS * np.abs(torque).max())
    if airless.any() and not problem.difference:
        empty = np.abs(torque[pressure <= WITHOUT_AIR]).max()
        text = f"without air the torque reads up to {empty:.3g} N·m: the limb's weight or tissue is in it; "
        yield Notice("torque-without-air", f"{text}remove it, or fit with torque = difference")


def beyond_law(solution: Solution) -> Iterator[Notice]:
    """A notice on each muscle that was filled beyond the pressures at which its law holds."""
    problem = solution.problem
    for name, group in problem.groups[0].orthosis.muscles_of(problem.chamber).items():
        low, high = group.type.law_set.pressure_range
        pressure = problem.column("pressure")
        filled = pressure[pressure > WITHOUT_AIR]
        if len(filled) and (filled.min() < 0.98 * low or filled.max() > 1.02 * high):
            asked = f"pressures go from {filled.min() * 1e-5:.3g} to {filled.max() * 1e-5:.3g} bar"
            holds = f"{group.type.law} holds from {low * 1e-5:.3g} to {high * 1e-5:.3g} bar"
            text = f"{{subject}}: {asked}, and {holds}"
            yield Notice("beyond-law", text, subject=name, quantity="pressure")


def _held_soft(solution: Solution) -> Iterator[Notice]:
    """Cables that end rigid, and a model that still is too weak: what is held gives more than the device."""
    problem, orthosis = solution.problem, solution.problem.groups[0].orthosis
    free = next((p for p in problem.free if p.name == "series_stiffness"), None)
    missed, torque = errors(problem, solution.values)["torque"], problem.column("torque")
    weaker = float(np.nansum(missed * np.sign(torque))) < 0.0  # errors are predicted less measured
    held = [f"{name}_stiffness" for name in ("cuff", "plate") if f"{name}_stiffness" not in problem.names]
    if free is None or not weaker or not held or not orthosis.anchored:
        return
    if solution.values[free.name] > RIGID * free.upper:
        text = "with rigid cables the readings are still stronger: what is held is softer in the "
        text += f"orthosis' file than on the device, or an anchor is elsewhere: try --free {held[0]}"
        yield Notice("held-soft", text, subject=held[0])
