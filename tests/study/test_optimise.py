"""Design search: ranking, limits, the optimiser on problems with known answers, resuming, refusals."""

import functools
import json
import math
import pathlib
import re
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from campaign import size
from command import Call
from hypothesis import given
from hypothesis import strategies as st
from sweep_runs import killed

import afo_sim
from afo_sim import cli
from afo_sim.cli import error_handler
from afo_sim.common import InputError, assets
from afo_sim.model import as_run
from afo_sim.show import draw_search
from afo_sim.study import OBJECTIVE, Columns, Problem, best_of, cases_of, statement
from afo_sim.study.constraint import read_constraint
from afo_sim.study.parameter import Parameter, Range
from afo_sim.study.search import plan, store
from afo_sim.study.search.aim import LACKING, OUTSIDE, PATIENT, Aim, Limit, Objective
from afo_sim.study.search.loop import Answers, _judged, evolve
from afo_sim.study.search.surrogate import Surrogate, _fitted, _monomials

LOWEST = Objective("f", "lowest")
X = Parameter("x", ("x",), "", Range(0.1, 5.0))
Y = Parameter("y", ("y",), "", Range(0.1, 3.0))


def of_functions(traits: np.ndarray | None = None, **functions: object) -> object:
    """An evaluator of closed forms of parameters and patient: {metric: function}; traits (patients,)."""
    patients = np.zeros(1) if traits is None else traits

    def evaluate(values: Columns, only: np.ndarray) -> Answers:
        left = (only[:, None] >= 0) & (only[:, None] != np.arange(len(patients)))
        columns = {name: column[:, None] for name, column in values.items()}
        columns |= {} if traits is None else {"t": traits}
        found = {name: np.where(left, np.nan, function(**columns)) for name, function in functions.items()}  # type: ignore[operator]
        return Answers(found, ("",) * len(only))

    return evaluate


def solved(
    folder: pathlib.Path,
    evaluate: object,
    parameters: tuple[Parameter, ...] = (X, Y),
    *,
    limits: tuple[Limit, ...] = (),
    constraints: tuple[str, ...] = (),
    generations: int = 100,
    seed: int = 0,
    objective: Objective = LOWEST,
    method: str = "surrogate",
    traits: np.ndarray | None = None,
) -> tuple[Columns, int, Aim]:
    """(all designs, row of the best, aim)"""
    aim = Aim(objective, limits)
    read = tuple(read_constraint(text, parameters) for text in constraints)
    told = {} if traits is None else {"traits": traits[:, None]}
    problem = Problem(parameters, read, aim, seed, method=method, **told)
    columns = evolve(problem, folder, generations, evaluate)[0]  # type: ignore[arg-type]
    return columns, best_of(aim, columns), aim


def test_a_model_of_runs_is_exact_for_a_cubic_and_as_wrong_as_its_noise() -> None:
    """Where one run is left out, by a run's own share; a value that nothing explains is its mean."""
    random = np.random.default_rng(3)
    at, other = random.uniform(-1.0, 1.0, (2, 200, 2))

    def cubic(x: np.ndarray) -> np.ndarray:
        return 1.0 + x[:, 0] - 2.0 * x[:, 1] + 3.0 * x[:, 0] * x[:, 1] - x[:, 1] ** 3

    noise = random.standard_normal(200)
    values, one = np.column_stack([cubic(at), cubic(at) + 0.1 * noise, noise]), np.ones(200)
    error, powers, factors = _fitted(at, values, one, one > 0.0, np.zeros((1, 0)))
    assert error[0] < 1e-6 and error[1:] == pytest.approx([0.1, 1.0], rel=0.15)
    found = _monomials(other, powers) @ factors[:, :, 0]
    assert found[:, 0] == pytest.approx(cubic(other), abs=1e-5)
    assert np.sqrt(np.mean((found[:, 1] - cubic(other)) ** 2)) < 0.05 and np.abs(found[:, 2]).max() < 1.0


@pytest.mark.parametrize(
    ("cost", "keeps", "place", "radius", "margin"),
    [  # before 1.0, promised 0.0, in a region of 0.1 and with a margin of 0.2
        (0.5, True, 0.08, 0.16, 0.1),  # found: twice the largest step
        (0.5, True, 0.01, 0.05, 0.1),  # at least half
        (0.5, True, 0.30, 0.20, 0.1),  # at most twice
        (0.95, True, 0.08, 0.05, 0.1),  # less than a tenth of what was promised
        (1.5, True, 0.08, 0.05, 0.1),
        (0.5, False, 0.08, 0.16, 0.4),  # a broken limit asks for more margin
    ],
)
def test_the_region_follows_sound_steps_and_shrinks_after_others(
    cost: float, keeps: bool, place: float, radius: float, margin: float
) -> None:
    search: Any = object.__new__(Surrogate)
    search._radius, search._margin, search._best, search._centre = 0.1, 0.2, 1.0, np.array([0.5, 0.5])
    search._keeps, search.aim = True, SimpleNamespace(feasible=lambda found: [keeps or found == 1.0])
    search._cost = lambda each: np.array([each])
    search._predicted = lambda _: 0.0
    search._follow(cost, np.array([[0.5 + place, 0.5 - 0.1 * place]]))
    assert (search._radius, search._margin) == pytest.approx((radius, margin))
    search._radius, search._keeps = 0.1, False
    search._follow(cost, np.array([[0.5, 0.5 + place]]))  # whatever a design that keeps the limits costs
    assert search._radius == pytest.approx(min(max(2.0 * place, 0.05), 0.2) if keeps or cost < 0.9 else 0.05)


