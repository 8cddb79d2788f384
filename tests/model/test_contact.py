"""Walking on a floor: the recorded walking comes back, and other feet are caught."""

import dataclasses
import functools
import math
import pathlib
import re
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from campaign import size
from changed_leg import changed_leg
from scipy.integrate import solve_ivp

import afo_sim
from afo_sim import native
from afo_sim.common import GRAVITY, InputError, assets
from afo_sim.description import load
from afo_sim.gait import file as gait_file
from afo_sim.model import PADS, Built, Turn, supply_and_timer, walking_start
from afo_sim.model.build import build
from afo_sim.model.contact import _placed_pads
from afo_sim.physics import passive_moment
from afo_sim.simulation import Recording, run_built

OWN_SIZE = {"patient.body_mass": "75 kg", "patient.body_height": "1.75 m"}  # the leg's
# walked from the start, row by row beside those on the recorded ground
CONTACT = {"ground.mode": "contact", "duration": "3.7 s", "gait.settled": "walked"} | OWN_SIZE
PATIENTS = ("healthy", "drop-foot", "drop-foot-mild", "plantarflexor-weak")
# One recorded stride, whose centre of pressure and ankle path are measured. Mean curves have derived ones.
MEASURED = {"gait.cycle": "gatk_stride1"}


def contact_built(sets: dict[str, object] | None = None, name: str = "walk-healthy") -> Built:
    return build(load("scenario", name, CONTACT | (sets or {})))


@pytest.fixture(scope="module")
def runs() -> dict[str, Recording]:
    return {p: afo_sim.run("walk-healthy", CONTACT | {"patient": p}) for p in PATIENTS}


@pytest.fixture(scope="module")
def as_recorded() -> dict[str, Recording]:
    sets = CONTACT | {"ground.mode": "recorded"}
    return {p: afo_sim.run("walk-healthy", sets | {"patient": p}) for p in PATIENTS}


def part(run: Recording, start: float, end: float) -> np.ndarray:
    """Rows after the first stride between two gait phases."""
    phase = run["gait/phase"]
    return (run["gait/stride"] >= 1.0) & (phase >= start) & (phase < end)


def needed_by_the_toes(
    ankle_x: np.ndarray, ankle_z: np.ndarray, pitch: np.ndarray, extension: np.ndarray, step: float
) -> np.ndarray:
    """Moment about their hinge that weight and inertia of the toes need, by their centre's acceleration."""
    turn = pitch + extension
    out = 0.0346 * np.cos(turn), 0.0346 * np.sin(turn)  # of their centre, from the hinge
    along = ankle_x + 0.115 * np.cos(pitch) + 0.050 * np.sin(pitch) + out[0]
    above = ankle_z + 0.115 * np.sin(pitch) - 0.050 * np.cos(pitch) + out[1]
    fast, up, spin = (np.gradient(np.gradient(x, step), step) for x in (along, above, turn))
    moment: np.ndarray = 1e-4 * spin + 0.161 * (out[0] * (up + GRAVITY) - out[1] * fast)
    return moment


# ---- the recorded walking comes back


def test_a_healthy_walker_feels_what_was_recorded(runs: dict[str, Recording]) -> None:
    run = runs["healthy"]
    rows = part(run, 0.0, 1.0)
    error = np.degrees(run["ankle/angle"] - run["gait/ankle_angle"])[rows]
    assert math.sqrt(np.mean(error**2)) < 0.1
    force, recorded = run["ground/force/z"][rows], run["gait/ground_force_z"][rows]
    assert np.abs(force - recorded).max() < 0.01 * 75.0 * GRAVITY
    assert force.sum() == pytest.approx(recorded.sum(), rel=0.002)
    assert np.abs(run["shank/sink"]).max() < 1e-4


def test_a_healthy_walkers_centre_of_pressure_is_the_recorded(
    runs: dict[str, Recording], as_recorded: dict[str, Recording]
) -> None:
    run, recorded = runs["healthy"], as_recorded["healthy"]
    rows = part(run, 0.0, 1.0) & (run["gait/ground_force_z"] > 50.0)
    force = run["ground/force/x"][rows], run["gait/ground_force_z"][rows]
    raised = (run["ankle/position/z"] - recorded["ankle/position/z"])[rows]
    # the force's moment about the ankle stays, which is laid on the floor with the sole
    place = recorded["ground/position/x"][rows] - raised * force[0] / force[1]
    assert np.abs(run["ground/position/x"][rows] - place).max() < 0.002


