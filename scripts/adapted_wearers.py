"""Let healthy wearers push with a muscle of one foot; keep each walk, and their responses.

    python scripts/adapted_wearers.py

The first ten healthy ones of the shipped population, by their own gait, with one muscle of 20 mm that pushes
one foot from an onset on [% of the stride]; 0: no air. A row is one undisturbed walk of 20 s at 1 ms.
"""

import pathlib
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import tomli_w

from afo_sim.common import GRAVITY, write_text
from afo_sim.walker import Walked, numbers, strides_of
from afo_sim.walker.measured import Wearer, wearers

MODELS = pathlib.Path("models")
KEPT, TOLD = MODELS / "validation/adapted_wearers.csv", MODELS / "responses_adapted.toml"
ONSETS, OFF = (36, 42, 48, 54), 64  # of a push [% of the stride]
SOONER = 3  # the valves switch [% of the stride]
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
HEADER = "wearer,onset,bar,cost_of_transport,speed,soleus,push_power,fell"


def row(walked: Walked) -> list[float]:
    """Numbers of a walk."""
    strides, of = strides_of(walked, "right"), numbers(walked)
    if len(strides.duration) < 2:
        return [np.nan] * 4 + [walked["time"][-1]]
    counted = slice(int(strides.begins[0]), int(strides.begins[-1]))
    push = np.maximum(walked["device/torque"] * walked["right/ankle_velocity"], 0.0)[counted].mean()
    return [
        of["cost_of_transport"],
        of["speed"],
        strides.mean("soleus")[PUSH_OFF].max(),
        push * GRAVITY / walked.body.weight,
        np.nan if walked.fell is None else walked.fell,
    ]


def pushing(onset: int, bar: float) -> dict[str, Any]:
    """A muscle that pushes from an onset on; 0: worn without air."""
    begin, end, empty = (onset - SOONER) / 100.0, (OFF - SOONER) / 100.0, {"outlet": [[0.0, 1.0]]}
    push = {"inlet": [[begin, end]], "outlet": [[end, begin]]} if onset else empty
    phases = {"plantarflexor": push, "dorsiflexor": empty}
    return PUSHER | {"phases": phases, "supply.pressure": f"{bar} bar"}


def onset(k: int, wearer: Wearer) -> Iterator[str]:
    """Onsets and powers of a push on the healthy; an empty cell is unknown."""
    for at in (0, *ONSETS):
        for bar in PRESSURES if at else PRESSURES[:1]:
            cells = (k, at, bar, *row(wearer.walk(pushing(at, bar))))
            yield ",".join("" if x != x else f"{x:.5g}" for x in cells)


def responses(file: pathlib.Path) -> dict[str, list[float]]:
    """Each wearer's responses, of the rows that are kept of those who do not fall."""
    rows = np.genfromtxt(file, delimiter=",", names=True)
    rows, found = rows[np.isnan(rows["fell"])], dict[str, list[float]]()

    def add(name: str, value: float) -> None:
        found.setdefault(name, []).append(round(float(value), 4))

    pushes, off = rows[rows["onset"] > 0.0], rows[rows["onset"] == 0.0]
    for k in np.unique(off["wearer"]):
        on, without = pushes[pushes["wearer"] == k], off[off["wearer"] == k][0]
        best, timed = on[on["cost_of_transport"].argmin()], on[on["onset"] == PUBLISHED]
        most = timed[timed["push_power"].argmax()]  # not chosen by what it costs
        add("plantarflexor_cost", 100.0 * (most["cost_of_transport"] / without["cost_of_transport"] - 1.0))
        add("plantarflexor_onset", best["onset"])
        for each in on["soleus"][on["onset"] == ONSETS[0]]:
            add("plantarflexor_soleus", 100.0 * (each / without["soleus"] - 1.0))
    return found


def main() -> None:
    """Walk the wearers, and tell what they did."""
    lines = [HEADER]
    for k, wearer in enumerate(wearers("healthy")[:10]):
        for each in onset(k, wearer):
            lines.append(each)
            print(each, file=sys.stderr, flush=True)
    write_text(KEPT, "\n".join(lines) + "\n")
    told = "# Of wearers, one number each: scripts/adapted_wearers.py, from validation/adapted_wearers.csv\n"
    write_text(TOLD, told + tomli_w.dumps(responses(KEPT)))


if __name__ == "__main__":
    main()
