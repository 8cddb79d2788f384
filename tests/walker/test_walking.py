"""The walker in MuJoCo's step: against laws of nature, against its reflexes computed anew, and itself."""

import copy
import dataclasses

import mujoco
import numpy as np
import pytest

from afo_sim import native
from afo_sim.common import GRAVITY, SimulationError
from afo_sim.physics import GAINS, LEG_MUSCLES, tendon_force
from afo_sim.walker import ROOT, Push, build_body, prepared, read_gait, strides_of, walk_body
from afo_sim.walker.gait import start
from afo_sim.walker.strides import swing_clearance
from afo_sim.walker.walking import _Board, _fill, _Recorder

ANKLE_MUSCLES = ("gastrocnemius", "soleus", "tibialis")


def body_of(scenario: str = "walk-healthy", step: str = "1 ms", **strength: float):  # type: ignore[no-untyped-def]
    return build_body(prepared(scenario, {"timestep": step}), strength)


def limp(body):  # type: ignore[no-untyped-def]
    """The body without muscles, tissue and toe spring, high in the air."""
    rows = body.model.actuator_user
    rows[body.muscles.ravel(), native.LEG_MUSCLE_ROW.force] = 0.0
    for side in ("", "left_"):
        tissue = body.model.actuator(f"{side}tissue").id
        rows[tissue, native.slots.PASSIVE_ROW.scale] = rows[tissue, native.slots.PASSIVE_ROW.damping] = 0.0
        toe = body.model.joint(f"{side}toe")
        body.model.jnt_stiffness[toe.id] = 0.0
        body.model.dof_damping[int(toe.dofadr[0])] = 0.0
        body.model.dof_damping[int(body.model.joint(f"{side}ankle").dofadr[0])] = 0.0
        rows[body.reflexes, native.REFLEX_ROW.extension] = 0.0
    return body


def angles_in_the_air(body) -> np.ndarray:  # type: ignore[no-untyped-def]
    """All angles 0.1 s after a start high in the air, in landing and late stance, which only loads end."""
    model, data = body.model, start(body, read_gait("natural").vector)
    data.qpos[1] += 2.0
    data.act[model.actuator_actadr[body.reflexes]] = 4.0, 1.0
    with native.installed():
        mujoco.mj_forward(model, data)
        data.qvel -= 0.5 * model.opt.timestep * data.qacc
        mujoco.mj_step(model, data, nstep=round(0.1 / model.opt.timestep))
    assert (np.round(data.act[model.actuator_actadr[body.reflexes]]) == (4.0, 1.0)).all()
    return data.qpos[2:]


def test_a_limp_walker_in_the_air_keeps_energy_and_falls_as_a_stone() -> None:
    body = limp(body_of(step="0.25 ms"))
    model = body.model
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = start(body, read_gait("natural").vector)
    data.qpos[1] += 2.0
    with native.installed():
        mujoco.mj_forward(model, data)
        energy, centre = data.energy.sum(), data.subtree_com[0].copy()
        mujoco.mj_subtreeVel(model, data)
        velocity = data.subtree_linvel[0].copy()
        mujoco.mj_step(model, data, nstep=400)
        mujoco.mj_forward(model, data)
    assert data.energy.sum() == pytest.approx(energy, rel=2e-4)
    fallen = centre + 0.1 * velocity - [0.0, 0.0, 0.5 * GRAVITY * 0.01]
    assert np.abs(data.subtree_com[0] - fallen).max() < 2e-4


@pytest.mark.parametrize("made", [body_of, lambda step: limp(body_of(step=step))])
def test_free_swing_is_of_second_order(made) -> None:  # type: ignore[no-untyped-def]
    coarse, middle, fine = (angles_in_the_air(made(step=step)) for step in ("0.5 ms", "0.25 ms", "0.125 ms"))
    assert np.log2(np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)) > 1.8


def test_bias_is_of_rates_half_a_step_on() -> None:
    """As MuJoCo's own recursion has it for rates that go on as over the last step."""
    body, rng = body_of("walk-dropfoot-afo"), np.random.default_rng(0)
    model, data = body.model, start(body, read_gait("natural").vector)
    data.time, data.qvel[:], before = 1.0, rng.normal(size=model.nv), rng.normal(size=model.nv)
    data.userdata[: 2 * model.nv] = np.repeat(before, 2)
    other, expected = copy.copy(data), np.empty(model.nv)
    other.qvel[:] = 1.5 * data.qvel - 0.5 * before
    mujoco.mj_fwdPosition(model, other)
    mujoco.mj_comVel(model, other)
    mujoco.mj_rne(model, other, 0, expected)
    with native.installed():
        _fill(body, data)
        mujoco.mj_forward(model, data)
    assert np.abs(data.qfrc_bias - expected).max() < 1e-9 * np.abs(expected).max()


