"""Mutants: one fault each, set into every room, and whether the quick tests near it notice.

    python scripts/mutate.py OUT.jsonl [--mutants 8] [--seed 0] [--rooms physics …] [--against BEFORE.jsonl]

A mutant is one changed expression, set into a copy of the tree. A digest of what it changes draws it, each
kind of fault in turn, so that the sample stays where other lines change or move. Tests near a room run once,
traced, and each mutant gets those that run its line, fastest first, and in the compiled rooms whoever steps a
model. It is "unreached" where none does: there a name that nothing has, in its place, passes as well. Rows
are written as they are found, so that a campaign goes on where it was stopped. With `--against`, the tests
that killed a mutant before are asked first, and nothing is traced for it where they kill it again.
"""

import argparse
import ast
import collections
import hashlib
import itertools
import json
import math
import os
import pathlib
import resource
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

os.environ["NUMBA_NUM_THREADS"] = "1"

import coverage
import mujoco  # noqa: F401  # what each test imports: each process forked from this one has it
import numba  # noqa: F401
import pydantic  # noqa: F401
import pytest
import scipy.optimize
import scipy.signal  # noqa: F401

ROOT = pathlib.Path(__file__).resolve().parents[1]
ROOMS = tuple(sorted(file.parent.name for file in ROOT.glob("afo_sim/*/__init__.py")))
CORE = ("physics", "native", "metrics", "model", "control", "simulation", "description", "gait")
NEAR = {room: (*CORE, "air", "laws_of_nature") if room in CORE else (room,) for room in ROOMS}
COMPILED, STEPPED = ("physics", "native"), "native/install.py"  # who runs this file runs compiled code
FILES, SECONDS, LIMIT = 6, 12.0, 90  # of a mutant's tests: files, traced seconds; and when they are stopped
COMPILE = "from afo_sim.native import compiled_sense, installed\nwith installed():\n    compiled_sense()"
QUICK = ("-q", "-m", "not slow", "-p", "no:cacheprovider")
OUTCOMES = {0: "survived", 5: "unreached", -signal.SIGXCPU: "timeout", -signal.SIGALRM: "timeout"}
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
    """One fault: `after` instead of the bytes from `start` to `end` of a file, and what its line becomes."""

    room: str
    path: str
    line: int
    kind: str
    start: int
    end: int
    after: str
    was: str
    now: str
    within: str  # the function, "" outside of any
    key: str  # a digest of the change, of the function it stands in, and of the seed


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


def places(node: ast.AST, within: str = "") -> Iterator[tuple[str, str, ast.AST, ast.AST]]:
    """Functions, expressions and what each may be replaced by, without annotations, texts, tables of data."""
    texts = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in WORDS
    table = not within and isinstance(node, DATA)
    if texts or table or isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr):
        return
    yield from ((within, kind, getattr(node, "test", node), new) for kind, new in faults(node))
    inside = getattr(node, "name", "lambda") if isinstance(node, ast.FunctionDef | ast.Lambda) else within
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and name not in ("annotation", "returns", "decorator_list"):
                yield from places(child, within if name == "args" else inside)  # defaults are of no call


def mutants(room: str, seed: int) -> Iterator[Mutant]:
    """All of a room."""
    alike: collections.Counter[str] = collections.Counter()
    for file in sorted((ROOT / "afo_sim" / room).rglob("*.py")):
        source, path = file.read_bytes(), file.relative_to(ROOT).as_posix()
        lines = source.splitlines(keepends=True)
        begins = [0, *itertools.accumulate(map(len, lines))]
        for within, kind, old, new in places(ast.parse(source)):
            assert isinstance(old, ast.expr | ast.stmt) and old.end_lineno and old.end_col_offset
            start = begins[old.lineno - 1] + old.col_offset
            end = begins[old.end_lineno - 1] + old.end_col_offset
            text = ast.unparse(ast.fix_missing_locations(new))
            after = text if isinstance(new, ast.stmt) else f"({text})"
            was = lines[old.lineno - 1].decode().strip()
            rest = source[end : begins[old.end_lineno]]
            now = (source[begins[old.lineno - 1] : start] + after.encode() + rest).decode().strip()
            told = f"{seed}\n{within}\n{kind}\n{was}\n{now}"
            alike[told] += 1
            key = hashlib.sha256(f"{told}\n{alike[told]}".encode()).hexdigest()[:16]
            yield Mutant(room, path, old.lineno, kind, start, end, after, was, now, within, key)


