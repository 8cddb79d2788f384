"""Commands that compare with measurement: fit, fit-run, fit-torque, validate."""

import json
import pathlib
import sys
from typing import Annotated, Any

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Sets, print_table, progress, read_sets
from afo_sim.cli.overwriting import check_folder

RUN_FILES = ("fit_run.json", "scenario.toml", "fit_run.png", "fit_run.pdf")
LAW_FILES = ("fit.json", "muscle.toml", "fit.png", "fit.pdf")


@app.command("fit-run")
def fit_run_command(
    log: Annotated[
        pathlib.Path, typer.Argument(help="CSV of your own measurement: time, angle, pressures …")
    ],
    scenario: Annotated[str, typer.Option(help="a shipped scenario's name, or a TOML file")],
    fit: Annotated[
        str, typer.Option(help="parameters with commas between them; none only lays log and run together")
    ] = "",
    sets: Sets = None,
    noise: Annotated[
        list[str] | None, typer.Option(metavar="CHANNEL=VALUE", help='for example angle="0.5 deg"')
    ] = None,
    hold_out: Annotated[
        float, typer.Option(help="share of the log, from its end, to predict; 0 for none")
    ] = 0.3,
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/fit-run"),
) -> None:
    """Fit dynamic parameters of a scenario to your own log; say what the log does not tell."""
    values = read_sets(sets)
    noises = read_sets(noise, "--noise", 'angle="0.5 deg"')
    names = [name.strip() for name in fit.split(",") if name.strip()]
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable, together
        from afo_sim.lab import run_report
        from afo_sim.lab.run_fit import fit_run
        from afo_sim.show.log_figure import write_log_figure

        check_folder(out, "fit to a log")
        check_writable(out)
        found = fit_run(
            scenario,
            log,
            names,
            sets=values,
            noise=noises,
            hold_out=hold_out,
            report=lambda text: report(0, 0, text),
        )
        with together(out, RUN_FILES) as folder:
            run_report.write(found, folder)
            write_log_figure(found, folder)
    for title, header, rows in run_report.tables(found):
        print_table(title, header, rows)
    for line in run_report.remarks(found):
        print(line)
    runnable = bool(names) and found.converged
    hint = f"; run it with: afo-sim run {out / run_report.SCENARIO}" if runnable else ""
    print(f"written to {out}{hint}")


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
    with progress("reading") as report:
        from afo_sim.common.writing import check_writable, together
        from afo_sim.lab import law_result
        from afo_sim.show.fit_figure import write_fit_figure

        check_folder(out, "fit of a muscle's law")
        check_writable(out)
        found = law_result.fit(
            files,
            law=law,
            hold_out=hold_out,
            test=test or (),
            free=free or (),
            fixed=read_sets(fix, "--fix", "k=1"),
            facts=read_sets(tell, "--tell", 'bore="20 mm"'),
            loss=loss,
            like=like,
            report=lambda text: report(0, 0, text),
        )
        with together(out, LAW_FILES) as folder:
            law_result.write(found, folder)
            write_fit_figure(found, folder)
    for title, header, rows in law_result.tables(found):
        print_table(title, header, rows)
    for line in law_result.remarks(found):
        print(line)
    print(f"written to {out}")


@app.command("fit-torque")
def fit_torque_command(
    files: Annotated[
        list[pathlib.Path], typer.Argument(help="CSV of static torque: angle, pressure, torque …")
    ],
    orthosis: Annotated[
        list[str], typer.Option(help="a shipped orthosis or a file; GROUP=ORTHOSIS where groups differ")
    ],
    fit: Annotated[
        str, typer.Option(help="series_stiffness, offset, cuff_stiffness, plate_stiffness, the law's own")
    ] = "series_stiffness,offset",
    hold_out: Annotated[
        list[str] | None,
        typer.Option(help="left out in turn: all|none|group|angle|pressure; or a CSV that is predicted"),
    ] = None,
    chamber: Annotated[str, typer.Option(help="that was filled, where the file does not say")] = "",
    torque: Annotated[
        str, typer.Option(help="device: of the muscles alone; difference: less the readings without air")
    ] = "device",
    rate: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help='of a log\'s still samples, for example angle="2 deg/s"'),
    ] = None,
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/fit-torque"),
) -> None:
    """Fit what gives way on a worn or mounted device to its static torque; say what that does not tell."""
    with progress("reading") as report:
        from afo_sim.common.writing import check_writable, together
        from afo_sim.lab import torque_report
        from afo_sim.lab.torque_fit import fit_torque
        from afo_sim.show.torque_bench import write_torque_figure

        check_folder(out, "fit to static torques")
        check_writable(out)
        found = fit_torque(
            files,
            _orthoses(orthosis),
            [name.strip() for name in fit.split(",") if name.strip()],
            hold_out=hold_out or "all",
            chamber=chamber,
            torque=torque,
            rates=read_sets(rate, "--rate", 'angle="2 deg/s"'),
            report=lambda text: report(0, 0, text),
        )
        with together(out, torque_report.FILES) as folder:
            torque_report.write(found, folder, out)
            write_torque_figure(found, folder)
    for title, header, rows in torque_report.tables(found):
        print_table(title, header, rows)
    for line in torque_report.remarks(found):
        print(line)
    place = out / next(iter(torque_report.folders(found).values()))
    print(f"written to {out}; run it with: afo-sim run --set orthosis={place}")


def _orthoses(texts: list[str]) -> Any:
    """One orthosis, or one for each group."""
    if len(texts) == 1 and "=" not in texts[0]:
        return texts[0]
    return read_sets(texts, "--orthosis", "GROUP=ORTHOSIS, once for each group")


@app.command("validate")
def validate_command(
    as_json: Annotated[bool, typer.Option("--json", help="every row, cells too, as a JSON list")] = False,
    figures: Annotated[
        pathlib.Path | None, typer.Option(help="folder for S1's and S3's figures, redrawn")
    ] = None,
) -> None:
    """Every published number of the four papers against simulation; exit code 1 when one is missed."""
    with progress("comparing with the papers") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.lab import validation as v

        if figures is not None:
            check_writable(figures, "--figures")
        rows = v.validate(report)
        written = []
        if figures is not None:
            from afo_sim.show.validation_figures import write_figures

            written = write_figures(figures)
    if as_json:
        print(json.dumps([v.record(row) for row in rows], indent=1, ensure_ascii=False))
    else:
        print_table("published and simulated", list(v.HEADER), v.table(rows), droppable=v.SOURCING)
        print("\n".join([v.LEGEND, "", *v.remarks(rows), "", v.verdict(rows)]))
    for path in written:
        print(path, file=sys.stderr if as_json else sys.stdout)
    if not all(row.passed for row in rows):
        sys.exit(1)
