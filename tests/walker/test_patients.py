"""Patients of a condition walk: each as by hand, by gaits that were theirs with the device they have on."""

import csv
import dataclasses
import math
import pathlib
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError, assets
from afo_sim.common.sealing import sealed_text
from afo_sim.simulation import occupy, released
from afo_sim.walker import (
    Falls,
    Population,
    Vector,
    build_body,
    falls_of,
    gaits_table,
    numbers,
    populate,
    prepared,
    read_gait,
    strides_of,
    walk_body,
)
from afo_sim.walker import patients as module
from afo_sim.walker.bounds import LEAST, MOST
from afo_sim.walker.patients import (
    DEVICE,
    SPRING,
    WEEKS,
    WITHOUT,
    Adapted,
    Gaits,
    Patient,
    device_key,
    packed,
    read_gaits,
    rounded,
)
from afo_sim.walker.population import as_drawn, read_condition
from afo_sim.walker.search import pushes_at

SCENARIO, SOURCE = "walk-dropfoot-afo", 'source = "assumed"'
BRIEF: dict[str, Any] = {"duration": 4.0, "starts": 1, "threads": 1}
SEARCH = sys.modules[pushes_at.__module__]  # its name in the room is the function's
NATURAL = read_gait("natural").vector
HOW = {"seed": "0", "generations": "1", "cost": "12.5000", "converged": "false", "cpu_seconds": "0.1"}


