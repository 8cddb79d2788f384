"""The wiring of an exported board as a picture: `python scripts/wiring_picture.py OUT.png`."""

import sys
from typing import Any

import matplotlib.pyplot as plt

VALVES = (
    ("dorsiflexor inlet", 2),
    ("dorsiflexor outlet", 3),
    ("plantarflexor inlet", 4),
    ("plantarflexor outlet", 5),
)


def box(axes: Any, x: float, y: float, width: float, height: float, text: str, colour: str = "white") -> None:
    axes.add_patch(plt.Rectangle((x, y), width, height, facecolor=colour, edgecolor="black"))
    axes.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=8)


def wire(axes: Any, *points: tuple[float, float], colour: str = "black") -> None:
    axes.plot(*zip(*points, strict=True), color=colour, linewidth=1.2)


def valve(axes: Any, y: float, name: str, pin: int) -> None:
    """Pin → gate resistor → MOSFET on the coil's ground side; a diode across the coil; a pull-down."""
    wire(axes, (2.2, y), (2.7, y))
    axes.text(2.15, y, f"pin {pin}", ha="right", va="center", fontsize=8)
    box(axes, 2.7, y - 0.13, 0.8, 0.26, "220 Ω")
    wire(axes, (3.5, y), (4.7, y))
    wire(axes, (3.9, y), (3.9, y - 0.42))
    box(axes, 3.55, y - 0.68, 0.7, 0.26, "10 kΩ")
    axes.text(4.3, y - 0.6, "to ground", va="center", fontsize=7)
    box(axes, 4.7, y - 0.28, 1.2, 0.56, "n-MOSFET\nsource to ground")
    wire(axes, (5.9, y), (6.5, y))
    box(axes, 6.5, y - 0.2, 1.7, 0.4, f"coil: {name}", "#e8f0fa")
    wire(axes, (8.2, y), (9.2, y), colour="tab:red")
    wire(axes, (6.2, y), (6.2, y - 0.5), (7.0, y - 0.5))
    box(axes, 7.0, y - 0.63, 0.9, 0.26, "▶| diode")
    wire(axes, (7.9, y - 0.5), (8.6, y - 0.5), (8.6, y), colour="tab:red")


def main(out: str) -> None:
    figure, axes = plt.subplots(figsize=(10, 6.2))
    box(axes, 0.2, 0.1, 2.0, 6.5, "", "#f4f4f4")
    axes.text(0.3, 6.35, "board", fontsize=10, weight="bold")
    for k, (name, pin) in enumerate(VALVES):
        valve(axes, 5.9 - 1.1 * k, name, pin)
    wire(axes, (9.2, 2.6), (9.2, 6.4), colour="tab:red")
    axes.text(9.2, 6.5, "+ of the coils' supply", ha="right", fontsize=8, color="tab:red")
    for height, label, text in (
        (1.5, "pin 6", "run switch, to ground: open is off"),
        (0.9, "A0", "foot switch or sensor, 0 to 5 V"),
    ):
        axes.text(2.15, height, label, ha="right", va="center", fontsize=8)
        wire(axes, (2.2, height), (4.7, height))
        box(axes, 4.7, height - 0.2, 3.5, 0.4, text)
    axes.text(2.15, 0.35, "GND", ha="right", va="center", fontsize=8)
    wire(axes, (2.2, 0.35), (4.7, 0.35))
    axes.text(
        4.8, 0.35, "ground of the supply, sources, switches and sensors: one point", va="center", fontsize=8
    )
    axes.set(xlim=(0, 9.6), ylim=(0, 6.8))
    axes.axis("off")
    figure.savefig(out, dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main(sys.argv[1])
