"""What an environment is made from, and what is refused of it."""

from typing import Any

import pytest

from afo_sim.common.errors import InputError
from afo_sim.rl.environments.episodes import setting
from afo_sim.rl.environments.tasks import SEATED_TRACKING


@pytest.mark.parametrize("sets", [3, "supply.pressure", [1]])
def test_sets_that_are_no_dict_are_refused(sets: Any) -> None:
    with pytest.raises(InputError, match=r"sets.*is no dict of keys and values"):
        setting(SEATED_TRACKING, sets)
