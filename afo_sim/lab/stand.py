"""The test stand as one call: quantities as text or in SI, one muscle or several, one test or all three."""

import functools
import itertools
import os
import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import GRAVITY, InputError, Shown, parse_quantity, unknown
from afo_sim.description import Muscle, load
from afo_sim.lab import stand_trial
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.lab.stand_plan import KINDS, Laboratory
from afo_sim.lab.stand_table import Comparison, compare_trial, points_of, table_of
from afo_sim.lab.stand_trial import AXES, Trial

Amount = str | float  # "3 bar", or a number in SI
Amounts = Amount | Sequence[Amount] | None
AnyMuscle = str | os.PathLike[str] | Mapping[str, Any] | Muscle

CHARACTERISTICS = tuple(AXES)  # the tests of "all"
AMOUNTS = ("pressure", "load", "contraction", "length")  # arguments
# Arguments that a test takes, beside those that all take.
TAKES = {
    "isobaric": ("pressure", "contraction", "length"),
    "isotonic": ("load", "pressure"),
    "isometric": ("contraction", "length", "pressure"),
    "step": ("pressure", "load", "contraction", "length", "valve"),
    "release": ("pressure", "load", "contraction", "length", "valve"),
}
UNITS = {"pressure": "Pa", "load": "N", "contraction": "", "length": "m", "supply": "Pa", "time": "s"}
POINTS = {"isobaric": "pressure", "isotonic": "load", "isometric": "contraction"}  # that tell curves apart


@dataclass(frozen=True, repr=False)
class Stand(Shown):
    """Finished tests, and their distance from measured points where some were given.

    trials : in the order of tests, muscles, laws, frictions
    compared : one for each trial, or none
    """

    trials: tuple[Trial, ...]
    compared: tuple[Comparison, ...] = ()

    def __repr__(self) -> str:
        muscles = dict.fromkeys(trial.plan.muscle.name for trial in self.trials)
        many = "s" if len(self.trials) > 1 else ""
        return f"<Stand: {', '.join(self.kinds)} of {', '.join(muscles)}; {len(self.trials)} trial{many}>"

    @property
    def kinds(self) -> tuple[str, ...]:
        """The tests that were run, each once."""
        return tuple(dict.fromkeys(trial.plan.kind for trial in self.trials))

    def of(self, kind: str) -> "Stand":
        """The trials of one test."""
        rows = [k for k, trial in enumerate(self.trials) if trial.plan.kind == kind]
        compared = tuple(self.compared[k] for k in rows) if self.compared else ()
        return Stand(tuple(self.trials[k] for k in rows), compared)

    def table(self) -> dict[str, np.ndarray]:
        """All rows of all curves, SI: {column: values (n,)}, ready for `pandas.DataFrame`."""
        return table_of(self.trials)


def stand(
    test: str,
    muscle: AnyMuscle | Sequence[AnyMuscle],
    *,
    law: str | Sequence[str] | None = None,
    friction: str | Sequence[str] | None = None,
    pressure: Amounts = None,
    load: Amounts = None,
    contraction: Amounts = None,
    length: Amounts = None,
    valve: str | None = None,
    supply: Amount | None = None,
    time: Amount | None = None,
    static: bool = False,
    compare: str | os.PathLike[str] | Measured | None = None,
    sets: Mapping[str, Any] | None = None,
    report: Callable[[int, int, str], None] | None = None,
) -> Stand:
    """Test muscles on the stand.

    Parameters
    ----------
    test : isobaric, isotonic, isometric, step, release, or "all" (the first three)
    muscle : one or several: a shipped name, a path to a TOML file, a dict of the same shape, a Muscle
    law, friction : every muscle is tested with each
    pressure : gauge, "3 bar" or [Pa]; several: the curves, or from and to
    load : "200 N", "20 kg" or [N]; the curves of isotonic, the weight of step and release
    contraction : "10 %" or [-]; the curves of isometric, from and to of isobaric, held in step and release
    length : of the braid, instead of the contraction, "15 cm" or [m]
    valve : name of a shipped solenoid valve, for step ("mh1" by default) and release
    supply : gauge pressure that no test goes beyond; the muscle's limit by default
    time : of one way up or down
    static : the formula instead of the rig
    compare : measured points (a CSV file, or read) that the trials are held against
    sets : dotted keys and values laid over the muscle
    report : called with (steps done, steps in all, what)

    Returns
    -------
    Stand

    Raises
    ------
    InputError
        A name, quantity or range is wrong; `field` is the argument.
    SimulationError
        A test became unstable.

    Examples
    --------
    >>> tests = stand("isobaric", "dmsp_20", pressure=["2 bar", "4 bar"], static=True)
    >>> len(tests.trials[0].curves), tests.table()["force"].max() > 900.0
    (2, np.True_)
    """
    amounts = dict(zip(AMOUNTS, map(_several, (pressure, load, contraction, length)), strict=True))
    kinds = _kinds(test, [name for name, values in {**amounts, "valve": valve}.items() if values])
    data = read_measured(pathlib.Path(compare)) if isinstance(compare, str | os.PathLike) else compare
    conditions = _Conditions(test, amounts, _laboratory(supply, valve), _amount("time", time), data)
    trials = tuple(_trials(conditions, kinds, _muscles(muscle, law, friction, sets), static, report))
    return Stand(trials, () if data is None else tuple(compare_trial(trial, data) for trial in trials))


@dataclass(frozen=True)
class _Conditions:
    """The conditions of all trials of one call."""

    test: str
    amounts: Mapping[str, tuple[Amount, ...]]
    laboratory: Laboratory
    duration: float | None  # [s]
    data: Measured | None


