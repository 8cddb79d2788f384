"""Command that exports the electronics: electronics."""

from pathlib import Path
from typing import Annotated

import typer
from typer import Option

from afo_sim.cli.common import Scenario, Sets, app, print_table, progress, quantity, read_sets, short_lived
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_same
from afo_sim.common import InputError, JsonDict

_JSON, _COMMANDS = "electronics.json", "commands.csv"
_FILES = (_JSON, "valves/valves.h", "valves/valves.ino", "host.c", _COMMANDS, "inputs.csv")


@app.command("electronics")
def electronics_command(
    scenario: Scenario,
    sets: Sets = None,
    out: Annotated[Path | None, Option(help="output folder; runs/<scenario>-electronics by default")] = None,
    read: Annotated[
        Path | None,
        Option(metavar="CSV", help="instead of exporting: compare a switching log with the simulation"),
    ] = None,
    firmware: Annotated[
        Path | None,
        Option(metavar="PATH", help="instead of exporting: run this C code in the control loop and compare"),
    ] = None,
    within: Annotated[str, Option(help="largest time difference that a comparison accepts")] = "1 ms",
    force: Annotated[bool, Option("--force", help="overwrite the export of another scenario")] = False,
) -> None:
    """Export timer or state machine as C for a board. Or compare a log of the board with the simulation."""
    values = read_sets(sets)
    given = {"out": out, "read": read, "firmware": firmware}
    named = [name for name, path in given.items() if path is not None]
    if len(named) > 1:
        problem = f"does not go with --{named[1]}"
        raise InputError(problem, field=named[0], value=str(given[named[0]]), allowed="one of the two")
    passed = quantity("--within", within, "s", at_least=0.0, at_most=10.0)
    short_lived()
    compared = read or firmware
    if compared is not None:
        _compare(scenario, values, compared, passed, in_loop=compared is firmware)
        return
    with progress("reading the files, compiling the muscles") as report:
        from afo_sim.common import as_stored, together, write_json, write_sealed, write_text
        from afo_sim.description import load
        from afo_sim.export import board_of, commanded, header, host, notes, sketch

        description = load("scenario", scenario, values or None)
        folder = out or Path("runs") / f"{description.name}-electronics"
        board = board_of(description)
        now, problem = {"scenario": description.resolved()}, "holds the export of another scenario"
        check_same(folder, "export for a board", _JSON, now, problem, force=force)
        found = commanded(description, report)
        texts = {
            "valves/valves.h": header(board),
            "valves/valves.ino": sketch(board),
            "host.c": host(board),
        } | ({"inputs.csv": found.inputs_text()} if len(found.times) else {})
        with together(folder, _FILES) as scratch:
            for name, text in texts.items():
                write_text(scratch / name, text)
            write_json(scratch / _JSON, as_stored(now, folder), "electronics")
            write_sealed(scratch / _COMMANDS, found.log.text(), "commands")
    for note in notes(board):
        print(note)
    for each in board.inputs:
        if each.scale is None:
            print(f"note: {each.column} has no calibration; enter scale and offset in valves.ino")
    print(f"written to {folder}: {', '.join((_JSON, *texts, _COMMANDS))}")
    played = "inputs.csv" if len(found.times) else f"{found.log.end:g}"
    print(f"check it with: cc -std=c99 -o host host.c && ./host {played} > host.csv")


def _compare(scenario: str, values: JsonDict, file: Path, within: float, *, in_loop: bool) -> None:
    """Compare a log, or firmware in the loop, with the simulation; exit code 1 where they differ."""
    with progress("reading the files, compiling the muscles") as report:
        from afo_sim.control import differences, read_log
        from afo_sim.description import load
        from afo_sim.export import Firmware, board_of, commanded
        from afo_sim.simulation import run_controlled

        description = load("scenario", scenario, values or None)
        if in_loop:
            firmware = Firmware(file, list(description.orthosis.chamber))
            rate = description.controller.rate if description.controller else 1.0 / description.timestep
            recording = run_controlled(description, firmware, rate, progress=report)
            if not recording.ok:
                raise InputError(f"there is nothing to compare: {recording.status}", field="--firmware")
            log = firmware.log
        else:
            log = read_log(file, board_of(description).chambers)
        if log.end <= 0.0:
            problem = "ends at 0 ms: there is nothing to compare"
            raise InputError(problem, file=file, field="time_ms", allowed="a log that goes on")
        simulated = commanded(description, report).log
        found = differences(log, simulated, within)
    rows = [
        [d.chamber, *(str(count) for count in d.counts), f"{1e3 * d.largest:.3f}", "yes" if d.first else "no"]
        for d in found
    ]
    header = ["chamber", "switchings", "simulated", "largest difference [ms]", "differs"]
    print_table(f"{file} against {description.name}", header, rows)
    end = min(log.end, simulated.end)
    print(f"compared over {end:.3f} s; the log lasts {log.end:.3f} s, the simulation {simulated.end:.3f} s")
    for difference in found:
        if difference.first:
            print(f"{difference.chamber}: first difference: {difference.first}")
    if any(d.first for d in found):
        print(f"they differ by more than {1e3 * within:g} ms")
        raise typer.Exit(1)
    print(f"they switch at the same times, within {1e3 * within:g} ms")
