"""Patients of a condition: how they are drawn, whose bodies they have, and which files are refused."""

import math
import pathlib
import re
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError, assets
from afo_sim.model import person_of
from afo_sim.walker import build_body, prepared, read_gait, walk_body
from afo_sim.walker.body import BARE
from afo_sim.walker.population import SHARES, Range, as_drawn, draw, draw_about, read_condition

SHIPPED = ("contracture", "drop-foot", "drop-foot-both", "healthy", "plantarflexor-weak", "spastic")
SOURCE = 'source = "assumed"'
# What is wrong in a condition's file: the table of its ranges, or more; and what an error has to name.
GOOD = f"[drawn]\ntibialis = {{ from = 0.0, to = 0.3, {SOURCE} }}\n"


def write(folder: pathlib.Path, text: str) -> pathlib.Path:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_conditions_are_the_shipped_ones_and_each_draws_within_its_ranges() -> None:
    assert tuple(assets.names("population")) == SHIPPED
    for name in SHIPPED:
        condition = read_condition(name)
        drawn = condition.draw()
        assert condition.name == name and len(drawn) == condition.patients == 20
        assert drawn == read_condition(name).draw()
        for key, each in condition.ranges.items():
            values = np.array([one[key] for one in drawn])
            assert each.source and np.isfinite(values).all(), (name, key)
            if each.sd:  # one in each twentieth, whose ends are quantiles of the lognormal
                assert (values > 0.0).all()
                parts = [NormalDist(math.log(each.median), each.sd).cdf(math.log(x)) * 20.0 for x in values]
            else:
                assert each.low <= values.min() and values.max() <= each.high
                parts = list((values - each.low) / (each.high - each.low) * 20.0)
            assert sorted(map(math.floor, parts)) == list(range(20)), (name, key)


@pytest.mark.parametrize("count", [1, 2, 7, 400])
def test_a_draw_hits_each_of_as_many_parts_once(count: int) -> None:
    ranges = {"a": Range(-2.0, 6.0), "b": Range(median=0.6, sd=0.5), "c": Range(3.0, 3.0)}
    drawn = draw(ranges, count, [3, 7])
    shares = (drawn["a"] + 2.0) / 8.0, NormalDist(math.log(0.6), 0.5).cdf
    assert sorted((shares[0] * count).astype(int)) == list(range(count))
    assert sorted(int(shares[1](math.log(x)) * count) for x in drawn["b"]) == list(range(count))
    assert (drawn["c"] == 3.0).all()
    assert all((drawn[n] == draw(ranges, count, [3, 7])[n]).all() for n in ranges)
    assert (drawn["a"] != draw(ranges, count, [4, 7])["a"]).all()
    if count > 10:  # numbers do not go together
        assert abs(np.corrcoef(drawn["a"], drawn["b"])[0, 1]) < 4.0 / math.sqrt(count)


@pytest.mark.parametrize("share", [0.001, 0.025, 0.5, 0.84134, 0.999])
def test_quantiles_of_a_lognormal_are_those_of_the_normal_of_its_logarithm(share: float) -> None:
    found = Range(median=0.6, sd=0.5).at(share)
    assert found == pytest.approx(0.6 * math.exp(0.5 * NormalDist().inv_cdf(share)), rel=1e-9)
    assert Range(2.0, 8.0).at(share) == pytest.approx(2.0 + 6.0 * share)


def test_a_drawn_patient_has_exactly_its_numbers() -> None:
    scenario = prepared("walk-dropfoot-afo", {"timestep": "1 ms", "patient": "spastic"})
    own = {"tibialis": 0.5, "soleus": 0.9}
    numbers = {
        "tibialis": 0.2,
        "left_vasti": 0.7,
        "plantarflexors": 0.5,
        "left_plantarflexors": 0.25,
        "strength": 0.8,
        "tissue": 1.5,
        "mass": 1.2,
        "height": 0.9,
        "cuff": 3e3,
        "patient.spasticity": 2.5,
        "patient.passive_offset": -10.0,
    }
    units = {"patient.spasticity": "N*m*s/rad", "patient.passive_offset": "deg"}
    worn, left = as_drawn(scenario, own, numbers, worn=True, units=units)
    muscles = [name for name in SHARES if not name.endswith("plantarflexors")]
    expected = dict.fromkeys(muscles, 0.8) | {
        "tibialis": 0.8 * 0.2,
        "left_vasti": 0.8 * 0.7,
        "soleus": 0.8 * 0.9 * 0.5,
        "gastrocnemius": 0.8 * 0.5,
        "left_soleus": 0.8 * 0.25,
        "left_gastrocnemius": 0.8 * 0.25,
    }
    assert len(left) == 14 and left == pytest.approx(expected, rel=1e-12)
    before, after, patient = person_of(scenario), person_of(worn), worn.patient
    assert patient is not None and scenario.patient is not None
    assert after.body_mass == pytest.approx(1.2 * before.body_mass, rel=1e-12)
    assert after.body_height == pytest.approx(0.9 * before.body_height, rel=1e-12)
    assert patient.passive_scale == pytest.approx(1.5 * scenario.patient.passive_scale, rel=1e-12)
    assert patient.spasticity == pytest.approx(2.5) and patient.passive_offset == pytest.approx(-math.pi / 18)
    assert worn.orthosis.anchor["shank"].stiffness == pytest.approx(3e3)
    bare, same = as_drawn(scenario, own, numbers, worn=False, units=units)
    assert same == left and bare.patient == patient and bare.orthosis.name == "none"
    assert not bare.orthosis.muscle and bare.shoe == worn.shoe
    assert own == {"tibialis": 0.5, "soleus": 0.9}  # the given one stays


