"""Names of the tasks and older names of the rooms; libraries that are missing are one sentence each."""

import importlib
import subprocess
import sys

import pytest

from afo_sim.common import InputError, MissingExtra

HIDDEN = "import sys; sys.modules[{library!r}] = None; import afo_sim.rl.environments; "
MISSING = [
    ("gymnasium", "afo_sim.rl.environments.gym_env", "pip install 'afo-sim[rl]'"),
    ("dm_control", "afo_sim.rl.environments.suite", "pip install 'afo-sim[rl]'"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("library", "module", "words"), MISSING)
def test_a_missing_library_is_one_sentence(library: str, module: str, words: str) -> None:
    code = HIDDEN.format(library=library) + f"import {module}"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    last = found.stderr.strip().splitlines()[-1]
    assert found.returncode == 1 and words in last and "MissingExtra: " in last
    assert issubclass(MissingExtra, ImportError)


def test_older_names_are_the_same_modules() -> None:
    pytest.importorskip("dm_control")
    from afo_sim.rl import physics
    from afo_sim.rl.environments import gym_id, suite

    with pytest.warns(FutureWarning) as notices:
        sys.modules.pop("afo_sim.environments", None)
        from afo_sim.bridge import physics as older_physics
        from afo_sim.environments import gym_id as older_id
        from afo_sim.environments import suite as older_suite
    assert len(notices) == 2
    assert older_physics is physics and older_suite is suite and older_id is gym_id


@pytest.mark.parametrize(
    ("module", "name", "instead"),
    [
        ("afo_sim.rl.entity", "OrthosisEntity", "afo_sim.attach"),
        ("afo_sim.rl", "OrthosisEntity", "afo_sim.attach"),
        ("afo_sim.bridge", "leg_entity", "afo_sim.attach"),
        ("afo_sim.rl.environments.stable_baselines", "OrthosisVecEnv", "DummyVecEnv"),
    ],
)
def test_a_retired_name_is_refused_by_what_to_use(module: str, name: str, instead: str) -> None:
    if "bridge" in module:
        pytest.importorskip("dm_control")
    with pytest.raises(InputError) as error:
        getattr(importlib.import_module(module), name)
    assert error.value.field == name and instead in error.value.allowed


def test_the_benchmarks_task_is_refused_by_the_walk() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    pytest.importorskip("dm_control")
    from afo_sim.rl.environments import suite

    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(InputError) as error:
            make("afo_sim/DropfootDay-v0", patients=[7])
        assert "dropfoot_walk" in error.value.allowed
    with pytest.raises(InputError) as error:
        suite.load("dropfoot_day")
    assert "dropfoot_walk" in error.value.allowed
    with pytest.raises((DeprecationWarning, gymnasium.error.Error)):
        gymnasium.make("afo_sim/DropfootWalk-v1")


def test_gymnasium_finds_a_task_behind_the_older_name() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    sys.modules.pop("afo_sim.environments", None)
    with pytest.warns(FutureWarning, match="afo_sim.rl.environments"):
        made = gymnasium.make("afo_sim.environments:afo_sim/SeatedTracking-v0")
    made.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SeatedTracking-v0", "DropfootWalk-v2"])
def test_gymnasium_makes_a_task_without_another_import(name: str) -> None:
    pytest.importorskip("gymnasium")
    code = (
        f"import gymnasium; print(gymnasium.make('afo_sim.rl.environments:afo_sim/{name}').unwrapped.spec.id)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert found.stdout.strip() == f"afo_sim/{name}", found.stderr
