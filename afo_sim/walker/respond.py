"""A scenario's patient walks by reflexes, without and with the device, as they are and adapted."""

import dataclasses
import functools
import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import InputError, JsonMapping, Keywords, assets, called, optional, si, unknown
from afo_sim.description import Scenario, load
from afo_sim.physics import LEG_MUSCLES
from afo_sim.simulation import kept
from afo_sim.walker.body import BARE, SIDES, Body, build_body
from afo_sim.walker.gait import OFFSETS, Vector
from afo_sim.walker.gait_file import Gait, read_gait, with_vector
from afo_sim.walker.population import PLANTARFLEXORS, as_drawn, draw_about
from afo_sim.walker.search import STRONGER, SUBSETS, Cost, Found, Free, adapt, identity
from afo_sim.walker.strides import numbers
from afo_sim.walker.walking import TICK, Push, Walked, own_copy, walk_body

TIMESTEP = 0.0005  # at which the walker's numbers are stated [s]
LONGEST = 0.002  # time step at which the walker still walks as at a shorter one [s]
FILLED = 2.0  # time from which on a chamber counts as filled to the supply [s]
NOISE = 0.02  # standard deviation of each angle of a perturbed start [rad]
FROM, UNTIL, HORIZON = 2.5, 4.5, 8.0  # between which a perturbed start is pushed, and how long it walks [s]
# Of what is asked for; shorter walks have too few strides [s], [N].
LIMITS = {"duration": (4.0, 600.0), "push": (0.0, 1000.0), "starts": (0, 1e5), "generations": (0, 1e5)}
LIMITS |= {"seed": (0, 2e9), "others": (0, 100)}
DRAWN_WITH = 12  # drawn patients, beside the corners, whom an adapting gait has to carry too
FIRM = 1.96  # of a 95 % interval


@dataclass(frozen=True)
class Falls:
    """Falls in simulation among perturbed starts. They are never a patient's risk of falling."""

    count: float  # of patients, the sum of their shares
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """Their share's 95 % interval, after Wilson 1927, doi 10.1080/01621459.1927.10502953 [-]."""
        n, share, z = self.of, self.count / self.of, FIRM
        centre = (share + z * z / (2.0 * n)) / (1.0 + z * z / n)
        half = z / (1.0 + z * z / n) * math.sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n))
        return max(centre - half, 0.0), min(centre + half, 1.0)


@dataclass(frozen=True, eq=False)
class Case:
    """One walker: healthy, the patient, the patient with the device; as they are, or adapted."""

    name: str  # such as "patient"
    gait: Gait  # reflexes that it walks by
    walked: Walked  # the walk
    numbers: Mapping[str, float]  # metrics of the walk, by name [SI; angles in degrees]
    falls: Falls | None = None  # among perturbed starts; None where none were tried
    found: Found | None = None  # the search that adapted it; None as it is


@dataclass(frozen=True, eq=False, repr=False)
class Response:
    """How a patient responds to a device in simulation.

    scenario : whose patient and device
    cases : by name
    asked : what it was computed with, by name
    """

    scenario: Scenario
    cases: Mapping[str, Case]
    asked: JsonMapping = field(default_factory=dict)

    def __getitem__(self, case: str) -> Case:
        return self.cases[case]

    def __repr__(self) -> str:
        return called(self, {"scenario": self.scenario.name, "cases": list(self.cases)})


def strengths_of(
    scenario: Scenario, given: Mapping[str, float] | None = None, field: str = "strength"
) -> dict[str, float]:
    """Share left of each muscle that is not whole, by name."""
    patient, known = scenario.patient, [f"{side}{name}" for side in SIDES for name in LEG_MUSCLES]
    found: dict[str, float] = {}
    if patient is not None:
        found["tibialis"] = patient.dorsiflexor_strength
        found |= dict.fromkeys(PLANTARFLEXORS, patient.plantarflexor_strength)
    for name, share in (given or {}).items():
        if name not in known:
            raise unknown(name, known, field=f"{field}.{name}", problem="is not a muscle of the walker")
        if isinstance(share, bool) or not isinstance(share, int | float) or not 0.0 <= share <= 2.0:
            raise InputError("is out of range", field=f"{field}.{name}", value=share, allowed="0 to 2")
        found[name] = float(share)
    return {name: share for name, share in found.items() if share != 1.0}


def check_limits(**asked: float) -> None:
    """Raise InputError if a setting is out of range."""
    for name, value in asked.items():
        least, most = LIMITS[name]
        if not least <= value <= most:
            raise InputError("is out of range", field=name, value=value, allowed=f"{least:g} to {most:g}")