def test_a_search_runs_as_often_as_it_tells_before() -> None:
    """Of one patient, and of three, who are simulated with the model's best design alone."""
    for patients in (1, 3):
        traits = np.linspace(0.0, 1.0, patients)
        problem = Problem((X, Y), (), Aim(LOWEST, ()), 0, traits=traits[:, None])
        evaluate: Any = of_functions(traits, f=lambda x, y, t: x**2 + y + t)
        search, runs = Surrogate(problem, 0), 0
        for generation in range(3):
            shares, only = search.ask()
            runs += sum(patients if each < 0 else 1 for each in only)
            asked = problem.values(shares) | {PATIENT: only}
            search.tell(_judged(problem, (generation, 0), 0, asked, evaluate))
        assert runs == search.runs(3)


# -- limits and shares ------------------------------------------------------------------------------------

PATIENTS = st.lists(st.integers(-5, 5).map(float), min_size=1, max_size=40)
SHARES = st.integers(1, 20).map(lambda k: k / 20.0)


@given(PATIENTS, SHARES, st.integers(-6, 6), st.booleans())
def test_a_level_keeps_the_bound_exactly_if_the_share_does(
    values: list[float], share: float, bound: int, at_least: bool
) -> None:
    """Counted patient by patient in whole numbers: share = k/20."""
    limit = Limit("g", at_least, float(bound), share)
    good = sum(v >= bound if at_least else v <= bound for v in values)
    enough = 20 * good >= round(20 * share) * len(values)
    level = limit.level(np.array(values))
    assert (limit.short(level) == 0.0) == enough
    assert limit.kept(np.array(values)) == pytest.approx(good / len(values), abs=1e-15)


@pytest.mark.parametrize("count", [7, 20, 33, 100])
@pytest.mark.parametrize("share", [0.5, 0.8125, 1.0])
def test_a_level_is_numpys_quantile(count: int, share: float) -> None:
    """The inverse of the empirical distribution, from below and, mirrored, from above."""
    values = np.random.default_rng(count).normal(size=count)
    below = np.quantile(values, share, method="inverted_cdf")
    above = -np.quantile(-values, share, method="inverted_cdf")
    assert Limit("g", False, 0.0, share).level(values) == below
    assert Limit("g", True, 0.0, share).level(values) == above


@pytest.mark.parametrize(("count", "share"), [(20, 0.95), (40, 0.95), (20, 0.5), (7, 0.8)])
def test_of_a_sample_the_share_of_the_population_keeps_the_level(count: int, share: float) -> None:
    """In the mean over 4000 samples; without the correction too few do."""
    random = np.random.default_rng(count).random((4000, count))  # uniform: the share above x is 1 − x
    level = [Limit("g", True, 0.0, share, sampled=True).level(values) for values in random]
    plain = [Limit("g", True, 0.0, share).level(values) for values in random]
    error = 4.0 * np.std(level) / np.sqrt(4000)
    assert 1.0 - np.mean(level) >= share - error
    assert 1.0 - np.mean(level) <= share + 1.0 / (count + 1) + error
    assert 1.0 - np.mean(plain) < share - 0.3 / (count + 1)


def test_a_patient_without_a_value_does_not_keep_a_limit() -> None:
    values = np.full((3, 20), 20.0)
    values[1, 0] = np.nan
    values[2, :2] = np.nan
    aim = Aim(Objective("air", "lowest"), (Limit("toe", True, 15.0, 0.95),))
    found = aim.judge({"air": np.ones((3, 20)), "toe": values})
    assert found[LACKING].tolist() == [0, 0, 1]
    assert found["toe_at_least_kept"].tolist() == [1.0, 0.95, 0.9]
    assert aim.feasible(found | {OUTSIDE: np.zeros(3)}).tolist() == [True, True, False]


def test_a_case_that_failed_makes_a_design_infeasible() -> None:
    air = np.ones((2, 4))
    air[1, 2] = np.nan
    aim = Aim(Objective("air", "lowest", "median"))
    found = aim.judge({"air": air})
    assert aim.feasible(found | {OUTSIDE: np.zeros(2)}).tolist() == [True, False]


