"""A torque fit as it is posed: readings, the orthosis of each group, parameters, and its predictions."""

import functools
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import OptimizeResult

from afo_sim.common import EXAMPLES, InputError, JsonMapping, Notice, unknown
from afo_sim.description import Orthosis
from afo_sim.lab.identifiability import memory, rms
from afo_sim.lab.measured import levels
from afo_sim.lab.solution import FitParameter, FitProblem
from afo_sim.lab.torque_data import SAME_ANGLE, Readings
from afo_sim.lab.torque_device import ANCHORS, Path, paths, statics
from afo_sim.physics import LAWS

STIFFEST = 1e7  # no cable of a device is stiffer [N/m]
CHANNELS = ("torque", "cuff")
USUAL_CHAMBER = "dorsiflexor"
LEFT = 0.9  # contraction ratio to either side that no path leaves
DISAGREE, APART = 0.05, 1e-3  # of its change, and [m], by which a path's length and moment arm may disagree
ROUND_OFF = 1e-6  # of its size, below which a value is nothing
BLOCKS = 5  # of angles
BEYOND = 1.25  # measured torque over that on rigid anchors, from which no stiffness can be the reason


def _stiffness(name: str) -> FitParameter:
    return FitParameter(name, "N/m", "kN/m", 100.0, STIFFEST, 5e3, 5e4, 5e3, STIFFEST, logarithmic=True)


OWN = {  # of each filled muscle's cable and brackets; of cuff and plate along the pull of all muscles
    "series_stiffness": _stiffness("series_stiffness"),
    "offset": FitParameter("offset", "m", "mm", 0.0, 0.1, 1e-3, 1e-2, 5e-3, 0.0),
    "cuff_stiffness": _stiffness("cuff_stiffness"),
    "plate_stiffness": _stiffness("plate_stiffness"),
}


def parameters(names: Sequence[str], orthoses: Sequence[Orthosis], chamber: str) -> tuple[FitParameter, ...]:
    """The parameters of these names, for the muscles on a chamber."""
    known = dict(OWN) | _of_law(orthoses, chamber)
    found = []
    if not names:
        raise InputError("names nothing", field="free", allowed=", ".join(known))
    for name in names:
        if name not in known:
            raise unknown(name, known, field="free", problem="is not a parameter that torques identify")
        if [*names].count(name) > 1:
            raise InputError("occurs twice", field="free", value=name)
        anchor = name in ("cuff_stiffness", "plate_stiffness")
        if anchor and not all(orthosis.anchored for orthosis in orthoses):
            problem = "has no effect: the muscles run over pulleys, which pull on no cuff"
            raise InputError(problem, field="free", value=name)
        found.append(known[name])
    return tuple(found)


def _of_law(orthoses: Sequence[Orthosis], chamber: str) -> dict[str, FitParameter]:
    """Parameters of the law of the filled muscles; none where several laws are in use."""
    muscles = [group.type for orthosis in orthoses for group in orthosis.muscles_of(chamber).values()]
    if len({muscle.law for muscle in muscles}) != 1:
        return {}
    found = {}
    for p in LAWS[muscles[0].law].parameters:
        own: Mapping[str, float] = muscles[0].law_set.parameters
        start = own.get(p.name, p.start[0])
        size = abs(start) or max(map(abs, p.start)) or 1.0
        usual = EXAMPLES[p.unit].partition(" ")[2] if p.unit else ""
        low, high = sorted((start, min(max(1.1 * start, p.lower), p.upper)))
        found[p.name] = FitParameter(p.name, p.unit, usual, p.lower, p.upper, low, high, size, of_law=True)
    return found


@dataclass(frozen=True, eq=False)
class Group:
    """Readings that belong together, and the orthosis that they were taken of."""

    readings: Readings  # torque over angle and pressure [SI]
    orthosis: Orthosis  # whose compliance is fitted

    @functools.cached_property
    def geometry(self) -> list[Path]:
        """The paths at the readings' angles, or as they were measured."""
        return paths(self.orthosis, self.readings.angle, self.readings.path)

    def __len__(self) -> int:
        return len(self.readings)