def stronger(left: Mapping[str, float]) -> list[dict[str, float]]:
    """Those through whom a patient's gait is searched for: by a share, and no stronger than healthy."""
    return [{n: max(min(own + share, 1.0), own) for n, own in left.items()} for share in STRONGER]


def prepared(
    scenario: str | os.PathLike[str] | Scenario, sets: Mapping[str, object] | None = None
) -> Scenario:
    """A walking scenario at the walker's time step, unless it is set."""
    read = scenario if isinstance(scenario, Scenario) else load("scenario", scenario, dict(sets or {}))
    if isinstance(scenario, Scenario) and sets:
        read = read.set(sets)
    if not read.walking or read.patient is None:
        allowed = "a scenario with gait and patient, such as walk-dropfoot-afo"
        raise InputError("nobody walks in it", field="scenario", value=read.name, allowed=allowed)
    if "timestep" not in (sets or {}):
        read = read.set({"timestep": f"{1e3 * TIMESTEP:g} ms"})
    if read.timestep > LONGEST or abs(TICK / read.timestep - round(TICK / read.timestep)) > 1e-6:
        allowed = "a whole part of 10 ms, at most 2 ms"
        problem = "is not taken by a responding walker"
        raise InputError(problem, field="timestep", value=read.timestep, allowed=allowed)
    begun = read.start.chambers.items() if read.start is not None else ()
    short = next((name for name, way in begun if (way.fill_time or FILLED) < FILLED), None)
    for key, has, allowed in (
        ("drive", bool(read.drive), "timer, phases, controller"),
        ("sensor", bool(read.sensor), "timer, phases, controller"),
        ("gait.pace", bool(read.gait and read.gait.pace), "[]: its reflexes neither stand, start nor stop"),
        ("load_moment", read.load_moment != 0.0, "0 N·m"),
        ("controller.rate", read.controller is not None and read.controller.rate * TICK != 1.0, "100 Hz"),
        (f"start.{short}.fill_time", short is not None, f"{FILLED:g} s, which fills it, or a pressure"),
    ):
        if has:
            raise InputError("is not taken by a responding walker", field=key, allowed=allowed)
    return read


