"""A population walks: each patient without the device, with it on the first day, and after weeks."""

import csv
import json
import math
import os
import pathlib
import re
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import InputError, JsonDict, as_stored, called, check_text, digest, optional, read_text
from afo_sim.common.versions import PACKAGE
from afo_sim.description import Scenario
from afo_sim.physics import GAINS
from afo_sim.simulation import kept
from afo_sim.walker.body import SIDES, Body, build_body
from afo_sim.walker.bounds import LEAST, MOST
from afo_sim.walker.cost import Cost
from afo_sim.walker.gait import OFFSETS, Vector
from afo_sim.walker.gait_file import STARTS, read_gait
from afo_sim.walker.population import SHARES, Condition, as_drawn, draw_about, read_condition
from afo_sim.walker.respond import DRAWN_WITH, Falls, check_limits, falls_of, prepared, strengths_of, stronger
from afo_sim.walker.search import Free, adapt, identity, search
from afo_sim.walker.strides import numbers, strides_of
from afo_sim.walker.walking import walk_body

WITHOUT, DEVICE, SPRING = "without", "device", "spring"
WEEKS = " adapted"  # behind a case's name
TIMESTEP = {"timestep": "1 ms"}
HEALTHY = "natural"  # the gait that everybody had
OTHERS = 10**6  # seed of those who are drawn to judge, beyond that of any search
LEVEL = {"ground.slope": "0 deg", "ground.uneven": "0 mm"}
STIFFEST = 500.0  # spring about the ankle [N·m/rad]: 8.7 N·m/deg, the stiffest of Waterval et al. 2023
OWN = "patients.csv of a walk of the same patients"
DIGITS = 7  # of a gait's numbers, in memory as in a file
# Of a scenario, what tells one device from another; and how what is worn is written in a file.
_DEVICE = ("orthosis", "worn_on", "supply", "start", "phases", "timer", "controller")
_WORN = re.compile(r"(nothing|spring of [\d.e+]+ N\*m/rad|.+ [\da-f]{8}) in .+ on .+")
_SEARCH = ("seed", "generations", "cost", "converged", "cpu_seconds")
_GAIT = ("speed", *OFFSETS, *(f"{side}{name}" for side in SIDES for name in GAINS))


@dataclass(frozen=True, eq=False)
class Adapted:
    """The gait that a patient has adapted to, and how it was found."""

    vector: Vector
    search: Mapping[str, str]


Gaits = dict[tuple[str, int], Adapted]  # by what is worn, and the patient's number from 0 on


@dataclass(frozen=True, eq=False)
class Patient:
    """A patient in a case: numbers undisturbed, falls, mean curves by "right/ankle" [rad] (101,)."""

    numbers: Mapping[str, float]
    falls: Falls
    curves: Mapping[str, np.ndarray]  # none where there are no strides


@dataclass(frozen=True, eq=False, repr=False)
class Population:
    """How the patients of a condition respond to a device, or to a spring in its place."""

    scenario: Scenario
    middle: Scenario  # of the patient in the middle of all ranges
    condition: Condition
    drawn: list[dict[str, float]]  # each patient's numbers
    cases: Mapping[str, tuple[Patient, ...]]  # "without", "device", "device adapted", …
    others: Mapping[str, Mapping[str, tuple[Patient, ...]]]  # who differ, by case and how; they keep the gait
    gaits: Gaits  # those that are known
    asked: JsonDict = field(default_factory=dict)

    def __getitem__(self, case: str) -> tuple[Patient, ...]:
        return self.cases[case]

    def __repr__(self) -> str:
        return called(self, {"condition": self.condition.name, "cases": list(self.cases)})

    def values(self, case: str, name: str) -> np.ndarray:
        """A number of each patient (n,), or the share of "falls"; NaN where it has no strides, no starts."""
        if name == "falls":
            falls = [each.falls for each in self.cases[case]]
            return np.array([each.count / each.of if each.of else math.nan for each in falls])
        return np.array([each.numbers.get(name, math.nan) for each in self.cases[case]])


