"""What the seated task reads fast is the column of a run."""

import numpy as np

from afo_sim.rl import TASKS
from afo_sim.rl.environments.episodes import FIELDS, Sight, readers, setting
from afo_sim.rl.environments.task import Sample
from afo_sim.simulation import Stepped, formulas, frame_of


def test_every_reader_gives_the_column_and_one_simulation_reads_as_several() -> None:
    made = setting(TASKS["seated_tracking"])
    stepped = Stepped([made.built], fields=FIELDS)
    inputs = stepped.inputs(0, 1200)
    fields = {name: values[0] for name, values in stepped.advance([0], inputs[None]).items()}
    stepped.close()
    frame, columns, n = frame_of(made.built, fields, inputs, 0), formulas(made.built), len(inputs)
    script = np.arange(n) * np.ones((2, 1)) * 1e-5
    many = Sample(readers(made.built), {name: v.T for name, v in fields.items()}, np.arange(n), script)
    assert {one.column for one in made.task.observed} - {""} <= set(many.readers)
    for name in many.readers:
        assert np.abs(many[name] - columns[name](frame)).max() == 0.0, name
    sight = Sight(made, 1)
    for k in range(0, n, 97):
        one = Sample(many.readers, {name: v[k] for name, v in fields.items()}, k, script[:, k])
        np.testing.assert_array_equal(sight.observation(one), sight.observation(many)[k])
