"""Newton's law as a check of a trial: the force of all plates against the acceleration of the trunk.

While every foot that stands is on a plate, Σ F(t + τ) / m = g + c a(t): F is a plate's upward force, m the
mass of the body by that plate, a the trunk's upward acceleration, c the body's share of it, and τ how late
the force is.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.gait_lab.readers.signals import evenly, fill_gaps, low_pass
from afo_sim.gait_lab.trial.events import find_events
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.strides import beside_heel_strike, steps
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

_CUTOFF = 5.0  # of force and acceleration; beyond it the trunk is no rigid body (assumed) [Hz]
_SHARE = (0.84, 0.05)  # of the trunk's acceleration that the body has; 0.80 to 0.86 in five walks (measured)
# Scatter of the delay about none between sound walks, beyond its own error: 6 ms in twelve public ones by
# the trunk (4 ±5 ms, measured); by pelvis and hips, which sway about the centre of mass, more (assumed) [s]
_SCATTER = {"trunk": 0.006, "pelvis": 0.008}
_RATE = 100.0  # at which the two are compared [Hz]
_DELAYS = np.arange(-0.15, 0.155, 0.01)  # that are tried, before the best one is refined [s]
_SWINGS = 0.7  # speed of a toe that does not stand; noise of 2 mm at 20 Hz makes 0.2 (derived) [m/s]
_NEAR = 0.05  # from a contact, in which its foot may stand: clocks differ, events blur (assumed) [s]
_BESIDE = 0.04  # about a stance beside the plates, which is left out with it (assumed) [s]
_END = 0.1  # of what was seen, in which a filtered acceleration is not known (assumed) [s]
_LEAST = 0.25  # time that is judged; a single support lasts 0.35 to 0.45 (assumed) [s]
_KNOWN = 0.3  # error of a mass by a plate, from which on it says nothing (assumed) [-]
_FEW = 12  # contacts of which each is left out in turn to find one half beside its plate; more outweigh it
_LOADED = 100.0  # force from which on a plate takes part [N]
_ABOVE = (0.15, 0.9)  # height over the pelvis of a marker on trunk or head (assumed) [m]
_WIDE = 0.35  # distance level from the pelvis beyond which it is of somebody else (assumed) [m]
_ARM = 0.12  # way to and fro about the pelvis of a marker on an arm (assumed) [m]
# Correlation of force and acceleration: from the first on the delay is clear; above the second the mass is,
# to which the mean force counts (both assumed) [-]
_FOLLOWS, _CARRIES = 0.95, 0.8
UNAIDED = "no cane, rail or harness, no foot off its plate"
_Loads = Mapping[str, tuple[np.ndarray, np.ndarray]]  # time and upward force of each plate
_Contacts = Sequence[tuple[str, PlateContact]]  # of which foot


@dataclass(frozen=True, eq=False)
class Newton:
    """Results of Newton's law for a trial, each with a standard error."""

    late: tuple[float, float]  # how late the force is [s]
    by: str  # what moves: "trunk", or "pelvis" (or hips) alone
    masses: Mapping[str, tuple[float, float]]  # of the body with all it carries, by each plate [kg]
    correlation: float  # of force and acceleration [-]
    share: float  # of the trunk's acceleration that the body has [-]
    time: float  # with all standing feet on plates [s]
    left_out: str = ""  # the one foot whose force does not follow, in words
    why: str = ""  # it stands in part beside its plate, as the heel shows; empty where nothing explains it

    @property
    def follows(self) -> bool:
        """Whether the force follows what moves, so that its delay can be told."""
        return self.correlation >= _FOLLOWS

    @property
    def mass(self) -> tuple[float, float]:
        """Of the body with all it carries, by all plates, the less sure the more these differ [kg]."""
        each, error = np.array(list(self.masses.values())).T
        weight = error**-2.0
        mean = float(each @ weight / weight.sum())
        spread = float((each - mean) ** 2 @ weight) / max(len(each) - 1, 1)
        return mean, float(np.sqrt(max(spread, 1.0) / weight.sum()))


