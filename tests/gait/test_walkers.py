"""Shipped walkers: what is published in them, and the derived path of the ankle against recorded ones."""

import dataclasses
import os
import pathlib
import sys

import numpy as np
import pytest
import real_trials
import scipy.io
from documents import ROOT, script

from afo_sim.common import GRAVITY, assets
from afo_sim.description import MASS_SHARES
from afo_sim.gait import (
    COP_FORCE,
    KINEMATICS,
    Chain,
    GaitCycle,
    closing_errors,
    stance,
)
from afo_sim.gait import file as gait
from afo_sim.gait_lab import Choices, import_gait
from afo_sim.lab import calf_share as calf

derived_path = script("derived_path")
FootShape, LOADED, rocking = derived_path.FootShape, derived_path.LOADED, derived_path.rocking
FIGURES = pathlib.Path(os.environ.get("AFO_SIM_WALKERS", ROOT.parent / "shared" / "data" / "walkers"))
TASKS = ("xs", "s", "natural", "m", "l")
BEHIND = 0.010  # the lateral malleolus behind the joint's centre: 6 to 15 mm on four strides of one adult [m]
GATK = {  # segment lengths of the walker by its own markers: trochanter, epicondyle, malleolus [m]
    "gatk_stride1": Chain(0.405, 0.442),
    "gatk_stride2": Chain(0.405, 0.442),
}
TRIALS = [  # and the person's height [m]
    ("overground, model and joint angles", 1.74),
    ("treadmill, model and joint angles", 1.80),
]
WITHIN = 0.010  # of a derived path: the height of a toe in swing is of that size [m]
needs_figures = pytest.mark.skipif(
    not FIGURES.is_dir(), reason=f"the typed figures are not here: AFO_SIM_WALKERS, else {FIGURES}"
)


def shipped(name: str) -> GaitCycle:
    return gait.read(assets.find_gait(name))


