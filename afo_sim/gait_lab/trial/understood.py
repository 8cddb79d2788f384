"""What was understood of a trial, in ten short rows for the person who brought it."""

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from afo_sim.gait.checks import STANCE_FORCE
from afo_sim.gait_lab.trial.centres_told import bridged_told, centres_told
from afo_sim.gait_lab.trial.moment_peaks import ANKLE_ERROR, ankle_error, moment_peaks
from afo_sim.gait_lab.trial.verdict import chosen_strides, counted, recorded_words

if TYPE_CHECKING:
    from afo_sim.gait_lab.trial.importing import Imported
    from afo_sim.gait_lab.trial.recorded_stride import Closing, RecordedStride

MASSLESS = 0.014  # moment of the foot's weight and inertia in walking, see GaitCycle.ground_moment [N·m/kg]
UNLOADED = re.compile(r"plate (\S+): read (\S+ N) without load")  # in the readers' words
OTHERS = ("right leg: ", "left leg: ", "right stride from", "left stride from")  # what was not taken, and why
LONG_NAME = 5  # letters of plates' names that tell by themselves what they are
WISHES = 2  # things that are named as making it better
# Remarks on a leg whose matter is told of the joint centres, or of the taken stride alone.
ELSEWHERE = ("leg placed by the model's joints", ": seen in ")
WORTH = ("ankle", "knee", "hip", "heel", "toe")  # points, by what a better one does for the ankle's moment


def ten_lines(imported: "Imported") -> list[tuple[str, str]]:
    """What was found, taken and estimated, and what would make it better.

    Parameters
    ----------
    imported : a trial's cycle with what it was cut from

    Returns
    -------
    (subject, sentence) in the order in which a person would ask; warnings are not among them
    """
    return [
        ("found", _found(imported)),
        ("direction", _direction(imported)),
        ("joint centres", centres_told(imported.legs[imported.cycle.side].points)),
        ("strides", _strides(imported)),
        ("taken", _taken(imported)),
        ("body mass", f"{_mass(imported)}; {_height(imported)}"),
        ("ankle", _ankle(imported)),
        ("moment", _moment(imported)),
        ("estimated", _estimated(imported)),
        ("better with", _better(imported)),
    ]


def _found(imported: "Imported") -> str:
    """The files by what they hold, the legs, the time, and how the legs were had from them."""
    trial = imported.trial
    kinds = {
        "markers": trial.markers,
        "joint angles": trial.angles,
        "body positions": trial.bodies,
        "joint moments": trial.moments,
        "standing trial": trial.standing,
    }
    said = [f"{kind} {content.file.name}" for kind, content in kinds.items() if content is not None]
    said.append(_count(len(trial.plates), "force plate"))
    times = [leg.time for leg in imported.legs.values()]
    start, end = min(time[0] for time in times), max(time[-1] for time in times)
    legs = "both legs" if len(imported.legs) > 1 else f"{imported.cycle.side} leg"
    said = [", ".join(said), f"{legs}, {start:.2f} to {end:.2f} s"]
    leg = imported.legs[imported.cycle.side]
    said += [remark.partition("; ")[0] for remark in leg.remarks if not any(t in remark for t in ELSEWHERE)]
    return "; ".join([*said, *bridged_told(leg, chosen_strides(imported))])


def _direction(imported: "Imported") -> str:
    """Forward and up, and the belt; the stride's own speed stands in the verdict."""
    return re.sub(r"(overground) at [\d.]+ m/s", r"\1", "; ".join(imported.frame.remarks))


