"""afo_sim: ankle-foot orthoses with pneumatic artificial muscles, simulated in MuJoCo.

import afo_sim
run = afo_sim.run("seated", {"supply.pressure": "3 bar"})
run["ankle/angle"], run.metrics["range_of_motion"], run.save("runs/a")
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from afo_sim.common.errors import AfoSimError as AfoSimError
    from afo_sim.common.errors import InputError as InputError
    from afo_sim.common.errors import SimulationError as SimulationError
    from afo_sim.description.reader import load as load
    from afo_sim.model.build import build as build
    from afo_sim.simulation.files import read_recording as read_recording
    from afo_sim.simulation.recording import Recording as Recording
    from afo_sim.simulation.rollout import run as run

_PUBLIC = {
    "AfoSimError": "common.errors",
    "InputError": "common.errors",
    "SimulationError": "common.errors",
    "load": "description.reader",
    "build": "model.build",
    "Recording": "simulation.recording",
    "read_recording": "simulation.files",
    "run": "simulation.rollout",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    # Imported when first asked for: MuJoCo and numba take a second, `afo-sim --help` must not.
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"afo_sim.{_PUBLIC[name]}"), name)
