"""The command line: reads options, calls the library, prints. Heavy imports wait for their command."""

import json
import pathlib
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from afo_sim.errors import AfoSimError, InputError, nearest_name

app = typer.Typer(
    name="afo-sim",
    help="Simulate ankle-foot orthoses with pneumatic artificial muscles.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
gait_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
app.add_typer(gait_app, name="gait", help="Bring your own walking data, and look at it.")
LISTS = ("muscles", "laws", "scenarios", "legs", "orthoses", "valves", "patients", "gaits")

Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help='for example supply.pressure="3 bar"'),
]
Rate = Annotated[str | None, typer.Option(help='samples a second in the Rerun file, for example "200 Hz"')]
Scenario = Annotated[str, typer.Argument(help="a shipped scenario's name, or a TOML file")]


def main() -> None:
    """Run a command; turn what went wrong into one message and an exit code."""
    try:
        app()
    except AfoSimError as error:
        print(f"afo-sim: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        sys.exit(0)
    except KeyboardInterrupt:
        print("afo-sim: stopped", file=sys.stderr)
        sys.exit(130)


@app.command()
def run(
    scenario: Scenario = "seated",
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; runs/<scenario> by default")
    ] = None,
    sets: Sets = None,
    rrd: Annotated[bool, typer.Option("--rrd/--no-rrd", help="write recording.rrd")] = True,
    rate: Rate = None,
    live: Annotated[bool, typer.Option("--live", help="watch in the Rerun viewer while it runs")] = False,
) -> None:
    """Simulate one scenario; without an argument, the seated solenoid-timer test."""
    values = read_sets(sets)
    hertz = None if rate is None else _rate(rate)
    with _watching(live) as watch, _progress("reading, compiling the muscles") as report:
        from afo_sim.model import build
        from afo_sim.reader import load
        from afo_sim.simulate import run_built
        from afo_sim.writing import check_writable

        built = build(load("scenario", scenario, values))
        folder = out or pathlib.Path("runs") / built.scenario.name
        check_writable(folder)
        recording = run_built(built, progress=report, watch=watch)
        recording.save(folder, rrd=rrd, rate=hertz)
        _print_run(recording, folder)
    if not recording.ok:
        print(f"afo-sim: {recording.status.removeprefix('failed: ')}", file=sys.stderr)
        sys.exit(3)


@app.command("torque-map")
def torque_map_command(
    scenario: Scenario = "seated",
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/torque-map"),
    sets: Sets = None,
    angle: Annotated[tuple[str, str, str], typer.Option(help="from, to, step", metavar="FROM TO STEP")] = (
        "-20 deg",
        "25 deg",
        "1 deg",
    ),
    pressure: Annotated[
        list[str] | None, typer.Option(help="gauge pressure; may be given several times")
    ] = None,
) -> None:
    """Torque necessary against torque available: ankle angle × pressure → orthosis torque."""
    values = read_sets(sets)
    start, stop, step = (_quantity("--angle", text, "rad") for text in angle)
    pressures = [_quantity("--pressure", p, "Pa") for p in pressure or ["1 bar", "2 bar", "3 bar", "4 bar"]]
    if not (step > 0.0 and stop > start) or (stop - start) / step > 2000:
        raise InputError("is no range", field="--angle", value=" ".join(angle), allowed="FROM < TO, STEP > 0")
    for text, value in zip(pressure or [], pressures, strict=False):
        if not 0.0 <= value <= 2e6:
            raise InputError("is out of range", field="--pressure", value=text, allowed="0 bar to 20 bar")
    with _progress("computing torques"):
        import numpy as np

        from afo_sim import torque_map as tm
        from afo_sim.model import build
        from afo_sim.reader import load
        from afo_sim.writing import check_writable, replacing

        built = build(load("scenario", scenario, values))
        check_writable(out)
        angles = start + step * np.arange(int((stop - start) / step + 1.0 + 1e-9))
        supply = built.scenario.supply.pressure
        tm.require_angles(built, angles)
        maps = tm.torque_map(built, angles, np.array(sorted({*pressures, supply})))
        warnings = tm.limit_warnings(built, maps)
        title = f"{built.scenario.orthosis.name} on {built.scenario.leg.name}: static torque"
        with replacing(out / "torque_map.csv") as path:
            tm.write_csv(maps, path)
        for suffix in ("png", "pdf"):
            with replacing(out / f"torque_map.{suffix}") as path:
                tm.draw(maps, path, title, suffix)
        answers = tm.answer(maps, supply)
    _print_torque_maps(maps, answers, supply, out)
    for warning in warnings:
        print(f"warning: {warning}")


