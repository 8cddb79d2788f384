"""Compliance, offset and law of a mounted device from measured static torque."""

import os
import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import Given, InputError, Notice, Shown, TableLike, nearest_name, quantity_at, unknown
from afo_sim.description import Orthosis, reader
from afo_sim.lab import torque_problem, torque_solution
from afo_sim.lab.identifiability import Believed, refused
from afo_sim.lab.measured import require_once, several
from afo_sim.lab.solution import FitParameter, HeldOut, Progress, Solution, held_out, require_left_out, unseen
from afo_sim.lab.torque_belief import SharedError, doubts, scattered, shared_errors, unknowns, warnings_of
from afo_sim.lab.torque_data import ANGLE_RATE, PRESSURE_RATE, Torques, joined, read_torques
from afo_sim.lab.torque_device import fitted_orthosis
from afo_sim.lab.torque_laws import OfLaw, moves, of_laws, widened

USUAL_FIT = ("series_stiffness", "offset")
HOLD_OUT = ("all", "none", *torque_solution.KINDS)
MEANINGS = ("device", "difference")


@dataclass(frozen=True, repr=False, eq=False)
class TorqueFit(Believed, Shown):
    """Parameters of a mounted device, and how far they can be believed. SI.

    solution : where the search ended
    verdict : parameters that the readings do not identify, and why
    held_out : torque errors of readings left out, by what was left out
    judged_by : what was left out to judge the alternatives: "group", "angle", "pressure", or ""
    alternatives : the fits without each parameter
    apart : the fits to each group alone; None of one group or small ones
    remarks : of reading the files
    warnings : what the fit does not explain
    shared : fits as if all readings were off alike
    laws : fits with each law, the one in use first
    """

    solution: Solution
    verdict: tuple[Notice, ...]
    held_out: dict[str, HeldOut]
    judged_by: str
    alternatives: tuple[torque_solution.Alternative, ...]
    apart: torque_solution.Apart | None
    remarks: tuple[str, ...]
    warnings: tuple[Notice, ...]
    shared: tuple[SharedError, ...] = ()
    laws: tuple[OfLaw, ...] = ()

    def __repr__(self) -> str:
        """One line: parameters with intervals, error, and how many are refused."""
        lacking, kind = len(refused(self.verdict)), next(iter(self.held_out), "")
        error = f"{self.rms:.3g} N·m RMS over {len(self.problem)} settings"
        error += f", {self.held_out[kind].rms:.3g} with {kind} left out" if kind else ""
        error += f"; {lacking} not identifiable" if lacking else ""
        short = []
        for p in self.problem.free:
            ends = " to ".join(f"{p.number(end):.3g}" for end in self.intervals[p.name] or ())
            short.append(f"{p.name} = {p.text(self.parameters[p.name])} ({ends or 'no interval'})")
        return f"<TorqueFit: {', '.join(short)}; {error}>"

    @property
    def problem(self) -> torque_problem.TorqueProblem:
        """What was fitted to what."""
        return self.solution.problem

    @property
    def parameters(self) -> dict[str, float]:
        """The fitted values [SI]."""
        return self.solution.values

    @property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """95 % interval of each [SI], over the laws that fit comparably; None where it is not identified."""
        lacking = refused(self.verdict)
        return {
            p.name: None if p.name in lacking else widened(self.solution.interval(k), self.laws, p.name)
            for k, p in enumerate(self.problem.free)
        }

    @property
    def residuals(self) -> np.ndarray:
        """Predicted less measured torque, setting by setting [N·m]."""
        return torque_problem.errors(self.problem, self.parameters)["torque"]

    @property
    def rms(self) -> float:
        """Of the residuals, every reading alike [N·m]."""
        return torque_solution.root_mean_square(self.solution)

    @property
    def orthosis(self) -> Orthosis:
        """The orthosis with the fitted values, ready to run; with several, the first of `orthoses`."""
        return next(iter(self.orthoses.values()))

    @property
    def orthoses(self) -> dict[str, Orthosis]:
        """The fitted orthosis by group; all the same where one orthosis was measured."""
        problem, sources = self.problem, {p.name: self.source(p) for p in self.problem.free}
        return {
            g.readings.group: fitted_orthosis(g.orthosis, problem.chamber, self.parameters, sources)
            for g in problem.groups
        }

    def ends(self, parameter: FitParameter) -> str:
        """A parameter's interval, or why it has none."""
        interval = self.intervals[parameter.name]
        if interval is None:
            return f"no interval: {self.reason(parameter.name)}"
        low, high = (f"{parameter.number(end):.3g}" for end in interval)
        text = f"95 % interval {low} to {high} {parameter.shown}".strip()
        others = ", ".join(each.law for each in self.laws[1:] if each.comparable)
        within = f"and of the laws that fit comparably ({others})" if others else "alone"
        return f"{text}, of the readings' scatter {within}"

    def source(self, parameter: FitParameter) -> str:
        """The source of a fitted value in the orthosis' file."""
        files = ", ".join(dict.fromkeys(g.readings.file.name for g in self.problem.groups))
        together = [p.name for p in self.problem.free if p is not parameter]
        beside = f" with {', '.join(together)}" if together else ""
        text = f"fitted{beside} to {len(self.problem)} static torques of {files}, {self.rms:.3g} N·m RMS; "
        return text + self.ends(parameter)


