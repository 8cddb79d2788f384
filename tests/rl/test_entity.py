"""The orthosis as a Composer entity: a run's bits, other people's legs, sensors, lives."""

import gc
import warnings
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import pytest

pytest.importorskip("dm_control")

from dm_control import composer, mjcf
from dm_control.locomotion.walkers.cmu_humanoid import CMUHumanoid

import afo_sim as afo
from afo_sim import native
from afo_sim.common import GRAVITY, CallbackError, InputError
from afo_sim.description import load
from afo_sim.model import Built, equilibrium
from afo_sim.model import controls as schedule
from afo_sim.rl import OrthosisEntity
from afo_sim.rl.leg_entity import LegEntity

SEATED = {"duration": "5 s"}
CHAMBERS = ("dorsiflexor", "plantarflexor")
INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


@pytest.fixture(autouse=True)
def callbacks_are_given_back() -> Iterator[None]:
    yield
    gc.collect()
    assert (mujoco.get_mjcb_act_bias(), mujoco.get_mjcb_act_dyn()) == (None, None)


class Still(composer.NullTask):
    """No action: the entities' own commands are the inputs. The ankle starts at an angle [rad]."""

    def __init__(self, arena: composer.Arena, ankle: Any = None, angle: float = 0.0):
        super().__init__(arena)
        self.ankle, self.angle = ankle, angle

    def initialize_episode(self, physics: Any, random_state: Any) -> None:
        if self.ankle is not None:
            physics.bind(self.ankle).qpos = self.angle

    def before_step(self, physics: Any, action: Any, random_state: Any) -> None:
        pass


def seated_arena() -> composer.Arena:
    """dm_control's own arena with a run's gravity, and without its least mass of 10 mg for every frame."""
    arena = composer.Arena()
    compiler = arena.mjcf_model.compiler
    compiler.boundmass = compiler.boundinertia = 0.0
    arena.mjcf_model.option.gravity = [0.0, 0.0, -GRAVITY]
    return arena


def on_leg(arena: composer.Arena | None = None, **options: Any) -> tuple[Any, LegEntity, OrthosisEntity]:
    arena = arena or seated_arena()
    leg = LegEntity("adult_75kg", knee_angle=np.pi / 2)
    arena.attach(leg)
    orthosis = OrthosisEntity("s1", **options)
    orthosis.attach_to(leg)
    return arena, leg, orthosis


def environment(task: composer.Task, step: float = 0.002, control: float | None = None) -> Any:
    task.set_timesteps(control or step, step)
    return composer.Environment(task, random_state=0)


def no_action(env: Any) -> np.ndarray:
    return np.zeros(env.physics.model.nu)


def own(name: str) -> str:
    return name.rsplit("/", 1)[-1]


def same_start(built: Built, first: np.ndarray) -> Any:
    """A hook that writes a run's own start, which was solved from another guess."""
    data = mujoco.MjData(built.model)
    with native.installed():
        mujoco.mj_setState(built.model, data, equilibrium(built, first), INTEGRATION)

    def hook(physics: Any, random_state: Any) -> None:
        model, run = physics.model.ptr, built.model
        for k in range(model.nu):
            i, n = run.actuator(own(model.actuator(k).name)).id, model.actuator_actnum[k]
            if n:
                at, there = model.actuator_actadr[k], run.actuator_actadr[i]
                physics.data.act[at : at + n] = data.act[there : there + n]

    return hook


def test_two_thousand_steps_are_the_runs_bits() -> None:
    run, built = afo.run("seated", SEATED), afo.build("seated", SEATED)
    control, valves = schedule.controls(built), built.index.valves
    arena, leg, orthosis = on_leg()
    env = environment(Still(arena, leg.ankle, run["ankle/angle"][0]))
    env.add_extra_hook("initialize_episode", same_start(built, control[0]))
    env.reset()
    for k in range(2000):
        assert env.physics.bind(leg.ankle).qpos.item() == run["ankle/angle"][k], k
        orthosis.set_valves(
            **{c: (control[k, valves[f"{c}_inlet"]], control[k, valves[f"{c}_outlet"]]) for c in CHAMBERS}
        )
        env.step(no_action(env))
    env.close()


