"""Inputs and outputs of an exported scenario by name, each a number of mjData."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.model import Built
from afo_sim.simulation import describe

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
    text = f"further moment on the joint, {built.scenario.leg.directions[0]} positive"
    yield Variable("ankle/moment/applied", "N*m", text, "qfrc_applied", index.ankle_dof, start=0.0)
    yield from _outputs(built)


def _outputs(built: Built) -> Iterator[Variable]:
    model, index, words = built.model, built.index, {"leg": {"directions": built.scenario.leg.directions}}
    # what reads states and results reads from these where they stand
    act, data = np.arange(model.na), np.arange(model.nuserdata)

    def output(
        name: str, array: str, place: int | np.ndarray, scale: float = 1.0, offset: float = 0.0
    ) -> Variable:
        """Unit and sign are those of a run's column of this name."""
        return Variable(name, *describe(name, words), array, int(place), scale, offset)

    yield output("ankle/angle", "qpos", index.ankle_qpos)
    yield output("ankle/velocity", "qvel", index.ankle_dof)
    if built.walk is None:
        yield output("ankle/moment/orthosis", "qfrc_actuator", index.ankle_dof)
        yield Variable("", "", "", "actuator_force", index.passive, scale=-1.0)
    for name, i in index.muscles.items():
        yield output(f"muscle/{name}/joint_force", "actuator_force", i, scale=-1.0)
        yield output(f"muscle/{name}/contraction", "userdata", native.read_own(model, data, i).contraction)
    for name, i in index.chambers.items():
        air = native.read_air(model, act, data, i)
        yield output(f"chamber/{name}/pressure", "userdata", air.absolute_pressure, offset=-AMBIENT_PRESSURE)
        yield output(f"chamber/{name}/mass", "act", air.mass)
        yield output(f"chamber/{name}/volume", "userdata", air.volume)
    for name, i in index.valves.items():
        yield output(f"valve/{name}/mass_flow", "userdata", native.read_flow(model, data, i))
        yield output(f"valve/{name}/opening", "userdata", native.read_opening(model, data, i))
    for name, i in index.stores.items():
        yield output(f"store/{name}/mass", "act", native.read_content(model, act, i))
