"""The settled stride that is solved for, against walking to it; what a run and its recording tell of it."""

import mujoco
import numpy as np
import pytest

from afo_sim import native
from afo_sim.description import Scenario, load
from afo_sim.model import AFTER, Built, get_state, steps_of_stride, two_strides, why_walked
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.native.between_strides import AIR, ANGLE
from afo_sim.simulation import Rollout, Settled, simulate_together
from afo_sim.simulation.examine import examine
from afo_sim.simulation.run import run
from afo_sim.simulation.settle import settle
from afo_sim.simulation.simulate import simulate

SHIPPED = ("walk-dropfoot-afo", "walk-dropfoot-afo-short", "walk-dropfoot", "walk-healthy")
SHORT = "walk-dropfoot-afo-short"
TORQUE, AIR_USED = "orthosis_peak_dorsiflexion_torque", "air_per_stride"


def scenario(name: str = "walk-dropfoot-afo", **sets: object) -> Scenario:
    return load("scenario", name, {key.replace("__", "."): value for key, value in sets.items()})


def solved(described: Scenario) -> tuple[Built, Settled]:
    built = build(two_strides(described))
    return built, settle([built], [schedule.controls(built)])[0]


def numbers(built: Built, rollout: Rollout) -> dict[str, float]:
    """Metrics of the last whole stride."""
    found = examine(built, rollout, transient=False, solved=True)[1]
    return {name: metric.value for name, metric in found.totals.items()}


def walked(described: Scenario, strides: int = 60) -> dict[str, float]:
    """Metrics of the last of so many plain strides from rest, with the step that the solver takes."""
    pair = two_strides(described)
    steps = strides * steps_of_stride(described) + AFTER
    plain = build(pair.model_copy(update={"duration": steps * pair.timestep}))
    rollout = simulate_together([plain], [schedule.controls(plain)])[0]
    assert rollout.failure is None
    return numbers(plain, rollout)


