"""Pictures of runs from Python: `afo_sim.view`, `report` and `figure`."""

import os
import pathlib
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from afo_sim.common import InputError, check_writable, optional, unknown
from afo_sim.show.run_figure import FIGURES, figures_of
from afo_sim.simulation import RERUN, Recording, read_recording

Run = Recording | str | os.PathLike[str]
Runs = Run | Mapping[object, Run] | Sequence[Run]


@dataclass(frozen=True)
class Picture:
    """A figure of a run, which a notebook shows and `save` writes; it is drawn on demand.

    recording : that it shows
    kind : of figure, such as "angle"
    """

    recording: Recording
    kind: str

    def save(self, path: str | os.PathLike[str]) -> pathlib.Path:
        """Write the figure, whole or not at all; the suffix (png, pdf or svg) is the format."""
        target = pathlib.Path(path)
        check_writable(target.parent)
        target.parent.mkdir(parents=True, exist_ok=True)
        FIGURES[self.kind](self.recording, target)
        return target

    def _repr_png_(self) -> bytes:  # asked for by Jupyter
        with tempfile.TemporaryDirectory() as folder:
            return self.save(pathlib.Path(folder) / "figure.png").read_bytes()


def figure(run: Run, out: str | os.PathLike[str] | None = None, *, kind: str = "overview") -> Picture:
    """A publication figure of a run; `report` compares several runs.

    Parameters
    ----------
    run : a Recording, or the folder of one
    out : file to write, whole or not at all; its suffix (png, pdf or svg) is the format
    kind : "overview", "angle", "torque", "clearance", "pressure", "muscles" or "force_contraction"; clearance
        is of walking, the last three of an orthosis

    Returns
    -------
    Picture, which a notebook shows

    Raises
    ------
    InputError
        The kind does not exist or does not apply to the run; there is no run; the suffix is not a format.

    Examples
    --------
    >>> figure(run("seated", {"duration": "1 s"}), "angle.pdf", kind="angle").kind
    'angle'
    """
    recording = _recording(run)
    kinds = figures_of(recording)
    if kind not in kinds:
        problem = "cannot be shown for this run" if kind in FIGURES else "is not a valid figure"
        raise unknown(kind, kinds, field="kind", problem=problem)
    picture = Picture(recording, kind)
    if out is not None:
        picture.save(out)
    return picture


def report(runs: Runs, out: str | os.PathLike[str] = "report.html") -> pathlib.Path:
    """Report on one run or several side by side, as one self-contained HTML file.

    Parameters
    ----------
    runs : a Recording or its folder, a list of them, or a dict of them whose keys become their names; at most
        six, and the others are compared with the first
    out : HTML file to write, whole or not at all

    Returns
    -------
    the file written

    Raises
    ------
    InputError
        There is no run, or there are too many, or the file cannot be written.

    Examples
    --------
    >>> runs = {f"{p} bar": run("seated", {"duration": "1 s", "supply.pressure": f"{p} bar"}) for p in (2, 4)}
    >>> report(runs, "two.html").name
    'two.html'
    """
    from afo_sim.show.report import write_report

    if not isinstance(out, str | os.PathLike):
        allowed = "a path; several runs in a list or dict"
        raise InputError("is no name of a file", field="out", value=out, allowed=allowed)
    with _folders(runs) as folders:
        return write_report(folders, pathlib.Path(out))


def view(runs: Runs) -> None:
    """Open one or several runs in the Rerun viewer, and wait until it is closed.

    Parameters
    ----------
    runs : a Recording or its folder, a list of them, or a dict of them whose keys become their names

    Raises
    ------
    InputError
        There is no run, or there is no display to open the viewer on.

    Examples
    --------
    >>> view(run("seated"))  # doctest: +SKIP
    """
    optional("rerun")
    from afo_sim.show.rerun import open_recordings, write_comparison, write_rrd
    from afo_sim.show.rerun.viewer import require_display

    try:
        require_display()
    except InputError:
        problem = "there is no display here to open the viewer on; draw with figure or report"
        raise InputError(problem) from None
    with _folders(runs) as folders, tempfile.TemporaryDirectory() as scratch:
        path = pathlib.Path(scratch) / RERUN
        if len(folders) == 1:
            write_rrd(folders[0], path)
        else:
            write_comparison(folders, path)
        open_recordings([path])


@contextmanager
def _folders(runs: Runs) -> Iterator[list[pathlib.Path]]:
    """Folders of runs, named as the runs are; those of recordings are there for the time being."""
    if isinstance(runs, Recording | str | os.PathLike):
        runs = [runs]
    with tempfile.TemporaryDirectory() as scratch:
        found: list[pathlib.Path] = []
        if isinstance(runs, Mapping):
            found += [_save(_recording(run), str(label), scratch) for label, run in runs.items()]
        else:
            for run in runs if isinstance(runs, Sequence) else [_recording(runs)]:
                if isinstance(run, str | os.PathLike):
                    found.append(pathlib.Path(run))
                else:
                    found.append(_save(_recording(run), run.described["name"], scratch))
        if not found:
            raise InputError("holds no run", field="runs")
        yield found


def _recording(run: object) -> Recording:
    if isinstance(run, str | os.PathLike):
        return read_recording(run)
    if not isinstance(run, Recording):
        raise InputError("is no run", value=run, allowed="a Recording, or the folder of one")
    return run


def _save(run: Recording, label: str, scratch: str) -> pathlib.Path:
    """A run's files in a folder called as near to the label as a folder can be."""
    name = re.sub(r"[^\w .+=-]", "_", label).strip(" .") or "run"
    taken = {path.name for path in pathlib.Path(scratch).iterdir()}
    names = [name, *(f"{name} {k}" for k in range(2, len(taken) + 3))]
    return run.save(pathlib.Path(scratch) / next(each for each in names if each not in taken), rrd=False)