def populate(
    scenario: str | os.PathLike[str] | Scenario,
    sets: Mapping[str, object] | None = None,
    *,
    patients: str | os.PathLike[str],
    spring: float | None = None,
    gaits: str | os.PathLike[str] | None = None,
    known: Mapping[tuple[str, int], Adapted] | None = None,
    duration: float = 10.0,
    starts: int = 2,
    push: float = 50.0,
    generations: int = 0,
    others: int = 0,
    seed: int = 0,
    threads: int = 2,
    progress: Callable[[str, float], None] | None = None,
) -> Population:
    """Let a condition's patients walk without a device, with it on the first day, and after weeks.

    `gaits` is by default the file beside the condition's, `known` goes beyond it; `others` are drawn about
    each patient and keep the gait; the result does not depend on `threads`.
    `spring` [N·m/rad], `duration` [s], `push` [N]; `generations` of searches, of 16 walks each.
    """
    condition = read_condition(patients)
    if own := next((key for key in sets or {} if key.partition(".")[0] == "patient"), None):
        allowed = "a condition that draws it, or one patient alone"
        raise InputError("is the condition's", field=own, value=str((sets or {})[own]), allowed=allowed)
    described = prepared(scenario, {**TIMESTEP, **(sets or {})}).set({"patient": condition.patient})
    asked: JsonDict = {"duration": duration, "starts": starts, "push": push, "seed": seed}
    asked |= {"generations": generations}
    check_limits(**asked, others=others)
    if spring is not None and not 0.0 < spring <= STIFFEST:
        allowed = f"above 0 to {STIFFEST:g} N*m/rad"
        raise InputError("is out of range", field="spring", value=spring, allowed=allowed)
    report = progress or (lambda name, share: None)
    shoe = "bare feet" if described.shoe is None else described.shoe.name
    foot, floor = f"in {shoe} on {described.leg.name}", described.ground
    worn = {WITHOUT: f"nothing {foot}"}
    if floor is not None and (floor.slope or floor.uneven):  # who adapted to the level knows the level alone
        foot += f" at {floor.slope:.4g} rad and {1e3 * floor.uneven:.4g} mm"
    if described.orthosis.muscle:
        worn[DEVICE] = f"{device_key(described)} {foot}"
    if spring is not None:
        worn[SPRING] = f"spring of {spring:g} N*m/rad {foot}"
    who = Who(described, condition, condition.draw(), spring or 0.0)
    beside = condition.file.with_suffix(".csv")
    read = read_gaits(gaits or beside, who.drawn) if gaits or beside.is_file() else {}
    known = read | dict(known or {})
    if generations:
        optional("cma")  # before anybody walks
        how = {"generations": generations, "seed": seed, "threads": threads}
        _let_adapt(who, worn, known, how, report)
    healthy, jobs = read_gait(HEALTHY).vector, dict[str, list[tuple[str, Vector]]]()
    people = range(len(who.drawn))
    for case, key in worn.items():
        now = [known[worn[WITHOUT], k].vector if (worn[WITHOUT], k) in known else healthy for k in people]
        jobs[case] = [(case, vector) for vector in now]
        if case != WITHOUT and all((key, k) in known for k in people):
            jobs[case + WEEKS] = [(case, known[key, k].vector) for k in people]

    def one(job: tuple[int, tuple[str, Vector]], other: Body | None = None) -> Patient:
        k, (case, vector) = job
        body = other or who.body(case, k)
        whose = (vector, k, duration, starts, push, seed)
        return kept(lambda: (*whose, identity(body)), lambda: walks(k, body, vector))

    def walks(k: int, body: Body, vector: Vector) -> Patient:
        walked = walk_body(body, vector, duration)
        falls = falls_of(body, vector, starts=starts, push=push, seed=1000 * seed + k, threads=1)
        curves = {
            f"{side}/{name}": strides.mean(name)
            for side, strides in ((side, strides_of(walked, side)) for side in ("right", "left"))
            for name in (("thigh", "knee", "ankle") if len(strides.duration) else ())
        }
        return Patient(numbers(walked), falls, curves)

    cases = dict[str, tuple[Patient, ...]]()
    with ThreadPoolExecutor(max(threads, 1)) as pool:
        for at, (name, job) in enumerate(jobs.items()):
            done = list[Patient]()
            for each in pool.map(one, enumerate(job)):
                done.append(each)
                report(name, (at + len(done) / len(job)) / len(jobs))
            cases[name] = tuple(done)
        unlike = dict[str, dict[str, tuple[Patient, ...]]]()
        for name, job in jobs.items() if others else ():
            groups = dict[str, list[Future[Patient]]]()
            for k, walker in enumerate(job):
                for what, body in who.unlike(walker[0], k, OTHERS + k, others):
                    groups.setdefault(what, []).append(pool.submit(one, (k, walker), body))
            unlike[name] = {what: tuple(each.result() for each in group) for what, group in groups.items()}
            report(f"others, {name}", len(unlike) / len(jobs))
    unadapted = sum((worn[WITHOUT], k) not in known for k in people)
    asked |= {"timestep": described.timestep, "worn": worn, "spring": spring, "unadapted": unadapted}
    middle, left = who.person(condition.middle, worn=True)
    shares = {"dorsiflexor": left.get("tibialis", 1.0), "plantarflexor": left.get("soleus", 1.0)}
    recorded: JsonDict = {f"patient.{name}_strength": min(share, 1.0) for name, share in shares.items()}
    recorded |= {"worn_on": "one"} | ({} if middle.ground is None else LEVEL)  # as the recorded walk is
    middle = middle.set(recorded)
    return Population(described, middle, condition, who.drawn, cases, unlike, known, asked)


