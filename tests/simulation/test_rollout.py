"""The roll-out: policies, blocks, strides, many simulations side by side."""

import pathlib
import re

import numpy as np
import pytest

import afo_sim
from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, CallbackError, SimulationError
from afo_sim.description import load
from afo_sim.model import Built, equilibrium
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import STATE, Case, Moment, Policy, Recipe, Rollout, fixed, roll_out, run_built
from afo_sim.simulation.simulate import simulate

PACKAGE = pathlib.Path(afo_sim.__file__).parent
SUPPLIES = (2e5, 3e5, 4e5)


@pytest.fixture(scope="module")
def built() -> Built:
    return build(load("scenario", "seated", {"duration": "1.2 s", "timestep": "1 ms"}))


@pytest.fixture(scope="module")
def control(built: Built) -> np.ndarray:
    return schedule.controls(built)


@pytest.fixture(scope="module")
def alone(built: Built, control: np.ndarray) -> Rollout:
    return simulate(built, control)


@pytest.fixture(scope="module")
def start(built: Built, control: np.ndarray) -> np.ndarray:
    with native.installed():
        return equilibrium(built, control[0])


def replay(inputs: np.ndarray, period: int | None) -> Policy:
    return Policy(lambda moment: inputs[moment.steps.start : moment.steps.stop], period)


def supplied(built: Built, control: np.ndarray, pressure: float) -> np.ndarray:
    mine = control.copy()
    mine[:, list(built.index.chambers.values())] = pressure
    return mine


def assert_same(one: Rollout, other: Rollout) -> None:
    assert one.rows.keys() == other.rows.keys()
    assert all(np.array_equal(one.rows[name], other.rows[name]) for name in one.rows)
    assert all(np.array_equal(one.final[name], other.final[name]) for name in STATE)


@pytest.mark.parametrize("period", [1, 7, 250, 5000])
def test_policy_that_replays_an_array_gives_the_same_bits(
    period: int, built: Built, control: np.ndarray, alone: Rollout
) -> None:
    n = 300 if period == 1 else 1200
    again = simulate(built, replay(control, period), n_step=n)
    assert np.array_equal(again.control, control[:n])
    assert all(np.array_equal(again.rows[name], alone.rows[name][:n]) for name in alone.rows)


def test_policy_sees_the_state_of_its_first_step_and_the_rows_before(
    built: Built, control: np.ndarray, alone: Rollout
) -> None:
    seen: list[tuple[range, dict, dict]] = []

    def choose(moment: Moment) -> np.ndarray:
        seen.append((moment.steps, moment.now, {name: v.copy() for name, v in moment.last.items()}))
        return control[moment.steps.start : moment.steps.stop]

    simulate(built, Policy(choose, 500))
    assert [steps for steps, _, _ in seen] == [range(500), range(500, 1000), range(1000, 1200)]
    assert len(seen[0][2]["qpos"]) == 0
    for k, (steps, now, last) in enumerate(seen):
        assert all(np.array_equal(now[name], alone.rows[name][steps.start]) for name in STATE)
        before = slice(500 * max(k - 1, 0), steps.start)
        assert all(np.array_equal(last[name], alone.rows[name][before]) for name in last)


def test_bang_bang_policy_holds_a_pressure() -> None:
    """Inlet below 2 bar, outlet above: a controller that no array written beforehand could be."""
    built = build(load("scenario", "seated", {"duration": "3 s"}))
    base, index, wanted = schedule.controls(built, 1)[0], built.index, 2e5
    base[list(index.valves.values())] = 0.0
    chamber = index.chambers["dorsiflexor"]

    def choose(moment: Moment) -> np.ndarray:
        last = moment.last  # none at first, when the muscles are empty
        air = native.read_air(built.model, last["act"], last["userdata"], chamber)
        low = not len(last["act"]) or air.absolute_pressure[-1] - AMBIENT_PRESSURE < wanted
        inputs = np.tile(base, (len(moment.steps), 1))
        inputs[:, index.valves["dorsiflexor_inlet" if low else "dorsiflexor_outlet"]] = 1.0
        return inputs

    run = run_built(built, policy=Policy(choose, 10))
    assert run.ok
    settled = run["time"] > 2.0
    pressure = run["chamber/dorsiflexor/pressure"][settled]
    assert np.abs(pressure - wanted).max() < 0.15e5
    assert run["chamber/plantarflexor/pressure"].max() < 0.3e5
    for side in ("inlet", "outlet"):
        coil = run[f"valve/dorsiflexor_{side}/coil"][settled]
        assert 0.0 < coil.mean() < 1.0
        assert set(np.unique(coil)) == {0.0, 1.0}
    assert run.metrics["air_per_cycle"].value > 0.0


