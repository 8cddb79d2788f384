"""No figure cuts a word off, lays one on another or a legend on a curve; its file says what it shows."""

import dataclasses
import pathlib
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from devices import device
from figures import unreadable
from matplotlib.figure import Figure
from sweep_case import write_sweep

import afo_sim
from afo_sim import show
from afo_sim.common import assets
from afo_sim.gait import file as gait
from afo_sim.lab import fit_torque, paths, replay, statics
from afo_sim.legs import import_leg
from afo_sim.show import compared_figures, draw_leg, draw_size, in_words, paper_page, run_figure, style
from afo_sim.show import sweep_figures as sweeps
from afo_sim.show.patients_figure import draw_patients
from afo_sim.show.stand_figure import draw_replay
from afo_sim.show.walker_figure import draw_response
from afo_sim.simulation import Recording
from afo_sim.study import Candidate, Indices, Sizing, read
from afo_sim.study.findings import findings
from afo_sim.study.sizing.limits import read_requirements
from afo_sim.walker import populate, walk

Walks = dict[str, Recording]
LONG = {"torque_against_push_off_per_mass": "N*m/kg", "plantarflexion_lost_at_toe_off": "deg"}
LONG |= {"orthosis_peak_dorsiflexion_torque": "N*m"}
TRIALS: dict[str, dict[str, Any]] = {
    "isobaric": {"muscle": "dmsp_10", "compare": "characteristic"},
    "isotonic": {"muscle": "dmsp_20"},
    "isometric": {"muscle": "dmsp_20"},
    "auxotonic": {"muscle": "dmsp_20", "stiffness": ["5 N/mm", "20 N/mm"]},
    "sealed": {"muscle": "dmsp_20", "pressure": "4 bar"},
    "step": {"muscle": "s1_215mm", "load": "2 kg", "pressure": ["3 bar", "4 bar"]},
    "release": {"muscle": "s1_215mm", "load": "5 kg"},
}


def of_a_run(kind: str) -> Callable[[pathlib.Path, Walks], None]:
    return lambda folder, walks: run_figure.FIGURES[kind](walks["worn"], folder / "a.png")


def of_the_stand(test: str) -> Callable[[pathlib.Path, Walks], None]:
    def draw(folder: pathlib.Path, walks: Walks) -> None:
        options = dict(TRIALS[test])
        if "compare" in options:
            options["compare"] = assets.find("muscle", options["muscle"]).parent / "characteristic.csv"
        found = afo_sim.stand(test, **options)
        show.draw_trials(found.trials, found.compared, folder / "a.png")

    return draw


def of_a_paper(name: str, title: str) -> Callable[[pathlib.Path, Walks], None]:
    return lambda folder, walks: style.write_figure(folder / "a.png", *paper_page.FIGURES[name][title])


def short(folder: pathlib.Path, walks: Walks) -> None:
    run_figure.draw_in_short(walks["worn"], folder / "a.png")


def sitting(folder: pathlib.Path, walks: Walks) -> None:
    for draw in run_figure.FIGURES.values():
        if draw is not run_figure.FIGURES["clearance"]:
            draw(walks["sitting"], folder / "a.png")


def laws(folder: pathlib.Path, walks: Walks) -> None:
    compared_figures.draw(dict.fromkeys(("sarosi_2012", "b"), walks["sitting"]), folder / "a.png")


def legs(folder: pathlib.Path, walks: Walks) -> None:
    show.draw_both(afo_sim.both("seated", sets={"record_rate": "50 Hz"}), folder / "a.png")


def stride(folder: pathlib.Path, walks: Walks) -> None:
    for name in ("gatk_mean", "opensim_walk"):
        show.draw_gait(gait.read(assets.find_gait(name)), folder / "a.png")


def map_of_torque(folder: pathlib.Path, walks: Walks) -> None:
    show.draw(afo_sim.torque_map(), folder / "a")


