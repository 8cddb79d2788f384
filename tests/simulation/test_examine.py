"""What a design costs after its steps: the columns that are computed, and the calls that it takes."""

import sys
from collections.abc import Callable
from typing import Any

import pytest

import afo_sim
from afo_sim import native
from afo_sim.description import load
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model import two_strides
from afo_sim.model.build import build
from afo_sim.simulation import EVERYTHING, Asked, Settled
from afo_sim.simulation.examine import examine
from afo_sim.simulation.settle import settle

BEGUN = {"time", "gait/phase", "gait/stride"}  # that there are rows, and where strides begin
STANCE = BEGUN | {"gait/ground_force_z"}
TORQUE = {"ankle/moment/orthosis", "gait/needed_moment", "shank/angle"}  # the shank ends the first swing
FREE = {f"{point}/height_without_floor" for point in ("sole", "ball", "toe")}
SWING = (
    FREE
    | {"foot/toe_load", "ankle/position/x", "shank/angle"}
    | {f"{whose}_height" for whose in ("gait/sole", "gait/ball", "gait/toe")}
    | {"gait/needed_moment"}  # of a patient's own walk nothing is known of the healthy foot's floor
)
EXTENDED = {f"sole/height{how}" for how in ("_less_extended", "_more_extended")}
AIR = {"supply/mass_flow"} | {
    f"{what}/dorsiflexor{of}" for what, of in (("chamber", "/pressure"), ("valve", "_inlet/mass_flow"))
}
AIR |= {name.replace("dorsiflexor", "plantarflexor") for name in AIR}
CALLS = {  # of Python functions on 3.11, a fifth more than they are
    Asked(frozenset({"toe_clearance", "air_per_stride", "orthosis_peak_dorsiflexion_torque"})): 3850,
    EVERYTHING: 5700,
}


@pytest.fixture(scope="module")
def walked() -> tuple[Any, Settled]:
    scenario = load("scenario", "walk-dropfoot-afo", {"timestep": "2 ms"})
    built = build(two_strides(scenario))
    with native.installed():
        return built, settle([built], [schedule.controls(built)])[0]


@pytest.mark.parametrize(
    ("metric", "read"),
    [
        ("stance", STANCE),
        ("orthosis_peak_dorsiflexion_torque", STANCE | TORQUE),
        ("air_per_stride", BEGUN | AIR),
        ("toe_clearance", STANCE | SWING | EXTENDED),
    ],
)
def test_columns_that_no_asked_metric_reads_are_not_computed(
    walked: tuple[Any, Settled], metric: str, read: set[str]
) -> None:
    built, settled = walked
    asked = Asked(frozenset({metric}), doubts=False)
    columns, found = examine(built, settled.rollout, transient=False, solved=True, asked=asked)
    assert metric in found.totals
    assert {name for name, values in vars(columns)["_found"].items() if values is not None} == read


def calls_of(work: Callable[[], object]) -> int:
    """Calls of Python functions at its second run: the first fills what runs share."""
    calls = 0

    def count(frame: Any, event: str, _: Any) -> None:
        nonlocal calls
        calls += event == "call"

    for _ in range(2):
        calls = 0
        sys.setprofile(count)
        try:
            work()
        finally:
            sys.setprofile(None)
    return calls


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize("asked", CALLS)
def test_a_design_takes_few_calls_after_its_steps(walked: tuple[Any, Settled], asked: Asked) -> None:
    built, settled = walked
    args = (built, settled.rollout)
    assert calls_of(lambda: examine(*args, transient=False, solved=True, asked=asked)) <= CALLS[asked]


@pytest.mark.slow
@pytest.mark.alone
def test_no_row_of_a_run_is_a_call() -> None:
    """Of 8,000 rows, of muscles that are stretched at rest; a fifth more than there are."""
    assert calls_of(lambda: afo_sim.run("seated")) <= 15000
