"""The Gymnasium environment: conforms, repeats itself by seed, refuses invalid actions, and ends."""

import subprocess
import sys
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

pytest.importorskip("gymnasium")

import gymnasium
from gymnasium.utils.env_checker import check_env

from afo_sim.common import InputError
from afo_sim.rl import TASKS
from afo_sim.rl.environments import gym_id
from afo_sim.rl.environments.gym_env import OrthosisEnv

IDS = [gym_id(name) for name in TASKS]


@pytest.fixture(scope="module", params=IDS)
def env(request: pytest.FixtureRequest) -> Iterator[gymnasium.Env]:
    made = gymnasium.make(request.param)
    yield made
    made.close()
    made.close()
    assert mujoco.get_mjcb_act_bias() is None


def rollout(env: gymnasium.Env, seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    actions = np.random.default_rng(5).uniform(-1.0, 1.0, (n, 2)).astype(np.float32)
    seen, rewards = [env.reset(seed=seed)[0]], []
    for action in actions:
        observation, reward, *_ = env.step(action)
        seen.append(observation)
        rewards.append(reward)
    return np.array(seen), np.array(rewards)


def test_gymnasiums_own_checker_is_content(env: gymnasium.Env) -> None:
    check_env(env.unwrapped, skip_render_check=True)  # warnings are errors here


def test_the_ids_are_the_documented_ones() -> None:
    assert IDS == ["afo_sim/SeatedTracking-v0", "afo_sim/DropfootWalk-v2"]


@pytest.mark.slow
def test_an_id_is_found_without_an_import() -> None:
    code = "import gymnasium; gymnasium.make('afo_sim.rl.environments:afo_sim/SeatedTracking-v0').close()"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_seed_gives_the_same_numbers_and_another_seed_others(env: gymnasium.Env) -> None:
    first, again, other = rollout(env, 3, 60), rollout(env, 3, 60), rollout(env, 4, 60)
    assert (first[0] == again[0]).all() and (first[1] == again[1]).all()
    assert (first[0] != other[0]).any()


def test_observations_are_finite_move_and_are_new_arrays(env: gymnasium.Env) -> None:
    made = env.unwrapped
    seen, kept = [made.reset(seed=0)[0]], []
    for _ in range(299):  # a walk begins after a second
        seen.append(made.step(np.array([1.0, 1.0]))[0])
        kept.append(seen[-1].copy())
    assert all((one == copy).all() for one, copy in zip(seen[1:], kept, strict=True))
    found = np.array(seen)
    assert found.dtype == np.float64 and np.isfinite(found).all()
    assert (np.ptp(found, axis=0) > 0.0).all()


def test_rewards_keep_their_bounds(env: gymnasium.Env) -> None:
    low, high = env.unwrapped.metadata["reward_range"]
    rewards = rollout(env, 1, 200)[1]
    assert (rewards >= low).all() and (rewards <= high).all()


def test_units_are_told(env: gymnasium.Env) -> None:
    units = env.unwrapped.metadata["observation_units"]
    assert len(units) == env.observation_space.shape[0]
    angle = next(name for name in units if name.endswith("_angle"))
    assert units[angle] == "rad" and units["dorsiflexor_pressure"] == "Pa"


@pytest.mark.parametrize("action", [[0.0, 2.0], [float("nan"), 0.0], [0.0]])
def test_what_is_no_action_steps_nothing(env: gymnasium.Env, action: list[float]) -> None:
    made = env.unwrapped
    made.reset(seed=0)
    before = made._episodes.stepped.state(0)
    with pytest.raises(InputError, match="action"):
        made.step(np.array(action))
    assert (made._episodes.stepped.state(0) == before).all()


@pytest.mark.slow
def test_an_episode_ends_and_has_to_be_reset(env: gymnasium.Env) -> None:
    made = env.unwrapped
    made.reset(seed=0)
    periods = made.setting.task.periods
    for k in range(periods):
        _, _, terminated, truncated, info = made.step(np.zeros(2))
        assert not terminated and truncated == (k == periods - 1) and "failure" not in info
    with pytest.raises(InputError, match="reset"):
        made.step(np.zeros(2))


def test_an_unstable_simulation_ends_with_its_reason(env: gymnasium.Env) -> None:
    made = env.unwrapped
    made.reset(seed=0)
    made.step(np.zeros(2))
    ankle = 1 + made.setting.built.index.ankle_qpos  # behind the time
    made._episodes.stepped.stepper.batch.state[0, ankle] = np.nan
    seen, reward, terminated, truncated, info = made.step(np.zeros(2))
    assert truncated and not terminated and reward == 0.0
    assert np.isfinite(seen).all() and info["failure"]
    seen, _ = made.reset(seed=0)
    assert np.isfinite(seen).all() and not made.step(np.zeros(2))[3]


def test_wrong_arguments_are_sentences() -> None:
    with pytest.raises(InputError, match="rgb_array"):
        OrthosisEnv(render_mode="rgb_aray")
    with pytest.raises(InputError, match="task's own"):
        gymnasium.make(IDS[0], sets={"duration": "1 s"})
    with pytest.raises(InputError, match="supply"):
        gymnasium.make(IDS[0], sets={"supply.presure": "3 bar"})


def test_keys_of_the_scenario_reach_the_device() -> None:
    env = gymnasium.make(IDS[0], sets={"supply.pressure": "2 bar"})
    env.reset(seed=0)
    for _ in range(400):
        seen = env.step(np.array([1.0, -1.0], np.float32))[0]
    env.close()
    assert seen[2] == pytest.approx(2e5, rel=0.02)


def test_a_picture_shows_the_leg() -> None:
    env = gymnasium.make(IDS[1], render_mode="rgb_array")
    env.reset(seed=0)
    try:
        picture = env.render()
    except InputError as error:
        pytest.skip(str(error))  # no OpenGL here
    finally:
        env.close()
    assert picture.shape == (480, 640, 3) and picture.std() > 5.0
