"""Parts of descriptions that readings share: they are what a reading of its own gives, error for error."""

import copy
import pathlib
import pickle
import random
from typing import Any

import pytest

from afo_sim import InputError, Scenario, load
from afo_sim.common import assets
from afo_sim.description import expand, reader

WALK = expand("scenario", "walk-dropfoot-afo")
TYPE = "orthosis.muscle.dorsiflexor.type"
VALUES: dict[str, tuple[Any, ...]] = {  # right and wrong ones; equal ones of other types
    "supply.pressure": ("3 bar", "3e5 Pa", "4 kg", "-1 bar", 3, None),
    "supply.presure": ("3 bar",),
    "supply.source": ("bottle_0_5l", "nothing"),
    "patient.body_mass": ("70 kg", {"value": "70 kg", "kind": "user", "source": "scale"}, {"kind": "user"}),
    "patient": ("healthy", "nobody", 1.0),
    "phases.dorsiflexor.inlet[0][0]": (0.5, 0.9, "0.5", 2.0),
    "phases.heel.inlet": ([[0.1, 0.2]],),
    "orthosis.muscle.dorsiflexor.count": (1, 1.0, True, 2, 2.0),
    f"{TYPE}": ("dmsp_20", "s1_215mm"),
    f"{TYPE}.nominal_length": ("0.2 m", "20 cm"),
    "orthosis.chamber.dorsiflexor.inlet.conductance": ("0.2 dm^3/(s*bar)", "0.2"),
    "load_moment": ("0 N*m", "-0 N*m"),
    "gait.cycle": ("bovi2011_slow", 7),
    "timestep": ("2 ms", "1 s"),
    "leg.side": ("left", "middle"),
}


def told(sets: dict[str, Any]) -> Any:
    """A scenario to the last sign and type, or each of its errors."""
    try:
        scenario = load("scenario", WALK, sets)
    except InputError as error:
        return [str(each) for each in (error, *error.others)]
    return repr(scenario.model_dump()), repr(scenario), hash(scenario)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_readings_that_share_parts_are_those_that_share_none(seed: int) -> None:
    draw = random.Random(seed)
    cases = [
        {key: draw.choice(VALUES[key]) for key in draw.sample(sorted(VALUES), draw.choice((1, 1, 2, 4)))}
        for _ in range(40)
    ]
    shared = [told(sets) for sets in cases]
    assert sum(isinstance(each, list) for each in shared) in range(5, 36)
    for sets, found in zip(cases, shared, strict=True):
        reader.KEPT.clear()
        assert told(sets) == found, sets


def test_only_parts_that_are_set_are_read_again() -> None:
    one, other = (
        load("scenario", WALK, {"supply.pressure": f"{k} bar", f"{TYPE}.mass": "0.3 kg"}) for k in (2, 3)
    )
    shared = {name for name in Scenario.model_fields if vars(one)[name] is vars(other)[name]}
    assert {"leg", "orthosis", "patient", "shoe", "limits", "gait", "phases", "start"} <= shared
    assert one.supply is not other.supply
    lighter = load("scenario", WALK, {f"{TYPE}.mass": "0.2 kg"}).orthosis
    assert (
        lighter is not one.orthosis and lighter.chamber["dorsiflexor"] is one.orthosis.chamber["dorsiflexor"]
    )


def test_a_part_that_readings_share_refuses_to_be_changed() -> None:
    groups: Any = load("scenario", "seated").orthosis.muscle
    for change in (lambda: groups.clear(), lambda: groups.pop("dorsiflexor"), lambda: groups.update(a=1)):
        with pytest.raises(TypeError, match="is frozen"):
            change()
    assert groups == copy.deepcopy(groups) == pickle.loads(pickle.dumps(groups)) == dict(groups)


def test_a_copy_has_tables_of_its_own_and_shares_what_is_frozen() -> None:
    whole = load("orthosis", "s1")
    own = copy.deepcopy(whole)
    assert own == whole and own.muscle["dorsiflexor"].type is whole.muscle["dorsiflexor"].type
    del own.muscle["plantarflexor"]
    assert list(whole.muscle) == ["dorsiflexor", "plantarflexor"]


def test_a_dict_and_a_file_that_change_between_readings_are_read_anew(tmp_path: pathlib.Path) -> None:
    own = copy.deepcopy(WALK)
    before = load("scenario", own)
    own["supply"]["pressure"] = "2 bar"
    assert (before.supply.pressure, load("scenario", own).supply.pressure) == (4e5, 2e5)
    file, text = tmp_path / "shoe.toml", assets.find("shoe", "trainer").read_text(encoding="utf-8")
    for stack in (30, 31):
        file.write_text(text.replace('"30 mm"', f'"{stack} mm"', 1), encoding="utf-8")
        shoe = load("scenario", WALK, {"shoe": str(file)}).shoe
        assert shoe is not None and shoe.heel_stack == pytest.approx(1e-3 * stack)