def missed(cycle: GaitCycle, foot: object, chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Derived less recorded ankle, way and height, mean differences taken out [m] (n,)."""
    recorded = {name: cycle.signal(name, cycle.phase) for name in ("ankle_x", "ankle_z")}
    speed = (cycle.ankle_x[-1] - cycle.ankle_x[0]) / cycle.stride_time
    derived = derived_path.with_derived_path(dataclasses.replace(cycle, walking_speed=speed), foot, chain)
    way, height = (getattr(derived, name) - values for name, values in recorded.items())
    return way - way.mean(), height - height.mean()


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


# --- the published figures ---


@needs_figures
@pytest.mark.parametrize("task", TASKS)
def test_the_published_columns_are_the_typed_figures(task: str) -> None:
    figures = np.genfromtxt(FIGURES / f"bovi2011_adult_{task}.csv", delimiter=",", names=True)
    cycle = shipped(f"bovi2011_{task}")
    phase = figures["pct"] / 100.0

    def at(values: np.ndarray) -> np.ndarray:
        return np.interp(phase, cycle.phase, values)

    for column, name in (("shank_deg", "shank"), ("knee_deg", "knee"), ("ankle_df_deg", "ankle")):
        typed = figures[column]
        drift = (typed[-1] - typed[0]) * (phase - 0.5)
        assert np.abs(drift).max() < 1.0  # what the stride does not close by, told in the file
        assert np.degrees(at(getattr(cycle, f"{name}_angle"))) == pytest.approx(typed - drift, abs=1e-4)
    assert at(cycle.grf_z) == pytest.approx(figures["grf_v_bw"], abs=1e-6)
    assert at(cycle.grf_x) == pytest.approx(figures["grf_ap_bw"], abs=1e-6)
    assert at(-cycle.ankle_moment) == pytest.approx(figures["ankle_pf_moment_nm_kg"], abs=1e-6)


@pytest.mark.parametrize("task", TASKS)
def test_mean_curves_are_labelled_and_close(task: str) -> None:
    cycle = shipped(f"bovi2011_{task}")
    assert "mean curve" in cycle.notes["description"] and "Bovi" in cycle.source
    assert "ankle_x_m" in cycle.notes["derived"] and "cop_x_m" in cycle.notes["derived"]
    assert cycle.notes["family"] == "bovi2011" and cycle.side == "right"
    for value in closing_errors(cycle).values():
        assert abs(value) < 1e-3
    assert cycle.ankle_x[-1] == pytest.approx(cycle.walking_speed * cycle.stride_time, rel=1e-5)


@pytest.mark.parametrize("task", TASKS)
def test_pressure_has_the_published_moment(task: str) -> None:
    """Statics of a massless foot: M = g (c F_z + z F_x)."""
    cycle = shipped(f"bovi2011_{task}")
    on = (cycle.grf_z > COP_FORCE) & (cycle.phase < 0.9)
    moment = GRAVITY * (cycle.cop_x * cycle.grf_z + cycle.ankle_z * cycle.grf_x)
    assert -cycle.ankle_moment[on] == pytest.approx(moment[on], abs=1e-4)


@pytest.mark.parametrize("task", TASKS)
def test_ball_clears_the_floor_as_measured(task: str) -> None:
    """Metatarsal markers pass 9 to 31 mm above where they are with the foot flat (six recorded strides,
    1.17 to 1.26 m/s); the hinge of the toes stands between them."""
    cycle = shipped(f"bovi2011_{task}")
    foot, pitch = FootShape.of_height(1.71, 0.080), cycle.foot_pitch()
    below = foot.ankle_height - foot.hinge_height
    rise = cycle.ankle_z + foot.hinge * np.sin(pitch) - below * np.cos(pitch) - foot.hinge_height
    late = (cycle.phase > 0.75) & (cycle.phase < 0.95)
    assert 0.005 < rise[late].min() < 0.035
    assert rise[cycle.phase < 0.55].min() > -0.005


def test_script_makes_the_shipped_mean_curves_from_their_own_published_columns(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["make_walkers.py", "--out", str(tmp_path)])
    script("make_walkers").main()
    for task in TASKS:
        made, held = gait.read(tmp_path / f"bovi2011_{task}.csv"), shipped(f"bovi2011_{task}")
        assert made.notes == held.notes
        for column in ("phase", *KINEMATICS, "grf_x", "grf_z", "cop_x", "ankle_moment"):
            assert np.allclose(getattr(made, column), getattr(held, column), atol=1e-5, equal_nan=True), (
                column
            )


def test_treadmill_mean_lies_between_its_strides_and_closes_better() -> None:
    mean = shipped("gatk_mean")
    strides = [shipped(name) for name in mean.notes["strides"].split(", ")]
    for name in ("shank_angle", "knee_angle", "ankle_angle", "ankle_z", "grf_z", "ankle_moment"):
        low, high = (ends([getattr(s, name) for s in strides], axis=0) for ends in (np.min, np.max))
        assert np.all(getattr(mean, name) >= low - 1e-6) and np.all(getattr(mean, name) <= high + 1e-6)
    worst = max(abs(value) for value in closing_errors(mean).values())
    assert all(worst < max(abs(v) for v in closing_errors(s).values()) for s in strides)


# --- the foot on the floor, and the leg's chain ---

FOOT = FootShape(0.08, 0.03, 0.13, 0.025)


def test_foot_turns_about_a_point_that_does_not_slide() -> None:
    pitch = np.radians(np.linspace(-60.0, 25.0, 86))
    x, z = rocking(pitch, FOOT)
    up, down = pitch > 0.0, pitch < 0.0

    def point(ahead: float, above: float) -> tuple[np.ndarray, np.ndarray]:
        """A point of the foot, fixed in its axes, in the laboratory."""
        return x + ahead * np.cos(pitch) - above * np.sin(pitch), z + ahead * np.sin(pitch) + above * np.cos(
            pitch
        )

    heel, hinge = point(-0.03, -0.08), point(0.13, 0.025 - 0.08)
    assert heel[0][up] == pytest.approx(-0.03) and heel[1][up] == pytest.approx(0.0, abs=1e-12)
    assert hinge[0][down] == pytest.approx(0.13) and hinge[1][down] == pytest.approx(0.025)
    assert z.min() == pytest.approx(0.08, abs=2e-4)
    assert np.abs(np.diff(x)).max() < 0.004 and np.abs(np.diff(z)).max() < 0.004  # no jump at the flat foot


def test_path_of_a_leg_under_a_known_hip_is_found_again() -> None:
    """A walker made by inverse kinematics: hips that rise twice a stride, feet that rock on the floor."""
    phase, length = np.linspace(0.0, 1.0, 201), 1.1
    chain = Chain(0.42, 0.42)
    off = 0.62
    fall = np.interp(phase, [0.0, 0.08, 1.0], [15.0, 0.0, 0.0])
    rise = np.where(phase > 0.3, 40.0 * (np.clip(phase - 0.3, 0.0, off - 0.3) / (off - 0.3)) ** 3, 0.0)
    back = np.clip((phase - off) / (1.0 - off), 0.0, 1.0)
    pitch = np.radians(fall - rise + 55.0 * back**2 * (3.0 - 2.0 * back))
    floor_x, floor_z = rocking(pitch, FOOT)
    swing = phase > off
    last = int(np.argmax(swing)) - 1
    ends_x, ends_z = (floor_x[last], floor_x[0] + length), (floor_z[last], floor_z[0])
    share = (phase[swing] - phase[last]) / (1.0 - phase[last])
    ease = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    x, z = floor_x.copy(), floor_z.copy()
    x[swing] = ends_x[0] + (ends_x[1] - ends_x[0]) * ease
    z[swing] = ends_z[0] + (ends_z[1] - ends_z[0]) * ease + 0.04 * np.sin(np.pi * share) ** 2
    hip_x = length * (phase - 0.25)
    hip_z = 0.85 - 0.02 * np.cos(4.0 * np.pi * (phase - 0.05))
    reach = np.hypot(hip_x - x, hip_z - z)
    knee = np.pi - np.arccos((chain.thigh**2 + chain.shank**2 - reach**2) / (2.0 * chain.thigh * chain.shank))
    within = np.arccos((chain.shank**2 + reach**2 - chain.thigh**2) / (2.0 * chain.shank * reach))
    shank = np.arctan2(hip_x - x, hip_z - z) + within
    load = np.where((phase > 0.03) & (phase < off - 0.04), 1.0, 0.0)
    path = derived_path.ankle_path(phase, (shank, knee, pitch + shank), load, length, FOOT, chain)
    assert load.max() > LOADED
    assert path.up == pytest.approx(z, abs=0.004)  # what 12 harmonics leave of its corners
    assert path.forward - path.forward[0] == pytest.approx(x - x[0], abs=0.008)
    assert np.abs(path.gaps).max() < 0.003


# --- against recorded strides ---


def missed_where_clearance_is_read(cycle: GaitCycle, height: np.ndarray) -> np.ndarray:
    """Of derived less recorded height, what is missed at 80 to 90 % over the own flat foot [m] (21,)."""
    flat = (cycle.phase > 0.12) & (cycle.phase < 0.28)
    return np.interp(np.linspace(0.80, 0.90, 21), cycle.phase, height - height[flat].mean())


@pytest.mark.parametrize("name", GATK)
def test_derived_path_against_the_recorded_treadmill_strides(name: str) -> None:
    cycle = shipped(name)
    assert cycle.body_height is not None
    foot = FootShape.of_height(cycle.body_height, cycle.ankle_height, BEHIND)
    way, height = missed(cycle, foot, GATK[name])
    assert rms(height) < WITHIN and rms(way) < WITHIN
    assert np.abs(missed_where_clearance_is_read(cycle, height)).max() < WITHIN


@pytest.mark.parametrize(("trial", "body_height"), TRIALS)
def test_derived_height_against_recorded_means_of_both_legs(trial: str, body_height: float) -> None:
    """Of a public trial's mean of both legs, with the model's lengths of its person's legs.

    Body heights are those of the hips over straight legs. The way is not held to 10 mm: it misses by 12
    and 3 mm RMS, as the pelvis turns.
    """
    known = real_trials.TRIALS[trial]
    if not known.files[0].is_file() or known.model is None:
        pytest.skip(f"{known.files[0]} is not here")
    done = import_gait([*known.files, known.model], Choices(both=True))
    points = done.legs["right"].points
    hip, knee, ankle = (points[role].path for role in ("hip", "knee", "ankle"))
    thigh, shank = (float(np.nanmean(np.linalg.norm(a - b, axis=1))) for a, b in ((hip, knee), (knee, ankle)))
    foot = FootShape.of_height(body_height, done.cycle.ankle_height)
    _, height = missed(done.cycle, foot, Chain(thigh, shank))
    assert rms(height) < WITHIN
    assert np.abs(missed_where_clearance_is_read(done.cycle, height)).max() < WITHIN


@needs_figures
@pytest.mark.parametrize("name", ["walk1_L_25", "walk1_R_105", "walk1_L_189", "walk2_L_80"])
def test_foot_on_the_floor_against_recorded_strides(name: str) -> None:
    """Four strides whose pitch and ankle were recorded, but neither knee nor hip: only stance is told."""
    table = np.genfromtxt(FIGURES / f"bmc_{name}.csv", delimiter=",", names=True)
    phase, force = table["pct"] / 100.0, table["grf_v_N"] / (74.0 * GRAVITY)
    on = (force > LOADED) & (phase < 0.9)
    held = (phase >= phase[on][0]) & (phase <= phase[on][-1])
    flat = (phase > 0.12) & (phase < 0.26)
    foot = FootShape.of_height(1.75, float(table["ankle_z_m"][flat].mean()))
    x, z = rocking(np.radians(table["foot_pitch_deg"]), foot)
    height, way = (z - table["ankle_z_m"])[held], (x - table["ankle_x_m"])[held]
    assert np.abs(height).max() < WITHIN
    assert np.abs(way - way.mean()).max() < WITHIN


# --- the calf's share of a stride's work ---


@pytest.mark.parametrize("name", ["bovi2011_natural", "gatk_mean", "opensim_walk"])
def test_joint_powers_and_the_forces_at_the_ends_change_the_legs_energy(name: str) -> None:
    """Shank and thigh: dE/dt is what the moments of ankle, knee and hip and both ends' forces give."""
    cycle = shipped(name)
    time = calf.PHASE * cycle.stride_time
    lean = {"shank": cycle.signal("shank_angle", calf.PHASE)}
    lean["thigh"] = lean["shank"] - cycle.signal("knee_angle", calf.PHASE)
    joint = cycle.signal("ankle_x", calf.PHASE) + 1j * cycle.signal("ankle_z", calf.PHASE)
    ends, energy, force = [joint], np.zeros_like(time), np.zeros_like(joint)
    lengths = Chain.of_height(cycle.body_height or 0.0)
    for part in ("shank", "thigh"):
        length, mass = getattr(lengths, part), MASS_SHARES[part]
        along = np.sin(lean[part]) + 1j * np.cos(lean[part])
        centre = ends[-1] + calf.CENTRES[part] * length * along
        speed, turn = np.gradient(centre, time), np.gradient(lean[part], time)
        energy += 0.5 * mass * (np.abs(speed) ** 2 + (calf.GYRATION[part] * length * turn) ** 2)
        energy += mass * GRAVITY * centre.imag
        force += mass * (np.gradient(speed, time) + 1j * GRAVITY)
        ends.append(ends[-1] + length * along)
    forward, upward, _ = cycle.ground(calf.PHASE)
    ankle, hip = (np.gradient(end, time) for end in (ends[0], ends[-1]))
    pull = GRAVITY * (forward + 1j * upward) - MASS_SHARES["foot"] * (np.gradient(ankle, time) + 1j * GRAVITY)
    given = (pull * ankle.conj() + (force - pull) * hip.conj()).real
    powers = calf.joint_powers(cycle)
    moment = np.interp(calf.PHASE, cycle.phase, cycle.ankle_moment)
    given += powers["knee"] + powers["hip"] + moment * np.gradient(lean["shank"], time)
    inner = slice(20, -20)  # differences are one-sided at the ends
    assert np.abs(given - np.gradient(energy, time))[inner].max() < 1e-3 * np.abs(given).max()


@needs_figures
@pytest.mark.parametrize(
    ("name", "start", "end"), [("gatk_stride1", 0.2003, 1.4036), ("gatk_stride2", 1.4036, 2.5917)]
)
def test_calf_share_is_near_that_of_the_trials_own_inverse_dynamics(
    name: str, start: float, end: float
) -> None:
    """GaitAnalysisToolKit's results: angular velocities and moments of hip, knee, ankle, 100 a second.

    Its hip turns against the recorded trunk, ours against an upright one, so the hip's work is not compared.
    """
    results = scipy.io.loadmat(FIGURES.parent / "gatk" / "gatk_ref.mat")["refresults"]
    cycle = shipped(name)
    time = start + calf.PHASE * (end - start)
    their = {
        joint: np.interp(time, 0.01 * np.arange(len(results)), results[:, 3 + k] * results[:, 6 + k])
        for k, joint in enumerate(("hip", "knee", "ankle"))
    }
    push_off = np.where((calf.PHASE > 0.40) & (stance(cycle) > calf.PHASE), their["ankle"], 0.0)
    their_work = {joint: np.trapezoid(np.maximum(power, 0.0), time) for joint, power in their.items()}
    work = calf.positive_work(cycle)
    assert work["ankle"] == pytest.approx(their_work["ankle"], rel=0.05)
    assert work["knee"] == pytest.approx(their_work["knee"], rel=0.10)
    share = np.trapezoid(np.maximum(push_off, 0.0), time) / sum(their_work.values())
    assert calf.calf_share(name) == pytest.approx(100.0 * share, abs=5.0)