def test_python_mode_takes_the_same_policy(built: Built, control: np.ndarray, alone: Rollout) -> None:
    plain = build(load("scenario", "seated", {"duration": "1.2 s", "timestep": "1 ms", "callback": "python"}))
    again = simulate(plain, replay(control, 70), n_step=200)
    assert np.array_equal(again.control, control[:200])
    assert again.rows["act"] == pytest.approx(alone.rows["act"][:200], rel=1e-9)


@pytest.mark.parametrize("block", [1200, 500, 77])
@pytest.mark.parametrize("threads", [1, 2])
def test_many_are_each_what_they_are_alone(
    block: int, threads: int, built: Built, control: np.ndarray, start: np.ndarray
) -> None:
    inputs = [supplied(built, control, p) for p in SUPPLIES]
    cases = [Case(built.model, start, fixed(mine)) for mine in inputs]
    together = roll_out(cases, 1200, Recipe(block=block, threads=threads))
    for case, mine, one in zip(cases, inputs, together, strict=True):
        assert_same(one, roll_out([case], 1200)[0])
        assert np.array_equal(one.control, mine)
    assert len({float(one.rows["qpos"][-1, 0]) for one in together}) == len(SUPPLIES)


@pytest.mark.parametrize("block", [1200, 500])
def test_one_that_fails_does_not_touch_the_others(
    block: int, built: Built, control: np.ndarray, start: np.ndarray
) -> None:
    """A supply without pressure stops in a kernel, an input that is not a number by MuJoCo's own warning."""
    inputs = [supplied(built, control, p) for p in SUPPLIES]
    inputs[0][700:, list(built.index.chambers.values())] = -2e5
    inputs[1][600:, built.index.passive] = np.nan
    cases = [Case(built.model, start, fixed(mine), number) for number, mine in enumerate(inputs)]
    kernel, warned, sound = roll_out(cases, 1200, Recipe(block=block))
    assert sound.failure is None
    assert_same(sound, roll_out([cases[2]], 1200)[0])
    assert "supply's absolute pressure is not positive in 'chamber_dorsiflexor'" in str(kernel.failure)
    for one, number, steps in ((kernel, 0, 700), (warned, 1, 600)):
        assert isinstance(one.failure, SimulationError)
        assert (one.failure.simulation, one.failure.time) == (number, pytest.approx(1e-3 * steps))
        assert len(one.rows["time"]) == len(one.control) == steps
        assert one.final["time"][0] == pytest.approx(1e-3 * steps)
        assert all(np.isfinite(values).all() for values in one.rows.values())
        assert_same(one, roll_out([cases[number]], 1200)[0])


@pytest.mark.parametrize("block", [1200, 77])
def test_stride_keeps_every_so_many_rows(
    block: int, built: Built, control: np.ndarray, start: np.ndarray, alone: Rollout
) -> None:
    case = Case(built.model, start, fixed(control))
    (thin,) = roll_out([case], 1200, Recipe(stride=9, block=block))
    assert all(np.array_equal(thin.rows[name], alone.rows[name][::9]) for name in thin.rows)
    assert np.array_equal(thin.control, control[::9])
    assert all(np.array_equal(thin.final[name], alone.final[name]) for name in STATE)


def test_stretches_put_together_are_the_whole(built: Built, control: np.ndarray, alone: Rollout) -> None:
    parts: list[Rollout] = []
    done: list[int] = []
    simulate(built, control, see=parts.append, progress=lambda steps, of: done.append(steps))
    assert [part.first_step for part in parts] == list(range(0, 1200, 250))
    assert done == [250, 500, 750, 1000, 1200]
    for name, values in alone.rows.items():
        assert np.array_equal(np.concatenate([part.rows[name] for part in parts]), values)
    assert np.array_equal(np.concatenate([part.control for part in parts]), control)


def test_limp_muscle_is_its_own_failure(built: Built, control: np.ndarray, start: np.ndarray) -> None:
    limp = build(built.scenario).model
    limp.actuator_user[built.index.muscles["dorsiflexor_1"], 0] = 0.0
    cases = [Case(model, start, fixed(control)) for model in (limp, built.model)]
    refused, sound = roll_out(cases, 100)
    assert isinstance(refused.failure, CallbackError)
    assert len(refused.rows["time"]) == 0
    assert sound.failure is None
    assert len(sound.rows["time"]) == 100


def test_policies_of_one_rollout_choose_together(
    built: Built, control: np.ndarray, start: np.ndarray
) -> None:
    cases = [Case(built.model, start, replay(control, period)) for period in (10, 20)]
    with pytest.raises(ValueError, match="different periods"):
        roll_out(cases, 100)


def test_nobody_else_steps() -> None:
    users = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if re.search(r"mj_step\(|from mujoco\.batch|import mujoco\.rollout", path.read_text("utf-8"))
    }
    # a Physics and a whole model are stepped by their users; a network is filled before it begins
    # a walker who may fall is stepped by 10 ms
    own = {"rl/physics.py", "rl/environments/attached_env.py", "walker/walking.py"}
    assert users == {"simulation/stepping.py", "model/prefill.py"} | own
