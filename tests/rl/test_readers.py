"""What a task reads fast is the column of a run."""

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.metrics import stance
from afo_sim.rl import TASKS
from afo_sim.rl.environments.episodes import Setting, setting
from afo_sim.rl.environments.readers import FIELDS, readers
from afo_sim.rl.environments.task import Sample
from afo_sim.simulation import Stepped, formulas, frame_of

EXACT = ("ankle/", "chamber/", "shank/", "gait/", "ground/")  # the rest is computed in another order


@pytest.fixture(scope="module", params=TASKS)
def made(request: pytest.FixtureRequest) -> Setting:
    return setting(TASKS[request.param])


@pytest.fixture(scope="module")
def rows(made: Setting) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """2.5 s, with the scenario's own timing: rows (n, width) and inputs."""
    stepped = Stepped([made.built], fields=FIELDS)
    inputs = stepped.inputs(0, round(2.5 / made.built.scenario.timestep))
    found = {name: values[0] for name, values in stepped.advance([0], inputs[None]).items()}
    stepped.close()
    return found, inputs


def test_every_reader_gives_the_column(made: Setting, rows: tuple[dict[str, np.ndarray], np.ndarray]) -> None:
    fields, inputs = rows
    n = len(inputs)
    frame, columns = frame_of(made.built, fields, inputs, 0), formulas(made.built)
    sample = Sample(readers(made.built), {name: v.T for name, v in fields.items()}, np.arange(n), np.empty(0))
    shared = set(sample.readers) & set(columns)
    asked = {one.column for one in made.task.observed} | set(made.task.carried)
    assert asked - {""} <= shared
    for name in sorted(shared):
        expected = columns[name](frame)
        error = np.abs(sample[name] - expected).max()
        if name.startswith(EXACT) and not name.endswith("_load"):
            assert error == 0.0, name
        else:
            assert error <= 1e-12 * max(np.abs(expected).max(), 1.0), name


def test_one_simulation_reads_as_several(
    made: Setting, rows: tuple[dict[str, np.ndarray], np.ndarray]
) -> None:
    fields, inputs = rows
    width = made.draw(np.random.default_rng(0))[1].shape[1]
    n = len(inputs)
    script = np.arange(n) * np.ones((width, 1)) * 1e-5
    many = made.sample({name: v.T for name, v in fields.items()}, np.arange(n), script)
    for k in range(0, n, 97):
        one = made.sample({name: v[k] for name, v in fields.items()}, k, script[:, k])
        np.testing.assert_allclose(
            made.observation(one), made.observation(many)[:, k], rtol=1e-12, atol=1e-12
        )


def test_swing_and_push_off_follow_the_recorded_ground() -> None:
    made = setting(TASKS["dropfoot_walk"])
    steps = np.arange(made.built.scenario.n_step)
    sample = Sample(made.readers, {}, steps, np.empty(0))
    standing = stance({"ground/force/z": sample["ground/force/z"]}, made.built.body_mass)
    assert (sample["swing"] == ~standing).all()
    push = sample["push_off"] == 1.0
    assert standing[push].all() and (sample["gait/phase"][push] >= 0.4).all()
    assert 0.15 < push.mean() < 0.3  # from 40 % of the stride to toe-off at some 62 %


def test_walking_on_a_floor_is_refused() -> None:
    with pytest.raises(InputError, match="recorded ground"):
        setting(TASKS["dropfoot_walk"], {"ground.mode": "contact"})