def test_what_is_missing_to_the_recording_goes_with_the_time_step(runs: dict[str, Recording]) -> None:
    """First order: the integrator takes a pad's force from the velocity at the end of the step."""
    errors = []
    for step, rate in (("1 ms", "1 kHz"), ("0.5 ms", "2 kHz"), ("0.25 ms", "4 kHz")):
        run = afo_sim.run("walk-healthy", CONTACT | {"timestep": step, "record_rate": rate})
        rows = part(run, 0.0, 1.0)
        errors.append(math.sqrt(np.mean((run["ankle/angle"] - run["gait/ankle_angle"])[rows] ** 2)))
    assert errors[0] / errors[1] > 1.5
    assert errors[1] / errors[2] > 1.5


@pytest.mark.parametrize(
    "sets",
    [
        {"timestep": "2 ms", "record_rate": "500 Hz"},
        {"patient.body_mass": "130 kg"},
        {"patient.body_mass": "30 kg", "patient.body_height": "1.2 m"},
        {"gait.cycle": "gatk_stride2"},
        {"gait.cycle": "gatk_mean"},
        {"gait.cycle": "opensim_walk"},
        {"gait.cycle": "bovi2011_xs"},
        {"gait.cycle": "bovi2011_s"},
        {"gait.cycle": "bovi2011_m"},
        {"gait.speed": "1 m/s"},
        MEASURED | {"gait.stride_time": "0.8 s"},
        {"gait.variability": 0.05},
        {"gait.ankle_offset": "8 deg"},
        {"gait.start_phase": 0.3},
    ],
)
def test_so_does_every_other_walk(sets: dict[str, object]) -> None:
    run = afo_sim.run("walk-healthy", CONTACT | sets)
    assert run.ok
    error = np.degrees(run["ankle/angle"] - run["gait/ankle_angle"])
    assert math.sqrt(np.mean(error**2)) < 0.1
    lost = (run["gait/ground_force_z"] - run["ground/force/z"]).max()
    steps = run["time"][1] / 1e-3  # what is lost goes with the time step
    assert lost < 0.01 * steps * run["gait/ground_force_z"].max()


def test_a_path_that_leaves_its_force_behind_is_told_and_a_softer_pad_walks_it() -> None:
    """The foot of a fast walker leaves faster than a pad of twice the damping follows."""
    sets: dict[str, object] = CONTACT | {"gait.cycle": "bovi2011_l", "ground.damping": "2 s/m"}
    run = afo_sim.run("walk-healthy", sets)
    said = [re.search(r"lower ground.damping to (0\.\d\d s/m)", text) for text in run.warnings]
    (enough,) = [found.group(1) for found in said if found]
    run = afo_sim.run("walk-healthy", sets | {"ground.damping": enough})
    assert not any("ground.damping" in text for text in run.warnings)
    rows = part(run, 0.0, 1.0)
    error = np.degrees(run["ankle/angle"] - run["gait/ankle_angle"])[rows]
    assert math.sqrt(np.mean(error**2)) < 0.1
    force, recorded = run["ground/force/z"][rows], run["gait/ground_force_z"][rows]
    assert np.abs(force - recorded).max() < 0.02 * 75.0 * GRAVITY


def test_the_toes_of_a_healthy_walker_stand_as_recorded(runs: dict[str, Recording]) -> None:
    run = runs["healthy"]
    rows = part(run, 0.0, 1.0)
    departure = np.degrees(run["toe/extension"] - run["gait/toe_extension"])[rows]
    assert np.degrees(run["toe/extension"][rows]).max() > 30.0
    assert np.abs(departure).max() < 0.1


@pytest.mark.parametrize("gait", ["bovi2011_natural", "gatk_stride1", "opensim_walk"])
def test_toe_flexors_bear_the_recorded_load_on_the_hinge(gait: str) -> None:
    """They give the load's moment less what weight and inertia of the toes need."""
    built = contact_built({"gait.cycle": gait})
    walk, contact = built.walk, built.contact
    pitch = walk.ankle - walk.pose[:, 2]
    needed = needed_by_the_toes(walk.pose[:, 0], walk.pose[:, 1], pitch, walk.toe, walk.timestep)[3:-3]
    turn = (pitch + walk.toe)[1:-1]
    lever = 0.060 * np.cos(turn) + 0.018 * np.sin(turn)
    left = (contact.flexors + contact.load[:, 2] * lever)[2:-2]
    assert np.abs(left - needed).max() < 0.02 * np.abs(needed).max()
    assert np.abs(left).max() < 0.02 * np.abs(contact.flexors).max()  # toes are light, however they swing


