"""Simulators give the bits of a run; what cannot be done with one is a sentence."""

import gc
import threading
from typing import Any

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim.common import CallbackError, InputError
from afo_sim.description import load
from afo_sim.model.build import build
from afo_sim.simulation import METRIC_FIELDS, Stepped

SHORT = {"duration": "0.4 s"}
COLUMNS = ("time", "ankle/angle", "ankle/velocity", "chamber/dorsiflexor/pressure")


def command(seen: Any) -> dict[str, Any]:
    """Both valves by angle and time, so that a difference of one bit would grow."""
    return {"dorsiflexor": "inlet" if np.sin(25.0 * seen.time) + seen["ankle/angle"] > 0.0 else (0.0, 1.0)}


def stepped(scenario: str, sets: dict[str, Any], dt: float = 0.01) -> Any:
    with afo_sim.Simulator(scenario, sets) as simulator:
        seen = simulator.observe()
        while not simulator.done:
            seen = simulator.step(command(seen), dt)
        return simulator.recording()


@pytest.mark.parametrize(
    ("scenario", "sets"),
    [
        ("seated", SHORT),
        ("seated", {"duration": "0.04 s", "callback": "python"}),
        ("seated", {**SHORT, "record_rate": "100 Hz"}),
        ("seated", {**SHORT, "drive.plantarflexor.kind": "bang_bang"}),
        ("walk-dropfoot-afo", {**SHORT, "gait.settled": "walked"}),
        ("walk-dropfoot-afo", {**SHORT, "gait.settled": "walked", "ground.mode": "contact"}),
    ],
)
def test_stepping_gives_the_bits_of_a_run(scenario: str, sets: dict[str, Any]) -> None:
    run = afo_sim.run(scenario, sets, controller=command, rate=100.0)
    own = stepped(scenario, sets)
    assert run.ok, run.status
    assert own.columns.keys() == run.columns.keys()
    for name, values in run.columns.items():
        assert np.array_equal(values, own[name], equal_nan=True), name


def test_simulators_side_by_side_are_each_what_one_is() -> None:
    with (
        afo_sim.Simulators("seated", SHORT, count=3, threads=2) as many,
        afo_sim.Simulator("seated", SHORT) as one,
    ):
        seen, alone = many.observe(), one.observe()
        for k in range(40):
            commands = [
                command(seen[0]),
                {"dorsiflexor": "both"},
                {"dorsiflexor": "inlet"} if k == 5 else None,
            ]
            seen, alone = many.step(commands, 0.01), one.step(command(alone), 0.01)
            for name in COLUMNS:
                assert np.array_equal(seen[0].rows(name), alone.rows(name)), (k, name)
        pressure = "chamber/dorsiflexor/pressure"
        assert seen[1][pressure] != seen[0][pressure]
        assert many.done.all()


def test_a_run_beside_open_simulators_changes_nothing() -> None:
    alone = afo_sim.run("seated", SHORT)
    with afo_sim.Simulator("seated", SHORT) as first, afo_sim.Simulator("seated", SHORT) as second:
        first.step(dt=0.1)
        between = afo_sim.run("seated", SHORT)
        second.step({"dorsiflexor": "both"}, 0.1)
        first.step(dt=0.3)
        own = first.recording()
    assert np.array_equal(between["ankle/angle"], alone["ankle/angle"])
    assert np.array_equal(own["ankle/angle"], alone["ankle/angle"])


def test_reset_begins_again_with_the_same_bits() -> None:
    with afo_sim.Simulator("seated", SHORT) as simulator:
        simulator.step({"dorsiflexor": "both"}, 0.1)
        first = simulator.recording()
        simulator.reset()
        with pytest.raises(InputError, match="no step yet"):
            simulator.recording()
        simulator.step({"dorsiflexor": "both"}, 0.1)
        second, again = simulator.recording(), simulator.recording()
    for name in COLUMNS:
        assert np.array_equal(first[name], second[name]), name
        assert np.array_equal(second[name], again[name]), name


@pytest.mark.parametrize("dt", [0.0, -0.002, 0.003, float("nan"), float("inf"), "0.01 m", True])
def test_a_wrong_dt_or_command_is_refused_and_nothing_steps(dt: Any) -> None:
    with afo_sim.Simulator("seated", SHORT) as simulator:
        with pytest.raises(InputError) as caught:
            simulator.step({"dorsiflexor": "both"}, dt)
        assert caught.value.field == "dt"
        with pytest.raises(InputError, match="did you mean 'dorsiflexor'"):
            simulator.step({"dorsiflexr": "inlet"}, 0.01)
        assert simulator.time == 0.0
        untouched = simulator.step(dt=0.1)["ankle/angle"]  # nor was the command taken
    assert untouched == afo_sim.run("seated", {"duration": "0.1 s"})["ankle/angle"][-1]


def test_seated_goes_on_after_its_duration_and_walking_says_where_it_ends() -> None:
    with afo_sim.Simulator("seated", {"duration": "0.1 s"}) as simulator:
        simulator.step(dt=0.1)
        assert simulator.done
        simulator.step(dt=0.3)
        longer = simulator.recording()
    assert np.array_equal(longer["ankle/angle"], afo_sim.run("seated", SHORT)["ankle/angle"])
    with afo_sim.Simulator("walk-dropfoot-afo", {"duration": "0.1 s"}) as simulator:
        simulator.step(dt=0.1)
        with pytest.raises(InputError, match="the recorded walking ends at"):
            simulator.step()


