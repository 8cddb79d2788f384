"""Search a healthy gait as the shipped ones were: for a speed, from a gait that walks.

    python scripts/search_gait.py natural --speed 1.4 --generations 100 --out brisk.toml

It walks in the shipped scenario's shoes, once pushed, once with half a tibialis, once with the device on.
"""

import argparse
import dataclasses
import pathlib
import sys

from afo_sim.model import UNDRIVEN
from afo_sim.walker import Cost, Free, build_body, prepared, read_gait, search, write_gait
from afo_sim.walker.gait_file import with_vector

STEP = {"timestep": "1 ms"}


def main() -> None:
    """Search, say how it goes, and write the gait."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("gait", help="where the search begins: a shipped gait, or a file")
    parser.add_argument("--speed", type=float, required=True, help="m/s")
    parser.add_argument("--generations", type=int, default=100, help="of 16 gaits")
    parser.add_argument("--spread", type=float, default=0.05, help="first standard deviation over the value")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    given = parser.parse_args()
    device = prepared("walk-dropfoot-afo", STEP | {"patient": "healthy"})
    shod = device.set({**UNDRIVEN, "orthosis": "none"})
    bodies = [build_body(shod), build_body(shod, {"tibialis": 0.5}), build_body(device)]
    begun = read_gait(given.gait)
    found = search(
        bodies,
        begun.vector,
        Cost(given.speed, norm=8.0, cadence=15.0),
        Free(alike=True),
        generations=given.generations,
        seed=given.seed,
        threads=given.threads,
        spread=given.spread,
        progress=lambda k, n, best: print(f"{k} of {n}: {best:.2f}", file=sys.stderr),
    )
    cost = round(sum(found.parts.values()), 3)
    how = {"evaluations": found.evaluations, "cost": cost, "converged": found.converged}
    words = f"healthy, searched for {given.speed:g} m/s"
    walked = dataclasses.replace(begun, speed=given.speed)
    write_gait(given.out, with_vector(walked, found.vector, given.out.stem, words, how))
    print({name: round(value, 2) for name, value in found.parts.items()})


if __name__ == "__main__":
    main()
