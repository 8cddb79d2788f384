"""The smallest component that meets stated limits: `afo_sim.size`."""

import dataclasses
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from afo_sim.common import InputError, parse_quantity, unknown
from afo_sim.description import Pressure, Quantity, Scenario, TubeLength, load
from afo_sim.study.pool import pool
from afo_sim.study.sizing.air_parts import SIDES, size_supply, size_tube, size_valve
from afo_sim.study.sizing.muscles import size_muscle
from afo_sim.study.sizing.pressures import size_pressure
from afo_sim.study.sizing.requirement import EXAMPLES, Requirement, read_requirements, usual
from afo_sim.study.sizing.result import Sizing
from afo_sim.study.sizing.trial import Report, Trials

_SIZED_BY: dict[str, Callable[..., Sizing]] = {
    "pressure": size_pressure,
    "valve": size_valve,
    "tube": size_tube,
    "supply": size_supply,
    "muscle": size_muscle,
}
_PLURALS = {each: f"{each}s" for each in _SIZED_BY} | {"supply": "sources"}
# {option: the kind that has it}
_OWN = {
    "at": "pressure",
    "between": "pressure",
    "chamber": "valve",
    "side": "valve",
    "proportional": "valve",
    "length": "tube",
    "hours": "supply",
    "strides": "supply",
    "group": "muscle",
    "count": "muscle",
}
_CADENCES = (30.0, 240.0)  # [steps/min]
_MOST = 8  # parallel muscles that are tried


def size(
    kind: str,
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    limits: str | Sequence[str] | None = None,
    threads: int | None = None,
    report: Report | None = None,
    **options: Any,
) -> Sizing:
    """The smallest component of the catalogue, or the least pressure, that meets limits; from runs.

    Parameters
    ----------
    kind : "pressure", "valve", "tube", "supply" or "muscle"
    scenario : a shipped name, a path, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it
    limits : one or several, as "toe_clearance >= 10 mm", "fill_time <= 300 ms"; of walking by default the toe
        clearance that the scenario's own limits want, settled and in the first stride
    threads : as many as processors by default
    report : called with (done, in all, what)
    options : `cadence` [steps/min] of walking; of "pressure" `at="3 bar"`, whether this one suffices, and
        `between=("1 bar", "4 bar")`; of "valve" `chamber`, `side` ("inlet", "outlet" or "both") and
        `proportional=True`; of "tube" `length="2 m"`; of "supply" `hours` or `strides` without a pause; of
        "muscle" `group` and `count=(1, 4)`, or 3, or "1-4"

    Returns
    -------
    Sizing: `best`, `answer`, `table`, `tried`, `holds`, `to_pandas()`, `save(folder)`

    Raises
    ------
    InputError
        There is no such kind, chamber or metric; an option is another kind's; nothing states what is wanted.

    Examples
    --------
    >>> limits = ["peak_pressure_dorsiflexor >= 1 bar"]
    >>> found = size("pressure", "seated", {"duration": "1 s"}, limits=limits, threads=1)
    >>> found.holds, found.best.meets
    (True, True)
    """
    if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
        problem, allowed = "is out of range", "1 or more; as many as processors by default"
        raise InputError(problem, field="threads", value=threads, allowed=allowed)
    return requested(kind, scenario, sets, limits=limits, **options).run(threads or 0, report)


@dataclass(frozen=True)
class Request:
    """What is to be sized, checked."""

    kind: str
    scenario: Scenario
    requirements: tuple[Requirement, ...]
    chamber: str
    options: Mapping[str, Any]

    def to_json(self) -> dict[str, Any]:
        """As plain data, by which a folder's content is known again."""
        found = {
            "kind": self.kind,
            "limits": [str(each) for each in self.requirements],
            "chamber": self.chamber,
            "options": dict(self.options),
            "scenario": self.scenario.resolved(),
        }
        plain: dict[str, Any] = json.loads(json.dumps(found))
        return plain

    def run(self, threads: int = 0, report: Report | None = None) -> Sizing:
        """Run what it takes."""
        scenario = _at_cadence(self.scenario, self.options.get("cadence"))
        own = {name: value for name, value in self.options.items() if name != "cadence"}
        own |= {"chamber": self.chamber} if self.kind == "valve" else {}
        with pool(threads) as who:
            trials = Trials(scenario, self.requirements, who, report, f"trying {_PLURALS[self.kind]}")
            found = _SIZED_BY[self.kind](trials, **own)
        return dataclasses.replace(found, request=self.to_json())


def requested(
    kind: str,
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    limits: str | Sequence[str] | None = None,
    **options: Any,
) -> Request:
    """What `size` is asked for, checked before anything is run; arguments and errors as its own."""
    if kind not in _SIZED_BY:
        raise unknown(kind, _SIZED_BY, field="kind")
    given = {name: value for name, value in options.items() if value is not None and value is not False}
    for name, value in given.items():
        if name != "cadence" and name not in _OWN:
            raise unknown(name, [*_OWN, "cadence"], field="options", problem="is not a valid option")
        if name in _OWN and _OWN[name] != kind:
            raise InputError(f"is an option of {_OWN[name]}, not of {kind}", field=name, value=value)
    description = scenario if isinstance(scenario, Scenario) else load("scenario", scenario)
    description = description.set(sets) if sets else description
    if not description.orthosis.chamber:
        raise InputError(
            "has no chambers: there is nothing to size", field="scenario", value=description.name
        )
    chamber = _chamber_of(description, given.pop("chamber", None), given.get("group"))
    read = {name: _read(name, value, description) for name, value in given.items()}
    if kind == "tube" and "length" not in read:
        raise InputError(
            "is needed: nothing states how long the tubes are", field="length", allowed='as "0.8 m"'
        )
    _at_cadence(description, read.get("cadence"))
    orthosis, texts = description.orthosis, [limits] if isinstance(limits, str) else limits or ()
    requirements = read_requirements(texts, chamber, [*orthosis.chamber], [*orthosis.volume])
    requirements = requirements or usual(description)
    if not requirements and not read.keys() & {"hours", "strides"}:
        problem = "is needed: nobody walks here, and nothing states what the device is to reach"
        raise InputError(problem, field="limit", allowed=f"a metric and a bound, such as {EXAMPLES}")
    return Request(kind, description, requirements, chamber, read)


