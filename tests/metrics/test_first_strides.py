"""The strides after a stop: what is told of them, what is left out, and the rules by which it is."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from afo_sim.metrics import (
    AIR_BEFORE,
    NAMES,
    Metric,
    first_stride_metrics,
    share_left,
    strides_needed,
    undefined,
    words,
)
from afo_sim.metrics.first_strides import AIR_FIRST, LOWEST, NEEDED, UNTIL, made_of


def strides(heights: Sequence[float], air: float = 0.1) -> list[dict[str, Metric]]:
    return [{"toe_clearance": Metric(h, "mm"), "air_per_stride": Metric(air, "g")} for h in heights]


def told(
    heights: Sequence[float], settled: float | None = None, share: float | None = None
) -> dict[str, float]:
    end = None if settled is None else strides([settled])[0]
    found = first_stride_metrics(strides(heights), end, share=share)[0]
    return {name: float(value) for name, value in found.items()}


def test_each_of_the_first_three_is_told() -> None:
    found = told([-5.0, 1.0])
    assert found == {"toe_clearance_stride_1": -5.0, "toe_clearance_stride_2": 1.0, AIR_FIRST: 0.1}


def test_ten_strides_tell_the_lowest_whatever_comes_behind() -> None:
    heights = [-5.0, -1.0, -7.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    assert told(heights)[LOWEST] == told([*heights, -20.0], 30.0)[LOWEST] == -7.0


@pytest.mark.parametrize(
    ("last", "settled", "known"), [(5.0, 5.5, True), (5.0, 5.6, False), (5.0, None, False)]
)
def test_fewer_than_ten_tell_it_only_near_the_settled_one(
    last: float, settled: float | None, known: bool
) -> None:
    found = told([-1.0, 3.0, last], settled)
    assert (LOWEST in found, UNTIL in found) == (known, known)
    assert not known or (found[LOWEST], found[UNTIL]) == (-1.0, 1.0)


def test_the_settled_stride_counts_as_one_of_those_not_walked() -> None:
    """The strides fall towards it: the lowest of ten is no higher than the last that was walked."""
    assert told([3.0, 2.0, 1.2], 1.0)[LOWEST] == 1.0


def test_strides_that_are_not_walked_near_the_settled_one_by_the_share_that_three_show() -> None:
    """A third of the way is left from each to the next: the tenth is lowest, or clear if 3^(1 − k) < 0.01."""
    way = np.array([3.0 ** (1 - k) for k in range(1, 11)])
    share = share_left(np.radians(0.5 * way[:3, np.newaxis]), np.zeros(1))
    assert share == pytest.approx(1.0 / 3.0, rel=1e-12)
    assert told([*(1.0 + way[:3])], 1.0, share)[LOWEST] == pytest.approx(1.0 + way[9], rel=1e-12)
    assert told([*(0.01 - way[:3])], 0.01, share)[UNTIL] == told([*(0.01 - way)], 0.01)[UNTIL] == 5.0


@pytest.mark.parametrize(
    ("way", "share"),
    [
        ([9.0, 3.0, 0.001], 0.0),  # there
        ([9.0, 3.0, 1.0], None),  # too far
        ([0.9, 0.3, 0.15], None),  # nearer by other shares
        ([0.9, -0.3, 0.1], None),  # to and fro
        ([0.1, 0.2, 0.4], None),  # away from it
        ([0.2, 0.1], None),
    ],
)
def test_three_strides_show_how_the_others_near_the_settled_one(
    way: list[float], share: float | None
) -> None:
    """Angles are in degrees from the settled one's."""
    assert share_left(np.radians(way)[:, np.newaxis], np.zeros(1)) == share


@pytest.mark.parametrize(
    ("heights", "until"),
    [
        ([0.0] * 10, 0.0),
        ([-1.0] + [1.0] * 9, 1.0),
        ([1.0, 1.0, -1.0] + [1.0] * 7, 3.0),  # clear at first, and not to stay
        ([-1.0] * 9 + [0.0], 9.0),
    ],
)
def test_clear_is_counted_from_the_last_stride_below_the_floor(heights: list[float], until: float) -> None:
    assert told(heights)[UNTIL] == told(heights, 2.0)[UNTIL] == until


@pytest.mark.parametrize(
    ("heights", "settled", "why"),
    [
        ([-1.0] * 10, 5.0, "still below the floor in stride 10"),
        ([1.0] * 10, -0.1, "0.1 mm below the floor in the settled stride"),
        ([1.0] * 4 + [math.nan] + [1.0] * 5, 1.0, "has no toe clearance"),
    ],
)
def test_never_clear_is_no_number_but_a_sentence(heights: list[float], settled: float, why: str) -> None:
    found, warnings = first_stride_metrics(strides(heights), strides([settled])[0])
    assert UNTIL not in found and [warning for warning in warnings if UNTIL in warning and why in warning]


def test_too_few_strides_are_told_where_there_is_air() -> None:
    warnings = first_stride_metrics(strides([1.0, 2.0]))[1]
    assert [w.split()[0] for w in warnings] == [LOWEST, UNTIL] and all("2 strides" in w for w in warnings)
    bare = [{"toe_clearance": Metric(1.0, "mm")}]
    assert first_stride_metrics(bare) == ({"toe_clearance_stride_1": Metric(1.0, "mm")}, ())
    assert first_stride_metrics(strides([1.0]), wanted={AIR_FIRST}) == ({AIR_FIRST: Metric(0.1, "g")}, ())


def test_air_before_the_first_step_is_told_in_grams() -> None:
    found, _ = first_stride_metrics(strides([1.0]), None, 4.2e-4)
    assert (float(found[AIR_BEFORE]), found[AIR_BEFORE].unit) == (pytest.approx(0.42), "g")


def test_without_a_stride_only_the_air_before_it_is_told() -> None:
    assert first_stride_metrics([]) == ({}, ())
    assert first_stride_metrics([], None, 1e-3) == ({AIR_BEFORE: Metric(1.0, "g")}, ())


def test_as_few_strides_are_needed_as_the_metrics_ask_for() -> None:
    assert strides_needed({"toe_clearance", "air_per_stride"}) == 0
    assert [strides_needed({f"toe_clearance_stride_{k}", "air_work"}) for k in (1, 2, 3)] == [1, 2, 3]
    assert strides_needed({LOWEST}) == strides_needed({UNTIL}) == strides_needed(None) == 10
    assert made_of({AIR_FIRST, "air_work"}) == {"air_per_stride"} and made_of({UNTIL}) == {"toe_clearance"}


def test_what_is_undefined_keeps_its_name_and_unit() -> None:
    assert NAMES == set(NEEDED) == set(undefined(None, True, True))
    assert set(undefined(None, False, False)) == NAMES - {AIR_FIRST, AIR_BEFORE}
    for name, metric in undefined(None, True, True).items():
        assert math.isnan(metric) and metric.unit == words(name).unit