def test_a_patient_without_numbers_is_the_stated_one() -> None:
    scenario = prepared("walk-dropfoot-afo", {"timestep": "1 ms"})
    worn, left = as_drawn(scenario, {"tibialis": 0.0}, {}, worn=True)
    before, after = person_of(scenario), person_of(worn)
    assert left == {"tibialis": 0.0}
    assert (before.body_mass, before.body_height) == (after.body_mass, after.body_height)
    assert scenario.patient is not None and worn.patient is not None
    assert scenario.patient.passive_scale == worn.patient.passive_scale


def test_a_conditions_file_is_read_with_its_defaults(tmp_path: pathlib.Path) -> None:
    condition = read_condition(write(tmp_path, GOOD))
    assert (condition.name, condition.patients, condition.seed) == ("mine", 20, 1)
    assert pathlib.Path(condition.patient).parent.name == "healthy"
    assert condition.ranges == {"tibialis": Range(0.0, 0.3, source="assumed")}
    other = read_condition(write(tmp_path, f"seed = 2\npatients = 3\n{GOOD}"))
    assert (
        len(other.draw()) == 3
        and other.draw() != read_condition(write(tmp_path, f"patients = 3\n{GOOD}")).draw()
    )
    fixed = read_condition(write(tmp_path, GOOD.replace("0.0", "0.3")))  # nobody differs
    assert {one["tibialis"] for one in fixed.draw()} == {0.3}


