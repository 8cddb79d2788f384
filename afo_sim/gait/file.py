"""Gait cycles as CSV files."""

import pathlib

from afo_sim.common import InputError, Keywords, read_header, read_phase_table, refuse, write_phase_table
from afo_sim.gait.checks import examine
from afo_sim.gait.cycle import COLUMNS, NUMBERS, OPTIONAL, GaitCycle

_TEXTS = {"source": "source", "licence": "licence", "side": "side"}
_WALKER = "walker"  # key of whose walk it is, which may be left out


def read(path: str | pathlib.Path) -> GaitCycle:
    """Read a gait cycle from its CSV file, and examine it."""
    file = pathlib.Path(path)
    if read_header(file).get("kind") == "norm":
        raise InputError("is a norm to compare with", file=file, allowed="one stride of a person")
    table = read_phase_table(file, tuple(COLUMNS))
    facts: Keywords = {}
    problems = []
    there = {key: name for key, name in OPTIONAL.items() if key in table.header}
    for key, name in {**_TEXTS, **NUMBERS, **there}.items():
        try:
            facts[name] = table.text(key) if key in _TEXTS else table.number(key)
        except InputError as error:
            problems.append(error)
    refuse(problems)
    facts |= {name: table.columns[column] * factor for column, (name, factor) in COLUMNS.items()}
    facts[_WALKER] = table.header.get(_WALKER)
    known = {**_TEXTS, **NUMBERS, **OPTIONAL, _WALKER: _WALKER}
    notes = {key: text for key, text in table.header.items() if key not in known}
    cycle = GaitCycle(**facts, notes=notes)
    examine(cycle, table.file)
    return cycle


def write(path: str | pathlib.Path, cycle: GaitCycle) -> None:
    """Write a gait cycle as CSV, whole or not at all."""
    header = {key: str(getattr(cycle, name)) for key, name in _TEXTS.items()}
    header |= {key: f"{getattr(cycle, name):.6g}" for key, name in NUMBERS.items()}
    known = {key: getattr(cycle, name) for key, name in OPTIONAL.items()}
    header |= {key: f"{value:.6g}" for key, value in known.items() if value is not None}
    header |= {_WALKER: cycle.walker} if cycle.walker else {}
    columns = {column: getattr(cycle, name) / factor for column, (name, factor) in COLUMNS.items()}
    write_phase_table(pathlib.Path(path), {**header, **cycle.notes}, columns)
