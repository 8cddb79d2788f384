"""The stride of a trial that becomes the gait cycle: one, or the mean of several."""

import dataclasses
import warnings
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from afo_sim.common import InputError, Keywords, Notice
from afo_sim.gait import CLOSING_USUAL, KINEMATICS, GaitCycle, closing_errors, examine
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride

_KINETICS = ("grf_x", "grf_z", "cop_x", "ankle_moment")
_NAMED = 6  # strides whose own notes are repeated in the mean's


def take_stride(
    strides: Sequence[RecordedStride], cycles: Sequence[GaitCycle], source: str, choices: Choices
) -> tuple[tuple[int, ...], GaitCycle, list[Notice]]:
    """The strides to take, their cycle, and why earlier ones are not taken."""
    loaded = require_loaded(strides, choices)
    groups = [loaded] if choices.mean or choices.both else [(k,) for k in loaded]
    if choices.stride is not None:
        groups = [(_numbered(strides, choices, choices.stride),)]
    refused: list[InputError] = []
    fair: dict[tuple[int, ...], GaitCycle] = {}
    why: dict[tuple[int, ...], Notice] = {}
    for group in groups:
        try:
            cycle = _examined(group, cycles, source, choices)
        except InputError as error:
            refused.append(error)
            problem = f"{error.field} {error.problem}"
        else:
            if _open(cycle) <= CLOSING_USUAL:
                return group, cycle, list(why.values())
            fair[group] = cycle
            problem = f"it ends {_open(cycle):.1f} deg from where it began"
        text, first = "{subject} stride from {start:.2f} s not used: {problem}", strides[group[0]]
        why[group] = note("stride-not-taken", text, subject=first.side, start=first.start, problem=problem)
    closing = _means_that_close(strides, cycles, source, choices)
    if not fair:
        raise refused[0].replaced(allowed="; ".join(filter(None, (refused[0].allowed, closing))))
    taken = min(fair, key=lambda group: _open(fair[group]))
    text = "a mean of strides closes within {limit:.0f} deg: {subject}"
    remedy = [Notice("mean-closes", text, subject=closing, limit=CLOSING_USUAL)] if closing else []
    return taken, fair[taken], [*(told for group, told in why.items() if group != taken), *remedy]


def _examined(group: Sequence[int], cycles: Sequence[GaitCycle], source: str, choices: Choices) -> GaitCycle:
    """The cycle of one stride or the mean of several; refused where it contradicts itself."""
    cycle = cycles[group[0]] if len(group) == 1 else mean_cycle([cycles[k] for k in group])[0]
    cycle = replace(cycle, source=choices.source or source, licence=choices.licence)
    examine(cycle, source)
    return cycle


def _means_that_close(
    strides: Sequence[RecordedStride], cycles: Sequence[GaitCycle], source: str, choices: Choices
) -> str:
    """Options whose mean contradicts nothing and closes as usual; a patient's legs have no mean."""
    loaded = [k for k, stride in enumerate(strides) if stride.loaded]
    own = [k for k in loaded if strides[k].side == choices.side]
    asked = {"--stride mean": own}
    if choices.walker != "patient" and own != loaded:
        asked["--side both"] = loaded
    found = []
    for option, group in asked.items():
        with suppress(InputError):
            if _open(_examined(group, cycles, source, choices)) <= CLOSING_USUAL:
                found.append(option)
    return " or ".join(found)


def _open(cycle: GaitCycle) -> float:
    """The farthest that an angle's two ends are apart [deg]."""
    return max(abs(off) for name, off in closing_errors(cycle).items() if name.endswith("_deg"))


def _own(strides: Sequence[RecordedStride], choices: Choices) -> list[int]:
    return [k for k, s in enumerate(strides) if choices.both or s.side == choices.side]


def require_loaded(strides: Sequence[RecordedStride], choices: Choices) -> tuple[int, ...]:
    """The strides whose whole stance was on plates; without any there is no ankle moment."""
    own = _own(strides, choices)
    found = tuple(k for k in own if strides[k].loaded)
    lacking = [side for side in SIDES if choices.both and side not in {strides[k].side for k in found}]
    if found and lacking:
        seen = "; ".join(s.by for s in strides if s.side == lacking[0]) or "its leg has no complete stride"
        problem = f"no plate carried a complete stance of the {lacking[0]} foot: {seen}"
        raise InputError(problem, field="side", value="both", allowed=strides[found[0]].side)
    if not found:
        other = next((s.side for s in strides if s.loaded), "")
        others = f"{other}, whose stance is; or " if other else ""
        some = (strides[k] for k in own[:4])
        seen = "; ".join(f"{stride.start:.2f} to {stride.end:.2f} s: {stride.by}" for stride in some)
        problem = f"no whole stride of the {choices.side} foot has its stance on a plate, without which its "
        problem += f"ankle moment is not known ({seen})"
        allowed = f"{others}a trial in which this foot steps on a plate between two heel strikes"
        raise InputError(problem, field="side", value=choices.side, allowed=allowed)
    return found


