"""Commands on legs: leg import, leg export."""

import pathlib
import shlex
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from afo_sim.cli.apps import leg_app
from afo_sim.cli.common import print_table, progress, quantity
from afo_sim.common.errors import InputError, unknown

if TYPE_CHECKING:
    from afo_sim.legs.importing import Imported

SIDES = ("right", "left")


@leg_app.command("import")
def leg_import_command(
    file: Annotated[pathlib.Path, typer.Argument(help="MJCF or URDF, of a leg or of a whole body")],
    out: Annotated[
        pathlib.Path | None, typer.Option(help="the leg's folder; legs/NAME by default, - writes nothing")
    ] = None,
    shank: Annotated[str | None, typer.Option(help="its body; found by its name by default")] = None,
    foot: Annotated[str | None, typer.Option(help="its body, or one that hangs on it")] = None,
    ankle: Annotated[str | None, typer.Option(help="its hinge")] = None,
    side: Annotated[str | None, typer.Option(help="right|left: which leg is meant")] = None,
    zero: Annotated[
        str | None, typer.Option(help="the file's coordinate where the ankle's angle is 0, \"0 deg\"")
    ] = None,
    range: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="FROM TO", help='stops, "-50 deg" "30 deg"; the file\'s by default'),
    ] = None,
    toes: Annotated[str | None, typer.Option(help="hinge of the toes to keep; others are welded")] = None,
    body_mass: Annotated[str | None, typer.Option(help='of the person, "72 kg"')] = None,
    body_height: Annotated[str | None, typer.Option(help='of the person, "1.72 m"')] = None,
    package: Annotated[
        list[pathlib.Path] | None,
        typer.Option(help="folder in which package:// meshes of a URDF lie; may be given again"),
    ] = None,
    name: Annotated[str | None, typer.Option(help="of the leg; by default the folder's or file's")] = None,
    force: Annotated[bool, typer.Option("--force", help="replace a leg that is in the folder")] = False,
) -> None:
    """Cut a leg out of your own model, turn it, and write a folder that every scenario takes."""
    if side is not None and side not in SIDES:
        raise unknown(side, SIDES, field="--side")
    at = None if zero is None else quantity("--zero", zero, "rad")
    stops = None if range is None else tuple(quantity("--range", text, "rad") for text in range)
    mass = _within("--body-mass", body_mass, "kg", 10.0, 300.0)
    height = _within("--body-height", body_height, "m", 0.5, 2.5)
    with progress("reading"):
        from afo_sim.legs.importing import default_folder, import_leg
        from afo_sim.show.leg_picture import draw_leg

        def draw(imported: "Imported", path: pathlib.Path) -> None:
            draw_leg(imported.leg, f"{imported.name}: {imported.found.side} leg of {file.name}", path)

        imported = import_leg(
            file,
            None if str(out) == "-" else out or default_folder(file, name, side),
            shank=shank,
            foot=foot,
            ankle=ankle,
            side=side,  # type: ignore[arg-type]
            zero=at,
            range=stops,  # type: ignore[arg-type]
            toes=toes,
            body_mass=mass,
            body_height=height,
            packages=tuple(package or ()),
            name=name,
            force=force,
            picture=draw,
        )
    print_table(f"{imported.name}, from {file.name}", ["", "", "how"], [list(row) for row in imported.rows])
    for note in imported.notes:
        print(f"note: {note}", file=sys.stderr)
    if imported.folder is not None:
        print(f"written to {imported.folder}; leg.png shows it")
        print(f"next: afo-sim run seated --set leg={shlex.quote(str(imported.folder))}")


def _within(option: str, text: str | None, unit: str, low: float, high: float) -> float | None:
    if text is None:
        return None
    value = quantity(option, text, unit)
    if not low <= value <= high:
        raise InputError("is out of range", field=option, value=text, allowed=f"{low:g} to {high:g} {unit}")
    return value


@leg_app.command("export")
def leg_export_command(
    source: Annotated[
        str, typer.Argument(metavar="LEG", help="a leg or a scenario: a shipped name, or a path")
    ],
    to: Annotated[pathlib.Path | None, typer.Option(help="needed: the .urdf file to write")] = None,
    orthosis: Annotated[str | None, typer.Option(help="worn on it; a leg alone has none by default")] = None,
    force: Annotated[bool, typer.Option("--force", help="replace a file that is there")] = False,
) -> None:
    """Write a leg, with its orthosis' rigid parts, for other programs, as URDF."""
    if to is None:
        raise InputError("is needed", field="--to", allowed="a file, leg.urdf")
    with progress("writing"):
        from afo_sim.legs.exporting import export_leg

        exported = export_leg(source, to, orthosis=orthosis, force=force)
    print_table(source, ["", ""], [list(row) for row in exported.rows])
    for note in exported.notes:
        print(f"note: {note}", file=sys.stderr)
    for path in exported.files:
        print(f"written to {path}")
