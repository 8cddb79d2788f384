"""A sweep's TOML file, read and checked."""

import os
import pathlib
from collections.abc import Mapping
from typing import Any

from pydantic import Field as Option
from pydantic import StrictInt, StrictStr, ValidationError, field_validator

from afo_sim.common import assets
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.description.quantity import refusal
from afo_sim.description.reader import load, split_key
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.metric import instead, told
from afo_sim.metrics.metric_words import OTHER, WORDS, words
from afo_sim.study.case_table import values_of
from afo_sim.study.constraint import Constraint, read_constraint
from afo_sim.study.parameter import Choice, Parameter
from afo_sim.study.parameter_table import ParameterReader, ParameterTable, StrictTable
from afo_sim.study.plan import Plan
from afo_sim.study.refused import first_error
from afo_sim.study.uncertainty.joint import joint_parameters

RANDOM = ("random", "latin-hypercube", "sobol", "saltelli")
UNCERTAINTY = "uncertainty"  # joint draws of what is not known
DESIGNS = ("grid", "list", *RANDOM, UNCERTAINTY)
CHUNK = 32  # cases


class SweepFile(StrictTable):
    """A sweep's file as it is written."""

    description: StrictStr = ""
    scenario: StrictStr | dict[str, Any]
    design: StrictStr
    cases: StrictInt | None = Option(default=None, ge=1)
    seed: StrictInt = Option(default=0, ge=0)
    metrics: tuple[StrictStr, ...] = ()
    keep: tuple[StrictInt, ...] = ()
    chunk: StrictInt = Option(default=CHUNK, ge=1)
    constraints: tuple[StrictStr, ...] = ()
    file: StrictStr | None = None
    spreads: StrictStr | None = None
    set: dict[str, Any] = Option(default_factory=dict)
    parameters: dict[str, ParameterTable] = Option(default_factory=dict)

    @field_validator("design")
    @classmethod
    def _is_a_design(cls, design: str) -> str:
        if design not in DESIGNS:
            raise refusal("is no design", ", ".join(DESIGNS), nearest=nearest_name(design, DESIGNS) or "")
        return design

    @field_validator("metrics")
    @classmethod
    def _are_metrics(cls, metrics: tuple[str, ...]) -> tuple[str, ...]:
        for name in metrics:
            if words(name).group == OTHER:
                problem = told(f"{name!r} is no metric", name)
                raise refusal(problem, "see `afo-sim run`", "", instead(name, WORDS) or "")
        return metrics

    @field_validator("keep")
    @classmethod
    def _are_cases(cls, keep: tuple[int, ...]) -> tuple[int, ...]:
        if any(case < 0 for case in keep):
            raise refusal("has a negative number", "numbers of cases, from 0")
        return keep


def read(path: str | os.PathLike[str]) -> Plan:
    """Read a sweep.

    Parameters
    ----------
    path : TOML file, or the name of a shipped sweep

    Returns
    -------
    Plan: keys, units and values fit the scenario, which is valid with the plan's fixed overrides

    Raises
    ------
    InputError
        The first thing that is wrong, with its field, value and what is allowed.
    """
    file = assets.find("sweep", os.fspath(path))
    return of_table(file, assets.read_toml(file))


def of_table(file: pathlib.Path, table: Mapping[str, Any]) -> Plan:
    """A sweep that stands in `file` as `table`; returns and raises as `read`."""
    try:
        written = SweepFile.model_validate(table)
    except ValidationError as error:
        raise first_error(file, table, error) from None
    _check_count(file, written)
    scenario = _scenario_of(file, written.scenario)
    sets = _flat(written.set)
    try:
        base = load("scenario", scenario, sets)
    except InputError as error:
        mine = error.field in sets or (error.file is None and error.field)
        field = f"set.{error.field}" if mine else "scenario"
        raise _elsewhere(error, file, field) from None
    parameters, notes = _told(file, written, base)
    check_keys(file, parameters, sets)
    constraints = _constraints(file, written, parameters)
    return Plan(
        file=file,
        description=written.description,
        scenario=scenario,
        design=written.design,
        cases=written.cases,
        seed=written.seed,
        metrics=written.metrics,
        keep=written.keep,
        chunk=written.chunk,
        set=sets,
        parameters=parameters,
        constraints=constraints,
        notes=notes,
    )


def _told(
    file: pathlib.Path, written: SweepFile, base: Scenario
) -> tuple[tuple[Parameter, ...], tuple[str, ...]]:
    """The parameters of a sweep, and what to tell of them."""
    if written.design != UNCERTAINTY:
        return _parameters(file, written, base), ()
    return joint_parameters(file, str(written.spreads), base, written.cases or 0, written.seed)


