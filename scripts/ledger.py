"""The ledger from outside: `python scripts/ledger.py PART …`, all parts by default.

changes  the rows that the ledger had before its bands were mended: before, after, and with each change alone
write    models/coverage.toml, and the lines of docs/accuracy.md
flow     where each number comes from that a row is predicted from; exit code 1 where a bench takes part in
         its own prediction
"""

import argparse
import dataclasses
import pathlib
import sys
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from afo_sim.common import write_text
from afo_sim.lab import ledger
from afo_sim.lab.ledger import Device, LedgerRow, Number
from afo_sim.lab.ledger_predictions import muscle

ROOT = pathlib.Path(__file__).parents[1]
LATER = (  # benches that were described after the bands were mended
    "Aeropoly",
    "Chongqing University of Technology",
    "Cruz & Dhaher 2009",
    "J. Case",
    "Kobayashi et al. 2011",
    "Moosabhoy & Gard 2006",
    "Winter 1991",
    "s-muscle",
)
CHANGES = ("laboratories' force", "free contraction", "rubber", "ends")
MAKERS, BARE = ("dmsp_10", "dmsp_20"), "chou_hannaford_1996"
TOLERANCE = Number(within=(0.9, 1.1), kind="published", source="the maker's tolerance of 10 %")
WALL = Number(within=("0.5 mm", "2 mm"), kind="assumed", source="of a wall without rubber")
MOVING = {
    "damping",
    "mass",
    "dead_volume",
    "braid_stiffness",
    "return_stiffness",
}  # no part of a force at rest


def without(device: Device, changes: Iterable[str]) -> Device:
    """A device as it was drawn before some changes."""
    given, unknown, measured = dict(device.given), dict(device.unknown), device.measured
    factor = unknown.get("force_factor")
    if "laboratories' force" in changes and factor is not None and factor.laboratories:
        unknown["force_factor"] = TOLERANCE
        if device.of == "handmade_10mm":
            del unknown["force_factor"]
    if "free contraction" in changes:
        unknown.pop("contraction_factor", None)
    if "ends" in changes and "end_loss" in unknown:
        del unknown["end_loss"]
        at = ({key: x for key, x in each.at.items() if key != "total_length"} for each in measured)
        measured = tuple(m.model_copy(update={"at": own}) for m, own in zip(measured, at, strict=True))
    if "rubber" in changes and "tube.modulus" in unknown:
        del unknown["tube.modulus"], unknown["tube.wall_thickness"]
        law = given["law"]  # no number is None, which takes the template's tube away: a copy is not checked
        given |= {key: law.model_copy(update={"value": x}) for key, x in (("law", BARE), ("tube", None))}
        unknown[f"laws.{BARE}.wall_thickness"] = WALL
    return device.model_copy(update={"given": given, "unknown": unknown, "measured": measured})


def changes() -> None:
    """Coverage, width and score of the same rows before, after, and with each change alone."""
    same = [d for d in ledger.devices().values() if d.bench not in LATER and not d.wanting]
    cases: dict[str, tuple[str, ...]] = {"before": CHANGES, "after": ()}
    cases |= {f"{one} alone": tuple(each for each in CHANGES if each != one) for one in CHANGES}
    for title, left_out in cases.items():
        found = [(device, row) for device in same for row in ledger.rows_of(without(device, left_out))]
        print(f"{title}: {measures([row for _, row in found])}")
        print(f"    makers' muscles: {measures([row for device, row in found if device.of in MAKERS])}")


def measures(rows: list[LedgerRow]) -> str:
    """What bands are worth, in a line."""
    inside, n = [float(bool(row.inside)) for row in rows], len(rows)
    low, _, high, x = np.array([(*(row.band or ()), row.measured) for row in rows]).T
    scores, width = ledger.interval_score(low, high, x), np.median((high - low) / np.abs(x))
    (share, error), by_rows = ledger.by_bench(rows, inside), float(np.mean(inside))
    deviation = (by_rows * (1.0 - by_rows) / n) ** 0.5
    return (
        f"{sum(inside):.0f} of {n} in band ({by_rows:.0%} ± {deviation:.0%}; by bench {share:.0%} ± "
        f"{error:.0%}), width/value {width:.2f}, score median {np.median(scores):.2f}, mean "
        f"{np.mean(scores):.2f}, by bench {ledger.by_bench(rows, list(scores))[0]:.2f}"
    )


def write() -> None:
    """Write the counts that go with answers, and the lines of the page."""
    rows = ledger.ledger()
    told = ["# How many measured values of the ledger lay in the band of 90 % that was predicted for them."]
    for kind, counts in ledger.coverage_of(rows).items():
        fields = {key: x for key, x in dataclasses.asdict(counts).items() if key != "kind"}
        told += [f'\n["{kind}"]', *(f"{key} = {x}" for key, x in fields.items())]
    write_text(ROOT / "models" / "coverage.toml", "\n".join(told) + "\n")
    page = ROOT / "docs" / "accuracy.md"
    head, begins, rest = page.read_text(encoding="utf-8").partition("<!-- ledger begins -->\n")
    lines = "".join(f"- {line}.\n" for line in ledger.summary(rows))
    _, ends, tail = rest.partition("<!-- ledger ends -->")
    write_text(page, f"{head}{begins}{lines}{ends}{tail}")


def flow() -> None:
    """Every input of each predicted row."""
    wrong = []
    for name, device in ledger.devices().items():
        if device.wanting:
            continue
        print(f"\n{name} ({device.bench}): {device.predict} of {device.of or 'the leg'}")
        bench = device.bench.split(",")[0]
        for key, number in (device.given | device.unknown).items():
            print(f"  {key}: {number.kind}: {number.source}")
            wrong += [f"{name}: {key}"] if bench in number.source and number.kind != "published" else []
        if device.others:
            told = ", ".join(f"{bench} {x:+.3f}" for bench, x in device.others.items())
            print(f"  force_factor by ln(measured/predicted) of: {told}")
            wrong += [name] if device.bench in device.others else []
        for key, how in sources(device) if device.predict in ("force", "contraction", "change") else ():
            print(f"  of the muscle, {key}: {how}")
            sister = device.of.endswith(".csv")  # a fit to another specimen's table of the same bench
            wrong += [f"{name}: {key}"] if device.bench in how and not sister else []
    sys.exit(f"predicted from their own bench: {', '.join(wrong)}" if wrong else 0)


def sources(device: Device) -> Iterator[tuple[str, str]]:
    """Where the other numbers come from that give a muscle's force at rest."""
    own = muscle(device.of, device.draws()[0])
    told = dict(own.provenance) | {f"{own.law}.{key}": each for key, each in own.law_set.provenance.items()}
    for key, each in told.items():
        if not MOVING & {key} and key not in device.given | device.unknown:
            yield key, f"{each.kind}: {each.source}"


PARTS: dict[str, Callable[[], None]] = {"changes": changes, "write": write, "flow": flow}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART")
    for part in parser.parse_args().parts or PARTS:
        PARTS[part]()