@pytest.mark.parametrize(
    ("drawn", "field", "allowed"),
    [
        (f"tibialis = {{ from = 0.3, to = 0.0, {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = -0.1, to = 0.3, {SOURCE} }}", "drawn.tibialis", "0 to 2"),
        (f"tibialis = {{ from = 0.0, to = 9.0, {SOURCE} }}", "drawn.tibialis", "0 to 2"),
        (f"tibialis = {{ from = 0.0, to = nan, {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = 0.0, to = inf, {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = 0.0, to = 1e999, {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = false, to = true, {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f'tibialis = {{ from = "0 kg", to = "0.3 kg", {SOURCE} }}', "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = 0.0, to = [0.3], {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = 0.0, too = 0.3, {SOURCE} }}", "drawn.tibialis", "from and to"),
        (f"tibialis = {{ from = 0.0, {SOURCE} }}", "drawn.tibialis.to", ""),
        ("tibialis = { from = 0.0, to = 0.3 }", "drawn.tibialis.source", ""),
        ('tibialis = { from = 0.0, to = 0.3, source = " " }', "drawn.tibialis", "source"),
        ("tibialis = { from = 0.0, to = 0.3, source = true }", "drawn.tibialis", "source"),
        ("tibialis = 0.3", "drawn.tibialis", "from and to"),
        ("tibialis = [0.0, 0.3]", "drawn.tibialis", "from and to"),
        (f"tissue = {{ median = 1.0, sd = 2.0, {SOURCE} }}", "drawn.tissue", "median and sd"),
        (f"tissue = {{ median = 1.0, sd = 0.0, {SOURCE} }}", "drawn.tissue", "median and sd"),
        (f"tissue = {{ median = 1.0, sd = nan, {SOURCE} }}", "drawn.tissue", "median and sd"),
        (f"tissue = {{ median = true, sd = 0.5, {SOURCE} }}", "drawn.tissue", "median and sd"),
        (f"tissue = {{ median = 1.0, sd = 0.5, to = 2.0, {SOURCE} }}", "drawn.tissue", "median and sd"),
        (f"mass = {{ from = 0.0, to = 1.0, {SOURCE} }}", "drawn.mass", "0.2 to 4"),
        (f"mass = {{ from = 1.0, to = 10.0, {SOURCE} }}", "drawn.mass", "0.2 to 4"),
        (f"height = {{ from = 1.0, to = 2.0, {SOURCE} }}", "drawn.height", "0.5 to 1.4"),
        (f"strength = {{ from = 0.0, to = 1.0, {SOURCE} }}", "drawn.strength", "0.1 to 2"),
        (f'cuff = {{ from = "8 kN/m", to = "2 kN/m", {SOURCE} }}', "drawn.cuff", "from and to"),
        (f'cuff = {{ from = "-8 kN/m", to = "2 kN/m", {SOURCE} }}', "drawn.cuff", "100 to 1e+06"),
        (f'cuff = {{ from = "2 kN", to = "8 kN", {SOURCE} }}', "drawn.cuff", "from and to"),
        (f"cuff = {{ from = 2000, to = 8000, {SOURCE} }}", "drawn.cuff", "from and to"),
        (f"cuff = {{ median = 1.0, sd = 0.5, {SOURCE} }}", "drawn.cuff", "100 to 1e+06"),
        (
            f'"patient.spasticity" = {{ from = "1 N*m*s/rad", to = "5 mm", {SOURCE} }}',
            *("drawn.patient.spasticity", "from and to"),
        ),
        (
            f'"patient.spasticity" = {{ from = "1 mm", to = "5 mm", {SOURCE} }}',
            *("drawn.patient.spasticity", "100 N*m*s/rad"),
        ),
        (
            f'"patient.spasticity" = {{ from = "-1 N*m*s/rad", to = "5 N*m*s/rad", {SOURCE} }}',
            *("drawn.patient.spasticity", "at least 0"),
        ),
        (
            f'"patient.spasticity" = {{ from = 1, to = 5, {SOURCE} }}',
            "drawn.patient.spasticity",
            "at least 0",
        ),
    ],
)
def test_a_range_that_is_none_names_file_field_and_what_is_allowed(
    drawn: str, field: str, allowed: str, tmp_path: pathlib.Path
) -> None:
    file = write(tmp_path, f"[drawn]\n{drawn}\n")
    with pytest.raises(InputError) as found:
        read_condition(file)
    assert (found.value.file, found.value.field) == (file, field)
    assert allowed in found.value.allowed and "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("text", "field", "nearest"),
    [
        (f"patiens = 3\n{GOOD}", "patiens", "patients"),
        (GOOD.replace("tibialis", "tibalis"), "drawn.tibalis", "tibialis"),
        (GOOD.replace("tibialis", "left_solus"), "drawn.left_solus", "left_soleus"),
        (GOOD.replace("tibialis", "masses"), "drawn.masses", "mass"),
        (GOOD.replace("tibialis", '"patient.spastcity"'), "drawn.patient.spastcity", "spasticity"),
        # a device differs between no patients; and a share goes by the muscle's name
        (GOOD.replace("tibialis", '"supply.pressure"'), "drawn.supply.pressure", None),
        (
            GOOD.replace("tibialis", '"patient.dorsiflexor_strength"'),
            "drawn.patient.dorsiflexor_strength",
            None,
        ),
        (f'patient = "drop-fot"\n{GOOD}', "patient", "drop-foot"),
        (f"patient = 3\n{GOOD}", "patient", None),
        ("", "drawn", None),
        ("drawn = 3", "drawn", None),
        ("[drawn]", "drawn", None),
        *(
            (f"patients = {value}\n{GOOD}", "patients", None)
            for value in ("0", "true", "-1", "2.5", "1001", "nan", '"3"')
        ),
        *((f"seed = {value}\n{GOOD}", "seed", None) for value in ("-1", "true", "inf", "1.0")),
    ],
)
def test_a_conditions_file_that_is_wrong_names_it_and_the_nearest(
    text: str, field: str, nearest: str | None, tmp_path: pathlib.Path
) -> None:
    file = write(tmp_path, text)
    with pytest.raises(InputError) as found:
        read_condition(file)
    assert (found.value.file, found.value.field) == (file, field)
    assert nearest is None or found.value.nearest == nearest
    assert found.value.allowed or field == "drawn"


