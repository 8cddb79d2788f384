"""Texts with the pictures: metrics, warnings, the whole scenario."""

from collections.abc import Iterator

import rerun as rr

import afo_sim.show.rerun.colours as colours
from afo_sim.common import Json
from afo_sim.description import worn
from afo_sim.description.scenario_text import reference
from afo_sim.metrics import GROUPS, unit, words
from afo_sim.show import bands, effects
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.numbers import readable
from afo_sim.show.rerun.run_rows import Source

_Sources = list[tuple[str, Source]]  # runs by their names


def answer(sources: _Sources) -> str:
    """The answers of the runs: verdict, what to change first, bands; "" without any."""
    found = []
    for label, source in sources:
        parts = [told for part in (verdict, effects, bands) if (told := part.markdown(source.header))]
        if parts and len(sources) > 1:
            parts.insert(0, f"**{label}**")
        found += parts
    return "\n\n".join(found)


def log_texts(stream: rr.RecordingStream, sources: _Sources) -> None:
    """The answer, the table of metrics and the resolved scenario(s)."""
    if found := answer(sources):
        document(stream, "answer", found)
    lines = [f"# {', '.join(label for label, _ in sources)}", ""]
    if len(sources) > 1:
        legend = colours.in_words((label, colours.of_run(k)) for k, (label, _) in enumerate(sources))
        lines += [f"Colours: {legend}.", ""]
    lines += [str(sources[0][1].header.described.get("description", "")), ""]
    for label, scenario in [(label, source.header.described) for label, source in sources]:
        other = f"; compared with {reference(scenario)}" if reference(scenario) else ""
        lines += [f"{label} wears: {worn(scenario)}{other}", ""] if worn(scenario) else []
    lines += _metrics(sources)
    for label, source in sources:
        lines += ["", f"**{label}**: {source.header.status}"]
        lines += [f"- {warning}" for warning in source.header.warnings]
    lines += ["", " · ".join(f"{n} {v}" for n, v in sources[0][1].header.versions.items())]
    document(stream, "summary", "\n".join(lines))
    texts = [f"# {label}\n```toml\n{_flat(s.header.described)}\n```" for label, s in sources]
    document(stream, "scenario", "\n".join(texts))


def _metrics(sources: _Sources) -> Iterator[str]:
    """The table of metrics: each under its group, with the words, digits and unit that people read."""
    names = list(dict.fromkeys(n for _, s in sources for n in s.header.metrics))
    yield f"| number |{'|'.join(f' {label} ' for label, _ in sources)}| unit |"
    yield f"|---|{'---:|' * len(sources)}---|"
    for group in GROUPS:
        members = [name for name in names if words(name).group == group]
        if members:
            yield f"| **{group}** |{' |' * len(sources)} |"
        for name in members:
            found = [s.header.metrics.get(name) for _, s in sources]
            cells = " | ".join("–" if m is None else readable(name, m) for m in found)
            yield f"| {words(name).label} | {cells} | {unit(next(m for m in found if m is not None))} |"


def document(stream: rr.RecordingStream, entity: str, text: str) -> None:
    stream.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _flat(node: Json, path: str = "") -> str:
    if isinstance(node, dict):
        parts = [_flat(v, f"{path}.{k}".strip(".")) for k, v in node.items() if k != "provenance"]
        return "\n".join(part for part in parts if part)
    return f"{path} = {node!r}"
