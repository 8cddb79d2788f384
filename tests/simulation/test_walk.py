"""Walking: the driven shank, the healthy trial returned, a foot that drops, an orthosis that lifts it."""

import math

import numpy as np
import pytest

import afo_sim
from afo_sim.common import GRAVITY, InputError, assets
from afo_sim.description import Gait, load
from afo_sim.gait import GaitCycle, fit_to_leg
from afo_sim.gait import file as gait_file
from afo_sim.model import Built, phase_at
from afo_sim.model.build import build
from afo_sim.model.muscle_weakness import needed_moment
from afo_sim.simulation import Recording

HALF_STEP = {"timestep": "0.5 ms"}  # of the shipped scenario's
# one recorded walker at the leg's own size, whatever the scenarios walk with, under the recorded force
WALKER = {
    "ground.mode": "recorded",
    "gait.cycle": "gatk_stride1",
    "patient.body_mass": "75 kg",
    "patient.body_height": "1.78 m",  # the trial's
    "leg.body_height": "1.78 m",
}
TEN_STRIDES = WALKER | {"duration": "13.3 s"}  # and one that ends in the run, to the last row
SWING = (0.68, 0.97)


@pytest.fixture(scope="module")
def healthy() -> Recording:
    return afo_sim.run("walk-healthy", WALKER)


@pytest.fixture(scope="module")
def drop_foot() -> Recording:
    return afo_sim.run("walk-dropfoot", WALKER)


@pytest.fixture(scope="module")
def lifted() -> Recording:
    return afo_sim.run("walk-dropfoot-afo-short", TEN_STRIDES)


def placed(under: float = 0.0, behind: float = 0.0) -> GaitCycle:
    """The shipped stride about the ankle of the shipped leg, whose bare sole is 68 mm below it.

    An even sole is `under` it [m], and reaches `behind` its heel [m].
    """
    sole = ((-0.060 - behind, -0.068 - under), (0.120, -0.068 - under))
    return fit_to_leg(gait_file.read(assets.find_gait("gatk_stride1")), sole, stack=under).cycle


def settled(run: Recording) -> np.ndarray:
    """Rows after the first stride."""
    return run["gait/stride"] >= 1.0


def in_swing(run: Recording) -> np.ndarray:
    phase = run["gait/phase"]
    return settled(run) & (phase > SWING[0]) & (phase < SWING[1])


def walk_built(name: str = "walk-healthy", sets: dict[str, object] | None = None) -> Built:
    return build(load("scenario", name, WALKER | (sets or {})))


@pytest.mark.slow
@pytest.mark.parametrize("settled", ["solved", "walked"])
def test_the_shank_is_where_the_recording_says_after_ten_strides(settled: str) -> None:
    lifted = afo_sim.run("walk-dropfoot-afo-short", TEN_STRIDES | {"gait.settled": settled})
    cycle = placed(0.022, 0.018)  # S1's plate
    phase = lifted["time"] / cycle.stride_time
    for column, name, bound in (
        ("ankle/position/x", "ankle_x", 1e-4),
        ("ankle/position/z", "ankle_z", 1e-4),
        ("shank/angle", "shank_angle", math.radians(0.01)),
    ):
        assert np.abs(lifted[column] - cycle.signal(name, phase)).max() < bound
    assert phase[-1] > 10.0


def test_the_foot_feels_the_shanks_true_acceleration(healthy: Recording) -> None:
    # one step of the finite differences is off by a fourth derivative of a 10 Hz signal
    cycle = placed()
    built = walk_built()
    exact = cycle.signal("ankle_z", built.walk.phase[1:-1], 2)
    assert np.abs(built.walk.acceleration[:, 1] - exact).max() < 1e-2 * np.abs(exact).max()


def test_a_healthy_ankle_follows_its_recording(healthy: Recording) -> None:
    rows = settled(healthy)
    error = np.degrees(healthy["ankle/angle"] - healthy["gait/ankle_angle"])[rows]
    assert math.sqrt(np.mean(error**2)) <= 1.0


