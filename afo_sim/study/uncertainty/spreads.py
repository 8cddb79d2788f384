"""What is not known, as a TOML file tells it: read, checked, and held against a scenario."""

import os
import pathlib
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Literal, get_args, get_origin

from pydantic import Field as Option
from pydantic import StrictBool, StrictStr, ValidationError

from afo_sim.common import assets
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import parse_quantity, read_any_quantity
from afo_sim.description.field import Field, field_at
from afo_sim.description.keys import holder
from afo_sim.description.leaves import SETS, core, fields_of, is_table, leaves
from afo_sim.description.muscle import Muscle
from afo_sim.description.reader import split_key
from afo_sim.description.scenario import Scenario
from afo_sim.model.recorded import recorded_stride
from afo_sim.model.walk import stride_time_of
from afo_sim.study.parameter_table import StrictTable
from afo_sim.study.refused import first_error
from afo_sim.study.uncertainty.distribution import Distribution, Kind

STRIDE_TIME = "gait.stride_time"
EACH_STRIDE, DERIVED_PATH = "each stride", "derived path"
WIDTHS = {  # of a distribution: the options that tell how wide it is, one of them
    "normal": ("sd", "relative_sd"),
    "lognormal": ("factor_sd",),
    "uniform": ("within", "relative_within"),
    "pearson3": ("sd", "relative_sd"),
}
EVERY_WIDTH = ("sd", "relative_sd", "factor_sd", "within", "relative_within")
QUANTITIES = ("sd", "within", "at_least", "at_most")  # options that have the unit of what is drawn
NOT_DRAWN = ("duration", "timestep", "record_rate", "limits")  # no property of what walks
NOTABLE = 0.01  # share cut off at a bound from which on it is told [-]


class SpreadTable(StrictTable):
    """A table [parameters.NAME], as it is written."""

    group: StrictStr | None = None
    key: StrictStr | None = None
    keys: tuple[StrictStr, ...] | None = None
    fit: StrictStr | None = None
    height: Literal["each stride", "derived path"] | None = None
    each_stride: StrictBool = False
    distribution: Kind | None = None
    sd: Any = None
    relative_sd: float | None = Option(default=None, ge=0.0, le=1.0)
    factor_sd: float | None = Option(default=None, ge=0.0, le=2.0)
    within: Any = None
    relative_within: float | None = Option(default=None, ge=0.0, le=1.0)
    skew: float | None = Option(default=None, ge=-4.0, le=4.0)
    at_least: Any = None
    at_most: Any = None
    scale: float = Option(default=1.0, ge=0.0, le=10.0)
    measure: StrictStr = ""
    kind: Literal["published", "fitted", "derived", "assumed", "user"]
    source: StrictStr = Option(min_length=1)


class SpreadsFile(StrictTable):
    """A file of spreads as it is written."""

    description: StrictStr = ""
    parameters: dict[str, SpreadTable] = Option(min_length=1)


@dataclass(frozen=True)
class Spreads:
    """What is not known: [parameters.NAME] tables by name, checked one by one, and the file they stand in."""

    file: pathlib.Path
    description: str
    tables: dict[str, SpreadTable]


@dataclass(frozen=True)
class Target:
    """Keys of a scenario that have one value, and what they are drawn from."""

    keys: tuple[str, ...]
    own: float
    unit: str
    distribution: Distribution


@dataclass(frozen=True)
class Unknown:
    """One thing that is not known, or varies: one deviate, which all its targets follow.

    A target without keys is a height [m] that is added to every height of the sole.
    """

    name: str
    table: SpreadTable
    targets: tuple[Target, ...]


@dataclass(frozen=True, eq=False)
class Fit:
    """A muscle's fitted numbers, drawn together; `places` are the keys at which this muscle stands."""

    name: str
    table: SpreadTable
    muscle: Muscle
    places: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Held:
    """Spreads held against a scenario: what is drawn, and what is left out and why."""

    unknowns: tuple[Unknown, ...]
    fits: tuple[Fit, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...] = ()


def read(source: str | os.PathLike[str], beside: pathlib.Path | None = None) -> Spreads:
    """Read a file of spreads.

    Parameters
    ----------
    source : a shipped name, or a path to a TOML file
    beside : file in which the name was found

    Raises
    ------
    InputError
        There is no such file, or something in it is wrong: field, value and what is allowed.
    """
    try:
        file = assets.find("uncertainty", os.fspath(source), beside)
    except InputError as error:
        problem, facts = "there are no such spreads", {"allowed": error.allowed, "nearest": error.nearest}
        raise InputError(problem, file=beside, field="spreads", value=str(source), **facts) from None  # type: ignore[arg-type]
    table = assets.read_toml(file)
    try:
        written = SpreadsFile.model_validate(table)
    except ValidationError as error:
        raise first_error(file, table, error) from None
    for name, one in written.parameters.items():
        _check(file, name, one)
    return Spreads(file, written.description, dict(written.parameters))


