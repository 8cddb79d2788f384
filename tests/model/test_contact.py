"""Walking on a floor: the recorded walking comes back, and other feet are caught."""

import dataclasses
import math
import pathlib

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import afo_sim
from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.common.units import GRAVITY
from afo_sim.description.reader import load
from afo_sim.model.build import Built, build
from afo_sim.physics.passive_ankle import passive_moment
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.run import run_built

CONTACT = {"ground.mode": "contact", "duration": "3.7 s"}
PATIENTS = ("healthy", "drop-foot", "drop-foot-mild", "plantarflexor-weak")


def contact_built(sets: dict[str, object] | None = None, name: str = "walk-healthy") -> Built:
    return build(load("scenario", name, CONTACT | (sets or {})))


@pytest.fixture(scope="module")
def runs() -> dict[str, Recording]:
    return {p: afo_sim.run("walk-healthy", CONTACT | {"patient": p}) for p in PATIENTS}


@pytest.fixture(scope="module")
def as_recorded() -> dict[str, Recording]:
    sets = {"duration": CONTACT["duration"], "gait.settled": "walked"}  # row by row beside those in contact
    return {p: afo_sim.run("walk-healthy", sets | {"patient": p}) for p in PATIENTS}


def part(run: Recording, start: float, end: float) -> np.ndarray:
    """Rows after the first stride between two gait phases."""
    phase = run["gait/phase"]
    return (run["gait/stride"] >= 1.0) & (phase >= start) & (phase < end)


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
    rows = part(run, 0.0, 1.0) & (run["gait/ground_force_z"] > 20.0)
    assert np.abs(run["ground/position/x"] - recorded["ground/position/x"])[rows].max() < 0.002


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
        {"gait.stride_time": "0.8 s"},
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


# ---- and what else may happen


def test_all_moments_sum_to_the_ankles_acceleration(runs: dict[str, Recording]) -> None:
    cases = [(contact_built(), run) for run in runs.values()]
    weak = {"patient.dorsiflexor_strength": 0.0, "patient.plantarflexor_strength": 0.0}  # up to the stop
    for built in (contact_built(weak), contact_built(name="walk-dropfoot-afo")):
        cases.append((built, run_built(built)))
    assert max(np.degrees(run["ankle/angle"]).max() for _, run in cases) > 30.0
    for built, run in cases:
        assert built.foot is not None
        assert run.ok
        total = sum(run[name] for name in run.columns if name.startswith("ankle/moment/"))
        assert np.abs(total - built.foot.inertia * run["ankle/acceleration"]).max() < 1e-9


def test_the_floor_holds_a_drop_foot(runs: dict[str, Recording], as_recorded: dict[str, Recording]) -> None:
    """The toe lies on the floor in swing and is pushed up; the foot lands flat, not on its heel."""
    run, through = runs["drop-foot"], as_recorded["drop-foot"]
    swing = part(run, 0.72, 0.97)
    healthy = as_recorded["healthy"]["toe/height"][swing].min()
    assert through["toe/height"][swing].min() < -0.04
    assert run["toe/height"][swing].min() > healthy - 0.006  # the rigid recorded toe is 12.6 mm deep itself
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
    assert most[0] > 30.0  # through the stop
    healthy = np.degrees(runs["healthy"]["ankle/angle"]).max()
    assert healthy + 3.0 < most[1] < 30.0
    run = runs["plantarflexor-weak"]
    assert run["shank/sink"].min() < -0.005  # what they do not carry lets the leg down
    assert run["ground/force/z"].max() < 1.05 * runs["healthy"]["ground/force/z"].max()


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


