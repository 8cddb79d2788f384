"""The cases of a sweep: grid, list, random, Latin hypercube, Sobol', Saltelli, joint draws."""

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, JsonDict, optional
from afo_sim.description import load
from afo_sim.study.parameter import Choice, OwnSeed, Parameter
from afo_sim.study.sweep_plan import Plan

MOST = 10_000_000  # cases, beyond which a number is taken for a slip
_BLOCK = 1 << 16  # samples at a time
_RARE = 1e-3  # share of samples within the constraints below which a sweep is refused …
_JUDGED = 20_000  # … once so many are drawn
STEP_SECONDS, ROW_BYTES = 4e-6, 600.0  # what a step and a row take, roughly, for what is reported of a slip
_FEW = 48  # cases that are all checked before the first is run

_ROW_BY_ROW = ("list", "uncertainty")  # designs whose parameters hold a value for each case

Columns = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Cases:
    """The cases of a sweep, numbered from 0."""

    plan: Plan
    values: Columns
    seeds: np.ndarray
    dropped: int

    def __len__(self) -> int:
        return len(self.seeds)

    def sets(self, case: int) -> JsonDict:
        """The overrides of one case by dotted key, as `load` takes them; the plan's fixed ones among them."""
        sets = dict(self.plan.set)
        for parameter in self.plan.parameters:
            value = self.values[parameter.name][case]
            written = parameter.written(value if isinstance(value, str) else float(value))
            sets |= dict.fromkeys(parameter.keys, written)
        return sets

    def in_words(self, case: int) -> str:
        """One case in words: "pressure = 200000.0 Pa, patient = drop-foot"."""
        each = {p.name: p.written(self.values[p.name][case]) for p in self.plan.parameters}
        return ", ".join(f"{name} = {value}" for name, value in each.items())


def cases_of(plan: Plan, most: int = MOST) -> Cases:
    """Every case of a sweep."""
    varied = [p for p in plan.parameters if not isinstance(p.spread, OwnSeed)]
    _check_count(plan, varied, most)
    if plan.design == "grid":
        meshes = np.meshgrid(*map(_levels, varied), indexing="ij")  # the last parameter fastest
        values, dropped = _within(plan, {p.name: m.ravel() for p, m in zip(varied, meshes, strict=True)})
    elif plan.design in _ROW_BY_ROW:
        values, dropped = _within(plan, {p.name: _levels(p) for p in varied})
    elif plan.design == "saltelli":
        # for first, second and total order
        sobol, names = optional("SALib.sample.sobol"), [f"x{k}" for k in range(len(varied))]
        asked = {"num_vars": len(varied), "names": names, "bounds": [[0.0, 1.0]] * len(varied)}
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="The balance properties of Sobol", category=UserWarning)
            shares = sobol.sample(asked, plan.cases, calc_second_order=True, seed=plan.seed)
        values, dropped = _spread(varied, np.asarray(shares)), 0
    else:
        values, dropped = _drawn(plan, varied)
    count = len(next(iter(values.values()))) if values else plan.cases or 1
    seeds = case_seeds(plan.seed, count)
    columns = {p.name: values.get(p.name, seeds.astype(np.float64)) for p in plan.parameters}
    cases = Cases(plan, columns, seeds, dropped)
    for case in plan.keep:
        if case >= len(cases):
            problem, allowed = "there is no such case", f"0 to {len(cases) - 1}"
            raise InputError(problem, file=plan.file, field="keep", value=case, allowed=allowed)
    for case in _telling(cases):  # so that what is wrong shows before the first is run
        try:
            load("scenario", plan.scenario, cases.sets(case))
        except InputError as error:
            raise _case_error(cases, case, error) from None
    return cases


def case_seeds(seed: int, count: int) -> np.ndarray:
    """Every case's own seed (count,), of uint32: of the sweep's seed and the case's number alone."""
    found = (np.random.SeedSequence([seed, case]).generate_state(1)[0] for case in range(count))
    return np.fromiter(found, np.uint32, count)


def _check_count(plan: Plan, varied: list[Parameter], most: int) -> None:
    """Refuse a design of too many cases, before constraints, or of nothing to vary."""
    levels = [len(_levels(p)) for p in varied if isinstance(p.spread, Choice)]
    count = plan.cases or 0
    if plan.design == "grid":
        count = math.prod([*levels, *(getattr(p.spread, "steps", None) or 1 for p in varied)])
    elif plan.design in _ROW_BY_ROW:
        count = plan.cases or levels[0]
    elif plan.design == "saltelli":
        count *= 2 * len(varied) + 2
    if count > most:
        steps = load("scenario", plan.scenario, plan.set).n_step
        days, size = count * steps * STEP_SECONDS / 86_400.0, count * ROW_BYTES / 1e9
        text = f"the design has {count} cases: some {days:.2g} days on one processor, "
        text += f"{size:.2g} GB of results"
        field = "parameters" if plan.design == "grid" else "cases"
        raise InputError(text, file=plan.file, field=field, allowed=f"up to {most}, or `yes_many`")
    if plan.design == "saltelli" and not varied:
        problem = "has no parameter but seeds"
        raise InputError(problem, file=plan.file, field="parameters", allowed="at least one")


