"""Names that users give are drawn letter by letter: a `$`, `_`, `^` or `\\` begins no mathematics."""

import dataclasses
import pathlib
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.text import Text
from sweep_case import write_sweep

import afo_sim
from afo_sim.common import assets
from afo_sim.gait import file as gait
from afo_sim.lab import Stand, Trial
from afo_sim.lab.stand import stand
from afo_sim.metrics import Metric, Need
from afo_sim.model import TorqueMap
from afo_sim.show import (
    RunView,
    compared_figures,
    draw_search,
    draw_trials,
    gait_figure,
    printed,
    report_figures,
    run_figure,
    sweep_figures,
    torque_map_figure,
    write_fit_figure,
    write_log_figure,
)
from afo_sim.show.numbers import readable
from afo_sim.show.style import plain
from afo_sim.simulation import Recording, TorqueMaps
from afo_sim.study import OBJECTIVE, Problem, read
from afo_sim.study.findings import effects_of
from afo_sim.study.parameter import Parameter, Range
from afo_sim.study.search.aim import LACKING, OUTSIDE, Aim, Limit, Objective

NAME = r"a$x_1$ ^b\c"


def assert_plain(figure: Figure, name: str = NAME) -> None:
    """No text is read as mathematics, and the name stands somewhere whole."""
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert not [text for text in texts if is_math_text(text)]
    assert any(name in text.replace(r"\$", "$") for text in texts)


@pytest.fixture(scope="module")
def short() -> Recording:
    """A short run whose scenario and joint have such names."""
    run = afo_sim.run("seated", {"duration": "0.2 s"})
    leg = run.described["leg"] | {"ankle": NAME, "directions": [NAME, "down"]}
    return dataclasses.replace(run, described=run.described | {"name": NAME, "description": NAME, "leg": leg})


def test_the_helper_keeps_every_letter_that_the_font_has() -> None:
    assert plain(NAME).replace(r"\$", "$") == NAME
    assert not is_math_text(plain(NAME))
    assert plain("κ → 5 ° · Ж") == "κ → 5 ° · Ж"
    assert plain("x" * 80, None) == "x" * 80


@pytest.mark.slow
@pytest.mark.parametrize("draw", [run_figure.FIGURES[name] for name in ("overview", "angle", "torque")])
def test_figure_of_a_run(
    draw: Callable[..., None], short: Recording, tmp_path: pathlib.Path, drawn: list[Figure]
) -> None:
    draw(short, tmp_path / "a.png")
    assert_plain(drawn[0])


@pytest.mark.slow
def test_figures_of_a_report(short: Recording) -> None:
    run = RunView(NAME, "black", short)
    for draw in (
        report_figures.draw_over_time,
        lambda figure, runs: report_figures.draw_pressures(figure, runs, "time"),
    ):
        figures = [Figure(layout="constrained") for _ in range(2)]
        draw(figures, [run, run])
        for figure in figures:
            assert_plain(figure)


