"""A sweep, checked: read from a TOML file or made of arguments, and the content that decides its results."""

import hashlib
import os
import pathlib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from typing import Annotated

from pydantic import AfterValidator, InstanceOf, StrictInt, StrictStr, field_validator
from pydantic import Field as Option

from afo_sim.common import Given, InputError, JsonDict, JsonMapping, Keywords, Shown, assets
from afo_sim.description import Scenario, load, refusal, refused_name
from afo_sim.description.reader import split_key
from afo_sim.metrics import OTHER, WORDS, instead, named, no_metric, told, words
from afo_sim.study.constraint import Constraint, read_constraint
from afo_sim.study.parameter import Choice, Parameter, Span
from afo_sim.study.parameter_table import ParameterReader, ParameterTable, StrictTable, is_free, values_of
from afo_sim.study.uncertainty.draw import joint_parameters
from afo_sim.study.walkers import decided_by

_RANDOM = ("random", "latin-hypercube", "sobol", "saltelli")
_UNCERTAINTY = "uncertainty"  # joint draws of what is not known
_DESIGNS = ("grid", "list", *_RANDOM, _UNCERTAINTY)


def one_of(designs: Sequence[str], problem: str) -> AfterValidator:
    """Refuses any other design."""

    def checked(design: str) -> str:
        if design not in designs:
            raise refused_name(problem, design, designs)
        return design

    return AfterValidator(checked)


def known_metric(name: str) -> str:
    """The name, if any run may have such a metric."""
    if words(name).group == OTHER:
        problem = told(f"{name!r} is not a valid metric", name)
        raise refusal(problem, "see `afo-sim run`", nearest=instead(name, WORDS) or "")
    return name


Metric = Annotated[StrictStr, AfterValidator(known_metric)]


class SweepTable(StrictTable):
    """What a sweep's file states and its plan keeps."""

    description: StrictStr = ""
    scenario: StrictStr | JsonDict
    design: Annotated[StrictStr, one_of(_DESIGNS, "is not a valid design")]
    cases: StrictInt | None = Option(default=None, ge=1)
    seed: StrictInt = Option(default=0, ge=0)
    metrics: tuple[Metric, ...] = ()
    keep: tuple[StrictInt, ...] = ()
    chunk: StrictInt = Option(default=32, ge=1)  # cases
    set: JsonDict = Option(default_factory=dict)
    walkers: StrictStr | None = None  # the condition whose patients walk in every case

    @field_validator("keep")
    @classmethod
    def _are_cases(cls, keep: tuple[int, ...]) -> tuple[int, ...]:
        if any(case < 0 for case in keep):
            raise refusal("has a negative number", "numbers of cases, from 0")
        return keep


class SweepFile(SweepTable):
    """A sweep's file as it is written."""

    constraints: tuple[StrictStr, ...] = ()
    file: StrictStr | None = None
    spreads: StrictStr | None = None
    parameters: dict[str, ParameterTable] = Option(default_factory=dict)


def check_metric(file: pathlib.Path, field: str, name: str, known: Collection[str]) -> None:
    """Refuse a metric that no case has."""
    if name not in known:
        problem, allowed = "is not a metric of these cases", ", ".join(sorted(known))
        raise no_metric(problem, name, known, file=file, field=field, allowed=allowed)


class Plan(SweepTable):
    """A sweep or the designs of a search, checked; from a file, from arguments or from a search alike."""

    file: pathlib.Path
    parameters: tuple[InstanceOf[Parameter], ...]
    constraints: tuple[InstanceOf[Constraint], ...]
    notes: tuple[str, ...] = ()

    @property
    def scenario_name(self) -> str:
        """The scenario in a word."""
        named = self.scenario if isinstance(self.scenario, str) else self.scenario.get("name")
        return pathlib.Path(named or "scenario").name

    def walked(self) -> "Plan":
        """The same with strides walked until they settle, not solved for; unchanged without walking."""
        if self.walkers is not None:
            raise InputError("does not go with walkers, who walk every stride", file=self.file, field="plain")
        if not load("scenario", self.scenario, self.set).walking:
            return self
        return self.model_copy(update={"set": self.set | {"gait.settled": "walked"}})

    def canonical(self) -> JsonDict:
        """Everything that decides the results, as JSON data, to compare two sweeps."""
        parameters = []
        for one in self.parameters:
            written = {"name": one.name, "keys": one.keys, "unit": one.unit}
            written |= {"spread": type(one.spread).__name__, **asdict(one.spread)}
            if isinstance(one.spread, Choice) and one.words:
                written["content"] = [_digest_of_word(one, str(word)) for word in one.spread.values]
            parameters.append(written)
        files = [_digest(str(path)) for path in decided_by(self.walkers)] if self.walkers else []
        return ({"walkers": files} if files else {}) | {
            "scenario": _content(load("scenario", self.scenario, self.set)),
            "set": self.set,  # holds over what a case swaps whole, also where it changes nothing here
            "design": self.design,
            "cases": self.cases,
            "seed": self.seed,
            "metrics": list(self.metrics),
            "parameters": parameters,
            "constraints": [constraint.text for constraint in self.constraints],
        }