def find_newton(
    trial: WalkingTrial, legs: Mapping[str, LegPoints], motions: Mapping[str, LegMotion],
    grounds: Mapping[str, GroundForce], frame: WalkingFrame,
) -> Newton | str:  # fmt: skip
    """Compare the plates' force with the trunk's acceleration, or return what is missing for it."""
    if len(motions) < 2:
        return "both legs"
    time, upward, by = _acceleration(trial, legs, frame)
    contacts = [(side, contact) for side, ground in grounds.items() for contact in steps(ground)]
    used = {contact.plate for ground in grounds.values() for contact in ground.contacts}  # none of others'
    plates = {k: plate for k, plate in next(iter(grounds.values())).plates.items() if k in used}
    loads = {name: (evenly(t, f)[0], low_pass(*evenly(t, f), _CUTOFF)) for name, (t, f) in plates.items()}

    def compare(those: _Contacts) -> Newton | None:
        return _compare(time, upward, by, _complete(time, motions, those, frame.belt_speed), loads)

    found = compare(contacts)
    if found is None:
        return "all standing feet on plates for 0.25 s, and the trunk or the pelvis seen then"
    for side, contact in contacts if 1 < len(contacts) <= _FEW and not found.follows else ():
        less = compare([other for other in contacts if other != (side, contact)])
        if less is not None and less.correlation > max(_FOLLOWS, found.correlation):
            foot = f"the {side} foot at {contact.start:.2f} s on plate {contact.plate}"
            why = beside_heel_strike(contact.start, motions[side], find_events(motions[side]))
            if why or by == "trunk":  # a pelvis' sway alone may follow better without one of few contacts
                found = replace(less, left_out=foot, why=why)
    low, high = _SHARE[0] - 4.0 * _SHARE[1], _SHARE[0] + 4.0 * _SHARE[1]
    if found.correlation >= _CARRIES and low <= found.share <= high:
        return found
    seen = f"correlation {_CARRIES:g}, here {found.correlation:.2f}"
    if found.correlation >= _CARRIES:
        seen = f"{low:.2f} to {high:.2f} of its acceleration over the mass, here {found.share:.2f}"
    return f"a force that follows the {by} ({seen}): {UNAIDED}"


def _acceleration(
    trial: WalkingTrial, legs: Mapping[str, LegPoints], frame: WalkingFrame
) -> tuple[np.ndarray, np.ndarray, str]:
    """Times, upward acceleration of trunk and head, else of pelvis or hips, NaN if not known; and which."""
    leg, *others = legs.values()
    hips = np.mean([each.points["hip"].path for each in (leg, *others)], axis=0)
    base = hips if leg.pelvis is None else leg.pelvis
    trunk: list[np.ndarray] = []
    for path in trial.markers.positions.values() if trial.markers else ():
        if leg.by_angles or len(path) != len(base):
            break
        way = frame.plane(path - base)
        way = way[np.isfinite(way).all(axis=1)]
        if len(way) < 0.4 * len(path) or not _ABOVE[0] < np.median(way[:, 1]) < _ABOVE[1]:
            continue
        if max(abs(np.nanmedian(frame.across(path - base))), abs(np.median(way[:, 0]))) > _WIDE:
            continue
        if np.ptp(np.quantile(way[:, 0], [0.02, 0.98])) < _ARM:
            trunk.append(path)
    seen = bool(trunk) and bool(np.isfinite(trunk).all(axis=(0, 2)).any())
    filled = [fill_gaps(leg.time, frame.plane(path)[:, 1]) for path in (trunk if seen else [base])]
    time, height = evenly(leg.time, np.mean([heights for heights, _ in filled], axis=0))
    upward = np.gradient(np.gradient(low_pass(time, height, _CUTOFF), time), time)
    ends = [(time[0], time[0]), (time[-1], time[-1])]
    for start, end in itertools.chain(ends, *(gaps for _, gaps in filled)):
        upward[(time > start - _END) & (time < end + _END)] = np.nan
    return time, upward, "trunk" if seen else "pelvis"