def _at_cadence(scenario: Scenario, cadence: float | None) -> Scenario:
    """A scenario at another cadence [steps/min]; the gait's curves go with the stride."""
    if cadence is None:
        return scenario
    if scenario.gait is None:
        raise InputError("is of walking", field="cadence", value=cadence, allowed="none for a fixed shank")
    if scenario.gait.speed is not None:
        problem = "stands beside the scenario's gait.speed, which states the cadence"
        raise InputError(problem, field="cadence", value=cadence, allowed="gait.speed alone, with --set")
    return scenario.set({"gait.stride_time": f"{120.0 / cadence:.9g} s"})  # two steps a stride


def _chamber_of(scenario: Scenario, name: str | None, group: str | None = None) -> str:
    """A chamber by its name, or that of a group of muscles; by default the first that is filled."""
    chambers = list(scenario.orthosis.chamber)
    if group is not None and group not in scenario.orthosis.muscle:
        raise unknown(group, scenario.orthosis.muscle, field="group", problem="is not a group of muscles")
    if name is None and group is not None:
        return scenario.orthosis.muscle[group].chamber or group
    if name is not None:
        if name not in chambers:
            raise unknown(name, chambers, field="chamber", problem="is not a chamber of this orthosis")
        return name
    times = [each.chambers for each in (scenario.phases, scenario.timer) if each is not None]
    filled = [c for c in chambers if any(c in table and table[c].inlet for table in times)]
    return (filled or chambers)[0]


def _read(name: str, value: Any, scenario: Scenario) -> Any:
    """An option's value, checked, SI."""
    if name == "at":
        return _within(name, _quantity(name, value, "Pa"), value, Pressure)
    if name == "between":
        ends = list(value) if isinstance(value, tuple | list) else [value]
        problem, allowed = "is not a valid range", 'two rising pressures, as "1 bar" "4 bar"'
        if len(ends) != 2:
            raise InputError(problem, field=name, value=value, allowed=allowed)
        low, high = (_quantity(name, each, "Pa") for each in ends)
        if not 0.0 <= low < high:
            raise InputError(problem, field=name, value=value, allowed=allowed)
        return low, _within(name, high, ends[1], Pressure)
    if name == "length":
        return _within(name, _quantity(name, value, "m"), value, TubeLength)
    if name == "side":
        if value not in SIDES:
            raise unknown(value, SIDES, field=name)
        return value
    if name in ("hours", "strides", "cadence"):
        number = _positive(name, _quantity(name, value, ""), value)
        if name == "cadence" and not _CADENCES[0] <= number <= _CADENCES[1]:
            allowed = "{:g} to {:g} steps/min".format(*_CADENCES)
            raise InputError("is out of range", field=name, value=value, allowed=allowed)
        if name == "strides" and not scenario.walking:
            raise InputError("are of walking", field=name, value=value, allowed="hours")
        return number
    if name == "count":
        return _read_count(value)
    return value


def _quantity(field: str, value: float | str | None, unit: str) -> float:
    try:
        return parse_quantity(value, unit)  # type: ignore[arg-type]
    except ValueError as error:
        raise InputError(str(error), field=field, value=value) from None


def _read_count(value: Any) -> tuple[int, int]:
    """Fewest and most muscles: of (1, 4), 3, "3" or "1-4"."""
    ends = list(value) if isinstance(value, tuple | list) else [value, value]
    if isinstance(value, str):
        low, _, high = value.partition("-")
        try:
            ends = [int(low), int(high or low)]
        except ValueError:
            raise InputError(
                "is not a whole number", field="count", value=value, allowed='as "3" or "1-4"'
            ) from None
    whole = len(ends) == 2 and all(isinstance(n, int) and not isinstance(n, bool) for n in ends)
    if not (whole and 1 <= ends[0] <= ends[1] <= _MOST):
        raise InputError("is out of range", field="count", value=value, allowed=f"1 to {_MOST}, as 1-4")
    return ends[0], ends[1]


def _within(field: str, number: float, value: Any, kind: Any) -> float:
    """A number [SI] within the bounds of a described quantity, or an error with the value as it was given."""
    bounds: Quantity = get_args(kind)[1]
    assert bounds.above is not None and bounds.at_most is not None
    if not bounds.above < number <= bounds.at_most:
        raise InputError("is out of range", field=field, value=value, allowed=bounds.span)
    return number


def _positive(field: str, number: float, value: Any) -> float:
    if not 0.0 < number < float("inf"):
        raise InputError("is out of range", field=field, value=value, allowed="more than 0")
    return number
