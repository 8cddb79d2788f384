"""Mutants: one fault each, set into the rooms that compute, and whether the tests notice it.

    python scripts/mutate.py OUT.jsonl [--mutants 150] [--seed 0] [--rooms physics native …] [--again]

A mutant is one changed expression: another operator, boundary, sign, constant, function or branch. Each room
has its share, and in it each kind of fault. All tests of `TESTS` run once, traced, so that each mutant gets
those that run its line, fastest first. Who steps a model runs the compiled rooms too. Mutants are set into a
copy of the tree. What a survivor changed is then replaced by a name that nothing has: where tests pass that
as well, its code is not run or not compiled anew, and it is "unreached". Rows are written as they are found,
so that a campaign goes on where it was stopped.
"""

import argparse
import ast
import collections
import contextlib
import hashlib
import itertools
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]
ROOMS = ("physics", "native", "metrics", "model", "control")
COMPILED, STEPPED = ("physics", "native"), "native/install.py"  # who runs this file runs compiled code
TESTS = (*ROOMS, "air", "description", "laws_of_nature")
FILES, SECONDS, LIMIT = 6, 20.0, 90.0  # of a mutant's tests: files, traced seconds; and when they are stopped
TRACED = 2000  # lines of a function in a test that are looked at, before it goes on untraced
TRACE = "import sys; sys.path.append('scripts'); import mutate; mutate.trace(sys.argv[1])"
OUTCOMES = {0: "survived", 5: "unreached", 124: "timeout", 137: "timeout"}  # exit codes of pytest, timeout
COMPILE = "from afo_sim.native import compiled_sense, installed\nwith installed():\n    compiled_sense()"
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
BOUNDARIES = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OPPOSITES = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq}
OPPOSITES |= {ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}
TWINS = {"min": "max", "sin": "cos", "minimum": "maximum", "argmin": "argmax", "floor": "ceil"}
TWINS |= {other: name for name, other in TWINS.items()}
WORDS = {"InputError", "Notice", "Provenance", "LawParameter", "field"}  # calls that say what others compute
DATA = (ast.Tuple, ast.List, ast.Dict, ast.Set)  # outside functions: tables of data
Traced = dict[str, tuple[float, dict[str, list[int]]]]  # {test: (seconds, {file: lines})}
Row = dict[str, Any]


@dataclass(frozen=True)
class Mutant:
    """One fault: `after` instead of the bytes from `start` to `end` of a file, in a line."""

    room: str
    path: str
    line: int
    kind: str
    start: int
    end: int
    after: str

    def written(self, source: bytes, after: str) -> bytes:
        """The file with a fault."""
        return source[: self.start] + after.encode() + source[self.end :]


