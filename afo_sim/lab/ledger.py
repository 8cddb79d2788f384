"""The ledger: other groups' devices and rigs, predicted with bands, compared with measurements.

Each file of `models/ledger` describes one device: what is published of it, what is not, what was measured.
What is not published is drawn from a stated range, never chosen. The rules, written before any result:

    band       5 to 95 % of the predictions of DRAWS draws; one set of draws for all rows of a device
    verdict    disagrees    band and measured ± error have no number in common
               cannot tell  they have, but half the band and the error exceed half of the measured value;
                            or nothing is predicted
               agrees       else
    score      (u − l) + 2/α (l − x)+ + 2/α (x − u)+ over |x|, α = 0.1; small is good
               (Gneiting & Raftery 2007, J. Am. Stat. Assoc. 102:359, eq. 43)
    coverage   share of measured values in their bands, in which each bench counts once, however many its rows
    spread     of makers' muscles between laboratories: of each bench the mean of ln(measured/predicted force)
               without contraction; a row is judged with the RMS over the n other benches, Student's t of n
"""

import functools
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError
from pydantic import Field as Option
from scipy.special import ndtri, stdtrit

from afo_sim.common import FloatOrArray, InputError, JsonDict, assets, nearest_name, unknown
from afo_sim.description import PROBLEMS, load
from afo_sim.lab.identifiability import rms
from afo_sim.lab.ledger_predictions import PREDICTIONS, contracted, si
from afo_sim.lab.validation_row import Report, counted

DRAWS, SEED = 64, 20070302
LEVELS = (0.05, 0.5, 0.95)
ALPHA = 0.1  # share of measured values that a band of 90 % misses
BY_MAKER = "B"  # grade of a muscle whose law is its maker's curve
AT_REST = 0.01  # contraction ratio up to which a force counts as without contraction [-]
SAYS_NOTHING = 0.5  # (half the band + error)/measured beyond which agreement says nothing
VERDICTS = ("agrees", "disagrees", "cannot tell")
HEADER = ("device", "quantity", "predicted", "90 % band", "measured", "ratio", "verdict")


class Number(BaseModel, frozen=True, extra="forbid"):
    """A number of a device: its value, or a range, choices or a factor to draw from."""

    value: float | str = ""
    within: tuple[float, float] | tuple[str, str] | None = None
    choices: tuple[str, ...] = ()
    factor_sd: float | None = Option(default=None, gt=0.0, le=2.0)
    laboratories: bool = False
    scale: Literal["linear", "log"] = "linear"
    kind: Literal["published", "derived", "assumed"]
    source: str = Option(min_length=1)

    def at(self, share: float, others: Sequence[float] = ()) -> float | str:
        """The value below which a share of draws lies; `others` are ln of measured over predicted force."""
        if self.laboratories:
            return float(np.exp(rms(np.array(others)) * stdtrit(len(others), share)))
        if self.factor_sd is not None:
            return float(np.exp(self.factor_sd * ndtri(share)))
        if self.within is None:
            return self.choices[int(share * len(self.choices))]
        ends = [str(end).partition(" ") for end in self.within]
        low, high = float(ends[0][0]), float(ends[1][0])
        value = float(low * (high / low) ** share if self.scale == "log" else low + share * (high - low))
        return f"{value!r} {ends[0][2]}" if ends[0][2] else value


class Measured(BaseModel, frozen=True, extra="forbid"):
    """A measured number, half its 90 % interval, and `at` where it is predicted."""

    quantity: str
    value: str
    error: str = ""
    at: dict[str, str] = {}


