"""A simulation that is forked goes on with the same bits, in any process; what cannot is a sentence."""

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign import size
from simulation.test_source_life import TANK

import afo_sim as afo
from afo_sim.common import InputError, SimulationError

WALK = {"gait.settled": "walked", "reference": None, "start": {"dorsiflexor": {"pressure": "2 bar"}}}
NOISY = {
    "sensor.shank": {"column": "shank/angle", "noise": "0.2 deg", "delay": "8 ms", "lowpass": "20 Hz"},
    "sensor.heel": {"column": "foot/heel_load", "noise": "5 N", "rate": "250 Hz", "hysteresis": "10 N"},
}
MACHINE = {
    "start": "swing",
    "transition": [
        {"state": "swing", "to": "stance", "column": "sensor/heel", "above": "50 N"},
        {
            "state": "stance",
            "to": "swing",
            "column": "ankle/velocity",
            "below": "-60 deg/s",
            "after": "0.2 s",
        },
    ],
    "state": {"swing": {"dorsiflexor": "inlet"}, "stance": {"dorsiflexor": "outlet"}},
}
PHASE = {"column": "sensor/shank", "switch": "sensor/heel", "dorsiflexor": {"inlet": [[0.5, 0.9]]}}
ANGLE = {"proportional_band": "3 deg", "reference": {"amplitude": "5 deg", "frequency": "1 Hz"}}
PID = {"integral_time": "0.3 s", "derivative_time": "20 ms", "lowers": "plantarflexor", "angle": ANGLE}
PRESSED = PID | {"pressures": {"mean": "2 bar", "half_range": "1 bar"}}
DRIVES = {f"drive.{name}.kind": "bang_bang" for name in ("dorsiflexor", "plantarflexor")}
VALVES = {"inlet": [["0.05 s", "0.2 s"]], "outlet": [["0.25 s", "0.39 s"]]}
TIMER = {"timer": {"period": "0.4 s", "dorsiflexor": VALVES, "plantarflexor": VALVES}}


def controlled(kind: dict[str, Any]) -> dict[str, Any]:
    return {"timer": None, "phases": None, "controller": kind | {"rate": "250 Hz"}}


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "timer": ("seated", TIMER),
    "pid": ("seated", controlled({"pid": PID})),
    "tracking by drives": ("seated", DRIVES | controlled({"pid": PRESSED})),
    "bottle": ("seated", TANK | {"supply.source": "bottle_0_5l_10bar"}),
    "walk": ("walk-dropfoot-afo", WALK),
    "contact": ("walk-dropfoot-afo", WALK | {"ground.mode": "contact"}),
    "state machine": ("walk-dropfoot-afo", WALK | NOISY | controlled({"state_machine": MACHINE})),
    "gait phase": ("walk-dropfoot-afo", WALK | NOISY | controlled({"gait_phase": PHASE})),
}
DT, END = 0.02, 1.2  # [s]


def made(case: str) -> afo.Simulator:
    name, sets = CASES[case]
    own = "scenario" if "controller" in sets else None
    return afo.Simulator(name, sets | {"duration": f"{END} s"}, controller=own)


def onward(simulator: afo.Simulator, until: float = END) -> Any:
    """Step to a time, with commands by what is seen, so that a difference of one bit would grow."""
    while simulator.time < until - 1e-9:
        command = None
        if simulator.controller is None and round(simulator.time / DT) % 5 == 0:
            lift = simulator.observe()["ankle/angle"] + 0.1 * np.sin(40.0 * simulator.time) > 0.0
            command = {"dorsiflexor": "inlet" if lift else (0.0, 0.7), "plantarflexor": "timed"}
        simulator.step(command, DT)
    return simulator.recording()


def assert_same(one: Any, other: Any) -> None:
    assert one.columns.keys() == other.columns.keys() and len(one["time"]) == len(other["time"])
    for name in one.columns:
        assert np.array_equal(one[name], other[name], equal_nan=True), name


def read_next(simulator: afo.Simulator) -> list[np.ndarray]:
    """What the sensors read in the next steps, before filters have forgotten what was before."""
    seen = simulator.step(dt=DT)
    return [seen.rows(f"sensor/{name}") for name in simulator.scenario.sensor]


FORKS = (lambda s: s, copy.copy, lambda s: pickle.loads(pickle.dumps(s)))


