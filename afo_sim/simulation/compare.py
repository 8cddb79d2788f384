"""One scenario with several muscle laws, side by side: runs, differences, one figure, one recording."""

import itertools
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.writing import check_writable, together, write_text
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.model.build import build
from afo_sim.show.figure import COLOURS, LINE_STYLES, RESOLUTION, STYLE
from afo_sim.simulation.files import RERUN
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.run import run_built

ANGLE = "ankle/angle"
FIGURE, TABLE = "comparison", "differences.csv"

Report = Callable[[int, int, str], None]


def common_laws(scenario: Scenario) -> list[str]:
    """The laws that every muscle of a scenario has parameters for."""
    groups = list(scenario.orthosis.muscle.values())
    return [law for law in groups[0].type.laws if all(law in group.type.laws for group in groups)]


def compare_laws(
    scenario: str | os.PathLike[str] | Mapping[str, Any],
    laws: Sequence[str] = (),
    sets: Mapping[str, Any] | None = None,
    *,
    report: Report | None = None,
) -> dict[str, Recording]:
    """Run a scenario once with each law in all its muscles.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, or a dict of the same shape
    laws : names; by default every law that all muscles have parameters for
    sets : dotted keys and values laid over the scenario
    report : called with (steps done, steps in all, law)

    Returns
    -------
    {law: Recording}, in the order asked for

    Raises
    ------
    InputError
        The description is wrong, or a muscle has no parameters for a law.
    """
    for key in sets or {}:
        if key.endswith(".type.law"):
            raise InputError("is what the comparison varies", field="--set", value=key, allowed="--laws")
    plain = load("scenario", scenario, sets)
    known = common_laws(plain)
    for law in laws:
        if law not in known:
            raise InputError(
                "is no law that all muscles of the scenario have parameters for",
                field="--laws",
                value=law,
                allowed=", ".join(known),
                nearest=nearest_name(law, known),
            )
    runs = {}
    for law in dict.fromkeys(laws or known):
        chosen = {f"orthosis.muscle.{group}.type.law": law for group in plain.orthosis.muscle}
        built = build(load("scenario", scenario, {**(sets or {}), **chosen}))
        tell = None if report is None else _for_law(report, law)
        runs[law] = run_built(built, progress=tell)
    return runs


def _for_law(report: Report, law: str) -> Callable[[int, int], None]:
    return lambda done, total: report(done, total, law)


def angle_differences(runs: Mapping[str, Recording]) -> dict[tuple[str, str], float]:
    """Root mean square of the angle between every two runs, over the time that both have [rad]."""
    found = {}
    for a, b in itertools.combinations(runs, 2):
        rows = min(len(runs[a][ANGLE]), len(runs[b][ANGLE]))
        difference = runs[a][ANGLE][:rows] - runs[b][ANGLE][:rows]
        found[a, b] = float(np.sqrt(np.mean(difference**2))) if rows else float("nan")
    return found


def tables(runs: Mapping[str, Recording]) -> list[tuple[str, list[str], list[list[str]]]]:
    """(title, header, rows): every run's metrics, and the angle between every two."""
    names = list(dict.fromkeys(name for run in runs.values() for name in run.metrics))
    metrics = []
    for name in names:
        found = [run.metrics.get(name) for run in runs.values()]
        unit = next(m.unit for m in found if m is not None)
        metrics.append([name, unit, *("" if m is None else f"{m.value:.4g}" for m in found)])
    apart = angle_differences(runs)
    pairs = [[a, *(f"{np.degrees(_of(apart, a, b)):.3f}" for b in runs)] for a in runs]
    return [
        ("metrics", ["metric", "unit", *runs], metrics),
        ("angle between two runs, RMS [deg]", ["", *runs], pairs),
    ]


def _of(apart: Mapping[tuple[str, str], float], a: str, b: str) -> float:
    return apart.get((a, b), apart.get((b, a), 0.0))


