"""What an air network costs: callbacks of S1, and of three chambers with tubes, manifold and reservoir."""

from typing import Any

from measuring import Figure
from step_parts import step_parts

import afo_sim

CALLBACKS = "step: callbacks"
TUBES = {"tube": "pun_4x2_5", "tube_length": "0.8 m", "tube_volume": "0 ml", "feed": "manifold"}
AIR = {
    "volume": {
        "reservoir": {"volume": "400 ml", "wall_conductance": "0.5 W/K"},
        "manifold": {"volume": "20 ml", "wall_conductance": "0.1 W/K"},
    },
    "restriction": {
        name: {
            "kind": "tube",
            "tube": "pun_4x2_5",
            "length": "1 m",
            "upstream": upstream,
            "downstream": downstream,
        }
        for name, upstream, downstream in (
            ("feed", "supply", "reservoir"),
            ("link", "reservoir", "manifold"),
        )
    },
}


def three_chambers() -> dict[str, Any]:
    """Overrides of S1's seated scenario: its plantarflexors on a chamber each, and the network."""
    orthosis = afo_sim.load("orthosis", "s1").model_dump(mode="json", exclude_none=True)
    back = orthosis["muscle"]["plantarflexor"]
    orthosis["muscle"]["third"] = back
    orthosis["chamber"]["third"] = orthosis["chamber"]["plantarflexor"]
    for chamber in orthosis["chamber"].values():
        chamber.update(TUBES)
    timer = afo_sim.load("scenario", "seated").model_dump(mode="json", exclude_none=True)["timer"]
    timer["third"] = timer["plantarflexor"]
    return {"orthosis": orthosis | AIR, "timer": timer}


def network_costs(steps: int, repeats: int) -> list[Figure]:
    """Callbacks of the smallest circuit and of the network, and their ratio; parameters of `step_parts`."""
    found = {}
    for title, sets in (("two chambers", {}), ("three chambers and a network", three_chambers())):
        figures = step_parts("seated", steps, repeats, sets, title)
        found[title] = next(each for each in figures if each.name.endswith(CALLBACKS))
    small, large = found.values()
    name = "callbacks of a network by those of two chambers"
    ratio = Figure(name, "-", "lower", large.best / small.best, large.median / small.median, repeats)
    return [small, large, ratio]
