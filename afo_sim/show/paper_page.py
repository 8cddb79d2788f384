"""A paper's page, and its figures redrawn: ours on top of the printed points, where there are any."""

import functools
import pathlib
from collections.abc import Callable

import numpy as np

from afo_sim import lab
from afo_sim.common import GRAVITY, Foreign, Keywords, together, write_text
from afo_sim.description import Muscle, reader
from afo_sim.lab.stand import stand
from afo_sim.lab.validation_s1 import CM, MISPRINT, model, table
from afo_sim.physics import LAWS, contractions
from afo_sim.show import style as theme
from afo_sim.show.in_words import image
from afo_sim.show.report import rendered
from afo_sim.show.stand_figure import colour as shade
from afo_sim.show.style import Axes, Figure
from afo_sim.show.torque_map_figure import fill
from afo_sim.simulation import torque_map

_S1_OWN, _OURS = theme.RED, theme.BLUE
_ISOBARS = (2.0, 3.0, 4.0, 5.0, 6.0)  # [bar]
_ISOTONES = (50.0, 100.0, 200.0, 300.0)  # [N]
_ISOMETERS = (0.0, 0.05, 0.11, 0.2)  # contraction ratios that the maker's table holds
_S3_LAW, _S3_PRINTED = "takosoglu_2016_an", "takosoglu_2016"
_S2_LAWS = ("kerscher_2006", "maximum_force", "sarosi_2012", "polynomial")
S2_ARMS = {"arm": ("S2 figure 5", (-40.0, 40.0)), "arm-short": ("S2 figure 6", (-5.0, 35.0))}


