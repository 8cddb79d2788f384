"""Commands on descriptions: list, check, new, keys, refit."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from afo_sim.cli import common
from afo_sim.cli.common import print_line as print
from afo_sim.common import Foreign, InputError, Keywords, assets, nearest_name, unknown

if TYPE_CHECKING:
    from afo_sim.model import Fit, Ratio

_WALK = "afo-sim new scenario NAME --like walk-dropfoot-afo"
_NEXT = {  # the command to go on with, or where the new one goes
    "scenario": "afo-sim run {file}",
    "sweep": "afo-sim sweep {file}",
    "search": "afo-sim optimise {file}",
    "orthosis": "afo-sim new scenario NAME --orthosis {file.parent}",
    "leg": "afo-sim new scenario NAME --leg {file.parent}",
    **{kind: f"{_WALK} --{kind} {{file.parent}}" for kind in ("patient", "shoe", "limits")},
    "sensor": '[sensor.NAME] with column = "…" and type = "{file.parent}" in a scenario',
    "tube": 'tube = "{file.parent}" and tube_length = "…" in a [chamber.NAME] of an orthosis',
    **{kind: f'{kind} = "{{file.parent}}" in the [supply] of a scenario' for kind in ("source", "regulator")},
    **{kind: f"afo-sim new orthosis NAME --{kind} {{file.parent}}" for kind in ("muscle", "valve")},
}


@common.app.command("list")
def list_command(
    what: Annotated[str, Argument(help="|".join(assets.LISTS) + ", or the name of an entry")] = "",
) -> None:
    """List what is available, or one entry with all its numbers. Each number has its unit and source."""
    common.short_lived()
    with common.progress("reading"):
        if what and what not in assets.LISTS:
            from afo_sim.description import product

            tables = product(what)
        else:
            columns = ("name", "what it is")
            kinds = [what] if what else [kind for kind in assets.LISTS if kind != "metrics"]  # hundreds
            tables = [(kind, columns, _entries(kind)) for kind in kinds]
    for title, header, rows in tables:
        common.print_table(title, list(header), [list(row) for row in rows] or [["–", "none is shipped yet"]])


def _entries(kind: str) -> list[tuple[str, str]]:
    """(name, description) of everything of a kind, named in the plural."""
    from afo_sim.common import read_header
    from afo_sim.physics import FRICTIONS, LAWS

    if kind in ("laws", "frictions"):
        known: Foreign = LAWS if kind == "laws" else FRICTIONS
        return [(law.name, f"{law.formula} — {law.source}; {law.validity}") for law in known.values()]
    if kind == "metrics":
        from afo_sim.metrics.metric_words import METRICS

        rows = [(one.name, f"{one.label} [{one.unit or '-'}] {one.meaning}") for one in METRICS.values()]
        return [(name.replace("{}", "…"), text.replace("{}", "…").strip()) for name, text in rows]
    if kind == "gaits":
        headers = {name: read_header(assets.find_gait(name)) for name in assets.gait_names()}
        return [(name, header.get("description", "")) for name, header in headers.items()]
    singular = next(one for one, plural in assets.KINDS.items() if plural == kind)
    own = {name: table for (of, name), table in assets.OWN.items() if of == singular}
    files = {n: assets.find(singular, n) for n in assets.names(singular) if n not in own}
    tables = {name: assets.read_toml(file) for name, file in files.items()} | own
    found = []
    for name, table in tables.items():
        laws = f" (grade {table.get('grade', 'D')}; {', '.join(table['laws'])})" if "laws" in table else ""
        found.append((name, f"{table.get('description', '')}{laws}"))
    return found


@common.app.command()
def check(
    file: Annotated[Path, Argument(help="TOML, MJCF, URDF or gait CSV file, or a shipped orthosis")],
) -> None:
    """Check a file of your own: what is wrong, or what was read."""
    with common.progress("checking"):
        from afo_sim.cli.doctor.kinds import check_file

        findings = check_file(file)
    common.print_table(str(file), ["", "found"], [list(row) for row in findings])
    doubts = sum(name == "warning" for name, _ in findings)
    print(f"readable; {doubts} warning{'s' if doubts > 1 else ''} above" if doubts else "good")


_PRODUCTS = (
    "orthosis", "muscle", "valve", "tube", "source", "regulator", "leg", "scenario", "patient", "shoe",
    "limits", "sensor",
)  # fmt: skip
_NEW_KINDS = (*_PRODUCTS, "sweep", "search")
_Braided = Annotated[str | None, Option(help="dimension of a hand-made muscle, with unit")]
_Used = Annotated[str | None, Option(help="shipped name or path that the new file refers to")]


@dataclass(frozen=True)
class _New:
    """Options of `new`: what is described, and what it uses."""

    kind: Annotated[str, Argument(help="|".join(_NEW_KINDS))]
    name: Annotated[str, Argument(help="name of the new file or folder")]
    out: Annotated[Path, Option(help="output folder")] = Path()
    like: Annotated[str, Option(help="shipped description to start from")] = ""
    whole: Annotated[bool, Option("--all", help="write every key, not only the main ones")] = False
    muscle: _Used = None
    valve: _Used = None
    orthosis: _Used = None
    leg: _Used = None
    patient: _Used = None
    shoe: _Used = None
    limits: _Used = None
    scenario: _Used = None
    bore: _Braided = None
    braid_angle: _Braided = None
    length: Annotated[str | None, Option(help="length of a hand-made muscle, end to end")] = None
    end_length: Annotated[
        str | None,
        Option(help="length of its clamps together, which do not contract; twice the bore by default"),
    ] = None
    wall_thickness: Annotated[str | None, Option(help="wall of its rubber tube; bore/7 by default")] = None


@common.app.command()
@common.one_group
def new(new_one: _New) -> None:
    """Write a commented file of your own that runs at once. It has the main keys; --all writes every key."""
    if new_one.kind not in _NEW_KINDS:
        raise unknown(new_one.kind, _NEW_KINDS, field="KIND", problem="is not a valid kind")
    parts = ("muscle", "valve", "orthosis", "leg", "patient", "shoe", "limits", "scenario")
    uses = {used: where for used, where in common.picked(new_one, *parts).items() if where}
    dimensions = common.picked(new_one, "bore", "braid_angle", "length", "end_length", "wall_thickness")
    braid = {key: text for key, text in dimensions.items() if text is not None}
    if braid and new_one.kind != "muscle":
        problem = f"is not an option of a new {new_one.kind}"
        raise InputError(problem, field=next(iter(braid)), allowed="a new muscle")
    where: Keywords = {"like": new_one.like, "uses": uses, "whole": new_one.whole}
    with common.progress("writing"):
        if new_one.kind in ("sweep", "search"):
            from afo_sim.study import new_study

            file = new_study(new_one.kind, new_one.name, new_one.out, **where)
        else:
            from afo_sim.description.new import new as write

            file = write(new_one.kind, new_one.name, new_one.out, braid=braid, **where)
    print(f"written to {file}")
    if braid:
        from afo_sim.description import load, new_braid_facts

        for fact, value in new_braid_facts(load("muscle", file)):
            print(f"{fact}: {value}")
    if new_one.kind == "orthosis" and "muscle" in uses:
        from afo_sim.description import load

        for name, group in load("orthosis", file).muscle.items():  # links that were fitted to it
            if group.link_length:
                print(f"link of {name}: {1e3 * group.link_length:.4g} mm, set to match the muscle")
            elif group.link_length is not None:
                print(f"warning: no link is left for {name}: shorten the muscle, or move its anchors apart")
    print(f"next: {_NEXT[new_one.kind].format(file=file)}")


@common.app.command()
def keys(
    scenario: common.Scenario,
    word: Annotated[str, Argument(help="show only keys that contain this word")] = "",
    sets: common.Sets = None,
) -> None:
    """List every key that --set, a sweep or a search can set. Shows value, range and source."""
    values = common.read_sets(sets)
    with common.progress("reading"):
        from afo_sim.description.keys import keys as find

        found = find(scenario, word, values)
    if not found:
        parts = {part for key in find(scenario, sets=values) for part in re.findall(r"\w+", key.key)}
        raise InputError(
            "no key contains it",
            field="WORD",
            value=word,
            allowed="part of a key's name",
            nearest=nearest_name(word, sorted(parts)),
        )
    rows = [[k.key, k.value, k.allowed, k.unit, k.origin, k.meaning] for k in found]
    header = ["key", "value", "allowed", "SI unit", "from", "meaning"]
    common.print_table(
        f"{scenario}: {len(rows)} key{'s' if len(rows) > 1 else ''}", header, rows, droppable=5
    )


@common.app.command("refit")
def refit_command(
    orthosis: Annotated[str, Argument(help="name of a shipped orthosis, or its TOML file or folder")],
    out: Annotated[Path | None, Option(help="(required) output folder of the refitted orthosis")] = None,
    to: Annotated[str, Option(help="leg that it shall fit", metavar="LEG")] = "",
    made_for: Annotated[str, Option("--from", help="leg that it was made for", metavar="LEG")] = "adult_75kg",
    shank_length: Annotated[str, Option(help='instead of --to: knee to ankle, such as "35 cm"')] = "",
    foot_length: Annotated[str, Option(help='instead of --to: heel to toe, such as "22 cm"')] = "",
    force: Annotated[bool, Option("--force", help="overwrite an existing orthosis")] = False,
) -> None:
    """Scale an orthosis to a leg of another size. Anchors and paths scale with shank and foot length."""
    if out is None:
        raise InputError("is needed", field="--out", allowed="a folder, orthoses/mine")
    with common.progress("reading"):
        from afo_sim.common import assets
        from afo_sim.description import load
        from afo_sim.model import fits, write_rescaled

        by = _ratio(to, made_for, shank_length, foot_length)
        leg = load("leg", to) if to else None
        missing = [s for s in ("shank", "foot") if leg and getattr(leg, f"{s}_length") is None]
        before = load("orthosis", assets.find("orthosis", orthosis))
        after = write_rescaled(orthosis, by, out, force=force)
        rows = _rows(dict(fits(before)), dict(fits(after)))
    print(f"{before.name}: {by.words}")
    for segment in missing:
        print(f"note: {to} states no {segment} length: it is taken as a share of the body height")
    print(f"shank × {by.shank:.4g}, foot × {by.foot:.4g}")
    common.print_table(
        "before → after", ["group", "moment arm at 0° [mm]", "contraction [%]", "taut at [deg]"], rows
    )
    print("contraction: that of the muscle on its path over the range of motion; below 0 it is stretched")
    print("unchanged: muscles and their spacing, pulleys, valves; size and mass of cuff, plate and outsole")
    print(f"written to {out}; to look at it: afo-sim run seated --set orthosis={out}")


def _ratio(to: str, made_for: str, shank_length: str, foot_length: str) -> "Ratio":
    """Scale factors of shank and foot from the command line."""
    from afo_sim.description import load
    from afo_sim.model import Ratio, lengths_of

    if bool(to) == bool(shank_length or foot_length):
        allowed = '--to LEG, or --shank-length "35 cm" and --foot-length "22 cm"'
        raise InputError("one of the two states the leg", field="--to", value=to or None, allowed=allowed)
    own = lengths_of(load("leg", made_for))
    if to:
        new = lengths_of(load("leg", to))
        words = f"from leg {made_for} to leg {Path(to).name}"
    else:
        stated = (("--shank-length", shank_length), ("--foot-length", foot_length))
        shank, foot = (
            common.quantity(option, text, "m") if text else length
            for (option, text), length in zip(stated, own, strict=True)
        )
        new = shank, foot
        words = f"from leg {made_for} to shank {100.0 * new[0]:.4g} cm, foot {100.0 * new[1]:.4g} cm"
    for option, length in zip(("--shank-length", "--foot-length"), new, strict=True):
        if not 0.02 <= length <= 1.0:
            raise InputError("is out of range", field=option, value=f"{length:g} m", allowed="2 cm to 100 cm")
    return Ratio(new[0] / own[0], new[1] / own[1], words)


def _rows(before: "dict[str, Fit]", after: "dict[str, Fit]") -> list[list[str]]:
    def cells(fit: "Fit") -> list[str]:
        low, high = fit.contraction
        taut = "–" if math.isnan(fit.taut) else f"{math.degrees(fit.taut):.1f}"
        return [f"{1e3 * fit.arm:.1f}", f"{100 * low:.1f} to {100 * high:.1f}", taut]

    return [
        [name, *(f"{a} → {b}" for a, b in zip(cells(before[name]), cells(after[name]), strict=True))]
        for name in before
    ]
