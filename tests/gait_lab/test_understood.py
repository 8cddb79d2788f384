"""The verdict and the ten rows on a trial: each number in them is computed here a second time."""

import dataclasses
import pathlib
import re
from types import SimpleNamespace

import numpy as np
from gait_lab.faulty_trials import FAULTS
from understood_trial import stand_in

from afo_sim.common import GRAVITY
from afo_sim.gait_lab import Choices, import_gait, ten_lines, verdict
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.trial.leg_points import LegPoint


def test_a_person_reads_ten_lines_in_the_order_of_their_questions() -> None:
    lines = ten_lines(stand_in())
    assert [subject for subject, _ in lines] == [
        "found",
        "direction",
        "joint centres",
        "strides",
        "taken",
        "body mass",
        "ankle",
        "moment",
        "estimated",
        "better with",
    ]
    assert all(sentence.strip() for _, sentence in lines)


def test_what_was_found_names_files_plates_legs_and_seconds() -> None:
    found = dict(ten_lines(stand_in(duration=4.0)))["found"]
    assert "markers walk.trc" in found
    assert "2 force plates" in found
    assert "both legs, 0.00 to 3.99 s" in found


def test_every_joint_centre_has_its_way_and_its_error() -> None:
    centres = dict(ten_lines(stand_in()))["joint centres"].split("; ")
    roles = ["hip ±20 mm fore-aft", "knee ±10 mm", "ankle ±8 mm", "heel", "toe"]
    assert [words.split(":")[0] for words in centres] == roles
    assert centres[0].endswith(": Harrington 2007 from the pelvis' markers")
    assert centres[3] == "heel: R.Heel"  # whose error is not known


def test_what_joint_centres_share_is_said_once() -> None:
    done = stand_in()
    points = dict(done.legs["right"].points)
    for role, name in (("hip", "RHJC"), ("knee", "RKJC"), ("ankle", "RAJC")):
        points[role] = LegPoint(points[role].path, name, way="a centre given in the file")
    done.legs["right"] = dataclasses.replace(done.legs["right"], points=points)
    centres = dict(ten_lines(done))["joint centres"]
    assert centres.startswith("hip RHJC, knee RKJC, ankle RAJC: a centre given in the file; ")
    for role in ("hip", "knee", "ankle"):
        points[role] = LegPoint(points[role].path, "joint angles in the model")
    assert dict(ten_lines(done))["joint centres"].startswith("hip, knee, ankle: joint angles in the model; ")


def test_only_what_is_bridged_in_the_taken_stride_is_told() -> None:
    done = stand_in()
    leg, stride = done.legs["right"], done.strides[0]
    inside = (leg.time >= stride.start) & (leg.time <= stride.end)
    for bridged, told in ((~inside, False), (inside & (leg.time > stride.start + 0.75 * stride.time), True)):
        hip = dataclasses.replace(leg.points["hip"], bridged=bridged)
        text = "{subject}: seen in 60 of 200 frames, in 140 more by its segment's markers"
        notices = (note("point-bridged", text, subject="right hip"),)
        done.legs["right"] = dataclasses.replace(leg, points={**leg.points, "hip": hip}, notices=notices)
        found = dict(ten_lines(done))["found"]
        assert ("hip by the segment's markers in 25 % of the stride" in found) == told
        assert "60 of 200" not in found


def test_the_verdict_tells_stride_peaks_mass_and_speed() -> None:
    done = stand_in()
    cycle, stride = done.cycle, done.strides[0]
    words = verdict(done)
    own = sum(s.side == "right" for s in done.strides)
    assert words.startswith(f"right stride 1 of {own}, {stride.start:.2f} to {stride.end:.2f} s: ")
    assert f"plantarflexor peak {-cycle.ankle_moment.min():.2f} ±" in words
    assert f"dorsiflexor peak {cycle.ankle_moment[cycle.phase < 0.6].max():.2f} ±" in words
    assert words.endswith(f"{cycle.body_mass:.1f} kg, {cycle.walking_speed:.2f} m/s")


def test_a_foot_that_only_pushes_has_no_dorsiflexor_peak() -> None:
    done = stand_in()
    done.cycle = dataclasses.replace(done.cycle, ankle_moment=-np.abs(done.cycle.ankle_moment) - 0.01)
    assert "dorsiflexor peak none, " in verdict(done)


def test_a_mean_of_both_legs_tells_each_legs_peak() -> None:
    done = stand_in()
    left = next(k for k, s in enumerate(done.strides) if s.side == "left" and s.loaded)
    done.chosen = (0, left)
    words = verdict(done)
    assert words.startswith("mean of both legs, 1 right and 1 left stride: ")
    right_peak, left_peak = (-done.cycles[k].ankle_moment.min() for k in done.chosen)
    assert f"(right {right_peak:.2f}, left {left_peak:.2f})" in words


def test_an_ankles_error_is_its_arm_times_the_force() -> None:
    done = stand_in()
    leg = done.legs["right"]
    for error in (0.005, 0.013):
        ankle = dataclasses.replace(leg.points["ankle"], error=error)
        done.legs["right"] = dataclasses.replace(leg, points={**leg.points, "ankle": ankle})
        said = dict(ten_lines(done))["estimated"]
        moment = float(re.search(r"ankle ±([\d.]+) N·m/kg", said)[1])
        force = done.cycle.grf_z[np.argmin(done.cycle.ankle_moment)]  # at the peak
        assert abs(moment - error * force * GRAVITY) <= 0.005
        assert f"±{moment:.2f} N·m/kg" in verdict(done)


