"""The smallest component, or the least pressure, that meets stated limits: `afo_sim.size`."""

import os
from collections.abc import Mapping, Sequence
from typing import get_args

from afo_sim.common import Given, InputError, JsonMapping, Mixed, unknown
from afo_sim.description import Pressure, Quantity, Scenario, TubeLength, load
from afo_sim.study.pool import Report
from afo_sim.study.sizing.limits import EXAMPLES, read_requirements, usual
from afo_sim.study.sizing.result import KINDS, Sizing
from afo_sim.study.sizing.trials import Request, at_cadence

SIDES = ("both", "inlet", "outlet")
_QUANTITIES: dict[str, Quantity] = {
    "at": get_args(Pressure)[1],
    "lowest": Quantity("Pa", at_least=0.0),
    "length": get_args(TubeLength)[1],
    "hours": Quantity("", above=0.0),
    "strides": Quantity("", above=0.0),
    "cadence": Quantity("", at_least=30.0, at_most=240.0),  # [steps/min]
}
_MOST = 8  # parallel muscles that are tried


def size(
    kind: str,
    scenario: str | os.PathLike[str] | Scenario | JsonMapping,
    sets: Mapping[str, object] | None = None,
    *,
    limits: str | Sequence[str] | None = None,
    threads: int = 0,
    progress: Report | None = None,
    **options: Given,
) -> Sizing:
    """Find the smallest catalogue component, or least pressure, that meets limits, by simulation.

    Parameters
    ----------
    kind : "pressure", "valve", "tube", "supply" or "muscle"
    scenario : a shipped name, a path, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it
    limits : one or several, as "toe_clearance >= 10 mm", "fill_time <= 300 ms"; of walking by default the toe
        clearance that the scenario's own limits want, settled and in the first stride
    threads : as many as processors if 0
    progress : called with (done, in all, what)
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
        A kind, chamber or metric does not exist; an option belongs to another kind; no limit is stated.

    Examples
    --------
    >>> limits = ["peak_pressure_dorsiflexor >= 1 bar"]
    >>> found = size("pressure", "seated", {"duration": "1 s"}, limits=limits, threads=1)
    >>> found.holds, found.best.meets
    (True, True)
    """
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 0:
        problem, allowed = "is out of range", "0 or more; as many as processors if 0"
        raise InputError(problem, field="threads", value=threads, allowed=allowed)
    return requested(kind, scenario, sets, limits=limits, **options).run(threads, progress)


def requested(
    kind: str, scenario: str | os.PathLike[str] | Scenario | JsonMapping,
    sets: Mapping[str, object] | None = None, *, limits: str | Sequence[str] | None = None, **options: Given,
) -> Request:  # fmt: skip
    """The request of `size`, checked before any run; arguments and errors as there."""
    if kind not in KINDS:
        raise unknown(kind, KINDS, field="kind")
    given = {name: value for name, value in options.items() if value is not None and value is not False}
    own = {name: other for other, each in KINDS.items() for name in each.options}
    for name, value in given.items():
        if name != "cadence" and name not in own:
            raise unknown(name, [*own, "cadence"], field="options", problem="is not a valid option")
        if own.get(name, kind) != kind:
            raise InputError(f"is an option of {own[name]}, not of {kind}", field=name, value=value)
    description = load("scenario", scenario, sets)
    orthosis = description.orthosis
    if not orthosis.chamber:
        problem = "has no chambers: there is nothing to size"
        raise InputError(problem, field="scenario", value=description.name)
    chamber = _chamber_of(description, given.pop("chamber", None), given.get("group"))
    read = {name: _read(name, value, description) for name, value in given.items()}
    if kind == "tube" and "length" not in read:
        problem = "is needed: nothing states how long the tubes are"
        raise InputError(problem, field="length", allowed='as "0.8 m"')
    if kind == "valve" and orthosis.chamber[chamber].three_way and read.get("side", "both") != "both":
        problem = f"is of two valves, and chamber {chamber!r} has one 3/2 valve"
        raise InputError(problem, field="side", value=read["side"], allowed="both")
    at_cadence(description, read.get("cadence"))
    texts = [limits] if isinstance(limits, str) else limits or ()
    requirements = read_requirements(texts, chamber, [*orthosis.chamber], [*orthosis.volume])
    requirements = requirements or usual(description)
    if not requirements and not read.keys() & {"hours", "strides"}:
        problem = "is needed: this scenario does not walk, and nothing states what the device shall reach"
        raise InputError(problem, field="limit", allowed=f"a metric and a bound, such as {EXAMPLES}")
    return Request(kind, description, requirements, chamber, read)


def _chamber_of(scenario: Scenario, name: str | None, group: str | None) -> str:
    """A chamber by its name, or that of a group of muscles; by default the first that is filled."""
    chambers = list(scenario.orthosis.chamber)
    if group is not None and group not in scenario.orthosis.muscle:
        raise unknown(group, scenario.orthosis.muscle, field="group", problem="is not a group of muscles")
    if name is None and group is not None:
        return scenario.orthosis.muscle[group].chamber or group
    if name is not None and name not in chambers:
        raise unknown(name, chambers, field="chamber", problem="is not a chamber of this orthosis")
    times = [each.chambers for each in (scenario.phases, scenario.timer) if each is not None]
    filled = [c for c in chambers if any(c in table and table[c].inlet for table in times)]
    return name or (filled or chambers)[0]


def _read(name: str, value: Given, scenario: Scenario) -> Mixed:
    """An option's value, checked, SI."""
    if name == "between":
        ends = value if isinstance(value, tuple | list) else [value]
        low, high = (_quantity(name, each, "lowest") for each in ends) if len(ends) == 2 else (0.0, 0.0)
        if not low < high:
            allowed = 'two rising pressures, as "1 bar" "4 bar"'
            raise InputError("is not a valid range", field=name, value=value, allowed=allowed)
        return low, _quantity(name, ends[1], "at")
    if name == "side" and value not in SIDES:
        raise unknown(value, SIDES, field=name)
    if name == "strides" and not scenario.walking:
        raise InputError("are of walking", field=name, value=value, allowed="hours")
    if name != "count":
        return _quantity(name, value, name) if name in _QUANTITIES else value
    # fewest and most muscles: of (1, 4), 3, "3" or "1-4"
    ends = list(value) if isinstance(value, tuple | list) else [value, value]
    if isinstance(value, str):
        fewest, _, most = value.partition("-")
        if not (fewest.isdecimal() and (most or fewest).isdecimal()):
            raise InputError("is not a whole number", field=name, value=value, allowed='as "3" or "1-4"')
        ends = [int(fewest), int(most or fewest)]
    whole = len(ends) == 2 and all(isinstance(n, int) and not isinstance(n, bool) for n in ends)
    if not (whole and 1 <= ends[0] <= ends[1] <= _MOST):
        raise InputError("is out of range", field=name, value=value, allowed=f"1 to {_MOST}, as 1-4")
    return ends[0], ends[1]


def _quantity(field: str, value: Given, which: str) -> float:
    """A number [SI] within its bounds."""
    try:
        return _QUANTITIES[which].read(value)
    except ValueError as error:
        allowed = _QUANTITIES[which].span + (" steps/min" if which == "cadence" else "")
        raise InputError(str(error), field=field, value=value, allowed=allowed) from None
