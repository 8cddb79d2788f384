"""Pressure drives in whole runs: what is recorded closes, repeats, and follows."""

import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError
from afo_sim.control import Observation
from afo_sim.description import load
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.show import panels
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recipe, Recording, case_of, fixed, roll_out

DRIVES: dict[str, dict[str, Any]] = {
    "bang_bang": {"kind": "bang_bang", "dead_band": "50 mbar", "least_on": "8 ms"},
    "pwm": {"kind": "pwm", "integral_time": "0.5 s", "least_on": "5 ms", "least_off": "5 ms"},
    "regulator": {"kind": "regulator", "integral_time": "0.5 s"},
}


def steps(seen: Observation) -> dict[str, Any]:
    """Up, down, and back to the valves' own inputs."""
    if seen.time < 1.2:
        return {"dorsiflexor": 2e5}
    return {"dorsiflexor": 1.2e5} if seen.time < 2.4 else {"dorsiflexor": "shut"}


def driven(kind: str, controller: Callable[[Any], Any] = steps, **sets: Any) -> Recording:
    table = {"duration": "3 s", "drive.dorsiflexor": DRIVES[kind]} | sets
    return afo_sim.run("seated-antagonist", table, controller=controller, rate=50)


@pytest.fixture(scope="module", params=list(DRIVES))
def followed(request: pytest.FixtureRequest) -> Recording:
    return driven(request.param)


def test_a_target_is_followed(followed: Recording) -> None:
    pressure, time = followed["chamber/dorsiflexor/pressure"], followed["time"]
    assert followed.ok
    assert pressure[(time > 1.0) & (time < 1.2)].mean() == pytest.approx(2e5, rel=0.05)
    assert pressure[(time > 2.2) & (time < 2.4)].mean() < 1.5e5  # it vents slowly


def test_a_drive_behind_s3s_regulator_follows_and_pays_its_leakage() -> None:
    """S3 prints at most 1.5 Nl/min: 0.0323 g/s at 1.293 kg/m³; the chambers take what they took."""
    behind = {"supply.regulator": "pre_u2", "supply.line_pressure": "8 bar"}
    run, plain = (driven("regulator", **sets) for sets in (behind, {}))
    time, pressure = run["time"], run["chamber/dorsiflexor/pressure"]
    assert pressure[(time > 1.0) & (time < 1.2)].mean() == pytest.approx(2e5, rel=0.05)
    taken, bare = (one.metrics["air_per_cycle"].value for one in (run, plain))
    assert taken - bare == pytest.approx(1.5 / 60.0 * 1.293 * 3.0, rel=0.02)
    with pytest.raises(InputError, match="1 bar to 6 bar"):
        driven("regulator", **behind, **{"supply.pressure": "0.8 bar"})


def test_columns_tell_target_and_given_coils(followed: Recording) -> None:
    time, target = followed["time"], followed["chamber/dorsiflexor/target"]
    assert np.all(target[time < 1.199] == 2e5) and np.all(target[(time > 1.201) & (time < 2.399)] == 1.2e5)
    assert np.isnan(target[time > 2.401]).all()
    assert "chamber/plantarflexor/target" not in followed.columns
    inlet, outlet = (followed[f"valve/dorsiflexor_{side}/coil"] for side in ("inlet", "outlet"))
    assert inlet.max() > 0.9 and outlet.max() > 0.9
    assert inlet[time > 2.401].max() == outlet[time > 2.401].max() == 0.0
    assert np.all(inlet * outlet == 0.0)  # never both


def test_energy_and_air_close(followed: Recording) -> None:
    """What comes in less what goes out is what the chamber holds more."""
    assert abs(followed.metrics["energy_error"].value) < 1e-3
    rows = {
        name: followed[f"chamber/dorsiflexor/{name}"] for name in ("mass", "mass_flow_in", "mass_flow_out")
    }
    step = followed["time"][1]
    moved = step * np.cumsum(rows["mass_flow_in"] - rows["mass_flow_out"])[:-1]
    assert rows["mass"][1:] - rows["mass"][0] == pytest.approx(moved, abs=1e-9 * rows["mass"].max())
    taken = step * np.maximum(followed["valve/dorsiflexor_inlet/mass_flow"], 0.0).sum() * 1e3
    assert followed.metrics["air_per_cycle_dorsiflexor"].value == pytest.approx(taken, rel=1e-9)


