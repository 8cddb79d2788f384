"""Looking at a sweep: its table, numbers against closed forms, figures, what is said of failures."""

import pathlib
import sys
from itertools import combinations
from typing import Any

import matplotlib
import numpy as np
import pytest
from figures import leave_blank
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.figure import Figure
from matplotlib.image import imread
from sweep_case import saltelli, write_sweep

from afo_sim.cli.sweep import show_folder
from afo_sim.common import InputError
from afo_sim.show import style
from afo_sim.show import sweep_figures as figures
from afo_sim.study import Results, analysis, read, scales
from afo_sim.study.findings import EXACT, effects_of, findings, indices

PI = {"x1": (-np.pi, np.pi), "x2": (-np.pi, np.pi), "x3": (-np.pi, np.pi)}
FILES = {"distributions.png", "main_effects.png", "maps.png", "pareto.png"}


def drawn(results: Results, folder: pathlib.Path, metrics: list[str]) -> list[pathlib.Path]:
    return figures.write_figures(findings(results, scales.chosen(results, metrics)), folder)


def bare(columns: dict[str, np.ndarray]) -> dict[str, tuple[np.ndarray, str]]:
    return {name: (values, "") for name, values in columns.items()}


def ishigami(x: dict[str, np.ndarray], a: float = 7.0, b: float = 0.1) -> np.ndarray:
    return np.sin(x["x1"]) + a * np.sin(x["x2"]) ** 2 + b * x["x3"] ** 4 * np.sin(x["x1"])


def ishigami_indices(a: float = 7.0, b: float = 0.1) -> tuple[np.ndarray, np.ndarray, float]:
    """First-order, total and the only second-order index (1, 3): Ishigami & Homma 1990."""
    v1 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    v2 = a**2 / 8.0
    v13 = b**2 * np.pi**8 * 8.0 / 225.0
    total = v1 + v2 + v13
    return np.array([v1, v2, 0.0]) / total, np.array([v1 + v13, v2, v13]) / total, v13 / total


def design_of(n: int, seed: int = 3) -> dict[str, tuple[np.ndarray, str]]:
    """Pressure, phase and moment arm, at random."""
    chance = np.random.default_rng(seed)
    return {
        "pressure": (chance.uniform(2e5, 6e5, n), "Pa"),
        "fill_start": (chance.uniform(0.4, 0.7, n), ""),
        "arm": (chance.uniform(0.03, 0.07, n), "m"),
    }


def walk_metrics(x: dict[str, tuple[np.ndarray, str]]) -> dict[str, tuple[np.ndarray, str]]:
    pressure, start, arm = (x[name][0] for name in ("pressure", "fill_start", "arm"))
    torque = 2e-4 * pressure * arm
    return {
        "stance": (60.0 + 0.0 * arm, "percent"),
        "toe_clearance": (12.0 + 2.0 * torque - 60.0 * np.maximum(start - 0.6, 0.0), "mm"),
        "air_per_stride": (1e-6 * pressure * (1.0 + start), "g"),
        "orthosis_peak_dorsiflexion_torque": (torque, "N*m"),
    }


# The table.


def test_one_line_gives_a_frame_with_units(tmp_path: pathlib.Path) -> None:
    x = design_of(9)
    write_sweep(tmp_path, "random", x, walk_metrics(x), failed={4: ("unstable", "NaN at 0.3 s")})
    frame = read(tmp_path).to_pandas()
    assert list(frame["case"]) == list(range(9))
    assert np.array_equal(frame["pressure [Pa]"], x["pressure"][0])
    assert frame["toe_clearance [mm]"].isna().tolist() == [k == 4 for k in range(9)]
    assert frame.attrs["units"]["pressure"] == "Pa" and frame.attrs["units"]["toe_clearance"] == "mm"


