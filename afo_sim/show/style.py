"""Pages of drawings as files: their formats, and PNGs of few colours."""

import functools
import io
import pathlib
import tempfile
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from afo_sim.common import FloatOrArray, Foreign, InputError, optional, replacing, write_text
from afo_sim.show.in_words import described, labelled, written

Axes = Foreign  # Matplotlib's, as the figure: it is imported where something is drawn
Figure = Foreign
LineStyle = Any  # as Matplotlib takes it: a text, or lengths of dashes and gaps
FORMATS = ("png", "pdf", "svg")
RESOLUTION = 200  # of PNG [1/inch]
# Hues of Okabe and Ito (2008), darkened until each stands out from white (contrast 3) and moved until any
# two are apart, and from black and GREY, also for readers without red, green or blue cones.
RED, BLUE, ORANGE = "#BE310F", "#0E4FB5", "#FD5F14"
VIOLET, GREEN, PINK = "#6661FB", "#23A866", "#D25DBE"
COLOURS = (RED, BLUE, ORANGE, VIOLET, GREEN, PINK)
GREY = "#737373"
RUNS = (BLUE, RED, GREEN, PINK, ORANGE, VIOLET)  # of runs, in their order
# Of runs, in their order: the colour is never alone in telling them.
RUN_STYLES: tuple[LineStyle, ...] = (
    "-",
    (0, (8, 1.5)),
    (0, (6, 1.5, 1, 1.5)),
    (0, (1, 0.8)),
    (0, (6, 1.2, 1, 1.2, 1, 1.2)),
    (0, (2.5, 0.8)),
)
MOMENTS = {  # about the ankle
    "orthosis": "#000000",
    "passive": GREEN,
    "gravity": PINK,
    "load": ORANGE,
    "biological": RED,
    "ground": VIOLET,
    "frame": GREY,
}
MOMENT_STYLES: dict[str, LineStyle] = {
    "passive": "--",
    "gravity": ":",
    "load": "-.",
    "ground": (0, (8, 1.5)),
    "frame": (0, (1, 3)),
}
MOUNTINGS = {"cuff": "#000000", "plate": GREEN}
SOLE = {"toe": ORANGE, "ball": BLUE}  # points of the sole
SCALE, SCALE_END = "plasma", 0.62  # colours of a scale on white, and the share of them that is dark enough
BESIDE = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}  # of a legend on its panel's right
MARKERS = (None, "o", "s", "^", "D", "v")  # of groups of muscles and chambers, in their order
STANCE, NORM, ZERO = VIOLET, "0.85", "0.6"
LINE_STYLES = ("-", "--", ":", "-.")
STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.xmargin": 0.0,
    "legend.frameon": False,
    "legend.handlelength": 1.4,
    "lines.linewidth": 1.3,
    "pdf.fonttype": 42,  # text stays text
}
_LONGEST = 34  # letters of a name in a legend
LINE = 95  # letters of a line above a whole page
_BEYOND = 1.05  # of its panel's side that a label may take
_SHRINKS = 1.2  # by which a panel is smaller after it is laid out, about
_TEXT, _MARK = 4.5, 3.0  # least contrast ratios: of text (level AA, 1.4.3), of lines and marks (1.4.11)
STEP = 0.97  # by which a colour is darkened at a time
SHADES = 96  # colours of a PNG


def on_scale(share: FloatOrArray) -> FloatOrArray:
    """The colour of each share of a scale, from 0 to 1."""
    from matplotlib import colormaps

    return colormaps[SCALE](SCALE_END * share)


def width_of(line: str, size: float, *, bold: bool = True) -> float:
    """Width of a line of letters [points]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size, weight="bold" if bold else "normal")
    return float(text_to_path.get_text_width_height_descent(line, font, False)[0])


def plain(text: str, longest: int | None = _LONGEST) -> str:
    """A user's text for a figure: no mathematics, no character that the font lacks."""
    shown = "".join(c if c.isprintable() and _has_glyph(c) else "?" for c in text)
    if longest is not None and len(shown) > longest:
        shown = shown[: longest - 1] + "…"
    # A legend leaves out what begins with an underscore.
    return (f" {shown}" if shown.startswith("_") else shown).replace("$", r"\$")


def paragraph(*texts: str) -> str:
    """A user's texts as lines of a page's title, each text wrapped."""
    return "\n".join(plain(line, None) for text in texts for line in textwrap.wrap(text, LINE))


def wrapped(text: str, letters: int = 26) -> str:
    """A user's text in as many lines as a small panel's side needs."""
    return _filled(plain(text, None), letters)


def _filled(text: str, letters: int) -> str:
    """A text in lines that keep a unit with its word, and a word whole."""
    kept = text.replace(" [", "\u00a0[")
    return textwrap.fill(kept, letters, break_long_words=False, break_on_hyphens=False)


@functools.cache
def _has_glyph(character: str) -> bool:
    from matplotlib.font_manager import FontProperties, findfont, get_font  # which keep what they found

    return bool(get_font(findfont(FontProperties())).get_char_index(ord(character)))


def by_height(axis: Axes) -> list[Foreign]:
    """A panel's named lines as they lie over one another: for a legend in which only the shade differs."""
    return sorted(
        axis.get_legend_handles_labels()[0], key=lambda line: -float(np.nan_to_num(line.get_ydata()).mean())
    )


