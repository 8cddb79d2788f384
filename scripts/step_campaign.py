"""Random legal designs, each beside an eighth of its time step: numbers that are off, and whether it is said.

A design is silent where a number of a controlled run is off by more than it may be and its warning does not
name it; beside it stands what a run at the asked step is off by. Designs are written as they are found, so
that a campaign goes on where it was stopped.

    python scripts/step_campaign.py OUT.jsonl [--designs 300] [--first 0] [--processes 2] [--most-silent N]
"""

import argparse
import collections
import functools
import json
import math
import pathlib
import sys
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

import afo_sim as afo
from afo_sim.common import InputError, assets, with_code
from afo_sim.model import as_run
from afo_sim.simulation import STEP_STUDY, at_step, described, step_errors

SCENARIOS = ("seated", "walk-dropfoot-afo", "walk-dropfoot-afo contact", "walk-dropfoot-afo both", "knee")
DEFAULTS = {"seated": 2.0, "walk-dropfoot-afo": 1.0, "knee": 1.0}  # [ms]
STEPS = (0.3, 0.5, 0.7, 1.0, 1.3, 1.5, 2.0, 2.4, 3.0)  # [ms]
ANKLE = {"dorsiflexor": 0.310, "plantarflexor": 0.330}  # between S1's anchors [m]
KNEE = {"flexor": 0.590}  # between the pin knee's at rest [m]
ANCHORS = (("shank", "foot"), ("proximal", "distal"))
FINER = 8  # times as many steps as asked, of the run that is believed
Draw = np.random.Generator
Sets = dict[str, Any]


@dataclass(frozen=True)
class Outcome:
    """What came of a design: "refused", "failed", "within", "warned" or "silent".

    step, taken : asked, and taken by the control [ms]; default : whether the first is the scenario's own
    beyond : {metric: times its bound} of the controlled run, null where one run alone defines it
    fixed : the same of the run at the asked step
    named : metrics that the controlled run's warning names
    why : it was refused or failed
    """

    seed: int
    kind: str
    step: float
    default: bool
    outcome: str
    taken: float = 0.0
    beyond: dict[str, float | None] = field(default_factory=dict)
    fixed: dict[str, float | None] = field(default_factory=dict)
    named: list[str] = field(default_factory=list)
    why: str = ""


def spread(draw: Draw, low: float, high: float, none: float = 0.0) -> float:
    """Evenly over the decades, and with a probability nothing."""
    return 0.0 if draw.random() < none else float(10.0 ** draw.uniform(math.log10(low), math.log10(high)))


@functools.cache
def muscle(name: str) -> Any:
    """A shipped muscle."""
    return afo.load("muscle", name)


def group(draw: Draw, name: str, path: float, networked: bool) -> Sets:
    """Muscles, cable, valves, tube and wall of one side, on a path of a length [m]."""
    kind = str(draw.choice(assets.names("muscle")))
    own = muscle(kind)
    length = own.total_length
    if draw.random() < 0.5:
        least = 0.0 if own.lengths is None else own.lengths.shortest
        length = float(draw.uniform(max(0.08, own.end_length + 0.03, least), 0.30))
    at, air = f"orthosis.muscle.{name}", f"orthosis.chamber.{name}"
    sets: Sets = {
        f"{at}.type": kind,
        f"{at}.type.law": str(draw.choice([*own.laws])),
        f"{at}.type.friction": str(draw.choice(["none", "none", *own.frictions])),
        f"{at}.type.total_length": f"{length} m",
        f"{at}.count": int(draw.integers(1, 6)),
        f"{at}.link_length": f"{max(path - length + draw.uniform(-0.02, 0.02), 0.0)} m",
        f"{at}.cable.stiffness": f"{spread(draw, 1e4, 1e7)} N/m",
        f"{air}.wall_conductance": f"{spread(draw, 0.01, 100.0, 0.15)} W/K",
    }
    if draw.random() < 0.5:
        sets[f"{at}.type.bore"] = f"{spread(draw, 0.005, 0.04)} m"
    if draw.random() < 0.5:
        sets[f"{at}.type.damping"] = f"{spread(draw, 1e-8, 5e-3, 0.15)} m^2*s"
    if networked:
        sets[f"{air}.tube"] = str(draw.choice(assets.names("tube")))
        sets[f"{air}.tube_length"] = f"{spread(draw, 0.2, 2.0)} m"
    else:
        sets[f"{air}.tube_volume"] = f"{spread(draw, 1e-6, 1e-3, 0.15)} m^3"
    catalogue = draw.random() < 0.5
    for valve in ("inlet", "outlet"):
        if catalogue:
            sets[f"{air}.{valve}"] = str(draw.choice(assets.names("valve")))
        else:
            sets[f"{air}.{valve}.conductance"] = f"{5.5e-10 * spread(draw, 0.1, 10.0)} m^3/(s*Pa)"
    return sets


