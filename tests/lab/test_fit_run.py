"""Dynamic fits: planted values come back, what the log does not tell is refused, the written files run."""

import dataclasses
import json
import pathlib
import shutil
from typing import Any

import numpy as np
import pytest
from command import call
from figures import leave_blank

import afo_sim
from afo_sim.common import InputError, assets
from afo_sim.description import load
from afo_sim.lab import FitRun, differences, fit_run
from afo_sim.lab.run_fit import Errors, doubts
from afo_sim.lab.run_problem import Channel, find_parameters, pose, run_at
from afo_sim.lab.run_report import remarks, write
from afo_sim.show import write_log_figure
from afo_sim.simulation import Recording

SHORT = {"duration": "8 s"}
FINE = {"timestep": "0.5 ms", "record_rate": "2 kHz"}  # of the run that a log is made of
CHAMBERS = ("dorsiflexor", "plantarflexor")
VALVES = {f"orthosis.chamber.{c}.inlet.conductance": "0.04 dm^3/(s*bar)" for c in CHAMBERS}
WALLS = {  # in the ratio that they have in the orthosis
    "orthosis.chamber.dorsiflexor.wall_conductance": "0.9 W/K",
    "orthosis.chamber.plantarflexor.wall_conductance": "0.594 W/K",
}
NOISE = {"angle": 0.1, "pressure dorsiflexor": 0.01}  # [deg], [bar]


def test_noise_of_a_channel_is_that_of_its_samples() -> None:
    """About a line at uneven times, 1 % of standard error; of rounding alone a step over √12."""
    random = np.random.default_rng(4)
    time = np.cumsum(random.uniform(0.5, 1.5, 20_000))
    for sigma in (0.3, 2.0):
        values = 5.0 - 0.7 * time + sigma * random.standard_normal(len(time))
        assert Channel("x", ("x",), "", 1.0, values).noise(time) == pytest.approx(sigma, rel=0.05)
    steps = 0.25 * np.round(4.0 * np.sin(1e-3 * time))
    assert Channel("x", ("x",), "", 1.0, steps).noise(time) == pytest.approx(0.25 / np.sqrt(12.0))


