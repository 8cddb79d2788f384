"""Columns of the last step with every address looked up once: the formulas of `simulation/columns.py`, fast.

What follows from the recorded walking alone is computed once for every step of the run.
One instant takes a tenth of the time that the formulas take; a test holds the two together.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, GRAVITY, InputError
from afo_sim.metrics import HEEL_RISE, loaded
from afo_sim.model import ACTIVE, GROUND, JOINTS, SPASTIC, STIFFNESS, Built
from afo_sim.rl.environments.task import Reader, Sample
from afo_sim.simulation import LOWEST, NARROWEST

FIELDS = ("actuator_force", "qfrc_actuator", "userdata")  # of MjData that readers need beside the state


def readers(built: Built) -> Mapping[str, Reader]:
    """Readers by name: columns of a run, "swing" and "push_off" (1 there, else 0) of walking."""
    index, model = built.index, built.model
    found: dict[str, Reader] = {
        "ankle/angle": _place("qpos", index.ankle_qpos),
        "ankle/velocity": _place("qvel", index.ankle_dof),
    }
    for chamber, actuator in index.chambers.items():
        # read from arrays of addresses, the air's numbers are their own addresses
        at = native.read_air(model, np.arange(model.na), np.arange(model.nuserdata), actuator)
        found[f"chamber/{chamber}/pressure"] = _gauge(int(at.absolute_pressure))
        found[f"chamber/{chamber}/mass"] = _place("act", int(at.mass))
    return found if built.walk is None else found | _walking(built)


def _place(field: str, at: int) -> Reader:
    return lambda s: s.rows[field][at]


def _gauge(at: int) -> Reader:
    return lambda s: s.rows["userdata"][at] - AMBIENT_PRESSURE


def _table(values: np.ndarray) -> Reader:
    return lambda s: values[s.step]


def _walking(built: Built) -> dict[str, Reader]:
    if built.contact is not None:
        problem = "meets the floor: the tasks walk on the recorded ground"
        raise InputError(problem, field="ground.mode", value="contact", allowed="recorded")
    walk, model = built.walk, built.model
    assert walk is not None
    steps = slice(1, 1 + built.scenario.n_step)  # instants begin a step before the run
    phase = walk.phase[steps]
    _, upward, ahead = walk.cycle.ground(phase)
    pressing = built.body_mass * GRAVITY * upward
    standing = loaded(pressing, built.body_mass)
    _, z, shank = (model.joint(name) for name in JOINTS)
    toes = built.scenario.leg.toes
    return {
        "gait/phase": _table(phase % 1.0),
        "swing": _table(np.where(standing, 0.0, 1.0)),
        "push_off": _table(np.where(standing & (phase % 1.0 >= HEEL_RISE), 1.0, 0.0)),
        "ground/force/z": _table(pressing),
        "ground/ahead": _table(ahead),
        "shank/angle": _place("qpos", int(shank.qposadr[0])),
        "shank/velocity": _place("qvel", int(shank.dofadr[0])),
        "ankle/position/z": _place("qpos", int(z.qposadr[0])),
        "extension": _none if toes is None else _place("qpos", int(model.joint(toes.joint).qposadr[0])),
        "sole": _sole(built),
        "toe/height": _toe_height,
        "foot/toe_load": _toe_load,
        "foot/heel_load": lambda s: s["ground/force/z"] - s["foot/toe_load"],
        "ankle/moment/orthosis": _orthosis_moment(built),
    }


def _none(_: Sample) -> float:
    return 0.0


def _sole(built: Built) -> Reader:
    """Places forward of heel and ball, heights of pulp and tip, from the ankle [m]: `Foot.outsole`, in part.

    A point (x, z) of the foot is at x cos φ − z sin φ, x sin φ + z cos φ at a pitch φ; the toes turn further.
    """
    foot = built.foot
    assert foot is not None
    (heel_x, heel_z), (ball_x, ball_z) = foot.points["heel"], foot.points["ball"]
    hinge_x, hinge_z = (0.0, 0.0) if foot.toes is None else foot.toes.hinge
    (pulp_x, pulp_z), (tip_x, tip_z) = (
        (foot.points[name][0] - hinge_x, foot.points[name][1] - hinge_z) for name in LOWEST["toe"]
    )

    def sole(s: Sample) -> Any:
        pitch = s["ankle/angle"] - s["shank/angle"]
        cosine, sine = np.cos(pitch), np.sin(pitch)
        toe = pitch + s["extension"]
        toe_cosine, toe_sine = np.cos(toe), np.sin(toe)
        hinge = hinge_x * sine + hinge_z * cosine
        return (
            heel_x * cosine - heel_z * sine,
            ball_x * cosine - ball_z * sine,
            hinge + pulp_x * toe_sine + pulp_z * toe_cosine,
            hinge + tip_x * toe_sine + tip_z * toe_cosine,
        )

    return sole


def _toe_height(s: Sample) -> Any:
    _, _, pulp, tip = s["sole"]
    return s["ankle/position/z"] + np.minimum(pulp, tip)


def _toe_load(s: Sample) -> Any:
    heel, ball, _, _ = s["sole"]
    share = (s["ground/ahead"] - heel) / np.maximum(ball - heel, NARROWEST)
    return s["ground/force/z"] * np.minimum(np.maximum(share, 0.0), 1.0)


def _orthosis_moment(built: Built) -> Reader:
    """As the column: the joint's moment less those of tissue, of the patient's muscles and of the ground."""
    index, dof = built.index, built.index.ankle_dof
    own, ground = index.passive, index.walking[GROUND]
    active, stiff, spastic = (index.walking[name] for name in (ACTIVE, STIFFNESS, SPASTIC))

    def moment(s: Sample) -> Any:
        force = s.rows["actuator_force"]
        biological = force[active] + force[stiff] + force[spastic]
        return s.rows["qfrc_actuator"][dof] - force[own] - biological - force[ground]

    return moment
