"""The ground's force on one foot: contacts found on the plates, assigned to feet, put together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import InputError, Notice, unknown
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.plates import PRESSED, Plate
from afo_sim.gait_lab.readers.signals import evenly, low_pass, stretches
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import LegPoints, Legs
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

EDGE = 20.0  # vertical force at which a contact begins and ends [N]
_SURE = 50.0  # vertical force that a contact must exceed, so that noise about the edge is none [N]
_SHORTEST = 0.1  # whole contact that is a step [s]
_LEVEL = 0.01  # height of the plates that is none (assumed) [m]
_UNDER_FOOT = (-0.25, 0.35)  # where the centre of pressure can be ahead of the same leg's ankle [m]

_REACH = 0.15  # mean distance of a foot's pressure from its line heel–toe, beyond which it is another's or a
# crutch's; 1 to 6 cm in the feet of four recorded walks, the other foot's 35 cm and more (derived) [m]
_PLANAR = 1e-4  # width of a leg that is known in the plane of walking alone [m]


@dataclass(frozen=True)
class PlateContact:
    """A foot on a plate."""

    plate: str
    start: float  # [s], to a part of a sample
    end: float
    begins: bool = True  # with a heel strike, not with the recording
    ends: bool = True  # with a toe-off, likewise

    @property
    def whole(self) -> bool:
        """Whether neither end is the recording's."""
        return self.begins and self.ends


@dataclass(frozen=True, eq=False)
class GroundForce(Noted):
    """Force on one foot in the sagittal plane, filtered; zero outside its contacts. Arrays (n,)."""

    time: np.ndarray  # [s]
    force_x: np.ndarray  # forward [N]
    force_z: np.ndarray  # upward [N]
    moment: np.ndarray  # centre of pressure on the floor times upward force [N·m]
    contacts: tuple[PlateContact, ...]  # own, in order
    plates: dict[str, tuple[np.ndarray, np.ndarray]]  # name: time, upward force as read, for the picture
    foreign: tuple[PlateContact, ...] = ()
    notices: tuple[Notice, ...] = ()


def find_contacts(plate: str, time: np.ndarray, force: np.ndarray) -> list[PlateContact]:
    """Contacts in a plate's upward force [N]: above 20 N, reaching 50 N, for 0.1 s unless cut short."""
    found = []
    for first, stop in stretches(force > EDGE):
        begins, ends = first > 0, stop < len(time)
        if (begins or force[first] < _SURE) and (ends or force[stop - 1] < _SURE):
            begins = ends = True  # the recording's end is hardly before the contact's
        start = _crossing(time, force, first - 1) if first > 0 else float(time[0])
        end = _crossing(time, force, stop - 1) if stop < len(time) else float(time[-1])
        contact = PlateContact(plate, start, end, begins, ends)
        if force[first:stop].max() > _SURE and (end - start >= _SHORTEST or not contact.whole):
            found.append(contact)
    return found


def with_floor(frame: WalkingFrame, plates: Sequence[Plate]) -> WalkingFrame:
    """The frame with the plates' surface as its floor, where that is not the laboratory's zero."""
    pressed = [frame.plane(p.place)[np.abs(frame.plane(p.force)[:, 1]) > PRESSED, 1] for p in plates]
    heights = np.concatenate([np.zeros(0), *pressed])
    floor = float(np.median(heights)) if len(heights) else 0.0
    if abs(floor) < _LEVEL:
        return frame
    text = "the plates lie {above_mm:+.0f} mm above the laboratory's zero: the floor is taken to be there"
    return replace(frame, floor=floor, notices=(*frame.notices, note("floor", text, above_mm=1e3 * floor)))


