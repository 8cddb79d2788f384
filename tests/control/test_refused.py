"""A wrong description of a controller is refused at its field, in words that help."""

from typing import Any

import pytest
from control.samples import MACHINE, changed, made

from afo_sim.common import InputError

CLOCK: dict[str, Any] = {"period": "50 ms", "dorsiflexor": {"inlet": [["20 ms", "35 ms"]]}}
STATES = MACHINE["state"]
REFUSED: dict[str, tuple[dict[str, Any], list[tuple[dict[str, Any], str, str]]]] = {
    "timer": (
        CLOCK,
        [
            ({"dorsiflexr": {}}, "timer.dorsiflexr", "dorsiflexor"),
            ({"dorsiflexor": {"inlet": [["40 ms", "60 ms"]]}}, "dorsiflexor.inlet", "within the period"),
            ({"restart": {"above": "heavy"}}, "timer.restart.above", "quantity"),
        ],
    ),
    "state_machine": (
        MACHINE,
        [
            ({"start": "swnig"}, "start", "swing"),
            (changed(0, to="contcat"), "transition.0.to", "contact"),
            (changed(1, to="swing"), "state.stance", "never reached"),
            (changed(1, below="2 s"), "transition.1", "one of the two"),
            (changed(1, above=None), "transition.1", "one of the two"),
            (changed(1, to="contact"), "transition.1.to", "another state"),
            (changed(0, above="many"), "transition.0.above", "quantity"),
            (changed(0, above="nan N"), "transition.0.above", "finite"),
            (changed(0, after="-1 s"), "transition.0.after", "range"),
            ({"state": STATES | {"swing": {"dorsiflexr": "inlet"}}}, "dorsiflexr", "dorsiflexor"),
            ({"state": STATES | {"swing": {"dorsiflexor": "open"}}}, "swing.dorsiflexor", "inlet"),
            ({"state": STATES | {"swing": {"dorsiflexor": [1.0, 2.0]}}}, "swing.dorsiflexor", "coils"),
            ({"state": STATES | {"swing": {"dorsiflexor": "3 bar"}}}, "swing.dorsiflexor", "drive"),
        ],
    ),
    "gait_phase": (
        {},
        [
            ({}, "gait_phase", "no chamber"),
            ({"dorsiflexr": {}}, "gait_phase.dorsiflexr", "dorsiflexor"),
            ({"dorsiflexor": {"pressure": [[0.0, "1 bar"]]}}, "gait_phase.dorsiflexor", "no drive"),
            ({"dorsiflexor": {"pressure": [[0.5, "1 bar"], [0.1, "1 bar"]]}}, "pressure", "do not rise"),
            ({"dorsiflexor": {"pressure": [[0.5, "1 bar"]], "inlet": [[0.1, 0.2]]}}, "pressure", "conflicts"),
            ({"dorsiflexor": {}, "estimator": "foot_switch", "column": "shank/angle"}, "column", "switch"),
        ],
    ),
    "emg": (
        {},
        [
            ({"full": "0 N*m"}, "full", "positive"),
            ({"chamber": "dorsiflexr"}, "chamber", "dorsiflexor"),
            ({"pressure": "2 bar"}, "chamber", "no drive"),
            ({"vent_below": 0.7}, "vent_below", "fill_above"),
            ({"side": "both"}, "side", "choice"),
        ],
    ),
    "toe_load": (
        {},
        [
            ({"lifts": None}, "lifts", "no chamber"),
            ({"pushes": "dorsiflexor"}, "pushes", "two chambers"),
            ({"pushes": "plantarflexr"}, "pushes", "plantarflexor"),
            ({"unloaded": 0.8}, "unloaded", "loaded"),
            ({"vent_below": 0.7}, "vent_below", "fill_above"),
            ({"lift_pressure": "2 bar"}, "lifts", "no drive"),
            ({"push_pressure": "2 bar"}, "push_pressure", "no effect"),
            ({"peak": "0 N"}, "peak", "range"),
        ],
    ),
}


@pytest.mark.parametrize(
    ("kind", "told", "field", "words"),
    [(kind, base | sets, *says) for kind, (base, cases) in REFUSED.items() for sets, *says in cases],
)
def test_a_wrong_description_is_refused_at_its_field(
    kind: str, told: dict[str, Any], field: str, words: str
) -> None:
    with pytest.raises(InputError) as refused:
        made({kind: told})
    assert field in str(refused.value)
    assert words in str(refused.value)