@pytest.mark.parametrize(
    ("goal", "over", "expected"),
    [("lowest", "mean", 3.0), ("lowest", "median", 2.0), ("lowest", "worst", 6.0), ("highest", "worst", 1.0)],
)
def test_objective_over_the_patients(goal: str, over: str, expected: float) -> None:
    assert Objective("f", goal, over).of(np.array([[1.0, 6.0, 2.0]]))[0] == expected  # type: ignore[arg-type]


# -- ranking ----------------------------------------------------------------------------------------------

DESIGN = st.tuples(
    st.sampled_from([0.0, 0.0, 0.0, 0.1, 0.4]),
    st.sampled_from([0, 0, 0, 1, 3]),
    st.sampled_from([0.0, 0.0, 1.0, 2.0]),
    st.sampled_from([0.0, 0.0, 10.0, 30.0]),
    st.sampled_from([1.0, 2.0, 3.0]),
)


@given(st.lists(DESIGN, min_size=1, max_size=12), st.sampled_from(["lowest", "highest"]))
def test_ranks_are_debs_rules_pair_by_pair(designs: list[tuple[float, ...]], goal: str) -> None:
    off, lacking, one, two, goal_values = map(np.array, zip(*designs, strict=True))
    aim = Aim(Objective("f", goal), (Limit("a", True, 5.0), Limit("b", False, 5.0)))  # type: ignore[arg-type]
    columns = {OUTSIDE: off, LACKING: lacking, OBJECTIVE: goal_values}
    columns |= {"a_at_least_short": one, "b_at_most_short": two}

    def beats(i: int, j: int) -> bool:
        most = [max(d[k] for d in designs) or 1.0 for k in (2, 3)]
        total = [d[2] / most[0] + d[3] / most[1] for d in designs]
        good = [d[0] == 0.0 and d[1] == 0 and t == 0.0 for d, t in zip(designs, total, strict=True)]
        if good[i] and good[j]:
            a, b = designs[i][4], designs[j][4]
            return a < b if goal == "lowest" else a > b
        if good[i] or good[j]:
            return good[i]
        if designs[i][0] != designs[j][0]:
            return designs[i][0] < designs[j][0]
        if designs[i][1] != designs[j][1]:
            return designs[i][1] < designs[j][1]
        return total[i] < total[j]

    every = range(len(designs))
    assert aim.ranks(columns).tolist() == [sum(beats(other, one) for other in every) for one in every]


def test_two_limits_on_one_metric_are_both_kept() -> None:
    """At least 10 in half of the patients, and −50 in all."""
    aim = Aim(LOWEST, (Limit("h", True, 10.0, 0.5, 1), Limit("h", True, -50.0, 1.0, 2)))
    heights = np.array([[12.0, -60.0], [12.0, -40.0], [9.0, 9.5]])
    columns = aim.judge({"f": np.zeros((3, 2)), "h": heights}) | {OUTSIDE: np.zeros(3)}
    assert columns["h_at_least_level"].tolist() == [12.0, 12.0, 9.5]
    assert columns["h_at_least_2_level"].tolist() == [-60.0, -40.0, 9.0]
    assert aim.feasible(columns).tolist() == [False, True, False]


def test_a_limit_in_large_numbers_does_not_drown_another() -> None:
    """Pascals beside millimetres: each is measured by the most that any design lacks of it."""
    aim = Aim(LOWEST, (Limit("p", True, 1e5), Limit("mm", True, 5.0)))
    columns = {
        OUTSIDE: np.zeros(3),
        LACKING: np.zeros(3, int),
        OBJECTIVE: np.zeros(3),
        "p_at_least_short": np.array([1e5, 1e4, 0.0]),
        "mm_at_least_short": np.array([0.0, 5.0, 4.0]),
    }
    assert aim.violation(columns) == pytest.approx([1.0, 1.1, 0.8])


# -- constraints on parameters ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x < y", [0.0, 0.5, 0.0]),
        ("x > y", [0.5, 0.0, 1.0]),
        ("not x > y", [0.0, 0.5, 0.0]),
        ("x < y and x < 1", [0.0, 0.5 + 0.5, 0.0]),
        ("x < y or x < 4", [0.0, 0.0, 0.0]),
        ("1 < x < 4", [0.0, 0.0, 1.0]),
        ("not (x < y or y < 2)", [0.5, 0.5, 1.0]),
        ("x == 1", [0.0, 0.5, 1.0]),
        ("0 < -x", [1.0, 1.0, 0.0]),
    ],
)
def test_excess_of_a_constraint(text: str, expected: list[float]) -> None:
    """Designs (1, 2), (2, 1) and (0, 4), by hand: what is missing over the larger side."""
    values = {"x": np.array([1.0, 2.0, 0.0]), "y": np.array([2.0, 1.0, 4.0])}
    constraint = read_constraint(text, (X, Y))
    found = constraint.excess(values)
    # a strict comparison of equals is off by nothing, and still not fulfilled
    assert np.array_equal(found == 0.0, constraint.holds(values))
    assert found == pytest.approx(expected, abs=1e-12)