def test_without_the_runs_own_start_it_agrees_to_the_solvers_tolerance() -> None:
    run = afo.run("seated", SEATED)
    arena, leg, orthosis = on_leg()
    env = environment(Still(arena, leg.ankle, run["ankle/angle"][0]))
    env.reset()
    orthosis.set_valves(dorsiflexor="inlet", plantarflexor="outlet")
    worst = 0.0
    for k in range(1900):  # before the timer's change at 4 s
        worst = max(worst, abs(env.physics.bind(leg.ankle).qpos.item() - run["ankle/angle"][k]))
        if k == 1000:
            for read, column in (
                (orthosis.pressure, "chamber/dorsiflexor/pressure"),
                (orthosis.air_mass, "chamber/dorsiflexor/mass"),
                (orthosis.force, "muscle/dorsiflexor_1/force"),
                (orthosis.contraction, "muscle/dorsiflexor_1/contraction"),
                (orthosis.cuff_force, "cuff/shank/force"),
                (orthosis.ankle_angle, "ankle/angle"),
            ):
                assert read(env.physics)[0] == pytest.approx(run[column][k], rel=1e-9), column
        env.step(no_action(env))
    assert worst < 1e-12
    env.close()


def test_every_compiled_number_is_the_runs() -> None:
    model = afo.build("seated").model
    arena, _, orthosis = on_leg()
    env = environment(Still(arena))
    found = env.physics.model.ptr
    names = {
        "body": ("body_mass", "body_ipos", "body_iquat", "body_inertia", "body_invweight0"),
        "site": ("site_pos", "site_quat"),
        "tendon": ("tendon_length0",),
    }
    for kind, arrays in names.items():
        count = getattr(found, {"body": "nbody", "site": "nsite", "tendon": "ntendon"}[kind])
        ids = {own(getattr(found, kind)(k).name): k for k in range(1 if kind == "body" else 0, count)}
        for k in range(1 if kind == "body" else 0, getattr(model, f"n{kind}")):
            name = getattr(model, kind)(k).name
            for array in arrays if name in ids else ():
                assert np.array_equal(getattr(model, array)[k], getattr(found, array)[ids[name]]), (
                    name,
                    array,
                )
    assert found.dof_M0 == pytest.approx(model.dof_M0, rel=0.0)
    env.close()
    orthosis.close()


def test_a_path_over_a_roller_is_as_long_as_in_a_run() -> None:
    built = afo.build("seated", {"orthosis": "guided"})
    arena, leg = seated_arena(), LegEntity()
    arena.attach(leg)
    OrthosisEntity(built.scenario.orthosis).attach_to(leg)
    env = environment(Still(arena))
    found, data = env.physics.model.ptr, mujoco.MjData(built.model)
    for angle in (-0.3, 0.0, 0.2):
        data.qpos[built.index.ankle_qpos] = angle
        mujoco.mj_fwdPosition(built.model, data)
        env.physics.bind(leg.ankle).qpos = angle
        mujoco.mj_fwdPosition(found, env.physics.data.ptr)
        for k in range(found.ntendon):
            run = built.model.tendon(own(found.tendon(k).name)).id
            assert env.physics.data.ten_length[k] == data.ten_length[run]
    assert built.model.nwrap > 2 * built.model.ntendon  # the roller is there
    env.close()


def test_each_episode_starts_with_ambient_air_and_shut_valves() -> None:
    arena, _, orthosis = on_leg()
    env = environment(Still(arena))
    env.reset()
    mass = orthosis.air_mass(env.physics)
    orthosis.set_valves(dorsiflexor="inlet")
    for _ in range(300):
        env.step(no_action(env))
    assert orthosis.pressure(env.physics)[0] > 5e4
    env.reset()
    assert orthosis.pressure(env.physics) == pytest.approx([0.0, 0.0], abs=1e-3)
    assert orthosis.air_mass(env.physics) == pytest.approx(mass, rel=1e-9)
    for _ in range(100):
        env.step(no_action(env))
    assert orthosis.air_mass(env.physics) == pytest.approx(mass, rel=1e-9)  # shut
    env.close()