def test_the_floor_carries_the_body_on_average() -> None:
    body = body_of()
    walked = walk_body(body, read_gait("natural").vector, 8.0)
    assert walked.fell is None
    down = walked["right/load"] > 20.0
    strikes = np.flatnonzero(down[1:] & ~down[:-1])
    strikes = strikes[np.diff(strikes, prepend=-99) > 40]
    rows = slice(strikes[2], strikes[-1])
    load = (walked["right/load"] + walked["left/load"])[rows].mean()
    assert load == pytest.approx(body.weight, rel=0.02)


def test_excitations_are_those_of_delayed_signals() -> None:
    """Of soleus, gastrocnemius and tibialis, computed anew from rows of each step, 20 ms before."""
    body, gait = body_of(), read_gait("natural")
    model, data = body.model, start(body, gait.vector)
    act, kept = native.LEG_MUSCLE_ACT, []
    at = {name: int(model.actuator_actadr[i]) for name, i in zip(LEG_MUSCLES, body.muscles[0], strict=True)}
    with native.installed():
        for _ in range(600):
            mujoco.mj_step(model, data)
            row = [data.act[at[name] + act.force] for name in ANKLE_MUSCLES]
            row += [data.act[at[name] + act.length] for name in ANKLE_MUSCLES]
            row += [data.act[at[name] + act.excitation] for name in ANKLE_MUSCLES]
            row += [np.round(data.act[int(model.actuator_actadr[body.reflexes[0]])])]
            kept.append(row)
    force, length, asked, phases = np.split(np.array(kept), [3, 6, 9], axis=1)
    gains = dict(zip(GAINS, gait.vector.gains[0], strict=True))
    back, rows = 20, np.arange(100, 600)
    phase, before = phases[rows, 0], rows - back
    stands, swings = phase <= 2.0, phase == 3.0
    for column, name in ((0, "gastrocnemius"), (1, "soleus")):
        beyond = np.maximum(length[before, column] - gains[f"{name}_offset"], 0.0)
        expected = gains[f"{name}_force"] * force[before, column] + gains[f"{name}_length"] * beyond
        expected = np.where(stands, expected, 0.0) + np.where(swings, 0.0, gains[f"{name}_start"])
        assert np.abs(asked[rows, column] - np.clip(expected, 0.01, 1.0)).max() < 1e-9
    expected = gains["tibialis_length"] * (length[before, 2] - gains["tibialis_offset"])
    expected += gains["tibialis_soleus"] * force[before, 1]
    expected += np.where(stands, 0.0, gains["tibialis_swing"])
    expected += np.where(phase == 0.0, gains["tibialis_loading"], 0.0)
    assert np.abs(asked[rows, 2] - np.clip(expected, 0.01, 1.0)).max() < 1e-9


def test_compiled_and_plain_python_agree() -> None:
    gait, found = read_gait("natural"), []
    for mode in ("native", "python"):
        body = body_of("walk-dropfoot", tibialis=0.3)
        data = start(body, gait.vector)
        with native.installed(mode):
            mujoco.mj_step(body.model, data, nstep=40)
        found.append(np.concatenate([data.qpos, data.qvel, data.act]))
    assert np.abs(found[0] - found[1]).max() < 1e-9 * np.abs(found[0]).max()


def test_a_walk_goes_on_from_its_state_to_the_bit() -> None:
    body = body_of("walk-healthy")
    model, data = body.model, start(body, read_gait("natural").vector)
    whole = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, whole))
    with native.installed():
        mujoco.mj_step(model, data, nstep=500)
        mujoco.mj_getState(model, data, state, whole)
        mujoco.mj_step(model, data, nstep=500)
        other = mujoco.MjData(model)
        mujoco.mj_setState(model, other, state, whole)
        mujoco.mj_step(model, other, nstep=500)
    assert (data.qpos == other.qpos).all() and (data.act == other.act).all()


def test_looking_at_a_walk_does_not_change_it() -> None:
    body, found = body_of(), []
    for looks in (False, True):
        data = start(body, read_gait("natural").vector)
        with native.installed():
            for _ in range(30):
                if looks:
                    mujoco.mj_forward(body.model, data)
                mujoco.mj_step(body.model, data, nstep=10)
        found.append(data.qpos.copy())
    # to rounding: what a pad's gain adds and its bias takes off is of another size then
    assert np.abs(found[0] - found[1]).max() < 1e-9