def device_key(scenario: Scenario) -> str:
    """A device's name and a mark of all that it is and does, by which gaits are adapted to it."""
    kept = {key: value for key, value in scenario.resolved().items() if key in _DEVICE}
    text = json.dumps(as_stored(kept, PACKAGE), sort_keys=True)
    return f"{scenario.orthosis.name} {digest(text.encode())[:8]}"


@dataclass(frozen=True, eq=False)
class Who:
    """The patients, and what they wear."""

    scenario: Scenario
    condition: Condition
    drawn: list[dict[str, float]]
    spring: float

    def person(self, numbers: Mapping[str, float], *, worn: bool) -> tuple[Scenario, dict[str, float]]:
        """The scenario, and what is left of each muscle, of a patient with some numbers."""
        units = {name: each.unit for name, each in self.condition.ranges.items()}
        return as_drawn(self.scenario, strengths_of(self.scenario), numbers, worn=worn, units=units)

    def body(self, case: str, k: int) -> Body:
        """A patient's body in a case."""
        return self._built(case, *self.person(self.drawn[k], worn=case == DEVICE))

    def unlike(self, case: str, k: int, seed: int, draws: int = DRAWN_WITH) -> list[tuple[str, Body]]:
        """Others by what they differ in: corners, and drawn about a patient by what is not known of one."""
        scenario, left = self.person(self.drawn[k], worn=True)
        named = {name: left.get(name, 1.0) for name in ("tibialis", *self.condition.ranges) if name in SHARES}
        corners, others = draw_about(scenario, named, draws, seed)
        names = ["as the patient"]
        for one in corners[1:]:
            name = next(name for name, share in corners[0].items() if one[name] != share)
            names.append(
                f"{'no' if not one[name] else 'less' if one[name] < corners[0][name] else 'more'} {name}"
            )
        names += ["drawn"] * draws
        each = [as_drawn(scenario, left, one, worn=case == DEVICE) for one in corners + others]
        return [(name, self._built(case, *one)) for name, one in zip(names, each, strict=True)]

    def _built(self, case: str, scenario: Scenario, left: dict[str, float]) -> Body:
        return build_body(scenario, left, self.spring if case == SPRING else 0.0)