def drawn(room: str, number: int, seed: int) -> list[Mutant]:
    """A sample of a room: of each kind its first, then of each its second, by their digests."""
    rank: collections.Counter[str] = collections.Counter()
    found = []
    for mutant in sorted(mutants(room, seed), key=lambda mutant: mutant.key):
        rank[mutant.kind] += 1
        found.append((rank[mutant.kind], mutant.key, mutant))
    return [mutant for *_, mutant in sorted(found)[:number]]


class Tracer:
    """A pytest plugin: CPU seconds and lines of some rooms that each test runs."""

    def __init__(self, package: pathlib.Path, rooms: list[str]):
        self.package = package
        self.seconds: dict[str, float] = collections.defaultdict(float)
        files = [f"{package}/{room}/*" for room in rooms]
        self.coverage = coverage.Coverage(data_file=None, config_file=False, include=files)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Any:
        """Trace a test with its fixtures; one that fails without a mutant counts for ever."""
        begun, name, failed = sum(os.times()[:4]), item.nodeid.split("[")[0], item.session.testsfailed
        self.coverage.start()
        self.coverage.switch_context(name)
        try:
            return (yield)
        finally:
            self.coverage.stop()
            spent = sum(os.times()[:4]) - begun
            self.seconds[name] += spent if item.session.testsfailed == failed else math.inf

    def tests(self) -> Traced:
        """What was seen of the tests that pass."""
        found: Traced = {name: (spent, {}) for name, spent in self.seconds.items() if spent < math.inf}
        data = self.coverage.get_data()
        for file in data.measured_files():
            at = pathlib.Path(file).relative_to(self.package).as_posix()
            for line, names in data.contexts_by_lineno(file).items():
                for name in found.keys() & set(names):
                    found[name][1].setdefault(at, []).append(line)
        return found


class Copy:
    """A copy of the tree, in which tests run with a fault."""

    def __init__(self, folder: pathlib.Path):
        self.root, self.cache, self.writes = folder / "tree", folder / "cache", 0
        shutil.copytree(ROOT, self.root, ignore=shutil.ignore_patterns(".*", "__pycache__", "runs"))
        self.code(lambda: exec(COMPILE))  # to trace the compiler takes minutes

    def code(self, call: Callable[[], object], limit: int = 0) -> int:
        """Exit code of a call in a process of its own, which is stopped after CPU seconds; minus a signal."""
        child = os.fork()
        if not child:
            os.setpgid(0, 0)
            os.chdir(self.root)
            sys.path.insert(0, str(self.root))
            os.environ.update(PYTHONPATH=str(self.root), AFO_SIM_CACHE=str(self.cache))
            for stream in range(3):
                os.dup2(os.open(os.devnull, os.O_RDWR), stream)
            if limit:
                resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
                signal.alarm(10 * limit)
            with suppress(BaseException):
                os._exit(int(call() or 0))  # type: ignore[call-overload]
            os._exit(1)
        _, status = os.waitpid(child, 0)
        with suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        return os.waitstatus_to_exitcode(status)

    def outcome(self, mutant: Mutant, after: str, tests: list[str]) -> str:
        """What tests make of a fault."""
        place = self.root / mutant.path
        source = place.read_bytes()  # of the copy: the tree may change meanwhile
        place.write_bytes(source[: mutant.start] + after.encode() + source[mutant.end :])
        self.writes += 1
        os.utime(place, (1e9 + self.writes,) * 2)  # by which Python knows that its bytecode is stale
        code = self.code(lambda: pytest.main([*QUICK, "-x", *tests]), LIMIT)
        place.write_bytes(source)
        return OUTCOMES.get(code, "killed")

    def traced(self, folder: str) -> Traced:
        """What each quick test of a folder runs of the rooms that it is near to."""
        rooms, out = [room for room in ROOMS if folder in NEAR[room]], self.root / "traced.json"

        def trace() -> None:
            tracer = Tracer(self.root / "afo_sim", rooms)
            pytest.main([*QUICK, f"tests/{folder}"], [tracer])
            out.write_text(json.dumps(tracer.tests()), encoding="utf-8")

        self.code(trace)
        return json.loads(out.read_text(encoding="utf-8"))


def near_tests(folders: tuple[str, ...], copy: Copy, file: pathlib.Path) -> Traced:
    """What tests of folders run; if neither they nor the rooms near them changed, it is read from a file."""
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for folder in folders:
        parts = [f"tests/{folder}", *(f"afo_sim/{room}" for room in ROOMS if folder in NEAR[room])]
        files = sorted(path for part in parts for path in (copy.root / part).rglob("*.py"))
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
        if known.get(folder, [""])[0] != digest:
            print(f"tracing tests/{folder}", file=sys.stderr, flush=True)
            known[folder] = digest, copy.traced(folder)
            file.write_text(json.dumps(known), encoding="utf-8")
    return {test: seen for folder in folders for test, seen in known[folder][1].items()}


