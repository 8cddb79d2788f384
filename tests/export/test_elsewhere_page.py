"""The page on use elsewhere names every input and output, with its unit."""

import re

import pytest
from documents import PAGES

from afo_sim.description import load
from afo_sim.export.elsewhere.variables import variables_of
from afo_sim.model import as_run
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build

UNITS = {"N*m": "N·m", "m^3": "m³"}


@pytest.mark.parametrize("name", ["seated", "walk-dropfoot-afo", "arm", "knee"])
def test_every_variable_of_a_scenario_is_in_the_tables(name: str) -> None:
    built = build(as_run(load("scenario", name)))
    rows = [line for line in PAGES["elsewhere"].splitlines() if line.startswith("| `")]
    for each in variables_of(built, schedule.controls(built)[0]):
        if not each.name:
            continue
        generic = re.sub(r"^(valve|chamber|muscle|store)/.+/", r"\1/NAME/", each.name)
        generic = re.sub(r"^walk/.+", "walk/…", generic)
        last = "…/" + generic.rpartition("/")[2]
        (row,) = [
            line
            for line in rows
            if f"`{generic}`" in line or (f"`{last}`" in line and f"`{generic.partition('/')[0]}/" in line)
        ]
        assert generic == "walk/…" or UNITS.get(each.unit, each.unit) in row, each.name