@pytest.mark.parametrize("gait", ["gatk_stride1", "gatk_stride2", "opensim_walk"])
def test_toe_flexors_need_what_is_published(gait: str) -> None:
    """The most is a fifth to a third of the ankle's (Miyazaki & Yamamoto 1993, two walkers)."""
    built = contact_built({"gait.cycle": gait})
    assert 0.2 < built.contact.flexors.min() / built.active.recorded.min() < 0.34


def test_toe_flexors_are_as_strong_as_the_plantarflexors() -> None:
    """Without any, spring and load bend the toes: nothing presses them down, wherever the foot stands."""
    sets = CONTACT | {"patient.plantarflexor_strength": 0.0}
    run = afo_sim.run("walk-healthy", sets)
    departure = np.degrees(run["toe/extension"] - run["gait/toe_extension"])
    assert departure.min() > -2.0


def test_a_shod_walker_feels_what_was_recorded() -> None:
    """On a tilted outsole that bends with the toes."""
    run = afo_sim.run("walk-healthy", CONTACT | {"shoe": "trainer"})
    rows = part(run, 0.0, 1.0)
    assert np.degrees(np.abs(run["ankle/angle"] - run["gait/ankle_angle"])[rows]).max() < 0.1
    assert np.degrees(np.abs(run["toe/extension"] - run["gait/toe_extension"])[rows]).max() < 0.1
    force, recorded = run["ground/force/z"][rows], run["gait/ground_force_z"][rows]
    assert np.abs(force - recorded).max() < 0.01 * 75.0 * GRAVITY


# ---- and what else may happen


def test_a_dragging_toe_bends_up(runs: dict[str, Recording]) -> None:
    """It touches with its tip, bends beyond rest while it drags, and springs back when it is free.

    While it slides on its pulp alone, spring and damper bear the force times its lever, less what the toes
    need to move otherwise than recorded.
    """
    built, run = contact_built({"patient": "drop-foot"}), runs["drop-foot"]
    pitch, extension = run["ankle/angle"] - run["shank/angle"], run["toe/extension"]
    departure = extension - run["gait/toe_extension"]
    points = built.foot.outsole(pitch, extension)
    height = {name: run["ankle/position/z"] + z for name, (_, z) in points.items()}
    swing = (run["gait/stride"] == 1.0) & (run["gait/phase"] > 0.74) & (run["gait/phase"] < 0.98)
    struck = np.flatnonzero(swing & (run["ground/force/z"] > 0.0))[0]
    assert height["tip"][struck] < height["pulp"][struck] - 0.002
    assert abs(departure[struck - 1]) < math.radians(0.2)
    assert departure[struck : struck + 15].max() > math.radians(3.0)
    free = np.flatnonzero(swing)[-1]
    assert abs(departure[free]) < math.radians(0.2)
    drags = swing & (height["pulp"] < 0.0) & (np.minimum(height["tip"], height["ball"]) > 0.001)
    assert np.count_nonzero(drags) > 30
    lever = 0.060 * np.cos(pitch + extension) + 0.018 * np.sin(pitch + extension)
    borne = 25.0 * departure + 0.2 * np.gradient(departure, run["time"])
    ankle = run["ankle/position/x"], run["ankle/position/z"]
    recorded = ankle[0], ankle[1] - run["shank/sink"], run["gait/ankle_angle"] - run["shank/angle"]
    more = needed_by_the_toes(*ankle, pitch, extension, 1e-3)
    more -= needed_by_the_toes(*recorded, run["gait/toe_extension"], 1e-3)
    load = run["ground/force/z"] * lever - more
    assert borne[drags].mean() == pytest.approx(load[drags].mean(), rel=0.05)


