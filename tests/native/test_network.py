"""A network's solution: found from anywhere, by two ways; a function of its state; the same in any mode."""

import itertools
import math
from typing import Any

import mujoco
import numpy as np
import pytest
from ankle_rig import STIFFENING, Ankle, pulses
from campaign import size
from mujoco.batch import Batch

from afo_sim import native
from afo_sim.description import load
from afo_sim.model import walking_start
from afo_sim.model.build import build
from afo_sim.model.supply_and_timer import controls
from afo_sim.native import balance, slots
from afo_sim.native import network as solving
from afo_sim.native import newton as newtons_method
from afo_sim.native.install import _flat
from afo_sim.native.muscle import friction, law_slopes, yield_force
from afo_sim.physics import FRICTIONS, Braid
from afo_sim.physics.static_force import static_slopes

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
CUFF, PLATE = (4e3, 0.0, 0.0, 0.0), (5e4, 0.0, 0.0, 0.0)


def rubbing(name: str, braid: Braid) -> tuple[int, tuple[float, ...]]:
    """A friction with its typical values."""
    found = FRICTIONS[name]
    return found.native_id, found.coefficients(braid, {p.name: p.typical for p in found.parameters})


BRAID = Ankle().braid
FULL = Ankle(  # two groups, anchors of both kinds, one damped, friction with states, three muscles a group
    groups=2,
    count=3,
    cable_stiffness=1e5,
    anchors=(CUFF, (*STIFFENING, 50.0)),
    friction=rubbing("maxwell_slip", BRAID),
)
RIGS = {
    "shipped-like": Ankle(groups=2, cable_stiffness=1e5, anchors=(CUFF, PLATE)),
    "one chamber": Ankle(groups=2, one_chamber=True),
    "one chamber, one anchor": Ankle(groups=2, one_chamber=True, anchors=(CUFF,), cable_stiffness=1e4),
    "all losses": FULL,
    "Coulomb": Ankle(
        groups=2, damping=0.0, anchors=(PLATE,), friction=rubbing("tondu_lopez_2000_stribeck", BRAID)
    ),
    "no losses": Ankle(groups=2, damping=0.0, cable_stiffness=1e7, anchors=((*STIFFENING, 0.0),)),
    "heavy damper": Ankle(groups=2, damping=5e-3, one_chamber=True, anchors=(CUFF,)),
}
every_rig = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)


# --- a function of its state ------------------------------------------------------------------------


def in_motion(rig: Ankle, model: mujoco.MjModel, steps: int = 150) -> mujoco.MjData:
    """Part of the way through its pulses; the callbacks must be installed."""
    data, inputs = rig.started(model, 0.5e5, 0.05), pulses(model)
    for n in range(steps):
        data.ctrl[:] = inputs(n * model.opt.timestep)
        mujoco.mj_step(model, data)
    return data


@every_rig
def test_a_second_forward_changes_no_bit(rig: Ankle) -> None:
    model = rig.model()
    with native.installed():
        data = in_motion(rig, model)
        found = []
        for _ in range(3):
            mujoco.mj_forward(model, data)
            found.append(
                [x.copy() for x in (data.act_dot, data.actuator_force, data.userdata, data.qacc, data.act)]
            )
            data.userdata[:] = 7.0  # nothing is taken from there
            data.act_dot[:] = 7.0
    for again in found[1:]:
        for x, y in zip(found[0], again, strict=True):
            assert np.array_equal(x, y)


@every_rig
def test_a_restart_in_the_middle_gives_the_same_bits(rig: Ankle) -> None:
    model = rig.model()
    inputs = pulses(model)
    row = np.empty(mujoco.mj_stateSize(model, INTEGRATION))

    def onward(data: mujoco.MjData) -> np.ndarray:
        rows = []
        for n in range(150, 400):
            data.ctrl[:] = inputs(n * model.opt.timestep)
            mujoco.mj_step(model, data)
            rows.append(np.r_[data.qpos, data.qvel, data.act, data.userdata, data.actuator_force])
        return np.array(rows)

    with native.installed():
        data = in_motion(rig, model)
        mujoco.mj_getState(model, data, row, INTEGRATION)
        other = mujoco.MjData(model)
        mujoco.mj_setState(model, other, row, INTEGRATION)
        assert np.array_equal(onward(data), onward(other))