def test_a_closed_simulator_refuses_in_words() -> None:
    simulator = afo_sim.Simulator("seated", SHORT)
    simulator.close()
    simulator.close()
    with pytest.raises(CallbackError, match="closed"):
        simulator.step()
    with pytest.raises(CallbackError, match="closed"):
        simulator.reset()


def test_garbage_collection_gives_the_callbacks_back() -> None:
    simulator = afo_sim.Simulator("seated", SHORT)
    simulator.step()
    assert mujoco.get_mjcb_act_bias() is not None
    del simulator
    gc.collect()
    assert mujoco.get_mjcb_act_bias() is None


def test_a_simulator_is_stepped_from_another_thread() -> None:
    with afo_sim.Simulator("seated", SHORT) as simulator:
        thread = threading.Thread(target=simulator.step, kwargs={"dt": 0.4})
        thread.start()
        thread.join()
        own = simulator.recording()
    assert np.array_equal(own["ankle/angle"], afo_sim.run("seated", SHORT)["ankle/angle"])


@pytest.mark.parametrize("seed", [-1, 1.5, "x", True, 2**70])
def test_what_is_no_seed_is_refused_before_anything_is_taken_back(seed: Any) -> None:
    sets = SHORT | {"sensor": {"it": {"column": "ankle/angle", "noise": "0.1 deg"}}}
    with afo_sim.Simulator("seated", sets) as simulator:
        simulator.step(dt=0.1)
        with pytest.raises(InputError, match=r"seed.*is not a valid seed; allowed: a whole number"):
            simulator.reset(seed)
        assert simulator.time == pytest.approx(0.1)
    with afo_sim.Simulators("seated", sets=sets, count=2) as several:
        several.step(dt=0.1)
        with pytest.raises(InputError, match="is not a valid seed"):
            several.reset(seed=seed)


def test_seeds_of_several_go_around() -> None:
    sets = SHORT | {"sensor": {"it": {"column": "ankle/angle", "noise": "0.1 deg"}}}
    with afo_sim.Simulators("seated", sets=sets, count=2) as several:
        last = several.reset(seed=2**32 - 1)[1]["sensor/it"]
        assert last == several.reset(seed=0)[0]["sensor/it"]


def test_what_simulators_cannot_do_is_a_sentence() -> None:
    for wrong in ({"count": 1.5}, {"count": "x"}, {"count": True}, {"threads": -1}, {"threads": "x"}):
        with pytest.raises(InputError, match="is out of range; allowed: a whole number"):
            afo_sim.Simulators("seated", SHORT, **({"count": 2} | wrong))
    with afo_sim.Simulators("seated", SHORT, count=3) as several:
        for numbers in ([1.5], ["x"], [True], 5):
            with pytest.raises(InputError, match="numbers"):
                several.reset(numbers)  # type: ignore[arg-type]
        with pytest.raises(InputError, match="are no commands"):
            several.step(5)  # type: ignore[arg-type]


def test_one_that_fails_stands_still_while_the_others_go_on_and_begins_anew() -> None:
    sets = {"duration": "1 s"}
    with afo_sim.Simulators("seated", sets, count=3) as many, afo_sim.Simulator("seated", sets) as one:
        many.step({"dorsiflexor": "inlet"}, 0.1)
        state = many._stepped.state(1)
        state[3] = np.nan  # of the ankle or its air: no kernel can go on with it
        many._stepped.begin([1], [state], [50])
        before = many.observe()[1]["time"]
        seen = many.step(None, 0.1)
        assert set(many.failures) == {1} and "not a number" in str(many.failures[1])
        assert many.done.tolist() == [False, True, False]
        one.step({"dorsiflexor": "inlet"}, 0.1)
        alone = one.step(None, 0.1)["ankle/angle"]
        assert seen[0]["ankle/angle"] == seen[2]["ankle/angle"] == alone and seen[1]["time"] == before
        many.reset([1])
        one.reset()
        again = many.step([None, {"dorsiflexor": "inlet"}, None], 0.1)[1]["ankle/angle"]
        assert again == one.step({"dorsiflexor": "inlet"}, 0.1)["ankle/angle"] and not many.failures


WALK = {"duration": "2 s", "gait.settled": "walked"}


@pytest.mark.parametrize(("name", "sets"), [("seated", {"duration": "2 s"}), ("walk-dropfoot-afo", WALK)])
def test_a_kept_state_goes_on_with_the_same_bits(name: str, sets: dict[str, str]) -> None:
    built = build(load("scenario", name, sets))
    stepped = Stepped([built], count=3, fields=METRIC_FIELDS)
    inputs = stepped.inputs(0, 400)
    stepped.advance([0], inputs[None, :250])
    kept = stepped.state(0)
    whole = {name: v[0].copy() for name, v in stepped.advance([0], inputs[None, 250:]).items()}
    stepped.begin([1, 2], [kept, kept], [250, 250])
    assert stepped.taken.tolist() == [400, 250, 250]
    again = stepped.advance([1, 2], np.stack([inputs[250:]] * 2))
    stepped.close()
    for field, values in whole.items():
        assert (again[field] == values).all(), field
