"""Environments are forked with their episodes and random numbers; wrappers and other libraries are served."""

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("dm_control")

import gymnasium

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.rl import OrthosisVectorEnv
from afo_sim.rl.environments import gym_id, suite
from afo_sim.rl.environments.attached_env import AttachedEnv

ACTIONS = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2, 2)).astype(np.float32)
FORKS = (copy.copy, copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)))


def single(env: Any) -> np.ndarray:
    """Observations, also of a next episode, which random numbers draw."""
    return np.array([*(env.step(action[0])[0] for action in ACTIONS), env.reset()[0]])


def vector(env: Any) -> np.ndarray:
    return np.array([*(env.step(action)[0] for action in ACTIONS), env.reset()[0]])


def suites(env: Any) -> np.ndarray:
    return np.array([np.concatenate(list(env.step(action[0]).observation.values())) for action in ACTIONS])


@pytest.mark.parametrize("task", ["seated_tracking", "dropfoot_walk"])
@pytest.mark.parametrize("play", [single, vector, suites])
def test_an_environment_and_its_forks_go_on_alike(task: str, play: Any) -> None:
    if play is single:
        env: Any = gymnasium.make(gym_id(task)).unwrapped
    else:
        env = OrthosisVectorEnv(task, 2) if play is vector else suite.load(task, {"time_limit": 0.5})
    env.reset()
    play(env)
    state, forks = env.state(), [fork(env) for fork in FORKS]
    expected = play(env)
    for fork in forks:
        np.testing.assert_array_equal(play(fork), expected)
        fork.close()
    assert (play(env) != expected).any()  # other episodes follow
    env.restore(pickle.loads(pickle.dumps(state)))
    np.testing.assert_array_equal(play(env), expected)
    env.close()


def test_dm_controls_state_holds_time_and_air() -> None:
    with afo.dm_control_physics("seated") as physics:
        state, found = physics.get_state(), []
        for _ in range(2):
            physics.set_state(state)
            physics.step(300)
            found.append(physics.get_state())
    assert (found[0] == found[1]).all() and found[0][0] == pytest.approx(0.6)


def test_a_task_is_reseeded_as_shimmy_does_it() -> None:
    env, found = suite.load("seated_tracking", {"random": 1}), []
    for seed in (5, 5, 6):
        env.task._random = np.random.RandomState(seed)
        found.append(float(env.reset().observation["reference"][0]))
    assert env.task.random is env.task._random and found[0] == found[1] != found[2]
    env.close()


@pytest.mark.slow
def test_a_body_in_two_orthoses_is_an_environment() -> None:
    models = pytest.importorskip("musclemimic_models")
    body = Path(models.__file__).parent / "model/body/myofullbody.xml"
    leg = afo.attach(afo.attach(body, "s1", side="right", timestep="2 ms"), "s1", side="left", prefix="left_")
    env = AttachedEnv(leg, {"pelvis": lambda data: data.qpos[2]}, duration=0.05)
    seen, _ = env.reset(seed=0)
    assert env.metadata["action_names"][2] == "left_dorsiflexor" and len(seen) == 7
    assert env.metadata["observation_names"][-1] == "pelvis" and seen[-1] == env.data.qpos[2]
    both = [env.step([1.0, -1.0, -1.0, 1.0]) for _ in range(2)]
    fork = copy.deepcopy(env)
    both += [env.step([1.0, -1.0, -1.0, 1.0]) for _ in range(3)]
    again = [fork.step([1.0, -1.0, -1.0, 1.0]) for _ in range(3)]
    np.testing.assert_array_equal([step[0] for step in again], [step[0] for step in both[2:]])
    assert [step[1:4] for step in both] == [(1.0, False, False)] * 4 + [(1.0, False, True)]
    named = dict(zip(env.metadata["observation_names"], both[-1][0], strict=True))
    assert named["afo_dorsiflexor_pressure"] > 1e4 > named["afo_plantarflexor_pressure"]
    assert named["left_plantarflexor_pressure"] > 1e4 > named["left_dorsiflexor_pressure"]
    with pytest.raises(InputError, match="reset"):
        env.step(np.zeros(4))
    fork.close()
    env.close()


def test_a_fork_has_a_model_of_its_own_and_no_pickle() -> None:
    env = AttachedEnv(afo.attach("pin_knee", "pin_knee", timestep="2 ms"))
    assert env.metadata["observation_names"][0] == "afo_knee_angle"
    fork, before = env.copy(), env.leg.model.body_mass.copy()
    env.leg.model.body_mass *= 3.0
    assert (fork.leg.model.body_mass == before).all() and (env.copy().leg.model.body_mass == 3 * before).all()
    env.restore(fork.state())
    for value in (env, env.state()):
        with pytest.raises(InputError, match=r"MjSpec.*copy\(\), state\(\) and restore"):
            pickle.dumps(value)
    for period in (0.0004, 0.0025):
        with pytest.raises(InputError, match=r"period.*0\.002 s times"):
            AttachedEnv(env.leg, period=period)