@pytest.mark.parametrize("stride", ["gatk_stride1", "gatk_stride2"])
def test_inverse_dynamics_returns_the_toolkits_moment(stride: str) -> None:
    built = walk_built(sets={"gait.cycle": stride, "duration": "1.2 s"})
    walk = built.walk
    mass = walk.cycle.body_mass
    ours = needed_moment(walk, built.foot, mass) / mass
    phase = walk.phase[1:-1]
    theirs = np.interp(phase % 1.0, walk.cycle.phase, walk.cycle.ankle_moment)
    assert math.sqrt(np.mean((ours - theirs) ** 2)) <= 0.05
    assert ours.min() == pytest.approx(theirs.min(), rel=0.04)


def test_all_moments_sum_to_the_ankles_acceleration(lifted: Recording) -> None:
    total = sum(lifted[name] for name in lifted.columns if name.startswith("ankle/moment/"))
    built = walk_built("walk-dropfoot-afo-short")
    assert np.abs(total - built.foot.inertia * lifted["ankle/acceleration"]).max() < 1e-9


def test_a_foot_without_dorsiflexors_drops(drop_foot: Recording) -> None:
    middle = settled(drop_foot) & (np.abs(drop_foot["gait/phase"] - 0.80) < 0.01)
    angle = np.degrees(drop_foot["ankle/angle"])[middle]
    assert -26.0 < angle.mean() < -12.0


def test_plantarflexors_alone_never_lift_the_foot(drop_foot: Recording) -> None:
    """A muscle pulls its own way: the muscles that are left give no dorsiflexion."""
    own = drop_foot["ankle/moment/biological"][settled(drop_foot)]
    assert own.max() < 0.1
    assert own.min() < -100.0


def test_no_moment_of_the_patient_jumps(drop_foot: Recording) -> None:
    """From one step to the next, not more than twice what the healthy walk's fastest change takes."""
    own, recorded = drop_foot["ankle/moment/biological"], drop_foot["gait/ankle_moment"]
    assert np.abs(np.diff(own)).max() < 2.0 * np.abs(np.diff(recorded)).max()


def test_the_orthosis_gives_the_clearance_back(
    healthy: Recording, drop_foot: Recording, lifted: Recording
) -> None:
    for point in ("ball", "toe"):
        clearance = [run[f"{point}/height"][in_swing(run)].min() for run in (healthy, drop_foot, lifted)]
        assert clearance[1] < clearance[0] - 0.02  # a drop foot scuffs
        assert clearance[2] >= clearance[0] - 0.005
    assert lifted.ok


def test_s1s_printed_timer_lifts_by_its_valves_and_not_by_the_gait() -> None:
    """Filled from 0 to 4 s of each 8 s. A separate computation had the toe caught in 6 of 14 strides."""
    walk = afo_sim.run("walk-dropfoot-afo-paper-timer", {"timestep": "2 ms"})
    stride = gait_file.read(assets.find_gait("bovi2011_natural")).stride_time
    heights = {k: each["toe_clearance"].value for k, each in walk.strides.items()}
    caught = {k for k, each in walk.strides.items() if each["swings_with_toe_contact"].value > 0.0}
    caught |= {k for k, height in heights.items() if height < 0.0}
    bare = walk.metrics["reference_toe_clearance"].value
    for k, height in heights.items():
        passed = (k + 0.86) * stride % 8.0  # of the timer, at the toe's event [s]
        if 2.0 < passed < 4.0:
            assert height > 10.0
        if 6.0 < passed < 8.0:
            assert k in caught and bare - 0.5 < height < -5.0
    assert len([k for k in caught if k < 14]) == 6
    assert min(heights.values()) == pytest.approx(-25.6, abs=0.1)
    assert {answer.name: answer.status for answer in walk.verdict}["lift"] == "bad"


def test_the_stop_holds_an_ankle_that_the_recorded_ground_bends() -> None:
    """Weak calf muscles under the recorded force: into the stop at 30°, which gives a little."""
    run = afo_sim.run("walk-dropfoot", WALKER | {"patient": "plantarflexor-weak", "duration": "2.4 s"})
    # the stop gives with the moment, 142 N·m here
    assert 30.0 < np.degrees(run["ankle/angle"]).max() < 32.5
    total = sum(run[name] for name in run.columns if name.startswith("ankle/moment/"))
    foot = build(load("scenario", "walk-dropfoot", WALKER)).foot
    assert np.abs(total - foot.inertia * run["ankle/acceleration"]).max() < 1e-9


