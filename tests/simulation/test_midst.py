"""Code that a step calls changes nothing: who catches the refusal goes on as if nothing had been asked."""

from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import pytest
from simulation.test_forking import assert_same

import afo_sim as afo
from afo_sim.common import CallbackError, InputError, SimulationError

SETS = {"duration": "0.2 s", "sensor.foot": {"column": "ankle/angle", "noise": "0.2 deg", "delay": "8 ms"}}
PYTHON = SETS | {"callback": "python"}
Asks = Callable[[Any], Any]
CHANGES: dict[str, Asks] = {
    "restore": lambda one: one.restore(BEFORE[-1]),
    "reset": lambda one: one.reset(),
    "step": lambda one: one.step(),
    "close": lambda one: one.close(),
}
LOOKS: dict[str, Asks] = {"state": lambda one: one.state(), "copy": lambda one: one.copy()}
BEFORE: list[Any] = []  # a state of what is stepped; a global, as a controller's closure is not copied
STEPPED: list[Any] = []


class Asking:
    """Asks something of what is stepped, once; a command follows from the time alone."""

    def __init__(self, place: str, ask: Asks, caught: bool = True) -> None:
        self.place, self.ask, self.caught, self.found = place, ask, caught, []

    def __deepcopy__(self, memo: Any) -> "Asking":
        other = Asking("", self.ask)  # who is copied asks no more
        other.found = self.found
        return other

    def at(self, place: str, *_: Any) -> None:
        if place != self.place or self.found or not STEPPED:
            return
        self.found.append(None)
        try:
            self.found[0] = self.ask(STEPPED[-1])
        except InputError as error:
            self.found[0] = error
            if not self.caught:
                raise

    def reset(self) -> None:
        self.at("reset")

    def tell(self) -> dict[str, float]:
        self.at("tell")
        return {}

    def __call__(self, seen: Any) -> dict[str, str]:
        if seen.time > 0.075:
            self.at("call")
        return {"dorsiflexor": "inlet" if round(100.0 * seen.time) % 7 < 4 else "outlet"}


@pytest.fixture(autouse=True)
def _clean() -> Iterator[None]:
    yield
    mujoco.set_mjcb_passive(None)
    BEFORE.clear()
    STEPPED.clear()


def begun(sets: dict[str, Any], controller: Any = None, until: float = 0.04) -> afo.Simulator:
    STEPPED[:] = []
    simulator = afo.Simulator("seated", sets, controller=controller)
    BEFORE[:] = [simulator.state()]
    simulator.step(dt=until)
    STEPPED[:] = [simulator]
    return simulator


def ended(simulator: afo.Simulator) -> Any:
    simulator.step(dt=0.2 - simulator.time)
    return simulator.recording()


@pytest.fixture(scope="module")
def whole() -> Any:
    return afo.run("seated", SETS, controller=Asking("", len))


@pytest.mark.parametrize("caught", [True, False])
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("place", ["call", "tell"])
def test_a_controller_changes_nothing(place: str, change: str, caught: bool, whole: Any) -> None:
    asking = Asking(place, CHANGES[change], caught)
    with begun(SETS, asking) as simulator:
        if caught:
            assert_same(ended(simulator), whole)
        else:
            with pytest.raises(InputError) as raised:
                ended(simulator)
            assert [raised.value] == asking.found
            kept = simulator.recording()
            assert simulator.done and kept.status.startswith("failed")
            assert np.array_equal(kept["ankle/angle"], whole["ankle/angle"][: len(kept["time"])])
            simulator.reset()
            assert_same(ended(simulator), whole)
        (error,) = asking.found
        assert isinstance(error, InputError) and error.field == "controller" and "copy()" in error.allowed


