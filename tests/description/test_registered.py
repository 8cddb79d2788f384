"""Parts of a user's own: their names stand for them as shipped ones do."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import assets, packed
from afo_sim.description import Valve, product
from afo_sim.description.keys import keys

KINDS = (
    "valve", "sensor", "muscle", "tube", "source", "regulator", "patient", "shoe", "leg", "orthosis",
    "limits",
)  # fmt: skip
INLET = "orthosis.chamber.dorsiflexor.inlet"


def a_valve(name: str = "my_valve", conductance: str = "0.3 l/(s*bar)") -> Valve:
    return afo.load("valve", "mh1", {"name": name, "conductance": conductance})


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_part_is_found_by_its_name_as_it_was_registered(kind: str) -> None:
    part = afo.load(kind, assets.names(kind)[0], {"name": "mine"})
    afo.register(part)
    assert afo.load(kind, "mine") == part
    assert assets.names(kind)[-1] == "mine"


def test_a_run_with_a_name_is_the_run_with_what_it_stands_for(tmp_path: pathlib.Path) -> None:
    valve, short = a_valve(), {"duration": "0.2 s"}
    told = afo.run("seated", {INLET: valve, **short})
    afo.register(valve)
    named = afo.run("seated", {INLET: "my_valve", **short})
    assert np.array_equal(named["chamber/dorsiflexor/pressure"], told["chamber/dorsiflexor/pressure"])
    shipped = afo.run("seated", short)
    assert not np.array_equal(named["chamber/dorsiflexor/pressure"], shipped["chamber/dorsiflexor/pressure"])

    text = assets.find("orthosis", "s1").read_text(encoding="utf-8")
    assert text.count('inlet = "mh1"') > 1
    (tmp_path / "s2.toml").write_text(text.replace('inlet = "mh1"', 'inlet = "my_valve"', 1))
    written = afo.load("orthosis", tmp_path / "s2.toml")
    assert [chamber.inlet.name for chamber in written.chamber.values()].count("my_valve") == 1


def test_a_cell_that_runs_again_replaces_what_it_registered() -> None:
    afo.register(a_valve())
    afo.register(a_valve(conductance="0.6 l/(s*bar)"))
    assert afo.load("valve", "my_valve").conductance == pytest.approx(0.6e-8)  # l/(s bar) = 1e-8 m³/(s Pa)


def test_the_name_of_a_shipped_part_or_none_is_refused() -> None:
    for name, field in (("mh1", "name"), ("", "register")):
        with pytest.raises(afo.InputError) as refused:
            afo.register(a_valve(name))
        assert refused.value.field == field and "my_valve" in refused.value.allowed
    afo.register(afo.load("valve", "mh1"))  # as a module has it at its top
    assert not assets.OWN


def test_a_misspelt_name_is_told_the_registered_one() -> None:
    afo.register(a_valve())
    with pytest.raises(afo.InputError) as refused:
        afo.load("scenario", "seated", {INLET: "my_valv"})
    assert refused.value.nearest == "my_valve" and "my_valve" in refused.value.allowed
    assert refused.value.field == "chamber.dorsiflexor.inlet"


def test_what_is_wrong_below_a_registered_part_names_the_whole_key() -> None:
    afo.register(afo.load("orthosis", "s1", {"name": "mine"}))
    with pytest.raises(afo.InputError) as refused:
        afo.load("scenario", "seated", {"orthosis": "mine", f"{INLET}.critical_ratio": 2.0})
    assert refused.value.field == f"{INLET}.critical_ratio"


def test_keys_and_lists_say_that_it_was_registered() -> None:
    afo.register(a_valve())
    (found,) = keys("seated", f"{INLET}.conductance", {INLET: "my_valve"})
    assert found.source == "registered" and found.kind == "user"
    ((title, _, rows),) = product("my_valve")
    assert "my_valve" in title and "conductance" in [row[0] for row in rows]


def test_another_process_knows_the_name_without_any_file() -> None:
    afo.register(a_valve())
    code = "import sys, afo_sim; from afo_sim.common import take; take(sys.stdin.buffer.read());"
    code += "print(afo_sim.load('valve', 'my_valve').conductance)"
    done = subprocess.run([sys.executable, "-c", code], input=packed(), capture_output=True, check=True)
    assert float(done.stdout) == a_valve().conductance
