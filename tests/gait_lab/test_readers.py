"""Laboratory files → gait cycle: a known walk is written as .mot, .sto, .trc and .c3d, and recovered."""

import pathlib
import re
import sys

import numpy as np
import pytest
from walking import (
    SHANK,
    THIGH,
    Walk,
    known_walk,
    marker_points,
    write_angles,
    write_forces,
    write_table,
    write_trc,
)

from afo_sim.common import GRAVITY, InputError
from afo_sim.gait_lab import Choices, Imported, import_gait
from afo_sim.gait_lab.readers.c3d import read_c3d
from afo_sim.gait_lab.readers.opensim_table import read_opensim_table
from afo_sim.gait_lab.readers.signals import even_clock, evenly, fill_gaps, low_pass
from afo_sim.gait_lab.readers.trc import read_trc
from afo_sim.gait_lab.trial.events import posture_return
from afo_sim.gait_lab.trial.ground_force import find_contacts, foot_force
from afo_sim.gait_lab.trial.recorded_stride import _extended

SLOW, FAST = np.arange(0.0, 3.2, 0.01), np.arange(0.0, 3.2, 0.001)  # 100 Hz and 1 kHz
MASS = 67.2
PLAIN = Choices(mass=MASS, cutoff=0.0)  # a known walk has no noise to take away


@pytest.fixture(scope="module")
def walk() -> Walk:
    return known_walk()


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


@pytest.mark.parametrize(("forward", "up"), [("x", "y"), ("y", "z"), ("-x", "z"), ("z", "y")])
def test_markers_alone_are_enough_in_any_axes(
    walk: Walk, tmp_path: pathlib.Path, forward: str, up: str
) -> None:
    from afo_sim.gait_lab import Markers, Plate, WalkingTrial

    file = write_trc(tmp_path / "walk.trc", walk, SLOW, forward=forward, up=up)
    read = read_trc(file)
    assert isinstance(read, Markers)
    # the plate in the same axes, as a C3D would give it
    force, place = np.zeros((len(FAST), 3)), np.zeros((len(FAST), 3))
    along, upward, where = walk.force(FAST)
    for axis, push, at in ((forward, along, where), (up, upward, np.zeros_like(where))):
        sign = -1.0 if axis.startswith("-") else 1.0
        force[:, "xyz".index(axis[-1])] = sign * push
        place[:, "xyz".index(axis[-1])] = sign * at
    from afo_sim.gait_lab import cut_cycle

    done = cut_cycle(WalkingTrial((file,), (Plate("1", FAST, force, place),), markers=read), PLAIN)
    (told,) = done.frame.remarks
    assert told.startswith(f"walks along {forward}, up {up}, overground")
    assert_recovered(done, walk)


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


def test_inverse_dynamics_file_gives_the_moment(walk: Walk, tmp_path: pathlib.Path) -> None:
    files = [
        write_angles(tmp_path / "ik.mot", walk, SLOW),
        write_forces(tmp_path / "grf.mot", walk, FAST),
        write_trc(tmp_path / "walk.trc", walk, SLOW),
    ]
    phase = walk.phase(SLOW) % 1.0
    moment = MASS * np.interp(phase, walk.cycle.phase, walk.cycle.ankle_moment)
    files.append(write_table(tmp_path / "id.sto", SLOW, {"ankle_angle_r_moment": moment}))
    done = import_gait(files, PLAIN)
    stride = done.strides[0]
    found = np.interp(
        walk.phase(stride.start + done.cycle.phase * stride.time) % 1.0,
        walk.cycle.phase,
        walk.cycle.ankle_moment,
    )
    assert np.abs(done.cycle.ankle_moment - found)[5:-5].max() < 0.03
    assert done.cycle.notes["ankle_moment"] == "as in id.sto"


