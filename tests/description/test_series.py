"""What stands in series with a muscle: cable, cuff and plate, as described, set, swept and refused."""

import math
import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest

from afo_sim import load, span, sweep
from afo_sim.common import InputError, assets
from afo_sim.description import Mounting, MuscleGroup, Scenario, field_at
from afo_sim.description.attachment import Cable
from afo_sim.description.keys import keys
from afo_sim.model.build import build

SHANK = "orthosis.anchor.shank"
FRONT = "orthosis.muscle.dorsiflexor"
LAW = {"force": "33 N", "length": "17 mm"}


@pytest.fixture(scope="module")
def walk() -> Scenario:
    return load("scenario", "walk-dropfoot-afo")


def group(**values: Any) -> MuscleGroup:
    """Three muscles between a shank's point 30 cm above and a foot's point 2 cm below the ankle."""
    origin = {"segment": "shank", "from_joint": ["6 cm", "0 cm", "30 cm"]}
    insertion = {"segment": "foot", "from_joint": ["6 cm", "0 cm", "-2 cm"]}
    table = {"count": 3, "type": "s1_215mm", "origin": origin, "insertion": insertion, "link_length": "10 cm"}
    for key, value in values.items():
        part, _, name = key.partition("_")
        if part in ("origin", "insertion"):
            table[part] = {**table[part], name: value}
        else:
            table[key] = value
    text = {"range_of_motion": ["-9 deg", "9 deg"], "muscle": {"front": table}, "chamber": {"front": AIR}}
    return load("orthosis", text).muscle["front"]


AIR = {"inlet": "mh1", "outlet": "mh1", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"}


def test_without_tables_anchors_are_rigid_and_cables_stiff(walk: Scenario) -> None:
    assert load("orthosis", "arm").anchor == {}
    assert Cable() == Cable(stiffness="1e6 N/m", offset="0 mm")


def test_a_rigid_anchor_is_set_to_a_stiffness(walk: Scenario) -> None:
    soft = walk.set({"orthosis.anchor": {}}).set({f"{SHANK}.stiffness": "8kN/m"})
    assert soft.orthosis.anchor == {"shank": Mounting(stiffness="8000 N/m")}
    both = soft.set({"orthosis.anchor.foot": {"stiffness": "50 kN/m", "damping": "190 N*s/m"}})
    assert (both.orthosis.anchor["foot"].damping, list(both.orthosis.anchor)) == (190.0, ["shank", "foot"])
    assert both.set({"orthosis.anchor": {}}).orthosis.anchor == {}


def test_what_is_described_is_read_again(walk: Scenario) -> None:
    sets = {SHANK: {"stiffening": LAW}, f"{FRONT}.cable": {"stiffness": "80 kN/m", "offset": "7.5 mm"}}
    made = walk.set(sets)
    assert load("scenario", made.resolved()) == made
    law = made.orthosis.anchor["shank"].stiffening
    assert law is not None and (law.force, law.length) == (33.0, 0.017)
    stated = {"value": "13 kN/m", "kind": "derived", "source": "185 torques"}
    cable = walk.set({f"{FRONT}.cable.stiffness": stated}).orthosis.muscle["dorsiflexor"].cable
    assert (cable.stiffness, cable.provenance["stiffness"].kind) == (13e3, "derived")


def test_keys_list_what_is_there(walk: Scenario) -> None:
    bare = walk.set({"orthosis.anchor": {}})
    assert field_at(f"{SHANK}.stiffness", bare).unit == "N/m"
    assert field_at(f"{SHANK}.stiffness", bare).value is None
    assert field_at(f"{FRONT}.cable.offset", bare).unit == "m"
    found = {key.key: key.value for key in keys("walk-dropfoot-afo", sets={SHANK: {"stiffening": LAW}})}
    assert found[f"{SHANK}.stiffening.length"] == "17 mm"
    assert {f"{FRONT}.cable.stiffness", f"{FRONT}.cable.offset"} < set(found)
    assert f"{FRONT}.type.return_stiffness" in found


def test_a_sweep_goes_from_rigid_over_stiffnesses() -> None:
    rigid = load("scenario", "seated", {"duration": "20 ms", "orthosis.anchor": {}})
    found = sweep(rigid, {f"{SHANK}.stiffness": span("2 kN/m", "8 kN/m", 3, scale="log")}, threads=1)
    assert found["stiffness"] == pytest.approx([2e3, 4e3, 8e3], rel=1e-12)
    assert set(found["status"]) == {"ok"}


@pytest.mark.parametrize(
    ("sets", "field", "says"),
    [
        ({f"{SHANK}.stiffness": "0 N/m"}, f"{SHANK}.stiffness", "out of range"),
        ({f"{SHANK}.stiffness": "-4 kN/m"}, f"{SHANK}.stiffness", "out of range"),
        ({f"{SHANK}.stiffness": "4 kN"}, f"{SHANK}.stiffness", "does not convert"),
        ({SHANK: {}}, f"{SHANK}.stiffness", "is missing"),
        ({SHANK: {"damping": "1 N*s/m"}}, f"{SHANK}.damping", "needs a stiffness"),
        ({SHANK: {"stiffness": "4 kN/m", "stiffening": LAW}}, f"{SHANK}.stiffness", "conflicts with"),
        ({SHANK: {"stiffening": {"force": "33 N"}}}, f"{SHANK}.stiffening.length", "is missing"),
        ({SHANK: {"stiffening": LAW | {"length": "0 mm"}}}, f"{SHANK}.stiffening.length", "out of range"),
        ({SHANK: {"stiffening": LAW | {"force": "0 N"}}}, f"{SHANK}.stiffening.force", "out of range"),
        ({SHANK: {"stiffness": "4 kN/m", "damping": "-1 N*s/m"}}, f"{SHANK}.damping", "out of range"),
        ({"orthosis.anchor.shnak.stiffness": "4 kN/m"}, "orthosis.anchor.shnak", "did you mean 'shank'"),
        ({f"{SHANK}.stifness": "4 kN/m"}, f"{SHANK}.stifness", "did you mean 'stiffness'"),
        ({f"{FRONT}.cable.stiffness": "0 N/m"}, f"{FRONT}.cable.stiffness", "out of range"),
        ({f"{FRONT}.cable.offset": "-1 mm"}, f"{FRONT}.cable.offset", "out of range"),
        ({f"{FRONT}.cable.offset": "32 cm"}, f"{FRONT}.cable.offset", "path between the anchors"),
        ({f"{FRONT}.type.return_stiffness": "-1 N"}, f"{FRONT}.type.return_stiffness", "out of range"),
    ],
)
def test_what_cannot_be_is_refused_with_its_field(
    walk: Scenario, sets: dict[str, Any], field: str, says: str
) -> None:
    with pytest.raises(InputError, match=says) as refused:
        walk.set({"orthosis.anchor": {}}).set(sets)
    assert refused.value.field == field


def test_anchors_that_no_muscle_pulls_on_are_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="over pulleys") as refused:
        load("orthosis", "arm_s1", {"anchor.proximal.stiffness": "4 kN/m"})
    assert refused.value.field == "anchor"
    with pytest.raises(InputError, match="there is no muscle"):
        load("orthosis", "none", {"anchor.foot.stiffness": "4 kN/m"})
    assert load("orthosis", "arm").anchored == {}


