"""The test stand as one call: quantities as text or in SI, one muscle or several, one test or all three."""

import contextlib
import itertools
import os
import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import (
    GRAVITY,
    Given,
    InputError,
    Keywords,
    Shown,
    parse_quantity,
    quantity_at,
    si,
    unknown,
)
from afo_sim.description import Muscle
from afo_sim.description import load as load_description
from afo_sim.lab import stand_trial
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.lab.stand_plan import KINDS, Kind, Laboratory, plan
from afo_sim.lab.stand_table import SET, Comparison, compare_trial, points_of, table_of
from afo_sim.lab.stand_trial import Trial

Amount = str | float  # "3 bar", or a number in SI
Amounts = Amount | Sequence[Amount] | None
AnyMuscle = str | os.PathLike[str] | Mapping[str, object] | Muscle

CHARACTERISTICS: tuple[Kind, ...] = ("isobaric", "isotonic", "isometric")  # the tests of "all", of S3
AMOUNTS = ("pressure", "load", "contraction", "length", "stiffness")  # arguments
# Arguments that a test takes, beside those that all take.
TAKES = {
    "isobaric": ("pressure", "contraction", "length"),
    "isotonic": ("load", "pressure"),
    "isometric": ("contraction", "length", "pressure"),
    "auxotonic": ("stiffness", "load", "pressure"),
    "sealed": ("pressure", "contraction", "length"),
    "step": ("pressure", "load", "contraction", "length", "valve"),
    "release": ("pressure", "load", "contraction", "length", "valve"),
}
UNITS = dict(zip((*AMOUNTS, "supply", "time"), ("Pa", "N", "", "m", "N/m", "Pa", "s"), strict=True))


@dataclass(frozen=True, repr=False)
class Stand(Shown):
    """Finished tests, and their distance from measured points, if given.

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
    stiffness: Amounts = None,
    series: int | None = None,
    valve: str | None = None,
    supply: Amount | None = None,
    time: Amount | None = None,
    static: bool = False,
    compare: str | os.PathLike[str] | Measured | None = None,
    sets: Mapping[str, object] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Stand:
    """Test muscles on the stand.

    Parameters
    ----------
    test : isobaric, isotonic, isometric, auxotonic, sealed, step, release, or "all" (the first three)
    muscle : one or several: a shipped name, a path to a TOML file, a dict of the same shape, a Muscle
    law, friction : every muscle is tested with each
    pressure : gauge, "3 bar" or [Pa]; several: the curves, or from and to
    load : "200 N", "20 kg" or [N]; the curves of isotonic, the weight of the others
    contraction : "10 %" or [-]; the curves of isometric, from and to of isobaric and sealed, else held
    length : of the braid, instead of the contraction, "15 cm" or [m]
    stiffness : of the springs of auxotonic, "5 N/mm" or [N/m]
    series : number of equal muscles end to end; one by default
    valve : name of a shipped solenoid valve, for step ("mh1" by default) and release
    supply : gauge pressure that no test exceeds; the muscle's limit by default
    time : of one stroke up or down
    static : use the static formula instead of the simulated rig
    compare : measured points (a CSV file, or read) to compare the trials with
    sets : dotted keys and values laid over the muscle
    progress : called with (steps done, steps in all, what)

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
    amounts = dict(zip(AMOUNTS, map(_several, (pressure, load, contraction, length, stiffness)), strict=True))
    kinds = _kinds(test, [name for name, values in {**amounts, "valve": valve}.items() if values])
    if compare is not None and not {*kinds} <= {*CHARACTERISTICS}:
        problem = "cannot be compared with a static characteristic"
        raise InputError(problem, field="compare", value=test, allowed=", ".join(CHARACTERISTICS))
    data = read_measured(pathlib.Path(compare)) if isinstance(compare, str | os.PathLike) else compare
    pair = {"supply": supply, "time": time}.items()
    top, duration = (None if x is None else _number(name, x) for name, x in pair)
    given: Keywords = {} if duration is None else {"duration": duration}
    given["laboratory"] = Laboratory(top, None if valve is None else load_description("valve", valve))
    if series is not None and not 1 <= series <= 20:
        raise InputError("is out of range", field="series", value=series, allowed="1 to 20")
    muscles = [in_series(each, series or 1) for each in _muscles(muscle, law, friction, sets)]
    trials = []
    for kind, (number, one) in itertools.product(kinds, enumerate(muscles, 1)):
        what = f"{kind} {number} of {len(muscles)}: {one.name}, {one.law}"
        step = None if progress is None else lambda done, total, what=what: progress(done, total, what)
        if progress is not None:
            progress(0, 0, what)
        with _told(kind, one, amounts["length"]):
            ends = test != "all"  # or they are of the other tests
            planned = plan(kind, one, **given, **_arguments(amounts, ends, data, kind, one))
            trials.append(stand_trial.static(planned) if static else stand_trial.run(planned, step))
    compared = () if data is None else tuple(compare_trial(trial, data) for trial in trials)
    return Stand(tuple(trials), compared)


def in_series(muscle: Muscle, count: int) -> Muscle:
    """Several equal muscles end to end on one chamber: force at κ and κ̇, multiplied length and volume."""
    if count == 1:
        return muscle
    grown, damper = ("total_length", "end_length", "dead_volume", "mass"), muscle.damper
    values: Keywords = {key: count * getattr(muscle, key) for key in grown}
    if damper is not None:
        lines = {key: getattr(damper, key) for key in ("contracting", "relaxing", "relaxing_above")}
        less = {key: (b[0] / count, b[1] / count) for key, b in lines.items() if b is not None}
        values["damper"] = damper.with_values(**less)
    sources = dict(muscle.provenance)
    for key, note in ((key, note) for key, note in sources.items() if key in grown):
        kind = "derived" if note.kind == "published" else note.kind
        sources[key] = note.model_copy(update={"kind": kind, "source": f"{count} × {note.source}"})
    return muscle.with_values(pieces=count * muscle.pieces, provenance=sources, **values)