def sizes(folder: pathlib.Path, walks: Walks) -> None:
    limits = read_requirements(["toe_clearance >= 10 mm", "toe_clearance_stride_1 >= 0 mm"], "")
    names = [limit.metric for limit in limits]
    values = [dict.fromkeys(names, 6.0 + k) for k in range(9)]
    tried = [Candidate(f"a_long_name_{k}", k, values=each) for k, each in enumerate(values)]
    draw_size(Sizing("valve", "walk", limits, tuple(tried), "air_per_stride"), folder / "a.png")


def curves_fitted(folder: pathlib.Path, walks: Walks) -> None:
    data = assets.find("muscle", "dmsp_20").parent / "characteristic.csv"
    show.write_fit_figure(afo_sim.fit(data), folder)


def log_fitted(folder: pathlib.Path, walks: Walks) -> None:
    run = walks["sitting"]
    log = {"time [s]": run["time"], "angle [rad]": run["ankle/angle"]}
    sets, noise = {"duration": "2 s"}, {"angle": "1 deg"}
    fit = afo_sim.fit(log, scenario="seated", sets=sets, noise=noise, hold_out=0)
    show.write_log_figure(fit, folder)


def torque_fitted(folder: pathlib.Path, walks: Walks) -> None:
    angle, bar = np.tile(np.linspace(-16.0, 12.0, 8), 3), np.repeat([2.0, 3.0, 4.0], 8)
    s1 = afo_sim.load("orthosis", "s1")
    torque, _ = statics(s1, paths(s1, np.radians(angle)), "dorsiflexor", 1e5 * bar, device(30e3, 3e-3))
    rows = [f"{a},{p},{m:.5f}" for a, p, m in zip(angle, bar, torque, strict=True)]
    text = "\n".join(["angle [deg],pressure [bar],torque [N*m]", *rows])
    (folder / "bench.csv").write_text(text, encoding="utf-8")
    show.write_torque_figure(fit_torque(folder / "bench.csv", "s1", hold_out="angle"), folder)


def replayed(folder: pathlib.Path, walks: Walks) -> None:
    time = np.linspace(0.0, 2.0, 201)
    log = {"time [s]": time, "pressure [bar]": 4.0 * (1.0 - np.abs(time - 1.0)), "force [N]": np.ones(201)}
    draw_replay(replay(log | {"muscle": "dmsp_10", "contraction": "0.05"}), folder / "a.png")


def swept(folder: pathlib.Path, walks: Walks) -> None:
    chance = np.random.default_rng(0)
    x = {name: (chance.uniform(0.4, 0.7, 40), "m") for name in ("link_length_of_the_dorsiflexor", "arm")}
    y = {name: (chance.normal(-9e3, 4e3, 40), unit) for name, unit in LONG.items()}
    results = read(write_sweep(folder / "sweep", "random", x, y))
    found = findings(results, dict.fromkeys(LONG, "lowest"))
    shares, ends = np.array([0.6, 0.2]), np.array([0.05, 0.1])
    indices = Indices(tuple(x), shares, ends, shares, ends, np.zeros((2, 2)), np.zeros((2, 2)), 8, 0)
    drawn = dataclasses.replace(found, indices=dict.fromkeys(LONG, indices))
    for name, size, fill in (*sweeps.drawings(drawn), *sweeps.fronts(results, found.objectives)):
        style.write_figure(folder / f"{name}.png", size, fill)


def leg(folder: pathlib.Path, walks: Walks) -> None:
    found = import_leg(assets.find("leg", "adult_75kg").parent / "leg.xml", folder / "leg")
    draw_leg(found.leg, "adult_75kg: right leg of leg.xml", folder / "a.png")


def responded(folder: pathlib.Path, walks: Walks) -> None:
    options: dict[str, Any] = {"duration": 4.0, "starts": 1}
    found = walk("walk-dropfoot-afo", **options)
    draw_response(found, folder / "a.png")
    show.draw_doses("supply.pressure", ["2 bar", "3 bar"], [show.doses_of(found)] * 2, folder / "b.png")
    draw_patients(
        populate("walk-dropfoot-afo", patients="drop-foot", spring=60.0, **options), folder / "c.png"
    )


