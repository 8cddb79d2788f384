"""Public walking trials at the first try: no option but the side, and the model where there is one."""

import functools
import pathlib

import numpy as np
import pytest
import real_trials

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, Imported, import_gait

pytestmark = [real_trials.where_recorded, pytest.mark.slow]
SIDES = ("right", "left")
C3D_FILES = ("walking5.c3d", "test_walking.c3d")
C3d = tuple[real_trials.C3DTrial, tuple[pathlib.Path, ...]]
WEIGHT = 65.5  # of the C3D files' walker: the right foot's impulse over half a stride, 65 to 66 kg [kg]


@functools.cache
def first_try(files: tuple[pathlib.Path, ...], side: str, model: pathlib.Path | None) -> Imported:
    return import_gait(files, Choices(side=side, model=model))


def imported(trial: real_trials.Trial, side: str) -> Imported:
    return first_try(trial.files, side, trial.model)


def recorded_time(found: Imported) -> np.ndarray:
    """When each sample of the cycle was recorded [s]; a closed stride's ends lie a period away."""
    stride = found.strides[found.chosen[0]]
    time = stride.start + found.cycle.phase * (stride.end - stride.start)
    if stride.closed is not None:
        begin, end = stride.closed.window
        period = stride.end - stride.start
        time = np.where(time < begin, time + period, np.where(time > end, time - period, time))
    return np.asarray(time)


def in_stance(
    found: Imported, force: real_trials.Curve, reference: real_trials.Curve
) -> tuple[np.ndarray, np.ndarray]:
    """Samples of the cycle whose foot stands by the plates as recorded, and the reference there."""
    time = recorded_time(found)
    standing = force.at(time) > 20.0
    expected = reference.at(time)
    known = standing & np.isfinite(expected)
    assert known.sum() > 0.6 * standing.sum() > 0.3 * len(time), "the reference covers too little of stance"
    return known, expected[known]


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.mean(difference**2)))


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", real_trials.TRIALS)
def test_ankle_moment_agrees_with_inverse_dynamics(name: str, side: str) -> None:
    trial = real_trials.TRIALS[name]
    found = imported(trial, side)
    known, expected = in_stance(found, trial.force(side), trial.moment(side))
    expected += trial.about_malleoli(side, recorded_time(found)[known], found.cycle.shank_angle[known])
    assert rms(found.cycle.ankle_moment[known] - expected) <= trial.moment_error


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", real_trials.TRIALS)
def test_ankle_angle_agrees_with_inverse_kinematics_but_for_a_stated_offset(name: str, side: str) -> None:
    trial = real_trials.TRIALS[name]
    found = imported(trial, side)
    known, expected = in_stance(found, trial.force(side), trial.angle(side))
    difference = np.degrees(found.cycle.ankle_angle[known]) - expected
    assert rms(difference - difference.mean()) <= trial.angle_error
    stated = f"{abs(np.degrees(found.zero)):.1f}"
    assert any(stated in sentence for sentence in (*found.remarks, *found.warnings)), found.remarks


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", real_trials.TRIALS)
def test_stride_is_that_between_heel_strikes_on_the_plates(name: str, side: str) -> None:
    trial = real_trials.TRIALS[name]
    stride = imported(trial, side).strides[imported(trial, side).chosen[0]]
    assert stride.side == side
    strikes = real_trials.heel_strikes(trial.force(side))
    own = np.diff(strikes)
    if len(own) == 0:  # one strike alone: a steady walker's other leg, and the error of events by kinematics
        own, allowed = (
            np.diff(real_trials.heel_strikes(trial.force("left" if side == "right" else "right"))),
            0.04,
        )
    else:
        own, allowed = own[strikes[:-1] < 1.6], 0.015
    assert np.abs(stride.end - stride.start - own).min() <= allowed
    assert np.abs(stride.start - strikes).min() <= 0.01 or stride.closed is not None


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", real_trials.TRIALS)
def test_body_mass_is_found(name: str, side: str) -> None:
    trial = real_trials.TRIALS[name]
    found = imported(trial, side)
    assert found.mass.mass == pytest.approx(trial.mass, rel=1e-3 if trial.model else 0.03)
    if found.mass.estimated is not None:  # what the plates carry, which the model does not know
        assert found.mass.estimated == pytest.approx(trial.mass, rel=0.03)


