"""Ankle-foot orthoses with pneumatic artificial muscles, simulated in MuJoCo.

    import afo_sim as afo

    muscle = afo.load("muscle", "dmsp_20")
    muscle.force("3 bar", contraction=[0, 0.05, 0.10])            # [N]
    walk = afo.load("scenario", "walk-dropfoot-afo").set({"orthosis.muscle.dorsiflexor.type": muscle})
    run = afo.run(walk, {"supply.pressure": "3 bar"})
    run["ankle/angle"], run.metrics["toe_clearance"] > "10 mm"    # [rad] (n,), a number with its unit
    afo.figure(run, "walk.pdf"), afo.report(run, "walk.html")

`dir(afo_sim)` lists all names, `afo-sim list` and `load` what is shipped. Numbers are SI; texts carry units.
The table of the names is `__init__.pyi`.
"""

import importlib
import warnings

import lazy_loader

from afo_sim.common import (
    RENAMED,
    RETIRED,
    Foreign,
    missing_extra,
    nearest_name,
    older,
    show_with,
    takes_older,
)

# A name is imported when it is first asked for: MuJoCo and numba take a second, `afo-sim --help` must not.
importlib.import_module("afo_sim.common.numba_settings")  # before numba
_resolve, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Foreign:
    if name == "__version__":
        return importlib.import_module("afo_sim.common.versions").versions()["afo-sim"]
    if name in RENAMED:
        globals()[name] = found = older(name)  # one notice
        return found
    if name not in __all__:
        instead = f" any more; instead: {RETIRED[name]}" if name in RETIRED else ""
        if not instead and not name.startswith("_") and (near := nearest_name(name, __all__)):
            instead = f"; did you mean {near!r}?"
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{instead}")
    try:
        found = _resolve(name)
    except ImportError as error:
        if (missing := missing_extra(error)) is None:
            raise
        raise missing from None
    if not found.__module__.startswith("afo_sim.common."):  # which errors and `register` do not need
        from afo_sim.common import register_installed

        register_installed()
    if any(entry.startswith(f"{name}(") for entry in (*RENAMED, *RETIRED)):
        globals()[name] = found = takes_older(found)
        found.__module__ = __name__  # by which pickle finds it
    return found


def __dir__() -> list[str]:
    return sorted([*__all__, "__doc__", "__file__", "__name__", "__path__", "__version__"])


def _room(module: str) -> Foreign:
    """A module of an extra, or a sentence on what to install."""
    try:
        return importlib.import_module(f"afo_sim.{module}")
    except ImportError as error:
        if (missing := missing_extra(error)) is None:
            raise
        raise missing from None


class _Show:
    """Shows and exports results, and draws bands; imports what that needs at first use."""

    def write(self, recording: Foreign, path: Foreign, rate: float | None = None) -> None:
        _room("show.rerun").write_rrd(recording, path, rate=rate)

    def open(self, paths: Foreign) -> None:
        _room("show.rerun").open_recordings(paths)

    def html(self, result: Foreign) -> Foreign:
        return _room("show.notebook").html(result)

    def both(self, legs: Foreign, path: Foreign) -> None:
        _room("show.compared_figures").draw_both(legs, path)

    def credibility(self, found: Foreign, folder: Foreign) -> Foreign:
        return _room("show.credibility_page").write_credibility(found, folder)

    def export(
        self, recording: Foreign, out: Foreign, to: Foreign, rate: Foreign, columns: Foreign, force: bool
    ) -> Foreign:
        exported = _room("export.exported").export(
            recording, out, to, rate=rate, columns=columns, force=force
        )
        for note in exported.notes:
            warnings.warn(note, stacklevel=3)
        return exported.files

    def bands(self, scenario: Foreign, draws: int, progress: Foreign) -> Foreign:
        studies = _room("study.run_studies")
        studies.check_studies(scenario, draws=draws)  # before anything is walked
        report = None if progress is None else lambda done, count, _: progress(done, count)
        return lambda recording: studies.with_studies(recording, scenario, draws=draws, report=report)


show_with(_Show())
