"""What was understood of a trial: the verdict in one sentence, and ten short rows for who brought it."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY, with_code
from afo_sim.gait import LATE_SWING, STANCE_FORCE, GaitCycle
from afo_sim.gait_lab.trial.cutting import FROM_GROUND_FORCE, stated_over
from afo_sim.gait_lab.trial.imported import Imported
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.recorded_stride import Closing, RecordedStride
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

_ANKLE_ERROR = 0.01  # of an ankle centre whose error nobody states, fore and aft; assumed [m]
_MASSLESS = 0.014  # moment of the foot's weight and inertia in walking, see GaitCycle.ground_moment [N·m/kg]
_LONG_NAME = 5  # letters of plates' names that say by themselves what they are
_NEAR = 0.25  # between a marked event and the stride's, which are the same; assumed [s]
_WISHES = 2  # things that are named as making it better
# Notes on a leg whose matter stands with the joint centres, or counts in the taken stride alone.
_ELSEWHERE = ("placed-by-model", "point-bridged", "model-parts-posed")
_OTHERS = ("leg-unused", "stride-left-out")  # notes on what was not taken, and why
_WORTH = ("ankle", "knee", "hip", "heel", "toe")  # points, by what a better one does for the ankle's moment


def verdict(imported: Imported) -> str:
    """What was taken, and the numbers that a person looks for first, in one sentence."""
    plantar, dorsi = _moment_peaks(imported)
    cycle = imported.cycle
    return (
        f"{taken_words(imported)}: plantarflexor peak {plantar.long_text(' N·m/kg')}, dorsiflexor peak "
        f"{dorsi.long_text()}, {cycle.body_mass:.1f} kg, {cycle.walking_speed:.2f} m/s"
    )


def taken_words(imported: Imported) -> str:
    """Which stride was taken and when it was recorded, or of which strides the mean is."""
    chosen = _chosen_strides(imported)
    sides = list(dict.fromkeys(stride.side for stride in chosen))
    if len(chosen) > 1:
        legs = f"both legs, {_counted(chosen)}" if len(sides) > 1 else _counted(chosen)
        return f"mean of {legs}"
    (stride,) = chosen
    own = sum(other.side == stride.side for other in imported.strides)
    words = f"{stride.side} stride {imported.number(imported.chosen[0])} of {own}"
    if stride.closed is None:
        return f"{words}, {stride.start:.2f} to {stride.end:.2f} s"
    return f"{words}, {_recorded_words(stride.closed)}"


def _chosen_strides(imported: Imported) -> list[RecordedStride]:
    return [imported.strides[index] for index in imported.chosen]


def _recorded_words(closing: Closing) -> str:
    return f"recorded {closing.window[0]:.3f} to {closing.window[1]:.3f} s, closed cyclically"


def _counted(strides: Sequence[RecordedStride]) -> str:
    counts = Counter(stride.side for stride in strides)
    words = " and ".join(f"{number} {side}" for side, number in counts.items())
    return f"{words} stride{'s' if max(counts.values()) > 1 else ''}"


def ten_lines(imported: Imported) -> list[tuple[str, str]]:
    """What was found, taken and estimated, and what would make it better."""
    return [
        ("found", _found(imported)),
        ("direction", direction(imported.frame)),
        ("joint centres", _centres(imported.legs[imported.cycle.side].points)),
        ("strides", _strides(imported)),
        ("taken", _taken(imported)),
        ("body mass", f"{_mass(imported)}; {_height(imported)}"),
        ("ankle", _ankle(imported)),
        ("moment", _moment(imported)),
        ("estimated", _estimated(imported)),
        ("better with", _better(imported)),
    ]


def _found(imported: Imported) -> str:
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
    said.append(f"{len(trial.plates)} force plate{'' if len(trial.plates) == 1 else 's'}")
    times = [leg.time for leg in imported.legs.values()]
    start, end = min(time[0] for time in times), max(time[-1] for time in times)
    legs = "both legs" if len(imported.legs) > 1 else f"{imported.cycle.side} leg"
    said = [", ".join(said), f"{legs}, {start:.2f} to {end:.2f} s"]
    leg = imported.legs[imported.cycle.side]
    said += [remark for remark in leg.remarks if remark.code not in _ELSEWHERE]
    said += with_code(imported.remarks, "laboratory-states")
    return "; ".join([*said, *_bridged(leg, _chosen_strides(imported))])


def direction(frame: WalkingFrame) -> str:
    """Forward and up, the belt and the floor; the stride's own speed stands in the verdict."""
    said: list[str] = []
    for remark in frame.remarks:
        if remark.code == "direction":
            data = remark.data
            ground = f"belt {data['belt_speed']:.2f} m/s" if remark.subject == "belt" else remark.subject
            said.append(f"walks along {data['forward']}, up {data['up']}, {ground}")
        else:
            said.append(remark)
    return "; ".join(said)


