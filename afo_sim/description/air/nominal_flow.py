"""A nominal flow as a data sheet prints it, with the norm and the pressures that make it a conductance."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import field_validator, model_validator

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY, Given, nearest_name
from afo_sim.description.quantity import Described, Quantity, amount, refusal
from afo_sim.physics import conductance_of_nominal_flow

GaugePressure = Annotated[float, Quantity("Pa", at_least=0.0, at_most=5e6)]
Norm = Literal["ANR", "DIN 1343"]
DENSITIES: dict[str, float] = {"ANR": STANDARD_DENSITY, "DIN 1343": NORMAL_DENSITY}  # of air [kg/m³]
MEANT = {"anr": "ANR", "smc": "ANR", "ckd": "ANR", "iso8778": "ANR"} | dict.fromkeys(
    ("din1343", "din", "festo", "nl", "nl/min"), "DIN 1343"
)
WHOSE = '"ANR" or "DIN 1343"; SMC and CKD count ANR, Festo DIN 1343'
NEEDED = ("flow", "norm", "upstream", "downstream")
HOW = (
    'nominal_flow = { flow = "100 l/min", norm = "ANR", upstream = "6 bar", downstream = "5 bar" }, gauge '
    "pressures. SMC and CKD print litres ANR (20 °C, 1 bar), Festo litres of DIN 1343 (0 °C, 1.01325 bar), "
    "which hold 9 % more air; both measure from 6 to 5 bar gauge. Read as absolute pressures, these make "
    "another 9 %"
)


class NominalFlow(Described):
    """A flow that a valve passes between two pressures, in litres of a norm."""

    flow: Annotated[float, Quantity("m^3/s", above=0.0, at_most=1.0)]
    """Volume flow Q, counted in the norm's state."""
    norm: Norm
    """State in which the volume is counted: "ANR" is 20 °C, 1 bar, 65 % humidity (ISO 8778; SMC, CKD),
    "DIN 1343" is 0 °C, 1.01325 bar (Festo; also written Nl)."""
    upstream: GaugePressure
    """Gauge pressure before the valve."""
    downstream: GaugePressure
    """Gauge pressure behind the valve."""

    @model_validator(mode="before")
    @classmethod
    def _tells_all(cls, table: Given) -> Given:
        if isinstance(table, cls):
            return table
        if not isinstance(table, Mapping):
            raise refusal("a flow without its norm and its two pressures is not a conductance", HOW)
        lacking = [name for name in NEEDED[1:] if table.get(name) is None] if "flow" in table else []
        if lacking:
            told = f"does not state {', '.join(lacking)}: a flow alone is not a conductance"
            raise refusal(told, HOW)
        return table

    @field_validator("norm", mode="before")
    @classmethod
    def _is_a_norm(cls, norm: Given) -> Given:
        if isinstance(norm, str) and norm in DENSITIES:
            return norm
        plain = "".join(str(norm).split()).lower()
        nearest = MEANT.get(plain) or nearest_name(str(norm), DENSITIES) or ""
        raise refusal("is not a valid choice", WHOSE, nearest=nearest)

    def _must_flow_down(self) -> None:
        if not self.downstream < self.upstream:
            problem = "is not below the pressure before the valve"
            raise refusal(problem, f"less than {amount(self.upstream, 'Pa')}", "downstream")

    @property
    def words(self) -> str:
        """The figure on one line."""
        pressures = " to ".join(amount(p, "Pa") for p in (self.upstream, self.downstream))
        return f"{amount(self.flow, 'm^3/s')} {self.norm} from {pressures} gauge"

    def conductance(self, critical_ratio: float) -> float:
        """Sonic conductance C [m³/(s·Pa)] of a valve with this flow and a critical ratio."""
        density = DENSITIES[self.norm]
        return conductance_of_nominal_flow(self.flow, critical_ratio, self.upstream, self.downstream, density)