@pytest.mark.parametrize("padding", list(composer.ObservationPadding))
def test_delay_and_corruptor_are_dm_controls(padding: Any) -> None:
    seen: dict[str, list[np.ndarray]] = {}
    delay, bias = 7, 125.0
    for kind, options in (
        ("plain", {}),
        ("delayed", {"delay": delay}),
        ("corrupted", {"corruptor": lambda value, random_state: value + bias}),
        ("buffered", {"buffer_size": 5, "aggregator": "mean"}),
    ):
        arena, _, orthosis = on_leg(observable_options={"pressure": {"enabled": True, **options}})
        task = Still(arena)
        task.set_timesteps(0.002, 0.002)
        env = composer.Environment(task, random_state=0, delayed_observation_padding=padding)
        key = orthosis.mjcf_model.full_identifier + "pressure"
        seen[kind] = [env.reset().observation[key]]
        orthosis.set_valves(dorsiflexor="inlet")
        for _ in range(100):
            seen[kind].append(env.step(no_action(env)).observation[key])
        env.close()
    plain = np.array(seen["plain"])[:, 0]
    assert plain[-1, 0] > 1e4
    assert np.array_equal(np.array(seen["delayed"])[delay:, 0], plain[:-delay])
    assert np.array_equal(np.array(seen["corrupted"])[:, 0], plain + bias)
    means = np.array([plain[k - 4 : k + 1].mean(axis=0) for k in range(4, 101)])
    assert np.allclose(np.array(seen["buffered"])[4:], means, rtol=1e-12)


def test_all_observables_are_there_in_order() -> None:
    arena, _, orthosis = on_leg()
    orthosis.observables.enable_all()
    env = environment(Still(arena))
    found = {own(name): value[0] for name, value in env.reset().observation.items()}
    assert {name: value.shape for name, value in found.items()} == {
        "pressure": (2,), "air_mass": (2,), "force": (5,), "contraction": (5,), "cuff_force": (2,),
        "ankle_angle": (1,),
    }  # fmt: skip
    assert orthosis.muscles[:3] == ("dorsiflexor_1", "dorsiflexor_2", "dorsiflexor_3")
    env.close()


def walker_on(arena: composer.Arena) -> CMUHumanoid:
    walker = CMUHumanoid()
    arena.attach(walker).pos = [0.0, 0.0, 1.5]
    arena.mjcf_model.option.flag.contact = "disable"
    return walker


def test_on_another_programs_humanoid_it_lifts_the_foot() -> None:
    angle = {}
    for filled in CHAMBERS:
        arena = composer.Arena()
        walker = walker_on(arena)
        orthosis = OrthosisEntity("s1")
        orthosis.attach_to(walker, shank="rtibia", foot="rfoot", ankle="rfootrx")
        assert orthosis.found is not None and orthosis.found.side == "right"
        assert len(walker.actuators) == 56  # its own motors only
        env = environment(Still(arena), 0.001, 0.05)
        env.reset()
        orthosis.set_valves(**{c: "inlet" if c == filled else "outlet" for c in CHAMBERS})
        for _ in range(60):
            env.step(no_action(env))
        angle[filled] = orthosis.ankle_angle(env.physics)[0]
        foot = env.physics.bind(walker.mjcf_model.find("joint", "rfootrx")).qpos.item()
        assert foot * orthosis.found.sign == pytest.approx(angle[filled])
        pulls = orthosis.force(env.physics)
        assert (pulls[:3].min() > 5.0) == (filled == "dorsiflexor")
        # what the cuff carries is the pull of all muscles
        assert orthosis.cuff_force(env.physics)[0] == pytest.approx(pulls.sum(), rel=1e-6)
        env.close()
    assert angle["dorsiflexor"] > angle["plantarflexor"] + np.radians(8.0)


