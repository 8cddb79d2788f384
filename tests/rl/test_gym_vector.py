"""The vector environment: the numbers of single ones, and episodes that end each on their own."""

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("gymnasium")

import gymnasium

from afo_sim.common import InputError
from afo_sim.rl import TASKS, OrthosisVectorEnv
from afo_sim.rl.environments import gym_id

MODE = "vector_entry_point"


@pytest.fixture(scope="module", params=TASKS)
def envs(request: pytest.FixtureRequest) -> Iterator[OrthosisVectorEnv]:
    made = gymnasium.make_vec(gym_id(request.param), num_envs=3, vectorization_mode=MODE, threads=2)
    yield made
    made.close()


def test_spaces_are_batches_of_the_single_ones(envs: OrthosisVectorEnv) -> None:
    assert envs.observation_space.shape == (3, *envs.single_observation_space.shape)
    assert envs.action_space.shape == (3, *envs.single_action_space.shape)
    assert envs.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
    assert envs.reset(seed=0)[0] in envs.observation_space


@pytest.mark.slow
def test_the_numbers_are_those_of_single_environments(envs: OrthosisVectorEnv) -> None:
    """As Gymnasium's own SyncVectorEnv has them; in walking through the end of an episode into the next."""
    task = envs.unwrapped.setting.task
    single = [lambda: gymnasium.make(gym_id(task.name), disable_env_checker=True)] * 3
    sync = gymnasium.vector.SyncVectorEnv(single)
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (520, 3, 2)).astype(np.float32)
    try:
        seen, expected = envs.reset(seed=11)[0], sync.reset(seed=11)[0]
        np.testing.assert_allclose(seen, expected, rtol=1e-12)
        for k, action in enumerate(actions):
            (*found, infos), (*wanted, told) = envs.step(action), sync.step(action)
            assert infos.keys() == told.keys()
            for mine, theirs in zip((*found, *infos.values()), (*wanted, *map(told.get, infos)), strict=True):
                np.testing.assert_allclose(mine, theirs, rtol=1e-12, atol=1e-12, err_msg=str(k))
    finally:
        sync.close()


def test_an_unstable_simulation_ends_and_the_others_go_on(envs: OrthosisVectorEnv) -> None:
    made, actions = envs.unwrapped, np.random.default_rng(0).uniform(-1.0, 1.0, (30, 3, 2))
    made.reset(seed=[1, 2, 3])
    calm = np.array([made.step(action)[0] for action in actions])
    made.reset(seed=[1, 2, 3])
    found, ended = [], []
    for k, action in enumerate(actions):
        if k == 10:
            ankle = 1 + made.setting.built.index.ankle_qpos  # behind the time
            made._episodes.stepped.stepper.batch.state[1, ankle] = np.nan
        seen, rewards, terminated, truncated, infos = made.step(action)
        assert np.isfinite(seen).all() and np.isfinite(rewards).all() and not terminated.any()
        found.append(seen)
        ended.append(truncated)
        assert (k == 10) == ("failure" in infos)
    assert np.argwhere(ended).tolist() == [[10, 1]]
    np.testing.assert_array_equal(np.array(found)[:, [0, 2]], calm[:, [0, 2]])


def test_one_of_them_can_be_reset(envs: OrthosisVectorEnv) -> None:
    first = envs.reset(seed=[5, 6, 7])[0]
    for _ in range(5):
        later = envs.step(np.ones((3, 2), np.float32))[0]
    seen, _ = envs.reset(seed=[5, 6, 7], options={"reset_mask": np.array([False, True, False])})
    np.testing.assert_array_equal(seen, np.stack([later[0], first[1], later[2]]))


def test_observations_are_new_arrays(envs: OrthosisVectorEnv) -> None:
    first = envs.reset(seed=0)[0]
    kept = first.copy()
    second = envs.step(np.ones((3, 2), np.float32))[0]
    envs.step(np.ones((3, 2), np.float32))
    np.testing.assert_array_equal(first, kept)
    assert not np.shares_memory(first, second)


def test_what_is_no_action_steps_nothing(envs: OrthosisVectorEnv) -> None:
    made = envs.unwrapped
    made.reset(seed=0)
    before = [made._episodes.stepped.state(k) for k in range(3)]
    for wrong in (np.full((3, 2), 1.5), np.full((3, 2), np.nan), np.zeros((2, 2)), np.zeros(2)):
        with pytest.raises(InputError, match="action"):
            made.step(wrong)
    assert all((made._episodes.stepped.state(k) == before[k]).all() for k in range(3))


@pytest.mark.parametrize(
    ("words", "field"),
    [({"num_envs": 0}, "num_envs"), ({"num_envs": 2, "threads": 0}, "threads"), ({"task": "walk"}, "task")],
)
def test_wrong_arguments_are_sentences(words: dict[str, object], field: str) -> None:
    with pytest.raises(InputError, match=field):
        OrthosisVectorEnv(**words)


def test_nothing_is_stepped_before_a_reset() -> None:
    envs = OrthosisVectorEnv(num_envs=2)
    with pytest.raises(InputError, match="reset"):
        envs.step(np.zeros((2, 2)))
    with pytest.raises(InputError, match="seed"):
        envs.reset(seed=[1])
    with pytest.raises(InputError, match="reset_mask"):
        envs.reset(options={"reset_mask": np.array([True])})
    envs.close()
    envs.close()


def test_numpys_numbers_are_seeds_and_a_fraction_is_none(envs: OrthosisVectorEnv) -> None:
    first = envs.reset(seed=4)[0]
    assert (envs.reset(seed=np.arange(4, 4 + envs.num_envs))[0] == first).all()
    with pytest.raises(InputError, match="seed"):
        envs.reset(seed=1.5)
