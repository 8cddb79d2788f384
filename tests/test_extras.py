"""The wall between the core and what a user may leave out: each part runs with the others blocked."""

import importlib.util

import pytest
from blocked import ROOMS, packages_of, without

from afo_sim.common import EXTRAS

CORE = """
import afo_sim as afo
run = afo.run("seated", {"duration": "1 s"})
assert run.status == "ok", run.status
assert "peak_dorsiflexion_angle" in run.metrics
walk = afo.run("walk-dropfoot-afo", {"duration": "2.6 s"})
assert walk.verdict, walk.warnings
walk.save("walked", rrd=False)
again = afo.read_recording("walked")
assert (again["ankle/angle"] == walk["ankle/angle"]).all() and again.metrics == walk.metrics
with afo.Simulator("seated") as simulator:
    simulator.step()
afo.build("seated"), afo.load("muscle", "dmsp_20").force("3 bar", contraction=0.05)
print("ok")
"""
COMMANDS = """
import contextlib, io, pathlib, sys
from afo_sim import cli
def call(*words):
    sys.argv = ["afo-sim", *words]
    said, wrong = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(wrong):
        try:
            cli.main()
        except SystemExit as end:
            return end.code or 0, said.getvalue(), wrong.getvalue()
    return 0, said.getvalue(), wrong.getvalue()
code, said, wrong = call("run", "seated", "--set", "duration=1 s", "--out", "run")
assert code == 0, wrong
assert pathlib.Path("run/recording.parquet").is_file() and not pathlib.Path("run/recording.rrd").exists()
assert not wrong and "afo-sim view" not in said, wrong + said
assert call("list", "muscles")[0] == 0
code, said, wrong = call("view", "run")
assert code == 2 and "pip install 'afo-sim[rerun]'" in wrong and "Traceback" not in wrong, wrong
code, said, wrong = call("report", "run")
assert code == 2 and "pip install 'afo-sim[show]'" in wrong and "Traceback" not in wrong, wrong
print("ok")
"""
# What each extra does alone, with every other extra's rooms and libraries blocked.
ALONE = {
    "gait_lab": """
        from afo_sim import gait_lab
        import afo_sim.gait_lab.trial.importing
        print("ok")
    """,
    "legs": """
        import afo_sim as afo
        afo.export_leg("adult_75kg", "leg.urdf")
        print("ok")
    """,
    "export": """
        import afo_sim as afo
        print("ok" if afo.run("seated", {"duration": "0.1 s"}).export("out.csv") else "nothing")
    """,
    "study": """
        import afo_sim as afo
        done = afo.sweep("seated", {"supply.pressure": ["2 bar", "3 bar"]}, sets={"duration": "0.2 s"})
        print("ok" if len(done) == 2 else done)
    """,
    "lab": """
        import afo_sim as afo
        print("ok" if afo.stand("isobaric", "dmsp_20") else "nothing")
    """,
    "rl": """
        import gymnasium
        import afo_sim.rl.environments
        made = gymnasium.make("afo_sim/SeatedTracking-v0")
        made.reset(seed=1)
        made.step(made.action_space.sample())
        print("ok")
    """,
    "show": """
        import afo_sim as afo
        run = afo.run("seated", {"duration": "0.2 s"})
        afo.figure(run, "run.png"), run.save("run")
        print("ok")
    """,
}
NEEDS = {"rl": {"legs"}, "export": {"legs"}, "show": {"study", "lab"}}


@pytest.mark.slow
def test_the_core_runs_without_any_extra() -> None:
    assert without(ROOMS, packages_of(EXTRAS), CORE).endswith("ok\n")


@pytest.mark.slow
def test_the_commands_run_on_the_core_and_say_what_they_miss() -> None:
    assert without((), packages_of(EXTRAS), COMMANDS).endswith("ok\n")


@pytest.mark.slow
@pytest.mark.parametrize("room", ALONE)
def test_each_extra_stands_on_the_core_alone(room: str) -> None:
    if room == "rl" and importlib.util.find_spec("gymnasium") is None:
        pytest.skip("gymnasium is not installed")
    kept = {room} | NEEDS.get(room, set())
    extras = [extra for extra in EXTRAS if extra != room]
    others = [other for other in ROOMS if other not in kept]
    assert without(others, packages_of(extras), ALONE[room]).endswith("ok\n")
