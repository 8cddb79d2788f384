"""Force over contraction of the fluidic muscles of 10, 20 and 40 mm, with their limits: a picture.

python scripts/fluidic_muscles.py
"""

import pathlib
import tempfile
from typing import Any

import numpy as np
from PIL import Image
from small_png import save

from afo_sim.description.muscle import Muscle
from afo_sim.description.reader import load
from afo_sim.show.style import BLUE, GREY, RED, RUN_STYLES, write_figure

PICTURE = pathlib.Path(__file__).parents[1] / "models/muscles/pictures/fluidic.png"
MUSCLES = {"dmsp_10": "maker's curve", "dmsp_20": "maker's curve", "dmsp_40": "20 mm × 4, not measured"}
LOW = 3e5  # gauge pressure of the second curve [Pa]
SHORT = 0.112  # shortest length at which the 10 mm muscle's force was measured [m]
HIGHEST = 1.6  # of a panel, over the limit of force


def panel(axis: Any, muscle: Muscle, grade: str) -> None:
    """One muscle: curves at its highest pressure and at LOW, its limits as lines."""
    limits, top = muscle.limits, f"{muscle.limits.pressure * 1e-5:g} bar"
    kappa = np.linspace(-0.01, 0.30, 311)
    percent, length = 100.0 * kappa, f"{100.0 * muscle.nominal_length:g} cm"
    axis.plot(percent, muscle.force(limits.pressure, contraction=kappa), color=BLUE, label=f"{top}, {length}")
    axis.plot(
        percent,
        muscle.force(LOW, contraction=kappa),
        color=RED,
        ls=RUN_STYLES[1],
        label=f"{LOW * 1e-5:g} bar, {length}",
    )
    if muscle.lengths is not None and muscle.lengths.force is not None:
        short = muscle.with_values(total_length=SHORT).force(limits.pressure, contraction=kappa)
        axis.plot(percent, short, color=BLUE, ls=RUN_STYLES[3], label=f"{top}, {100.0 * SHORT:g} cm")
    axis.axhline(limits.force, color=GREY, lw=0.8)
    axis.text(24.5, 1.02 * limits.force, f"at most {limits.force:g} N", ha="right", va="bottom", color=GREY)
    for limit in (limits.contraction_min, limits.contraction_max):
        axis.axvline(100.0 * limit, ymax=1.0 / HIGHEST, color=GREY, lw=0.8, ls=":")
    axis.set(
        title=f"{1e3 * muscle.bore:g} mm: {grade}",
        xlabel="contraction [%]",
        xlim=(-4.0, 30.0),
        ylim=(0.0, HIGHEST * limits.force),
    )
    axis.legend(loc="upper right")


def fill(figure: Any) -> None:
    """A panel for each muscle."""
    axes = figure.subplots(1, len(MUSCLES))
    for axis, (name, grade) in zip(axes, MUSCLES.items(), strict=True):
        panel(axis, load("muscle", name), grade)
    axes[0].set_ylabel("force at rest [N]")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        drawn = pathlib.Path(folder) / "fluidic.png"
        write_figure(drawn, (9.5, 3.4), fill)
        save(Image.open(drawn), PICTURE)
