"""Curves of a muscle at rest: force, contraction, pressure and volume, over arrays."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol, overload

import numpy as np

from afo_sim.common import FloatOrArray, Given, InputError, Mixed, si
from afo_sim.physics import LAWS, AtRest, Braid, LawVolume, muscle_volume, row, rubber_force, tension

_Amount = float | str | Sequence[Given] | np.ndarray  # an SI number, a text as "3 bar", an array of them
_One = float | str
_OneOr = _One | None
_Or = _Amount | None
_Found = FloatOrArray  # of plain numbers a float, an array where one of them is one: the overloads say so


class _Muscle(Protocol):
    """The properties of a muscle that its curves need."""

    @property
    def law(self) -> str: ...
    @property
    def dead_volume(self) -> float: ...
    @property
    def rubber_volume(self) -> float: ...
    @property
    def limits(self) -> Mixed: ...
    @property
    def braid(self) -> Braid: ...
    @property
    def nominal_length(self) -> float: ...
    @property
    def law_volume(self) -> LawVolume: ...
    @property
    def returning(self) -> float: ...


class RestCurves:
    """Curves of a muscle at rest and without friction, by the law in use.

    Arguments are SI numbers, texts with a unit ("3 bar"), or arrays of either, which broadcast as in NumPy:
    plain numbers give a float, arrays an array. Contraction ratios are (L0 − L)/L0, shorter is positive;
    pressures are gauge. A law holds within `law_set.pressure_range` and `contraction_range`; beyond
    them it is extrapolated. Below zero contraction the braid's stiffness carries.
    """

    @overload
    def force(  # type: ignore[overload-overlap]  # one number is also one of many
        self: _Muscle, pressure: _One, *, contraction: _OneOr = None, length: _OneOr = None,
        series_stiffness: _One = ..., offset: _One = ...,
    ) -> float: ...  # fmt: skip
    @overload
    def force(
        self: _Muscle, pressure: _Amount, *, contraction: _Or = None, length: _Or = None,
        series_stiffness: _Amount = ..., offset: _Amount = ...,
    ) -> np.ndarray: ...  # fmt: skip
    def force(
        self: _Muscle, pressure: _Amount, *, contraction: _Amount | None = None,
        length: _Amount | None = None, series_stiffness: _Amount = math.inf, offset: _Amount = 0.0,
    ) -> _Found:  # fmt: skip
        """Tension at rest, as the simulated muscle pulls when nothing moves or rubs.

        With a series element (cable, bracket, cuff) `contraction` or `length` is of the whole path: muscle
        and series element together are (1 − κ_path) L0 long. The muscle's own contraction κ is solved for:

            κ = κ_path + [offset + F(κ, p)/k]/L0

        F falls with κ, so there is one such κ. Without tension the muscle is slack, and F is zero.

        Parameters
        ----------
        pressure : gauge, a number [Pa] or a text such as "3 bar"; `limits` are not checked here
        contraction : ratio [-]; this or `length`
        length : of the active braid, a number [m] or a text such as "28 cm"
        series_stiffness : k of what is in series with the muscle, above 0 [N/m]; by default nothing gives
        offset : length that it has gained before it carries anything, ≥ 0 [m]

        Returns
        -------
        force [N], ≥ 0, of the broadcast shape; with infinite stiffness and no offset the muscle's own

        Raises
        ------
        InputError
            A quantity has no unit or another dimension; contraction and length are both given, or neither;
            a stiffness is not above zero, an offset is below.

        Examples
        --------
        >>> muscle = load("muscle", "dmsp_20")
        >>> muscle.force("3 bar", contraction=[0, 0.05, 0.10]).round()
        array([757., 463., 295.])
        >>> muscle.force([2e5, 3e5], length="28.5 cm").round()
        array([241., 463.])
        >>> muscle.force("3 bar", contraction=[0, 0.05, 0.10], series_stiffness="20 kN/m").round()
        array([400., 297., 203.])
        """
        kappa = _contraction(self, contraction, length)
        stiffness, gained = _si("series_stiffness", series_stiffness, "N/m"), _si("offset", offset, "m")
        _require(stiffness > 0.0, "series_stiffness", series_stiffness, "above 0 N/m")
        _require((gained >= 0.0) & np.isfinite(gained), "offset", offset, "0 m or more")
        bare, length_0 = at_rest(self), self.nominal_length

        def pull(kappa: float, gauge: float, k: float, gained: float) -> float:
            path = kappa + gained / length_0
            return bare.force(path, gauge) if math.isinf(k) else tension(path, gauge, row(bare, k))

        return _over(pull, kappa, _si("pressure", pressure, "Pa"), stiffness, gained)

    @overload
    def contraction(self: _Muscle, pressure: _One, *, force: _One) -> float: ...  # type: ignore[overload-overlap]  # one number is also one of many
    @overload
    def contraction(self: _Muscle, pressure: _Amount, *, force: _Amount) -> np.ndarray: ...
    def contraction(self: _Muscle, pressure: _Amount, *, force: _Amount) -> _Found:
        """Contraction ratio at which a force is carried: where a hung weight comes to rest.

        Parameters
        ----------
        pressure : gauge [Pa]
        force : [N]; 0 gives the contraction at which the muscle goes slack

        Returns
        -------
        contraction [-], between the braid's lock and 0.7; NaN where no contraction carries the force

        Raises
        ------
        InputError
            A quantity has no unit or another dimension.

        Examples
        --------
        >>> round(load("muscle", "dmsp_20").contraction("3 bar", force="100 N"), 3)
        0.174
        """
        bare, lock = at_rest(self), self.braid.lock
        gauge, pull = _si("pressure", pressure, "Pa"), _si("force", force, "N")
        return _over(lambda gauge, pull: bare.contraction(gauge, pull, lock), gauge, pull)

    @overload
    def pressure(self: _Muscle, force: _One, *, contraction: _OneOr = ..., length: _OneOr = ...) -> float: ...  # type: ignore[overload-overlap]  # one number is also one of many
    @overload
    def pressure(
        self: _Muscle, force: _Amount, *, contraction: _Or = ..., length: _Or = ...
    ) -> np.ndarray: ...
    def pressure(self: _Muscle, force: _Amount, *, contraction: _Or = None, length: _Or = None) -> _Found:
        """Lowest pressure that carries a force.

        Parameters
        ----------
        force : [N]
        contraction : ratio [-]; this or `length`
        length : of the active braid [m]

        Returns
        -------
        gauge pressure [Pa], from 0 to `limits.pressure`; NaN where that is too little

        Raises
        ------
        InputError
            As for `force`.

        Examples
        --------
        >>> round(load("muscle", "dmsp_20").pressure("100 N", contraction=0.174) / 1e5, 1)
        3.0
        """
        bare, highest = at_rest(self), self.limits.pressure
        pull, kappa = _si("force", force, "N"), _contraction(self, contraction, length)
        return _over(lambda pull, kappa: bare.pressure(pull, kappa, highest), pull, kappa)

    @overload
    def volume(
        self: _Muscle, *, contraction: _OneOr = ..., length: _OneOr = ..., pressure: _One = ...
    ) -> float: ...  # type: ignore[overload-overlap]  # one number is also one of many
    @overload
    def volume(
        self: _Muscle, *, contraction: _Or = ..., length: _Or = ..., pressure: _Amount = ...
    ) -> np.ndarray: ...
    def volume(
        self: _Muscle, *, contraction: _Or = None, length: _Or = None, pressure: _Amount = 3e5
    ) -> _Found:
        """Volume of air in the muscle: its law's, or the ideal braid's where that is not plausible.

        Parameters
        ----------
        contraction : ratio [-]; this or `length`
        length : of the active braid [m]
        pressure : gauge [Pa]; most laws' volumes do not depend on it above 1 bar

        Returns
        -------
        volume [m³], never less than the dead volume

        Raises
        ------
        InputError
            As for `force`.

        Source
        ------
        ∂V/∂κ = L0 ∂F/∂p (`physics.law_volume`), from π r0² L0; or Chou & Hannaford 1996,
        V = π r0² L0 (1 − κ) [1 − cos²α0 (1 − κ)²]/sin²α0.

        Examples
        --------
        >>> (1e6 * load("muscle", "dmsp_20").volume(contraction=[0, 0.1])).round()  # ml
        array([ 96., 162.])
        """
        braid = self.braid
        size = braid.nominal_length, braid.nominal_radius, braid.b, float(LAWS[self.law].braids)
        own = *size, self.dead_volume, self.rubber_volume, self.returning, self.law_volume.numbers, 0
        kappa, gauge = _contraction(self, contraction, length), _si("pressure", pressure, "Pa")
        return _over(lambda kappa, gauge: muscle_volume(kappa, gauge, *own)[0], kappa, gauge)


def at_rest(muscle: Given, law: Mapping[str, float] = MappingProxyType({})) -> AtRest:
    """A muscle's static force as a function of numbers, by the law in use; `law` replaces its parameters."""
    used, lowest = LAWS[muscle.law], muscle.law_set.pressure_range[0]
    numbers = muscle.coefficients_of(muscle.law, muscle.law_set.parameters | law)
    stiffness = muscle.braid_stiffness, muscle.return_stiffness
    by_law = AtRest(float(used.native_id), numbers, lowest, *stiffness, muscle.braid, float(used.braids))
    scale, (stiffness, bore, turn) = 1.0, muscle.rubber
    if muscle.free_contraction is not None:  # where the law carries the rubber alone
        taken = -rubber_force(muscle.free_contraction, stiffness, bore, muscle.braid.b, turn)[0]
        scale = by_law.contraction(muscle.test_pressure, taken, 0.0) / muscle.free_contraction
    return replace(by_law, contraction_scale=scale / muscle.contraction_factor, rubber=muscle.rubber)