def test_all_moments_sum_to_the_ankles_acceleration(runs: dict[str, Recording]) -> None:
    cases = [(contact_built(), run) for run in runs.values()]
    weak = {"patient.dorsiflexor_strength": 0.0, "patient.plantarflexor_strength": 0.0}
    weak |= MEASURED  # which goes up to the stop
    for built in (contact_built(weak), contact_built(name="walk-dropfoot-afo")):
        cases.append((built, run_built(built)))
    assert max(np.degrees(run["ankle/angle"]).max() for _, run in cases) > 30.0
    for built, run in cases:
        assert run.ok
        total = sum(run[name] for name in run.columns if name.startswith("ankle/moment/"))
        assert np.abs(total - built.foot.inertia * run["ankle/acceleration"]).max() < 1e-9


def test_the_floor_holds_a_drop_foot(runs: dict[str, Recording], as_recorded: dict[str, Recording]) -> None:
    """The toe lies on the floor in swing and is pushed up; the foot lands flat, not on its heel."""
    run, through = runs["drop-foot"], as_recorded["drop-foot"]
    swing = part(run, 0.72, 0.97)
    healthy = as_recorded["healthy"]["toe/height"][swing].min()
    assert through["toe/height"][swing].min() < -0.02  # what would be seen without a floor
    assert run["toe/height"][swing].min() > min(healthy, 0.0) - 0.003  # the pads give by a millimetre
    struck = swing & (run["ground/force/z"] > 20.0)
    assert np.count_nonzero(struck) > 20
    assert run["shank/sink"][struck].max() > 0.0005
    assert run["ground/force/z"].min() >= 0.0
    assert run.metrics["contacts_with_heel"].value == 0.0
    assert run.metrics["stance"].value == pytest.approx(runs["healthy"].metrics["stance"].value)


def test_a_weak_foot_slaps(runs: dict[str, Recording]) -> None:
    """Heel first, then down faster than a healthy one."""
    mild, healthy = (runs[p].metrics for p in ("drop-foot-mild", "healthy"))
    assert mild["contacts_with_heel"].value == 100.0
    assert mild["foot_pitch_at_contact"].value < healthy["foot_pitch_at_contact"].value - 2.0
    assert mild["foot_slap_velocity"].value > 1.1 * healthy["foot_slap_velocity"].value


def test_the_floor_holds_weak_plantarflexors(
    runs: dict[str, Recording], as_recorded: dict[str, Recording]
) -> None:
    most = [np.degrees(r["plantarflexor-weak"]["ankle/angle"]).max() for r in (as_recorded, runs)]
    healthy = np.degrees(runs["healthy"]["ankle/angle"]).max()
    assert healthy + 3.0 < most[1] < most[0] - 3.0
    run = runs["plantarflexor-weak"]
    assert run["shank/sink"].min() < -0.005  # what they do not carry lets the leg down
    assert run["ground/force/z"].max() < 1.05 * runs["healthy"]["ground/force/z"].max()


def test_the_floor_keeps_weak_plantarflexors_off_the_stop() -> None:
    sets = CONTACT | MEASURED | {"patient": "plantarflexor-weak"}
    through = afo_sim.run("walk-healthy", sets | {"ground.mode": "recorded", "gait.settled": "walked"})
    assert np.degrees(through["ankle/angle"]).max() > 30.0
    assert np.degrees(afo_sim.run("walk-healthy", sets)["ankle/angle"]).max() < 30.0


@pytest.mark.parametrize("patient", ["drop-foot", "plantarflexor-weak"])
def test_half_the_time_step_changes_little(patient: str) -> None:
    found = []
    for step, rate in (("1 ms", "1 kHz"), ("0.5 ms", "2 kHz"), ("0.25 ms", "4 kHz")):
        sets = {"patient": patient, "timestep": step, "record_rate": rate}
        run = afo_sim.run("walk-healthy", CONTACT | sets)
        rows, swing = part(run, 0.0, 1.0), part(run, 0.70, 0.97)
        angle = np.degrees(run["ankle/angle"][rows])
        force = run["ground/force/z"]
        found.append(
            (angle.max(), angle.min(), 1e3 * run["toe/height"][swing].min(), force[rows].max() / 10.0)
        )
    first, second = np.abs(np.diff(found, axis=0))
    assert first.max() < 0.2  # deg, deg, mm, 10 N
    assert second.max() < 0.1


