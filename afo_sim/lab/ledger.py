"""The ledger: devices and rigs of others, predicted before their measured numbers are read, with a band.

Each file of `models/ledger` describes one device: what is published of it, what is not, and what was measured.
What is not published is drawn from a stated range, never chosen. The rules, written before any result:

    band       5 to 95 % of the predictions of DRAWS draws; one set of draws for all rows of a device
    verdict    disagrees    band and measured ± error have no number in common
               cannot tell  they have, but half the band and the error exceed half of the measured value;
                            or nothing can be predicted, for the stated reason
               agrees       else
    score      (u − l) + 2/α (l − x)+ + 2/α (x − u)+ over |x|, α = 0.1; small is good

Source of the score: Gneiting & Raftery 2007, J. Am. Stat. Assoc. 102:359, eq. 43.
"""

import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic import Field as Option

from afo_sim.common import InputError, Shown, assets, read_any_quantity, unknown
from afo_sim.description import PROBLEMS
from afo_sim.lab.ledger_predictions import PREDICTIONS

Verdict = Literal["agrees", "disagrees", "cannot tell"]
DRAWS, SEED = 64, 20070302
LEVELS = (0.05, 0.5, 0.95)
ALPHA = 0.1  # share of measured values that a band of 90 % misses
SAYS_NOTHING = 0.5  # half the band and the error, over the measured value, from which agreement says nothing
HEADER = ("device", "quantity", "predicted", "90 % band", "measured", "ratio", "verdict")
# Shared recordings that are not in this package; a function of their folder gives (predictions, measured, error).
BENCH: dict[str, Callable[[pathlib.Path], tuple[np.ndarray, float, float]] | None] = {
    "aarl_festo10_isometric": None,
    "aarl_festo20_fill_leak": None,
    "pamy_acrkn": None,
}


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Unknown(_Table):
    """A number that is not published: a range to draw from, or a choice."""

    within: tuple[float, float] | tuple[str, str] | None = None
    choices: tuple[str, ...] = ()
    scale: Literal["linear", "log"] = "linear"
    kind: Literal["published", "derived", "assumed"]
    source: str = Option(min_length=1)

    def at(self, share: float) -> float | str:
        """The value below which a share of the draws lies, a text where the range has a unit."""
        if self.within is None:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        ends = [str(end).partition(" ") for end in self.within]
        low, high, unit = float(ends[0][0]), float(ends[1][0]), ends[0][2]
        value = low * (high / low) ** share if self.scale == "log" else low + share * (high - low)
        return f"{value!r} {unit}" if unit else value


class Measured(_Table):
    """A measured number; the error is half its 90 % interval, `at` where the prediction is made."""

    quantity: str
    value: str
    error: str = ""
    at: dict[str, str] = Option(default_factory=dict)


class Device(_Table):
    """A file of the ledger: how it is predicted, from what, what is not known, and what was measured."""

    name: str
    device: str
    description: str
    worn: bool = False
    predict: str = ""
    of: str = ""
    given: dict[str, Any] = Option(default_factory=dict)
    unknown: dict[str, Unknown] = Option(default_factory=dict)
    wanting: str = ""
    error_from: str = ""
    source: str = Option(min_length=1)
    measured: tuple[Measured, ...] = Option(min_length=1)

    def draws(self, count: int = DRAWS, seed: int = SEED) -> list[dict[str, Any]]:
        """Values of what is not known, a Latin hypercube: every `count`-th part of each range once."""
        rng = np.random.default_rng(seed)
        shares = {name: (rng.permutation(count) + rng.random(count)) / count for name in sorted(self.unknown)}
        return [
            {name: self.unknown[name].at(float(share[k])) for name, share in shares.items()} | {"draw": k}
            for k in range(count)
        ]


@dataclass(frozen=True)
class LedgerRow:
    """One measured number beside the predicted one, in `unit`; None where there is none."""

    device: str
    quantity: str
    unit: str
    predicted: float | None
    low: float | None
    high: float | None
    measured: float | None
    error: float | None
    source: str
    why: str = ""
    worn: bool = False

    @property
    def verdict(self) -> Verdict:
        """By the rule of this page."""
        if self.low is None or self.high is None or self.measured is None or self.error is None:
            return "cannot tell"
        if self.low > self.measured + self.error or self.high < self.measured - self.error:
            return "disagrees"
        half = 0.5 * (self.high - self.low) + self.error
        return "cannot tell" if half > SAYS_NOTHING * abs(self.measured) else "agrees"

    @property
    def ratio(self) -> float | None:
        """Predicted over measured."""
        return None if self.predicted is None or not self.measured else self.predicted / self.measured

    @property
    def covered(self) -> bool:
        """Whether the measured value lies in the band."""
        return self.ratio is not None and self.low <= self.measured <= self.high  # type: ignore[operator]

    @property
    def score(self) -> float:
        """Interval score over the measured value [-]; of rows that have a prediction."""
        low, high, x = self.low, self.high, self.measured
        assert low is not None and high is not None and x
        return ((high - low) + 2.0 / ALPHA * (max(low - x, 0.0) + max(x - high, 0.0))) / abs(x)


class Ledger(Shown, list[LedgerRow]):
    """Rows of the ledger, which show how they came out."""

    def __repr__(self) -> str:
        return f"<Ledger: {summary(self)[0]}>"


