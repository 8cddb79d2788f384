"""A refusal names its true cause and the way out: each case is a trial that was generated with one fault."""

import dataclasses
import pathlib

import numpy as np
import pytest
from analytic_walker import ANKLE, AnalyticWalker
from gait_lab.laboratory import Laboratory, Recorded
from gait_lab.trial_files import write_forces, write_trc
from recorded_leg import leg
from walking import known_walk, write_table

from afo_sim.common import GRAVITY, InputError, with_code
from afo_sim.gait_lab import Choices, import_gait
from afo_sim.gait_lab.trial.events import period_by_motion

PLAIN = Laboratory()
SET = "opensim c3d"
POUND = 1.0 / 4.4482216  # lbf in a newton


def trial(
    folder: pathlib.Path, plates: list[Recorded] | None = None, empty: tuple[str, ...] = ()
) -> list[pathlib.Path]:
    """Markers, of which some have no number, and plates of the known walker."""
    points = {n: p * np.nan if n in empty else p for n, p in PLAIN.markers(SET).items()}
    plates = PLAIN.plates("feet") if plates is None else plates
    markers = write_trc(folder / "walk.trc", PLAIN.time, points)
    return [markers, write_forces(folder / "grf.mot", plates)]


def refused(files: list[pathlib.Path], **choices: float) -> InputError:
    with pytest.raises(InputError) as caught:
        import_gait(files, Choices(**choices))
    return caught.value


def gait_of(folder: pathlib.Path, duty: float, speed: float) -> list[pathlib.Path]:
    """A walker or runner whose feet carry half sines, the weight over a stride together."""
    walker = AnalyticWalker(speed=speed, period=0.95 if duty > 0.5 else 0.7, duty=duty)
    time, fast = np.arange(0.0, 3.0, 0.01), np.arange(0.0, 3.0, 0.001)
    names = {"hip": "HJC", "knee": "KJC", "ankle": "AJC", "heel": "CAL", "toe": "MT2"}
    legs, points, plates = walker.legs(time), {}, []
    for side, each in walker.legs(fast).items():
        points |= {side[0].upper() + names[role]: p.path for role, p in legs[side].points.items()}
        share = (fast / walker.period + (0.0 if side == "right" else 0.5)) % 1.0 / duty
        up = np.where(share < 1.0, 70.0 * GRAVITY * np.pi / (4.0 * duty) * np.sin(np.pi * share), 0.0)
        force = np.column_stack([-0.15 * up * np.cos(np.pi * share), up, 0.0 * up])
        ahead = np.column_stack([0.18 * share - 0.05, 0.0 * share - ANKLE, 0.0 * share])
        middle = each.points["ankle"].path * [1.0, 0.0, 1.0] + [0.0, ANKLE, 0.0]
        plates.append(Recorded(side[0], fast, force, middle + ahead, np.zeros((4, 3))))
    return [write_trc(folder / "walk.trc", time, points), write_forces(folder / "grf.mot", plates)]


@pytest.mark.parametrize(("duty", "speed"), [(0.35, 3.3), (0.45, 2.5)])
def test_a_run_is_refused(tmp_path: pathlib.Path, duty: float, speed: float) -> None:
    error = refused(gait_of(tmp_path, duty, speed))
    assert "runs" in error.problem
    assert f"{100.0 * duty:.0f} %" in error.problem


@pytest.mark.parametrize(("duty", "speed"), [(0.70, 0.7), (0.62, 1.2), (0.54, 1.6)])
def test_a_walk_is_no_run(tmp_path: pathlib.Path, duty: float, speed: float) -> None:
    done = import_gait(gait_of(tmp_path, duty, speed), Choices())
    assert done.cycle.walking_speed == pytest.approx(speed, rel=0.03)


def test_an_empty_marker_is_named(tmp_path: pathlib.Path) -> None:
    error = refused(trial(tmp_path, empty=("RLMAL", "RMMAL", "RAJC")))
    assert "the file holds RLMAL and RMMAL of the right ankle without a single place" in error.problem
    assert "known by its name" not in error.problem


def test_clocks_that_do_not_meet_are_named(tmp_path: pathlib.Path) -> None:
    late = [dataclasses.replace(p, time=p.time + 100.0) for p in PLAIN.plates("feet")]
    error = refused(trial(tmp_path, late))
    assert error.field == "time"
    assert "while the motion is known" in error.problem


def test_the_foot_that_is_on_a_plate_is_the_way_out(tmp_path: pathlib.Path) -> None:
    files = trial(tmp_path, [p for p in PLAIN.plates("feet") if p.name == "l"])
    error = refused(files)
    assert (error.field, error.value, error.allowed) == ("side", "right", "left")
    assert "the left foot is on plate" in error.problem
    assert import_gait(files, Choices(side="left")).cycle.side == "left"


def test_forces_in_pounds_are_named(tmp_path: pathlib.Path) -> None:
    light = [dataclasses.replace(p, force=POUND * p.force) for p in PLAIN.plates("feet")]
    files = trial(tmp_path, light)
    (doubt,) = with_code(import_gait(files, Choices()).warnings, "forces-in-pounds")
    assert doubt.data["fits"] == pytest.approx(PLAIN.walker.mass, rel=0.02)
    error = refused(files, mass=PLAIN.walker.mass)
    assert error.field == "mass"
    assert "pounds (lbf)" in error.problem


def test_moments_in_newton_millimetres_are_named(tmp_path: pathlib.Path) -> None:
    columns = {name: 1e3 * column for name, column in PLAIN.moments().items()}
    done = import_gait([*trial(tmp_path), write_table(tmp_path / "id.sto", PLAIN.time, columns)], Choices())
    (doubt,) = with_code(done.warnings, "moment-off-reference")
    assert "N·mm" in doubt.data["reason"]


def test_a_motion_that_comes_back_but_not_closely_is_not_said_to_be_lost() -> None:
    walk = known_walk()
    motion = leg(walk, walk.heel_strike(1) + np.arange(0.0, 1.35 * walk.cycle.stride_time, 0.01))
    drift = np.radians(30.0) * (motion.time - motion.time.mean())
    why = period_by_motion(dataclasses.replace(motion, knee_angle=motion.knee_angle + drift))
    assert isinstance(why, str)
    after = float(why.partition(" after ")[2].partition(" s")[0])
    assert after == pytest.approx(walk.cycle.stride_time, rel=0.05)