def test_first_strides_near_the_settled_one_alike_in_blocks_of_less_than_a_stride(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = run(scenario()).metrics
    monkeypatch.setattr("afo_sim.simulation.simulate.BLOCK", 300)
    assert dict(run(scenario()).metrics) == dict(whole)


QUICK: dict[str, dict[str, object]] = {
    "shipped": {},
    "little pressure, heavy": {"supply.pressure": "2.1 bar", "patient.body_mass": "89 kg"},
    "much pressure, late": {"supply.pressure": "4.9 bar", "phases.dorsiflexor.inlet": [[0.58, 0.95]]},
    "spastic": {"patient": "spastic"},
    "contracture": {"patient": "contracture", "timestep": "3 ms"},
}


@pytest.mark.parametrize("name", QUICK)
def test_two_thousand_steps_find_the_stride_that_ten_plain_strides_repeat(name: str) -> None:
    built, settled = solved(scenario(timestep="2 ms").set(QUICK[name]))
    assert settled.found and settled.steps <= 2000
    n, rows, ankle = steps_of_stride(built.scenario), settled.rollout.rows, built.index.ankle_qpos
    pair, steps = built.scenario, 10 * n + AFTER
    longer = build(pair.model_copy(update={"duration": steps * pair.timestep}))
    data = mujoco.MjData(built.model)
    data.qpos[:], data.qvel[:], data.act[:] = (rows[name][n] for name in ("qpos", "qvel", "act"))
    state = get_state(built.model, data)
    plain = simulate(longer, schedule.controls(longer), state=state).rows["qpos"][9 * n : 10 * n, ankle]
    assert np.degrees(np.abs(rows["qpos"][n : 2 * n, ankle] - plain).max()) <= 0.006


def assert_near(found: dict[str, float], expected: dict[str, float], clearance: float, share: float) -> None:
    """Equal to `clearance` [mm], and `share` of torque and air where there is an orthosis."""
    assert found["toe_clearance"] == pytest.approx(expected["toe_clearance"], abs=clearance)
    assert (TORQUE in found) == (TORQUE in expected)
    for name in (TORQUE, AIR_USED):
        if name in expected:
            assert found[name] == pytest.approx(expected[name], rel=share), name


@pytest.mark.slow
@pytest.mark.parametrize("step", ["1 ms", "2 ms"])
@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_case_is_what_sixty_strides_walk_to(name: str, step: str) -> None:
    described = scenario(name, timestep=step)
    built, settled = solved(described)
    assert settled.found and settled.strides <= 6
    assert_near(numbers(built, settled.rollout), walked(described), 0.05, 2e-3)


# Designs that 60 strides settle, whose air is seldom exchanged, or at once, or moved by two chambers.
DORSIFLEXOR = "orthosis.muscle.dorsiflexor"
ODD: dict[str, dict[str, object]] = {
    "both chambers filled": {
        "phases.plantarflexor.inlet": [[0.1, 0.3]],
        "phases.plantarflexor.outlet": [[0.35, 0.9]],
    },
    "both valves open at once": {
        "phases.dorsiflexor.inlet": [[0.4, 0.9]],
        "phases.dorsiflexor.outlet": [[0.1, 0.6]],
    },
    "never filled": {"phases.dorsiflexor.inlet": []},
    "always open to the supply": {"phases.dorsiflexor.inlet": [[0.0, 1.0]], "phases.dorsiflexor.outlet": []},
    "adiabatic": {"orthosis.chamber.dorsiflexor.wall_conductance": "0 W/K"},
    "a good conductor": {"orthosis.chamber.dorsiflexor.wall_conductance": "5 W/K"},
    "quick strides": {"gait.stride_time": "0.75 s"},
    "from amid the stride": {"gait.start_phase": 0.37},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
def test_an_odd_design_is_what_sixty_strides_walk_to(name: str) -> None:
    described = scenario(timestep="4 ms").set(ODD[name])
    built, settled = solved(described)
    assert settled.found
    # its air, where little flows, is that of a stride whose mass changes by up to 0.01 %
    found, expected = numbers(built, settled.rollout), walked(described)
    assert found["toe_clearance"] == pytest.approx(expected["toe_clearance"], abs=0.05)
    assert found[TORQUE] == pytest.approx(expected[TORQUE], rel=2e-3)
    held = 1.0  # l of free air, about what the chamber holds
    assert found[AIR_USED] == pytest.approx(expected[AIR_USED], rel=2e-3, abs=AIR * held)


STARVED: dict[str, dict[str, object]] = {
    "a leak for an inlet": {
        "orthosis.chamber.dorsiflexor.inlet.conductance": "0.000113 dm^3/(s*bar)",
        "orthosis.chamber.dorsiflexor.wall_conductance": "20 W/K",
        "supply.pressure": "3.576 bar",
    },
    "filled for 4 ms of a short stride": {
        "phases.dorsiflexor.inlet": [[0.553, 0.558]],
        "orthosis.chamber.dorsiflexor.wall_conductance": "20 W/K",
        "orthosis.muscle.dorsiflexor.link_length": "6.13 cm",
        "supply.pressure": "2.815 bar",
        "gait.stride_time": "0.7781 s",
    },
}


FRICTIONS: dict[str, dict[str, object]] = {
    friction: {
        f"orthosis.muscle.{group}.type.friction": friction for group in ("dorsiflexor", "plantarflexor")
    }
    for friction in ("tondu_lopez_2000_stribeck", "maxwell_slip")
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "sets", "clearance"),
    [
        *((name, sets, 0.2) for name in SHIPPED[:2] for sets in FRICTIONS.values()),
        *((SHORT, sets, 0.05) for sets in STARVED.values()),
    ],
)
def test_friction_that_remembers_and_little_air_are_what_sixty_strides_walk_to(
    name: str, sets: dict[str, object], clearance: float
) -> None:
    described = scenario(name, timestep="2 ms").set(sets)
    built, settled = solved(described)
    assert settled.found
    found, expected = numbers(built, settled.rollout), walked(described)
    assert found["toe_clearance"] == pytest.approx(expected["toe_clearance"], abs=clearance)


def test_a_sealed_chamber_keeps_the_air_that_it_begins_with() -> None:
    """Nothing brings its mass back; it holds ambient air, as it does when walked from rest."""
    described = scenario(timestep="4 ms").set(
        {"phases.dorsiflexor.inlet": [], "phases.dorsiflexor.outlet": []}
    )
    built, settled = solved(described)
    chamber = built.index.chambers["dorsiflexor"]
    mass = native.read_held(built.model, settled.rollout.rows["act"], chamber)[:, 0]
    assert settled.found and np.ptp(mass) == 0.0
    plain = simulate_together([built], [schedule.controls(built)])[0]
    begun = native.read_held(built.model, plain.rows["act"], chamber)[0, 0]
    assert mass[0] == pytest.approx(begun, rel=1e-3)


@pytest.mark.parametrize("friction", ["none", "maxwell_slip"])
def test_the_residuals_are_those_of_the_two_strides_that_are_returned(friction: str) -> None:
    """Friction with states has two strides that are compared, and else one is compared with itself."""
    described = scenario(timestep="4 ms").set({f"{DORSIFLEXOR}.type.friction": friction})
    built, settled = solved(described)
    n, rows = steps_of_stride(described), settled.rollout.rows
    assert len(rows["time"]) == len(settled.rollout.control) == 2 * n + AFTER
    air = [native.read_held(built.model, rows["act"], c) for c in built.index.chambers.values()]
    change = max(float(np.abs(np.log(held[2 * n] / held[n])).max()) for held in air)
    angle = rows["qpos"][:, built.index.ankle_qpos]
    apart = float(np.abs(angle[n + 1 : 2 * n + 1] - angle[1 : n + 1]).max())
    assert settled.air == pytest.approx(change, rel=1e-9)
    assert settled.angle == pytest.approx(apart, rel=1e-9)
    assert settled.found and change <= AIR and apart <= ANGLE
    # and so does the stride that begins at their end, as far as it is told
    again = np.abs(air[0][2 * n : 2 * n + AFTER] / air[0][n : n + AFTER] - 1.0).max()
    assert again <= 1.01 * AIR


def test_the_strides_begin_where_the_recorded_walk_does() -> None:
    """The shank's rows are those of the walk that the scenario of two strides lays out."""
    built, settled = solved(scenario(timestep="4 ms"))
    joints = [built.model.joint(name).qposadr[0] for name in ("shank_x", "shank_z", "shank_angle")]
    assert settled.rollout.rows["qpos"][:, joints] == pytest.approx(built.walk.pose[1:-1], abs=1e-7)


BATCH: tuple[dict[str, object], ...] = (
    {},
    {"supply.pressure": "2 bar"},
    {"load_moment": "1000 N*m"},  # goes through its stops
    {"patient": "healthy", "phases.dorsiflexor.inlet": [[0.6, 0.8]]},
    {"phases.dorsiflexor.inlet": []},
)


def test_a_case_is_to_the_bit_what_it_is_alone() -> None:
    """Searches of one batch end after unlike numbers of strides, or fail."""
    builts = [build(two_strides(scenario(timestep="4 ms").set(sets))) for sets in BATCH]
    controls = [schedule.controls(built) for built in builts]
    alone = [settle([b], [c])[0] for b, c in zip(builts, controls, strict=True)]
    assert len({each.strides for each in alone}) > 2
    for order in ((0, 1, 2, 3, 4), (4, 2, 0), (3, 0, 1)):
        together = settle([builts[k] for k in order], [controls[k] for k in order])
        for k, found in zip(order, together, strict=True):
            expected = alone[k]
            assert (found.strides, found.found) == (expected.strides, expected.found)
            assert str(found.rollout.failure) == str(expected.rollout.failure)
            for name, rows in expected.rollout.rows.items():
                assert rows.tobytes() == found.rollout.rows[name].tobytes(), name


def test_strides_of_as_many_steps_may_have_other_numbers_of_longer_steps() -> None:
    """1.0992 and 1.1008 s are 550 steps of about 2 ms, and 137 and 138 of about 8 ms."""
    times = [{"gait.stride_time": f"{time} s", "timestep": "2 ms"} for time in (1.0992, 1.1008)]
    builts = [build(two_strides(scenario().set(sets))) for sets in times]
    controls = [schedule.controls(built) for built in builts]
    together = settle(builts, controls)
    for built, control, found in zip(builts, controls, together, strict=True):
        (expected,) = settle([built], [control])
        assert found.found and (found.strides, found.steps) == (expected.strides, expected.steps)
        assert found.rollout.rows["qpos"].tobytes() == expected.rollout.rows["qpos"].tobytes()


def test_what_fails_while_it_is_sought_is_an_outcome() -> None:
    _, settled = solved(scenario(timestep="4 ms", load_moment="1000 N*m"))
    assert not settled.found and "stops" in str(settled.rollout.failure)
    failed = run(scenario(timestep="4 ms", load_moment="1000 N*m"))
    assert not failed.ok and "stops" in failed.status


def test_a_run_ends_with_two_settled_strides() -> None:
    """Rows at even times; phase and the shank's way go on over the seam, where the air has jumped."""
    recording = run(scenario(timestep="4 ms", duration="5 s"))
    n = steps_of_stride(scenario(timestep="4 ms"))
    settled = recording["gait/solved"]
    assert settled.sum() == 2 * n and set(np.diff(settled)) == {0.0, 1.0}
    assert np.diff(recording["time"]) == pytest.approx(recording["time"][1], rel=1e-9)
    way = recording["gait/stride"] + recording["gait/phase"]
    assert np.diff(way) == pytest.approx(1.0 / n, rel=1e-9)
    seam = len(settled) - 2 * n
    for name in ("ankle/position/x", "qpos/shank_x", "ground/position/x"):
        onward = np.diff(recording[name])
        assert onward[seam - 1] == pytest.approx(onward[seam + n - 1], abs=1e-6), name
    metrics, last = recording.metrics, recording.strides[max(recording.strides)]
    assert metrics["toe_clearance"] == last["toe_clearance"]
    assert metrics["settled_air_change"] <= 100.0 * AIR
    assert metrics["settled_angle_change"] <= np.degrees(ANGLE)
    assert metrics["strides_solved"] >= 2


@pytest.mark.parametrize(
    ("sets", "strides"),
    [
        ({"duration": "0.5 s"}, 3),
        ({"duration": "1.3 s", "record_rate": "125 Hz"}, 3),
        ({"duration": "2.5 s", "gait.start_phase": 0.37}, 2),
        ({"duration": "5 s", "gait.start_phase": 0.37, "record_rate": "125 Hz"}, 3),
        ({"duration": "5 s", "gait.start_phase": 1.0}, 4),
    ],
)
def test_a_run_of_any_length_and_rate_has_whole_strides(sets: dict[str, object], strides: int) -> None:
    recording = run(scenario(timestep="4 ms").set(sets))
    assert recording.ok and len(recording.strides) == strides
    assert np.ptp(np.diff(recording["time"])) < 1e-9
    assert np.ptp(np.diff(recording["gait/stride"] + recording["gait/phase"])) < 1e-9
    assert {len(values) for values in recording.columns.values()} == {len(recording["time"])}


def test_plain_walking_has_no_solved_rows() -> None:
    plain = run(scenario(timestep="4 ms", duration="3.7 s"), {"gait.settled": "walked"})
    assert "gait/solved" not in plain.columns and "strides_solved" not in plain.metrics
    assert not [warning for warning in plain.warnings if "not solved" in warning]


WALKED: dict[str, dict[str, object]] = {
    "variability": {"gait.variability": 0.03},
    "pace": {"gait.pace": [["1 s", 1.1]]},
}


@pytest.mark.parametrize("key", WALKED)
def test_strides_that_need_not_repeat_are_walked_with_a_warning(key: str) -> None:
    described = scenario(timestep="2 ms", duration="2 s").set(WALKED[key])
    assert key in why_walked(described)
    recording = run(described)
    assert [warning for warning in recording.warnings if "not solved for" in warning and key in warning]
    assert "gait/solved" not in recording.columns


def test_a_timer_that_fits_the_stride_is_solved_as_the_phases_are() -> None:
    """At a period of the stride, or half of it, times are phases."""
    stride = 1.2
    phases = scenario(timestep="4 ms").set({"gait.stride_time": f"{stride} s"})
    whole = {"period": f"{stride} s"}
    timer = {
        "dorsiflexor": {"inlet": [["0.6 s", "1.14 s"]], "outlet": [["0.18 s", "0.54 s"]]},
        "plantarflexor": {"outlet": [["0 s", f"{stride} s"]]},
    }
    sets = {"timestep": "4 ms", "gait.stride_time": f"{stride} s", "gait.settled": "solved"}
    described = load("scenario", "walk-dropfoot-afo-timer", sets).set({"timer": whole | timer})
    assert not why_walked(described)
    built, settled = solved(described)
    other, expected = solved(phases)
    # the phases of the shipped scenario, in seconds: 0.50 to 0.95, and 0.15 to 0.45
    assert settled.found and expected.found
    a, b = numbers(built, settled.rollout), numbers(other, expected.rollout)
    assert_near(a, b, 1e-6, 1e-6)
