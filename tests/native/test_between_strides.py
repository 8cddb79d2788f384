"""Small matrices of the search for the settled stride, against NumPy's."""

import numpy as np
import pytest

from afo_sim.native.air_slopes import solve
from afo_sim.native.between_strides import STILL, least_squares

RANDOM = np.random.default_rng(7)


def shut(size: int) -> np.ndarray:
    """1 − slopes of air of which the second node is shut in: two rows and columns of almost nothing."""
    found = np.eye(size) - 0.4 * RANDOM.uniform(-1.0, 1.0, (size, size))
    found[:, 2:4], found[2:4] = 0.0, 1e-9 * RANDOM.uniform(-1.0, 1.0, (2, size))
    return found


MATRICES = {
    **{f"{size} numbers": RANDOM.uniform(-1.0, 1.0, (size, size)) for size in (2, 4, 10, 16)},
    "one node is shut": shut(6),
    "nothing": np.zeros((4, 4)),
    "alike columns": np.ones((4, 4)),
    "just counted": np.diag([1.0, 1.1 * STILL]),
    "just not counted": np.diag([1.0, 0.9 * STILL]),
}


@pytest.mark.parametrize("name", MATRICES)
def test_least_squares_are_those_of_a_singular_value_decomposition(name: str) -> None:
    matrix, n = MATRICES[name], len(MATRICES[name])
    wanted = RANDOM.uniform(-1.0, 1.0, n)
    s = np.concatenate([matrix.ravel(), np.zeros(n * n), wanted, np.full(n, np.nan)])
    least_squares(s, 0, n * n, 2 * n * n, 2 * n * n + n, n)
    expected = np.linalg.lstsq(matrix, wanted, rcond=STILL)[0]
    assert s[-n:] == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_what_is_no_number_is_not_taken_for_nothing() -> None:
    s = np.array([np.nan, 0.0, 0.0, 1.0] + 4 * [0.0] + [1.0, 1.0] + [0.0, 0.0])
    least_squares(s, 0, 4, 8, 10, 2)
    assert np.isnan(s[-2:]).any()


@pytest.mark.parametrize("size", [2, 5, 12])
def test_equations_are_solved_with_pivots(size: int) -> None:
    matrix, right = RANDOM.uniform(-1.0, 1.0, (2, size, size))
    matrix[0, 0] = 0.0
    s = np.concatenate([matrix.ravel(), right.ravel()])
    solve(s, 0, size * size, size)
    assert s[size * size :] == pytest.approx(np.linalg.solve(matrix, right).ravel(), rel=1e-9)
