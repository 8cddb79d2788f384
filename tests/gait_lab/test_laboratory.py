"""The known walker and its laboratory are what they say, by laws that do not depend on how they were made."""

import dataclasses

import numpy as np
import pytest
from gait_lab import known_walker
from gait_lab.marker_sets import in_world
from gait_lab.patients import LameWalker, Patient, anybody
from scipy.signal import butter, sosfiltfilt
from walking import SHANK, THIGH

from afo_sim.common import GRAVITY

TIME = np.arange(0.0, 2.6, 0.001)


@pytest.fixture(scope="module")
def walker() -> known_walker.Walker:
    return known_walker.Walker(seed=None)


def test_segments_are_rigid_and_joined(walker: known_walker.Walker) -> None:
    segments = walker.segments(TIME)
    for rotation, _ in segments.values():
        assert np.allclose(np.swapaxes(rotation, 1, 2) @ rotation, np.eye(3), atol=1e-12)
        assert np.allclose(np.linalg.det(rotation), 1.0)
    for side in known_walker.SIGN:
        hip, knee, ankle = walker.centres(side, TIME).values()
        assert np.ptp(np.linalg.norm(hip - knee, axis=1)) < 1e-12
        assert np.ptp(np.linalg.norm(knee - ankle, axis=1)) < 1e-12
        assert np.hypot(*(knee - ankle)[:, :2].T) == pytest.approx(SHANK, abs=1e-12)
        assert np.hypot(*(hip - knee)[:, :2].T) == pytest.approx(THIGH, abs=1e-12)
        assert ankle[:, :2] == pytest.approx(walker.ankle_plane(side, TIME), abs=1e-12)


def test_angles_are_those_of_the_centres(walker: known_walker.Walker) -> None:
    """From positions alone: shank from the vertical, knee between the bones, foot from heel to toe."""
    for side in known_walker.SIGN:
        hip, knee, ankle = (p[:, :2] for p in walker.centres(side, TIME).values())
        shank = np.arctan2(*(knee - ankle).T)
        assert shank == pytest.approx(walker.angle(side, "shank", TIME), abs=1e-12)
        bend = shank - np.arctan2(*(hip - knee).T)
        assert bend == pytest.approx(walker.angle(side, "knee", TIME), abs=1e-12)
        seen = in_world(walker, "opensim c3d", TIME)
        letter = side[0].upper()
        foot = (seen[f"{letter}MT2"] - seen[f"{letter}CAL"])[:, :2]
        pitch = np.unwrap(np.arctan2(foot[:, 1], foot[:, 0]))
        flat = walker.phase(side, TIME) % 1.0
        flat = walker.walk.cycle.flat.holds(flat)
        pitch -= pitch[flat].mean()
        expected = walker.angle(side, "ankle", TIME) - walker.angle(side, "shank", TIME)
        assert pitch == pytest.approx(expected - expected[flat].mean(), abs=1e-9)
        assert abs(np.degrees(expected[flat].mean())) < 0.1
        assert ankle[flat, 1].mean() == pytest.approx(known_walker.SOLE, abs=1e-4)


def test_left_is_right_half_a_stride_later(walker: known_walker.Walker) -> None:
    later = TIME + 0.5 * walker.stride_time
    for name, points in in_world(walker, "cast", TIME).items():
        if name.startswith("R"):
            other = in_world(walker, "cast", later)["L" + name[1:]]
            ahead = points + np.array([0.5 * walker.stride_length, 0.0, 0.0])
            assert other == pytest.approx(ahead * [1.0, 1.0, -1.0], abs=1e-9)


def test_harringtons_regression_gives_the_hip(walker: known_walker.Walker) -> None:
    """Harrington 2007, one-variable, in the pelvis' frame from the four markers."""
    seen = in_world(walker, "plug-in gait", TIME)
    front = 0.5 * (seen["RASI"] + seen["LASI"])
    back = 0.5 * (seen["RPSI"] + seen["LPSI"])
    z = seen["RASI"] - seen["LASI"]
    width, depth = np.linalg.norm(z, axis=1)[:, None], np.linalg.norm(front - back, axis=1)[:, None]
    z = z / width
    x = front - back
    x -= (x * z).sum(axis=1)[:, None] * z
    x /= np.linalg.norm(x, axis=1)[:, None]
    y = np.cross(z, x)
    front = front - 0.007 * x  # from the markers' centres to the skin
    for side, sign in known_walker.SIGN.items():
        hip = front + (-0.24 * depth - 0.0099) * x + (-0.30 * width - 0.0109) * y
        hip = hip + sign * (0.33 * width + 0.0073) * z
        assert hip == pytest.approx(walker.centres(side, TIME)["hip"], abs=1e-6)
    assert pytest.approx(float((0.33 * width + 0.0073)[0, 0]), abs=1e-9) == known_walker.HIP_Z


def test_two_feet_carry_the_weight(walker: known_walker.Walker) -> None:
    time = np.linspace(0.0, walker.stride_time, 20_001)[:-1]
    total = sum(walker.force(side, time)[0] for side in known_walker.SIGN)
    assert total[:, 1].mean() == pytest.approx(walker.mass * GRAVITY, rel=1e-3)
    assert np.abs(total[:, [0, 2]].mean(axis=0)).max() < 0.003 * walker.mass * GRAVITY


BODIES = [
    known_walker.Walker(),
    LameWalker(right_load=0.9),
    Patient(share=0.7, slower=1.3),
    *map(anybody, range(4)),
]


