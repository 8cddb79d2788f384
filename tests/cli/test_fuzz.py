"""Shipped descriptions and tables with seeded damage: `check` and `load` answer, or say what is wrong."""

import os
import pathlib
import random
import re
from collections.abc import Callable

import pytest

from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import AfoSimError, assets, read_table
from afo_sim.description import load

ROOT = pathlib.Path(__file__).parents[2]
CASES = int(os.environ.get("AFO_SIM_FUZZ_CASES", "24"))  # of each file
VALUES = (
    "nan", "-inf", "1e400", "9" * 400, "-9" + "9" * 400, "true", "''", "'\u202e\u0000'".replace("\0", ""),
    "'x y'", "[]", "[[]]", "[1, 'a', []]", "{}", "{ value = 1 }", "{ value = {}, source = 1 }", "1979-05-27",
    "'nan bar'", "'1e999 m'", "'-1 m'", "'1 m**m**m'", "'0 s'", "'½ bar'", "{ value = '1 m', kind = 'x' }",
    "[" * 200 + "]" * 200, "'" + "a" * 10_000 + "'", "-1", "0", "3.5", "'/'", "'..'", "'.'", "['1 m', '2 m']",
)  # fmt: skip
Damage = Callable[[random.Random, list[str]], list[str]]


def _line(random: random.Random, lines: list[str]) -> int:
    return random.choice([k for k, line in enumerate(lines) if line.strip()] or [0])


def drop_line(random: random.Random, lines: list[str]) -> list[str]:
    k = _line(random, lines)
    return lines[:k] + lines[k + 1 :]


def repeat_line(random: random.Random, lines: list[str]) -> list[str]:
    k = _line(random, lines)
    return [*lines[: k + 1], lines[k], *lines[k + 1 :]]


def other_value(random: random.Random, lines: list[str]) -> list[str]:
    keys = [k for k, line in enumerate(lines) if re.match(r"[\w.\"]+ *=", line)]
    if not keys:
        return other_cell(random, lines)
    k = random.choice(keys)
    return [*lines[:k], f"{lines[k].partition('=')[0]}= {random.choice(VALUES)}", *lines[k + 1 :]]


def other_inner_value(random: random.Random, lines: list[str]) -> list[str]:
    """A text or number somewhere in a line."""
    k = _line(random, lines)
    found = list(re.finditer(r"\"[^\"]*\"|(?<![\w.])-?\d[\d.e-]*", lines[k]))
    if not found:
        return drop_line(random, lines)
    at = random.choice(found)
    return [
        *lines[:k],
        lines[k][: at.start()] + random.choice(VALUES) + lines[k][at.end() :],
        *lines[k + 1 :],
    ]


def other_key(random: random.Random, lines: list[str]) -> list[str]:
    k = _line(random, lines)
    return [
        *lines[:k],
        re.sub(r"[a-z]+", random.choice(["x", "law", "ä", "''"]), lines[k], count=1),
        *lines[k + 1 :],
    ]


def other_table(random: random.Random, lines: list[str]) -> list[str]:
    heads = [k for k, line in enumerate(lines) if line.startswith("[")]
    if not heads:
        return other_key(random, lines)
    k = random.choice(heads)
    head = random.choice(["[x]", "[[x]]", lines[k].replace("[", "[x."), f"[{lines[k]}]", "[provenance]"])
    return [*lines[:k], head, *lines[k + 1 :]]


def other_cell(random: random.Random, lines: list[str]) -> list[str]:
    k = _line(random, lines)
    cells = lines[k].split(",")
    cells[random.randrange(len(cells))] = random.choice(
        ["nan", "inf", "", "x", "1e400", "-1", '"', "9" * 500, "1e6"]
    )
    return [*lines[:k], ",".join(cells), *lines[k + 1 :]]


def cut(random: random.Random, lines: list[str]) -> list[str]:
    text = "\n".join(lines)
    return text[: random.randrange(len(text) + 1)].split("\n")


def splice(random: random.Random, lines: list[str]) -> list[str]:
    text = "\n".join(lines)
    at = random.randrange(len(text) + 1)
    return (
        text[:at] + random.choice(['"', "[", "]", "{", "=", "\n", "\0", "ü", "'''", ",", "#"]) + text[at:]
    ).split("\n")


DAMAGES: tuple[Damage, ...] = (
    drop_line, repeat_line, other_value, other_value, other_inner_value, other_inner_value, other_key,
    other_table, cut, splice,
)  # fmt: skip
TABLE_DAMAGES: tuple[Damage, ...] = (
    other_cell,
    other_cell,
    other_cell,
    drop_line,
    repeat_line,
    cut,
    splice,
    other_key,
)
FILES = {
    "scenario": ["seated", "walk-dropfoot-afo", "arm"],
    "muscle": ["dmsp_20", "s1_215mm"],
    "orthosis": ["s1"],
    "leg": ["adult_75kg"],
    "valve": ["mh1", "mha2", "mpye_m5"],
    "patient": None,
    "sweep": None,
    "search": None,
}


def shipped() -> list[tuple[str, pathlib.Path]]:
    found = [
        (k, assets.find(k, name)) for k, names in FILES.items() for name in (names or assets.names(k)[:1])
    ]
    found += [("checks", next((ROOT / "models" / "checks").glob("*.toml")))]
    found += [("gait", assets.find_gait(name)) for name in ("gatk_stride1", "norm_adult")]
    return [*found, ("points", ROOT / "models" / "muscles" / "dmsp_20" / "characteristic.csv")]


def examine(kind: str, file: pathlib.Path) -> None:
    """What a person does with such a file."""
    if kind == "points":
        from afo_sim.lab import read_measured

        read_table(file, "x")
        read_measured(file)
        return
    check_file(file)
    if kind in FILES and kind not in ("sweep", "search"):
        load(kind, str(file))


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "source"), shipped(), ids=lambda value: getattr(value, "stem", value))
def test_damaged_files_are_answered_or_refused(
    kind: str, source: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    lines = source.read_text("utf-8").splitlines()
    beside = {path.name: path for path in source.parent.iterdir() if path.is_file() and path != source}
    told = {"fine": 0, "refused": 0}
    file = tmp_path / source.parent.name / source.name
    file.parent.mkdir()
    for name, path in beside.items():
        (file.parent / name).symlink_to(path)
    for number in range(CASES):
        chance = random.Random(f"{source.stem} {number}")
        damages = TABLE_DAMAGES if source.suffix == ".csv" else DAMAGES
        damaged = lines
        for _ in range(chance.choice((1, 1, 2))):
            damaged = chance.choice(damages)(chance, damaged)
        file.write_text("\n".join(damaged) + "\n", encoding="utf-8")
        try:
            examine(kind, file)
            told["fine"] += 1
        except AfoSimError as error:
            told["refused"] += 1
            assert str(error)
    assert told["refused"] > CASES // 4, told


@pytest.mark.parametrize("suffix", [".toml", ".csv", ".xml", ".urdf", ".mjcf"])
def test_files_of_no_kind_are_refused(suffix: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "folder").with_suffix(suffix).mkdir()
    loop = tmp_path / f"loop{suffix}"
    loop.symlink_to(loop)
    files = [(tmp_path / "folder").with_suffix(suffix), loop, tmp_path / f"none{suffix}"]
    for number, data in enumerate(
        (b"", b"\0" * 99, b"\xff\xfe\x00", bytes(range(256)), b"\n\n\n", b"x" * 200_000)
    ):
        files.append(tmp_path / f"{number}{suffix}")
        files[-1].write_bytes(data)
    for file in files:
        with pytest.raises(AfoSimError):
            check_file(file)