def _check_count(file: pathlib.Path, written: SweepFile) -> None:
    """The number of cases, and what else the design asks for or refuses."""
    joint = written.design == UNCERTAINTY
    counted = joint or written.design in RANDOM
    if not joint and not written.parameters:
        raise InputError(
            "is missing", file=file, field="parameters", allowed="a table [parameters.NAME] for each"
        )
    if joint and written.spreads is None:
        problem = f"is missing: the design {written.design!r} needs it"
        raise InputError(problem, file=file, field="spreads", allowed='such as "usual"')
    if counted and written.cases is None:
        raise InputError(f"is missing: the design {written.design!r} needs it", file=file, field="cases")
    for field, refused in (
        ("cases", not counted and written.cases is not None),
        ("file", written.design != "list" and written.file is not None),
        ("constraints", written.design in ("saltelli", UNCERTAINTY) and bool(written.constraints)),
        ("parameters", joint and bool(written.parameters)),
        ("spreads", not joint and written.spreads is not None),
    ):
        if refused:
            problem = f"does not go with the design {written.design!r}"
            if field == "constraints":
                whose = "joint draws" if joint else "sensitivity indices"
                problem += f": {whose} need every case of it"
            value = None if field == "parameters" else getattr(written, field)
            raise InputError(problem, file=file, field=field, value=value)


def _scenario_of(file: pathlib.Path, name: str | dict[str, Any]) -> str | dict[str, Any]:
    """The scenario's name, its whole path where it lies beside the sweep, or itself."""
    if not isinstance(name, str):
        return name
    beside = file.parent / name
    return str(beside.resolve()) if name not in assets.names("scenario") and beside.is_file() else name


def _flat(table: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """[set] as dotted keys, whether they were written "a.b" = … or a.b = …"""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and "value" not in value:
            found |= _flat(value, f"{above}{key}.")
        else:
            found[f"{above}{key}"] = value
    return found


def _parameters(file: pathlib.Path, written: SweepFile, base: Scenario) -> tuple[Parameter, ...]:
    tables = written.parameters
    if written.file is not None:
        for name, parameter in tables.items():
            if parameter.values is not None:
                problem = "is told by the file's column"
                raise InputError(
                    problem, file=file, field=f"parameters.{name}.values", allowed="values or file"
                )
        rows = values_of(file, written.file, tables)
        tables = {
            name: parameter.model_copy(update={"values": rows[name]}) if name in rows else parameter
            for name, parameter in tables.items()
        }
    found = tuple(
        ParameterReader(file, written.design, name, parameter, base).parameter()
        for name, parameter in tables.items()
    )
    if written.design == "list":
        lengths = {p.name: len(p.spread.values) for p in found if isinstance(p.spread, Choice)}
        if len(set(lengths.values())) != 1:
            each = ", ".join(f"{name}: {length}" for name, length in lengths.items())
            problem = (
                "the parameters' lists of values differ in length"
                if lengths
                else "there is no list of values"
            )
            raise InputError(
                problem, file=file, field="parameters", value=each or None, allowed="alike, row by row"
            )
    return found


def check_keys(file: pathlib.Path, parameters: tuple[Parameter, ...], sets: Mapping[str, Any]) -> None:
    """Refuse what is set twice: the same key, or one below another parameter's."""
    taken: dict[tuple[str, ...], tuple[str, str]] = {}
    for parameter in parameters:
        for key in parameter.keys:
            path = _parts(key)
            for other, (name, written) in taken.items():
                if path[: len(other)] == other or other[: len(path)] == path:
                    how = (
                        "what"
                        if path == other
                        else "what lies within"
                        if len(path) > len(other)
                        else "all of what"
                    )
                    raise InputError(
                        f"sets {how} {name!r} sets already ({written})",
                        file=file,
                        field=f"parameters.{parameter.name}.key",
                        value=key,
                    )
            taken[path] = (parameter.name, key)
    for key in sets:
        if _parts(key) in taken:
            problem = f"is set by the parameter {taken[_parts(key)][0]!r} too"
            raise InputError(problem, file=file, field=f"set.{key}", value=sets[key])


def _parts(key: str) -> tuple[str, ...]:
    path, items = split_key(key)
    return (*path, *(f"[{item}]" for item in items))


def _constraints(
    file: pathlib.Path, written: SweepFile, parameters: tuple[Parameter, ...]
) -> tuple[Constraint, ...]:
    found = []
    for number, text in enumerate(written.constraints):
        try:
            found.append(read_constraint(text, parameters))
        except InputError as error:
            raise _elsewhere(error, file, f"constraints[{number}]") from None
    return tuple(found)


def _elsewhere(error: InputError, file: pathlib.Path, field: str) -> InputError:
    """The same error, as one of this file and field; what it said of another file stays in its words."""
    problem = f"{error.problem} (in {error.file}: {error.field})" if error.file else error.problem
    facts = {"value": error.value, "allowed": error.allowed, "nearest": error.nearest}
    return InputError(problem, file=file, field=field, **facts)  # type: ignore[arg-type]
