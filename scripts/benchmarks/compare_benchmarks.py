"""What became slower and what faster between two files of `benchmark.py`.

    python scripts/benchmarks/compare_benchmarks.py OLD.json NEW.json [--tolerance 5%] [--other-machine]

Bests are compared. Exit code 1 where something is slower by more than the tolerance, 2 where the files cannot
be compared: another benchmark, or another machine, whose figures say nothing of the code.
"""

import argparse
import json
import math
import pathlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

SAME = ("processor", "cores", "system")  # of a machine


class NotComparable(Exception):
    """Why two files cannot be compared."""


@dataclass(frozen=True)
class Change:
    """A figure in both files; `slower` is the share by which it is worse, negative where it is better."""

    name: str
    unit: str
    old: float
    new: float
    slower: float

    def __str__(self) -> str:
        values = f"{self.old:.4g} → {self.new:.4g} {self.unit}".rstrip()
        return f"{self.name}: {values} ({abs(self.slower):.1%})"


def read(path: pathlib.Path) -> dict[str, Any]:
    """A file of figures."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        for key in ("benchmark", "machine", "figures", "options"):
            found[key]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NotComparable(f"{path} is no file of a benchmark: {error!r}") from None
    return dict(found)


def check_alike(old: dict[str, Any], new: dict[str, Any], other_machine: bool) -> list[str]:
    """Differences that do not forbid a comparison, in words."""
    if old["benchmark"] != new["benchmark"]:
        raise NotComparable(f"one file is of {old['benchmark']!r}, the other of {new['benchmark']!r}")
    apart = _unlike(*({key: repr(found["machine"].get(key)) for key in SAME} for found in (old, new)))
    if apart and not other_machine:
        raise NotComparable(f"other machines ({'; '.join(apart)}): give --other-machine if that is meant")
    versions = _unlike(*(found["machine"].get("versions", {}) for found in (old, new)))
    return [*apart, *versions, *_unlike(*(found["options"] | {"parts": None} for found in (old, new)))]


def _unlike(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """What differs between two tables, in words."""
    keys = [key for key in old | new if old.get(key) != new.get(key)]
    return [f"{key} {old.get(key)}, {new.get(key)}" for key in keys]


def changes(old: dict[str, Any], new: dict[str, Any]) -> list[Change]:
    """Figures with a better direction that both files have, the worst first."""
    before = {figure["name"]: figure for figure in old["figures"]}
    found = []
    for figure in new["figures"]:
        was = before.get(figure["name"])
        if was is None or not figure["better"] or was["unit"] != figure["unit"]:
            continue
        one, other = was["best"], figure["best"]
        if one > 0.0 and other > 0.0:  # a difference within the noise may be negative
            slower = (other / one if figure["better"] == "lower" else one / other) - 1.0
            found.append(Change(figure["name"], figure["unit"], one, other, slower))
    return sorted(found, key=lambda change: -change.slower)


def tolerance(words: str) -> float:
    """The share that "5%" or "0.05" is."""
    number = float(words.removesuffix("%")) / (100.0 if words.endswith("%") else 1.0)
    if not 0.0 <= number < math.inf:
        raise ValueError(words)
    return number


def told(found: Sequence[Change], allowed: float) -> list[str]:
    """What became slower, what became faster, and how many figures did neither."""
    slower = [change for change in found if change.slower > allowed]
    faster = [change for change in reversed(found) if change.slower < -allowed]
    alike = len(found) - len(slower) - len(faster)
    lines = [*(f"slower: {change}" for change in slower), *(f"faster: {change}" for change in faster)]
    return [*lines, f"{len(slower)} slower, {len(faster)} faster, {alike} alike"]


def main(words: Sequence[str] | None = None) -> int:
    """Compare the files that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    parser.add_argument(
        "--tolerance", type=tolerance, default=0.05, help="share that is no change, 5%% by default"
    )
    parser.add_argument("--other-machine", action="store_true", help="compare all the same")
    options = parser.parse_args(words)
    try:
        old, new = read(options.old), read(options.new)
        for difference in check_alike(old, new, options.other_machine):
            print(f"differs: {difference}")
    except NotComparable as error:
        print(error, file=sys.stderr)
        return 2
    names = [{figure["name"] for figure in found["figures"]} for found in (old, new)]
    for word, some in (("only in the old", names[0] - names[1]), ("only in the new", names[1] - names[0])):
        if some:
            print(f"{word}: {', '.join(sorted(some))}")
    found = changes(old, new)
    print("\n".join(told(found, options.tolerance)))
    return int(any(change.slower > options.tolerance for change in found))


if __name__ == "__main__":
    sys.exit(main())