def _over(function: Callable[..., float], *arguments: np.ndarray) -> _Found:
    try:
        together = np.broadcast_arrays(*arguments)
    except ValueError:
        shapes = " and ".join(str(a.shape) for a in arguments)
        problem = f"the arguments have shapes that do not broadcast: {shapes}"
        allowed = "one value, equal shapes, or a column as pressures[:, np.newaxis] beside a row"
        raise InputError(problem, allowed=allowed) from None
    flat = [function(*map(float, each)) for each in zip(*(a.flat for a in together), strict=True)]
    return np.array(flat).reshape(together[0].shape) if together[0].ndim else flat[0]


def _contraction(muscle: _Muscle, contraction: _Amount | None, length: _Amount | None) -> np.ndarray:
    if (contraction is None) == (length is None):
        given = "neither is given" if length is None else "both are given"
        raise InputError(given, field="contraction, length", allowed="one of them")
    if contraction is not None:
        return _si("contraction", contraction, "")
    nominal = muscle.nominal_length
    return (nominal - _si("length", length, "m")) / nominal


def _require(good: np.ndarray, name: str, amount: Given, allowed: str) -> None:
    if not np.all(good):
        raise InputError("is out of range", field=name, value=amount, allowed=allowed)


def _si(name: str, amount: Given, unit: str) -> np.ndarray:
    """Numbers in SI of numbers, texts, numbers that know their unit, or arrays of them."""
    if isinstance(amount, list | tuple):
        return np.array([_si(name, item, unit) for item in amount])
    try:
        one = isinstance(amount, str) or hasattr(amount, "unit")
        return np.asarray(si(amount, unit, name) if one else amount, dtype=float)
    except (TypeError, ValueError):
        raise InputError("is not a number", field=name, value=amount) from None