def _check(file: pathlib.Path, name: str, table: SpreadTable) -> None:
    """One table by itself: what it draws, and how widely."""

    def wrong(problem: str, option: str, allowed: str = "") -> InputError:
        value = getattr(table, option, None) if option else None
        at = f"parameters.{name}" + (f".{option}" if option else "")
        return InputError(problem, file=file, field=at, value=value, allowed=allowed)

    if not name.isascii() or not name.isidentifier():
        raise wrong("is no name", "", "letters, digits and _, a letter first")
    if sum(getattr(table, option) is not None for option in ("key", "keys", "fit", "height")) != 1:
        raise wrong("what is drawn is not told, or twice", "", "one of key, keys, fit, height")
    if (table.height == EACH_STRIDE) > table.each_stride:
        raise wrong("varies from stride to stride", "each_stride", "true")
    if table.measure and table.each_stride:
        raise wrong("goes with what a measurement can tell, not with what varies", "measure")
    for key in table.keys or filter(None, (table.key,)):
        _check_key(file, name, key)
    for option in QUANTITIES:
        if problem := _no_quantity(getattr(table, option), width=option in EVERY_WIDTH):
            raise wrong(problem, option, "a text with the unit of what is drawn, or a number if it has none")
    given = [option for option in EVERY_WIDTH if getattr(table, option) is not None]
    if table.fit is not None:
        if not _is_place(table.fit):
            raise wrong("is no place of a muscle", "fit", "orthosis.muscle.*.type, or one group's name for *")
        for option in ("distribution", "skew", "at_least", "at_most", *EVERY_WIDTH):
            if getattr(table, option) is not None:
                raise wrong("does not go with fit, which has the fit's own covariance", option, "scale")
        return
    if table.scale != 1.0:
        raise wrong("goes with fit alone", "scale")
    if table.distribution is None:
        raise wrong("is missing", "distribution", ", ".join(WIDTHS))
    allowed = WIDTHS[table.distribution]
    if len(given) != 1 or given[0] not in allowed:
        option = next((one for one in given if one not in allowed), allowed[0])
        raise wrong(
            f"does not go with {table.distribution}, which takes one width", option, " or ".join(allowed)
        )
    if (table.skew is not None) != (table.distribution == "pearson3"):
        raise wrong("goes with pearson3, and pearson3 with a skew", "skew")
    if table.distribution == "pearson3" and (table.at_least, table.at_most) != (None, None):
        raise wrong("does not go with pearson3", "at_least" if table.at_least is not None else "at_most")
    if table.height is not None and given[0].startswith("relative"):
        raise wrong("has nothing to be relative to: a height is added", given[0], "sd or within")


def _check_key(file: pathlib.Path, name: str, key: str) -> None:
    """Refuse a key that no scenario has, or that is no property of orthosis, wearer or walk."""
    field = f"parameters.{name}"
    if key.partition(".")[0] in NOT_DRAWN:
        raise InputError("is no property of orthosis, wearer or walk", file=file, field=field, value=key)
    astray = _astray(key.split("."), Scenario)
    if astray is not None:
        part, known = astray
        raise InputError(
            f"fits no key of any scenario: {part!r} is unknown",
            file=file,
            field=field,
            value=key,
            allowed=", ".join(known) or "a key as afo-sim keys lists it, * for a name",
            nearest=nearest_name(part, known),
        )


def _is_place(key: str) -> bool:
    """Whether a key is the place of muscles: orthosis.muscle.GROUP.type."""
    parts = key.split(".")
    return len(parts) == 4 and (parts[:2], parts[3]) == (["orthosis", "muscle"], "type")


def _no_quantity(given: Any, *, width: bool) -> str:
    """What is wrong with a quantity whose unit is not known yet; "" where nothing is."""
    if given is None:
        return ""
    try:
        value = read_any_quantity(given)[0] if isinstance(given, str) else parse_quantity(given, "")
    except ValueError as error:
        return str(error)
    return "is below zero" if width and value < 0.0 else ""


def in_words(spreads: Spreads) -> list[tuple[str, str]]:
    """(name, what is drawn and why) of each table."""
    found = []
    for name, table in spreads.tables.items():
        what = ", ".join(
            table.keys or filter(None, (table.key, table.fit, table.height and "the sole's height"))
        )
        width = next((f"{o} {getattr(table, o)}" for o in EVERY_WIDTH if getattr(table, o) is not None), "")
        how = "by the fit's covariance" if table.fit else f"{table.distribution}, {width}"
        found.append((name, f"{what}: {how}; {table.kind}: {table.source}"))
    return found


