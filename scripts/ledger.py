"""The ledger from outside: `python scripts/ledger.py PART …`, all parts by default.

write    models/coverage.toml, and the lines of docs/accuracy.md
flow     where each number comes from that a row is predicted from; exit code 1 where a bench takes part in
         its own prediction
"""

import argparse
import dataclasses
import pathlib
import sys
from collections.abc import Callable, Iterable, Iterator

from afo_sim.common import write_text
from afo_sim.lab import ledger
from afo_sim.lab.ledger import Device, LedgerRow
from afo_sim.lab.ledger_predictions import muscle
from afo_sim.metrics import Coverage, coverages

ROOT = pathlib.Path(__file__).parents[1]
# no part of a force at rest
MOVING = {"damping", "mass", "dead_volume", "braid_stiffness", "return_stiffness"}


def coverage_of(rows: Iterable[LedgerRow]) -> dict[str, Coverage]:
    """How many values of each kind lie in their bands, on how many benches, and how many were worn."""
    told = [row for row in rows if row.inside is not None]
    found = {}
    for kind in coverages():
        own = [row for row in told if row.kind == kind]
        benches, worn = {row.bench for row in own}, [row for row in own if row.worn]
        found[kind] = Coverage(kind, len(own), sum(bool(row.inside) for row in own), len(benches), len(worn))
    return found


def write() -> None:
    """Write the counts that go with answers, and the lines of the page."""
    rows = ledger.ledger()
    told = ["# How many measured values of the ledger lay in the band of 90 % that was predicted for them."]
    for kind, counts in coverage_of(rows).items():
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


PARTS: dict[str, Callable[[], None]] = {"write": write, "flow": flow}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART")
    for part in parser.parse_args().parts or PARTS:
        PARTS[part]()