def _strides(imported: "Imported") -> str:
    """How many strides of each side were on plates for the whole stance, and on which."""
    found, more = [], []
    for side in imported.legs:
        own = [stride for stride in imported.strides if stride.side == side]
        words = f"{sum(stride.loaded for stride in own)} of {len(own)} {side}"
        if side in imported.grounds:
            ground = imported.grounds[side]
            plates = ", ".join(dict.fromkeys(contact.plate for contact in ground.contacts))
            words += f" (plate {plates})" if len(plates) < LONG_NAME else f" ({plates})"
            more += [remark for remark in ground.remarks if not remark.startswith(f"{side} foot on plate")]
        found.append(words)
    more += [words for words in imported.remarks if words.startswith(OTHERS)]
    return "; ".join(
        [f"whole stance on plates: {', '.join(found)}", *dict.fromkeys(more), *_taken_off(imported)]
    )


def _taken_off(imported: "Imported") -> list[str]:
    """What the plates read without load, which was taken off."""
    constants = [UNLOADED.search(remark) for remark in imported.remarks]
    each = ", ".join(f"{match[2]} of plate {match[1]}" for match in constants if match)
    return [f"without load taken off: {each}"] if each else []


def _taken(imported: "Imported") -> str:
    """When the taken strides began and ended, by what evidence."""
    chosen = chosen_strides(imported)
    evidence = f"; events by {_evidence(chosen)}"
    if len(chosen) > 1:
        spread = np.std([stride.time for stride in chosen], ddof=1)
        closed = sum(stride.closed is not None for stride in chosen)
        return (
            f"{counted(chosen)}, {imported.cycle.stride_time:.3f} s on average (standard deviation "
            f"{spread:.3f} s){evidence}" + f"; {closed} closed cyclically" * bool(closed)
        )
    (stride,) = chosen
    if stride.closed is None:
        return f"{stride.start:.3f} to {stride.end:.3f} s, toe-off {stride.toe_off:.3f} s{evidence}"
    first, last = stride.closed.window
    # instants of a closed stride are told where they were recorded
    strike, off = (first + (t - first) % stride.time for t in (stride.start, stride.toe_off))
    words = f"{recorded_words(stride.closed)}; heel strike {strike:.3f} s, toe-off {off:.3f} s{evidence}"
    if stride.closed.gap >= 0.0005:
        words += f"; {100.0 * (last - first) / stride.time:.1f} % of a stride recorded"
    return words + _ends(stride.closed)


def _evidence(strides: Sequence["RecordedStride"]) -> str:
    """What tells the strides' ends, without what is told elsewhere of their closing and their plates."""
    found: dict[str, None] = {}
    for stride in strides:
        start, _, end = stride.by.partition("; ")[0].partition(", its end by ")
        found |= dict.fromkeys(by.removeprefix("heel strike by ") for by in (start, end) if by)
    return (", the end by " if len(strides) == 1 else " and ").join(found)


def _ends(closing: "Closing") -> str:
    """What the ends of a closed stride differ by."""
    residual = closing.residual
    angles = [
        abs(residual[name]) for name in ("shank_angle", "knee_angle", "ankle_angle") if name in residual
    ]
    ends = [f"{math.degrees(max(angles)):.1f} deg"] if angles else []
    ends += [f"{1e3 * abs(residual['ankle_z']):.0f} mm"] if "ankle_z" in residual else []
    return f"; ends meet within {' and '.join(ends)}" if ends else ""


def _mass(imported: "Imported") -> str:
    mass = imported.mass
    if mass.how == "by the plates":
        return "; ".join(mass.remarks) or f"{mass.mass:.1f} kg, by the plates"
    said = f"{mass.mass:.1f} kg, {mass.how}"
    if mass.estimated is None:
        return said
    found = mass.remarks[0] if mass.remarks else f"the plates carry {mass.estimated:.1f} kg"
    carried = found.partition(" over ")[0]
    return f"{said}, {_signed(100.0 * (mass.mass / mass.estimated - 1.0), 1)} % off: {carried}"


def _height(imported: "Imported") -> str:
    """The body's height, which a person alone can tell."""
    height = imported.cycle.body_height
    return "height not known: a run keeps its patient's" if height is None else f"height {height:.2f} m"