def _let_adapt(
    who: Who,
    worn: Mapping[str, str],
    known: Gaits,
    how: Mapping[str, int],
    report: Callable[[str, float], None],
) -> None:
    """Search for each patient's gait in each case where none is known; without a device first."""
    healthy = read_gait(HEALTHY)
    missing = [(case, k) for case in worn for k in range(len(who.drawn)) if (worn[case], k) not in known]
    cost, free = Cost(healthy.speed, speed=60.0, lean=60.0), Free()
    asked: JsonDict = {"cost": cost, "free": free, "threads": how["threads"]}
    asked |= {"generations": how["generations"], "seed": how["seed"] + 1}
    first = healthy.vector
    if any(case == WITHOUT for case, _ in missing):  # one in the middle of all ranges goes ahead
        scenario, left = who.person(who.condition.middle, worn=False)
        stages = [[build_body(scenario, each)] for each in (*stronger(left), left)]
        everybody = [who.body(WITHOUT, k) for k in range(len(who.drawn))]
        how_first = asked | {"generations": 2 * how["generations"]}
        how_first["progress"] = lambda k, n, _: report("a first patient adapts", k / n)
        first = adapt(stages, first, drawn=everybody, **how_first).vector
    for at, (case, k) in enumerate(missing):
        begun = known[worn[WITHOUT], k].vector if case != WITHOUT else first
        found = search(
            [who.body(case, k)],
            begun,
            drawn=[body for _, body in who.unlike(case, k, 1000 * how["seed"] + k + 1)],
            progress=lambda n, of, _: report(f"patients adapt, {case}", (at + n / of) / len(missing)),  # noqa: B023
            **asked,
        )
        price, converged = f"{sum(found.parts.values()):.4f}", str(found.converged).lower()
        words = (str(how["seed"]), str(how["generations"]), price, converged, f"{found.seconds:.1f}")
        known[worn[case], k] = Adapted(rounded(found.vector), dict(zip(_SEARCH, words, strict=True)))


def rounded(vector: Vector) -> Vector:
    """A gait to the digits that a file has."""
    return unpacked([f"{x:.{DIGITS}g}" for x in packed(vector)])


def packed(vector: Vector) -> list[float]:
    """A gait's numbers, as in a file."""
    return [float(x) for x in (vector.speed, *vector.offsets, *vector.gains.ravel())]


def unpacked(cells: list[str]) -> Vector:
    """The gait of some numbers; ValueError where one is out of its bounds."""
    speed, *rest = map(float, cells)
    offsets, gains = np.array(rest[: len(OFFSETS)]), np.array(rest[len(OFFSETS) :]).reshape(len(SIDES), -1)
    low, high = STARTS["speed"]
    spans = (LEAST.offsets, offsets, MOST.offsets), (LEAST.gains, gains, MOST.gains), (low, speed, high)
    if not all(np.all((low <= x) & (x <= high)) for low, x, high in spans):
        raise ValueError("a number of the gait is out of bounds")
    return Vector(offsets, gains, speed)


def gaits_table(population: Population) -> str:
    """The adapted gaits of a population as CSV: who the patient is, how it was found, the gait."""
    names = list(population.condition.ranges)
    lines = [",".join(("worn", "patient", *names, *_SEARCH, *(f"gait {name}" for name in _GAIT)))]
    for (worn, k), each in population.gaits.items():
        who = [f"{population.drawn[k][name]:.6g}" for name in names]
        gait = [f"{x:.{DIGITS}g}" for x in packed(each.vector)]
        found = (each.search.get(key, "") for key in _SEARCH)
        lines.append(",".join((worn, str(k + 1), *who, *found, *gait)))
    return "\n".join(lines) + "\n"


def read_gaits(file: str | os.PathLike[str], drawn: list[dict[str, float]]) -> Gaits:
    """The adapted gaits of a file, for the drawn patients."""
    path = pathlib.Path(file)
    if not path.is_file():
        raise InputError("there is no such file of adapted gaits", file=path, allowed=OWN)
    rows = csv.DictReader(check_text(read_text(path), path).strip().splitlines(), restval="")
    if not {"worn", "patient"} <= {*(rows.fieldnames or ())}:
        raise InputError("has no columns `worn` and `patient`", file=path, allowed=OWN)
    found: Gaits = {}
    for line, row in enumerate(rows, 2):
        try:
            k = int(row["patient"]) - 1
            if not 0 <= k < len(drawn) or not _WORN.fullmatch(row["worn"]) or (row["worn"], k) in found:
                raise ValueError("another patient, worn thing, or one that is there already")
            vector = unpacked([row[f"gait {name}"] for name in _GAIT])
            others = [n for n, x in drawn[k].items() if not math.isclose(float(row[n]), x, rel_tol=1e-5)]
        except (KeyError, ValueError) as error:
            problem = f"line {line} is no adapted gait of one of {len(drawn)} patients: {str(error)[:100]}"
            raise InputError(problem, file=path, allowed=OWN) from None
        if others:
            problem = f"patient {k + 1} of line {line} has another {others[0]} than is drawn"
            raise InputError(problem, file=path, allowed=OWN)
        found[row["worn"], k] = Adapted(vector, {key: row.get(key) or "" for key in _SEARCH})
    return found
