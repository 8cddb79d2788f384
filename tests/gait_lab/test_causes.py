"""A refusal names its true cause and the way out: each case is a trial that was generated with one fault."""

import dataclasses
import pathlib
import re
from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest
from analytic_walker import AnalyticWalker
from gait_lab.laboratory import Laboratory, Recorded
from gait_lab.trial_files import write_forces, write_trc, write_trial
from recorded_leg import leg, plate
from walking import known_walk, write_table

from afo_sim.common import GRAVITY, InputError, with_code
from afo_sim.gait_lab import Choices, import_gait
from afo_sim.gait_lab.trial.events import period_by_motion
from afo_sim.gait_lab.trial.strides import find_strides

PLAIN = Laboratory()
FEET = PLAIN.plates("feet")


def trial(folder: pathlib.Path, plates: Sequence[Recorded] = FEET, empty: Sequence[str] = ()) -> list[Any]:
    """Markers, of which some have no number, and plates of the known walker."""
    points = {n: p * np.nan if n in empty else p for n, p in PLAIN.markers("opensim c3d").items()}
    return write_trial(folder, PLAIN, "opensim c3d", plates, points)


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
        place = each.points["ankle"].path * [1.0, 0.0, 1.0] + np.outer(0.18 * share - 0.05, [1.0, 0.0, 0.0])
        plates.append(Recorded(side[0], fast, force, place, np.zeros((4, 3))))
    return [write_trc(folder / "walk.trc", time, points), write_forces(folder / "grf.mot", plates)]


@pytest.mark.parametrize(("duty", "speed"), [(0.35, 3.3), (0.45, 2.5), (0.54, 1.6), (0.62, 1.2), (0.70, 0.7)])
def test_a_run_is_refused_and_a_walk_is_not(tmp_path: pathlib.Path, duty: float, speed: float) -> None:
    refused = pytest.raises(InputError, match="runs: the right foot")
    with refused if duty < 0.5 else nullcontext() as seen:
        done = import_gait(gait_of(tmp_path, duty, speed), Choices())
        assert done.cycle.walking_speed == pytest.approx(speed, rel=0.03)
    if seen is not None:  # 20 N are a little later than the first contact
        share = float(re.findall(r"(\d+\.\d) %", seen.value.problem)[0])
        assert share == pytest.approx(100.0 * duty, abs=1.0)


LATE = [dataclasses.replace(plate, time=plate.time + 100.0) for plate in FEET]
LIGHT = [dataclasses.replace(plate, force=plate.force / 4.4482216) for plate in FEET]  # lbf
LEFT = [plate for plate in FEET if plate.name == "l"]
CENTRE = ("RLMAL", "RMMAL", "RAJC")


@pytest.mark.parametrize(
    ("plates", "empty", "mass", "field", "words"),
    [
        (FEET, CENTRE, None, "markers", "holds RLMAL and RMMAL of the right ankle without a single place"),
        (LATE, (), None, "time", "nobody stands on a plate"),
        (LIGHT, (), PLAIN.walker.mass, "mass", "pounds (lbf)"),
        (LEFT, (), None, "side", "the left foot is on plate"),
    ],
)
def test_a_refusal_names_the_cause(
    tmp_path: pathlib.Path, plates: Any, empty: Any, mass: float | None, field: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        import_gait(trial(tmp_path, plates, empty), Choices(mass=mass))
    assert caught.value.field == field
    assert words in caught.value.problem
    if field == "side":
        assert caught.value.allowed == "left"


def test_other_units_of_force_and_moment_are_named(tmp_path: pathlib.Path) -> None:
    (doubt,) = with_code(import_gait(trial(tmp_path, LIGHT), Choices()).warnings, "forces-in-pounds")
    assert doubt.data["fits"] == pytest.approx(PLAIN.walker.mass, rel=0.02)
    columns = {name: 1e3 * column for name, column in PLAIN.moments().items()}
    done = import_gait([*trial(tmp_path), write_table(tmp_path / "id.sto", PLAIN.time, columns)], Choices())
    (doubt,) = with_code(done.warnings, "moment-off-reference")
    assert "N·mm" in doubt.data["reason"]


@pytest.mark.slow
def test_what_cannot_be_closed_is_not_said_to_be_lost() -> None:
    """A knee that is straightened by 30 degrees a second; a whole contact in the last part of a stride."""
    walk = known_walk()
    motion = leg(walk, np.arange(walk.heel_strike(1) - 0.2, walk.heel_strike(3) + 0.9, 0.01))
    motion.knee_angle[:] += np.radians(30.0) * (motion.time - motion.time.mean())
    short = leg(walk, motion.time[20:180])
    short.knee_angle[:] += np.radians(30.0) * (short.time - short.time.mean())
    why = period_by_motion(short)
    assert isinstance(why, str)
    after = float(why.partition(" after ")[2].partition(" s")[0])
    assert after == pytest.approx(walk.cycle.stride_time, rel=0.05)
    strides = find_strides(motion, plate(walk, np.arange(walk.heel_strike(3) - 0.2, 6.0, 0.001), motion))
    assert not any(stride.loaded for stride in strides)
    assert "the motion ends before the next heel strike" in strides[-1].missing
