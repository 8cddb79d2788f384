"""Dotted keys that read a description as they set it."""

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description.keys import keys


@pytest.mark.parametrize("name", ["seated", "walk-dropfoot-afo"])
def test_every_key_that_can_be_set_is_read(name: str) -> None:
    scenario = afo.load("scenario", name)
    listed = keys(name)
    assert len(listed) > 200
    for key in listed:
        there = key.key in scenario
        assert there, key.key
        if key.value == "":
            assert not scenario[key.key], key.key


def test_a_number_is_read_in_si_as_the_attribute_has_it() -> None:
    walk = afo.load("scenario", "walk-dropfoot-afo")
    set_to = {
        "supply.pressure": ("3 bar", 3e5),
        "shank.mass": ("3.2 kg", 3.2),
        "phases.dorsiflexor.inlet[0][1]": (0.9, 0.9),
        "orthosis.muscle.dorsiflexor.insertion.from_joint[0]": ("6 cm", 0.06),
        "orthosis.muscle.dorsiflexor.insertion.from_ankle[2]": ("-1 cm", -0.01),
    }
    known = {key: value for key, value in set_to.items() if key in walk}
    assert len(known) >= 4
    changed = walk.set({key: text for key, (text, _) in known.items()})
    for key, (_, number) in known.items():
        assert np.isclose(changed[key], number, rtol=1e-12), key
    assert changed["supply.pressure"] == changed.supply.pressure
    assert changed["supply"] is changed.supply and changed["supply.source"] is None


def test_parts_read_their_own_keys_one_by_one_or_dotted() -> None:
    walk = afo.load("scenario", "walk-dropfoot-afo")
    group = walk["orthosis"]["muscle"]["dorsiflexor"]
    assert group is walk.orthosis.muscle["dorsiflexor"] is walk.orthosis["muscle.dorsiflexor"]
    assert walk.phases is not None
    assert walk["phases.dorsiflexor.inlet"] == walk.phases["dorsiflexor.inlet"]
    muscle = afo.load("muscle", "dmsp_20")
    law = muscle.laws[muscle.law]
    for name, value in law.parameters.items():
        assert muscle[f"laws.{muscle.law}.{name}"] == value


@pytest.mark.parametrize(
    ("key", "field", "nearest"),
    [
        ("supply.presure", "supply.presure", "pressure"),
        ("suply.pressure", "suply", "supply"),
        ("phases.dorsiflexr.inlet", "phases.dorsiflexr", "dorsiflexor"),
        ("orthosis.muscle.dorsiflexor.type.laww", "orthosis.muscle.dorsiflexor.type.laww", "law"),
    ],
)
def test_a_mistyped_key_is_told_the_nearest(key: str, field: str, nearest: str) -> None:
    walk = afo.load("scenario", "walk-dropfoot-afo")
    with pytest.raises(InputError) as wrong:
        walk[key]
    assert (wrong.value.field, wrong.value.nearest) == (field, nearest)
    assert key not in walk and walk.get(key, 1) == 1 and "\n" not in str(wrong.value)


@pytest.mark.parametrize("key", ["supply.pressure.x", "phases.dorsiflexor.inlet[9]", "supply[0]", "a[b"])
def test_a_key_that_leads_nowhere_is_refused(key: str) -> None:
    with pytest.raises(InputError):
        afo.load("scenario", "walk-dropfoot-afo")[key]
