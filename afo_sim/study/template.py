"""Files to start from: a new sweep or design search that runs at once."""

import os
import pathlib
from collections.abc import Mapping

from afo_sim.common import InputError, assets, check_writable, write_text
from afo_sim.description import base_of, target_of
from afo_sim.description.new import reference
from afo_sim.study.search.plan import STARTS

_PARAMETERS = """\
# The parameters: one table each. Its name is a column of the results.
[parameters.pressure]
key = "supply.pressure"    # what it sets; afo-sim keys {scenario} lists every key
# keys = ["supply.pressure", "…"]    # instead of key: several keys that get the same value
from = "2 bar"             # lowest value, with its unit
to = "4 bar"               # highest value
"""
SWEEP = (
    """\
# {name}: a sweep, many runs of one scenario.
# What stands behind # has no effect until the # goes.

# One line that says what it is.
description = "the lowest supply pressure that still lifts the foot"

# A shipped scenario, or the path of one from here.
scenario = "{scenario}"

# How the cases are chosen: "grid" (every combination), "list" (row by row of values), or drawn: "random",
# "latin-hypercube", "sobol", "saltelli" (for Sobol indices), "uncertainty" (what is not known, together).
design = "grid"

# Number of drawn cases, at least 1; needed where they are drawn, refused for grid and list.
# cases = 64

# Seed of what is drawn, at least 0; default 0.
# seed = 0

# Metrics to keep, of those that afo-sim run prints; default all.
metrics = ["{metric}", "{other}"]

# Numbers of cases, from 0, whose whole recording is kept; default none.
# keep = [0]

# Cases that are computed together, at least 1; default 32.
# chunk = 32

# Conditions between parameters that a case must meet; default none.
# constraints = ["pressure < '3.5 bar'"]

# CSV file of cases, a column for each parameter without values; for the design "list".
# file = "cases.csv"

# What is not known, a shipped name or a TOML file; for the design "uncertainty", instead of parameters.
# spreads = "usual"

# Keys of the scenario that are the same in all cases.
[set]
duration = "{duration}"

"""
    + _PARAMETERS
    + """\
steps = 3                  # of a grid, at least 2
# scale = "log"            # "linear" by default
# values = ["2 bar", "3 bar"]    # instead of from and to: these values alone
# distribution = "normal"  # or "lognormal", of drawn cases: with mean (or median) and sd, cut at from and to
# mean = "3 bar"
# median = "3 bar"
# sd = "0.3 bar"
# from_seed = true         # instead of all that: a whole number of its own in each case, for a seed
"""
)
SEARCH = (
    """\
# {name}: a design search by CMA-ES.
# What stands behind # has no effect until the # goes.

# One line that says what it is.
description = "the lowest supply pressure that still lifts the foot"

# A shipped scenario, or the path of one from here.
scenario = "{scenario}"

# Generations at most, at least 1; default 40.
generations = 3

# Designs of a generation, at least 4; default by the number of parameters.
population = 4

# Seed of the search, at least 0; default 0.
# seed = 0

# Independent searches of that many generations, each with a seed of its own, 1 to 100; default {starts}.
# Their spread shows how sure the best design is.
starts = 1

# Conditions between parameters that a design must meet; default none.
# constraints = ["pressure < '3.5 bar'"]

# Keys of the scenario that are the same in all runs.
[set]
duration = "{duration}"

"""
    + _PARAMETERS
    + """\
# scale = "log"            # "linear" by default

# What is to be best.
[objective]
metric = "{other}"         # of those that afo-sim run prints
goal = "lowest"            # or "highest"
# over = "mean"            # of the patients: "mean", "median" or "worst"

# What every design must keep; one [[limits]] each.
[[limits]]
metric = "{metric}"
at_least = "{bound}"       # or at_most
# at_most = "40 deg"
# share = 1.0              # of the patients in which it must be kept, above 0, to 1

# Patients by which every design is judged, as a sweep states its cases; default the scenario's own.
# [patients]
# design = "latin-hypercube"
# cases = 20
# seed = 1
# file = "patients.csv"
# constraints = []
#
# [patients.parameters.strength]
# key = "patient.dorsiflexor_strength"
# from = 0.0
# to = 0.5
"""
)
_TEXTS = {"sweep": SWEEP, "search": SEARCH}
_SEATED = {"metric": "range_of_motion", "other": "air_per_cycle", "bound": "15 deg", "duration": "8 s"}
_WALKING = {"metric": "toe_clearance", "other": "air_per_stride", "bound": "0 mm", "duration": "7.2 s"}


def new_study(
    kind: str,
    name: str,
    out: str | os.PathLike[str] = ".",
    *,
    like: str = "",
    uses: Mapping[str, str] | None = None,
) -> pathlib.Path:
    """Write a commented sweep or search that runs as it is."""
    for used, where in (uses or {}).items():
        if used != "scenario":
            problem = f"does not go with a new {kind}"
            raise InputError(problem, field=used, value=where, allowed="`scenario`")
    target = target_of(kind, name, pathlib.Path(out))
    if like:
        if uses:
            raise InputError("does not go with `like`", field="scenario", value=uses["scenario"])
        text = base_of(kind, like).read_text(encoding="utf-8")
    else:
        chosen = (uses or {}).get("scenario", "seated")
        scenario = reference("scenario", chosen, target.parent)
        walks = "gait" in assets.read_toml(assets.find("scenario", chosen))
        text = _TEXTS[kind].format(
            name=name, scenario=scenario, starts=STARTS, **(_WALKING if walks else _SEATED)
        )
    check_writable(target.parent)
    write_text(target, text)
    return target
