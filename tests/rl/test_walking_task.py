"""The walking task: its reward by hand and beside the verdict, and what cannot be walked."""

from typing import Any

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.model.build import build
from afo_sim.rl.environments.episodes import Episodes
from afo_sim.rl.environments.task import Sample
from afo_sim.rl.environments.tasks import setting_of
from afo_sim.rl.environments.walking import (
    PASSING,
    PUSHING,
    STRUCK,
    badness,
    limits_of,
    passing,
    walking_reward,
)

WALK = {"timestep": "2 ms", "reference": None}


def paid(**facts: float) -> float:
    """Reward of a sample in which nothing happens but what is given, by the usual limits."""
    nothing = {"passing": 0.0, "struck": 0.0, "pushing": 0.0, "toe/height": 0.0, "sole/pitch": 0.0}
    nothing |= {"ankle/moment/orthosis": 0.0, "air/taken": 0.0}
    names = {"height": "toe/height", "pitch": "sole/pitch", "air": "air/taken"}
    names |= {"torque": "ankle/moment/orthosis"}
    given = nothing | {names.get(name, name): value for name, value in facts.items()}
    found = Sample({}, {}, np.empty(0), limits=limits_of(load("scenario", "walk-dropfoot-afo")))
    found.found |= given
    return float(walking_reward(found))


def test_each_part_is_the_verdicts_question_between_its_limits() -> None:
    assert paid(passing=0.1, height=0.004) == pytest.approx(0.1 * 0.5 * 0.4)  # 4 of 10 mm
    assert paid(struck=1, pitch=np.radians(3.2)) == pytest.approx(0.5 * 0.5)  # of −1.6 to 8°
    assert paid(pushing=1, torque=0.105) == pytest.approx(-0.5 * 0.5)  # of 0.07 to 0.14 N·m/kg
    assert paid(pushing=1, torque=-1.0) == 0.0
    bottle = 300.0 * 1e5 * 0.5e-3 / (287.0 * 293.0 * 1.104)  # of an ideal gas over its compressibility [kg]
    assert paid(air=bottle / 2000.0) == pytest.approx(-0.25, abs=0.02)
    assert paid(air=bottle) == -0.5 and paid(height=1.0, pitch=1.0, torque=1.0) == 0.0


def test_a_stride_is_asked_once_for_each_part() -> None:
    made = setting_of("dropfoot_walk")
    script = made.draw(np.random.default_rng(0))
    strides = script[:, STRUCK].sum()
    assert strides == np.floor(made.built.walk.phase[9000])  # the first begins with the walk
    assert script[:, PASSING].sum() == pytest.approx(strides) == script[:, PUSHING].sum()
    share = np.modf(made.built.walk.phase[np.r_[1, 5:9001:5]])[0]  # a sample is one step old
    pushed = share[script[:, PUSHING] > 0.0]
    assert 0.4 <= pushed.min() < 0.41 and 0.55 < pushed.max() < 0.7  # from heel rise to toe-off


def test_the_foot_passes_where_the_metric_has_its_clearance() -> None:
    sets = WALK | {"supply.pressure": "3 bar"}
    run, built = afo.run("walk-dropfoot-afo", sets), build("walk-dropfoot-afo", sets)
    first, last = passing(built.walk.cycle)
    there = (run["gait/stride"] == run["gait/stride"].max() - 1) & (run["gait/phase"] >= first)
    there &= run["gait/phase"] < last
    height = np.minimum(run["ball/height"], run["toe/height"])[there].min()
    assert 1e3 * height == pytest.approx(run.metrics["toe_clearance"].value, abs=0.02)


def test_shut_valves_take_no_air_and_filled_dorsiflexors_lift_and_hinder() -> None:
    made, rewards = setting_of("dropfoot_walk"), []
    asked = made.draw(np.random.default_rng(0))[1:601].T
    episodes = Episodes(made, 2)
    episodes.begin([0, 1], [np.random.default_rng(0)] * 2)
    for _ in range(600):
        outcome = episodes.step([0, 1], np.array([[0.0, 0.0], [1.0, -1.0]]))
        rewards.append(outcome.reward)
    episodes.close()
    shut, filled = np.array(rewards).T
    swing, push = asked[PASSING] > 0.0, asked[PUSHING] > 0.0
    assert (shut >= 0.0).all()
    assert filled[:100].sum() < shut[:100].sum()  # the air of the filling
    assert filled[swing][-20:].mean() > 1.5 * shut[swing][-20:].mean() > 0.0
    assert filled[push][-20:].mean() < 0.0


@pytest.mark.parametrize(
    ("sets", "field"),
    [
        ({"gait.pace": [["1 s", 0.0]]}, "gait.pace"),
        ({"phases": None, "controller": {"rate": "100 Hz", "toe_load": {}}}, "controller"),
        ({"drive": {"dorsiflexor": {"kind": "bang_bang"}}}, "drive"),
        ({"ground.mode": "contact"}, "ground.mode"),
        ({"timestep": "1 ms"}, "timestep"),
    ],
)
def test_what_the_task_cannot_be_of_is_refused(sets: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as error:
        setting_of("dropfoot_walk", sets)
    assert error.value.field == field


def test_equal_limits_have_the_whole_price_beyond_and_none_below() -> None:
    """Of a bottle that is not above the supply's 4 bar any air is too much, as the verdict says."""
    sets = {"limits.bottle_pressure": "4 bar", "limits.toe_clearance": ["5 mm"] * 2}
    toe, *_, air = limits_of(load("scenario", "walk-dropfoot-afo", sets))
    assert badness(np.array([0.005 - 1e-6, 0.005, 0.006]), toe).tolist() == [1.0, 0.0, 0.0]
    assert np.minimum(1e-6 / air[1], 1.0) == 1.0 and np.minimum(0.0 / air[1], 1.0) == 0.0
    assert badness(np.array([-1.0, 0.0, 5.0, 10.0]), (10.0, 0.0)).tolist() == [1.0, 1.0, 0.5, 0.0]
    assert badness(np.array([1.0, 3.0, 4.0]), (2.0, 4.0)).tolist() == [0.0, 0.5, 1.0]
