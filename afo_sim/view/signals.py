"""What is plotted and told: curves, valve lanes, events, text."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr

from afo_sim.view.scene import send
from afo_sim.view.source import Columns, Source

DORSIFLEXOR = ([230, 90, 70], [240, 150, 60], [235, 200, 80], [200, 70, 110], [250, 120, 120])
PLANTARFLEXOR = ([80, 150, 235], [90, 205, 220], [130, 120, 230], [70, 190, 150], [150, 180, 250])
RUNS = ([240, 240, 240], [250, 165, 50], [90, 190, 250], [120, 220, 120], [240, 110, 160])
MOMENTS = {
    "orthosis": [240, 150, 60],
    "passive": [90, 205, 140],
    "gravity": [150, 150, 240],
    "load": [220, 200, 90],
}


@dataclass(frozen=True)
class Curve:
    """One plotted line: where, its name and colour, and its column × factor."""

    entity: str
    name: str
    colour: list[int]
    column: str
    factor: float = 1.0

    def values(self, block: Columns) -> np.ndarray:
        """The plotted values. Angles go through `np.degrees`, so that they are its very bits."""
        values = block[self.column]
        return np.degrees(values) if self.column == "ankle/angle" else values * self.factor


def curves(source: Source) -> list[Curve]:
    """Every line of a run's plots."""
    found = [Curve("angle/ankle", "angle", [235, 235, 235], "ankle/angle")]
    moments = {m: f"ankle/moment/{m}" for m in MOMENTS}
    found += [Curve("moment/ankle", m, MOMENTS[m], c) for m, c in moments.items() if c in source.columns]
    for chamber in source.named("chamber"):
        colour = _colour(f"{chamber}_1")
        found.append(Curve("pressure/chambers", chamber, colour, f"chamber/{chamber}/pressure", 1e-5))
    for muscle in source.named("muscle"):
        colour = _colour(muscle)
        found.append(Curve("force/muscles", muscle, colour, f"muscle/{muscle}/force"))
        found.append(Curve("contraction/muscles", muscle, colour, f"muscle/{muscle}/contraction", 100.0))
    return found


def compared_curves(source: Source, label: str, number: int) -> list[Curve]:
    """A run's lines among other runs': one colour a run."""
    colour = list(RUNS[number % len(RUNS)])
    found = [
        Curve(f"angle/{label}", label, colour, "ankle/angle"),
        Curve(f"moment/{label}", f"{label}: orthosis", colour, "ankle/moment/orthosis"),
    ]
    for kind, entity, factor, column in (
        ("chamber", "pressure", 1e-5, "pressure"),
        ("muscle", "force", 1.0, "force"),
        ("muscle", "contraction", 100.0, "contraction"),
    ):
        for k, name in enumerate(n for n in source.named(kind) if kind == "chamber" or n.endswith("_1")):
            shade = [round(part * (1.0 - 0.35 * (k % 2))) for part in colour]
            path = f"{kind}/{name}/{column}"
            found.append(Curve(f"{entity}/{label}", f"{label}: {name}", shade, path, factor))
    return found


def log_styles(stream: rr.RecordingStream, lines: list[Curve]) -> None:
    """Names and colours of the lines, once."""
    for entity, group in _by_entity(lines).items():
        style = rr.SeriesLines(
            names=[c.name for c in group], colors=[c.colour for c in group], widths=[1.6] * len(group)
        )
        stream.log(entity, style, static=True)


def log_curves(stream: rr.RecordingStream, lines: list[Curve], block: Columns) -> None:
    """The lines of a block of rows."""
    for entity, group in _by_entity(lines).items():
        values = np.column_stack([c.values(block) for c in group])
        send(stream, entity, block["time"], rr.Scalars.columns(scalars=values))


def log_range(stream: rr.RecordingStream, source: Source, end: float) -> None:
    """The range of motion that the device is built for, as a band of two lines."""
    limits = np.degrees(source.scenario.orthosis.range_of_motion)
    style = rr.SeriesLines(
        names=["range of motion", "range of motion"], colors=[[95, 120, 95]] * 2, widths=[1.0, 1.0]
    )
    stream.log("angle/range", style, static=True)
    send(stream, "angle/range", np.array([0.0, end]), rr.Scalars.columns(scalars=np.tile(limits, (2, 1))))