def test_an_offset_makes_a_muscle_slacker_by_its_length() -> None:
    """The contraction at which the chain is taut, 1 − (x − s)/L0, grows by offset/L0 on either mounting."""
    for name in ("s1", "arm"):
        key = f"muscle.{'dorsiflexor' if name == 's1' else 'flexor'}"
        taut, slack = (load("orthosis", name, {f"{key}.cable.offset": o}) for o in ("0 mm", "7.5 mm"))
        before, after = (next(iter(o.muscle.values())) for o in (taut, slack))
        assert after.series_length - before.series_length == pytest.approx(7.5e-3, abs=1e-15)


def test_path_is_the_models_at_an_angle_of_zero(walk: Scenario) -> None:
    sets = {f"{FRONT}.origin.spacing": "4 cm", f"{FRONT}.insertion.from_joint[1]": "1 cm"}
    built = build(walk.set(sets))
    data = mujoco.MjData(built.model)
    data.qpos[built.index.ankle_qpos] = 0.0
    mujoco.mj_kinematics(built.model, data)
    mujoco.mj_tendon(built.model, data)
    for name, made in built.scenario.orthosis.muscle.items():
        ids = [i for muscle, i in built.index.muscles.items() if muscle.rsplit("_", 1)[0] == name]
        lengths = [data.ten_length[built.model.actuator_trnid[i, 0]] for i in ids]
        assert made.path_lengths == pytest.approx(lengths, abs=1e-9)


@pytest.mark.parametrize(
    ("values", "alike"),
    [
        ({}, True),
        ({"origin_spacing": "2 cm", "insertion_spacing": "2 cm"}, True),
        ({"origin_spacing": "2 cm", "insertion_spacing": "3 cm"}, False),
        ({"origin_spacing": "2 cm", "insertion_spacing": "3 cm", "count": 1}, True),
        # two stand equally far aside of the middle, to either side
        ({"origin_spacing": "2 cm", "insertion_spacing": "3 cm", "count": 2}, True),
        ({"origin_spacing": "2 cm", "count": 2, "insertion_from_joint": ["6 cm", "1 cm", "-2 cm"]}, False),
    ],
)
def test_muscles_are_alike_where_their_paths_are_equally_long(values: dict[str, Any], alike: bool) -> None:
    made = group(**values)
    assert made.alike is alike
    assert bool(np.ptp(made.path_lengths) < 1e-12) is alike


def test_muscles_over_a_pulley_are_alike() -> None:
    assert all(
        muscles.alike and not muscles.path_lengths for muscles in load("orthosis", "arm_s1").muscle.values()
    )


@pytest.mark.parametrize("pull", [0.5, 33.0, 150.0, 900.0])
def test_displacement_of_a_mounting_inverts_its_law(pull: float) -> None:
    linear, stiffening = Mounting(stiffness="4 kN/m"), Mounting(stiffening=LAW)
    assert linear.displacement(pull) * 4e3 == pytest.approx(pull, rel=1e-12)
    assert 33.0 * math.expm1(stiffening.displacement(pull) / 0.017) == pytest.approx(pull, rel=1e-12)
    assert linear.displacement(-pull) == stiffening.displacement(-pull) == 0.0


def test_every_shipped_muscle_says_what_brings_it_back() -> None:
    for name in assets.names("muscle"):
        muscle = load("muscle", name)
        assert muscle.provenance["return_stiffness"].kind == "assumed"
        assert muscle.return_stiffness == (0.0 if muscle.law.endswith("_bladder") else 20.0), name


def test_a_chamber_of_pulleys_and_anchors_is_refused_where_the_anchors_give() -> None:
    over = {"count": 1, "type": "s1_215mm", "pulley": {"radius": "5 cm", "direction": "positive"}}
    sets = {"orthosis.muscle.over": over | {"chamber": "dorsiflexor"}}
    with pytest.raises(InputError, match=r"over pulleys and between anchors") as refused:
        load("scenario", "walk-dropfoot-afo", sets)
    assert "chamber.dorsiflexor" in str(refused.value)
