"""Newton's law finds a late force, a scaled plate and the mass, each within the error that it states."""

import dataclasses
import pathlib

import numpy as np
import pytest
from campaign import size as cases
from gait_lab.laboratory import Laboratory
from gait_lab.patients import LameWalker, Patient, anybody

from afo_sim.common import with_code
from afo_sim.gait_lab import Choices, Imported, Markers, WalkingTrial, cut_cycle
from afo_sim.gait_lab.readers.plates import plate
from afo_sim.gait_lab.trial.newton import Newton

FILE = pathlib.Path("walk.trc")
ERRING = {"noise": 6e-4, "blinks": 3, "ends": 0.1, "offset": 3.0}
SETS = ("plug-in gait", "opensim c3d", "rajagopal")  # with markers on the trunk


def recorded(
    laboratory: Laboratory,
    marked: str = SETS[0],
    kind: str = "feet",
    keep: slice = slice(None),
    lost: float = 0.0,
    **choices: object,
) -> Imported:
    plates = [
        dataclasses.replace(p, force=p.force * (1.0 - lost * (p.name == "r")))
        for p in laboratory.plates(kind)[keep]
    ]
    read = tuple(plate(FILE, p.name, p.time, p.force, p.place) for p in plates)
    trial = WalkingTrial((FILE,), read, Markers(FILE, laboratory.time, laboratory.markers(marked)))
    return cut_cycle(trial, Choices(**choices))


def law(done: Imported) -> Newton:
    assert isinstance(done.newton, Newton), done.newton
    return done.newton


def test_the_errors_that_it_states_are_honest() -> None:
    """Delays and gains that are drawn are met as often as a normal error says, and are not all too wide."""
    late, mass = [], []
    for seed in range(8100, 8100 + cases(5, 60)):
        rng = np.random.default_rng(seed)
        walker, delay, gain = anybody(seed), rng.uniform(-0.05, 0.05), rng.uniform(0.85, 1.15)
        laboratory = Laboratory(
            walker, seconds=3.6 * walker.slower, seed=seed, late=delay, gains=(gain, 1.0), **ERRING
        )
        found = law(recorded(laboratory, str(rng.choice(SETS)), str(rng.choice(["feet", "single"]))))
        late.append((found.late[0] - delay) / found.late[1])
        names = list(found.masses)
        for name, true in zip(names, (gain, 1.0), strict=False):
            value, error = found.masses[name]
            mass.append((value / walker.mass - true) / np.hypot(error / walker.mass, 0.01))
    assert np.abs(late).max() < 3.0
    assert 0.2 < np.sqrt(np.mean(np.square(late))) < 1.3
    assert np.sqrt(np.mean(np.square(mass))) < 1.6 and np.abs(mass).max() < 4.0


@pytest.mark.parametrize("rate", [60.0, 250.0])
def test_the_delay_does_not_hang_on_the_cameras_rate(rate: float) -> None:
    walker = anybody(8001)
    laboratory = Laboratory(walker, seconds=3.6, rate=rate, plate_rate=5.0 * rate, late=0.03, **ERRING)
    assert law(recorded(laboratory)).late[0] == pytest.approx(0.03, abs=0.006)


def test_one_plate_is_judged_while_its_foot_stands_alone() -> None:
    walker = anybody(8002)
    laboratory = Laboratory(walker, seconds=3.6 * walker.slower, **ERRING)
    done = recorded(laboratory, kind="single", keep=slice(1), either=True)
    found = law(done)
    assert list(found.masses) == ["1"] and 0.25 < found.time < 0.5
    assert done.mass.mass == pytest.approx(walker.mass, rel=0.02)  # not twice what one leg carries
    assert found.late[0] == pytest.approx(0.0, abs=3.0 * found.late[1])
    said = {check.fault: check.verdict for check in done.checks}
    assert said["plates alike"].startswith("not checked")


def test_the_belt_of_a_treadmill_changes_nothing() -> None:
    walker = anybody(8003)
    still = law(recorded(Laboratory(walker, seconds=4.0, **ERRING)))
    moved = law(recorded(Laboratory(walker, seconds=4.0, belt=walker.speed, **ERRING)))
    assert moved.late[0] == pytest.approx(still.late[0], abs=0.002)
    assert moved.mass[0] == pytest.approx(still.mass[0], rel=0.005)


