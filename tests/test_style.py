"""What passes no review elsewhere: types that say nothing, errors caught whole, words by multiplication."""

import ast
import functools
import pathlib
import re
from collections.abc import Callable, Iterator

import pytest

PACKAGE = pathlib.Path(__file__).parents[1] / "afo_sim"
SOURCES = sorted(PACKAGE.rglob("*.py"))
STATED = re.compile(r"`Any`")  # in the docstring of a module, or of its room: what it stands for there


@functools.cache
def lines(path: pathlib.Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines()


@functools.cache
def tree(path: pathlib.Path) -> ast.Module:
    return ast.parse("\n".join(lines(path)))


def says_why(path: pathlib.Path, line: int) -> bool:
    """Whether there is a comment on a line or on the one before it."""
    return any("# " in text for text in lines(path)[max(line - 2, 0) : line])


def where(path: pathlib.Path, node: ast.expr | ast.stmt | ast.excepthandler) -> str:
    return f"{path.relative_to(PACKAGE)}:{node.lineno}"


def bare_any(path: pathlib.Path) -> Iterator[str]:
    """Where a module says Any, but for what it names once and for all with the reason beside it."""
    room, *inside = path.relative_to(PACKAGE).parts
    stating = {path, PACKAGE / room / "__init__.py"} if inside else {path}
    if any(STATED.search(ast.get_docstring(tree(each)) or "") for each in stating):
        return
    for statement in tree(path).body:
        named = isinstance(statement, ast.Assign) and says_why(path, statement.lineno)
        for node in () if named else ast.walk(statement):
            if isinstance(node, ast.Name) and node.id == "Any":
                yield where(path, node)


def words_by_multiplication(path: pathlib.Path) -> Iterator[str]:
    """Texts and lists times a condition, and functions without a name that are given one."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            for part, times in ((node.left, node.right), (node.right, node.left)):
                condition = isinstance(times, ast.Compare | ast.BoolOp) or (
                    isinstance(times, ast.Call) and ast.unparse(times.func) == "bool"
                )
                text = isinstance(part, ast.Constant) and isinstance(part.value, str)
                if condition and (text or isinstance(part, ast.JoinedStr | ast.List)):
                    yield where(path, node)
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.Lambda):
            yield from (where(path, node) for name in node.targets if isinstance(name, ast.Name))


@pytest.mark.parametrize("find", [bare_any, words_by_multiplication])
def test_a_type_and_a_condition_are_written_as_such(find: Callable[[pathlib.Path], Iterator[str]]) -> None:
    found = [place for path in SOURCES for place in find(path)]
    assert not found, "\n".join(found)


def test_whatever_is_caught_whole_says_why() -> None:
    """Also Ctrl-C and sys.exit() are: a handler of all that names none of it has a comment."""
    found = [
        where(path, node)
        for path in SOURCES
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ExceptHandler)
        and (node.type is None or ast.unparse(node.type) in ("Exception", "BaseException"))
        and not says_why(path, node.lineno)
    ]
    assert not found, "\n".join(found)


def test_an_ignored_type_says_which_and_why() -> None:
    ignored = [
        (path.relative_to(PACKAGE), k, text)
        for path in SOURCES
        for k, text in enumerate(lines(path), 1)
        if "type: ignore" in text
    ]
    bare = [f"{path}:{k}" for path, k, text in ignored if not re.search(r"ignore\[[a-z-]+\]  # \S", text)]
    assert ignored and not bare, "\n".join(bare)
