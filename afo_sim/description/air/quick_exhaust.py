"""A quick exhaust at a muscle, as it is described: fills through its lip seal, vents straight to ambient."""

from typing import Annotated

from afo_sim.description.air.network import Conductance, Ratio
from afo_sim.description.quantity import Described, Quantity


class QuickExhaust(Described):
    """A quick exhaust between a chamber's tube and its muscles."""

    conductance: Conductance
    """Sonic conductance C (ISO 6358) from the tube to the muscles."""
    critical_ratio: Ratio
    """Critical pressure ratio b (ISO 6358), of both ways."""
    exhaust_conductance: Conductance
    """Sonic conductance from the muscles to the ambient air."""
    cracking_pressure: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e5)] = 0.0
    """Pressure difference between tube and muscles that opens either way."""
