"""Dotted keys laid over a finished scenario, checked as a file's are."""

import numpy as np
import pytest

from afo_sim import InputError, Muscle, Scenario, load, run
from afo_sim.common import names


@pytest.fixture(scope="module")
def walk() -> Scenario:
    return load("scenario", "walk-dropfoot-afo")


@pytest.mark.parametrize("name", sorted(names("scenario")))
def test_setting_a_scenario_is_loading_it_with_the_value(name: str) -> None:
    sets = {"duration": "3.2 s", "supply.pressure": "3 bar"}
    assert load("scenario", name).set(sets) == load("scenario", name, sets)
    assert load("scenario", name).set({}) == load("scenario", name)


def test_the_first_scenario_stays_as_it_was(walk: Scenario) -> None:
    before = walk.model_dump_json()
    walk.set({"phases.dorsiflexor.inlet[0][0]": 0.4})
    assert walk.model_dump_json() == before


def test_a_title_begins_with_what_was_set_since_it_was_written(walk: Scenario) -> None:
    """At its end a narrow terminal or page would cut it off."""
    set_once = load("scenario", "walk-dropfoot-afo", {"patient": "healthy", "supply.pressure": "3 bar"})
    assert set_once.description == f"set supply.pressure=3 bar; set patient=healthy; {walk.description}"
    again = set_once.set({"patient.dorsiflexor_strength": 0.5, "supply.pressure": "2 bar"})
    assert again.description.endswith(f"; set patient=healthy; {walk.description}")
    assert "=3 bar" not in again.description and "set supply.pressure=2 bar; " in again.description
    healthy = load("patient", "healthy").description
    assert again.patient is not None
    assert again.patient.description == f"set dorsiflexor_strength=0.5; {healthy}"
    other = again.set({"patient": "drop-foot", "name": "mine"}).description
    assert other == f"set patient=drop-foot; set supply.pressure=2 bar; {walk.description}"
    timed = walk.set({"phases.dorsiflexor.inlet[0][0]": 0.4}).description
    assert timed == f"set phases.dorsiflexor.inlet[0][0]=0.4; {walk.description}"
    same = load("scenario", "walk-dropfoot-afo", {"patient": "drop-foot"})
    assert same.description == walk.description


def test_a_value_may_be_a_description_or_a_number_of_numpys(walk: Scenario) -> None:
    muscle = load("muscle", "dmsp_20").using(law="kerscher_2006")
    assert isinstance(muscle, Muscle)
    key = "orthosis.muscle.dorsiflexor"
    sets = {
        f"{key}.type": muscle,
        f"{key}.count": np.int64(2),
        "phases.dorsiflexor.inlet[0][0]": np.float64(0.4),
    }
    for made in (walk.set(sets), load("scenario", "walk-dropfoot-afo", sets)):
        group = made.orthosis.muscle["dorsiflexor"]
        assert (group.type, group.count) == (muscle, 2)
        assert made.phases is not None and made.phases.chambers["dorsiflexor"].inlet[0][0] == 0.4
    deeper = walk.set({f"{key}.type": muscle, f"{key}.type.bore": "19 mm"})
    assert deeper.orthosis.muscle["dorsiflexor"].type.bore == 0.019
    whole = walk.set({"orthosis": load("orthosis", "s1"), "patient": load("patient", "drop-foot-mild")})
    assert whole.patient == load("patient", "drop-foot-mild")


def test_a_number_that_was_set_names_the_user_as_its_source(walk: Scenario) -> None:
    key = "orthosis.muscle.dorsiflexor.type"
    assert walk.orthosis.muscle["dorsiflexor"].type.provenance["bore"].kind != "user"
    muscle = walk.set({f"{key}.bore": "19 mm"}).orthosis.muscle["dorsiflexor"].type
    assert muscle.provenance["bore"].kind == "user"
    assert muscle.provenance["end_length"].kind != "user"


def test_a_table_that_is_not_there_can_be_set(walk: Scenario) -> None:
    assert walk.ground is None
    touching = walk.set({"ground.mode": "contact"}).ground
    assert touching is not None and touching.mode == "contact"
    timed = walk.set({"phases": None, "timer": {"period": "2 s", "dorsiflexor": {"inlet": [["0 s", "1 s"]]}}})
    assert timed.timer is not None and timed.phases is None


@pytest.mark.parametrize(
    ("sets", "says"),
    [
        ({"duration": "-4 s"}, "out of range"),
        ({"duration": -4.0}, "no unit"),
        ({"suply.pressure": "3 bar"}, "did you mean 'supply'"),
        ({"supply.presure": "3 bar"}, "did you mean '.*pressure'"),
        ({"supply.pressure": "3 N"}, "newton"),
        ({"patient": "drop"}, "did you mean 'drop-foot'"),
        ({"patient.mass": "72 kg"}, "did you mean 'body_mass'"),
        ({"orthosis.muscle.dorsiflexor.type.law": "sarosi"}, "sarosi"),
        ({"phases.dorsiflexor.inlet[7][0]": 0.1}, "no item"),
        ({"orthosis.muscle.dorsiflexor.type.bore": "30 cm"}, "out of range"),
    ],
)
def test_a_wrong_value_is_refused(walk: Scenario, sets: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        walk.set(sets)


def test_run_takes_a_scenario_with_overrides() -> None:
    seated = load("scenario", "seated", {"duration": "0.3 s"})
    sets = {"supply.pressure": "3 bar"}
    made, named = run(seated, sets), run("seated", {"duration": "0.3 s", **sets})
    assert made.scenario == named.scenario
    assert np.array_equal(made["ankle/angle"], named["ankle/angle"])
    with pytest.raises(InputError, match="out of range"):
        run(seated, {"duration": "-4 s"})
