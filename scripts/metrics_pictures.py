"""The pictures of docs/metrics.md: each group of metrics drawn on a stride.

python scripts/metrics_pictures.py [--out models/scenarios/pictures]
"""

import argparse
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import small_png
from PIL import Image

import afo_sim
from afo_sim.metrics import FOREFOOT_PITCH, HEEL_PITCH, HEEL_RISE, LOADING, Stride
from afo_sim.model import NEEDS
from afo_sim.show import BLUE, COLOURS, GREEN, ORANGE, PINK, RED, RunView, write_figure
from afo_sim.simulation import limits_of

SCENARIO, BARE = "walk-dropfoot-afo", "walk-dropfoot"
DURATION = "3.7 s"
WIDTH = 7.0  # [inch]
POINTS = {"heel/height": "heel", "ball/height": "ball", "toe/height": "toe: the lower of pulp and tip"}
POINT_COLOURS = (BLUE, ORANGE, PINK)
TRIP = "where contact of ball or toe is a trip"


class Drawn:
    """The stride of a run that counts, with its metrics."""

    def __init__(self, scenario: str):
        recording = afo_sim.run(scenario, {"duration": DURATION, "record_rate": "1 kHz"})
        self.metrics, self.limits = recording.metrics, limits_of(recording)
        self.stride: Stride = RunView("", COLOURS[0], recording).strides[-1]
        self.percent = 100.0 * self.stride.phase

    def __getitem__(self, column: str) -> np.ndarray:
        return self.stride[column]


def above(figure: Any, axis: Any, columns: int) -> None:
    """An axis' legend above the whole figure, where it covers no curve."""
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, fontsize=8.0)


def clearance(figure: Any, run: Drawn) -> None:
    """Heights of the outsole's points and the event; below, the foot's forward speed; shaded the window."""
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.4, 1.0])
    stride, x = run.stride, run.percent
    upper.plot(x, 1e3 * run["sole/height"], color="black", lw=3.0, label="lowest of the outsole")
    for colour, (name, label) in zip(POINT_COLOURS, POINTS.items(), strict=True):
        upper.plot(x, 1e3 * run[name], color=colour, lw=1.2, label=label)
    band = (1e3 * run[f"sole/height_{how}_extended"] for how in ("less", "more"))
    upper.fill_between(x, *band, color="0.5", alpha=0.35, lw=0.0, label="toes less to more extended")
    at, height = (run.metrics[name].value for name in ("toe_clearance_phase", "toe_clearance"))
    upper.plot(at, height, "o", color=COLOURS[0], ms=7.0, zorder=5, label=f"toe clearance {height:.1f} mm")
    passing, seen = x[stride.passing], x[stride.fast & stride.passing]
    for level, rows, what in ((-20.0, seen, "where the minimum counts"), (-38.0, passing, TRIP)):
        upper.plot([rows[0], rows[-1]], [level, level], color="0.3", lw=3.0, solid_capstyle="butt")
        upper.text(rows[0], level + 2.0, what, fontsize=8.0, color="0.3", va="bottom")
    upper.axhline(0.0, color="0.3", lw=0.8)
    upper.set_ylim(-44.0, 150.0)
    upper.set_ylabel("above the floor [mm]")
    speed = np.gradient(run["ankle/position/x"], stride.timestep)
    lower.plot(x, speed, color="black", lw=1.2)
    lower.axhline(speed[stride.fast].min(), color="0.5", lw=0.8, ls="-.")
    lower.text(55.4, speed[stride.fast].min() + 0.1, "upper quartile", fontsize=8.0, color="0.3")
    lower.set_ylabel("ankle's forward\nspeed [m/s]")
    lower.set_ylim(0.0, 1.2 * speed.max())
    for axis in (upper, lower):
        axis.axvspan(seen[0], seen[-1], color=COLOURS[3], alpha=0.18, lw=0.0)
        axis.axvline(100.0 * stride.toe_off, color="0.5", ls=":", lw=0.8)
        axis.axvline(100.0 * stride.upright, color="0.5", ls="--", lw=0.8)
    lower.text(100.0 * stride.upright + 0.3, 0.3, "shank upright", fontsize=8.0)
    lower.text(100.0 * stride.toe_off + 0.3, 0.3, "toe-off", fontsize=8.0)
    lower.set_xlim(55.0, 100.0)
    lower.set_xlabel("gait cycle [%]")
    figure.align_ylabels()
    above(figure, upper, 3)


