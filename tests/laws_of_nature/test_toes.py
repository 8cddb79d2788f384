"""The program's foot with toes, in a shoe and under an orthosis, against separate differential equations."""

import math

import mujoco
import numpy as np
import pytest
from campaign import NIGHTLY
from laws_of_nature.own_length_case import foot_of, size_of, toes_of
from laws_of_nature.toe_case import (
    Compared,
    Motion,
    compared,
    from_the_start,
    healthy_angle,
    heights,
    needed_moment,
    sole_of,
)

import afo_sim
from afo_sim import native

# Reached at 1 ms: 0.004° of the ankle, 0.03° of the toes, 0.03 mm; with toes of 8 N·m/rad twice that. All go
# with the time step.
ANGLE, EXTENSION, HEIGHT = 0.02, 0.1, 0.1e-3  # [deg], [deg], [m]
PLATE = {"heel_stack": "12 mm", "ball_stack": "6 mm", "toe_spring": "8 mm", "tip_ahead": "5 mm"}
TRAINER = {"shoe": "trainer"}
WALKED = {"gait.settled": "walked", "ground.mode": "recorded"}
SMALL = {"patient.body_mass": "40 kg", "patient.body_height": "1.45 m"}
TIGHT = {
    "patient.passive_scale": 2.0,
    "patient.passive_offset": "-15 deg",
    "patient.spasticity": "3 N*m*s/rad",
}
WALKS: dict[str, tuple[str, dict[str, object], int]] = {
    "barefoot": ("walk-dropfoot", {}, 5),
    "shod": ("walk-dropfoot", TRAINER, 5),
    "soft toes": ("walk-dropfoot", {"leg.toes.stiffness": "8 N*m/rad", "timestep": "0.5 ms"}, 5),
    "stiff toes": ("walk-dropfoot", {"leg.toes.stiffness": "100 N*m/rad"}, 5),
    "less extended": ("walk-dropfoot", {"leg.toes.swing_extension": "6 deg"}, 5),
    "more extended": ("walk-dropfoot", TRAINER | {"leg.toes.swing_extension": "16 deg"}, 5),
    "small": ("walk-dropfoot", SMALL | TRAINER, 5),
    "small and tight": ("walk-dropfoot", SMALL | TIGHT, 5),
    "braced": ("walk-dropfoot-afo", {}, 10),
    "braced, short links": ("walk-dropfoot-afo-short", {}, 10),
    "braced and soled": ("walk-dropfoot-afo", {"orthosis.outsole": PLATE}, 10),
    "braced and shod": ("walk-dropfoot-afo-short", TRAINER, 10),
}


# In the suite a case of each kind: of foot, toes, shoe, outsole, orthosis and person.
FEW = ("barefoot", "soft toes", "small and tight", "braced and soled")
SLOW = [
    pytest.param(name, marks=[pytest.mark.slow] if name != "barefoot" else [])
    for name in (WALKS if NIGHTLY else FEW)
]


@pytest.fixture(scope="module", params=SLOW)
def walk(request: pytest.FixtureRequest) -> Compared:
    return compared(*WALKS[request.param])


@pytest.mark.slow
def test_ankle_and_toes_turn_as_solved(walk: Compared) -> None:
    assert np.degrees(walk.found.angle) == pytest.approx(np.degrees(walk["ankle/angle"]), abs=ANGLE)
    extension = np.degrees(walk.found.extension)
    assert np.ptp(extension) > 20.0
    assert extension == pytest.approx(np.degrees(walk["toe/extension"]), abs=EXTENSION)


@pytest.mark.slow
def test_the_outsole_is_where_it_is_solved(walk: Compared) -> None:
    for name in ("heel", "ball", "toe", "sole"):
        assert walk.heights[name] == pytest.approx(walk[f"{name}/height"], abs=HEIGHT)
    swing = walk["gait/phase"] > 0.68
    clearance = walk.heights["sole"][swing].min()
    assert clearance == pytest.approx(walk["sole/height"][swing].min(), abs=HEIGHT)


def test_the_outsole_stands_flat(walk: Compared) -> None:
    """The recorded foot is flat in stance, on whatever it stands; the ankle is higher by what is under it."""
    flat = (walk["gait/phase"] > 0.2) & (walk["gait/phase"] < 0.3)
    sole = sole_of(walk.built)
    assert walk.built.foot.level == pytest.approx(sole.level, abs=1e-12)
    assert walk.built.foot.ankle_height == pytest.approx(sole.ankle_height, abs=1e-12)
    assert np.abs(walk["gait/sole_height"][flat]).max() < 0.006
    assert np.ptp(walk["gait/ankle_angle"] - healthy_angle(walk.built, walk.found.time)) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("sets", [{}, TRAINER], ids=["barefoot", "shod"])
def test_two_strides_from_the_start(sets: dict[str, object]) -> None:
    """No state is taken from the run."""
    described = afo_sim.load("scenario", "walk-dropfoot").set(sets | {"duration": "2.4 s", **WALKED})
    built, run = afo_sim.build(described), afo_sim.run(described)
    found = from_the_start(built, run["time"])
    assert np.degrees(found.angle) == pytest.approx(np.degrees(run["ankle/angle"]), abs=ANGLE)
    assert np.degrees(found.extension) == pytest.approx(np.degrees(run["toe/extension"]), abs=EXTENSION)
    lowest = heights(built, run["time"], found.angle, found.extension)["sole"]
    assert lowest == pytest.approx(run["sole/height"], abs=HEIGHT)


