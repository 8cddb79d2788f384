"""The main job: what a run shows, and what it does when it fails."""

import numpy as np
import pytest

import afo_sim
from afo_sim.common import CallbackError, InputError
from afo_sim.description import load
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.native import slots
from afo_sim.simulation import Recording, make_recording
from afo_sim.simulation.simulate import simulate


def test_seated_foot_rises_and_returns_twice(seated: Recording) -> None:
    angle, time = np.degrees(seated["ankle/angle"]), seated["time"]
    assert seated.ok
    assert len(time) == 8000
    for start in (0.0, 8.0):
        cycle = angle[(time >= start) & (time < start + 8.0)]
        rest, top = cycle[0], cycle.max()
        assert 10.0 < top - rest < 45.0
        assert abs(cycle[-1] - rest) < 0.5
        assert cycle[1950] > rest + 0.95 * (top - rest)
    assert -50.0 < angle.min() < angle.max() < 30.0
    assert 0.15 < seated.metrics["air_per_cycle_dorsiflexor"].value / 3.0 < 0.4


def test_what_holds_the_foot_up_is_in_balance(seated: Recording) -> None:
    """Just before the valves turn: three muscles hold weight and tissue, and the cuff of 4 kN/m gives way."""
    row = 1999
    at = {name: values[row] for name, values in seated.columns.items()}
    pulls = [at[f"muscle/dorsiflexor_{k}/force"] for k in (1, 2, 3)]
    held = at["ankle/moment/gravity"] + at["ankle/moment/passive"]
    assert held < seated["ankle/moment/gravity"].max() < 0.0
    assert sum(pulls) * at["muscle/dorsiflexor_1/moment_arm"] == pytest.approx(-held, rel=0.01)
    assert at["cuff/shank/force"] == pytest.approx(sum(pulls), rel=1e-9)
    assert at["cuff/shank/displacement"] == pytest.approx(sum(pulls) / 4e3, rel=1e-9)
    assert at["cuff/foot/displacement"] == pytest.approx(sum(pulls) / 50e3, rel=1e-9)


def test_it_starts_at_rest(seated: Recording) -> None:
    assert seated["ankle/velocity"][0] == 0.0
    assert abs(seated["ankle/acceleration"][0]) < 1e-9
    assert seated["chamber/dorsiflexor/pressure"][0] == 0.0


def test_antagonist_pulls_below_rest(seated: Recording, antagonist: Recording) -> None:
    rest = np.degrees(seated["ankle/angle"][0])
    assert antagonist.metrics["peak_plantarflexion_angle"].value < rest - 1.0
    last = {name: values[-1] for name, values in antagonist.columns.items()}
    pulls = last["muscle/plantarflexor_1/force"] + last["muscle/plantarflexor_2/force"]
    lacking = last["ankle/moment/gravity"] + last["ankle/moment/passive"]  # of a foot below its rest
    assert lacking > 0.1
    assert pulls * last["muscle/plantarflexor_1/moment_arm"] == pytest.approx(-lacking, rel=0.01)
    assert antagonist.metrics["peak_plantarflexion_torque"].value >= lacking


def test_metrics_are_of_the_columns(seated: Recording) -> None:
    angle = np.degrees(seated["ankle/angle"])
    assert seated.metrics["range_of_motion"].value == np.ptp(angle)
    first = angle[:4000]
    height = first.max() - first[0]
    t10, t90 = (np.argmax(first >= first[0] + share * height) * 2e-3 for share in (0.1, 0.9))
    assert seated.metrics["rise_time"].value == pytest.approx(t90 - t10, abs=2e-3)
    inflow = np.maximum(seated["valve/dorsiflexor_inlet/mass_flow"], 0.0)
    assert seated.metrics["air_per_cycle"].value == pytest.approx(inflow.sum() * 2e-3 * 1e3 / 2.0, rel=1e-12)


@pytest.mark.parametrize("supply", ["2 bar", "3 bar", "4 bar", "5 bar"])
def test_supplies_run_clean(supply: str) -> None:
    run = afo_sim.run("seated", {"supply.pressure": supply, "duration": "8 s"})
    assert run.ok
    assert all(np.isfinite(values).all() for values in run.columns.values())
    assert not any("stop" in warning for warning in run.warnings)


def test_leaving_a_limit_is_said() -> None:
    run = afo_sim.run("seated", {"supply.pressure": "5 bar", "duration": "8 s"})
    assert any("dorsiflexor_1: gauge pressure reaches 4.9" in w and "4.2 bar" in w for w in run.warnings)
    quiet = afo_sim.run("seated", {"duration": "1 s"})
    assert quiet.warnings == tuple(w for w in quiet.warnings if "extrapolated" in w)
    assert not afo_sim.run("seated", {"duration": "1 s", "shank.knee_angle": "50 deg"}).warnings


def test_valve_answers_after_its_delay(seated: Recording) -> None:
    coil, opening = (seated[f"valve/dorsiflexor_inlet/{x}"] for x in ("coil", "opening"))
    assert coil[0] == 1.0
    assert opening[:3].tolist() == [0.0, 0.0, 1.0]  # 4 ms of a row every 2 ms
    off = int(np.argmax(coil == 0.0))
    assert off == 2000
    assert opening[off : off + 3].tolist() == [1.0, 1.0, 0.0]


