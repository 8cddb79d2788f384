"""What is not known, read from a TOML file and checked, and the distribution of one number."""

import math
import os
import pathlib
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np
from pydantic import Field as Option
from pydantic import StrictBool, StrictStr
from scipy.special import ndtr, ndtri

from afo_sim.common import Given, InputError, Mixed, assets, nearest_name, parse_quantity, read_any_quantity
from afo_sim.description import SETS, Scenario, fields_of, of_chambers, tables
from afo_sim.study.parameter import deviate
from afo_sim.study.parameter_table import StrictTable

Kind = Literal["normal", "lognormal", "uniform", "pearson3"]
EACH_STRIDE, DERIVED_PATH = "each stride", "derived path"
_WIDTHS = {  # of a distribution: the options that state how wide it is, one of them
    "normal": ("sd", "relative_sd"),
    "lognormal": ("factor_sd",),
    "uniform": ("within", "relative_within"),
    "pearson3": ("sd", "relative_sd"),
}
_EVERY_WIDTH = ("sd", "relative_sd", "factor_sd", "within", "relative_within")
_FACTORS = ("force_factor", "contraction_factor")  # of a muscle, which knows whether these were measured
_QUANTITIES = ("sd", "within", "at_least", "at_most")  # options that have the unit of what is drawn
_NOT_DRAWN = ("duration", "timestep", "record_rate", "limits")  # no property of what walks


@dataclass(frozen=True)
class Distribution:
    """Of one number [SI] about its own value."""

    kind: Kind
    width: float
    skew: float = 0.0
    lower: float = -math.inf
    upper: float = math.inf

    def at(self, deviates: np.ndarray, own: float) -> np.ndarray:
        """The values of standard normal deviates (n,), rising with them."""
        if self.kind == "pearson3":
            from scipy import stats  # slow to import

            return np.asarray(own + self.width * stats.pearson3.ppf(ndtr(deviates), self.skew))
        if self.width == 0.0:
            return np.full(len(deviates), own)
        inside, (low, high) = deviates, (self._deviate(bound, own) for bound in (self.lower, self.upper))
        if low > -math.inf or high < math.inf:  # cut off at its bounds: the same shares of what is left
            from scipy import stats

            inside = np.asarray(stats.truncnorm.ppf(ndtr(deviates), low, high))
        if self.kind == "uniform":
            return np.asarray(own + self.width * (2.0 * ndtr(inside) - 1.0))
        if self.kind == "lognormal":
            return np.asarray(own * np.exp(self.width * inside))
        return np.asarray(own + self.width * inside)

    def cut(self, own: float) -> float:
        """Share of the distribution that lies beyond its bounds [-]; the rest is drawn in its stead."""
        if self.kind == "pearson3" or self.width == 0.0:
            return 0.0
        low, high = ndtr([self._deviate(self.lower, own), self._deviate(self.upper, own)])
        return float(1.0 - (high - low))

    def _deviate(self, bound: float, own: float) -> float:
        if self.kind == "uniform":
            return float(ndtri(min(max(0.5 + 0.5 * (bound - own) / self.width, 0.0), 1.0)))
        return deviate(bound, own, self.width, self.kind == "lognormal")


class SpreadTable(StrictTable):
    """A table [parameters.NAME], as it is written."""

    group: StrictStr | None = None
    key: StrictStr | None = None
    keys: tuple[StrictStr, ...] | None = None
    fit: StrictStr | None = None
    height: Literal["each stride", "derived path"] | None = None
    each_stride: StrictBool = False
    distribution: Kind | None = None
    sd: Given = None
    relative_sd: float | None = Option(default=None, ge=0.0, le=1.0)
    factor_sd: float | None = Option(default=None, ge=0.0, le=2.0)
    factor_sd_measured: float | None = Option(default=None, ge=0.0, le=2.0)
    within: Given = None
    relative_within: float | None = Option(default=None, ge=0.0, le=1.0)
    skew: float | None = Option(default=None, ge=-4.0, le=4.0)
    at_least: Given = None
    at_most: Given = None
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
    """Spreads of uncertain inputs: [parameters.NAME] tables by name, each checked, and their file."""

    file: pathlib.Path
    tables: dict[str, SpreadTable]


def read(source: str | os.PathLike[str], beside: pathlib.Path | None = None) -> Spreads:
    """Read a file of spreads."""
    try:
        file = assets.find("uncertainty", os.fspath(source), beside)
    except InputError as error:
        problem = "there are no such spreads"
        raise error.replaced(problem=problem, file=beside, field="spreads", value=str(source)) from None
    written = SpreadsFile.read(file, assets.read_toml(file))
    for name, one in written.parameters.items():
        _check(file, name, one)
    return Spreads(file, dict(written.parameters))


