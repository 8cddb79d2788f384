"""Pages of drawings as files: their formats, and PNGs of few colours."""

import pathlib
import tempfile
from collections.abc import Callable
from typing import Any

from afo_sim.common.writing import replacing
from afo_sim.show.style import RESOLUTION, write_figure

SHADES = 96  # colours of a PNG


def write_page(path: pathlib.Path, size: tuple[float, float], fill: Callable[[Any], None]) -> None:
    """Draw a page and write it, whole or not at all; a PNG in few colours.

    Units: size [inch].
    """
    if path.suffix.lower() == ".png":
        _write_png(path, size, fill)
    else:
        write_figure(path, size, fill)


def _write_png(path: pathlib.Path, size: tuple[float, float], fill: Callable[[Any], None]) -> None:
    """A page of few colours, a third as large as one of all."""
    from PIL import Image

    with tempfile.TemporaryDirectory() as scratch, replacing(path) as temporary:
        whole = pathlib.Path(scratch) / "page.png"
        write_figure(whole, size, fill)
        with Image.open(whole) as picture:
            few = picture.convert("RGB").quantize(SHADES, dither=Image.Dither.NONE)
        few.save(temporary, format="PNG", optimize=True, dpi=(RESOLUTION, RESOLUTION))