def _strides(imported: Imported) -> str:
    """How many strides of each side were on plates for the whole stance, and on which."""
    found: list[str] = []
    more: list[str] = []
    for side in imported.legs:
        own = [stride for stride in imported.strides if stride.side == side]
        words = f"{sum(stride.loaded for stride in own)} of {len(own)} {side}"
        if side in imported.grounds:
            ground = imported.grounds[side]
            plates = ", ".join(dict.fromkeys(contact.plate for contact in ground.contacts))
            words += f" (plate {plates})" if len(plates) < _LONG_NAME else f" ({plates})"
            more += [remark for remark in ground.remarks if remark.code != "foot-on-plates"]
        found.append(words)
    more += [remark for remark in imported.remarks if remark.code in _OTHERS]
    said = [f"whole stance on plates: {', '.join(found)}", *dict.fromkeys(more)]
    offsets = with_code(imported.remarks, "plate-offset")
    each = ", ".join(f"{offset.data['force']:.1f} N of plate {offset.subject}" for offset in offsets)
    return "; ".join([*said, f"without load taken off: {each}"] if each else said)


def _taken(imported: Imported) -> str:
    """When the taken strides began and ended, by what evidence."""
    chosen = _chosen_strides(imported)
    shown = dict.fromkeys(by for stride in chosen for by in (stride.start_by, stride.end_by) if by)
    ends = (", the end by " if len(chosen) == 1 else " and ").join(shown)
    evidence = f"; events by {ends}{_stated_events(imported)}"
    if "processing" in imported.cycle.notes:
        evidence += f"; {imported.cycle.notes['processing']}"
    if len(chosen) > 1:
        spread = np.std([stride.time for stride in chosen], ddof=1)
        closed = sum(stride.closed is not None for stride in chosen)
        return (
            f"{_counted(chosen)}, {imported.cycle.stride_time:.3f} s on average (standard deviation "
            f"{spread:.3f} s){evidence}" + (f"; {closed} closed cyclically" if closed else "")
        )
    (stride,) = chosen
    if stride.closed is None:
        return f"{stride.start:.3f} to {stride.end:.3f} s, toe-off {stride.toe_off:.3f} s{evidence}"
    first, last = stride.closed.window
    # instants of a closed stride are given where they were recorded
    strike, off = (first + (t - first) % stride.time for t in (stride.start, stride.toe_off))
    words = f"{_recorded_words(stride.closed)}; heel strike {strike:.3f} s, toe-off {off:.3f} s{evidence}"
    if stride.closed.gap >= 0.0005:
        words += f"; {100.0 * (last - first) / stride.time:.1f} % of a stride recorded"
    residual = stride.closed.residual
    angles = [abs(off) for name, off in residual.items() if name.endswith("_angle")]
    apart = [f"{math.degrees(max(angles)):.1f} deg"] if angles else []
    apart += [f"{1e3 * abs(residual['ankle_z']):.0f} mm"] if "ankle_z" in residual else []
    return f"{words}; ends meet within {' and '.join(apart)}" if apart else words


def _mass(imported: Imported) -> str:
    mass = imported.mass
    if mass.how == "by the plates":
        return "; ".join(mass.remarks) or f"{mass.mass:.1f} kg, by the plates"
    said = f"{mass.mass:.1f} kg, {mass.how}"
    if mass.estimated is None:
        return said
    carried = f"the plates carry {mass.estimated:.1f} kg"
    for estimate in with_code(mass.remarks, "mass-by-plates"):
        carried += f" (±{estimate.data['percent']:.0f} %)"
    return f"{said}, {100.0 * (mass.mass / mass.estimated - 1.0):+z.1f} % off: {carried}"


def _height(imported: Imported) -> str:
    height = imported.cycle.body_height
    if height is None:
        return "height not known: a run keeps its patient's"
    return f"height {height:.2f} m" + (" of the file" if height == imported.trial.stated.height else "")