def test_division_by_nothing_is_far_off() -> None:
    found = read_constraint("x / y > 1", (X, Y)).excess({"x": np.zeros(1), "y": np.zeros(1)})
    assert found[0] == math.inf


# -- the optimiser on problems with known answers ---------------------------------------------------------


def sphere(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x - 2.0) ** 2 + (y - 1.0) ** 2


@pytest.mark.parametrize(
    ("method", "seed"), [("surrogate", 0), ("cma-es", 0), ("surrogate", 1)][: size(1, 3)]
)
@pytest.mark.parametrize(
    ("function", "objective", "place"),
    [
        (sphere, LOWEST, [2.0, 1.0]),
        (lambda x, y: -sphere(x, y), Objective("f", "highest"), [2.0, 1.0]),
        (lambda x, y: (x - 7.0) ** 2 + (y + 1.0) ** 2, LOWEST, [5.0, 0.1]),  # beyond both: the box's corner
    ],
)
def test_the_optimum_of_a_sphere(
    tmp_path: pathlib.Path, function: object, objective: Objective, place: list[float], method: str, seed: int
) -> None:
    evaluate = of_functions(f=function)
    columns, best, _ = solved(tmp_path, evaluate, seed=seed, objective=objective, method=method)
    assert [columns["x"][best], columns["y"][best]] == pytest.approx(place, abs=5e-3)
    assert columns["x"].max() <= 5.0 and columns["y"].min() >= 0.1
    assert method == "cma-es" or len(columns["x"]) <= 100