def test_switchings_are_the_rises_of_the_coil(followed: Recording) -> None:
    """Seated rows are every step; pulses and gaps of 5 ms and more cannot hide between two."""
    minutes = followed["time"][1] * len(followed["time"]) / 60.0
    for side in ("inlet", "outlet"):
        on = followed[f"valve/dorsiflexor_{side}/coil"] > 0.0
        if followed.scenario["drive"]["dorsiflexor"]["kind"] == "regulator":  # it shuts as its valve does
            for k, opening in enumerate(followed[f"valve/dorsiflexor_{side}/opening"][1:], start=1):
                on[k] |= on[k - 1] and opening > 0.01
        rises = int(on[0]) + np.count_nonzero(on[1:] & ~on[:-1])
        counted = followed.metrics[f"switches_per_minute_dorsiflexor_{side}"].value * minutes
        assert counted == pytest.approx(rises, abs=1e-9)
        assert followed[f"valve/dorsiflexor_{side}/switches"][-1] == rises >= 1


def test_a_recording_with_drives_is_read_back(followed: Recording, tmp_path: pathlib.Path) -> None:
    followed.save(tmp_path / "run")
    again = afo_sim.read_recording(tmp_path / "run")
    for name, values in followed.columns.items():
        assert np.array_equal(again[name], values, equal_nan=True), name
    assert again.model().nu == followed.model().nu


def test_the_pressure_panel_shows_what_was_asked_for(followed: Recording) -> None:
    from matplotlib.figure import Figure

    axis = Figure().subplots()
    panels.pressures(axis, [alone(followed)])
    lines = {str(line.get_label()): np.asarray(line.get_ydata()) for line in axis.get_lines()}
    asked = 1e-5 * followed["chamber/dorsiflexor/target"]
    assert np.array_equal(lines["dorsiflexor, asked for"], asked, equal_nan=True)


@pytest.mark.parametrize(("asked", "words"), [(2.0, "was bar meant?"), (4.5e5, "above the supply's 4 bar")])
def test_a_pressure_that_can_hardly_be_meant_is_warned_of(asked: float, words: str) -> None:
    def told(pressure: float) -> list[str]:
        run = driven("pwm", lambda seen: {"dorsiflexor": pressure}, duration="0.1 s")
        return [text for text in run.warnings if text.startswith("drive of chamber")]

    assert [words in text for text in told(asked)] == [True]
    assert told(0.0) == told(2e5) == []


@pytest.mark.parametrize("kind", DRIVES)
def test_a_halved_step_changes_little_and_a_quarter_less(kind: str) -> None:
    """Of the pressure in the rise, where no kind switches yet, and of its mean once it is there."""

    def seen(step: str) -> np.ndarray:
        run = driven(kind, duration="1 s", timestep=step)
        time, pressure = run["time"], run["chamber/dorsiflexor/pressure"]
        means = [pressure[(time >= a) & (time < a + 0.1)].mean() for a in (0.1, 0.2, 0.9)]
        return np.array(means)

    coarse, middle, fine = seen("2 ms"), seen("1 ms"), seen("0.5 ms")
    assert np.abs(middle - fine).max() < 2e3
    assert np.abs(middle - fine)[:2].max() < 0.7 * np.abs(coarse - middle)[:2].max() + 50.0


def test_a_drive_that_nothing_asks_is_said_to_change_nothing() -> None:
    sets = {"duration": "0.1 s", "drive.dorsiflexor": DRIVES["pwm"]}
    timed = afo_sim.run("seated-antagonist", sets)
    assert sum("never gets a pressure command" in text for text in timed.warnings) == 1
    asked = driven("pwm", lambda seen: {"dorsiflexor": 0.0}, duration="0.1 s")
    assert not any("never gets a" in text for text in asked.warnings)


@pytest.mark.parametrize("command", ["hold", "2 baar"])
def test_a_text_that_is_no_pressure_is_refused_by_its_chamber(command: str) -> None:
    with pytest.raises(InputError) as refused:
        driven("pwm", lambda seen: {"dorsiflexor": command}, duration="0.1 s")
    assert (refused.value.field, refused.value.value) == ("dorsiflexor", command)
    assert "bar" in str(refused.value)  # as a pressure is written


def test_how_often_a_proportional_valve_opens_is_not_how_many_steps_there_are() -> None:
    """At the edge of the dead band its coil comes and goes with the steps; the valve does not."""

    def opened(step: str) -> float:
        table = {"kind": "regulator", "full_at": "0.3 bar", "integral_time": "0.5 s", "dead_band": "20 mbar"}
        sets = {"duration": "2 s", "timestep": step, "drive.dorsiflexor": table}
        run = afo_sim.run("seated", sets, controller=lambda seen: {"dorsiflexor": 2e5}, rate=50)
        return float(run.metrics["switches_per_minute_dorsiflexor_inlet"].value) * 2.0 / 60.0

    coarse, fine = opened("1 ms"), opened("0.25 ms")
    assert coarse > 0.5
    assert fine == pytest.approx(coarse)