def test_threads_give_the_same_bits() -> None:
    model = FULL.model()
    inputs = pulses(model)
    control = np.array([inputs(n * model.opt.timestep).copy() for n in range(300)])
    controls = np.repeat(control[None], 6, axis=0)
    chambers = [model.actuator(f"chamber_{name}").id for name in FULL.names]
    controls[:, :, chambers] *= np.linspace(0.4, 1.2, 6)[:, None, None]
    row, results = np.empty(mujoco.mj_stateSize(model, INTEGRATION)), []
    with native.installed():
        mujoco.mj_getState(model, FULL.started(model, 0.5e5, 0.05), row, INTEGRATION)
        for threads in (1, 2, 4):
            batch = Batch(model, nsim=6, nthread=threads)
            batch.state[:] = row
            out = batch.rollout(300, controls, record=["qpos", "qvel", "act"])
            results.append(np.concatenate([out[name] for name in ("qpos", "qvel", "act")], axis=-1))
    assert np.array_equal(results[0], results[1])
    assert np.array_equal(results[0], results[2])
    assert len(np.unique(results[0][:, -1], axis=0)) == 6


@pytest.mark.slow
@every_rig
def test_plain_python_gives_the_same_numbers(rig: Ankle) -> None:
    """Forces, own lengths, rates of all states, over 60 steps in which muscles fill and become taut."""
    model, rows = rig.model(), []
    inputs = pulses(model)
    for mode in ("native", "python"):
        with native.installed(mode):
            data, found = rig.started(model, 2e5, 0.05), []
            for n in range(60):
                data.ctrl[:] = inputs(0.09 + n * model.opt.timestep)
                mujoco.mj_step(model, data)
                found.append(np.r_[data.actuator_force, data.userdata, data.act_dot, data.act, data.qpos])
            rows.append(np.array(found))
    scale = np.abs(rows[1]).max(axis=0) + 1e-300
    kept = scale > 1e-14  # a damper's force of no damper is rounding
    assert np.abs(rows[0] - rows[1])[:, kept].max(axis=0) / scale[kept] == pytest.approx(0.0, abs=1e-12)
    assert rows[0][:, : model.nu].min() < -5.0  # muscles pull


@pytest.mark.slow
def test_a_walking_step_asks_its_laws_seven_times_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over a stride: with a good first guess, two steps of Newton's method, and slopes with each force."""
    built = build(load("scenario", "walk-dropfoot-afo", {"timestep": "2 ms"}))
    control, data, asked = controls(built)[:550], mujoco.MjData(built.model), []
    space = static_slopes.__globals__
    for name, kernel in [item for item in space.items() if item[0].startswith("kernel_")]:
        monkeypatch.setitem(space, name, lambda *given, kernel=kernel: asked.append(given) or kernel(*given))
    with native.installed("python"):
        mujoco.mj_setState(built.model, data, walking_start(built, control[0]), INTEGRATION)
        asked.clear()
        for row in control:
            data.ctrl[:] = row
            mujoco.mj_step(built.model, data)
    assert 2 * len(control) <= len(asked) <= 7 * len(control)


# --- one solution, two ways to it -------------------------------------------------------------------


def at_random(rig: Ankle, seed: int) -> tuple[Any, mujoco.MjData]:
    """A posture and a past that need not have to do with each other: stretched, taut, slack."""
    random, model = np.random.default_rng(seed), rig.model()
    with native.installed():
        data = rig.started(
            model, random.uniform(0.0, 4e5, len(rig.circuit().chambers)), random.uniform(-0.2, 0.5)
        )
    data.qpos[0] += random.uniform(-0.05, 0.05)
    mujoco.mj_fwdPosition(model, data)
    for name in rig.names:
        at = int(model.actuator_user[model.actuator(f"{name}_0").id, slots.MUSCLE_ROW.state])
        data.act[at + slots.LEADER_ACT.contraction] += random.normal(0.0, 5e-3)
        data.act[at + slots.LEADER_ACT.last_move] += random.normal(0.0, 1e-3)
    return _flat(model), data


def places(model: Any) -> list[int]:
    """Of the leaders' contractions in `userdata`."""
    rows = model.actuator_user.reshape(-1, model.nuser_actuator)
    of_leaders = (rows[:, slots.KIND] == slots.Kind.MUSCLE) & (
        rows[:, slots.MUSCLE_ROW.leader] == np.arange(len(rows))
    )
    return [int(at) + slots.LEADER_DATA.contraction for at in rows[of_leaders, slots.MUSCLE_ROW.userdata]]


