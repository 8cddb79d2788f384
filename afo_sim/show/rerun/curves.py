"""Plotted lines: their places, names, colours and values."""

from dataclasses import dataclass

import numpy as np
import rerun as rr

from afo_sim.model.mounting import muscle_names
from afo_sim.show.rerun.clock import GAIT, send
from afo_sim.show.rerun.source import Columns, Source

DORSIFLEXOR = ([230, 90, 70], [240, 150, 60], [235, 200, 80], [200, 70, 110], [250, 120, 120])
PLANTARFLEXOR = ([80, 150, 235], [90, 205, 220], [130, 120, 230], [70, 190, 150], [150, 180, 250])
RUNS = ([240, 240, 240], [250, 165, 50], [90, 190, 250], [120, 220, 120], [240, 110, 160])
MOMENTS = {
    "orthosis": [240, 150, 60],
    "passive": [225, 225, 225],
    "gravity": [150, 150, 240],
    "biological": [235, 110, 160],
    "ground": [110, 235, 120],
    "load": [220, 200, 90],
}
ANGLE, HEALTHY = [235, 235, 235], [80, 140, 220]
SOLE = {"toe": ([250, 200, 70], [140, 110, 40]), "ball": ([90, 190, 250], [50, 100, 140])}  # own, healthy
MOUNTINGS = {"shank": ("cuff", [235, 235, 235]), "foot": ("plate", [90, 205, 140])}
SMALL = ("gravity", "frame")  # moments of a few N·m, left out beside walking's hundred
ANGLES = ("ankle/angle", "gait/ankle_angle")


@dataclass(frozen=True)
class Curve:
    """One plotted line: where, its name and colour, and its column × factor."""

    entity: str
    name: str
    colour: list[int]
    column: str
    factor: float = 1.0

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that it reads."""
        return (self.column,)

    def values(self, block: Columns) -> np.ndarray:
        """The plotted values. Angles go through `np.degrees`, so that they are its very bits."""
        values = block[self.column]
        return np.degrees(values) if self.column in ANGLES else values * self.factor


@dataclass(frozen=True)
class PathLength(Curve):
    """Length that a muscle would have on rigid cable, cuff and plate: its path less all that is in series."""

    series: float = 0.0  # [m]

    def values(self, block: Columns) -> np.ndarray:
        found: np.ndarray = (block[self.column] - self.series) * self.factor
        return found


def curves(source: Source) -> list[Curve]:
    """Every line of a run's plots."""
    found = [Curve("angle/ankle", "angle", ANGLE, "ankle/angle")]
    if source.walks:
        found.append(Curve("angle/healthy", "healthy, recorded", HEALTHY, "gait/ankle_angle"))
    absent = (() if source.named("muscle") else ("orthosis",)) + (SMALL if source.walks else ())
    for name, colour in MOMENTS.items():
        if f"ankle/moment/{name}" in source.columns and name not in absent:
            found.append(Curve("moment/ankle", name, colour, f"ankle/moment/{name}"))
    if source.walks:
        found += _clearance(source)
    for chamber in source.named("chamber"):
        shade = colour_of(f"{chamber}_1")
        found.append(Curve("pressure/chambers", chamber, shade, f"chamber/{chamber}/pressure", 1e-5))
    for muscle in source.named("muscle"):
        shade = colour_of(muscle)
        found.append(Curve("force/muscles", muscle, shade, f"muscle/{muscle}/force"))
        found.append(Curve("contraction/muscles", muscle, shade, f"muscle/{muscle}/contraction", 100.0))
    return [*found, *_lengths(source), *_mountings(source)]


def _lengths(source: Source) -> list[Curve]:
    """Own length and that of the path, of one muscle of a group whose muscles are alike [mm]."""
    found: list[Curve] = []
    for muscle, group in muscle_names(source.scenario.orthosis).items():
        if group.alike and not muscle.endswith("_1"):
            continue
        shade, path = colour_of(muscle), f"muscle/{muscle}/path_length"
        found.append(Curve("length/muscles", muscle, shade, f"muscle/{muscle}/length", 1e3))
        label = f"{muscle}, path"
        found.append(PathLength("length/muscles", label, _shade(shade), path, 1e3, group.series_length))
    return found


def _mountings(source: Source) -> list[Curve]:
    """What cuff and plate give [mm], and the pull on them [N]."""
    found = []
    for anchor in source.named("cuff"):
        name, colour = MOUNTINGS[anchor]
        found.append(Curve("mounting/gives", name, colour, f"cuff/{anchor}/displacement", 1e3))
        found.append(Curve("mounting/pull", name, colour, f"cuff/{anchor}/force"))
    return found


def _clearance(source: Source) -> list[Curve]:
    """Heights of ball and toe above the floor [mm], and of a healthy foot's; the ground's force [N]."""
    found = [Curve("clearance/foot", n, own, f"{n}/height", 1e3) for n, (own, _) in SOLE.items()]
    found += _healthy_heights(source)
    for axis, (name, colour) in {"z": ("up", [110, 235, 120]), "x": ("forward", [60, 150, 110])}.items():
        found.append(Curve("ground/force", name, colour, f"ground/force/{axis}"))
    return found


