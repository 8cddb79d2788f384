"""Parameters that static torques can tell: what they set, how they are searched, and what stands for none."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from afo_sim.common.errors import InputError, unknown
from afo_sim.common.units import EXAMPLES, in_unit
from afo_sim.description.orthosis import Orthosis
from afo_sim.physics.laws import LAWS

STIFFEST = 1e7  # no cable of a device is stiffer [N/m]


@dataclass(frozen=True)
class TorqueParameter:
    """A parameter of a torque fit, SI; `shown` is the unit for people's eyes.

    A `logarithmic` one is searched as ln x, and its interval is a ratio. `size` is what an uncertainty is
    held against, beside the value itself. `neutral` is the value of a device without it, None where there
    is none; `of_law` says that it is one of the muscle's law. `low` and `high` are usual values, from which
    searches start.
    """

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
            raise unknown(name, known, field="fit", problem="is no parameter that torques can tell")
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