def solved(model: Any, data: mujoco.MjData, rest: bool = False) -> tuple[float, np.ndarray]:
    """Pull and contractions by Newton's method."""
    first = newtons_method.guess(model, data, 0, 0, rest)
    pull, settled = newtons_method.newton(model, data, 0, first, rest)
    assert settled
    return pull, data.userdata[places(model)]


@pytest.mark.slow
@every_rig
@pytest.mark.parametrize("seed", range(1, 1 + size(1, 2)))
@pytest.mark.parametrize("rest", [False, True])
def test_bisection_finds_what_newton_finds(
    rig: Ankle, seed: int, rest: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solving, "HALVINGS", 36)  # of a bracket of κ to 1e-11; more would only take longer
    model, data = at_random(rig, seed)
    pull, newton = solved(model, data, rest)
    # chamber by chamber, and where Newton's method fails there, too
    for solve in (solving.newton_chamber, lambda *_: False):
        monkeypatch.setattr(solving, "newton_chamber", solve)
        assert solving.bisect(model, data, 0, rest) == pytest.approx(pull, abs=2e-5)
        assert data.userdata[places(model)] == pytest.approx(newton, abs=1e-8)


@every_rig
def test_newton_from_absurd_guesses_is_right_or_says_so(rig: Ankle) -> None:
    settled_ones = 0
    for seed in range(3):
        model, data = at_random(rig, seed)
        right, lengths = solved(model, data)
        for start, pull in itertools.product((-0.07, 0.0, 0.4, 0.9), (0.0, 50.0, 1e6)):
            data.userdata[places(model)] = start
            again, settled = newtons_method.newton(model, data, 0, pull, False)
            settled_ones += settled or rig is RIGS["Coulomb"]  # its step in the rate is too steep for it
            if settled:
                assert again == pytest.approx(right, abs=1e-6 + 1e-9 * right)
                assert data.userdata[places(model)] == pytest.approx(lengths, abs=1e-9)
    assert settled_ones > 12


@every_rig
def test_a_leaders_force_falls_with_its_contraction(rig: Ankle) -> None:
    """So that bisection has one crossing to find, at any pressure and any displacement of the anchors."""
    for seed in range(3):
        model, data = at_random(rig, seed)
        chamber = next(
            i
            for i in range(99)
            if model.actuator_user[model.nuser_actuator * i + slots.KIND] == slots.Kind.CHAMBER
        )
        leader = int(model.actuator_user[model.nuser_actuator * chamber + slots.CHAMBER_ROW.first_muscle])
        grid = np.linspace(-0.075, 0.5, 400)
        for absolute, moved, rest in itertools.product((3e4, 1e5, 1.5e5, 5e5), (0.0, 0.01), (False, True)):
            left = [balance.lacking(model, data, leader, chamber, x, absolute, moved, rest)[0] for x in grid]
            assert np.all(np.diff(left) < 0.0)


@pytest.mark.slow
@every_rig
def test_the_pull_that_is_left_rises_with_the_pull(rig: Ankle, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solving, "HALVINGS", 30)
    model, data = at_random(rig, 4)
    row = model.actuator_user
    size = model.nuser_actuator
    left = []
    for pull in (0.0, 1.0, 10.0, 50.0, 100.0, 300.0):
        moved, _ = balance.shift(model, data, 0, pull, False)
        pulled, chamber = 0.0, int(row[slots.NETWORK_ROW.first_chamber])
        while chamber >= 0:
            pulled += solving.pull_at(model, data, chamber, moved, False)
            chamber = int(row[size * chamber + slots.CHAMBER_ROW.next])
        left.append(pull - pulled)
    assert np.all(np.diff(left) > 0.0)


