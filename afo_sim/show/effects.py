"""What to change first, as it is shown: a few lines, a table with bars that print in black and white."""

import math
from collections.abc import Iterator, Sequence

from afo_sim.common import JsonDict
from afo_sim.metrics import UNITS, number
from afo_sim.show.run_names import begun
from afo_sim.show.run_view import RunView
from afo_sim.simulation import Recording
from afo_sim.study import AIR, CLEARANCE, EFFECTS, FIRST, LEFT_OUT, NOTICED, PITCH, TORQUE, WORK, Effects
from afo_sim.study.effect import Effect

_TOP = 5
_FEW = 3  # on a page
_LANDING = 1.0  # loss of the pitch at contact from which on every line tells it [deg]
_APART = 0.5  # by which the first stride's clearance must differ otherwise to be told in a line [mm]
_WHY = {
    "lift": "the toe needs more clearance; changes are ranked by the gain in lowest toe clearance",
    "heel": "the foot does not land on its heel; changes are ranked by the gain in foot pitch at contact",
    "push_off": "push-off is hindered; changes are ranked by its relief while the toe stays clear",
    "air": "a bottle is empty too soon; changes are ranked by the air saved while the toe stays clear",
    "spare": "all targets are met; changes are ranked by relief of push-off, then by the air saved",
}
_SHORT = {
    CLEARANCE: "toe clearance",
    FIRST: "in the first stride",
    TORQUE: "torque against push-off",
    WORK: "work against push-off",
    PITCH: "foot pitch at contact",
    AIR: "air per stride",
}
_HEADS = _SHORT | {FIRST: "toe clearance, first stride"}
_PLACES = {"forward": "ahead of the joint", "up": "above the joint"}
_BARS = (CLEARANCE, TORQUE)  # columns that are drawn, too
_MEASURE = "assumed: measure it first"
_NONE = "no single change helps: try a larger one, several together, or another design"


def effects_of(recording: Recording) -> Effects | None:
    """The effects that a recording holds; None without."""
    table = recording.studies.get(EFFECTS)
    return None if table is None or LEFT_OUT in table else Effects.from_json(table)


def lines(recording: Recording) -> list[str]:
    """For the terminal, at most six; none where there is nothing to report."""
    found, left_out = effects_of(recording), _left_out(recording)
    if found is None:
        return [f"What to change first was not computed: {left_out}"] if left_out else []
    told = [f"What to change first: {_WHY[found.aim]} (each change alone, in its own run)"]
    told += [f"  {sentence}" for sentence in sentences(found, _TOP)]
    return told if found.helping else [*told, f"  {_NONE}"]


def first_step(recording: Recording) -> str:
    """The change that helps most and its aim, in a line; "" where there is nothing to report."""
    found, left_out = effects_of(recording), _left_out(recording)
    if found is None:
        return f"what to change first was not computed: {left_out}" if left_out else ""
    aim = found.aim.replace("_", "-")
    return f"change first, for {aim}: {next(iter(sentences(found, 1)), _NONE)}"


def sentences(effects: Effects, most: int) -> list[str]:
    """The changes that help most, best first, with the differences that count."""
    sentences = []
    for effect in effects.helping[:most]:
        apart = abs(effect.by(FIRST) - effect.by(CLEARANCE)) >= _APART
        names = [CLEARANCE, *([FIRST] if apart else []), TORQUE]
        names += [*([WORK] if effects.aim == "push_off" else []), AIR]
        told = [n for n in names if n == CLEARANCE or abs(effect.by(n)) >= NOTICED[n]]
        told += [PITCH] if effects.aim == "heel" or effect.by(PITCH) <= -_LANDING else []
        lost = [n for n, value in effect.differences.items() if n in _SHORT and math.isnan(value)]
        told += [n for n in lost if n not in told]
        text = ", ".join(f"{_SHORT[n]} {_number(effect, effects, n)} {_unit(effects, n)}" for n in told)
        notes = f" ({'; '.join(effect.notes)})" if effect.notes else ""
        sentences.append(f"{_advice(effect)}: {text}{notes}")
    return sentences


def markdown(recording: Recording) -> str:
    """For the viewer; "" where there is nothing to report."""
    found, left_out = effects_of(recording), _left_out(recording)
    if found is None:
        return f"*Not computed: {left_out}.*" if left_out else ""
    told = [f"{begun(_WHY[found.aim])}. Each change alone, in its own run.", ""]
    if not found.helping:
        return "\n".join([*told, f"**{begun(_NONE)}.**"])
    _, head, rows = table(found)
    ruled = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join([*told, *(f"| {' | '.join(row)} |" for row in ruled)])


