"""The layout of the viewer."""

from dataclasses import dataclass
from typing import Any

import rerun.blueprint as rrb
from rerun.encodings import AbsoluteTimeRange

from afo_sim.show.rerun.clock import STRIDES, TIMELINE

CAMERA = ((0.46, -0.72, 0.56), (0.03, 0.0, 0.43))  # beside a seated leg: where it is, where it looks [m]
CARRIAGE_CAMERA = ((0.15, -0.95, 0.38), (0.02, 0.0, 0.23))  # beside a walking one, from the carriage [m]


@dataclass(frozen=True)
class Contents:
    """The contents to lay out.

    valves is the number of valve lanes; loop the time that is played over and over [s]; muscles whether
    any run has an orthosis, mountings whether any has a cuff or plate that gives; carriage the entity that
    a walk's camera rides on, trails the entities whose last stride is shown, stride its duration [s];
    compared, whether several runs are shown; joint and positive are what the joint and its positive
    direction are called.
    """

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


def blueprint(contents: Contents) -> rrb.Blueprint:
    """The layout: leg on the left; plots, lanes and text on the right."""
    body = _walking(contents) if contents.carriage else _sitting(contents)
    return rrb.Blueprint(
        body,
        rrb.TimePanel(
            state="collapsed",
            timeline=TIMELINE,
            play_state="paused",
            loop_mode="selection",
            time_selection=AbsoluteTimeRange(min=0, max=round(contents.loop * 1e9)),
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _sitting(contents: Contents) -> rrb.Horizontal:
    name = "runs overlaid" if contents.compared else "device"
    return rrb.Horizontal(
        _space(name, "/world", CAMERA),
        rrb.Vertical(
            _plot("/angle", f"{contents.joint} angle [deg], {contents.positive} +"),
            _plot("/moment", f"{contents.joint} moment [N·m], {contents.positive} +"),
            _plot("/pressure", "gauge pressure [bar]"),
            _lanes("/valves", "valves"),
            rrb.Tabs(*_details(contents), active_tab=0),
            row_shares=[3, 3, 2.6, 1.0 + 0.8 * contents.valves, 3],
        ),
        column_shares=[3, 4],
    )


def _walking(contents: Contents) -> rrb.Horizontal:
    """As for sitting, with the gait lanes under the leg, and the clearance of the sole."""
    name = "runs overlaid" if contents.compared else "walking leg"
    rows: list[tuple[Any, float]] = [
        (_plot("/clearance", "height of the sole above the floor [mm]"), 3.0),
        (_plot("/angle", f"{contents.joint} angle [deg], {contents.positive} +"), 3.0),
        (_plot("/moment", f"{contents.joint} moment [N·m], {contents.positive} +"), 3.0),
    ]
    if contents.muscles:
        rows.append((_plot("/pressure", "gauge pressure [bar]"), 2.4))
    rows.append((rrb.Tabs(*_details(contents), active_tab=0), 3.0))
    return rrb.Horizontal(
        rrb.Vertical(
            _space(name, contents.carriage, CARRIAGE_CAMERA, contents),
            _lanes("/", "gait and valves", ["/gait/**", "/valves/**"]),
            row_shares=[9.0, 1.1 + 0.6 * (contents.lanes + contents.valves)],
        ),
        rrb.Vertical(*(view for view, _ in rows), row_shares=[share for _, share in rows]),
        column_shares=[1, 1],
    )


def _space(
    name: str, origin: str, camera: tuple[Any, Any], contents: Contents | None = None
) -> rrb.Spatial3DView:
    """The scene as seen from an entity; trails are drawn over the time of one stride."""
    overrides = {}
    if contents is not None:
        last = [
            rrb.VisibleTimeRange(
                timeline,
                start=rrb.TimeRangeBoundary.cursor_relative(seconds=-duration),
                end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0),
            )
            for timeline, duration in ((TIMELINE, contents.stride), (STRIDES, 1.0))
        ]
        overrides = {trail: rrb.VisibleTimeRanges(last) for trail in contents.trails}
    position, target = camera
    return rrb.Spatial3DView(
        origin=origin,
        contents="/world/**",
        name=name,
        line_grid=False,
        background=[28, 30, 34],
        eye_controls=rrb.EyeControls3D(
            kind="Orbital", position=position, look_target=target, eye_up=(0, 0, 1)
        ),
        overrides=overrides,
    )


def _details(contents: Contents) -> list[Any]:
    plots: list[Any] = []
    if contents.muscles:
        contraction, length = _plot("/contraction", "contraction [%]"), _plot("/length", "length [mm]")
        both = rrb.Horizontal(contraction, length, name="contraction")
        plots += [_plot("/force", "muscle force [N]"), contraction if contents.compared else both]
    if contents.mountings:
        gives = _plot("/mounting/gives", "mounting gives [mm]")
        pull = _plot("/mounting/pull", "pull on it [N]")
        plots.append(rrb.Horizontal(gives, pull, name="cuff"))
    if contents.carriage and not contents.compared:
        plots.append(_plot("/ground", "ground force [N]"))
    return [
        *plots,
        rrb.TextLogView(origin="/events", name="events"),
        rrb.TextDocumentView(origin="/summary", name="metrics"),
        rrb.TextDocumentView(origin="/scenario", name="scenario"),
    ]


def _plot(origin: str, name: str) -> rrb.TimeSeriesView:
    link, legend = rrb.TimeAxis(link="LinkToGlobal"), rrb.PlotLegend(corner="RightTop")
    return rrb.TimeSeriesView(origin=origin, name=name, axis_x=link, plot_legend=legend)


def _lanes(origin: str, name: str, entities: list[str] | str = "$origin/**") -> rrb.StateTimelineView:
    return rrb.StateTimelineView(origin=origin, contents=entities, name=name)
