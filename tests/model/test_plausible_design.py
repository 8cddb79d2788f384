"""Persons and devices that cannot exist are named by their field; no answer rests on one."""

import itertools
import random
from typing import Any

import pytest
from campaign import SEED, sampled, size

import afo_sim
from afo_sim.common import InputError, assets, with_code
from afo_sim.model import IMPLAUSIBLE
from afo_sim.model.build import build

ORIGIN, INSERTION = (f"orthosis.muscle.dorsiflexor.{end}.from_joint" for end in ("origin", "insertion"))
ABSURD: dict[str, tuple[Any, ...]] = {  # field: values that no person or worn device has
    "patient.body_mass": ("10 kg", "300 kg"),
    "patient.body_height": ("0.6 m", "2.5 m"),
    "leg.body_mass": ("12 kg", "28 kg", "290 kg"),
    "leg.body_height": ("0.7 m", "2.45 m"),
    "leg.foot_length": ("5 cm", "50 cm"),
    "leg.shank_length": ("10 cm", "90 cm"),
    ORIGIN: (["60 cm", "0 cm", "30 cm"], ["6 cm", "0 cm", "70 cm"], ["6 cm", "40 cm", "30 cm"]),
    INSERTION: (["6.5 cm", "0 cm", "-20 cm"], ["60 cm", "0 cm", "-1 cm"]),
    "gait.stride_time": ("0.4 s", "9 s"),
    "supply.pressure": ("40 bar",),
    "supply.source": ({"kind": "bottle", "volume": "100 l", "filling_pressure": "300 bar"},),
    "limits.bottle_volume": ("90 l",),
    "limits.bottle_pressure": ("1000 bar",),
    "orthosis.muscle.dorsiflexor.count": (20,),
    "orthosis.muscle.dorsiflexor.link_length": ("80 cm",),
    "orthosis.muscle.dorsiflexor.slack": ("60 cm",),
    "orthosis.muscle.dorsiflexor.cable.stiffness": ("100 N/m",),
    "orthosis.anchor.shank.stiffness": ("20 N/m",),
    "orthosis.interface.shank.area": ("1 cm^2", "9000 cm^2"),
    "orthosis.interface.shank.friction": (1.9,),
    "orthosis.outsole.heel_stack": ("14 cm",),
}
SINGLE = [{field: value} for field, values in ABSURD.items() for value in values]
PAIRS = [a | b for a, b in itertools.combinations(SINGLE, 2) if not a.keys() & b.keys()]
DRAWN = [*SINGLE, *random.Random(1).sample(PAIRS, 200 - len(SINGLE))]


def named(sets: dict[str, Any]) -> tuple[set[str], bool]:
    """Fields that are refused or doubted, and whether the design was refused."""
    try:
        found = build("walk-dropfoot-afo", sets).warnings
    except InputError as error:
        return {str(error)}, True
    return {each.subject for each in with_code(found, IMPLAUSIBLE)}, False


@pytest.mark.parametrize("sets", sampled(DRAWN, 40))
def test_an_absurd_design_is_named_by_its_field_or_refused(sets: dict[str, Any]) -> None:
    """Each field of a pair, unless one has the design refused."""
    fields, refused = named(sets)
    for field in sets:
        start = field.removesuffix(".source") if field == "supply.source" else field
        assert refused or any(start in name for name in fields), (field, fields)


@pytest.mark.parametrize("sets", sampled(SINGLE, 6))
def test_no_answer_that_rests_on_it_is_good(sets: dict[str, Any]) -> None:
    try:
        walk = afo_sim.run("walk-dropfoot-afo", sets | {"duration": "3 s", "timestep": "2 ms"})
    except InputError:
        return
    assert not walk.ok or [answer.status for answer in walk.verdict].count("good") == 0


def test_nothing_that_is_shipped_is_doubted() -> None:
    for name in assets.names("scenario"):
        assert with_code(build(name).warnings, IMPLAUSIBLE) == []


@pytest.mark.parametrize("number", range(size(20, 300)))
def test_no_plausible_person_and_device_is_doubted(number: int) -> None:
    """Children to tall adults of usual mass, devices about S1's: masses by the index of their height."""
    dice = random.Random(SEED + number)
    tall = dice.uniform(0.95, 2.05)
    mass = dice.uniform(14.5, 19.0) * tall**2 if tall < 1.4 else dice.uniform(17.5, 42.0) * tall**2
    sets = {
        "patient.body_mass": f"{mass:.1f} kg",
        "patient.body_height": f"{tall:.2f} m",
        "supply.pressure": f"{dice.uniform(2.0, 6.0):.2f} bar",
        "orthosis.muscle.dorsiflexor.count": dice.randint(1, 5),
        "orthosis.muscle.dorsiflexor.link_length": f"{dice.uniform(9.5, 12.0):.2f} cm",
        ORIGIN: [f"{dice.uniform(4.5, 7.0):.2f} cm", "0 cm", f"{dice.uniform(29.0, 31.0):.1f} cm"],
        "orthosis.anchor.shank.stiffness": f"{dice.uniform(1.0, 20.0):.1f} kN/m",
        "orthosis.interface.shank.area": f"{dice.uniform(60.0, 350.0):.0f} cm^2",
    }
    fields, refused = named(sets)
    assert refused or fields == set(), sets
