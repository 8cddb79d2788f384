"""A design search as its TOML file describes it: parameters, objective, limits, patients."""

import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field as Option
from pydantic import InstanceOf, StrictFloat, StrictInt, StrictStr, model_validator

from afo_sim.common import Given, InputError, JsonDict, JsonMapping, assets, parse_quantity
from afo_sim.description import refusal
from afo_sim.metrics import OwnMetric, named
from afo_sim.study import sweep_plan
from afo_sim.study.design import Cases, case_seeds, cases_of
from afo_sim.study.folder import fingerprint
from afo_sim.study.parameter import OwnSeed, Range, Span
from afo_sim.study.parameter_table import ParameterTable, StrictTable
from afo_sim.study.search.aim import (
    LACKING,
    OBJECTIVE,
    OF_LIMIT,
    OUTSIDE,
    PATIENT,
    Aim,
    Limit,
    Objective,
    Problem,
)

SURROGATE: Literal["surrogate"] = "surrogate"
CMA_ES: Literal["cma-es"] = "cma-es"
_FRESH = 4  # times as many patients as the designs were judged by, to judge the best one again
_JUDGING = ("grid", "list", "random", "latin-hypercube", "sobol")  # designs that patients can be of
_FIXED_COLUMNS = (
    "generation", "start", "design", OUTSIDE, LACKING, OBJECTIVE, "feasible", "violation", "reason", PATIENT,
)  # fmt: skip


class SearchTable(StrictTable):
    """What a search's file states and its plan keeps."""

    description: StrictStr = ""
    scenario: StrictStr | JsonDict
    seed: StrictInt = Option(default=0, ge=0)
    generations: StrictInt = Option(default=40, ge=1)
    population: StrictInt | None = Option(default=None, ge=4)
    starts: StrictInt = Option(default=3, ge=1, le=100)
    method: Literal["surrogate", "cma-es"] = SURROGATE


class SearchPlan(SearchTable):
    """A design search, checked."""

    file: pathlib.Path
    designs: sweep_plan.Plan
    patients: sweep_plan.Plan | None
    objective: InstanceOf[Objective]
    limits: tuple[InstanceOf[Limit], ...]

    @property
    def proposer(self) -> str:
        """The method that proposes designs; the surrogate is of numbers that may have any value."""
        return CMA_ES if any(p.whole for p in self.designs.parameters) else self.method

    def walked(self) -> "SearchPlan":
        """The same with settled strides that are walked to, not solved for."""
        return self.model_copy(update={"designs": self.designs.walked()})

    def problem(self, aim: Aim, patients: Cases | None) -> Problem:
        """The problem to solve, with what distinguishes the patients."""
        plan = self.designs
        judged = plan.parameters, plan.constraints, aim, plan.seed, self.population, self.starts
        return Problem(*judged, self.proposer, *([_traits(patients)] if patients else []))

    def aim(self, units: Mapping[str, str], *, sampled: bool = False) -> Aim:
        """Objective and limits, by the units that the scenario's metrics have."""
        sweep_plan.check_metric(self.file, "objective.metric", self.objective.metric, units)
        drawn = sampled and self.patients is not None and self.patients.cases is not None
        limits = []
        for number, limit in enumerate(self.limits):
            sweep_plan.check_metric(self.file, f"limits[{number}].metric", limit.metric, units)
            bound = limit.bound.replace("%", " percent") if isinstance(limit.bound, str) else limit.bound
            try:
                bound = parse_quantity(bound, units[limit.metric])
            except ValueError as error:
                field = f"limits[{number}].{limit.option}"
                raise InputError(str(error), file=self.file, field=field, value=limit.bound) from None
            limits.append(replace(limit, bound=bound, sampled=drawn))
        return Aim(self.objective, tuple(limits))

    def judging(self) -> Cases | None:
        """The patients by which every design is judged."""
        return _patients_of(self.patients) if self.patients else None

    def fresh(self) -> Cases | None:
        """Patients that no design has seen: of another seed, and more of them; None where none can be."""
        if self.patients is None or self.patients.cases is None:
            return None
        count, seed = _FRESH * self.patients.cases, self.patients.seed + 1
        return _patients_of(self.patients.model_copy(update={"cases": count, "seed": seed}))

    def as_cases(self, values: Mapping[str, np.ndarray]) -> Cases:
        """Designs as cases of a sweep; {parameter: values (n,) [SI]}."""
        count = len(next(iter(values.values())))
        return Cases(self.designs, dict(values), case_seeds(self.designs.seed, count), 0)

    def fingerprint(self) -> JsonDict:
        """Everything that decides the result: the search, this program's code, its libraries."""
        written = {
            "designs": self.designs.canonical(),
            "patients": self.patients.canonical() if self.patients else None,
            "objective": repr(self.objective),
            "limits": repr(self.limits),
            "population": self.population,
            "starts": self.starts,
            "method": self.proposer,
        }
        return fingerprint("search", written, "cma" if self.proposer == CMA_ES else "scipy")