class EventFinder:
    """Collects, block by block, valve switches and peaks of a run."""

    def __init__(self, source: Source):
        self.valves = source.named("valve")
        self.switches: list[tuple[float, str, bool]] = []
        self.positive, self.negative = source.scenario.leg.directions
        self._open: dict[str, bool] = {}
        self._peaks: dict[str, tuple[float, float]] = {}

    def see(self, block: Columns) -> None:
        """Take in a block of rows."""
        time = block["time"]
        for valve in self.valves:
            is_open = block[f"valve/{valve}/opening"] > 0.5
            before = self._open.get(valve, not is_open[0])
            for k in np.flatnonzero(np.r_[is_open[0] != before, is_open[1:] != is_open[:-1]]):
                self.switches.append((float(time[k]), valve, bool(is_open[k])))
            self._open[valve] = bool(is_open[-1])
        for name, values in (
            (f"greatest {self.positive}", block["ankle/angle"]),
            (f"greatest {self.negative}", -block["ankle/angle"]),
            (f"greatest {self.positive} torque of the orthosis", block["ankle/moment/orthosis"]),
        ):
            top = int(np.argmax(values))
            if name not in self._peaks or values[top] > self._peaks[name][1]:
                self._peaks[name] = (float(time[top]), float(values[top]))

    def events(self, source: Source) -> list[tuple[float, str, str]]:
        """(time [s], level, text), in order."""
        found = [(0.0, "WARN", warning) for warning in source.header.warnings]
        if not source.header.ok:
            found.append((source.n_row / source.rate, "ERROR", source.header.status))
        for time, valve, is_open in self.switches:
            if time > 0.0 or is_open:
                found.append((time, "INFO", f"{valve.replace('_', ' ')} {'opens' if is_open else 'shuts'}"))
        for name, (time, value) in self._peaks.items():
            said = f"{value:.2f} N·m" if "torque" in name else f"{abs(np.degrees(value)):.2f} deg"
            found.append((time, "INFO", f"{name}: {said}"))
        return sorted(found)


def log_events(stream: rr.RecordingStream, finder: EventFinder, source: Source, prefix: str = "") -> None:
    """Valve lanes and the list of events."""
    for valve in finder.valves:
        entity = f"valves/{prefix}{valve}"
        colours = [_colour(f"{valve.rsplit('_', 1)[0]}_1"), [55, 58, 64]]
        lane = rr.StateConfiguration(values=["open", "shut"], labels=["open", "shut"], colors=colours)
        stream.log(entity, lane, static=True)
        changes = [(time, is_open) for time, name, is_open in finder.switches if name == valve]
        states = ["open" if is_open else "shut" for _, is_open in changes]
        send(stream, entity, np.array([t for t, _ in changes]), rr.StateChange.columns(state=states))
    events = finder.events(source)
    if events:
        texts = rr.TextLog.columns(
            text=[f"{prefix.replace('/', ': ')}{e[2]}" for e in events], level=[e[1] for e in events]
        )
        send(stream, f"events/{prefix.rstrip('/') or 'run'}", np.array([e[0] for e in events]), texts)


def log_texts(stream: rr.RecordingStream, sources: list[tuple[str, Source]]) -> None:
    """The table of metrics and the resolved scenario(s)."""
    names = list(dict.fromkeys(n for _, s in sources for n in s.header.metrics))
    lines = [f"# {', '.join(label for label, _ in sources)}", ""]
    lines += [str(sources[0][1].header.scenario.get("description", "")), ""]
    lines += [f"| metric | unit |{'|'.join(f' {label} ' for label, _ in sources)}|"]
    lines += [f"|---|---|{'---:|' * len(sources)}"]
    for name in names:
        found = [s.header.metrics.get(name) for _, s in sources]
        unit = next(m.unit for m in found if m is not None)
        cells = " | ".join("" if m is None else f"{m.value:.4g}" for m in found)
        lines.append(f"| {name} | {unit} | {cells} |")
    for label, source in sources:
        lines += ["", f"**{label}**: {source.header.status}"]
        lines += [f"- {warning}" for warning in source.header.warnings]
    versions = sources[0][1].header.versions
    lines += ["", " · ".join(f"{n} {v}" for n, v in versions.items())]
    _document(stream, "summary", "\n".join(lines))
    texts = [f"# {label}\n```toml\n{_flat(s.header.scenario)}\n```" for label, s in sources]
    _document(stream, "scenario", "\n".join(texts))


def _document(stream: rr.RecordingStream, entity: str, text: str) -> None:
    stream.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _flat(node: Any, path: str = "") -> str:
    """A resolved scenario as dotted keys, without where its numbers come from."""
    if isinstance(node, dict):
        parts = [_flat(v, f"{path}.{k}".strip(".")) for k, v in node.items() if k != "provenance"]
        return "\n".join(part for part in parts if part)
    return f"{path} = {node!r}"


def _by_entity(lines: list[Curve]) -> dict[str, list[Curve]]:
    groups: dict[str, list[Curve]] = {}
    for line in lines:
        groups.setdefault(line.entity, []).append(line)
    return groups


def _colour(name: str) -> list[int]:
    role, number = name.rsplit("_", 1)
    palette = PLANTARFLEXOR if role.startswith(("plantar", "extensor")) else DORSIFLEXOR
    return list(palette[(int(number) - 1) % len(palette)])
