"""The verdict on a trial: which stride was taken, and the numbers that a person looks for first."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from afo_sim.gait_lab.trial.moment_peaks import moment_peaks

if TYPE_CHECKING:
    from afo_sim.gait_lab.trial.importing import Imported
    from afo_sim.gait_lab.trial.recorded_stride import Closing, RecordedStride


def verdict(imported: "Imported") -> str:
    """What was taken, and the numbers that a person looks for first, in one sentence."""
    plantar, dorsi = moment_peaks(imported)
    cycle = imported.cycle
    return (
        f"{taken_words(imported)}: plantarflexor peak {plantar.text(' N·m/kg')}, dorsiflexor peak "
        f"{dorsi.text()}, {cycle.body_mass:.1f} kg, {cycle.walking_speed:.2f} m/s"
    )


def taken_words(imported: "Imported") -> str:
    """Which stride was taken and when it was recorded, or of which strides the mean is."""
    chosen = chosen_strides(imported)
    sides = list(dict.fromkeys(stride.side for stride in chosen))
    if len(chosen) > 1:
        legs = f"both legs, {counted(chosen)}" if len(sides) > 1 else counted(chosen)
        return f"mean of {legs}"
    (stride,) = chosen
    own = sum(other.side == stride.side for other in imported.strides)
    words = f"{stride.side} stride {imported.number(imported.chosen[0])} of {own}"
    if stride.closed is None:
        return f"{words}, {stride.start:.2f} to {stride.end:.2f} s"
    return f"{words}, {recorded_words(stride.closed)}"


def chosen_strides(imported: "Imported") -> list["RecordedStride"]:
    """The strides that the cycle is, or is the mean of."""
    return [imported.strides[index] for index in imported.chosen]


def recorded_words(closing: "Closing") -> str:
    """The part of the recording that a closed stride uses."""
    return f"recorded {closing.window[0]:.3f} to {closing.window[1]:.3f} s, closed cyclically"


def counted(strides: Sequence["RecordedStride"]) -> str:
    """How many strides of each side: "2 right and 1 left strides"."""
    sides = [stride.side for stride in strides]
    counts = {side: sides.count(side) for side in dict.fromkeys(sides)}
    words = " and ".join(f"{number} {side}" for side, number in counts.items())
    return f"{words} stride{'s' * (max(counts.values()) > 1)}"