def foot_force(
    plates: Sequence[Plate], motion: LegMotion, legs: Legs, frame: WalkingFrame, choices: Choices
) -> GroundForce:
    """The ground's force on one foot."""
    names = [plate.name for plate in plates]
    for name in choices.plates:
        if name not in names:
            raise unknown(name, names, field="plate", problem="there is no such plate")
    chosen = [plate for plate in plates if not choices.plates or plate.name in choices.plates]
    loads = [_plate_load(plate, motion, legs, frame) for plate in chosen]
    contacts = [contact for load in loads for contact, own in load.contacts if own]
    foreign = [contact for load in loads for contact, own in load.contacts if not own]
    if not contacts:
        strongest = max(float(load.force[:, 1].max()) for load in loads)
        side, (start, end) = motion.side, motion.time[[0, -1]]
        among = ", ".join(plate.name for plate in chosen)
        if not foreign and strongest > _SURE:
            seen = f"no contact on a plate ({among}) lasts {_SHORTEST:g} s, "
            seen += f"though it reaches {strongest:.4g} N"
            allowed = "steps on plates, no spikes: is a channel damaged?"
            raise InputError(seen, field="plate", allowed=allowed)
        if not foreign:
            problem = f"no foot stands on a plate ({among}): the largest upward force is {strongest:.3g} N"
            raise InputError(problem, allowed=f"one above {_SURE:g} N, in newtons and in the motion's axes")
        spans = ", ".join(f"plate {c.plate} from {c.start:.2f} to {c.end:.2f} s" for c in foreign[:6])
        if not any(c.start < end and c.end > start for c in foreign):
            seen = f"nobody stands on a plate while motion is recorded, {start:.2f} to {end:.2f} s ({spans})"
            raise InputError(seen, field="time", allowed="motion and forces of one trial, by one clock")
        problem = f"no contact has its centre of pressure under the {side} foot throughout ({spans})"
        allowed = "a plate that carries this foot alone, in the motion's axes"
        allowed += f"; or one of {among} alone" if len(chosen) > 1 else ""
        raise InputError(problem, field="side", value=side, allowed=allowed)
    grid, _ = evenly(chosen[0].time, chosen[0].time)
    force_x, force_z, moment = np.sum([load.on_grid(grid, choices.cutoff) for load in loads], axis=0).T
    used = ", ".join(dict.fromkeys(contact.plate for contact in contacts))
    notices = [note("foot-on-plates", "{subject} foot on plate {plates}", subject=motion.side, plates=used)]
    turned = [load.plate.name for load in loads if load.turned]
    if turned:
        which = "plates {plates}" if len(turned) > 1 else "plate {plates}"
        text = f"{which}: turned round to be the ground's force on the foot"
        notices.append(note("plates-turned", text, plates=", ".join(turned)))
    return GroundForce(
        time=grid,
        force_x=force_x,
        force_z=force_z,
        moment=moment,
        contacts=tuple(sorted(contacts, key=lambda c: c.start)),
        plates={load.plate.name: (load.plate.time, load.force[:, 1]) for load in loads},
        foreign=tuple(foreign),
        notices=tuple(notices),
    )


@dataclass(frozen=True, eq=False)
class _PlateLoad:
    """What one plate carries, in the plane of walking, and whose each contact is."""

    plate: Plate
    force: np.ndarray  # forward and upward [N] (n, 2)
    moment: np.ndarray  # about the laboratory's origin on the floor [N·m] (n,)
    contacts: list[tuple[PlateContact, bool]]  # each with whether it is of the leg's own foot
    turned: bool  # the file has the foot's force on the ground

    def on_grid(self, grid: np.ndarray, cutoff: float) -> np.ndarray:
        """Filtered forces and moment of the own contacts at the grid's times, 0 outside (m, 3)."""
        time, own = self.plate.time, np.zeros(len(self.force))
        for contact, mine in self.contacts:
            if mine:
                own[_with_tails(contact, time, self.force[:, 1])] = 1.0
        loads = np.column_stack([self.force, self.moment]) * own[:, None]
        smooth = low_pass(*evenly(time, loads), cutoff)
        even = evenly(time, time)[0]
        return np.column_stack([np.interp(grid, even, c, left=0.0, right=0.0) for c in smooth.T])


def _plate_load(plate: Plate, motion: LegMotion, legs: Legs, frame: WalkingFrame) -> _PlateLoad:
    force = frame.plane(plate.force)
    place = frame.over_floor(plate.place)
    turned = bool(force[:, 1].min() < -2.0 * _SURE and -force[:, 1].min() > force[:, 1].max())
    if turned:
        force = -force
    # the moment about the origin on the floor, from which the pressure on the floor follows
    force[np.abs(force[:, 1]) < 1.0] = 0.0
    moment = place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0]
    found = find_contacts(plate.name, plate.time, force[:, 1])
    known = [_under_foot(contact, plate.time, force[:, 1], place[:, 0], motion) for contact in found]
    for k, contact in enumerate(found):
        sure = (plate.time > contact.start) & (plate.time < contact.end) & (force[:, 1] > _SURE)
        if known[k] and not stands_there(plate.time[sure], plate.place[sure], motion.side, legs, frame):
            known[k] = False
    seen = [mine for mine in known if mine is not None]
    unseen = bool(seen) and all(seen)  # a plate that carries this foot alone
    contacts = [(c, unseen if mine is None else mine) for c, mine in zip(found, known, strict=True)]
    return _PlateLoad(plate, force, moment, contacts, turned)


