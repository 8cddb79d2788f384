"""Ankle-foot orthoses with pneumatic artificial muscles, simulated in MuJoCo.

    import afo_sim as afo

    muscle = afo.load("muscle", "dmsp_20")
    muscle.force("3 bar", contraction=[0, 0.05, 0.10])            # [N]
    walk = afo.load("scenario", "walk-dropfoot-afo").set({"orthosis.muscle.dorsiflexor.type": muscle})
    run = afo.run(walk, {"supply.pressure": "3 bar"})
    run["ankle/angle"], run.metrics["toe_clearance"] > "10 mm"    # [rad] (n,), a number with its unit
    afo.figure(run, "walk.pdf"), afo.report(run, "walk.html")

`dir(afo_sim)` lists all names, `afo-sim list` and `load` what is shipped. Numbers are SI; texts carry units.
"""

import importlib
import warnings
from typing import TYPE_CHECKING, Any

from afo_sim.simulation.shown import show_with

if TYPE_CHECKING:
    from afo_sim.common.errors import AfoSimError as AfoSimError
    from afo_sim.common.errors import InputError as InputError
    from afo_sim.common.errors import SimulationError as SimulationError
    from afo_sim.description.muscle import Muscle as Muscle
    from afo_sim.description.reader import load as load
    from afo_sim.description.scenario import Scenario as Scenario
    from afo_sim.lab.bench.stand import stand as stand
    from afo_sim.lab.fitting.law_result import fit as fit
    from afo_sim.lab.fitting.run_fit import fit_run as fit_run
    from afo_sim.lab.fitting.torque_fit import fit_torque as fit_torque
    from afo_sim.lab.validation.table import validate as validate
    from afo_sim.legs.attached_files import attached as attached
    from afo_sim.legs.attaching import attach as attach
    from afo_sim.legs.exporting import export_leg as export_leg
    from afo_sim.legs.importing import import_leg as import_leg
    from afo_sim.metrics.metric import Metric as Metric
    from afo_sim.model.build import build as build
    from afo_sim.model.rescale import refit as refit
    from afo_sim.model.torque_map import pressure_map as pressure_map
    from afo_sim.rl.bridge.library import dm_control_physics as dm_control_physics
    from afo_sim.show.drawing import draw as draw
    from afo_sim.show.library import figure as figure
    from afo_sim.show.library import report as report
    from afo_sim.show.library import view as view
    from afo_sim.simulation.both import Both as Both
    from afo_sim.simulation.both import both as both
    from afo_sim.simulation.checks import expect as expect
    from afo_sim.simulation.recording import Recording as Recording
    from afo_sim.simulation.recording import read_recording as read_recording
    from afo_sim.simulation.run import run as run
    from afo_sim.simulation.simulator import Simulator as Simulator
    from afo_sim.simulation.simulators import Simulators as Simulators
    from afo_sim.study.effects import effects as effects
    from afo_sim.study.frequency_response import bode as bode
    from afo_sim.study.library import optimise as optimise
    from afo_sim.study.library import sweep as sweep
    from afo_sim.study.parameter import span as span
    from afo_sim.study.sizing.sizes import size as size
    from afo_sim.study.uncertainty.library import uncertainty as uncertainty

_PUBLIC = {
    "run": "simulation.run",
    "Simulator": "simulation.simulator",
    "Simulators": "simulation.simulators",
    "load": "description.reader",
    "build": "model.build",
    "import_leg": "legs.importing",
    "export_leg": "legs.exporting",
    "pressure_map": "model.torque_map",
    "refit": "model.rescale",
    "attach": "legs.attaching",
    "attached": "legs.attached_files",
    "Scenario": "description.reader",  # which fills what `Scenario.set` asks
    "Muscle": "description.reader",
    "Recording": "simulation.recording",
    "Metric": "metrics.metric",
    "read_recording": "simulation.recording",
    "stand": "lab.bench.stand",
    "both": "simulation.both",
    "Both": "simulation.both",
    "fit": "lab.fitting.law_result",
    "fit_run": "lab.fitting.run_fit",
    "fit_torque": "lab.fitting.torque_fit",
    "sweep": "study.library",
    "span": "study.parameter",
    "uncertainty": "study.uncertainty.library",
    "optimise": "study.library",
    "effects": "study.effects",
    "bode": "study.frequency_response",
    "size": "study.sizing.sizes",
    "validate": "lab.validation.table",
    "dm_control_physics": "rl.bridge.library",
    "view": "show.library",
    "report": "show.library",
    "figure": "show.library",
    "draw": "show.drawing",
    "expect": "simulation.checks",
    "AfoSimError": "common.errors",
    "InputError": "common.errors",
    "SimulationError": "common.errors",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    # Imported when first asked for: MuJoCo and numba take a second, `afo-sim --help` must not.
    if name == "__version__":
        return importlib.import_module("afo_sim.common.versions").versions()["afo-sim"]
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"afo_sim.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__doc__", "__file__", "__name__", "__path__", "__version__"])


class _Show:
    """Shows and exports recordings; what it takes is imported when it is first asked for."""

    def write(self, recording: Any, path: Any, rate: float | None = None) -> None:
        importlib.import_module("afo_sim.show.rerun").write_rrd(recording, path, rate=rate)

    def open(self, paths: Any) -> None:
        importlib.import_module("afo_sim.show.rerun").open_recordings(paths)

    def html(self, recording: Any) -> str:
        return str(importlib.import_module("afo_sim.show.notebook").html(recording))

    def both(self, legs: Any, path: Any) -> None:
        importlib.import_module("afo_sim.show.both_figure").draw_both(legs, path)

    def export(self, recording: Any, out: Any, to: Any, rate: Any, columns: Any, force: bool) -> Any:
        exported = importlib.import_module("afo_sim.export.exported").export(
            recording, out, to, rate=rate, columns=columns, force=force
        )
        for note in exported.notes:
            warnings.warn(note, stacklevel=3)
        return exported.files


show_with(_Show())