def push_off(figure: Any, run: Drawn) -> None:
    """Ankle angles, and the torque that the orthosis has against push-off."""
    angle, torque = figure.subplots(1, 2)
    stride, x = run.stride, run.percent
    off = 100.0 * stride.toe_off
    angle.plot(x, np.degrees(run["gait/ankle_angle"]), "k--", lw=1.0, label="recorded")
    angle.plot(x, np.degrees(run["ankle/angle"]), color=COLOURS[1], lw=1.5, label="with the orthosis")
    ends = [
        -(run.metrics["plantarflexion_at_toe_off"].value + lost)
        for lost in (0.0, run.metrics["plantarflexion_lost_at_toe_off"].value)
    ]
    angle.annotate("", (off, ends[0]), (off, ends[1]), arrowprops={"arrowstyle": "<->", "color": COLOURS[0]})
    lost = run.metrics["plantarflexion_lost_at_toe_off"].value
    look = {"color": COLOURS[0], "fontsize": 8.0, "ha": "right", "va": "center"}
    angle.text(off - 7.0, np.mean(ends), f"lost {lost:.1f}°", **look)
    angle.set_ylabel("ankle angle [deg]\ndorsiflexion +")
    moment = run["ankle/moment/orthosis"]
    torque.plot(x, moment, color=COLOURS[1], lw=1.5)
    against = (stride.phase >= HEEL_RISE) & ~stride.swing
    torque.fill_between(
        x,
        0.0,
        moment,
        where=against & (run["ankle/velocity"] < 0.0),
        color=COLOURS[0],
        alpha=0.4,
        lw=0.0,
        label="against push-off, foot going down",
    )
    for limit, name, colour in zip(
        run.limits.torque_against_push_off,
        ("good up to here", "bad beyond"),
        (GREEN, RED),
        strict=True,
    ):
        torque.axhline(limit * stride.body_mass, color=colour, lw=0.9, ls="--")
        torque.text(99.0, limit * stride.body_mass, name, color=colour, fontsize=8.0, ha="right", va="bottom")
    torque.set_ylabel("orthosis torque [N·m]\ndorsiflexion +")
    torque.set_ylim(0.0, 11.0)
    handles, labels = (
        a + b for a, b in zip(*(x.get_legend_handles_labels() for x in (angle, torque)), strict=True)
    )
    figure.legend(handles, labels, loc="outside upper left", ncols=3, fontsize=8.0)
    for axis in (angle, torque):
        axis.axvline(off, color="0.5", ls=":", lw=0.8)
        axis.axvline(100.0 * HEEL_RISE, color="0.5", ls="--", lw=0.8)
        axis.annotate(
            "toe-off", (off + 1.0, 0.98), xycoords=("data", "axes fraction"), fontsize=8.0, va="top"
        )
        axis.set_xlim(0.0, 100.0)
        axis.set_xlabel("gait cycle [%]")


def need(figure: Any, run: Drawn) -> None:
    """Torque that the patient lacks in swing, with the tissue's part apart."""
    axis = figure.subplots()
    stride, x = run.stride, run.percent
    low, high = NEEDS["swing"]
    axis.axhspan(low, high, color=COLOURS[2], alpha=0.2, lw=0.0, label=f"torque map: {low:g} to {high:g} N·m")
    needed, held = run["gait/needed_moment"], np.maximum(-run["gait/passive_moment"], 0.0)
    axis.plot(x, run["gait/ankle_moment"], color="black", lw=1.0, ls="--", label="whole moment, recorded")
    axis.plot(x, needed, color=COLOURS[1], lw=1.8, label="needed of the orthosis")
    swing = stride.swing
    axis.fill_between(
        x[swing],
        0.0,
        np.minimum(held, needed)[swing],
        color=COLOURS[1],
        alpha=0.2,
        lw=0.0,
        label="of it, against the ankle's own tissue",
    )
    for rows, name, side in (
        (swing & (stride.phase < stride.upright), "needed_swing_torque", "right"),
        (stride.phase >= stride.upright, "needed_terminal_swing_torque", "left"),
    ):
        row = np.flatnonzero(rows)[np.argmax(needed[rows])]
        axis.plot(x[row], needed[row], "o", color=COLOURS[0], zorder=5)
        axis.annotate(
            f"{name}\n{needed[row]:.1f} N·m",
            (x[row], needed[row]),
            xytext=(-6.0 if side == "right" else 6.0, 18.0),
            textcoords="offset points",
            ha=side,
            fontsize=8.0,
        )
    axis.axvline(100.0 * stride.upright, color="0.5", ls="--", lw=0.8)
    axis.text(100.0 * stride.upright - 0.3, -1.7, "shank upright", fontsize=8.0, ha="right")
    axis.set_xlim(100.0 * stride.toe_off, 100.0)
    axis.set_ylim(-2.0, 8.0)
    axis.set_xlabel("gait cycle [%]")
    axis.set_ylabel("torque [N·m], dorsiflexion +")
    above(figure, axis, 2)


