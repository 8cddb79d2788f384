"""Commands on walking data: gait import, gait show."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from afo_sim.cli.common import SIDES_HEADER, gait_app, one_group, print_table, progress
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_files
from afo_sim.common import InputError


@dataclass(frozen=True)
class Trial:
    """Options of `gait import`: files of a trial, and facts that they lack."""

    files: Annotated[
        list[Path],
        Argument(
            help="files of one trial (.c3d, .trc, .mot, .sto, .csv, the model's .osim) or an OpenCap folder"
        ),
    ]
    out: Annotated[Path | None, Option(help="(required) CSV to write; a picture goes with it")] = None
    walker: Annotated[
        str | None, Option(metavar="healthy|patient", help="(required) whose walk it is; it is never guessed")
    ] = None
    side: Annotated[
        str | None,
        Option(
            help="right|left|both (the mean of both)|each (NAME_right.csv, NAME_left.csv); by default right, "
            "or, if that has no usable stride, a healthy walker's left"
        ),
    ] = None
    stride: Annotated[
        str | None, Option(metavar="N|mean", help="stride; the first complete one by default")
    ] = None
    mass: Annotated[str | None, Option(help='body mass, "72 kg"; by default of C3D, model or plates')] = None
    height: Annotated[str | None, Option(help='body height, "1.72 m"; by default from the C3D')] = None
    sole: Annotated[
        str | None,
        Option(help='sole thickness under the ankle, "25 mm", or "0 mm" barefoot; unknown by default'),
    ] = None
    model: Annotated[Path | None, Option(help="the person's scaled OpenSim model")] = None
    static: Annotated[Path | None, Option(help="standing trial: .trc, .c3d, .csv")] = None
    map: Annotated[
        Path | None,
        Option("--role", "--map", help="TOML file of the laboratory that assigns markers to landmarks"),
    ] = None
    write_map: Annotated[
        Path | None,
        Option("--write-role", "--write-map", help="write such a TOML file with the guessed assignment"),
    ] = None
    marker: Annotated[
        list[str] | None,
        Option(
            metavar="ROLE=NAME[,NAME]",
            help="marker of hip, knee, ankle, heel or toe; two names: their midpoint",
        ),
    ] = None
    plate: Annotated[list[str] | None, Option(help="force plate to use; all by default")] = None
    forward: Annotated[str | None, Option(help="walking direction: x, -x, y, …; found by default")] = None
    up: Annotated[str | None, Option(help="vertical axis; found by default")] = None
    angles: Annotated[str | None, Option(help="deg|rad: unit of angles if the header is wrong")] = None
    belt_speed: Annotated[str | None, Option(help="treadmill speed; by default from the stance foot")] = None
    cutoff: Annotated[str, Option(help='cut-off of the low-pass, up to "50 Hz"; "0 Hz": no filter')] = "10 Hz"
    thigh: Annotated[
        str | None, Option(help='distance from hip to knee, "43 cm", if no file has the ankle\'s position')
    ] = None
    shank: Annotated[str | None, Option(help='distance from knee to ankle, "43 cm", likewise')] = None
    hip: Annotated[
        tuple[str, str] | None,
        Option(help='hip from the pelvis origin; "-6.3 cm" "-7.2 cm" by default', metavar="FORWARD UP"),
    ] = None
    ankle_height: Annotated[str | None, Option(help='ankle height, foot flat on the floor, "7 cm"')] = None
    ankle_zero: Annotated[
        str, Option(help="zero of the ankle angle: flat (sole level while the foot is flat) or file")
    ] = "flat"
    source: Annotated[str, Option(help="where the data come from")] = ""
    licence: Annotated[str, Option(help="licence of the data")] = "not stated"
    force: Annotated[bool, Option("--force", help="overwrite an existing CSV and picture")] = False


@gait_app.command("import")
@one_group
def gait_import_command(trial: Trial) -> None:
    """Cut one stride from a walking trial into a gait CSV. A picture shows what was read.

    Ground forces are always needed. For the leg, give either markers or joint angles with the model.

    \b
        afo-sim gait import walk.c3d --walker patient --static standing.c3d --out walk.csv
        afo-sim gait import ik.mot grf.mot scaled.osim --walker healthy --out walk.csv

    docs/gait_data.md states which files belong together, and how far to trust each.
    """
    if trial.write_map is not None:
        _write_map(trial.files, trial.write_map)
        return
    if trial.out is None or trial.out.suffix.lower() != ".csv":
        shown = None if trial.out is None else str(trial.out)
        problem = "is missing: the file to write" if trial.out is None else "is not a CSV file"
        allowed = "a name ending in .csv, such as my_walk.csv"
        raise InputError(problem, field="out", value=shown, allowed=allowed)
    if trial.walker is None:
        meaning = "healthy (a sound leg, which a described patient then weakens) or patient (the patient's "
        meaning += "own walk without the device, which the device is added to and nothing weakens again)"
        raise InputError("is missing: state whose walk it is", field="walker", allowed=meaning)
    with progress("reading the trial"):
        from afo_sim.common import check_writable, together
        from afo_sim.gait import asymmetry, write
        from afo_sim.gait_lab import import_gait, import_sides, read_options, ten_lines, verdict
        from afo_sim.show import draw_gait

        asked = {k: v for k, v in vars(trial).items() if k not in ("files", "out", "write_map", "force")}
        choices = read_options(asked)
        check_writable(trial.out.parent)
        names = {side: trial.out.with_stem(f"{trial.out.stem}_{side}") for side in ("right", "left")}
        outs = names.values() if choices.each else [trial.out]
        check_files((out.with_suffix(end) for out in outs for end in (".csv", ".png")), force=trial.force)
        try:
            if choices.each:
                sides = import_sides(trial.files, choices)
                found = {names[side]: done for side, done in sides.items()}
            else:
                found = {trial.out: import_gait(trial.files, choices)}
        except InputError as error:  # where a map of markers would help, say how to get one
            more = "`map`, which `write_map=roles.toml` writes to be edited"
            raise error.replaced(allowed=error.allowed.replace("`map`", more, 1)) from error
        with together(trial.out.parent) as scratch:
            for out, done in found.items():
                draw_gait(done.cycle, (scratch / out.name).with_suffix(".png"), done)
                write(scratch / out.name, done.cycle)
    for out, done in found.items():
        print(verdict(done))
        print_table("", ["", ""], [list(row) for row in ten_lines(done)])
        rows = [[check.fault, check.found, check.limit, check.verdict] for check in done.checks]
        print_table("Is this trial plausible?", ["fault", "found", "limit", ""], rows)
        for warning in done.warnings:
            print(f"warning: {warning}")
        picture = out.with_suffix(".png")
        print(f"written to {out}, walker: {trial.walker}; check the picture {picture} before you use it")
    if choices.each:
        beside = asymmetry(sides["right"].cycle, sides["left"].cycle)
        print_table("right and left compared", SIDES_HEADER, [row.cells for row in beside])


def _write_map(files: list[Path], path: Path) -> None:
    """Write the guessed places of the markers, for correction by hand."""
    with progress("reading the markers"):
        from afo_sim.gait_lab import read_trial, write_role_map

        if path.exists():
            raise InputError("exists already", field="write_map", value=str(path), allowed="another name")
        markers = read_trial(files).markers
        if markers is None:
            names = ", ".join(map(str, files))
            raise InputError("no file holds markers", file=names, allowed="a .trc, .c3d or .csv with markers")
        write_role_map(path, markers)
    print(f"written to {path}; edit it, and give it with --role {path}")


@gait_app.command("show")
def gait_show_command(
    gait: Annotated[str, Argument(help="a gait CSV, or a shipped name")],
    out: Annotated[Path | None, Option(help="picture to write: .png, .pdf or .svg")] = None,
) -> None:
    """Show the key numbers of a gait cycle, and draw it."""
    with progress("reading"):
        from afo_sim.common import assets, check_writable
        from afo_sim.gait import findings
        from afo_sim.gait.file import read
        from afo_sim.show import draw_gait

        cycle = read(assets.find_gait(gait))
        if out is not None:
            check_writable(out.parent)
            draw_gait(cycle, out)
    print_table(gait, ["what", "found"], [list(row) for row in findings(cycle)])
    if out is not None:
        print(f"written to {out}")