@pytest.fixture(scope="module")
def condition(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Two patients, who walk by the healthy gait."""
    file = tmp_path_factory.mktemp("condition") / "mild.toml"
    file.write_text(
        f"patients = 2\n[drawn]\ntibialis = {{ from = 0.5, to = 1.0, {SOURCE} }}\n"
        f"left_soleus = {{ from = 0.95, to = 1.0, {SOURCE} }}\n"
        f"mass = {{ from = 0.8, to = 1.2, {SOURCE} }}\n"
        f'"patient.spasticity" = {{ from = "0 N*m*s/rad", to = "1 N*m*s/rad", {SOURCE} }}\n',
        encoding="utf-8",
    )
    return file


@pytest.fixture(scope="module")
def walked(condition: pathlib.Path) -> Population:
    return populate(SCENARIO, patients=condition, spring=30.0, **BRIEF | {"threads": 3})


def assert_same(one: Population, other: Population) -> None:
    assert list(one.cases) == list(other.cases)
    for case in one.cases:
        for a, b in zip(one[case], other[case], strict=True):
            assert a.falls == b.falls
            assert np.array_equal(list(a.numbers.values()), list(b.numbers.values()), equal_nan=True)


def test_a_patient_walks_as_by_hand(walked: Population) -> None:
    assert list(walked.cases) == [WITHOUT, DEVICE, SPRING]  # nobody has adapted
    assert walked.asked["unadapted"] == 2
    units = {"patient.spasticity": "N*m*s/rad"}
    described = prepared(SCENARIO, {"timestep": "1 ms", "patient": "healthy"})
    for case, spring in ((WITHOUT, 0.0), (DEVICE, 0.0), (SPRING, 30.0)):
        for k in (0, 1):
            scenario, left = as_drawn(described, {}, walked.drawn[k], worn=case == DEVICE, units=units)
            assert left["tibialis"] == walked.drawn[k]["tibialis"]
            body = build_body(scenario, left)
            ankle = body.model.joint("ankle").id
            if spring:
                body = build_body(scenario, left, spring)
                bare = build_body(scenario, left)
                stiffer = body.model.jnt_stiffness - bare.model.jnt_stiffness
                assert stiffer[ankle] == pytest.approx(spring) and np.count_nonzero(stiffer) == 1
            found = walk_body(body, NATURAL, 4.0)
            mine = numbers(found)
            theirs = walked[case][k].numbers
            assert {n: theirs[n] for n in mine} == pytest.approx(mine, rel=1e-12, nan_ok=True)
            assert walked[case][k].falls == falls_of(body, NATURAL, starts=1, push=50.0, seed=k)
            strides = strides_of(found, "right")
            curve = walked[case][k].curves.get("right/ankle")
            assert (curve is not None) == bool(len(strides.duration))
            if curve is not None:
                assert (curve == strides.mean("ankle")).all()


def test_threads_and_the_seed_of_starts(walked: Population, condition: pathlib.Path) -> None:
    again = populate(SCENARIO, patients=condition, spring=30.0, **BRIEF | {"threads": 0})
    assert_same(walked, again)
    assert again.drawn == walked.drawn


@pytest.mark.slow
def test_who_adapts_goes_on_after_a_kill(
    condition: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = [10**6]

    def brief(body: Any, vector: Any, _: float, *of: Any, **more: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return walk_body(body, vector, 0.3, *of, **more)

    monkeypatch.setattr(SEARCH, "walk_body", brief)
    monkeypatch.setattr(module, "DRAWN_WITH", 1)
    asked = {"patients": condition, "generations": 1, **BRIEF, "starts": 0}
    whole = populate(SCENARIO, **asked)
    assert list(whole.cases) == [WITHOUT, DEVICE, DEVICE + WEEKS] and whole.asked["unadapted"] == 0
    foot = "in trainer on adult_75kg"
    keys = {WITHOUT: f"nothing {foot}", DEVICE: f"{device_key(whole.scenario)} {foot}"}
    assert list(whole.gaits) == [(keys[case], k) for case in (WITHOUT, DEVICE) for k in (0, 1)]
    left[0] = (10**6 - left[0]) * 3 // 4
    with pytest.raises(KeyboardInterrupt), released():
        occupy(tmp_path, "patients")
        populate(SCENARIO, **asked)
    assert len([path for path in tmp_path.rglob("*") if path.is_file()]) >= 6  # of the first, and of both
    left[0] = 10**6
    with released():
        assert occupy(tmp_path, "patients")
        again = populate(SCENARIO, **asked | {"threads": 2})
    assert not list(tmp_path.glob(".*"))
    for key, each in whole.gaits.items():
        assert packed(each.vector) == packed(again.gaits[key].vector)
        assert each.search["cost"] == again.gaits[key].search["cost"]
    assert_same(whole, again)
    file = tmp_path / "patients.csv"  # who reads them walks as they did who found them
    file.write_text(gaits_table(whole), encoding="utf-8")
    left[0] = 0  # nobody searches again
    read = populate(SCENARIO, gaits=file, **asked)
    assert_same(whole, read)


@pytest.fixture
def adapted(condition: pathlib.Path) -> Population:
    """Gaits that nobody has searched for: the natural one's neighbours, in bounds, to its last digit."""
    read, draw, gaits = read_condition(condition), np.random.default_rng(2), Gaits()
    described = prepared(SCENARIO, {"timestep": "1 ms", "patient": "healthy"})
    for what in ("nothing", device_key(described), "spring of 30 N*m/rad"):
        worn = f"{what} in trainer on adult_75kg"
        for k in (0, 1):
            near = [
                np.clip(x * (1.0 + draw.normal(0.0, 1e-9, x.shape)), low, high)
                for x, low, high in (
                    (NATURAL.offsets, LEAST.offsets, MOST.offsets),
                    (NATURAL.gains, LEAST.gains, MOST.gains),
                )
            ]
            gaits[worn, k] = Adapted(rounded(Vector(near[0], near[1], NATURAL.speed)), HOW)
    return Population(described, described, read, read.draw(), {}, {}, gaits)


def test_adapted_gaits_are_read_as_they_are_written(adapted: Population, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "patients.csv"
    for text in (gaits_table(adapted), sealed_text(gaits_table(adapted))):
        file.write_text(text, encoding="utf-8")
        found = read_gaits(file, adapted.drawn)
        assert list(found) == list(adapted.gaits)
        for key, each in found.items():
            assert packed(each.vector) == packed(adapted.gaits[key].vector) and each.search == HOW
        again = dataclasses.replace(adapted, gaits=found)
        assert gaits_table(again) == gaits_table(adapted)
    ends = [*(Vector(x.offsets, x.gains, speed) for x, speed in ((LEAST, 0.0), (MOST, 2.0)))]
    for vector in ends:  # a rest of rounding leaves no bound
        inner = [x * (1.0 - 1e-12) for x in (vector.offsets, vector.gains)]
        assert packed(rounded(Vector(inner[0], inner[1], vector.speed))) == pytest.approx(packed(vector))


def damaged(text: str, **cells: str) -> str:
    """The table with other cells in its first row, by column."""
    rows = list(csv.DictReader(text.splitlines()))
    rows[0] |= {name.replace("__", " "): cell for name, cell in cells.items()}
    return "\n".join(",".join(each) for each in (rows[0], *(row.values() for row in rows)))


DAMAGES: dict[str, Callable[[str], str]] = {
    "another patient": lambda text: damaged(text, tibialis="0.123"),
    "no number of a patient": lambda text: damaged(text, mass="nan"),
    "nobody": lambda text: damaged(text, patient="0"),
    "one too many": lambda text: damaged(text, patient="3"),
    "half a patient": lambda text: damaged(text, patient="1.0"),
    "twice": lambda text: damaged(text, patient="2"),
    "NaN": lambda text: damaged(text, gait__lean="nan"),
    "infinite": lambda text: damaged(text, gait__lean="inf"),
    "beyond a bound": lambda text: damaged(text, gait__lean="10.1"),
    "of another sign": lambda text: damaged(text, gait__left_stretch="0.1"),
    "too fast": lambda text: damaged(text, gait__speed="2.1"),
    "a word": lambda text: damaged(text, gait__lean="a lot"),
    "empty": lambda text: damaged(text, gait__lean=""),
    "unknown worn": lambda text: damaged(text, worn="nothng"),
    "empty worn": lambda text: damaged(text, worn=""),
    "a spring without unit": lambda text: damaged(text, worn="spring of 30"),
    "no such column": lambda text: text.replace("gait lean,", "gait leen,", 1),
    "no column of who": lambda text: text.replace("worn,patient", "worn,patent", 1),
    "no column of what": lambda text: text.replace("worn,", "wom,", 1),
    "no column of a number": lambda text: text.replace(",mass,", ",maß,", 1),
    "cut short": lambda text: text[: len(text) // 2].rpartition(",")[0],
    "nothing": lambda _: "",
    "a bit": lambda text: sealed_text(text).replace("true", "false").replace(",2,", ",1,", 1),
    "no table": lambda _: "drawn = 3",
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_file_of_other_gaits_is_refused(damage: str, adapted: Population, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "patients.csv"
    file.write_text(DAMAGES[damage](gaits_table(adapted)), encoding="utf-8")
    with pytest.raises(InputError) as found:
        read_gaits(file, adapted.drawn)
    assert found.value.file == file and found.value.allowed and "\n" not in str(found.value)


def test_a_file_of_gaits_has_to_be_there(tmp_path: pathlib.Path) -> None:
    for place in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(InputError) as found:
            read_gaits(place, [{}])
        assert found.value.file == place


def test_a_device_is_known_by_all_that_it_does_and_a_patient_by_nothing_of_it() -> None:
    scenario = prepared(SCENARIO, {"timestep": "1 ms", "patient": "healthy"})
    key = device_key(scenario)
    assert key.startswith("s1 ") and len(key) == 11
    for same in ({"patient": "spastic"}, {"duration": "5 s"}, {"timestep": "0.5 ms"}):
        assert device_key(scenario.set(same)) == key, same
    others = [
        {"supply.pressure": "3.99 bar"},
        {"worn_on": "both"},
        {"orthosis.anchor.shank.stiffness": "5.01 kN/m"},
        {"phases.dorsiflexor.inlet[0][1]": 0.9},
    ]
    assert len({key, *(device_key(scenario.set(other)) for other in others)}) == 1 + len(others)


def test_whose_gait_is_known_does_not_search_again(adapted: Population, condition: pathlib.Path) -> None:
    """As at the next value of what is varied: without a device all stays as it is."""
    bare = {key: gait for key, gait in adapted.gaits.items() if key[0].startswith("nothing")}
    asked: dict[str, Any] = {"patients": condition, "known": bare, "generations": 1, **BRIEF}
    found = populate(SCENARIO, {"orthosis": "none", "start": None, "phases": None}, **asked)
    assert found.gaits == bare and found.asked["unadapted"] == 0


def test_gaits_of_after_weeks_are_those_of_this_device(
    adapted: Population, condition: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    file = tmp_path / "patients.csv"
    file.write_text(gaits_table(adapted), encoding="utf-8")
    asked: dict[str, Any] = {"patients": condition, "gaits": file, "duration": 4.0, "starts": 0}
    own = populate(SCENARIO, spring=30.0, **asked)
    first = [WITHOUT, DEVICE, DEVICE + WEEKS]
    assert list(own.cases) == [*first, SPRING, SPRING + WEEKS] and own.asked["unadapted"] == 0
    other = populate(SCENARIO, {"supply.pressure": "3 bar"}, spring=31.0, **asked)
    assert list(other.cases) == [WITHOUT, DEVICE, SPRING]
    rows = gaits_table(adapted).splitlines()
    file.write_text("\n".join([rows[0], *rows[2:]]), encoding="utf-8")  # one has not adapted
    assert populate(SCENARIO, **asked).asked["unadapted"] == 1


@pytest.mark.parametrize(
    ("asked", "field"),
    [
        ({"spring": 0.0}, "spring"),
        ({"spring": -30.0}, "spring"),
        ({"spring": math.nan}, "spring"),
        ({"spring": 1001.0}, "spring"),
        ({"starts": -1}, "starts"),
        ({"duration": 3.9}, "duration"),
        ({"duration": math.inf}, "duration"),
        ({"push": math.nan}, "push"),
        ({"push": -50.0}, "push"),
        ({"generations": -1}, "generations"),
        ({"seed": -1}, "seed"),
        ({"sets": {"patient": "spastic"}}, "patient"),
        ({"sets": {"patient.spasticity": "5 N*m*s/rad"}}, "patient.spasticity"),
        ({"sets": {"timestep": "3 ms"}}, "timestep"),
        ({"scenario": "seated"}, "scenario"),
        ({"patients": "drop-fot"}, "population"),
    ],
)
def test_what_is_out_of_range_is_refused_before_anybody_walks(
    asked: dict[str, Any], field: str, condition: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "walk_body", None)
    call = {"scenario": SCENARIO, "patients": condition} | asked
    with pytest.raises(InputError) as found:
        populate(call.pop("scenario"), call.pop("sets", None), **call)
    assert found.value.field == field and found.value.allowed


@pytest.mark.parametrize("name", assets.names("population"))
def test_shipped_gaits_are_of_the_patients_who_are_drawn(name: str) -> None:
    read = read_condition(name)
    file = read.file.with_suffix(".csv")
    if not file.is_file():
        pytest.skip("nobody has adapted yet")
    found = read_gaits(file, read.draw())  # refuses whoever is another, and what is out of bounds
    worn = {key for key, _ in found}
    assert any(key.startswith("nothing in ") for key in worn) and set(found) == {
        (key, k) for key in worn for k in range(read.patients)
    }
    for key, each in found.items():
        low, high = (packed(Vector(x.offsets, x.gains, s)) for x, s in ((LEAST, 0.0), (MOST, 2.0)))
        assert (np.array(low) <= packed(each.vector)).all() and (packed(each.vector) <= np.array(high)).all()
        assert math.isfinite(float(each.search["cost"])) and int(each.search["generations"]) > 0, key


def test_values_are_nan_where_there_is_no_such_number(adapted: Population) -> None:
    patients = (Patient({"speed": 1.2}, Falls(1, 4), {}), Patient({"speed": math.nan}, Falls(0, 0), {}))
    population = dataclasses.replace(adapted, cases={WITHOUT: patients})
    assert population.values(WITHOUT, "speed") == pytest.approx([1.2, math.nan], nan_ok=True)
    assert population.values(WITHOUT, "falls") == pytest.approx([0.25, math.nan], nan_ok=True)
    assert np.isnan(population.values(WITHOUT, "air_per_stride")).all()
