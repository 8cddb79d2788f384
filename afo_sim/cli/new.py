"""The commands that help to write a description: new, keys."""

import pathlib
import re
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Scenario, Sets, print_table, progress, read_sets
from afo_sim.common.errors import InputError, nearest_name, unknown

PRODUCTS = (
    "orthosis", "muscle", "valve", "tube", "source", "regulator", "leg", "scenario", "patient", "shoe",
    "limits", "sensor",
)  # fmt: skip
KINDS = (*PRODUCTS, "sweep", "search")
Braided = Annotated[str | None, typer.Option(help="of a hand-made muscle, with unit")]
Used = Annotated[str | None, typer.Option(help="that it refers to: a shipped name, or a path")]


@app.command()
def new(
    kind: Annotated[str, typer.Argument(help="|".join(KINDS))],
    name: Annotated[str, typer.Argument(help="of the new file or folder")],
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path(),
    like: Annotated[str, typer.Option(help="the shipped one whose numbers it starts with")] = "",
    muscle: Used = None,
    valve: Used = None,
    orthosis: Used = None,
    leg: Used = None,
    patient: Used = None,
    shoe: Used = None,
    limits: Used = None,
    scenario: Used = None,
    bore: Braided = None,
    braid_angle: Braided = None,
    length: Annotated[str | None, typer.Option(help="of a hand-made muscle, end to end")] = None,
    end_length: Annotated[
        str | None, typer.Option(help="of its clamps together, which do not contract; two bores by default")
    ] = None,
    wall_thickness: Annotated[
        str | None, typer.Option(help="of its braid and bladder; thin by default")
    ] = None,
) -> None:
    """Write a commented file of your own that runs at once: every key, what it means, what is allowed."""
    if kind not in KINDS:
        raise unknown(kind, KINDS, field="KIND", problem="is no kind")
    given = {
        "muscle": muscle,
        "valve": valve,
        "orthosis": orthosis,
        "leg": leg,
        "patient": patient,
        "shoe": shoe,
        "limits": limits,
        "scenario": scenario,
    }
    uses = {used: where for used, where in given.items() if where}
    dimensions = {
        "bore": bore,
        "braid_angle": braid_angle,
        "length": length,
        "end_length": end_length,
        "wall_thickness": wall_thickness,
    }
    braid = {key: text for key, text in dimensions.items() if text is not None}
    if braid and kind != "muscle":
        raise InputError(f"does not go with a new {kind}", field=next(iter(braid)), allowed="a new muscle")
    with progress("writing"):
        if kind in ("sweep", "search"):
            from afo_sim.study.template import new_study

            file = new_study(kind, name, out, like=like, uses=uses)
        else:
            from afo_sim.description.new import new as write

            file = write(kind, name, out, like=like, uses=uses, braid=braid)
    print(f"written to {file}")
    if braid:
        from afo_sim.description.handmade import new_braid_facts
        from afo_sim.description.reader import load

        for fact, value in new_braid_facts(load("muscle", file)):
            print(f"{fact}: {value}")
    print(f"next: {_next(kind, name, file)}")


@app.command()
def keys(
    scenario: Scenario,
    word: Annotated[str, typer.Argument(help="only keys that mention it")] = "",
    sets: Sets = None,
) -> None:
    """Every key that --set, a sweep or a search can set: value, range, where the value comes from."""
    values = read_sets(sets)
    with progress("reading"):
        from afo_sim.description.keys import keys as find

        found = find(scenario, word, values)
    if not found:
        parts = {part for key in find(scenario, sets=values) for part in re.findall(r"\w+", key.key)}
        raise InputError(
            "no key mentions it",
            field="WORD",
            value=word,
            allowed="a part of a key's name",
            nearest=nearest_name(word, sorted(parts)),
        )
    rows = [[k.key, k.value, k.allowed, k.unit, k.origin, k.meaning] for k in found]
    header = ["key", "value", "allowed", "SI unit", "from", "meaning"]
    print_table(f"{scenario}: {len(rows)} key{'s' if len(rows) > 1 else ''}", header, rows, droppable=5)


def _next(kind: str, name: str, file: pathlib.Path) -> str:
    """The command to go on with."""
    if kind == "scenario":
        return f"afo-sim run {file}"
    if kind == "sweep":
        return f"afo-sim sweep {file}"
    if kind == "search":
        return f"afo-sim optimise {file}"
    if kind == "orthosis":
        return f"afo-sim new scenario NAME --orthosis {file.parent}"
    if kind == "leg":
        return f"afo-sim new scenario NAME --leg {file.parent}"
    if kind in ("patient", "shoe", "limits"):
        return f"afo-sim new scenario NAME --like walk-dropfoot-afo --{kind} {file.parent}"
    if kind == "sensor":
        return f'[sensor.NAME] with column = "…" and type = "{file.parent}" in a scenario'
    if kind == "tube":
        return f'tube = "{file.parent}" and tube_length = "…" in a [chamber.NAME] of an orthosis'
    if kind in ("source", "regulator"):
        return f'{kind} = "{file.parent}" in the [supply] of a scenario'
    return f"afo-sim new orthosis NAME --{kind} {file.parent}"
