"""A muscle as it is described: braid, laws and frictions with their parameters, damper, limits."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from afo_sim.common import Given, JsonDict, JsonMapping, nearest_name, unknown
from afo_sim.description.covariance import Draws, FitCovariance
from afo_sim.description.law_set import FrictionSet, GaugePressure, LawSet, named
from afo_sim.description.lengths import BraidLength, Lengths, amounts
from afo_sim.description.quantity import (
    SET_BY_HAND,
    Described,
    Named,
    Quantity,
    amount,
    refusal,
    refused_name,
)
from afo_sim.description.rest_curves import RestCurves, at_rest
from afo_sim.physics import (
    FRICTIONS,
    LAWS,
    RETIRED_FRICTIONS,
    Braid,
    LawVolume,
    law_volume,
    returning,
    turning,
)

PositiveLength = Annotated[float, Quantity("m", above=0.0, at_most=2.0)]
Distance = Annotated[float, Quantity("m", at_least=0.0, at_most=2.0)]
Pressure = Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]
_Damping = Annotated[float, Quantity("N*s/m", at_least=-1e6, at_most=1e6)]
_DampingSlope = Annotated[float, Quantity("N*s/(m*Pa)", at_least=-1.0, at_most=1.0)]


class Limits(Described):
    """Limits of a muscle; beyond them a run warns."""

    pressure: Pressure
    """Highest gauge pressure."""
    force: Annotated[float, Quantity("N", above=0.0, at_most=1e6)]
    """Highest force."""
    contraction_min: Annotated[float, Quantity("", at_least=-0.5, at_most=0.0)]
    """Furthest stretch, as a negative contraction ratio."""
    contraction_max: Annotated[float, Quantity("", above=0.0, at_most=0.6)]
    """Highest contraction ratio."""


class ThreeElementDamper(Described):
    """Damping of the three-element model, B = b0 + b1 p, another while contracting than while relaxing."""

    contracting: tuple[_Damping, _DampingSlope]
    """b0 and b1 of B = b0 + b1 p while the muscle contracts."""
    relaxing: tuple[_Damping, _DampingSlope]
    """b0 and b1 while it relaxes."""
    switch_pressure: GaugePressure = 0.0
    """Gauge pressure from which relaxing_above replaces relaxing."""
    relaxing_above: tuple[_Damping, _DampingSlope] | None = None
    """b0 and b1 while it relaxes above switch_pressure; those of relaxing by default."""

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Arguments of the kernel after pressure and contraction rate."""
        above = self.relaxing if self.relaxing_above is None else self.relaxing_above
        return (*self.contracting, self.switch_pressure, *self.relaxing, *above)


class RubberTube(Described):
    """Rubber tube inside the braid, incompressible, whose elasticity the law does not know."""

    modulus: Annotated[float, Quantity("Pa", at_least=5e4, at_most=2e7)]
    """Young's modulus of the rubber at small strain."""
    wall_thickness: Annotated[float, Quantity("m", at_least=1e-4, at_most=0.1)]
    """Thickness of its wall at rest, where its outside touches the braid; less than half the bore."""


