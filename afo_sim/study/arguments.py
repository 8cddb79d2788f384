"""Arguments of a sweep or a search in Python, as the tables that a file would hold."""

import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.description.reader import split_key
from afo_sim.description.scenario import Scenario
from afo_sim.study.parameter import Span
from afo_sim.study.parameter_table import is_free
from afo_sim.study.plan import Plan
from afo_sim.study.sweep_file import CHUNK, of_table


def plan_of(
    scenario: Any,
    parameters: Mapping[str, Any],
    *,
    design: str = "",
    cases: int | None = None,
    metrics: Sequence[str] = (),
    constraints: Sequence[str] = (),
    sets: Mapping[str, Any] | None = None,
    seed: int = 0,
    chunk: int = CHUNK,
    spreads: str = "",
) -> Plan:
    """A sweep without a file.

    Units: parameters [parameters.NAME].
    """
    for name, listed in (("metrics", metrics), ("constraints", constraints)):
        if isinstance(listed, str):
            raise InputError("is one text, not a list", field=name, value=listed, allowed=f"[{listed!r}]")
    table = {
        "scenario": plain_scenario(scenario),
        "design": design or ("grid" if cases is None else "sobol"),
        "metrics": tuple(metrics),
        "constraints": tuple(constraints),
        "set": dict(sets or {}),
        "seed": seed,
        "chunk": chunk,
        "parameters": parameter_tables(parameters),
    }
    table |= {} if cases is None else {"cases": cases}
    return of_table(pathlib.Path("sweep"), table | ({"spreads": spreads} if spreads else {}))


def plain_scenario(scenario: Any) -> str | dict[str, Any]:
    """A scenario as a plan holds it: a name, a path, or plain data."""
    if isinstance(scenario, Scenario):
        return scenario.resolved()
    return dict(scenario) if isinstance(scenario, Mapping) else os.fspath(scenario)


def parameter_tables(parameters: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """{column: table as [parameters.NAME] has it}; keys, values and result as `plan_of` has them."""
    if not isinstance(parameters, Mapping):
        example = '{"supply.pressure": ["2 bar", "4 bar"]}'
        raise InputError("is no dict", field="parameters", value=parameters, allowed="as in " + example)
    found: dict[str, dict[str, Any]] = {}
    names = column_names([key for key, values in parameters.items() if not _has_key(values)])
    for key, values in parameters.items():
        if isinstance(values, Span):
            values = values.table()
        elif isinstance(values, str):
            raise InputError(
                "is one text, not a list", field=key, value=values, allowed=f"[{values!r}], or span(…)"
            )
        elif not isinstance(values, Mapping):
            values = {"values": tuple(values.tolist() if hasattr(values, "tolist") else values)}
        found[names.get(key, key)] = dict(values) if _has_key(values) else {"key": key, **values}
    return found


def column_names(keys: Sequence[str]) -> dict[str, str]:
    """{dotted key: a name for its column}: the last words of the key, as many as tell it from the others."""
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


def _has_key(values: Any) -> bool:
    return isinstance(values, Mapping) and ("key" in values or "keys" in values)
