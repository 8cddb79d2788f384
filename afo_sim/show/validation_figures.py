"""S1's figures 9 to 15 and S3's three characteristics, redrawn with ours on top of the printed points."""

import functools
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from afo_sim.common import GRAVITY, check_writable, together
from afo_sim.description import Muscle, reader
from afo_sim.lab import (
    CM,
    MISPRINT,
    S3_A,
    S3_B,
    S3_N,
    TABLES,
    Measured,
    as_s1,
    characteristic,
    law_force,
    ours,
    s3_coefficients,
    s3_force,
    select,
)
from afo_sim.lab.validation_s1 import table
from afo_sim.physics import LAWS, contractions
from afo_sim.show.style import COLOURS, on_scale, write_pair

_S1_OWN, _OURS = COLOURS[0], COLOURS[1]
_ISOBARS = (2.0, 3.0, 4.0, 5.0, 6.0)  # [bar]
_ISOTONES = (50.0, 100.0, 200.0, 300.0)  # [N]
_ISOMETERS = (0.0, 0.05, 0.11, 0.2)  # contraction ratios that the maker's table holds
_S3_LAW = "takosoglu_2016_an"


def write_figures(folder: pathlib.Path) -> list[pathlib.Path]:
    """Draw the validation's figures as PNG and as PDF, and return the files."""
    check_writable(folder, "folder")
    with together(folder) as scratch:
        files = [
            file for name, (size, fill) in FIGURES.items() for file in write_pair(scratch / name, size, fill)
        ]
    return [folder / file.name for file in files]


def _s1(figure: Any, bench: int, first: int, masses: tuple[float, ...], shape: tuple[int, int]) -> None:
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


