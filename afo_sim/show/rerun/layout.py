"""The layout of the viewer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import rerun.blueprint as rrb
from rerun.encodings import AbsoluteTimeRange

from afo_sim.common import Foreign, Keywords
from afo_sim.show.rerun.run_rows import STRIDES, TIMELINE

View = Foreign  # or a container of them
Row = tuple[View, float]  # a view; its share of a column, or its height as a negative number [pixel]
CAMERA = ((0.46, -0.72, 0.56), (0.03, 0.0, 0.43))  # beside a seated leg: where it is, where it looks [m]
_CARRIAGE_CAMERA = ((0.12, -1.3, 0.53), (0.05, 0.0, 0.46))  # beside a walking one, from the carriage [m]


HEIGHT = 650.0  # that the views share in the smallest usual window, 1280 × 720 [pixel]
_LANE, _LANES_HEAD = 40.0, 60.0  # heights of a lane, and of what is above the lanes [pixel]
_ANSWER, _ANSWERS = 185.0, 260.0  # heights of the answer of one run, of several [pixel]
TITLE = 90  # letters of a plot's title in that window


@dataclass(frozen=True)
class Contents:
    """The contents to lay out."""

    valves: int
    loop: float
    muscles: bool = True
    mountings: bool = False
    compared: bool = False
    carriage: str = ""
    trails: tuple[str, ...] = ()
    stride: float = 1.0
    lanes: int = 2
    joint: str = "ankle"
    positive: str = "dorsiflexion"
    plots: Mapping[str, str] = field(default_factory=dict)
    runs: str = ""
    answer: bool = False


def blueprint(contents: Contents) -> rrb.Blueprint:
    """The layout: leg on the left; plots, lanes and text on the right."""
    return closed(
        _walking(contents) if contents.carriage else _sitting(contents),
        play_state="paused",
        loop_mode="selection",
        time_selection=AbsoluteTimeRange(min=0, max=round(contents.loop * 1e9)),
    )


def closed(body: View, timeline: str = TIMELINE, **time: object) -> rrb.Blueprint:
    """A layout with all panels collapsed, and the time panel's settings."""
    return rrb.Blueprint(
        body,
        rrb.TimePanel(state="collapsed", timeline=timeline, **time),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _sitting(contents: Contents) -> rrb.Horizontal:
    pressure = (_plots(contents, "/pressure", "gauge pressure [bar]"), 2.6)
    valves = (_lanes("/valves", "valves, coloured where open"), -_tall(contents.valves, 0.35))
    rows = [*_answer(contents), *_joint(contents), *([pressure] if contents.muscles else []), valves]
    return rrb.Horizontal(
        space("/world", contents.runs or "device", *CAMERA, contents="/world/**"),
        _column([*rows, _tabs(contents)]),
        column_shares=[3, 4],
    )


def _walking(contents: Contents) -> rrb.Horizontal:
    """As for sitting, with the gait lanes under the leg, and the clearance of the sole."""
    lanes = _tall(contents.lanes + contents.valves, 0.5)
    title = "gait: stance green, swing blue"
    title += "; valves coloured where open" if contents.valves else ""
    rows = [*_answer(contents), (_plots(contents, "/clearance", "sole height [mm]"), 3.0)]
    one_stride = [  # for so long a trail is seen
        rrb.VisibleTimeRange(
            timeline,
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-duration),
            end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0),
        )
        for timeline, duration in ((TIMELINE, contents.stride), (STRIDES, 1.0))
    ]
    trails = {trail: rrb.VisibleTimeRanges(one_stride) for trail in contents.trails}
    name = contents.runs or "walking leg"
    leg = space(contents.carriage, name, *_CARRIAGE_CAMERA, contents="/world/**", overrides=trails)
    return rrb.Horizontal(
        rrb.Vertical(leg, _lanes("/", title, ["/gait/**", "/valves/**"]), row_shares=[HEIGHT - lanes, lanes]),
        _column([*rows, *_joint(contents), _tabs(contents)]),
        column_shares=[1, 1],
    )


def _tall(lanes: int, most: float) -> float:
    """Height of a view of lanes in the smallest window, at most a share of the whole [pixel]."""
    return min(_LANES_HEAD + _LANE * lanes, most * HEIGHT)


