"""Names of runs for people: of their scenarios' descriptions, what sets them apart."""

import itertools
import pathlib
import re
from collections.abc import Sequence

from afo_sim.common import JsonMapping
from afo_sim.description import unapplied, unchanged
from afo_sim.description.scenario_text import own_walk
from afo_sim.show.style import plain

_LONGEST = 60  # letters of a name
_CLAUSE = r"[,;:] "  # ends one


def begun(text: str) -> str:
    """A text as the beginning of a sentence; a key that begins it stays as it is."""
    return text if re.match(r"\w+[._]\w", text) else text[:1].upper() + text[1:]


def in_words(scenario: JsonMapping) -> tuple[str, list[str]]:
    """A scenario's description, and each value that was set otherwise with its key in words."""
    whole = scenario.get("description") or ""
    words, _ = unchanged(whole)
    keys = (part.removeprefix("set ").partition("=") for part in whole.split("; ") if part.startswith("set "))
    idle = unapplied(whole) if own_walk(scenario) else []
    told = [
        (re.sub(r"[._]", " ", key), value, " (not applied)" if key in idle else "") for key, _, value in keys
    ]
    return words, [f"{key} {value}".rstrip() + idly for key, value, idly in told]


def whom(scenario: JsonMapping) -> str:
    """Patient, walk, side, device and changed values of a walk, as a line for its page."""
    gait, patient = scenario.get("gait") or {}, scenario.get("patient") or {}
    if not gait:
        return ""
    whose = "the patient's own" if gait.get("walker") == "patient" else "a healthy walker's"
    parts = [
        f"Patient: {patient.get('name') or 'not named (patient.name)'}",
        f"walk: {pathlib.Path(gait['cycle']).stem}, {whose}",
        f"{scenario.get('side') or scenario['leg'].get('side', 'right')} side",
        f"device: {scenario['orthosis'].get('name') or 'not named'}",
        f"set: {'; '.join(changed)}" if (changed := in_words(scenario)[1]) else "nothing changed",
    ]
    return " · ".join(parts).replace("_", " ")


def apart(scenarios: Sequence[JsonMapping]) -> tuple[str, list[str]]:
    """What the descriptions of scenarios begin with, and the clauses that set each apart, if any do."""
    if len(scenarios) == 1:
        return "", ["this run"]
    texts, changed = zip(*map(in_words, scenarios), strict=True)
    if len(set(texts)) == 1:
        told = ["; ".join(each) or "as described" for each in changed]
        return re.split(_CLAUSE, texts[0])[0], _distinct(told)
    alike = (len(set(letters)) == 1 for letters in zip(*texts, strict=False))
    shared = texts[0][: sum(itertools.takewhile(bool, alike))]
    clause = max(shared.rfind(mark) for mark in (", ", ": ", "; "))
    within = any(text[len(shared) :][:1].isalnum() for text in texts)
    word = shared.rfind(" ") if within else len(shared)
    begin = shared[: max(clause if clause > 0 else word, 0)]
    rests = [re.split(_CLAUSE, text[len(begin) :].lstrip(" ,;:").removeprefix("and ")) for text in texts]
    for count in range(1, max(map(len, rests)) + 1):
        if found := _distinct([", ".join(rest[:count]) for rest in rests]):
            return begin.rstrip(" ,;:"), found
    return "", []


def _distinct(names: Sequence[str]) -> list[str]:
    """The names, where each is one, none is too long and a figure's legend sets them apart."""
    short = all(0 < len(name) <= _LONGEST for name in names)
    return list(names) if short and len(set(map(plain, names))) == len(names) else []
