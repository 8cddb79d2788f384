"""The walking task: its reward by hand, and what it says of devices that lift and that do not."""

import math
from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.rl import TASKS
from afo_sim.rl.environments.episodes import Episodes, Setting, setting
from afo_sim.rl.environments.task import Sample
from afo_sim.rl.environments.tasks import AIR, CLEAR, POWER, SMOOTH, walking_reward


@pytest.fixture(scope="module")
def made() -> Setting:
    return setting(TASKS["dropfoot_walk"])


def at(*, swing: float, push_off: float, toe: float, moment: float, velocity: float, gained: float) -> float:
    told = {
        "swing": swing,
        "push_off": push_off,
        "toe/height": toe,
        "ankle/moment/orthosis": moment,
        "ankle/velocity": velocity,
    }
    readers = {name: (lambda s, v=value: v) for name, value in told.items()}
    return float(walking_reward(Sample(readers, {}, 0, np.empty(0)), np.array([gained, 0.0])))


def test_the_reward_is_its_formula() -> None:
    still = {"moment": 0.0, "velocity": 0.0, "gained": 0.0}
    assert at(swing=1, push_off=0, toe=CLEAR, **still) == 0.0
    assert at(swing=1, push_off=0, toe=CLEAR + SMOOTH, **still) == pytest.approx(math.tanh(1.0))
    assert at(swing=1, push_off=0, toe=-0.05, **still) < -0.99
    assert at(swing=0, push_off=1, toe=0.3, **still) == 0.0
    resisting = {"swing": 0, "push_off": 1, "toe": 0.0, "gained": 0.0}
    assert at(moment=5.0, velocity=-1.0, **resisting) == pytest.approx(-0.5 * 5.0 / POWER)
    assert at(moment=5.0, velocity=1.0, **resisting) == 0.0  # it goes along
    assert at(moment=-5.0, velocity=-1.0, **resisting) == 0.0  # it helps
    filling = {"swing": 0, "push_off": 0, "toe": 0.0, "moment": 0.0, "velocity": 0.0}
    assert at(gained=0.5 * AIR, **filling) == pytest.approx(-0.1)
    assert at(gained=-AIR, **filling) == 0.0


def test_the_reward_keeps_its_bounds() -> None:
    task = TASKS["dropfoot_walk"]
    worst = at(swing=1, push_off=0, toe=-1.0, moment=1e3, velocity=-1e3, gained=1.0)
    assert worst == pytest.approx(task.lowest)
    best = at(swing=1, push_off=0, toe=1.0, moment=0.0, velocity=0.0, gained=0.0)
    assert best == pytest.approx(task.highest)


def test_episodes_begin_at_phases_all_over_the_stride(made: Setting) -> None:
    phase = made.built.walk.phase[1:]
    begun = np.sort([phase[start.step] for start in made.starts])
    assert begun[0] >= 1.0 and begun[-1] < 2.0
    assert np.diff(begun).max() < 0.015  # a control period of 10 ms in a stride of 1.1 s
    drawn = {made.draw(np.random.default_rng(seed))[0].step for seed in range(50)}
    assert len(drawn) > 30


def mean_reward(made: Setting, action: list[float]) -> float:
    """Of three seconds from three starts."""
    episodes = Episodes(made, 3)
    episodes.begin([0, 1, 2], [np.random.default_rng(seed) for seed in range(3)])
    total = np.zeros(3)
    for _ in range(300):
        total += episodes.step([0, 1, 2], np.array([action] * 3)).reward
    episodes.close()
    return float(total.mean() / 300)


def test_a_filled_dorsiflexor_is_worth_more_than_an_empty_one(made: Setting) -> None:
    filled = mean_reward(made, [1.0, -1.0])
    empty = mean_reward(made, [-1.0, -1.0])
    pulling_down = mean_reward(made, [-1.0, 1.0])
    assert filled > empty + 0.1 and empty > pulling_down


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ({"gait.pace": [["1 s", 0.0]]}, "gait.pace"),  # who stands swings no more
        ({"phases": None, "controller": {"rate": "100 Hz", "toe_load": {}}}, "controller"),
        ({"drive": {"dorsiflexor": {"kind": "bang_bang"}}}, "drive"),
    ],
)
def test_what_no_episode_can_be_of_is_refused(sets: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        setting(TASKS["dropfoot_walk"], sets)
