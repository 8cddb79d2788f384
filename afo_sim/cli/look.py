"""Commands on finished runs and designs: view, figure, report, video, recover, check-run, draw, export."""

import functools
import sys
import tempfile
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from afo_sim.cli.common import Rate, Sets, app, hertz_of, progress, quantity, read_sets
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import KNOWN_BY, check_folder
from afo_sim.common import InputError, unknown

_FORMATS = "sto|mot|csv|mat|mjb|plugin|c|fmu"
_STUDIES = {
    "sweep": "a run's folder: afo-sim replay DIR CASE makes one of a case; results.parquet has all",
    "search": "a run's folder: afo-sim run DIR/best.toml makes one of the best design",
}


@app.command()
def view(
    paths: Annotated[list[Path], Argument(help="run folders, or .rrd files")],
    picture: Annotated[
        Path | None,
        Option("--screenshot", help="write a PNG file instead of opening the viewer; needs no display"),
    ] = None,
    at: Annotated[str | None, Option(help='time shown in the screenshot, for example "2.5 s"')] = None,
    rate: Rate = None,
    colour: Annotated[str, Option(help="muscles are coloured by: force|pressure")] = "force",
) -> None:
    """Open one or several runs in the Rerun viewer."""
    if colour not in ("force", "pressure"):
        raise InputError("is not a valid choice", field="--colour", value=colour, allowed="force, pressure")
    if at is not None and picture is None:
        raise InputError("goes with --screenshot", field="--at", value=at)
    moment = None if at is None else quantity("--at", at, "s")
    hertz = None if rate is None else hertz_of(rate)
    if picture is not None and picture.suffix.lower() != ".png":
        allowed = "a name ending in .png"
        raise InputError("is not a PNG file", field="--screenshot", value=str(picture), allowed=allowed)
    with tempfile.TemporaryDirectory() as scratch, progress("reading the run"):
        from afo_sim.common import check_writable, replacing

        files = _rerun_files(paths, Path(scratch), hertz, colour)
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


def _rerun_files(paths: list[Path], scratch: Path, rate: float | None, colour: str) -> list[Path]:
    """The Rerun files to show: those given, a new one, or one made from several runs."""
    folders = [path for path in paths if path.is_dir()]
    if not folders and all(path.is_file() and path.suffix == ".rrd" for path in paths):
        return paths
    for path in paths:
        if path not in folders:
            raise InputError("there is no run here", file=path, allowed="folders of runs, or only .rrd files")
    from afo_sim.simulation import RERUN, intact_picture

    present = intact_picture(folders[0])
    if len(folders) == 1 and present and rate is None and colour == "force":
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
    folder: Annotated[Path, Argument(help="a run's folder")],
    out: Annotated[Path | None, Option(help="output folder; the run's own by default")] = None,
) -> None:
    """Write publication figures of a run as PNG and PDF. They show angle, torque, pressure and force."""
    with progress("drawing"):
        from afo_sim.common import check_writable
        from afo_sim.show.run_figure import write_figures
        from afo_sim.simulation import read_recording

        recording = read_recording(folder)
        target = out or folder
        check_writable(target)
        written = write_figures(recording, target)
    for path in written:
        print(path)


@app.command("report")
def report_command(
    folders: Annotated[
        list[Path], Argument(help="run folders, compared with the first; or one of both legs")
    ],
    out: Annotated[Path | None, Option(help="HTML file to write; report.html in the first run")] = None,
) -> None:
    """Write an HTML report of one run, or of several compared. It has verdict, figures, numbers, sources."""
    with progress("drawing"):
        from afo_sim.show import write_report

        remarks: list[str] = []
        written = write_report(folders, out, tell=remarks.append)
    for remark in remarks:
        print(f"note: {remark}", file=sys.stderr)
    print(f"written to {written}; open it in a browser")