def _complete(
    time: np.ndarray, motions: Mapping[str, LegMotion], contacts: _Contacts, belt_speed: float
) -> np.ndarray:
    """Where somebody stands on a plate, and nobody's foot beside the plates (n,)."""
    on, beside = np.zeros((2, len(time)), dtype=bool)
    edge = round(_BESIDE / float(time[1] - time[0]))
    for side, motion in motions.items():
        speed = np.gradient(motion.toe[:, 0] + belt_speed * motion.time, motion.time)
        stands = ~(np.interp(time, motion.time, speed > _SWINGS, left=0.0, right=0.0) > 0.5)
        for what, start, end in motion.hidden:
            stands |= what.startswith("toe") & (time > start) & (time < end)
        for own, contact in contacts:
            if own == side:
                on |= (time >= contact.start) & (time <= contact.end)
                start = contact.start - _NEAR * contact.begins
                stands &= ~((time >= start) & (time <= contact.end + _NEAR * contact.ends))
        beside |= np.convolve(stands, np.ones(2 * edge + 1), "same") > 0.5
    return on & ~beside


def _compare(
    time: np.ndarray, upward: np.ndarray, by: str, complete: np.ndarray, loads: _Loads
) -> Newton | None:
    """Fit delay, masses and share over the moments at which the whole force is known."""
    where = complete & np.isfinite(upward)
    step = float(time[1] - time[0])
    thin = max(1, round(1.0 / (_RATE * step)))
    at, pull, lasts = time[where][::thin], upward[where][::thin], float(where.sum() * step)
    names = [name for name, (t, f) in loads.items() if len(at) and np.interp(at, t, f).max() > _LOADED]
    if lasts < _LEAST or not names:
        return None
    count = 2.0 * _CUTOFF * lasts  # neighbouring samples of a filtered signal say the same

    def forces(late: float) -> np.ndarray:
        return np.column_stack([np.interp(at + late, *loads[name]) for name in names])

    def solve(late: float, error: float, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One over each mass, the share, a change of the delay; their covariance."""
        rows = np.column_stack([forces(late), -pull, slope]) * np.sqrt(count / len(at)) / error
        wanted = np.full(len(at), GRAVITY * np.sqrt(count / len(at)) / error)
        known = np.zeros((2, rows.shape[1]))  # of the share; of a change without a slope
        known[0, -2], known[1, -1] = 1.0 / _SHARE[1], 1e-9 if slope.any() else 1.0
        full = np.vstack([rows, known])
        inverse = np.linalg.pinv(full.T @ full)
        return inverse @ full.T @ np.r_[wanted, _SHARE[0] / _SHARE[1], 0.0], inverse

    def residual(late: float, found: np.ndarray) -> float:
        off = forces(late) @ found[:-2] - found[-2] * pull - GRAVITY
        return float(np.sqrt(np.mean(off**2) * count / max(count - len(found), 1.0)))

    flat = np.zeros(len(at))
    late = float(min(_DELAYS, key=lambda delay: residual(delay, solve(delay, 0.3, flat)[0])))
    found, inverse = solve(late, 0.3, flat)
    for _ in range(5):  # Gauss and Newton: the delay is the one unknown that is not linear
        slope = (forces(late + 2e-3) - forces(late - 2e-3)) @ found[:-2] / 4e-3
        found, inverse = solve(late, max(residual(late, found), 0.02), slope)
        late += float(np.clip(found[-1], -0.01, 0.01))
    each = list(zip(names, found, np.sqrt(np.diag(inverse)), strict=False))
    if not any(error < _KNOWN * x for _, x, error in each):
        return None
    return Newton(
        late=(late, float(np.hypot(np.sqrt(inverse[-1, -1]), _SCATTER[by]))),
        by=by,
        # without plates that hardly bear anything in these moments
        masses={name: (float(1.0 / x), float(error / x**2)) for name, x, error in each if error < _KNOWN * x},
        correlation=float(np.corrcoef(forces(late) @ found[:-2], pull)[0, 1]),
        share=float(found[-2]),
        time=lasts,
    )