def test_parallel_muscles_differ_where_the_foot_turns_about_two_hinges() -> None:
    """The humanoid's foot turns about rfootrz too: then each muscle has the tension of its own path."""
    arena = composer.Arena()
    walker = walker_on(arena)
    orthosis = OrthosisEntity("s1")
    orthosis.attach_to(walker, shank="rtibia", foot="rfoot", ankle="rfootrx")
    env = environment(Still(arena), 0.001, 0.05)
    env.reset()
    physics = env.physics
    physics.bind(walker.mjcf_model.find("joint", "rfootrz")).qpos = 0.4
    native.fill_chambers(physics.model.ptr, physics.data.ptr, 4e5)
    physics.forward()
    muscles = [physics.model.name2id(f"walker/orthosis/dorsiflexor_{k}", "actuator") for k in (1, 2, 3)]
    length, force = physics.data.actuator_length[muscles], orthosis.force(physics)[:3]
    assert (np.argsort(length) == np.argsort(force)).all()
    assert np.ptp(force) > 0.2
    env.close()


class FootOfTwo(composer.Entity):
    """A leg whose ankle turns a light talus, and the calcaneus below it by a hinge of its own."""

    def _build(self) -> None:
        self._model = mjcf.from_xml_string(
            """<mujoco model="leg"><worldbody><body name="tibia" pos="0 0 1">
            <inertial pos="0 0 .2" mass="3" diaginertia=".05 .05 .005"/>
            <geom type="capsule" fromto="0 0 .02 0 0 .4" size=".02" mass="0"/>
            <body name="talus"><inertial pos="0 0 0" mass=".1" diaginertia=".001 .001 .001"/>
            <joint name="ankle" axis="0 -1 0" range="-50 30"/>
            <body name="calcaneus" pos="-.05 0 -.03">
            <inertial pos=".1 0 0" mass="1" diaginertia=".002 .004 .004"/>
            <joint name="subtalar" axis="1 0.3 0.6" range="-20 20"/>
            <geom type="box" pos=".08 0 -.01" size=".12 .04 .02" mass="0"/>
            </body></body></body></worldbody></mujoco>"""
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        return self._model


@pytest.mark.parametrize("named", [None, "calcaneus", "talus"])
def test_the_plate_is_on_the_named_foot_or_the_heaviest(named: str | None) -> None:
    leg, orthosis = FootOfTwo(), OrthosisEntity("s1")
    carrier = named or "calcaneus"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        orthosis.attach_to(leg, shank="tibia", foot=named, ankle="ankle", side="right")
    assert any("the plate is on 'calcaneus'" in str(t.message) for t in told) == (carrier == "calcaneus")
    arena = composer.Arena()
    arena.attach(leg)
    model = mujoco.MjModel.from_xml_string(arena.mjcf_model.to_xml_string(), arena.mjcf_model.get_assets())
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    data.qpos[model.joint("leg/subtalar").qposadr[0]] = 0.2
    before = data.ten_length.copy()
    mujoco.mj_fwdPosition(model, data)
    assert (np.ptp(data.ten_length - before) > 1e-3) == (carrier == "calcaneus")


def test_two_legs_of_one_walker_pull_alike() -> None:
    arena = composer.Arena()
    walker = walker_on(arena)
    both = {side: OrthosisEntity("s1", name=f"orthosis_{side}") for side in ("right", "left")}
    for side, orthosis in both.items():
        letter = side[0]
        orthosis.attach_to(walker, shank=f"{letter}tibia", foot=f"{letter}foot", ankle=f"{letter}footrx")
    env = environment(Still(arena), 0.001, 0.05)
    env.reset()
    both["right"].set_valves(dorsiflexor="inlet")
    for _ in range(20):
        env.step(no_action(env))
    assert both["right"].pressure(env.physics)[0] > 1e5
    assert abs(both["left"].pressure(env.physics)[0]) < 2e3  # shut
    both["left"].set_valves(dorsiflexor="inlet")
    for _ in range(40):
        env.step(no_action(env))
    right, left = (both[side].pressure(env.physics)[0] for side in ("right", "left"))
    assert right > left > 1e5
    env.close()


def test_two_devices_of_one_arena_need_their_numbers_side_by_side() -> None:
    arena, made = seated_arena(), []
    for _ in range(2):  # orthoses on legs that no arena holds yet: PyMJCF keeps one leg's count for both
        leg, orthosis = LegEntity(), OrthosisEntity("s1")
        orthosis.attach_to(leg)
        arena.attach(leg)
    with pytest.raises(InputError, match="legs to the arena first"):
        environment(Still(arena))
    arena = seated_arena()
    for pressure in (2e5, 4e5):
        made.append(on_leg(arena, supply_pressure=pressure))
    env = environment(Still(arena))
    env.reset()
    for _, _, orthosis in made:
        orthosis.set_valves(dorsiflexor="inlet", plantarflexor="outlet")
    for _ in range(1800):
        env.step(no_action(env))
    found = [orthosis.pressure(env.physics)[0] for _, _, orthosis in made]
    env.close()
    # each as it is alone
    for pressure, together in zip((2e5, 4e5), found, strict=True):
        run = afo.run("seated", {"duration": "4 s", "supply.pressure": f"{pressure} Pa"})
        assert together == pytest.approx(run["chamber/dorsiflexor/pressure"][1800], rel=1e-3)


def test_an_orthosis_too_long_for_a_leg_is_told() -> None:
    high = load(
        "orthosis",
        "s1",
        {
            "muscle.dorsiflexor.origin.from_joint": ["6 cm", "0 cm", "60 cm"],
            "muscle.dorsiflexor.link_length": "41.2 cm",
        },
    )
    with pytest.warns(UserWarning, match=r"60 cm above the ankle.*41 cm long"):
        OrthosisEntity(high).attach_to(CMUHumanoid(), shank="rtibia", foot="rfoot", ankle="rfootrx")


def test_two_environments_at_once() -> None:
    made = [on_leg() for _ in range(2)]
    first = environment(Still(made[0][0]))
    first.reset()
    second = environment(Still(made[1][0]))
    second.reset()
    for _, _, orthosis in made:
        orthosis.set_valves(dorsiflexor="inlet")
    for env in (first, second):
        for _ in range(200):
            env.step(no_action(env))
    pressures = [
        orthosis.pressure(e.physics)[0] for (_, _, orthosis), e in zip(made, (first, second), strict=True)
    ]
    assert pressures[0] == pressures[1] > 3e4
    first.close()
    second.step(no_action(second))
    assert made[1][2].pressure(second.physics)[0] > pressures[1]
    second.close()


def test_closing_gives_the_callbacks_back_and_refuses_to_go_on() -> None:
    arena, leg, orthosis = on_leg()
    env = environment(Still(arena))
    env.reset()
    assert mujoco.get_mjcb_act_bias() is not None
    orthosis.close()
    orthosis.close()
    with pytest.raises(CallbackError, match="closed"):
        env.step(no_action(env))
    with pytest.raises(CallbackError, match="closed"):
        orthosis.pressure(env.physics)
    leg.close()
    assert mujoco.get_mjcb_act_bias() is None
    env.reset()  # compiled anew: held again
    env.step(no_action(env))
    env.close()
    assert mujoco.get_mjcb_act_bias() is None


def test_a_replaced_callback_is_told() -> None:
    arena, _, _ = on_leg()
    env = environment(Still(arena))
    env.reset()
    mujoco.set_mjcb_act_dyn(None)
    with pytest.raises(CallbackError, match="replaced"):
        env.step(no_action(env))
    env.close()


def test_tissue_alone_turns_the_relaxed_ankle_as_in_a_run() -> None:
    rest = {}
    for tissue in (True, False):
        arena = seated_arena()
        leg = LegEntity("adult_75kg", knee_angle=np.pi / 2, tissue=tissue)
        arena.attach(leg)
        env = environment(Still(arena))
        env.reset()
        for _ in range(3000):
            env.step(no_action(env))
        rest[tissue] = env.physics.bind(leg.ankle).qpos.item()
        env.close()
    run = afo.run("seated", {"duration": "0.1 s", "orthosis": "none", "timer": {"period": "1 s"}})
    assert rest[True] == pytest.approx(run["ankle/angle"][0], abs=1e-6)
    assert rest[False] < np.radians(-40.0)  # a foot on a bare hinge hangs down


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_another_integrator_is_refused(integrator: str) -> None:
    arena = composer.Arena()
    leg = LegEntity()
    arena.attach(leg)
    arena.mjcf_model.option.integrator = integrator
    with pytest.raises(InputError, match='integrator = "implicitfast"'):
        OrthosisEntity("s1").attach_to(leg)
    arena.mjcf_model.option.integrator = "implicitfast"
    OrthosisEntity("s1").attach_to(leg)
    arena.mjcf_model.option.integrator = integrator
    with pytest.raises(InputError, match=f"{integrator.upper()}.*implicitfast"):
        environment(Still(arena))


def test_too_long_a_step_is_refused() -> None:
    arena, _, _ = on_leg()
    with pytest.raises(InputError, match="timestep"):
        environment(Still(arena), 0.1)


def test_what_cannot_be_attached_is_told() -> None:
    arena = composer.Arena()
    walker = walker_on(arena)
    orthosis = OrthosisEntity("s1")
    wrongs: list[dict[str, Any]] = [
        {"shank": "rtibi"},
        {"shank": "rtibia", "foot": "rfot"},
        {"ankle": "rfootrq"},
    ]
    for wrong in wrongs:
        with pytest.raises(InputError):
            orthosis.attach_to(walker, **wrong)
    orthosis.attach_to(walker, shank="rtibia", foot="rfoot", ankle="rfootrx")
    with pytest.raises(InputError, match="attached already"):
        orthosis.attach_to(walker, shank="ltibia", foot="lfoot", ankle="lfootrx")
    with pytest.raises(InputError, match="no such chamber"):
        orthosis.set_valves(dorsiflexo="inlet")
    alone = composer.Arena()
    alone.attach(OrthosisEntity("s1"))
    alone.mjcf_model.option.integrator = "implicitfast"
    alone.mjcf_model.size.nuserdata = 100
    with pytest.raises(InputError, match="attached to no leg"):
        environment(Still(alone))


def test_elements_say_the_leg_as_names_do() -> None:
    found = []
    for as_elements in (False, True):
        walker = CMUHumanoid()
        names: dict[str, Any] = {"shank": "ltibia", "foot": "lfoot", "ankle": "lfootrx"}
        if as_elements:
            kinds = {"shank": "body", "foot": "body", "ankle": "joint"}
            names = {key: walker.mjcf_model.find(kinds[key], name) for key, name in names.items()}
        orthosis = OrthosisEntity("s1")
        orthosis.attach_to(walker, **names)
        assert orthosis.found is not None
        found.append(orthosis.found)
    assert found[0].side == found[1].side == "left"
    assert np.array_equal(found[0].axes, found[1].axes)


def test_the_left_orthosis_is_the_right_ones_mirror_image() -> None:
    """An orthosis with its front muscles 2 cm to the left, on a humanoid whose legs are alike to 1 cm."""
    lateral = {
        "muscle.dorsiflexor.origin.from_joint": ["6 cm", "2 cm", "30 cm"],
        "muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", "2 cm", "-1 cm"],
    }
    places = {}
    for side in ("right", "left"):
        walker = CMUHumanoid()
        orthosis = OrthosisEntity(load("orthosis", "s1", lateral))
        orthosis.attach_to(walker, shank=f"{side[0]}tibia", foot=f"{side[0]}foot", ankle=f"{side[0]}footrx")
        physics = mjcf.Physics.from_mjcf_model(walker.mjcf_model)
        assert orthosis.found is not None
        front = [point.site for point in orthosis.mjcf_model.find("tendon", "dorsiflexor_2").site]
        offset = [physics.bind(site).xpos - orthosis.found.centre for site in front]
        places[side] = np.array(offset) @ orthosis.found.axes  # forward, left, up
    assert places["right"] == pytest.approx(np.array([[0.06, 0.02, 0.30], [0.065, 0.02, -0.01]]), abs=1e-9)
    assert places["left"] == pytest.approx(places["right"] * [1.0, -1.0, 1.0], abs=1e-9)


def test_detached_nothing_is_left_of_it() -> None:
    walker = CMUHumanoid()
    bodies = len(walker.mjcf_model.find_all("body"))
    orthosis = OrthosisEntity("s1")
    orthosis.attach_to(walker, shank="rtibia", foot="rfoot", ankle="rfootrx")
    orthosis.detach()
    assert len(walker.mjcf_model.find_all("body")) == bodies
    assert not [a for a in walker.mjcf_model.find_all("actuator") if "chamber" in a.name]
