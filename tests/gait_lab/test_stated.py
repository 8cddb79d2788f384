"""What a laboratory's C3D states: taken where nobody said otherwise, compared in any case."""

import dataclasses
import pathlib
from typing import Any

import numpy as np
import pytest
from gait_lab.c3d_writer import write_c3d
from gait_lab.laboratory import Laboratory
from recorded_leg import leg
from walking import known_walk

from afo_sim.common import with_code
from afo_sim.gait_lab import Choices, import_gait, ten_lines
from afo_sim.gait_lab.readers.c3d import read_c3d
from afo_sim.gait_lab.trial.recorded_stride import MARKED
from afo_sim.gait_lab.trial.strides import find_strides

LABORATORY = Laboratory(rate=200.0, plate_rate=1000.0)
WALKER = LABORATORY.walker
HEIGHT = 1.71  # [m]
OFFSET = 3.0  # of the laboratory's ankle angle [deg]
LATE = 0.012  # of the marked events after the walker's own [s]


def written(folder: pathlib.Path, mass: float, moment: tuple[float, str] = (1e3, "Nmm")) -> pathlib.Path:
    """The known walker as Vicon's Plug-in Gait writes it, with the right ankle's angle and moment.

    `moment`: what the file's number is of 1 N·m/kg, and the unit that it states.
    """
    time, points = LABORATORY.time, dict(LABORATORY.markers("plug-in gait"))
    angle = np.degrees(WALKER.angle("right", "ankle", time)) + OFFSET
    kinetics = -WALKER.moment("right", time, foot=False) / WALKER.mass * moment[0]
    for name, curve in (("RAnkleAngles", angle), ("RAnkleMoment", kinetics)):
        points[name] = 1e-3 * np.outer(curve, [1.0, 0.1, 0.1])  # written as mm
    said = {"PROCESSING": {"Bodymass": mass, "Height": 1e3 * HEIGHT, "RLegLength": 880.0}}
    said["POINT"] = {"ANGLES": "RAnkleAngles", "MOMENTS": "RAnkleMoment", "MOMENT_UNITS": moment[1]}

    def change(file: Any) -> None:
        for group, name, value in ((g, n, v) for g, each in said.items() for n, v in each.items()):
            file.add_parameter(group, name, [value])
        for number in range(2):
            at = WALKER.heel_strike("right", number) + LATE
            file.add_event([0.0, at], context="Right", label="Foot Strike")

    return write_c3d(folder / "walk.c3d", time, points, LABORATORY.plates("feet"), change=change)


@pytest.mark.parametrize(
    "moment", [(1e3, "Nmm"), (1.0, "N.m/kg"), (1e3 * WALKER.mass, "Nmm"), (WALKER.mass, "Nm")]
)
def test_measures_are_taken_and_curves_compared(tmp_path: pathlib.Path, moment: tuple[float, str]) -> None:
    done = import_gait([written(tmp_path, 1.04 * WALKER.mass, moment)], Choices())
    assert (done.mass.how, done.mass.mass) == ("of the file", pytest.approx(1.04 * WALKER.mass))
    assert done.mass.estimated == pytest.approx(WALKER.mass, rel=0.02)
    assert done.cycle.body_height == pytest.approx(HEIGHT)
    assert done.trial.stated.legs == {"right": pytest.approx(0.88)}
    assert done.reference is not None
    time = done.strides[done.chosen[0]].start + done.cycle.phase * done.cycle.stride_time
    whole = moment[0] in (WALKER.mass, 1e3 * WALKER.mass)
    expected = WALKER.moment("right", time, foot=False) / (done.mass.mass if whole else WALKER.mass)
    known = np.isfinite(done.reference)  # in swing the file has zeros, which stand for nothing
    assert known.mean() > 0.55
    assert done.reference[known] == pytest.approx(expected[known], abs=0.005)
    rows = dict(ten_lines(done))
    assert "RMS from the laboratory's own" in rows["moment"]
    off = np.degrees(WALKER.angle("right", "ankle", time) - done.cycle.ankle_angle).mean() + OFFSET
    assert f"laboratory's own angle {off:+.1f} deg" in rows["ankle"]
    assert "heel strike +12 ms from these" in rows["taken"]
    assert "height 1.71 m of the file" in rows["body mass"]
    assert done.cycle.notes["ankle_moment"].startswith("derived")


def test_what_a_person_gives_goes_before_the_file_and_a_wrong_file_is_told(tmp_path: pathlib.Path) -> None:
    file = written(tmp_path, 1.15 * WALKER.mass)
    (doubt,) = with_code(import_gait([file], Choices()).warnings, "mass-differs")
    assert doubt.data["how"] == "of the file"
    assert doubt.data["percent"] == pytest.approx(100.0 / 1.15 - 100.0, abs=1.0)
    done = import_gait([file], Choices(mass=WALKER.mass, height=1.6))
    assert (done.mass.how, done.cycle.body_height) == ("given", 1.6)


@pytest.mark.parametrize(("mass", "doubts"), [(0.0, []), (6e4, ["mass"])])
def test_a_mass_that_nobody_has_is_not_taken(tmp_path: pathlib.Path, mass: float, doubts: list[str]) -> None:
    markers, _ = read_c3d(written(tmp_path, mass))
    assert markers.stated is not None and markers.stated.mass is None
    assert [doubt.subject for doubt in with_code(markers.warnings, "stated-unlikely")] == doubts


def test_a_marked_heel_strike_counts_where_force_and_motion_show_none() -> None:
    walk = known_walk()
    first, last = (walk.heel_strike(number) for number in (1, 2))
    motion = leg(walk, np.arange(first, last + 0.005, 0.005))
    (stride,) = find_strides(dataclasses.replace(motion, marked=(first, last)), None)
    assert MARKED in (stride.start_by, stride.end_by)
    assert stride.closed is None
    assert stride.start == pytest.approx(first, abs=0.005)
    assert stride.end == pytest.approx(last, abs=0.04)