def test_a_knees_error_leans_the_shank_by_error_over_length() -> None:
    done = stand_in()
    leg = done.legs["right"]
    length = np.linalg.norm(leg.points["knee"].path - leg.points["ankle"].path, axis=1).mean()
    lean = float(re.search(r"shank ±([\d.]+) deg", dict(ten_lines(done))["estimated"])[1])
    assert abs(lean - np.degrees(np.arctan(0.010 / length))) < 0.06


def test_moment_is_compared_with_a_given_inverse_dynamics() -> None:
    done = stand_in()
    cycle = done.cycle
    for off in (0.05, -0.2):
        done.reference = cycle.ground_moment() + off
        assert f"{abs(off):.3f} N·m/kg RMS from the" in dict(ten_lines(done))["moment"]
    done.reference = None
    assert "RMS" not in dict(ten_lines(done))["moment"]
    assert re.search(
        rf"plantarflexor {-cycle.ankle_moment.min():.2f} ±[\d.]+ at 50 %", dict(ten_lines(done))["moment"]
    )


def test_a_given_mass_is_held_against_the_plates() -> None:
    text = "the plates carry 64.0 kg (±{percent:.0f} %) over 2 right strides"
    carried = (note("mass-by-plates", text, percent=2.0),)
    mass = SimpleNamespace(mass=80.0, how="given", estimated=64.0, remarks=carried)
    words = dict(ten_lines(stand_in(mass=mass)))["body mass"]
    assert words.startswith("80.0 kg, given, +25.0 % off: the plates carry 64.0 kg (±2 %); height ")
    mass = SimpleNamespace(mass=64.0, how="by the plates", estimated=64.0, remarks=carried)
    assert dict(ten_lines(stand_in(mass=mass)))["body mass"].startswith(f"{carried[0]}; height ")


def test_height_and_sole_are_told_as_they_are_known() -> None:
    done = stand_in()
    done.cycle = dataclasses.replace(done.cycle, body_height=None, sole_thickness=None)
    told = dict(ten_lines(done))
    assert told["body mass"].endswith("; height not known: a run keeps its patient's")
    assert told["ankle"].endswith("; sole not known: taken as barefoot")
    done.cycle = dataclasses.replace(done.cycle, body_height=1.72, sole_thickness=0.025)
    told = dict(ten_lines(done))
    assert told["body mass"].endswith("; height 1.72 m")
    assert told["ankle"].endswith("; sole 25 mm")


def test_a_closed_stride_tells_what_was_recorded_first_and_no_other_times() -> None:
    done = stand_in()
    stride = done.strides[0]
    window = (stride.start - 0.4 * stride.time, stride.start + 0.55 * stride.time)
    stride.closed = SimpleNamespace(
        window=window,
        gap=0.05 * stride.time,
        residual={"ankle_angle": np.radians(0.7), "knee_angle": np.radians(-0.9), "ankle_z": -0.003},
    )
    taken = dict(ten_lines(done))["taken"]
    told = f"recorded {window[0]:.3f} to {window[1]:.3f} s, closed cyclically"
    assert taken.startswith(told)
    assert told in verdict(done)
    assert "95.0 % of a stride recorded; ends meet within 0.9 deg and 3 mm" in taken
    instants = [float(t) for t in re.findall(r"([\d.]+) s\b", taken)]
    assert all(window[0] - 0.001 <= t <= window[1] + 0.001 for t in instants)


def test_a_mean_tells_of_how_many_strides_it_is() -> None:
    done = stand_in(duration=8.0)
    done.chosen = tuple(k for k, s in enumerate(done.strides) if s.side == "right")
    for k, stride in enumerate(done.strides):
        stride.time += 0.01 * (k % 3)
    spread = np.std([done.strides[k].time for k in done.chosen], ddof=1)
    taken = dict(ten_lines(done))["taken"]
    assert taken.startswith(f"{len(done.chosen)} right strides")
    assert f"standard deviation {spread:.3f} s" in taken
    done.chosen = tuple(range(len(done.strides)))
    assert "6 right and 5 left strides" in dict(ten_lines(done))["taken"]


def test_the_wishes_are_two_and_the_ankles_goes_first() -> None:
    done = stand_in()
    wishes = dict(ten_lines(done))["better with"].split("; ")
    assert [wish.split(":")[0] for wish in wishes] == ["ankle", "hip"]
    done.strides[0].loaded = False
    wishes = dict(ten_lines(done))["better with"].split("; ")
    assert wishes[0] == "a plate under the whole stance"
    assert len(wishes) == 2
    done = stand_in()
    known = {role: LegPoint(point.path, "model") for role, point in done.legs["right"].points.items()}
    done.legs["right"] = dataclasses.replace(done.legs["right"], points=known)
    assert dict(ten_lines(done))["better with"] == "nothing that is known"


def test_what_a_plate_reads_without_load_is_told(tmp_path: pathlib.Path) -> None:
    done = import_gait(FAULTS["plate not zeroed, 30 N"].write(tmp_path), Choices())
    (row,) = [words for subject, words in ten_lines(done) if subject == "strides"]
    assert re.search(r"without load taken off: (2[6-9]|3[0-4])(\.\d)? N of plate ", row)