def test_a_muscle_pulls_as_its_tendon_is_stretched() -> None:
    """What a fibre leaves of the path at the recorded angles stretches the tendon, which only pulls."""
    body, row = body_of(step="0.25 ms"), native.LEG_MUSCLE_ROW
    walked, model = walk_body(body, read_gait("natural").vector, 2.0), body.model
    data, found = mujoco.MjData(model), []
    for k in range(20, 200, 20):
        for joint in map(model.joint, range(model.njnt)):
            side = "left" if joint.name.startswith("left_") else "trunk" if joint.name in ROOT else "right"
            data.qpos[joint.qposadr] = walked[f"{side}/{joint.name.removeprefix('left_')}"][k]
        mujoco.mj_fwdPosition(model, data)
        for side, muscles in zip(("right", "left"), body.muscles, strict=True):
            for i, name in zip(muscles, LEG_MUSCLES, strict=True):
                own, length = model.actuator_user[i], walked[f"{side}/{name}/length"][k]
                along = own[row.optimal] * np.sqrt(length**2 - own[row.width] ** 2)
                strain = (data.actuator_length[i] - along) / own[row.slack] - 1.0
                pull = own[row.force] * tendon_force(strain, own[row.strain])[0]
                found.append((walked[f"{side}/{name}/force"][k], pull))
    force, pull = np.transpose(found)
    assert force.max() > 1000.0 and np.abs(force - pull).max() < 50.0  # the force is of half a step before


def test_a_controller_sees_each_leg_as_it_is() -> None:
    """Lean to the plumb on a slope, moments as forces times how lengths change, loads as the floor's."""
    sets = {"timestep": "1 ms", "patient": "healthy", "worn_on": "both", "ground.slope": "5 deg"}
    body = build_body(prepared("walk-dropfoot-afo", sets))
    model, data = body.model, start(body, read_gait("natural").vector)
    with native.installed():
        _fill(body, data)
        mujoco.mj_step(model, data, nstep=300)
        mujoco.mj_forward(model, data)
        recorder, other = _Recorder(body, 3), mujoco.MjData(model)
        recorder.take(data)
        ahead, up = np.array(
            [[c := np.cos(np.radians(5.0)), 0.0, -(s := np.sin(np.radians(5.0)))], [s, 0.0, c]]
        )
        for leg, prefix in enumerate(("", "left_")):
            seen, ankle = recorder.seen(data, _Board(body.scenario, body, leg)), model.joint(f"{prefix}ankle")
            shank = data.body(f"{prefix}shank").xmat.reshape(3, 3) @ [0.0, 0.0, 1.0]
            assert seen["shank/angle"] == pytest.approx(np.arctan2(shank @ ahead, shank @ up), abs=1e-9)
            assert seen["ankle/angle"] == data.qpos[ankle.qposadr][0]
            assert seen["ankle/velocity"] == data.qvel[ankle.dofadr][0]
            moment, muscles = 0.0, body.muscles[leg]
            for way in (1.0, -1.0):  # virtual work
                other.qpos[:] = data.qpos
                other.qpos[ankle.qposadr] += way * 1e-6
                mujoco.mj_fwdPosition(model, other)
                moment += way * data.actuator_force[muscles] @ other.actuator_length[muscles] / 2e-6
            assert seen["ankle/moment/biological"] == pytest.approx(moment, rel=1e-6) and abs(moment) > 1.0
            load = seen["foot/heel_load"] + seen["foot/toe_load"]
            assert seen["ground/force_z"] == pytest.approx(load) and (load > 50.0) == (leg == 0)


def test_a_push_gives_its_impulse() -> None:
    body = body_of()
    vector = read_gait("natural").vector
    plain, pushed = (
        walk_body(body, vector, 2.0, (Push(1.0, force),))["trunk/forward"] for force in (0.0, 20.0)
    )
    assert (plain[:99] == pushed[:99]).all()
    gained = np.diff(pushed - plain)[109] / 0.01  # speed of the trunk after 0.1 s
    assert 0.3 < gained / (20.0 * 0.1 / (body.weight / GRAVITY)) < 3.0  # the legs take or add some of it


def test_a_body_of_another_size_has_its_mass() -> None:
    body = build_body(
        prepared("walk-dropfoot", {"patient.body_mass": "90 kg", "patient.body_height": "1.9 m"})
    )
    shoes = sum(body.model.body_mass[k] for k in range(body.model.nbody) if "shoe" in body.model.body(k).name)
    assert body.weight / GRAVITY - shoes == pytest.approx(90.0, abs=0.02)
    assert dataclasses.replace(body).size.heavier == pytest.approx(90.0 / 75.0)


