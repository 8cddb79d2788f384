"""The compiled kernels against plain NumPy, against Python, and beside functions of a user's own."""

import threading
from typing import Any

import numpy as np
import pytest
from synthetic_walk import MASS, walk_columns, with_orthosis

import afo_sim as afo
from afo_sim.metrics import Stride, walk_metrics, walking
from afo_sim.metrics.kernel import READS, SILENT, plan, told
from afo_sim.metrics.metric import Of, functions_of
from afo_sim.metrics.strides import events, strides

Columns = dict[str, np.ndarray]


def rough(seed: int, step: float) -> Columns:
    """The written walk with an orthosis and smooth chance in every signal, of whole strides between rows."""
    chance = np.random.default_rng(seed)
    columns = walk_columns(3.3, step=step, start=0.2)
    columns = with_orthosis(columns, 3.0 * np.ones_like(columns["time"]))
    columns |= {"sole/pitch": columns["ankle/angle"] - columns["shank/angle"] + 0.02}
    columns |= {"sole/height_less_extended": columns["sole/height"].copy()}
    columns |= {"ankle/moment/inversion": np.zeros_like(columns["time"])}
    columns |= {"gait/ground_force_z": columns["ground/force/z"], "foot/toe_load": columns["ground/force/z"]}
    way = columns["gait/stride"] + columns["gait/phase"]
    for name in sorted(columns.keys() - {"time", "gait/phase", "gait/stride"}):
        size = np.ptp(columns[name]) + 0.1
        waves = chance.normal(size=(2, 6)) / np.arange(1, 7)
        turns = 2.0 * np.pi * np.outer(way, np.arange(1, 7))
        columns[name] = columns[name] + 0.05 * size * (
            np.cos(turns) @ waves[0] + np.sin(3.1 * turns) @ waves[1]
        )
    return columns


def told_of(stride: Stride) -> dict[str, float]:
    return stride.values(walking._functions(tuple(stride.columns)))


CASES = [(1, 2e-3), (2, 1.9e-3), (3, 3.1e-3), (4, 0.7e-3)]


@pytest.mark.parametrize(("seed", "step"), CASES)
def test_the_hard_ones_are_those_of_plain_numpy(seed: int, step: float) -> None:
    columns = rough(seed, step)
    for stride in strides(columns, step, MASS):
        found, rows = told_of(stride), stride.rows
        phase, way = stride.phase, columns["gait/stride"] + columns["gait/phase"] - stride.number

        # the quantile, and the lowest local minimum while the foot is fast
        speed = np.gradient(columns["ankle/position/x"][rows], step)
        fast = speed >= np.quantile(speed, 0.75)
        np.testing.assert_array_equal(stride.fast, fast)
        begun = stride.toe_off + 0.1 * (1.0 - stride.toe_off)
        height, best = columns["sole/height"][rows], None
        near = round(0.01 * len(height))
        for k in np.flatnonzero(fast & (phase >= begun) & (phase < stride.upright)):
            if 0 < k < len(height) - 1 and height[k] < height[k - 1]:
                lowest = height[k] == height[max(0, k - near) : k + near + 1].min()
                best = k if lowest and (best is None or height[k] < height[best]) else best
        at_fastest = np.interp(stride.fastest, way, columns["sole/height"])
        event = best is not None and height[best] <= at_fastest
        expected = height[best] if event else at_fastest
        assert found["toe_clearance"] == pytest.approx(1e3 * expected, rel=1e-9)
        assert found["swings_without_toe_event"] == 100.0 * (not event)

        # an integral and peaks over 10 ms between rows, on grids that have the rows and the ends
        off, first, last = (np.interp(x, way, np.arange(len(way))) for x in (stride.toe_off, 0.4, 1.0))
        places = np.unique([first, *np.arange(np.ceil(first), off), off])
        torque, angle = (
            np.interp(places, np.arange(len(way)), columns[f"ankle/{of}"])
            for of in ("moment/orthosis", "angle")
        )
        against = np.maximum(torque, 0.0)
        work = 0.5 * (against[1:] + against[:-1]) * np.diff(angle)
        taken = np.maximum(-work, 0.0).sum() / MASS
        assert found["work_against_push_off"] == pytest.approx(taken, rel=1e-7)
        length, means = 10e-3 / step, []
        ends = [first, off - length, *np.arange(np.ceil(first), off - length)]
        ends += [end - length for end in np.arange(np.ceil(first + length), off)]
        for start in ends:
            grid = np.unique([start, *np.arange(np.ceil(start), start + length), start + length])
            values = np.interp(grid, np.arange(len(way)), columns["ankle/moment/orthosis"])
            means.append(np.trapezoid(values, grid) / length)
        assert found["torque_against_push_off"] == pytest.approx(max(0.0, *means), rel=1e-9)

        # flow by shares of the first and the last step
        start = np.interp(0.0, way, np.arange(len(way)))
        shares = np.ones(len(phase))
        shares[0] += rows.start - start
        shares[-1] -= rows.stop - last
        grams = 1e3 * step * np.maximum(columns["valve/front_inlet/mass_flow"][rows], 0.0) @ shares
        assert found["air_per_stride"] == pytest.approx(grams, rel=1e-9)


