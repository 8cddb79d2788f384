"""Where everything stands in the viewer."""

import rerun.blueprint as rrb
from rerun.encodings import AbsoluteTimeRange

TIMELINE = "sim_time"


def blueprint(
    valves: int,
    cycle: float,
    *,
    joint: str = "ankle",
    positive: str = "dorsiflexion",
    compared: bool = False,
) -> rrb.Blueprint:
    """The layout: leg on the left; plots, valve lanes and text on the right.

    Parameters
    ----------
    valves : number of valve lanes
    cycle : the timer's period [s]; the first one is selected, and repeats when played
    joint, positive : what the joint and its positive direction are called
    compared : several runs side by side
    """
    legend = rrb.PlotLegend(corner="RightTop")

    def plot(origin: str, name: str) -> rrb.TimeSeriesView:
        link = rrb.TimeAxis(link="LinkToGlobal")
        return rrb.TimeSeriesView(origin=origin, name=name, axis_x=link, plot_legend=legend)

    lanes = rrb.StateTimelineView(origin="/valves", name="valves")
    texts = [
        plot("/contraction", "contraction [%]"),
        rrb.TextLogView(origin="/events", name="events"),
        rrb.TextDocumentView(origin="/summary", name="metrics"),
        rrb.TextDocumentView(origin="/scenario", name="scenario"),
    ]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world",
                name="runs overlaid" if compared else "device",
                line_grid=False,
                background=[28, 30, 34],
                eye_controls=rrb.EyeControls3D(
                    kind="Orbital",
                    position=(0.46, -0.72, 0.56),
                    look_target=(0.03, 0.0, 0.43),
                    eye_up=(0, 0, 1),
                ),
            ),
            rrb.Vertical(
                plot("/angle", f"{joint} angle [deg], {positive} +"),
                plot("/moment", f"{joint} moment [N·m], {positive} +"),
                plot("/pressure", "gauge pressure [bar]"),
                lanes,
                rrb.Tabs(plot("/force", "muscle force [N]"), *texts, active_tab=0),
                row_shares=[3, 3, 2.6, 1.0 + 0.8 * valves, 3],
            ),
            column_shares=[3, 4],
        ),
        rrb.TimePanel(
            state="collapsed",
            timeline=TIMELINE,
            play_state="paused",
            loop_mode="selection",
            time_selection=AbsoluteTimeRange(min=0, max=round(cycle * 1e9)),
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )
