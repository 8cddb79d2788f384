"""A device on each leg: by weight, by symmetry of a symmetric walker, and by each foot's own switch."""

import itertools

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.model.build import build
from afo_sim.walker import Body, build_body, prepared, read_gait, strides_of, walk_body
from afo_sim.walker.body import BARE


def body_of(**sets: object) -> Body:
    return build_body(prepared("walk-dropfoot-afo", {"patient": "healthy", "timestep": "1 ms"} | sets))


def test_each_leg_weighs_what_the_other_does() -> None:
    model = body_of(worn_on="both").model
    legs = [model.body(f"{side}thigh").id for side in ("", "left_")]
    assert model.body_subtreemass[legs[0]] == pytest.approx(model.body_subtreemass[legs[1]], rel=1e-12)
    one, bare = body_of().model, body_of(**BARE).model
    worn = one.body_mass.sum() - bare.body_mass.sum()
    assert worn > 0.5 and model.body_mass.sum() - one.body_mass.sum() == pytest.approx(worn, rel=1e-9)


@pytest.mark.parametrize("switched", ["phases", "controller"])
def test_a_symmetric_walker_fills_both_alike_half_a_stride_apart(switched: str) -> None:
    sets = {"phases": None, "start": None, "controller": {"emg": {
        "column": "ankle/moment/biological", "full": "20 N*m", "chamber": "dorsiflexor",
    }}}  # fmt: skip
    body = body_of(worn_on="both", **(sets if switched == "controller" else {}))
    walked = walk_body(body, read_gait("natural").vector, 30.0)
    assert walked.fell is None
    curves = []
    for side, prefix in (("right", ""), ("left", "left_")):
        begins = strides_of(walked, side).begins[-13:]  # settled: the first come from another first posture
        columns = walked[f"chamber/{prefix}dorsiflexor/mass"], walked[f"device/{prefix}torque"]
        places = [np.linspace(*ends, 101) for ends in itertools.pairwise(begins)]
        rows = np.arange(len(walked["time"]))
        curves.append([np.mean([np.interp(place, rows, x) for place in places], axis=0) for x in columns])
    for own, other in zip(*curves, strict=True):
        assert np.abs(own - other).max() < 0.05 * np.ptp(own)
    (mass, torque), _ = curves
    assert np.ptp(mass) > 2e-5 and np.ptp(torque) > 0.2
    masses = [walked[f"chamber/{prefix}dorsiflexor/mass"] for prefix in ("", "left_")]
    assert np.abs(masses[0] - masses[1]).max() > 0.5 * np.ptp(mass)  # in time they are half a stride apart


def test_the_recorded_walk_refuses_two() -> None:
    with pytest.raises(InputError) as error:
        build("walk-dropfoot-afo", {"worn_on": "both"})
    assert error.value.field == "worn_on" and error.value.value == "both"
