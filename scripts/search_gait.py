"""Search a healthy gait as the shipped ones were: for a speed, from a gait that walks, by several seeds.

    python scripts/search_gait.py natural --speed 1.4 --generations 100 --seeds 5 --out brisk

It walks in the shipped scenario's shoes and is pushed. Beside it walks one in each generation who is weak on
one side: 15 to 100 % of the tibialis is left, 80 to 100 % of the plantarflexors, 85 to 100 % of all others.
The folder gets a gait for each seed, a table, and the best gait under its name. The same command goes
on after a kill.

The best, by a rule older than the searches: of those that fall neither in 12 walks whose pushes no generation
had, nor in 20 s undisturbed at 0.5 ms, the one whose mean cost in those pushed walks is least.
"""

import argparse
import dataclasses
import os
import pathlib
import shutil
import sys
from typing import Any

import numpy as np

from afo_sim.common import write_text
from afo_sim.model import UNDRIVEN
from afo_sim.physics import LEG_MUSCLES
from afo_sim.simulation import occupy, released
from afo_sim.walker import Cost, Free, build_body, prepared, read_gait, search, walk_body, write_gait
from afo_sim.walker.gait_file import with_vector

LIKENESS, WEAK = 80.0, 24  # weight of the likeness to people, and how many weak ones
STEP, FINE, UNDISTURBED = {"timestep": "1 ms"}, {"timestep": "0.5 ms"}, 20.0


def weakened() -> list[dict[str, float]]:
    """Strength left of each muscle of the weak ones, most often little of the tibialis."""
    draw, found = np.random.default_rng(12), []
    for k in range(WEAK):
        left = {name: float(draw.uniform(0.85, 1.0)) for name in LEG_MUSCLES}
        left |= {name: float(draw.uniform(0.8, 1.0)) for name in ("soleus", "gastrocnemius")}
        found.append(left | {"tibialis": 0.15 + 0.85 * (k / (WEAK - 1)) ** 2})
    return found


def searched(given: argparse.Namespace, seed: int) -> dict[str, Any]:
    """Search with a seed, write its gait, and say what it came to."""
    device = prepared("walk-dropfoot-afo", STEP | {"patient": "healthy"})
    shod = device.set({**UNDRIVEN, "orthosis": "none"})
    begun, weak = read_gait(given.gait), [build_body(shod, each) for each in weakened()]
    found = search(
        [build_body(shod)],
        begun.vector,
        Cost(given.speed, likeness=LIKENESS),
        Free(alike=True),
        drawn=weak,
        generations=given.generations,
        seed=seed,
        threads=given.threads,
        spread=given.spread,
        progress=lambda k, n, best: print(f"seed {seed}, {k} of {n}: {best:.2f}", file=sys.stderr),
    )
    cost, words = round(sum(found.parts.values()), 3), f"healthy, searched for {given.speed:g} m/s"
    how = {"seed": seed, "cost": cost, "evaluations": found.evaluations, "converged": found.converged}
    gait = with_vector(dataclasses.replace(begun, speed=given.speed), found.vector, "", words, how)
    write_gait(given.out / f"seed_{seed}.toml", gait)
    quiet = walk_body(build_body(shod.set(FINE)), found.vector, UNDISTURBED, rows=False)
    parts = {name: round(value, 3) for name, value in found.parts.items()}
    falls = {"fell_pushed": found.walked.fell is not None, "fell_undisturbed": quiet.fell is not None}
    return how | parts | falls | {"cpu_minutes": round(found.seconds / 60.0, 2)}


def main() -> None:
    """Search, say how it goes, and write gaits and their table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("gait", help="where the search begins: a shipped gait, or a file")
    parser.add_argument("--speed", type=float, required=True, help="m/s")
    parser.add_argument("--generations", type=int, default=100, help="of 16 gaits")
    parser.add_argument("--spread", type=float, default=0.05, help="first standard deviation over the value")
    parser.add_argument("--seeds", type=int, default=5, help="searches, from 1 on")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="the gaits do not depend on them")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder")
    given = parser.parse_args()
    with released():
        if said := occupy(given.out, sys.argv[1:]):
            print(said, file=sys.stderr)
        rows = [searched(given, seed) for seed in range(1, given.seeds + 1)]
    table = "\n".join(",".join(map(str, row)) for row in (rows[0], *(row.values() for row in rows))) + "\n"
    write_text(given.out / "seeds.csv", table)
    standing = [row for row in rows if not (row["fell_pushed"] or row["fell_undisturbed"])]
    if not standing:
        sys.exit(f"{table}no seed's gait stands: more generations, or another gait to begin at")
    best = min(standing, key=lambda row: row["cost"])["seed"]
    shutil.copyfile(given.out / f"seed_{best}.toml", given.out / f"{given.out.resolve().name}.toml")
    print(f"{table}the best is seed {best}")


if __name__ == "__main__":
    main()
