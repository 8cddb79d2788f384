"""The dm_control environments: conform, repeat themselves by seed, and see what the Gymnasium ones see."""

import itertools
import unittest
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import pytest
from campaign import size

pytest.importorskip("dm_control")

from dm_env.test_utils import EnvironmentTestMixin

from afo_sim.common import InputError
from afo_sim.rl import TASKS
from afo_sim.rl.environments import suite
from afo_sim.rl.environments.episodes import Episodes
from afo_sim.rl.environments.tasks import setting_of


class Conforming(EnvironmentTestMixin):
    """dm_env's own test of what an environment owes, through the end of an episode."""

    name = ""

    def make_object_under_test(self) -> Any:
        return suite.load(self.name, task_kwargs={"random": 1, "time_limit": 0.3})

    def make_action_sequence(self) -> Iterator[np.ndarray]:
        random = np.random.default_rng(0)
        for _ in range(70):
            yield random.uniform(-1.0, 1.0, 2)


class TestSeatedTracking(Conforming, unittest.TestCase):
    name = "seated_tracking"


class TestDropfootWalk(Conforming, unittest.TestCase):
    name = "dropfoot_walk"


@pytest.fixture(scope="module", params=TASKS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def environment(name: str) -> Iterator[suite.OrthosisEnvironment]:
    made = suite.load(name, task_kwargs={"random": 3})
    yield made
    made.close()
    made.close()
    assert mujoco.get_mjcb_act_bias() is None


def actions(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 2))


def flat(step: Any) -> np.ndarray:
    return np.concatenate(list(step.observation.values()))


def test_the_suite_lists_its_tasks() -> None:
    assert list(suite.SUITE) == list(TASKS)
    assert [name for _, name in suite.ALL_TASKS] == list(TASKS)
    assert set(suite.SUITE.tagged("orthosis")) == set(TASKS)


def test_the_numbers_are_those_of_the_batch(environment: suite.OrthosisEnvironment, name: str) -> None:
    """To the bit but for the foot's loads and clearance, whose sines numpy may round otherwise."""
    episodes = Episodes(setting_of(name))
    expected = episodes.begin([0], [np.random.RandomState(3)])[0]
    np.testing.assert_allclose(flat(environment.reset()), expected, rtol=1e-12, atol=1e-12)
    for k, action in enumerate(actions(300)):
        step, outcome = environment.step(action), episodes.step([0], action[None])
        np.testing.assert_allclose(flat(step), outcome.observation[0], rtol=1e-12, atol=1e-12, err_msg=str(k))
        assert step.reward == pytest.approx(outcome.reward[0], abs=1e-12)
    np.testing.assert_array_equal(environment.physics.data.qpos, episodes.stepped.now["qpos"][0])
    episodes.close()


def test_a_seed_repeats_itself_through_several_episodes(name: str) -> None:
    found = []
    for seed in (1, 1, 2):
        made = suite.load(name, task_kwargs={"random": seed, "time_limit": 0.2})
        found.append(np.array([flat(made.step(action)) for action in actions(60)]))
        made.close()
    assert (found[0] == found[1]).all() and (found[0] != found[2]).any()
    assert (found[0][0] != found[0][21]).any()  # another episode begins otherwise


def test_observations_are_new_arrays(environment: suite.OrthosisEnvironment) -> None:
    steps = [environment.reset()] + [environment.step(np.ones(2)) for _ in range(4)]
    assert all(flat(step).dtype == np.float64 for step in steps)
    arrays = [array for step in steps for array in step.observation.values()]
    assert not any(np.shares_memory(a, b) for a, b in itertools.combinations(arrays, 2))


def test_names_units_and_ranges_are_told(environment: suite.OrthosisEnvironment) -> None:
    spec = environment.observation_spec()
    assert list(spec) == list(environment.task.units) == list(environment.task.meanings)
    assert all(one.name == key and one.minimum < one.maximum for key, one in spec.items())
    assert environment.action_spec().name == "dorsiflexor\tplantarflexor"


@pytest.mark.parametrize("action", [[0.0, 1.5], [float("nan"), 0.0], [0.0, 0.0, 0.0]])
def test_what_is_no_action_steps_nothing(environment: suite.OrthosisEnvironment, action: list[float]) -> None:
    environment.reset()
    before = environment.physics.time()
    with pytest.raises(InputError, match="action"):
        environment.step(np.array(action))
    assert environment.physics.time() == before


def test_flat_observations_are_one_array(name: str) -> None:
    made = suite.load(name, environment_kwargs={"flat_observation": True})
    early = made.observation_spec()["observations"]  # as agents ask, before the first episode
    assert early.shape == (len(TASKS[name].observed),) and early.dtype == np.float64
    seen = made.reset().observation
    assert list(seen) == list(made.observation_spec()) == ["observations"]
    assert seen["observations"].shape == (len(TASKS[name].observed),)
    made.close()


@pytest.mark.parametrize(
    ("words", "match"),
    [
        ({"task_kwargs": {"time_limit": 1e3}}, "time_limit"),
        ({"environment_kwargs": {"n_sub_steps": 3}}, "n_sub_steps"),
        ({"task_kwargs": {"sets": {"timestep": "1 ms"}}}, "timestep"),
    ],
)
def test_wrong_arguments_are_sentences(words: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        suite.load("seated_tracking", **words)
    with pytest.raises(InputError, match="dropfoot_walk"):
        suite.load("dropfoot_wlk")


@pytest.mark.slow
def test_many_random_steps_raise_no_warning(name: str) -> None:
    made = suite.load(name, task_kwargs={"random": 0})
    made.reset()
    for action in actions(size(10_000, 100_000) // made.task.setting.steps, seed=4):
        step = made.step(action)
        assert step.first() or np.isfinite(step.reward)
        assert np.isfinite(flat(step)).all()
    assert not any(warning.number for warning in made.physics.data.ptr.warning)
    made.close()