def fit_torque(
    data: TableLike, orthosis: Given, fit: Sequence[str] = USUAL_FIT, *, hold_out: str | TableLike = "all",
    chamber: str = "", torque: str = "device", rates: Mapping[str, object] | None = None,
    report: Progress = lambda text: None,
) -> TorqueFit:  # fmt: skip
    """Fit the compliance between device and joint, and the muscle's law, to static torque, as `fit`.

    The joint is held at an angle, the muscle is filled, and the torque is read: dorsiflexion positive. At
    each reading the muscle is in balance with its cable, cuff and plate,

        κ = κ_path(φ) + [offset + F(κ, p)/k + Σ z(n F)]/L0,    M = Σ r(φ) F(κ, p),

    with path and moment arm r of the orthosis and k the `series_stiffness`.
    """
    if torque not in MEANINGS:
        raise unknown(torque, MEANINGS, field="torque")
    kinds, files = _held(hold_out)
    names = (fit,) if isinstance(fit, str) else tuple(fit)
    difference, orthoses = torque == "difference", _orthoses(orthosis)
    read, *others = (_read(each, chamber, difference, rates) for each in (data, *files))
    problem = _posed(read, orthoses, names, chamber, difference)
    further = [group for each in others for group in _groups(each, orthoses, problem.chamber)]
    report("fitting")
    solution = torque_solution.solve(problem)
    groups = torque_solution.apart(solution, report)
    solution, contradictions = scattered(solution, groups)
    found = held_out(solution.problem, kinds, torque_solution.from_start(solution.x), report)
    named = [each for each in several(hold_out) if isinstance(each, str)]
    require_left_out([kind for kind in kinds if kind in named], found)
    kind, alone = torque_solution.alternatives(solution, found, report)
    lines = unknowns(solution, kind, alone, found)
    laws = of_laws(solution, dict(found), report)
    if further:
        posed = {f"{g.readings.file.name} {g.readings.group}": replace(problem, groups=(g,)) for g in further}
        found["file"] = unseen([(name, each, solution.values) for name, each in posed.items()])
    shared = shared_errors(solution)
    moved = (each for each in moves(laws, problem.free) if each.severity == "warning")
    told = [*warnings_of(solution, [name for name in problem.names if name not in names])]
    told += doubts(solution, [name for name in problem.names if name not in refused(lines)], shared)
    doubted = (read.remarks, (*contradictions, *told, *moved))
    return TorqueFit(solution, tuple(lines), found, kind, alone, groups, *doubted, shared, laws)


def _held(hold_out: str | TableLike) -> tuple[tuple[str, ...], list[TableLike]]:
    """The kinds of parts to leave out, and further data to predict."""
    given = several(hold_out)
    kinds = [each for each in given if isinstance(each, str) and each in HOLD_OUT]
    unseen = [each for each in given if not (isinstance(each, str) and each in HOLD_OUT)]
    for each in unseen:
        if isinstance(each, str) and not pathlib.Path(each).is_file():
            problem, near = "is neither something to leave out nor a file", nearest_name(each, HOLD_OUT)
            allowed = f"{', '.join(HOLD_OUT)}, or a CSV"
            raise InputError(problem, field="hold_out", value=each, allowed=allowed, nearest=near)
    if "all" in kinds or (unseen and not kinds):
        return torque_solution.KINDS, unseen
    return tuple(dict.fromkeys(kind for kind in kinds if kind != "none")), unseen


