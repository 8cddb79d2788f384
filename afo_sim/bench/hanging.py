"""Masses that hang on muscles side by side, each muscle on a chamber and valves of its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, GRAVITY
from afo_sim.description.muscle import Muscle

DAMPER = 200.0  # of the slides [N·s/m]: brings the masses to rest, and is nothing at rest
TUBE_VOLUME, WALL_CONDUCTANCE = 4e-6, 0.5  # of each chamber [m³, W/K]
CONDUCTANCE, CRITICAL_RATIO, DELAY = 5.5e-10, 0.3, 4e-3  # of each valve [m³/(s·Pa), -, s]
TIMESTEP, DURATION = 1e-3, 10.0  # [s]; twice as long moves no mass of S1 by 1e-8 cm
PER_MUSCLE = 4  # actuators: muscle, chamber, inlet, outlet


@dataclass(frozen=True)
class Hung:
    """A mass [kg] on a muscle that is filled to a gauge pressure [Pa]."""

    muscle: Muscle
    mass: float
    pressure: float


def settled(hung: Sequence[Hung]) -> np.ndarray:
    """Let masses hang until they rest: how much each muscle has shortened.

    Every muscle begins at its nominal length and at ambient pressure; its inlet valve then stays open to a
    supply at its pressure. Forces and pressures come from the compiled callbacks, as in every run.

    Parameters
    ----------
    hung : masses, muscles and pressures

    Returns
    -------
    shortening [m] (n,)
    """
    model = _model(hung)
    with native.installed():
        data = _start(model, len(hung))
        data.ctrl[1::PER_MUSCLE] = [h.pressure for h in hung]
        data.ctrl[2::PER_MUSCLE] = 1.0
        for _ in range(round(DURATION / TIMESTEP)):
            mujoco.mj_step(model, data)
    return data.qpos.copy()


def _model(hung: Sequence[Hung]) -> mujoco.MjModel:
    blank = " ".join(["0"] * native.N_USER)
    worldbody, tendons, actuators = [], [], []
    for k, h in enumerate(hung):
        place = f'pos="{0.1 * k:.1f} 0'
        worldbody.append(
            f'<site name="top{k}" {place} {h.muscle.total_length!r}"/><body {place} 0">'
            f'<joint name="slide{k}" type="slide" axis="0 0 1" damping="{DAMPER}"/>'
            f'<geom size=".01" mass="{h.mass!r}"/><site name="hook{k}"/></body>'
        )
        tendons.append(f'<spatial name="{k}"><site site="top{k}"/><site site="hook{k}"/></spatial>')
        plain = f'joint="slide{k}" dyntype="user" gainprm="0" biastype="none" user="{blank}"'
        actuators.append(
            f'<general tendon="{k}" gaintype="affine" gainprm="0 0 -1" biastype="user" user="{blank}"/>'
            f'<general actdim="3" {plain}/><general actdim="2" {plain}/><general actdim="2" {plain}/>'
        )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{TIMESTEP}" integrator="implicitfast" gravity="0 0 {-GRAVITY}">'
        '<flag autoreset="disable" contact="disable"/></option>'
        f'<size nuserdata="{native.FLOWS_PER_CHAMBER * len(hung)}"/>'
        f"<worldbody>{''.join(worldbody)}</worldbody>"
        f"<tendon>{''.join(tendons)}</tendon><actuator>{''.join(actuators)}</actuator></mujoco>"
    )
    for k, h in enumerate(hung):
        _fill_parameters(model, k, h.muscle)
    return model


def _fill_parameters(model: mujoco.MjModel, number: int, muscle: Muscle) -> None:
    first = PER_MUSCLE * number
    model.actuator_user[first] = native.muscle_row(
        **muscle.row,
        series_length=muscle.end_length,
        chamber=first + 1,
        next_muscle=-1,
    )
    model.actuator_user[first + 1] = native.chamber_row(
        first_muscle=first,
        inlet=first + 2,
        outlet=first + 3,
        tube_volume=TUBE_VOLUME,
        wall_conductance=WALL_CONDUCTANCE,
        userdata=native.FLOWS_PER_CHAMBER * number,
    )
    model.actuator_user[first + 2 : first + 4] = native.valve_row(
        conductance=CONDUCTANCE, critical_ratio=CRITICAL_RATIO, opening_delay=DELAY, closing_delay=DELAY
    )


def _start(model: mujoco.MjModel, count: int) -> mujoco.MjData:
    """At rest and nominal length, chambers at ambient pressure and temperature, valves shut."""
    data = mujoco.MjData(model)
    states = [model.actuator_actadr[PER_MUSCLE * k + 1] for k in range(count)]
    for at in states:
        data.act[at : at + 3] = 1.0
    mujoco.mj_forward(model, data)
    for k, at in enumerate(states):
        volume = data.userdata[native.FLOWS_PER_CHAMBER * k + 2]
        mass = AMBIENT_PRESSURE * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
        data.act[at : at + 3] = mass, volume, AMBIENT_PRESSURE
    return data