def test_a_grid_is_an_array_over_its_parameters(tmp_path: pathlib.Path) -> None:
    chance = np.random.default_rng(0)
    pressure, law, count = np.array([4e5, 2e5, 3e5]), np.array(["linear", "cubic"]), np.array([1, 3])
    cells = np.stack(np.meshgrid(np.arange(3), np.arange(2), np.arange(2), indexing="ij"), -1).reshape(-1, 3)
    cells = cells[chance.permutation(12)]  # the order of the rows is nobody's business
    x = {"pressure": (pressure[cells[:, 0]], "Pa"), "law": (law[cells[:, 1]], "")}
    x["count"] = (count[cells[:, 2]], "")
    y = x["pressure"][0] * np.where(x["law"][0] == "cubic", 2.0, 1.0) + x["count"][0]
    results = read(write_sweep(tmp_path, "grid", x, {"force": (y, "N")}))
    data = results.to_xarray()
    assert data["force"].dims == ("pressure", "law", "count")
    assert data["pressure"].values.tolist() == [2e5, 3e5, 4e5] and data["pressure"].attrs["units"] == "Pa"
    assert set(data["law"].values) == {"linear", "cubic"} and data["force"].attrs["units"] == "N"
    for k in range(12):
        at = {name: values[k] for name, (values, _) in x.items()}
        cell = data.sel(at)
        assert float(cell["force"]) == y[k] and int(cell["case"]) == k and str(cell["status"].item()) == "ok"


def test_an_unfinished_grid_has_holes(tmp_path: pathlib.Path) -> None:
    a, b = (v.ravel() for v in np.meshgrid([1.0, 2.0, 3.0], [0.1, 0.2], indexing="ij"))
    rows = [np.array([3, 4]), np.array([0, 1])]  # chunks end in any order
    write_sweep(tmp_path, "grid", bare({"a": a, "b": b}), {"y": (a * b, "m")}, chunks=rows)
    results = read(tmp_path)
    assert results.unfinished and len(results) == 4 and results.planned == 6
    assert results["case"].tolist() == [0, 1, 3, 4]
    data = results.to_xarray()
    assert np.array_equal(data["y"].values, [[0.1, 0.2], [np.nan, 0.4], [3 * 0.1, np.nan]], equal_nan=True)
    assert data["status"].values.tolist() == [["ok", "ok"], ["", "ok"], ["ok", ""]]


def test_other_designs_have_one_dimension(tmp_path: pathlib.Path) -> None:
    x = design_of(5)
    data = read(write_sweep(tmp_path, "random", x, walk_metrics(x))).to_xarray()
    assert data["arm"].dims == ("case",) and data["arm"].attrs["units"] == "m"


def test_finished_wins_over_chunks(tmp_path: pathlib.Path) -> None:
    x = design_of(5)
    write_sweep(tmp_path, "random", x, walk_metrics(x), chunks=[np.arange(2)])
    write_sweep(tmp_path, "random", x, walk_metrics(x))
    results = read(tmp_path)
    assert len(results) == 5 and not results.unfinished


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("other.txt", b"", "no sweep here"),
        ("results.parquet", b"PAR1 and no more", "is not a valid Parquet file"),
        ("chunks/.tmp", b"", "no case of this sweep"),
    ],
)
def test_a_folder_that_is_no_sweep(tmp_path: pathlib.Path, name: str, text: bytes, problem: str) -> None:
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_bytes(text)
    with pytest.raises(InputError, match=problem):
        read(tmp_path)


def test_a_run_is_no_sweep(tmp_path: pathlib.Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({"time": [0.0]}), tmp_path / "results.parquet")
    with pytest.raises(InputError, match="not a result of a sweep"):
        read(tmp_path)


@pytest.mark.parametrize("missing", ["pandas", "xarray", "SALib"])
def test_a_missing_library_is_named(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, missing: str
) -> None:
    x = saltelli(PI, 16)
    results = read(write_sweep(tmp_path, "saltelli", bare(x), {"y": (ishigami(x), "")}))
    for name in [n for n in sys.modules if n.split(".")[0] == missing]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)  # what makes an import fail
    asked: dict[str, Any] = {
        "pandas": results.to_pandas,
        "xarray": results.to_xarray,
        "SALib": lambda: indices(results, "y"),
    }
    with pytest.raises(InputError, match=rf"{missing}.*pip install 'afo-sim\[study\]'"):
        asked[missing]()


# The numbers.


def test_spread_of_known_numbers() -> None:
    values = np.r_[np.arange(101.0), np.nan]
    count, mean, deviation, *levels = analysis.spread(np.random.default_rng(0).permutation(values))
    assert (count, mean, levels) == (101, 50.0, [0.0, 5.0, 50.0, 95.0, 100.0])
    assert deviation == pytest.approx(np.sqrt(101 * 102 / 12))  # of the integers 0 to n − 1, by n − 1
    assert analysis.spread(np.full(3, np.nan))[0] == 0