@app.command("video")
def video_command(
    folders: Annotated[list[Path], Argument(help="one run folder, or those of two or three walks")],
    out: Annotated[Path, Argument(help="MP4 file to write")],
    rate: Annotated[str, Option(help="frames per second")] = "25 Hz",
    stride: Annotated[int | None, Option(help="number of a walk's stride; by default settled")] = None,
    slow: Annotated[float | None, Option(help="slow-motion factor; by default 4, seated 1")] = None,
    reference: Annotated[bool, Option(help="show the walk without the device beside a single walk")] = True,
) -> None:
    """Film a stride of one to three walks, or a seated run. Needs an OpenGL backend and ffmpeg."""
    hertz = hertz_of(rate)
    if out.suffix.lower() != ".mp4":
        raise InputError("is not an MP4 file", field="OUT", value=str(out), allowed="a name ending in .mp4")
    with progress("filming") as report:
        from afo_sim.common import check_writable
        from afo_sim.show import write_video
        from afo_sim.simulation import read_recording

        names = [folder.resolve().name for folder in folders]
        names = [name if names.count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(names)]
        runs = dict(zip(names, map(read_recording, folders), strict=True))
        check_writable(out.parent)
        told = functools.partial(report, what="filming")
        shown = runs if len(runs) > 1 else runs[names[0]]
        chosen = functools.partial(write_video, stride=stride, slow=slow, reference=reference, rate=hertz)
        titles = chosen(shown, out, progress=told)
    print(f"written to {out}" + (f": {' | '.join(titles)}" if titles else ""))


@app.command("recover")
def recover_command(
    folder: Annotated[Path, Argument(help="folder of a damaged run or sweep")],
    out: Annotated[
        Path | None,
        Option(help="output folder for the intact part of a run; by default its name with -recovered"),
    ] = None,
) -> None:
    """Save the intact part of a damaged run or sweep. The sweep can then be continued."""
    with progress("reading"):
        from afo_sim.simulation import recover_recording
        from afo_sim.study import SWEEP, recover

        if (folder / SWEEP.manifest).is_file():
            whole, planned = recover(folder)
            print(f"{whole} of {planned} cases are whole; the same sweep into {folder} computes the others")
            return
        recording = recover_recording(folder)
        target = out or folder.with_name(f"{folder.name}-recovered")
        check_folder(target)
        recording.save(target, rrd=False)
    print(f"{recording.warnings[-1]}\nwritten to {target}")


@app.command("check-run")
def check_run_command(
    folder: Annotated[Path, Argument(help="a run's folder")],
    checks: Annotated[Path | None, Argument(help="checks file; the shipped scenario's by default")] = None,
) -> None:
    """Test a run against a file of checks. Exit code 1 if one fails."""
    with progress("checking"):
        from afo_sim.common import assets
        from afo_sim.simulation import read_recording, run_checks

        recording = read_recording(folder)
        results = run_checks(recording, checks or assets.checks_of(recording.described["name"]))
    for result in results:
        print(f"{'good' if result.ok else 'FAILED'}  {result.message}")
    failed = sum(not result.ok for result in results)
    print(f"{len(results) - failed} passed, {failed} failed")
    if failed:
        sys.exit(1)