def write_paper(paper: lab.Paper, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write paper.html, and each figure as PNG and PDF, into a folder: the files."""
    with together(folder) as scratch:
        figures = FIGURES[paper.name].items()
        files = [file for title, figure in figures for file in theme.write_pair(scratch / title, *figure)]
        images = [image(file) for file in files if file.suffix == ".png"]
        same = {"paper": paper, "kinds": lab.KINDS, "words": lab.OUTCOMES}
        write_text(scratch / "paper.html", rendered("paper.html.j2", figures=images, **same))
    return [folder / "paper.html", *(folder / file.name for file in files)]


def _device(figure: Figure) -> None:
    """S1's figures 6 to 8: force of its models and of the measured muscle over the 8 s, and the angle."""
    force, angle = figure.subplots(1, 2)
    group = "orthosis.muscle.dorsiflexor.type"
    geometric = {f"{group}.law": "chou_hannaford_1996", f"{group}.damping": "0 m^2*s"}
    drawn: tuple[tuple[str, str, dict[str, str]], ...] = (
        ("S1's geometric model, no damper", "seated-s1-simulated", geometric),
        ("S1's Hill model", "seated-s1-simulated", {}),
        ("the measured muscle", "seated", {}),
    )
    for k, (label, scenario, sets) in enumerate(drawn):
        run = lab.paper_values.recorded({"scenario": scenario, "set": sets})
        look: Keywords = {"color": theme.COLOURS[k], "ls": theme.RUN_STYLES[k], "label": label}
        cycle = run["time"] <= 8.0
        pulls = np.sum([run[f"muscle/dorsiflexor_{number}/force"] for number in (1, 2, 3)], axis=0)
        force.plot(run["time"][cycle], pulls[cycle], **look)
        angle.plot(run["time"][cycle], np.degrees(run["ankle/angle"][cycle]), **look)
    force.set(title="S1 figures 6, 7", xlabel="time [s]", ylabel="force of three muscles [N]")
    force.set_ylim(0.0, None)
    angle.set(title="S1 figure 8", xlabel="time [s]", ylabel="ankle angle [deg], dorsiflexion +")
    figure.legend(*angle.get_legend_handles_labels(), loc="outside lower center", ncols=3)


def _isobars(figure: Figure) -> None:
    """S2's figure 4, S0's 4.8: the maker's points, and the shipped law where it holds."""
    axis, data, muscle = figure.subplots(), lab.characteristic("dmsp_20"), reader.load("muscle", "dmsp_20")
    assert data.contraction is not None
    kappa, levels = np.linspace(0.0, 0.25, 120), np.unique(data.pressure)
    for pressure, colour in zip(levels, theme.on_scale(np.linspace(0.0, 1.0, len(levels))), strict=True):
        here = data.pressure == pressure
        pulls = lab.law_force(muscle, muscle.law, kappa, np.full(len(kappa), pressure))
        _pair(axis, 100.0 * kappa, pulls, "-", colour, f"{pressure * 1e-5:g} bar")
        axis.plot(100.0 * data.contraction[here], data.force[here], "o", ms=3.0, color=colour)
    axis.set(xlabel="contraction [%]", ylabel="force [N]", xlim=(-3.5, 25.5), ylim=(0.0, None))
    axis.set_title("20 mm muscle: the maker's table (points), law fitted here (lines)", loc="left")
    axis.legend(handles=theme.by_height(axis), loc="upper right")


def _arms(figure: Figure, scenarios: dict[str, tuple[str, tuple[float, float]]]) -> None:
    """S2's figures 5 and 6: the arm with each of the four laws, on the paper's axes; differences below."""
    axes = figure.subplots(2, 2, sharex=True)
    for column, (name, (title, axis_ends)) in zip(axes.T, scenarios.items(), strict=True):
        runs = lab.paper_values.compared(name, _S2_LAWS)
        first = runs["sarosi_2012"]["ankle/angle"]
        for k, (law, run) in enumerate(runs.items()):
            for axis, angle in zip(column, (run["ankle/angle"], run["ankle/angle"] - first), strict=True):
                look: Keywords = {"color": theme.COLOURS[k], "ls": theme.RUN_STYLES[k], "label": law}
                axis.plot(run["time"], np.degrees(angle), lw=1.0, **look)
        column[0].set(title=title, ylabel="arm's angle [deg]\nflexion +", xlim=(0.0, 11.0), ylim=axis_ends)
        column[1].set(xlabel="time [s]", ylabel="less that of\nsarosi_2012 [deg]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _static_load(figure: Figure) -> None:
    """S0's figures 4.3 to 4.6 by two stand-ins: F_ce with its line, contraction under loads, open loop."""
    for name, axes in zip(("reynolds_2003", "serres_2009"), figure.subplots(2, 3), strict=True):
        isobaric, isotonic, step = (stand(test, name).trials[0] for test in ("isobaric", "isotonic", "step"))
        found = lab.static_load(isobaric)
        line = np.array([found.pressure.min(), found.pressure.max()])
        label = f"{found.start:.1f} N + {found.slope * 1e3:.3f} N/kPa p"
        axes[0].plot(line * 1e-5, found.start + found.slope * line, color=theme.RED, label=label)
        look: Keywords = {"ms": 4, "color": theme.BLUE, "label": "stand"}
        axes[0].plot(found.pressure * 1e-5, found.contractile_force, "o", **look)
        axes[0].set(title=name, xlabel="gauge pressure [bar]", ylabel="contractile force\nF_ce [N]")
        axes[0].set_ylim(0.0, None)
        axes[0].legend(loc="lower right")
        for k, columns in enumerate(isotonic.curves):
            up, look = columns["branch"] == 0, {"color": shade(isotonic, k)}
            look["label"] = lab.set_point_text(isotonic, k)
            axes[1].plot(columns["pressure"][up] * 1e-5, 100.0 * columns["contraction"][up], **look)
        axes[1].set(title="under constant loads", xlabel="gauge pressure [bar]", ylabel="contraction [%]")
        axes[1].legend(handles=theme.by_height(axes[1]), **theme.BESIDE)
        for k, columns in enumerate(step.curves):
            tau = step.metrics[k]["fill_contraction_time_constant"].value
            text = f"{lab.set_point_text(step, k)}: τ = {tau:.2f} s"
            axes[2].plot(columns["time"], 100.0 * columns["contraction"], color=shade(step, k), label=text)
        title = f"open loop under {step.plan.load[0]:g} N"
        axes[2].set(title=title, xlabel="time [s]", ylabel="contraction [%]")
        axes[2].legend(handles=theme.by_height(axes[2]), **theme.BESIDE)


def _s1(figure: Figure, bench: int, first: int, masses: tuple[float, ...], shape: tuple[int, int]) -> None:
    """Change of length over pressure, one panel for each load, as S1's figures compare them."""
    axes = figure.subplots(*shape, sharex=True, sharey=True, squeeze=False)
    for number, (axis, mass) in enumerate(zip(axes.flat, masses, strict=True), first):
        _s1_panel(axis, bench, mass)
        axis.set_title(f"S1 figure {number}: {1000.0 * mass:g} g", loc="left")
    axes[0, 0].set(xlim=(1.4, 4.3), ylim=(0.0, 1.08 * axes[0, 0].get_ylim()[1]))
    for axis in axes[-1]:
        axis.set_xlabel("gauge pressure [bar]")
    for axis in axes[:, 0]:
        axis.set_ylabel("change of length [cm]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    length = CM * table(bench).facts["total_length"]
    figure.suptitle(f"Muscle of {length:g} cm between its ends", x=0.01, ha="left", fontsize=9.0)


def _s1_panel(axis: Axes, bench: int, mass: float) -> None:
    measured, own = table(bench), table(bench + 2)
    loads = {bench: (mass + measured.facts["hanger"]) * GRAVITY, bench + 2: mass * GRAVITY}
    pressure = np.linspace(1.5e5, 4.2e5, 100)
    looks: dict[int, Keywords] = {
        bench + 2: {"color": _S1_OWN, "ls": "--", "label": "S1's model as it is run here (37°, r0 5 mm)"},
        bench: {"color": _OURS, "label": "muscle fitted here to tables I and II"},
    }
    for number, look in looks.items():
        axis.plot(pressure * 1e-5, model(number, np.full(100, loads[number]), pressure), **look)
    hollow = {"marker": "s", "mfc": "white", "color": _S1_OWN, "label": "S1's simulation, printed"}
    full = {"marker": "o", "color": "black", "label": "S1's measurement, printed"}
    for number, data, look in ((bench + 2, own, hollow), (bench, measured, full)):
        here = np.isclose(data.force, loads[number])
        assert data.change is not None
        axis.plot(data.pressure[here] * 1e-5, CM * data.change[here], ls="", ms=4.5, **look)
    if bench == 2 and np.isclose(own.force[MISPRINT], loads[bench + 2]):
        assert own.change is not None
        look = {"ha": "right", "va": "center", "fontsize": 8.0, "color": _S1_OWN, "xytext": (-7.0, 0.0)}
        place = own.pressure[MISPRINT] * 1e-5, CM * own.change[MISPRINT]
        axis.annotate("misprint: 2.4 is implied", place, textcoords="offset points", **look)


def _s3(figure: Figure) -> None:
    """Isobaric, isotonic and isometric: the maker's points, S3's printed numbers, the law fitted here."""
    axes = figure.subplots(1, 3)
    data, _ = lab.select(lab.characteristic("dmsp_10"))
    muscle = reader.load("muscle", "dmsp_10")
    panels = ((_isobaric, "upper right"), (_isotonic, "upper left"), (_isometric, "upper left"))
    for axis, (panel, corner) in zip(axes, panels, strict=True):
        panel(axis, data, muscle)
        axis.set_ylim(bottom=0.0)
        axis.legend(handles=theme.by_height(axis), loc=corner)
    grey, told = {"color": "0.3"}, ", ".join(f"{key} = {x:g}" for key, x in _s3_printed().items())
    keys = [
        *axes[0].plot([], [], "o", ms=3.5, label="maker's 10 mm table", **grey),
        *axes[0].plot([], [], "o", ms=3.5, mfc="white", label="interpolated in it", **grey),
        *axes[0].plot([], [], "-", label=f"{_S3_LAW}, fitted here", **grey),
        *axes[0].plot([], [], "--", label=f"S3's {told}", **grey),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=4)
    title = "S3's characteristics of a 10 mm muscle; its own points are lost from its text, "
    figure.suptitle(f"{title}these are independent", x=0.01, ha="left", fontsize=9.0)


def _s3_printed() -> dict[str, float]:
    rows = (told for told in lab.paper_values.validated() if told["part"] == "s3" and "parameters" in told)
    return next(rows)["parameters"]


def _isobaric(axis: Axes, data: lab.Measured, muscle: Muscle) -> None:
    assert data.contraction is not None
    kappa = np.linspace(0.0, 0.25, 120)
    for bar, colour in zip(_ISOBARS, theme.on_scale(np.linspace(0.0, 1.0, len(_ISOBARS))), strict=True):
        pressure = np.full(len(kappa), bar * 1e5)
        _pair(
            axis, 100.0 * kappa, lab.law_force(muscle, _S3_LAW, kappa, pressure), "-", colour, f"{bar:g} bar"
        )
        printed = lab.law_force(muscle, _S3_PRINTED, kappa, pressure, _s3_printed())
        _pair(axis, 100.0 * kappa, printed, "--", colour)
        here = np.isclose(data.pressure, bar * 1e5)
        axis.plot(100.0 * data.contraction[here], data.force[here], "o", ms=3.0, color=colour)
    axis.set(title="isobaric F(κ)", xlabel="contraction [%]", ylabel="force [N]", xlim=(-0.5, 25.0))


def _isotonic(axis: Axes, data: lab.Measured, muscle: Muscle) -> None:
    assert data.contraction is not None
    pressure = np.linspace(1e5, 8e5, 120)
    fitted = LAWS[_S3_LAW].coefficients(muscle.braid, muscle.laws[_S3_LAW].parameters)
    printed = LAWS[_S3_PRINTED].coefficients(muscle.braid, _s3_printed())
    for force, colour in zip(_ISOTONES, theme.on_scale(np.linspace(0.0, 1.0, len(_ISOTONES))), strict=True):
        pull = np.full(len(pressure), force)
        for coefficients, style, label in ((fitted, "-", f"{force:g} N"), (printed, "--", "")):
            kappa = contractions(LAWS[_S3_LAW].native_id, coefficients, pull, pressure)
            _pair(axis, pressure * 1e-5, 100.0 * kappa, style, colour, label)
        points = []
        for level in np.unique(data.pressure):
            here = data.pressure == level
            order = np.argsort(data.force[here])
            if data.force[here].min() <= force <= data.force[here].max():
                kappa_there = np.interp(force, data.force[here][order], data.contraction[here][order])
                points.append((level * 1e-5, 100.0 * kappa_there))
        axis.plot(*np.array(points).T, "o", ms=3.5, mfc="white", color=colour)
    axis.set(title="isotonic κ(p)", xlabel="gauge pressure [bar]", ylabel="contraction [%]", xlim=(0.8, 8.2))
    axis.set_ylim(top=25.0)


def _isometric(axis: Axes, data: lab.Measured, muscle: Muscle) -> None:
    assert data.contraction is not None
    pressure = np.linspace(1e5, 8e5, 120)
    for kappa, colour in zip(_ISOMETERS, theme.on_scale(np.linspace(0.0, 1.0, len(_ISOMETERS))), strict=True):
        held = np.full(len(pressure), kappa)
        label = f"κ = {100.0 * kappa:g} %"
        _pair(axis, pressure * 1e-5, lab.law_force(muscle, _S3_LAW, held, pressure), "-", colour, label)
        printed = lab.law_force(muscle, _S3_PRINTED, held, pressure, _s3_printed())
        _pair(axis, pressure * 1e-5, printed, "--", colour)
        here = np.isclose(data.contraction, kappa)
        axis.plot(data.pressure[here] * 1e-5, data.force[here], "o", ms=3.0, color=colour)
    axis.set(title="isometric F(p)", xlabel="gauge pressure [bar]", ylabel="force [N]", xlim=(0.8, 8.2))


def _pair(axis: Axes, x: np.ndarray, y: np.ndarray, style: str, colour: Foreign, label: str = "") -> None:
    axis.plot(x, np.where(y >= 0.0, y, np.nan), style, color=colour, label=label or None)


_WEAK_CALF = {"patient": "plantarflexor-weak"}
FIGURES: dict[str, dict[str, tuple[tuple[float, float], Callable[[Figure], None]]]] = {
    "S0": {"static_load": ((12.0, 6.4), _static_load), "isobaric": ((6.0, 4.2), _isobars)},
    "S1": {
        "figures_6_to_8": ((8.0, 3.6), _device),
        "torque_of_a_drop_foot": ((8.8, 3.8), lambda figure: fill(figure, torque_map())),
        "torque_of_a_weak_calf": ((8.8, 3.8), lambda figure: fill(figure, torque_map(sets=_WEAK_CALF))),
        "figures_9_to_12": ((6.6, 5.4), lambda f: _s1(f, 1, 9, (1.0, 1.5, 2.0, 3.0), (2, 2))),
        "figures_13_to_15": ((7.6, 3.3), lambda f: _s1(f, 2, 13, (1.5, 2.0, 3.0), (1, 3))),
    },
    "S2": {
        "figure_4": ((6.0, 4.2), _isobars),
        "figures_5_and_6": ((9.0, 5.6), functools.partial(_arms, scenarios=S2_ARMS)),
    },
    "S3": {"characteristics": ((9.6, 3.6), _s3)},
}
