"""The design picture: an orthosis on its leg with dimensions, and what its muscles do over the angle."""

import functools
import os
import pathlib
from collections.abc import Sequence
from typing import Any, Literal, overload

from afo_sim.common.errors import InputError, unknown
from afo_sim.common.writing import check_writable, replacing
from afo_sim.model.air_scheme import AirScheme
from afo_sim.model.design import Design, Source, design
from afo_sim.show.air_drawing import scheme_of, write_air
from afo_sim.show.drawing_curves import draw_curves
from afo_sim.show.drawing_files import write_page
from afo_sim.show.drawing_table import draw_table
from afo_sim.show.drawing_views import Box, front_view, scale_of, side_view
from afo_sim.show.style import FORMATS, LINE, plain

PAGE = (297.0 / 25.4, 210.0 / 25.4)  # A4 landscape [inch]
SIDE: Box = (0.35, 1.8, 4.9, 5.65)
FRONT: Box = (5.2, 1.8, 1.65, 5.65)
CURVES: Box = (7.3, 2.2, 4.05, 5.25)
TABLE: Box = (0.35, 0.15, 11.0, 1.5)
GAP = 0.24  # between panels [inch]
RERUN = "rrd"
ALLOWED = (*FORMATS, RERUN)
DESIGN, AIR = "design", "air"
VIEWS = {DESIGN: ALLOWED, AIR: FORMATS}  # what is drawn, and the formats that there are of it
View = Literal["design", "air"]


def page(figure: Any, design: Design) -> None:
    """Fill an empty figure of PAGE's size."""
    figure.set_layout_engine("none")
    scenario = design.built.scenario
    heading = f"{plain(scenario.orthosis.name or 'orthosis')} on {plain(scenario.leg.name or 'leg')}: design"
    figure.text(SIDE[0] / PAGE[0], 0.975, heading, fontsize=12.0, weight="bold", va="top")
    told = plain(scenario.orthosis.description, LINE + 60)
    figure.text(SIDE[0] / PAGE[0], 0.945, told, fontsize=8.0, va="top", color="0.25")
    scale = scale_of(design, SIDE)
    side_view(_axis(figure, SIDE), design, SIDE, scale)
    front_view(_axis(figure, FRONT), design, FRONT, scale)
    left, bottom, width, height = CURVES
    each = (height - 3.0 * GAP) / 4.0
    boxes = [(left, bottom + (3 - k) * (each + GAP), width, each) for k in range(4)]
    draw_curves([_axis(figure, box) for box in boxes], design)
    draw_table(_axis(figure, TABLE), design)


def _axis(figure: Any, box: Box) -> Any:
    left, bottom, width, height = box
    return figure.add_axes((left / PAGE[0], bottom / PAGE[1], width / PAGE[0], height / PAGE[1]))


def suffix_of(path: pathlib.Path, view: str = DESIGN) -> str:
    """The format that a file's name asks for."""
    suffix = path.suffix.lower().removeprefix(".")
    if suffix not in VIEWS[view]:
        allowed = ", ".join(f".{each}" for each in VIEWS[view])
        raise InputError("is not a format of a drawing", file=path, allowed=f"a name that ends in {allowed}")
    return suffix


def check_files(paths: Sequence[pathlib.Path], *, force: bool = False, view: str = DESIGN) -> None:
    """Refuse files that cannot be written, or that are there already, before anything is computed.

    Raises
    ------
    InputError
        A suffix is none of the view's, a file is there and `force` is false, or a folder cannot be
        written to.
    """
    for path in paths:
        suffix_of(path, view)
        if path.is_dir():
            raise InputError("is a folder, and a file of that name is to be written", file=path)
        if path.exists() and not force:
            raise InputError("is there already", file=path, allowed="another name, or --force to replace it")
        check_writable(path.parent)


def write_drawing(found: Design, path: pathlib.Path) -> None:
    """Draw a design and write it, whole or not at all.

    Parameters
    ----------
    found : the design
    path : file to write; PNG, PDF and SVG are the page, RRD is the leg in motion for the Rerun viewer
    """
    if suffix_of(path) == RERUN:
        from afo_sim.show.rerun.design import write_design

        with replacing(path) as temporary:
            write_design(found, temporary)
        return
    write_page(path, PAGE, functools.partial(page, design=found))


@overload
def draw(
    orthosis: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    leg: str | None = None,
    pressure: float | str | None = None,
    view: Literal["design"] = "design",
) -> Design: ...


@overload
def draw(
    orthosis: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    leg: str | None = None,
    pressure: float | str | None = None,
    view: Literal["air"],
) -> AirScheme: ...


def draw(
    orthosis: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    leg: str | None = None,
    pressure: float | str | None = None,
    view: View = "design",
) -> Design | AirScheme:
    """Draw an orthosis on its leg: to scale with dimensions, and what its muscles do over the angle.

    The view "air" is a schematic of its air path instead, from the source to the muscles.

    Parameters
    ----------
    orthosis : a shipped orthosis or scenario, the TOML file or folder of one, an Orthosis or a Scenario
    out : file to write, replaced whole: png, pdf or svg, or rrd of a design for the Rerun viewer; by default
        nothing
    leg : of a design: a shipped name or a file; the scenario's own by default
    pressure : gauge, [Pa] or text such as "4 bar"; the scenario's supply by default
    view : "design" or "air"

    Returns
    -------
    Design: `facts` (lengths, contraction, moment arm, torque of every group), `through` and `warnings`. Of
    the view "air" AirScheme: `nodes`, `edges`, and of every chamber the ways of `filling` and `venting` with
    their `conductance` [m³/(s·Pa)] and `narrowest` part

    Raises
    ------
    InputError
        There is no such orthosis or view, it has no muscle or cannot be built; the suffix is no format.

    Examples
    --------
    >>> front = draw("s1", pressure="4 bar").facts[0]
    >>> front.name, round(1000 * front.arm[front.at(0.0)])  # [mm]
    ('dorsiflexor', 65)
    >>> draw("s1_waist", view="air").filling["dorsiflexor"].narrowest
    'dorsiflexor inlet'
    """
    path = None if out is None else pathlib.Path(out)
    if view not in VIEWS:
        raise unknown(view, VIEWS, field="view", problem="is not a valid view")
    if path is not None:
        check_files([path], force=True, view=view)
    if view == AIR:
        return _draw_air(orthosis, path, leg, pressure)
    found = design(orthosis, leg=leg, pressure=pressure)
    if path is not None:
        write_drawing(found, path)
    return found


def _draw_air(
    orthosis: Source, path: pathlib.Path | None, leg: str | None, pressure: float | str | None
) -> AirScheme:
    refuse_leg(leg)
    scheme = scheme_of(orthosis, pressure)
    if path is not None:
        write_air(scheme, path)
    return scheme


def refuse_leg(leg: str | None, field: str = "leg") -> None:
    """Refuse a leg where an air path is drawn, which has none."""
    if leg is not None:
        raise InputError(
            "has no effect: the air path is the orthosis' own", field=field, value=leg, allowed="no leg"
        )
