"""95 % intervals and correlations of fitted parameters, and refusals of what data lack."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.stats import t

from afo_sim.common import Notice


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def memory(curves: Iterable[np.ndarray], square: float) -> float:
    """Correlation of neighbouring errors along curves [-]; `square` is the sum of all their squares."""
    products = sum(float(np.sum(curve[..., 1:] * curve[..., :-1])) for curve in curves)
    return products / square if square else 0.0


def intervals(jacobian: np.ndarray, variance: float, freedom: float) -> tuple[np.ndarray, np.ndarray]:
    """Half-widths of the 95 % intervals, and correlations, of linearised least squares."""
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1e-300
    _, singular, rows = np.linalg.svd(jacobian / norms, full_matrices=False)
    inverse = (rows.T / np.maximum(singular, 1e-15) ** 2) @ rows
    spread = np.sqrt(np.diag(inverse))
    with np.errstate(over="ignore"):  # a parameter without any effect
        half = t.ppf(0.975, freedom) * np.sqrt(variance) * spread / norms
    return half, inverse / np.outer(spread, spread)


def unidentified(code: str, names: Sequence[str], reason: str) -> Notice:
    """A notice on parameters whose intervals are refused; `data` has their names and the reason."""
    together = ", ".join(names)
    return Notice(code, "{subject}: {reason}", subject=together, names=tuple(names), reason=reason)


def refused(verdict: Iterable[Notice]) -> set[str]:
    """The names that a verdict is about."""
    return {name for notice in verdict for name in notice.data["names"]}


class Believed:
    """A fit whose parameters have intervals, but for those that its verdict refuses."""

    verdict: tuple[Notice, ...]

    @property
    def identifiable(self) -> bool:
        """True where the data identify every parameter."""
        return not self.verdict

    def reason(self, name: str) -> str:
        """The reason why a parameter's interval is refused; "" where it is not."""
        notice = next((notice for notice in self.verdict if name in notice.data["names"]), None)
        if notice is None:
            return ""
        others = ", ".join(other for other in notice.data["names"] if other != name)
        text: str = notice.data["reason"].removeprefix("not identifiable: ")
        return f"{text} (with {others})" if others else text