def _ankle(imported: "Imported") -> str:
    height = 1e3 * imported.cycle.ankle_height
    zero = math.degrees(imported.zero)
    moved = "as in the file" if zero == 0.0 else f"moved by {_signed(-zero, 1)} deg"
    sole = imported.cycle.sole_thickness
    worn = "sole not known: taken as barefoot" if sole is None else f"sole {1e3 * sole:.0f} mm"
    flat = f"with the foot flat, {imported.cycle.flat.words}"
    return f"zero {moved}; centre {height:.0f} mm above the floor {flat}; {worn}"


def _moment(imported: "Imported") -> str:
    """Both peaks with their phases, where they come from, and how far the two sources are apart."""
    cycle = imported.cycle
    names = ("plantarflexor", "dorsiflexor")
    peaks = [
        f"{name} {peak.text().partition(' (')[0]}" + f" at {100.0 * peak.phase:.0f} %" * (peak.value > 0.0)
        for name, peak in zip(names, moment_peaks(imported), strict=True)
    ]
    given = cycle.notes.get("ankle_moment", "").startswith("as in")
    words = f"{', '.join(peaks)}, by the {'given inverse dynamics' if given else 'ground force'}"
    if imported.reference is None:
        return words
    known = (cycle.grf_z > STANCE_FORCE) & np.isfinite(imported.reference)
    error = np.sqrt(np.mean((cycle.ground_moment() - imported.reference)[known] ** 2))
    other = "the ground force" if given else "the given inverse dynamics"
    return f"{words}; {error:.3f} N·m/kg RMS from {other} in stance"


def _estimated(imported: "Imported") -> str:
    """What was not measured, and what its error does to moment or angle."""
    points = imported.legs[imported.cycle.side].points
    error = ankle_error(imported)
    size = f"±{1e3 * ANKLE_ERROR:.0f} mm fore-aft (assumed): " if error is None else ""
    said = [f"ankle {size}±{moment_peaks(imported)[0].error:.2f} N·m/kg"]
    leans = {}
    for role, segment in (("knee", "shank"), ("hip", "thigh")):
        error = points[role].error if role in points else None
        if error is not None:
            leans[segment] = math.degrees(error / _length(imported, role))
    if leans:
        said.append(", ".join(f"{segment} ±{lean:.1f} deg" for segment, lean in leans.items()))
    if "massless" in imported.cycle.notes.get("ankle_moment", "massless"):
        said.append(f"foot as massless ±{MASSLESS} N·m/kg")
    return "; ".join(said)


def _length(imported: "Imported", role: str) -> float:
    """Distance from a joint to the next one down the leg [m]."""
    points = imported.legs[imported.cycle.side].points
    below = {"knee": "ankle", "hip": "knee"}[role]
    return float(np.nanmedian(np.linalg.norm(points[role].path - points[below].path, axis=1)))


def _better(imported: "Imported") -> str:
    """The first two of what is lacking, in the order of what it does to the ankle's moment."""
    points = imported.legs[imported.cycle.side].points
    chosen = chosen_strides(imported)
    wishes = [f"{role}: {points[role].better}" for role in WORTH if role in points and points[role].better]
    if not all(stride.loaded for stride in chosen):
        wishes.insert(0, "a plate under the whole stance")
    if imported.mass.how == "by the plates":
        wishes.insert(1, "body mass from scales")
    if any(stride.closed is not None for stride in chosen):
        wishes.append("a recording of a whole stride")
    if sum(stride.side == imported.cycle.side and stride.loaded for stride in imported.strides) == 1:
        wishes.append("more strides on plates, for their mean")
    return "; ".join(wishes[:WISHES]) or "nothing that is known"


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}" + ("" if number == 1 else "s")


def _signed(value: float, digits: int) -> str:
    return f"{round(value, digits) + 0.0:+.{digits}f}"  # no "-0.0"