def legend_on_top(axis: Axes, columns: int = 1) -> None:
    """A legend inside a panel, whose scale goes on upward until nothing that is drawn reaches the legend."""
    for count in range(columns, 0, -1):
        box = axis.legend(loc="upper left", ncols=count).get_window_extent()
        if _SHRINKS * box.width <= axis.bbox.width:
            break
    low, high = axis.get_ylim()
    axis.set_ylim(low, low + (high - low) / (1.0 - min(_SHRINKS * box.height / axis.bbox.height, 0.6)))


def styled(**own: object) -> Foreign:
    """A block with Matplotlib's defaults and this style, whatever `matplotlibrc` the current folder holds."""
    import matplotlib

    return matplotlib.rc_context({**matplotlib.rcParamsDefault, **STYLE, **own})


@contextmanager
def new_figure(path: pathlib.Path, size: tuple[float, float], *also: pathlib.Path) -> Iterator[Figure]:
    """An empty figure that is filled in the block and written at its end, each file whole or not at all."""
    suffixes = {file: file.suffix.lower().removeprefix(".") for file in (path, *also)}
    for file, suffix in suffixes.items():
        if suffix not in FORMATS:
            raise InputError("is not a format of a figure", file=file, allowed=", ".join(FORMATS))
    make = optional("matplotlib.figure").Figure  # and not pyplot: no display, nothing global
    with styled():
        figure = make(figsize=size, layout="constrained")
        yield figure
        _break_long_labels(figure)
        words = described(figure)
        for file, suffix in suffixes.items():
            if suffix == "svg":
                page = io.StringIO()
                figure.savefig(page, format=suffix, metadata={"Description": words})
                write_text(file, labelled(page.getvalue(), "figure", file.stem, words))
            else:
                told = {"Subject" if suffix == "pdf" else "Description": words}
                with replacing(file) as temporary:
                    figure.savefig(temporary, format=suffix, dpi=RESOLUTION, metadata=told)
            figure.set_layout_engine("none")  # what is laid out stays, and is not laid out again


def _break_long_labels(figure: Figure) -> None:
    """Break labels and titles that are longer than their panel: a layout keeps no room for their ends."""
    layout, broken = figure.get_layout_engine(), False
    layout.execute(figure)
    texts = [(figure._suptitle, figure.bbox.width)] if figure._suptitle else []
    for axis in (axis for axis in figure.axes if axis.axison):
        wide, tall = axis.bbox.size
        titles = (axis.title, axis._left_title, axis.xaxis.label)
        texts += [*((text, _BEYOND * wide) for text in titles), (axis.yaxis.label, _BEYOND * tall)]
    for text, room in texts:
        words, long = text.get_text(), max(text.get_window_extent().size) / room
        if words and long > 1.0:
            most = max(map(len, words.split("\n")))
            text.set_text("\n".join(_filled(line, int(0.9 * most / long)) for line in words.split("\n")))
            broken = True
    if not broken:
        figure.set_layout_engine("none")


def write_figure(path: pathlib.Path, size: tuple[float, float], fill: Callable[[Figure], None]) -> None:
    """Draw a figure and write it, whole or not at all."""
    with new_figure(path, size) as figure:
        fill(figure)


def write_pair(
    stem: pathlib.Path, size: tuple[float, float], fill: Callable[[Figure], None]
) -> list[pathlib.Path]:
    """Draw a figure as PNG and as PDF: the files. Other parameters and errors as in `write_figure`."""
    files = [stem.with_suffix(f".{suffix}") for suffix in FORMATS[:2]]
    with new_figure(files[0], size, *files[1:]) as figure:
        fill(figure)
    return files


def luminance(colour: str) -> float:
    """Relative luminance of an sRGB colour, 0 of black to 1 of white [-]."""
    from matplotlib.colors import to_rgb

    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in to_rgb(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def ratio(one: str, other: str = "white") -> float:
    """Contrast ratio of two sRGB colours, (brighter + 0.05)/(darker + 0.05), 1 to 21 [-]."""
    brighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (brighter + 0.05) / (darker + 0.05)


def ink(colour: str) -> str:
    """A line's colour, darkened as far as words in it on white need it."""
    from matplotlib.colors import to_hex, to_rgb

    shade = colour
    while ratio(shade) < _TEXT:
        shade = to_hex([STEP * part for part in to_rgb(shade)])
    return shade


def write_page(path: pathlib.Path, size: tuple[float, float], fill: Callable[[Figure], None]) -> None:
    """Draw a page and write it, whole or not at all; a PNG in few colours, a third as large as in all."""
    if path.suffix.lower() != ".png":
        write_figure(path, size, fill)
        return
    image, plugins = optional("PIL.Image"), optional("PIL.PngImagePlugin")
    with tempfile.TemporaryDirectory() as scratch, replacing(path) as temporary:
        whole, told = pathlib.Path(scratch) / path.name, plugins.PngInfo()
        write_figure(whole, size, fill)
        with image.open(whole) as picture:
            few = picture.convert("RGB").quantize(SHADES, dither=image.Dither.NONE)
        told.add_itxt("Description", written(whole))
        few.save(temporary, format="PNG", optimize=True, dpi=(RESOLUTION, RESOLUTION), pnginfo=told)