class ObjectiveTable(StrictTable):
    metric: sweep_plan.Metric
    goal: Literal["lowest", "highest"]
    over: Literal["mean", "median", "worst"] = "mean"


class LimitTable(StrictTable):
    metric: sweep_plan.Metric
    at_least: StrictStr | StrictFloat | StrictInt | None = None
    at_most: StrictStr | StrictFloat | StrictInt | None = None
    share: StrictFloat | StrictInt = Option(default=1.0, gt=0.0, le=1.0)

    @model_validator(mode="after")
    def _has_one_bound(self) -> "LimitTable":
        if (self.at_least is None) == (self.at_most is None):
            raise refusal("the bound is not stated, or twice", "at_least or at_most", "at_least")
        return self


class PatientsTable(StrictTable):
    design: Annotated[StrictStr, sweep_plan.one_of(_JUDGING, "is not a valid design of patients")]
    cases: StrictInt | None = Option(default=None, ge=1)
    seed: StrictInt = Option(default=0, ge=0)
    file: StrictStr | None = None
    constraints: tuple[StrictStr, ...] = ()
    parameters: dict[str, ParameterTable] = Option(min_length=1)


class SearchFile(SearchTable):
    """A search's file as it is written."""

    constraints: tuple[StrictStr, ...] = ()
    set: JsonDict = Option(default_factory=dict)
    walkers: StrictStr | None = None
    parameters: dict[str, ParameterTable] = Option(min_length=1)
    objective: ObjectiveTable
    limits: tuple[LimitTable, ...] = ()
    patients: PatientsTable | None = None


def read(path: str | os.PathLike[str]) -> SearchPlan:
    """Read a design search."""
    file = assets.find("search", os.fspath(path))
    return _of_table(file, assets.read_toml(file))


def search_of(
    scenario: Given, over: Mapping[str, object], *, lowest: str | OwnMetric = "",
    highest: str | OwnMetric = "", of: Literal["mean", "median", "worst"] = "mean",
    limits: Sequence[str] = (), patients: Mapping[str, object] | None = None, **options: Given,
) -> SearchPlan:  # fmt: skip
    """A design search without a file."""
    file = pathlib.Path("search")
    if bool(lowest) == bool(highest):
        raise InputError("is not stated, or twice", file=file, field="objective", allowed="lowest or highest")
    (goal,) = named([lowest or highest])
    ranges = {key: Span(*written) if isinstance(written, tuple) else written for key, written in over.items()}
    bounds = []
    for number, text in enumerate(limits):
        found = re.fullmatch(r"\s*(\w+)\s*(>=|<=)\s*(.+?)(?:\s+in\s+([\d.]+)\s*%)?\s*", text)
        if found is None:
            at, example = f"limits[{number}]", "toe_clearance >= 10 mm in 95 %"
            raise InputError("is not a valid limit", file=file, field=at, value=text, allowed=example)
        metric, sign, bound, share = found.groups()
        bounds.append({"metric": metric, "at_least" if sign == ">=" else "at_most": bound})
        bounds[-1] |= {"share": float(share) / 100.0} if share else {}
    table = {
        "scenario": sweep_plan.plain_scenario(scenario),
        "parameters": sweep_plan.parameter_tables(ranges),
        "objective": {"metric": goal, "goal": "lowest" if lowest else "highest", "over": of},
        "limits": tuple(bounds),
        "set": dict(options.pop("sets", None) or {}),
        **options,
    }
    return _of_table(file, table | ({"patients": dict(patients)} if patients else {}))


