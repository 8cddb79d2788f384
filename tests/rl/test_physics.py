"""A scenario as dm_control's Physics: the run's own bits, commands by name, and a life with an end."""

import copy
import gc
import pickle
import subprocess
import sys
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

pytest.importorskip("dm_control")

import afo_sim as afo
from afo_sim import rl
from afo_sim.common import CallbackError, InputError
from afo_sim.model import supply_and_timer as schedule
from afo_sim.rl.dm import PhysicsError
from afo_sim.rl.physics import ScenarioPhysics

SEATED = {"duration": "5 s"}
WALKED = {"gait.settled": "walked"}


def installed() -> tuple[object, object]:
    return mujoco.get_mjcb_act_bias(), mujoco.get_mjcb_act_dyn()


@pytest.fixture(autouse=True)
def callbacks_are_given_back() -> Iterator[None]:
    yield
    gc.collect()
    assert installed() == (None, None)


@pytest.fixture
def seated() -> Iterator[ScenarioPhysics]:
    with rl.dm_control_physics("seated") as physics:
        yield physics


def angles(physics: ScenarioPhysics, n: int) -> list[float]:
    found = []
    for _ in range(n):
        found.append(float(physics.data.qpos[physics.built.index.ankle_qpos]))
        physics.step()
    return found


@pytest.mark.parametrize(("name", "sets"), [("seated", SEATED), ("walk-dropfoot-afo", WALKED)])
def test_every_bit_is_the_runs(name: str, sets: dict[str, str]) -> None:
    run = afo.run(name, sets)
    read = [
        "ankle/angle", "ankle/moment/orthosis", "ankle/moment/passive", "ankle/acceleration",
        "chamber/dorsiflexor/pressure", "chamber/dorsiflexor/mass", "chamber/dorsiflexor/mass_flow_in",
        "muscle/dorsiflexor_1/force", "muscle/dorsiflexor_1/contraction", "cuff/shank/force",
        "valve/dorsiflexor_inlet/coil", "supply/pressure",
    ]  # fmt: skip
    with rl.dm_control_physics(name, sets) as physics:
        for k in range(2000):
            assert physics.data.qpos[physics.built.index.ankle_qpos] == run["ankle/angle"][k], k
            if k % 100 == 7:  # reading changes nothing of what follows
                for column in read:
                    assert physics.read(column) == run[column][k], (k, column)
                assert physics.pressure("dorsiflexor") == run["chamber/dorsiflexor/pressure"][k]
                assert physics.air_mass("dorsiflexor") == run["chamber/dorsiflexor/mass"][k]
                assert physics.force("dorsiflexor_1") == run["muscle/dorsiflexor_1/force"][k]
                assert physics.contraction("dorsiflexor_1") == run["muscle/dorsiflexor_1/contraction"][k]
                assert physics.ankle_angle() == run["ankle/angle"][k]
                assert physics.orthosis_moment() == run["ankle/moment/orthosis"][k]
            physics.step()


def test_many_steps_at_once_and_reset_give_the_same_bits(seated: ScenarioPhysics) -> None:
    one = angles(seated, 300)
    seated.set_valves(dorsiflexor="outlet")
    seated.supply_pressure = 1e5
    seated.reset()
    assert angles(seated, 300) == one
    seated.reset()
    seated.step(299)
    assert seated.ankle_angle() == one[299]


def test_timing_given_as_inputs_gives_the_same_bits(seated: ScenarioPhysics) -> None:
    timed = angles(seated, 300)
    rows = schedule.controls(seated.built)
    seated.reset()
    for k in range(300):
        assert float(seated.data.qpos[seated.built.index.ankle_qpos]) == timed[k]
        seated.set_control(rows[k])
        seated.step()


def test_two_at_once_do_not_touch_each_other() -> None:
    alone = afo.run("seated", {"duration": "1 s"})["ankle/angle"]
    first, second = rl.dm_control_physics("seated"), rl.dm_control_physics("seated", {"timestep": "1 ms"})
    found = angles(first, 200)
    second.step(50)
    second.close()
    found += angles(first, 300)
    assert found == list(alone)
    first.close()
    first.close()
    assert installed() == (None, None)