@app.command()
def fit(
    files: Annotated[list[pathlib.Path], typer.Argument(help="CSV of measured points, one per muscle")],
    law: Annotated[str, typer.Option(help="a law's name, or all")],
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/fit"),
    hold_out: Annotated[
        str, typer.Option(help="what is left out in turn: all|none|pressure|load|curve|muscle")
    ] = "all",
    test: Annotated[
        list[pathlib.Path] | None, typer.Option(help="further CSV that is predicted, not fitted")
    ] = None,
    free: Annotated[list[str] | None, typer.Option(help="a parameter to fit as well")] = None,
    fix: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="a parameter to hold")] = None,
    tell: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help='what the CSV does not say, for example bore="20 mm"'),
    ] = None,
    loss: Annotated[
        str, typer.Option(help="linear|soft_l1|huber|cauchy; the last three bear outliers")
    ] = "linear",
    like: Annotated[str, typer.Option(help="muscle to take from what the data do not tell")] = "s1_215mm",
) -> None:
    """Fit a muscle's law to measured points; say what the data do not tell."""
    with _progress("reading") as report:
        from afo_sim import fit_command
        from afo_sim.writing import check_writable

        check_writable(out)
        asked = fit_command.Request(
            tuple(files),
            tuple(test or ()),
            law,
            hold_out,
            tuple(free or ()),
            read_sets(fix, "--fix", "k=1"),
            read_sets(tell, "--tell", 'bore="20 mm"'),
            loss,
            like,
        )
        answer = fit_command.answer(asked, report=lambda text: report(0, 0, text))
        fit_command.write(answer, out, like)
    for title, header, rows in fit_command.tables(answer):
        _print_table(title, header, rows)
    for line in fit_command.remarks(answer):
        print(line)
    print(f"written to {out}")


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
    moment = None if at is None else _quantity("--at", at, "s")
    hertz = None if rate is None else _rate(rate)
    if picture is not None and picture.suffix.lower() != ".png":
        raise InputError(
            "is no PNG", field="--screenshot", value=str(picture), allowed="a name ending in .png"
        )
    with tempfile.TemporaryDirectory() as scratch, _progress("reading the run"):
        from afo_sim.writing import check_writable, replacing

        files = _rerun_files(paths, pathlib.Path(scratch), hertz, colour)
        from afo_sim import view as viewer

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
    from afo_sim.run_files import RERUN

    present = folders[0] / RERUN
    if len(folders) == 1 and present.is_file() and rate is None and colour == "force":
        return [present]
    from afo_sim.view import write_comparison, write_rrd

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
    with _progress("drawing"):
        from afo_sim.figure import write_figures
        from afo_sim.run_files import read_recording
        from afo_sim.writing import check_writable

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
    with _progress("drawing"):
        from afo_sim.report import write_report

        written = write_report(folders, out)
    print(f"written to {written}; open it in a browser")


@app.command("video")
def video_command(
    folder: Annotated[pathlib.Path, typer.Argument(help="a run's folder")],
    out: Annotated[pathlib.Path, typer.Argument(help="MP4 file to write")],
    rate: Annotated[str, typer.Option(help="pictures a second")] = "30 Hz",
) -> None:
    """A film of a run through MuJoCo's own renderer (needs an OpenGL backend and ffmpeg)."""
    hertz = _rate(rate)
    if out.suffix.lower() != ".mp4":
        raise InputError("is no MP4", field="OUT", value=str(out), allowed="a name ending in .mp4")
    with _progress("filming") as report:
        from afo_sim.run_files import read_recording
        from afo_sim.video import write_video
        from afo_sim.writing import check_writable

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
    with _progress("checking"):
        from afo_sim import assets
        from afo_sim.checks_file import run_checks
        from afo_sim.run_files import read_recording

        recording = read_recording(folder)
        results = run_checks(recording, checks or assets.checks_of(recording.scenario["name"]))
    for result in results:
        print(f"{'good' if result.ok else 'FAILED'}  {result.message}")
    failed = sum(not result.ok for result in results)
    print(f"{len(results) - failed} passed, {failed} failed")
    if failed:
        sys.exit(1)