def mounting(draw: Draw, names: Sequence[str]) -> Sets:
    """Cuff and plate: rigid, linear or stiffening, soft and hard, damped or not."""
    found: Sets = {}
    for name in names:
        kind = draw.random()
        if kind < 0.15:
            continue
        law: Sets = {"stiffness": f"{spread(draw, 5e2, 1e7)} N/m"}
        if kind > 0.6:
            a, x0 = spread(draw, 5.0, 200.0), spread(draw, 0.002, 0.03)
            law = {"stiffening": {"force": f"{a} N", "length": f"{x0} m"}}
        damped = {"damping": f"{spread(draw, 0.01, 2000.0)} N*s/m"} if draw.random() < 0.5 else {}
        found[name] = law | damped
    return found


def air(draw: Draw, networked: bool) -> Sets:
    """What feeds the chambers: endless or finite, through a regulator, manifold, reservoir and tube."""
    sets: Sets = {"supply.pressure": f"{draw.uniform(0.5, 8.0)} bar"}
    if draw.random() < 0.25:
        sets["supply.source"] = str(draw.choice(assets.names("source")))
    if networked:
        sets["orthosis.volume.manifold.volume"] = f"{spread(draw, 1e-6, 1e-3)} m^3"
        sets["orthosis.restriction.feed.length"] = f"{spread(draw, 0.1, 2.0)} m"
        sets["orthosis.restriction.feed.tube"] = str(draw.choice(assets.names("tube")))
        if draw.random() < 0.4:
            sets["supply.regulator"] = str(draw.choice(assets.names("regulator")))
            sets["supply.line_pressure"] = f"{draw.uniform(6.0, 10.0)} bar"
    return sets


def design(seed: int) -> tuple[str, Sets]:
    """The scenario and what it sets."""
    draw = np.random.default_rng(seed)
    kind = str(draw.choice(SCENARIOS))
    scenario, networked = kind.split(" ")[0], bool(draw.random() < 0.3)
    paths = KNEE if scenario == "knee" else ANKLE
    networked = networked and scenario != "knee"
    own = bool(draw.random() < 0.5)
    step = DEFAULTS[scenario] if own else float(draw.choice(STEPS))
    sets: Sets = {"orthosis": "s1_waist"} if networked else {}
    sets |= {"timestep": f"{step} ms"} | air(draw, networked)
    if scenario in ("seated", "knee"):
        period, share = draw.uniform(0.6, 2.0), draw.uniform(0.2, 0.8)
        spans = [["0 s", f"{share * period} s"]], [[f"{share * period} s", f"{period} s"]]
        sets["duration"] = f"{period * draw.uniform(1.0, 3.0):.3f} s"
        sets["timer"] = {"period": f"{period} s"}
        for k, name in enumerate(paths):
            sets["timer"][name] = {"inlet": spans[k], "outlet": spans[1 - k]}
    else:
        sets["duration"] = f"{draw.uniform(2.4, 5.0):.3f} s"
        sets |= {"patient.body_mass": f"{draw.uniform(40.0, 120.0)} kg"}
        sets |= {"patient.body_height": f"{draw.uniform(1.4, 2.0)} m"}
        sets |= {"gait.settled": "walked"} if draw.random() < 0.3 else {}
        sets |= {"ground.mode": "contact"} if kind.endswith("contact") else {}
    for name, path in paths.items():
        sets |= group(draw, name, path, networked)
    return kind, sets | {"orthosis.anchor": mounting(draw, ANCHORS[scenario == "knee"])}