@dataclass(frozen=True, eq=False)
class TorqueProblem(FitProblem):
    """What is fitted to what; ten copies of a reading are one point of a larger weight."""

    groups: tuple[Group, ...]  # of readings
    free: tuple[FitParameter, ...]  # parameters
    chamber: str  # that is filled
    difference: bool = False  # the torques are those with air less those without
    fixed: Mapping[str, float] = field(default_factory=dict)  # values of the other parameters [SI], by name
    spread: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(CHANNELS, 1.0))
    """By which errors of each channel are divided [SI]."""

    inside = 1e-6

    def __len__(self) -> int:
        return sum(len(group) for group in self.groups)

    @property
    def options(self) -> JsonMapping:
        """Of scipy's least_squares."""
        tight = dict.fromkeys(("ftol", "xtol", "gtol"), 1e-11)
        return {"jac": "3-point", "x_scale": "jac", "max_nfev": 200, **tight}

    def ended(self, x: np.ndarray) -> dict[str, float]:
        """The parameters [SI] where a search ended; what is nothing but round-off is 0."""
        logarithmic = np.array([p.logarithmic for p in self.free])
        return self.values(np.where((np.abs(x) < ROUND_OFF) & ~logarithmic, 0.0, x))

    def starts(self) -> list[np.ndarray]:
        """A low and a high usual value of every parameter, in all combinations of up to four of them."""
        ends = [sorted({p.coordinate(p.low), p.coordinate(p.high)}) for p in self.free]
        some = [values if k < 4 else values[:1] for k, values in enumerate(ends)]
        return [np.array(x) for x in itertools.product(*some)]

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Errors of all channels in units of their sizes, each of the weight of its readings."""
        found, weight = errors(self, self.values(x)), np.sqrt(self.column("weight"))
        parts = [(weight * found[c] / self.spread[c])[np.isfinite(self.column(c))] for c in CHANNELS]
        return np.nan_to_num(np.concatenate(parts), nan=1e6, posinf=1e6, neginf=-1e6)

    def scaled(self, errors: Mapping[str, np.ndarray]) -> "TorqueProblem":
        """With each channel in units of the size of errors."""
        seen = {c: errors[c][np.isfinite(self.column(c))] for c in CHANNELS}
        return replace(self, spread={c: max(rms(e), 1e-6 * self.spread[c], 1e-9) for c, e in seen.items()})

    def memory(self, best: OptimizeResult) -> float:
        """Correlation of the torque errors of neighbouring angles, within a group and a pressure [-]."""
        found = errors(self, self.values(best.x))["torque"]
        rising, curve = np.argsort(self.column("angle"), kind="stable"), self.of_curve
        curves = [found[rising][curve[rising] == k] for k in np.unique(curve)]
        if (pairs := len(found) - len(curves)) < 5:
            return 0.0
        return min(max(memory(curves, float(np.sum(found**2))) * len(found) / pairs, 0.0), 0.95)

    @property
    def of_curve(self) -> np.ndarray:
        """The number of each reading's curve over the angle, of one group at one pressure level."""
        return np.unique([self.of_group, self.levels], axis=1, return_inverse=True)[1].ravel()

    @property
    def curves(self) -> float:
        """Each is one independent error at least."""
        return float(len(np.unique(self.of_curve)))

    @property
    def levels(self) -> np.ndarray:
        """The number of each reading's pressure level; pressures nearer than 2 % of their span are one."""
        return levels(self.column("pressure"), 1e5)

    @property
    def telling(self) -> int:
        """The number of settings."""
        return len(self)

    def parts(self, kind: str) -> dict[str, np.ndarray]:
        """Which readings are left out together, by a name for people; none where that cannot be done."""
        found = {name: mask for name, mask in self._parts(kind) if mask.any()}
        return found if len(found) > 1 else {}

    def _parts(self, kind: str) -> Iterator[tuple[str, np.ndarray]]:
        if kind == "group":
            for k, group in enumerate(self.groups):
                yield group.readings.group, self.of_group == k
        elif kind == "pressure":
            level, pressure = self.levels, self.column("pressure") * 1e-5
            for k in np.unique(level):
                yield f"{pressure[level == k].mean():.3g} bar", level == k
        else:
            degrees = np.round(np.degrees(self.column("angle")), 1)
            different = np.unique(degrees)
            for block in np.array_split(different, min(BLOCKS, len(different))):
                mask = (degrees >= block[0]) & (degrees <= block[-1])
                yield f"{block[0]:g} to {block[-1]:g} deg" if len(block) > 1 else f"{block[0]:g} deg", mask

    def missed(self, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Torque errors [N·m] of the settings."""
        return errors(self, values)["torque"], self.column("weight"), self.column("scatter")

    def take(self, keep: np.ndarray) -> "TorqueProblem":
        """Some of the readings, over all groups end to end; groups without any are gone."""
        parts = np.split(keep, np.cumsum([len(g) for g in self.groups])[:-1])
        kept = [(group, some) for group, some in zip(self.groups, parts, strict=True) if some.any()]
        groups = tuple(replace(group, readings=group.readings.take(some)) for group, some in kept)
        return replace(self, groups=groups)

    def column(self, name: str) -> np.ndarray:
        """A column of the readings, all groups end to end."""
        return np.concatenate([getattr(group.readings, name) for group in self.groups])

    @property
    def of_group(self) -> np.ndarray:
        """The number of its group, for each reading."""
        return np.repeat(np.arange(len(self.groups)), [len(group) for group in self.groups])


def on_muscles(readings: Readings, orthosis: Orthosis, chamber: str) -> Readings:
    """Readings with measured paths under the names of the filled muscles; checked."""
    if not readings.path:
        return readings
    muscles = orthosis.muscles_of(chamber)
    titles = {re.sub(r"[\s_]+", " ", name.lower()): name for name in muscles}
    if len(muscles) == 1 and "" in readings.path:
        titles = {"": next(iter(muscles))}
    if orthosis.joint_centre:
        problem = "is given in addition to the orthosis' joint_centre: only one may give the path"
        raise InputError(problem, file=readings.file, field="path length")
    if {*readings.path} != {*titles}:
        problem = f"is of {', '.join(readings.path) or 'no muscle by name'}"
        allowed = f"a column and a moment arm for each muscle that is filled: {', '.join(muscles)}"
        raise InputError(problem, file=readings.file, field="path length", allowed=allowed)
    for title, name in titles.items():
        length, arm = readings.path[title]
        left = 1.0 + (muscles[name].series_length - length) / muscles[name].type.nominal_length
        if np.abs(left).max() > LEFT:
            problem = f"leaves {name} a contraction ratio of {left.min():.2g} to {left.max():.2g}"
            allowed = "lengths from origin to insertion; over a pulley, longer than at angle zero by"
            raise InputError(problem, file=readings.file, field="path length", allowed=allowed)
        lengths, turned = _over_angle(readings, length, arm)
        if np.ptp(turned) > APART and np.sum((lengths - lengths.mean()) * turned) > 0.0:
            problem = "has the wrong sign: r = -dL/dangle, but the path's length increases with its integral"
            mean = f"{1e3 * arm.mean():.3g} mm"
            raise InputError(problem, file=readings.file, field="moment arm", value=mean)
    return replace(readings, path={name: readings.path[title] for title, name in titles.items()})


def arms_off(readings: Readings) -> Iterator[Notice]:
    """A notice on each measured path whose moment arm is not the slope of its length, r = −dL/dφ."""
    for name, (length, arm) in readings.path.items():
        lengths, turned = _over_angle(readings, length, arm)
        length, turn, apart = (1e3 * float(np.ptp(each)) for each in (lengths, turned, lengths + turned))
        if apart > DISAGREE * length + 1e3 * APART:
            text = "{subject}: its path changes by {length:.3g} mm and, by its moment arm (r = -dL/dangle), "
            text += "by {turn:.3g} mm, up to {apart:.3g} mm apart"
            yield Notice("arm-off", text, subject=name, length=length, turn=turn, apart=apart)


def _over_angle(readings: Readings, length: np.ndarray, arm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean lengths over the rising angle, and the integral of the mean moment arms [m]; 0 at first."""
    steps, where = np.unique(np.round(readings.angle / SAME_ANGLE), return_inverse=True)
    lengths, arms = (np.bincount(where, values) / np.bincount(where) for values in (length, arm))
    return lengths, cumulative_trapezoid(arms, steps * SAME_ANGLE, initial=0.0)


def choose_chamber(orthosis: Orthosis, asked: str, named: Sequence[str]) -> str:
    """The filled chamber: as requested, as in the file, the only one, or the dorsiflexor."""
    of_group = {name: group.chamber or name for name, group in orthosis.muscle.items()}
    known = {**of_group, **{name: name for name in orthosis.chamber}}
    if not known:
        raise InputError("has no muscle", field="orthosis", value=orthosis.name)
    for name in (asked, *named):
        if name and name not in known:
            raise unknown(name, known, field="chamber", problem="the orthosis has no such chamber or muscle")
    meant = {known[name] for name in ([asked] if asked else named)}
    if len(meant) > 1:
        problem = "several were filled, but one is fitted: which one?"
        raise InputError(problem, field="chamber", value=", ".join(named), allowed=", ".join(sorted(meant)))
    if meant:
        return meant.pop()
    if len(orthosis.chamber) == 1:
        return next(iter(orthosis.chamber))
    if USUAL_CHAMBER in known:
        return known[USUAL_CHAMBER]
    problem = "which one was filled? Neither the file nor the orthosis states it"
    raise InputError(problem, field="chamber", allowed=", ".join(orthosis.chamber))


def predict(
    problem: TorqueProblem, values: Mapping[str, float], groups: Sequence[Group] | None = None
) -> dict[str, np.ndarray]:
    """Torque [N·m] and displacement of the cuff [m], all groups end to end."""
    values = {**problem.fixed, **values}
    found: dict[str, list[np.ndarray]] = {channel: [] for channel in CHANNELS}
    for group in problem.groups if groups is None else groups:
        known = group.orthosis, group.geometry, problem.chamber
        torque, pull = statics(*known, group.readings.pressure, values)
        if problem.difference:
            torque = torque - statics(*known, np.zeros(len(group)), values)[0]
        found["torque"].append(torque)
        described = group.orthosis.anchor.get(group.orthosis.words.segments[0])
        # none of a rigid cuff, or of one that stiffens
        stiffness = values.get(ANCHORS[0]) or (described.stiffness if described is not None else None)
        found["cuff"].append(pull / stiffness if stiffness else np.full(len(group), np.nan))
    return {channel: np.concatenate(parts) for channel, parts in found.items()}


def require_possible(problem: TorqueProblem) -> None:
    """Refuse torques that the muscles cannot give at any compliance: of the wrong sign, or far too large."""
    rigid = dict.fromkeys(("series_stiffness", *ANCHORS), np.inf) | {"offset": 0.0}
    measured, most = problem.column("torque"), predict(replace(problem, difference=False), rigid)["torque"]
    file, orthosis = problem.groups[0].readings.file, problem.groups[0].orthosis
    largest, cuff = float(np.abs(measured).max()), problem.column("cuff")

    def refused(text: str, value: str | None = None, allowed: str = "", field: str = "torque") -> InputError:
        return InputError(text, file=file, field=field, value=value, allowed=allowed)

    if largest == 0.0:
        raise refused("is zero at every reading")
    if np.isfinite(cuff).any() and not np.nansum(cuff) > 0.0:
        mean = f"{1e3 * np.nanmean(cuff):.3g} mm on average"
        raise refused("is not along the pull, which is positive", mean, field="cuff")
    muscles = f"the muscles of chamber {problem.chamber!r}"
    if not np.abs(most).max() > 1e-6 * largest:
        text = f"{muscles} are slack at every reading, even on rigid anchors"
        allowed = "another chamber, angle or pressure, or a shorter link in the orthosis"
        raise refused(text, f"{largest:.3g} N·m measured", allowed)
    share = float(np.sum(measured * most) / np.sum(most**2))
    if share < 0.0:
        sign, way = "positive" if most.sum() > 0.0 else "negative", orthosis.words.directions[0]
        text = f"has the wrong sign: {muscles} turn the joint to {sign} torques ({way} is positive)"
        read = f"{measured[np.argmax(np.abs(measured))]:.3g} N·m"
        raise refused(text, read, "the other sign, or another chamber")
    if share > BEYOND and not any(p.of_law for p in problem.free):
        text = f"is {share:.2g} times what the muscles give on rigid anchors; a series stiffness or an "
        allowed = "another muscle, law, geometry, unit or pressure; or a parameter of the law in the fit"
        read = f"up to {largest:.3g} N·m measured, {np.abs(most).max():.3g} N·m at most"
        raise refused(f"{text}offset can only lessen it", read, allowed)


def errors(problem: TorqueProblem, values: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Prediction less measurement by channel [N·m], [m]; not a number where nothing was measured."""
    found = predict(problem, values)
    return {channel: found[channel] - problem.column(channel) for channel in CHANNELS}
