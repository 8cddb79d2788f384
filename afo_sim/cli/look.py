"""Commands on finished runs: view, figure, video, check-run."""

import pathlib
import sys
import tempfile
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Rate, hertz_of, progress, quantity
from afo_sim.common.errors import InputError


@app.command()
def view(
    paths: Annotated[list[pathlib.Path], typer.Argument(help="run folders, or .rrd files")],
    picture: Annotated[
        pathlib.Path | None, typer.Option("--screenshot", help="write a PNG instead; needs no display")
    ] = None,
    at: Annotated[str | None, typer.Option(help='time shown in the screenshot, for example "2.5 s"')] = None,
    rate: Rate = None,
    colour: Annotated[str, typer.Option(help="what colours the muscles: force|pressure")] = "force",
) -> None:
    """Open a run, or several side by side, in the Rerun viewer (on this machine only)."""
    if colour not in ("force", "pressure"):
        raise InputError("is no choice", field="--colour", value=colour, allowed="force, pressure")
    if at is not None and picture is None:
        raise InputError("goes with --screenshot", field="--at", value=at)
    moment = None if at is None else quantity("--at", at, "s")
    hertz = None if rate is None else hertz_of(rate)
    if picture is not None and picture.suffix.lower() != ".png":
        raise InputError(
            "is no PNG", field="--screenshot", value=str(picture), allowed="a name ending in .png"
        )
    with tempfile.TemporaryDirectory() as scratch, progress("reading the run"):
        from afo_sim.common.writing import check_writable, replacing

        files = _rerun_files(paths, pathlib.Path(scratch), hertz, colour)
        from afo_sim.show import rerun as viewer

        if moment is not None and paths[0].is_dir():
            viewer.require_time(paths, moment)
        if picture is None:
            viewer.open_recordings(files)
        else:
            check_writable(picture.parent)
            with replacing(picture) as temporary:
                viewer.screenshot(files[0], temporary, moment)
    if picture is not None:
        print(f"written to {picture}")


def _rerun_files(
    paths: list[pathlib.Path], scratch: pathlib.Path, rate: float | None, colour: str
) -> list[pathlib.Path]:
    """The Rerun files to show: those given, one made anew, or one made of several runs."""
    folders = [path for path in paths if path.is_dir()]
    if not folders and all(path.is_file() and path.suffix == ".rrd" for path in paths):
        return paths
    for path in paths:
        if path not in folders:
            raise InputError("there is no run here", file=path, allowed="folders of runs, or only .rrd files")
    from afo_sim.simulation.files import RERUN

    present = folders[0] / RERUN
    if len(folders) == 1 and present.is_file() and rate is None and colour == "force":
        return [present]
    from afo_sim.show.rerun import write_comparison, write_rrd

    made = scratch / RERUN
    if len(folders) == 1:
        write_rrd(folders[0], made, rate=rate, colour_by=colour)
    else:
        write_comparison(folders, made, rate=rate)
    return [made]


@app.command("figure")
def figure_command(
    folder: Annotated[pathlib.Path, typer.Argument(help="a run's folder")],
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; the run's own by default")
    ] = None,
) -> None:
    """Publication figures of a run: angle, torque, pressure, force against contraction (PNG and PDF)."""
    with progress("drawing"):
        from afo_sim.common.writing import check_writable
        from afo_sim.show.run_figure import write_figures
        from afo_sim.simulation.recording import read_recording

        recording = read_recording(folder)
        target = out or folder
        check_writable(target)
        written = write_figures(recording, target)
    for path in written:
        print(path)


@app.command("report")
def report_command(
    folders: Annotated[list[pathlib.Path], typer.Argument(help="folders of runs; compared with the first")],
    out: Annotated[
        pathlib.Path | None, typer.Option(help="HTML file; report.html in the first run's folder by default")
    ] = None,
) -> None:
    """One HTML file of a run, or of several compared: figures, numbers in a clinician's words, sources."""
    with progress("drawing"):
        from afo_sim.show.report import write_report

        remarks: list[str] = []
        written = write_report(folders, out, tell=remarks.append)
    for remark in remarks:
        print(f"note: {remark}", file=sys.stderr)
    print(f"written to {written}; open it in a browser")


@app.command("video")
def video_command(
    folder: Annotated[pathlib.Path, typer.Argument(help="a run's folder")],
    out: Annotated[pathlib.Path, typer.Argument(help="MP4 file to write")],
    rate: Annotated[str, typer.Option(help="pictures a second")] = "30 Hz",
) -> None:
    """A film of a run through MuJoCo's own renderer (needs an OpenGL backend and ffmpeg)."""
    hertz = hertz_of(rate)
    if out.suffix.lower() != ".mp4":
        raise InputError("is no MP4", field="OUT", value=str(out), allowed="a name ending in .mp4")
    with progress("filming") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.show.video import write_video
        from afo_sim.simulation.recording import read_recording

        recording = read_recording(folder)
        check_writable(out.parent)
        write_video(recording, out, rate=hertz, progress=report)
    print(f"written to {out}")


@app.command("check-run")
def check_run_command(
    folder: Annotated[pathlib.Path, typer.Argument(help="a run's folder")],
    checks: Annotated[
        pathlib.Path | None, typer.Argument(help="checks file; the shipped scenario's own by default")
    ] = None,
) -> None:
    """Hold a run against a file of checks; exit code 1 when one fails."""
    with progress("checking"):
        from afo_sim.common import assets
        from afo_sim.simulation.checks import run_checks
        from afo_sim.simulation.recording import read_recording

        recording = read_recording(folder)
        results = run_checks(recording, checks or assets.checks_of(recording.scenario["name"]))
    for result in results:
        print(f"{'good' if result.ok else 'FAILED'}  {result.message}")
    failed = sum(not result.ok for result in results)
    print(f"{len(results) - failed} passed, {failed} failed")
    if failed:
        sys.exit(1)
