"""Command that fits an orthosis to a leg of another size."""

import math
import pathlib
from typing import TYPE_CHECKING, Annotated, Any

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import print_table, progress, quantity
from afo_sim.common.errors import InputError

if TYPE_CHECKING:
    from afo_sim.model.rescale import Fit, Ratio


@app.command("refit")
def refit_command(
    orthosis: Annotated[str, typer.Argument(help="a shipped orthosis' name, or its TOML file or folder")],
    out: Annotated[pathlib.Path | None, typer.Option(help="needed: folder of the refitted orthosis")] = None,
    to: Annotated[str, typer.Option(help="leg that it is to fit", metavar="LEG")] = "",
    made_for: Annotated[
        str, typer.Option("--from", help="leg that it was made for", metavar="LEG")
    ] = "adult_75kg",
    shank_length: Annotated[str, typer.Option(help='instead of --to: knee to ankle, "35 cm"')] = "",
    foot_length: Annotated[str, typer.Option(help='instead of --to: heel to toe, "22 cm"')] = "",
    force: Annotated[bool, typer.Option("--force", help="replace an orthosis that is there")] = False,
) -> None:
    """Fit an orthosis to a leg of another size: anchors and paths go with the lengths of shank and foot."""
    if out is None:
        raise InputError("is needed", field="--out", allowed="a folder, orthoses/mine")
    with progress("reading"):
        from afo_sim.common import assets
        from afo_sim.description.reader import load
        from afo_sim.model.rescale import fits, write_rescaled

        by = _ratio(to, made_for, shank_length, foot_length)
        leg = load("leg", to) if to else None
        missing = [s for s in ("shank", "foot") if leg and getattr(leg, f"{s}_length") is None]
        before = load("orthosis", assets.find("orthosis", orthosis))
        after = write_rescaled(orthosis, by, out, force=force)
        rows = _rows(dict(fits(before)), dict(fits(after)))
    print(f"{before.name}: {by.words}")
    for segment in missing:
        print(
            f"note: no length of the {segment} is stated for {to}: a share of its body height stands for it"
        )
    print(f"shank × {by.shank:.4g}, foot × {by.foot:.4g}")
    print_table(
        "before → after", ["group", "moment arm at 0° [mm]", "contraction [%]", "taut at [deg]"], rows
    )
    print("contraction: what the path leaves a muscle over the range of motion; below 0 it is stretched")
    print(
        "as they were: muscles and their spacing, pulleys, valves; size and mass of cuff, plate and outsole"
    )
    print(f"written to {out}; look at it with: afo-sim run seated --set orthosis={out}")


def _ratio(to: str, made_for: str, shank_length: str, foot_length: str) -> "Ratio":
    """How much longer shank and foot are, from what the command line tells."""
    from afo_sim.description.reader import load
    from afo_sim.model.rescale import Ratio, lengths_of

    if bool(to) == bool(shank_length or foot_length):
        allowed = '--to LEG, or --shank-length "35 cm" and --foot-length "22 cm"'
        raise InputError("one of the two tells the leg", field="--to", value=to or None, allowed=allowed)
    own = lengths_of(load("leg", made_for))
    if to:
        new = lengths_of(load("leg", to))
        words = f"from leg {made_for} to leg {pathlib.Path(to).name}"
    else:
        told = (("--shank-length", shank_length), ("--foot-length", foot_length))
        new = tuple(  # type: ignore[assignment]
            quantity(option, text, "m") if text else length
            for (option, text), length in zip(told, own, strict=True)
        )
        words = f"from leg {made_for} to shank {100.0 * new[0]:.4g} cm, foot {100.0 * new[1]:.4g} cm"
    for option, length in zip(("--shank-length", "--foot-length"), new, strict=True):
        if not 0.02 <= length <= 1.0:
            raise InputError("is out of range", field=option, value=f"{length:g} m", allowed="2 cm to 100 cm")
    return Ratio(new[0] / own[0], new[1] / own[1], words)


def _rows(before: "dict[str, Fit]", after: "dict[str, Fit]") -> list[list[str]]:
    def cells(fit: Any) -> list[str]:
        low, high = fit.contraction
        taut = "–" if math.isnan(fit.taut) else f"{math.degrees(fit.taut):.1f}"
        return [f"{1e3 * fit.arm:.1f}", f"{100 * low:.1f} to {100 * high:.1f}", taut]

    return [
        [name, *(f"{a} → {b}" for a, b in zip(cells(before[name]), cells(after[name]), strict=True))]
        for name in before
    ]
