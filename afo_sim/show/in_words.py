"""What a figure shows in words: for readers who do not see it, in a page and in the picture's own file."""

import base64
import html
import pathlib
import re

import numpy as np

from afo_sim.common import Foreign

_MINUS = str.maketrans("-", "−")


def described(figure: Foreign) -> str:
    """A figure's title, and of each panel what over what, its named curves and bars from where to where."""
    told = [*map(_said, figure.texts)]
    for axis in figure.axes:
        # without upright lines, whose height is the panel's
        lines = [line for line in axis.lines if line.get_transform() != axis.get_xaxis_transform()]
        drawn = [(line.get_label(), line.get_ydata()) for line in lines]
        drawn += [(bars.get_label(), getattr(bars, "datavalues", ())) for bars in axis.containers]
        drawn += [("colours", each.get_array()) for each in axis.collections if each.get_array() is not None]
        ranges = [
            f"{unescaped(label)} {ends}" for label, y in drawn if label[:1] != "_" and (ends := _ends(y))
        ]
        title, up, across = map(_said, (axis._left_title, axis.yaxis.label, axis.xaxis.label))
        words, extent = ", ".join(filter(None, (title or axis.get_title(), up))), "interval" + "xy"[bool(up)]
        words += f" over {across}" if across and up else across
        if not axis.axison:
            told += map(_said, axis.texts)
        elif words:
            told.append(f"{words}: {'; '.join(ranges) or _ends(getattr(axis.dataLim, extent))}")
    return " ".join(f"{text}." for text in told if text)


def written(file: pathlib.Path) -> str:
    """What a PNG or a GIF says that it shows."""
    from PIL import Image

    with Image.open(file) as picture:
        return str(picture.info.get("Description") or picture.info.get("comment", b"").decode())


def image(file: pathlib.Path, style: str = "max-width: 100%") -> str:
    """A PNG or a GIF as an HTML element that holds it and says what it shows."""
    data = base64.b64encode(file.read_bytes()).decode()
    kind, words = file.suffix.removeprefix("."), html.escape(written(file))
    return f'<img style="{style}" alt="{words}" src="data:image/{kind};base64,{data}">'


def labelled(svg: str, name: str, title: str, words: str) -> str:
    """An SVG page that states its title and what it shows, with identifiers that begin with a name."""
    told = "".join(
        f'<{tag} id="{name}-{tag}">{html.escape(text)}</{tag}>'
        for tag, text in (("title", title), ("desc", words))
    )
    names = f'role="img" aria-labelledby="{name}-title {name}-desc"'
    return re.sub(r"<svg ([^>]*)>", lambda tag: f"<svg {names} {tag[1]}>{told}", svg, count=1)


def unescaped(text: str) -> str:
    """A text as it was before `plain` kept it from being read as mathematics."""
    return text.replace(r"\$", "$").strip()


def _said(text: Foreign) -> str:
    return unescaped(" ".join(text.get_text().split())) if text.get_visible() else ""


def _ends(values: np.ndarray) -> str:
    """The least and the most of what is known."""
    numbers = np.asarray(np.ma.filled(values, np.nan), float)
    known = np.where(np.abs(numbers) < 1e-13, 0.0, numbers)[np.isfinite(numbers)]  # of round-off
    return f"{known.min():.3g} to {known.max():.3g}".translate(_MINUS) if known.size else ""
