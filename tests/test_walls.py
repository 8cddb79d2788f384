"""Who may know what: the imports are read, not trusted."""

import ast
import functools
import pathlib
import re

import pytest
from documents import TEXT

from afo_sim.common import EXTRAS, WRITTEN

PACKAGE = pathlib.Path(__file__).parents[1] / "afo_sim"
SOURCES = sorted(PACKAGE.rglob("*.py"))

GROUND = {"common"}
PLANT = GROUND | {"physics", "gait", "description", "native"}
CORE = PLANT | {"control", "metrics", "model", "simulation"}
# {room: the rooms that it may import}; each stands below the room itself
ROOMS = {
    "common": set(),
    "physics": GROUND,
    "gait": GROUND,
    "description": GROUND | {"physics", "gait"},
    "native": GROUND | {"physics"},
    "control": GROUND | {"physics", "description"},
    "metrics": GROUND | {"gait", "physics"},
    "model": PLANT,
    "simulation": CORE - {"simulation"},
    # extras: a user may leave each of them out
    "gait_lab": GROUND | {"gait"},
    "legs": PLANT | {"model"},
    "export": CORE | {"legs"},
    "walker": CORE,
    "study": CORE | {"walker"},
    "lab": CORE,
    "rl": CORE | {"legs"},
    "show": CORE | {"study", "lab", "gait_lab", "legs", "walker"},
    "studio": CORE | {"study", "gait_lab", "show"},
    "cli": CORE | {"studio", "gait_lab", "legs", "export", "study", "lab", "rl", "show", "walker"},
}
PLAIN = {"math", "functools", "numba", "numpy", "collections", "dataclasses", "typing", "afo_sim"}
PLAIN |= {"ctypes", "lazy_loader"}  # to call machine code; the face
PLAIN |= {
    "importlib",
    "inspect",
    "itertools",
    "linecache",
    "pkgutil",
    "re",
    "sys",
    "types",
}  # what the registry of laws is made with
SEALING = {"write_sealed", "write_json", "write_parquet", "parquet_writer"}
FACES = {
    "__init__.py",
    "__main__.py",
    "pytest_plugin.py",
    "environments.py",
    "bridge.py",
}  # of the package: they may open any room
# Arrows that still run upward, and circles that are still closed.
UPWARD: set[tuple[str, str]] = set()
CIRCLES: set[frozenset[str]] = set()