def independent_leg(built: Built, run: Recording, first: int, n: int) -> np.ndarray:
    """Ankle, toes and sink of a bare leg on the same floor, by equations and an integrator of their own.

    The unknowns are the pitch of foot and toes, and the sink; each body's row is J·(m a) + ω·I α.
    """
    walk, contact, active = built.walk, built.contact, built.active
    cycle, period, rest = walk.cycle, walk.cycle.stride_time, walk.toe
    shank, shank_centre = 3.49, 0.2444
    masses, inertias = (0.929, 0.161), (0.004234, 1e-4)
    centre, hinge, toe_centre = (0.03861, -0.02653), (0.115, -0.050), (0.0346, 0.0)
    on_foot, on_toes = ((-0.060, -0.068), (0.120, -0.068)), ((0.060, -0.018), (0.075, -0.010))
    times = run["time"]
    resting_rate = np.diff(rest)[1:] / walk.timestep

    def told(values: np.ndarray, t: float) -> float:
        return float(np.interp(t, times, values))

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        theta, rate, extension, extending, sink, sinking = y
        z, shank_angle = (cycle.signal(s, t / period) for s in ("ankle_z", "shank_angle"))
        vz, turning = (cycle.signal(s, t / period, 1) for s in ("ankle_z", "shank_angle"))
        ax, az, turning2 = (cycle.signal(s, t / period, 2) for s in ("ankle_x", "ankle_z", "shank_angle"))
        pitch, spin = theta - shank_angle, rate - turning
        toe_spin = spin + extending

        def along(place: tuple[float, float], angle: float) -> np.ndarray:
            cos, sin = math.cos(angle), math.sin(angle)
            return np.array([place[0] * cos - place[1] * sin, place[0] * sin + place[1] * cos])

        def across(place: np.ndarray) -> np.ndarray:
            return np.array([-place[1], place[0]])

        at_hinge = along(hinge, pitch)
        # of each pad: the way of its point by the foot's pitch, and by the toes' [m]
        pads = [(along(point, pitch), np.zeros(2)) for point in on_foot]
        pads += [(at_hinge, along(point, pitch + extension)) for point in on_toes]
        right = np.zeros(3)
        for k, (by_foot, by_toes) in enumerate(pads):
            rising = vz + sinking + by_foot[0] * spin + by_toes[0] * toe_spin
            depth = max(told(contact.floor[:, k], t) - (z + sink + by_foot[1] + by_toes[1]), 0.0)
            force = 5e4 * depth * max(1.0 - rising, 0.0)
            right += force * np.array([by_foot[0], by_toes[0], 1.0])
        in_hinge = -25.0 * (extension - told(rest[1:-1], t)) - 0.2 * (extending - told(resting_rate, t))
        in_hinge += told(contact.flexors, t)
        in_ankle = told(contact.moment, t) + told(active.moment, t) - told(active.stiffness, t) * theta
        in_ankle += (
            passive_moment(theta, float(cycle.signal("knee_angle", t / period)), 1.0, 0.0) - 0.5 * rate
        )
        right += [in_ankle - in_hinge, in_hinge, 0.0]
        shank_lift = shank_centre * (-math.sin(shank_angle) * turning2 - math.cos(shank_angle) * turning**2)
        right[2] += told(contact.support, t) - 2e4 * sink - 400.0 * sinking
        right[2] -= shank * (az + GRAVITY + shank_lift)
        matrix = np.diag([inertias[0], inertias[1], shank])
        up, none = np.array([0.0, 1.0]), np.zeros(2)
        bodies = ((along(centre, pitch), none), (at_hinge, along(toe_centre, pitch + extension)))
        for mass, (by_foot, by_toes) in zip(masses, bodies, strict=True):
            ways = np.stack([across(by_foot), across(by_toes), up])
            matrix += mass * ways @ ways.T
            known = np.array([ax, az + GRAVITY]) - spin**2 * by_foot - toe_spin**2 * by_toes
            right -= mass * ways @ known
        pitching, toe_pitching, sinking2 = np.linalg.solve(matrix, right)
        return np.array([rate, pitching + turning2, extending, toe_pitching - pitching, sinking, sinking2])

    step = built.scenario.timestep
    names = ("ankle/angle", "toe/extension", "shank/sink")
    start = []
    for name in names:
        start += [run[name][first], (run[name][first + 1] - run[name][first - 1]) / (2.0 * step)]
    at = times[first : first + n]
    found = solve_ivp(rhs, (at[0], at[-1]), start, t_eval=at, max_step=2e-3, rtol=1e-6, atol=1e-9)
    return found.y[::2]