def held(spreads: Spreads, scenario: Scenario) -> Held:
    """What of some spreads a scenario has.

    Parameters
    ----------
    spreads : from `read`
    scenario : of walking

    Raises
    ------
    InputError
        A key is in no scenario, a width has another dimension, or two tables draw one key.
    """
    unknowns: list[Unknown] = []
    fits: list[Fit] = []
    left_out: list[str] = []
    taken: dict[str, str] = {}
    for name, table in spreads.tables.items():
        try:
            if table.fit is not None:
                found = list(_fits(name, table, scenario, left_out))
                fits += found
                drawn = [f"{at}.{key}" for fit in found for at in fit.places for key in fitted(fit.muscle)]
            else:
                targets = tuple(_targets(name, table, scenario, left_out))
                unknowns += [Unknown(name, table, targets)] if targets else []
                drawn = [key for target in targets for key in target.keys]
        except InputError as error:
            raise error.of_file(spreads.file) from None
        for key in drawn:
            if key in taken:
                problem = f"is drawn by {taken[key]!r} too"
                raise InputError(problem, file=spreads.file, field=f"parameters.{name}", value=key)
            taken[key] = name
    notes = tuple(note for unknown in unknowns for note in _cut_off(unknown))
    return Held(tuple(unknowns), tuple(fits), tuple(left_out), notes)


def fitted(muscle: Muscle) -> tuple[str, ...]:
    """Keys, below a muscle, of the numbers that were fitted together."""
    return () if muscle.covariance is None else muscle.covariance.parameters


def _cut_off(unknown: Unknown) -> Iterator[str]:
    for target in unknown.targets:
        share = target.distribution.cut(target.own)
        if share > NOTABLE:
            yield (
                f"{unknown.name}: {100.0 * share:.0f} % of its spread lies beyond what is allowed and is "
                "drawn within"
            )


def _targets(name: str, table: SpreadTable, scenario: Scenario, left_out: list[str]) -> Iterator[Target]:
    """Keys by their own value: those that have the same are one target."""
    if table.height is not None:
        if table.height == DERIVED_PATH and not derived_path(scenario):
            left_out.append(f"{name}: the ankle's path of this gait is recorded, not derived")
        else:
            yield Target((), 0.0, "m", _distribution(name, table, "m", 0.0, None))
        return
    alike: dict[tuple[str, float], list[Field]] = {}
    for pattern in table.keys or (str(table.key),):
        for field in _matching(name, pattern, scenario, left_out):
            own = _own(field, scenario)
            if own is None:
                left_out.append(f"{name}: {field.key} has no value here")
            elif own == 0.0 and (table.relative_sd or table.factor_sd or table.relative_within):
                left_out.append(f"{name}: {field.key} is zero, about which nothing is relative")
            else:
                alike.setdefault((field.unit, own), []).append(field)
    for (unit, own), fields in alike.items():
        distribution = _distribution(name, table, unit, own, fields[0])
        yield Target(tuple(field.key for field in fields), own, unit, distribution)


def _own(field: Field, scenario: Scenario) -> float | None:
    """The scenario's own value of a field; of a stride time that is not told the recording's."""
    if field.value is None and field.key == STRIDE_TIME and scenario.gait is not None:
        return None if scenario.gait.speed is not None else float(stride_time_of(scenario))
    return None if field.value is None else float(field.value)


def derived_path(scenario: Scenario) -> bool:
    """Whether the height of the recorded ankle is derived from angles, rather than recorded."""
    assert scenario.gait is not None
    return "ankle_z_m" in recorded_stride(scenario.gait).notes.get("derived", "")


