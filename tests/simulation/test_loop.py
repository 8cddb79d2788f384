"""A controller in a run: its commands act; what it does wrong is a sentence, what came before is kept."""

import math
import pathlib
import re
import threading
import time
import traceback
from typing import Any

import command
import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError, SimulationError
from afo_sim.description import toml_text
from afo_sim.simulation import Loop, run_built

SHORT = {"duration": "0.5 s"}
LATE = 0.2  # from when on a controller fails [s]


def late(command: Any) -> Any:
    """A controller that gives a command from LATE on, and none before."""
    return lambda seen: command if seen.time >= LATE - 1e-9 else {}


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (None, "a mapping of chambers"),
        ("inlet", "a mapping of chambers"),
        ({"dorsiflexr": "inlet"}, "did you mean 'dorsiflexor'?"),
        ({"dorsiflexor": "inlt"}, "'inlt'"),
        ({"dorsiflexor": (math.nan, 0.0)}, "is outside a coil's range"),
        ({"dorsiflexor": (0.0, 1.5)}, "is outside a coil's range"),
        ({"dorsiflexor": (1.0,)}, "is not a valid command"),
        ({"dorsiflexor": np.ones((1, 2))}, "is not a valid command"),
        ({"dorsiflexor": True}, "is not a valid command"),
        ({"dorsiflexor": 2e5}, "[drive.dorsiflexor]"),
    ],
)
def test_a_wrong_command_is_refused_and_the_error_has_what_came_before(command: Any, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        afo_sim.run("seated", SHORT, controller=late(command))
    run = recorded(caught.value)
    assert run.status.startswith("failed: t = 0.2 s: ") and words in run.status
    timed = afo_sim.run("seated", SHORT)
    for name in ("time", "ankle/angle", "chamber/dorsiflexor/pressure"):
        assert np.array_equal(run[name], timed[name][:100]), name


class Own(Exception):
    """A user's."""


def failing(kind: type[BaseException] = Own) -> Any:
    """A controller that raises from LATE on, two functions deep, from an exception of its own."""

    def inner() -> None:
        try:
            {}["key"]  # type: ignore[index]
        except KeyError as error:
            raise kind("oh") from error

    def controller(seen: Any) -> dict[str, str]:
        if seen.time >= LATE - 1e-9:
            inner()
        return {}

    return controller


def recorded(error: BaseException) -> afo_sim.Recording:
    """The recording that an error brings, which is also told in a note."""
    assert any("`recording`" in note for note in error.__notes__)
    found = vars(error)["recording"]
    assert isinstance(found, afo_sim.Recording)
    return found


@pytest.mark.parametrize("kind", [Own, KeyError, InputError, SystemExit, GeneratorExit])
def test_what_a_controller_raises_is_raised_with_its_own_traceback(kind: type[BaseException]) -> None:
    with pytest.raises(kind) as caught:
        afo_sim.run("seated", SHORT, controller=failing(kind))
    assert type(caught.value) is kind and "oh" in str(caught.value)
    frames = traceback.extract_tb(caught.value.__traceback__)
    assert [frame.name for frame in frames][-2:] == ["controller", "inner"]
    cause = caught.value.__cause__
    assert isinstance(cause, KeyError) and caught.value.__context__ is cause  # as raised: nothing of ours
    run = recorded(caught.value)
    assert (
        run.status.endswith(f" ({__file__}:{frames[-1].lineno})")
        and kind.__name__ in run.status + "InputError"
    )
    assert np.array_equal(run["ankle/angle"], afo_sim.run("seated", SHORT)["ankle/angle"][:100])


def test_a_mistyped_column_is_raised_where_it_is_read() -> None:
    with pytest.raises(InputError) as caught:
        afo_sim.run("seated", SHORT, controller=lambda seen: {"dorsiflexor": seen["ankle/angel"] and "shut"})
    assert caught.value.nearest == "ankle/angle"
    at = traceback.extract_tb(caught.value.__traceback__)
    (line,) = {frame.lineno for frame in at if frame.name == "<lambda>" and frame.filename == __file__}
    assert recorded(caught.value).status.endswith(f" ({__file__}:{line})")


def test_a_controller_may_fail_at_a_step_that_nobody_asked_for() -> None:
    def careful(seen: Any) -> dict[str, str]:
        if len(time := seen.rows("time")) > 1 and time[1] - time[0] > 0.0011:
            raise Own
        return {}

    short = {"duration": "0.5 s", "timestep": "1 ms"}
    assert afo_sim.run("seated", short, controller=careful, step="controlled").ok
    with pytest.raises(Own):
        afo_sim.run("seated", short | {"timestep": "2 ms"}, controller=careful, step="controlled")


def test_a_stepped_controller_raises_what_it_raises() -> None:
    with afo_sim.Simulator("seated", SHORT, controller=failing()) as simulator:
        with pytest.raises(Own) as caught:
            simulator.step(dt=0.5)
        assert traceback.extract_tb(caught.value.__traceback__)[-1].name == "inner"
        assert len(simulator.recording()["time"]) == 100 and simulator.done
        with pytest.raises(SimulationError, match=r"oh .*; reset\(\) begins again"):
            simulator.step()
        simulator.reset()
        simulator.step(dt=0.1)
    with afo_sim.Simulator("seated", SHORT, controller=late({"dorsiflexor": "inlt"})) as simulator:
        with pytest.raises(InputError) as refused:
            simulator.step(dt=0.5)
        assert refused.value.nearest == "inlet"


def test_a_command_ends_in_a_status_with_the_place_in_the_users_file(
    call: command.Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("afo_sim.simulation.run.make", lambda described, scenario: failing())
    machine = {"start": "a", "transition": [], "state": {"a": {"dorsiflexor": "inlet"}}}
    sets = {"timer": None, "controller": {"rate": "100 Hz", "state_machine": machine}}
    scenario = tmp_path / "own.toml"
    scenario.write_text(toml_text(afo_sim.load("scenario", "seated", SHORT | sets).resolved()))
    code, _, said = call("run", scenario, "--out", tmp_path / "out", "--step", "fixed")
    assert code == 3 and len(said.strip().splitlines()) == 1
    assert re.search(rf"t = 0\.2 s: the controller raised Own: oh \({re.escape(__file__)}:\d+\)", said)
    run = afo_sim.read_recording(tmp_path / "out")
    assert len(run["time"]) == 100 and not run.ok
    assert afo_sim.run(scenario).status == run.status  # a described one


def endless(seen: Any) -> Any:
    while True:
        try:
            while True:
                pass
        except Exception:
            pass


class Endless:
    """A controller of which one part has no end."""

    def __init__(self, part: str):
        self.part = part

    def __call__(self, seen: Any) -> dict[str, str]:
        return endless(0) if self.part == "call" else {}

    def tell(self) -> dict[str, float]:
        return endless(0) if self.part == "tell" else {}

    def reset(self) -> None:
        if self.part == "reset":
            endless(0)


@pytest.mark.parametrize(("part", "words"), [("call", "for a command"), ("tell", "to report its columns")])
def test_an_endless_controller_is_interrupted(part: str, words: str) -> None:
    start = time.monotonic()
    run = afo_sim.run("seated", SHORT, controller=Endless(part), time_limit=0.2)
    assert run.status == (
        f"failed: t = 0 s: the controller took more than 0.2 s {words}; allowed: up to time_limit"
    )
    assert time.monotonic() - start < 10.0


def test_an_endless_reset_is_refused() -> None:
    with pytest.raises(InputError, match=r"cannot be reset: .*0\.2 s to reset"):
        afo_sim.run("seated", SHORT, controller=Endless("reset"), time_limit=0.2)


def test_an_endless_controller_is_interrupted_off_the_main_thread() -> None:
    found = []

    def work() -> None:
        found.append(afo_sim.run("seated", SHORT, controller=endless, time_limit=0.2).status)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(20.0)
    assert len(found) == 1
    assert "took more than 0.2 s" in found[0]


def interrupted(seen: Any) -> dict[str, str]:
    if seen.time >= LATE - 1e-9:
        raise KeyboardInterrupt
    return {}


def test_an_interrupt_of_the_keyboard_keeps_what_came_before() -> None:
    run = afo_sim.run("seated", SHORT, controller=interrupted)
    assert run.status == "failed: t = 0.2 s: stopped by Ctrl-C"
    timed = afo_sim.run("seated", SHORT)
    assert np.array_equal(run["ankle/angle"], timed["ankle/angle"][:100])
    with afo_sim.Simulator("seated", SHORT, controller=interrupted) as simulator:
        with pytest.raises(KeyboardInterrupt):  # whoever steps has the rows, and may go on
            simulator.step(dt=0.5)
        assert len(simulator.recording()["time"]) == 100


def test_an_interrupt_passes_where_nobody_keeps_the_run() -> None:
    built = afo_sim.build("seated", SHORT)
    with pytest.raises(KeyboardInterrupt):
        run_built(built, policy=Loop(built, interrupted, 100.0).policy())


@pytest.mark.parametrize(
    ("field", "arguments"),
    [("controller.rate", {"rate": rate}) for rate in (0.0, -1.0, math.nan, math.inf, "100 m", 333.3)]
    + [("time_limit", {"time_limit": limit}) for limit in (0.0, -1.0, math.nan, "1 m")]
    + [("controller", {"controller": 5})],
)
def test_wrong_arguments_are_refused_before_the_first_step(field: str, arguments: Any) -> None:
    with pytest.raises(InputError) as caught:
        afo_sim.run("seated", SHORT, **({"controller": lambda seen: {}} | arguments))
    assert caught.value.field == field
    assert caught.value.allowed


@pytest.mark.parametrize("told", [{"phase": "x"}, {"phas": 1.0}, None])
def test_what_is_told_wrongly_is_refused(told: Any) -> None:
    controller = Endless("")
    controller.tell = lambda: told  # type: ignore[method-assign]
    with pytest.raises(InputError) as caught:
        afo_sim.run("seated", SHORT, controller=controller)
    assert caught.value.field.startswith("tell") and len(recorded(caught.value)["time"]) == 0


def test_a_controller_sees_rows_that_are_one_step_old() -> None:
    seen_rows: list[np.ndarray] = []
    times: list[float] = []

    def controller(seen: Any) -> dict[str, str]:
        times.append(seen.time)
        seen_rows.append(np.array(seen.rows("ankle/angle")))
        return {"dorsiflexor": "inlet"}

    run = afo_sim.run("seated", SHORT, controller=controller, rate=100.0)
    assert times == pytest.approx(np.arange(50) * 0.01)
    # the row of the start, and then the five rows of each period
    assert [len(rows) for rows in seen_rows] == [1] + [5] * 49
    assert np.array_equal(np.concatenate(seen_rows[1:]), run["ankle/angle"][:245])


@pytest.mark.parametrize("output", ["valves", "pressures"])
def test_a_described_controller_does_not_go_on_with_a_reading_that_is_no_number(output: str) -> None:
    """1/p of no pressure has no value: the chamber must not stay empty in a run that is "ok"."""
    pid: dict[str, Any] = {
        "integral_time": "0.5 s",
        "pressure": {"column": "sensor/air", "proportional_band": "0.5 bar", "reference": {"mean": "2 bar"}},
    }
    if output == "pressures":
        pid["pressures"] = {"mean": "2 bar", "half_range": "1 bar"}
    calibration = {"shape": "inverse", "slope": "1 V*Pa", "intercept": "0 V"}
    sets = {
        "timer": None,
        "controller.pid": pid,
        "sensor.air": {"column": "chamber/dorsiflexor/pressure", "calibration": calibration},
        "drive.dorsiflexor.kind": "pwm",
    }
    run = afo_sim.run("seated", SHORT | sets)
    assert "the controller reads sensor/air, which is not a number" in run.status


SINE = {"amplitude": "3 deg", "frequency": "0.5 Hz"}
PID = {"pid": {"lowers": "plantarflexor", "angle": {"proportional_band": "2 deg", "reference": SINE}}}
HELD = {"pid": {"angle": {"proportional_band": "2 deg", "reference": {"mean": "2 deg"}}}}
WHOLE = "numbers per cycle are for the whole run"


def controlled(controller: dict[str, Any]) -> afo_sim.Recording:
    return afo_sim.run("seated", {"timer": None, "controller": controller, "duration": "6 s"})


def test_a_sine_has_its_period() -> None:
    """Three periods of 2 s: a third of the air that the inlets let in."""
    found = controlled(PID)
    flows = [found[f"valve/{c}_inlet/mass_flow"] for c in ("dorsiflexor", "plantarflexor")]
    air = 2e-3 * sum(flow[flow > 0.0].sum() for flow in flows) / 3.0
    assert float(found.metrics["air_per_cycle"]) * 1e-3 == pytest.approx(air, rel=1e-9)
    assert not any(WHOLE in warning for warning in found.warnings)


def test_what_does_not_repeat_says_that_the_run_is_the_cycle() -> None:
    assert any(WHOLE in warning for warning in controlled(HELD).warnings)