def test_after_close_nothing_is_stepped() -> None:
    physics = rl.dm_control_physics("seated")
    physics.free()
    for use in (physics.step, physics.reset, physics.state, lambda: physics.pressure("dorsiflexor")):
        with pytest.raises(CallbackError, match="closed"):
            use()


def test_a_forgotten_physics_gives_the_callbacks_back() -> None:
    physics = rl.dm_control_physics("seated")
    assert None not in installed()
    del physics
    gc.collect()
    assert installed() == (None, None)


def test_a_replaced_callback_is_told() -> None:
    physics = rl.dm_control_physics("seated")
    mujoco.set_mjcb_act_bias(None)
    with pytest.raises(CallbackError, match="replaced"):
        physics.step()
    physics.close()


def test_a_run_beside_a_physics_leaves_both_alone(seated: ScenarioPhysics) -> None:
    alone = afo.run("seated", {"duration": "1 s"})["ankle/angle"]
    found = angles(seated, 100)
    assert np.array_equal(afo.run("seated", {"duration": "1 s"})["ankle/angle"], alone)
    assert found + angles(seated, 400) == list(alone)


def test_valves_by_name_fill_and_vent_the_chamber() -> None:
    with rl.dm_control_physics("seated", timed=False) as physics:
        physics.step(200)
        assert abs(physics.pressure("dorsiflexor")) < 100.0  # shut: only what the foot's settling does
        physics.set_valves(dorsiflexor="inlet")
        physics.step(1500)
        assert physics.supply_pressure == 4e5
        assert 3.5e5 < physics.pressure("dorsiflexor") < 4e5
        assert physics.ankle_angle() > 0.1
        physics.supply_pressure = 2e5  # an open inlet lets air back to a supply of lower pressure
        physics.step(3000)
        assert physics.pressure("dorsiflexor") == pytest.approx(2e5, rel=0.01)
        held = physics.air_mass("dorsiflexor")
        physics.set_valves(dorsiflexor="outlet")
        physics.step(3000)
        assert physics.pressure("dorsiflexor") < 0.2e5
        assert physics.air_mass("dorsiflexor") < 0.6 * held


def test_timed_again_follows_the_scenario(seated: ScenarioPhysics) -> None:
    seated.set_valves(dorsiflexor=(0.0, 0.0))
    seated.step(100)
    shut = seated.pressure("dorsiflexor")
    seated.set_valves(dorsiflexor="timed")
    seated.step(200)
    assert seated.pressure("dorsiflexor") > shut + 1e4


def test_a_timer_goes_on_beyond_the_scenarios_duration() -> None:
    long = afo.run("seated", {"duration": "2 s"})
    with rl.dm_control_physics("seated", {"duration": "1 s"}) as physics:
        assert angles(physics, 1000) == list(long["ankle/angle"])


def test_walking_that_is_over_is_told() -> None:
    with rl.dm_control_physics("walk-dropfoot-afo", WALKED) as physics:
        end = physics.built.scenario.n_step * physics.built.scenario.timestep
        physics.data.time = end
        with pytest.raises(InputError, match="recorded walking ends"):
            physics.step()
        assert np.isfinite(physics.pressure("dorsiflexor"))


