"""The axis of a wearer at several values."""

import pytest

from afo_sim.show.walker_doses import axis_of


@pytest.mark.parametrize(
    ("values", "axis"),
    [
        ([1, 0.5, 0], ([1.0, 0.5, 0.0], "")),
        (["1 bar", "2.5bar", "1e1 bar"], ([1.0, 2.5, 10.0], "bar")),
        (["1 bar", "200 kPa"], ([0.0, 1.0], None)),  # other units are no one axis
        (["slow", "fast"], ([0.0, 1.0], None)),
        ([1, "slow"], ([0.0, 1.0], None)),
        ([True, False], ([0.0, 1.0], None)),
        (["../a.toml", "./b.toml", "1.2.3"], ([0.0, 1.0, 2.0], None)),
    ],
)
def test_numbers_of_one_unit_are_an_axis_and_others_stand_in_order(values: list, axis: tuple) -> None:
    assert axis_of(values) == axis
