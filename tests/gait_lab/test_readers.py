"""Laboratory files → gait cycle: a known walk is written as .mot, .sto, .trc and .c3d, and recovered."""

import dataclasses
import pathlib

import numpy as np
import pytest
from recorded_leg import leg
from walking import (
    SHANK,
    THIGH,
    Walk,
    write_angles,
    write_forces,
    write_table,
    write_trc,
)

from afo_sim.common import GRAVITY, InputError
from afo_sim.gait_lab import Choices, Imported, WalkingTrial, import_gait, read_options, read_trial
from afo_sim.gait_lab.readers.opensim_table import read_opensim_table
from afo_sim.gait_lab.readers.signals import even_clock, evenly, fill_gaps, low_pass
from afo_sim.gait_lab.trial.events import posture_return
from afo_sim.gait_lab.trial.ground_force import find_contacts, foot_force
from afo_sim.gait_lab.trial.legs import find_legs

SLOW, FAST = np.arange(0.0, 3.2, 0.01), np.arange(0.0, 3.2, 0.001)  # 100 Hz and 1 kHz
MASS = 67.2
PLAIN = Choices(mass=MASS, cutoff=0.0)  # a known walk has no noise to take away


def recovered(done: Imported, walk: Walk) -> dict[str, float]:
    """RMS differences between what was imported and the walk itself, in deg, mm, body weights."""
    cycle, stride = done.cycle, done.strides[done.chosen[0]]
    time = stride.start + cycle.phase * stride.time
    found = {}
    for name in ("shank_angle", "knee_angle", "ankle_angle"):
        found[name] = np.degrees(getattr(cycle, name) - walk.angle(name, time))
    found["ankle_z"] = 1e3 * (cycle.ankle_z - walk.angle("ankle_z", time))
    found["ankle_x"] = 1e3 * (cycle.ankle_x - walk.angle("ankle_x", time) + walk.angle("ankle_x", time[:1]))
    forward, upward, place = walk.force(time)
    weight = MASS * GRAVITY
    found["grf_x"], found["grf_z"] = cycle.grf_x - forward / weight, cycle.grf_z - upward / weight
    known = np.isfinite(cycle.cop_x)
    ahead = place - walk.way - walk.angle("ankle_x", time)
    found["cop_x"] = 1e3 * (cycle.cop_x - ahead)[known]
    return {name: float(np.sqrt(np.mean(error**2))) for name, error in found.items()}


def assert_recovered(done: Imported, walk: Walk, *, angle: float = 0.1, ankle: float = 0.5) -> None:
    errors = recovered(done, walk)
    for name, error in errors.items():
        limit = angle if name.endswith("angle") else 0.003 if name.startswith("grf") else ankle
        assert error < limit, (name, error)
    share = np.isfinite(done.cycle.cop_x).mean()
    assert 0.6 < share < 0.7  # stance has a centre of pressure, swing has none
    assert done.cycle.stride_time == pytest.approx(walk.cycle.stride_time, abs=1e-3)


@pytest.mark.parametrize("degrees", [True, False])
@pytest.mark.parametrize("knee", [1.0, -1.0])
def test_opensim_trial_is_recovered(walk: Walk, tmp_path: pathlib.Path, degrees: bool, knee: float) -> None:
    """Joint angles at 100 Hz, two plates at 1 kHz, markers for the ankle; degrees or radians by header."""
    angles = write_angles(tmp_path / "ik.mot", walk, SLOW, degrees=degrees, knee=knee)
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    done = import_gait([forces, markers, angles], PLAIN)
    assert_recovered(done, walk)
    assert "right foot on plate 1_ground_force" in done.remarks
    assert any("turned round" in remark for remark in done.remarks) is (knee < 0.0)
    assert f"joint angles in {'degrees' if degrees else 'radians'}" in done.remarks
    assert done.cycle.stride_time == pytest.approx(walk.cycle.stride_time, abs=1e-4)


