"""A torque fit as it is posed: readings, the orthosis of each group, parameters, and its predictions."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from afo_sim.common import EXAMPLES, InputError, Notice, in_unit, unknown
from afo_sim.description import Orthosis
from afo_sim.lab.torque_data import SAME_ANGLE, Readings
from afo_sim.lab.torque_device import Change, Path, paths, statics
from afo_sim.physics import LAWS

STIFFEST = 1e7  # no cable of a device is stiffer [N/m]
CHANNELS = ("torque", "cuff")
USUAL_CHAMBER = "dorsiflexor"
LEFT = 0.9  # contraction ratio to either side that no path leaves
DISAGREE, APART = 0.05, 1e-3  # of its change, and [m], by which a path's length and moment arm may disagree
BEYOND = 1.25  # measured torque over that on rigid anchors, from which no stiffness can be the reason


@dataclass(frozen=True)
class TorqueParameter:
    """A parameter of a torque fit, SI; `shown` is the unit for people's eyes."""

    name: str
    meaning: str
    unit: str
    shown: str
    lower: float
    upper: float
    low: float
    high: float
    size: float
    neutral: float | None = None
    logarithmic: bool = False
    of_law: bool = False

    def coordinate(self, value: float) -> float:
        """A value [SI] as it is searched: a number of ordinary size."""
        return math.log(value / self.low) if self.logarithmic else value / self.size

    def value(self, coordinate: float) -> float:
        """The value [SI] of what is searched."""
        if self.logarithmic:
            return self.low * math.exp(min(max(coordinate, -700.0), 700.0))
        return self.size * coordinate

    def text(self, value: float) -> str:
        """A value [SI] for people."""
        return f"{self.number(value):.3g} {self.shown}".strip()

    def number(self, value: float) -> float:
        """A value in the unit for people's eyes."""
        return in_unit(value, self.unit, self.shown) if self.shown else value


def _stiffness(name: str, meaning: str) -> TorqueParameter:
    return TorqueParameter(
        name, meaning, "N/m", "kN/m", 100.0, STIFFEST, 5e3, 5e4, 1.0, STIFFEST, logarithmic=True
    )


OWN = {
    "series_stiffness": _stiffness("series_stiffness", "of each filled muscle's cable and brackets"),
    "offset": TorqueParameter(
        *("offset", "length that cable and brackets give before they carry anything", "m", "mm"),
        *(0.0, 0.1, 1e-3, 1e-2, 5e-3, 0.0),
    ),
    "cuff_stiffness": _stiffness("cuff_stiffness", "of the cuff along the pull of all muscles"),
    "plate_stiffness": _stiffness("plate_stiffness", "of the plate along the pull of all muscles"),
}


def parameters(
    names: Sequence[str], orthoses: Sequence[Orthosis], chamber: str
) -> tuple[TorqueParameter, ...]:
    """The parameters of these names, for the muscles on a chamber."""
    known = dict(OWN) | _of_law(orthoses, chamber)
    found = []
    if not names:
        raise InputError("names nothing", field="fit", allowed=", ".join(known))
    for name in names:
        if name not in known:
            raise unknown(name, known, field="fit", problem="is not a parameter that torques identify")
        if [*names].count(name) > 1:
            raise InputError("stands there twice", field="fit", value=name)
        anchor = name in ("cuff_stiffness", "plate_stiffness")
        if anchor and not all(orthosis.anchored for orthosis in orthoses):
            problem = "has no effect: the muscles run over pulleys, which pull on no cuff"
            raise InputError(problem, field="fit", value=name)
        found.append(known[name])
    return tuple(found)


def _of_law(orthoses: Sequence[Orthosis], chamber: str) -> dict[str, TorqueParameter]:
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
        found[p.name] = TorqueParameter(
            *(p.name, p.meaning, p.unit, usual, p.lower, p.upper, low, high, size), of_law=True
        )
    return found


@dataclass(frozen=True, eq=False)
class Group:
    """Readings that belong together, the orthosis that they were taken of, and its paths at their angles."""

    readings: Readings
    orthosis: Orthosis
    geometry: tuple[Path, ...]

    @classmethod
    def of(cls, readings: Readings, orthosis: Orthosis) -> "Group":
        """With the paths at the readings' angles, or as they were measured."""
        return cls(readings, orthosis, tuple(paths(orthosis, readings.angle, readings.path)))

    def take(self, keep: np.ndarray) -> "Group":
        """Some of the readings."""
        geometry = tuple(replace(p, length=p.length[keep], arm=p.arm[keep]) for p in self.geometry)
        return Group(self.readings.take(keep), self.orthosis, geometry)

    def __len__(self) -> int:
        return len(self.readings)