def _ankle(imported: Imported) -> str:
    height = 1e3 * imported.cycle.ankle_height
    zero = math.degrees(imported.zero)
    moved = "as in the file" if zero == 0.0 else f"moved by {-zero:+z.1f} deg"
    sole = imported.cycle.sole_thickness
    worn = "sole not known: taken as barefoot" if sole is None else f"sole {1e3 * sole:.0f} mm"
    flat = f"with the foot flat, {imported.cycle.flat.words}"
    said = f"zero {moved}; centre {height:.0f} mm above the floor {flat}; {worn}"
    cycle, stated = imported.cycle, imported.trial.stated
    own = stated_over(stated.time, stated.angles, _chosen_strides(imported), cycle.phase)
    if own is None:
        return said
    off = np.degrees(own - cycle.ankle_angle)[np.isfinite(own)]  # whose zero may be another
    apart = f"{off.mean():+z.1f} deg, else within {np.std(off):.1f} deg RMS"
    return f"{said}; the laboratory's own angle {apart}"


def _stated_events(imported: Imported) -> str:
    """How much earlier or later than the taken strides' events the laboratory marked its own."""
    apart: dict[str, list[float]] = {"heel strike": [], "toe-off": []}
    for stride in _chosen_strides(imported):
        for own in (stride.start, stride.end, stride.toe_off):
            name = "toe-off" if own == stride.toe_off else "heel strike"
            marked = imported.trial.stated.events.get((stride.side, name), ())
            apart[name] += [at - own for at in marked if abs(at - own) < _NEAR]
    each = [f"{name} {1e3 * float(np.mean(off)):+z.0f} ms" for name, off in apart.items() if off]
    return f"; the laboratory's events: {', '.join(each)} from these" if each else ""


def _moment(imported: Imported) -> str:
    """Both peaks with their phases, where they come from, and how far the two sources are apart."""
    cycle = imported.cycle
    names = ("plantarflexor", "dorsiflexor")
    peaks = [
        f"{name} {peak.text()}" + (f" at {100.0 * peak.phase:.0f} %" if peak.value > 0.0 else "")
        for name, peak in zip(names, _moment_peaks(imported), strict=True)
    ]
    given = _moment_is_given(cycle)
    words = f"{', '.join(peaks)}, by the {'given inverse dynamics' if given else 'ground force'}"
    if imported.reference is None:
        return words
    known = (cycle.grf_z > STANCE_FORCE) & np.isfinite(imported.reference)
    if not known.any():
        return words
    error = np.sqrt(np.mean((cycle.ground_moment() - imported.reference)[known] ** 2))
    other = "the ground force" if given else "the given inverse dynamics"
    other = "the laboratory's own" if imported.trial.moments is None else other
    return f"{words}; {error:.3f} N·m/kg RMS from {other} in stance"


def _moment_is_given(cycle: GaitCycle) -> bool:
    return cycle.notes.get("ankle_moment", FROM_GROUND_FORCE) != FROM_GROUND_FORCE


def _estimated(imported: Imported) -> str:
    """What was not measured, and what its error does to moment or angle."""
    points = imported.legs[imported.cycle.side].points
    error = _ankle_error(imported)
    size = f"±{1e3 * _ANKLE_ERROR:.0f} mm fore-aft (assumed): " if error is None else ""
    said = [f"ankle {size}±{_moment_peaks(imported)[0].error:.2f} N·m/kg"]
    leans = []
    for role, segment, below in (("knee", "shank", "ankle"), ("hip", "thigh", "knee")):
        error = points[role].error
        if error is not None:
            length = np.nanmedian(np.linalg.norm(points[role].path - points[below].path, axis=1))
            leans.append(f"{segment} ±{math.degrees(error / length):.1f} deg")
    said += [", ".join(leans)] if leans else []
    if not _moment_is_given(imported.cycle):
        said.append(f"foot as massless ±{_MASSLESS} N·m/kg")
    return "; ".join(said)


def _better(imported: Imported) -> str:
    """The first two of what is lacking, in the order of what it does to the ankle's moment."""
    points = imported.legs[imported.cycle.side].points
    chosen = _chosen_strides(imported)
    wishes = [f"{role}: {points[role].better}" for role in _WORTH if points[role].better]
    if not all(stride.loaded for stride in chosen):
        wishes.insert(0, "a plate under the whole stance")
    if imported.mass.how == "by the plates":
        wishes.insert(1, "body mass from scales")
    if any(stride.closed is not None for stride in chosen):
        wishes.append("a recording of a whole stride")
    if sum(stride.side == imported.cycle.side and stride.loaded for stride in imported.strides) == 1:
        wishes.append("more strides on plates, for their mean")
    return "; ".join(wishes[:_WISHES]) or "nothing that is known"