@pytest.mark.slow
def test_figure_of_a_comparison(short: Recording, tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    compared_figures.draw({NAME: short, "b": short}, tmp_path / "a.png")
    assert_plain(drawn[0])


def named(tests: Stand) -> list[Trial]:
    """Trials of a muscle of that name."""
    (trial,) = tests.trials
    muscle = trial.plan.muscle.model_copy(update={"name": NAME})
    return [dataclasses.replace(trial, plan=dataclasses.replace(trial.plan, muscle=muscle))]


def test_figure_of_the_stand(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    data = assets.find("muscle", "dmsp_10").parent / "characteristic.csv"
    tests = stand("isobaric", "dmsp_10", compare=data, static=True)
    compared = [dataclasses.replace(tests.compared[0], name=NAME + "data")]
    draw_trials(named(tests), compared, tmp_path / "a.png")
    assert_plain(drawn[0], NAME)
    assert_plain(drawn[0], NAME + "data")


@pytest.mark.slow
def test_figure_of_a_gait(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    cycle = gait.read(assets.find_gait("gatk_stride2"))
    gait_figure.draw_gait(dataclasses.replace(cycle, source=NAME), tmp_path / "a.png")
    assert_plain(drawn[0])


def test_figure_of_a_torque_map(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    angles, pressures = np.radians([-5.0, 0.0, 5.0]), np.array([1e5, 2e5])
    torque = np.outer([3.0, 2.0, 1.0], [1.0, 2.0])
    found = TorqueMap(NAME, angles, pressures, torque, np.full((3, 2), 0.1))
    scenario = afo_sim.load("scenario", "seated")
    scenario = scenario.model_copy(update={"leg": scenario.leg.model_copy(update={"name": NAME})})
    need = Need("swing", "needed_swing_torque", "dorsiflexion", angles, np.array([1.0, 2.0, 3.0]), 3.0)
    maps = TorqueMaps(scenario, [found], [need], [(NAME, need, np.zeros(3))], [])
    torque_map_figure.draw(maps, tmp_path / "a")
    assert_plain(drawn[0], f"s1 on {NAME}: static torque; needed by 75 kg")
    assert_plain(drawn[0], f"{NAME} chamber alone")


def test_figures_of_a_sweep(tmp_path: pathlib.Path) -> None:
    x = np.linspace(0.0, 1.0, 30)
    folder = write_sweep(tmp_path, "random", {"p$q$": (x, "")}, {"m$n$": (x**2, "")})
    results = read(folder)
    figure = Figure(layout="constrained")
    sweep_figures.draw_distributions(figure, results, ["m$n$"])
    assert_plain(figure, "m$n$")
    figure = Figure(layout="constrained")
    sweep_figures.draw_effects(figure, results, {"m$n$": effects_of(results, "m$n$")})
    assert_plain(figure, "p$q$")


@pytest.mark.slow
def test_figure_of_a_search(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    limit = Limit("m$_n$", False, 1.0)
    aim = Aim(Objective("o$^p$", "lowest"), (limit,))
    parameters = (Parameter("_q$r$", ("supply.pressure",), "Pa", Range(1e5, 4e5, False, None, False)),)
    designs = np.arange(4)
    columns = {"generation": designs // 2, "start": 0 * designs, "design": designs}
    columns |= {"_q$r$": np.linspace(1e5, 4e5, 4), OUTSIDE: np.zeros(4), LACKING: 0 * designs}
    columns |= {OBJECTIVE: np.arange(4.0), "reason": np.full(4, "", dtype=object)}
    columns |= {f"{limit.name}_{part}": np.array([0.0, 0.0, 1.0, 2.0]) for part in ("level", "kept", "short")}
    draw_search(Problem(parameters, (), aim, 0), {"m$_n$": "mm", "o$^p$": "g"}, columns, tmp_path / "a.png")
    for name in ("m$ n$", "o$^p$", "q$r$"):
        assert_plain(drawn[0], name)


@pytest.mark.slow
def test_figure_of_a_fit(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    lines = ["pressure [bar],contraction [-],force [N]", "1,0,253", "1,.05,15", "2,0,500", "2,.1,110"]
    lines += ["3,0,755", "3,.15,130"]
    data = tmp_path / f"{NAME}.csv"
    data.write_text("# bore: 20 mm\n" + "\n".join(lines), encoding="utf-8")
    write_fit_figure(afo_sim.fit(data, law="tondu_lopez_2000", hold_out="none"), tmp_path)
    assert_plain(drawn[0])


@pytest.mark.slow
def test_figure_of_a_log(short: Recording, tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    log = {"time [s]": short["time"], "angle [rad]": short["ankle/angle"]}
    sets, noise = {"duration": "0.2 s"}, {"angle": "1 deg"}
    fit = afo_sim.fit(log, scenario="seated", sets=sets, noise=noise, hold_out=0)
    problem = fit.problem
    channel = dataclasses.replace(problem.log.channels[0], title=NAME)
    renamed = dataclasses.replace(problem.log, channels=(channel,))
    problem = dataclasses.replace(problem, log=renamed, noise={NAME: problem.noise["angle"]})
    write_log_figure(dataclasses.replace(fit, problem=problem), tmp_path)
    assert_plain(drawn[0])


# --- what is undefined is said, not drawn


def test_an_undefined_number_is_a_dash_with_its_reason() -> None:
    never = Metric(float("nan"), "s")
    assert readable("rise_time", never) == printed("rise_time", never) == "– (never rises)"
    still = Metric(3e-14, "deg")
    assert readable("range_of_motion", still) == printed("range_of_motion", still) == "– (does not move)"
    assert readable("something", Metric(float("inf"), "m")) == "– (undefined)"
    assert printed("rise_time", Metric(1.23456, "s")) == "1.235"
    assert printed("peak_pressure_front", Metric(1.455e-16, "bar")) == "0.00"
    assert readable("range_of_motion", Metric(12.34, "deg")) == "12.3"


def test_a_joint_that_does_not_move_says_so_on_a_scale_that_means_something(
    tmp_path: pathlib.Path, drawn: list[Figure]
) -> None:
    run = afo_sim.run("seated", {"duration": "0.02 s"})
    still = 0.1 + 1e-17 * np.arange(len(run["time"]))
    columns = run.columns | {"ankle/angle": still}
    run_figure.FIGURES["angle"](dataclasses.replace(run, columns=columns), tmp_path / "a.png")
    axis = drawn[0].axes[0]
    assert "does not move" in [text.get_text() for text in axis.texts]
    assert np.ptp(axis.get_ylim()) >= 0.1