@pytest.mark.slow
@pytest.mark.parametrize("sets", [{}, TRAINER], ids=["barefoot", "shod"])
def test_a_healthy_foot_walks_as_recorded(sets: dict[str, object]) -> None:
    """Inverse dynamics by momentum, and the separate equations forward again."""
    walk = compared("walk-healthy", sets, 4)
    built, time = walk.built, walk.found.time
    inside = slice(5, -5)  # the ground's force jumps at heel strike
    needed = needed_moment(built, time)[inside]
    assert needed.min() < -1.2 * built.body_mass  # published: 1.3 N·m/kg
    assert needed == pytest.approx(walk["gait/ankle_moment"][inside], abs=2e-3)
    recorded = np.degrees(healthy_angle(built, time))
    assert np.degrees(walk.found.angle) == pytest.approx(recorded, abs=0.1)
    assert np.degrees(walk["ankle/angle"]) == pytest.approx(recorded, abs=0.1)


def test_moments_turn_hindfoot_and_toes() -> None:
    """Moments from outside against the momenta of both bodies, from where they are, row by row."""
    errors = []
    for step in (0.2, 0.1):
        fine = {"timestep": f"{step} ms", "record_rate": f"{1.0 / step} kHz", "duration": "1.3 s", **WALKED}
        described = afo_sim.load("scenario", "walk-dropfoot").set(fine)
        built, run = afo_sim.build(described), afo_sim.run(described)
        assert len(run["time"]) == described.n_step
        parts = [n for n in run.columns if n.startswith("ankle/moment/")]
        total = sum(run[name] for name in parts)
        assert np.abs(total - built.foot.inertia * run["ankle/acceleration"]).max() < 1e-9
        assert np.abs(run["ankle/moment/toes"]).max() > 0.05
        own = ("ankle/moment/gravity", "ankle/moment/frame", "ankle/moment/toes")
        outside = sum(run[name] for name in parts if name not in own)
        momentum = Motion.of(run).turned_by(built, run["time"][1] - run["time"][0])
        errors.append(float(np.sqrt(np.mean((momentum - outside[1:-1]) ** 2))))
    assert errors[1] < 1e-3 * np.abs(outside).max()
    assert errors[1] < 0.6 * errors[0]


@pytest.mark.parametrize("sets", [{}, TRAINER], ids=["barefoot", "shod"])
def test_toes_without_damping_ring(sets: dict[str, object]) -> None:
    """On a held foot, at √(K/I) of the toes about their hinge, and on."""
    undamped = {"leg.toes.damping": "0 N*m*s/rad", "timestep": "0.05 ms", "duration": "0.1 s"}
    undamped["ground.mode"] = "recorded"
    built = afo_sim.build(afo_sim.load("scenario", "walk-healthy").set(sets | undamped))
    model, toes = built.model, toes_of(built)
    about = toes.inertia + toes.mass * (toes.centre[0] ** 2 + toes.centre[1] ** 2)
    rate = math.sqrt((toes.stiffness + toes.sole_stiffness) / about)
    model.dof_armature[model.joint("ankle").dofadr[0]] = 1e9
    model.opt.gravity[:] = 0.0
    at, step, extension = int(model.joint("toe").qposadr[0]), model.opt.timestep, []
    with native.installed():
        data = native.scratch(model)
        data.qpos[at] = 0.1
        for _ in range(4000):
            mujoco.mj_step(model, data)
            extension.append(data.qpos[at])
    time = step * np.arange(1.5, 4001.0)  # velocities stand half a step before positions
    assert np.array(extension) == pytest.approx(0.1 * np.cos(rate * time), abs=1e-3)
    assert np.abs(extension[-500:]).max() == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("sets", [{}, SMALL], ids=["adult", "small"])
def test_a_shoe_is_mass_on_the_hindfoot(sets: dict[str, object]) -> None:
    """Mass, centre and inertia of the shoe as it is described, on those of the bare foot; toes as bare."""
    bare, shod = (
        afo_sim.build(afo_sim.load("scenario", "walk-dropfoot").set(s | sets)) for s in ({}, TRAINER)
    )
    shoe, foot, (heavier, taller) = shod.scenario.shoe, foot_of(bare), size_of(bare)
    found, worn, own = foot_of(shod), heavier * shoe.mass, heavier * taller**2 * shoe.inertia
    x, z = (taller * at for at in shoe.centre)
    mass = foot.mass + worn
    assert found.mass == pytest.approx(mass)
    centre = [(foot.mass * c + worn * s) / mass for c, s in zip(foot.centre, (x, z), strict=True)]
    assert found.centre == pytest.approx(centre)
    assert found.inertia == pytest.approx(foot.inertia + own + worn * (x**2 + z**2))
    assert found.toes.mass == foot.toes.mass
    assert found.toes.sole_stiffness == pytest.approx(shoe.toe_stiffness * heavier * taller)


@pytest.mark.slow
@pytest.mark.parametrize("sets", [{}, TRAINER], ids=["barefoot", "shod"])
def test_heights_of_otherwise_extended_toes_are_those_of_their_own_run(sets: dict[str, object]) -> None:
    """The columns leave out that the ankle feels the toes' weight elsewhere: a fifth of a millimetre."""
    walk = afo_sim.load("scenario", "walk-dropfoot").set(sets)
    run, swing = afo_sim.run(walk), "leg.toes.swing_extension"
    for column, limit in zip(("less", "more"), walk.leg.toes.swing_extension_range, strict=True):
        other = afo_sim.run(walk.set({swing: f"{math.degrees(limit)} deg"}))["sole/height_without_floor"]
        # where clearance is read; before, the toes leave the floor at other extensions
        swing_rows = (run["gait/phase"] > 0.75) & (run["gait/phase"] < 0.95)
        assert np.abs(other - run["sole/height_without_floor"])[swing_rows].max() > 3e-3
        extended = run[f"sole/height_{column}_extended"]
        assert other[swing_rows] == pytest.approx(extended[swing_rows], abs=0.3e-3)