@pytest.mark.slow
def test_half_the_time_step_changes_clearance_and_torque_little() -> None:
    runs = [afo_sim.run("walk-dropfoot-afo", {"duration": "4.8 s", **step}) for step in ({}, HALF_STEP)]
    for point in ("ball", "toe"):
        coarse, fine = (run[f"{point}/height"][in_swing(run)].min() for run in runs)
        assert abs(coarse - fine) < 0.3e-3
        coarse, fine = (run.metrics[f"lowest_{point}_clearance"].value for run in runs)  # [mm]
        assert abs(coarse - fine) < 0.3
    coarse, fine = (run.metrics["orthosis_peak_dorsiflexion_torque"].value for run in runs)
    assert coarse == pytest.approx(fine, rel=0.005)


def test_heights_are_those_of_the_model(lifted: Recording) -> None:
    """Sole points from pose and angle, against MuJoCo's own kinematics."""
    import mujoco

    built = walk_built("walk-dropfoot-afo-short")
    data = mujoco.MjData(built.model)
    for row in range(0, len(lifted["time"]), 1777):
        for name in ("shank_x", "shank_z", "shank_angle", "ankle", "toe"):
            joint = built.model.joint(name)
            data.qpos[joint.qposadr[0]] = lifted[f"qpos/{name}"][row]
        mujoco.mj_kinematics(built.model, data)
        heights = {name: data.site(f"sole_{name}").xpos[2] for name in ("heel", "ball", "pulp", "tip")}
        heights |= {"toe": min(heights["pulp"], heights["tip"]), "sole": min(heights.values())}
        for point in ("heel", "ball", "toe", "sole"):
            assert lifted[f"{point}/height"][row] == pytest.approx(heights[point], abs=1e-9)


def test_varied_strides_have_the_stated_mean_and_spread() -> None:
    gait = Gait(cycle="gatk_stride1", stride_time="1.1 s", variability=0.04, seed=3)
    time = np.arange(0.0, 2200.0, 0.01)
    phase = phase_at(gait, 1.2, time)
    strikes = np.interp(np.arange(1.0, 1900.0), phase, time)
    strides = np.diff(strikes)
    assert strides.mean() == pytest.approx(1.1, rel=0.004)
    assert strides.std() / 1.1 == pytest.approx(0.04, rel=0.1)
    assert np.all(np.diff(phase) > 0.0)
    # no kink: the rate of phase has no jump from one sample to the next
    assert np.abs(np.diff(phase, 2)).max() / 1e-4 < 1.0


@pytest.mark.slow
def test_valves_follow_the_gait_phase_whatever_the_cadence() -> None:
    for stride_time in ("1 s", "1.4 s"):
        run = afo_sim.run("walk-dropfoot-afo", {"gait.stride_time": stride_time, "duration": "5 s"})
        on = run["valve/dorsiflexor_inlet/coil"] == 1.0
        phase = run["gait/phase"]
        assert np.array_equal(on, (phase >= phase[on].min()) & (phase <= phase[on].max()))
        timer = load("scenario", "walk-dropfoot-afo").phases.chambers["dorsiflexor"].inlet[0]
        assert (phase[on].min(), phase[on].max()) == pytest.approx(timer, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "value", "column"),
    [
        ("patient.dorsiflexor_strength", 0.5, "ankle/angle"),
        ("patient.plantarflexor_strength", 0.5, "ankle/angle"),
        ("patient.stiffness", 0.5, "ankle/angle"),
        ("patient.spasticity", "3 N*m*s/rad", "ankle/moment/biological"),
        ("patient.body_mass", "90 kg", "ground/force/z"),
        ("patient.body_height", "1.9 m", "ankle/position/z"),
        ("gait.stride_time", "1.1 s", "gait/phase"),
        ("gait.variability", 0.05, "gait/phase"),
        ("gait.seed", 7, "gait/phase"),
        ("gait.start_phase", 0.3, "gait/phase"),
        ("gait.ankle_offset", "3 deg", "ankle/angle"),
        ("gait.cycle", "gatk_stride2", "shank/angle"),
    ],
)
def test_every_parameter_of_walking_acts(key: str, value: object, column: str) -> None:
    base = {"duration": "2.5 s", "gait.variability": 0.02, "patient.dorsiflexor_strength": 0.9}
    before, after = (afo_sim.run("walk-healthy", sets)[column] for sets in (base, base | {key: value}))
    assert np.abs(after - before).max() > 1e-6 * np.abs(before).max()


