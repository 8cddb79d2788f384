"""A recorded column, and the stretch of a simulation that it is computed from."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE

if TYPE_CHECKING:
    from afo_sim.model import Built, Index


@dataclass(frozen=True)
class Frame:
    """A stretch of a simulation, from which columns follow."""

    built: "Built"
    rows: dict[str, np.ndarray]
    control: np.ndarray
    first_step: int = 0

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.rows["time"])

    def force(self, actuator: int) -> np.ndarray:
        """MuJoCo's force of an actuator (n,)."""
        return self.rows["actuator_force"][:, actuator]

    def dof(self, name: str) -> np.ndarray:
        """A field at the ankle's degree of freedom (n,)."""
        return self.rows[name][:, self.built.index.ankle_dof]


@dataclass(frozen=True)
class Column:
    """One recorded column, or one of each muscle, chamber, valve or joint."""

    name: str
    unit: str
    sign: str
    formula: Callable[..., np.ndarray]
    whole: bool = False
    where: Callable[["Built"], object] = lambda built: True
    of: Callable[["Index", int], object] = lambda index, owner: True


def edge_flow(f: Frame, edge: int) -> np.ndarray:
    """Mass flow through an edge of the air, along it positive [kg/s] (n,)."""
    return native.read_flow(f.built.model, f.rows["userdata"], edge)


def volume_pressure(f: Frame, node: int) -> np.ndarray:
    """Gauge pressure of a rigid volume or a store [Pa] (n,)."""
    return native.read_volume(f.built.model, f.rows["userdata"], node) - AMBIENT_PRESSURE
