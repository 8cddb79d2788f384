"""Colours of lines and lanes on the viewer's dark ground, apart for every eye, each with its word."""

from collections.abc import Iterable

DARK = [13, 14, 16]  # the ground of the viewer's plots
WHITE, ORANGE, SKY = [240, 240, 240], [236, 148, 85], [120, 188, 249]
GREEN, MAGENTA, BLUE = [160, 255, 78], [208, 29, 163], [84, 106, 255]
RED, GREY, YELLOW = [225, 60, 60], [100, 100, 100], [255, 245, 8]
OCHRE, TEAL, LIME = [196, 146, 0], [58, 205, 195], [189, 249, 0]
DORSIFLEXOR = [240, 70, 50], [253, 133, 8], [255, 228, 47], [121, 95, 132]
PLANTARFLEXOR = [128, 153, 255], [168, 249, 255], [133, 44, 249], [3, 195, 166]
WORDS = {
    tuple(WHITE): "white",
    tuple(ORANGE): "orange",
    tuple(SKY): "sky blue",
    tuple(GREEN): "green",
    tuple(MAGENTA): "magenta",
    tuple(BLUE): "blue",
    tuple(RED): "red",
    tuple(GREY): "grey",
    tuple(YELLOW): "yellow",
    tuple(OCHRE): "ochre",
    tuple(TEAL): "teal",
    tuple(LIME): "lime",
    **dict(zip(map(tuple, DORSIFLEXOR), ("red", "orange", "yellow", "mauve"), strict=True)),
    **dict(zip(map(tuple, PLANTARFLEXOR), ("light blue", "pale blue", "violet", "teal"), strict=True)),
}
RUNS = (WHITE, ORANGE, SKY, GREEN, MAGENTA)
HEALTHY = BLUE
MOMENTS = {
    "orthosis": ORANGE,
    "passive": WHITE,
    "gravity": BLUE,
    "biological": MAGENTA,
    "ground": TEAL,
    "load": LIME,
}
SOLE = {"toe": (YELLOW, OCHRE), "ball": (SKY, BLUE)}  # own, recorded
MOUNTINGS = {"cuff": WHITE, "plate": TEAL}
FORCE = {"z": ("up", TEAL), "x": ("forward", ORANGE)}  # of the ground
FLOOR, RANGE = RED, GREY
VOLUMES = (MAGENTA, LIME, TEAL, WHITE)  # of an air path, beside chambers


def of_run(number: int) -> list[int]:
    """Colour of a run among several, counted from 0."""
    return list(RUNS[number % len(RUNS)])


def of_muscle(name: str) -> list[int]:
    """Colour of a muscle, <role>_<number>: warm for those that lift the foot, cold for the others."""
    palette, number = _palette(name)
    return list(palette[number % len(palette)])


def of_path(name: str, alike: bool) -> list[int]:
    """Colour of a muscle's path; the muscle's own if one represents its group."""
    palette, number = _palette(name)
    return list(palette[1]) if alike else [round(0.6 * part) for part in palette[number % len(palette)]]


def _palette(name: str) -> tuple[tuple[list[int], ...], int]:
    role, number = name.rsplit("_", 1)
    cold = role.startswith(("plantar", "extensor"))
    return (PLANTARFLEXOR if cold else DORSIFLEXOR), int(number) - 1


def in_words(lines: Iterable[tuple[str, list[int]]]) -> str:
    """Names and colours of lines for a title: "front red (path orange), back blue"."""
    found: dict[str, str] = {}
    for name, colour in lines:
        word = WORDS.get(tuple(colour), "")
        of, _, part = name.rpartition(", ")
        if of in found:
            found[of] += f" ({part} {word})" if word else ""
        else:
            found.setdefault(name, f"{name} {word}".strip())
    return ", ".join(found.values())
