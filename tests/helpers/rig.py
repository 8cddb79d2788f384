"""Small MuJoCo rigs with this project's actuators, put together by hand."""

from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.native import slots
from afo_sim.physics import LAWS, Braid

BRAID = Braid(nominal_length=0.1631, nominal_radius=0.00575, braid_angle=np.radians(22.0))
LAW = {"k": 1.0, "bladder_force": 136.0, "bladder_stiffness": 153.0}


def muscle_row(
    law: str = "tondu_lopez_2000_bladder",
    parameters: dict[str, float] = LAW,
    braid: Braid = BRAID,
    **own: Any,
) -> dict[str, Any]:
    """Parameters of a muscle by its law, as a circuit's muscle takes them."""
    row = {"law": law, "coefficients": LAWS[law].coefficients(braid, parameters), "lowest_pressure": 0.0}
    return row | {"braid": braid, "braid_stiffness": 2e4, "dead_volume": 1e-6, "damping": 2e-4} | own


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
    cable_stiffness: float = 1e6,
    return_stiffness: float = 0.0,
    anchor: native.CircuitAnchor | None = None,
    drive: native.CircuitDrive | None = None,
) -> mujoco.MjModel:
    """A mass on a vertical slide, on one muscle, whose chamber has an inlet and an outlet valve.

    The slide's coordinate is the muscle's shortening [m]; the muscle is at nominal length at zero.
    """
    xml = f"""<mujoco><option timestep="{timestep!r}" integrator="implicitfast" gravity="0 0 -9.80665">
    <flag autoreset="disable"/></option>
    <worldbody><site name="top" pos="0 0 {BRAID.nominal_length!r}"/>
    <body name="load"><joint name="slide" type="slide" axis="0 0 1" damping="{damper!r}"/>
    <geom size=".01" mass="{mass!r}"/><site name="hook"/></body></worldbody>
    <tendon><spatial name="muscle"><site site="top"/><site site="hook"/></spatial></tendon></mujoco>"""
    own = {"damping": damping, "return_stiffness": return_stiffness, "lowest_pressure": lowest_pressure}
    row = muscle_row(law, LAW if law_parameters is None else law_parameters, **own)
    valve = native.CircuitValve(conductance, 0.3, 4e-3, 4e-3)
    anchors = () if anchor is None else (anchor,)
    names = tuple(a.name for a in anchors)
    circuit = native.Circuit(
        (native.CircuitMuscle("muscle", ("muscle",), row, 0.0, "air", cable_stiffness, names),),
        (native.CircuitChamber("air", "slide", tube_volume, wall_conductance, valve, valve, drive),),
        anchors,
    )
    spec = mujoco.MjSpec.from_string(xml)
    native.add_circuit(spec, circuit)
    model = spec.compile()
    native.fill_circuit(model, circuit)
    if not muscles:  # the chamber is its tube alone
        model.actuator_user[model.actuator("chamber_air").id, slots.CHAMBER_ROW.first_muscle] = -1
    return model


def charged(model: mujoco.MjModel, pressure: float, shortening: float = 0.0) -> mujoco.MjData:
    """A state with `pressure` (gauge) in the chamber at ambient temperature, at rest, valves shut."""
    data = mujoco.MjData(model)
    data.qpos[0] = shortening
    native.fill_chambers(model, data, pressure)
    return data
