"""A design → Rerun: the leg over degrees of the ankle, or in time, at full pressure, with its curves."""

import pathlib

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from afo_sim.model import ANKLE, Design, PathFacts, muscle_names, pressure, rows
from afo_sim.show.moving_parts import Mountings
from afo_sim.show.rerun import colours, scene
from afo_sim.show.rerun.curves import log_line
from afo_sim.show.rerun.layout import CAMERA, closed, space, time_plot
from afo_sim.show.rerun.recording_file import recording
from afo_sim.show.rerun.run_rows import ANGLE, SWEPT, Columns
from afo_sim.show.rerun.texts import document

_SPEED = 10.0  # at which the ankle turns on the timeline of seconds [deg/s]
_PLOTS = {
    "contraction": "contraction [%]: path thin, muscle thick",
    "arm": "moment arm [mm]",
    "torque": "torque [N·m]",
    "length": "length [mm]: path thin, muscle with link and slack thick",
}


def write_design(design: Design, path: pathlib.Path) -> None:
    """Write a design, with its layout, as a Rerun file."""
    name = f"design: {design.built.scenario.orthosis.name}"
    model, groups = design.built.full_model, muscle_names(design.built.scenario.orthosis)
    stage = scene.Stage(model, groups, "world", 1.0, "force", Mountings(model, groups, ()))
    told = colours.in_words((entry.name, colours.of_run(k)) for k, entry in enumerate(design.facts))
    view = space("/world", f"at {pressure(design.facts[0])}: {told}", *CAMERA)
    plots = [time_plot(f"/{plot}", title, legend=False) for plot, title in _PLOTS.items()]
    text = rrb.TextDocumentView(origin="/summary", name="in words")
    right = rrb.Vertical(*plots[:3], rrb.Tabs(text, plots[3], active_tab=0))
    layout = closed(rrb.Horizontal(view, right, column_shares=[3, 4]), ANGLE, play_state="paused")
    with recording(path, name, layout) as stream:
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        scene.log_shapes(stream, stage)
        block = _swept(design)
        scene.log_poses(stream, stage, block)
        for number, entry in enumerate(design.facts):
            _log_curves(stream, entry, number, block)
        lines = [
            f"# {design.built.scenario.orthosis.name} on {design.built.scenario.leg.name}",
            "",
            "| | |",
            "|---|---|",
            *(f"| {what} | {found} |" for entry in design.facts for what, found in rows(entry)),
            "",
            *(f"- {warning}" for warning in design.warnings),
        ]
        document(stream, "summary", "\n".join(lines))


def _swept(design: Design) -> Columns:
    """The columns that leg and muscles are drawn from, at every whole degree between the ankle's stops."""
    low, high = np.degrees(design.facts[0].angles[[0, -1]])
    degrees = np.arange(np.ceil(low - 1e-6), np.floor(high + 1e-6) + 1.0)
    angles = np.radians(degrees)
    model = design.built.full_model
    block: Columns = {SWEPT: degrees, "time": (degrees - degrees[0]) / _SPEED}
    for joint in range(model.njnt):
        name = model.joint(joint).name
        block[f"qpos/{name}"] = angles if name == ANKLE else np.zeros(len(angles))
    for entry in design.facts:
        kind = entry.group.type

        def at(values: np.ndarray, entry: PathFacts = entry) -> np.ndarray:
            return np.interp(angles, entry.angles, values)

        own = at(entry.own[:, -1])
        gained = entry.group.series_length - entry.hardware  # a pulley's path is measured from elsewhere
        for muscle in entry.muscles:
            block[f"muscle/{muscle}/contraction"] = own
            block[f"muscle/{muscle}/length"] = kind.nominal_length * (1.0 - own)
            block[f"muscle/{muscle}/force"] = at(entry.force[:, -1])
            block[f"muscle/{muscle}/path_length"] = at(entry.length) + gained
        block[f"chamber/{entry.chamber}/pressure"] = np.full(len(angles), entry.pressures[-1])
    return block


def _log_curves(stream: rr.RecordingStream, entry: PathFacts, number: int, block: Columns) -> None:
    """Lines of one group, with their colour, name and width."""
    colour, angles = colours.of_run(number), np.radians(block[SWEPT])
    full, thin, thick = pressure(entry), 1.0, 2.2
    lines: list[tuple[str, str, np.ndarray, float]] = [
        ("contraction", "path", 100.0 * entry.path, thin),
        ("contraction", full, 100.0 * entry.own[:, -1], thick),
        ("contraction", "no air", 100.0 * entry.own[:, 0], 1.5),
        ("arm", "arm", 1e3 * entry.arm, thick),
        ("length", "path", 1e3 * entry.length, thin),
        ("length", full, 1e3 * entry.chain_length[:, -1], thick),
        *(
            ("torque", f"{p * 1e-5:g} bar", entry.torque[:, k], thin + 0.6 * k)
            for k, p in enumerate(entry.pressures)
        ),
    ]
    for plot, what, values, width in lines:
        entity = f"{plot}/{entry.name.replace(' ', '_').replace(',', '')}/{what.replace(' ', '_')}"
        shown = np.interp(angles, entry.angles, values)
        log_line(stream, entity, block, shown, f"{entry.name}, {what}", colour, width)