def _content(description: Given) -> JsonDict:
    return _stripped(description.model_dump(mode="json"))


def _stripped(node: Given) -> Given:
    if isinstance(node, dict):
        written = {k: v for k, v in node.items() if not (k in ("name", "description") and isinstance(v, str))}
        files = {k: _digest(v) for k, v in written.items() if k in ("file", "cuff", "plate", "cycle") and v}
        return {k: _stripped(v) for k, v in (written | files).items() if k != "provenance"}
    return [_stripped(part) for part in node] if isinstance(node, list | tuple) else node


def _digest(path: str) -> str:
    """A file as the SHA-256 of its content; a shipped gait's name stands for its file."""
    file = pathlib.Path(path)
    file = file if file.is_file() else assets.find_gait(path)
    return f"sha256:{hashlib.sha256(file.read_bytes()).hexdigest()}"


def _digest_of_word(parameter: Parameter, word: str) -> Given:
    """The content that a word names, of a description or a file; None where it is the word alone."""
    path = parameter.files.get(word, word)
    if parameter.description:
        return _content(load(parameter.description, path))
    return _digest(path) if word in parameter.files or word in assets.gait_names() else None


def read(path: str | os.PathLike[str]) -> Plan:
    """Read a sweep."""
    file = assets.find("sweep", os.fspath(path))
    return of_table(file, assets.read_toml(file))


def of_table(file: pathlib.Path, table: JsonMapping) -> Plan:
    """A sweep from `table` of `file`; returns and raises as `read`."""
    return planned(file, SweepFile.read(file, table))


def planned(file: pathlib.Path, written: SweepFile) -> Plan:
    """The plan of a sweep from `file`; raises as `read`."""
    _check_count(file, written)
    scenario = written.scenario
    if isinstance(scenario, str) and scenario not in assets.names("scenario"):
        beside = file.parent / scenario
        scenario = str(beside.resolve()) if beside.is_file() else scenario
    sets = _flat(written.set)
    try:
        base = load("scenario", scenario, sets)
    except InputError as error:
        mine = error.field in sets or (error.file is None and error.field)
        raise _elsewhere(error, file, f"set.{error.field}" if mine else "scenario") from None
    if written.design == _UNCERTAINTY:
        spreads, cases = str(written.spreads), written.cases or 0
        parameters, notes = joint_parameters(file, spreads, base, cases, written.seed)
    else:
        parameters, notes = _parameters(file, written, base), ()
    check_keys(file, parameters, sets)
    constraints = []
    for number, text in enumerate(written.constraints):
        try:
            constraints.append(read_constraint(text, parameters))
        except InputError as error:
            raise _elsewhere(error, file, f"constraints[{number}]") from None
    stated = {name: getattr(written, name) for name in SweepTable.model_fields}
    stated |= {"scenario": scenario, "set": sets, "notes": notes}
    stated |= {} if written.walkers is None else _with_walkers(file, written, sets, parameters)
    return Plan(**stated, file=file, parameters=parameters, constraints=tuple(constraints))


def _check_count(file: pathlib.Path, written: SweepFile) -> None:
    """The number of cases, and what else the design asks for or refuses."""
    joint = written.design == _UNCERTAINTY
    counted = joint or written.design in _RANDOM
    if not joint and not written.parameters:
        allowed = "a table [parameters.NAME] for each"
        raise InputError("is missing", file=file, field="parameters", allowed=allowed)
    if joint and written.spreads is None:
        problem = f"is missing: the design {written.design!r} needs it"
        raise InputError(problem, file=file, field="spreads", allowed='such as "usual"')
    if counted and written.cases is None:
        raise InputError(f"is missing: the design {written.design!r} needs it", file=file, field="cases")
    for field, refused in (
        ("cases", not counted and written.cases is not None),
        ("file", written.design != "list" and written.file is not None),
        ("constraints", written.design in ("saltelli", _UNCERTAINTY) and bool(written.constraints)),
        ("parameters", joint and bool(written.parameters)),
        ("spreads", not joint and written.spreads is not None),
        ("walkers", joint and written.walkers is not None),
    ):
        if refused:
            problem = f"does not go with the design {written.design!r}"
            if field == "constraints":
                whose = "joint draws" if joint else "sensitivity indices"
                problem += f": {whose} need every case of it"
            value = None if field == "parameters" else getattr(written, field)
            raise InputError(problem, file=file, field=field, value=value)


def _with_walkers(
    file: pathlib.Path, written: SweepFile, sets: Mapping[str, object], parameters: tuple[Parameter, ...]
) -> JsonDict:
    """What a plan holds of patients who respond; refused is what does not go with them."""
    taken = {f"set.{key}": key for key in sets}
    taken |= {f"parameters.{one.name}.key": key for one in parameters for key in one.keys}
    taken |= {"keep": "keep"} if written.keep else {}
    for field, key in taken.items():
        if key.split(".")[0] in ("patient", "gait", "keep"):
            problem = "does not go with walkers: they are the condition's patients, and nothing is recorded"
            raise InputError(problem, file=file, field=field, value=key, allowed="none, or of the device")
    condition = str(assets.find("population", str(written.walkers), file).resolve())
    decided_by(condition)  # says now what is wrong with it
    return {"walkers": condition} | ({} if "chunk" in written.model_fields_set else {"chunk": 1})