@app.command("validate")
def validate_command(
    as_json: Annotated[bool, typer.Option("--json", help="every row, cells too, as a JSON list")] = False,
    figures: Annotated[
        pathlib.Path | None, typer.Option(help="folder for S1's and S3's figures, redrawn")
    ] = None,
) -> None:
    """Every published number of the four papers against simulation; exit code 1 when one is missed."""
    with _progress("comparing with the papers") as report:
        from afo_sim import validate as v
        from afo_sim.writing import check_writable

        if figures is not None:
            check_writable(figures, "--figures")
        rows = v.validate(report)
        written = []
        if figures is not None:
            from afo_sim.validate_figures import write_figures

            written = write_figures(figures)
    if as_json:
        print(json.dumps([v.record(row) for row in rows], indent=1, ensure_ascii=False))
    else:
        _print_table("published and simulated", list(v.HEADER), v.table(rows), droppable=v.SOURCING)
        print("\n".join([v.LEGEND, "", *v.remarks(rows), "", v.verdict(rows)]))
    for path in written:
        print(path, file=sys.stderr if as_json else sys.stdout)
    if not all(row.passed for row in rows):
        sys.exit(1)


@app.command("list")
def list_command(
    what: Annotated[str, typer.Argument(help="|".join(LISTS))] = "",
) -> None:
    """What there is, with one line each."""
    if what and what not in LISTS:
        raise InputError(
            "cannot be listed",
            field="list",
            value=what,
            allowed=", ".join(LISTS),
            nearest=nearest_name(what, LISTS),
        )
    from afo_sim.catalogue import entries

    for kind in [what] if what else LISTS:
        rows = [list(row) for row in entries(kind)]
        _print_table(kind, ["name", "what it is"], rows or [["–", "none is shipped yet"]])


@app.command()
def check(
    file: Annotated[pathlib.Path, typer.Argument(help="a TOML description, MJCF, URDF or gait CSV")],
) -> None:
    """Doctor for your own files: says what is wrong, or what was understood."""
    with _progress("checking"):
        from afo_sim.check import check_file

        findings = check_file(file)
    _print_table(str(file), ["", "found"], [list(row) for row in findings])
    print("good")


@gait_app.command("import")
def gait_import_command(
    files: Annotated[list[pathlib.Path], typer.Argument(help=".mot, .sto, .trc, .c3d of one trial")],
    out: Annotated[pathlib.Path, typer.Option(help="CSV to write; a picture of the same name goes with it")],
    mass: Annotated[str | None, typer.Option(help='of the body, for example "72 kg"')] = None,
    side: Annotated[str, typer.Option(help="right|left")] = "right",
    stride: Annotated[int | None, typer.Option(help="which stride; the first found by default")] = None,
    marker: Annotated[
        list[str] | None,
        typer.Option(metavar="ROLE=NAME[,NAME]", help="hip, knee, ankle, heel or toe; the midpoint of two"),
    ] = None,
    plate: Annotated[list[str] | None, typer.Option(help="force plate to look at; all by default")] = None,
    forward: Annotated[str | None, typer.Option(help="axis of walking: x, -x, y, …")] = None,
    up: Annotated[str | None, typer.Option(help="axis upward")] = None,
    angles: Annotated[str | None, typer.Option(help="deg|rad, where the header is silent or wrong")] = None,
    belt_speed: Annotated[str, typer.Option(help="of the treadmill")] = "0 m/s",
    cutoff: Annotated[str, typer.Option(help="of the low-pass; 0 Hz leaves the data alone")] = "6 Hz",
    thigh: Annotated[str | None, typer.Option(help="hip to knee, if no file has the ankle's place")] = None,
    shank: Annotated[str | None, typer.Option(help="knee to ankle, likewise")] = None,
    hip: Annotated[
        tuple[str, str] | None, typer.Option(help="hip from the pelvis' origin", metavar="FORWARD UP")
    ] = None,
    ankle_height: Annotated[str | None, typer.Option(help="above the floor, foot flat")] = None,
    ankle_zero: Annotated[str, typer.Option(help="flat (foot level where flat) or file")] = "flat",
    source: Annotated[str, typer.Option(help="where the data come from")] = "",
    licence: Annotated[str, typer.Option(help="what one may do with them")] = "not stated",
) -> None:
    """Cut one stride from a walking trial, and write it as gait CSV with a picture of what was understood."""
    given = {name: value for name, value in locals().items() if name not in ("files", "out")}
    with _progress("reading the trial"):
        from afo_sim.gait_readers.importing import import_to
        from afo_sim.gait_readers.options import read_options

        done, picture = import_to(out, files, read_options(given))
    _print_table(str(out), ["what", "found"], [list(row) for row in done.findings()])
    print(f"written to {out}; look at {picture} before you believe it")


