"""Inputs and outputs of an exported scenario by name, each a number of mjData."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.model import Built

# Of what recorded walking gives: unit, and what it is.
WALKING = {
    "drive_shank_x": ("m/s^2", "acceleration of the shank forwards"),
    "drive_shank_z": ("m/s^2", "acceleration of the shank upwards"),
    "drive_shank_angle": ("rad/s^2", "angular acceleration of the shank"),
    "ground": ("N*m", "moment of the ground about the ankle beside its pads, dorsiflexion positive"),
    "active_moment": ("N*m", "moment of the patient's own muscles, dorsiflexion positive"),
    "active_stiffness": ("N*m/rad", "stiffness of the patient's own muscles"),
    "toe_rest": ("N*m", "moment that turns the toes to their rest"),
    "support": ("N", "force that carries the leg beside its pads"),
}


@dataclass(frozen=True)
class Variable:
    """value = scale · (array[place] + offset); one of no name goes with the one before."""

    name: str
    unit: str
    description: str
    array: str
    place: int
    scale: float = 1.0
    offset: float = 0.0
    start: float | None = None  # of an input

    @property
    def line(self) -> str:
        """As the library reads it."""
        numbers = str(self.place), repr(float(self.scale)), repr(float(self.offset))
        causality = "output" if self.start is None else "input"
        return "\t".join((causality, self.array, *numbers, self.name, self.unit, self.description))


def variables_of(built: Built, first: np.ndarray) -> Iterator[Variable]:
    """Inputs, with their values at the start in `first` (nu,), and outputs."""
    index = built.index

    def control(name: str, unit: str, description: str, actuator: int) -> Variable:
        return Variable(name, unit, description, "ctrl", actuator, start=float(first[actuator]))

    for valve, i in index.valves.items():
        if not native.is_driven(built.model, i) and native.first_way(built.model, i) is None:
            yield control(f"valve/{valve}/coil", "", "command of its coil, 0 to 1", i)
    for chamber, i in index.drives.items():
        text = "gauge pressure that its drive is asked for; below 0 the drive is off"
        yield control(f"chamber/{chamber}/target", "Pa", text, i)
    if native.ends_at_supply(built.model):  # and at no bottle
        regulated = built.scenario.supply.regulator is not None
        name, before = ("line_pressure", "regulator") if regulated else ("pressure", "inlet valves")
        for number, i in enumerate(index.chambers.values()):
            yield control("" if number else f"supply/{name}", "Pa", f"gauge pressure before the {before}", i)
    if built.scenario.leg.passive.scale > 0.0:
        text = "of the knee, flexion positive: it stretches the tissue"
        yield control("knee/angle", "rad", text, index.passive)
    for name, i in index.walking.items():
        if name.startswith("pad_"):
            yield control(f"walk/{name}", "m", "height of the floor under this point of the sole", i)
        elif name in WALKING:
            yield control(f"walk/{name}", *WALKING[name], i)
    text = "further moment on the ankle, dorsiflexion positive"
    yield Variable("ankle/moment/applied", "N*m", text, "qfrc_applied", index.ankle_dof, start=0.0)
    yield from _outputs(built)


def _outputs(built: Built) -> Iterator[Variable]:
    model, index = built.model, built.index
    # what reads states and results reads from these where they stand
    act, data = np.arange(model.na), np.arange(model.nuserdata)
    yield Variable("ankle/angle", "rad", "dorsiflexion positive", "qpos", index.ankle_qpos)
    yield Variable("ankle/velocity", "rad/s", "dorsiflexion positive", "qvel", index.ankle_dof)
    if built.walk is None:
        text = "moment of all muscles of the orthosis, dorsiflexion positive"
        yield Variable("ankle/moment/orthosis", "N*m", text, "qfrc_actuator", index.ankle_dof)
        yield Variable("", "", "", "actuator_force", index.passive, scale=-1.0)
    for name, i in index.muscles.items():
        text, at = "tension that the joint feels", int(native.read_own(model, data, i).contraction)
        yield Variable(f"muscle/{name}/joint_force", "N", text, "actuator_force", i, scale=-1.0)
        text = "(L0 - L)/L0 of its own length, shorter is positive"
        yield Variable(f"muscle/{name}/contraction", "", text, "userdata", at)
    for name, i in index.chambers.items():
        air = native.read_air(model, act, data, i)
        pressure = int(air.absolute_pressure)
        yield Variable(
            f"chamber/{name}/pressure", "Pa", "gauge", "userdata", pressure, offset=-AMBIENT_PRESSURE
        )
        yield Variable(f"chamber/{name}/mass", "kg", "air in the chamber", "act", int(air.mass))
        yield Variable(f"chamber/{name}/volume", "m^3", "muscles and tube", "userdata", int(air.volume))
    for name, i in index.valves.items():
        text, flow = "supply to chamber to ambient positive", int(native.read_flow(model, data, i))
        yield Variable(f"valve/{name}/mass_flow", "kg/s", text, "userdata", flow)
        opening = int(native.read_opening(model, data, i))
        yield Variable(f"valve/{name}/opening", "", "seat, 0 to 1: mean of the step", "userdata", opening)
    for name, i in index.stores.items():
        mass = int(native.read_content(model, act, i))
        yield Variable(f"store/{name}/mass", "kg", "gas and liquid in it", "act", mass)