def _flat(table: JsonMapping, above: str = "") -> JsonDict:
    """[set] as dotted keys, whether they were written "a.b" = … or a.b = …"""
    found: JsonDict = {}
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
                problem, at = "is stated by the file's column", f"parameters.{name}.values"
                raise InputError(problem, file=file, field=at, allowed="values or file")
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
            differ, allowed = "the parameters' lists of values differ in length", "alike, row by row"
            problem = differ if lengths else "there is no list of values"
            raise InputError(problem, file=file, field="parameters", value=each or None, allowed=allowed)
    return found


def check_keys(file: pathlib.Path, parameters: tuple[Parameter, ...], sets: Mapping[str, object]) -> None:
    """Refuse what is set twice: the same key, or one below another parameter's."""
    taken: dict[tuple[str, ...], tuple[str, str]] = {}
    for parameter in parameters:
        for key in parameter.keys:
            path = _parts(key)
            for other, (name, written) in taken.items():
                if path[: len(other)] == other or other[: len(path)] == path:
                    how = "what lies within" if len(path) > len(other) else "all of what"
                    how = "what" if path == other else how
                    problem = f"sets {how} {name!r} sets already ({written})"
                    raise InputError(problem, file=file, field=f"parameters.{parameter.name}.key", value=key)
            taken[path] = (parameter.name, key)
    for key in sets:
        if _parts(key) in taken:
            problem = f"is set by the parameter {taken[_parts(key)][0]!r} too"
            raise InputError(problem, file=file, field=f"set.{key}", value=sets[key])


def _parts(key: str) -> tuple[str, ...]:
    path, items = split_key(key)
    return (*path, *(f"[{item}]" for item in items))


def _elsewhere(error: InputError, file: pathlib.Path, field: str) -> InputError:
    """The same error, as one of this file and field; what it said of another file stays in its words."""
    problem = f"{error.problem} (in {error.file}: {error.field})" if error.file else error.problem
    return error.replaced(problem=problem, file=file, field=field)


def plan_of(
    scenario: Given, parameters: JsonMapping, sets: Mapping[str, object] | None = None, *,
    design: str = "", cases: int | None = None, **options: Given,
) -> Plan:  # fmt: skip
    """A sweep without a file; `options` as its file has them, "" and None for what is not stated."""
    for name in ("metrics", "constraints"):
        options[name] = named(options.get(name, ()), name)
    table = {
        "scenario": plain_scenario(scenario),
        "design": design or ("grid" if cases is None else "sobol"),
        "cases": cases,
        "set": dict(sets or {}),
        "parameters": parameter_tables(parameters),
        **options,
    }
    return of_table(pathlib.Path("sweep"), {k: v for k, v in table.items() if v is not None and v != ""})


def plain_scenario(scenario: Given) -> str | JsonDict:
    """A scenario as a plan holds it: a name, a path, or plain data."""
    if isinstance(scenario, Scenario):
        return scenario.resolved()
    table = isinstance(scenario, Mapping) and not isinstance(scenario, Shown)  # a result is none
    return dict(scenario) if table else os.fspath(scenario)


def parameter_tables(parameters: JsonMapping) -> dict[str, JsonDict]:
    """{column: table as [parameters.NAME] has it}; keys, values and result as `plan_of` has them."""
    if not isinstance(parameters, Mapping):
        example = '{"supply.pressure": ["2 bar", "4 bar"]}'
        raise InputError("is not a dict", field="parameters", value=parameters, allowed="as in " + example)
    found: dict[str, Keywords] = {}
    names = column_names([key for key, values in parameters.items() if not _has_key(values)])
    for key, values in parameters.items():
        if isinstance(values, Span):
            values = values.table()
        elif isinstance(values, str):
            allowed = f"[{values!r}], or span(…)"
            raise InputError("is one text, not a list", field=key, value=values, allowed=allowed)
        elif not isinstance(values, Mapping):
            values = {"values": tuple(values.tolist() if hasattr(values, "tolist") else values)}
        found[names.get(key, key)] = dict(values) if _has_key(values) else {"key": key, **values}
    return found


def column_names(keys: Sequence[str]) -> dict[str, str]:
    """{dotted key: a name for its column}: as many last words of the key as make it unique."""
    words = {key: re.findall(r"\w+", key) for key in keys}

    def name(key: str, count: int) -> str:
        return "_".join(words[key][-count:])

    found = {}
    for key in keys:
        least = 1 + len(split_key(key)[1])
        for count in range(least, max(least, len(words[key])) + 1):
            taken = sum(name(key, count) == name(other, count) for other in keys) > 1
            if not taken and is_free(name(key, count)):
                break
        found[key] = name(key, count)
    return found


def _has_key(values: Given) -> bool:
    return isinstance(values, Mapping) and ("key" in values or "keys" in values)
