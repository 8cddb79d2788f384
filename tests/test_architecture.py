"""The page on architecture is true: its recipes work, its files exist, its picture is that of the code."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass

import pytest
from documents import PAGES, ROOT, script

PAGE = PAGES["architecture"]
SCRIPT = ROOT / "scripts" / "architecture.py"
COPIED = ("afo_sim", "models", "gait_data")
TEXT_LINES = 6  # that a recipe may have beside its example

# Runs every check in one process, since the changed code compiles once for each; prints {section: complaint}.
RUN_CHECKS = """
import json, pathlib, sys, traceback
import afo_sim
assert pathlib.Path(afo_sim.__file__).parents[1] == pathlib.Path(sys.argv[1]).parent, afo_sim.__file__
said = {}
checks, out = map(pathlib.Path, sys.argv[1:])
for section, code in json.loads(checks.read_text(encoding="utf-8")).items():
    try:
        exec(compile(code, f"<check of: {section}>", "exec"), {"__name__": "__main__"})
        said[section] = ""
    except BaseException:
        said[section] = traceback.format_exc()
out.write_text(json.dumps(said), encoding="utf-8")
"""


@dataclass(frozen=True)
class Block:
    """A fenced block of a recipe: what its first line says, and the lines after it."""

    section: str
    order: str
    code: str

    @property
    def file(self) -> str:
        """The file that it goes to; "" of a check."""
        found = re.match(r"(?:new file|add to|in): ([^,\s]+)", self.order)
        return found[1] if found else ""

    def apply(self, root: pathlib.Path) -> None:
        """Change a tree."""
        path, (kind, _, rest) = root / self.file, self.order.partition(": ")
        if kind == "new file":
            assert not path.exists(), f"{self.section}: {self.file} is there already"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(self.code, encoding="utf-8")
            return
        text = path.read_text(encoding="utf-8")
        if kind == "add to":
            path.write_text(f"{text.rstrip()}\n\n\n{self.code}", encoding="utf-8")
            return
        lines, (where, _, sought) = text.splitlines(True), rest.partition(", ")[2].partition(": ")
        at = [k for k, line in enumerate(lines) if sought in line]
        assert kind == "in" and where in ("after", "instead of"), f"{self.section}: {self.order}"
        assert len(at) == 1, f"{self.section}: {len(at)} lines of {self.file} contain {sought!r}"
        lines[at[0] + (where == "after") : at[0] + 1] = self.code.splitlines(True)
        path.write_text("".join(lines), encoding="utf-8")


def sections() -> dict[str, str]:
    """{title: text} of the recipes."""
    recipes = PAGE.partition("# To add something")[2]
    return {part.partition("\n")[0]: part for part in re.split(r"^## ", recipes, flags=re.M)[1:]}


def blocks() -> list[Block]:
    return [
        Block(title, order.strip(), code)
        for title, text in sections().items()
        for order, code in re.findall(r"^```(?:python|toml)\n# ([^\n]*)\n(.*?)^```", text, flags=re.M | re.S)
    ]


@pytest.mark.slow
def test_every_recipe_works(tmp_path: pathlib.Path) -> None:
    """Their checks hold in a tree to which all of them are applied."""
    for name in COPIED:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    found = blocks()
    for block in found:
        if block.file:
            block.apply(tmp_path)
    checks, said = tmp_path / "checks.json", tmp_path / "said.json"
    codes = {block.section: block.code for block in found if block.order == "check"}
    checks.write_text(json.dumps(codes), encoding="utf-8")
    there = os.environ | {"PYTHONPATH": str(tmp_path), "AFO_SIM_CACHE": "off"}
    command = [sys.executable, "-c", RUN_CHECKS, str(checks), str(said)]
    done = subprocess.run(command, cwd=tmp_path, env=there, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0 and said.is_file(), done.stdout + done.stderr
    told = json.loads(said.read_text(encoding="utf-8"))
    assert told == dict.fromkeys(sections(), "")


def test_every_recipe_is_short_and_has_a_check() -> None:
    assert len(sections()) == 10
    for title, text in sections().items():
        kinds = [block.order.partition(":")[0] for block in blocks() if block.section == title]
        assert kinds[-1] == "check" and kinds.count("check") == 1 and len(kinds) > 1, title
        (check,) = [block.code for block in blocks() if block.section == title and block.order == "check"]
        assert "assert " in check, title
        assert text.count("```") == 2 * len(kinds), f"{title}: a block without a first line that says where"
        words = re.sub(r"^```.*?^```", "", text.partition("\n")[2], flags=re.M | re.S)
        assert len([line for line in words.splitlines() if line.strip()]) <= TEXT_LINES, title


def test_every_line_that_a_recipe_looks_for_stands_once(tmp_path: pathlib.Path) -> None:
    """Without a run: the blocks apply, and what they make of Python is Python."""
    for block in blocks():
        if block.file:
            path = tmp_path / block.file
            if not path.exists() and not block.order.startswith("new file"):
                path.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / block.file, path)
            block.apply(tmp_path)
    for path in [*tmp_path.rglob("*.py"), *tmp_path.rglob("*.pyi")]:
        compile(path.read_text(encoding="utf-8"), str(path), "exec")


def test_every_file_that_the_page_names_exists() -> None:
    made = {block.file for block in blocks() if block.order.startswith("new file")}
    named = set(re.findall(r"`(?:python )?([\w./]+/[\w.]*)`", PAGE)) | {b.file for b in blocks() if b.file}
    assert len(named) > 40
    assert not [name for name in sorted(named - made) if not (ROOT / name).exists()]


@pytest.mark.slow
def test_the_picture_is_that_of_the_code() -> None:
    """In a new process: what a process has run before changes which rooms a run enters first."""
    there = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(SCRIPT), "--check"]
    done = subprocess.run(command, env=there, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_the_table_has_every_room_and_its_extra() -> None:
    from afo_sim.common import EXTRAS

    rooms = script("architecture")
    table = dict(re.findall(r"^\| `(\w+)` \| [^|]+ \|\s*(.*?)\s*\|$", PAGE, flags=re.M))
    assert set(table) == set(rooms.rooms())
    assert {room for room, extra in table.items() if not extra} == set(rooms.BLUE)
    assert (
        set(re.findall(r"`(\w+)`", " ".join(table.values()))) == EXTRAS.keys() - {"compile"}
        and "`compile`" in PAGE
    )


def test_the_picture_tells_the_page_its_order() -> None:
    """The text for those who do not see the picture has the order that the picture has."""
    picture = (ROOT / "docs" / "architecture.svg").read_text(encoding="utf-8")
    numbered = re.findall(
        r'id="(\w+)" x=[^>]*/>(?:\n<text[^\n]*)*\n<circle[^\n]*\n<text[^>]*>(\d+)<', picture
    )
    way = [room for room, _ in sorted(numbered, key=lambda pair: int(pair[1]))]
    assert way and f"enters the rooms: {', '.join(way)}](architecture.svg)" in PAGE