def test_many_are_as_one() -> None:
    """To the bit, with other targets and other drives side by side."""
    targets = (0.7e5, 1.4e5, 2.2e5, -1.0)
    described = [
        load("scenario", "seated-antagonist", {"duration": "0.6 s", "drive.dorsiflexor": DRIVES[kind]})
        for kind in ("pwm", "bang_bang", "regulator", "pwm")
    ]
    cases = []
    for scenario, target in zip(described, targets, strict=True):
        built = build(scenario)
        inputs = schedule.controls(built)
        inputs[:, built.index.drives["dorsiflexor"]] = target
        cases.append(case_of(built, fixed(inputs), inputs[0]))
    n_step = described[0].n_step
    together = roll_out(cases, n_step, Recipe(threads=2))
    for case, found in zip(cases, together, strict=True):
        alone = roll_out([case], n_step)[0]
        for name in ("qpos", "act", "userdata"):
            assert np.array_equal(found.rows[name], alone.rows[name]), name


def test_compiled_and_plain_runs_agree() -> None:
    def short(seen: Observation) -> dict[str, Any]:
        return {"dorsiflexor": 1.5e5}

    native, plain = (driven("pwm", short, duration="0.2 s", callback=mode) for mode in ("native", "python"))
    for name in ("ankle/angle", "chamber/dorsiflexor/pressure", "valve/dorsiflexor_inlet/coil"):
        assert native[name] == pytest.approx(plain[name], rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_a_drive_that_is_off_changes_no_bit_of_a_walk() -> None:
    without = afo_sim.run("walk-dropfoot-afo-short")
    off = afo_sim.run("walk-dropfoot-afo-short", {"drive.dorsiflexor": DRIVES["pwm"]})
    assert all(np.array_equal(off[name], without[name]) for name in without.columns)
    assert off.metrics == without.metrics


@pytest.mark.slow
@pytest.mark.parametrize("kind", DRIVES)
def test_a_drive_lifts_the_foot_in_swing(kind: str) -> None:
    """2 bar in swing, none in stance: the foot comes up higher than without air."""

    def swing(seen: Observation) -> dict[str, Any]:
        return {"dorsiflexor": 2e5 if seen["gait/phase"] > 0.55 else 0.0}

    sets = {"duration": "6 s", "drive.dorsiflexor": DRIVES[kind]}
    run = afo_sim.run("walk-dropfoot-afo", sets, controller=swing, rate=100)
    bare = afo_sim.run("walk-dropfoot-afo", sets, controller=lambda seen: {"dorsiflexor": 0.0})
    assert run.ok and bare.ok
    assert run.metrics["toe_clearance"] > bare.metrics["toe_clearance"] + 15.0
    assert abs(run.metrics["energy_error"].value) < 0.1
    assert run.metrics["switches_per_stride_dorsiflexor_inlet"] >= 1.0
    assert run.metrics["peak_pressure_dorsiflexor"] < 2.3


def test_pulses_that_would_move_no_air_are_not_given() -> None:
    """The valve opens after 4 ms: a pulse of pwm is as long at least, unless it is told otherwise."""
    pwm = {"kind": "pwm", "full_at": "0.3 bar"}
    sets = {"duration": "2 s", "timestep": "0.5 ms", "record_rate": "2 kHz", "drive.dorsiflexor": pwm}
    shortest, ends = [], []
    for more in ({}, {"drive.dorsiflexor.least_on": "0 ms"}):
        run = afo_sim.run("seated", sets | more, controller=lambda seen: {"dorsiflexor": 1.5e5}, rate=100)
        coil = run["valve/dorsiflexor_inlet/coil"]
        begins = np.flatnonzero((coil[1:] > 0.0) & (coil[:-1] == 0.0)) + 1
        shortest.append(5e-4 * np.add.reduceat(coil, begins)[:-1].min())
        ends.append(run["chamber/dorsiflexor/pressure"][-400:].mean())
    assert shortest[0] >= 4e-3 - 1e-9 > shortest[1]
    assert ends[0] == pytest.approx(ends[1], abs=2e3)  # [Pa]: what is left out moved no air