@pytest.mark.parametrize("side", SIDES)
def test_treadmill_gives_the_belt_speed(side: str) -> None:
    """The markers of the flat foot, in the same file as the joint angles, go back at 1.11 to 1.14 m/s."""
    found = imported(real_trials.TRIALS["treadmill, model and joint angles"], side)
    assert found.frame.belt_speed == pytest.approx(1.125, abs=0.03)
    assert found.cycle.walking_speed == pytest.approx(1.125, abs=0.05)


@pytest.mark.parametrize("side", SIDES)
def test_given_inverse_dynamics_are_the_reference(side: str) -> None:
    trial = real_trials.TRIALS["overground, all there is"]
    found = imported(trial, side)
    assert found.reference is not None
    known, expected = in_stance(found, trial.force(side), trial.moment(side))
    closed = found.strides[found.chosen[0]].closed
    ends = trial.moment(side).at(np.array(closed.window if closed else (1.0, 1.0)))
    seam = 0.5 * abs(float(np.diff(np.nan_to_num(ends))[0]))  # that closing spreads over the period
    assert np.abs(found.reference[known] - expected).max() < seam + 0.005


@pytest.mark.parametrize("side", SIDES)
def test_inverse_dynamics_without_ground_forces_are_told_and_not_taken(side: str) -> None:
    """The set's own file: its pelvis carries the body weight, its ankle 2.4 N·m at most."""
    trial = real_trials.TRIALS["treadmill, model and joint angles"]
    dynamics = real_trials.SUBJECT01 / "subject01_walk1_InverseDynamics.sto"
    found = first_try((*trial.files, dynamics), side, trial.model)
    known, expected = in_stance(found, trial.force(side), trial.moment(side))
    expected += trial.about_malleoli(side, recorded_time(found)[known], found.cycle.shank_angle[known])
    assert rms(found.cycle.ankle_moment[known] - expected) <= trial.moment_error
    assert any("ankle moment" in warning for warning in found.warnings), found.warnings


@pytest.fixture(params=C3D_FILES)
def c3d(request: pytest.FixtureRequest) -> C3d:
    pytest.importorskip("ezc3d")
    return real_trials.c3d_trial(request.param), (real_trials.C3D / request.param,)


def test_c3d_strides_of_both_feet_begin_with_the_heel(c3d: C3d) -> None:
    """Left, the heel lands beside its plate: the force begins 100 ms after the heel strike."""
    trial, files = c3d
    found = first_try(files, "right", None)
    for side in SIDES:
        strikes = trial.heel_strikes(side)
        own = [stride for stride in found.strides if stride.side == side]
        assert own
        for stride in own:
            assert stride.end - stride.start == pytest.approx(float(np.diff(strikes).mean()), abs=0.03)
            assert -0.01 <= min(stride.start - strikes, key=abs) <= 0.05
            assert stride.loaded == (side == "right")


def test_c3d_walks_along_minus_x(c3d: C3d) -> None:
    trial, files = c3d
    found = first_try(files, "right", None)
    assert np.degrees(np.arccos(found.frame.forward @ trial.forward())) < 3.0
    assert found.frame.up == pytest.approx([0.0, 0.0, 1.0], abs=0.02)
    assert found.frame.belt_speed == pytest.approx(0.0, abs=0.02)


def test_c3d_body_mass_comes_from_the_foot_that_is_wholly_on_its_plate(c3d: C3d) -> None:
    """The left foot's impulse alone would say 48 kg."""
    assert first_try(c3d[1], "right", None).mass.mass == pytest.approx(WEIGHT, rel=0.04)


def test_c3d_right_ankle_moment_balances_the_ground(c3d: C3d) -> None:
    trial, files = c3d
    found = first_try(files, "right", None)
    known, expected = in_stance(found, trial.upward("right"), trial.moment("right"))
    moment = found.cycle.ankle_moment[known] * found.mass.mass
    assert rms(moment - expected) <= 0.06 * WEIGHT


def test_c3d_left_foot_is_told_to_be_partly_beside_its_plate(c3d: C3d) -> None:
    with pytest.raises(InputError, match="beside the plate"):
        first_try(c3d[1], "left", None)