@pytest.mark.slow
@pytest.mark.parametrize("gait", ["bovi2011_natural", "gatk_stride1"][: size(1, 2)])
def test_an_independent_leg_strikes_the_floor_alike(gait: str) -> None:
    """A drop foot from toe-off over the toe's strike in swing and the landing into stance."""
    sets = {"timestep": "0.25 ms", "record_rate": "4 kHz", "duration": "1.7 s", "gait.cycle": gait}
    built = contact_built(sets, "walk-dropfoot")
    run = run_built(built)
    phase = run["gait/stride"] + run["gait/phase"]
    first, end = np.searchsorted(phase, [0.70, 1.32])
    rows = slice(first, end)
    angle, extension, sink = independent_leg(built, run, int(first), int(end - first))
    assert run["ground/force/z"][(phase > 0.75) & (phase < 0.90)].max() > 50.0
    assert np.degrees(run["toe/extension"] - run["gait/toe_extension"])[rows].max() > 3.0
    assert np.degrees(np.abs(angle - run["ankle/angle"][rows])).max() < 0.5
    assert np.degrees(np.abs(extension - run["toe/extension"][rows])).max() < 0.5
    assert np.abs(sink - run["shank/sink"][rows]).max() < 3e-4


# ---- how it runs


@pytest.mark.slow
def test_python_callbacks_do_the_same() -> None:
    native_run, plain = (
        afo_sim.run("walk-dropfoot", CONTACT | {"duration": "1.4 s", "callback": mode})
        for mode in ("native", "python")
    )
    for column in ("ankle/angle", "ground/force/z", "shank/sink", "ankle/moment/ground"):
        scale = np.abs(plain[column]).max()
        assert np.abs(native_run[column] - plain[column]).max() < 1e-9 * scale


@pytest.mark.parametrize("mode", ["native", "python"])
def test_a_pad_that_is_no_number_ends_the_run(mode: str) -> None:
    built = contact_built({"callback": mode, "duration": "0.1 s"})
    row = built.index.walking["pad_ball"]
    built.model.actuator_user[row, 2] = np.nan
    run = run_built(built)
    assert "pad_ball" in run.status
    built = contact_built({"callback": mode, "duration": "0.1 s"})
    floor = built.contact.floor.copy()
    floor[50:] = np.nan
    run = run_built(dataclasses.replace(built, contact=dataclasses.replace(built.contact, floor=floor)))
    assert not run.ok
    assert len(run["time"]) == 50


def test_a_step_hands_dampers_to_the_integrator_and_writes_no_input_but_the_muscles() -> None:
    """A pad's state is half of −∂F/∂v and h/4 of its secant stiffness, of this step's own force."""
    built = contact_built({"duration": "0.3 s", "patient": "spastic"}, "walk-dropfoot-afo")
    model, muscles = built.model, list(built.index.muscles.values())
    pads = [built.index.walking[name] for name in PADS]
    stiffness, damping = model.actuator_user[pads, 2], model.actuator_user[pads, 3]
    inputs, pressed, data = supply_and_timer.controls(built), 0, mujoco.MjData(model)
    with native.installed():
        start = walking_start(built, inputs[0])
        mujoco.mj_setState(model, data, start, mujoco.mjtState.mjSTATE_INTEGRATION)
        for row in inputs:
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
            assert np.array_equal(np.delete(data.ctrl, muscles), np.delete(row, muscles))
            force, depth = data.actuator_force[pads], row[pads] - data.actuator_length[pads]
            on = (force > 0.0) & (depth > 0.0)
            secant = np.divide(force, depth, out=np.zeros(len(pads)), where=on)
            carried = 0.5 * stiffness * damping * depth + 0.25 * model.opt.timestep * secant
            found = data.act[model.actuator_actadr[pads]]
            assert found == pytest.approx(np.where(on, carried, 0.0), rel=1e-9, abs=1e-9)
            pressed += on.any()
    assert pressed > 100