def near(mutant: Mutant, tests: Traced) -> list[str]:
    """Tests that run a line, a constant's file, its room compiled; the nearest first, then the fastest."""
    at = mutant.path.removeprefix("afo_sim/")
    own, stem = f"tests/{mutant.room}/", pathlib.Path(at).stem

    def away(test: str) -> tuple[float, ...]:
        seconds, lines = tests[test]
        here = mutant.line in lines.get(at, ())
        return not here, at not in lines, stem not in test, own not in test, seconds

    found: list[str] = []
    spent = 0.0
    for test in sorted(tests, key=away):
        compiled = mutant.room in COMPILED and STEPPED in tests[test][1]
        if mutant.within and away(test)[0] and not compiled:
            continue
        files = {name.split("::")[0] for name in (*found, test)}
        if len(files) <= FILES and (not found or spent + tests[test][0] < SECONDS):
            found.append(test)
            spent += tests[test][0]
    return found


def stands(test: str) -> bool:
    """Whether the tree still has a test."""
    file, _, name = test.partition("::")
    return (ROOT / file).exists() and f"def {name}(" in (ROOT / file).read_text(encoding="utf-8")


def killed_again(mutant: Mutant, before: Row | None, copy: Copy) -> Row | None:
    """The row of a mutant that was killed before, where what is left of its tests kills it still."""
    chosen = [*filter(stands, before["tests"])] if before and before["outcome"] == "killed" else []
    if not chosen or copy.outcome(mutant, mutant.after, chosen) != "killed":
        return None
    return asdict(mutant) | {"outcome": "killed", "tests": chosen}


def tried(mutant: Mutant, tests: Traced, copy: Copy) -> Row:
    """What becomes of a mutant."""
    chosen = near(mutant, tests)
    outcome = copy.outcome(mutant, mutant.after, chosen) if chosen else "unreached"
    unknown = mutant.room in COMPILED or not mutant.within  # whether a test has run it
    if unknown and outcome == "survived" == copy.outcome(mutant, "nowhere", chosen):
        outcome = "unreached"
    return asdict(mutant) | {"outcome": outcome, "tests": chosen}


def rows_of(file: pathlib.Path | None) -> dict[str, Row]:
    """The last row of each mutant in a file."""
    lines = file.read_text(encoding="utf-8").splitlines() if file and file.exists() else []
    return {row["key"]: row for row in map(json.loads, lines)}


def campaign(out: pathlib.Path, sample: list[Mutant], before: dict[str, Row]) -> list[Row]:
    """Try mutants, and write each as it is found; those that a file holds already are read from it."""
    known = rows_of(out)
    with tempfile.TemporaryDirectory() as folder, out.open("a", encoding="utf-8") as file:
        copy = Copy(pathlib.Path(folder))
        for mutant in (mutant for mutant in sample if mutant.key not in known):
            row = killed_again(mutant, before.get(mutant.key), copy)
            if row is None:
                tests = near_tests(NEAR[mutant.room], copy, out.with_name("mutants.traced.json"))
                row = tried(mutant, tests, copy)
            known[mutant.key] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
            print(in_words(row), file=sys.stderr, flush=True)
    return [known[mutant.key] for mutant in sample]


def in_words(row: Row) -> str:
    """A row in a line."""
    return f"{row['outcome']}: {row['path']}:{row['line']}: {row['kind']}: {row['was']} → {row['now']}"


def report(rows: list[Row], before: dict[str, Row]) -> Iterator[str]:
    """Counts of each room, what was not killed, and what was killed before."""
    for room in dict.fromkeys(row["room"] for row in rows):
        counts = collections.Counter(row["outcome"] for row in rows if row["room"] == room)
        yield f"{room}: {counts.total()} mutants: " + ", ".join(f"{n} {what}" for what, n in counts.items())
    yield from (in_words(row) for row in rows if row["outcome"] in ("survived", "unreached"))
    fell = (row for row in rows if row["outcome"] != "killed" == before.get(row["key"], row)["outcome"])
    yield from (f"killed before: {in_words(row)}" for row in fell)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="JSON lines, one a mutant; it goes on with them")
    parser.add_argument("--mutants", type=int, default=8, help="of each room")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=ROOMS)
    parser.add_argument("--against", type=pathlib.Path, help="rows of another state: what was killed there")
    asked = parser.parse_args()
    sample = [mutant for room in asked.rooms for mutant in drawn(room, asked.mutants, asked.seed)]
    before = rows_of(asked.against)
    print("\n".join(report(campaign(asked.out, sample, before), before)))


if __name__ == "__main__":
    main()
