"""Command that puts an orthosis on a leg of a whole model: attach."""

import pathlib
import sys
from typing import Annotated, Any

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import print_table, progress, quantity
from afo_sim.common.errors import InputError, unknown

SIDES = ("right", "left")


@app.command("attach")
def attach_command(
    model: Annotated[
        pathlib.Path, typer.Argument(help="MJCF or URDF file of a whole model, or a shipped leg's name")
    ],
    orthosis: Annotated[
        str, typer.Option(help="a shipped orthosis' name, or the path of its TOML file or folder")
    ],
    shank: Annotated[str | None, typer.Option(help="name of its body; sought by default")] = None,
    foot: Annotated[str | None, typer.Option(help="name of the body that wears the plate")] = None,
    ankle: Annotated[str | None, typer.Option(help="name of the hinge between them")] = None,
    side: Annotated[str | None, typer.Option(help="right|left, where both are there")] = None,
    zero: Annotated[
        str | None, typer.Option(help='the hinge where the ankle is at 0, "0 deg" by default')
    ] = None,
    supply: Annotated[str, typer.Option(help="gauge pressure before the inlet valves")] = "4 bar",
    timestep: Annotated[str | None, typer.Option(help='"1 ms"; the model\'s own by default')] = None,
    prefix: Annotated[str, typer.Option(help="of all names that are added")] = "afo_",
    out: Annotated[
        pathlib.Path | None, typer.Option(help="MJCF file to write; MODEL_ORTHOSIS.xml by default")
    ] = None,
    mjb: Annotated[
        bool, typer.Option("--mjb", help="also MuJoCo's binary model, with all parameters")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="replace files that are there")] = False,
) -> None:
    """Put an orthosis on a leg of a whole model, which you then step from Python.

    A model that was written with it may be given again, for the other leg.
    """
    if side is not None and side not in SIDES:
        raise unknown(side, SIDES, field="--side")
    out = out or pathlib.Path(f"{model.stem}_{pathlib.Path(orthosis).stem}.xml")
    angle = None if zero is None else quantity("--zero", zero, "rad")
    if not _is_written(model) and model.exists() and out.exists() and out.samefile(model):
        problem = "is the model that is read, and holds no orthosis of ours"
        raise InputError(problem, field="--out", value=str(out), allowed="another file")
    with progress("attaching"):
        from afo_sim.legs.attached_files import attached, write_attached
        from afo_sim.legs.attaching import attach

        before: Any = attached(model) if _is_written(model) else model
        try:
            found = attach(
                before,
                orthosis,
                shank=shank,
                foot=foot,
                ankle=ankle,
                side="left" if side == "left" else "right" if side == "right" else None,
                zero=angle,
                supply=supply,
                timestep=timestep,
                prefix=prefix,
            )
        except InputError as error:
            raise error.renamed(_option, str) from None
        written = write_attached(found, out, force=force, mjb=mjb)
    _print(found)
    for words in found.notices:
        print(f"note: {words}", file=sys.stderr)
    beside = [file for file in written if file.parent != out.parent]
    for file in written:
        if file not in beside:
            print(f"written to {file}")
    if beside:
        print(f"{len(beside)} meshes, pictures and parts are in {out.with_name(f'{out.stem}_files')}")
    print(f'next, in Python: leg = afo_sim.attached("{out}")')


def _is_written(model: pathlib.Path) -> bool:
    """Whether a model was written with an orthosis on it."""
    sidecar = model.with_suffix(".toml")
    try:
        return model.suffix == ".xml" and f'model = "{model.name}"' in sidecar.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False


def _option(field: str) -> str:
    """The option that stands for an argument of `attach`."""
    own = ("shank", "foot", "ankle", "side", "zero", "supply", "timestep", "prefix", "orthosis")
    return f"--{field}" if field in own else field


def _print(found: Any) -> None:
    """What was found, and where each input and state stands."""
    from afo_sim.common.units import in_unit

    leg, model = found.found, found.model
    axis = ", ".join(f"{x:.3f}" for x in -leg.sign * leg.axes[:, 1])
    rows = [
        ["shank", f"{leg.shank} ({leg.how.get('shank', 'given')})"],
        ["foot", f"{found.bodies['foot']} ({leg.how.get('foot', 'given')})"],
        ["ankle", f"{leg.ankle} ({leg.how.get('ankle', 'given')}), axis {axis} in the world"],
        ["dorsiflexion", "positive" if leg.sign > 0 else "negative, of the hinge's coordinate"],
        ["side", f"{leg.side} ({leg.how.get('side', 'given')})"],
        ["joints crossed", ", ".join(found.joints)],
        ["supply", f"{in_unit(found.supply, 'Pa', 'bar'):g} bar"],
        ["time step", f"{in_unit(float(model.opt.timestep), 's', 'ms'):g} ms"],
        ["ctrl, model's own", f"0 to {found.own_controls.stop - 1}" if found.own_controls.stop else "none"],
        ["userdata", f"{found.userdata} to {model.nuserdata - 1}"],
    ]
    print_table(f"{found.orthosis.name} on {leg.shank} and {found.bodies['foot']}", ["", ""], rows)
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