@dataclass(frozen=True, eq=False)
class TorqueProblem:
    """What is fitted to what. `difference`: the torques are those with air less those without."""

    groups: tuple[Group, ...]
    free: tuple[TorqueParameter, ...]
    chamber: str
    difference: bool = False
    held: Mapping[str, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return sum(len(group) for group in self.groups)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the free parameters."""
        return tuple(p.name for p in self.free)

    def take(self, keep: np.ndarray) -> "TorqueProblem":
        """Some of the readings, over all groups end to end; groups without any are gone."""
        parts = np.split(keep, np.cumsum([len(g) for g in self.groups])[:-1])
        kept = [g.take(k) for g, k in zip(self.groups, parts, strict=True) if k.any()]
        return replace(self, groups=tuple(kept))

    def column(self, name: str) -> np.ndarray:
        """A column of the readings, all groups end to end."""
        return np.concatenate([getattr(group.readings, name) for group in self.groups])

    @property
    def of_group(self) -> np.ndarray:
        """The number of its group, for each reading."""
        return np.repeat(np.arange(len(self.groups)), [len(group) for group in self.groups])


def on_muscles(readings: Readings, orthosis: Orthosis, chamber: str) -> Readings:
    """Readings whose measured paths stand under the names of the muscles that are filled; checked."""
    if not readings.path:
        return readings
    muscles = orthosis.muscles_of(chamber)
    titles = {re.sub(r"[\s_]+", " ", name.lower()): name for name in muscles}
    if len(muscles) == 1 and "" in readings.path:
        titles = {"": next(iter(muscles))}
    if orthosis.joint_centre:
        problem = "stands beside the orthosis' joint_centre: one of them gives the path"
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
            problem = "has the wrong sign: r = -dL/dangle, and the path's length rises with its integral"
            mean = f"{1e3 * arm.mean():.3g} mm"
            raise InputError(problem, file=readings.file, field="moment arm", value=mean)
    return replace(readings, path={name: readings.path[title] for title, name in titles.items()})


def arms_off(readings: Readings) -> Iterator[Notice]:
    """A notice on each measured path whose moment arm is not the slope of its length, r = −dL/dφ."""
    for name, (length, arm) in readings.path.items():
        lengths, turned = _over_angle(readings, length, arm)
        length, turn, apart = (1e3 * float(np.ptp(each)) for each in (lengths, turned, lengths + turned))
        if apart > DISAGREE * length + 1e3 * APART:
            text = (
                "{subject}: its path changes by {length:.3g} mm and, by its moment arm (r = -dL/dangle), by "
            )
            text += "{turn:.3g} mm, up to {apart:.3g} mm apart"
            yield Notice("arm-off", text, subject=name, length=length, turn=turn, apart=apart)


def _over_angle(readings: Readings, length: np.ndarray, arm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean lengths over the rising angle, and the integral of the mean moment arms [m]; 0 at first."""
    steps, where = np.unique(np.round(readings.angle / SAME_ANGLE), return_inverse=True)
    lengths, arms = (np.bincount(where, values) / np.bincount(where) for values in (length, arm))
    return lengths, cumulative_trapezoid(arms, steps * SAME_ANGLE, initial=0.0)


def choose_chamber(orthosis: Orthosis, asked: str, named: Sequence[str]) -> str:
    """The chamber that was filled: as asked, as the file says, or the only one, or the dorsiflexor."""
    of_group = {name: group.chamber or name for name, group in orthosis.muscle.items()}
    known = {**of_group, **{name: name for name in orthosis.chamber}}
    if not known:
        raise InputError("has no muscle", field="orthosis", value=orthosis.name)
    for name in (asked, *named):
        if name and name not in known:
            raise unknown(name, known, field="chamber", problem="the orthosis has no such chamber or muscle")
    meant = {known[name] for name in ([asked] if asked else named)}
    if len(meant) > 1:
        problem = "several were filled, and one is fitted: which one?"
        raise InputError(problem, field="chamber", value=", ".join(named), allowed=", ".join(sorted(meant)))
    if meant:
        return meant.pop()
    if len(orthosis.chamber) == 1:
        return next(iter(orthosis.chamber))
    if USUAL_CHAMBER in known:
        return known[USUAL_CHAMBER]
    problem = "which one was filled? Neither the file nor the orthosis says"
    raise InputError(problem, field="chamber", allowed=", ".join(orthosis.chamber))


def predict(
    problem: TorqueProblem, values: Mapping[str, float], groups: Sequence[Group] | None = None
) -> dict[str, np.ndarray]:
    """Torque [N·m] and displacement of the cuff [m], all groups end to end."""
    change = _change(problem, values)
    found: dict[str, list[np.ndarray]] = {channel: [] for channel in CHANNELS}
    for group in problem.groups if groups is None else groups:
        torque, pull = _statics(problem, group, group.readings.pressure, change)
        if problem.difference:
            torque = torque - _statics(problem, group, np.zeros(len(group)), change)[0]
        found["torque"].append(torque)
        stiffness = _cuff(group.orthosis, change)
        found["cuff"].append(pull / stiffness if stiffness else np.full(len(group), np.nan))
    return {channel: np.concatenate(parts) for channel, parts in found.items()}


def _statics(
    problem: TorqueProblem, group: Group, pressure: np.ndarray, change: Change
) -> tuple[np.ndarray, np.ndarray]:
    return statics(group.orthosis, group.geometry, problem.chamber, pressure, change)


def _change(problem: TorqueProblem, values: Mapping[str, float]) -> Change:
    law = {p.name: values[p.name] for p in problem.free if p.of_law}
    values = {**problem.held, **values}
    return Change(
        values.get("series_stiffness"),
        values.get("offset"),
        values.get("cuff_stiffness"),
        values.get("plate_stiffness"),
        law,
    )


def _cuff(orthosis: Orthosis, change: Change) -> float | None:
    """The stiffness of the cuff [N/m]; none of a rigid one, or of one that stiffens."""
    described = orthosis.anchor.get(orthosis.words.segments[0])
    return change.cuff or (described.stiffness if described is not None else None)


def require_possible(problem: TorqueProblem) -> None:
    """Refuse torques that the muscles cannot give at any compliance: of the wrong sign, or far too large."""
    measured, rigid = problem.column("torque"), Change(np.inf, 0.0, np.inf, np.inf)
    most = np.concatenate([_statics(problem, g, g.readings.pressure, rigid)[0] for g in problem.groups])
    file, largest = problem.groups[0].readings.file, float(np.abs(measured).max())
    if largest == 0.0:
        raise InputError("is zero at every reading", file=file, field="torque")
    cuff = problem.column("cuff")
    if np.isfinite(cuff).any() and not np.nansum(cuff) > 0.0:
        problem_of_cuff = "does not go along the pull, which is positive"
        raise InputError(
            problem_of_cuff, file=file, field="cuff", value=f"{1e3 * np.nanmean(cuff):.3g} mm on average"
        )
    if not np.abs(most).max() > 1e-6 * largest:
        raise InputError(
            f"the muscles of chamber {problem.chamber!r} hang slack at every reading, even on rigid anchors",
            file=file,
            field="torque",
            value=f"{largest:.3g} N·m measured",
            allowed="another chamber, angle or pressure, or a shorter link in the orthosis",
        )
    share = float(np.sum(measured * most) / np.sum(most**2))
    if share < 0.0:
        sign = "positive" if most.sum() > 0.0 else "negative"
        raise InputError(
            f"has the wrong sign: the muscles of chamber {problem.chamber!r} turn the joint to {sign} "
            f"torques ({problem.groups[0].orthosis.words.directions[0]} is positive)",
            file=file,
            field="torque",
            value=f"{measured[np.argmax(np.abs(measured))]:.3g} N·m",
            allowed="the other sign, or another chamber",
        )
    if share > BEYOND and not any(p.of_law for p in problem.free):
        raise InputError(
            f"is {share:.2g} times what the muscles give on rigid anchors; a series stiffness or an offset "
            "can only lessen it",
            file=file,
            field="torque",
            value=f"up to {largest:.3g} N·m measured, {np.abs(most).max():.3g} N·m at most",
            allowed="another muscle, law, geometry, unit or pressure; or a parameter of the law in the fit",
        )


def errors(
    problem: TorqueProblem, values: Mapping[str, float], groups: Sequence[Group] | None = None
) -> dict[str, np.ndarray]:
    """Prediction less measurement by channel [N·m], [m]; not a number where nothing was measured."""
    found = predict(problem, values, groups)
    of = problem.groups if groups is None else groups
    return {
        channel: found[channel] - np.concatenate([getattr(group.readings, channel) for group in of])
        for channel in CHANNELS
    }
