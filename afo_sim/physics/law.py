"""Description of a static force law: the braid's geometry, its parameters, the law itself."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from afo_sim.common import takes

Values = Mapping[str, float]  # parameters by name [SI]
Coefficients = tuple[float, ...]

MAX_COEFFICIENTS = 21  # slots of a law's coefficients in an actuator's row
CHARACTERISTIC = (1e5, 6e5)  # gauge pressures of the maker's characteristics of fluidic muscles [Pa]


@dataclass(frozen=True)
class Braid:
    """Geometry that every law shares, at rest."""

    nominal_length: float  # L0 [m]
    nominal_radius: float  # r0 [m]
    braid_angle: float  # α0 [rad]

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

    @property
    def lock(self) -> float:
        """κ = 1 − 1/cos α0, negative: the contraction ratio at which the threads lie along the muscle [-]."""
        return 1.0 - 1.0 / math.cos(self.braid_angle)


TRIED = Braid(nominal_length=0.2, nominal_radius=0.01, braid_angle=0.4)  # on which entries are tried


@dataclass(frozen=True)
class LawParameter:
    """One parameter of a law or friction beyond the braid's geometry: symbol, SI unit, bounds.

    `start` is the range of usual values, from which fits start; `default` stands where a description is
    silent.
    """

    name: str
    symbol: str
    unit: str
    lower: float
    upper: float
    meaning: str
    start: tuple[float, float] = (0.0, 0.0)
    default: float | None = None

    @property
    def typical(self) -> float:
        """The default, or the middle of the usual values, or of the bounds where none are stated [unit]."""
        if self.default is not None:
            return self.default
        low, high = (self.lower, self.upper) if self.start == (0.0, 0.0) else self.start
        return 0.5 * (low + high)


def _in_their_order(braid: Braid, q: Values) -> Coefficients:
    """Stands for `plain(parameters)`."""
    raise NotImplementedError


@dataclass(frozen=True)
class Entry:
    """A law or a friction, as a registry holds it.

    kernel : of its own arguments and the coefficients
    coefficients : (braid, parameters) → the kernel's coefficients; the parameters in their order by default
    native_id : the number by which compiled code knows the kernel; entries of one kernel share it, and a
        registered one of a user's gets its own
    """

    name: str
    kernel: Callable[..., Any]
    parameters: tuple[LawParameter, ...]
    coefficients: Callable[[Braid, Values], Coefficients] = _in_their_order
    formula: str = ""
    validity: str = ""
    source: str = ""
    native_id: int = 0

    def __post_init__(self) -> None:
        if self.coefficients is _in_their_order:
            object.__setattr__(self, "coefficients", plain(self.parameters))

    @property
    def typical(self) -> Coefficients:
        """Coefficients of the parameters' typical values on a braid of 20 cm, 10 mm and 0.4 rad."""
        return self.coefficients(TRIED, {p.name: p.typical for p in self.parameters})


@dataclass(frozen=True)
class Law(Entry):
    """A force law: `kernel(contraction, pressure, *coefficients(braid, parameters))` in newtons.

    A kernel under `@with_slopes` is written with its derivatives; others have difference quotients for them.

    `fitted` names the parameters that a fit varies (a law's, and `braid_angle` or `end_length` of the
    muscle). The ranges [Pa, -] are where the law was published or shown to hold. `braids` says that the
    formula is the braid's own, so that pressure pulls more on a stretched one; others are held at κ = 0
    beside the braid's stiffness, as the measured fluidic muscle of 20 mm is.

    `force_powers` are the powers with which the coefficients grow when the force grows by a factor. `length`
    says how the force depends on the muscle's length: by the contraction "ratio" alone; the set holds for
    "one" length, since the formula has lengths or stiffnesses of that muscle in it; or the formula knows the
    effect of the length by its "own". `pleated` says that no braid's volume bounds that of its pleats.
    `rubber` says that the formula knows its rubber, or has no braid around it: a tube adds no force to it.
    `count` is the number of coefficients where trying them would load NumPy.
    """

    fitted: tuple[str, ...] = ()
    pressure_range: tuple[float, float] = CHARACTERISTIC
    contraction_range: tuple[float, float] = (0.0, 0.25)
    braids: bool = False
    force_powers: Coefficients = ()
    length: Literal["ratio", "one", "own"] = "ratio"
    pleated: bool = False
    rubber: bool = False
    count: int = 0

    def parameter(self, name: str) -> LawParameter:
        """The parameter of a name."""
        return next(parameter for parameter in self.parameters if parameter.name == name)

    def scaled(self, coefficients: Coefficients, factor: float) -> Coefficients:
        """Coefficients that give the force of others times a factor: c_i f^(m_i), with `force_powers` m_i.

        Parameters
        ----------
        coefficients : of the kernel
        factor : f on the force, above zero [-]; with 1 the coefficients stay what they are, to the bit

        Raises
        ------
        ValueError
            The law has no powers.
        """
        if factor == 1.0:
            return coefficients
        if not self.force_powers:
            raise ValueError(f"the law {self.name!r} has no force_powers: its force cannot be scaled")
        return tuple(c * factor**m for c, m in zip(coefficients, self.force_powers, strict=True))


takes(Law, "afo_sim.physics.laws")


def without_default(parameters: tuple[LawParameter, ...]) -> tuple[str, ...]:
    """Names of the parameters that have no default: those that a fit usually varies."""
    return tuple(parameter.name for parameter in parameters if parameter.default is None)


def radial(*names: str) -> Callable[[Braid, Values], Coefficients]:
    """Coefficients of a kernel that takes r0 [m] and b = 1/sin²α0 [-] before the named parameters."""
    return lambda braid, q: (braid.nominal_radius, braid.b, *(q[name] for name in names))


def plain(parameters: tuple[LawParameter, ...]) -> Callable[[Braid, Values], Coefficients]:
    """Coefficients of a kernel that takes the parameters alone, in their order."""
    return lambda braid, q: tuple(q[parameter.name] for parameter in parameters)