def _crossing(time: np.ndarray, force: np.ndarray, k: int) -> float:
    """Time at which the force passes the edge between samples k and k + 1 [s]."""
    share = (EDGE - force[k]) / (force[k + 1] - force[k])
    return float(time[k] + share * (time[k + 1] - time[k]))


def _under_foot(
    contact: PlateContact, time: np.ndarray, force: np.ndarray, place: np.ndarray, motion: LegMotion
) -> bool | None:
    """Whether the centre of pressure stays where the leg's own foot is; None where that is not known."""
    sure = (time > contact.start) & (time < contact.end) & (force > _SURE)
    sure &= (time >= motion.time[0]) & (time <= motion.time[-1])
    if not np.any(sure):
        return None
    ahead = place[sure] - np.interp(time[sure], motion.time, motion.ankle_x)
    low, high = np.quantile(ahead, [0.05, 0.95])
    return bool(_UNDER_FOOT[0] < low and high < _UNDER_FOOT[1])


def _with_tails(contact: PlateContact, time: np.ndarray, force: np.ndarray) -> slice:
    """The contact's samples, and those beside it while the force still falls to nothing."""
    first = int(np.searchsorted(time, contact.start))
    last = int(np.searchsorted(time, contact.end, side="right")) - 1
    while first > 0 and 0.0 < force[first - 1] < force[first]:
        first -= 1
    while last < len(force) - 1 and 0.0 < force[last + 1] < force[last]:
        last += 1
    return slice(first, last + 1)


def stands_there(time: np.ndarray, place: np.ndarray, side: str, legs: Legs, frame: WalkingFrame) -> bool:
    """Whether a centre of pressure is this foot's, by its line from heel to toe, seen from above."""
    wide = bool(np.ptp(frame.across(place))) and all(_width(leg, frame) > _PLANAR for leg in legs.values())
    pressed = _level(place, frame, wide)
    found = {}
    for name, leg in legs.items():
        near = slice(max(np.searchsorted(leg.time, time[0]) - 1, 0), np.searchsorted(leg.time, time[-1]) + 1)
        ways = [_level(leg.points[role].path[near], frame, wide) for role in ("heel", "toe")]
        # NaN before and after a way and beside its gaps
        ends = [
            np.column_stack([np.interp(time, leg.time[near], c, np.nan, np.nan) for c in way.T])
            for way in ways
        ]
        away = _distance(pressed, *ends)
        if np.isfinite(away).mean() > 0.5:
            found[name] = float(np.nanmean(away))
    if side not in found:
        return True
    return found[side] == min(found.values()) and (found[side] < _REACH or not wide)


def _width(leg: LegPoints, frame: WalkingFrame) -> float:
    """How far the leg's points lie apart across the walk [m]; none for one made of sagittal angles."""
    some = slice(None, None, max(1, len(leg.time) // 500))  # which is called for each contact of a trial
    across = np.array([frame.across(point.path[some]) for point in leg.points.values()])
    seen = across[:, np.isfinite(across).all(axis=0)]
    return float(np.ptp(seen, axis=0).max()) if seen.size else 0.0


def _level(points: np.ndarray, frame: WalkingFrame, wide: bool) -> np.ndarray:
    """(n, 3) in the laboratory → forward and across (n, 2); 0 across where that is not known."""
    return np.column_stack([frame.plane(points)[:, 0], frame.across(points) * wide])


def _distance(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance of points to lines between two ends, each (n, 2) [m] (n,)."""
    line = end - start
    share = np.sum((points - start) * line, axis=1) / np.maximum(np.sum(line**2, axis=1), 1e-9)
    return np.asarray(np.linalg.norm(points - start - np.clip(share, 0.0, 1.0)[:, None] * line, axis=1))