def _matching(name: str, pattern: str, scenario: Scenario, left_out: list[str]) -> Iterator[Field]:
    """Fields of a scenario whose key fits a pattern; what is not there is told.

    A star stands for a name: of a muscle group, a chamber, a segment.
    """
    parts = pattern.split(".")
    known = [leaf for leaf in leaves(Scenario, scenario.resolved()) if len(leaf.path) == len(parts)]
    if "*" not in pattern:
        try:
            field = field_at(pattern, scenario)
        except InputError as error:
            if not _elsewhere(parts):
                raise InputError(
                    error.problem,
                    field=f"parameters.{name}",
                    value=pattern,
                    allowed=error.allowed,
                    nearest=error.nearest,
                ) from None
            left_out.append(f"{name}: {pattern} is not there")
            return
        there = [field] if holder(scenario, split_key(pattern)[0]) is not None else []
    else:
        keys = [leaf.key for leaf in known if all(map(fnmatchcase, leaf.path, parts))]
        fields = [field_at(key, scenario) for key in keys]
        there = [field for field in fields if holder(scenario, split_key(field.key)[0]) is not None]
        if not there and not _elsewhere(parts):
            nearest = nearest_name(pattern, [leaf.key for leaf in known])
            raise InputError(
                "fits no key of any scenario",
                field=f"parameters.{name}",
                value=pattern,
                allowed="a key as afo-sim keys lists it, * for a name",
                nearest=nearest,
            )
    for field in there:
        if field.kind != "number":
            problem = "is no number that spreads"
            raise InputError(problem, field=f"parameters.{name}", value=field.key, allowed=field.form)
    if not there:
        left_out.append(f"{name}: {pattern} is not there")
    yield from there


def _elsewhere(parts: list[str]) -> bool:
    """Whether some scenario has such a key: the types alone tell, with any name of a muscle or chamber."""
    return _astray(parts, Scenario) is None


def _astray(parts: list[str], node: Any) -> tuple[str, list[str]] | None:
    """The first part of a key that no scenario has, and what may stand there; None where one has the key."""
    if not parts:
        return None
    kind, name = core(node)[0], parts[0].partition("[")[0]
    if kind in SETS:  # a law's parameters: which they are, its muscle tells
        return None
    if get_origin(kind) is dict:
        return _astray(parts[1:], get_args(kind)[1])
    known = list(fields_of(kind)) if is_table(kind) else []
    fitting = [each for each in known if fnmatchcase(each, name)]
    if is_table(kind) and kind.model_config.get("extra") == "allow" and name not in known:  # of chambers
        return _astray(parts[1:], get_args(kind.__annotations__["__pydantic_extra__"])[1])
    ways = [_astray(parts[1:], kind.model_fields[each].annotation) for each in fitting]
    return None if None in ways else ways[0] if ways else (parts[0], known)


def _distribution(name: str, table: SpreadTable, unit: str, own: float, field: Field | None) -> Distribution:
    """The distribution about an own value, cut off at the table's bounds and at the field's."""
    assert table.distribution is not None

    def quantity(option: str, default: float) -> float:
        text = getattr(table, option)
        if text is None:
            return default
        try:
            return parse_quantity(text, unit)
        except ValueError as error:
            raise InputError(str(error), field=f"parameters.{name}.{option}", value=text) from None

    width = next(
        found
        for found in (
            table.factor_sd,
            None if table.relative_sd is None else table.relative_sd * abs(own),
            None if table.relative_within is None else table.relative_within * abs(own),
            quantity("sd", -1.0) if table.sd is not None else None,
            quantity("within", -1.0) if table.within is not None else None,
        )
        if found is not None
    )
    if width < 0.0:
        option = "sd" if table.sd is not None else "within"
        raise InputError("is below zero", field=f"parameters.{name}.{option}", value=getattr(table, option))
    low, high = (-float("inf"), float("inf")) if field is None else field.bounds
    low, high = max(low, quantity("at_least", low)), min(high, quantity("at_most", high))
    if not low <= own <= high:
        option = "at_least" if own < low else "at_most"
        problem = f"leaves out the scenario's own value of {field.key if field else name}"
        allowed = f"{'at most' if own < low else 'at least'} {own:g} {unit}".rstrip()
        raise InputError(
            problem, field=f"parameters.{name}.{option}", value=getattr(table, option), allowed=allowed
        )
    if table.distribution == "pearson3":
        return Distribution("pearson3", width, table.skew or 0.0)
    return Distribution(table.distribution, width, 0.0, low, high)


def _fits(name: str, table: SpreadTable, scenario: Scenario, left_out: list[str]) -> Iterator[Fit]:
    """The muscles of a scenario, each once: groups of the same muscle come from the same fit."""
    pattern = str(table.fit).split(".")[2]
    groups = [group for group in scenario.orthosis.muscle if fnmatchcase(group, pattern)]
    if not groups:
        left_out.append(f"{name}: {table.fit} is not there")
    kinds: dict[Muscle, list[str]] = {}
    for group in groups:
        kinds.setdefault(scenario.orthosis.muscle[group].type, []).append(group)
    for muscle, members in kinds.items():
        why = muscle.without_draws
        if why:
            left_out.append(f"{name}: {muscle.name or ', '.join(members)}: {why}")
        else:
            own = name if len(kinds) == 1 else f"{name}_{members[0]}"
            yield Fit(own, table, muscle, tuple(f"orthosis.muscle.{group}.type" for group in members))
