"""A design search from its description to its result, in a folder that it can be resumed from."""

import pathlib
from dataclasses import asdict, dataclass, replace

import numpy as np

from afo_sim.common import JsonDict, JsonMapping, Keywords, optional, together, write_json, write_sealed
from afo_sim.description import load, toml_text
from afo_sim.description.portable import portable
from afo_sim.study.design import Cases
from afo_sim.study.effect import defined
from afo_sim.study.folder import AGAIN, Changed, told_in
from afo_sim.study.pool import Pool, Report, pool
from afo_sim.study.runner import probe
from afo_sim.study.search import store
from afo_sim.study.search.aim import (
    LACKING,
    OBJECTIVE,
    OF_LIMIT,
    OUTSIDE,
    Aim,
    Columns,
    Problem,
    best_of,
    row,
)
from afo_sim.study.search.best import spread_over_starts
from afo_sim.study.search.loop import METHODS, Answers, answers, evolve
from afo_sim.study.search.plan import CMA_ES, SearchPlan
from afo_sim.study.time_step import longer


@dataclass(frozen=True)
class Opened:
    """A search and its folder. `seconds` is what one case takes; `best` the result, if it is there."""

    search: SearchPlan
    folder: pathlib.Path
    scenario: JsonDict
    units: dict[str, str]
    patients: Cases | None
    problem: Problem
    seconds: float
    best: JsonDict | None
    mixed: bool = False

    @property
    def finished(self) -> bool:
        """True where nothing is left to do."""
        best, most = self.best, self.search.generations
        return best is not None and (best["converged"] or best["generations"] >= most)

    @property
    def runs(self) -> int:
        """Simulations of the whole search at most."""
        problem = self.problem
        return problem.starts * METHODS[problem.method](problem, problem.seed).runs(self.search.generations)


def open_search(search: SearchPlan, folder: pathlib.Path, changed: Changed = "refuse") -> Opened:
    """A search in its folder: a new one, or one to be continued."""
    patients = search.judging()
    search.fresh()  # says now what would be wrong with them at the end
    plan = search.designs
    if search.proposer == CMA_ES:
        optional("cma")  # says so at once if it is missing

    def first(scenario: JsonDict) -> JsonDict:
        middle = {p.name: p.range.at(np.array([0.5])) for p in plan.parameters}
        sets = search.as_cases(middle).sets(0) | (patients.sets(0) if patients else {})
        units, beside, seconds = probe(scenario, [plan.set, sets], plan)
        search.aim(units | beside)
        return {"metrics": units | beside, "seconds_per_case": seconds}

    manifest = store.SEARCH.open(folder, changed, plan, search.fingerprint(), first)
    return Opened(
        search=search,
        folder=folder,
        scenario=manifest["scenario"],
        units=manifest["metrics"],
        patients=patients,
        problem=search.problem(search.aim(manifest["metrics"], sampled=True), patients),
        seconds=float(manifest["seconds_per_case"]),
        best=told_in(folder / store.BEST, store.RESTART),
        mixed=bool(manifest.get("mixed")),
    )


def optimise(
    search: SearchPlan, folder: pathlib.Path, *, threads: int = 0, report: Report | None = None
) -> JsonDict:
    """A whole search, or what is left of it: `open_search` and `run` in one; returns and raises as these."""
    with pool(threads) as who:
        return run(open_search(search, folder), who, report)


def run(opened: Opened, who: Pool, report: Report | None = None) -> JsonDict:
    """Search to the end; what was done before is not done again."""
    if opened.finished:
        assert opened.best is not None
        return opened.best
    search, problem = opened.search, opened.problem
    names = problem.aim.metrics

    def evaluate(values: Columns, only: np.ndarray) -> Answers:
        return answers(opened.scenario, search.as_cases(values), opened.patients, names, who, only)

    searched = evolve(problem, opened.folder, search.generations, evaluate, report)
    columns = searched[0]
    best = row(columns, best_of(problem.aim, columns))
    design = search.as_cases({p.name: best[p.name] for p in problem.parameters})
    summary = _summary(opened, searched, best, design) | {"fresh_patients": None, "half_step": None}
    inside = best[OUTSIDE][0] == 0.0
    if inside and (fresh := search.fresh()) is not None:  # patients that no design has seen
        again = answers(opened.scenario, design, fresh, names, who)
        told = {"patients": len(fresh), "seed": fresh.plan.seed}
        summary["fresh_patients"] = told | _judged_again(again, search.aim(opened.units))
    if inside and not search.designs.walkers:
        sets = longer(opened.scenario, design.sets(0), 0.5)
        half = {key: sets[key] for key in ("timestep", "record_rate")}
        finer, patients = (
            cases and replace(cases, plan=cases.plan.model_copy(update={"set": cases.plan.set | half}))
            for cases in (design, opened.patients)  # each sets what the search does
        )
        assert finer is not None
        again = answers(opened.scenario, finer, patients, names, who)
        summary["half_step"] = _judged_again(again, problem.aim)
    _write(opened, columns, summary)
    return summary


