"""A torque fit with every law of its muscle: how far the law moves it, and what the intervals then hold."""

import json
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from campaign import size
from devices import device
from knee import knee_data, knee_orthosis
from scipy.stats import f

from afo_sim.common import with_code
from afo_sim.description import Orthosis, reader
from afo_sim.lab import TorqueFit, fit_torque, knee_tests, paths, statics, torque_report

PLANTED = 20e3
ANGLE = np.tile(np.radians(np.linspace(-25.0, 15.0, 9)), 3)
GAUGE = np.repeat([2e5, 3e5, 4e5], 9)


def by(law: str, *others: str) -> Orthosis:
    """The arm whose flexor uses a law, and has parameters for others."""
    arm: Orthosis = reader.load("orthosis", "arm")
    flexor = arm.muscle["flexor"]
    laws = {name: flexor.type.laws[name] for name in (law, *others)}
    muscle = flexor.type.with_values(law=law, laws=laws, covariance=None)
    return arm.model_copy(
        update={"muscle": arm.muscle | {"flexor": flexor.model_copy(update={"type": muscle})}}
    )


def readings(law: str, noise: float, seed: int, gauge: np.ndarray = GAUGE) -> dict[str, np.ndarray]:
    orthosis = by(law)
    torque = statics(orthosis, paths(orthosis, ANGLE), "flexor", gauge, device(PLANTED, 4e-3))[0]
    scatter = np.random.default_rng(seed).normal(0.0, noise, len(torque))
    return {"angle [rad]": ANGLE, "pressure [Pa]": gauge, "torque [N*m]": torque + scatter}


LAWS = [*reader.load("orthosis", "arm").muscle["flexor"].type.laws]


def fitted(data: Any, law: str = "sarosi_2012", others: Sequence[str] = LAWS, **options: Any) -> TorqueFit:
    return fit_torque(data, by(law, *others), chamber="flexor", **{"hold_out": "none"} | options)


@pytest.mark.slow
def test_the_hull_is_that_of_fits_with_each_law_given_in_the_orthosis() -> None:
    """Each law as the only one in use, in a fit of its own; the ratio of mean squares by hand."""
    data = readings("maximum_force", 0.15, 3)
    found, alone, square = fitted(data), {}, {}
    for law in LAWS:
        alone[law] = fitted(data, law, ())
        assert alone[law].laws == ()
        square[law] = np.mean(alone[law].residuals ** 2)
    least = min(square, key=square.__getitem__)
    many = {law: each.solution.independent for law, each in alone.items()}
    close = {law for law in alone if square[law] / square[least] <= f.ppf(0.95, many[law], many[least])}
    assert {each.law for each in found.laws if each.comparable} == close and 1 < len(close) < len(alone)
    for name in ("series_stiffness", "offset"):
        held = [alone[law].intervals[name] or (alone[law].parameters[name],) for law in close]
        ends = min(map(min, held)), max(map(max, held))
        assert found.intervals[name] == pytest.approx(ends, rel=1e-4, abs=1e-7)


@pytest.mark.slow
def test_intervals_hold_the_planted_value_though_another_law_made_the_torques() -> None:
    """By the law in use alone most intervals miss it; those over the laws miss it as often as 95 % may."""
    held, held_alone = [], []
    for seed in range(size(8, 20)):
        found = fitted(readings("maximum_force", 0.05, seed), others=["maximum_force"])
        (low, high), own = found.intervals["offset"] or (0.0, 0.0), found.laws[0].ends("offset")
        assert own is not None and low <= own[0] and own[1] <= high
        held_alone.append(own[0] <= 4e-3 <= own[1])
        held.append(low <= 4e-3 <= high)
    assert np.mean(held) >= 0.85 and np.mean(held_alone) <= 0.5