def test_nobodys_muscles_and_a_giant_end_no_run() -> None:
    for sets in (
        {"patient.dorsiflexor_strength": 0.0, "patient.plantarflexor_strength": 0.0},
        {"patient": "drop-foot", "patient.body_mass": "200 kg", "patient.body_height": "2.1 m"},
        {"patient": "drop-foot", "patient.stiffness": 0.0, "ground.damping": "0 s/m"},
        {"patient": "spastic", "gait.start_phase": 0.85},
    ):
        run = afo_sim.run("walk-healthy", CONTACT | sets)
        assert run.ok, sets
        weight = GRAVITY * 200.0 if "patient.body_mass" in sets else GRAVITY * 75.0
        assert run["ground/force/z"].min() >= 0.0
        assert run["ground/force/z"].max() < 1.5 * weight


def test_contact_is_the_default_and_the_recorded_force_adds_nothing() -> None:
    sets = {"duration": "0.5 s"}
    plain = build(load("scenario", "walk-dropfoot-afo", sets))
    told = build(load("scenario", "walk-dropfoot-afo", sets | {"ground.mode": "contact"}))
    without = build(load("scenario", "walk-dropfoot-afo", sets | {"ground.mode": "recorded"}))
    assert plain.xml == told.xml
    assert plain.model.nu == told.model.nu == without.model.nu + 5  # four pads, the support
    before, after = run_built(plain), run_built(told)
    assert list(before.columns) == list(after.columns)
    assert all(np.array_equal(before[name], after[name]) for name in before.columns)


@pytest.mark.parametrize(
    ("key", "value", "column"),
    [
        ("ground.stiffness", "80 kN/m", "ground/force/z"),
        ("ground.damping", "0.5 s/m", "ground/force/z"),
        ("leg.toes.stiffness", "40 N*m/rad", "toe/height"),
        ("ground.body_stiffness", "40 kN/m", "shank/sink"),
        ("ground.body_damping", "800 N*s/m", "shank/sink"),
    ],
)
def test_every_parameter_of_the_floor_acts(key: str, value: str, column: str) -> None:
    base = CONTACT | {"duration": "1.6 s"}
    before, after = (afo_sim.run("walk-dropfoot", sets)[column] for sets in (base, base | {key: value}))
    assert np.abs(after - before).max() > 1e-3 * np.abs(before).max()


def test_a_rigid_foot_has_its_toe_joint_in_its_pad(tmp_path: pathlib.Path) -> None:
    leg = changed_leg(tmp_path, lambda text: re.sub(r'<joint name="toe".*/>|\[toes\]\n(.+\n?)*', "", text))
    run = afo_sim.run("walk-healthy", CONTACT | leg)
    assert "toe/extension" not in run.columns
    error = np.degrees(run["ankle/angle"] - run["gait/ankle_angle"])[part(run, 0.0, 1.0)]
    assert math.sqrt(np.mean(error**2)) < 0.1
    base = CONTACT | leg | {"duration": "1.6 s"}
    before, after = (
        afo_sim.run("walk-dropfoot", sets)["toe/height"]
        for sets in (base, base | {"ground.toe_stiffness": "40 N*m/rad"})
    )
    assert np.abs(after - before).max() > 1e-3 * np.abs(before).max()


