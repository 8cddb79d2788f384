"""The body's mass: given, of the file, of the model, or what the plates carry over whole strides."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY, InputError, Keywords, Notice
from afo_sim.gait import RANGES
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.newton import Newton
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride

_DIFFERENCE = 0.1  # between two masses from which on a person is warned
# Error of the estimate from both legs: speed upward that differs by 0.2 m/s at the ends of a stride of 1.1 s;
# derived
_BOTH_LEGS = 0.02
_ONE_LEG = 0.05  # error where one leg's share is taken for half; assumed, and more of a hemiparetic walk
_CLEAR = 0.9  # correlation of force and acceleration from which on Newton's mass is taken; assumed
_NEWTON = 0.01  # error of Newton's law beside its own: what a trunk is not of the whole body; assumed
_UNLIKE = 1.25  # ratio of the legs' impulses that are reported, 44 % and 56 % of the weight; assumed
_QUIET = 0.1  # distance from any contact at which a plate carries nobody [s]
_QUIET_ENOUGH = 0.1  # time of that which shows a plate's offset [s]
_OFFSET = 5.0  # of a plate from which on it is reported [N]
_TAIL = 0.03  # before and after a contact, in which the force is below its edge of 20 N [s]


@dataclass(frozen=True)
class BodyMass(Noted):
    """The mass that is taken, and what it was compared with."""

    mass: float  # [kg]
    how: str  # "given", "of the file", "of the model" or "by the plates"
    estimated: float | None = None  # by the plates, where they carry a whole stance [kg]
    one_leg: bool = False  # the estimate is twice one leg's share, as if nobody limped
    notices: tuple[Notice, ...] = ()


def find_mass(
    grounds: Mapping[str, GroundForce], strides: Sequence[RecordedStride], given: float | None,
    of_model: float | None, of_file: float | None = None, law: Newton | str = "",
) -> BodyMass:  # fmt: skip
    """The mass that is given, or else the laboratory's in its file, the model's, the plates' estimate."""
    found, error, notices = _estimate(grounds, strides)
    one_leg = found is not None and len({s.side for s in strides if s.loaded and s.side in grounds}) == 1
    clear = isinstance(law, Newton) and law.correlation >= _CLEAR
    if isinstance(law, Newton) and clear and np.hypot(law.mass[1], _NEWTON * law.mass[0]) < error:
        (found, error), one_leg = law.mass, False
        text = "the plates carry {mass:.1f} kg (±{percent:.0f} %) by Newton's law over {time:.2f} s"
        percent = 100.0 * float(np.hypot(error / found, _NEWTON))
        said = note("mass-by-plates", text, mass=found, percent=percent, time=law.time)
        notices = [said, *(each for each in notices if each.code == "plate-offset-in-mass")]
    masses = {"given": given, "of the file": of_file, "of the model": of_model, "by the plates": found}
    sure = found is not None and not one_leg and not any(n.code == "legs-unlike" for n in notices)
    if sure and found and of_model and abs(of_model / found - 1.0) > _DIFFERENCE:
        masses["of the model"] = masses.pop("of the model")  # behind the plates
    how = next((name for name, mass in masses.items() if mass is not None), None)
    mass = masses[how] if how else None
    if how is None or mass is None:
        raise InputError("the body mass is not in the files", field="mass", allowed='for example "72 kg"')
    low, high = RANGES["body_mass_kg"]
    if how == "by the plates" and not low <= mass <= high:
        problem = f"the plates carry {mass:.3g} kg: forces in another unit?"
        raise InputError(problem, field="mass", allowed=f"{low:g} to {high:g} kg")
    if how == "by the plates" and one_leg:
        text = "the mass, {mass:.1f} kg, is twice what one leg carries: a leg that carries 40 % of the "
        text += "weight makes it 20 % too small; state the mass"
        notices.append(Notice("mass-of-one-leg", text, mass=mass))
    for name, other in masses.items():
        # Newton's law is judged with its own error, among the trial's checks
        judged = isinstance(law, Newton) and name == "by the plates"
        if other is not None and name != how and not judged and abs(mass / other - 1.0) > _DIFFERENCE:
            text = "the mass {how}, {mass:.1f} kg, is used; {subject} it is {other:.1f} kg "
            text += "({percent:+.0f} % off that)"
            off = 100.0 * (mass / other - 1.0)
            told = Notice("mass-differs", text, subject=name, how=how, mass=mass, other=other, percent=off)
            notices.append(told)
    return BodyMass(mass, how, found, one_leg, tuple(notices))


