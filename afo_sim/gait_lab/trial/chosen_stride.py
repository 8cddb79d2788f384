"""The stride of a trial that becomes the gait cycle."""

from collections.abc import Sequence
from dataclasses import replace

from afo_sim.common.errors import InputError
from afo_sim.gait.checks import examine
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.mean_stride import mean_cycle
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride


def take_stride(
    strides: Sequence[RecordedStride], cycles: Sequence[GaitCycle], source: str, choices: Choices
) -> tuple[tuple[int, ...], GaitCycle]:
    """The strides to take and their cycle: the asked one, the mean, or the first that contradicts nothing."""
    loaded = require_loaded(strides, choices)
    if choices.mean or choices.both:
        groups = [loaded]
    elif choices.stride is not None:
        groups = [(_numbered(strides, choices),)]
    else:
        groups = [(k,) for k in loaded]
    refused: list[InputError] = []
    for group in groups:
        cycle = cycles[group[0]] if len(group) == 1 else mean_cycle([cycles[k] for k in group])[0]
        cycle = replace(cycle, source=choices.source or source, licence=choices.licence)
        try:
            examine(cycle, source)
        except InputError as error:
            refused.append(error)
        else:
            return group, cycle
    raise refused[0]


def _own(strides: Sequence[RecordedStride], choices: Choices) -> list[int]:
    return [k for k, s in enumerate(strides) if choices.both or s.side == choices.side]


def require_loaded(strides: Sequence[RecordedStride], choices: Choices) -> tuple[int, ...]:
    """The strides whose whole stance was on plates; without any there is no ankle moment."""
    own = _own(strides, choices)
    found = tuple(k for k in own if strides[k].loaded)
    lacking = [side for side in SIDES if choices.both and side not in {strides[k].side for k in found}]
    if found and lacking:
        seen = "; ".join(s.by for s in strides if s.side == lacking[0]) or "its leg has no whole stride"
        raise InputError(
            f"no plate carried a whole stance of the {lacking[0]} foot: {seen}",
            field="side",
            value="both",
            allowed=strides[found[0]].side,
        )
    if not found:
        seen = "; ".join(
            f"{strides[k].start:.2f} to {strides[k].end:.2f} s: {strides[k].by}" for k in own[:4]
        )
        raise InputError(
            f"no plate carried a whole stance of the {choices.side} foot, without which its ankle moment is "
            f"not known ({seen})",
            field="side",
            value=choices.side,
            allowed="the other side, or a trial in which this foot steps on a plate",
        )
    return found


def _numbered(strides: Sequence[RecordedStride], choices: Choices) -> int:
    """Index of the stride that the person asked for."""
    own = _own(strides, choices)
    assert choices.stride is not None
    if choices.stride > len(own):
        times = ", ".join(
            f"{n}: {strides[k].start:.2f} to {strides[k].end:.2f} s" for n, k in enumerate(own, 1)
        )
        raise InputError("there is no such stride", field="stride", value=choices.stride, allowed=times)
    index = own[choices.stride - 1]
    if not strides[index].loaded:
        loaded = ", ".join(str(n) for n, k in enumerate(own, 1) if strides[k].loaded)
        problem = "no plate carried this stride whole, and without its force no ankle moment is known"
        raise InputError(problem, field="stride", value=choices.stride, allowed=loaded)
    return index
