"""Plotted lines: their places, names, colours and values."""

import itertools
from dataclasses import dataclass, field

import numpy as np
import rerun as rr

import afo_sim.show.rerun.colours as colours
from afo_sim.description import WORN, MuscleGroup
from afo_sim.model import OUTLET, SOURCE, TUBE_END, VALVE_END, muscle_names
from afo_sim.physics import AIR
from afo_sim.show.panels import FLOWS, PER_MINUTE
from afo_sim.show.rerun.run_rows import GAIT, Columns, Source, send

_ANGLES = ("ankle/angle", "gait/ankle_angle")
_USUAL, _THIN = 1.6, 0.8  # widths of lines
_SET_PRESSURE = "supply/set_pressure"
_OWN = {"biological": "own"}  # what a moment is called beside the orthosis'
_SMALL = ("gravity", "frame")  # moments of a few N·m, left out beside walking's hundred


@dataclass(frozen=True)
class Curve:
    """One plotted line: where, its name and colour, and its column, less an amount, × factor."""

    entity: str
    name: str
    colour: list[int]
    column: str
    factor: float = 1.0
    less: float = 0.0  # in the column's unit
    width: float = field(default=_USUAL, kw_only=True)

    def values(self, block: Columns) -> np.ndarray:
        """The plotted values. Angles go through `np.degrees`, so that they are its very bits."""
        values = block[self.column]
        return np.degrees(values) if self.column in _ANGLES else (values - self.less) * self.factor


def _air_curves(source: Source) -> list[Curve]:
    """Lines of a run's air path; none where its valves hang on endless air and the ambient air alone."""
    if not any(source.named(kind) for kind in ("volume", "store", "restriction")):
        return []
    found = [Curve("pressure/chambers", "supply", colours.GREY, "supply/pressure", 1e-5, width=_THIN)]
    free = itertools.cycle(colours.VOLUMES)
    ends = {VALVE_END.format(chamber): chamber for chamber in source.named("chamber")}
    far = {TUBE_END.format(chamber): f"{chamber}, tube end" for chamber in source.named("chamber")}
    for name in source.named("volume"):
        if name == SOURCE or (name == OUTLET and _SET_PRESSURE in source.columns):
            continue
        label, shade = ({OUTLET: "regulator"} | far).get(name, name), list(next(free))
        if name in ends:
            label, shade = f"{ends[name]}, valve end", colours.of_path(f"{ends[name]}_1", True)
        found.append(Curve("pressure/chambers", label, shade, f"volume/{name}/pressure", 1e-5, width=_THIN))
    described = source.scenario.supply.source
    litres = PER_MINUTE / (AIR if described is None else described.real_gas).free_density
    for (column, (name, *_)), colour in zip(FLOWS.items(), (colours.SKY, colours.ORANGE), strict=True):
        if column in source.columns:
            found.append(Curve("air/flow", name, colour, column, litres))
    return found


def curves(source: Source) -> list[Curve]:
    """Every line of a run's plots."""
    found = [Curve("angle/ankle", "own", colours.WHITE, "ankle/angle")]
    if source.walks:
        found.append(Curve("angle/recorded", "recorded", colours.HEALTHY, "gait/ankle_angle"))
    absent = (() if source.named("muscle") else ("orthosis",)) + (_SMALL if source.walks else ())
    for name, colour in colours.MOMENTS.items():
        if f"ankle/moment/{name}" in source.columns and name not in absent:
            found.append(Curve("moment/ankle", _OWN.get(name, name), colour, f"ankle/moment/{name}"))
    if source.walks:
        shown = colours.SOLE.items()
        found += [Curve("clearance/foot", n, own, f"{n}/height", 1e3) for n, (own, _) in shown]
        for name, (_, dim) in shown:
            found.append(Curve("clearance/recorded", f"recorded {name}", dim, f"gait/{name}_height", 1e3))
        for axis, (name, colour) in colours.FORCE.items():
            found.append(Curve("ground/force", name, colour, f"ground/force/{axis}"))
    for chamber in source.named("chamber"):
        shade = colours.of_muscle(f"{chamber}_1")
        found.append(Curve("pressure/chambers", chamber, shade, f"chamber/{chamber}/pressure", 1e-5))
    found += _air_curves(source)
    for muscle, label, _ in _drawn_muscles(source):
        shade = colours.of_muscle(muscle)
        found.append(Curve("force/muscles", label, shade, f"muscle/{muscle}/force"))
        found.append(Curve("contraction/muscles", label, shade, f"muscle/{muscle}/contraction", 100.0))
    for muscle, label, group in _drawn_muscles(source):
        label = muscle.rsplit("_", 1)[0] if group.alike else label
        shade, path = colours.of_muscle(muscle), f"muscle/{muscle}/path_length"
        found.append(Curve("length/muscles", label, shade, f"muscle/{muscle}/length", 1e3))
        shade = colours.of_path(muscle, group.alike)
        # what the muscle would have on rigid cable, cuff and plate: its path less all that is in series
        found.append(Curve("length/muscles", f"{label}, path", shade, path, 1e3, group.series_length))
    for anchor in source.named("cuff"):
        name, colour = WORN[anchor], colours.MOUNTINGS[WORN[anchor]]
        found.append(Curve("mounting/gives/ends", name, colour, f"cuff/{anchor}/displacement", 1e3))
        found.append(Curve("mounting/pull/ends", name, colour, f"cuff/{anchor}/force"))
    return found