def test_record_rate_thins_rows_not_metrics(seated: Recording) -> None:
    thin = afo_sim.run("seated", {"record_rate": "100 Hz"})
    assert np.array_equal(thin["ankle/angle"], seated["ankle/angle"][::5])
    assert thin.metrics == seated.metrics


def test_resolved_scenario_is_the_same_run(seated: Recording) -> None:
    again = afo_sim.run(seated.scenario)
    assert all(np.array_equal(again[name], seated[name]) for name in seated.columns)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["native", "python"])
def test_failed_run_keeps_its_rows_and_says_why(mode: str) -> None:
    """The supply's pressure is lost from the inputs at 1.5 s."""
    built = build(load("scenario", "seated", {"duration": "3 s", "callback": mode}))
    control = schedule.controls(built)
    control[750:, built.index.chambers["dorsiflexor"]] = np.nan
    run = make_recording(built, simulate(built, control))
    sound = afo_sim.run("seated", {"duration": "3 s"})
    assert not run.ok
    assert "simulation 0" in run.status
    n = len(run["time"])
    assert 750 <= n <= 752
    assert np.array_equal(run["ankle/angle"][:750], sound["ankle/angle"][:750]) or mode == "python"
    assert np.isfinite(run["ankle/angle"]).all()


@pytest.mark.parametrize("mode", ["native", "python"])
def test_law_that_is_not_a_number_is_a_failure_of_a_named_muscle(mode: str) -> None:
    built = build(load("scenario", "seated", {"duration": "1 s", "callback": mode}))
    muscle = built.index.muscles["plantarflexor_1"]  # alike muscles are solved as their first
    built.model.actuator_user[muscle, slots.MUSCLE_ROW.coefficients] = np.nan
    run = make_recording(built, simulate(built, schedule.controls(built)))
    assert "the force is not a number in 'plantarflexor_1'" in run.status
    assert len(run["time"]) == 0


def test_run_takes_a_dict_and_checks_sets_on_a_finished_scenario() -> None:
    description = load("scenario", "seated", {"duration": "2 ms"})
    assert afo_sim.run(description.resolved()).ok
    assert len(afo_sim.run(description, {"duration": "6 ms"})["time"]) == 3
    with pytest.raises(InputError, match="out of range"):
        afo_sim.run(description, {"duration": "-2 s"})


def test_air_is_counted_of_whole_cycles() -> None:
    """After 12.1 s a second cycle has begun, and its filling has ended: it does not count."""
    part, whole = (
        afo_sim.run("seated", {"duration": f"{seconds} s"}).metrics["air_per_cycle"]
        for seconds in (12.1, 8.0)
    )
    assert part.value == pytest.approx(whole.value, rel=1e-9)


@pytest.mark.parametrize("kind", ["passive", "chambers", "valves", "muscles"])
def test_actuator_that_lost_its_parameters_does_not_run(kind: str) -> None:
    built = build(load("scenario", "seated", {"duration": "1 s"}))
    ids = getattr(built.index, kind)
    built.model.actuator_user[ids if isinstance(ids, int) else next(iter(ids.values())), 0] = np.nan
    with pytest.raises(CallbackError, match="lost its parameters"):
        simulate(built, schedule.controls(built))


def test_an_ankle_through_its_stops_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Finite nonsense is nonsense too: MuJoCo warns only beyond 1e10."""
    monkeypatch.setattr("afo_sim.simulation.simulate.PLAY", -0.4)  # as if a stop had let the ankle pass
    run = afo_sim.run("seated", {"duration": "4 s"})
    assert not run.ok
    assert "moved beyond its stops" in run.status
    assert 0 < len(run["time"]) < 2000


@pytest.mark.slow
def test_friction_that_falls_with_speed_is_followed_or_refused() -> None:
    """A true Stribeck curve is damping of the wrong sign; integrated implicitly it would blow up."""
    muscle = "orthosis.muscle.dorsiflexor.type"
    table = {
        "static_coefficient": 0.04,
        "kinetic_coefficient": 0.015,
        "stribeck_velocity": "0.15 m/s",
        "creep_velocity": "1e-5 m/s",
    }
    law = "tondu_lopez_2000_stribeck"
    sets = {f"{muscle}.friction": law, f"{muscle}.frictions.{law}": table, "duration": "8 s"}
    peaks = []
    for step in ("1 ms", "0.1 ms"):
        run = afo_sim.run("seated", sets | {"timestep": step})
        assert run.ok
        peaks.append(np.degrees(run["ankle/angle"].max()))
    assert peaks[0] == pytest.approx(peaks[1], abs=0.01)
    steep = {f"{muscle}.frictions.{law}": table | {"stribeck_velocity": "1 cm/s"}}
    with pytest.raises(InputError, match=r"falls too fast with speed.*at most"):
        build(load("scenario", "seated", sets | steep))
