"""Small MuJoCo rigs with this project's actuators, put together by hand."""

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.physics.law import Braid
from afo_sim.physics.laws import LAWS

BRAID = Braid(nominal_length=0.1631, nominal_radius=0.00575, braid_angle=np.radians(22.0))
LAW = {"k": 1.0, "bladder_force": 136.0, "bladder_stiffness": 153.0}


def hanging_mass(
    mass: float,
    *,
    law: str = "tondu_lopez_2000_bladder",
    law_parameters: dict[str, float] | None = None,
    lowest_pressure: float = 0.0,
    damper: float = 200.0,
    damping: float = 2e-4,
    timestep: float = 1e-3,
    tube_volume: float = 4e-6,
    wall_conductance: float = 0.5,
    conductance: float = 5.5e-10,
    muscles: int = 1,
) -> mujoco.MjModel:
    """A mass on a vertical slide, on one muscle, whose chamber has an inlet and an outlet valve.

    The slide's coordinate is the muscle's shortening [m]; the muscle is at nominal length at zero.
    """
    user = " ".join(["0"] * native.N_USER)
    plain = f'joint="slide" dyntype="user" gaintype="fixed" gainprm="0" biastype="none" user="{user}"'
    xml = f"""<mujoco><option timestep="{timestep!r}" integrator="implicitfast" gravity="0 0 -9.80665">
    <flag autoreset="disable"/></option><size nuserdata="3"/>
    <worldbody><site name="top" pos="0 0 {BRAID.nominal_length!r}"/>
    <body name="load"><joint name="slide" type="slide" axis="0 0 1" damping="{damper!r}"/>
    <geom size=".01" mass="{mass!r}"/><site name="hook"/></body></worldbody>
    <tendon><spatial name="muscle"><site site="top"/><site site="hook"/></spatial></tendon>
    <actuator>
    <general name="muscle" tendon="muscle" gaintype="affine" gainprm="0 0 -1" biastype="user" user="{user}"/>
    <general name="chamber" actdim="3" {plain}/>
    <general name="inlet" actdim="2" {plain}/><general name="outlet" actdim="2" {plain}/>
    </actuator></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    model.actuator_user[0] = native.muscle_row(
        law=law,
        coefficients=LAWS[law].coefficients(BRAID, LAW if law_parameters is None else law_parameters),
        lowest_pressure=lowest_pressure,
        braid=BRAID,
        series_length=0.0,
        damping=damping,
        braid_stiffness=2e4,
        dead_volume=1e-6,
        chamber=1,
        next_muscle=-1,
    )
    model.actuator_user[1] = native.chamber_row(
        first_muscle=0 if muscles else -1,
        inlet=2,
        outlet=3,
        tube_volume=tube_volume,
        wall_conductance=wall_conductance,
        userdata=0,
    )
    for valve in (2, 3):
        model.actuator_user[valve] = native.valve_row(
            conductance=conductance, critical_ratio=0.3, opening_delay=4e-3, closing_delay=4e-3
        )
    return model


def charged(model: mujoco.MjModel, pressure: float, shortening: float = 0.0) -> mujoco.MjData:
    """A state with `pressure` (gauge) in the chamber at ambient temperature, at rest, valves shut."""
    data = mujoco.MjData(model)
    data.qpos[0] = shortening
    data.act[:3] = 1.0
    mujoco.mj_forward(model, data)
    volume, absolute = data.userdata[2], pressure + AMBIENT_PRESSURE
    data.act[:3] = absolute * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE), volume, absolute
    return data
