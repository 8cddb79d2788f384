"""What a task reads fast is the column of a run, and one simulation reads as several."""

import numpy as np
import pytest

from afo_sim.rl.environments.episodes import FIELDS, Setting, Sight, readers
from afo_sim.rl.environments.task import Sample
from afo_sim.rl.environments.tasks import setting_of
from afo_sim.rl.environments.walking import CLOSES
from afo_sim.simulation import Stepped, formulas, frame_of


def stepped_on(made: Setting, n: int) -> tuple[Sample, dict[str, np.ndarray]]:
    """A sample of many steps of one simulation, and the columns of a run."""
    stepped, inputs = Stepped([made.built], fields=FIELDS), made.inputs[:n].copy()
    inputs[200:700, made.valves[0]] = 1.0
    fields = {name: values[0] for name, values in stepped.advance([0], inputs[None]).items()}
    stepped.close()
    frame, columns = frame_of(made.built, fields, inputs, 0), formulas(made.built)
    times = np.arange(n) * made.built.scenario.timestep
    script = made.task.script(made.built, times)(np.random.default_rng(0)).T
    found = {**readers(made.built), **made.task.readers(made.built)}
    many = Sample(found, {name: v.T for name, v in fields.items()}, script)
    return many, {name: columns[name](frame) for name in columns if name in found or "height" in name}


@pytest.mark.parametrize("task", ["seated_tracking", "dropfoot_walk"])
def test_every_reader_gives_the_column_and_one_simulation_reads_as_several(task: str) -> None:
    made = setting_of(task)
    many, columns = stepped_on(made, 1200)
    for name in many.readers.keys() & columns.keys() - {"toe/height", "ankle/moment/orthosis"}:
        np.testing.assert_allclose(many[name], columns[name], rtol=1e-12, atol=1e-9, err_msg=name)
    sight = Sight(made, 1)
    for k in range(0, 1200, 97):
        one = Sample(many.readers, {name: v[:, k] for name, v in many.rows.items()}, many.script[:, k])
        np.testing.assert_allclose(sight.observation(one), sight.observation(many)[k], rtol=1e-14, atol=1e-14)


def test_the_seated_readers_give_the_columns_bits() -> None:
    many, columns = stepped_on(setting_of("seated_tracking"), 1200)
    assert many.readers.keys() == columns.keys() & many.readers.keys()
    for name in many.readers:
        assert np.abs(many[name] - columns[name]).max() == 0.0, name


def test_what_a_walk_rewards_is_a_runs_columns() -> None:
    made = setting_of("dropfoot_walk")
    many, columns = stepped_on(made, 2000)
    lowest = np.minimum(columns["ball/height"], columns["toe/height"])
    np.testing.assert_allclose(many["toe/height"], lowest, atol=1e-12)
    moment = columns["ankle/moment/orthosis"] / made.built.body_mass
    np.testing.assert_allclose(many["ankle/moment/orthosis"], moment, atol=1e-9)
    assert np.ptp(moment) > 0.08
    seen = Sight(made, 1).observation(many)
    np.testing.assert_array_equal(seen[:, 2], columns["foot/heel_load"] > CLOSES)
    np.testing.assert_array_equal(seen[:, 3], columns["foot/toe_load"] > CLOSES)
    for k, name, noise in ((0, "shank/angle", 0.1), (1, "shank/velocity", 0.05)):
        assert np.std(seen[:, k] - columns[name]) == pytest.approx(np.radians(noise), rel=0.1)
    assert np.std(seen[:, 5] - columns["chamber/plantarflexor/pressure"]) == pytest.approx(780.0, rel=0.1)
