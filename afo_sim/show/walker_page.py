"""The pictures of a response, and its page."""

import base64
import pathlib
from collections.abc import Sequence

from afo_sim.common import write_text
from afo_sim.description import Scenario
from afo_sim.metrics import NO_DEVICE
from afo_sim.show.patients_figure import draw_patients
from afo_sim.show.report import rendered
from afo_sim.show.walker_figure import draw_response
from afo_sim.show.walker_film import draw_film
from afo_sim.walker import (
    EXPERIMENTAL,
    PICTURES,
    Population,
    Recorded,
    Reply,
    Response,
    Rows,
    asked_in_words,
    in_words,
    replies,
    table,
    tables,
    verdict,
)


def write_pictures(response: Response, folder: pathlib.Path, *, rrd: bool) -> None:
    """Write walk.png, walk.gif, walk.html and, with rrd, walk.rrd into a folder that is there."""
    figure, film, _, recording = (folder / name for name in PICTURES)
    draw_response(response, figure)
    draw_film(response, film)
    tables = [("Numbers", "Of undisturbed walks; a dash where a case has no such number.", table(response))]
    _write_page(
        folder, response.scenario, in_words(response), verdict(response), tables, asked_in_words(response)
    )
    if rrd:
        from afo_sim.show.rerun.walker_recording import write_response

        write_response(response, recording)


def write_population(population: Population, recorded: Recorded, folder: pathlib.Path) -> None:
    """Write walk.png and walk.html of a population into a folder that is there."""
    draw_patients(population, folder / PICTURES[0])
    condition, asked = population.condition, population.asked
    words = [f"{len(population.drawn)} patients: {condition.description}."]
    how = f"{asked['starts']} starts of each, pushed by {asked['push']:g} N; {asked['generations']} "
    how += f"generations of search now; seed {asked['seed']}; steps of {1e3 * asked['timestep']:g} ms."
    _write_page(folder, population.scenario, words, replies(population, recorded), tables(population), [how])


def _write_page(
    folder: pathlib.Path,
    scenario: Scenario,
    words: list[str],
    answers: Sequence[Reply],
    tables: Sequence[tuple[str, str, Rows]],
    asked: list[str],
) -> None:
    """Write walk.html with the pictures that lie beside it."""
    figure, film = (
        base64.b64encode(file.read_bytes()).decode() if file.is_file() else ""
        for file in (folder / name for name in PICTURES[:2])
    )
    page = rendered(
        "walk.html.j2",
        title=f"{scenario.name}: {'a walker that responds' if film else 'patients who respond'}",
        no_device=f"{EXPERIMENTAL} {NO_DEVICE}",
        words=words,
        replies=answers,
        tables=tables,
        figure=figure,
        film=film,
        asked=asked,
    )
    write_text(folder / PICTURES[2], page)