def test_moment_without_a_file_is_the_ground_forces(walk: Walk, tmp_path: pathlib.Path) -> None:
    files = [write_trc(tmp_path / "walk.trc", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    cycle = import_gait(files, PLAIN).cycle
    stance = (cycle.phase > 0.02) & (cycle.phase < 0.6)
    assert np.allclose(cycle.ankle_moment[stance], cycle.ground_moment()[stance], atol=1e-9)
    assert cycle.ankle_moment.min() == pytest.approx(-1.8, abs=0.05)


def test_force_of_the_foot_on_the_ground_is_turned(walk: Walk, tmp_path: pathlib.Path) -> None:
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    forces = write_forces(tmp_path / "grf.mot", walk, FAST, sign=-1.0)
    done = import_gait([markers, forces], PLAIN)
    assert_recovered(done, walk)
    assert any("turned round" in remark for remark in done.remarks)


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


def test_heel_strikes_are_found_within_a_sample(walk: Walk, tmp_path: pathlib.Path) -> None:
    files = [write_trc(tmp_path / "walk.trc", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    done = import_gait(files, PLAIN)
    assert len(done.strides) == 2
    assert [s.by for s in done.strides] == ["force", "force"]
    for number, stride in enumerate(done.strides):
        assert stride.start == pytest.approx(walk.heel_strike(number), abs=0.001)
        assert stride.end == pytest.approx(walk.heel_strike(number + 1), abs=0.001)
    second = import_gait(files, Choices(mass=MASS, cutoff=0.0, stride=2))
    assert_recovered(second, walk)


def test_a_single_plate_needs_only_the_posture(walk: Walk, tmp_path: pathlib.Path) -> None:
    """Overground: the foot meets one plate; the next heel strike is where the posture comes back."""
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    once = np.arange(0.0, 1.4, 0.001)  # the plates' recording ends in swing
    done = import_gait([markers, write_forces(tmp_path / "grf.mot", walk, once)], PLAIN)
    first, second = done.strides
    assert (first.loaded, second.loaded) == (True, False)
    stride = done.strides[done.chosen[0]]
    assert stride.by == "force, its end by the leg's posture"
    assert stride.end == pytest.approx(walk.heel_strike(1), abs=0.01)  # the motion's sample
    assert_recovered(done, walk)
    assert "posture" in done.cycle.notes["cut"]
    assert "the ground force is missing" in second.by


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
    assert posture_return(LegMotion(even, **series), 0.0) == pytest.approx(first.stride_time, abs=0.015)


def test_left_leg_and_named_markers(walk: Walk, tmp_path: pathlib.Path) -> None:
    text = write_trc(tmp_path / "walk.trc", walk, SLOW).read_text()
    for old, new in (
        ("RHJC", "LHJC"),
        ("RKJC", "sub:LKJC"),
        ("R.Heel", "L_Heel"),
        ("R.Toe.Lat", "toes"),
    ):
        text = text.replace(old, new)
    (tmp_path / "left.trc").write_text(text.replace("RAJC", "LAJC"))
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    files = [tmp_path / "left.trc", forces]
    with pytest.raises(InputError) as caught:
        import_gait(files, Choices(mass=MASS, side="left"))
    assert "no marker of the left toe" in caught.value.problem
    assert "toes" in caught.value.problem
    done = import_gait(files, Choices(mass=MASS, side="left", cutoff=0.0, markers={"toe": ("toes",)}))
    assert_recovered(done, walk)
    assert done.cycle.side == "left"
    with pytest.raises(InputError, match="did you mean 'toes'"):
        import_gait(files, Choices(mass=MASS, side="left", markers={"toe": ("toez",)}))


def test_short_gaps_are_filled_and_long_ones_told(walk: Walk, tmp_path: pathlib.Path) -> None:
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    short = write_trc(tmp_path / "short.trc", walk, SLOW, gap=(0.90, 0.95))
    assert_recovered(import_gait([short, forces], PLAIN), walk, angle=0.2, ankle=1.5)
    long = write_trc(tmp_path / "long.trc", walk, SLOW, gap=(0.90, 1.30))
    done = import_gait([long, forces], PLAIN)
    assert len(done.strides) == 1
    assert done.strides[0].start == pytest.approx(walk.heel_strike(1), abs=0.001)
    lost = write_trc(tmp_path / "lost.trc", walk, SLOW, gap=(0.90, 2.80))
    with pytest.raises(InputError, match=r"RAJC.* is missing for too long"):
        import_gait([lost, forces], PLAIN)


def test_belt_speed_is_added(walk: Walk, tmp_path: pathlib.Path) -> None:
    """The same walk on a treadmill: everything runs backward with the belt."""
    belt = 0.98

    class Treadmill(Walk):
        def points(self, time: np.ndarray) -> dict[str, np.ndarray]:
            return {n: p - np.outer(belt * time, [1.0, 0.0]) for n, p in super().points(time).items()}

        def force(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            forward, upward, place = super().force(time)
            return forward, upward, place - belt * time

    on_belt = Treadmill(walk.cycle)
    markers = write_trc(tmp_path / "walk.trc", on_belt, SLOW)
    forward, upward, place = on_belt.force(FAST)
    columns = {"ground_force_vx": forward, "ground_force_vy": upward, "ground_force_px": place}
    forces = write_table(tmp_path / "grf.mot", FAST, columns)
    done = import_gait([markers, forces], Choices(mass=MASS, cutoff=0.0, belt_speed=belt))
    assert_recovered(done, walk)
    assert done.cycle.walking_speed == pytest.approx(0.977, abs=0.002)
    found = import_gait([markers, forces], PLAIN)
    flat = np.linspace(0.15, 0.35, 50) * walk.cycle.stride_time
    creep = np.polyfit(flat, walk.angle("ankle_x", walk.start + flat), 1)[0]  # of a foot that stands
    assert 0.0 < creep < 0.05
    assert found.frame.belt_speed == pytest.approx(belt - creep, rel=0.02)
    assert found.cycle.walking_speed == pytest.approx(0.977 - creep, rel=0.02)


def test_both_feet_on_one_plate_are_refused(walk: Walk, tmp_path: pathlib.Path) -> None:
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    other = Walk(walk.cycle, walk.start + 0.5 * walk.cycle.stride_time, walk.way + 0.55)
    (fx, fz, px), (gx, gz, qx) = walk.force(FAST), other.force(FAST)
    columns = {
        "ground_force_vx": fx + gx,
        "ground_force_vy": fz + gz,
        "ground_force_px": (fz * px + gz * qx) / np.maximum(fz + gz, 1.0),
    }
    forces = write_table(tmp_path / "grf.mot", FAST, columns)
    with pytest.raises(InputError, match="centre of pressure under the right foot throughout"):
        import_gait([markers, forces], PLAIN)


def test_units_of_angles_are_told_by_the_knee(walk: Walk, tmp_path: pathlib.Path) -> None:
    """A knee bends by some 60 deg in walking: 60 radians are ten turns, and 1 deg is no walk."""
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    for degrees, header in ((True, "inDegrees=no"), (True, ""), (False, "inDegrees=yes"), (False, "")):
        angles = write_angles(tmp_path / "ik.mot", walk, SLOW, degrees=degrees)
        lying = re.sub("inDegrees=(yes|no)", header, angles.read_text())
        angles.write_text(lying)
        done = import_gait([forces, markers, angles], PLAIN)
        assert_recovered(done, walk)
        told = [w for w in done.warnings if "knee_angle_r" in w]
        assert told and f"in {'degrees' if degrees else 'radians'}" in told[0]
    with pytest.raises(InputError, match="looks like radians"):
        import_gait([forces, markers, angles], Choices(mass=MASS, cutoff=0.0, degrees=True))


def test_filter_is_6_hz_over_both_passes_and_delays_nothing() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    middle = slice(200, 800)
    for frequency, expected in ((1.0, 1.0), (6.0, np.sqrt(0.5)), (20.0, 0.0)):
        wave = np.sin(2 * np.pi * frequency * time)
        gain = low_pass(time, wave, 6.0)[middle] @ wave[middle] / (wave[middle] @ wave[middle])
        assert gain == pytest.approx(expected, abs=0.02)
    assert np.array_equal(low_pass(time, wave, 0.0), wave)


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


def test_a_plate_that_stops_before_the_window_is_unloaded_there() -> None:
    time = np.arange(0.5, 1.5, 0.1)
    longer, values = _extended(time, np.ones((10, 1)), (0.26, 2.04), 0.0)
    assert longer == pytest.approx(np.arange(0.2, 2.15, 0.1))
    assert values[:, 0].tolist() == [0.0] * 3 + [1.0] * 10 + [0.0] * 7
    assert len(_extended(time, np.ones((10, 1)), (0.6, 1.3), 0.0)[0]) == 10


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
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    (tmp_path / "plain.mot").write_text("time\ta\n0\t1\n")
    (tmp_path / "word.mot").write_text(angles.read_text().replace("0.01\t", "0.01\tx"))
    (tmp_path / "inch.trc").write_text(markers.read_text().replace("\tmm\t", "\tparsnips\t"))
    (tmp_path / "walk.pdf").write_text("hello")
    (tmp_path / "not.trc").write_text("hello\n" * 9)
    write_table(tmp_path / "other.sto", SLOW, {"soleus_r": SLOW})
    no_knee = angles.read_text().replace("knee_angle_r", "knee_r")
    (tmp_path / "no_knee.mot").write_text(no_knee)
    quiet = write_table(
        tmp_path / "quiet.mot", FAST, {f"ground_force_{n}": 0.0 * FAST for n in ("vx", "vy", "px")}
    )
    for files, expected in (
        (["plain.mot", forces], "has no header that ends in 'endheader'"),
        (["word.mot", forces], "row 2 of its table is not 7 numbers"),
        (["inch.trc", forces], "Units = 'parsnips': is not a valid length"),
        (["not.trc", forces], "is not laid out as a .trc file"),
        (["other.sto", forces], "holds neither joint angles"),
        (["no_knee.mot", forces], "knee_angle_r: this coordinate is missing"),
        (["walk.trc", quiet], "no foot stands on a plate"),
        (["walk.trc", "walk.trc", forces], "is a second file with markers"),
        (["walk.trc", forces, forces], "is a second file with force plates"),
        (["walk.trc"], "no file holds ground forces"),
        ([forces], "no file holds the leg's motion"),
        (["walk.pdf", forces], "is not a kind of file that can be imported"),
        (["nowhere.mot", forces], "cannot be read"),
        (["nowhere.trc", forces], "cannot be read"),
    ):
        with pytest.raises(InputError) as caught:
            import_gait([tmp_path / file for file in files], PLAIN)
        assert expected in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_wrong_choices_are_told_by_their_names(walk: Walk, tmp_path: pathlib.Path) -> None:
    files = [write_trc(tmp_path / "walk.trc", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    upside_down = {"knee": ("RAJC",), "ankle": ("RKJC",)}
    turned = {"heel": ("R.Toe.Lat",), "toe": ("R.Heel",)}
    for options, field, expected in (
        ({"markers": turned}, "marker.heel", "toe is behind the heel in the direction of travel"),
        ({"markers": upside_down}, "up", "leans"),
        ({"forward": "y"}, "forward", "the walk goes along x, 90 deg away"),
        ({"forward": "z"}, "forward", "the walk goes along x, 90 deg away"),
        ({"belt_speed": 1.0}, "belt_speed", "the feet stand still on the ground"),
        ({"cutoff": 0.1}, "", "no whole stride"),
    ):
        with pytest.raises(InputError) as caught:
            import_gait(files, Choices(**({"mass": MASS} | options)))
        assert caught.value.field == field
        assert expected in caught.value.problem


def test_choices_are_checked(walk: Walk, tmp_path: pathlib.Path) -> None:
    files = [write_trc(tmp_path / "walk.trc", walk, SLOW), write_forces(tmp_path / "grf.mot", walk, FAST)]
    light = Choices(mass=0.7 * MASS)
    with pytest.raises(InputError, match="is the body mass right"):
        import_gait(files, light)
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


def test_states_file_names_are_understood(tmp_path: pathlib.Path) -> None:
    time = np.arange(0.0, 1.0, 0.1)
    path = write_table(
        tmp_path / "s.sto", time, {"/jointset/ankle_r/ankle_angle_r/value": time}, degrees="no"
    )
    table = read_opensim_table(path)
    assert list(table.columns) == ["ankle_angle_r"]
    assert table.degrees is False


def test_simms_header_is_understood(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "old.mot"
    path.write_text(
        "name old\ndatacolumns 2\ndatarows 3\nrange 0 0.2\nendheader\ntime a\n0 1\n0.1 2\n0.2 3\n"
    )
    table = read_opensim_table(path)
    assert table.degrees is None
    assert np.array_equal(table.columns["a"], [1.0, 2.0, 3.0])


def test_c3d_without_the_library_says_how_to_get_it(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ezc3d", None)  # as if it were not installed
    (tmp_path / "walk.c3d").write_bytes(b"")
    with pytest.raises(InputError, match=r"pip install 'afo-sim\[gait\]'"):
        import_gait([tmp_path / "walk.c3d"], PLAIN)


def write_c3d(path: pathlib.Path, walk: Walk) -> None:
    """Markers at 100 Hz in mm, z up, walking along −y; a type-2 plate at 1 kHz whose z points down."""
    import ezc3d

    file = ezc3d.c3d()
    points = marker_points(walk, SLOW, "-y", "z")
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(points)
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    block = np.ones((4, len(points), len(SLOW)))
    for k, point in enumerate(points.values()):
        block[:3, k] = 1e3 * point.T
    file["data"]["points"] = block
    time = np.arange(10 * len(SLOW)) / 1000.0
    forward, upward, place = walk.force(time)
    nought = np.zeros_like(time)
    # The plate's x is the laboratory's y, its y the laboratory's x, its z down; its middle at y = -1 m.
    turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    push = turn @ -np.array([nought, -forward, upward])  # of the foot on the plate
    arm = turn @ np.array([nought + 0.12, -place + 1.0, nought])  # from the middle to the pressure
    moment = 1e3 * np.cross(arm.T, push.T).T  # [N·mm]
    file["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = ["Fx1", "Fy1", "Fz1", "Mx1", "My1", "Mz1"]
    file["data"]["analogs"] = np.vstack([push, moment])[None]
    corners = np.array([[0.6, 0.3, 0.0], [-0.6, 0.3, 0.0], [-0.6, -0.3, 0.0], [0.6, -0.3, 0.0]])
    corners = (turn.T @ corners.T).T + np.array([0.0, -1.0, 0.0])  # from (+x, +y) of the plate on
    file.add_parameter("FORCE_PLATFORM", "CORNERS", 1e3 * corners.T[:, :, None])
    file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.zeros((3, 1)))
    whole = {"USED": [1], "TYPE": [2], "ZERO": [1, 0], "CHANNEL": np.arange(1, 7)[:, None]}
    for name, numbers in whole.items():
        file.add_parameter("FORCE_PLATFORM", name, np.array(numbers, dtype=float))
        file["parameters"]["FORCE_PLATFORM"][name]["type"] = 2  # a whole number, which ezc3d makes none of
    file.write(str(path))


def test_c3d_is_recovered(walk: Walk, tmp_path: pathlib.Path) -> None:
    write_c3d(tmp_path / "walk.c3d", walk)
    done = import_gait([tmp_path / "walk.c3d"], PLAIN)
    assert done.frame.remarks[0].startswith("walks along -y, up z")
    assert "plate 1: turned round to be the ground's force on the foot" in done.remarks
    assert_recovered(done, walk)
    (tmp_path / "broken.c3d").write_bytes((tmp_path / "walk.c3d").read_bytes()[:700])
    with pytest.raises(InputError, match="is cut short or damaged: it has 700 bytes"):
        import_gait([tmp_path / "broken.c3d"], PLAIN)


def test_c3d_holds_markers_and_plate_in_the_laboratorys_axes(walk: Walk, tmp_path: pathlib.Path) -> None:
    """What was written, sample by sample: markers from mm in m, force and place out of the plate's axes.

    The force is the foot's on the plate, as C3D has it; an import turns it round, and says so.
    """
    write_c3d(tmp_path / "walk.c3d", walk)
    markers, plates = read_c3d(tmp_path / "walk.c3d")
    written = marker_points(walk, SLOW, "-y", "z")
    assert markers.time == pytest.approx(SLOW - SLOW[0], abs=1e-9)
    assert set(markers.positions) == set(written)
    for name, points in written.items():
        assert markers.positions[name] == pytest.approx(points, abs=1e-5)  # kept as 32-bit floats
    (plate,) = plates
    assert plate.time[1] - plate.time[0] == pytest.approx(1e-3)
    forward, upward, place = walk.force(plate.time)
    nought = np.zeros_like(forward)
    assert plate.force == pytest.approx(-np.column_stack([nought, -forward, upward]), abs=0.01)
    stands = upward > 100.0
    expected = np.column_stack([nought + 0.12, -place, nought])
    assert plate.place[stands] == pytest.approx(expected[stands], abs=1e-3)


def test_foot_force_adds_what_two_plates_share(walk: Walk) -> None:
    """A foot across the joint of two plates, 30 to 70: their sum acts at their common centre of pressure."""
    from afo_sim.gait_lab import Plate, WalkingFrame
    from afo_sim.gait_lab.trial.leg_motion import LegMotion

    forward, upward, place = walk.force(FAST)
    names = ("shank_angle", "knee_angle", "ankle_angle", "ankle_z")
    motion = LegMotion(
        SLOW,
        **{n: walk.angle(n, SLOW) for n in names},
        ankle_x=walk.way + walk.angle("ankle_x", SLOW),
    )
    zero = np.zeros_like(FAST)
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


def test_clock_that_leaps_or_is_no_number_is_refused(walk: Walk, tmp_path: pathlib.Path) -> None:
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    markers = write_trc(tmp_path / "walk.trc", walk, SLOW)
    for file, field in ((forces, "time"), (markers, "Time")):
        lines = file.read_text().splitlines()
        cells = lines[-3].split("\t")
        column = 0 if file == forces else 1
        for clock, expected in (
            ("nan", "has no finite time"),
            ("inf", "has no finite time"),
            ("1e9", "time does not increase"),
            (cells[column].replace(".", ".0"), "time does not increase"),
        ):
            changed = "\t".join([*cells[:column], clock, *cells[column + 1 :]])
            broken = tmp_path / f"broken{file.suffix}"
            broken.write_text("\n".join([*lines[:-3], changed, *lines[-2:]]) + "\n")
            with pytest.raises(InputError, match=expected) as caught:
                import_gait([broken, markers if file == forces else forces], PLAIN)
            assert (caught.value.field, caught.value.file) == (field, broken)
        late = [line.split("\t") for line in lines[-2:]]
        late = [[*row[:column], str(float(row[column]) + 1e6), *row[column + 1 :]] for row in late]
        broken.write_text("\n".join([*lines[:-2], *("\t".join(row) for row in late)]) + "\n")
        with pytest.raises(InputError, match="time leaps from"):
            import_gait([broken, markers if file == forces else forces], PLAIN)


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
