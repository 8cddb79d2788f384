"""Joint uncertainty of a muscle's fitted numbers: standard errors, correlations, and draws from them."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Protocol, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_serializer
from pydantic_core import PydanticCustomError

from afo_sim.common import Foreign, Given, InputError, JsonDict, JsonMapping, format_quantity, nearest_name
from afo_sim.description.quantity import Described, Quantity, Whole, refusal, refuse_all, refused_name
from afo_sim.physics import LAWS

_GEOMETRY = {"braid_angle": "rad", "end_length": "m"}  # of the muscle, fitted together with a law: SI unit
_SAME = 1e-9  # two numbers that differ by less are one
_ROUNDING = 1e-3  # an eigenvalue may lie below zero by this much: correlations written with three decimals

_Correlation = Annotated[float, Quantity("", at_least=-1.0, at_most=1.0)]


class FitCovariance(Described):
    """Covariance of the numbers that were fitted together: standard errors and correlations."""

    law: str
    """Force law that was fitted; the covariance applies while this law is in use."""
    parameters: Annotated[tuple[str, ...], Whole()]
    """Parameters that were fitted together: "laws.LAW.NAME" of that law, "braid_angle", "end_length"."""
    standard_errors: Annotated[tuple[float, ...], Whole()]
    """Standard error of each parameter, a text with the parameter's unit."""
    scale: Annotated[float, Quantity("", at_least=0.0, at_most=10.0)] = 1.0
    """Factor on the standard errors, for what the fit does not know."""
    correlation: Annotated[tuple[tuple[_Correlation, ...], ...], Whole()]
    """Correlations of the parameters, row by row: symmetric, ones on the diagonal."""
    freedom: Annotated[int, Field(ge=1, le=10**9)]
    """Degrees of freedom: points that were fitted less parameters."""

    @field_validator("law")
    @classmethod
    def _is_known(cls, law: str) -> str:
        if law not in LAWS:
            raise refused_name("is an unknown law", law, LAWS)
        return law

    @field_validator("parameters")
    @classmethod
    def _belong_together(cls, names: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        if "law" not in info.data:
            return names
        law = info.data["law"]
        known = (*_GEOMETRY, *(f"laws.{law}.{parameter.name}" for parameter in LAWS[law].parameters))
        last = {_split(key)[1]: key for key in known}  # a wrong key is told by its last name
        problems = []
        for name in names:
            if name not in known:
                nearest = last.get(nearest_name(_split(name)[1], last) or "", "")
                problem = f"{name!r} is not a number that a fit of {law} gives"
                problems.append(refusal(problem, ", ".join(known), nearest=nearest))
        refuse_all(problems)
        if not names or len(set(names)) < len(names):
            raise refusal("each parameter is named once, and at least one", ", ".join(known))
        return names

    @field_validator("standard_errors", mode="before")
    @classmethod
    def _are_quantities(cls, texts: Given, info: ValidationInfo) -> Given:
        names = info.data.get("parameters")
        if names is None:
            return ()  # the parameters are refused, and that is reported
        if not isinstance(texts, list | tuple) or len(texts) != len(names):
            count = len(names)
            problem = f"there are {count} parameters"
            raise refusal(problem, f"a list of {count} standard errors, in their order")
        read, problems = [], []
        for k, (name, text) in enumerate(zip(names, texts, strict=True)):
            try:
                read.append(Quantity(_unit(name), above=0.0, exact=True).read(text, info))
            except PydanticCustomError as problem:
                facts = problem.context or {}
                problems.append(refusal(facts["problem"], facts["allowed"], str(k)))
        refuse_all(problems)
        return tuple(read)

    @field_validator("correlation")
    @classmethod
    def _is_a_correlation(
        cls, rows: tuple[tuple[float, ...], ...], info: ValidationInfo
    ) -> tuple[tuple[float, ...], ...]:
        count = len(info.data.get("parameters", rows))
        form = f"{count} rows of {count} numbers, symmetric, with ones on the diagonal"
        if len(rows) != count or any(len(row) != count for row in rows):
            raise refusal("does not go with the parameters", form)
        found = np.array(rows)
        if np.abs(np.diag(found) - 1.0).max() > _SAME:
            raise refusal("holds another number than 1 on the diagonal", form)
        if np.abs(found - found.T).max() > _SAME:
            i, j = np.unravel_index(np.abs(found - found.T).argmax(), found.shape)
            raise refusal(f"is not symmetric: [{i}][{j}] differs from [{j}][{i}]", form)
        least = float(np.linalg.eigvalsh(found).min())
        if least < -_ROUNDING:
            problem = f"no numbers can be correlated like this: the smallest eigenvalue is {least:.2g}"
            raise refusal(problem, "a positive semidefinite matrix; correlations near ±1 need more decimals")
        return rows

    @model_serializer(mode="wrap")
    def _write(self, handler: Foreign) -> JsonDict:
        errors = zip(self.standard_errors, self.units, strict=True)
        texts = [format_quantity(error, unit) for error, unit in errors]
        return handler(self) | {"standard_errors": texts}

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each parameter, "" of bare numbers."""
        return tuple(map(_unit, self.parameters))

    @property
    def matrix(self) -> np.ndarray:
        """Covariance of the parameters [SI units of row times column], (k, k)."""
        errors = self.scale * np.array(self.standard_errors)
        return np.outer(errors, errors) * np.array(self.correlation)

    def draws(self, normals: np.ndarray, about: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Values of the parameters, distributed normally with this covariance."""
        deviates = np.asarray(normals, dtype=float)
        if deviates.ndim != 2 or deviates.shape[1] != len(self.parameters):
            problem = "does not go with the covariance"
            allowed = f"of shape (n, {len(self.parameters)}), a column for each parameter"
            raise InputError(problem, field="normals", value=f"of shape {deviates.shape}", allowed=allowed)
        values, vectors = np.linalg.eigh(np.array(self.correlation))
        root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        steps = deviates @ root * (self.scale * np.array(self.standard_errors))
        return {name: about[name] + steps[:, k] for k, name in enumerate(self.parameters)}

    def block(self, parameters: Sequence[str]) -> Self:
        """The covariance of some of the parameters, the others free: a part of the matrix."""
        kept = [self.parameters.index(name) for name in parameters]
        return self.model_copy(
            update={
                "parameters": tuple(parameters),
                "standard_errors": tuple(self.standard_errors[i] for i in kept),
                "correlation": tuple(tuple(self.correlation[i][j] for j in kept) for i in kept),
            }
        )


class _Muscle(Protocol):
    """The properties of a muscle that its draws need."""

    @property
    def law(self) -> str: ...
    @property
    def laws(self) -> JsonMapping: ...
    @property
    def covariance(self) -> FitCovariance | None: ...
    @property
    def total_length(self) -> float: ...
    @property
    def without_draws(self) -> str: ...


class Draws:
    """Draws of a muscle's fitted numbers from the covariance of their fit."""

    @property
    def without_draws(self: _Muscle) -> str:
        """The reason why nothing is drawn, a sentence; "" where `drawn` draws.

        The covariance is of one law's fit, geometry included: with another law in use none of it applies.
        """
        if self.covariance is None:
            return "the muscle has no covariance of a fit"
        if self.covariance.law != self.law:
            return f"the covariance is of {self.covariance.law}, and {self.law} is in use"
        return ""

    def drawn(self: _Muscle, normals: np.ndarray) -> dict[str, np.ndarray]:
        """Values of the numbers that were fitted together, about the muscle's own, by their joint covariance.

        Parameters
        ----------
        normals : standard normal deviates (n, k), a column for each of `covariance.parameters`

        Returns
        -------
        {dotted key below the muscle: values (n,) [SI]}, in the order of `covariance.parameters`; empty where
        `without_draws` says why. The normal distribution knows no bounds: `legal` says which draws are
        muscles. Reject the others, all parameters at once. Clipping would heap them up at the bound, and
        reflecting one parameter would undo its correlations.

        Raises
        ------
        InputError
            `normals` has another number of columns.

        Examples
        --------
        >>> muscle = load("muscle", "dmsp_20")
        >>> muscle.drawn(np.zeros((1, 4))), muscle.without_draws
        ({}, 'the muscle has no covariance of a fit')
        """
        if self.covariance is None or self.without_draws:
            return {}
        about = {}
        for key in self.covariance.parameters:
            law, name = _split(key)
            about[key] = float(self.laws[law].parameters[name] if law else getattr(self, name))
        return self.covariance.draws(normals, about)

    def legal(self: _Muscle, drawn: Mapping[str, np.ndarray]) -> np.ndarray:
        """Which draws are muscles: within the bounds of every parameter, the ends shorter than the whole.

        Parameters
        ----------
        drawn : from `drawn`, not empty

        Returns
        -------
        mask (n,)
        """
        masks = []
        for key, values in drawn.items():
            law, name = _split(key)
            if law:
                lower, upper = LAWS[law].parameter(name).lower, LAWS[law].parameter(name).upper
            else:
                marks = type(self).model_fields[name].metadata  # type: ignore[attr-defined]  # which pydantic gives a model
                quantity = next(mark for mark in marks if isinstance(mark, Quantity))
                lower, upper = float(quantity.at_least or 0.0), float(quantity.at_most or np.inf)
            masks.append((values >= lower) & (values <= upper))
            if key == "end_length":
                masks.append(values < self.total_length)
        return np.all(masks, axis=0)


def key_of(law: str, name: str) -> str:
    """Dotted key, below a muscle, of a law's parameter or of the braid's geometry."""
    return name if name in _GEOMETRY else f"laws.{law}.{name}"


def _split(key: str) -> tuple[str, str]:
    """Law and parameter of a key, or "" and the name of the geometry."""
    law, _, name = key.removeprefix("laws.").rpartition(".")
    return law, name


def _unit(key: str) -> str:
    law, name = _split(key)
    return LAWS[law].parameter(name).unit if law else _GEOMETRY[name]
