"""How fast a responding walker walks: over real time, without and with the device's whole air path."""

import time
from collections.abc import Callable

from measuring import Figure, figure, in_turn, ratio

from afo_sim.walker import Walked, build_body, prepared, read_gait, walk
from afo_sim.walker.walking import own_copy

WALKED = 5.0  # [s]


def walker_rates(repeats: int) -> list[Figure]:
    """Simulated seconds by seconds of one core, at the step at which the walker's numbers are stated."""
    gait = read_gait("natural")
    bodies = {
        "bare": build_body(prepared("walk-dropfoot"), {"tibialis": 0.4}),
        "device": build_body(prepared("walk-dropfoot-afo"), {"tibialis": 0.4}),
    }

    def once(name: str) -> Callable[[], float]:
        def measured() -> float:
            begun = time.process_time()
            walked: Walked = walk(own_copy(bodies[name]), gait.vector, WALKED)
            return float(walked["time"][-1]) / (time.process_time() - begun)

        return measured

    rates = in_turn({name: once(name) for name in bodies}, repeats)
    return [
        *(figure(f"walker, {name}", "× real time", "higher", rates[name]) for name in bodies),
        ratio("walker, device over bare", rates["device"], rates["bare"], "higher"),
    ]
