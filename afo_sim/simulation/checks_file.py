"""A TOML file of checks, read and held against a run."""

import dataclasses
import os
import pathlib
from dataclasses import dataclass
from typing import Any, Self

from afo_sim.common.assets import read_toml
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.simulation.checks import expect, metric_result
from afo_sim.simulation.criterion import CHECKS, Result
from afo_sim.simulation.recording import Recording

METRIC_KEYS = ("metric", "between", "above", "below", "why")
SUBJECTS = ("column", "metric", "sum")
ENTRY_KEYS: dict[str, type] = {"column": str, "metric": str, "sum": list, **dict.fromkeys(CHECKS, object)}
ENTRY_KEYS |= {"after": object, "before": object, "per_cycle": bool, "rate": bool, "why": str}


@dataclass(frozen=True)
class CheckEntry:
    """One [[check]] of a checks file; `number` counts from 1."""

    file: pathlib.Path
    number: int
    table: dict[str, Any]

    def check(self, run: Recording) -> Result:
        """Look at a run; what is wrong with the entry is an `InputError` that names file and field."""
        table = self.table
        (kind,) = (key for key in table if key in CHECKS)
        try:
            if "metric" in table:
                return metric_result(run, table["metric"], kind, table[kind], table.get("why", ""))
            expected = expect(run, table["column"] if "column" in table else table["sum"])
            expected = expected.rate() if table.get("rate") else expected
            expected = expected.expecting(kind, table[kind])
            expected = expected.after(table["after"]) if "after" in table else expected
            expected = expected.before(table["before"]) if "before" in table else expected
            expected = expected.per_cycle() if table.get("per_cycle") else expected
            return dataclasses.replace(expected, why=table.get("why", "")).check()
        except InputError as error:
            facts = (error.problem, error.field, error.value, error.allowed, error.nearest)
            raise self.refusal(*facts) from None

    def refusal(
        self, problem: str, key: str, value: object, allowed: str = "", nearest: str | None = None
    ) -> InputError:
        """Refusal of this entry, at a key or ("") as a whole."""
        field = f"check[{self.number}]" + (f".{key}" if key else "")
        return InputError(problem, file=self.file, field=field, value=value, allowed=allowed, nearest=nearest)

    def examined(self) -> Self:
        """Itself, if it looks at one thing, in one way, and no key is unknown or of a wrong type."""
        for key, value in self.table.items():
            if key not in ENTRY_KEYS:
                nearest = nearest_name(key, ENTRY_KEYS)
                raise self.refusal("is an unknown key", key, value, ", ".join(ENTRY_KEYS), nearest)
            if "metric" in self.table and key not in METRIC_KEYS:
                raise self.refusal("does not go with a metric", key, value, ", ".join(METRIC_KEYS))
            wanted = ENTRY_KEYS[key]
            right = isinstance(value, wanted)
            if not right or (wanted is list and not all(isinstance(item, str) for item in value)):
                words = {str: "a text", bool: "true or false", list: "a list of texts"}
                raise self.refusal("has another type", key, value, words[wanted])
        for what, keys in (("column, metric or sum", SUBJECTS), ("check", CHECKS)):
            found = [key for key in keys if key in self.table]
            if len(found) != 1:
                problem = f"has {'more than one' if found else 'no'} {what}"
                raise self.refusal(problem, "", ", ".join(found) or None, "one of " + ", ".join(keys))
        return self


def read_checks(path: str | os.PathLike[str]) -> list[CheckEntry]:
    """The entries of a checks file.

    Raises
    ------
    InputError
        The file is no TOML, has no check, or an entry has a wrong key, none or two checks.
    """
    file = pathlib.Path(path)
    table = read_toml(file)
    for key in table:
        if key != "check":
            raise InputError("is an unknown key", file=file, field=key, allowed="[[check]]")
    tables = table.get("check")
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputError("has no checks", file=file, field="check", allowed="[[check]] tables")
    return [CheckEntry(file, number, t).examined() for number, t in enumerate(tables, start=1)]


def run_checks(run: Recording, path: str | os.PathLike[str]) -> list[Result]:
    """The result of each entry of a checks file, in its order.

    Raises
    ------
    InputError
        As `read_checks`; or an entry names a column or metric that the run has not, or a wrong unit.
    """
    return [entry.check(run) for entry in read_checks(path)]
