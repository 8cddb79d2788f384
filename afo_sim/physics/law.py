"""What describes a static force law: the braid's geometry, a law's parameters, the law itself."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Braid:
    """Geometry that every law shares: L0 [m], r0 [m], α0 [rad]."""

    nominal_length: float
    nominal_radius: float
    braid_angle: float

    @property
    def b(self) -> float:
        """1/sin²α0 [-]."""
        return 1.0 / math.sin(self.braid_angle) ** 2

    @property
    def thread_length(self) -> float:
        """L0/cos α0 [m]."""
        return self.nominal_length / math.cos(self.braid_angle)

    @property
    def turns(self) -> float:
        """L0 tan α0/(2 π r0) [-]."""
        return self.nominal_length * math.tan(self.braid_angle) / (2.0 * math.pi * self.nominal_radius)


@dataclass(frozen=True)
class LawParameter:
    """One parameter of a law beyond the braid's geometry: its symbol, SI unit and bounds.

    `start` is the range that fits start from; `default` stands where a description is silent.
    """

    name: str
    symbol: str
    unit: str
    lower: float
    upper: float
    meaning: str
    start: tuple[float, float] = (0.0, 0.0)
    default: float | None = None


@dataclass(frozen=True)
class Law:
    """A force law: `kernel(contraction, pressure, *coefficients(braid, parameters))` in newtons.

    `fitted` names what a fit varies (parameters, and `braid_angle` or `end_length` of the muscle);
    the ranges are where the law was published or shown to hold.
    """

    name: str
    kernel: Callable[..., float]
    native_id: int
    parameters: tuple[LawParameter, ...]
    coefficients: Callable[[Braid, Mapping[str, float]], tuple[float, ...]]
    fitted: tuple[str, ...]
    formula: str
    pressure_range: tuple[float, float]
    contraction_range: tuple[float, float]
    validity: str
    source: str

    def parameter(self, name: str) -> LawParameter:
        """The parameter of a name."""
        return next(parameter for parameter in self.parameters if parameter.name == name)