class Device(BaseModel, frozen=True, extra="forbid"):
    """A file of the ledger: how a device is predicted (or why not), and what was measured on it."""

    device: str
    bench: str = Option(min_length=1)
    kind: str
    worn: bool = False
    description: str
    predict: str = ""
    of: str = ""
    given: dict[str, Number] = {}
    unknown: dict[str, Number] = {}
    wanting: str = ""
    error_from: str = ""
    source: str = Option(min_length=1)
    measured: tuple[Measured, ...] = Option(min_length=1)

    def draws(self) -> list[JsonDict]:
        """What is given, and draws of what is not known: each DRAWS-th part of every range once."""
        rng = np.random.default_rng(SEED)
        shares = {key: (rng.permutation(DRAWS) + rng.random(DRAWS)) / DRAWS for key in sorted(self.unknown)}
        of, others = self.unknown, [*self.others.values()]
        drawn = ({key: of[key].at(each[k], others) for key, each in shares.items()} for k in range(DRAWS))
        return [self.known | one | {"draw": k} for k, one in enumerate(drawn)]

    @property
    def known(self) -> JsonDict:
        """What is given."""
        return {key: number.value for key, number in self.given.items()}

    @property
    def others(self) -> dict[str, float]:
        """Of the other laboratories: ln of measured over predicted force; empty where it is not asked for."""
        asked = any(number.laboratories for number in self.unknown.values())
        return {bench: x for bench, x in laboratories().items() if bench != self.bench} if asked else {}


@dataclass(frozen=True)
class LedgerRow:
    """A measured number, half its 90 % interval, 5, 50, 95 % of its prediction."""

    device: str
    quantity: str
    unit: str = ""
    band: tuple[float, ...] | None = None
    measured: float | None = None
    error: float | None = None
    source: str = ""
    bench: str = ""
    kind: str = ""
    worn: bool = False

    @property
    def inside(self) -> bool | None:
        """Whether the measured value lies in the band; None where there is no such pair."""
        if self.band is None or self.measured is None:
            return None
        return self.band[0] <= self.measured <= self.band[2]

    @property
    def verdict(self) -> str:
        """One of VERDICTS, by the module's rule."""
        if self.band is None or self.measured is None or self.error is None:
            return VERDICTS[2]
        (low, _, high), error = self.band, self.error
        if low > self.measured + error or high < self.measured - error:
            return VERDICTS[1]
        return VERDICTS[2 if 0.5 * (high - low) + error > SAYS_NOTHING * abs(self.measured) else 0]


def interval_score(low: FloatOrArray, high: FloatOrArray, x: FloatOrArray) -> FloatOrArray:
    """The interval score of bands over the measured values [-]; numbers or arrays."""
    beyond = np.maximum(low - x, 0.0) + np.maximum(x - high, 0.0)
    return (high - low + 2.0 / ALPHA * beyond) / np.abs(x)


Described = TypeVar("Described", bound=BaseModel)


def read_checked(kind: type[Described], file: pathlib.Path, *parts: type[BaseModel]) -> Described:
    """A TOML file as a model with submodels; unknown keys are reported before missing ones."""
    try:
        return kind.model_validate(assets.read_toml(file))
    except ValidationError as error:
        first = min(error.errors(include_url=False), key=lambda each: each["type"] != "extra_forbidden")
        field, problem = ".".join(map(str, first["loc"])), PROBLEMS.get(first["type"], first["msg"])
        known = [*kind.model_fields, *(name for part in parts for name in part.model_fields)]
        near = nearest_name(str(first["loc"][-1]), known) if first["type"] == "extra_forbidden" else ""
        raise InputError(problem, file=file, field=field, nearest=near) from None


def read_device(file: pathlib.Path) -> Device:
    """A file of the ledger, checked."""
    device = read_checked(Device, file, Measured, Number)
    if device.predict not in PREDICTIONS and not device.wanting:
        raise unknown(device.predict, [*PREDICTIONS], field="predict", problem="is an unknown prediction")
    return device


def ledger(report: Report = None) -> list[LedgerRow]:
    """A row for each measured number of the shipped ledger; `report` takes devices done, and in all."""
    return [row for device in counted([*devices().values()], report) for row in rows_of(device)]


@functools.cache
def devices() -> dict[str, Device]:
    """The shipped ledger's devices by the names of their files."""
    files = sorted((assets.folder("models") / "ledger").glob("*.toml"))
    return {file.stem: read_device(file) for file in files}


@functools.cache
def laboratories() -> dict[str, float]:
    """Of each bench with makers' muscles: mean ln of measured over predicted force without contraction."""
    found: dict[str, list[float]] = {}
    for device in devices().values():
        if device.predict != "force" or load("muscle", device.of).grade != BY_MAKER:
            continue
        middle = {key: each.at(0.5, (0.0,)) for key, each in device.unknown.items()}
        middle = device.known | middle | {"draw": 0}
        for each in device.measured:
            if abs(contracted(each.at, middle)) < AT_REST:
                predicted = PREDICTIONS["force"](device.of, each.at, middle)
                found.setdefault(device.bench, []).append(float(np.log(si(each.value) / predicted)))
    return {bench: float(np.mean(ratios)) for bench, ratios in found.items()}