def test_a_cane_shows_as_a_plate_that_carries_less() -> None:
    laboratory = Laboratory(LameWalker(), seconds=4.0, **ERRING)
    done = recorded(laboratory, lost=0.15, walker="patient")
    low, high = law(done).masses["r"][0], law(done).masses["l"][0]
    assert low / high == pytest.approx(0.85, abs=0.02)
    (notice,) = (check.notice for check in done.checks if check.notice)
    assert (notice.code, notice.subject, notice.data["other"]) == ("plates-unlike", "r", "l")
    assert notice.data["percent"] == pytest.approx(100.0 * (1.0 - low / high), abs=1e-6)


def test_a_foot_half_beside_its_plate_is_left_out_and_named() -> None:
    walker = anybody(8004)
    laboratory = Laboratory(walker, seconds=3.6 * walker.slower, **ERRING)
    plates = laboratory.plates("steps")
    half = plates[2]  # whose first 0.2 s press beside it
    begins = half.time[np.argmax(np.linalg.norm(half.force, axis=1) > 50.0)]
    beside = half.force * (half.time > begins + 0.2)[:, None]
    plates[2] = dataclasses.replace(half, force=beside)
    read = tuple(plate(FILE, p.name, p.time, p.force, p.place) for p in plates)
    marked = Markers(FILE, laboratory.time, laboratory.markers(SETS[0]))
    found = law(cut_cycle(WalkingTrial((FILE,), read, marked), Choices(either=True)))
    assert found.mass[0] == pytest.approx(walker.mass, rel=0.02)
    assert found.late[0] == pytest.approx(0.0, abs=0.012)
    assert "plate 3" in found.left_out and found.why


def test_one_plate_of_another_clock_is_doubted_not_taken_for_a_foot_beside_it() -> None:
    walker = anybody(8006)
    laboratory = Laboratory(walker, seconds=3.6 * walker.slower, **ERRING)
    plates = laboratory.plates("steps")
    plates[2] = dataclasses.replace(plates[2], time=plates[2].time - 0.05)
    read = tuple(plate(FILE, p.name, p.time, p.force, p.place) for p in plates)
    marked = Markers(FILE, laboratory.time, laboratory.markers(SETS[0]))
    done = cut_cycle(WalkingTrial((FILE,), read, marked), Choices(either=True))
    (notice,) = with_code(done.warnings, "foot-unlike")
    assert "plate 3" in notice.subject and not law(done).why


def test_markers_of_somebody_beside_are_no_trunk() -> None:
    """An operator 0.7 m aside, who bobs as he walks along."""
    walker = anybody(8007)
    laboratory = Laboratory(walker, seconds=3.6 * walker.slower, **ERRING)
    marked = laboratory.markers(SETS[0])
    bob = 0.03 * np.sin(2.0 * np.pi * 2.1 * laboratory.time + 1.0)[:, None] * [0.0, 1.0, 0.0]
    for k in range(3):
        marked[f"OP{k}"] = marked["C7"] + bob + [0.0, 0.05 * k, 0.7]
    plates = [plate(FILE, p.name, p.time, p.force, p.place) for p in laboratory.plates("feet")]
    trial = WalkingTrial((FILE,), tuple(plates), Markers(FILE, laboratory.time, marked))
    alone = law(recorded(laboratory)).late[0]
    assert law(cut_cycle(trial, Choices())).late[0] == pytest.approx(alone, abs=0.001)


def test_a_pelvis_that_hardly_rises_shows_the_mass_and_not_the_clock() -> None:
    walker = Patient(share=0.5, slower=2.0)
    done = recorded(Laboratory(walker, seconds=6.0, **ERRING), "helen hayes", walker="patient")
    assert law(done).mass[0] == pytest.approx(walker.mass, rel=0.02) and not law(done).follows
    (clock,) = (check for check in done.checks if check.fault == "force's clock")
    assert "acceleration" not in clock.found


def test_a_force_that_does_not_follow_the_trunk_is_not_judged() -> None:
    walker = anybody(8005)
    laboratory = Laboratory(walker, seconds=3.6 * walker.slower, **ERRING)
    marked = laboratory.markers(SETS[0])
    for name in ("C7", "T10", "CLAV", "STRN", "RSHO", "LSHO"):  # somebody who bobs, as on a harness
        marked[name] = marked[name] + 0.10 * np.sin(9.0 * laboratory.time)[:, None] * [0.0, 1.0, 0.0]
    plates = [plate(FILE, p.name, p.time, p.force, p.place) for p in laboratory.plates("feet")]
    trial = WalkingTrial((FILE,), tuple(plates), Markers(FILE, laboratory.time, marked))
    done = cut_cycle(trial, Choices())
    assert isinstance(done.newton, str)
    needs = {check.fault: check.needs for check in done.checks}
    assert needs["mass and plates' scale"] == done.newton