def read_device(file: pathlib.Path) -> Device:
    """Read a file of the ledger.

    Raises
    ------
    InputError
        The file cannot be read, or a key of it is wrong.
    """
    table = {"name": file.stem, "device": file.stem} | assets.read_toml(file)
    try:
        device = Device.model_validate(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(map(str, first["loc"]))
        raise InputError(PROBLEMS.get(first["type"], first["msg"]), file=file, field=field) from None
    if device.predict not in PREDICTIONS and not device.wanting:
        raise unknown(device.predict, [*PREDICTIONS], field="predict", problem="is an unknown prediction")
    return device


def ledger(folder: pathlib.Path | None = None, report: Callable[[int, int], None] | None = None) -> Ledger:
    """Predict every device of the ledger, and set the measured numbers beside it.

    Parameters
    ----------
    folder : of TOML files, one a device; the shipped ones by default
    report : called with (devices done, devices in all)

    Returns
    -------
    rows, one per measured number, in the order of the files' names

    Raises
    ------
    InputError
        A file is wrong.

    Examples
    --------
    >>> [row.device for row in ledger() if row.verdict == "disagrees"]  # doctest: +SKIP
    """
    files = sorted((folder or assets.folder("models") / "ledger").glob("*.toml"))
    found = Ledger()
    for done, file in enumerate(files, 1):
        found += rows_of(read_device(file))
        if report is not None:
            report(done, len(files))
    return found


def rows_of(device: Device) -> list[LedgerRow]:
    """The rows of one device: all its measured numbers, predicted from the same draws."""
    draws = [] if device.wanting else device.draws()
    return [_row(device, each, draws) for each in device.measured]


def _row(device: Device, each: Measured, draws: Sequence[Mapping[str, Any]]) -> LedgerRow:
    unit = each.value.partition(" ")[2]
    one = read_any_quantity(f"1 {unit}")[0]
    band: Sequence[float | None] = (None, None, None)
    if draws:
        predict = PREDICTIONS[device.predict]
        values = [predict(device.of, device.given, each.at, drawn) for drawn in draws]
        band = [float(x) for x in np.quantile(values, LEVELS) / one]
    low, middle, high = band
    value, error = (read_any_quantity(x)[0] / one if x else None for x in (each.value, each.error))
    why = device.wanting or device.error_from
    return LedgerRow(
        device.device, each.quantity, unit, middle, low, high, value, error, device.source, why, device.worn
    )


def bench(data: pathlib.Path | None = None) -> list[LedgerRow]:
    """Rows of the shared recordings, each predicted by its function where its folder is given."""
    found = []
    for name, predict in BENCH.items():
        why = "the recordings are not in this package; give --data FOLDER"
        band: list[float | None] = [None] * 5
        if data is not None:
            why = "nothing here predicts it yet" if predict is None else ""
            if predict is not None:
                values, measured, error = predict(data / name)
                band = [*map(float, np.quantile(values, LEVELS)), measured, error]
        low, middle, high, value, error_ = band
        found.append(LedgerRow(name, "recordings", "", middle, low, high, value, error_, name, why))
    return found


def table(rows: Sequence[LedgerRow]) -> list[list[str]]:
    """The rows as texts under HEADER."""
    return [
        [
            row.device,
            f"{row.quantity} [{row.unit}]" if row.unit else row.quantity,
            "" if row.predicted is None else f"{row.predicted:.3g}",
            "" if row.low is None else f"{row.low:.3g} to {row.high:.3g}",
            "" if row.measured is None else f"{row.measured:.4g}" + (f" ± {row.error:.2g}" if row.error else ""),
            "" if row.ratio is None else f"{row.ratio:.2f}",
            row.verdict,
        ]
        for row in rows
    ]


def remarks(rows: Sequence[LedgerRow]) -> list[str]:
    """Source of each device, and why nothing can be told of some."""
    found: dict[str, None] = {}
    for row in rows:
        found[f"{row.device}: {row.source}" + (f" ({row.why})" if row.why else "")] = None
    return list(found)


def summary(rows: Sequence[LedgerRow]) -> list[str]:
    """How the rows came out, how good the bands are, and how wide."""
    counts = {v: sum(row.verdict == v for row in rows) for v in ("agrees", "disagrees", "cannot tell")}
    told = {row.device for row in rows if row.verdict != "cannot tell"}
    lines = [", ".join(f"{n} {v}" for v, n in counts.items()) + f"; {len(told)} devices or rigs told"]
    both = [row for row in rows if row.ratio is not None]
    if not both:
        return lines
    from scipy.stats import binomtest  # slow to import

    error = np.median([abs(row.ratio - 1.0) for row in both])  # type: ignore[operator]
    inside = sum(row.covered for row in both)
    least, most = binomtest(inside, len(both)).proportion_ci(0.9)
    narrow = "too narrow" if most < 1.0 - ALPHA else "too wide" if least > 1.0 - ALPHA else "not refuted"
    width = np.median([(row.high - row.low) / row.predicted for row in both])  # type: ignore[operator]
    scores = [row.score for row in both]
    return [
        *lines,
        f"median error {100.0 * error:.0f} %; median width of the band {100.0 * width:.0f} % of the prediction",
        f"{inside} of {len(both)} measured values lie in their band, a share of {100.0 * least:.0f} to "
        f"{100.0 * most:.0f} % (90 % interval): as bands of 90 % they are {narrow}",
        f"interval score over the measured value: median {np.median(scores):.2f}, mean {np.mean(scores):.2f}",
    ]
