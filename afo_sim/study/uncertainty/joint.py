"""Joint draws as the parameters of a sweep: a column for each drawn number."""

import pathlib
from collections.abc import Iterator

from afo_sim.common.errors import InputError
from afo_sim.description.scenario import Scenario
from afo_sim.study.parameter import Joint, Parameter
from afo_sim.study.parameter_table import is_free
from afo_sim.study.uncertainty.draw import Draws, draw
from afo_sim.study.uncertainty.held import held
from afo_sim.study.uncertainty.spreads import read

FEWEST = 2  # draws of a Latin hypercube


def joint_parameters(
    file: pathlib.Path, spreads: str, scenario: Scenario, cases: int, seed: int
) -> tuple[tuple[Parameter, ...], tuple[str, ...]]:
    """The parameters of a sweep whose cases are joint draws, and what is left out of it."""
    if not scenario.walking:
        problem = "what is not known is drawn of walking, and here nobody walks"
        raise InputError(problem, file=file, field="scenario", allowed="a scenario with a gait")
    if cases < FEWEST:
        raise InputError("is too few", file=file, field="cases", value=cases, allowed=f"{FEWEST} or more")
    drawn = draw(held(read(spreads, file), scenario), scenario, cases, seed)
    found = []
    for column in drawn.columns:
        if not is_free(column.name):
            problem = "is the name of another column of the results"
            raise InputError(problem, file=file, field=f"spreads: parameters.{column.name}")
        if column.keys:
            spread = Joint(tuple(column.values.tolist()))
            found.append(Parameter(column.name, column.keys, column.unit, spread))
    return tuple(found), tuple(_notes(drawn))


def _notes(drawn: Draws) -> Iterator[str]:
    yield from drawn.notes
    if drawn.left_out:
        yield "not drawn: " + "; ".join(drawn.left_out)
    heights = ", ".join(column.name for column in drawn.columns if not column.keys)
    if heights:
        yield (
            f"not drawn: {heights}: no key of the scenario sets a height of the sole; "
            "`afo-sim run --uncertainty` adds it to every clearance"
        )
