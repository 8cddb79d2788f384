"""Joint draws: as correlated as the fit says, alike in all groups of a muscle, the same for the same seed."""

import pathlib
from typing import Any

import numpy as np
import pytest
from scipy import stats
from spread_tables import spread, spreads_file

from afo_sim.common import InputError
from afo_sim.description import Scenario, load
from afo_sim.study.uncertainty.draw import Draws, applied, draw
from afo_sim.study.uncertainty.spreads import read

FIT = spread("muscle_fit", fit="orthosis.muscle.*.type", scale=1.0)
LAW = "laws.tondu_lopez_2000_bladder."
KEYS = ["braid_angle", LAW + "bladder_force"]


@pytest.fixture(scope="module")
def walk() -> Scenario:
    """A walk whose muscle's fit is loose in two numbers that are all but one."""
    muscle = load("muscle", "s1_215mm").model_dump(mode="json", exclude_none=True)
    muscle["covariance"] = {
        "law": "tondu_lopez_2000_bladder",
        "parameters": KEYS,
        "standard_errors": ["1 deg", "10 N"],
        "correlation": [[1.0, -0.99], [-0.99, 1.0]],
        "freedom": 20,
    }
    places = {f"orthosis.muscle.{group}.type": muscle for group in ("dorsiflexor", "plantarflexor")}
    found: Scenario = load("scenario", "walk-dropfoot-afo", places)
    return found


def drawn(folder: pathlib.Path, text: str, scenario: Scenario, count: int, seed: int = 0) -> Draws:
    return draw(applied(read(spreads_file(folder, text)), scenario), scenario, count, seed)


def test_a_fit_is_drawn_with_its_covariance(tmp_path: pathlib.Path, walk: Scenario) -> None:
    angle, force = drawn(tmp_path, FIT, walk, 4000).columns
    assert (angle.name, force.name) == ("muscle_fit_braid_angle", "muscle_fit_bladder_force")
    assert np.degrees(angle.values.mean()) == pytest.approx(22.0, abs=0.05)
    assert np.degrees(angle.values.std()) == pytest.approx(1.0, rel=0.05)
    assert force.values.std() == pytest.approx(10.0, rel=0.05)
    assert np.corrcoef(angle.values, force.values)[0, 1] == pytest.approx(-0.99, abs=0.002)


def test_all_groups_of_a_muscle_come_from_one_fit(tmp_path: pathlib.Path, walk: Scenario) -> None:
    found = drawn(tmp_path, FIT, walk, 20)
    for k in (0, 19):
        sets = found.sets(k)
        for key in KEYS:
            front, behind = (
                sets[f"orthosis.muscle.{g}.type.{key}"] for g in ("dorsiflexor", "plantarflexor")
            )
            assert front == behind
        # what is set is what was drawn, to the last bit
        scenario = walk.set(sets)
        assert scenario.orthosis.muscle["dorsiflexor"].type.braid_angle == found.columns[0].values[k]


def test_another_muscle_has_a_fit_of_its_own(tmp_path: pathlib.Path, walk: Scenario) -> None:
    muscle: Any = walk.orthosis.muscle["plantarflexor"].type.model_dump(mode="json", exclude_none=True)
    other = walk.set({"orthosis.muscle.plantarflexor.type": muscle | {"mass": "90 g"}})
    found = drawn(tmp_path, FIT, other, 500)
    assert len(found.columns) == 4 and len(found.groups) == 2
    angles = [column.values for column in found.columns if column.name.endswith("braid_angle")]
    assert abs(np.corrcoef(*angles)[0, 1]) < 0.15


def test_draws_that_are_no_muscle_are_drawn_anew_and_counted(tmp_path: pathlib.Path, walk: Scenario) -> None:
    found = drawn(tmp_path, FIT.replace("1.0", "8.0"), walk, 2000)
    angle, force = (column.values for column in found.columns)
    assert np.degrees(angle.min()) >= 5.0 and force.min() >= 0.0 and found.rejected > 0
    # θ ≥ 5° (17° below) and F ≥ 0 (136 N below) at 8 standard errors of 1° and 10 N
    share = stats.norm.cdf(-17.0 / 8.0) + stats.norm.cdf(-136.0 / 80.0)
    again = share / (1.0 - share)
    assert found.rejected == pytest.approx(2000 * again, rel=0.25)


def test_a_fit_that_gives_no_muscle_is_refused(tmp_path: pathlib.Path, walk: Scenario) -> None:
    table = walk.resolved()
    for group in ("dorsiflexor", "plantarflexor"):
        table["orthosis"]["muscle"][group]["type"]["covariance"]["standard_errors"] = ["10 deg", "1e9 N"]
    with pytest.raises(InputError, match="hardly any draw"):
        drawn(tmp_path, FIT.replace("1.0", "10.0"), load("scenario", table), 5000)


def test_the_same_seed_draws_the_same(walk: Scenario) -> None:
    spread = applied(read("usual"), walk)
    first, same, other = (draw(spread, walk, 50, seed) for seed in (3, 3, 4))
    for a, b, c in zip(first.columns, same.columns, other.columns, strict=True):
        assert (a.values == b.values).all() and (a.values != c.values).any()


def test_each_unknown_has_a_draw_in_every_slice(walk: Scenario) -> None:
    found = draw(applied(read("usual"), walk), walk, 64)
    (cuff,) = (column.values for column in found.columns if column.name == "cuff")
    slices = np.floor(64 * stats.norm.cdf(np.log(cuff / 4000.0) / 0.35)).astype(int)
    assert sorted(slices) == list(range(64))  # a Latin hypercube


def test_unknowns_are_independent_of_each_other(walk: Scenario) -> None:
    found = draw(applied(read("usual"), walk), walk, 2000)
    columns = {c.name: c.values for c in found.columns}
    names = ["cuff", "tissue", "inlet", "bore", "toe_extension", "pace", "swing_path"]
    correlations = np.corrcoef([columns[name] for name in names]) - np.eye(len(names))
    assert np.abs(correlations).max() < 0.1


def test_what_varies_stands_apart_from_what_is_not_known(walk: Scenario) -> None:
    found = draw(applied(read("usual"), walk), walk, 500)
    path, walking = found.heights(each_stride=True), found.heights(each_stride=False)
    assert 1e3 * path.std() == pytest.approx(3.0, rel=0.05)
    assert stats.skew(path) == pytest.approx(0.6, abs=0.1)
    assert 1e3 * walking.std() == pytest.approx(5.0, rel=0.05)
    varying = {group.name for group in found.groups if group.each_stride}
    assert varying == {"pace", "swing_path"}
    (tissue,) = (group for group in found.groups if group.name == "tissue")
    assert tissue.deviates.shape == (500, 2)  # scale and zero are measured together
