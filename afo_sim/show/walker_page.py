"""The pictures of a response, and its page."""

import base64
import pathlib

from afo_sim.show.report import rendered
from afo_sim.show.style import plain
from afo_sim.show.walker_figure import draw_response
from afo_sim.show.walker_film import draw_film
from afo_sim.walker import PICTURES, Response, table, verdict


def write_pictures(response: Response, folder: pathlib.Path, *, rrd: bool) -> None:
    """Write walk.png, walk.gif, walk.html and, where it is asked for, walk.rrd into a folder.

    Parameters
    ----------
    response : what `respond` gives
    folder : that is there
    rrd : whether the Rerun recording is written
    """
    figure, film, html, recording = (folder / name for name in PICTURES)
    draw_response(response, figure)
    draw_film(response, film)
    html.write_text(response_page(response, figure), encoding="utf-8")
    if rrd:
        from afo_sim.show.rerun.walker_recording import write_response

        write_response(response, recording)


def response_page(response: Response, picture: pathlib.Path) -> str:
    """The HTML text of a response: answers, table, and its figure.

    Parameters
    ----------
    response : what `respond` gives
    picture : its figure, as PNG; it becomes a part of the page
    """
    header, rows = table(response)
    figure = base64.b64encode(picture.read_bytes()).decode()
    title = f"{plain(response.scenario.name, None)}: a responding walk"
    return rendered(
        "walk.html.j2",
        title=title,
        replies=verdict(response),
        header=header,
        rows=rows,
        figure=figure,
        asked=[(name, value) for name, value in response.asked.items() if value not in ({}, None)],
    )
