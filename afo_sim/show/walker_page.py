"""The pictures of a response, and its page."""

import pathlib

from afo_sim import walker
from afo_sim.common import JsonDict, write_text
from afo_sim.metrics import NO_DEVICE
from afo_sim.show.in_words import image
from afo_sim.show.patients_figure import draw_patients
from afo_sim.show.report import rendered
from afo_sim.show.walker_figure import draw_response
from afo_sim.show.walker_film import draw_film


def write_pictures(response: walker.Response, folder: pathlib.Path, *, rrd: bool) -> None:
    """Write walk.png, walk.gif, walk.html and, with rrd, walk.rrd into a folder that is there."""
    figure, film, _, recording = (folder / name for name in walker.PICTURES)
    draw_response(response, figure)
    draw_film(response, film)
    caption = "Of undisturbed walks; a dash where a case has no such number."
    shown: JsonDict = {"words": walker.in_words(response), "asked": walker.asked_in_words(response)}
    shown |= {"replies": walker.verdict(response), "tables": [("Numbers", caption, walker.table(response))]}
    _write_page(folder, f"{response.scenario.name}: a walker that responds", shown)
    if rrd:
        from afo_sim.show.rerun.walker_recording import write_response

        write_response(response, recording)


def write_population(population: walker.Population, recorded: walker.Recorded, folder: pathlib.Path) -> None:
    """Write walk.png and walk.html of a population into a folder that is there."""
    draw_patients(population, folder / walker.PICTURES[0])
    asked, words = population.asked, f"{len(population.drawn)} patients: {population.condition.description}."
    how = f"{asked['starts']} starts of each, pushed by {asked['push']:g} N; {asked['generations']} "
    how += f"generations of search now; seed {asked['seed']}; steps of {1e3 * asked['timestep']:g} ms."
    shown: JsonDict = {"words": [words], "asked": [how], "tables": walker.tables(population)}
    shown |= {"replies": walker.replies(population, recorded)}
    _write_page(folder, f"{population.scenario.name}: patients who respond", shown)


def _write_page(folder: pathlib.Path, title: str, shown: JsonDict) -> None:
    files = [folder / name for name in walker.PICTURES[:2]]
    figure, film = (image(file) if file.is_file() else "" for file in files)
    shown |= {"no_device": f"{walker.EXPERIMENTAL} {NO_DEVICE}", "figure": figure, "film": film}
    write_text(folder / walker.PICTURES[2], rendered("walk.html.j2", title=title, **shown))
