"""Colours of lines and lanes on the viewer's dark ground, apart for every eye, each with its word."""

from collections.abc import Iterable

DARK = [13, 14, 16]  # the ground of the viewer's plots
WORDS: dict[tuple[int, ...], str] = {
    (240, 240, 240): "white",
    (236, 148, 85): "orange",
    (120, 188, 249): "sky blue",
    (160, 255, 78): "green",
    (208, 29, 163): "magenta",
    (84, 106, 255): "blue",
    (225, 60, 60): "red",
    (100, 100, 100): "grey",
    (255, 245, 8): "yellow",
    (196, 146, 0): "ochre",
    (58, 205, 195): "teal",
    (240, 70, 50): "red",
    (253, 133, 8): "orange",
    (255, 228, 47): "yellow",
    (121, 95, 132): "mauve",
    (128, 153, 255): "light blue",
    (168, 249, 255): "pale blue",
    (133, 44, 249): "violet",
    (3, 195, 166): "teal",
    (189, 249, 0): "lime",
}
WHITE, ORANGE, SKY, GREEN, MAGENTA, BLUE, RED, GREY, YELLOW, OCHRE, TEAL = map(list, list(WORDS)[:11])
DORSIFLEXOR = tuple(map(list, list(WORDS)[11:15]))
PLANTARFLEXOR = tuple(map(list, list(WORDS)[15:19]))
LIME = list(list(WORDS)[19])
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
    """Colour of a muscle's path beside the muscle's own; alike where one stands for its whole group."""
    palette, number = _palette(name)
    return list(palette[1]) if alike else [round(0.6 * part) for part in palette[number % len(palette)]]


def _palette(name: str) -> tuple[tuple[list[int], ...], int]:
    role, number = name.rsplit("_", 1)
    cold = role.startswith(("plantar", "extensor"))
    return (PLANTARFLEXOR if cold else DORSIFLEXOR), int(number) - 1


def in_words(lines: Iterable[tuple[str, list[int]]]) -> str:
    """Names and colours of lines as a title tells them: "front red (path orange), back blue"."""
    found: dict[str, str] = {}
    for name, colour in lines:
        word = WORDS.get(tuple(colour), "")
        of, _, part = name.rpartition(", ")
        if of in found:
            found[of] += f" ({part} {word})" if word else ""
        else:
            found.setdefault(name, f"{name} {word}".strip())
    return ", ".join(found.values())