def _s1_panel(axis: Any, bench: int, mass: float) -> None:
    measured, own = table(bench), table(bench + 2)
    loads = {bench: (mass + measured.facts["hanger"]) * GRAVITY, bench + 2: mass * GRAVITY}
    pressure = np.linspace(1.5e5, 4.2e5, 100)
    lifted = as_s1(own.facts["total_length"], np.full(100, loads[bench + 2]), pressure)
    axis.plot(
        pressure * 1e-5, CM * lifted, "--", color=_S1_OWN, label="S1's model as it is run here (37°, r0 5 mm)"
    )
    lifted = ours(reader.load("muscle", TABLES[bench]), np.full(100, loads[bench]), pressure)
    axis.plot(pressure * 1e-5, CM * lifted, color=_OURS, label="muscle fitted here to tables I and II")
    for number, data, look in (
        (
            bench + 2,
            own,
            {"marker": "s", "mfc": "white", "color": _S1_OWN, "label": "S1's simulation, printed"},
        ),
        (bench, measured, {"marker": "o", "color": "black", "label": "S1's measurement, printed"}),
    ):
        here = np.isclose(data.force, loads[number])
        assert data.change is not None
        axis.plot(data.pressure[here] * 1e-5, CM * data.change[here], ls="", ms=4.5, **look)
    if bench == 2 and np.isclose(own.force[MISPRINT], loads[bench + 2]):
        assert own.change is not None
        axis.annotate(
            "misprint: 2.4 is implied",
            (own.pressure[MISPRINT] * 1e-5, CM * own.change[MISPRINT]),
            xytext=(-7.0, 0.0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=8.0,
            color=_S1_OWN,
        )


def _s3(figure: Any) -> None:
    """Isobaric, isotonic and isometric: the maker's points, S3's printed numbers, the law fitted here."""
    axes = figure.subplots(1, 3)
    data, _ = select(characteristic(10))
    muscle = reader.load("muscle", "dmsp_10")
    for axis, panel in zip(axes, (_isobaric, _isotonic, _isometric), strict=True):
        panel(axis, data, muscle)
    grey = {"color": "0.3"}
    keys = [
        *axes[0].plot([], [], "o", ms=3.5, label="maker's 10 mm table", **grey),
        *axes[0].plot([], [], "o", ms=3.5, mfc="white", label="interpolated in it", **grey),
        *axes[0].plot([], [], "-", label=f"{_S3_LAW}, fitted here", **grey),
        *axes[0].plot([], [], "--", label=f"S3's a = {S3_A:g}, b = {S3_B:g}, n = {S3_N[6.0]:g}", **grey),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=4)
    title = (
        "S3's characteristics of a 10 mm muscle; its own points are lost from its text, these are independent"
    )
    figure.suptitle(title, x=0.01, ha="left", fontsize=9.0)


def _isobaric(axis: Any, data: Measured, muscle: Muscle) -> None:
    assert data.contraction is not None
    kappa = np.linspace(0.0, 0.25, 120)
    for bar, colour in zip(_ISOBARS, on_scale(np.linspace(0.0, 1.0, len(_ISOBARS))), strict=True):
        pressure = np.full(len(kappa), bar * 1e5)
        _pair(axis, 100.0 * kappa, law_force(muscle, _S3_LAW, kappa, pressure), "-", colour, f"{bar:g} bar")
        _pair(axis, 100.0 * kappa, s3_force(data, S3_A, S3_N[6.0], kappa, pressure), "--", colour)
        here = np.isclose(data.pressure, bar * 1e5)
        axis.plot(100.0 * data.contraction[here], data.force[here], "o", ms=3.0, color=colour)
    axis.set(title="isobaric F(κ)", xlabel="contraction [%]", ylabel="force [N]", xlim=(-0.5, 25.0))
    axis.set_ylim(0.0, None)
    axis.legend(loc="upper right")


def _isotonic(axis: Any, data: Measured, muscle: Muscle) -> None:
    assert data.contraction is not None
    pressure = np.linspace(1e5, 8e5, 120)
    law = LAWS[_S3_LAW]
    fitted = law.coefficients(muscle.braid, muscle.laws[_S3_LAW].parameters)
    printed = s3_coefficients(data, S3_A, S3_N[6.0])
    for force, colour in zip(_ISOTONES, on_scale(np.linspace(0.0, 1.0, len(_ISOTONES))), strict=True):
        pull = np.full(len(pressure), force)
        for coefficients, style, label in ((fitted, "-", f"{force:g} N"), (printed, "--", "")):
            kappa = contractions(law.native_id, coefficients, pull, pressure)
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
    axis.set_ylim(0.0, 25.0)
    axis.legend(loc="upper left")


def _isometric(axis: Any, data: Measured, muscle: Muscle) -> None:
    assert data.contraction is not None
    pressure = np.linspace(1e5, 8e5, 120)
    for kappa, colour in zip(_ISOMETERS, on_scale(np.linspace(0.0, 1.0, len(_ISOMETERS))), strict=True):
        held = np.full(len(pressure), kappa)
        label = f"κ = {100.0 * kappa:g} %"
        _pair(axis, pressure * 1e-5, law_force(muscle, _S3_LAW, held, pressure), "-", colour, label)
        _pair(axis, pressure * 1e-5, s3_force(data, S3_A, S3_N[6.0], held, pressure), "--", colour)
        here = np.isclose(data.contraction, kappa)
        axis.plot(data.pressure[here] * 1e-5, data.force[here], "o", ms=3.0, color=colour)
    axis.set(title="isometric F(p)", xlabel="gauge pressure [bar]", ylabel="force [N]", xlim=(0.8, 8.2))
    axis.set_ylim(0.0, None)
    axis.legend(loc="upper left")


def _pair(axis: Any, x: np.ndarray, y: np.ndarray, style: str, colour: Any, label: str = "") -> None:
    """A curve where it is positive: a muscle does not push."""
    axis.plot(x, np.where(y >= 0.0, y, np.nan), style, color=colour, label=label or None)


FIGURES: dict[str, tuple[tuple[float, float], Callable[[Any], None]]] = {
    "s1_figures_9_to_12": (
        (6.6, 5.4),
        functools.partial(_s1, bench=1, first=9, masses=(1.0, 1.5, 2.0, 3.0), shape=(2, 2)),
    ),
    "s1_figures_13_to_15": (
        (7.6, 3.3),
        functools.partial(_s1, bench=2, first=13, masses=(1.5, 2.0, 3.0), shape=(1, 3)),
    ),
    "s3_characteristics": ((9.6, 3.6), _s3),
}
