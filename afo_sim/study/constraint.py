"""Constraints of a sweep: a small language of comparisons between parameters and quantities.

    fill_start < fill_end - 0.05
    pressure <= '5 bar' or arm < '5 cm'

Names of parameters, numbers, 'quantities', + - * /, < <= > >= == !=, and, or, not, parentheses.
"""

import ast
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from afo_sim.common import Dimension, FloatOrArray, InputError, dimension, nearest_name, read_any_quantity
from afo_sim.study.parameter import Choice, OwnSeed, Parameter

_LANGUAGE = "parameters, numbers, 'quantities', + - * /, comparisons, and, or, not, parentheses"
_LONGEST = 1000  # characters
_DEEPEST = 60  # levels of nesting
_LARGEST = sys.float_info.max  # a whole number may be beyond any float
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


# whether it holds; how far it is from that, and how far from the contrary
Judged = tuple[FloatOrArray, FloatOrArray, FloatOrArray]


@dataclass(frozen=True)
class Constraint:
    """A condition on the parameters that every case of a sweep fulfils."""

    text: str
    units: dict[str, str]
    words: dict[str, tuple[str, ...]]

    def holds(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Mask of the cases that fulfil it (n,)."""
        return self._judged(values)[0]

    def excess(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Distance of cases from fulfilling it: 0 where they do, more where more is missing."""
        holds, off = self._judged(values)
        off = np.nan_to_num(off, nan=np.inf)
        return np.where(holds, 0.0, np.maximum(off, np.finfo(np.float64).tiny))

    def _judged(self, values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, FloatOrArray]:
        with np.errstate(all="ignore"):  # what is not a number compares as false
            holds, off, _ = _Evaluation(self, values).judged(_parse(self.text))
        return np.broadcast_to(holds, (len(next(iter(values.values()), "-")),)), off


def read_constraint(text: str, parameters: Sequence[Parameter]) -> Constraint:
    """Read a constraint, and see that it makes sense."""
    varied = [p for p in parameters if not isinstance(p.spread, OwnSeed)]
    words = {p.name: p.spread.values for p in varied if isinstance(p.spread, Choice) and p.words}
    units = {p.name: p.unit for p in varied if not p.words}
    constraint = Constraint(text.strip(), units, words)  # type: ignore[arg-type]  # of choices of words
    constraint.holds({n: np.ones(1) for n in units} | {n: np.array(w[:1], object) for n, w in words.items()})
    return constraint


def _all(parts: Sequence[Judged]) -> Judged:
    """Several conditions at once: what is missing adds up, and the contrary of one is that of all."""
    holds, off, contrary = (np.broadcast_arrays(*each) for each in zip(*parts, strict=True))
    return np.logical_and.reduce(holds), np.add.reduce(off), np.minimum.reduce(contrary)


def _not(condition: Judged) -> Judged:
    holds, off, contrary = condition
    return np.logical_not(holds), contrary, off


class _Evaluation:
    """One walk through a constraint's text over the values of all cases."""

    def __init__(self, constraint: Constraint, values: Mapping[str, np.ndarray]):
        self.constraint, self.values, self.text = constraint, values, constraint.text

    def judged(self, node: ast.expr) -> Judged:
        """Something that is true or false."""
        if isinstance(node, ast.BoolOp):
            parts = [self.judged(part) for part in node.values]
            return _all(parts) if isinstance(node.op, ast.And) else _not(_all([_not(part) for part in parts]))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return _not(self.judged(node.operand))
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            pairs = zip(sides, node.ops, sides[1:], strict=False)
            return _all([self._compared(left, op, right, node) for left, op, right in pairs])
        self._refuse(node, "is neither true nor false", "a comparison, or several with and, or, not")

    def _compared(self, left: ast.expr, op: ast.cmpop, right: ast.expr, whole: ast.expr) -> Judged:
        """A comparison; it is off by a share of the larger side, or of words by one."""
        if type(op) not in COMPARISONS:
            self._refuse(whole, "is not a comparison that is known here", "< <= > >= == !=")
        for name, other in ((left, right), (right, left)):
            if isinstance(name, ast.Name) and name.id in self.constraint.words:
                same = self.values[name.id] == self._word(name.id, other)
                if not isinstance(op, ast.Eq | ast.NotEq):
                    self._refuse(whole, f"orders words: {name.id!r} is a word", "== or !=")
                alike = same, np.where(same, 0.0, 1.0), np.where(same, 1.0, 0.0)
                return alike if isinstance(op, ast.Eq) else _not(alike)
        a, b, _ = self._alike(left, right, whole)
        if isinstance(op, ast.Eq | ast.NotEq):
            off, contrary = np.abs(a - b), np.zeros(np.shape(a - b))
        else:
            off, contrary = a - b, b - a
        if isinstance(op, ast.NotEq | ast.Gt | ast.GtE):
            off, contrary = contrary, off
        largest = np.maximum(np.abs(a), np.abs(b))
        shares = (np.where(each > 0.0, each / largest, each * 0.0) for each in (off, contrary))
        return COMPARISONS[type(op)](a, b), *shares

    def _word(self, name: str, node: ast.expr) -> FloatOrArray:
        """The other side of a comparison of words: one of the words, or another such parameter."""
        if isinstance(node, ast.Name) and node.id in self.constraint.words:
            return self.values[node.id]
        words = self.constraint.words[name]
        word = node.value if isinstance(node, ast.Constant) else None
        if word not in words:
            nearest = nearest_name(word, words) if isinstance(word, str) else None
            self._refuse(node, f"is not a value of {name!r}", ", ".join(map(repr, words)), nearest)
        return word

    def _number(self, node: ast.expr) -> tuple[FloatOrArray, Dimension]:
        """Numbers [SI] and what they measure, as far as the text states."""
        if isinstance(node, ast.Name):
            names = [*self.constraint.units, *self.constraint.words]
            if node.id not in names:
                nearest = nearest_name(node.id, names)
                self._refuse(node, "is not a parameter that a constraint can name", ", ".join(names), nearest)
            if node.id in self.constraint.words:
                self._refuse(node, "is a word, not a number", f"{node.id} == 'a word'")
            return self.values[node.id], dimension(self.constraint.units[node.id])
        if isinstance(node, ast.Constant):
            value = node.value
            if isinstance(value, str):
                try:
                    return np.float64(read_any_quantity(value)[0]), read_any_quantity(value)[1]
                except ValueError as error:
                    self._refuse(node, str(error))
            if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
                self._refuse(node, "is not a number", _LANGUAGE)
            return np.float64(value), ()
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            value, measures = self._number(node.operand)
            return -value if isinstance(node.op, ast.USub) else value, measures
        if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
            if isinstance(node.op, ast.Add | ast.Sub):
                a, b, measures = self._alike(node.left, node.right, node)
            else:
                (a, of_a), (b, of_b) = self._number(node.left), self._number(node.right)
                powers, sign = dict(of_a), 1 if isinstance(node.op, ast.Mult) else -1
                for name, power in of_b:
                    powers[name] = powers.get(name, 0.0) + sign * power
                measures = tuple(sorted((name, power) for name, power in powers.items() if power))
            return ARITHMETIC[type(node.op)](a, b), measures
        self._refuse(node, "is not allowed in a constraint", _LANGUAGE)

    def _alike(
        self, left: ast.expr, right: ast.expr, whole: ast.expr
    ) -> tuple[FloatOrArray, FloatOrArray, Dimension]:
        """Both sides of what puts numbers of one dimension together, and the dimension."""
        (a, of_a), (b, of_b) = self._number(left), self._number(right)
        if of_a != of_b:
            sides = ((left, of_a), (right, of_b))
            words = []
            for each, of in sides:
                base = "·".join(name if power == 1.0 else f"{name}^{power:g}" for name, power in of)
                words.append(f"{self._part(each)!r} in {base or 'bare numbers'}")
            problem = f"combines different dimensions: {' and '.join(words)}"
            self._refuse(whole, problem, "the same dimension on both sides")
        return a, b, of_a

    def _part(self, node: ast.expr) -> str:
        return ast.get_source_segment(self.text, node) or self.text

    def _refuse(
        self, node: ast.expr, problem: str, allowed: str = "", nearest: str | None = None
    ) -> NoReturn:
        *before, line = self.text.split("\n")[: node.lineno]
        at = sum(len(each) + 1 for each in before) + len(line.encode()[: node.col_offset].decode())
        _refuse(self.text, at, f"{self._part(node)!r} {problem}", allowed, nearest)


def _refuse(text: str, at: int, problem: str, allowed: str = "", nearest: str | None = None) -> NoReturn:
    told = f"at character {at + 1}: {problem}"
    raise InputError(told, field="constraints", value=text, allowed=allowed, nearest=nearest)


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