@pytest.mark.parametrize("sets", [SETS, PYTHON])
@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("place", ["call", "tell"])
def test_a_controller_sees_the_last_finished_step(place: str, look: str, sets: Any, whole: Any) -> None:
    asking = Asking(place, LOOKS[look])
    with begun(sets, asking) as simulator:
        recorded = ended(simulator)
        (found,) = asking.found
        if look == "state":
            simulator.restore(found)
            found = simulator
        assert found.time == pytest.approx(0.08 if place == "call" else 0.04, abs=1e-12)
        assert_same(ended(found), recorded)
        if sets is SETS:
            assert_same(recorded, whole)
        found.close()


def foreseen(simulator: afo.Simulator) -> float:
    with simulator.copy() as trial:
        return trial.step(dt=0.05)["ankle/angle"]


def test_a_controller_tries_a_copy_out(whole: Any) -> None:
    asking = Asking("call", foreseen)
    with begun(SETS, asking) as simulator:
        assert_same(ended(simulator), whole)
    assert asking.found == [whole["ankle/angle"][64]]  # of the last step before 0.13 s


@pytest.mark.parametrize("change", CHANGES)
def test_a_reset_has_the_last_word(change: str, whole: Any) -> None:
    asking = Asking("", CHANGES[change])
    with begun(SETS, asking) as simulator:
        asking.place = "reset"
        if change == "close":
            with pytest.raises(CallbackError, match="is closed"):
                simulator.reset()
        else:
            simulator.reset()
            assert_same(ended(simulator), whole)


@pytest.mark.parametrize("caught", [True, False])
@pytest.mark.parametrize("ask", [*CHANGES, *LOOKS])
def test_a_mujoco_callback_changes_nothing(ask: str, caught: bool) -> None:
    asking = Asking("passive", (CHANGES | LOOKS)[ask], caught)
    with begun(PYTHON) as simulator:
        start = simulator.state()
        undisturbed = ended(simulator)
        simulator.restore(start)
        mujoco.set_mjcb_passive(lambda model, data: asking.at("passive"))
        if caught:
            assert_same(ended(simulator), undisturbed)
        else:
            with pytest.raises(InputError, match="mix two states"):
                ended(simulator)
            with pytest.raises(SimulationError, match="InputError broke a step off"):
                simulator.step()
            assert simulator.done and simulator.recording().status.startswith("failed")
            simulator.restore(start)
            assert_same(ended(simulator), undisturbed)
        assert isinstance(asking.found[0], InputError)


@pytest.mark.parametrize("ask", ["reset", "step", "close"])
def test_a_mujoco_callback_does_not_change_one_of_many(ask: str) -> None:
    angles = []
    for asking in (Asking("", len), Asking("passive", CHANGES[ask])):
        with afo.Simulators("seated", PYTHON, count=2) as many:
            STEPPED[:] = [many]
            mujoco.set_mjcb_passive(lambda model, data, asking=asking: asking.at("passive"))
            seen = many.step({"dorsiflexor": "inlet"}, 0.1)
            mujoco.set_mjcb_passive(None)
            angles.append([one.rows("ankle/angle") for one in seen])
    assert isinstance(asking.found[0], InputError)
    np.testing.assert_array_equal(*angles)


@pytest.mark.parametrize(("ask", "end"), [("reset", 0.1), ("step", 0.152)])
def test_a_generator_of_commands_acts_before_the_step(ask: str, end: float) -> None:
    timed = SETS | {"timer": {"period": "0.2 s", "dorsiflexor": {"inlet": [["0 s", "0.07 s"]]}}}
    angles = []
    with afo.Simulators("seated", timed, count=2) as many:

        def commands() -> Iterator[None]:
            CHANGES[ask](many)
            yield from (None, None)

        for given in (lambda: CHANGES[ask](many) and None, commands):
            many.reset()
            many.step(dt=0.05)
            angles.append([one.rows("ankle/angle") for one in many.step(given(), 0.1)])
            assert many.time == pytest.approx([end, end])
    np.testing.assert_array_equal(*angles)