@gait_app.command("show")
def gait_show_command(
    gait: Annotated[str, typer.Argument(help="a gait CSV, or a shipped name")],
    out: Annotated[pathlib.Path | None, typer.Option(help="picture to write: .png, .pdf or .svg")] = None,
) -> None:
    """The key numbers of a gait cycle, and its picture."""
    with _progress("reading"):
        from afo_sim import assets
        from afo_sim.gait import read
        from afo_sim.gait_checks import findings
        from afo_sim.gait_figure import draw_gait
        from afo_sim.writing import check_writable

        cycle = read(assets.find_gait(gait))
        if out is not None:
            check_writable(out.parent)
            draw_gait(cycle, out)
    _print_table(gait, ["what", "found"], [list(row) for row in findings(cycle)])
    if out is not None:
        print(f"written to {out}")


def read_sets(
    sets: list[str] | None, field: str = "--set", example: str = 'supply.pressure="3 bar"'
) -> dict[str, Any]:
    """`--set key=value` options as dotted keys and values; a value is TOML, or else plain text."""
    values: dict[str, Any] = {}
    for text in sets or []:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise InputError("is not KEY=VALUE", field=field, value=text, allowed=example)
        try:
            values[key.strip()] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            values[key.strip()] = value.strip()
    return values


def _rate(text: str) -> float:
    hertz = _quantity("--rate", text, "Hz")
    if hertz <= 0.0:
        raise InputError("is out of range", field="--rate", value=text, allowed="more than 0 Hz")
    return hertz


@contextmanager
def _watching(live: bool) -> Iterator[Any]:
    """What watches a run grow: a viewer, or nobody."""
    if not live:
        yield None
        return
    from afo_sim.view.live import live_viewer

    with live_viewer() as watch:
        yield watch


def _quantity(field: str, text: str, unit: str) -> float:
    from afo_sim.units import parse_quantity

    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=field, value=text) from None


@contextmanager
def _progress(title: str) -> Iterator[Callable[..., None]]:
    """A line on the terminal that moves while something takes time, and then goes away."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=None)

        def report(done: int, total: int, what: str = "simulating") -> None:
            progress.update(task, description=what, completed=done, total=total or None)

        yield report


def _print_table(title: str, header: list[str], rows: list[list[str]], droppable: int | None = None) -> None:
    """Aligned columns; on a narrow terminal a table of many may drop one."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console()
    if droppable is not None:
        console = Console(width=shutil.get_terminal_size((200, 24)).columns)
        if console.width < 140:
            header = header[:droppable] + header[droppable + 1 :]
            rows = [row[:droppable] + row[droppable + 1 :] for row in rows]
    table = Table(title=escape(title), title_justify="left", title_style="bold", pad_edge=False, box=None)
    for k, name in enumerate(header):
        rigid = k == 0 if len(header) == 2 else droppable is not None and k > 1
        table.add_column(escape(name), overflow="fold", no_wrap=rigid)
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)
    console.print()


def _print_run(recording: Any, folder: pathlib.Path) -> None:
    rows = [[name, f"{m.value:.4g}", m.unit] for name, m in recording.metrics.items()]
    _print_table(recording.scenario["name"], ["metric", "value", "unit"], rows)
    for warning in recording.warnings:
        print(f"warning: {warning}")
    timing = recording.timing
    print(
        f"{timing['steps']} steps in {timing['wall_seconds']:.2f} s "
        f"({timing['steps_per_second'] / 1000:.0f} thousand a second)"
    )
    print(f"written to {folder}; look at it with: afo-sim view {folder}")


def _print_torque_maps(maps: list[Any], answers: dict[str, Any], supply: float, out: pathlib.Path) -> None:
    import numpy as np

    for found in maps:
        chosen = np.unique(np.linspace(0, len(found.angles) - 1, 10).round().astype(int))
        header = ["angle [deg]", *(f"{p * 1e-5:g} bar" for p in found.pressures)]
        rows = [
            [f"{np.degrees(found.angles[k]):.0f}", *(f"{t:.2f}" for t in found.torque[k])] for k in chosen
        ]
        _print_table(f"{found.chamber}: orthosis torque [N·m], dorsiflexion +", header, rows)
    for chamber, needs in answers.items():
        for need, span in needs.items():
            reach = (
                "nowhere"
                if span is None
                else f"from {np.degrees(span[0]):.0f} to {np.degrees(span[1]):.0f} deg"
            )
            print(f"{chamber}: enough for {need} {reach}, at the supply's {supply * 1e-5:g} bar")
    print(f"written to {out}")
