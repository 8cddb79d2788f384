"""Patients drawn from stated ranges: of a condition, or over what is not known of one; and their bodies."""

import itertools
import math
import os
import pathlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from afo_sim.common import FloatOrArray, InputError, JsonDict, JsonMapping, assets, parse_quantity, unknown
from afo_sim.description import Scenario, load
from afo_sim.model import person_of
from afo_sim.physics import LEG_MUSCLES
from afo_sim.walker.body import BARE, SIDES

PLANTARFLEXORS = ("soleus", "gastrocnemius")
SPREAD = math.sqrt(math.log1p(0.57**2))  # of ln of the passive stiffness: 57 % (Chung et al. 2004)
NEAR = 0.1  # to either side of a share that is stated [-]
MOST = 1000  # patients
SHARES = [f"{side}{name}" for side in SIDES for name in (*LEG_MUSCLES, "plantarflexors")]
FACTORS = {"strength": (0.1, 2.0), "tissue": (0.1, 10.0), "mass": (0.2, 4.0), "height": (0.5, 1.4)}
FACTORS |= {"cuff": (100.0, 1e6)}  # [N/m]; least and most, of the others over the stated
_NUMBER = re.compile(r"\s*([-+\d.eE]+)\s*(.*?)\s*")


@dataclass(frozen=True)
class Range:
    """Where a number of patients lies: alike from `low` to `high`, or about a median, lognormal."""

    low: float = 0.0
    high: float = 0.0
    unit: str = ""
    median: float = 1.0
    sd: float = 0.0  # of the logarithm
    source: str = ""

    def at(self, share: FloatOrArray) -> FloatOrArray:
        """The number below which a share of people lies."""
        if self.sd:
            return self.median * np.exp(self.sd * ndtri(share))
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True)
class Condition:
    """A kind of patients: the initial patient, and the ranges in which they differ."""

    file: pathlib.Path
    description: str
    patient: str
    ranges: Mapping[str, Range]
    patients: int = 20
    seed: int = 1

    @property
    def name(self) -> str:
        """The file's, without its ending."""
        return self.file.stem

    @property
    def middle(self) -> dict[str, float]:
        """The numbers in the middle of all ranges."""
        return {name: float(each.at(0.5)) for name, each in self.ranges.items()}

    def draw(self) -> list[dict[str, float]]:
        """Each patient's numbers, by a Latin hypercube."""
        drawn = draw(self.ranges, self.patients, [self.seed, 7])
        return [{name: float(numbers[k]) for name, numbers in drawn.items()} for k in range(self.patients)]


def draw(ranges: Mapping[str, Range], count: int, seed: Sequence[int]) -> dict[str, np.ndarray]:
    """So many numbers in each range: one in each of as many parts of it that are as probable."""
    rng = np.random.default_rng(seed)
    return {n: each.at((rng.permutation(count) + rng.random(count)) / count) for n, each in ranges.items()}


def read_condition(name: str | os.PathLike[str]) -> Condition:
    """Read a condition: a shipped name, or a path."""
    file = assets.find("population", str(name))
    tables = assets.read_toml(file)
    for key in tables:
        if key not in (known := ("description", "patient", "patients", "seed", "drawn")):
            raise unknown(key, known, file=file, field=key, problem="is not a key of a population")
    patient = str(assets.find("patient", str(tables.get("patient", "healthy")), file))
    drawn, ranges = tables.get("drawn", {}), dict[str, Range]()
    if not isinstance(drawn, Mapping) or not drawn:
        raise InputError("is missing: ranges in which patients differ", file=file, field="drawn")
    for key, table in drawn.items():
        field, own = f"drawn.{key}", key.startswith("patient.") and not key.endswith("_strength")
        if not own and key not in (*SHARES, *FACTORS):
            problem = "is no number in which patients differ"
            raise unknown(key, (*SHARES, *FACTORS), file=file, field=field, problem=problem)
        try:
            ranges[key] = _range(table, key)
        except KeyError as error:
            raise InputError("is missing", file=file, field=f"{field}.{error.args[0]}") from None
        except (TypeError, ValueError) as error:
            allowed = 'from and to, or median and sd, and source: { from = 0.0, to = 0.3, source = "…" }'
            raise InputError(f"is no range: {error}", file=file, field=field, allowed=allowed) from None
        low, high = ends = [float(ranges[key].at(share)) for share in (0.001, 0.999)]
        least, most = FACTORS.get(key, (0.0, 2.0))
        if not own and not least <= low <= high <= most:
            raise InputError("is out of range", file=file, field=field, value=f"{low:g} to {high:g}",
                             allowed=f"{least:g} to {most:g}")  # fmt: skip
        for end in ends if own else ():
            own_key, value = key.removeprefix("patient."), f"{end!r} {ranges[key].unit}".strip()
            try:
                load("patient", patient, {own_key: value})
            except InputError as error:
                raise error.replaced(file=file, field=field) from None
    for key, least, most in (("patients", 1, MOST), ("seed", 0, 2**31)):
        value = tables.get(key, least)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            allowed = f"a whole number from {least} to {most}"
            raise InputError("is out of range", file=file, field=key, value=value, allowed=allowed)
    numbers = tables.get("patients", 20), tables.get("seed", 1)
    return Condition(file, str(tables.get("description", "")), patient, ranges, *numbers)


