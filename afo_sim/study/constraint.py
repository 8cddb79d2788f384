"""Constraints of a sweep: a small language of comparisons between parameters and quantities.

    fill_start < fill_end - 0.05
    pressure <= '5 bar' or arm < '5 cm'

Names of parameters, numbers, 'quantities', + - * /, < <= > >= == !=, and, or, not, parentheses.
"""

import ast
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from afo_sim.common import Dimension, InputError, dimension, nearest_name, read_any_quantity
from afo_sim.study.parameter import Choice, OwnSeed, Parameter

_LANGUAGE = "parameters, numbers, 'quantities', + - * /, comparisons, and, or, not, parentheses"
_LONGEST = 1000  # characters
_DEEPEST = 60  # levels of nesting
COMPARISONS: dict[type[ast.cmpop], np.ufunc] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}
ARITHMETIC: dict[type[ast.operator], np.ufunc] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
}


@dataclass(frozen=True)
class Constraint:
    """A condition on the parameters that every case of a sweep fulfils."""

    text: str
    units: dict[str, str]
    words: dict[str, tuple[str, ...]]

    def holds(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Mask of the cases that fulfil it (n,)."""
        with np.errstate(all="ignore"):  # what is not a number compares as false
            found = _Evaluation(self, values).truth(_parse(self.text))
        return np.broadcast_to(found, (len(next(iter(values.values()), "-")),))

    def excess(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Distance of cases from fulfilling it: 0 where they do, more where more is missing."""
        with np.errstate(all="ignore"):
            found = np.nan_to_num(_Evaluation(self, values).excess(_parse(self.text)), nan=np.inf)
        return np.where(self.holds(values), 0.0, np.maximum(found, np.finfo(np.float64).tiny))


def read_constraint(text: str, parameters: Sequence[Parameter]) -> Constraint:
    """Read a constraint, and see that it makes sense."""
    varied = [p for p in parameters if not isinstance(p.spread, OwnSeed)]
    words = {p.name: p.spread.values for p in varied if isinstance(p.spread, Choice) and p.words}
    units = {p.name: p.unit for p in varied if not p.words}
    constraint = Constraint(text.strip(), units, words)  # type: ignore[arg-type]
    constraint.holds({n: np.ones(1) for n in units} | {n: np.array(w[:1], object) for n, w in words.items()})
    return constraint


@dataclass(frozen=True)
class _Operand:
    """Numbers [SI] and what they measure, as far as the text states: a word's values measure nothing."""

    value: Any
    measures: Dimension
    text: str


class _Evaluation:
    """One walk through a constraint's text over the values of all cases."""

    def __init__(self, constraint: Constraint, values: Mapping[str, np.ndarray]):
        self.constraint, self.values, self.text = constraint, values, constraint.text

    def truth(self, node: ast.expr) -> Any:
        """The value of something that is true or false."""
        if isinstance(node, ast.BoolOp):
            parts = [self.truth(part) for part in node.values]
            return (np.logical_and if isinstance(node.op, ast.And) else np.logical_or).reduce(
                np.broadcast_arrays(*parts)
            )
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return np.logical_not(self.truth(node.operand))
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            pairs = zip(sides, node.ops, sides[1:], strict=False)
            return np.logical_and.reduce(
                np.broadcast_arrays(*(self._compared(left, op, right, node) for left, op, right in pairs))
            )
        self._refuse(node, "is neither true nor false", "a comparison, or several with and, or, not")

    def excess(self, node: ast.expr, negated: bool = False) -> Any:
        """Distance of something that `truth` can read from being true, or `negated`, false."""
        if isinstance(node, ast.UnaryOp):
            return self.excess(node.operand, not negated)
        if isinstance(node, ast.BoolOp):
            parts = [self.excess(part, negated) for part in node.values]
            all_of_them = isinstance(node.op, ast.And)
        else:
            assert isinstance(node, ast.Compare)
            sides = [node.left, *node.comparators]
            pairs = zip(sides, node.ops, sides[1:], strict=False)
            parts = [self._off(left, op, right, negated) for left, op, right in pairs]
            all_of_them = True
        joined = np.add if all_of_them != negated else np.minimum
        return joined.reduce(np.broadcast_arrays(*parts))

    def _off(self, left: ast.expr, op: ast.cmpop, right: ast.expr, negated: bool) -> Any:
        """Error of a comparison, as a share of the larger side."""
        a, b = self._number(left).value, self._number(right).value
        if isinstance(op, ast.Eq | ast.NotEq):
            off = np.abs(a - b) if isinstance(op, ast.Eq) != negated else np.zeros(np.shape(a - b))
        else:
            off = a - b if isinstance(op, ast.Lt | ast.LtE) != negated else b - a
        return np.where(off > 0.0, off / np.maximum(np.abs(a), np.abs(b)), off * 0.0)

    def _compared(self, left: ast.expr, op: ast.cmpop, right: ast.expr, whole: ast.expr) -> Any:
        if type(op) not in COMPARISONS:
            self._refuse(whole, "is not a comparison that is known here", "< <= > >= == !=")
        for name, other in ((left, right), (right, left)):
            if isinstance(name, ast.Name) and name.id in self.constraint.words:
                same = self.values[name.id] == self._word(name.id, other)
                if not isinstance(op, ast.Eq | ast.NotEq):
                    self._refuse(whole, f"orders words: {name.id!r} is a word", "== or !=")
                return same if isinstance(op, ast.Eq) else np.logical_not(same)
        a, b = self._number(left), self._number(right)
        self._require_alike(a, b, whole)
        return COMPARISONS[type(op)](a.value, b.value)

    def _word(self, name: str, node: ast.expr) -> Any:
        """The other side of a comparison of words: one of the words, or another such parameter."""
        if isinstance(node, ast.Name) and node.id in self.constraint.words:
            return self.values[node.id]
        words = self.constraint.words[name]
        word = node.value if isinstance(node, ast.Constant) else None
        if word not in words:
            nearest = nearest_name(word, words) if isinstance(word, str) else None
            self._refuse(node, f"is not a value of {name!r}", ", ".join(map(repr, words)), nearest)
        return word

    def _number(self, node: ast.expr) -> _Operand:
        """The value of something that is a number or a quantity."""
        text = ast.get_source_segment(self.text, node) or self.text
        if isinstance(node, ast.Name):
            return _Operand(*self._parameter(node), text)
        if isinstance(node, ast.Constant):
            return _Operand(*self._constant(node), text)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            inner = self._number(node.operand)
            return _Operand(
                -inner.value if isinstance(node.op, ast.USub) else inner.value, inner.measures, text
            )
        if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
            a, b = self._number(node.left), self._number(node.right)
            if isinstance(node.op, ast.Add | ast.Sub):
                self._require_alike(a, b, node)
                measures = a.measures
            else:
                measures = _product(a.measures, b.measures, 1 if isinstance(node.op, ast.Mult) else -1)
            return _Operand(ARITHMETIC[type(node.op)](a.value, b.value), measures, text)
        self._refuse(node, "is not of the language of constraints", _LANGUAGE)

    def _parameter(self, node: ast.Name) -> tuple[Any, Dimension]:
        names = [*self.constraint.units, *self.constraint.words]
        if node.id not in names:
            nearest = nearest_name(node.id, names)
            self._refuse(node, "is not a parameter that a constraint can name", ", ".join(names), nearest)
        if node.id in self.constraint.words:
            self._refuse(node, "is a word, not a number", f"{node.id} == 'a word'")
        return self.values[node.id], dimension(self.constraint.units[node.id])

    def _constant(self, node: ast.Constant) -> tuple[Any, Dimension]:
        value = node.value
        if isinstance(value, str):
            try:
                return np.float64(read_any_quantity(value)[0]), read_any_quantity(value)[1]
            except ValueError as error:
                self._refuse(node, str(error))
        if isinstance(value, bool) or not isinstance(value, int | float) or not _finite(value):
            self._refuse(node, "is not a number", _LANGUAGE)
        return np.float64(value), ()

    def _require_alike(self, a: _Operand, b: _Operand, node: ast.expr) -> None:
        if a.measures != b.measures:
            words = " and ".join(f"{o.text!r} in {_in_words(o.measures)}" for o in (a, b))
            self._refuse(node, f"puts together what has different dimensions: {words}", "alike on both sides")

    def _refuse(
        self, node: ast.expr, problem: str, allowed: str = "", nearest: str | None = None
    ) -> NoReturn:
        part = ast.get_source_segment(self.text, node) or self.text
        line = self.text.split("\n")[node.lineno - 1].encode()
        at = sum(len(before) + 1 for before in self.text.split("\n")[: node.lineno - 1])
        _refuse(
            self.text, at + len(line[: node.col_offset].decode()), f"{part!r} {problem}", allowed, nearest
        )


def _refuse(text: str, at: int, problem: str, allowed: str = "", nearest: str | None = None) -> NoReturn:
    raise InputError(
        f"at character {at + 1}: {problem}",
        field="constraints",
        value=text,
        allowed=allowed,
        nearest=nearest,
    )


def _parse(text: str) -> ast.expr:
    """The text as Python's grammar has it; nothing of it is ever run."""
    if len(text) > _LONGEST or not text.strip():
        _refuse(text, 0, "is empty" if not text.strip() else "is too long", f"1 to {_LONGEST} characters")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what is refused later on
            tree = ast.parse(text, mode="eval").body
        level: list[ast.AST] = [tree]
        depth = 0  # to which it is nested
        while level:
            level, depth = [child for node in level for child in ast.iter_child_nodes(node)], depth + 1
    except SyntaxError as error:
        _refuse(text, max((error.offset or 1) - 1, 0), f"cannot be read: {error.msg}", _LANGUAGE)
    except (ValueError, RecursionError, MemoryError):
        _refuse(text, 0, "cannot be read", _LANGUAGE)
    if depth > _DEEPEST:
        _refuse(text, 0, "is nested too deeply", f"up to {_DEEPEST} levels")
    return tree


def _finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond any float
        return False


def _product(a: Dimension, b: Dimension, sign: int) -> Dimension:
    powers = dict(a)
    for name, power in b:
        powers[name] = powers.get(name, 0.0) + sign * power
    return tuple(sorted((name, power) for name, power in powers.items() if power))


def _in_words(measures: Dimension) -> str:
    """A dimension, as base units."""
    text = "·".join(name if power == 1.0 else f"{name}^{power:g}" for name, power in measures)
    return text or "bare numbers"
