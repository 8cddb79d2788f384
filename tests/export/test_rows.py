"""Which rows and columns leave."""

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from afo_sim.common import InputError
from afo_sim.export.rows import LONGEST, legal_names, rows_of
from afo_sim.simulation import Recording


def test_rate_keeps_whole_rows(seated_second: Recording) -> None:
    """500 rows a second: every fifth at 100 Hz."""
    rows = rows_of(seated_second, 100.0)
    assert all(np.array_equal(v, seated_second[n][::5]) for n, v in rows.columns.items()) and not rows.notes


def test_rate_that_cannot_be_had_is_told(seated_second: Recording) -> None:
    rows = rows_of(seated_second, 180.0)
    assert np.array_equal(rows.columns["time"], seated_second["time"][::3])
    assert "166.67 rows a second instead of 180" in rows.notes[0]


@pytest.mark.parametrize("rate", [0.0, -1.0, 510.0, np.nan])
def test_rate_out_of_range_is_refused(seated_second: Recording, rate: float) -> None:
    with pytest.raises(InputError, match="at most the run's own 500 Hz"):
        rows_of(seated_second, rate)


def test_columns_by_pattern(seated_second: Recording) -> None:
    rows = rows_of(seated_second, columns=["chamber/*/pressure", "ankle/angle"])
    pressures = [f"chamber/{group}/pressure" for group in ("dorsiflexor", "plantarflexor")]
    assert list(rows.columns) == ["time", "ankle/angle", *pressures]
    with pytest.raises(InputError, match="did you mean 'ankle/angle'"):
        rows_of(seated_second, columns=["ankle/angel"])


def test_coordinate_that_slides_is_in_metres(walked: Recording) -> None:
    units = rows_of(walked).units
    assert (units["qpos/shank_x"], units["qpos/shank_z"]) == ("m", "m")
    assert (units["qpos/shank_angle"], units["qpos/ankle"]) == ("rad", "rad")
    assert np.array_equal(walked["qpos/shank_x"], walked["ankle/position/x"])  # which is in metres


def test_run_without_rows_or_clock_is_refused(seated_second: Recording) -> None:
    nothing = {name: values[:0] for name, values in seated_second.columns.items()}
    with pytest.raises(InputError, match="no rows: failed: why"):
        rows_of(dataclasses.replace(seated_second, columns=nothing, status="failed: why"))
    twice = seated_second.columns | {"time": np.repeat(seated_second["time"][::2], 2)}
    with pytest.raises(InputError, match="time does not increase"):
        rows_of(dataclasses.replace(seated_second, columns=twice))


@pytest.mark.slow
@given(st.lists(st.text(max_size=90), unique=True, max_size=40))
def test_names_are_legal_and_different(names: list[str]) -> None:
    legal = legal_names(names)
    assert list(legal) == names
    assert len({name.lower() for name in legal.values()}) == len(names)
    assert all(re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST - 1}}}", name) for name in legal.values())


def test_paths_become_words_that_differ() -> None:
    assert legal_names(["muscle/dorsiflexor_1/force"]).popitem()[1] == "muscle_dorsiflexor_1_force"
    assert sorted(legal_names(["a/b_c", "a_b/c", "a/b/c"]).values()) == ["a_b_c", "a_b_c_2", "a_b_c_3"]
