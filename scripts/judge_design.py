"""How a design keeps a search's limits: with the search's own patients and with its fresh ones.

    python scripts/judge_design.py least-air pressure="2.22 bar" link="6.24 cm" fill_start=0.601 \
        fill_end=0.708 vent_start=0.397 [--set start.dorsiflexor.fill_time="0 s"]

The values are those of the search's parameters, by their names; what `--set` tells holds for all patients.
"""

import argparse
import json
from dataclasses import replace

import numpy as np

from afo_sim.common import parse_quantity
from afo_sim.description import expand
from afo_sim.metrics import words
from afo_sim.study import Cases, SearchPlan, answers, probe, processors
from afo_sim.study.pool import pool
from afo_sim.study.search.plan import read


def main() -> None:
    """Print objective, level and kept share of every limit."""
    asked = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    asked.add_argument("search", help="its name or file")
    asked.add_argument("values", nargs="+", help="NAME=VALUE of every parameter")
    asked.add_argument("--set", action="append", default=[], help="KEY=VALUE, as afo-sim run takes it")
    options = asked.parse_args()
    search = read(options.search)
    sets = search.designs.set | dict(one.split("=", 1) for one in options.set)
    search = replace(search, designs=search.designs.model_copy(update={"set": sets}))
    written = dict(one.split("=", 1) for one in options.values)
    units = {parameter.name: parameter.unit for parameter in search.designs.parameters}
    values = {
        name: np.array([parse_quantity(written[name], unit) if unit else float(written[name])])
        for name, unit in units.items()
    }
    for who, patients in (("the search's patients", search.judging()), ("fresh patients", search.fresh())):
        if patients is not None:
            judge(search, values, patients, who)


def judge(search: SearchPlan, values: dict[str, np.ndarray], patients: Cases, who: str) -> None:
    """Print what one group of patients says of a design {parameter: value (1,) [SI]}."""
    scenario = json.loads(json.dumps(expand("scenario", search.designs.scenario)))
    designs = search.as_cases(values)
    units, _ = probe(scenario, [designs.sets(0) | patients.sets(0)], search.file)
    aim = search.aim(units)
    with pool(processors(), 0, "") as workers:
        found = answers(scenario, designs, patients, aim.metrics, workers)
    goal = aim.objective
    print(f"{len(patients)} of {who}{': ' + found.reasons[0] if found.reasons[0] else ''}")
    columns = aim.judge(found.metrics)
    print(f"  {words(goal.metric).label}, {goal.over}: {columns['objective'][0]:.4g} {units[goal.metric]}")
    for limit in aim.limits:
        sign, unit = "≥" if limit.at_least else "≤", units[limit.metric]
        level, kept = columns[f"{limit.name}_level"][0], 100.0 * columns[f"{limit.name}_kept"][0]
        held = "kept" if columns[f"{limit.name}_short"][0] == 0.0 and not np.isnan(level) else "NOT kept"
        asked = f"{sign} {limit.bound:g} {unit} in {100.0 * limit.share:g} %"
        print(f"  {words(limit.metric).label} {asked}: {level:.4g} {unit}, in {kept:.3g} %: {held}")


if __name__ == "__main__":
    main()