def walk(
    scenario: str | os.PathLike[str] | Scenario,
    sets: Mapping[str, object] | None = None,
    *,
    gait: str | os.PathLike[str] = "natural",
    adapted: str | os.PathLike[str] | None = None,
    adapted_device: str | os.PathLike[str] | None = None,
    strength: Mapping[str, float] | None = None,
    duration: float | str = 20.0,
    starts: int = 50,
    push: float | str = 50.0,
    generations: int = 0,
    subset: str = "all",
    cost: Cost | None = None,
    seed: int = 0,
    threads: int = 0,
    progress: Callable[[str, float], None] | None = None,
) -> Response:
    """Let a scenario's patient walk by reflexes, without and with its device.

    Parameters
    ----------
    scenario, sets : as of `run`; its recorded walk is not used
    gait : a healthy gait, shipped or a file
    adapted, adapted_device : gaits of the patient without and with the device, found before; where nothing is
        set, those that are shipped for this patient and device
    strength : remaining share of each muscle, on top of the patient's
    duration : of the undisturbed walks [s], or "20 s"
    starts : perturbed starts per case
    push : on the trunk, forward or backward [N], or "50 N"
    generations : of the search by which the patient adapts, 16 walks each; 0: none
    subset : of the gains that adapt, "swing", "stance" or "all"
    cost : that adaptation minimises; by default of the healthy gait's speed and the muscles' effort
    seed : of starts and search
    threads : as many as processors if 0; the result does not depend on them
    progress : called with a case's name and the share done

    Raises
    ------
    InputError
        As in `prepared`, `strengths_of`, `read_gait`; a number is out of range.

    Examples
    --------
    >>> found = walk("walk-dropfoot-afo", duration=4.0, starts=0)
    >>> list(found.cases), found["healthy"].walked.fell
    (['healthy', 'patient', 'patient adapted', 'device', 'device adapted'], None)
    """
    if "duration" in (sets or {}):
        problem, allowed = "is of the recorded walk, which nobody walks here", "the argument `duration`"
        raise InputError(problem, field="duration", value=dict(sets or {})["duration"], allowed=allowed)
    described = prepared(scenario, sets)
    if subset not in SUBSETS:
        raise unknown(subset, SUBSETS, field="subset", problem="is not a set of gains")
    duration, push = si(duration, "s", "duration"), si(push, "N", "push")
    check_limits(duration=duration, push=push, starts=starts, generations=generations, seed=seed)
    shares, healthy = strengths_of(described, strength), read_gait(gait)
    workers = threads or os.cpu_count() or 1
    if generations:
        optional("cma")  # before anybody walks
    if adapted_device is not None and not described.orthosis.muscle:
        raise InputError("no device is worn", field="adapted_device", value=str(adapted_device))
    if not (sets or strength or generations):
        adapted = adapted or _shipped(described)
        adapted_device = adapted_device or _shipped(described, "device")
    known = {n: read_gait(x) for n, x in (("patient", adapted), ("device", adapted_device)) if x is not None}
    bare = described.set(BARE)
    person = described.patient  # whose size a healthy walker beside them has too
    assert person is not None
    sizes = {"body_mass": (person.body_mass, "kg"), "body_height": (person.body_height, "m")}
    same = {f"patient.{key}": f"{x!r} {unit}" for key, (x, unit) in sizes.items() if x is not None}
    whole = bare.set({"patient": "healthy"} | same)
    report = progress or (lambda name, share: None)

    def case(name: str, body: Body, gait: Gait) -> Case:
        report(name, 0.0)
        walked, falls = walk_body(own_copy(body), gait.vector, duration), None
        if starts:
            how: Keywords = {"starts": starts, "push": push, "seed": seed, "threads": workers}
            falls = falls_of(body, gait.vector, report=functools.partial(report, name), **how)
        return Case(name, gait, walked, numbers(walked), falls)

    cases = {"healthy": case("healthy", build_body(whole), healthy)}
    worn = {"patient": bare} | ({"device": described} if described.orthosis.muscle else {})
    target = cost or Cost(healthy.speed, speed=60.0, lean=60.0)
    dead = shares.get("tibialis", 1.0) == 0.0  # its gains change nothing, and would end anywhere
    alive = tuple(name for name in SUBSETS[subset] if not (dead and name.startswith("tibialis")))
    stated = {"tibialis": 1.0} | shares
    corners, unlike = draw_about(described, stated, DRAWN_WITH, seed + 1)
    search: Keywords = {"generations": generations, "seed": seed + 1, "threads": workers}
    for name, wearing in worn.items():
        body = build_body(wearing, shares)
        cases[name] = case(name, body, healthy)
        after = f"{name} adapted"
        if name in known:
            cases[after] = case(after, body, known[name])
        elif generations:
            on = name == "device"
            others = [build_body(*as_drawn(described, stated, one, worn=on)) for one in corners + unlike]
            stages = [*([build_body(wearing, left)] for left in stronger(shares)), [body]]
            search["drawn"] = others
            search["progress"] = lambda k, n, _: report(after, k / n)  # noqa: B023 - called before the loop goes on
            found = adapt(stages, healthy.vector, target, Free(alive, pose=subset == "all"), **search)
            how = {"evaluations": found.evaluations, "cost": round(sum(found.parts.values()), 4)}
            how |= {"converged": found.converged}
            begun = with_vector(healthy, found.vector, after, f"{after}, {described.name}", how)
            cases[after] = dataclasses.replace(case(after, body, begun), found=found)
    asked = {"gait": healthy.name, "strength": shares, "starts": starts, "push": push, "seed": seed}
    asked |= {"generations": generations, "subset": subset, "timestep": described.timestep}
    return Response(described, cases, asked)


def _shipped(scenario: Scenario, worn: str = "") -> str | None:
    """The shipped gait to which a patient has adapted, by their name, with a device by its name too."""
    assert scenario.patient is not None
    one = bool(scenario.orthosis.muscle) and scenario.worn_on == "one"
    device = scenario.orthosis.name if one else None
    name = f"{scenario.patient.name}-{device}" if worn else scenario.patient.name
    return name if name in assets.names("walker") and (device or not worn) else None


def falls_of(
    body: Body,
    gait: Vector,
    *,
    starts: int,
    push: float = 50.0,
    seed: int = 0,
    threads: int = 2,
    report: Callable[[float], None] = lambda share: None,
) -> Falls:
    """Falls among starts whose pose is drawn about the gait's, with one push each at a drawn moment."""

    def walked(k: int) -> bool:
        draw = np.random.default_rng([seed, k])
        noise = draw.normal(0.0, NOISE, len(OFFSETS))
        pushes = (Push(float(draw.uniform(FROM, UNTIL)), push * float(draw.choice([-1.0, 1.0]))),)
        return walk_body(own_copy(body), gait, HORIZON, pushes, noise, rows=False).fell is not None

    whose = functools.cache(lambda: (identity(body), gait, push, seed))

    count = 0
    with ThreadPoolExecutor(max(threads, 1)) as pool:
        falls = pool.map(lambda k: kept(lambda: ("start", k, whose()), lambda: walked(k)), range(starts))
        for k, fallen in enumerate(falls, 1):
            count += fallen
            report(k / starts)
    return Falls(count, starts)
