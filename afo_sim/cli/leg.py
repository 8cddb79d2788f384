"""Commands on legs: leg import, leg export, attach."""

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from afo_sim.cli.common import app, check_side, leg_app, one_group, picked, print_table, progress, quantity
from afo_sim.cli.common import print_line as print
from afo_sim.common import InputError, Keywords, Mixed, read_text

if TYPE_CHECKING:
    from afo_sim.legs import Attached, Imported


_Forward = Annotated[
    str | None, Option(help='direction in which the foot points, in the file\'s axes: "x", "-y" or "1 0 0"')
]
_Package = Annotated[
    list[Path] | None, Option(help="folder with the URDF file's meshes; repeat the option for several")
]


@dataclass(frozen=True)
class Cut:
    """Options of `leg import`: a model, and which leg of it."""

    file: Annotated[Path, Argument(help="MJCF or URDF file of a leg or a whole body")]
    out: Annotated[Path | None, Option(help="output folder; legs/NAME by default; -: write nothing")] = None
    shank: Annotated[str | None, Option(help="body of the shank; found by its name by default")] = None
    foot: Annotated[str | None, Option(help="body of the foot, or one attached to it")] = None
    ankle: Annotated[str | None, Option(help="hinge of the ankle")] = None
    side: Annotated[str | None, Option(help="right|left: which leg to take")] = None
    zero: Annotated[str | None, Option(help='the hinge\'s coordinate at ankle angle 0, as "0 deg"')] = None
    forward: _Forward = None
    range: Annotated[
        tuple[str, str] | None,
        Option(metavar="FROM TO", help='range of motion, "-50 deg" "30 deg"; the file\'s by default'),
    ] = None
    toes: Annotated[str | None, Option(help="hinge of the toes to keep; other joints are welded")] = None
    body_mass: Annotated[str | None, Option(help='body mass of the person, "72 kg"')] = None
    body_height: Annotated[str | None, Option(help='body height of the person, "1.72 m"')] = None
    package: _Package = None
    name: Annotated[str | None, Option(help="name of the leg; by default that of the folder or file")] = None
    force: Annotated[bool, Option("--force", help="overwrite a leg in the folder")] = False


@leg_app.command("import")
@one_group
def leg_import_command(cut: Cut) -> None:
    """Cut a leg out of your own model. The written folder works in every scenario."""
    check_side(cut.side)
    person: Keywords = {}
    for name, text, unit, low, high in (
        ("body_mass", cut.body_mass, "kg", 10.0, 300.0),
        ("body_height", cut.body_height, "m", 0.5, 2.5),
    ):
        if text is not None:
            person[name] = quantity(f"--{name.replace('_', '-')}", text, unit, at_least=low, at_most=high)
    with progress("reading"):
        from afo_sim.legs import default_folder, import_leg
        from afo_sim.show import draw_leg

        def draw(imported: "Imported", path: Path) -> None:
            draw_leg(imported.leg, f"{imported.name}: {imported.found.side} leg of {cut.file.name}", path)

        imported = import_leg(
            cut.file,
            None if str(cut.out) == "-" else cut.out or default_folder(cut.file, cut.name, cut.side),
            zero=cut.zero,
            range=cut.range,
            **person,
            packages=tuple(cut.package or ()),
            **picked(cut, "shank", "foot", "ankle", "side", "forward", "toes", "name", "force"),
            picture=draw,
        )
    rows = [list(row) for row in imported.rows]
    print_table(f"{imported.name}, from {cut.file.name}", ["", "", "how"], rows)
    for note in imported.notes:
        print(f"note: {note}", file=sys.stderr)
    if imported.folder is not None:
        print(f"written to {imported.folder}; leg.png shows it")
        print(f"next: afo-sim run seated --set leg={shlex.quote(str(imported.folder))}")


@leg_app.command("export")
def leg_export_command(
    source: Annotated[str, Argument(metavar="LEG", help="leg or scenario: a shipped name, or a path")],
    to: Annotated[Path | None, Option(help="(required) URDF file to write")] = None,
    orthosis: Annotated[str | None, Option(help="orthosis worn on it; by default none on a leg")] = None,
    force: Annotated[bool, Option("--force", help="overwrite an existing file")] = False,
) -> None:
    """Write a leg as URDF, with the rigid parts of its orthosis."""
    if to is None:
        raise InputError("is needed", field="--to", allowed="a file, leg.urdf")
    with progress("writing"):
        from afo_sim.legs import export_leg

        exported = export_leg(source, to, orthosis=orthosis, force=force)
    print_table(source, ["", ""], [list(row) for row in exported.rows])
    for note in exported.notes:
        print(f"note: {note}", file=sys.stderr)
    for path in exported.files:
        print(f"written to {path}")


