"""Let wearers adapt to springs, or push with a muscle as they are; keep each walk, and their responses.

    python scripts/adapted_wearers.py stiffness --wearers 5 --walk 3 --generations 20 --seed 1
    python scripts/adapted_wearers.py onset --wearers 5
    python scripts/adapted_wearers.py tell

`stiffness`: wearers lose soleus and gastrocnemius of one leg step by step, adapting to each loss without a
device, and from that gait adapt to each spring [N·m/deg] at that leg's ankle. A search has 16 walks of 10 s
in each generation, at 1 ms. `onset`: healthy ones, unadapted, with one muscle of 20 mm that pushes one foot
from an onset on [% of the stride]; 0: no air. A row is one undisturbed walk of 20 s at 0.5 ms.
The file keeps the rows of other studies. `tell` computes the responses anew from the rows that are kept.
"""

import argparse
import dataclasses
import pathlib
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import tomli_w

from afo_sim.common import GRAVITY, write_text
from afo_sim.walker import Cost, Free, Vector, Walked, numbers, search, strides_of, walk
from afo_sim.walker.measured import WALKED, Wearer, drawn_people
from afo_sim.walker.population import PLANTARFLEXORS

KEPT, TOLD = (
    pathlib.Path("models/validation/adapted_wearers.csv"),
    pathlib.Path("models/responses_adapted.toml"),
)
STEPS, WEAK = (0.85, 0.7, 0.55, 0.4), (0.7, 0.4)  # share left of the plantarflexors, on the way and kept
STIFFNESSES = (0.0, 0.9, 2.8, 4.7, 6.6)  # [N·m/deg]
ONSETS, OFF, SOONER = (
    (36, 42, 48, 54),
    64,
    3,
)  # of a push, and how much sooner the valves switch [% of the stride]
PUBLISHED, PRESSURES = 42, (2, 3, 4)  # best onset [% of the stride], [bar]
PUSH_OFF = slice(30, 66)
# With a place, a valve and a cuff that let it push (all assumed): S1's own two push with 0.005 W/kg
PUSHER = {
    "orthosis.muscle.plantarflexor.type": "dmsp_20",
    "orthosis.muscle.plantarflexor.count": 1,
    "orthosis.muscle.plantarflexor.slack": "0 mm",
    "orthosis.muscle.plantarflexor.link_length": "12.6 cm",
    "orthosis.muscle.plantarflexor.origin.from_joint": ["-6 cm", "0 cm", "38 cm"],
    "orthosis.muscle.plantarflexor.insertion.from_joint": ["-9 cm", "0 cm", "-3 cm"],
    "orthosis.chamber.plantarflexor.inlet": "sy7000",
    "orthosis.chamber.plantarflexor.outlet": "sy7000",
    "orthosis.anchor.shank.stiffness": "50 kN/m",
    "start": None,
}
HEADER = (
    "study,wearer,adapted,left,setting,bar,"
    "cost_of_transport,speed,most_dorsiflexion,peak_power,soleus,push_power,fell"
)


def adapted(given: argparse.Namespace, wearer: Wearer, vector: Vector, spring: float) -> Vector:
    """The gait that a search finds from another, with energy as the greater part of its cost."""
    coarse = dataclasses.replace(wearer, scenario=wearer.scenario.set({"timestep": "1 ms"}))
    cost = Cost(wearer.gait.speed, speed=60.0, lean=60.0, effort=2.0)
    how = {"generations": given.generations, "seed": given.seed, "threads": given.threads, "spread": 0.06}
    return search([coarse.body(spring=spring)], vector, cost, Free(), **how).vector


def row(walked: Walked, spring: float) -> list[float]:
    """Numbers of a walk, the ankle's power with the spring's."""
    strides, of, mass = strides_of(walked, "right"), numbers(walked), walked.body.weight / GRAVITY
    if len(strides.duration) < 2:
        return [np.nan] * 6 + [walked["time"][-1]]
    ankle = strides.curves["ankle"]
    rate = np.gradient(ankle, axis=1) * 100.0 / strides.duration[:, None]
    power = strides.curves["power"] - np.degrees(spring) * ankle * rate / mass
    counted = slice(int(strides.begins[0]), int(strides.begins[-1]))
    push = np.maximum(walked["device/torque"] * walked["right/ankle_velocity"], 0.0)[counted].mean() / mass
    return [
        of["cost_of_transport"],
        of["speed"],
        np.degrees(ankle[:, 10:62].max(axis=1)).mean(),
        power[:, 35:70].max(axis=1).mean(),
        strides.mean("soleus")[PUSH_OFF].max(),
        push,
        np.nan if walked.fell is None else walked.fell,
    ]


def line(*cells: Any) -> str:
    """A row of the file; an empty cell is unknown."""
    return ",".join("" if x != x else x if isinstance(x, str) else f"{x:.5g}" for x in cells)


