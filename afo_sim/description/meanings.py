"""What the fields of a description mean: the texts that stand below them in the classes."""

import ast
import functools
import inspect
import itertools
import sys
from typing import Any


def meaning(kind: type, name: str) -> str:
    """The text below a field of a class, or of the class that has the field first; "" where there is none."""
    return next((texts[name] for base in kind.__mro__ if name in (texts := _texts(base))), "")


@functools.cache
def _texts(kind: type) -> dict[str, str]:
    found = _classes(kind.__module__).get(kind.__qualname__, []) if kind.__module__ != "builtins" else []
    return {
        field.target.id: inspect.cleandoc(below.value.value)
        for field, below in itertools.pairwise(found)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }


@functools.cache
def _classes(module: str) -> dict[str, list[Any]]:
    """The classes of a module by name, as its source writes them; none where there is no source."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError):
        return {}
    return {node.name: node.body for node in tree.body if isinstance(node, ast.ClassDef)}
