"""afo_sim: ankle-foot orthoses with pneumatic artificial muscles, simulated in MuJoCo.

import afo_sim
run = afo_sim.run("seated", {"supply.pressure": "3 bar"})
run["ankle/angle"], run.metrics["range_of_motion"], run.save("runs/a")
"""

import importlib
from typing import TYPE_CHECKING, Any

from afo_sim.simulation.shown import show_with

if TYPE_CHECKING:
    from afo_sim.common.errors import AfoSimError as AfoSimError
    from afo_sim.common.errors import InputError as InputError
    from afo_sim.common.errors import SimulationError as SimulationError
    from afo_sim.description.reader import load as load
    from afo_sim.model.build import build as build
    from afo_sim.simulation.recording import Recording as Recording
    from afo_sim.simulation.recording import read_recording as read_recording
    from afo_sim.simulation.run import run as run

_PUBLIC = {
    "AfoSimError": "common.errors",
    "InputError": "common.errors",
    "SimulationError": "common.errors",
    "load": "description.reader",
    "build": "model.build",
    "Recording": "simulation.recording",
    "read_recording": "simulation.recording",
    "run": "simulation.run",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    # Imported when first asked for: MuJoCo and numba take a second, `afo-sim --help` must not.
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"afo_sim.{_PUBLIC[name]}"), name)


class _Show:
    """Shows recordings; what it takes is imported when the first is to be shown."""

    def write(self, recording: Any, path: Any, rate: float | None = None) -> None:
        importlib.import_module("afo_sim.show.rerun").write_rrd(recording, path, rate=rate)

    def open(self, paths: Any) -> None:
        importlib.import_module("afo_sim.show.rerun").open_recordings(paths)

    def html(self, recording: Any) -> str:
        return str(importlib.import_module("afo_sim.show.notebook").html(recording))


show_with(_Show())