def test_best_cases_leave_out_what_failed() -> None:
    values = np.array([3.0, np.nan, 1.0, 3.0, 2.0])
    assert analysis.best(values, 3, lowest=True).tolist() == [2, 4, 0]
    assert analysis.best(values, 9, lowest=False).tolist() == [0, 3, 4, 2]


def test_main_effect_is_the_conditional_mean() -> None:
    chance = np.random.default_rng(5)
    a, b, c = chance.random((3, 20_000))
    y = 3.0 * a**2 + b + 0.2 * c  # E[y | a] = 3 a² + 0.6; a² over a bin by its edges
    found = analysis.effect(a, y, bins=10)
    edges = np.quantile(a, np.linspace(0.0, 1.0, 11))
    expected = np.diff(edges**3) / np.diff(edges) + 0.6
    assert found.counts.tolist() == [2000] * 10
    assert np.all(np.abs(found.means - expected) < 4.5 * found.errors)
    within = 9.0 * np.diff(edges**5) / 5.0 / np.diff(edges) - (np.diff(edges**3) / np.diff(edges)) ** 2
    deviation = np.sqrt(within + (1.0 + 0.04) / 12.0)
    assert found.errors == pytest.approx(deviation / np.sqrt(2000), rel=0.06)  # 1/√(2·2000) = 1.6 % each


def test_share_is_the_first_order_index_and_chance_is_taken_off() -> None:
    a, b, c = np.random.default_rng(6).random((3, 300, 200))  # 300 sweeps of 200 cases
    y = 2.0 * a + b
    shares = [[analysis.effect(x[k], y[k], bins=10).share for x in (a, b, c)] for k in range(300)]
    # linear: 4/5 and 1/5 of the variance, of which ten bins see 1 − 1/10²; nothing of c
    expected = np.array([0.8, 0.2, 0.0]) * 0.99
    standard_error = np.std(shares, axis=0) / np.sqrt(300)
    # a ratio of estimates is biased by some 1/n = 0.005 of itself
    assert np.all(np.abs(np.mean(shares, axis=0) - expected) < 4.0 * standard_error + 0.005)


def test_shares_of_a_full_grid_are_exact() -> None:
    a, b = (v.ravel() for v in np.meshgrid(np.arange(5.0), np.arange(3.0), indexing="ij"))
    y = 2.0 * a + b
    va, vb = 4.0 * 2.0, 2.0 / 3.0  # variances of {0…4}, {0, 1, 2}
    assert analysis.effect(a, y, grid=True).share == pytest.approx(va / (va + vb))
    assert analysis.effect(b, y, grid=True).share == pytest.approx(vb / (va + vb))
    assert analysis.effect(a, y, grid=True).means == pytest.approx(2.0 * np.arange(5.0) + 1.0)


def test_reasons_that_differ_in_numbers_are_one() -> None:
    status = np.array(["ok", "infeasible", "infeasible", "unstable", "infeasible"])
    reason = np.array(["", "stretched by 16.2 %", "stretched by -1e-3 %", "NaN at 1 s", "no leg"])
    assert analysis.failures(status, reason) == [
        ("infeasible", "stretched by 16.2 %", 2),
        ("unstable", "NaN at 1 s", 1),
        ("infeasible", "no leg", 1),
    ]


def test_warnings_are_counted_by_what_they_are_about() -> None:
    """Two muscles whose names differ in a digit are two; one limit in other words is one."""
    warnings = np.array(
        ["", "muscle_1: 5 bar\nmuscle_2: 6 bar\nstop", "stop\nmuscle_1: 7.5 bar, which bursts"]
    )
    about = np.array(
        ["", "pressure muscle_1\npressure muscle_2\nstop ankle", "stop ankle\npressure muscle_1"]
    )
    found = [("muscle_1: 5 bar", 2), ("stop", 2), ("muscle_2: 6 bar", 1)]
    assert analysis.warned(warnings, about) == found
    older = np.array(["", "", ""])  # numbers apart, as these results do not say
    assert analysis.warned(warnings, older)[:2] == [("stop", 2), ("muscle_1: 5 bar", 1)]