@pytest.mark.parametrize(("seed", "step"), CASES)
def test_compiled_and_in_python_they_give_the_same_bits(seed: int, step: float) -> None:
    columns = rough(seed, step)
    functions = (events, *functions_of(Of.STRIDE, Of.WORN))
    planned = plan(functions, tuple(columns))
    kernels = [function for function in functions if function in READS]
    for stride in strides(columns, step, MASS):
        one, other = stride._block(planned.reads), stride._block(planned.reads)
        fast = told(planned.calls, one, len(planned.names))
        out = np.full(len(fast), SILENT)
        for function, (_, place) in zip(kernels, planned.calls, strict=True):
            function(other, out[place // 8 :])
        np.testing.assert_array_equal(fast, out)


def test_each_reads_the_columns_that_it_needs() -> None:
    """A column that a kernel does not name is no number to it."""
    columns = rough(1, 2e-3)
    stride = strides(columns, 2e-3, MASS)[1]
    every = told_of(stride)
    for function in functions_of(Of.STRIDE, Of.WORN):
        alone = stride.values((function,))
        assert alone and alone == {name: every[name] for name in alone}, function.__name__


def test_a_recording_without_a_column_has_no_such_metrics() -> None:
    columns = rough(1, 2e-3)
    full = told_of(strides(columns, 2e-3, MASS)[1])
    for name in (
        "gait/ankle_moment",
        "ankle/velocity",
        "gait/needed_moment",
        "ankle/position/x",
        "toe/height",
    ):
        lacking = {key: values for key, values in columns.items() if key != name}
        found = walk_metrics(lacking, 2e-3, MASS).totals
        assert "stance" in found and not full.keys() <= found.keys(), name
        assert all(np.isfinite(metric) for metric in found.values())


def test_what_depends_on_no_number_is_none() -> None:
    """A simulated column of NaN leaves each metric as it is, or undefined."""
    columns = rough(1, 2e-3)
    clean = told_of(strides(columns, 2e-3, MASS)[1])
    for name in sorted(columns.keys() - {"time", "gait/phase", "gait/stride"}):
        if name.startswith(("gait/", "shank/", "foot/", "valve/front_inlet/coil")):  # recorded, or counted
            continue
        spoilt = columns | {name: np.full_like(columns["time"], np.nan)}
        found = told_of(strides(spoilt, 2e-3, MASS)[1])
        other = {key: value for key, value in found.items() if np.isfinite(value) and value != clean[key]}
        assert not other, name


def test_a_metric_of_ones_own_stands_beside_them_from_threads_too() -> None:
    @afo.metric("own_mean_angle", "deg", "Mean angle after mid-stride")
    def late(of: Any) -> float:
        return float(np.degrees(of["ankle/angle"][of["gait/phase"] > 0.5].mean()))

    afo.register(late)
    columns, found = rough(1, 2e-3), []
    wanted = frozenset({"own_mean_angle", "toe_clearance"})
    work = [
        threading.Thread(target=lambda: found.append(walk_metrics(columns, 2e-3, MASS, wanted=wanted)))
        for _ in range(4)
    ]
    for each in work:
        each.start()
    for each in work:
        each.join()
    assert len(found) == 4 and all(one.totals == found[0].totals for one in found)
    totals = found[0].totals
    way, angle = columns["gait/phase"], np.degrees(columns["ankle/angle"])
    counted = strides(columns, 2e-3, MASS)[1:]
    means = [angle[s.rows][way[s.rows] > 0.5].mean() for s in counted]
    assert float(totals["own_mean_angle"]) == pytest.approx(np.mean(means), abs=1e-12)
    assert totals["own_mean_angle"].unit == "deg" and "toe_clearance" in totals
    assert set(totals) <= {*wanted, "strides_counted", "lowest_toe_clearance", "walked_clearance_change"}
