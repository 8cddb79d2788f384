"""How much bands were worth so far: the ledger's measured values that lay in them, by kind of number."""

import functools
from dataclasses import dataclass

from afo_sim.common import assets

KINDS = {  # metric: the kind of measured value that tells what its band is worth
    "toe_clearance": "toe clearance",
    "torque_against_push_off": "joint torque",
    "orthosis_peak_dorsiflexion_torque": "joint torque",
    "range_of_motion": "joint angle",
    "air_per_stride": "air",
}


@dataclass(frozen=True)
class Coverage:
    """Measured values of one kind that were predicted with a band of 90 %."""

    kind: str
    values: int
    inside: int
    benches: int  # devices, rigs and groups of people that they were measured on
    worn: int  # of the values, those of a worn orthosis

    @property
    def text(self) -> str:
        """In plain words."""
        if not self.values:
            return f"{self.kind}: nobody has measured a value to compare with"
        on = "" if self.worn else ", none of them on a worn orthosis"
        return f"{self.kind}: of {self.values} measured values {self.inside} lay in such a band{on}"


@functools.cache
def coverages() -> dict[str, Coverage]:
    """Of each kind, as the ledger was last compared."""
    table = assets.read_toml(assets.folder("models") / "coverage.toml")
    return {kind: Coverage(kind, **counts) for kind, counts in table.items()}


def coverage(metric: str) -> Coverage | None:
    """Of the kind of a metric; None where the ledger has no kind for it."""
    return coverages().get(KINDS.get(metric, ""))