def test_a_parameter_without_a_share_may_matter_most() -> None:
    def effect(means: list[float], share: float) -> analysis.Effect:
        one = np.ones(len(means))
        return analysis.Effect(np.arange(len(means)) + 0.0, np.array(means), one, one, share)

    found = {"arm": effect([1.0, 2.0], 0.04), "pressure": effect([-28.0, -3.0], np.nan)}
    assert figures.most_influential({"clearance": found}, 2) == ["pressure", "arm"]
    found = {"arm": effect([1.0, 9.0], 0.04), "pressure": effect([1.0, 2.0], 0.5)}
    assert figures.most_influential({"clearance": found}, 2) == ["pressure", "arm"]


@pytest.mark.slow
def test_shares_of_an_unfinished_grid_are_no_exact_ones(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Row by row, b has not yet had all its values: of y = b² nothing is a's."""
    a, b = (grid.ravel().astype(float) for grid in np.meshgrid(range(10), range(10), indexing="ij"))
    y = b**2
    columns = {"a": (a, ""), "b": (b, "")}
    folder = write_sweep(tmp_path / "s", "grid", columns, {"y": (y, "")}, chunks=[np.arange(55)])
    results = read(folder)
    assert results.levels() is not None and results.lacking("y") == 45
    exact = analysis.effect(a[:55], y[:55], grid=True)
    assert exact.share > 0.05
    assert abs(effects_of(results, "y")["a"].share) < exact.share
    show_folder(folder, None, ["y:lowest"], 1)
    assert "45 of 100 cells of the grid have no y" in capsys.readouterr().out


def test_a_front_of_every_case_is_drawn(tmp_path: pathlib.Path) -> None:
    x = {"pressure": (np.linspace(2e5, 4e5, 5), "Pa")}
    y = {"air": (np.linspace(1.0, 2.0, 5), "g"), "lift": (np.linspace(5.0, 9.0, 5), "mm")}
    folder = write_sweep(tmp_path / "s", "list", x, y)
    show_folder(folder, None, ["air:lowest", "lift:highest"], 1)
    assert shade(folder / "figures" / "pareto.png") > 0.0


def test_effect_of_words_ties_and_constants() -> None:
    law = np.array(["b", "a"] * 10)
    found = analysis.effect(law, np.where(law == "a", 1.0, 3.0))
    assert found.places.tolist() == ["b", "a"] and found.means.tolist() == [3.0, 1.0]
    assert found.share == pytest.approx(1.0)
    tied = np.repeat(np.arange(40.0), 5)
    assert set(analysis.effect(tied, tied, bins=7).counts % 5) == {0}  # no value is parted
    assert np.isnan(analysis.effect(tied, np.ones(200)).share)
    assert np.isnan(analysis.effect(np.ones(200), tied).share)
    few = np.arange(12.0)
    assert np.isnan(analysis.effect(few, few).share)


def test_errors_know_that_cases_of_a_block_are_one() -> None:
    chance = np.random.default_rng(8)
    x, y = chance.random((2, 400))
    alone = analysis.effect(x, y, bins=5)
    copies = (np.repeat(v, 6) for v in (x, y, np.arange(400)))
    copied = analysis.effect(*(next(copies), next(copies)), bins=5, blocks=next(copies))
    assert copied.errors == pytest.approx(alone.errors, rel=1e-9)


# Pareto fronts.


def dominated(points: np.ndarray) -> np.ndarray:
    """By every pair (n,)."""
    better = (points[:, None] <= points[None]).all(-1) & (points[:, None] < points[None]).any(-1)
    return better.any(axis=0)


@settings(suppress_health_check=[HealthCheck.too_slow])  # of a busy machine
@given(st.data(), st.integers(0, 40))
def test_the_front_is_that_of_every_pair(data: st.DataObject, n: int) -> None:
    points = data.draw(arrays(float, (n, 2), elements=st.integers(-5, 5).map(float)))  # many ties
    lowest = data.draw(st.tuples(st.booleans(), st.booleans()))
    expected = np.flatnonzero(~dominated(np.where(lowest, points, -points)))
    assert analysis.pareto_front(points, lowest).tolist() == expected.tolist()


def test_a_case_without_a_metric_is_not_on_the_front() -> None:
    points = np.array([[1.0, 2.0], [np.nan, 0.0], [2.0, 3.0]])
    assert analysis.pareto_front(points, (True, True)).tolist() == [0]
    assert not len(analysis.pareto_front(np.full((2, 2), np.nan), (True, True)))


# Sobol' indices.


def test_indices_of_ishigami(tmp_path: pathlib.Path) -> None:
    x = saltelli(PI, 1024)
    results = read(write_sweep(tmp_path, "saltelli", bare(x), {"y": (ishigami(x), "")}))
    found = indices(results, "y")
    first, total, second = ishigami_indices()
    assert np.abs(found.first - first).max() < 0.03
    assert np.abs(found.total - total).max() < 0.03
    assert np.all(np.abs(found.first - first) < found.first_interval)
    assert np.all(np.abs(found.total - total) < found.total_interval)
    one, other, strongest, interval = found.pairs()[0]
    assert (one, other) == ("x1", "x3") and abs(strongest - second) < interval
    assert all(abs(index) < 2.0 * width for _, _, index, width in found.pairs()[1:])
    assert (found.blocks, found.left_out) == (1024, 0)
    again = indices(results, "y")
    assert np.array_equal(again.first_interval, found.first_interval)


def test_binned_shares_of_ishigami(tmp_path: pathlib.Path) -> None:
    x = saltelli(PI, 1024)
    results = read(write_sweep(tmp_path, "saltelli", bare(x), {"y": (ishigami(x), "")}))
    t = np.linspace(-np.pi, np.pi, 12_001)
    t = 0.5 * (t[1:] + t[:-1])
    conditional = (np.sin(t) * (1.0 + 0.1 * np.pi**4 / 5.0), 7.0 * np.sin(t) ** 2, 0.0 * t)
    variance = 0.5 + 0.1 * np.pi**4 / 5.0 + 0.01 * np.pi**8 / 18.0 + 49.0 / 8.0
    for effect, mean in zip(effects_of(results, "y").values(), conditional, strict=True):
        bins = len(effect.means)
        expected = np.var(mean.reshape(bins, -1).mean(axis=1)) / variance  # the index, but for wide bins
        assert abs(effect.share - expected) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("n", [16, 1024])
def test_of_a_saltelli_design_one_share_is_told(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, n: int
) -> None:
    """Of few cases a bin is as wide as half a wave of sin² x2: between the bins' means nothing is left."""
    monkeypatch.setenv("COLUMNS", "200")
    x = saltelli(PI, n)
    folder = write_sweep(tmp_path / "s", "saltelli", bare(x), {"y": (ishigami(x), "")})
    results = read(folder)
    found = findings(results, {"y": "lowest"})
    index = found.indices["y"].first
    binned = analysis.effect(x["x2"], ishigami(x), bins=4).share
    true = ishigami_indices()[0][1]
    assert true > 0.4 and binned < 0.1
    assert [found.effects["y"][name].share for name in ("x1", "x2", "x3")] == index.tolist()
    show_folder(folder, None, ["y:lowest"], 1)
    said = capsys.readouterr().out
    rows = [line.split() for line in said.splitlines() if line.startswith("x2")]
    assert rows[0][1] == f"{100.0 * max(index[1], 0.0):.0f}"  # main effects, in percent
    assert float(rows[1][1]) == pytest.approx(index[1], abs=5e-3)  # Sobol' indices
    assert EXACT.split(",")[0] in " ".join(said.split()) and "means of bins" not in said
    if n == 1024:
        assert index[1] == pytest.approx(true, abs=0.03)


@pytest.mark.slow
def test_shares_between_bins_are_named_as_such(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    x = {name: values[0] for name, values in bare(saltelli(PI, 16)).items()}
    folder = write_sweep(tmp_path / "s", "random", bare(x), {"y": (ishigami(x), "")})
    show_folder(folder, None, ["y:lowest"], 1)
    said = " ".join(capsys.readouterr().out.split())
    assert "variance explained" not in said
    assert "shares of variance are between the means of bins" in said


def test_of_a_sum_first_order_is_total(tmp_path: pathlib.Path) -> None:
    x = saltelli({"a": (0.0, 1.0), "b": (0.0, 1.0), "c": (0.0, 1.0)}, 1024)
    y = 3.0 * x["a"] + 2.0 * x["b"] + x["c"]
    results = read(write_sweep(tmp_path, "saltelli", bare(x), {"y": (y, "")}))
    found = indices(results, "y")
    expected = np.array([9.0, 4.0, 1.0]) / 14.0
    assert np.abs(found.first - expected).max() < 0.01
    assert np.abs(found.total - expected).max() < 0.01


def test_every_case_s_own_seed_has_no_part_in_the_indices(tmp_path: pathlib.Path) -> None:
    x = saltelli({"a": (0.0, 1.0), "b": (0.0, 1.0)}, 1024)
    columns = bare(x) | {"noise": (np.random.default_rng(1).integers(0, 2**32, len(x["a"])) + 0.0, "")}
    y = 3.0 * x["a"] + x["b"]
    folder = write_sweep(tmp_path, "saltelli", columns, {"y": (y, "")}, seeds=("noise",))
    results = read(folder)
    found = indices(results, "y")
    assert found.parameters == ("a", "b") and found.blocks == 1024
    assert np.abs(found.first - [0.9, 0.1]).max() < 0.01
    assert set(effects_of(results, "y")) == {"a", "b"}


def test_few_failures_leave_out_their_base_samples(tmp_path: pathlib.Path) -> None:
    x = saltelli(PI, 512)
    bad = dict.fromkeys([8 * 17 + 2, 8 * 17 + 3, 8 * 300], ("unstable", "NaN"))
    y = {"y": (ishigami(x), "")}
    results = read(write_sweep(tmp_path / "a", "saltelli", bare(x), y, failed=bad))
    found = indices(results, "y")
    assert (found.blocks, found.left_out) == (512, 2)
    whole = np.setdiff1d(np.arange(512), [17, 300])
    kept = {name: values.reshape(512, 8)[whole].ravel() for name, values in x.items()}
    again = write_sweep(tmp_path / "b", "saltelli", bare(kept), {"y": (ishigami(kept), "")})
    same = indices(read(again), "y")
    assert np.array_equal(found.first, same.first) and np.array_equal(found.total, same.total)
    assert any("2 of 512 base samples" in r for r in findings(results, {"y": "lowest"}).remarks)


def test_indices_that_cannot_be_are_refused(tmp_path: pathlib.Path) -> None:
    x = saltelli(PI, 32)
    y = {"y": (ishigami(x), ""), "flat": (np.ones(256), "")}
    many = dict.fromkeys(range(0, 256, 80), ("unstable", "NaN"))  # 4 of 256
    failed = read(write_sweep(tmp_path / "a", "saltelli", bare(x), y, failed=many))
    with pytest.raises(InputError, match=r"1\.6 % of the cases have no y.*less than 1 %"):
        indices(failed, "y")
    assert "1.6 % of the cases have no y" in " ".join(findings(failed, {"y": "lowest"}).remarks)
    whole = read(write_sweep(tmp_path / "b", "saltelli", bare(x), y))
    with pytest.raises(InputError, match="does not vary"):
        indices(whole, "flat")
    part = read(write_sweep(tmp_path / "c", "saltelli", bare(x), y, chunks=[np.arange(80)]))
    with pytest.raises(InputError, match=r"every case.*80 of 256"):
        indices(part, "y")
    other = read(write_sweep(tmp_path / "d", "random", bare(x), y))
    with pytest.raises(InputError, match="allowed: saltelli"):
        indices(other, "y")


# What is shown.


def shade(path: pathlib.Path) -> float:
    """Share of a picture's pixels that are not white."""
    return float((imread(path)[:, :, :3].min(axis=2) < 0.95).mean())


@pytest.mark.slow
def test_every_figure_is_written_and_has_something_on_it(tmp_path: pathlib.Path) -> None:
    x = saltelli({"pressure": (2e5, 6e5), "fill_start": (0.4, 0.7), "arm": (0.03, 0.07)}, 64)
    units = {"pressure": "Pa", "fill_start": "", "arm": "m"}
    named = {name: (values, units[name]) for name, values in x.items()}
    folder = write_sweep(tmp_path, "saltelli", named, walk_metrics(named))
    before = dict(matplotlib.rcParams)
    show_folder(folder, None, [], 3)
    assert {path.name for path in (folder / "figures").iterdir()} == FILES | {"sobol.png"}
    assert all(0.01 < shade(path) < 0.9 for path in (folder / "figures").iterdir())
    assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
@pytest.mark.parametrize("design", ["grid", "list"])
def test_words_failures_constants_and_one_parameter_are_drawn(tmp_path: pathlib.Path, design: str) -> None:
    law = np.repeat(["linear", "a $strange$ law"], 8)
    pressure = np.tile(np.linspace(2e5, 4e5, 4), 4)
    again = np.tile(np.repeat([0, 1], 4), 2)
    x = {"law": (law, ""), "pressure": (pressure, "Pa"), "trial": (again, "")}
    y = {"force": (pressure * (law == "linear"), "N"), "flat": (np.ones(16), "m")}
    y |= {"never": (np.full(16, np.nan), "s"), "depth": (-1e-3 * pressure, "mm")}
    failed = {1: ("unstable", "NaN"), 2: ("error", "out of memory"), 3: ("unstable", "NaN")}
    results = read(write_sweep(tmp_path / "a", design, x, y, failed=failed))
    paths = drawn(results, tmp_path / "f", list(y))
    assert {path.name for path in paths} == FILES
    assert all(shade(path) > 0.005 for path in paths)
    assert "no case has a value of never" in findings(results, dict.fromkeys(y, "lowest")).remarks
    one = {"pressure": x["pressure"]}
    alone = read(write_sweep(tmp_path / "b", design, one, {"force": y["force"]}))
    assert {p.name for p in drawn(alone, tmp_path / "g", [])} == {"distributions.png", "main_effects.png"}


@pytest.mark.slow
def test_no_words_are_cut_off_or_on_each_other(tmp_path: pathlib.Path) -> None:
    """Of long names and numbers: a title, a label or a tick's number."""
    chance = np.random.default_rng(0)
    x = {
        "link_length_of_the_dorsiflexor": (chance.uniform(0.4, 0.7, 40), "m"),
        "arm": (chance.random(40), "m"),
    }
    names = ("toe_clearance", "orthosis_peak_dorsiflexion_torque", "a_metric_of_a_very_long_name")
    y = {
        name: (chance.normal(-9e3, 4e3, 40), unit)
        for name, unit in zip(names, ("mm", "N*m", "s"), strict=True)
    }
    results = read(write_sweep(tmp_path, "random", x, y))
    found = findings(results, dict.fromkeys(names, "lowest"))
    for name, size, fill in (*figures.drawings(found), *figures.fronts(results, found.objectives)):
        with style.styled():
            figure = Figure(figsize=size, layout="constrained")
            fill(figure)
            figure.draw_without_rendering()
        words = [(a.title, a._left_title, a.xaxis.label, a.yaxis.label) for a in figure.axes]
        boxes = [text.get_window_extent() for text in sum(words, ()) if text.get_text()]
        assert all(figure.bbox.padded(2.0).containsy(y) for b in boxes for y in (b.y0, b.y1)), name
        assert all(figure.bbox.padded(2.0).containsx(x) for b in boxes for x in (b.x0, b.x1)), name
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2)), name