@pytest.mark.parametrize("walker", BODIES)
def test_the_body_obeys_newton(walker: known_walker.Walker) -> None:
    """Two feet's force, by second differences of what pelvis and trunk do, weighted by their masses."""
    time = np.arange(0.5, 4.0, 0.001)
    segments = walker.segments(time)
    hips = 0.5 * (segments["femur_r"][1] + segments["femur_l"][1])
    body = known_walker.PELVIS_SHARE * hips + (1.0 - known_walker.PELVIS_SHARE) * segments["trunk"][1]
    total = sum(walker.force(side, time)[0] for side in known_walker.SIGN) / walker.mass - [0.0, GRAVITY, 0.0]
    strides = round(walker.stride_time / 0.001)  # to take the mean over

    def moved(acceleration: np.ndarray) -> np.ndarray:
        filtered = sosfiltfilt(butter(2, 8.0, fs=1000.0, output="sos"), acceleration, axis=0)
        return np.asarray(filtered[200:-200, :2])

    expected = moved(np.gradient(np.gradient(body, 0.001, axis=0), 0.001, axis=0)) * [1.0, walker.calm]
    assert np.abs(moved(total) - expected).max() < 0.03 * np.abs(expected).max()
    assert np.abs(np.mean(total[:strides], axis=0)).max() < 0.1  # m/s²: the walk goes on
    for part in (hips, segments["trunk"][1], segments["pelvis"][1]):
        accelerated = moved(np.gradient(np.gradient(part, 0.001, axis=0), 0.001, axis=0))
        assert np.corrcoef(accelerated[:, 1], expected[:, 1])[0, 1] > 0.9


@pytest.mark.parametrize("slower, size", [(0.85, 1.0), (1.2, 1.0), (1.0, 1.1)])
def test_the_force_swings_with_the_size_and_the_square_of_the_speed(slower: float, size: float) -> None:
    """Froude: the same walk of another body, at another speed."""
    walker, other = known_walker.Walker(seed=None), known_walker.Walker(slower=slower, size=size, seed=None)
    phase = np.linspace(0.0, 1.0, 400)
    swing = []
    for each in (walker, other):
        time = each.start + phase * each.stride_time
        total = sum(each.force(side, time)[0] for side in known_walker.SIGN)[:, 1]
        swing.append(total / (each.mass * GRAVITY) - 1.0)
    # a spline's second derivative between its knots differs a little
    assert swing[1] == pytest.approx(swing[0] * size / slower**2, abs=0.01)


def test_strides_differ_as_peoples_do() -> None:
    """Of 30 walkers: step lengths by 8 to 16 mm, times by about 1 %, no two strides alike."""
    lengths, times = [], []
    for seed in range(30):
        walker = known_walker.Walker(seed=seed)
        strikes = np.array([walker.heel_strike("right", k) for k in range(6)])
        stands = walker.ankle_plane("right", strikes + 0.3 * walker.stride_time)[:, 0]
        lengths += list(np.diff(stands) - walker.stride_length)
        times += list(np.diff(strikes) / walker.stride_time - 1.0)
    assert 0.008 < np.std(lengths) < 0.016 and np.abs(lengths).max() < 0.05
    assert 0.005 < np.std(times) < 0.02
    assert np.abs(np.mean(lengths)) < 0.002


def test_moment_balances_the_foot_about_the_laboratorys_origin(walker: known_walker.Walker) -> None:
    """Angular momentum of the foot about a fixed point, by differences of time, not about the ankle."""
    step = TIME[1] - TIME[0]
    mass = known_walker.FOOT_MASS * walker.mass
    for side in known_walker.SIGN:
        rotation, ankle = walker.segments(TIME)[f"foot_{side[0]}"]
        centre = (rotation @ known_walker.FOOT_CENTRE + ankle)[:, :2]
        speed = np.gradient(centre, step, axis=0, edge_order=2)
        spin = np.gradient(np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])), step, edge_order=2)
        momentum = mass * (_cross(centre, speed) + known_walker.FOOT_GYRATION**2 * spin)
        change = np.gradient(momentum, step, edge_order=2)
        push = mass * np.gradient(speed, step, axis=0, edge_order=2)  # of all forces
        force, place = walker.force(side, TIME)
        shank = push - force[:, :2] + [0.0, mass * GRAVITY]  # of the shank on the foot
        weight = np.tile([0.0, -mass * GRAVITY], (len(TIME), 1))
        rest = _cross(place[:, :2], force[:, :2]) + _cross(centre, weight) + _cross(ankle[:, :2], shank)
        expected = (change - rest)[5:-5]
        assert walker.moment(side, TIME)[5:-5] == pytest.approx(expected, abs=0.02)
        light = walker.moment(side, TIME, foot=False)
        assert 0.5 < np.abs(light - walker.moment(side, TIME)).max() < 4.0  # N·m: the foot is not massless


def test_the_standing_foot_does_not_slide(walker: known_walker.Walker) -> None:
    straight = dataclasses.replace(walker, toe_out=0.0)
    for side in known_walker.SIGN:
        ball = straight.segments(TIME)[f"toes_{side[0]}"][1]
        phase = straight.phase(side, TIME)
        for number in (0, 1):
            stands = (phase > number + 0.09) & (phase < number + 0.55)
            assert np.ptp(ball[stands, 0]) < 5e-4
            assert np.ptp(ball[stands, 2]) < 10e-3  # with the hip, when the pelvis turns


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