@app.command()
def draw(
    orthosis: Annotated[str, Argument(help="shipped orthosis or scenario, or its TOML file or folder")],
    leg: Annotated[
        str | None, Option(help="shipped leg, or its TOML file; the scenario's by default")
    ] = None,
    pressure: Annotated[
        str | None, Option(help='pressure, such as "4 bar"; the supply\'s by default')
    ] = None,
    out: Annotated[
        list[Path] | None,
        Option(
            help="file to write (png, pdf, svg; a design also rrd); repeat for several; NAME-design.pdf or "
            "NAME-air.pdf by default"
        ),
    ] = None,
    view: Annotated[str, Option(help='"design", or "air": schematic of the air path')] = "design",
    force: Annotated[bool, Option("--force", help="overwrite existing files")] = False,
) -> None:
    """Draw an orthosis to scale, and its muscles over the angle.

    With --view air: a schematic of its air path, with the narrowest part on the way to each muscle.
    """
    full = None if pressure is None else quantity("--pressure", pressure, "Pa", above=0.0, at_most=2e6)
    with progress("reading") as report:
        from afo_sim import show
        from afo_sim.model.design import design

        if view not in show.VIEWS:
            raise unknown(view, show.VIEWS, field="--view", problem="is not a valid view")
        air = view == show.AIR
        if air:
            show.refuse_leg(leg, "--leg")
        show.check_files(out or [], force=force, view=view)
        if air:
            scheme = show.scheme_of(orthosis, full)
            name, lines, write = scheme.name, show.ways(scheme), functools.partial(show.write_air, scheme)
        else:
            found = design(orthosis, leg=leg, pressure=full)
            name = found.built.scenario.orthosis.name or "orthosis"
            lines = [f"warning: {warning}" for warning in found.warnings]
            write = functools.partial(show.write_drawing, found)
        paths = list(out or [Path(f"{name}-{view}.pdf")])
        show.check_files(paths, force=force, view=view)
        for done, path in enumerate(paths):
            report(done, len(paths), "drawing")
            write(path)
    for line in lines:
        print(line)
    for path in paths:
        print(f"written to {path}")


@app.command("export")
def export_command(
    what: Annotated[
        str,
        Argument(
            metavar="RUN|SCENARIO", help="run folder or recording.parquet; a scenario for plugin, c, fmu"
        ),
    ],
    to: Annotated[str | None, Option(help=f"{_FORMATS}; by default by the ending of --out")] = None,
    out: Annotated[
        Path | None,
        Option(help="file or folder to write; by default recording.FORMAT beside the run, or NAME_FORMAT"),
    ] = None,
    rate: Annotated[str | None, Option(help='rows per second, such as "200 Hz"; all by default')] = None,
    column: Annotated[
        list[str] | None,
        Option(
            metavar="NAME",
            help='column to export, or a pattern such as "ankle/*" (sto, csv, mat); all by default',
        ),
    ] = None,
    sets: Sets = None,
    force: Annotated[bool, Option("--force", help="overwrite existing files")] = False,
) -> None:
    """Export a run or scenario to other programs. Runs: OpenSim, CSV, MATLAB; scenarios: MuJoCo, C, FMI."""
    hertz = None if rate is None else hertz_of(rate)
    if to is None and out is None:
        raise InputError("is needed", field="--to", allowed=_FORMATS.replace("|", ", "))
    folder = Path(what)
    with progress("reading") as report:
        from afo_sim.export import ELSEWHERE, export, format_of
        from afo_sim.simulation import read_recording

        kind = (to if to is not None else Path(str(out)).suffix).removeprefix(".").lower()
        if kind in ELSEWHERE:
            beside = Path(f"{folder.stem}.fmu" if kind == "fmu" else f"{folder.stem}_{kind}")
        elif out is None:
            beside = (folder if folder.is_dir() else folder.parent) / f"recording.{format_of(to or '').name}"
        for name, study in KNOWN_BY.items():
            if study in _STUDIES and (folder / name).is_file():
                raise InputError(f"holds a {study} ({name})", file=folder, allowed=_STUDIES[study])
        run = kind not in ELSEWHERE or folder.is_dir() or folder.suffix == ".parquet"
        exported = export(
            read_recording(folder) if run else what,
            out or beside,
            to,
            rate=hertz,
            columns=column or (),
            sets=read_sets(sets),
            force=force,
            report=lambda done, total: report(done, total, "writing"),
        )
    for note in exported.notes:
        print(f"note: {note}", file=sys.stderr)
    for file in exported.files:
        print(f"written to {file}")
    print(f"open it with {exported.opens}")
    if exported.minds:
        print(f"note: {exported.minds}")