def write_log(
    file: pathlib.Path,
    run: Recording,
    *,
    span: tuple[float, float] = (0.0, 8.0),
    offset: float = 0.0,
    noise: float = 1.0,
    seed: int = 1,
    channels: tuple[str, ...] = tuple(NOISE),
) -> pathlib.Path:
    """A log of a run at 100 Hz, with the noise of a sensor upon it."""
    random = np.random.default_rng(seed)
    time = np.arange(*span, 0.01)
    read = {
        "angle": ("deg", np.degrees(run["ankle/angle"])),
        "pressure dorsiflexor": ("bar", run["chamber/dorsiflexor/pressure"] * 1e-5),
    }
    columns, titles = [time], ["time [s]"]
    for channel in channels:
        unit, values = read[channel]
        spread = noise * NOISE[channel]
        columns.append(np.interp(time - offset, run["time"], values) + random.normal(0.0, spread, len(time)))
        titles.append(f"{channel} [{unit}]")
    rows = [", ".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    file.write_text("\n".join([", ".join(titles), *rows]) + "\n", encoding="utf-8")
    return file


def fitted(file: pathlib.Path, *names: str, **options: Any) -> FitRun:
    return fit_run("seated", file, names, sets=SHORT | options.pop("sets", {}), **options)


@pytest.fixture(scope="module")
def planted(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A log of other valves and walls, from a run at half the step."""
    run = afo_sim.run("seated", SHORT | FINE | VALVES | WALLS)
    return write_log(tmp_path_factory.mktemp("planted") / "bench.csv", run, offset=0.1)


@pytest.fixture(scope="module")
def found(planted: pathlib.Path) -> FitRun:
    return fitted(planted, "inlet_conductance", "wall_conductance", "time_offset")


@pytest.mark.slow
def test_planted_values_come_back_inside_their_intervals(found: FitRun) -> None:
    truth = {"inlet_conductance": 4e-10, "wall_conductance": 0.9, "time_offset": 0.1}
    for name, value in truth.items():
        interval = found.interval[name]
        assert interval is not None
        assert interval[0] <= value <= interval[1]
        assert interval[1] - interval[0] < 0.2 * value
    assert found.converged
    assert found.identifiable
    assert found.misfit == pytest.approx(1.0, abs=0.05)  # in units of the noise that the log was given
    assert abs(found.memory) < 0.1


def test_noise_is_estimated_and_errors_fall_to_it(found: FitRun) -> None:
    units = {"angle": np.radians(1.0), "pressure dorsiflexor": 1e5}
    for channel, spread in NOISE.items():
        assert found.problem.noise[channel] == pytest.approx(spread * units[channel], rel=0.15)
        errors = found.errors[channel]
        assert errors.after == pytest.approx(spread * units[channel], rel=0.1)
        assert errors.before > 10.0 * errors.after
        assert errors.held_out == pytest.approx(spread * units[channel], rel=0.2)
        assert errors.before_held_out is not None
        assert errors.before_held_out > 1.5 * errors.after


def test_held_out_part_is_the_last_and_was_not_seen(found: FitRun) -> None:
    problem = found.problem
    assert problem.log.time[problem.seen][-1] == pytest.approx(0.7 * 8.0, abs=0.02)
    assert found.forecast is not None
    values, run = found.forecast
    assert values != found.values
    rest = differences(problem, values, run)["angle"][~problem.seen]
    assert found.errors["angle"].held_out == pytest.approx(np.sqrt(np.mean(rest**2)))


def test_chambers_keep_their_ratio_and_name_their_source(found: FitRun) -> None:
    scenario = found.scenario
    assert scenario.name == "seated-fitted"
    walls = [scenario.orthosis.chamber[c].wall_conductance for c in CHAMBERS]
    assert walls[1] / walls[0] == pytest.approx(0.33 / 0.5)
    inlet = scenario.orthosis.chamber["dorsiflexor"].inlet
    assert inlet.conductance == pytest.approx(found.values["inlet_conductance"])
    told = inlet.provenance["conductance"]
    assert told.kind == "fitted"
    assert "bench.csv" in told.source and "95 % interval" in told.source


def test_one_chamber_alone(planted: pathlib.Path) -> None:
    problem = pose("seated", planted, ["wall_conductance.plantarflexor"], sets=SHORT)
    keys = {key for parameter in problem.free for key in parameter.keys}
    assert keys == {"orthosis.chamber.plantarflexor.wall_conductance"}


@pytest.mark.slow
def test_fill_is_not_told_by_a_log_of_the_vent_alone(tmp_path: pathlib.Path) -> None:
    """What was full and had cooled long before 4 s vents alike, however fast it was filled."""
    fast = {"orthosis.chamber.dorsiflexor.inlet.conductance": "0.6 dm^3/(s*bar)"}
    run = afo_sim.run("seated", SHORT | FINE | fast)
    file = write_log(tmp_path / "vent.csv", run, span=(4.5, 8.0))
    names = ("inlet_conductance.dorsiflexor", "outlet_conductance")
    vent = fitted(file, *names, sets=fast, hold_out=0.0)
    assert vent.interval["inlet_conductance.dorsiflexor"] is None
    assert "fit as well" in vent.reason("inlet_conductance.dorsiflexor")
    interval = vent.interval["outlet_conductance"]
    assert interval is not None
    assert interval[0] <= 5.5e-10 <= interval[1]


@pytest.mark.slow
def test_damping_is_not_told_at_rest(tmp_path: pathlib.Path) -> None:
    """The foot rests on slack muscles for 0.4 s; the pressure, which tells how they swell, is not logged."""
    run = afo_sim.run("seated", SHORT | FINE)
    file = write_log(tmp_path / "rest.csv", run, span=(0.0, 0.4), channels=("angle",))
    rest = fitted(file, "damping", "tube_volume", hold_out=0.0)
    assert rest.interval["damping"] is None
    assert any(line.startswith("damping: not identifiable") for line in rest.verdict)


@pytest.mark.slow
def test_two_names_for_one_effect_are_not_told_apart(tmp_path: pathlib.Path) -> None:
    """The first fill of a muscle at rest: a valve twice as wide is a tube half as large."""
    quiet = {"orthosis.muscle.dorsiflexor.type.dead_volume": "0.01 ml"}
    tube = {f"orthosis.chamber.{c}.tube_volume": "0.5 l" for c in CHAMBERS}
    run = afo_sim.run("seated", SHORT | FINE | quiet | tube)
    file = write_log(
        tmp_path / "tube.csv", run, span=(0.05, 3.0), channels=("pressure dorsiflexor",), noise=0.1
    )
    both = fitted(file, "inlet_conductance", "tube_volume", sets=quiet | tube, hold_out=0.0)
    assert [both.interval[name] for name in ("inlet_conductance", "tube_volume")] == [None, None]
    assert "not identifiable one by one: correlation" in both.reason("tube_volume")
    assert "with inlet_conductance" in both.reason("tube_volume")


@pytest.mark.slow
def test_what_the_model_lacks_widens_the_intervals(planted: pathlib.Path, found: FitRun) -> None:
    """Without the clock's offset the errors hang together, and there is less to believe."""
    wrong = fitted(planted, "inlet_conductance", hold_out=0.0)
    right = found.interval["inlet_conductance"]
    wide = wrong.interval["inlet_conductance"]
    assert wrong.misfit > 2.0
    assert wrong.memory > 0.5
    assert right is not None
    assert wide is not None
    assert np.log(wide[1] / wide[0]) > 5.0 * np.log(right[1] / right[0])


@pytest.mark.slow
def test_friction_that_is_not_there_is_none(tmp_path: pathlib.Path) -> None:
    file = write_log(tmp_path / "free.csv", afo_sim.run("seated", SHORT | FINE))
    free = fitted(file, "friction", hold_out=0.0)
    assert free.values["friction"] < 0.01
    interval = free.interval["friction"]
    assert interval is None or (interval[0] < 0.001 and interval[1] < 0.02)


@pytest.mark.slow
def test_overlay_fits_nothing(planted: pathlib.Path, tmp_path: pathlib.Path) -> None:
    overlay = fitted(planted)
    assert overlay.values == {}
    errors = overlay.errors["angle"]
    assert errors.before == errors.after
    assert errors.held_out is None
    write(overlay, tmp_path)
    write_log_figure(overlay, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"fit_run.json", "fit_run.png", "fit_run.pdf"}


LEAK = 0.04  # of the inlet's conductance


@pytest.fixture(scope="module")
def leaking(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A log of a dorsiflexor that leaks while it is filled: its outlet opens for a step, over and over.

    The outlet answers within a step, and is open for LEAK × inlet/outlet of the time.
    """
    inlet, outlet, step = 4e-10, 5.5e-10, 5e-4
    period = round(outlet / (LEAK * inlet)) * step
    slow = 4.0 + 4e-3 - step  # the shipped outlet's dead time
    opened = [[f"{k * period!r} s", f"{k * period + step!r} s"] for k in range(int(4.0 / period))]
    sets = {
        "orthosis.chamber.dorsiflexor.outlet.opening_delay": "0 s",
        "orthosis.chamber.dorsiflexor.outlet.closing_delay": "0 s",
        "timer.dorsiflexor.outlet": [*opened, [f"{slow!r} s", "8 s"]],
    }
    run = afo_sim.run("seated", SHORT | FINE | VALVES | sets)
    return write_log(tmp_path_factory.mktemp("leaking") / "leak.csv", run)


@pytest.mark.slow
def test_a_leak_is_told_by_its_channel(leaking: pathlib.Path) -> None:
    found = fitted(leaking, "inlet_conductance", "outlet_conductance")
    (line,) = (w for w in found.warnings if w.startswith("pressure dorsiflexor"))
    assert "times its noise" in line
    assert "a leak" in line
    errors, noise = found.errors["pressure dorsiflexor"], found.problem.noise["pressure dorsiflexor"]
    assert errors.chi_squared == pytest.approx((errors.after / noise) ** 2)
    assert errors.chi_squared > 1.5
    assert any(line in remark for remark in remarks(found))


def test_a_run_that_explains_the_log_is_not_doubted(found: FitRun) -> None:
    assert not [w for w in found.warnings if "its noise" in w]
    for errors in found.errors.values():
        assert errors.chi_squared == pytest.approx(1.0, abs=0.2)
        assert errors.chi_squared_held_out == pytest.approx(1.0, abs=0.35)


def test_channels_are_judged_one_by_one() -> None:
    """One bad channel among good ones, and one that is bad only where it was held out."""
    random = np.random.default_rng(2)
    rest = np.arange(1000) >= 700
    noise = {"angle": 0.1, "pressure flexor": 2.0, "force flexor": 5.0}
    good = {title: spread * random.standard_normal(1000) for title, spread in noise.items()}
    last = good | {"force flexor": 2.0 * good["force flexor"]}
    unseen = last | {"pressure flexor": np.where(rest, 6.5, 1.0) * good["pressure flexor"]}
    columns = {
        "angle": "ankle/angle",
        "pressure flexor": "chamber/flexor/pressure",
        "force flexor": "muscle/flexor_1/force",
    }

    def errors(last: dict[str, Any], unseen: dict[str, Any]) -> dict[str, Errors]:
        return {t: Errors.of(noise[t], good[t], last[t], unseen[t], rest) for t in noise}

    pressure, force = doubts(errors(last, unseen), columns)
    assert pressure.startswith("pressure flexor: its errors are 6.")
    assert "held out" in pressure
    assert "after the fit" not in pressure
    assert "a leak" in pressure
    assert force.startswith("force flexor: its errors are 2")
    assert "the muscle's law" in force
    assert not list(doubts(errors(good, good), columns))


def test_fitted_scenario_runs_where_its_folder_was_moved(found: FitRun, tmp_path: pathlib.Path) -> None:
    """Shipped files by shipped name, the user's own beside the scenario: nothing absolute."""
    mine = tmp_path / "mine" / "leg.xml"
    mine.parent.mkdir()
    mine.write_text(pathlib.Path(found.problem.scenario["leg"]["file"]).read_text("utf-8"), encoding="utf-8")
    leg = found.problem.scenario["leg"] | {"file": str(mine)}
    problem = dataclasses.replace(found.problem, scenario=found.problem.scenario | {"leg": leg})
    write(dataclasses.replace(found, problem=problem), tmp_path / "before")
    text = (tmp_path / "before" / "scenario.toml").read_text(encoding="utf-8")
    assert str(tmp_path) not in text
    assert str(assets.folder("models")) not in text
    shutil.rmtree(mine.parent)
    (tmp_path / "before").rename(tmp_path / "after")
    run = afo_sim.run(tmp_path / "after" / "scenario.toml", {"duration": "0.5 s"})
    # the file leaves out what conversions leave behind the twelfth digit
    np.testing.assert_allclose(run["ankle/angle"], found.after["ankle/angle"][: len(run["time"])], atol=1e-9)


BAD = {
    "unknown parameter": (["dampng"], {}, "not a dynamic parameter.*did you mean 'damping'"),
    "unknown chamber": (["tube_volume.dorsiflexr"], {}, "no such chamber.*dorsiflexor'"),
    "part of what has none": (["friction.dorsiflexor"], {}, "no such part"),
    "twice": (["damping", "damping.dorsiflexor"], {}, "'damping' sets already"),
    "share": (["damping"], {"hold_out": 0.95}, "hold_out.*0 to 0.9"),
    "noise": (["damping"], {"noise": {"torque": "1 N*m"}}, "no such channel"),
    "beyond the search": (
        ["damping"],
        {"sets": {"orthosis.muscle.dorsiflexor.type.damping": "0.5 m^2*s"}},
        "beyond what is searched",
    ),
    "shorter than the log": ([], {"sets": {"duration": "2 s"}}, "outside the scenario"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_requests_are_one_message(case: str, planted: pathlib.Path) -> None:
    names, options, expected = BAD[case]
    sets = SHORT | options.pop("sets", {}) if "sets" in options else SHORT
    with pytest.raises(InputError, match=expected) as error:
        pose("seated", planted, names, sets=sets, **options)
    assert "\n" not in str(error.value)


def test_values_at_their_bounds_are_run(planted: pathlib.Path) -> None:
    problem = pose("seated", planted, ["tube_volume", "outlet_conductance"], sets=SHORT)
    assert run_at(problem, {"tube_volume": 1e-8, "outlet_conductance": 1e-7}).ok


def test_a_constant_channel_is_refused_unless_its_noise_is_told(
    planted: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    lines = planted.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    lines[first] += ",pressure plantarflexor [bar]"
    lines[first + 1 :] = [f"{line},0" for line in lines[first + 1 :]]
    file = tmp_path / "constant.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match="is constant"):
        pose("seated", file, ["inlet_conductance"], sets=SHORT)
    told = {"pressure plantarflexor": "0.01 bar"}
    assert pose("seated", file, ["inlet_conductance"], sets=SHORT, noise=told)


def test_a_searched_number_beyond_all_bounds_is_the_bound() -> None:
    parameter, *_ = find_parameters(["inlet_conductance"], load("scenario", "seated"))
    assert parameter.value(1e6) == parameter.upper
    assert parameter.value(-1e6) == parameter.lower


@pytest.mark.slow
def test_command_writes_table_figure_numbers_and_scenario(
    planted: pathlib.Path,
    tmp_path: pathlib.Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    leave_blank(monkeypatch)
    asked = ["--scenario", "seated", "--set", "duration=8 s", "--free", "inlet_conductance, time_offset"]
    out = tmp_path / "fit"
    noise = ["--noise", "angle=0.1 deg", "--hold-out", "0"]
    code, printed, complaint = call(capsys, "fit", str(planted), *asked, *noise, "--out", str(out))
    assert code == 0, complaint
    names = {"fit_run.json", "fit_run.png", "fit_run.pdf", "scenario.toml"}
    assert {path.name for path in out.iterdir()} == names
    for expected in ("inlet_conductance", "dm^3/(s*bar)", "ms", "0.055", "angle"):
        assert expected in printed
    told = json.loads((out / "fit_run.json").read_text())
    low, high = told["parameters"]["time_offset"]["interval_95"]
    assert low < told["parameters"]["time_offset"]["value"] < high
    assert told["channels"]["angle"]["noise"] == pytest.approx(np.radians(0.1))
    assert "time_offset = " in (out / "scenario.toml").read_text()
    code, _, complaint = call(
        capsys, "run", out / "scenario.toml", "--set", "duration=1 s", "--no-rrd", "--out", tmp_path / "r"
    )
    assert code == 0, complaint


@pytest.mark.parametrize(
    "arguments",
    [
        ("README.md", "--scenario", "seated"),
        ("{log}", "--scenario", "seated", "--free", "dampng"),
        ("{log}", "--scenario", "seated", "--noise", "angle=1"),
    ],
)
def test_command_refuses_with_exit_2_and_writes_nothing(
    arguments: tuple[str, ...],
    planted: pathlib.Path,
    tmp_path: pathlib.Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    filled = [argument.format(log=planted) for argument in arguments]
    code, _, complaint = call(capsys, "fit", *filled, "--out", str(tmp_path / "x"))
    assert code == 2
    assert complaint.startswith("afo-sim: ")
    assert complaint.strip().count("\n") == 0
    assert not (tmp_path / "x").exists()