def _trials(
    conditions: _Conditions,
    kinds: Sequence[str],
    muscles: Sequence[Muscle],
    static: bool,
    report: Callable[[int, int, str], None] | None,
) -> Iterator[Trial]:
    for kind in kinds:
        for number, muscle in enumerate(muscles, 1):
            what = f"{kind} {number} of {len(muscles)}: {muscle.name}, {muscle.law}"
            progress = None if report is None else functools.partial(_forward, report, what)
            if progress is not None:
                progress(0, 0)
            yield _trial(conditions, kind, muscle, static, progress)


def _forward(report: Callable[[int, int, str], None], what: str, done: int, total: int) -> None:
    report(done, total, what)


def _several(value: Any) -> tuple[Any, ...]:
    """One or several as a tuple."""
    if value is None:
        return ()
    single = isinstance(value, str | os.PathLike | Mapping | Muscle) or not isinstance(
        value, Sequence | np.ndarray
    )
    return (value,) if single else tuple(value)


def _kinds(test: str, given: Sequence[str]) -> tuple[str, ...]:
    """The tests to run; refuse arguments that none of them takes."""
    allowed = (*KINDS, "all")
    if test not in allowed:
        raise unknown(test, allowed, field="test", problem="is not a valid test")
    kinds = CHARACTERISTICS if test == "all" else (test,)
    for name in given:
        if not any(name in TAKES[kind] for kind in kinds):
            takers = ", ".join(kind for kind, names in TAKES.items() if name in names)
            raise InputError(f"is nothing that {test} takes", field=name, allowed=takers)
    return kinds


def _muscles(muscle: Any, law: Any, friction: Any, sets: Mapping[str, Any] | None) -> list[Muscle]:
    """Every muscle with every law and friction."""
    found = []
    for one in _several(muscle):
        description = one.model_dump(mode="json") if isinstance(one, Muscle) else one
        for name, rubbing in itertools.product(_several(law) or (None,), _several(friction) or (None,)):
            chosen = {"law": name, "friction": rubbing}
            laid = {key: value for key, value in chosen.items() if value is not None} | dict(sets or {})
            found.append(one if isinstance(one, Muscle) and not laid else load("muscle", description, laid))
    return found


def _laboratory(supply: Amount | None, valve: str | None) -> Laboratory:
    return Laboratory(_amount("supply", supply), None if valve is None else load("valve", valve))


def _trial(
    conditions: _Conditions,
    kind: str,
    muscle: Muscle,
    static: bool,
    progress: Callable[[int, int], None] | None,
) -> Trial:
    try:
        plan = stand_trial.PLANS[kind](
            muscle, laboratory=conditions.laboratory, **_arguments(conditions, kind, muscle)
        )
        return stand_trial.static(plan) if static else stand_trial.run(plan, progress)
    except InputError as error:
        if error.field not in UNITS:
            raise
        field, value = error.field, error.value
        if field == "contraction" and conditions.amounts["length"]:
            field, value = "length", ", ".join(map(str, conditions.amounts["length"]))
        problem = f"{error.problem} ({muscle.name}, {kind})"
        raise error.replaced(problem=problem, file=None, field=field, value=value) from None


def _arguments(conditions: _Conditions, kind: str, muscle: Muscle) -> dict[str, Any]:
    """The arguments of a kind's plan, from amounts and from measured points."""
    pressures, loads, contractions = (
        [_number(name, value) for value in conditions.amounts[name]]
        for name in ("pressure", "load", "contraction")
    )
    lengths = [_number("length", value) for value in conditions.amounts["length"]]
    contractions += [1.0 - length / muscle.nominal_length for length in lengths]
    found: dict[str, Any] = {} if conditions.duration is None else {"duration": conditions.duration}
    if kind in ("step", "release"):
        found |= {"pressures": pressures or None, "load": _one("load", loads)}
        held = _one("contraction", contractions)
        return found if held is None else found | {"contraction": held}
    measured = points_of(kind, conditions.data, muscle) if conditions.data is not None else {}
    name = POINTS[kind]
    points = {"pressure": pressures, "load": loads, "contraction": contractions}[name]
    found[f"{name}s"] = points or measured.get("points")
    if kind == "isobaric":
        found["span"] = _span(contractions, 0.0) if conditions.test != "all" else None
        if found["span"] is None and "span" in measured:
            found["span"] = (measured["span"][0], None)
    else:
        found["span"] = _span(pressures, None if kind == "isotonic" else 0.0)
    return found


def _span(values: list[float], start: float | None) -> tuple[float | None, float] | None:
    """From and to; one value is the end, of several the least and the greatest."""
    if not values:
        return None
    return (start, values[0]) if len(values) == 1 else (min(values), max(values))


def _one(argument: str, values: list[float]) -> float | None:
    if len(values) > 1:
        raise InputError("is given several times", field=argument, allowed="one for this test")
    return values[0] if values else None


def _amount(argument: str, value: Amount | None) -> float | None:
    return None if value is None else _number(argument, value)


def _number(argument: str, value: Amount) -> float:
    """An amount in SI; a load may be kilograms, a contraction per cent."""
    if not isinstance(value, str):
        return float(value)
    if argument == "contraction" and value.strip().endswith("%"):
        return 0.01 * _parse(argument, value.strip().removesuffix("%"), "")
    if argument == "load":
        try:
            return parse_quantity(value, "kg") * GRAVITY
        except ValueError:
            pass  # newtons, or nothing that hangs on a muscle
    return _parse(argument, value, UNITS[argument])


def _parse(argument: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=argument, value=text) from None