def rows_of(device: Device) -> list[LedgerRow]:
    """The rows of one device: all its measured numbers, predicted from the same draws."""
    draws, found = [] if device.wanting else device.draws(), []
    source = f"{device.source} ({device.wanting or device.error_from})"
    for each in device.measured:
        unit, band = each.value.partition(" ")[2], None
        if draws:
            predict = PREDICTIONS[device.predict]
            values = [predict(device.of, each.at, drawn) / si(f"1 {unit}") for drawn in draws]
            band = tuple(map(float, np.quantile(values, LEVELS)))
        value, error = (si(text) / si(f"1 {unit}") if text else None for text in (each.value, each.error))
        what = device.bench, device.kind, device.worn
        found.append(LedgerRow(device.device, each.quantity, unit, band, value, error, source, *what))
    return found


def by_bench(rows: Sequence[LedgerRow], values: Sequence[float]) -> tuple[float, float]:
    """Mean of values, and its standard error, in which each bench counts once."""
    benches = dict.fromkeys(row.bench for row in rows)
    means = [np.mean([x for row, x in zip(rows, values, strict=True) if row.bench == b]) for b in benches]
    return float(np.mean(means)), float(np.std(means, ddof=1) / len(means) ** 0.5)


def table(rows: Sequence[LedgerRow]) -> list[list[str]]:
    """The rows as texts under HEADER."""
    shown = []
    for row in rows:
        quantity = f"{row.quantity} [{row.unit}]" if row.unit else row.quantity
        band = [f"{row.band[1]:.4g}", f"{row.band[0]:.4g} to {row.band[2]:.4g}"] if row.band else ["", ""]
        error = f" ± {row.error:g}" if row.error else ""
        measured = "" if row.measured is None else f"{row.measured:g}{error}"
        ratio = f"{row.band[1] / row.measured:.2f}" if row.band and row.measured else ""
        shown.append([row.device, quantity, *band, measured, ratio, row.verdict])
    return shown


def summary(rows: Sequence[LedgerRow]) -> list[str]:
    """How rows came out of which some are predicted, how good the bands are, and how wide."""
    counts = ", ".join(f"{[row.verdict for row in rows].count(v)} {v}" for v in VERDICTS)
    benches = {row.bench for row in rows if row.verdict != VERDICTS[2]}
    told = [row for row in rows if row.inside is not None]
    low, middle, high, x = np.array([(*(row.band or ()), row.measured) for row in told]).T
    error = np.array([row.error for row in told])
    from scipy.stats import binomtest  # slow to import

    scores, inside = interval_score(low, high, x), [float(bool(row.inside)) for row in told]
    near = int(((low <= x + error) & (x - error <= high)).sum())
    least, most = binomtest(int(sum(inside)), len(told)).proportion_ci(0.9)
    share, deviation = by_bench(told, inside)
    what = "too narrow" if most < 1.0 - ALPHA else "too wide" if least > 1.0 - ALPHA else "not refuted"
    width, wide = np.median((high - low) / np.abs(x)), f"{100.0 * least:.0f} to {100.0 * most:.0f} %"
    median, mean, once = np.median(scores), np.mean(scores), by_bench(told, scores)[0]
    return [
        f"{counts}; {len(benches)} benches or groups with a verdict",
        f"median error {100.0 * np.median(np.abs(middle / x - 1.0)):.0f} %, "
        f"median width of the band {100.0 * width:.0f} % of the measured value",
        f"{sum(inside):.0f} of {len(told)} measured values lie in their band, a share of {wide} (90 % "
        f"interval): as bands of 90 % they are {what}; {near} lie in it within their own error",
        f"each bench counted once, {100.0 * share:.0f} % lie in it, standard error {100.0 * deviation:.0f} %",
        f"interval score over the measured value: median {median:.2f}, mean {mean:.2f}, "
        f"each bench counted once {once:.2f}",
    ]
