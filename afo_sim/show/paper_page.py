"""A paper's page: every claim with both numbers and its command, and its figures redrawn, in one file."""

import base64
import pathlib

from afo_sim.common import together, write_text
from afo_sim.lab import KINDS, OUTCOMES, Paper
from afo_sim.show.paper_figures import write_figures
from afo_sim.show.report import rendered


def write_paper(paper: Paper, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write paper.html, and each figure as PNG and PDF, into a folder: the files."""
    with together(folder) as scratch:
        files = write_figures(paper.name, scratch)
        pictures = [file for file in files if file.suffix == ".png"]
        images = [(file.stem, base64.b64encode(file.read_bytes()).decode()) for file in pictures]
        same = {"paper": paper, "kinds": KINDS, "words": OUTCOMES}
        write_text(scratch / "paper.html", rendered("paper.html.j2", figures=images, **same))
    return [folder / "paper.html", *(folder / file.name for file in files)]