def test_opensim_angles_with_lengths_are_recovered(walk: Walk, tmp_path: pathlib.Path) -> None:
    """No marker: the ankle hangs on pelvis, thigh and shank."""
    files = [write_angles(tmp_path / "ik.mot", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    with pytest.raises(InputError) as caught:
        import_gait(files, PLAIN)
    assert "missing: `thigh`, `shank`, `ankle_height`" in caught.value.problem
    assert "a .trc with an ankle marker" in caught.value.allowed
    choices = Choices(
        mass=MASS,
        cutoff=0.0,
        thigh=THIGH,
        shank=SHANK,
        hip=(-0.06, -0.08),
        ankle_height=walk.cycle.ankle_height,
    )
    assert_recovered(import_gait(files, choices), walk)


def test_body_positions_give_the_ankle(walk: Walk, tmp_path: pathlib.Path) -> None:
    ankle = walk.points(SLOW)["ankle"]
    bodies = write_table(
        tmp_path / "BodyKinematics_pos_global.sto",
        SLOW,
        {"talus_r_X": ankle[:, 0], "talus_r_Y": ankle[:, 1], "talus_r_Z": 0.1 + 0.0 * SLOW},
    )
    files = [write_angles(tmp_path / "ik.mot", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    assert_recovered(import_gait([*files, bodies], PLAIN), walk)


def test_joint_angles_lie_in_the_plane_in_which_the_ankle_is_seen_to_walk(
    walk: Walk, tmp_path: pathlib.Path
) -> None:
    """Without the pelvis' way the markers show it, with gaps; who turns the laboratory turns the leg."""
    table = read_opensim_table(write_angles(tmp_path / "ik.mot", walk, SLOW))
    angles = dataclasses.replace(
        table, columns={name: c for name, c in table.columns.items() if not name.startswith("pelvis_t")}
    )
    angles.columns["pelvis_tilt"] = table.columns["pelvis_tilt"]
    (marked,) = (read_trial([write_trc(tmp_path / "walk.trc", walk, SLOW)]).markers,)
    assert marked is not None
    places: dict[float, dict[str, np.ndarray]] = {}
    for yaw in (0.0, 0.7, 2.5):
        turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
        turned = {name: path @ turn.T for name, path in marked.positions.items()}
        for path in turned.values():
            path[:3] = path[-2:] = np.nan
        trial = WalkingTrial((marked.file,), (), dataclasses.replace(marked, positions=turned), angles)
        leg = find_legs(trial, Choices(), None)[0]["right"]
        places[yaw] = {role: point.path @ turn for role, point in leg.points.items()}
        for role, path in places[yaw].items():
            np.testing.assert_allclose(path, places[0.0][role], atol=1e-9, err_msg=role)
    lean = places[0.0]["knee"] - places[0.0]["ankle"]
    shank = np.interp(SLOW, angles.time, walk.angle("shank_angle", SLOW))
    np.testing.assert_allclose(np.arctan2(lean[:, 0], lean[:, 1])[5:-5], shank[5:-5], atol=1e-6)


@pytest.mark.parametrize("rate", [1000.0, 100.0])
def test_contact_is_found_within_a_sample(rate: float) -> None:
    """Half-sine steps of 0.7 s with known edges, noise of 10 N between them."""
    time = np.arange(0.0, 4.0, 1.0 / rate)
    noise = np.random.default_rng(1).normal(0.0, 5.0, len(time))
    starts = (0.5033, 1.7071, 2.9507)
    force = noise + sum(700.0 * np.sin(np.pi * np.clip((time - start) / 0.7, 0.0, 1.0)) for start in starts)
    contacts = find_contacts("1", time, force)
    assert len(contacts) == 3
    for contact, start in zip(contacts, starts, strict=True):
        edge = 0.7 / np.pi * np.arcsin(20.0 / 700.0)  # later than the start: where 20 N are reached
        slope = 700.0 * np.pi / 0.7  # the noise moves the crossing by itself over this
        allowed = 1.0 / rate + 20.0 / slope
        assert abs(contact.start - start - edge) < allowed
        assert abs(contact.end - (start + 0.7 - edge)) < allowed
        assert contact.whole


def test_a_contact_begins_and_ends_where_the_line_between_two_samples_meets_20_newtons() -> None:
    """Samples of no even steps whose lines have each a slope of their own."""
    time = np.array([0.0, 0.01, 0.025, 0.03, 0.05, 0.09, 0.14, 0.16, 0.17, 0.18, 0.2])
    force = np.array([0.0, 2.0, 12.0, 40.0, 300.0, 640.0, 700.0, 450.0, 90.0, 4.0, 0.0])
    (contact,) = find_contacts("1", time, force)
    assert contact.start == pytest.approx(np.interp(20.0, force[:5], time[:5]), abs=1e-12)
    assert contact.end == pytest.approx(np.interp(-20.0, -force[6:], time[6:]), abs=1e-12)
    assert contact.whole
    late, cut = find_contacts("1", time[4:], force[4:]), find_contacts("1", time[:7], force[:7])
    assert [(c.begins, c.ends, c.start) for c in late] == [(False, True, 0.05)]
    assert [(c.begins, c.ends, c.end) for c in cut] == [(True, False, 0.14)]


@pytest.mark.parametrize(
    ("most", "lasts", "count"),
    [(49.9, 0.3, 0), (50.0, 0.3, 0), (50.1, 0.3, 1), (700.0, 0.095, 0), (700.0, 0.105, 1)],
)
def test_a_contact_that_is_weak_or_brief_is_none(most: float, lasts: float, count: int) -> None:
    """Above 50 N and for 0.1 s; a brief one that the recording cuts may have lasted longer."""
    time = np.arange(0.0, 0.5, 0.0001)
    force = np.where((time > 0.1) & (time < 0.1 + lasts), most, 0.0)
    assert len(find_contacts("1", time, force)) == count
    cut = time < 0.1 + 0.5 * lasts
    assert len(find_contacts("1", time[cut], force[cut])) == (most > 50.0)


def test_posture_agrees_with_force_on_the_recorded_trial() -> None:
    """Between the two shipped strides' ends the posture returns within a sample of the next heel strike."""
    from afo_sim.common import assets
    from afo_sim.gait import file as gait
    from afo_sim.gait_lab.trial.leg_motion import LegMotion

    first, second = (gait.read(assets.find_gait(f"gatk_stride{k}")) for k in (1, 2))
    time, values = [], {n: [] for n in ("shank_angle", "knee_angle", "ankle_angle", "ankle_x", "ankle_z")}
    start = 0.0
    for cycle in (first, second):
        time.append(start + cycle.phase[:-1] * cycle.stride_time)
        for name, parts in values.items():
            parts.append(getattr(cycle, name)[:-1])
        start += cycle.stride_time
    even = np.arange(0.0, start - 0.01, 0.01)
    series = {n: np.interp(even, np.concatenate(time), np.concatenate(v)) for n, v in values.items()}
    foot = np.zeros((len(even), 2))
    motion = LegMotion(even, **series, heel=foot, toe=foot)
    assert posture_return(motion, 0.0) == pytest.approx(first.stride_time, abs=0.015)


def test_filter_is_6_hz_over_both_passes_and_delays_nothing() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    middle = slice(200, 800)
    for frequency, expected in ((1.0, 1.0), (6.0, np.sqrt(0.5)), (20.0, 0.0)):
        wave = np.sin(2 * np.pi * frequency * time)
        gain = low_pass(time, wave, 6.0)[middle] @ wave[middle] / (wave[middle] @ wave[middle])
        assert gain == pytest.approx(expected, abs=0.02)
    assert np.array_equal(low_pass(time, wave, 0.0), wave)
    assert np.array_equal(low_pass(time, wave, 60.0), wave)  # beyond what 100 Hz can tell
    assert np.array_equal(low_pass(time[:12], wave[:12], 6.0), wave[:12])


def test_uneven_time_is_made_even() -> None:
    time = np.cumsum(np.r_[0.0, np.tile([0.008, 0.012, 0.010], 50)])
    even, values = evenly(time, np.column_stack([time, 2.0 * time]))
    assert np.ptp(np.diff(even)) < 1e-9
    assert np.allclose(values, np.column_stack([even, 2.0 * even]))


@pytest.mark.parametrize(("rate", "step"), [(30.0, 1 / 30), (40.0, 0.025), (25.0, 0.03), (50.0, 0.03)])
def test_steps_of_30_ms_are_a_rate_that_rounds_to_them(rate: float, step: float) -> None:
    """Printed in hundredths of a second; of what no rounding explains, the clock is right."""
    time, (doubt,) = even_clock(0.03 * np.arange(100), rate)
    assert np.diff(time) == pytest.approx(step)
    assert doubt.code == ("clock-rate-differs" if step == 0.03 else "clock-step-rounded")


def test_gaps_say_what_was_invented() -> None:
    time = np.arange(0.0, 1.0, 0.01)
    values = time**2
    holed = values.copy()
    holed[20:25] = holed[50:80] = holed[97:] = np.nan
    filled, hidden = fill_gaps(time, holed)
    assert np.abs(filled - values)[:97].max() < 1e-2
    assert np.abs(filled - values)[20:25].max() < 5e-4
    assert [(round(a, 2), round(b, 2)) for a, b in hidden] == [(0.49, 0.8), (0.96, 0.99)]


def test_bad_files_are_one_message(walk: Walk, tmp_path: pathlib.Path) -> None:
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    angles = write_angles(tmp_path / "ik.mot", walk, SLOW)
    write_trc(tmp_path / "walk.trc", walk, SLOW)
    (tmp_path / "plain.mot").write_text("time\ta\n0\t1\n")
    write_table(tmp_path / "other.sto", SLOW, {"soleus_r": SLOW})
    no_knee = angles.read_text().replace("knee_angle_r", "knee_r")
    (tmp_path / "no_knee.mot").write_text(no_knee)
    quiet = write_table(
        tmp_path / "quiet.mot", FAST, {f"ground_force_{n}": 0.0 * FAST for n in ("vx", "vy", "px")}
    )
    for files, expected in (
        (["plain.mot", forces], "has no header that ends in 'endheader'"),
        (["other.sto", forces], "holds neither joint angles"),
        (["no_knee.mot", forces], "knee_angle_r: this coordinate is missing"),
        (["walk.trc", quiet], "no foot stands on a plate"),
        ([forces], "no file holds the leg's motion"),
    ):
        with pytest.raises(InputError) as caught:
            import_gait([tmp_path / file for file in files], PLAIN)
        assert expected in str(caught.value)
        assert "\n" not in str(caught.value)


def test_choices_are_checked(walk: Walk, tmp_path: pathlib.Path) -> None:
    files = [write_trc(tmp_path / "walk.trc", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    with pytest.raises(InputError, match="there is no such plate"):
        import_gait(files, Choices(mass=MASS, plates=("3",)))
    with pytest.raises(InputError, match="there is no such stride"):
        import_gait(files, Choices(mass=MASS, stride=5))
    with pytest.raises(InputError, match="under the right foot throughout"):
        import_gait(files, Choices(mass=MASS, plates=("ground_force",)))
    for bad in (
        {"side": "middle"},
        {"forward": "w"},
        {"forward": "x", "up": "-x"},
        {"mass": 67200.0},
        {"stride": 0},
        {"markers": {"nose": ("a",)}},
        {"cutoff": -1.0},
        {"thigh": 41.0},
    ):
        with pytest.raises(InputError):
            Choices(**bad)


def test_options_are_read_with_their_units() -> None:
    given = {
        "mass": "158.733 lb", "height": "172 cm", "sole": "25 mm", "belt_speed": "4.32 km/h",
        "cutoff": "6 Hz", "thigh": "43 cm", "shank": "0.4 m",
        "hip": ("-6.3 cm", "-72 mm"), "ankle_height": "7 cm",
    }  # fmt: skip
    found = vars(read_options(given))
    for name, value in {
        "mass": 72.0, "height": 1.72, "sole": 0.025, "belt_speed": 1.2, "cutoff": 6.0,
        "thigh": 0.43, "shank": 0.4, "hip": (-0.063, -0.072), "ankle_height": 0.07,
    }.items():  # fmt: skip
        assert found[name] == pytest.approx(value, rel=1e-5), name


def test_simms_header_is_understood(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "old.mot"
    path.write_text(
        "name old\ndatacolumns 2\ndatarows 3\nrange 0 0.2\nendheader\ntime a\n0 1\n0.1 2\n0.2 3\n"
    )
    table = read_opensim_table(path)
    assert table.degrees is None
    assert np.array_equal(table.columns["a"], [1.0, 2.0, 3.0])


def test_foot_force_adds_what_two_plates_share(walk: Walk) -> None:
    """A foot across the joint of two plates, 30 to 70: their sum acts at their common centre of pressure."""
    from afo_sim.gait_lab import Plate, WalkingFrame

    forward, upward, place = walk.force(FAST)
    motion, zero = leg(walk, SLOW), np.zeros_like(FAST)
    plates = [
        Plate(
            name,
            FAST,
            share * np.column_stack([forward, upward, zero]),
            np.column_stack([place + shift, zero, zero]),
        )
        for name, share, shift in (("a", 0.3, 0.07), ("b", 0.7, -0.03))
    ]
    frame = WalkingFrame(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.0)
    ground = foot_force(plates, motion, {}, frame, PLAIN)
    inside = upward > 100.0
    assert np.allclose(ground.force_z[inside], upward[inside])
    assert np.allclose((ground.moment / np.maximum(ground.force_z, 1.0))[inside], place[inside], atol=1e-6)


def test_forces_that_are_no_numbers_are_refused_where_they_matter(walk: Walk, tmp_path: pathlib.Path) -> None:
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    forward, upward, place = walk.force(FAST)
    loaded, empty = int(np.argmax(upward)), int(np.argmin(upward))
    for row, column, value, problem in (
        (loaded, "vy", np.nan, "its force is not a finite number"),
        (empty, "vx", np.inf, "its force is not a finite number"),
        (loaded, "px", np.nan, "its place is not a finite number"),
        (empty, "px", -np.inf, "its place is not a finite number"),
        (empty, "px", np.nan, ""),
    ):
        columns = {"vx": forward.copy(), "vy": upward.copy(), "px": place.copy()}
        columns[column][row] = value
        named = {f"ground_force_{name}": values for name, values in columns.items()}
        forces = write_table(tmp_path / "grf.mot", FAST, named)
        if not problem:
            assert np.isfinite(import_gait([markers, forces], PLAIN).cycle.ankle_moment).all()
            continue
        with pytest.raises(InputError, match=problem) as caught:
            import_gait([markers, forces], PLAIN)
        assert caught.value.file == forces