def sensitivity(muscle: Muscle, pressure: float, contraction: float = 0.0) -> dict[str, np.ndarray]:
    """What 90, 100, 110 % of braid angle, braid length and bore do at rest, at a gauge pressure [Pa]."""
    found: dict[str, np.ndarray] = {}
    for key, rest in (("braid_angle", 0.0), ("total_length", muscle.end_length), ("bore", 0.0)):
        own = getattr(muscle, key) - rest
        varied = [muscle.model_copy(update={key: rest + share * own}) for share in (0.9, 1.0, 1.1)]
        pull = np.array([m.force(pressure, contraction=[contraction, contraction + 1e-6]) for m in varied])
        free = np.array([m.contraction(pressure, force=0.0) for m in varied])
        by = f"by {key.replace('total', 'braid').replace('_', ' ')}"
        found |= {f"force [N] {by}": pull[:, 0], f"free contraction [-] {by}": free}
        found[f"stiffness [N/m] {by}"] = -np.diff(pull)[:, 0] / [1e-6 * m.nominal_length for m in varied]
    return found


def _several(value: Given) -> tuple[Given, ...]:
    if value is None:
        return ()
    one = isinstance(value, str | os.PathLike | Mapping | Muscle)
    return (value,) if one or not isinstance(value, Sequence | np.ndarray) else tuple(value)


def _kinds(test: Given, given: Sequence[str]) -> tuple[Kind, ...]:
    allowed = (*KINDS, "all")
    if test not in allowed:
        raise unknown(test, allowed, field="test", problem="is not a valid test")
    kinds = CHARACTERISTICS if test == "all" else (test,)
    for name in given:
        if not any(name in TAKES[kind] for kind in kinds):
            takers = ", ".join(kind for kind, names in TAKES.items() if name in names)
            raise InputError(f"is not accepted by {test}", field=name, allowed=takers)
    return kinds


def _muscles(muscle: Given, law: Given, friction: Given, sets: Mapping[str, object] | None) -> list[Muscle]:
    found = []
    for one in _several(muscle):
        description = one.model_dump(mode="json") if isinstance(one, Muscle) else one
        for chosen in itertools.product(_several(law) or (None,), _several(friction) or (None,)):
            named = zip(("law", "friction"), chosen, strict=True)
            laid = {key: name for key, name in named if name is not None} | dict(sets or {})
            same = isinstance(one, Muscle) and not laid
            found.append(one if same else load_description("muscle", description, laid))
    return found


@contextlib.contextmanager
def _told(kind: str, muscle: Muscle, lengths: Sequence[Amount]) -> Iterator[None]:
    """An error of a plan, related to the given argument, the muscle and the test."""
    try:
        yield
    except InputError as error:
        if error.field not in UNITS:
            raise
        field, value = error.field, error.value
        if field == "contraction" and lengths:
            field, value = "length", ", ".join(map(str, lengths))
        problem = f"{error.problem} ({muscle.name}, {kind})"
        raise error.replaced(problem=problem, file=None, field=field, value=value) from None


def _arguments(
    amounts: Mapping[str, Sequence[Amount]], ends: bool, data: Measured | None, kind: str, muscle: Muscle
) -> Keywords:
    """The arguments of a kind's plan, from amounts and from measured points."""
    si = {name: [_number(name, value) for value in values] for name, values in amounts.items()}
    si["contraction"] += [1.0 - length / muscle.nominal_length for length in si["length"]]
    if kind in ("step", "release"):
        held = {key: _one(key, si[key]) for key in ("load", "contraction")}
        return {"given": si["pressure"] or None, **held}
    name, _, _ = SET[kind]
    points, start = (None, None) if data is None else points_of(kind, data, muscle, named=bool(si[name]))
    if kind not in ("isobaric", "sealed"):
        span = _span(si["pressure"], None)
    else:
        span = _span(si["contraction"], 0.0) if ends else None
        span = span if span or start is None else (start, None)
    hung = {"load": _one("load", si["load"])} if kind == "auxotonic" else {}
    return {"given": si[name] or points, "span": span} | hung


def _span(values: list[float], start: float | None) -> tuple[float | None, float | None] | None:
    """From and to; one value is the end, of several the least and the greatest."""
    if not values:
        return None
    return (start, values[0]) if len(values) == 1 else (min(values), max(values))


def _one(argument: str, values: list[float]) -> float | None:
    if len(values) > 1:
        raise InputError("is given several times", field=argument, allowed="one for this test")
    return values[0] if values else None


def _number(argument: str, value: Amount) -> float:
    """An amount in SI; a load may be kilograms, a contraction per cent."""
    if not isinstance(value, str):
        return si(value, UNITS[argument], argument)
    if argument == "contraction" and value.strip().endswith("%"):
        return 0.01 * quantity_at(argument, value.strip().removesuffix("%"), "")
    if argument == "load":
        try:
            return parse_quantity(value, "kg") * GRAVITY
        except ValueError:
            pass  # newtons, or nothing that hangs on a muscle
    return quantity_at(argument, value, UNITS[argument])