def contact(figure: Any, runs: dict[str, Drawn]) -> None:
    """Pitch of the outsole at initial contact, and the foot's fall after it."""
    pitch, slap = figure.subplots(1, 2)
    for colour, (label, run) in zip(COLOURS, runs.items(), strict=False):
        first = run.percent <= 20.0
        pitch.plot(run.percent[first], np.degrees(run["sole/pitch"][first]), color=colour, label=label)
        pitch.plot(0.0, run.metrics["foot_pitch_at_contact"].value, "o", color=colour)
        falling = -np.degrees(run["ankle/velocity"])
        slap.plot(run.percent[first], falling[first], color=colour, label=label)
        value = run.metrics["foot_slap_velocity"].value
        loading = run.percent <= 100.0 * LOADING
        slap.plot(run.percent[np.argmin(np.abs(falling[loading] - value))], value, "o", color=colour)
    for bound in (HEEL_PITCH, FOREFOOT_PITCH):
        pitch.axhline(bound, color="0.5", lw=0.8, ls="--")
    for text, height in (("heel", HEEL_PITCH + 0.5), ("flat", 2.0), ("forefoot", FOREFOOT_PITCH - 2.5)):
        pitch.text(8.0, height, text, ha="center", fontsize=8.0, color="0.4")
    slap.axvspan(0.0, 100.0 * LOADING, color=COLOURS[3], alpha=0.18, lw=0.0)
    pitch.set_ylabel("outsole to floor [deg], toe up +")
    slap.set_ylabel("plantarflexion velocity [deg/s]")
    for axis in (pitch, slap):
        axis.set_xlabel("gait cycle [%]")
        axis.set_xlim(-0.5, 20.0)
    above(figure, pitch, 2)


def air(figure: Any, run: Drawn) -> None:
    """Pressure of the dorsiflexor, and air taken from the supply, over the stride."""
    pressure, mass = figure.subplots(1, 2)
    pressure.plot(run.percent, 1e-5 * run["chamber/dorsiflexor/pressure"], color=COLOURS[1])
    pressure.set_ylabel("gauge pressure of the\ndorsiflexor [bar]")
    taken = 1e3 * np.cumsum(np.maximum(run["valve/dorsiflexor_inlet/mass_flow"], 0.0)) * run.stride.timestep
    mass.plot(run.percent, taken, color=COLOURS[1])
    grams, free, normal = (
        run.metrics[name].value
        for name in ("air_per_stride", "free_air_per_stride", "normal_litres_per_stride")
    )
    text = f"{grams:.3f} g\n= {free:.3f} l ANR (ISO 8778)\n= {normal:.3f} normal litres (DIN 1343)"
    mass.text(3.0, 0.95 * taken[-1], text, fontsize=8.0, va="top")
    mass.set_ylabel("taken from the supply [g]")
    for axis in (pressure, mass):
        axis.set_xlim(0.0, 100.0)
        axis.set_ylim(bottom=0.0)
        axis.set_xlabel("gait cycle [%]")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    place = pathlib.Path(__file__).resolve().parents[1] / "models" / "scenarios" / "pictures"
    parser.add_argument("--out", type=pathlib.Path, default=place)
    given = parser.parse_args()
    worn, bare = Drawn(SCENARIO), Drawn(BARE)
    both = {"drop foot": bare, "with the orthosis": worn}
    pictures: dict[str, tuple[float, Callable[[Any], None]]] = {
        "clearance": (4.6, lambda figure: clearance(figure, worn)),
        "push-off": (2.9, lambda figure: push_off(figure, worn)),
        "need": (3.2, lambda figure: need(figure, bare)),
        "contact": (2.7, lambda figure: contact(figure, both)),
        "air": (2.5, lambda figure: air(figure, worn)),
    }
    for name, (height, fill) in pictures.items():
        path = given.out / f"metrics-{name}.png"
        write_figure(path, (WIDTH, height), fill)
        small_png.save(Image.open(path), path)


if __name__ == "__main__":
    main()
