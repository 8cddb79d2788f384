"""The subtalar hinge: its axis, its rest, its motion, and what it is refused for."""

import math
import pathlib

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sideways import Talus, moments

import afo_sim
from afo_sim import native
from afo_sim.common import GRAVITY, InputError
from afo_sim.description import Side, Subtalar, load
from afo_sim.model import Built, controls, equilibrium, get_state, muscle_names
from afo_sim.model.build import build
from afo_sim.model.inversion import axis_of
from afo_sim.simulation.simulate import simulate

STIFFNESS = 10.0  # [N·m/rad]
HINGE = {"leg.subtalar.stiffness": "10 N*m/rad", "leg.subtalar.damping": "0.2 N*m*s/rad"}
OUTSIDE = {"orthosis.muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", "-1.5 cm", "-1 cm"]}
FILLED = {"timer.dorsiflexor": {"inlet": [["0 s", "8 s"]]}, "duration": "6 s"}


def built(sets: dict[str, object]) -> Built:
    return build(load("scenario", "seated", HINGE | sets))


@pytest.mark.parametrize("side", ["right", "left"])
def test_axis_is_carried_by_the_ankle_and_the_ankles_stays_in_the_shank(side: str) -> None:
    """World axes and a point of the sole at angles of both hinges, by rotation matrices."""
    made = built({"side": side, "leg.subtalar.below_ankle": "2 cm"})
    model, ankle, subtalar = made.model, 0.3, -0.12
    data = native.scratch(model)
    data.qpos[made.index.ankle_qpos] = ankle
    data.qpos[model.joint("subtalar").qposadr[0]] = subtalar
    mujoco.mj_kinematics(model, data)
    talus = Talus(made.scenario, ankle, subtalar)
    at = data.xanchor[model.joint("ankle").id]
    np.testing.assert_allclose(data.xaxis[model.joint("ankle").id], [0.0, -1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(data.xaxis[model.joint("subtalar").id], talus.axis, atol=1e-14)
    np.testing.assert_allclose(data.xanchor[model.joint("subtalar").id] - at, talus.centre, atol=1e-14)
    ball = np.array([0.120, 0.0, -0.068])
    np.testing.assert_allclose(data.site("ball").xpos - at, talus.placed(ball), atol=1e-14)


@pytest.mark.parametrize("side", ["right", "left"])
def test_inversion_turns_the_sole_to_the_inside(side: str) -> None:
    made = built({"side": side})
    data = native.scratch(made.model)
    data.qpos[made.model.joint("subtalar").qposadr[0]] = 0.2
    mujoco.mj_kinematics(made.model, data)
    under = -data.body("foot").xmat.reshape(3, 3)[:, 2]
    inside = 1.0 if side == "right" else -1.0  # the right leg's is to the left, +y
    assert inside * under[1] > 0.1
    axis = data.xaxis[made.model.joint("subtalar").id] * inside
    assert axis[0] > 0.0 and axis[2] > 0.0 and inside * axis[1] > 0.0  # ahead, above, inside


# of opensim-org/opensim-models, gait2392_simbody.osim: subtalar_r and subtalar_l; x forward, y up, z right
GAIT2392 = {"right": (0.78717961, 0.60474746, -0.12094949), "left": (-0.78717961, -0.60474746, -0.12094949)}


@pytest.mark.parametrize("side", ["right", "left"])
def test_axis_points_as_that_of_gait2392(side: Side) -> None:
    """Its inclination and deviation, read off the right leg's axis, give both of its axes."""
    forward, up, right = GAIT2392["right"]
    angles = {"inclination": f"{math.asin(up)} rad", "deviation": f"{math.atan2(-right, forward)} rad"}
    hinge = Subtalar.model_validate(angles | {"stiffness": "1 N*m/rad", "damping": "0 N*m*s/rad"})
    ahead, above, outside = GAIT2392[side]
    np.testing.assert_allclose(axis_of(hinge, side), [ahead, -outside, above], atol=1e-7)


def gravity_moment(made: Built, ankle: float, subtalar: float) -> float:
    """Weight of all that turns with the foot about the subtalar axis, from the bodies' own places."""
    model, talus, found = made.model, Talus(made.scenario, ankle, subtalar), 0.0
    for body in range(model.nbody):
        place, parent = model.body_ipos[body].copy(), body
        while parent and model.body(parent).name != "foot":
            place += model.body_pos[parent]
            parent = int(model.body_parentid[parent])
        if parent:
            weight = np.array([0.0, 0.0, -model.body_mass[body] * GRAVITY])
            found += float(talus.axis @ np.cross(talus.placed(place) - talus.centre, weight))
    return found


@pytest.mark.parametrize("side", ["right", "left"])
def test_rest_balances_weight_and_spring(side: str) -> None:
    """Muscles hang through at rest: K β is the weight's moment, and the ankle is in balance too."""
    made = built({"side": side})
    with native.installed("native"):
        state = equilibrium(made, controls.controls(made, 1)[0])
        data = mujoco.MjData(made.model)
        mujoco.mj_setState(made.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_forward(made.model, data)
    ankle, subtalar = data.qpos[made.index.ankle_qpos], data.joint("subtalar").qpos[0]
    assert abs(subtalar) > 0.01
    assert subtalar == pytest.approx(gravity_moment(made, ankle, subtalar) / STIFFNESS, rel=1e-9)
    np.testing.assert_allclose(data.qacc, 0.0, atol=1e-8)


def test_filled_muscles_on_the_outside_evert_by_their_moment_over_the_stiffness() -> None:
    """At rest again after filling; cross products of the muscles' lines, and the weight."""
    made = built(OUTSIDE | FILLED)
    run = afo_sim.run(made.scenario)
    ankle, subtalar = run["ankle/angle"][-1], run["subtalar/angle"][-1]
    assert np.ptp(run["subtalar/angle"][-100:]) < 2e-5  # in 0.2 s: the damper has less than 2e-5 N·m
    tensions = {name: run[f"muscle/{name}/force"][-1] for name in muscle_names(made.scenario.orthosis)}
    inversion, about = moments(made.scenario, tensions, ankle, subtalar)
    assert run["subtalar/moment/orthosis"][-1] == pytest.approx(about, rel=1e-9)
    assert run["ankle/moment/inversion"][-1] == pytest.approx(inversion, rel=1e-9)
    assert subtalar < -0.02
    expected = (about + gravity_moment(made, ankle, subtalar)) / STIFFNESS
    assert subtalar == pytest.approx(expected, rel=1e-4)


def test_symmetric_muscles_about_an_axis_in_the_legs_plane_do_not_turn_it() -> None:
    """To the bit: the muscles beside each other pull alike, and all else lies in that plane."""
    run = afo_sim.run("seated", HINGE | {"leg.subtalar.deviation": "0 deg", "duration": "8 s"})
    assert run.status == "ok" and run["muscle/dorsiflexor_1/force"].max() > 10.0
    assert not run["subtalar/angle"].any()
    np.testing.assert_array_equal(run["muscle/dorsiflexor_1/force"], run["muscle/dorsiflexor_3/force"])


def test_stiff_hinge_is_no_hinge() -> None:
    """The stiffer, the nearer the ankle goes to what it does without one: in proportion to 1/K."""
    run = {
        stiffness: afo_sim.run(
            "seated", OUTSIDE | {"duration": "3 s", "timestep": "0.5 ms", "leg.subtalar": hinge(stiffness)}
        )["ankle/angle"]
        for stiffness in (100.0, 1000.0)
    }
    bare = afo_sim.run("seated", OUTSIDE | {"duration": "3 s", "timestep": "0.5 ms"})["ankle/angle"]
    near, nearer = (np.abs(run[k] - bare).max() for k in (100.0, 1000.0))
    assert nearer < 0.2 * near < 2e-3


def hinge(stiffness: float) -> dict[str, str]:
    return {"stiffness": f"{stiffness} N*m/rad", "damping": "1 N*m*s/rad"}


def test_swings_freely_as_an_independent_integrator_has_it() -> None:
    """Let go from both angles; scipy integrates the accelerations that MuJoCo gives without a step."""
    made = build(load("scenario", "seated", HINGE | {"orthosis": "none", "duration": "0.5 s", "timer": None}))
    model, dofs = made.model, 2
    start = np.array([0.2, 0.1])
    with native.installed("native"):
        data = mujoco.MjData(model)

        def rates(_: float, state: np.ndarray) -> np.ndarray:
            data.qpos[:], data.qvel[:] = state[:dofs], state[dofs:]
            mujoco.mj_forward(model, data)
            return np.concatenate([state[dofs:], data.qacc])

        exact = solve_ivp(rates, (0.0, 0.5), [*start, 0.0, 0.0], rtol=1e-10, atol=1e-12, t_eval=[0.1, 0.3])
        errors = []
        for step in (2e-3, 1e-3, 5e-4):
            own = build(made.scenario.model_copy(update={"timestep": step}))
            fresh = mujoco.MjData(own.model)
            fresh.qpos[:] = start
            mujoco.mj_forward(own.model, fresh)
            fresh.qvel[:] = -0.5 * step * fresh.qacc  # MuJoCo's velocities stand half a step before
            control = np.zeros((own.scenario.n_step, own.model.nu))
            rows = simulate(own, control, state=get_state(own.model, fresh)).rows
            at = [round(t / step) for t in (0.1, 0.3)]
            errors.append(np.abs(rows["qpos"][at] - exact.y[:dofs].T).max())
    assert np.ptp(exact.y[1]) > 0.01  # it has swung
    assert errors[0] < 2e-3 and errors[1] < 0.6 * errors[0] and errors[2] < 0.6 * errors[1]


def test_halved_steps_converge_with_muscles() -> None:
    sets = HINGE | OUTSIDE | {"duration": "1 s", "record_rate": "250 Hz"}
    runs = [afo_sim.run("seated", sets | {"timestep": f"{step} ms"}) for step in (2, 1, 0.5, 0.125)]
    for column in ("ankle/angle", "subtalar/angle"):
        off = [np.abs(run[column] - runs[-1][column]).max() for run in runs[:-1]]
        assert off[0] < math.radians(0.03) and off[1] < 0.4 * off[0] and off[2] < 0.4 * off[1]


def test_energy_closes() -> None:
    run = afo_sim.run("seated", HINGE | OUTSIDE | {"duration": "8 s"})
    assert abs(run.metrics["energy_error"]) < 1e-3  # percent of the air's turnover
    assert run.metrics["skeleton_work"] > 0.0


def test_stops_hold() -> None:
    soft = {"leg.subtalar.stiffness": "0 N*m/rad", "leg.subtalar.range": ["-3 deg", "3 deg"]}
    run = afo_sim.run("seated", HINGE | soft | OUTSIDE | {"duration": "4 s"})
    angle = np.degrees(run["subtalar/angle"])
    assert run.status == "ok" and angle.min() < -2.9
    assert np.all(np.abs(angle) < 3.5)


def test_is_welded_in_walking_and_the_moment_about_it_is_told() -> None:
    sets = HINGE | {"duration": "2 s", "record_rate": "1 kHz"}
    walk, bare = (afo_sim.run("walk-dropfoot-afo", s) for s in (sets, {k: sets[k] for k in list(sets)[2:]}))
    assert "subtalar/angle" not in walk.columns and "qpos/subtalar" not in walk.columns
    for name, values in bare.columns.items():
        np.testing.assert_array_equal(walk[name], values, err_msg=name)
    scenario = load("scenario", "walk-dropfoot-afo", sets)
    k = int(np.argmax(np.abs(walk["subtalar/moment/orthosis"])))
    tensions = {name: walk[f"muscle/{name}/force"][k] for name in muscle_names(scenario.orthosis)}
    about = moments(scenario, tensions, walk["ankle/angle"][k])[1]
    assert abs(about) > 1.0
    assert walk["subtalar/moment/orthosis"][k] == pytest.approx(about, rel=1e-5)


@pytest.mark.parametrize("unit", ["degree", "radian"])
def test_stops_are_in_the_files_own_unit_of_angle(unit: str, tmp_path: pathlib.Path) -> None:
    shipped = pathlib.Path(afo_sim.__file__).parents[1] / "models/legs/adult_75kg/leg.xml"
    text = shipped.read_text()
    if unit == "radian":
        text = text.replace('angle="degree"', 'angle="radian"').replace(
            'range="-50 30"', 'range="-0.87 0.52"'
        )
        text = text.replace('range="-28.6 60.2"', 'range="-0.5 1.05"').replace('euler="0 12 0"', "")
    (tmp_path / "leg.xml").write_text(text)
    made = built({"leg.file": str(tmp_path / "leg.xml"), "leg.subtalar.range": ["-10 deg", "20 deg"]})
    np.testing.assert_allclose(np.degrees(made.model.joint("subtalar").range), [-10.0, 20.0])


@pytest.mark.parametrize(
    ("scenario", "sets", "said"),
    [
        ("arm", HINGE, "belongs under an ankle"),
        ("seated", HINGE | {"leg.subtalar.range": ["0 deg", "0 deg"]}, "no angle to turn"),
        (
            "seated",
            HINGE | {"leg.subtalar.stiffness": "1000 N*m/rad", "timestep": "4 ms"},
            "too stiff for this time step",
        ),
        ("seated", {"leg.subtalar.stiffness": "10 N*m/rad"}, "damping"),
    ],
)
def test_what_it_is_refused_for(scenario: str, sets: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        build(load("scenario", scenario, sets))


def test_pulley_has_no_line_about_another_axis() -> None:
    pulley = {"radius": "5 cm", "direction": "positive"}
    group = {"origin": None, "insertion": None, "link_length": None, "pulley": pulley, "slack": "0 mm"}
    sets = {f"orthosis.muscle.dorsiflexor.{key}": value for key, value in group.items()}
    with pytest.raises(InputError, match="does not go with a pulley: the muscle dorsiflexor"):
        build(load("scenario", "seated", HINGE | sets))


def test_hinge_of_that_name_in_the_file_is_told(tmp_path: pathlib.Path) -> None:
    shipped = pathlib.Path(afo_sim.__file__).parents[1] / "models/legs/adult_75kg/leg.xml"
    more = '<joint name="subtalar" axis="1 0 0" range="-10 10"/><geom name="heel"'
    (tmp_path / "leg.xml").write_text(shipped.read_text().replace('<geom name="heel"', more, 1))
    with pytest.raises(InputError, match="in the leg's file already"):
        built({"leg.file": str(tmp_path / "leg.xml")})