def test_a_mistyped_condition_is_told_the_nearest(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=re.escape("did you mean 'drop-foot'?")):
        read_condition("dropfoot")
    with pytest.raises(InputError, match="not valid TOML"):
        read_condition(write(tmp_path, "[drawn\n"))


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_patient_has_a_body_that_a_scenario_takes(name: str) -> None:
    """At the ends of every range, too."""
    condition = read_condition(name)
    scenario = prepared("walk-dropfoot-afo", {"timestep": "1 ms", "patient": condition.patient})
    units: dict[str, Any] = {key: each.unit for key, each in condition.ranges.items()}
    for share in (0.001, 0.999):
        numbers = {key: float(each.at(share)) for key, each in condition.ranges.items()}
        worn, left = as_drawn(scenario, {}, numbers, worn=True, units=units)
        assert worn.patient is not None and all(0.0 <= x <= 2.0 for x in left.values())


@pytest.mark.parametrize(
    ("left", "corners"),
    [
        ({}, [(0.0, 1.0), (0.1, 1.0), (0.0, 0.8)]),  # as stated first: tibialis, plantarflexors
        ({"tibialis": 0.3}, [(0.3, 1.0), (0.0, 1.0), (0.2, 1.0), (0.4, 1.0), (0.3, 0.8)]),
        ({"tibialis": 0.95}, [(0.95, 1.0), (0.0, 1.0), (0.85, 1.0), (1.0, 1.0), (0.95, 0.8)]),
        ({"tibialis": 1.0}, [(1.0, 1.0), (0.9, 1.0), (1.0, 0.8)]),
        ({"tibialis": 0.0, "gastrocnemius": 0.5}, [(0.0, 1.0), (0.1, 1.0), (0.0, 0.8)]),
    ],
)  # fmt: skip
def test_corners_are_exact_and_the_stated_one_is_the_first(
    left: dict[str, float], corners: list[tuple[float, float]]
) -> None:
    scenario, own = prepared("walk-dropfoot-afo"), {"tibialis": 0.0, **left}
    found, drawn = draw_about(scenario, own, 3, 0)
    shares = [as_drawn(scenario, own, one, worn=False)[1] for one in found]
    calf = left.get("gastrocnemius", 1.0)
    names = ("tibialis", "soleus", "gastrocnemius")  # who is not named is whole
    walked = [tuple(each.get(name, 1.0) for name in names) for each in shares]
    assert len(drawn) == 3 and walked == [pytest.approx((a, b, calf * b), abs=1e-12) for a, b in corners]
    ends = zip(np.ravel(walked), np.ravel([(a, b, calf * b) for a, b in corners]), strict=True)
    assert all(a == b for a, b in ends if b in (0.0, 1.0))  # exactly
    assert all(one["tissue"] == one["mass"] == one["height"] == 1.0 for one in found)  # all else is as stated


def test_who_is_drawn_about_a_patient_keeps_the_ranges() -> None:
    _, drawn = draw_about(prepared("walk-dropfoot-afo"), {"tibialis": 0.3}, 400, 0)
    many = {name: np.array([one[name] for one in drawn]) for name in drawn[0]}
    assert many["tissue"].mean() == pytest.approx(1.0, abs=0.1)  # the mean stays that of the patient
    assert many["tissue"].std() == pytest.approx(0.57, abs=0.1)
    ranges = {"tibialis": (0.2, 0.4), "plantarflexors": (0.8, 1.0), "mass": (0.9, 1.1)}
    ranges |= {"height": (0.95, 1.05), "cuff": (2e3, 8e3)}
    assert set(many) == {"tissue", *ranges}
    for name, (low, high) in ranges.items():
        assert low <= many[name].min() < many[name].max() <= high
        assert np.ptp(many[name]) > 0.95 * (high - low)
    _, bare = draw_about(prepared("walk-dropfoot"), {"tibialis": 0.3}, 1, 0)
    assert "cuff" not in bare[0]


def test_a_bare_walk_is_the_same_at_any_mass_and_one_with_a_device_is_not() -> None:
    """Dynamic similarity: all forces and masses of a bare walker grow alike, but air does not."""
    scenario = prepared("walk-dropfoot-afo", {"timestep": "1 ms"})
    ankles = {}
    for name, wearing in (("bare", scenario.set(BARE)), ("worn", scenario)):
        for mass in (60.0, 75.0, 90.0):
            body = build_body(wearing.set({"patient.body_mass": f"{mass} kg"}), {"tibialis": 0.7})
            walked = walk_body(body, read_gait("natural").vector, 3.0)
            assert walked.fell is None
            ankles[name, mass] = np.degrees(walked["right/ankle"])
    for mass in (60.0, 90.0):
        assert abs(ankles["bare", mass] - ankles["bare", 75.0]).max() < 1e-6
        assert abs(ankles["worn", mass] - ankles["worn", 75.0]).max() > 1.0