def _orthoses(orthosis: Given) -> dict[str, Orthosis]:
    """The orthosis of every group, under its name; under "" the one of all."""
    by_group = isinstance(orthosis, Mapping) and not ({"muscle", "range_of_motion"} & set(orthosis))
    found = {}
    for group, source in (orthosis if by_group else {"": orthosis}).items():
        own: Orthosis = source if isinstance(source, Orthosis) else reader.load("orthosis", source)
        if not own.muscle:
            raise InputError("has no muscle", field="orthosis", value=own.name)
        found[str(group)] = own
    if not found:
        raise InputError("names no orthosis", field="orthosis")
    return found


def _read(data: TableLike, chamber: str, difference: bool, rates: Mapping[str, object] | None) -> Torques:
    """The readings of one or several files; several files are groups of their own."""
    sources = several(data)
    if not sources:
        raise InputError("names no data", field="data")
    bounds = {"angle": ANGLE_RATE, "pressure": PRESSURE_RATE}
    for name, text in (rates or {}).items():
        if name not in bounds:
            raise unknown(name, bounds, field="rates")
        bounds[name] = quantity_at(f"rates.{name}", text, {"angle": "rad/s", "pressure": "Pa/s"}[name])
        if bounds[name] <= 0.0:
            raise InputError("is out of range", field=f"rates.{name}", value=text, allowed="more than 0")
    require_once(sources)
    found: dict[str, Torques] = {}
    for k, source in enumerate(sources):
        if not isinstance(source, str | os.PathLike) and not hasattr(source, "keys"):
            shown, allowed = type(source).__name__, "a CSV, or {title: numbers}"
            raise InputError("is not valid data", field="data", value=shown, allowed=allowed)
        name = pathlib.Path(source).stem if isinstance(source, str | os.PathLike) else f"data {k + 1}"
        name = name if name not in found else f"{name} {k + 1}"
        rest = bounds["angle"], bounds["pressure"]
        found[name] = read_torques(source, chamber=chamber, difference=difference, rates=rest)
    return joined(found)


def _groups(
    read: Torques, orthoses: Mapping[str, Orthosis], chamber: str
) -> tuple[torque_problem.Group, ...]:
    found = []
    for name, readings in read.groups.items():
        orthosis = orthoses.get(name) or orthoses.get("")
        if orthosis is None:
            problem = "no orthosis is given for this group"
            raise unknown(name, orthoses, field="group", file=readings.file, problem=problem)
        found.append(torque_problem.Group(torque_problem.on_muscles(readings, orthosis, chamber), orthosis))
    return tuple(found)


def _posed(
    read: Torques, orthoses: Mapping[str, Orthosis], names: Sequence[str], chamber: str, difference: bool
) -> torque_problem.TorqueProblem:
    """The problem, if there is enough to fit; a measured cuff brings its stiffness with it."""
    chamber = torque_problem.choose_chamber(next(iter(orthoses.values())), chamber, read.chambers)
    for orthosis in orthoses.values():
        if chamber not in orthosis.chamber:
            lacking = "one of the orthoses has no such chamber"
            raise unknown(chamber, orthosis.chamber, field="chamber", problem=lacking)
    groups = _groups(read, orthoses, chamber)
    used = [group.orthosis for group in groups]
    cuff = any(np.isfinite(group.readings.cuff).any() for group in groups)
    wanted = [*names, *(["cuff_stiffness"] if cuff and "cuff_stiffness" not in names else [])]
    free = torque_problem.parameters(wanted, used, chamber)
    problem = torque_problem.TorqueProblem(groups, free, chamber, difference)
    if len(problem) <= len(problem.free):
        settings, parts = ("" if len(each) == 1 else "s" for each in (problem, problem.free))
        few = f"holds {len(problem)} different setting{settings} for {len(problem.free)} parameter{parts}"
        allowed = "more settings than parameters, or fewer parameters in the fit"
        raise InputError(few, file=groups[0].readings.file, allowed=allowed)
    torque_problem.require_possible(problem)
    return problem
