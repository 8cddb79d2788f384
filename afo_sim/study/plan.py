"""A sweep, checked: scenario, design, parameters, constraints, and the content that decides its results."""

import hashlib
import pathlib
from dataclasses import asdict, dataclass, replace
from typing import Any

from afo_sim.common import assets
from afo_sim.description.reader import load
from afo_sim.study.constraint import Constraint
from afo_sim.study.parameter import Choice, Joint, Parameter


@dataclass(frozen=True)
class Plan:
    """A sweep, checked.

    `file` is where it was read; `scenario` a shipped name, a path, or the scenario itself as plain data.
    `cases` is None for grid and list, and
    for saltelli the number of base samples. `metrics` and `keep` are empty where nothing is told: all
    metrics, no recordings. `set` are fixed overrides by dotted key; `parameters` stand in the file's order.
    `notes` tell what a reader of the sweep minds.
    """

    file: pathlib.Path
    description: str
    scenario: str | dict[str, Any]
    design: str
    cases: int | None
    seed: int
    metrics: tuple[str, ...]
    keep: tuple[int, ...]
    chunk: int
    set: dict[str, Any]
    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...]
    notes: tuple[str, ...] = ()

    @property
    def scenario_name(self) -> str:
        """The scenario in a word."""
        named = self.scenario if isinstance(self.scenario, str) else self.scenario.get("name")
        return str(named or "scenario")

    def walked(self) -> "Plan":
        """The same with settled strides that are walked to, not solved for; where nobody walks, the same."""
        if not load("scenario", self.scenario, self.set).walking:
            return self
        return replace(self, set=self.set | {"gait.settled": "walked"})

    def canonical(self) -> dict[str, Any]:
        """Everything that decides the results, as JSON-able data, to tell whether two sweeps are the same.

        The scenario and every description that a word names stand in it as they are resolved, files as
        the SHA-256 of their content; descriptions, sources, chunk and kept cases do not.
        """
        return {
            "scenario": _content(load("scenario", self.scenario, self.set)),
            "set": self.set,  # holds over what a case swaps whole, also where it changes nothing here
            "design": self.design,
            "cases": self.cases,
            "seed": self.seed,
            "metrics": list(self.metrics),
            "parameters": [self._canonical_parameter(parameter) for parameter in self.parameters],
            "constraints": [constraint.text for constraint in self.constraints],
        }

    def _canonical_parameter(self, parameter: Parameter) -> dict[str, Any]:
        spread = {
            key: repr(value) if isinstance(value, float) else value
            for key, value in asdict(parameter.spread).items()
        }
        written = {
            "name": parameter.name,
            "keys": list(parameter.keys),
            "unit": parameter.unit,
            "spread": type(parameter.spread).__name__,
        }
        if parameter.words:
            spread["content"] = [_digest_of_word(parameter, word) for word in spread["values"]]
        if isinstance(parameter.spread, Choice | Joint) and not parameter.words:
            spread["values"] = [repr(value) for value in spread["values"]]
        return written | {key: list(v) if isinstance(v, tuple) else v for key, v in spread.items()}


def _content(description: Any) -> dict[str, Any]:
    """A description as what it holds, without names, words and places."""
    return _stripped(description.model_dump(mode="json"))


def _stripped(node: Any) -> Any:
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


def _digest_of_word(parameter: Parameter, word: str) -> Any:
    """The content that a word names, of a description or a file; None where it is the word alone."""
    description = parameter.description
    path = parameter.files.get(word, word)
    if description:
        return _content(load(description, path))
    return _digest(path) if word in parameter.files or word in assets.gait_names() else None
