"""The root of a function: as SciPy finds it, to the last bit and in as many evaluations."""

import math
from collections.abc import Callable

import pytest
from scipy.optimize import brentq

from afo_sim.physics import root

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "straight": lambda x: 2.0 * x - 0.7,
    "flat at the root": lambda x: (x - 0.3) ** 3 + 1e-4 * (x - 0.3),
    "steep at the root": lambda x: math.copysign(abs(x - 0.3) ** 0.2, x - 0.3),
    "a step": lambda x: 1.0 if x > 0.3 else -1e-3,
    "exponential": lambda x: math.exp(9.0 * x) - 5.0,
    "not monotone": lambda x: math.sin(5.0 * x) + x - 0.2,
    "zero at an end": lambda x: x + 1.0,
    "zero at an end, negative beyond": lambda x: -1.0 - x,
}


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("ends", [(-1.0, 2.0), (1.5, -1.0)])
@pytest.mark.parametrize("tolerance", [2e-12, 1e-14, 1e-6])
def test_root_is_scipys(name: str, ends: tuple[float, float], tolerance: float) -> None:
    asked: list[list[float]] = [[], []]
    found = []
    for places, of in zip(asked, (root, lambda f, a, b, xtol: brentq(f, a, b, xtol=xtol)), strict=True):
        found.append(of(lambda x, places=places: places.append(x) or FUNCTIONS[name](x), *ends, tolerance))
    assert found[0] == found[1] and asked[0] == asked[1]


@pytest.mark.parametrize(
    "of", [lambda x: x * x + 1.0, lambda x: math.nan, lambda x: math.nan if x > -1.0 else -1.0]
)
def test_no_change_of_sign_and_no_number_are_refused(of: Callable[[float], float]) -> None:
    with pytest.raises(ValueError, match="no change of sign"):
        root(of, -1.0, 2.0)