def faults(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """What an expression may be replaced by."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in OPERATORS:
            yield "operator", ast.BinOp(left, OPERATORS[type(op)](), right)
            if isinstance(op, ast.Add | ast.Sub):
                yield "term left out", left
        case ast.AugAssign(target, op, value) if type(op) in OPERATORS:
            yield "operator", ast.AugAssign(target, OPERATORS[type(op)](), value)
        case ast.Compare(left, [op], rest):
            for kind, table in (("boundary", BOUNDARIES), ("negation", OPPOSITES)):
                if type(op) in table:
                    yield kind, ast.Compare(left, [table[type(op)]()], rest)
        case ast.BoolOp(op, values):
            yield "and, or", ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.UnaryOp(ast.USub(), operand):
            yield "sign", operand
        case ast.Constant(float(value)):
            yield "constant", ast.Constant(1.1 * value or 0.1)
        case ast.Constant(value) if type(value) is int:
            yield from (("constant", ast.Constant(value + by)) for by in (1, -1))
        case ast.Call(ast.Name(name) | ast.Attribute(_, name), [only]) if name in ("abs", "fabs"):
            yield "abs", only
        case ast.Call(ast.Name(name) | ast.Attribute(_, name), given, words) if name in TWINS:
            called = ast.unparse(node.func).removesuffix(name) + TWINS[name]
            yield "function", ast.Call(ast.Name(called), given, words)
        case ast.If() | ast.IfExp() | ast.While():
            for answer in (False, True)[: 1 if isinstance(node, ast.While) else 2]:
                yield "branch", ast.Constant(answer)


def places(node: ast.AST, top: bool = True) -> Iterator[tuple[str, ast.AST, ast.AST]]:
    """Expressions and what each may be replaced by, without annotations, texts and tables of data."""
    texts = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in WORDS
    if texts or isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr) or (top and isinstance(node, DATA)):
        return
    yield from ((kind, getattr(node, "test", node), new) for kind, new in faults(node))
    top = top and not isinstance(node, ast.FunctionDef | ast.Lambda)
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and name not in ("annotation", "returns", "decorator_list"):
                yield from places(child, top)


def mutants(room: str) -> Iterator[Mutant]:
    """All of a room."""
    for file in sorted((ROOT / "afo_sim" / room).rglob("*.py")):
        source, path = file.read_bytes(), file.relative_to(ROOT).as_posix()
        begins = [0, *itertools.accumulate(map(len, source.splitlines(keepends=True)))]
        for kind, old, new in places(ast.parse(source)):
            assert isinstance(old, ast.expr | ast.stmt) and old.end_lineno and old.end_col_offset
            start = begins[old.lineno - 1] + old.col_offset
            end = begins[old.end_lineno - 1] + old.end_col_offset
            text = ast.unparse(ast.fix_missing_locations(new))
            after = text if isinstance(new, ast.stmt) else f"({text})"
            yield Mutant(room, path, old.lineno, kind, start, end, after)


def drawn(rooms: list[str], number: int, seed: int) -> list[Mutant]:
    """A sample: rooms in turn, in each a kind at random, then a mutant of that kind."""
    draw, found = random.Random(seed), []
    left = {room: sorted(mutants(room), key=lambda mutant: mutant.kind) for room in rooms}
    for k in range(number):
        own = left[rooms[k % len(rooms)]]
        kind = draw.choice(sorted({mutant.kind for mutant in own}))
        found.append(own.pop(draw.choice([i for i, mutant in enumerate(own) if mutant.kind == kind])))
    return found


class Tracer:
    """A pytest plugin: seconds and lines of the rooms that each test runs."""

    def __init__(self, package: pathlib.Path):
        self.package = f"{package}{os.sep}"
        self.rooms = tuple(f"{self.package}{room}{os.sep}" for room in ROOMS)
        self.tests: Traced = {}
        self.failed: set[str] = set()
        self._lines: dict[int, collections.Counter[int]] = {}  # by the code's id
        self._known: dict[int, CodeType] = {}  # also keeps an id from being another's

    def _traced(self, frame: FrameType, event: str, argument: Any) -> Any:
        code = frame.f_code
        lines = self._lines.get(id(code))
        if lines is None:
            self._known[id(code)] = code
            own = code.co_filename.startswith(self.rooms)
            lines = self._lines[id(code)] = collections.Counter({0: 0 if own else TRACED})
        if lines[0] >= TRACED:
            return None
        lines.update((0, frame.f_lineno))
        return self._traced

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Any:
        """Trace a test with its fixtures."""
        self._lines, begun = {}, time.perf_counter()
        sys.settrace(self._traced)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            name = item.nodeid.split("[")[0]
            seconds, found = self.tests.get(name, (0.0, {}))
            for code, lines in self._lines.items():
                file = self._known[code].co_filename.removeprefix(self.package)
                if self._known[code].co_filename.startswith(self.rooms):
                    found[file] = sorted(lines.keys() | found.get(file, []))
            self.tests[name] = seconds + time.perf_counter() - begun, found

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note what fails without a mutant."""
        if report.failed:
            self.failed.add(report.nodeid.split("[")[0])


def trace(folder: str) -> None:
    """Run tests of this tree, and print what `Tracer` has seen."""
    tracer = Tracer(ROOT / "afo_sim")
    with contextlib.redirect_stdout(sys.stderr):
        pytest.main(["-q", "-p", "no:cacheprovider", folder], [tracer])
    print(json.dumps({name: seen for name, seen in tracer.tests.items() if name not in tracer.failed}))


class Copy:
    """A copy of the tree, in which tests run with a fault."""

    def __init__(self, folder: pathlib.Path):
        self.root, self.writes = folder / "tree", 0
        shutil.copytree(ROOT, self.root, ignore=shutil.ignore_patterns(".*", "__pycache__", "runs"))
        own = {"PYTHONPATH": str(self.root), "AFO_SIM_CACHE": str(folder / "cache"), "NUMBA_NUM_THREADS": "1"}
        self.environment = os.environ | own
        self.call("-c", COMPILE)  # to trace the compiler takes minutes

    def call(self, *words: str | float, limit: float = 0.0) -> subprocess.CompletedProcess[str]:
        """Python, stopped with its children after a limit [s]; 0: never."""
        line = map(str, ("timeout", "--kill-after=1", limit, sys.executable, *words))
        return subprocess.run([*line], cwd=self.root, env=self.environment, capture_output=True, text=True)

    def outcome(self, mutant: Mutant, after: str, tests: list[str]) -> str:
        """What tests make of a fault."""
        source, place = (ROOT / mutant.path).read_bytes(), self.root / mutant.path
        self._write(place, mutant.written(source, after))
        code = self.call("-m", "pytest", "-qx", "-p", "no:cacheprovider", *tests, limit=LIMIT).returncode
        self._write(place, source)
        return OUTCOMES.get(code, "killed")

    def _write(self, place: pathlib.Path, content: bytes) -> None:
        """A source with a time of its own, by which Python knows that its bytecode is stale."""
        self.writes += 1
        place.write_bytes(content)
        os.utime(place, (1e9 + self.writes,) * 2)


def traced(copy: Copy, file: pathlib.Path) -> Traced:
    """What each test of `TESTS` runs; of a room in which no file of tests is new it is read from a file."""
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for room in TESTS:
        files = sorted((copy.root / "tests" / room).rglob("*.py"))
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
        if known.get(room, [""])[0] != digest:
            print(f"tracing tests/{room}", file=sys.stderr, flush=True)
            known[room] = digest, json.loads(copy.call("-c", TRACE, f"tests/{room}").stdout)
            file.write_text(json.dumps(known), encoding="utf-8")
    return {test: seen for _, tests in known.values() for test, seen in tests.items()}


def near(mutant: Mutant, tests: Traced) -> list[str]:
    """Tests that run a mutant's line, or its room compiled; the nearest first, of these the fastest.

    Of a line that none runs, such as a constant's, those that run its file or are named like it.
    """
    at = mutant.path.removeprefix("afo_sim/")
    own, stem = f"tests/{mutant.room}/", pathlib.Path(at).stem

    def away(test: str) -> tuple[float, ...]:
        seconds, lines = tests[test]
        here = mutant.line in lines.get(at, ())
        return not here, at not in lines, stem not in test, own not in test, seconds

    found: list[str] = []
    spent, run = 0.0, any(not away(test)[0] for test in tests)
    for test in sorted(tests, key=away):
        if run and away(test)[0] and not (mutant.room in COMPILED and STEPPED in tests[test][1]):
            continue
        files = {name.split("::")[0] for name in (*found, test)}
        if len(files) <= FILES and (not found or spent + tests[test][0] < SECONDS):
            found.append(test)
            spent += tests[test][0]
    return found


def tried(mutant: Mutant, tests: Traced, copy: Copy) -> Row:
    """What becomes of a mutant, and its line before and after."""
    chosen, begun = near(mutant, tests), time.perf_counter()
    outcome = copy.outcome(mutant, mutant.after, chosen)
    if outcome == "survived" == copy.outcome(mutant, "nowhere", chosen):
        outcome = "unreached"
    source = (ROOT / mutant.path).read_bytes()
    texts = (text.decode().split("\n") for text in (source, mutant.written(source, mutant.after)))
    was, now = (lines[mutant.line - 1].strip() for lines in texts)
    seconds = round(time.perf_counter() - begun, 1)
    return asdict(mutant) | {"outcome": outcome, "was": was, "now": now, "tests": chosen, "seconds": seconds}


def campaign(out: pathlib.Path, sample: list[Mutant], again: bool) -> list[Row]:
    """Try mutants, and write each as it is found; those that a file holds already are read from it."""
    rows = [json.loads(line) for line in out.read_text("utf-8").splitlines()] if out.exists() else []
    known = {row["key"]: row for row in rows if row["outcome"] == "killed" or not again}
    with tempfile.TemporaryDirectory() as folder, out.open("a", encoding="utf-8") as file:
        copy = Copy(pathlib.Path(folder))
        tests = traced(copy, out.with_suffix(".traced.json"))
        for k, mutant in enumerate(sample):
            if str(mutant) not in known:
                row = known[str(mutant)] = {"key": str(mutant)} | tried(mutant, tests, copy)
                file.write(json.dumps(row) + "\n")
                file.flush()
                print(f"{k + 1} of {len(sample)}: {in_words(row)}", file=sys.stderr, flush=True)
    return [known[str(mutant)] for mutant in sample]


def in_words(row: Row) -> str:
    """A row in a line."""
    return f"{row['outcome']}: {row['path']}:{row['line']}: {row['kind']}: {row['was']} → {row['now']}"


def report(rows: list[Row]) -> Iterator[str]:
    """Counts of each room, and what was not killed."""
    for room in dict.fromkeys(row["room"] for row in rows):
        counts = collections.Counter(row["outcome"] for row in rows if row["room"] == room)
        yield f"{room}: {counts.total()} mutants: " + ", ".join(f"{n} {what}" for what, n in counts.items())
    yield from (in_words(row) for row in rows if row["outcome"] in ("survived", "unreached"))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="JSON lines, one a mutant; it goes on with them")
    parser.add_argument("--mutants", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=ROOMS)
    parser.add_argument("--again", action="store_true", help="try those again that were not killed")
    asked = parser.parse_args()
    sample = drawn(asked.rooms, asked.mutants, asked.seed)
    print("\n".join(report(campaign(asked.out, sample, asked.again))))


if __name__ == "__main__":
    main()
