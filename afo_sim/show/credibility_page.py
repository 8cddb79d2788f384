"""The page of a credibility assessment, and its JSON."""

import pathlib

from afo_sim.common import json_text, together, write_text
from afo_sim.lab.credibility import Credibility
from afo_sim.metrics import UNITS, number, words
from afo_sim.show.report import rendered

FILES = ("credibility.html", "credibility.json")


def write_credibility(found: Credibility, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write page and JSON into a folder: the files."""
    a, keys = found.answer, ("low", "value", "high", "wanted", "bad")
    ends = {key: a[key] for key in keys if a[key] is not None}
    low, wide = min(ends.values()), max(max(ends.values()) - min(ends.values()), 1e-12)
    at = {key: 8.0 + 84.0 * (end - low) / wide for key, end in ends.items()}  # percent of the bar
    told = {key: number(a[key], a["unit"]) for key in at}
    names = {"label": words(found.asked["metric"]).label, "unit": UNITS.get(a["unit"], a["unit"])}
    page = rendered("credibility.html.j2", found=found.to_json(), at=at, told=told, **names)
    with together(folder, FILES) as scratch:
        write_text(scratch / FILES[0], page)
        write_text(scratch / FILES[1], json_text(found.to_json()))
    return [folder / name for name in FILES]