def _of_table(file: pathlib.Path, table: JsonMapping) -> SearchPlan:
    """A search that stands in `file` as `table`; raises as `read`."""
    written = SearchFile.read(file, table)
    if written.walkers is not None and written.patients is not None:
        raise InputError("does not go with walkers, who are the patients", file=file, field="patients")
    base = {"scenario": written.scenario, "set": written.set}
    searched = {name: getattr(written, name) for name in ("seed", "constraints", "parameters", "walkers")}
    designs = sweep_plan.planned(file, sweep_plan.SweepFile(**base | searched, design="random", cases=1))
    limits: list[Limit] = []
    for one in written.limits:
        at_least = one.at_least is not None
        bound = one.at_least if at_least else one.at_most
        number = 1 + sum((limit.metric, limit.at_least) == (one.metric, at_least) for limit in limits)
        limits.append(Limit(one.metric, at_least, bound, float(one.share), number))
    taken = {*_FIXED_COLUMNS, *(f"{limit.name}_{what}" for limit in limits for what in OF_LIMIT)}
    for parameter in designs.parameters:
        at = f"parameters.{parameter.name}"
        if not isinstance(parameter.spread, Range):
            given = written.parameters[parameter.name].model_dump(exclude_none=True)
            option = next((name for name in ("values", "distribution", "from_seed") if name in given), "")
            problem, at = "is not a range that can be searched", f"{at}.{option}"
            raise InputError(problem, file=file, field=at, value=given.get(option), allowed="from and to")
        if parameter.name in taken:
            problem = "is what another column of the designs is called"
            raise InputError(problem, file=file, field=at, allowed="another name")
    patients = None if written.patients is None else _patients(file, base, written.patients, designs)
    stated = {name: getattr(written, name) for name in SearchTable.model_fields}
    objective = Objective(**written.objective.model_dump())
    planned_with = {"file": file, "designs": designs, "patients": patients}
    return SearchPlan(**stated, **planned_with, objective=objective, limits=tuple(limits))


def _patients(
    file: pathlib.Path, base: JsonDict, written: PatientsTable, designs: sweep_plan.Plan
) -> sweep_plan.Plan:
    stated = {name: getattr(written, name) for name in PatientsTable.model_fields}
    try:
        found = sweep_plan.planned(file, sweep_plan.SweepFile(**base | stated))
        for parameter in found.parameters:
            if parameter.name in (p.name for p in designs.parameters):
                field = f"parameters.{parameter.name}"
                problem = "is the name of a searched parameter, too"
                raise InputError(problem, file=file, field=field, allowed="another name")
        sweep_plan.check_keys(file, (*designs.parameters, *found.parameters), {})
        return found
    except InputError as error:
        raise error.replaced(field=f"patients.{error.field}") from None


def _patients_of(plan: sweep_plan.Plan) -> Cases:
    """The cases of [patients], which is a sweep's table."""
    try:
        return cases_of(plan)
    except InputError as error:
        raise error.replaced(field=f"patients.{error.field}") from None


def _traits(patients: Cases) -> np.ndarray:
    """Values of the patients' parameters in standard deviations, of a word 1 where it is it (n, traits)."""
    columns: list[np.ndarray] = []
    for parameter in patients.plan.parameters:
        values = patients.values[parameter.name]
        if parameter.words:
            columns += [(values == word).astype(np.float64) for word in sorted(set(values))]
        elif not isinstance(parameter.spread, OwnSeed):
            columns.append(values.astype(np.float64))
    varied = [column for column in columns if np.ptp(column) > 0.0]
    found = [(column - np.mean(column)) / np.std(column) for column in varied]
    return np.array(found).reshape(len(found), len(patients)).T