FIGURES: dict[str, Callable[[pathlib.Path, Walks], None]] = {
    **{kind: of_a_run(kind) for kind in run_figure.FIGURES},
    **{f"stand {test}": of_the_stand(test) for test in TRIALS},
    **{
        f"{name} {title}": of_a_paper(name, title)
        for name, own in paper_page.FIGURES.items()
        for title in own
    },
}
FIGURES |= {
    made.__name__: made
    for made in (
        *(short, sitting, laws, legs, stride, map_of_torque, sizes, curves_fitted, log_fitted),
        *(torque_fitted, replayed, swept, leg, responded),
    )
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_legible_and_told_in_words(
    name: str, tmp_path: pathlib.Path, walks: Walks, drawn: list[Figure]
) -> None:
    FIGURES[name](tmp_path, walks)
    assert drawn
    for figure in drawn:
        assert not unreadable(figure)
        assert re.search(r"\d", in_words.described(figure)), "no number is told"


def test_every_module_that_writes_figures_is_drawn_here() -> None:
    """A new figure has a row in FIGURES; pages, gaits of trials and the report have tests of their own."""
    writes = re.compile(r"\b(?:new_figure|write_figure|write_pair)\(")
    own = pathlib.Path(show.__file__).parent
    found = {path.stem for path in own.glob("*.py") if writes.search(path.read_text(encoding="utf-8"))}
    drawn = {
        "run_figure",
        "compared_figures",
        "gait_figure",
        "torque_map_figure",
        "size_figure",
        "fit_figure",
    }
    drawn |= {"torque_bench", "stand_figure", "sweep_figures", "leg_picture", "walker_figure", "walker_doses"}
    drawn |= {"patients_figure", "paper_page", "search_figure", "size_figure"}
    assert found - {"style"} == drawn


def test_a_file_says_what_it_shows(tmp_path: pathlib.Path) -> None:
    def fill(figure: Figure) -> None:
        axis = figure.subplots()
        axis.plot([0.0, 1.0], [-2.0, 3.0], label="a & b")
        axis.set(xlabel="time [s]", ylabel="a label that is much longer than this small panel is high [mm]")

    for suffix in style.FORMATS:
        style.write_figure(tmp_path / f"a.{suffix}", (2.0, 1.5), fill)
    words = "a label that is much longer than this small panel is high [mm] over time [s]: a & b −2 to 3."
    assert in_words.written(tmp_path / "a.png").replace("\u00a0", " ") == words
    page = (tmp_path / "a.svg").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert '<svg role="img" aria-labelledby="figure-title figure-desc"' in page
    assert f'<desc id="figure-desc">{words.replace("&", "&amp;")}</desc>' in page
    assert in_words.image(tmp_path / "a.png").count("a &amp; b −2 to 3") == 1


def test_a_label_longer_than_its_panel_is_broken_and_a_unit_stays_with_its_word(
    tmp_path: pathlib.Path, drawn: list[Figure]
) -> None:
    with style.new_figure(tmp_path / "a.png", (2.4, 1.8)) as figure:
        figure.subplots().set_ylabel("a label that is much longer than this small panel is high [mm]")
    assert not unreadable(figure) and figure.axes[0].get_ylabel().endswith("high\u00a0[mm]")


def test_a_word_beyond_the_edge_and_a_legend_on_a_curve_are_found() -> None:
    """What the tests above ask: on a figure that is wrong."""
    figure = Figure(figsize=(2.0, 1.5))
    axis = figure.subplots()
    axis.plot([0.0, 1.0], [0.0, 1.0], label="curve")
    axis.legend(loc="upper right")
    axis.set_ylabel("a label that is much longer than this small panel is high [mm]")
    found = " ".join(unreadable(figure))
    assert "is beyond the edge" in found and "a legend lies on 'curve'" in found