@functools.cache
def tree(path: pathlib.Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@functools.cache
def imported(path: pathlib.Path, *, at_top: bool = False) -> frozenset[str]:
    nodes = tree(path).body if at_top else ast.walk(tree(path))
    found = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(found)


def module_name(path: pathlib.Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in SOURCES}


def arrows() -> dict[str, set[str]]:
    """{module: the modules of this package that it imports}, also inside functions and for types only."""
    return {
        name: {other for other in imported(path) if other in MODULES} - {name, "afo_sim"}
        for name, path in MODULES.items()
    }


def room_of(module: str) -> str:
    return module.split(".")[1]


def upward(graph: dict[str, set[str]]) -> set[tuple[str, str]]:
    """Arrows into a room that the table does not allow."""
    found = set()
    for name, others in graph.items():
        if MODULES[name].relative_to(PACKAGE).as_posix() in FACES:
            continue
        room = room_of(name)
        assert room in ROOMS, f"{name} stands in no room of the table"
        found |= {(name, o) for o in others if room_of(o) not in ROOMS[room] | {room}}
    return found


def circles(graph: dict[str, set[str]]) -> set[frozenset[str]]:
    """Sets of modules that reach each other."""

    def reach(start: str) -> set[str]:
        seen, todo = set(), [start]
        while todo:
            for other in graph.get(todo.pop(), ()):
                if other not in seen:
                    seen.add(other)
                    todo.append(other)
        return seen

    reached = {name: reach(name) for name in graph}
    return {
        frozenset(o for o in reached[name] if name in reached[o])
        for name in graph
        if name in reached[name]
    }  # fmt: skip


def test_imports_run_downward() -> None:
    found = upward(arrows())
    assert found <= UPWARD, "these imports run upward: " + ", ".join(f"{a} → {b}" for a, b in sorted(found))
    assert found >= UPWARD, "these exceptions are no longer needed"


def test_there_is_no_circle() -> None:
    graph = {a: {b for b in others if (a, b) not in UPWARD} for a, others in arrows().items()}
    found = circles(graph)
    assert found == CIRCLES, "these modules import each other: " + "; ".join(map(str, map(sorted, found)))


def test_the_core_imports_no_extra_at_its_top() -> None:
    """Neither rooms nor libraries; what the core can do with a library, it imports when it is asked."""
    libraries = {package for packages in EXTRAS.values() for package in packages}
    for path in SOURCES:
        if path.relative_to(PACKAGE).parts[0] in CORE:
            used = {name.split(".")[0] for name in imported(path, at_top=True)}
            own = {"numba"} if path.name == "compiling.py" else set()  # imported to compile alone
            assert not used & libraries - own, path


def test_table_of_rooms_runs_downward() -> None:
    floors = list(ROOMS)
    for room, others in ROOMS.items():
        assert all(floors.index(other) < floors.index(room) for other in others), room
    assert {path.name for path in PACKAGE.iterdir() if path.is_dir()} - {"__pycache__"} == set(ROOMS)


def test_walls_tell_a_broken_rule() -> None:
    graph = {"afo_sim.physics.law": {"afo_sim.show.style"}, "afo_sim.show.style": {"afo_sim.physics.law"}}
    MODULES.setdefault("afo_sim.show.style", PACKAGE / "show" / "style.py")
    assert upward(graph) == {("afo_sim.physics.law", "afo_sim.show.style")}
    assert circles(graph) == {frozenset(graph)}


def test_no_room_is_called_like_a_public_name() -> None:
    import afo_sim

    assert not set(ROOMS) & set(afo_sim.__all__)


def users_of(package: str) -> set[str]:
    return {
        path.relative_to(PACKAGE).as_posix()
        for path in SOURCES
        if any(name.split(".")[0] == package for name in imported(path))
    }


def test_physics_knows_no_simulator() -> None:
    for path in (PACKAGE / "physics").rglob("*.py"):
        for name in imported(path):
            assert name.split(".")[0] in PLAIN, (path, name)


@pytest.mark.parametrize(
    ("package", "allowed"),
    [
        ("rerun", "show/rerun/"),
        ("rerun_cli", "show/rerun/"),
        ("pint", "common/units.py"),
        ("typer", "cli/"),
        ("jinja2", "show/"),
        ("matplotlib", "show/"),  # the fit still draws itself
    ],
)
def test_one_place_knows(package: str, allowed: str | tuple[str, ...]) -> None:
    users = users_of(package)
    assert users
    assert all(user.startswith(allowed) for user in users), users


def test_only_native_knows_a_callback() -> None:
    users = {path.name for path in SOURCES if "set_mjcb_" in path.read_text(encoding="utf-8")}
    assert users <= {"install.py", "struct_layout.py"}
    assert "install.py" in users


def test_only_native_knows_a_slot() -> None:
    readable = {"MUSCLE_CHAMBER", "MUSCLE_NOMINAL_LENGTH", "MUSCLE_SERIES_LENGTH"}  # by name, for reading
    for path in SOURCES:
        if path.parent.name != "native":
            assert not any(name.startswith("afo_sim.native.slots") for name in imported(path)), path
            used = set(re.findall(r"native\.((?:MUSCLE|CHAMBER|VALVE|PASSIVE)_\w+)", path.read_text("utf-8")))
            assert used <= readable, path


def test_command_line_imports_nothing_heavy() -> None:
    heavy = {"mujoco", "numba", "numpy", "scipy", "matplotlib", "rerun", "pint", "pydantic", "pyarrow"}
    commands = [f"cli/{path.name}" for path in (PACKAGE / "cli").glob("*.py")]
    for name in (*commands, "common/errors.py", "__init__.py"):
        assert not heavy & {i.split(".")[0] for i in imported(PACKAGE / name, at_top=True)}


def faces() -> dict[str, dict[str, str]]:
    """{room: {name: its module}} of the tables in `__init__.pyi`."""
    return {
        stub.parent.name: {
            alias.name: f"afo_sim.{stub.parent.name}.{node.module}"
            for node in ast.parse(stub.read_text(encoding="utf-8")).body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        for stub in PACKAGE.glob("*/__init__.pyi")
    }


def test_a_name_of_a_face_is_imported_through_it() -> None:
    """By other rooms, tests and scripts, so that a room may move what stands behind its face."""
    folders = (PACKAGE, PACKAGE.parent / "tests", PACKAGE.parent / "scripts")
    past, tables = [], faces()
    for path in (path for folder in folders for path in folder.rglob("*.py")):
        room = path.relative_to(PACKAGE).parts[0] if path.is_relative_to(PACKAGE) else ""
        for other, names in tables.items():
            if other != room:
                through = {f"{module}.{name}" for name, module in names.items()}
                past += [f"{path}: {each}" for each in imported(path) & through]
    assert not past, "\n".join(past)


def test_a_face_names_only_what_another_room_uses() -> None:
    tests = (PACKAGE.parent / "tests", PACKAGE.parent / "scripts")
    words = {
        path: set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
        for path in (*SOURCES, *(path for folder in tests for path in folder.rglob("*.py")))
    }
    for room, names in faces().items():
        outside = set().union(*(w for path, w in words.items() if not path.is_relative_to(PACKAGE / room)))
        assert not names.keys() - outside - set(re.findall(r"\w+", TEXT)), room


def test_files_are_written_by_the_writers_alone() -> None:
    """A file that is read again is sealed, and its kind is one of the writer's list."""
    named: set[str] = set()
    for path in set(SOURCES) - {PACKAGE / "common" / "writing.py", PACKAGE / "common" / "sealing.py"}:
        nodes = list(ast.walk(tree(path)))
        calls = [node for node in nodes if isinstance(node, ast.Call)]
        past = {call.func.attr for call in calls if isinstance(call.func, ast.Attribute)}
        assert not past & {"write_text", "write_bytes"}, f"{path}: afo_sim.common has functions for it"
        for call in calls:
            name = call.func.id if isinstance(call.func, ast.Name) else ""
            if name in SEALING and f"afo_sim.common.{name}" in imported(path):
                assert len(call.args) > 2, f"{path}:{call.lineno}: {name} names no kind of WRITTEN"
                named |= {
                    node.value for node in nodes if isinstance(node, ast.Constant) and node.value in WRITTEN
                }
        if path != PACKAGE / "common" / "phase_table.py":
            assert not {f"afo_sim.common.sealing.{name}" for name in SEALING} & imported(path), path
    assert named | {"stride"} == set(WRITTEN)  # of common/phase_table.py