def independent_leg(built: Built, run: Recording, first: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Ankle and sink of a bare leg on the same floor, by equations and an integrator of their own."""
    walk, contact, active = built.walk, built.contact, built.active
    assert walk is not None and contact is not None and active is not None
    cycle, period = walk.cycle, walk.cycle.stride_time
    foot, foot_inertia, shank, shank_centre = 1.09, 0.0061 + 1.09 * (0.055**2 + 0.030**2), 3.49, 0.2444
    points = {"heel": (-0.060, 5e4), "ball": (0.120, 5e4), "toe": (0.190, 25.0 / 0.07**2)}
    times = run["time"]

    def told(values: np.ndarray, t: float) -> float:
        return float(np.interp(t, times, values))

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        theta, rate, sink, sinking = y
        z, shank_angle = (cycle.signal(s, t / period) for s in ("ankle_z", "shank_angle"))
        vz, turning = (cycle.signal(s, t / period, 1) for s in ("ankle_z", "shank_angle"))
        ax, az, turning2 = (cycle.signal(s, t / period, 2) for s in ("ankle_x", "ankle_z", "shank_angle"))
        pitch, spin = theta - shank_angle, rate - turning
        cos, sin = math.cos(pitch), math.sin(pitch)
        lift, moment = 0.0, told(contact.moment, t)
        for k, (x, stiffness) in enumerate(points.values()):
            ahead, height = x * cos + 0.068 * sin, z + sink + x * sin - 0.068 * cos
            depth = max(told(contact.floor[:, k], t) - height, 0.0)
            force = stiffness * depth * max(1.0 - (vz + sinking + ahead * spin), 0.0)
            lift, moment = lift + force, moment + force * ahead
        moment += told(active.moment, t) - told(active.stiffness, t) * theta - 0.5 * rate
        moment += passive_moment(theta, float(cycle.signal("knee_angle", t / period)), 1.0, 0.0)
        cx, cz = 0.055 * cos + 0.030 * sin, 0.055 * sin - 0.030 * cos
        # about the ankle, and up; unknown: the foot's pitch and the sink, twice derived
        matrix = [[foot_inertia, foot * cx], [foot * cx, foot + shank]]
        shank_lift = (
            shank * shank_centre * (-math.sin(shank_angle) * turning2 - math.cos(shank_angle) * turning**2)
        )
        right = [
            moment - foot * (cx * (az + GRAVITY) - cz * ax),
            told(contact.support, t)
            + lift
            - 2e4 * sink
            - 400.0 * sinking
            - (foot + shank) * (az + GRAVITY)
            - shank_lift
            + foot * cz * spin**2,
        ]
        pitching, sinking2 = np.linalg.solve(matrix, right)
        return np.array([rate, pitching + turning2, sinking, sinking2])

    sinking = (run["shank/sink"][first + 1] - run["shank/sink"][first]) / built.scenario.timestep
    start = [run["ankle/angle"][first], run["ankle/velocity"][first], run["shank/sink"][first], sinking]
    at = times[first : first + n]
    found = solve_ivp(rhs, (at[0], at[-1]), start, t_eval=at, max_step=1e-3, rtol=1e-6, atol=1e-9)
    return found.y[0], found.y[2]


@pytest.mark.slow
def test_an_independent_leg_strikes_the_floor_alike() -> None:
    """A drop foot from toe-off over the toe's strike in swing and the landing into stance."""
    sets = {"timestep": "0.25 ms", "record_rate": "4 kHz", "duration": "1.7 s"}
    built = contact_built(sets, "walk-dropfoot")
    run = run_built(built)
    first, n = 3400, 3000  # 0.85 s to 1.6 s
    angle, sink = independent_leg(built, run, first, n)
    assert run["ground/force/z"][3600:4400].max() > 50.0
    assert np.degrees(np.abs(angle - run["ankle/angle"][first : first + n])).max() < 0.5
    assert np.abs(sink - run["shank/sink"][first : first + n]).max() < 3e-4


# ---- how it runs


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
    assert built.contact is not None
    floor = built.contact.floor.copy()
    floor[50:] = np.nan
    run = run_built(dataclasses.replace(built, contact=dataclasses.replace(built.contact, floor=floor)))
    assert not run.ok
    assert len(run["time"]) == 50


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


def test_without_contact_nothing_has_changed() -> None:
    sets = {"duration": "0.5 s"}
    plain = build(load("scenario", "walk-dropfoot-afo", sets))
    told = build(load("scenario", "walk-dropfoot-afo", sets | {"ground.mode": "recorded"}))
    assert plain.xml == told.xml
    assert plain.model.nu == told.model.nu == contact_built(name="walk-dropfoot-afo").model.nu - 7
    before, after = run_built(plain), run_built(told)
    assert list(before.columns) == list(after.columns)
    assert all(np.array_equal(before[name], after[name]) for name in before.columns)


@pytest.mark.parametrize(
    ("key", "value", "column"),
    [
        ("ground.stiffness", "80 kN/m", "ground/force/z"),
        ("ground.damping", "0.5 s/m", "ground/force/z"),
        ("ground.toe_stiffness", "40 N*m/rad", "toe/height"),
        ("ground.body_stiffness", "40 kN/m", "shank/sink"),
        ("ground.body_damping", "800 N*s/m", "shank/sink"),
    ],
)
def test_every_parameter_of_the_floor_acts(key: str, value: str, column: str) -> None:
    base = CONTACT | {"duration": "1.6 s"}
    before, after = (afo_sim.run("walk-dropfoot", sets)[column] for sets in (base, base | {key: value}))
    assert np.abs(after - before).max() > 1e-3 * np.abs(before).max()


@pytest.mark.parametrize(
    ("name", "sets", "said"),
    [
        ("seated", {"ground.mode": "contact"}, "driven shank"),
        ("walk-healthy", {"ground.mode": "contakt"}, "'recorded' or 'contact'"),
        ("walk-healthy", {"ground.stifness": "50 kN/m"}, "did you mean 'stiffness'"),
        ("walk-healthy", {"ground.mode": "contact", "ground.stiffness": "50"}, "has no unit"),
        (
            "walk-healthy",
            {"ground.mode": "contact", "timestep": "4 ms", "record_rate": "250 Hz"},
            "at most 2",
        ),
        ("walk-healthy", {"ground.mode": "contact", "ground.stiffness": "900 kN/m"}, "softer"),
    ],
)
def test_bad_floors_are_refused(name: str, sets: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as refused:
        build(load("scenario", name, sets))
    assert said in str(refused.value)


def test_a_sole_without_its_points_is_refused(tmp_path: pathlib.Path) -> None:
    leg = assets.find("leg", "adult_75kg")
    for spoil, said in (
        (lambda xml: xml.replace('<site name="toe"', '<site name="hallux"'), "no such site"),
        (lambda xml: xml.replace('pos="0.190 0 -0.068"', 'pos="0.110 0 -0.068"'), "back to front"),
    ):
        for file in leg.parent.iterdir():
            (tmp_path / file.name).write_text(spoil(file.read_text()))
        with pytest.raises(InputError) as refused:
            contact_built({"leg": str(tmp_path / "leg.toml")})
        assert said in str(refused.value)


@pytest.mark.parametrize(("damping", "warned"), [("1 s/m", False), ("2 s/m", True)])
def test_a_recorded_force_that_the_pads_cannot_carry_is_told(damping: str, warned: bool) -> None:
    # A damping of 2 s/m lets go of a point that rises at 0.5 m/s, as the ball does before toe-off.
    sets = {"ground.mode": "contact", "ground.damping": damping, "duration": "1.3 s", "timestep": "0.25 ms"}
    run = afo_sim.run("walk-healthy", sets)
    missing = np.max(run["gait/ground_force_z"] - run["ground/force/z"]) / (75.0 * 9.80665)
    assert (missing > 0.01) == warned
    assert any("lower ground.damping" in text for text in run.warnings) == warned
