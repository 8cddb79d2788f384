"""Texts beside the pictures: metrics, warnings, the whole scenario."""

from typing import Any

import rerun as rr

from afo_sim.description.words import reference, worn
from afo_sim.show.rerun.source import Source


def log_texts(stream: rr.RecordingStream, sources: list[tuple[str, Source]]) -> None:
    """The table of metrics and the resolved scenario(s)."""
    names = list(dict.fromkeys(n for _, s in sources for n in s.header.metrics))
    lines = [f"# {', '.join(label for label, _ in sources)}", ""]
    lines += [str(sources[0][1].header.scenario.get("description", "")), ""]
    lines += [line for label, source in sources for line in _wear(label, source)]
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


def _wear(label: str, source: Source) -> list[str]:
    """What a walking run wears, and whom it is compared with."""
    scenario = source.header.scenario
    if not worn(scenario):
        return []
    other = reference(scenario)
    return [f"{label} wears: {worn(scenario)}" + (f"; compared with {other}" if other else ""), ""]


def _document(stream: rr.RecordingStream, entity: str, text: str) -> None:
    stream.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _flat(node: Any, path: str = "") -> str:
    """A resolved scenario as dotted keys, without where its numbers come from."""
    if isinstance(node, dict):
        parts = [_flat(v, f"{path}.{k}".strip(".")) for k, v in node.items() if k != "provenance"]
        return "\n".join(part for part in parts if part)
    return f"{path} = {node!r}"