def table(effects: Effects) -> tuple[str, list[str], list[list[str]]]:
    """Title, header and rows: the steps that help most, with the differences that they make."""
    names = [name for name in _SHORT if name in effects.base]
    head = ["step", *(f"{_HEADS[n]} [{_unit(effects, n)}]" for n in names)]
    best = effects.helping[:_TOP]
    rows = [[change(effect), *(_number(effect, effects, n) for n in names)] for effect in best]
    return _WHY[effects.aim], head, rows


def of_report(runs: Sequence[RunView]) -> list[JsonDict]:
    """What the report's part report_effects.html.j2 draws; empty where there is nothing to report."""
    tables = []
    for run in runs:
        found, left_out = effects_of(run.recording), _left_out(run.recording)
        if found is not None:
            tables.append(_table(run, found))
        elif left_out:
            tables.append({"run": run, "left_out": left_out})
    return tables


def change(effect: Effect) -> str:
    """A step in short, as "dorsiflexor link length 11.2 → 10.7 cm"."""
    return f"{effect.name} {_values(effect)}" + (f" ({_MEASURE})" if effect.assumed else "")


def _advice(effect: Effect) -> str:
    """A step as advice, as "change dorsiflexor link length from 11.2 to 10.7 cm"."""
    name, matched, _ = effect.name.partition(", link to match")
    what, _, way = name.rpartition(" ")
    step = f"from {_values(effect).replace('→', 'to')}"
    moved = f"move {what} {step} {_PLACES[way]}" if way in _PLACES else f"change {name} {step}"
    return moved + (" and adjust the link" if matched else "") + (f" ({_MEASURE})" if effect.assumed else "")


def _values(effect: Effect) -> str:
    before, _, unit = effect.before.partition(" ")
    after = effect.after.removesuffix(f" {unit}") if unit else effect.after
    unit = unit.replace("^3", "³").replace("*", "·")
    return f"{before} → {after} {unit}".rstrip().replace("-", "−")


def _number(effect: Effect, effects: Effects, name: str) -> str:
    if name not in effect.differences:
        return ""
    return number(effect.differences[name], effects.base[name].unit, signed=True)


def _unit(effects: Effects, name: str) -> str:
    unit = effects.base[name].unit
    return UNITS.get(unit, unit)


def _left_out(recording: Recording) -> str:
    return str(recording.studies.get(EFFECTS, {}).get(LEFT_OUT, ""))


def _table(run: RunView, effects: Effects) -> JsonDict:
    names = [name for name in _HEADS if name in effects.base]
    shown = [e for e in effects.ranked if e.status == "run" and e.name not in effects.idle]
    best = {effect.name for effect in effects.helping[:_TOP]}
    longest = {n: max((abs(e.by(n)) for e in shown), default=0.0) or 1.0 for n in names}
    reasons: dict[str, list[str]] = {}  # parameters without air are told among the idle ones
    for effect in effects.ranked:
        if effect.status not in ("run", "no air"):
            reasons.setdefault(effect.reason, []).append(change(effect))
    return {
        "run": run,
        "left_out": "",
        "why": begun(_WHY[effects.aim]),
        "heads": [(_HEADS[n], _unit(effects, n)) for n in names],
        "base": [number(effects.base[n].value, effects.base[n].unit) for n in names],
        "drawn": [n in _BARS for n in names],
        "first": list(_rows(effects, [e for e in shown if e.name in best], names, longest)),
        "others": list(_rows(effects, [e for e in shown if e.name not in best], names, longest)),
        "sentences": list(map(begun, sentences(effects, _FEW))),
        "none": "" if effects.helping else _NONE,
        "idle": "; ".join(effects.idle),
        "not_run": [f"{'; '.join(steps)}: {reason}" for reason, steps in reasons.items()],
    }


def _rows(
    effects: Effects, shown: Sequence[Effect], names: Sequence[str], longest: dict[str, float]
) -> Iterator[JsonDict]:
    """Both steps of a parameter together, in the order of the better one; its name at the first alone."""
    for parameter in dict.fromkeys(effect.name for effect in shown):
        steps = [effect for effect in shown if effect.name == parameter]
        for k, effect in enumerate(steps):
            cells = [(_number(effect, effects, n), 100.0 * effect.by(n) / longest[n]) for n in names]
            told = _MEASURE if effect.assumed and k == 0 else ""
            note = "; ".join(text for text in (told, effect.reason, *effect.beyond, *effect.notes) if text)
            row = {"name": parameter if k == 0 else "", "steps": len(steps), "change": _values(effect)}
            yield row | {"helps": effect.helps, "cells": cells, "note": note}