def _estimate(
    grounds: Mapping[str, GroundForce], strides: Sequence[RecordedStride]
) -> tuple[float | None, float, list[Notice]]:
    """Mass by the plates, None where no whole stance is on them, and its error [kg]; notices."""
    offsets = _offsets(grounds)
    shares: dict[str, list[float]] = {}
    for stride in strides:
        if stride.loaded and stride.side in grounds:
            impulse = _impulse(grounds[stride.side], stride, offsets)
            shares.setdefault(stride.side, []).append(impulse / (stride.end - stride.start) / GRAVITY)
    text = "plate {subject} reads {force:+.0f} N while unloaded; the mass is estimated without that"
    notices = [
        Notice("plate-offset-in-mass", text, subject=name, force=offset)
        for name, offset in offsets.items()
        if abs(offset) > _OFFSET
    ]
    if not shares:
        return None, np.inf, notices
    means = {side: float(np.mean(each)) for side, each in shares.items()}
    mass = sum(means.values()) * 2.0 / len(means)
    error, symmetry = (_BOTH_LEGS, "") if len(means) == 2 else (_ONE_LEG, ", assuming equal legs")
    low, high = min(means, key=means.__getitem__), max(means, key=means.__getitem__)
    if means[high] > _UNLIKE * means[low]:
        error = (means[high] - means[low]) / mass
        text = "the {subject} leg carries only {percent:.0f} % of the weight: a limp, or a foot partly off "
        text += "its plate; then the mass is more likely {rather:.1f} kg"
        percent, rather = 100.0 * means[low] / mass, 2.0 * means[high]
        notices.append(Notice("legs-unlike", text, subject=low, percent=percent, rather=rather))
    counted = " and ".join(f"{len(each)} {side}" for side, each in shares.items())
    word = "strides" if sum(map(len, shares.values())) > 1 else "stride"
    text = "the plates carry {mass:.1f} kg (±{percent:.0f} %) over {strides}{symmetry}"
    data: Keywords = {"percent": 100.0 * error, "strides": f"{counted} {word}", "symmetry": symmetry}
    return mass, error * mass, [note("mass-by-plates", text, mass=mass, **data), *notices]


def _impulse(ground: GroundForce, stride: RecordedStride, offsets: Mapping[str, float]) -> float:
    """Vertical impulse on the foot in one period, without the plates' offset [N·s]."""
    contacts = [(contact, offsets.get(contact.plate, 0.0)) for contact in ground.contacts]
    if stride.closed is None:
        low, high = stride.start - _QUIET, stride.toe_off + _QUIET
        return sum(_of_contact(ground, c, o)[0] for c, o in contacts if low <= c.start and c.end <= high)
    window = stride.closed.window
    parts = [_of_contact(ground, contact, offset, window) for contact, offset in contacts]
    gap = stride.time - (window[1] - window[0])
    return sum(impulse for impulse, _ in parts) + 0.5 * gap * sum(ends for _, ends in parts)


def _of_contact(
    ground: GroundForce, contact: PlateContact, offset: float, window: tuple[float, float] | None = None
) -> tuple[float, float]:
    """A contact's impulse within a window [N·s], and its force at the window's two ends together [N]."""
    time, force = ground.plates.get(contact.plate, (ground.time, ground.force_z))
    low, high = contact.start - _TAIL, contact.end + _TAIL
    if window is None:
        inside = (time >= low) & (time <= high)
        return float(np.trapezoid(force[inside] - offset, time[inside])), 0.0
    first, last = max(low, window[0]), min(high, window[1])
    if first >= last:
        return 0.0, 0.0
    inside = (time > first) & (time < last)
    at = np.r_[first, time[inside], last]
    load = np.interp(at, time, force) - offset
    ends = load[0] * (first == window[0]) + load[-1] * (last == window[1])
    return float(np.trapezoid(load, at)), float(ends)


def _offsets(grounds: Mapping[str, GroundForce]) -> dict[str, float]:
    """What each plate reads without load [N]; 0 if it is always loaded."""
    plates = {name: each for ground in grounds.values() for name, each in ground.plates.items()}
    contacts = [c for ground in grounds.values() for c in (*ground.contacts, *ground.foreign)]
    found = {}
    for name, (time, force) in plates.items():
        quiet = np.ones(len(time), dtype=bool)
        for contact in contacts:
            if contact.plate == name:
                quiet &= (time < contact.start - _QUIET) | (time > contact.end + _QUIET)
        step = (time[-1] - time[0]) / max(1, len(time) - 1)
        found[name] = float(np.median(force[quiet])) if quiet.sum() * step >= _QUIET_ENOUGH else 0.0
    return found
