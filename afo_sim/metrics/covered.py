"""How well predictions did so far: the ledger's measured values inside their bands, by kind of number."""

import functools
from collections.abc import Container, Iterable
from dataclasses import asdict, dataclass

from afo_sim.common import JsonDict, assets
from afo_sim.metrics.answer import listed

KINDS = {  # metric: the kind of measured value that shows how good its predictions are
    "toe_clearance": "toe clearance",
    "torque_against_push_off": "joint torque",
    "torque_against_push_off_per_mass": "joint torque",
    "orthosis_peak_dorsiflexion_torque": "joint torque",
    "peak_dorsiflexion_torque": "joint torque",
    "range_of_motion": "joint angle",
    "muscle_share_of_force": "muscle force",
    "air_per_stride": "air",
    "air_per_cycle": "air",
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
            return f"{self.kind} (none measured)"
        alone = " (one test)" if self.benches < min(self.values, 2) else ""
        return f"{self.kind} {self.inside} of {self.values}{alone}"


@functools.cache
def coverages() -> dict[str, Coverage]:
    """Of each kind, as the ledger was last compared."""
    table = assets.read_toml(assets.folder("models") / "coverage.toml")
    return {kind: Coverage(kind, **counts) for kind, counts in table.items()}


def coverage(metric: str) -> Coverage | None:
    """Of the kind of a metric; None where the ledger has no kind for it."""
    return coverages().get(KINDS.get(metric, ""))


def counts(metrics: Iterable[str]) -> dict[str, JsonDict]:
    """Of each metric that has a kind, for files."""
    return {name: asdict(found) for name in metrics if (found := coverage(name))}


def worth(metrics: Container[str]) -> str:
    """How well such metrics were predicted so far, as a sentence; "" where none has a kind."""
    kinds = {KINDS[name]: found for name in KINDS if name in metrics and (found := coverage(name))}
    worn = [kind for kind, found in kinds.items() if found.worn]
    told = ", ".join(found.text for found in kinds.values())
    on = f"only {listed(worn)}" if worn else "none"
    start = "Measured values inside predicted 90 % bands (9 of 10 expected)"
    return f"{start}: {told}; {on} on a worn orthosis." if kinds else ""