def _judged_again(found: Answers, aim: Aim) -> JsonDict:
    again = aim.judge(found.metrics)
    return {
        "lacking": int(again[LACKING][0]),
        "reason": str(found.reasons[0]),
        "objective": defined(float(again[OBJECTIVE][0])),
        "limits": _found(aim, again),
    }


def _summary(opened: Opened, searched: tuple[Columns, bool, int], best: Columns, design: Cases) -> JsonDict:
    """The result but for the best design tried again, as JSON-able data."""
    problem, aim, (columns, converged, runs) = opened.problem, opened.problem.aim, searched
    found: JsonDict = {
        "search": opened.search.file.stem,
        "scenario": opened.search.designs.scenario_name,
        "feasible": bool(aim.feasible(best)[0]),
        "feasible_designs": int(np.count_nonzero(aim.feasible(columns))),
        "converged": converged,
        "method": problem.method,
        "runs": runs,
        "starts": _starts(opened, columns),
        "generations": int(columns["generation"][-1]) + 1,
        "designs": len(columns["design"]),
        "simulated": int(np.count_nonzero(columns[OUTSIDE] == 0.0)),
        "patients": len(opened.patients) if opened.patients else 1,
        "design": int(best["design"][0]),
        "outside": float(best[OUTSIDE][0]),
        "lacking": int(best[LACKING][0]),
        "reason": str(best["reason"][0]),
        "parameters": [
            {"name": p.name, "keys": list(p.keys), "value": float(best[p.name][0]), "unit": p.unit}
            | {"from": float(p.range.lower), "to": float(p.range.upper)}
            for p in problem.parameters
        ],
        "objective": asdict(aim.objective)
        | {"unit": opened.units[aim.objective.metric], "value": defined(float(best[OBJECTIVE][0]))},
        "limits": [
            {"metric": limit.metric, "at": "least" if limit.at_least else "most", "bound": limit.bound}
            | {"unit": opened.units[limit.metric], "share": limit.share}
            | values
            for limit, values in zip(aim.limits, _found(aim, best), strict=True)
        ],
        "sets": design.sets(0),
    }
    walkers = opened.search.designs.walkers
    found |= {"walkers": pathlib.Path(walkers).stem} if walkers else {}
    return found | ({"mixed": True} if opened.mixed else {})


def _starts(opened: Opened, columns: Columns) -> list[JsonDict]:
    """The best design of each start, by which the spread over seeds is shown."""
    problem = opened.problem
    found: list[Keywords] = []
    for start, seed in enumerate(problem.seeds):
        own = {name: values[columns["start"] == start] for name, values in columns.items()}
        best = row(own, best_of(problem.aim, own))
        found.append(
            {
                "seed": seed,
                "design": int(best["design"][0]),
                "feasible": bool(problem.aim.feasible(best)[0]),
                "objective": defined(float(best[OBJECTIVE][0])),
                "parameters": {p.name: float(best[p.name][0]) for p in problem.parameters},
            }
        )
    return found


def _found(aim: Aim, columns: Columns) -> list[dict[str, float | None]]:
    return [
        {what: defined(float(columns[f"{limit.name}_{what}"][0])) for what in OF_LIMIT}
        for limit in aim.limits
    ]


def _write(opened: Opened, columns: Columns, summary: JsonMapping) -> None:
    """All files of the result."""
    aim, folder = opened.problem.aim, opened.folder
    units = {p.name: p.unit for p in opened.problem.parameters}
    units[OBJECTIVE] = opened.units[aim.objective.metric]
    for limit in aim.limits:
        units |= {f"{limit.name}_{what}": opened.units[limit.metric] for what in ("level", "short")}
    judged = {"feasible": aim.feasible(columns), "violation": aim.violation(columns)}
    about = {key: summary[key] for key in ("search", "scenario", "objective", "limits")}
    with together(folder, (store.DESIGNS, store.SCENARIO, store.BEST), AGAIN) as scratch:
        store.write_table(scratch / store.DESIGNS, columns | judged, "designs", units, about)
        # the files that the scenario needs are copied beside it
        scenario = portable(load("scenario", opened.scenario, summary["sets"]).resolved(), folder, scratch)
        scenario["name"] = f"{opened.search.file.stem}-best"
        worse = "design that violates its limits least (none meets them)"
        kind = "best design" if summary["feasible"] else worse
        head = [f"The {kind} of {summary['designs']} that the search {opened.search.file.name} tried."]
        text = "".join(f"# {line}\n" for line in (*head, *spread_over_starts(summary)))
        write_sealed(scratch / store.SCENARIO, text + toml_text(scenario), "scenario", scratch)
        write_json(scratch / store.BEST, summary, "best design")
