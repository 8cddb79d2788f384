"""Non-dominated sorting: which cases no other case is better than in every respect."""

import bisect

import numpy as np


def ranks(points: np.ndarray, lowest: tuple[bool, ...]) -> np.ndarray:
    """Number of the front that each case is on; 0 is the Pareto front.

    A case dominates another if it is as good in all metrics and better in one; a front is what is not
    dominated once the fronts before it are taken away. Equal cases are on the same front.

    Parameters
    ----------
    points : cases and metrics (n, m)
    lowest : for each metric whether low values are good (m,)

    Returns
    -------
    int (n,); −1 where a metric is NaN

    References
    ----------
    Two metrics in O(n log n): Jensen 2003, doi 10.1109/TEVC.2003.817234; more of them front by front: Zhang
    et al. 2015 (ENS-SS), doi 10.1109/TEVC.2014.2308305.
    """
    found = np.full(len(points), -1)
    known = np.isfinite(points).all(axis=1)
    if not known.any():
        return found
    costs = np.where(np.array(lowest), points[known], -points[known])
    distinct, member = np.unique(costs, axis=0, return_inverse=True)  # sorted by the first metric, then on
    front = _two(distinct) if distinct.shape[1] == 2 else _many(distinct)
    found[known] = front[member.ravel()]
    return found


def _two(costs: np.ndarray) -> np.ndarray:
    """Fronts of sorted, distinct costs (n, 2): a front's last point has the least second cost on it."""
    tails: list[float] = []  # of each front, ascending
    found = np.empty(len(costs), int)
    for row, cost in enumerate(costs[:, 1].tolist()):
        front = bisect.bisect_right(tails, cost)
        tails[front : front + 1] = [cost]
        found[row] = front
    return found


def _many(costs: np.ndarray) -> np.ndarray:
    """Fronts of sorted, distinct costs (n, m): no point is dominated by a later one."""
    fronts: list[list[int]] = []
    found = np.empty(len(costs), int)
    for row, cost in enumerate(costs):
        for front, members in enumerate(fronts):  # noqa: B007 the number is used below
            if not (costs[members] <= cost).all(axis=1).any():
                break
        else:
            front = len(fronts)
            fronts.append([])
        fronts[front].append(row)
        found[row] = front
    return found