def _centres(points: Mapping[str, LegPoint]) -> str:
    """Each point with its error and its way; those of one way stand together."""
    groups: dict[str, list[tuple[str, str, float | None]]] = {}  # way: role, its source, its error
    for role, point in points.items():
        way = ", ".join(part for part in (point.way, "standing" if point.carriers else "") if part)
        groups.setdefault(way or point.source, []).append((role, point.source if way else "", point.error))
    said, axis = [], " fore-aft"  # the axis is said with the first error alone
    for way, each in groups.items():
        sources, words = [source for _, source, _ in each], []
        for role, _, error in each:
            words.append(role if error is None else f"{role} ±{1e3 * error:.0f} mm{axis}")
            axis = axis if error is None else ""
        if len(set(sources)) == 1:
            way = ", ".join(filter(None, (sources[0], way)))
        else:
            words = [f"{word} {source}".strip() for word, source in zip(words, sources, strict=True)]
        said.append(f"{', '.join(words)}: {way}")
    return "; ".join(said)


def _bridged(leg: LegPoints, strides: Sequence[RecordedStride]) -> list[str]:
    """Points that were not seen in a part of the strides, where their segment's markers stand in for them."""
    inside = np.zeros(len(leg.time), dtype=bool)
    for stride in strides:
        if stride.side == leg.side:
            first, last = (stride.start, stride.end) if stride.closed is None else stride.closed.window
            inside |= (leg.time >= first) & (leg.time <= last)
    shares: dict[str, list[str]] = {}
    for role, point in leg.points.items():
        if point.bridged is not None and point.bridged[inside].any():
            shares.setdefault(f"{100.0 * point.bridged[inside].mean():.0f} %", []).append(role)
    return [
        f"{', '.join(roles)} by the segment's markers in {share} of the stride"
        for share, roles in shares.items()
    ]


@dataclass(frozen=True)
class MomentPeak:
    """The greatest moment of one direction in stance."""

    value: float  # [N·m/kg]; 0 if the moment never has this direction
    phase: float  # [-]
    error: float  # by the ankle centre's: its arm times the upward force at this phase [N·m/kg]
    sides: Mapping[str, float]  # each side's own peak where both legs were averaged, else empty [N·m/kg]

    def text(self) -> str:
        """The peak with its error in N·m/kg."""
        return "none" if self.value <= 0.0 else f"{self.value:.2f} ±{self.error:.2f}"

    def long_text(self, unit: str = "") -> str:
        """The same with a unit, and with both sides' own."""
        if self.value <= 0.0:
            return self.text()
        own = ", ".join(f"{side} {value:.2f}" for side, value in self.sides.items())
        return f"{self.text()}{unit}" + (f" ({own})" if own else "")


def _moment_peaks(imported: Imported) -> tuple[MomentPeak, MomentPeak]:
    """The plantarflexor's and the dorsiflexor's peak of the taken stride."""
    cycle = imported.cycle
    stance = (cycle.grf_z > STANCE_FORCE) & (cycle.phase < LATE_SWING)
    chosen: dict[str, list[np.ndarray]] = {}
    for index in imported.chosen:
        chosen.setdefault(imported.strides[index].side, []).append(imported.cycles[index].ankle_moment)
    means = {side: np.mean(moments, axis=0) for side, moments in chosen.items()} if len(chosen) > 1 else {}
    arm = _ankle_error(imported)
    found = []
    for sign in (-1.0, 1.0):  # dorsiflexion is positive
        k = int(np.argmax(np.where(stance, sign * cycle.ankle_moment, -np.inf)))
        sides = {side: max(0.0, float((sign * moment)[stance].max())) for side, moment in means.items()}
        error = (_ANKLE_ERROR if arm is None else arm) * GRAVITY * float(cycle.grf_z[k])
        highest = max(0.0, float(sign * cycle.ankle_moment[k]))
        found.append(MomentPeak(highest, float(cycle.phase[k]), error, sides))
    return found[0], found[1]


def _ankle_error(imported: Imported) -> float | None:
    """The ankle centre's error, the larger of two averaged legs' [m]; None where it is not known."""
    sides = {imported.strides[index].side for index in imported.chosen}
    errors = [imported.legs[side].points["ankle"].error for side in sides if side in imported.legs]
    known = [error for error in errors if error is not None]
    return max(known) if known and len(known) == len(errors) else None