def valley(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Rosenbrock's, doi 10.1093/comjnl/3.3.175, with 20 for 100: no cubic; over the ranges up to 10,000."""
    return (1.0 - x) ** 2 + 20.0 * (y - x**2) ** 2


@pytest.mark.parametrize("seed", range(size(2, 6)))
@pytest.mark.parametrize(("bound", "least"), [(-1.0, 0.0), (1.2, 0.04)])
def test_the_end_of_a_bent_valley(tmp_path: pathlib.Path, bound: float, least: float, seed: int) -> None:
    """Its end at x = 1, or where a limit x ≥ 1.2 cuts it, at y = 1.44: the region must shrink and grow."""
    evaluate = of_functions(f=valley, g=lambda x, y: x)
    columns, best, aim = solved(tmp_path, evaluate, limits=(Limit("g", True, bound),), seed=seed)
    assert aim.feasible(columns)[best] and columns[OBJECTIVE][best] == pytest.approx(least, abs=1e-4)
    assert len(columns["x"]) <= 300


@pytest.mark.parametrize("share", [0.9, 0.5])
def test_a_share_of_patients_keeps_a_limit_at_the_least_cost(tmp_path: pathlib.Path, share: float) -> None:
    """x·y ≥ 1 + 0.2 exp t: least x + y = 2 √(1 + 0.2 exp t) at x = y, t of the last that must keep it.

    The traits' mean is none, so that the objective's mean is x + y.
    """
    traits = np.random.default_rng(5).permutation(np.linspace(-1.5, 1.5, 20))
    evaluate = of_functions(
        traits, f=lambda x, y, t: x + y + t * (x - y) ** 2, g=lambda x, y, t: x * y - 0.2 * np.exp(t)
    )
    limits = (Limit("g", True, 1.0, share),)
    columns, best, aim = solved(tmp_path, evaluate, limits=limits, traits=traits, generations=25)
    last = np.exp(np.sort(traits)[round(share * 20) - 1])
    assert aim.feasible(columns)[best] and columns["g_at_least_kept"][best] == share
    assert columns[OBJECTIVE][best] == pytest.approx(2.0 * math.sqrt(1.0 + 0.2 * last), rel=1e-4)
    assert not np.isnan(columns[OBJECTIVE]).any()


def test_where_runs_fail_no_design_is_the_best(tmp_path: pathlib.Path) -> None:
    """Nothing is known of x < 2, where the objective would be lowest: the best design lies at the edge."""
    evaluate = of_functions(f=lambda x, y: np.where(x < 2.0, np.nan, sphere(x, y) + x))
    columns, best, _ = solved(tmp_path, evaluate)
    assert (columns[LACKING] > 0).any()
    assert columns["x"][best] >= 2.0 and columns[OBJECTIVE][best] == pytest.approx(2.0, abs=0.01)


def test_whole_numbers_stay_whole(tmp_path: pathlib.Path) -> None:
    n = Parameter("x", ("x",), "", Range(1.0, 12.0, whole=True), whole=True)
    columns, best, _ = solved(
        tmp_path, of_functions(f=lambda x: (x - 4.2) ** 2), (n,), generations=15, method="cma-es"
    )
    assert columns["x"][best] == 4.0
    assert np.array_equal(columns["x"], np.round(columns["x"]))


@pytest.mark.parametrize(
    ("how", "method", "generations"),
    [("limit", "surrogate", 30), ("constraint", "surrogate", 30), ("limit", "cma-es", 60)],
)
def test_least_sum_of_a_given_product(
    tmp_path: pathlib.Path, how: str, method: str, generations: int
) -> None:
    """x + y least with x·y ≥ 1: by Lagrange's multiplier x = y = 1, sum 2."""
    evaluate = of_functions(f=lambda x, y: x + y, g=lambda x, y: x * y)
    limits = (Limit("g", True, 1.0),) if how == "limit" else ()
    constraints = ("x * y >= 1",) if how == "constraint" else ()
    budget = {"generations": generations, "method": method}
    columns, best, aim = solved(tmp_path, evaluate, limits=limits, constraints=constraints, **budget)  # type: ignore[arg-type]
    assert columns["x"][best] * columns["y"][best] >= 1.0
    assert 2.0 <= columns[OBJECTIVE][best] < 2.001
    assert [columns["x"][best], columns["y"][best]] == pytest.approx([1.0, 1.0], abs=0.03)
    assert aim.feasible(columns)[best]


def test_designs_outside_the_constraints_are_not_simulated(tmp_path: pathlib.Path) -> None:
    asked: list[np.ndarray] = []

    def evaluate(values: Columns, only: np.ndarray) -> Answers:
        asked.append(values["x"] - values["y"])
        return of_functions(f=lambda x, y: x + y)(values, only)  # type: ignore[operator]

    columns, *_ = solved(tmp_path, evaluate, constraints=("x > y",), generations=12, method="cma-es")
    assert np.concatenate(asked).min() > 0.0
    outside = columns[OUTSIDE] > 0.0
    assert outside.any()
    assert np.array_equal(outside, columns["x"] <= columns["y"])
    assert np.isnan(columns[OBJECTIVE][outside]).all()


def test_without_any_feasible_design_the_least_violating_one_is_best(tmp_path: pathlib.Path) -> None:
    evaluate = of_functions(f=lambda x, y: x, g=sphere)
    columns, best, aim = solved(tmp_path, evaluate, limits=(Limit("g", False, -1.0),))
    assert not aim.feasible(columns).any()
    assert [columns["x"][best], columns["y"][best]] == pytest.approx([2.0, 1.0], abs=0.03)
    assert columns["g_at_most_short"][best] == pytest.approx(1.0, abs=1e-3)


# -- resuming ---------------------------------------------------------------------------------------------


class Killed(Exception):
    """What stands for a kill in these tests."""


def same(a: Columns, b: Columns) -> bool:
    return list(a) == list(b) and all(np.array_equal(a[n], b[n], equal_nan=a[n].dtype.kind == "f") for n in a)


@pytest.mark.parametrize("method", ["surrogate", "cma-es"])
def test_interrupted_after_every_generation_is_uninterrupted_to_the_last_bit(
    tmp_path: pathlib.Path, method: str
) -> None:
    traits = np.linspace(-1.0, 1.0, 4)
    evaluate = of_functions(traits, f=lambda x, y, t: x + y, g=lambda x, y, t: x * y - 0.1 * t)
    limits = (Limit("g", True, 1.0, 0.75),)
    run = functools.partial(solved, limits=limits, constraints=("x < 2 * y",), traits=traits, method=method)
    whole, best, _ = run(tmp_path / "whole", evaluate, generations=6)
    calls = 0

    def dies_at_the_second(values: Columns, only: np.ndarray) -> Answers:
        nonlocal calls
        calls += 1
        if calls > 1:
            raise Killed
        return evaluate(values, only)  # type: ignore[operator]

    for generation in range(6):
        calls = 0
        np.random.seed(generation)  # another process has another state of NumPy's own generator
        try:
            parts, again, _ = run(tmp_path / "parts", dies_at_the_second, generations=6)
        except Killed:
            assert generation < 5
            assert len(list((tmp_path / "parts" / store.GENERATIONS).glob("*"))) == generation + 1
    assert same(whole, parts)
    assert again == best


def test_more_generations_continue_fewer(tmp_path: pathlib.Path) -> None:
    evaluate = of_functions(f=sphere)
    few, *_ = solved(tmp_path / "a", evaluate, generations=5)
    more, *_ = solved(tmp_path / "a", evaluate, generations=9)
    at_once, *_ = solved(tmp_path / "b", evaluate, generations=9)
    assert same(more, at_once)
    assert same(few, {name: column[: len(few["x"])] for name, column in more.items()})


def test_other_designs_in_the_folder_are_refused(tmp_path: pathlib.Path) -> None:
    solved(tmp_path, of_functions(f=sphere), generations=3)
    with pytest.raises(InputError, match="other designs"):
        solved(tmp_path, of_functions(f=sphere), generations=4, seed=1)


def test_the_figure_takes_a_search_without_any_feasible_design(tmp_path: pathlib.Path) -> None:
    columns, _, aim = solved(
        tmp_path,
        of_functions(f=lambda x, y: x, g=sphere),
        limits=(Limit("g", False, -1.0),),
        constraints=("x > y",),
        generations=2,
    )
    read = (read_constraint("x > y", (X, Y)),)
    draw_search(Problem((X, Y), read, aim, 0), {"f": "g", "g": "mm"}, columns, tmp_path / "search.png")
    assert (tmp_path / "search.png").read_bytes().startswith(b"\x89PNG")


# -- a search's file --------------------------------------------------------------------------------------

PARAMETERS = """
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
[parameters.fill_start]
key = "phases.dorsiflexor.inlet[0][0]"
from = 0.45
to = 0.85
"""
OBJECTIVE_TABLE = '[objective]\nmetric = "air_per_stride"\ngoal = "lowest"\n'
LIMIT = '[[limits]]\nmetric = "toe_clearance"\nat_least = "-1.5 cm"\nshare = 0.5\n'
STRENGTH = '[patients.parameters.strength]\nkey = "patient.dorsiflexor_strength"\nfrom = 0.0\nto = 0.5\n'
PATIENT_TABLE = f'[patients]\ndesign = "latin-hypercube"\ncases = 2\n{STRENGTH}'
HEAD = (
    'scenario = "walk-dropfoot-afo"\nmethod = "cma-es"\ngenerations = 1\nstarts = 2\npopulation = 4\n'
    'constraints = ["fill_start < 0.8"]\n'
    '[set]\nduration = "3.6 s"\ntimestep = "4 ms"\n'
)
SMALL = HEAD + PARAMETERS + OBJECTIVE_TABLE + LIMIT + PATIENT_TABLE


def written(folder: pathlib.Path, text: str = SMALL) -> pathlib.Path:
    file = folder / "small.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("name", assets.names("search"))
def test_shipped_searches_are_good(name: str) -> None:
    search = plan.read(name)
    assert len(search.description) > 10
    judging, fresh = search.judging(), search.fresh()
    assert (judging is None) == (fresh is None) == (search.patients is None)
    if judging is not None and fresh is not None:
        assert len(fresh) == 4 * len(judging)
        for parameter in judging.values:  # none of the fresh patients is one of the others
            assert not set(judging.values[parameter]) & set(fresh.values[parameter])


def test_a_search_is_checked(call: Call, tmp_path: pathlib.Path) -> None:
    code, out, _ = call("check", written(tmp_path))
    assert code == 0
    assert "search" in out
    assert "lowest air_per_stride" in out


def test_whole_numbers_are_searched_by_cma_es(tmp_path: pathlib.Path, call: Call) -> None:
    count = '[parameters.count]\nkey = "orthosis.muscle.dorsiflexor.count"\nfrom = 1\nto = 3\n'
    for more, method in (("", "surrogate"), (count, "cma-es")):
        text = SMALL.replace('"cma-es"', '"surrogate"').replace(OBJECTIVE_TABLE, more + OBJECTIVE_TABLE)
        assert plan.read(written(tmp_path, text)).proposer == method
    code, out, err = call("optimise", tmp_path / "small.toml", "--out", tmp_path / "out", "--dry-run")
    assert code == 0 and "surrogate takes no whole numbers: cma-es searches" in out, err


def test_limits_have_bounds_in_the_metrics_unit_and_are_told_apart(tmp_path: pathlib.Path) -> None:
    more = '[[limits]]\nmetric = "torque_covered"\nat_least = "50 %"\n'
    more += '[[limits]]\nmetric = "toe_clearance"\nat_least = "-5 cm"\n'
    more += '[[limits]]\nmetric = "toe_clearance"\nat_most = "5 cm"\n'
    search = plan.read(written(tmp_path, SMALL.replace(PATIENT_TABLE, more + PATIENT_TABLE)))
    aim = search.aim({"air_per_stride": "g", "toe_clearance": "mm", "torque_covered": "percent"})
    toe = "toe_clearance_at_least"
    names = [toe, "torque_covered_at_least", f"{toe}_2", "toe_clearance_at_most"]
    assert [limit.name for limit in aim.limits] == names
    assert [limit.bound for limit in aim.limits] == [-15.0, 50.0, -50.0, 50.0]
    assert plan.read(written(tmp_path)).fingerprint()["search"] != search.fingerprint()["search"]


def test_fresh_patients_that_are_invalid_are_refused_before_anything_runs(
    tmp_path: pathlib.Path, call: Call
) -> None:
    """Two patients about 0.3 are strengths; of eight more, one is below zero."""
    normal = 'distribution = "normal"\nmean = 0.3\nsd = 0.15\n'
    file = written(tmp_path, SMALL.replace("from = 0.0\nto = 0.5\n", normal))
    search = plan.read(file)
    assert search.judging() is not None
    code, _, err = call("optimise", file, "--out", tmp_path / "out")
    assert code == 2 and "patients.parameters.strength" in err
    assert not (tmp_path / "out").exists()


REFUSED = {
    "no objective": (OBJECTIVE_TABLE, "", r"objective: is missing"),
    "unknown metric": ("air_per_stride", "air_per_strid", r"objective.*did you mean 'air_per_stride'"),
    "unknown limit": ("toe_clearance", "toe_clearanc", r"limits.*did you mean 'toe_clearance'"),
    "goal": ('"lowest"', '"least"', r"objective\.goal = 'least'.*'lowest' or 'highest'"),
    "no goal": ('goal = "lowest"', "", r"objective\.goal: is missing"),
    "method": ('"cma-es"', '"cma"', r"method = 'cma'.*'surrogate' or 'cma-es'"),
    "generations": ("generations = 1", "generations = 0", r"generations = 0.*at least 1"),
    "population": ("population = 4", "population = 2", r"population = 2.*at least 4"),
    "empty range": ('to = "4 bar"', 'to = "1 bar"', r"parameters\.pressure\.from.*the range is empty"),
    "values": ("from = 0.45\nto = 0.85", "values = [0.5, 0.6]", r"fill_start\.values.*allowed: from and to"),
    "words": ('from = "2 bar"\nto = "4 bar"', 'values = ["2 bar"]', r"pressure\.values.*from and to"),
    "spread": (
        "from = 0.45\nto = 0.85",
        'distribution = "normal"\nmean = 0.5\nsd = 0.1',
        r"fill_start\.distribution.*from and to",
    ),
    "unit of a limit": ('"-1.5 cm"', '"5 bar"', r"limits\[0\]\.at_least = '5 bar'.*does not convert to mm"),
    "no unit": ('"-1.5 cm"', "5", r"limits\[0\]\.at_least = 5: has no unit"),
    "no bound": ('at_least = "-1.5 cm"', "", r"limits\.0\.at_least: the bound is not stated"),
    "two bounds": ('"-1.5 cm"', '"-1.5 cm"\nat_most = "1 cm"', r"the bound is not stated, or twice"),
    "share": ("share = 0.5", "share = 1.5", r"limits\.0\.share = 1\.5.*at most 1"),
    "not of this scenario": (
        '"air_per_stride"',
        '"air_per_cycle"',
        r"objective\.metric = 'air_per_cycle': is not a metric of these cases",
    ),
    "same key": (
        '"patient.dorsiflexor_strength"\nfrom = 0.0\nto = 0.5',
        '"supply.pressure"\nfrom = "2 bar"\nto = "3 bar"',
        r"patients\.parameters\.strength\.key.*sets what 'pressure' sets already",
    ),
    "same name": ("[patients.parameters.strength]", "[patients.parameters.pressure]", r"name of a searched"),
    "taken name": ("[parameters.pressure]", "[parameters.objective]", r"what another column"),
    "patients' design": ('"latin-hypercube"', '"latin-hypercub"', r"patients\.design.*'latin-hypercube'"),
    "sensitivity": ('"latin-hypercube"', '"saltelli"', r"patients\.design = 'saltelli'"),
    "patients' range": ("to = 0.5\n", "to = 0.0\n", r"patients\.parameters\.strength\.from"),
    "patients' value": ("to = 0.5\n", "to = 1.5\n", r"patients\.parameters\.strength"),
    "typing error": ("generations", "generation", r"generation.*did you mean 'generations'"),
    "constraint": ("fill_start < 0.8", "fil_start < 0.8", r"did you mean 'fill_start'"),
    "scenario": ('"walk-dropfoot-afo"', '"walk-dropfoot-af"', r"did you mean 'walk-dropfoot-afo'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str, tmp_path: pathlib.Path, call: Call) -> None:
    old, new, message = REFUSED[case]
    assert old in SMALL
    file = written(tmp_path, SMALL.replace(old, new))
    code, _, err = call("optimise", file, "--out", tmp_path / "out")
    assert code == 2
    assert "Traceback" not in err
    assert re.search(message, err.replace("\n", " ")), err
    assert not (tmp_path / "out").exists()


def test_without_cma_it_says_what_to_install(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cma", None)
    code, _, err = call("optimise", written(tmp_path), "--out", tmp_path / "out")
    assert code == 2
    assert "pip install 'afo-sim[study]'" in err
    assert not (tmp_path / "out").exists()


# -- the real thing ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("whole")
    arguments = ["optimise", str(written(folder)), "--out", str(folder / "out"), "--threads", "1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["afo-sim", *arguments])
        assert error_handler.run(cli.app) == 0
    return folder


@pytest.mark.slow
def test_a_killed_search_ends_as_if_it_had_not_been(
    uninterrupted: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    out = tmp_path / "out"
    file = written(tmp_path)
    command = [sys.executable, "-m", "afo_sim", "optimise", str(file), "--out", str(out), "--threads", "1"]
    assert killed(command, out / store.GENERATIONS)
    assert not (out / store.BEST).exists()
    code, printed, err = call("optimise", file, "--out", out)  # with as many threads as there are
    assert code == 0, err
    assert "objective and limits" in printed
    for name in (store.DESIGNS, store.BEST):
        assert (out / name).read_bytes() == (uninterrupted / "out" / name).read_bytes()


def set_by(row: dict[str, Any]) -> dict[str, Any]:
    """What a design of the search sets."""
    found = {"phases.dorsiflexor.inlet[0][0]": row["fill_start"], "duration": "3.6 s", "timestep": "4 ms"}
    return found | {"supply.pressure": f"{row['pressure']!r} Pa"}


@pytest.mark.slow
def test_every_design_is_what_its_patients_say(uninterrupted: pathlib.Path) -> None:
    """Each patient of each design run alone, the limit counted patient by patient."""
    search = plan.read(uninterrupted / "small.toml")
    patients = cases_of(search.patients)  # type: ignore[arg-type]
    table = pq.read_table(uninterrupted / "out" / store.DESIGNS).to_pylist()
    assert len(table) == 8
    simulated = [row for row in table if row["fill_start"] < 0.8]
    assert all(row[OUTSIDE] > 0.0 for row in table if row not in simulated)
    for row in simulated[:2]:
        sets = set_by(row)
        runs = [afo_sim.run("walk-dropfoot-afo", sets | patients.sets(k)) for k in range(2)]
        air = [run.metrics["air_per_stride"].value for run in runs]
        toe = [run.metrics["toe_clearance"].value for run in runs]
        assert row[OBJECTIVE] == (air[0] + air[1]) / 2.0
        # half of all patients: of two that are drawn, the worse one has a third below it in the mean
        assert row["toe_clearance_at_least_level"] == min(toe)
        assert row["feasible"] == (min(toe) >= -15.0)


@pytest.mark.slow
def test_the_best_design_is_told(uninterrupted: pathlib.Path) -> None:
    best = json.loads((uninterrupted / "out" / store.BEST).read_text())
    rows = pq.read_table(uninterrupted / "out" / store.DESIGNS).to_pylist()
    row = rows[best["design"]]
    assert {p["name"]: p["value"] for p in best["parameters"]} == {
        name: row[name] for name in ("pressure", "fill_start")
    }
    good = [r for r in rows if r["feasible"]]
    assert best["feasible"] == bool(good)
    if good:
        assert row[OBJECTIVE] == min(r[OBJECTIVE] for r in good)
    assert best["fresh_patients"]["patients"] == 8
    sets, patients = set_by(row), cases_of(plan.read(uninterrupted / "small.toml").patients)  # type: ignore[arg-type]
    half = f"{as_run(afo_sim.load('scenario', 'walk-dropfoot-afo', sets)).timestep / 2.0!r} s"
    each = [sets | patients.sets(k) | {"timestep": half} for k in range(2)]
    runs = [afo_sim.run("walk-dropfoot-afo", one).metrics for one in each]
    assert best["half_step"]["objective"] == pytest.approx(
        sum(run["air_per_stride"].value for run in runs) / 2
    )
    lowest = min(run["toe_clearance"].value for run in runs)
    assert best["half_step"]["limits"][0]["level"] == pytest.approx(lowest)


def test_a_finished_search_computes_nothing(uninterrupted: pathlib.Path, call: Call) -> None:
    out = uninterrupted / "out"
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    code, printed, _ = call("optimise", uninterrupted / "small.toml", "--out", out)
    assert code == 0
    assert "nothing was computed" in printed
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == before


def test_an_infeasible_result_says_what_is_short(uninterrupted: pathlib.Path) -> None:
    best = json.loads((uninterrupted / "out" / store.BEST).read_text())
    best |= {"feasible": False, "feasible_designs": 0}
    best["limits"][0] |= {"level": -22.5, "short": 7.5, "kept": 0.0, "bound": -15.0}
    held = {"metric": "torque_against_push_off_per_mass", "at": "most", "unit": "N*m/kg", "share": 1.0}
    best["limits"] += [held | {"bound": 0.07, "level": 0.074, "short": 0.004, "kept": 0.0}]
    best["parameters"][0]["value"] = 3.99e5  # of 2 to 4 bar
    best["parameters"][1]["value"] = 0.65  # of 0.45 to 0.85
    said = " ".join(statement(best))
    assert "at an end of its range: pressure;" in said
    assert "no design meets every limit" in said
    assert "Toe clearance is 7.5 mm below the limit of −15.0 mm; " in said
    assert "is 0.004 N·m/kg above the limit of 0.070 N·m/kg" in said
