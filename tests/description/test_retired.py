"""What is retired: a file that has it still is read, and whoever chooses it learns its successor."""

import pathlib

import pytest

import afo_sim
from afo_sim.common import InputError
from afo_sim.physics import RETIRED_FRICTIONS

OWN = pathlib.Path(__file__).parents[1] / "former" / "0.1" / "own" / "my-muscle"  # it has tables of both


def test_tables_of_retired_frictions_are_read_and_dropped() -> None:
    text = (OWN / "muscle.toml").read_text(encoding="utf-8")
    muscle = afo_sim.load("muscle", str(OWN / "muscle.toml"))
    for name in RETIRED_FRICTIONS:
        assert f"[frictions.{name}]" in text
        assert name not in muscle.frictions
    assert set(muscle.frictions) == {"tondu_lopez_2000_stribeck"}


@pytest.mark.parametrize("name", RETIRED_FRICTIONS)
def test_a_retired_friction_that_is_chosen_is_refused_with_its_successor(name: str) -> None:
    for source in (str(OWN / "muscle.toml"), "s1_215mm"):
        with pytest.raises(InputError) as refused:
            afo_sim.load("muscle", source, {"friction": name})
        assert (refused.value.field, refused.value.value) == ("friction", name)
        assert "maxwell_slip" in refused.value.allowed
    assert afo_sim.load("muscle", "s1_215mm", {"friction": "maxwell_slip"}).friction == "maxwell_slip"