def _range(table: JsonMapping, key: str) -> Range:
    """A range of a condition's file; of the cuff in its SI unit, of a patient's key in the unit it has."""
    source, lognormal = table["source"], "median" in table
    keys = {"median", "sd", "source"} if lognormal else {"from", "to", "source"}
    if extra := table.keys() - keys:
        raise ValueError(f"{min(extra)} is not one of its keys")
    if not isinstance(source, str) or not source.strip():
        raise ValueError("its source is no text")
    if lognormal:
        median, sd = (parse_quantity(table[name], "") for name in ("median", "sd"))
        if not (0.1 <= median <= 10.0 and 0.0 < sd <= 1.0):
            raise ValueError("its median lies from 0.1 to 10, its sd from 0 to 1")
        return Range(median=median, sd=sd, source=source)
    ends = [_NUMBER.fullmatch(str(table[name])) for name in ("from", "to")]
    low, high = (float(end[1]) if end else math.nan for end in ends)
    units = {end[2] for end in ends if end}
    if key == "cuff":
        low, high = (parse_quantity(table[name], "N/m") for name in ("from", "to"))
        units = {"N/m"}
    if not low <= high < math.inf or len(units) != 1 or ("." not in key and key != "cuff" and units != {""}):
        raise ValueError("its ends are not numbers of one unit, the lower one first")
    return Range(low, high, units.pop(), source=source)


def draw_about(
    scenario: Scenario, own: Mapping[str, float], draws: int, seed: int
) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Patients about a stated one: the corners, itself first; and drawn by what is not known of one."""
    stated = {name: share for name, share in own.items() if name.rpartition("_")[2] not in PLANTARFLEXORS}
    ranges = {name: Range(max(x - NEAR, 0.0), max(min(x + NEAR, 1.0), x)) for name, x in stated.items()}
    stated["plantarflexors"], ranges["plantarflexors"] = (1.0, Range(0.8, 1.0))  # assumed, as all but tissue
    ends = {name: (each.low, each.high) for name, each in ranges.items()}
    ranges["tissue"] = Range(median=math.exp(-0.5 * SPREAD**2), sd=SPREAD)
    ranges |= {"mass": Range(0.9, 1.1), "height": Range(0.95, 1.05)}
    if "shank" in scenario.orthosis.anchor:
        ranges["cuff"] = Range(2e3, 8e3)
    drawn = draw(ranges, draws, [seed, 7])
    stated |= {"tissue": 1.0, "mass": 1.0, "height": 1.0}
    corners = [stated]
    for name, (low, high) in ends.items():
        for end in sorted({low, high, 0.0 if stated[name] < 1.0 else low} - {stated[name]}):
            corners.append(stated | {name: end})
    return corners, [{name: float(numbers[k]) for name, numbers in drawn.items()} for k in range(draws)]


def as_drawn(
    scenario: Scenario,
    own: Mapping[str, float],
    numbers: Mapping[str, float],
    *,
    worn: bool,
    units: Mapping[str, str] | None = None,
) -> tuple[Scenario, dict[str, float]]:
    """A scenario, and the share left of each muscle, of a patient with some numbers."""
    person, patient = person_of(scenario), scenario.patient
    assert patient is not None
    sets: JsonDict = {
        "patient.passive_scale": patient.passive_scale * numbers.get("tissue", 1.0),
        "patient.body_mass": f"{person.body_mass * numbers.get('mass', 1.0)!r} kg",
        "patient.body_height": f"{person.body_height * numbers.get('height', 1.0)!r} m",
    }
    sets |= {key: f"{x!r} {(units or {})[key]}".strip() for key, x in numbers.items() if "." in key}
    if worn and "cuff" in numbers and "shank" in scenario.orthosis.anchor:
        sets["orthosis.anchor.shank.stiffness"] = f"{numbers['cuff']!r} N/m"
    left, whole = dict(own), numbers.get("strength", 1.0)
    for side, name in itertools.product(SIDES, LEG_MUSCLES):
        muscle = f"{side}{name}"
        share = whole * numbers.get(muscle, own.get(muscle, 1.0))
        if name in PLANTARFLEXORS:
            share *= numbers.get(f"{side}plantarflexors", 1.0)
        if share != 1.0 or muscle in left:
            left[muscle] = share
    return (scenario if worn else scenario.set(BARE)).set(sets), left
