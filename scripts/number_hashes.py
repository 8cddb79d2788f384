"""A table of hashes of every number that the shipped files give, to compare two states of the code.

    python scripts/number_hashes.py --out before.json
    …change the code…
    python scripts/number_hashes.py --out after.json --against before.json

Everything goes through the command line, so that the table does not depend on where a function stands. A run
is hashed by column and by metric, a fit by parameter, `validate` by row, a sweep and a search by column of
their tables. Hashes are of the bits, so they hold for one kind of processor and one set of libraries.
Exit code 1 where a hash differs. Takes some four minutes on two cores.
"""

import argparse
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from typing import Any

ROOT = pathlib.Path(__file__).parents[1]
MODELS = ROOT / "models"
NOT_NUMBERS = {"wall_seconds", "steps_per_second", "why", "seconds"}  # of the machine, or words

Hashes = dict[str, str]


def command(*words: str | pathlib.Path) -> str:
    """Standard output of `afo-sim WORDS`; its message where it fails."""
    line = [sys.executable, "-m", "afo_sim", *map(str, words)]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


def digest(data: bytes) -> str:
    """The first sixteen digits of SHA-256."""
    return hashlib.sha256(data).hexdigest()[:16]


def table(path: pathlib.Path, name: str) -> Iterator[tuple[str, str]]:
    """Each column of a Parquet file."""
    import pyarrow.parquet as pq

    read = pq.ParquetFile(path).read()
    for column in read.column_names:
        if column.rsplit("/", 1)[-1] not in NOT_NUMBERS:
            values = json.dumps(read[column].to_pylist(), default=str)
            yield f"{name} · {column}", digest(values.encode())


def leaves(value: Any, name: str) -> Iterator[tuple[str, str]]:
    """Each number of a JSON value, by its path."""
    if isinstance(value, dict):
        for key, item in value.items():
            if key not in NOT_NUMBERS:
                yield from leaves(item, f"{name} · {key}")
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        for k, item in enumerate(value):
            yield from leaves(item, f"{name} · {k}")
    elif isinstance(value, list):
        yield name, digest(json.dumps(value).encode())
    elif isinstance(value, float | int) and not isinstance(value, bool):
        yield name, repr(value)


def runs(folder: pathlib.Path) -> Iterator[tuple[str, str]]:
    """Every shipped scenario."""
    for file in sorted((MODELS / "scenarios").glob("*.toml")):
        out = folder / file.stem
        command("run", file.stem, "--no-rrd", "--out", out)
        yield from table(out / "recording.parquet", f"run {file.stem}")
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        yield from leaves({k: summary.get(k) for k in ("metrics", "strides")}, f"run {file.stem}")


def stands(folder: pathlib.Path) -> Iterator[tuple[str, str]]:
    """Every test of the stand, with and without friction."""
    cases = (
        ("all", "dmsp_20"),
        ("step", "s1_215mm"),
        ("isobaric", "dmsp_10", "--friction", "maxwell_slip"),
        ("release", "s1_215mm", "--pressure", "3 bar", "--load", "100 N"),
    )
    for k, words in enumerate(cases):
        out = folder / f"stand{k}"
        command("stand", *words, "--no-rrd", "--out", out)
        for path in sorted(out.glob("*.parquet")):
            yield from table(path, f"stand {' '.join(words)} {path.stem}")


def fits(folder: pathlib.Path) -> Iterator[tuple[str, str]]:
    """The shipped measured points, each with the law that the shipped muscle uses, and others."""
    muscles = MODELS / "muscles"
    cases = (
        ("dmsp_10/characteristic.csv", "sarosi_2012"),
        ("dmsp_10/characteristic.csv", "maximum_force"),
        ("dmsp_20/characteristic.csv", "kerscher_2006"),
        ("dmsp_20/characteristic.csv", "sarosi_2012"),
        ("s1_215mm/table_1.csv s1_120mm/table_2.csv", "tondu_lopez_2000_bladder"),
    )
    for k, (files, law) in enumerate(cases):
        out = folder / f"fit{k}"
        command("fit", *(muscles / file for file in files.split()), "--law", law, "--out", out)
        yield from leaves(json.loads((out / "fit.json").read_text("utf-8")), f"fit {files} {law}")


def validation(folder: pathlib.Path) -> Iterator[tuple[str, str]]:
    """Every row of `validate`."""
    for row in json.loads(command("validate", "--json")):
        yield from leaves(row, f"validate {row['source']} {row['quantity']}")


def sweeps(folder: pathlib.Path) -> Iterator[tuple[str, str]]:
    """The shipped sweeps whole."""
    for file in sorted((MODELS / "sweeps").glob("*.toml")):
        out = folder / f"sweep-{file.stem}"
        command("sweep", file.stem, "--out", out)
        yield from table(out / "results.parquet", f"sweep {file.stem}")


def searches(folder: pathlib.Path) -> Iterator[tuple[str, str]]:
    """Two generations of the shipped searches."""
    for file in sorted((MODELS / "searches").glob("*.toml")):
        out, short = folder / f"search-{file.stem}", folder / file.name
        lines = file.read_text("utf-8").splitlines()
        lines = ["generations = 2" if line.startswith("generations") else line for line in lines]
        short.write_text("\n".join(lines), encoding="utf-8")
        command("optimise", short, "--out", out)
        for path in sorted(out.rglob("*.parquet")):
            yield from table(path, f"search {file.stem} {path.relative_to(out)}")


# By the word that their names begin with.
PARTS = {
    "run": runs,
    "stand": stands,
    "fit": fits,
    "validate": validation,
    "sweep": sweeps,
    "search": searches,
}


def hashes(parts: list[str]) -> Hashes:
    """Those of some parts, by name."""
    found: Hashes = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in parts:
            new = dict(PARTS[name](pathlib.Path(folder)))
            print(f"{name}: {len(new)} numbers and columns", file=sys.stderr, flush=True)
            found |= new
    return found


def main() -> int:
    """Write the table, and compare it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=pathlib.Path, help="write the table here, as JSON")
    parser.add_argument("--against", type=pathlib.Path, help="a table to compare with")
    parser.add_argument("--only", nargs="*", choices=PARTS, default=[], help="some parts; all by default")
    options = parser.parse_args()
    now = hashes(options.only or list(PARTS))
    if options.out:
        options.out.write_text(json.dumps(now, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    if not options.against:
        return 0
    before = json.loads(options.against.read_text(encoding="utf-8"))
    before = {n: value for n, value in before.items() if n.split()[0] in (options.only or PARTS)}
    changed = [name for name in before if name in now and before[name] != now[name]]
    gone, new = [n for n in before if n not in now], [n for n in now if n not in before]
    for word, names in (("changed", changed), ("gone", gone), ("new", new)):
        for name in names:
            print(f"{word}: {name}  {before.get(name, '')} → {now.get(name, '')}")
    print(f"{len(before)} before, {len(changed)} changed, {len(gone)} gone, {len(new)} new")
    return int(bool(changed or gone))


if __name__ == "__main__":
    sys.exit(main())
