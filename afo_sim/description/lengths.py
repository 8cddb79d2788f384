"""Muscles of one type at any length: the lengths that are made, and what follows from the length."""

import math
from collections.abc import Iterator
from typing import Annotated

from afo_sim.description.quantity import Described, Quantity, provenance_note, refusal

BraidLength = Annotated[float, Quantity("m", above=0.0, at_most=10.0)]


class LengthForce(Described):
    """Effect of a muscle's length on its force: F ∝ atan(slope (L0 − offset)), up to the reference length."""

    slope: Annotated[float, Quantity("m^-1", above=0.0, at_most=1e4)]
    """Slope of the arctangent's argument by nominal length."""
    offset: Annotated[float, Quantity("m", at_least=0.0, at_most=0.5)]
    """Nominal length at which no force would be left."""
    shortest: BraidLength
    """Shortest nominal length at which the effect was measured."""
    longest: BraidLength
    """Longest nominal length at which the effect was measured."""

    def _must_be_measured(self) -> None:
        if not self.offset < self.shortest < self.longest:
            allowed = f"above the offset and below the longest, {100.0 * self.longest:g} cm"
            raise refusal("was not measured over a range of lengths", allowed, "shortest")

    def factor(self, length: float, reference: float) -> float:
        """Force at a nominal length [m] over that at a reference length [m], at equal κ and pressure [-]."""
        own, at_reference = (math.atan(self.slope * (each - self.offset)) for each in (length, reference))
        return min(1.0, own / at_reference)


class Lengths(Described):
    """What follows from a muscle's length where the type is sold by the metre."""

    reference: BraidLength
    """Nominal length, the braid between the fittings, that laws and mass belong to."""
    shortest: BraidLength
    """Shortest nominal length that is made."""
    longest: BraidLength
    """Longest nominal length that is made."""
    mass_per_length: Annotated[float, Quantity("kg/m", at_least=0.0, at_most=20.0)]
    """Mass of the braid per nominal length; the rest of the mass are the fittings."""
    force: LengthForce | None = None
    """Effect of the length on the force; without it the force depends on the contraction ratio alone."""

    def _must_rise(self) -> None:
        if not self.shortest <= self.reference <= self.longest:
            allowed = f"{amounts(self.shortest)} to {amounts(self.longest)}"
            raise refusal("is outside of the lengths that are made", allowed, "reference")
        if self.force is not None and self.force.offset >= self.reference:
            raise refusal("no force is left at the reference length", "", "force.offset")

    def problems(self, length: float) -> Iterator[str]:
        """Reasons why a nominal length [m] cannot be bought."""
        for key, word, beyond in (
            ("shortest", "shorter", length < self.shortest),
            ("longest", "longer", length > self.longest),
        ):
            if beyond:
                yield (
                    f"a braid of {amounts(length)} is {word} than any that is made, "
                    f"{amounts(getattr(self, key))}{provenance_note(self, key)}"
                )

    def factor(self, length: float) -> float:
        """Force at a nominal length [m] over that at the reference length [-]."""
        return 1.0 if self.force is None else self.force.factor(length, self.reference)

    def unmeasured(self, length: float) -> str:
        """Warning of a nominal length [m] at which the force was not measured; "" without one."""
        force = self.force
        if force is None or force.shortest <= length <= force.longest:
            return ""
        return (
            f"a braid of {amounts(length)} is outside the {amounts(force.shortest)} to "
            f"{amounts(force.longest)} at which the effect of length on force was measured"
            f"{provenance_note(force, 'slope')}"
        )


def amounts(length: float) -> str:
    """A length in the unit of catalogues."""
    return f"{1e3 * length:.6g} mm"
