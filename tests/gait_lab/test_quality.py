"""Faults of a laboratory that spoil the ankle moment in silence are found by name; sound trials have none."""

import dataclasses
import pathlib

import numpy as np
import pytest
from campaign import size as cases
from gait_lab.laboratory import Laboratory, Recorded
from gait_lab.patients import anybody

from afo_sim.common import with_code
from afo_sim.gait_lab import Choices, Imported, Markers, WalkingTrial, cut_cycle
from afo_sim.gait_lab.readers.plates import plate

SET, FILE = "opensim c3d", pathlib.Path("walk.trc")
GAITS = ("gatk_stride2", "opensim_walk", "bovi2011_s", "bovi2011_natural", "bovi2011_m")
SEEDS = range(7000, 7000 + cases(3, 10))
CODES = {
    "ahead": {"pressure-shifted"},
    "across": {"pressure-aside"},
    "late": {"force-late"},
    "clipped": {"plate-clipped"},
    "scaled": {"plates-unlike"},
}


def spoilt(found: Recorded, fault: str, size: float, first: bool) -> Recorded:
    if fault in ("ahead", "across"):
        return dataclasses.replace(found, place=found.place + size * np.eye(3)[0 if fault == "ahead" else 2])
    if fault == "late":
        moved = [
            np.column_stack([np.interp(found.time - size, found.time, c) for c in table.T])
            for table in (found.force, found.place)
        ]
        return dataclasses.replace(found, force=moved[0], place=moved[1])
    if first and fault == "scaled":
        return dataclasses.replace(found, force=(1.0 + size) * found.force)
    if first and fault == "clipped":
        most = (1.0 - size) * found.force[:, 1].max()
        return dataclasses.replace(found, force=np.minimum(found.force, [np.inf, most, np.inf]))
    return found


def trial(seed: int, fault: str = "", size: float = 0.0, standing: Markers | None = None) -> WalkingTrial:
    rng = np.random.default_rng(seed)
    walker, rate = anybody(seed, gait=str(rng.choice(GAITS))), float(rng.choice([100.0, 120.0, 200.0]))
    errs = {"noise": 1e-3 * rng.uniform(0.3, 1.0), "blinks": 3, "ends": 0.1, "offset": 3.0}
    seconds = 3.6 * walker.slower
    laboratory = Laboratory(walker, seconds=seconds, rate=rate, plate_rate=5.0 * rate, seed=seed, **errs)
    plates = [spoilt(p, fault, size, p.name == "r") for p in laboratory.plates("feet")]
    read = tuple(plate(FILE, p.name, p.time, p.force, p.place) for p in plates)
    marked = Markers(FILE, laboratory.time, laboratory.markers(SET))
    return WalkingTrial((FILE,), read, marked, standing=standing)


def codes(done: Imported) -> set[str]:
    return {check.notice.code for check in done.checks if check.notice is not None}


@pytest.mark.parametrize(
    ("fault", "size"),
    [
        ("ahead", 0.03),
        ("ahead", -0.03),
        ("across", 0.03),
        ("across", -0.03),
        ("late", 0.03),
        ("late", -0.03),
        ("clipped", 0.05),
        ("scaled", 0.1),
        ("scaled", -0.1),
    ],
)
def test_a_fault_is_found_and_named(fault: str, size: float) -> None:
    found = [codes(cut_cycle(trial(seed, fault, size), Choices())) for seed in SEEDS]
    assert sum(bool(each) and each <= CODES[fault] for each in found) >= 0.9 * len(SEEDS), found


def test_sound_trials_are_not_doubted() -> None:
    for seed in SEEDS:
        done = cut_cycle(trial(seed), Choices())
        assert codes(done) == set()
        assert "mass against height" in done.cycle.notes["quality"].split("not checked: ")[1]


def test_a_stated_mass_says_which_plate_is_scaled() -> None:
    done = cut_cycle(trial(7000, "scaled", -0.2), Choices(mass=anybody(7000).mass))
    (notice,) = with_code(done.warnings, "plate-scaled")
    assert notice.subject == "plate r carries"
    assert notice.data["percent"] == pytest.approx(-20.0, abs=2.0)


@pytest.mark.parametrize("share", [-0.1, 0.1])
def test_a_stated_mass_that_the_plates_contradict_is_doubted(share: float) -> None:
    done = cut_cycle(trial(7000), Choices(mass=(1.0 + share) * anybody(7000).mass))
    assert codes(done) == {"mass-differs"}
    (notice,) = with_code(done.warnings, "mass-differs")
    assert notice.data["percent"] == pytest.approx(100.0 / (1.0 + share) - 100.0, abs=1.5)


def test_a_shift_sideways_is_told_by_foot() -> None:
    """The sentence shows whether both feet are off, or a marker of one."""
    done = cut_cycle(trial(7001, "across", 0.03), Choices())
    (notice,) = with_code(done.warnings, "pressure-aside")
    right, left = (float(part.split()[1]) for part in notice.data["each"].split(", "))
    assert notice.data["off"] == pytest.approx(0.5 * (right + left), abs=1.0)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda p: p, set()),
        (lambda p: 1.08 * p, {"standing-stranger"}),
        (lambda p: p * [1.0, 1.0, -1.0], {"standing-mirrored"}),
    ],
)
def test_a_standing_trial_of_another_person_or_mirrored(change: object, expected: set[str]) -> None:
    laboratory = Laboratory()
    still = {name: change(path) for name, path in laboratory.standing(SET).items()}
    standing = Markers(pathlib.Path("still.trc"), 0.01 * np.arange(150), still)
    assert codes(cut_cycle(trial(7000, standing=standing), Choices())) == expected


@pytest.mark.parametrize(("height", "doubted"), [(1.7, False), (0.9, True)])
def test_mass_against_height(height: float, doubted: bool) -> None:
    done = cut_cycle(trial(7000), Choices(height=height))
    assert codes(done) == ({"mass-for-height"} if doubted else set()), done.cycle.body_mass