@pytest.mark.parametrize("patient", assets.names("patient"))
def test_every_patient_walks(patient: str) -> None:
    run = afo_sim.run("walk-healthy", {"patient": patient, "duration": "2.5 s"})
    assert run.ok
    peak = np.degrees(np.abs(run["ankle/angle"] - run["gait/ankle_angle"])).max()
    assert peak < 0.5 if patient == "healthy" else peak > 1.0


def test_a_bigger_patient_is_the_same_shape() -> None:
    """All lengths × 1.2, masses × 1.5: the foot's inertia × 1.5 × 1.44."""
    sets = {"patient.body_mass": "112.5 kg", "patient.body_height": "2.1 m"}
    own = {"patient.body_mass": "75 kg", "patient.body_height": "1.75 m"}
    small, big = (walk_built(sets=s).foot for s in (own, sets))
    assert big.mass == pytest.approx(1.5 * small.mass, rel=1e-9)
    assert big.inertia == pytest.approx(1.5 * 1.44 * small.inertia, rel=1e-9)
    assert big.ankle_height == pytest.approx(1.2 * small.ankle_height, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "sets", "said"),
    [
        ("walk-healthy", {"gait.cycle": "gatk_stride3"}, "did you mean 'gatk_stride"),
        ("walk-healthy", {"gait.stride_time": "1.2"}, "has no unit"),
        ("walk-healthy", {"gait.variability": 0.5}, "at most 0.2"),
        ("walk-healthy", {"patient": "dropfoot"}, "did you mean 'drop-foot'"),
        ("walk-healthy", {"patient.dorsiflexor_strength": 1.5}, "at most 1"),
        ("walk-healthy", {"shank.knee_angle": "90 deg"}, "follows from the gait"),
        ("walk-healthy", {"shank.pose": "fixed"}, "needs it"),
        ("walk-dropfoot-afo", {"timer.period": "1 s"}, "one of them"),
        ("walk-dropfoot-afo", {"phases.dorsiflexors.inlet": [[0.1, 0.2]]}, "did you mean 'dorsiflexor'"),
        ("walk-dropfoot-afo", {"phases.dorsiflexor.inlet": [[0.1, 1.2]]}, "at most 1"),
        ("seated", {"patient": "healthy"}, "driven shank"),
        ("seated", {"gait.cycle": "gatk_stride1"}, "driven shank"),
    ],
)
def test_bad_walks_are_refused(name: str, sets: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as refused:
        build(load("scenario", name, sets))
    assert said in str(refused.value)


def test_who_changes_a_recording_does_not_change_the_next_run():
    # The recorded walking is laid out once for all runs of a process that share it.
    sets = {"duration": "0.3 s"}
    first = afo_sim.run("walk-dropfoot", sets)
    angle = first["ankle/angle"].copy()
    for values in first.columns.values():
        values *= 2.0
    assert np.array_equal(afo_sim.run("walk-dropfoot", sets)["ankle/angle"], angle)
    walk = build(load("scenario", "walk-dropfoot", sets)).walk
    for values in (walk.pose, walk.ankle, walk.knee, walk.phase, walk.cycle.ankle_x, walk.cycle.grf_z):
        with pytest.raises(ValueError, match="read-only"):
            values[:] = 0.0


@pytest.mark.parametrize("name", sorted(set(assets.gait_names()) - {"norm_adult"}))
def test_every_shipped_walker_is_returned(name: str) -> None:
    """Its ankle to 0.1°, and in stance its moment about this leg's ankle to 0.05 N·m/kg (RMS)."""
    sets = {"gait.cycle": name, "duration": "2.6 s"}
    run, built = afo_sim.run("walk-healthy", sets), build(load("scenario", "walk-healthy", sets))
    assert np.degrees(np.abs(run["ankle/angle"] - run["gait/ankle_angle"])).max() < 0.1
    cycle = built.walk.cycle
    recorded = np.interp(run["gait/phase"], cycle.phase, cycle.ankle_moment)
    loaded = run["ground/force/z"] > 0.05 * built.body_mass * GRAVITY
    missed = (run["gait/ankle_moment"] / built.body_mass - recorded)[loaded]
    assert math.sqrt(np.mean(missed**2)) < 0.05