def test_a_muscle_of_half_its_fibres_makes_half_the_heat() -> None:
    """Of quick fibres, whose heat grows with the square of a small activation."""
    powers, silent = [], dataclasses.replace(read_gait("natural").vector, gains=np.zeros((2, len(GAINS))))
    for share in (1.0, 0.5):
        body = body_of(tibialis=share)
        row = body.model.actuator_user[body.muscles[0, -1]]
        row[native.LEG_MUSCLE_ROW.slow] = row[native.LEG_MUSCLE_ROW.force] = 0.0  # no work, heat alone
        data = start(body, silent)
        with native.installed():
            mujoco.mj_forward(body.model, data)
        at = int(body.model.actuator_actadr[body.muscles[0, -1]])
        powers.append(data.act_dot[at + native.LEG_MUSCLE_ACT.energy])
    assert powers[0] > 0.0 and powers[1] == pytest.approx(0.5 * powers[0], rel=0.05)


def test_clearance_is_of_the_forefoot_not_of_the_heel() -> None:
    """A dorsiflexed foot in swing: its heel is lower than ball and toes."""
    walked = walk_body(body_of(), read_gait("natural").vector, 6.0)
    strides = strides_of(walked, "right")
    found = swing_clearance(walked, strides, "right")
    speed = np.gradient(walked["right/foot"], walked["time"])
    a, b = strides.begins[:2]
    fast = np.flatnonzero(speed[a:b] >= np.percentile(speed[a:b], 75.0)) + a
    lowest = np.minimum(walked["right/forefoot_clearance"], walked["right/toe_clearance"])[fast].min()
    assert found[0] == pytest.approx(lowest)
    assert found[0] > walked["right/clearance"][fast].min() + 1e-3  # the heel's


def test_a_controller_sees_the_switch_under_the_heel() -> None:
    """Valves by strikes of the heel alone: shut until a stride is known, then vented in stance."""
    phases = {"estimator": "foot_switch", "dorsiflexor": {"outlet": [[0.15, 0.45]]}}
    sets = {"timestep": "1 ms", "patient": "healthy", "phases": None, "controller": {"gait_phase": phases}}
    walked = walk_body(build_body(prepared("walk-dropfoot-afo", sets)), read_gait("natural").vector, 4.0)
    mass, pressed = walked["chamber/dorsiflexor/mass"], walked["right/load"] > 30.0
    second = np.flatnonzero(pressed[1:] & ~pressed[:-1])[1]  # the first is of the start
    assert np.ptp(mass[:second]) < 1e-9 and mass[-1] < 0.95 * mass[0]


def test_the_board_switches_valves_by_intervals_that_may_wrap() -> None:
    sets = {"phases.dorsiflexor.inlet": [[0.9, 0.1]], "phases.dorsiflexor.outlet": [[0.2, 0.4]]}
    body = build_body(prepared("walk-dropfoot-afo", {"timestep": "1 ms"} | sets))
    board, phases = _Board(body.scenario, body), body.scenario.phases
    assert phases is not None
    for place, inlet, outlet in ((0.95, 1.0, 0.0), (0.05, 1.0, 0.0), (0.15, 0.0, 0.0), (0.3, 0.0, 1.0)):
        coils = board._at(phases.chambers, place)
        assert (coils["dorsiflexor_inlet"], coils["dorsiflexor_outlet"]) == (inlet, outlet)
    assert set(board._at(phases.chambers, 0.5)) <= set(body.ids.valves)  # type: ignore[union-attr]


def test_a_controller_sees_how_active_the_devices_tibialis_is() -> None:
    """It fills by activity: air comes where the recorded activity is beyond 0.3 of full, and not before."""
    emg = {"column": "tibialis/activation", "full": "1.0"}
    sets = {
        "timestep": "1 ms",
        "patient": "healthy",
        "phases": None,
        "start": None,
        "controller": {"emg": emg},
    }
    walked = walk_body(build_body(prepared("walk-dropfoot-afo", sets)), read_gait("natural").vector, 3.0)
    mass, active = walked["chamber/dorsiflexor/mass"], walked["right/tibialis/activation"]
    filled, first = int(np.argmax(mass > 1.05 * mass[0])), int(np.argmax(active > 0.3))
    assert 0 < first < filled < first + 10  # activation_time of the controller, and the valve's delay


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
@pytest.mark.parametrize(("gain", "pose"), [(np.nan, 0.0), (1.0, 3.0)])
def test_a_walk_that_ends_in_no_number_says_when(gain: float, pose: float, engine) -> None:  # type: ignore[no-untyped-def]
    gait = read_gait("natural").vector
    bad = dataclasses.replace(gait, gains=gain * gait.gains, offsets=gait.offsets + pose)
    with pytest.raises(SimulationError) as error:
        walk_body(body_of(), bad, 1.0, engine=engine)
    assert 0.0 <= error.value.time < 1.0 and "nan" not in str(error.value)


def test_a_walk_of_no_time_does_not_fall() -> None:
    assert walk_body(body_of(), read_gait("natural").vector, 0.0, rows=False).fell is None