def _column(rows: list[Row]) -> rrb.Vertical:
    """Views under one another: those of a height that is told in pixels, negative, and the others' shares."""
    fixed = sum(-share for _, share in rows if share < 0.0)
    shares = sum(share for _, share in rows if share > 0.0)
    each = [-share if share < 0.0 else share / shares * (HEIGHT - fixed) for _, share in rows]
    return rrb.Vertical(*(view for view, _ in rows), row_shares=each)


def _answer(contents: Contents) -> list[Row]:
    if not contents.answer:
        return []
    height = _ANSWERS if contents.compared else _ANSWER
    return [(rrb.TextDocumentView(origin="/answer", name="in short"), -height)]


def _joint(contents: Contents) -> list[Row]:
    angle = _plots(contents, "/angle", f"{contents.joint} angle [deg], {contents.positive} +")
    return [(angle, 3.0)] if contents.answer else [(angle, 3.0), (_moment(contents), 3.0)]


def _moment(contents: Contents) -> View:
    return _plots(contents, "/moment", f"moment [N·m], {contents.positive} +", "moment")


def space(
    origin: str, name: str, position: Sequence[float], target: Sequence[float], **more: object
) -> rrb.Spatial3DView:
    """A view in space that turns about a point, z up."""
    eye = rrb.EyeControls3D(kind="Orbital", position=position, look_target=target, eye_up=(0, 0, 1))
    ground: Keywords = {"line_grid": False, "background": [28, 30, 34], "eye_controls": eye}
    return rrb.Spatial3DView(origin=origin, name=name, **ground, **more)


def _tabs(contents: Contents) -> Row:
    """The tabs, those that are looked at most first: all names do not fit in the smallest window."""
    plots: list[View] = [_moment(contents)] if contents.answer else []
    further: list[View] = []
    if contents.muscles and contents.carriage:
        plots.append(_plots(contents, "/pressure", "gauge pressure [bar]", "pressure"))
    if "/air" in contents.plots:
        further.append(_plots(contents, "/air", "air flow [l/min ANR]", "air"))
    if contents.muscles:
        plots.append(_plots(contents, "/force", "muscle force [N]", "force"))
        plots.append(_plots(contents, "/contraction", "contraction [%]", "contraction"))
    if contents.muscles and not contents.compared:
        further.append(_plots(contents, "/length", "length [mm]", "length"))
    if contents.mountings:
        gives = _plots(contents, "/mounting/gives", "gives [mm]")
        pull = _plots(contents, "/mounting/pull", "pull [N]")
        further.append(rrb.Horizontal(gives, pull, name="cuff"))
    if contents.carriage and not contents.compared:
        further.append(_plots(contents, "/ground", "ground force [N]", "ground"))
    plots.append(rrb.TextDocumentView(origin="/summary", name="metrics"))
    plots.append(rrb.TextLogView(origin="/events", name="events"))
    further.append(rrb.TextDocumentView(origin="/scenario", name="scenario"))
    return rrb.Tabs(*plots, *further, active_tab=0), 4.2


def _plots(contents: Contents, origin: str, title: str, tab: str = "") -> View:
    """The plot of an entity; of compared runs a plot for each part below it, beside one another."""
    parts = [plot for plot in contents.plots if plot.startswith(f"{origin}/")] if contents.compared else []
    if not parts:
        legend = contents.plots.get(origin, "")
        whole = f"{title}: {legend}" if legend else title
        fits = contents.compared or len(whole) <= TITLE
        plot = time_plot(origin, whole if fits else title, not fits)
        return rrb.Vertical(plot, name=tab) if tab else plot
    short = title.split(",")[0]  # beside one another there is no room for the direction
    views = [time_plot(part, f"{part.rsplit('/', 1)[1]}: {short}", False) for part in parts]
    return rrb.Horizontal(*views, name=tab or title)


def time_plot(origin: str, name: str, legend: bool) -> rrb.TimeSeriesView:
    """A plot with its lines in the title, or in a legend if they are too many."""
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        plot_legend=rrb.PlotLegend(corner="RightTop", visible=legend),
    )


def _lanes(origin: str, name: str, entities: list[str] | str = "$origin/**") -> rrb.StateTimelineView:
    return rrb.StateTimelineView(origin=origin, contents=entities, name=name)
