"""The planar steps against MuJoCo's of the same walkers, and against their own kernels as plain Python."""

import dataclasses

import mujoco
import numpy as np
import pytest

from afo_sim import native
from afo_sim.common import SimulationError
from afo_sim.native import planar
from afo_sim.physics import GAINS
from afo_sim.walker import Body, Push, Walked, build_body, numbers, prepared, read_gait, walk_body
from afo_sim.walker.body import BARE
from afo_sim.walker.gait import start

ANGLES = [f"{side}/{joint}" for side in ("right", "left") for joint in ("hip", "knee", "ankle", "toe")]
BODIES = {
    "bare": {**BARE, "patient": "healthy"},
    "tall, heavy": {**BARE, "patient.body_mass": "95 kg", "patient.body_height": "1.9 m"},
    "spastic": {**BARE, "patient": "spastic"},
    "S1's air": {"patient": "healthy"},
    "paths over two joints": {"patient": "healthy", "orthosis": "s1_waist"},
    "timer": {"patient": "healthy", "phases": None, "start": None, "timer": {
        "period": "1 s", "dorsiflexor": {"inlet": [["0 s", "0.3 s"]], "outlet": [["0.5 s", "0.9 s"]]},
    }},
    "air of both legs": {"patient": "healthy", "worn_on": "both"},
    "slope": {"patient": "healthy", "ground.slope": "-4 deg"},
    "uneven": {"patient": "healthy", "ground.uneven": "20 mm", "ground.seed": 3},
}  # fmt: skip


def body_of(sets: dict[str, object], step: str = "0.5 ms") -> Body:
    return build_body(prepared("walk-dropfoot-afo", sets | {"timestep": step}))


def both(body: Body, duration: float, *pushes: Push) -> tuple[Walked, Walked]:
    vector = read_gait("natural").vector
    return walk_body(body, vector, duration, pushes), walk_body(
        body, vector, duration, pushes, engine="mujoco"
    )


@pytest.mark.parametrize("name", BODIES)
def test_a_second_is_mujocos_to_a_millionth_of_a_radian(name: str) -> None:
    body = body_of(BODIES[name])
    assert body.plan is not None
    own, judge = both(body, 1.0, Push(0.4, 60.0))
    rows = min(len(own["time"]), len(judge["time"]))
    assert rows > 60 and own.fell == judge.fell
    assert max(np.abs(own[angle][:rows] - judge[angle][:rows]).max() for angle in ANGLES) < 1e-6
    assert set(own.columns) == set(judge.columns)
    for column in own.columns:
        size = np.abs(judge[column]).max()
        assert np.abs(own[column][:rows] - judge[column][:rows]).max() <= 1e-6 * max(size, 1e-3), column


def test_statistics_of_twenty_seconds_are_mujocos() -> None:
    own, judge = map(numbers, both(body_of(BODIES["S1's air"], "1 ms"), 20.0))
    assert own["fell"] == 0.0 and own["strides"] > 10.0
    for name, value in judge.items():
        assert own[name] == pytest.approx(value, rel=1e-3, abs=1e-5, nan_ok=True), name


def test_either_goes_on_where_the_other_stopped() -> None:
    body, vector = body_of(BODIES["bare"]), read_gait("natural").vector
    found = []
    assert body.plan is not None
    pushes = np.zeros(1)
    for turns in ("mmmm", "pmpm", "pppp"):
        data = start(body, vector)
        with native.installed():
            mujoco.mj_forward(body.model, data)
            for turn in turns:
                if turn == "m":
                    mujoco.mj_step(body.model, data, nstep=40)
                else:
                    plan, place = body.plan.ctypes.data, pushes.ctypes.data
                    taken = native.planar_steps()(
                        body.model._address, data._address, plan, place, place, 1, 40, 0
                    )
                    assert taken == 1
        found.append(np.concatenate([data.qpos, data.qvel]))
    assert np.abs(found[0] - found[1]).max() < 1e-9 and np.abs(found[0] - found[2]).max() < 1e-9


def test_plain_python_takes_the_same_steps() -> None:
    body, states = body_of(BODIES["bare"]), []
    for python in (False, True):
        data = start(body, read_gait("natural").vector)
        with native.installed():
            mujoco.mj_forward(body.model, data)
        model, row, push = body.model, np.zeros(planar.ROW.act + body.model.na + body.model.nu), np.zeros(2)
        assert body.plan is not None
        if python:
            flat = native.install._flat(model), native.install._FlatData(data)
            assert planar.walk_on(*flat, body.plan, push, row, 1, 5, len(row)) == 1
        else:
            places = (body.plan.ctypes.data, push.ctypes.data, row.ctypes.data)
            assert native.planar_steps()(model._address, data._address, *places, 1, 5, len(row)) == 1
        states.append(np.concatenate([data.qpos, data.qvel, data.act, row]))
    assert np.abs(states[0] - states[1]).max() < 1e-9


def test_a_body_that_is_not_planar_is_left_to_mujoco() -> None:
    """A cable that rubs at its guides: its friction is asked of MuJoCo's path."""
    body = body_of({"patient": "healthy", "orthosis": "guided"}, "1 ms")
    assert body.plan is None
    own, judge = both(body, 0.3)
    assert len(own["time"]) == 30 and (own["right/ankle"] == judge["right/ankle"]).all()


@pytest.mark.parametrize(
    "asked", ["body_gravcomp", "jnt_stiffnesspoly", "jnt_actfrclimited", "dof_dampingpoly"]
)
def test_what_a_legs_file_asks_beyond_the_steps_is_left_to_mujoco(asked: str) -> None:
    body = body_of(BODIES["bare"], "1 ms")
    feet = tuple(body.model.body(f"{side}foot").id for side in ("", "left_"))
    rest = body.pads, body.model.body("trunk").id, feet
    assert native.plan_of(body.model, *rest) is not None
    getattr(body.model, asked)[-1] = 1
    assert native.plan_of(body.model, *rest) is None


def test_a_walk_that_is_no_number_is_an_error() -> None:
    vector = read_gait("natural").vector
    gains = vector.gains.copy()
    gains[0, GAINS.index("soleus_force")] = np.nan
    for engine in ("planar", "mujoco"):
        with pytest.raises(SimulationError) as found:
            walk_body(body_of(BODIES["bare"]), dataclasses.replace(vector, gains=gains), 0.5, engine=engine)
        assert [
            each for each in native.COMPLAINTS if each.partition(" in actuator")[0] in str(found.value)
        ] == [native.COMPLAINTS[0]]