def _check(file: pathlib.Path, name: str, table: SpreadTable) -> None:
    """One table by itself: what it draws, and how widely."""

    def wrong(problem: str, option: str, allowed: str = "") -> InputError:
        value = getattr(table, option, None) if option else None
        at = f"parameters.{name}" + (f".{option}" if option else "")
        return InputError(problem, file=file, field=at, value=value, allowed=allowed)

    if not name.isascii() or not name.isidentifier():
        raise wrong("is not a valid name", "", "letters, digits and _, a letter first")
    if sum(getattr(table, option) is not None for option in ("key", "keys", "fit", "height")) != 1:
        raise wrong("what is drawn is not stated, or twice", "", "one of key, keys, fit, height")
    if (table.height == EACH_STRIDE) > table.each_stride:
        raise wrong("varies from stride to stride", "each_stride", "true")
    if table.measure and table.each_stride:
        raise wrong("goes with what a measurement can give, not with what varies", "measure")
    for key in table.keys or filter(None, (table.key,)):
        told: dict[str, Mixed] = {"file": file, "field": f"parameters.{name}", "value": key}
        if key.partition(".")[0] in _NOT_DRAWN:
            raise InputError("is not a property of orthosis, wearer or walk", **told)
        if (unknown_part := astray(key.split("."))) is not None:
            part, known = unknown_part
            told["allowed"] = ", ".join(known) or "a key as afo-sim keys lists it, * for a name"
            text, near = f"fits no key of any scenario: {part!r} is unknown", nearest_name(part, known)
            raise InputError(text, nearest=near, **told)
    for option in _QUANTITIES:
        if problem := _no_quantity(getattr(table, option), width=option in _EVERY_WIDTH):
            raise wrong(problem, option, "a text with the unit of what is drawn, or a number if it has none")
    given = [option for option in _EVERY_WIDTH if getattr(table, option) is not None]
    if table.fit is not None:
        parts = table.fit.split(".")
        if len(parts) != 4 or (parts[:2], parts[3]) != (["orthosis", "muscle"], "type"):
            problem = "is not a place of a muscle"
            raise wrong(problem, "fit", "orthosis.muscle.*.type, or one group's name for *")
        for option in ("distribution", "skew", "at_least", "at_most", "factor_sd_measured", *_EVERY_WIDTH):
            if getattr(table, option) is not None:
                raise wrong("does not go with fit, which has the fit's own covariance", option, "scale")
        return
    if table.scale != 1.0:
        raise wrong("goes with fit alone", "scale")
    if table.distribution is None:
        raise wrong("is missing", "distribution", ", ".join(_WIDTHS))
    allowed = _WIDTHS[table.distribution]
    if len(given) != 1 or given[0] not in allowed:
        option = next((one for one in given if one not in allowed), allowed[0])
        problem = f"does not go with {table.distribution}, which takes one width"
        raise wrong(problem, option, " or ".join(allowed))
    if table.factor_sd_measured is not None:
        if table.factor_sd is None:
            raise wrong("goes with lognormal", "factor_sd_measured", "beside factor_sd")
        if not all(key.endswith(_FACTORS) for key in table.keys or (table.key or "",)):
            raise wrong("goes with factors of a muscle", "factor_sd_measured", " or ".join(_FACTORS))
    if (table.skew is not None) != (table.distribution == "pearson3"):
        raise wrong("goes with pearson3, and pearson3 with a skew", "skew")
    if table.distribution == "pearson3" and (table.at_least, table.at_most) != (None, None):
        raise wrong("does not go with pearson3", "at_least" if table.at_least is not None else "at_most")
    if table.height is not None and given[0].startswith("relative"):
        raise wrong("has nothing to be relative to: a height is added", given[0], "sd or within")


def _no_quantity(given: Given, *, width: bool) -> str:
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
        one = (table.key, table.fit, table.height and "the sole's height")
        what = ", ".join(table.keys or filter(None, one))
        width = next((f"{o} {getattr(table, o)}" for o in _EVERY_WIDTH if getattr(table, o) is not None), "")
        if table.factor_sd_measured is not None:
            width += f", {table.factor_sd_measured} where measured"
        how = "by the fit's covariance" if table.fit else f"{table.distribution}, {width}"
        found.append((name, f"{what}: {how}; {table.kind}: {table.source}"))
    return found


def astray(parts: list[str], node: Mixed = Scenario) -> tuple[str, list[str]] | None:
    """The first part of a key that no scenario has, by the types alone, and what may stand there; or None."""
    if not parts:
        return None
    (kind, many), name = tables(node), parts[0].partition("[")[0]
    if many == "list":  # "path[0].spacing", or split "path", "0", "spacing"
        return astray(parts[1:] if parts[0].isdigit() else parts, kind)
    if kind in SETS and many == "one":  # a law's parameters: its muscle states which they are
        return None
    if many == "named":
        return astray(parts[1:], kind)
    known = fields_of(kind) if many else {}
    fitting = [each for each in known if fnmatchcase(each, name)]
    if of_chambers(kind) is not None and name not in known:
        return astray(parts[1:], of_chambers(kind))
    ways = [astray(parts[1:], known[each].annotation) for each in fitting]
    return None if None in ways else ways[0] if ways else (parts[0], list(known))
