"""Tasks and actions: three positions of a chamber's valves, and sentences for what is invalid."""

from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.rl import TASKS, coils_of
from afo_sim.rl.environments.episodes import setting
from afo_sim.rl.environments.task import checked
from afo_sim.rl.environments.tasks import SEATED_TRACKING, task_of


def test_a_chamber_is_filled_vented_or_shut() -> None:
    action = np.array([[1.0, -1.0], [0.34, -0.34], [0.33, -0.33], [0.0, 0.0]])
    on = [[1, 0, 0, 1], [1, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]]  # inlet, outlet; inlet, outlet
    assert coils_of(action).tolist() == on
    assert coils_of(action[0]).tolist() == on[0]


def test_both_valves_of_a_chamber_are_never_open() -> None:
    coils = coils_of(np.linspace(-1.0, 1.0, 4001)[:, None])
    assert (coils.sum(axis=1) <= 1.0).all()
    assert {0.0, 1.0} == set(coils.ravel())


@pytest.mark.parametrize(
    ("action", "word"),
    [
        ([0.0, 1.0001], "1.0001"),
        ([float("nan"), 0.0], "nan"),
        ([0.0, -float("inf")], "inf"),
        ([0.0], "(1,)"),
        ([[0.0, 0.0]], "(1, 2)"),
        (["inlet", "shut"], "inlet"),
        (None, "action"),
    ],
)
def test_what_is_no_action_is_refused(action: object, word: str) -> None:
    with pytest.raises(InputError) as error:
        checked(action, (2,))
    assert word in str(error.value)
    assert "\n" not in str(error.value)


def test_single_precision_is_an_action() -> None:
    assert checked(np.array([1.0, -1.0], np.float32), (2,)).tolist() == [1.0, -1.0]


def test_a_wrong_task_has_its_nearest_name() -> None:
    with pytest.raises(InputError, match="seated_tracking"):
        task_of("seated_traking")


@pytest.mark.parametrize("name", TASKS)
def test_every_observed_number_has_a_name_a_unit_a_meaning_and_a_range(name: str) -> None:
    observed = TASKS[name].observed
    assert len({one.name for one in observed}) == len(observed)
    for one in observed:
        assert one.unit and one.meaning and one.low < one.high


@pytest.mark.parametrize("sets", [3, "supply.pressure", [1]])
def test_sets_that_are_no_dict_are_refused(sets: Any) -> None:
    with pytest.raises(InputError, match=r"sets.*is not a dict of keys and values"):
        setting(SEATED_TRACKING, sets)