@pytest.mark.parametrize("name", ["hunt_2017", "maxwell_slip"])
def test_friction_of_a_dead_band_never_drives(name: str) -> None:
    """Also where the law's force falls with the pressure, so that a dead band would make it stronger."""
    model, data = at_random(Ankle(friction=rubbing(name, BRAID)), 1)
    user = model.actuator_user
    k = model.nuser_actuator * next(
        i for i in range(9) if user[model.nuser_actuator * i + slots.KIND] == slots.Kind.MUSCLE
    )
    dead_band, falling = user[k + slots.MUSCLE_ROW.friction_coefficients], 0
    for kappa, pressure in itertools.product(np.linspace(-0.07, 0.9, 40), (-1e4, 0.0, 1e4, 1e5, 5e5)):
        static = law_slopes(user, k, kappa, pressure)[0]
        yields = yield_force(user, k, kappa, pressure, static)
        lower = min(pressure, max(pressure - dead_band, 0.0))
        weaker = static - law_slopes(user, k, kappa, lower)[0]
        falling += weaker < 0.0
        assert yields == pytest.approx(max(weaker, 0.0), abs=1e-9)
        for rate in (-1.0, -1e-4, 0.0, 1e-4, 1.0):
            moved = rate * model.opt.timestep
            force, slope = friction(model, data, k, kappa, moved, pressure, static)
            assert force * moved >= 0.0 and slope >= 0.0
            assert abs(force) <= yields * (1.0 + 1e-12)
    assert falling > 20


@pytest.mark.parametrize("name", ["tondu_lopez_2000_stribeck", "hunt_2017"])
def test_friction_takes_energy_also_where_the_step_before_was_a_long_one(name: str) -> None:
    """By steps back alone a muscle that comes to rest within a third of its last move would be drawn on."""
    rubbed, free = (at_random(Ankle(friction=f), 1) for f in (rubbing(name, BRAID), (0, ())))
    for last, share in itertools.product((-1e-3, 1e-3), (-1.0, 0.1, 0.3, 1.0)):
        left = []
        for model, data in (rubbed, free):
            chamber = int(model.actuator_user[slots.NETWORK_ROW.first_chamber])
            leader = int(model.actuator_user[model.nuser_actuator * chamber + slots.CHAMBER_ROW.first_muscle])
            at = int(model.actuator_user[model.nuser_actuator * leader + slots.MUSCLE_ROW.state])
            data.act[at + slots.LEADER_ACT.contraction], data.act[at + slots.LEADER_ACT.last_move] = 0.1, last
            left.append(balance.lacking(model, data, leader, chamber, 0.1 + share * last, 3e5, 0.0, False)[0])
        assert (left[1] - left[0]) * share * last > 0.0


def test_a_muscle_that_shortens_against_a_heavy_damper_is_bracketed(monkeypatch: pytest.MonkeyPatch) -> None:
    """There more pressure makes a narrower muscle: the damper grows with it, and the bracket must hold it."""
    monkeypatch.setattr(solving, "HALVINGS", 36)
    rig = Ankle(damping=5e-3, timestep=2e-3)
    model, data = at_random(rig, 1)
    user, size = model.actuator_user, model.nuser_actuator
    chamber = int(user[slots.NETWORK_ROW.first_chamber])
    leader = int(user[size * chamber + slots.CHAMBER_ROW.first_muscle])
    # it shortened by so much in the step before that what is left of that draws with 2 kN
    state, air = int(user[size * leader + slots.MUSCLE_ROW.state]), model.actuator_actadr[chamber]
    absolute = data.act[air + slots.CHAMBER_ACT.last_pressure]
    data.act[state + slots.LEADER_ACT.last_move] = 2e3 * 2.0 * rig.timestep / (rig.damping * absolute)
    pull, newton = solved(model, data)
    solving.bisect(model, data, 0, False)
    assert data.userdata[places(model)] == pytest.approx(newton, abs=1e-9)
    assert math.isfinite(pull)


@pytest.mark.parametrize("mode", ["native", "python"])
def test_a_muscle_that_nothing_holds_spoils_no_other(mode: native.Mode) -> None:
    """Slack, without air, bladder, damper and return force any length balances it; its neighbour is taut."""
    rig = Ankle(groups=2, damping=0.0, return_stiffness=0.0, anchors=(CUFF,), cable_stiffness=1e5)
    model = rig.model()
    muscles = [model.actuator(f"{name}_0").id for name in rig.names]
    for muscle in muscles:  # the law's bladder
        first = slots.MUSCLE_ROW.coefficients
        model.actuator_user[muscle, first + 3 : first + 5] = 0.0
    with native.installed(mode):
        data = rig.started(model, [3e5, 0.0], 0.2)
        for _ in range(20):
            mujoco.mj_step(model, data)
        taut, slack = (native.read_own(model, data.userdata, muscle) for muscle in muscles)
        assert taut.tension > 10.0
        assert slack.tension == 0.0
        assert math.isfinite(slack.contraction)
        assert data.ctrl[muscles[0]] > 0.0  # its derivative, which keeps the step stable