@pytest.mark.parametrize(
    ("commands", "words"),
    [
        ({"dorsiflexr": "inlet"}, "did you mean 'dorsiflexor'"),
        ({"dorsiflexr": "timed"}, "did you mean 'dorsiflexor'"),
        ({"dorsiflexor": "open"}, "inlet, outlet, both, shut"),
        ({"dorsiflexor": (0.0, 1.5)}, "outside a coil's range"),
        ({"dorsiflexor": (float("nan"), 0.0)}, "outside a coil's range"),
        ({"dorsiflexor": 1.0}, "has no drive"),
    ],
)
def test_wrong_commands_are_refused(seated: ScenarioPhysics, commands: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        seated.set_valves(**commands)  # type: ignore[arg-type]


def test_other_wrong_inputs_are_refused(seated: ScenarioPhysics) -> None:
    for pressure in (-1.0, float("nan"), 4e6, "3 m"):
        with pytest.raises(InputError, match="supply_pressure"):
            seated.supply_pressure = pressure  # type: ignore[assignment]
    with pytest.raises(InputError, match="another shape"):
        seated.set_control(np.zeros(3))
    with pytest.raises(InputError, match="did you mean 'ankle/angle'"):
        seated.read("ankle/angel")
    with pytest.raises(InputError, match="keyframes"):
        seated.reset(0)
    with pytest.raises(InputError, match="build another"):
        seated.reload_from_xml_string("<mujoco/>")
    with pytest.raises(InputError, match="callback"):
        rl.dm_control_physics("seated", {"callback": "python"})
    seated.data.ctrl[seated.built.index.valves["dorsiflexor_inlet"]] = 0.5
    with pytest.raises(InputError, match=r"valve_dorsiflexor_inlet.*set_valves"):
        seated.step()


def test_reset_context_takes_another_posture(seated: ScenarioPhysics) -> None:
    with seated.reset_context():
        seated.data.qpos[seated.built.index.ankle_qpos] = -0.3
    assert seated.ankle_angle() == -0.3
    seated.step(10)
    assert seated.ankle_angle() > -0.3  # tissue, and the stretched muscles, turn the foot up


def test_instability_is_dm_controls_error(seated: ScenarioPhysics) -> None:
    chamber = seated.built.index.chambers["dorsiflexor"]
    seated.data.act[seated.model.actuator_actadr[chamber]] = -1.0
    with pytest.raises(PhysicsError, match=r"air mass.*chamber_dorsiflexor"):
        seated.step()


@pytest.mark.parametrize(
    "copied",
    [lambda p: p.copy(), copy.copy, copy.deepcopy, lambda p: pickle.loads(pickle.dumps(p))],
    ids=["copy()", "copy", "deepcopy", "pickle"],
)
def test_copies_go_on_alike(seated: ScenarioPhysics, copied: object) -> None:
    seated.step(50)
    seated.set_valves(plantarflexor="inlet")
    with copied(seated) as other:  # type: ignore[operator]
        assert angles(other, 100) == angles(seated, 100)
        assert other.pressure("plantarflexor") > 1e4
    seated.step()  # its callbacks are still there


def test_the_drawn_model_has_its_shapes(seated: ScenarioPhysics) -> None:
    names = {seated.model.id2name(k, "geom") for k in range(seated.model.ngeom)}
    assert {"shank", "knee"} <= names


@pytest.mark.slow
def test_python_ends_well_with_a_physics_left_open() -> None:
    code = "from afo_sim import rl\np = rl.dm_control_physics('seated')\np.step(10)\nprint('done')"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (0, "done\n"), ended.stderr


@pytest.mark.slow
def test_a_missing_dm_control_is_told_in_one_sentence() -> None:
    code = (
        "import sys\nsys.modules['dm_control'] = None\nfrom afo_sim import rl\n"
        "try:\n    rl.dm_control_physics('seated')\nexcept ImportError as error:\n    print(error)\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ended.stdout.startswith("this needs the library dm_control"), ended.stderr
    assert "3.13" in ended.stdout and ended.stdout.count("\n") == 1


def test_a_pressure_goes_to_the_drive_and_a_described_controller_does_not_act() -> None:
    """As in a Simulator, which gives the bits of a run."""
    pid = {"pid": {"angle": {"proportional_band": "1 deg", "reference": {"mean": "5 deg"}}}}
    sets = {"timer": None, "controller": pid, "drive": {"dorsiflexor": {"kind": "pwm"}}, "duration": "1 s"}
    with rl.dm_control_physics("seated", sets) as physics, afo.Simulator("seated", sets) as simulator:
        physics.step(100)
        assert physics.pressure("dorsiflexor") == pytest.approx(0.0, abs=100.0)  # [Pa]: its valves are shut
        physics.set_valves(dorsiflexor=1.5e5)
        physics.step(300)
        simulator.step(None, 0.2)
        simulator.step({"dorsiflexor": 1.5e5}, 0.6)
        simulator.step(None, 0.002)  # a sample is one step old
        assert physics.ankle_angle() == simulator.observe()["ankle/angle"]
        assert physics.pressure("dorsiflexor") > 1e5