def _levels(parameter: Parameter) -> np.ndarray:
    return parameter.spread.levels()  # type: ignore[union-attr]  # a grid has levels alone


def _within(plan: Plan, values: Columns) -> tuple[Columns, int]:
    """(the cases within the constraints, number of the others)"""
    holds = _holds(plan, values)
    dropped = int(np.count_nonzero(~holds))
    if values and dropped == len(holds):
        raise _contradiction(plan, f"leave none of {dropped} cases")
    return {name: column[holds] for name, column in values.items()}, dropped


def _holds(plan: Plan, values: Columns) -> np.ndarray:
    every = np.ones(len(next(iter(values.values()), "-")), dtype=bool)
    return np.logical_and.reduce([every, *(constraint.holds(values) for constraint in plan.constraints)])


def _contradiction(plan: Plan, problem: str) -> InputError:
    stated = "; ".join(constraint.text for constraint in plan.constraints)
    return InputError(problem, file=plan.file, field="constraints", value=stated, allowed="less strict ones")


def _drawn(plan: Plan, varied: list[Parameter]) -> tuple[Columns, int]:
    """Samples within the constraints, as many as asked for, and how many were left out on the way."""
    wanted = plan.cases or 0
    if not varied:
        return {}, 0
    kept: list[Columns] = []
    found = drawn = 0
    for share in _samples(plan, len(varied)):
        values = _spread(varied, share)
        inside = np.flatnonzero(_holds(plan, values))[: wanted - found]
        kept.append({name: column[inside] for name, column in values.items()})
        found += len(inside)
        if found == wanted:
            drawn += int(inside[-1]) + 1
            break
        drawn += len(share)
        if drawn >= _JUDGED and found < _RARE * drawn:
            raise _contradiction(plan, f"leave {found} of {drawn} samples")
    return {p.name: np.concatenate([part[p.name] for part in kept]) for p in varied}, drawn - wanted


def _spread(varied: list[Parameter], share: np.ndarray) -> Columns:
    """Values from samples of the unit hypercube (n, number of parameters)."""
    return {p.name: p.spread.at(share[:, k]) for k, p in enumerate(varied)}  # type: ignore[union-attr]  # no seed


def _samples(plan: Plan, dimensions: int) -> Iterator[np.ndarray]:
    """Samples of the unit hypercube (n, dimensions) without end, in blocks."""
    generator = np.random.default_rng(plan.seed)
    block = min(1 << max((plan.cases or 1) - 1, 1).bit_length(), _BLOCK)
    if plan.design == "random":
        while True:
            yield generator.random((block, dimensions))
    from scipy.stats import qmc  # slow to import

    if plan.design == "latin-hypercube":
        sequence, block = qmc.LatinHypercube(dimensions, seed=generator), plan.cases or 1
    else:
        sequence = qmc.Sobol(dimensions, scramble=True, seed=generator)
    while True:
        yield sequence.random(block)


def _telling(cases: Cases) -> list[int]:
    """The cases that are read as scenarios before any is run."""
    if len(cases) <= _FEW:
        return list(range(len(cases)))
    found: set[int] = set()
    for parameter in cases.plan.parameters:
        column = cases.values[parameter.name]
        if parameter.words:
            found |= {int(np.argmax(column == word)) for word in set(column)}
        else:
            middle = np.argpartition(column, len(column) // 2)[len(column) // 2]
            found |= {int(column.argmin()), int(middle), int(column.argmax())}
    return sorted(found)


def _case_error(cases: Cases, case: int, error: InputError) -> InputError:
    """The error of a case, as one of the parameter that set the field, if one did."""
    plan = cases.plan
    at = error.field.replace("[", ".").replace("]", "")
    blamed = [
        (parameter, key)
        for parameter in plan.parameters
        for key in parameter.keys
        if f"{at}.".startswith(dotted := key.replace("[", ".").replace("]", "") + ".")
        or dotted.startswith(f"{at}.")
    ]
    field, about = "parameters", error.field
    if len(blamed) == 1 or (blamed and at == blamed[0][1]):
        field, about = f"parameters.{blamed[0][0].name}", blamed[0][1]
    problem = f"case {case} is not a valid scenario: {about}: {error.problem}; {cases.in_words(case)}"
    return InputError(problem, file=plan.file, field=field, allowed=error.allowed, nearest=error.nearest)