def _numbered(strides: Sequence[RecordedStride], choices: Choices, number: int) -> int:
    """Index of the requested stride, from 1."""
    own = dict(enumerate(_own(strides, choices), 1))
    if number not in own:
        spans = {n: f"{strides[k].start:.2f} to {strides[k].end:.2f} s" for n, k in own.items()}
        times = ", ".join(f"{n}: {span}" for n, span in spans.items())
        raise InputError("there is no such stride", field="stride", value=number, allowed=times)
    if not strides[own[number]].loaded:
        loaded = ", ".join(str(n) for n, k in own.items() if strides[k].loaded)
        problem = "no plate carried this whole stride, and without ground force the ankle moment is unknown"
        raise InputError(problem, field="stride", value=number, allowed=loaded)
    return own[number]


def mean_cycle(cycles: Sequence[GaitCycle]) -> tuple[GaitCycle, dict[str, np.ndarray]]:
    """The mean over strides at equal phase, of either side."""
    if not cycles:
        raise InputError("a mean needs at least one stride", field="cycles")
    first = cycles[0]
    for phase in (cycle.phase for cycle in cycles):
        if len(phase) != len(first.phase) or not np.allclose(phase, first.phase):
            raise InputError("strides of other rows have no mean", field="cycles", value=len(phase))
    loaded = [cycle for cycle in cycles if np.isfinite(cycle.grf_z).all()]
    # without any force they are NaN, but for moments that come from a file of their own
    of = dict.fromkeys(KINEMATICS, cycles) | dict.fromkeys(_KINETICS, loaded or cycles)
    values = {name: np.array([getattr(cycle, name) for cycle in each]) for name, each in of.items()}
    values["ankle_x"] = values["ankle_x"] - values["ankle_x"][:, :1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # NaN where none, or a single one, is known
        means: Keywords = {name: np.nanmean(rows, axis=0) for name, rows in values.items()}
        band = {name: np.nanstd(rows, axis=0, ddof=1) for name, rows in values.items()}
    # a mean weighted by forces, where those that have a place carry at least half of the force
    place, force = values["cop_x"], values["grf_z"]
    known = np.isfinite(place)
    weight = np.where(known, force, 0.0)
    total = weight.sum(axis=0)
    enough = (2.0 * total >= np.abs(force).sum(axis=0)) & (total > 0.0)
    moment = (weight * np.where(known, place, 0.0)).sum(axis=0)
    means["cop_x"] = np.asarray(np.where(enough, moment / np.where(enough, total, 1.0), np.nan))
    times = np.array([cycle.stride_time for cycle in cycles])
    speeds = np.array([cycle.walking_speed for cycle in cycles])
    mean = dataclasses.replace(
        first,
        source="; ".join(dict.fromkeys(cycle.source for cycle in cycles)),
        licence="; ".join(dict.fromkeys(cycle.licence for cycle in cycles)),
        stride_time=float(times.mean()),
        body_mass=float(np.mean([cycle.body_mass for cycle in cycles])),
        walking_speed=float(speeds @ times / times.sum()),
        ankle_height=float(np.mean([cycle.ankle_height for cycle in cycles])),
        notes=_notes(cycles, len(loaded)),
        **means,
    )
    return mean, band


def _notes(cycles: Sequence[GaitCycle], loaded: int) -> dict[str, str]:
    sides = Counter(cycle.side for cycle in cycles)
    which = " and ".join(f"{number} {side}" for side, number in sides.items())
    first = cycles[0].notes.items()
    notes = {key: text for key, text in first if all(c.notes.get(key) == text for c in cycles)}
    cuts = [cycle.notes["cut"] for cycle in cycles if "cut" in cycle.notes]
    if len(cycles) > 1 and cuts:
        more = f"; and {len(cuts) - _NAMED} more" if len(cuts) > _NAMED else ""
        notes["cut"] = "; ".join(cuts[:_NAMED]) + more
    return notes | {"mean": f"of {len(cycles)} strides ({which}), ground force of {loaded}"}
