"""What is shipped, from Python."""

import command
import pytest

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description.schema import SPECS


def test_every_name_that_is_listed_loads() -> None:
    for kind in SPECS:
        names = afo.list(kind)
        assert names and all(afo.load(kind, name).name == name for name in names)


def test_all_is_what_the_command_lists(call: command.Call) -> None:
    found, printed = afo.list(), call("list")[1]
    assert found["muscles"] == afo.list("muscles") == afo.list("muscle")
    assert {"laws", "frictions", "gaits", "limits", "populations"} < set(found)
    assert all(name in printed for kind in found.keys() - {"metrics"} for name in found[kind])


@pytest.mark.parametrize("kind", ["limits", "populations"])
def test_the_command_lists_every_kind_that_it_names(call: command.Call, kind: str) -> None:
    code, printed, _ = call("list", kind)
    assert code == 0 and all(name in printed for name in afo.list(kind))


def test_a_mistyped_kind_is_told_the_nearest() -> None:
    with pytest.raises(InputError) as wrong:
        afo.list("muscels")
    assert (wrong.value.nearest, wrong.value.field) == ("muscles", "kind")