def examined(seed: int) -> Outcome:
    """Run a design, or one of each leg, with its step controlled, at its step, and at an eighth of it."""
    kind, sets = design(seed)
    step = float(sets["timestep"].split(" ")[0])
    begun = functools.partial(Outcome, seed, kind, step, step == DEFAULTS[kind.split(" ")[0]])
    taken, beyond, fixed, named = step, dict[str, float | None](), dict[str, float | None](), list[str]()
    try:
        scenario = afo.load("scenario", kind.split(" ")[0], sets)
        weaker = {"patient.dorsiflexor_strength": np.random.default_rng(seed).uniform(0.0, 0.5)}
        legs = described(scenario, None, left_sets=weaker) if kind.endswith("both") else (scenario,)
        for leg in legs:
            runs = [afo.run(leg, step="controlled"), afo.run(leg, step="fixed")]
            runs.append(afo.run(at_step(leg, as_run(leg).timestep / FINER), step="fixed"))
            if not all(run.ok for run in runs):
                return begun("failed", why="; ".join(run.status for run in runs))
            beyond, fixed = beyond | _beyond(runs[0], runs[2]), fixed | _beyond(runs[1], runs[2])
            named += [n for w in with_code(runs[0].warnings, "step-matters") for n in w.data["names"]]
            if with_code(runs[0].warnings, "strides-unsettled"):
                named += beyond  # no stride repeats, whose numbers these were
            taken = min(taken, 1e3 * float(runs[0].studies[STEP_STUDY]["step"]))
    except InputError as error:
        return begun("refused", why=str(error))
    outcome = "silent" if beyond.keys() - {*named} else "warned" if named else "within"
    return begun(outcome, taken, beyond, fixed, named)


def _beyond(run: afo.Recording, fine: afo.Recording) -> dict[str, float | None]:
    """Metrics beyond their bounds, as times these."""
    errors = step_errors(run.metrics, fine.metrics)
    return {n: e.times if math.isfinite(e.times) else None for n, e in errors.items() if e.times > 1.0}


def campaign(out: pathlib.Path, seeds: Sequence[int], processes: int) -> list[Outcome]:
    """Examine designs, and write each as it is found; those that a file holds already are read from it."""
    lines = out.read_text(encoding="utf-8").splitlines() if out.exists() else []
    known = {row["seed"]: Outcome(**row) for row in map(json.loads, lines)}
    missing = [seed for seed in seeds if seed not in known]
    with ProcessPoolExecutor(processes) as pool, out.open("a", encoding="utf-8") as file:
        for found in pool.map(examined, missing):
            known[found.seed] = found
            file.write(json.dumps(asdict(found)) + "\n")
            file.flush()
    return [known[seed] for seed in seeds]


def report(found: list[Outcome]) -> Iterator[str]:
    """Counts, at the default step and at others; what was warned of without need; the silent designs."""
    for title, rows in (
        ("default step", [each for each in found if each.default]),
        ("other steps", [each for each in found if not each.default]),
    ):
        counts = collections.Counter(each.outcome for each in rows)
        ran = [each for each in rows if each.outcome in ("within", "warned", "silent")]
        needless = sum(not each.beyond for each in ran if each.outcome == "warned")
        off, halved = (
            sum(bool(each.fixed) for each in ran),
            sum(each.taken < 0.99 * each.step for each in ran),
        )
        yield f"{title}: {len(rows)} designs: " + ", ".join(f"{n} {what}" for what, n in counts.items())
        yield f"  {halved} halved, {needless} warned without need; without control {off} would be off"
    for each in found:
        if each.outcome in ("silent", "warned"):
            about = each.beyond if each.outcome == "silent" else each.named
            yield f"{each.outcome}: seed {each.seed}, {each.kind}, {each.step:g} ms: {', '.join(about)}"


def main() -> None:
    """Command line."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="JSON lines, one a design; it goes on with them")
    parser.add_argument("--designs", type=int, default=300)
    parser.add_argument("--first", type=int, default=0, help="seed of the first design")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--most-silent", type=int, help="exit with 1 where more designs are silent")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.designs)
    found = campaign(asked.out, seeds, asked.processes)
    print("\n".join(report(found)))
    if asked.most_silent is not None and sum(each.outcome == "silent" for each in found) > asked.most_silent:
        sys.exit(1)


if __name__ == "__main__":
    main()