def stiffness(given: argparse.Namespace, k: int, wearer: Wearer) -> Iterator[str]:
    """Springs on plantarflexors of which little is left."""
    vector = wearer.gait.vector
    for left in STEPS:
        weak = dataclasses.replace(wearer, strength=dict.fromkeys(PLANTARFLEXORS, left))
        vector = adapted(given, weak, vector, 0.0)
        for spring in STIFFNESSES if left in WEAK else ():
            found = adapted(given, weak, vector, spring) if spring else vector
            walked = walk(weak.body(spring=spring), found, WALKED)
            *of, _, _, fell = row(walked, spring)
            yield line("stiffness", k, 1, left, spring, 0, *of, np.nan, np.nan, fell)


def pushing(onset: int, bar: float) -> dict[str, Any]:
    """A muscle that pushes from an onset on; 0: worn without air."""
    begin, end, empty = (onset - SOONER) / 100.0, (OFF - SOONER) / 100.0, {"outlet": [[0.0, 1.0]]}
    push = {"inlet": [[begin, end]], "outlet": [[end, begin]]} if onset else empty
    phases = {"plantarflexor": push, "dorsiflexor": empty}
    return PUSHER | {"phases": phases, "supply.pressure": f"{bar} bar"}


def onset(_: argparse.Namespace, k: int, wearer: Wearer) -> Iterator[str]:
    """Onsets and powers of a push on the healthy."""
    for at in (0, *ONSETS):
        for bar in PRESSURES if at else PRESSURES[:1]:
            yield line("onset", k, 0, 1, at, bar, *row(wearer.walk(pushing(at, bar)), 0.0))


def responses(file: pathlib.Path) -> dict[str, list[float]]:
    """Each wearer's responses, of the rows that are kept of those who do not fall."""
    rows = np.atleast_1d(np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8"))
    rows, found = rows[np.isnan(rows["fell"])], dict[str, list[float]]()

    def add(name: str, value: float) -> None:
        found.setdefault(name, []).append(round(float(value), 4))

    springs, pushes = (
        rows[(rows["study"] == study) & (rows["setting"] > 0.0)] for study in ("stiffness", "onset")
    )
    off = rows[(rows["study"] == "onset") & (rows["setting"] == 0.0)]
    for k in np.unique(springs["wearer"]):
        own = [springs[(springs["wearer"] == k) & (springs["left"] == left)] for left in WEAK]
        if all(len(each) > 1 for each in own):
            less, weak = (each["setting"][each["cost_of_transport"].argmin()] for each in own)
            add("spring_by_weakness", np.sign(weak - less))
        for each in (each[each["setting"] > 2.0] for each in own):  # the measured range
            if len(each) < 2:
                continue
            add("spring_dorsiflexion", np.polyfit(each["setting"], each["most_dorsiflexion"], 1)[0])
            add("spring_power", np.polyfit(each["setting"], each["peak_power"], 1)[0])
    for k in np.unique(off["wearer"]):
        on, without = pushes[pushes["wearer"] == k], off[off["wearer"] == k][0]
        best, timed = on[on["cost_of_transport"].argmin()], on[on["setting"] == PUBLISHED]
        most = timed[timed["push_power"].argmax()]  # not chosen by what it costs
        add("plantarflexor_cost", 100.0 * (most["cost_of_transport"] / without["cost_of_transport"] - 1.0))
        add("plantarflexor_onset", best["setting"])
        for each in on["soleus"][on["setting"] == ONSETS[0]]:
            add("plantarflexor_soleus", 100.0 * (each / without["soleus"] - 1.0))
    return found


def main() -> None:
    """Walk a study's wearers, and keep its rows beside those of others."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", choices=("stiffness", "onset", "tell"))
    for name, value in (("wearers", 5), ("walk", 5), ("generations", 20), ("seed", 1), ("threads", 2)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--out", type=pathlib.Path, default=KEPT)
    given = parser.parse_args()
    study = {"stiffness": stiffness, "onset": onset}.get(given.study)
    lines = given.out.read_text().splitlines()[1:] if given.out.exists() else []
    lines = [each for each in lines if study is None or not each.startswith(f"{given.study},")]
    people = drawn_people(given.wearers)["healthy"] if study else []
    for k, wearer in enumerate(people[: given.walk]):
        for each in study(given, k, wearer) if study else ():
            lines.append(each)
            write_text(given.out, "\n".join([HEADER, *lines]) + "\n")
            print(each, file=sys.stderr, flush=True)
    told = "# Of wearers, one number each: scripts/adapted_wearers.py, from validation/adapted_wearers.csv\n"
    if given.out == KEPT:
        write_text(TOLD, told + tomli_w.dumps(responses(KEPT)))
    else:
        print(responses(given.out))


if __name__ == "__main__":
    main()