@pytest.mark.parametrize(
    ("name", "sets", "said"),
    [
        ("seated", {"ground.mode": "contact"}, "driven shank"),
        ("walk-healthy", {"ground.mode": "contakt"}, "'contact' or 'recorded'"),
        ("walk-healthy", {"ground.stifness": "50 kN/m"}, "did you mean 'stiffness'"),
        ("walk-healthy", {"ground.mode": "contact", "ground.stiffness": "50"}, "has no unit"),
        (
            "walk-healthy",
            {"ground.mode": "contact", "timestep": "8 ms", "record_rate": "125 Hz"},
            "at most 6",
        ),
        ("walk-healthy", {"timestep": "2 ms", "ground.stiffness": "900 kN/m"}, "softer"),
        ("walk-healthy", {"ground.toe_stiffness": "40 N*m/rad"}, "allowed: leg.toes.stiffness"),
    ],
)
def test_bad_floors_are_refused(name: str, sets: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as refused:
        build(load("scenario", name, sets))
    assert said in str(refused.value)


def test_a_sole_without_its_points_is_refused(tmp_path: pathlib.Path) -> None:
    for old, new, said in (
        ('<site name="pulp"', '<site name="hallux"', "lacks some of the sole's sites"),
        ('pos="0.060 0 -0.018"', 'pos="-0.010 0 -0.018"', "back to front"),
    ):
        leg = changed_leg(tmp_path, functools.partial(re.sub, old, new))
        with pytest.raises(InputError, match=said):
            contact_built(leg)


@pytest.mark.parametrize(
    ("damping", "walker", "warned"),
    [
        ("1 s/m", "gatk_stride1", False),
        ("2 s/m", "gatk_stride1", False),
        ("1 s/m", "bovi2011_m", False),
        ("2 s/m", "bovi2011_l", True),
    ],
)
def test_a_recorded_force_that_the_pads_cannot_carry_is_told(damping: str, walker: str, warned: bool) -> None:
    # A damping of 2 s/m lets go of a point that rises at 0.5 m/s, as the pulp does in a quick push-off.
    sets = {
        "gait.cycle": walker,
        "ground.damping": damping,
        "duration": "1.3 s",
        "timestep": "0.25 ms",
    } | OWN_SIZE
    run = afo_sim.run("walk-healthy", sets)
    missing = np.max(run["gait/ground_force_z"] - run["ground/force/z"]) / (75.0 * 9.80665)
    assert (missing > 0.01) == warned
    assert any("lower ground.damping" in text for text in run.warnings) == warned


def test_pads_of_the_toes_have_levers_about_their_hinge() -> None:
    """Of heel, ball, pulp and tip, at two pitches and toes bent by 0.3 rad; by cosines and sines."""
    points = {"heel": (-0.05, -0.07), "ball": (0.12, -0.06), "pulp": (0.17, -0.05), "tip": (0.19, -0.04)}
    foot: Any = SimpleNamespace(toes=SimpleNamespace(hinge=(0.12, -0.05)), points=points)
    pitch, toe = np.array([0.0, 0.0, 0.5, 0.5]), np.full(4, 0.3)
    sole, toes = Turn.by(pitch), Turn.by(pitch + toe)
    pose = np.array([[0.0, 0.08, 0.0]] * 2 + [[0.0, 0.10, 0.0]] * 2)
    walk: Any = SimpleNamespace(
        phase=pitch, pose=pose, ankle=pitch, toe=toe, sole=sole, toes=toes, timestep=0.01
    )
    ahead, height, lever, velocity = _placed_pads(walk, foot)
    for k, at in enumerate((0.0, 0.5)):
        hinge = 0.12 * np.cos(at) + 0.05 * np.sin(at), 0.12 * np.sin(at) - 0.05 * np.cos(at)
        arms = [x * np.cos(at + 0.3) - z * np.sin(at + 0.3) for x, z in ((0.05, 0.0), (0.07, 0.01))]
        assert lever[k] == pytest.approx([0.0, 0.0, *arms])
        heel = -0.05 * np.cos(at) + 0.07 * np.sin(at)
        assert ahead[k, [0, 3]] == pytest.approx([heel, hinge[0] + arms[1]])
        above = pose[k + 1, 1] + hinge[1] + 0.05 * np.sin(at + 0.3)
        assert height[k, 2] == pytest.approx(above)
        assert velocity[k] == pytest.approx((0.02 + 0.5 * ahead[k]) / 0.02)  # over two steps


@pytest.mark.parametrize(("late", "told"), [(0.0, False), (0.03, False), (0.06, True)])
def test_a_force_that_does_not_fit_the_path_is_told(late: float, told: bool, tmp_path: pathlib.Path) -> None:
    """The force of a clock that is late by so many seconds."""
    cycle = gait_file.read(assets.find_gait("gatk_stride1"))
    then = (cycle.phase - late / cycle.stride_time) % 1.0
    forward, upward = (np.interp(then, cycle.phase, values) for values in (cycle.grf_x, cycle.grf_z))
    place = np.interp(then, cycle.phase, np.nan_to_num(cycle.cop_x))
    known = np.where(np.isfinite(cycle.cop_x) | (upward > 0.1), place, np.nan)
    file = tmp_path / "late.csv"
    gait_file.write(file, dataclasses.replace(cycle, grf_x=forward, grf_z=upward, cop_x=known))
    warnings = build(load("scenario", "walk-dropfoot-afo", {"gait.cycle": str(file)})).warnings
    assert ("sole-off-floor" in {getattr(one, "code", "") for one in warnings}) == told
