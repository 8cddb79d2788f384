"""The pictures of a response, and its page."""

import base64
import pathlib

from afo_sim.common import write_text
from afo_sim.metrics import NO_DEVICE
from afo_sim.show.report import rendered
from afo_sim.show.walker_figure import draw_response
from afo_sim.show.walker_film import draw_film
from afo_sim.walker import EXPERIMENTAL, PICTURES, Response, asked_in_words, in_words, table, verdict


def write_pictures(response: Response, folder: pathlib.Path, *, rrd: bool) -> None:
    """Write walk.png, walk.gif, walk.html and, with rrd, walk.rrd into a folder that is there."""
    figure, film, html, recording = (folder / name for name in PICTURES)
    draw_response(response, figure)
    draw_film(response, film)
    tables = [("Numbers", "Of undisturbed walks; a dash where a case has no such number.", table(response))]
    if drawn := response.asked.get("drawn"):
        falls = "Falls among perturbed starts, of patients drawn over what is not known of this one."
        tables.append((f"{drawn['draws']} drawn patients", falls, drawn["table"]))
    page = rendered(
        "walk.html.j2",
        title=f"{response.scenario.name}: a walker that responds",
        no_device=f"{EXPERIMENTAL} {NO_DEVICE}",
        words=in_words(response),
        replies=verdict(response),
        tables=tables,
        figure=base64.b64encode(figure.read_bytes()).decode(),
        film=base64.b64encode(film.read_bytes()).decode(),
        asked=asked_in_words(response),
    )
    write_text(html, page)
    if rrd:
        from afo_sim.show.rerun.walker_recording import write_response

        write_response(response, recording)