@pytest.mark.slow
def test_four_metrics_take_two_figures(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_blank(monkeypatch)
    x = design_of(40)
    y = {name: (np.random.default_rng(k).random(40), "s") for k, name in enumerate("abcd")}
    results = read(write_sweep(tmp_path, "random", x, y))
    names = {path.name for path in drawn(results, tmp_path / "f", list("abcd"))}
    assert names == FILES | {"distributions_2.png", "main_effects_2.png", "maps_2.png"}
    with pytest.raises(InputError, match="no such metric"):
        drawn(results, tmp_path / "h", ["z"])


def test_every_case_failed(tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> None:
    x = design_of(4)
    failed = dict.fromkeys(range(4), ("infeasible", "the cable is too short"))
    show_folder(write_sweep(tmp_path, "random", x, walk_metrics(x), failed=failed), None, [], 3)
    said = capsys.readouterr().out
    assert "the cable is too short" in said and "no case has a value of toe_clearance" in said
    assert "figures: none" in said


def test_a_heat_map_has_the_mean_of_each_cell(tmp_path: pathlib.Path) -> None:
    a, b, c = (v.ravel() for v in np.meshgrid([1e5, 2e5, 4e5], [0.1, 0.2], [1.0, 2.0], indexing="ij"))
    y = a * 1e-5 + 100.0 * b + c
    results = read(
        write_sweep(tmp_path, "grid", {"a": (a, "Pa"), "b": (b, ""), "c": (c, "")}, {"y": (y, "mm")})
    )
    figure = Figure(layout="constrained")
    figures.draw_maps(figure, results, {"y": effects_of(results, "y")})
    axis, mesh = figure.axes[0], figure.axes[0].collections[0]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("b", "a\u00a0[bar]")  # variances 25 and 1.6
    expected = np.array([1.0, 2.0, 4.0])[:, None] + np.array([10.0, 20.0]) + 1.5
    assert np.asarray(mesh.get_array()).reshape(3, 2) == pytest.approx(expected)
    assert [t.get_text() for t in axis.get_yticklabels()] == ["1", "2", "4"]


@pytest.mark.slow
def test_tables_say_what_failed_and_which_case_is_best(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    x = design_of(200)
    y = walk_metrics(x)
    failed = {
        11: ("unstable", "NaN at 1 s"),
        12: ("unstable", "NaN at 1 s"),
        13: ("infeasible", "[too] short"),
    }
    folder = write_sweep(tmp_path / "s", "latin-hypercube", x, y, failed=failed)
    show_folder(folder, tmp_path / "elsewhere", ["air_per_stride", "toe_clearance:lowest"], 2)
    said = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["ok", "197", "98.5", "%"] in said
    assert ["unstable", "2", "1", "%", "NaN", "at", "1", "s"] in said
    assert ["infeasible", "1", "0.5", "%", "[too]", "short"] in said
    there = ~np.isin(np.arange(200), list(failed))
    for name in ("air_per_stride", "toe_clearance"):
        row = said[said.index(["best", "cases:", "lowest", *name.split("_")]) + 2]
        values = np.where(there, y[name][0], np.inf)
        assert row[0] == str(values.argmin())
        assert row[1] == f"{x['pressure'][0][values.argmin()] * 1e-5:.4g}"  # in bar
    assert (tmp_path / "elsewhere" / "pareto.png").is_file() and not (folder / "figures").exists()


def test_an_unknown_metric_has_a_nearest_name(tmp_path: pathlib.Path) -> None:
    x = design_of(6)
    folder = write_sweep(tmp_path, "random", x, walk_metrics(x))
    with pytest.raises(InputError, match="did you mean 'toe_clearance'"):
        show_folder(folder, None, ["toe_clearence"], 3)
    with pytest.raises(InputError, match="lowest, highest"):
        show_folder(folder, None, ["toe_clearance:middle"], 3)
    assert not (folder / "figures").exists()


def test_metrics_that_matter_most_come_by_themselves(tmp_path: pathlib.Path) -> None:
    x = design_of(6)
    y = walk_metrics(x)
    results = read(write_sweep(tmp_path / "a", "random", x, y))
    assert list(scales.chosen(results, [])) == [name for name in y if name != "stance"]
    plain = {name: (np.arange(6.0), "") for name in "wxyz"}
    assert list(scales.chosen(read(write_sweep(tmp_path / "b", "random", x, plain)), [])) == ["w", "x", "y"]


@pytest.mark.parametrize(
    ("unit", "largest", "factor", "shown"),
    [
        ("Pa", 6e5, 1e-5, "bar"),
        ("m", 0.02, 1e3, "mm"),
        ("m", 0.07, 1e2, "cm"),
        ("m", 1.8, 1.0, "m"),
        ("rad", 0.5, 180.0 / np.pi, "°"),
        ("s", 0.04, 1e3, "ms"),
        ("kg", 70.0, 1.0, "kg"),
        ("N*m/rad", 3.0, 1.0, "N·m/rad"),
        ("kg*m^2", 0.01, 1.0, "kg·m²"),
        ("mm", 20.0, 1.0, "mm"),
        ("", 0.5, 1.0, ""),
    ],
)
def test_axes_are_in_units_that_people_read(
    tmp_path: pathlib.Path, unit: str, largest: float, factor: float, shown: str
) -> None:
    x = {"x": (np.linspace(0.0, largest, 4), unit)}
    look = scales.scale(read(write_sweep(tmp_path, "random", x, {"y": (np.ones(4), "")})), "x")
    assert look.factor == pytest.approx(factor, rel=1e-12) and look.unit == shown