def _healthy_heights(source: Source) -> list[Curve]:
    return [
        Curve("clearance/healthy", f"{n}, healthy", dim, f"gait/{n}_height", 1e3)
        for n, (_, dim) in SOLE.items()
    ]


def compared_curves(source: Source, label: str, number: int, *, healthy: bool) -> list[Curve]:
    """A run's lines among other runs': one colour a run; with the lines of the healthy foot, or without."""
    colour = run_colour(number)
    found = [Curve(f"angle/{label}", label, colour, "ankle/angle")]
    if healthy:
        found.append(Curve("angle/healthy", "healthy, recorded", HEALTHY, "gait/ankle_angle"))
        found += [line for line in _healthy_heights(source) if line.name.startswith("toe")]
    if source.walks:
        found.append(Curve(f"clearance/{label}", f"{label}: toe", colour, "toe/height", 1e3))
        found.append(Curve(f"moment/{label}", f"{label}: own", _shade(colour), "ankle/moment/biological"))
    if source.named("muscle"):
        found.append(Curve(f"moment/{label}", f"{label}: orthosis", colour, "ankle/moment/orthosis"))
    for kind, entity, factor, column in (
        ("chamber", "pressure", 1e-5, "pressure"),
        ("muscle", "force", 1.0, "force"),
        ("muscle", "contraction", 100.0, "contraction"),
    ):
        for k, name in enumerate(n for n in source.named(kind) if kind == "chamber" or n.endswith("_1")):
            path = f"{kind}/{name}/{column}"
            shade = _shade(colour) if k % 2 else colour
            found.append(Curve(f"{entity}/{label}", f"{label}: {name}", shade, path, factor))
    for k, anchor in enumerate(source.named("cuff")):
        name, shade = f"{label}: {MOUNTINGS[anchor][0]}", _shade(colour) if k else colour
        path = f"cuff/{anchor}/displacement"
        found.append(Curve(f"mounting/gives/{label}", name, shade, path, 1e3))
        found.append(Curve(f"mounting/pull/{label}", name, shade, f"cuff/{anchor}/force"))
    return found


def log_styles(stream: rr.RecordingStream, lines: list[Curve]) -> None:
    """Names and colours of the lines, once."""
    for entity, group in _by_entity(lines).items():
        style = rr.SeriesLines(
            names=[c.name for c in group], colors=[c.colour for c in group], widths=[1.6] * len(group)
        )
        stream.log(entity, style, static=True)


def columns_of(source: Source, lines: list[Curve]) -> list[str]:
    """The columns to read for some lines."""
    clock = ["time", *(GAIT if source.walks else ())]
    return list(dict.fromkeys([*clock, *(name for line in lines for name in line.columns)]))


def log_curves(stream: rr.RecordingStream, lines: list[Curve], block: Columns) -> None:
    """The lines of a block of rows."""
    for entity, group in _by_entity(lines).items():
        values = np.column_stack([c.values(block) for c in group])
        send(stream, entity, block, rr.Scalars.columns(scalars=values))


def log_limits(stream: rr.RecordingStream, sources: list[Source], ends: Columns) -> None:
    """Log the lines' limits: the device's range of motion, and the floor.

    Parameters
    ----------
    stream : to log to
    sources : the runs; the first with an orthosis gives the range
    ends : first and last row to draw them at, as `send` takes them
    """
    for device in [source for source in sources if source.named("muscle")][:1]:
        limits = np.degrees(device.scenario.orthosis.range_of_motion)
        _level(stream, "angle/range", "range of motion", [95, 120, 95], limits, ends)
    if any(source.walks for source in sources):
        _level(stream, "clearance/floor", "floor", [200, 90, 80], np.zeros(1), ends)


def _level(
    stream: rr.RecordingStream, entity: str, name: str, colour: list[int], levels: np.ndarray, ends: Columns
) -> None:
    count = len(levels)
    style = rr.SeriesLines(names=[name] * count, colors=[colour] * count, widths=[1.0] * count)
    stream.log(entity, style, static=True)
    send(stream, entity, ends, rr.Scalars.columns(scalars=np.tile(levels, (2, 1))))


def colour_of(name: str) -> list[int]:
    """Colour of a muscle, <role>_<number>: warm for those that lift the foot, cold for the others."""
    role, number = name.rsplit("_", 1)
    palette = PLANTARFLEXOR if role.startswith(("plantar", "extensor")) else DORSIFLEXOR
    return list(palette[(int(number) - 1) % len(palette)])


def run_colour(number: int) -> list[int]:
    """Colour of a run among several, counted from 0."""
    return list(RUNS[number % len(RUNS)])


def _shade(colour: list[int]) -> list[int]:
    return [round(part * 0.65) for part in colour]


def _by_entity(lines: list[Curve]) -> dict[str, list[Curve]]:
    groups: dict[str, list[Curve]] = {}
    for line in lines:
        groups.setdefault(line.entity, []).append(line)
    return groups