def _drawn_muscles(source: Source) -> list[tuple[str, str, MuscleGroup]]:
    """(muscle, its name in a plot, its group): of a group whose muscles are alike the first, for all."""
    found = []
    for muscle, group in muscle_names(source.scenario.orthosis).items():
        name, number = muscle.rsplit("_", 1)
        if group.alike and number == "1":
            found.append((muscle, name if group.count == 1 else f"{name} 1–{group.count}", group))
        elif not group.alike:
            found.append((muscle, f"{name} {number}", group))
    return found


def compared_curves(source: Source, label: str, number: int, *, recorded: bool) -> list[Curve]:
    """A run's lines among other runs': one colour a run, and one line of it in each plot."""
    colour, found = colours.of_run(number), list[Curve]()

    def draw(plot: str, column: str, factor: float = 1.0) -> None:
        found.append(Curve(f"{plot}/{label}", label, colour, column, factor))

    draw("angle", "ankle/angle")
    if recorded:
        found.append(Curve("angle/recorded", "recorded", colours.HEALTHY, "gait/ankle_angle"))
        column = "gait/toe_height"
        found.append(Curve("clearance/recorded", "recorded", colours.HEALTHY, column, 1e3))
    if source.walks:
        draw("clearance", "toe/height", 1e3)
        draw("moment/own", "ankle/moment/biological")
    if source.named("muscle"):
        draw("moment/orthosis", "ankle/moment/orthosis")
    for chamber in source.named("chamber"):
        draw(f"pressure/{chamber}", f"chamber/{chamber}/pressure", 1e-5)
    for muscle in source.named("muscle"):
        group, nth = muscle.rsplit("_", 1)
        if nth == "1":
            draw(f"force/{group}", f"muscle/{muscle}/force")
            draw(f"contraction/{group}", f"muscle/{muscle}/contraction", 100.0)
    for anchor in source.named("cuff"):
        draw(f"mounting/gives/{WORN[anchor]}", f"cuff/{anchor}/displacement", 1e3)
        draw(f"mounting/pull/{WORN[anchor]}", f"cuff/{anchor}/force")
    return found


def plots_of(lines: list[Curve]) -> dict[str, list[Curve]]:
    """{entity of a plot: its lines}, for plots that lie directly above their lines' entities."""
    plots: dict[str, list[Curve]] = {}
    for line in lines:
        plots.setdefault(f"/{line.entity.rsplit('/', 1)[0]}", []).append(line)
    return plots


def log_styles(stream: rr.RecordingStream, lines: list[Curve]) -> None:
    """Names and colours of the lines, once."""
    for entity, group in _by_entity(lines).items():
        names, shades, widths = zip(*((c.name, c.colour, c.width) for c in group), strict=True)
        stream.log(entity, rr.SeriesLines(names=names, colors=shades, widths=widths), static=True)


def columns_of(source: Source, lines: list[Curve]) -> list[str]:
    """The columns to read for some lines."""
    clock = ["time", *(GAIT if source.walks else ())]
    return list(dict.fromkeys([*clock, *(line.column for line in lines)]))


def log_curves(stream: rr.RecordingStream, lines: list[Curve], block: Columns) -> None:
    """The lines of a block of rows."""
    for entity, group in _by_entity(lines).items():
        values = np.column_stack([c.values(block) for c in group])
        send(stream, entity, block, rr.Scalars.columns(scalars=values))


def log_limits(stream: rr.RecordingStream, sources: list[Source], ends: Columns) -> None:
    """Log the lines' limits: the device's range of motion, and the floor."""
    for device in [source for source in sources if source.named("muscle")][:1]:
        limits = np.degrees(device.scenario.orthosis.range_of_motion)
        levels = np.tile(limits, (2, 1))
        log_line(stream, "angle/range", ends, levels, "range of motion", colours.RANGE, 1.0)
    if any(source.walks for source in sources):
        log_line(stream, "clearance/floor", ends, np.zeros(2), "floor", colours.FLOOR, 1.0)


def log_line(
    stream: rr.RecordingStream,
    entity: str,
    rows: Columns,
    values: np.ndarray,
    name: str,
    colour: list[int],
    width: float = _USUAL,
) -> None:
    """One line, or as many alike as there are columns, with their name, colour and width."""
    count = 1 if values.ndim == 1 else values.shape[1]
    style = rr.SeriesLines(names=[name] * count, colors=[colour] * count, widths=[width] * count)
    stream.log(entity, style, static=True)
    send(stream, entity, rows, rr.Scalars.columns(scalars=values))


def _by_entity(lines: list[Curve]) -> dict[str, list[Curve]]:
    groups: dict[str, list[Curve]] = {}
    for line in lines:
        groups.setdefault(line.entity, []).append(line)
    return groups
