"""Simulations that are stepped from states in the midst of a run."""

import numpy as np
import pytest

from afo_sim.description import load
from afo_sim.model.build import build
from afo_sim.simulation import METRIC_FIELDS, Stepped

WALK = {"duration": "2 s", "gait.settled": "walked"}


@pytest.mark.parametrize(("name", "sets"), [("seated", {"duration": "2 s"}), ("walk-dropfoot-afo", WALK)])
def test_a_kept_state_goes_on_with_the_same_bits(name: str, sets: dict[str, str]) -> None:
    built = build(load("scenario", name, sets))
    stepped = Stepped([built], count=3, fields=METRIC_FIELDS)
    inputs = stepped.inputs(0, 400)
    stepped.advance([0], inputs[None, :250])
    kept = stepped.state(0)
    whole = {name: v[0].copy() for name, v in stepped.advance([0], inputs[None, 250:]).items()}
    stepped.begin([1, 2], [kept, kept], [250, 250])
    assert stepped.taken.tolist() == [400, 250, 250]
    again = stepped.advance([1, 2], np.stack([inputs[250:]] * 2))
    stepped.close()
    for field, values in whole.items():
        assert (again[field] == values).all(), field