class Muscle(Named, RestCurves, Draws):
    """A pneumatic artificial muscle: braid, law, friction, damper, limits.

    `laws` holds the parameters of every known law; `law` names the one in use; so do
    `frictions` and `friction`, which may be "none". The damping R p_abs κ̇ and a `damper` add up. SI inside.
    `force`, `contraction`, `pressure` and `volume` are its curves at rest; `drawn` draws its fitted numbers
    from their `covariance`.

    Examples
    --------
    >>> muscle = load("muscle", "dmsp_20")
    >>> muscle.nominal_length, muscle.limits.pressure  # [m], [Pa]
    (0.3, 600000.0)
    """

    grade: Literal["A", "B", "C", "D"] = "D"
    """Quality of the numbers: A is measured on this muscle, D is a guess."""
    law: str
    """Force law in use, one of those under laws."""
    laws: dict[str, LawSet]
    """Force laws with their parameters, by name."""
    friction: str = "none"
    """Friction in use, one of those under frictions, or none."""
    frictions: dict[str, FrictionSet] = Field(default_factory=dict)
    """Frictions with their parameters, by name."""
    damper: ThreeElementDamper | None = None
    """Damper of the three-element model, beside damping."""
    total_length: BraidLength
    """Length between the ends of the fittings, unpressurised."""
    end_length: Distance
    """Length of clamps and dead ends, which do not contract."""
    bore: Annotated[float, Quantity("m", above=0.0, at_most=0.2)]
    """Inner diameter of the braid at rest."""
    braid_angle: Annotated[float, Quantity("rad", at_least=0.0873, at_most=0.872)]
    """Angle between fibre and muscle axis at rest."""
    damping: Annotated[float, Quantity("m^2*s", at_least=0.0, at_most=1.0)]
    """Coefficient R of the viscous damping R p_abs κ̇, with p_abs the absolute pressure."""
    braid_stiffness: Annotated[float, Quantity("N", above=0.0, at_most=1e7)]
    """Stiffness of the stretched braid, force per contraction ratio below zero."""
    return_stiffness: Annotated[float, Quantity("N", at_least=0.0, at_most=1e5)] = 20.0
    """Force per contraction ratio that brings a muscle without air back to its nominal length."""
    dead_volume: Annotated[float, Quantity("m^3", above=0.0, at_most=0.1)]
    """Volume of air that stays when the muscle is empty."""
    test_pressure: Annotated[float, Quantity("Pa", at_least=1e5, at_most=2e6)] = 6.2e5
    """Gauge pressure at which free_contraction and blocked_force were measured on this very muscle."""
    free_contraction: Annotated[float, Quantity("", above=0.0, at_most=0.6)] | None = None
    """Contraction ratio without load, to which the law's contractions are scaled; the law's by default."""
    blocked_force: Annotated[float, Quantity("N", above=0.0, at_most=1e6)] | None = None
    """Force at the nominal length, to which the law's forces are scaled; the law's by default."""
    force_factor: Annotated[float, Quantity("", at_least=0.2, at_most=3.0)] = 1.0
    """Factor on the law's force, by which another specimen or another laboratory differs."""
    contraction_factor: Annotated[float, Quantity("", at_least=0.3, at_most=2.0)] = 1.0
    """Factor on the law's contraction without load, by which another specimen differs."""
    end_loss: Distance = 0.0
    """Length d by which the ends weaken each piece, F ∝ 1 − d/L0; without a blocked_force, which has it."""
    tube: RubberTube | None = None
    """Rubber tube inside the braid; without one no rubber takes force beside the law's."""
    mass: Annotated[float, Quantity("kg", at_least=0.0, at_most=20.0)]
    """Mass of muscle and fittings; at lengths.reference, where there are lengths."""
    limits: Limits
    """Limits beyond which a run warns."""
    pieces: int = Field(default=1, ge=1, le=20)
    """Equal muscles end to end that it consists of: lengths, dead_volume, mass and damper are of all
    together, laws and frictions of one."""
    lengths: Lengths | None = None
    """Lengths that are made, and what follows from the length; laws and mass hold as they are by default."""
    covariance: FitCovariance | None = None
    """Joint uncertainty of the numbers that were fitted together, where a fit reported it."""

    @model_validator(mode="before")
    @classmethod
    def _read_sets(cls, table: Given) -> Given:
        if not isinstance(table, dict):
            return table
        laws, frictions = named(table, "law"), named(table, "friction")
        frictions = {name: own for name, own in frictions.items() if name not in RETIRED_FRICTIONS}
        return table | {"laws": laws, "frictions": frictions}

    @field_validator("law", "friction")
    @classmethod
    def _is_known(cls, chosen: str, info: ValidationInfo) -> str:
        known = [*LAWS] if info.field_name == "law" else [*FRICTIONS, "none"]
        if instead := RETIRED_FRICTIONS.get(chosen):
            problem = f"the friction {chosen!r} is retired: it gave energy where the pressure rose"
            raise refusal(problem, f"{instead}, in a table [frictions.{instead}] with the same parameters")
        if chosen not in known:
            own = "one of your own comes by afo_sim.register, or --extension FILE"
            raise refused_name(f"{chosen!r} is an unknown {info.field_name}; {own}", chosen, known)
        return chosen

    @field_validator("laws", "frictions")
    @classmethod
    def _hold_the_one_in_use(cls, sets: JsonDict, info: ValidationInfo) -> JsonDict:
        kind = str(info.field_name).removesuffix("s")
        chosen, none = info.data.get(kind), ["none"] if kind == "friction" else []
        if chosen is None or chosen in sets or chosen in none:
            return sets
        # even where every parameter has a default: the braid angle was fitted together with another law
        known: JsonMapping = LAWS if kind == "law" else FRICTIONS
        wanted = ", ".join(p.name for p in known[chosen].parameters if p.default is None)
        raise refusal(
            f"this muscle has no parameters for {chosen!r}: a table [{kind}s.{chosen}]"
            + (f" with {wanted}" if wanted else ""),
            f"one of those it has: {', '.join([*sets, *none]) or 'none'}",
            "",
            nearest_name(chosen, sets) or "",
            beside=kind,
        )

    def _must_have_a_braid(self) -> None:
        if self.end_length >= self.total_length:
            raise refusal(
                f"the ends ({self.end_length * 100:g} cm) are not shorter than the whole muscle "
                f"({self.total_length * 100:g} cm): no braid is left",
                f"less than the total length, {self.total_length * 100:g} cm",
                "end_length",
            )

    def _must_have_ends_of_law(self) -> None:
        law = LAWS[self.law]
        pull = law.kernel(0.0, self.test_pressure, *law.coefficients(self.piece, self.law_set.parameters))
        problem = f"the law {law.name} does not pull at {amount(self.test_pressure, 'Pa')}"
        for key in ("free_contraction", "blocked_force"):
            if getattr(self, key) is not None and not pull > 0.0:
                raise refusal(problem, "", key)
        for key in ("blocked_force", "force_factor", "end_loss"):
            if getattr(self, key) != type(self).model_fields[key].default and not law.force_powers:
                raise refusal(f"the force of the law {law.name} cannot be scaled", "", key)

    def _must_leave_force(self) -> None:
        if self.end_loss >= self.piece.nominal_length:
            least = f"less than the braid of a piece, {amounts(self.piece.nominal_length)}"
            raise refusal("no force would remain", least, "end_loss")
        told = {"blocked_force": self.blocked_force, "lengths.force": self.lengths and self.lengths.force}
        told[f"the law {self.law}"] = True if LAWS[self.law].length == "own" else None
        for key in (key for key, value in told.items() if self.end_loss and value is not None):
            raise refusal(f"{key} says what the ends take", "one of the two", "end_loss")

    def _must_fit_its_tube(self) -> None:
        if self.tube is None:
            return
        if not 2.0 * self.tube.wall_thickness < self.bore:
            problem, most = "no air would be left", f"less than half the bore, {amounts(self.bore / 2.0)}"
            raise refusal(problem, most, "tube.wall_thickness")
        for name, own in self.laws.items():
            if own.parameters.get("wall_thickness") and not LAWS[name].rubber:
                problem = "the tube already includes the wall's rubber: it would count twice"
                raise refusal(problem, "0 mm beside a tube", f"laws.{name}.wall_thickness")
        if not math.isfinite(self.contraction_scale):
            problem = f"its rubber resists more at this contraction than {self.law} pulls"
            raise refusal(problem, "a smaller one, or a softer tube", "free_contraction")

    def _must_have_a_length_that_is_made(self) -> None:
        if self.lengths is None:
            return
        made = f"{amounts(self.lengths.shortest)} to {amounts(self.lengths.longest)} between the fittings"
        for problem in self.lengths.problems(self.piece.nominal_length):
            raise refusal(problem, made, "total_length")
        if self.whole_mass <= 0.0:
            raise refusal(
                f"the fittings would have no mass: a braid of {amounts(self.lengths.reference)}, which the "
                "mass belongs to, is heavier",
                f"more than {1e3 * (self.mass - self.whole_mass):.4g} g",
                "mass",
            )
        for name in self.laws if self.lengths.force is not None else ():
            if not LAWS[name].force_powers:
                raise refusal(f"the force of the law {name} cannot be scaled", "", "lengths.force")

    def _must_own_covariance(self) -> None:
        if self.covariance is not None and self.covariance.law not in self.laws:
            nearest = nearest_name(self.covariance.law, self.laws) or ""
            problem = "the muscle has no parameters of this law"
            raise refusal(problem, f"one of those it has: {', '.join(self.laws)}", "covariance.law", nearest)

    @property
    def law_set(self) -> LawSet:
        """The parameters and ranges of the law in use."""
        return self.laws[self.law]

    def using(self, *, law: str | None = None, friction: str | None = None) -> Self:
        """The same muscle with another of its laws or frictions in use.

        The muscle keeps its covariance, which does not apply while another law than its own is in use.

        Parameters
        ----------
        law : one of `laws`; as it is by default
        friction : one of `frictions`, or "none"; as it is by default

        Raises
        ------
        InputError
            The muscle has no parameters for it.

        Examples
        --------
        >>> load("muscle", "dmsp_20").using(law="kerscher_2006").law
        'kerscher_2006'
        """
        for kind, name, known in (
            ("law", law, [*self.laws]),
            ("friction", friction, [*self.frictions, "none"]),
        ):
            if name is not None and name not in known:
                raise unknown(name, known, field=kind, problem="the muscle has no parameters for it")
        return self.with_values(law=law or self.law, friction=friction or self.friction)

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Arguments of the law's kernel after contraction and pressure."""
        return self.coefficients_of(self.law, self.law_set.parameters)

    def coefficients_of(self, law: str, parameters: Mapping[str, float]) -> tuple[float, ...]:
        """Arguments of a law's kernel for this muscle at its length, after contraction and pressure.

        With `lengths` the force goes with the contraction ratio as at the reference length, times
        `Lengths.factor`. A law that knows the effect of the length itself takes the length instead. The ends
        weaken it by 1 − end_loss/L0 of a piece. A `blocked_force` has precedence. `force_factor` is on
        whatever that gives.
        """
        known, braid = LAWS[law], self.piece
        factor = 1.0 if known.length == "own" else 1.0 - self.end_loss / braid.nominal_length
        if self.lengths is not None and known.length != "own":
            factor *= self.lengths.factor(braid.nominal_length)
            if known.length == "one":
                braid = replace(braid, nominal_length=self.lengths.reference)
        found = known.coefficients(braid, parameters)
        if self.blocked_force is not None:
            factor = self.blocked_force / known.kernel(0.0, self.test_pressure, *found)
        return known.scaled(found, factor * self.force_factor)

    @property
    def measured(self) -> frozenset[str]:
        """What was measured on this very muscle, of "force" and "contraction"."""
        known = {
            name
            for name, told in self.provenance.items()
            if told.kind in ("user", "fitted") and told.source != SET_BY_HAND
        }
        own = {"force": {"force_factor", "blocked_force"}}
        own |= {"contraction": {"contraction_factor", "free_contraction"}}
        return frozenset(key for key, names in own.items() if names & known)

    @property
    def rubber(self) -> tuple[float, float, float]:
        """Stiffness [N], bore and turn [-] of its tube for `rubber_force`; no wall where its law has it."""
        if self.tube is None or LAWS[self.law].rubber:
            return 0.0, 1.0, 0.0
        bore = (1.0 - 2.0 * self.tube.wall_thickness / self.bore) ** 2
        stiffness = math.pi * self.tube.modulus / 3.0 * (self.bore / 2.0) ** 2 / 2.0
        return stiffness, bore, turning(self.braid.b, bore)

    @property
    def rubber_volume(self) -> float:
        """Volume of its tube's wall, which is no air [m³]."""
        if self.tube is None:
            return 0.0
        outer, inner = self.bore / 2.0, self.bore / 2.0 - self.tube.wall_thickness
        return math.pi * (outer**2 - inner**2) * self.nominal_length

    @property
    def contraction_scale(self) -> float:
        """The law's contraction over the muscle's; both reach free contraction together [-]."""
        return at_rest(self).contraction_scale

    @property
    def contraction_range(self) -> tuple[float, float]:
        """Contractions of the muscle between which its law holds [-]."""
        low, high = self.law_set.contraction_range
        scale = self.contraction_scale
        return low / scale, high / scale

    @property
    def friction_coefficients(self) -> tuple[float, ...]:
        """Arguments of the friction's kernel; none without friction."""
        if self.friction == "none":
            return ()
        return FRICTIONS[self.friction].coefficients(self.piece, self.frictions[self.friction].parameters)

    @property
    def row(self) -> JsonDict:
        """Arguments of `native.muscle_row` that do not depend on where the muscle is mounted."""
        return {
            "law": self.law,
            "coefficients": self.coefficients,
            "lowest_pressure": self.law_set.pressure_range[0],
            "braid": self.braid,
            "damping": self.damping,
            "braid_stiffness": self.braid_stiffness,
            "return_stiffness": self.return_stiffness,
            "dead_volume": self.dead_volume,
            "damper": () if self.damper is None else self.damper.coefficients,
            "friction": 0 if self.friction == "none" else FRICTIONS[self.friction].native_id,
            "friction_coefficients": self.friction_coefficients,
            "law_volume": self.law_volume.numbers,
            "returning": self.returning,
            "contraction_scale": self.contraction_scale,
            "rubber": self.rubber[0],
            "rubber_bore": self.rubber[1],
            "rubber_turn": self.rubber[2],
            "rubber_volume": self.rubber_volume,
        }

    @property
    def law_volume(self) -> LawVolume:
        """Its volume by the law in use; the braid's, and why, where that is not plausible."""
        ranges = self.law_set.pressure_range, self.contraction_range
        return law_volume(
            self.law, self.coefficients, self.braid, *ranges, self.contraction_scale, self.force_factor
        )

    @property
    def returning(self) -> float:
        """The part of its return force that has a volume [N]."""
        most = max(self.contraction_range[1], 0.0)
        return returning(self.return_stiffness, self.braid, most, self.rubber_volume)

    @property
    def nominal_length(self) -> float:
        """L0: the active braid, unpressurised [m]."""
        return self.total_length - self.end_length

    @property
    def whole_mass(self) -> float:
        """Mass of the muscle at its length: the braid's by the metre, and two fittings' [kg]."""
        if self.lengths is None:
            return self.mass
        further = self.nominal_length - self.pieces * self.lengths.reference
        return self.mass + self.lengths.mass_per_length * further

    @property
    def length_warning(self) -> str:
        """Warning of a length at which the force was not measured; "" without one."""
        return "" if self.lengths is None else self.lengths.unmeasured(self.piece.nominal_length)

    @property
    def braid(self) -> Braid:
        """Its geometry, as the laws take it."""
        return Braid(self.nominal_length, self.bore / 2.0, self.braid_angle)

    @property
    def piece(self) -> Braid:
        """The braid of one of its pieces."""
        return replace(self.braid, nominal_length=self.nominal_length / self.pieces)
