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
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

SAME = ("processor", "cores", "system")  # of a machine


class NotComparable(Exception):
    """Why two files cannot be compared."""


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


def changes(old: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """Figures with a better direction that both have, by the share that each is worse, the worst first."""
    both = old.merge(new, on=["name", "unit", "better"], suffixes=("_old", "_new"))
    both = both[(both.better != "") & (both.best_old > 0.0) & (both.best_new > 0.0)]  # noise may be negative
    grown = both.best_new / both.best_old
    both["slower"] = np.where(both.better == "lower", grown, 1.0 / grown) - 1.0
    return both.sort_values("slower", ascending=False)


def tolerance(words: str) -> float:
    """The share that "5%" or "0.05" is."""
    number = float(words.removesuffix("%")) / (100.0 if words.endswith("%") else 1.0)
    if not 0.0 <= number < math.inf:
        raise ValueError(words)
    return number


def told(found: pd.DataFrame, allowed: float) -> Iterator[str]:
    """What became slower, what became faster, and how many figures did neither."""
    slower, faster = found[found.slower > allowed], found[found.slower < -allowed][::-1]
    for word, rows in (("slower", slower), ("faster", faster)):
        for row in rows.itertuples():
            values = f"{row.best_old:.4g} → {row.best_new:.4g} {row.unit}".rstrip()
            yield f"{word}: {row.name}: {values} ({abs(row.slower):.1%})"
    alike = len(found) - len(slower) - len(faster)
    yield f"{len(slower)} slower, {len(faster)} faster, {alike} alike"


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
    before, now = pd.DataFrame(old["figures"]), pd.DataFrame(new["figures"])
    for word, one, other in (("only in the old", before, now), ("only in the new", now, before)):
        if some := sorted({*one.name} - {*other.name}):
            print(f"{word}: {', '.join(some)}")
    found = changes(before, now)
    print("\n".join(told(found, options.tolerance)))
    return int((found.slower > options.tolerance).any())


if __name__ == "__main__":
    sys.exit(main())