@pytest.mark.slow
def test_a_law_that_fits_far_worse_widens_nothing_and_is_in_table_file_and_remarks(
    tmp_path: pathlib.Path,
) -> None:
    found = fitted(readings("sarosi_2012", 0.1, 1), hold_out="angle")
    laws = {each.law: each for each in found.laws}
    assert not laws["kerscher_2006"].comparable and laws["polynomial"].comparable
    kerscher = laws["kerscher_2006"].ends("series_stiffness")
    interval = found.intervals["series_stiffness"]
    assert interval is not None and kerscher is not None and kerscher[1] < interval[0]
    torque_report.write(found, tmp_path, tmp_path)
    written = json.loads((tmp_path / "fit_torque.json").read_text())
    assert written["parameters"]["series_stiffness"]["interval_95"] == pytest.approx(interval)
    assert written["laws"]["kerscher_2006"]["fits_comparably"] is False
    assert written["laws"]["sarosi_2012"]["rms_held_out"] == pytest.approx(found.held_out["angle"].rms)
    cable = reader.load("orthosis", tmp_path).muscle["flexor"].cable
    low, high = (f"{1e-3 * end:.3g}" for end in interval)
    assert f"95 % interval {low} to {high} kN/m" in cable.provenance["stiffness"].source
    assert (
        "of the laws that fit comparably (maximum_force, polynomial)" in cable.provenance["stiffness"].source
    )
    (rows,) = [rows for title, _, rows in torque_report.tables(found) if title.startswith("each law")]
    assert [row[0] for row in rows] == [*laws]
    assert sum("depending on the law it is" in line for line in torque_report.remarks(found)) == 2


def test_a_law_beyond_its_range_or_against_the_readings_is_reported() -> None:
    low_pressure = np.repeat([0.6e5, 1.5e5, 3e5], 9)
    found = fitted(
        readings("sarosi_2012", 0.05, 2, low_pressure), "kerscher_2006", ["sarosi_2012", "bolen_2026"]
    )
    laws = {each.law: each for each in found.laws}
    assert any("pressures go from 0.6 to 3 bar" in line for line in laws["sarosi_2012"].beyond)
    assert not with_code(laws["bolen_2026"].beyond, "beyond-law")  # holds from 0 bar
    (against,) = with_code(found.warnings, "law-fits-worse")
    assert against.subject == "kerscher_2006" and "sarosi_2012" in against
    (rows,) = [rows for title, _, rows in torque_report.tables(found) if title.startswith("each law")]
    assert [row[-1].partition(";")[2] for row in rows] == [" beyond its range of pressure"] * 2 + [""]


@pytest.mark.slow
def test_the_knees_stiffness_goes_with_the_law() -> None:
    """185 measured torques: laws that lie about as close ask for half the stiffness."""
    orthoses = {name: knee_orthosis(test) for name, test in knee_tests().items()}
    found = fit_torque(knee_data(), orthoses, ("series_stiffness",), hold_out="none")
    own, interval = found.laws[0].ends("series_stiffness"), found.intervals["series_stiffness"]
    assert own is not None and interval is not None
    apart = [e.law for e in found.laws if e.comparable and (e.ends("series_stiffness") or own)[1] < own[0]]
    assert apart and interval[0] < 0.6 * own[0] and interval[1] == own[1]
    (moved,) = with_code(found.warnings, "law-moves")
    assert "12.9 kN/m (bolen_2026)" in moved


def test_an_offset_of_round_off_is_printed_as_0(tmp_path: pathlib.Path) -> None:
    found = fitted(readings("sarosi_2012", 0.1, 0), "martens_boblan_2017", ())
    assert found.parameters["offset"] == 0.0 and found.solution.x[1] > 0.0  # a search ends within its bounds
    shown = [*map(str, torque_report.tables(found)), *torque_report.remarks(found), repr(found)]
    assert not any("e-" in text for text in shown) and "offset = 0 mm" in repr(found)
    torque_report.write(found, tmp_path, tmp_path)
    assert reader.load("orthosis", tmp_path).muscle["flexor"].cable.offset == 0.0