@dataclass(frozen=True)
class _Attachment:
    """Options of `attach`: a model, an orthosis, and where it goes."""

    model: Annotated[Path, Argument(help="MJCF or URDF file of a whole model, or the name of a shipped leg")]
    orthosis: Annotated[str, Option(help="name of a shipped orthosis, or its TOML file or folder")]
    joint: Annotated[str | None, Option("--joint", "--ankle", help="hinge; an ankle's is found")] = None
    proximal: Annotated[str | None, Option("--proximal", "--shank", help="body above the joint")] = None
    distal: Annotated[str | None, Option("--distal", "--foot", help="body that carries the plate")] = None
    side: Annotated[str | None, Option(help="right|left, if the model has both")] = None
    zero: Annotated[str | None, Option(help='coordinate of the hinge at joint angle 0; "0 deg"')] = None
    sign: Annotated[int | None, Option(help="1|-1: whether flexion increases the coordinate")] = None
    forward: _Forward = None
    package: _Package = None
    supply: Annotated[str, Option(help="gauge pressure before the inlet valves")] = "4 bar"
    timestep: Annotated[str | None, Option(help='time step, such as "1 ms"; the model\'s by default')] = None
    prefix: Annotated[str, Option(help="prefix of all added names")] = "afo_"
    out: Annotated[Path | None, Option(help="output file or plugin folder; MODEL_ORTHOSIS.xml")] = None
    to: Annotated[str | None, Option(help="plugin: write a folder that MuJoCo runs without afo_sim")] = None
    mjb: Annotated[bool, Option("--mjb", help="also write MuJoCo's binary model with all parameters")] = False
    force: Annotated[bool, Option("--force", help="overwrite existing files")] = False


@app.command("attach")
@one_group
def attach_command(worn: _Attachment) -> None:
    """Put an orthosis on a joint of a whole MuJoCo or URDF model. Step it from Python or in MuJoCo alone.

    XX may be given again, for another joint.
    """
    check_side(worn.side)
    model, name = worn.model, Path(worn.orthosis).stem
    if worn.to not in (None, "plugin") or (worn.to and worn.mjb):
        raise InputError("is not possible here", field="--to", value=worn.to, allowed="plugin, without --mjb")
    out = worn.out or Path(f"{model.stem}_{name}{'.xml' if not worn.to else '_plugin'}")
    out = out / "model.xml" if worn.to else out
    ours = _is_written(model)
    if not ours and model.exists() and out.exists() and out.samefile(model):
        problem = "is the model that is read, and holds no orthosis of ours"
        raise InputError(problem, field="--out", value=str(out), allowed="another file")
    with progress("attaching"):
        from afo_sim.legs import attach, read_attached, write_attached

        names = ("joint", "proximal", "distal", "side", "sign", "forward", "supply", "timestep", "prefix")
        before: Mixed = read_attached(model) if ours else model
        packages = tuple(worn.package or ())
        found = attach(before, worn.orthosis, zero=worn.zero, packages=packages, **picked(worn, *names))
        if worn.to:
            from afo_sim.export import export_attached

            written = export_attached(found, out.parent, force=worn.force)
        else:
            written = write_attached(found, out, force=worn.force, mjb=worn.mjb)
    _print(found)
    for words in found.told:
        print(f"note: {words}", file=sys.stderr)
    beside = [file for file in written if file.parent != out.parent]
    for file in written:
        if file not in beside:
            print(f"written to {file}")
    if beside:
        print(f"{len(beside)} meshes, pictures and parts are in {out.with_name(f'{out.stem}_files')}")
    in_python = f'in Python: leg = afo_sim.legs.read_attached("{out}")'
    print(f"next: {out.with_name('README.md')} says how it is opened" if worn.to else f"next, {in_python}")


def _is_written(model: Path) -> bool:
    sidecar = model.with_suffix(".toml")
    try:
        return model.suffix == ".xml" and f'model = "{model.name}"' in read_text(sidecar)
    except InputError:
        return False


def _print(found: "Attached") -> None:
    """Print what was found, and the index of each input and state."""
    from afo_sim.common import in_unit

    leg, model, words = found.found, found.model, found.orthosis.words
    carrier = list(found.bodies.values())[1]
    how, way = leg.how.get("sign", "its foot shows it"), "positive" if leg.sign > 0 else "negative"
    axis = ", ".join(f"{x:.3f}" for x in -words.turn * leg.sign * leg.axes[:, 1])
    rows = [
        [words.above, f"{leg.shank} ({leg.how.get('shank', 'above the hinge')})"],
        [words.below, f"{carrier} ({leg.how.get('foot', 'below the hinge')})"],
        [found.orthosis.joint, f"{leg.ankle} ({leg.how.get('ankle', 'given')}), axis {axis} in the world"],
        [words.directions[0], f"{way}, of the hinge's coordinate ({how})"],
        ["side", f"{leg.side} ({leg.how.get('side', 'given')})"],
        ["joints crossed", ", ".join(found.joints)],
        ["supply", f"{in_unit(found.supply, 'Pa', 'bar'):g} bar"],
        ["time step", f"{in_unit(float(model.opt.timestep), 's', 'ms'):g} ms"],
        ["ctrl, model's own", f"0 to {found.own_controls.stop - 1}" if found.own_controls.stop else "none"],
        ["userdata", f"{found.userdata} to {model.nuserdata - 1}"],
    ]
    print_table(f"{found.orthosis.name} on {leg.shank} and {carrier}", ["", ""], rows)
    kinds = {
        "network": (found.ids.networks, "0: do not write"),
        "muscle": (found.muscles, "do not write"),
        "chamber": (found.chambers, "supply, gauge [Pa]"),
        "valve": (found.valves, "1 with current, else 0"),
        "friction": (found.ids.frictions, "none"),
    }
    added = []
    for kind, (ids, ctrl) in kinds.items():
        for number in ids.values():
            first, count = int(model.actuator_actadr[number]), int(model.actuator_actnum[number])
            act = f"{first} to {first + count - 1}" if count > 0 and first >= 0 else ""
            added.append([model.actuator(number).name, kind, str(number), act, ctrl])
    print_table(f"{len(added)} actuators added", ["actuator", "kind", "ctrl", "act", "what ctrl is"], added)