def write(runs: Mapping[str, Recording], folder: pathlib.Path, *, rrd: bool = True) -> list[pathlib.Path]:
    """Write every run into FOLDER/LAW, the differences, the figure and the common Rerun recording.

    Parameters
    ----------
    runs : as `compare_laws` returns them
    folder : made if need be
    rrd : also write the recording of all runs on one timeline

    Returns
    -------
    the files that are not a run's own
    """
    check_writable(folder)
    figures = [f"{FIGURE}.png", f"{FIGURE}.pdf"]
    written = [TABLE]
    with together(folder, (TABLE, *figures, RERUN)) as scratch:
        folders = [run.save(scratch / law, rrd=False) for law, run in runs.items()]
        rows = [f"{a},{b},{np.degrees(value):.6g}" for (a, b), value in angle_differences(runs).items()]
        write_text(scratch / TABLE, "\n".join(["law,other law,RMS angle between them [deg]", *rows]) + "\n")
        if all(len(run["time"]) for run in runs.values()):
            for name in figures:
                draw(runs, scratch / name, name.rpartition(".")[2])
            written += figures
            if rrd:
                from afo_sim.show.rerun import write_comparison

                write_comparison(folders, scratch / RERUN)
                written.append(RERUN)
    return [folder / name for name in written]


def draw(runs: Mapping[str, Recording], path: pathlib.Path, suffix: str = "png") -> None:
    """Angles, their differences, pressures and forces of all runs over time.

    Parameters
    ----------
    runs : {name: recording}, none of them without rows; the first is what the others are compared with
    path : file to write
    suffix : its format
    """
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    first = next(iter(runs.values()))
    colours = dict(zip(runs, itertools.cycle(COLOURS)))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.1, 7.4), layout="constrained")
        axes = figure.subplots(4, 1, sharex=True, height_ratios=[1.3, 1.0, 1.0, 1.0])
        _draw_angles(axes[0], axes[1], runs, colours)
        for axis, kind, column, factor in (
            (axes[2], "chamber", "pressure", 1e-5),
            (axes[3], "muscle", "force", 1.0),
        ):
            styles = _draw_groups(axis, runs, colours, kind, column, factor)
            handles = [Line2D([], [], color="0.3", ls=ls, label=name) for name, ls in styles.items()]
            axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=2.2)
        axes[2].set_ylabel("gauge pressure\n[bar]")
        axes[3].set_ylabel("muscle force\n[N]")
        axes[3].set_xlabel("time [s]")
        figure.align_ylabels(axes)
        title = f"{first.scenario['name']}: {first.scenario['description']}"
        figure.suptitle(title, x=0.01, ha="left", fontsize=9.0, wrap=True)
        figure.savefig(path, format=suffix, dpi=RESOLUTION)


def _draw_angles(
    angle: Any, difference: Any, runs: Mapping[str, Recording], colours: Mapping[str, str]
) -> None:
    """The angles over one another, and how far each is from the first."""
    name, first = next(iter(runs.items()))
    leg = first.scenario["leg"]
    for axis in (angle, difference):
        axis.axhline(0.0, color="0.75", lw=0.6, zorder=1)
    for number, (law, run) in enumerate(runs.items()):
        degrees = np.degrees(run[ANGLE])
        # where they coincide, the first shows through the gaps of the others
        style = {"color": colours[law], "ls": LINE_STYLES[number % len(LINE_STYLES)], "label": law}
        angle.plot(run["time"], degrees, **style)
        rows = min(len(degrees), len(first["time"]))
        difference.plot(run["time"][:rows], degrees[:rows] - np.degrees(first[ANGLE][:rows]), **style)
    angle.set_ylabel(f"{leg['ankle']} angle [deg]\n{leg['directions'][0]} +")
    difference.set_ylabel(f"less that of\n{name} [deg]")
    angle.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=2.2)


def _draw_groups(
    axis: Any,
    runs: Mapping[str, Recording],
    colours: Mapping[str, str],
    kind: str,
    column: str,
    factor: float,
) -> dict[str, str]:
    """A line per run and chamber, or per run and first muscle of a group; {group: its line style}."""
    orthosis = next(iter(runs.values())).scenario["orthosis"]
    styles = dict(zip(orthosis[kind], itertools.cycle(LINE_STYLES)))
    for law, run in runs.items():
        for group, style in styles.items():
            name = group if kind == "chamber" else f"{group}_1"
            values = run[f"{kind}/{name}/{column}"] * factor
            axis.plot(run["time"], values, color=colours[law], ls=style, lw=1.0)
    return styles
