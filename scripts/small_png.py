"""A picture as a PNG of few colours, small enough to be kept beside the text."""

import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
from PIL import Image

from afo_sim.show import write_figure

EXACT, COLOURS = 32, 96  # colours that are kept as they are, and all
LARGEST = 150_000  # [bytes]


def draw(path: pathlib.Path, size: tuple[float, float], fill: Callable[[Any], None]) -> None:
    """Draw a figure of a size [inch], and keep it with few colours."""
    write_figure(path, size, fill)
    save(Image.open(path), path)


def save(picture: Image.Image, path: pathlib.Path) -> None:
    """Write a picture as PNG of few colours; refuse one that is too large.

    Its most frequent colours stay as they are: a light shade beside white would be lost in a common palette.
    """
    pixels = np.asarray(picture.convert("RGB"))
    own, which, counts = np.unique(pixels.reshape(-1, 3), axis=0, return_inverse=True, return_counts=True)
    frequent = own[np.argsort(-counts)[:EXACT]]
    mixed = picture.convert("RGB").quantize(COLOURS - len(frequent), Image.Quantize.FASTOCTREE)
    others = np.array(mixed.getpalette(), dtype=int).reshape(-1, 3)[: COLOURS - len(frequent)]
    palette = np.vstack([frequent, others]).astype(int)
    # Pillow maps to a palette by rounded colours, which turns white into grey
    far = [((own.astype(int) - colour) ** 2).sum(axis=1) for colour in palette]
    few = Image.fromarray(np.argmin(far, axis=0)[which].reshape(pixels.shape[:2]).astype(np.uint8), "P")
    few.putpalette(palette.astype(np.uint8).ravel().tolist())
    few.save(path, optimize=True)
    size = path.stat().st_size
    print(f"written to {path}, {size / 1000.0:.0f} kB")
    if size > LARGEST:
        raise SystemExit(f"{path} is larger than {LARGEST} bytes")