@pytest.mark.parametrize("case", CASES)
def test_a_state_and_its_replay_agree_in_every_bit(case: str) -> None:
    """From 104 random moments at night, three a scenario by day; in turn restored, copied and pickled."""
    uncommanded = [step for step in range(58) if step % 5]
    moments = sorted(np.random.default_rng(len(case)).choice(uncommanded, size(3, 13), replace=False))
    with made(case) as simulator:
        states, read = [], []
        for moment in moments:
            onward(simulator, moment * DT)
            states.append(simulator.state())
            read.append(read_next(simulator))
        whole = onward(simulator)
        if simulator.controller is not None:
            assert_same(whole, afo.run(CASES[case][0], CASES[case][1] | {"duration": f"{END} s"}))
        for k, (moment, state) in enumerate(zip(moments, states, strict=True)):
            simulator.restore(pickle.loads(pickle.dumps(state)))
            fork = FORKS[k % 3](simulator)
            if fork is not simulator:
                simulator.restore(states[0])  # what this one does is not the other's
                simulator.step(dt=10 * DT)
            assert fork.time == pytest.approx(moment * DT, abs=1e-12)
            assert fork.observe()["ankle/angle"] == whole["ankle/angle"][whole["time"] < fork.time - 1e-9][-1]
            np.testing.assert_array_equal(read_next(fork), read[k])
            assert_same(onward(fork), whole)
            if fork is not simulator:
                fork.close()


@pytest.mark.slow
def test_another_process_replays_a_simulator_to_the_bit(tmp_path: Path) -> None:
    with made("state machine") as simulator:
        onward(simulator, 0.4)
        (tmp_path / "simulator").write_bytes(pickle.dumps(simulator))
        simulator.step(dt=0.4)
        found = simulator.recording()["sensor/shank"]
    code = "import pickle, sys; s = pickle.load(open(sys.argv[1], 'rb')); s.step(dt=0.4); "
    code += "sys.stdout.buffer.write(s.recording()['sensor/shank'].tobytes())"
    ended = subprocess.run([sys.executable, "-c", code, tmp_path / "simulator"], capture_output=True)
    assert ended.stdout == found.tobytes(), ended.stderr.decode()


class Counting:
    """A controller whose commands depend on how often it was asked."""

    def __init__(self, count: int = 0, more: Any = None) -> None:
        self.count, self.more = count, more

    def reset(self) -> None:
        self.count = 0

    def __call__(self, seen: Any) -> dict[str, str]:
        self.count += 1
        return {"dorsiflexor": "inlet" if self.count % 7 < 4 else "outlet"}


def test_a_controller_in_python_is_copied_with_its_memory() -> None:
    own = Counting()
    with afo.Simulator("seated", {"duration": "1.2 s"}, controller=own) as simulator:
        onward(simulator, 0.1)
        with copy.deepcopy(simulator) as other, pickle.loads(pickle.dumps(simulator)) as third:
            assert own.count == 10  # making others has not reset it
            whole = onward(simulator)
            assert_same(onward(other), whole)
            assert_same(onward(third), whole)
            assert other.controller is not own and other.controller.count == own.count == 120
            with pytest.raises(InputError, match="beside a controller"):
                other.step({"dorsiflexor": "inlet"})
    assert_same(whole, afo.run("seated", {"duration": "1.2 s"}, controller=Counting()))


def remembering(count: int) -> Any:
    return lambda seen: {} if count else {"dorsiflexor": "inlet"}


@pytest.mark.parametrize("controller", [remembering(1), Counting(more=(k for k in range(3)))])
def test_a_controller_that_cannot_be_copied_is_a_sentence(controller: Any) -> None:
    with afo.Simulator("seated", controller=controller) as simulator:
        for fork in (simulator.state, simulator.copy, lambda: pickle.dumps(simulator)):
            with pytest.raises(InputError, match="cannot be copied"):
                fork()


def test_what_is_no_state_of_it_is_refused_and_changes_nothing() -> None:
    with made("timer") as simulator, made("pid") as other, afo.Simulators("seated", count=2) as many:
        simulator.step(dt=0.1)
        for wrong in (other.state(), afo.Simulator("seated").state(), b"state"):
            with pytest.raises(InputError, match="not a state of this"):
                simulator.restore(wrong)
        assert simulator.time == pytest.approx(0.1)
        with pytest.raises(TypeError, match="Simulators is neither copied nor pickled"):
            copy.copy(many)


@pytest.mark.parametrize("other", [(Counting(), 10.0), (remembering, 100.0)])
def test_a_state_of_another_rate_or_kind_of_controller_is_refused(other: tuple[Any, float]) -> None:
    with afo.Simulator("seated", None, Counting()) as one, afo.Simulator("seated", None, *other) as wrong:
        one.restore(one.copy().state())
        with pytest.raises(InputError, match="not a state of this"):
            one.restore(wrong.state())


def test_a_failed_simulation_is_taken_back() -> None:
    with made("timer") as simulator:
        good, whole = simulator.state(), onward(simulator, 0.6)
        stepper = simulator._stepped.stepper
        now = stepper.begun([0])  # time, qpos, qvel, act
        now[:, -simulator._stepped.builts[0].model.na :] = -1.0
        stepper.begin([0], now)
        with pytest.raises(SimulationError):
            simulator.step()
        assert pickle.loads(pickle.dumps(simulator)).done
        simulator.restore(good)
        assert_same(onward(simulator, 0.6), whole)
