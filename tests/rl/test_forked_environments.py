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
import mujoco

import afo_sim as afo
from afo_sim import rl
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
    with rl.dm_control_physics("seated") as physics:
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


ASKS: dict[str, Any] = {
    "restore": lambda env, state: env.restore(state),
    "reset": lambda env, state: env.reset(),
    "step": lambda env, state: env.step([1.0]),
    "state": lambda env, state: env.state(),
    "copy": lambda env, state: env.copy(),
    "close": lambda env, state: env.close(),
}


@pytest.mark.parametrize("ask", ASKS)
@pytest.mark.parametrize("place", ["begin", "observe", "reward", "terminated"])
def test_what_an_environment_calls_changes_nothing(place: str, ask: str) -> None:
    leg = afo.attach("pin_knee", "pin_knee", timestep="2 ms")

    def play(found: list[str]) -> list[Any]:
        """Five steps; what is called asks once, where nothing has been found yet."""
        env: Any = None

        def at(here: str, value: Any) -> Any:
            if here == place and env is not None and not found:
                with pytest.raises(InputError, match="mix two states") as caught:
                    ASKS[ask](env, state)
                found.append(caught.value.field)
            return value

        env = AttachedEnv(
            leg,
            observe={"knee": lambda data: at("observe", data.qpos[0])},
            reward=lambda env: at("reward", env.data.qpos[0]),
            terminated=lambda env: at("terminated", False),
            begin=lambda env: at("begin", None),
            duration=0.05,
        )
        state = env.state()
        env.reset(seed=0)
        steps = [env.step([1.0]) for _ in range(5)]
        env.close()
        return steps

    found: list[str] = []
    played = [play(found), play(["nothing is asked"])]
    assert found == ["reset" if place in ("begin", "observe") else "step"]
    for one, other in zip(*played, strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:4] == other[1:4]
    assert [step[3] for step in played[0]] == [False] * 4 + [True]


def test_an_error_of_a_reward_ends_the_episode() -> None:
    env = AttachedEnv(afo.attach("pin_knee", "pin_knee", timestep="2 ms"), reward=lambda env: 1 / 0)
    env.reset(seed=0)
    with pytest.raises(ZeroDivisionError):
        env.step([1.0])
    with pytest.raises(InputError, match=r"over.*reset"):
        env.step([1.0])
    env.close()


def test_an_episode_that_fails_to_begin_is_none_and_a_refused_reset_draws_nothing() -> None:
    draws: list[float] = []

    def begin(env: AttachedEnv) -> None:
        if draws:
            with pytest.raises(InputError, match="mix two states"):
                env.reset(seed=5)
        draws.append(env.np_random.random())
        if len(draws) == 2:
            raise RuntimeError("it does not stand")

    env = AttachedEnv(afo.attach("pin_knee", "pin_knee", timestep="2 ms"), begin=begin)
    env.reset(seed=0)
    env.step([1.0])
    with pytest.raises(RuntimeError, match="stand"):
        env.reset(seed=0)
    assert draws[1] == draws[0]
    with pytest.raises(InputError, match=r"not begun.*reset"):
        env.step([1.0])
    env.close()


@pytest.mark.parametrize("ask", [*ASKS, "set_state"])
def test_a_mujoco_callback_changes_no_physics(ask: str) -> None:
    changes = ASKS | {
        "set_state": lambda physics, state: physics.set_state(start),
        "step": lambda physics, state: physics.step(),
    }
    found: list[Any] = []
    with rl.dm_control_physics("seated") as physics:
        start, state = physics.get_state(), physics.state()

        def passive(model: Any, data: Any) -> None:
            if not found:
                found.append(None)
                with pytest.raises(InputError, match="mix two states"):
                    changes[ask](physics, state)
                found[0] = "refused"

        mujoco.set_mjcb_passive(passive)
        try:
            physics.step(5)
        finally:
            mujoco.set_mjcb_passive(None)
        after = physics.get_state()
        physics.restore(state)
        physics.step(5)
        np.testing.assert_array_equal(physics.get_state(), after)
    assert found == ["refused"]
