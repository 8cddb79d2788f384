"""The time step of a sweep, judged on a sample of its cases: against the same runs made one by one."""

import pathlib

import pytest
from command import Call

import afo_sim
from afo_sim.common import read_json
from afo_sim.simulation import step_errors
from afo_sim.study.results import STEPS
from afo_sim.study.time_step import remark

VALVES = {f"orthosis.chamber.dorsiflexor.{valve}": "sy9000" for valve in ("inlet", "outlet")}
SWEEP = """
scenario = "seated"
design = "grid"
[set]
duration = "1 s"
timestep = "{step} ms"
"orthosis.chamber.dorsiflexor.inlet" = "sy9000"
"orthosis.chamber.dorsiflexor.outlet" = "sy9000"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
steps = 5
"""


@pytest.mark.parametrize(("step", "fine"), [(4.0, False), (0.25, True)])
def test_numbers_that_twice_the_step_moves_are_named(
    step: float, fine: bool, tmp_path: pathlib.Path, call: Call
) -> None:
    """The first and the last of five cases."""
    (tmp_path / "sweep.toml").write_text(SWEEP.format(step=step))
    code, printed, _ = call("sweep", tmp_path / "sweep.toml", "--out", tmp_path / "out", "--threads", "1")
    told = read_json(tmp_path / "out" / STEPS)
    assert (
        code == 0
        and remark(tmp_path / "out") in " ".join(printed.split())
        and (told["sample"], told["checked"]) == (2, 2)
    )
    assert (not told["beyond"]) is fine
    named = {name for names in told["beyond"].values() for name in names}
    assert all(name in remark(tmp_path / "out") for name in named)  # by them nobody should decide
    assert fine or f"other {len(told['worst']) - len(named)} numbers" in remark(tmp_path / "out")
    times = {}
    for case, pressure in ((0, "2 bar"), (4, "4 bar")):
        sets = VALVES | {"duration": "1 s", "supply.pressure": pressure}
        own, twice = (
            afo_sim.run("seated", sets | {"timestep": f"{many * step} ms"}).metrics for many in (1, 2)
        )
        errors = step_errors(own, twice)
        beyond = [name for name, each in errors.items() if each.times > 1.0]
        assert set(told["beyond"].get(str(case), [])) == set(beyond)
        times[case] = errors["peak_flow"]
    case, worst = max(times.items(), key=lambda item: item[1].times)
    assert told["worst"]["peak_flow"]["case"] == case
    assert told["worst"]["peak_flow"]["error"] == pytest.approx(worst.error)


def test_a_sample_that_was_not_taken_is_taken_by_the_next_call(tmp_path: pathlib.Path, call: Call) -> None:
    assert remark(tmp_path) == ""
    (tmp_path / "sweep.toml").write_text(SWEEP.format(step=4.0))
    words = ("sweep", tmp_path / "sweep.toml", "--out", tmp_path / "out", "--threads", "1")
    assert call(*words)[0] == 0
    told = (tmp_path / "out" / STEPS).read_bytes()
    (tmp_path / "out" / STEPS).unlink()  # as where it is stopped once it has its results
    assert call(*words)[0] == 0 and (tmp_path / "out" / STEPS).read_bytes() == told
