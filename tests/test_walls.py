"""Who may know what: the imports are read, not trusted."""

import ast
import pathlib
import re

import pytest

PACKAGE = pathlib.Path(__file__).parents[1] / "afo_sim"
SOURCES = sorted(PACKAGE.rglob("*.py"))


def imported(path: pathlib.Path, *, at_top: bool = False) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = tree.body if at_top else ast.walk(tree)
    found = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def users_of(package: str) -> set[str]:
    return {
        path.relative_to(PACKAGE).as_posix()
        for path in SOURCES
        if any(name.split(".")[0] == package for name in imported(path))
    }


def test_physics_knows_no_simulator() -> None:
    for path in (PACKAGE / "physics").glob("*.py"):
        for name in imported(path):
            assert name.split(".")[0] in {"math", "numba", "collections", "dataclasses", "afo_sim"}, (
                path,
                name,
            )
            assert not name.startswith("afo_sim.") or name.startswith(
                ("afo_sim.physics", "afo_sim.common.units")
            )


@pytest.mark.parametrize(
    ("package", "allowed"),
    [
        ("rerun", {"view"}),
        ("rerun_cli", {"view"}),
        ("pint", {"units.py"}),
        ("typer", {"cli"}),
        ("ezc3d", {"gait_readers"}),
    ],
)
def test_one_module_knows(package: str, allowed: set[str]) -> None:
    assert {user.split("/")[0] for user in users_of(package)} == allowed


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
    for name in (*commands, "errors.py", "__init__.py"):
        assert not heavy & {i.split(".")[0] for i in imported(PACKAGE / name, at_top=True)}


def test_public_names_resolve() -> None:
    import afo_sim

    for name in afo_sim.__all__:
        assert callable(getattr(afo_sim, name))
