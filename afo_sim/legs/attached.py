"""A whole model with an orthosis on one of its legs: its state, its valves, and its readings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError, gauge, si, unknown
from afo_sim.description import Orthosis, Segment
from afo_sim.legs.finding import Found
from afo_sim.native import Hold

Command = Literal["inlet", "outlet"] | None
COMMANDS: dict[Command, tuple[float, float]] = {"inlet": (1.0, 0.0), "outlet": (0.0, 1.0), None: (0.0, 0.0)}


@dataclass(frozen=True, eq=False)
class Attached:
    """A compiled model that an orthosis is attached to; it is stepped with `mujoco.mj_step`."""

    model: mujoco.MjModel  # exact; the user's own actuators come first, in their order
    spec: mujoco.MjSpec  # that it was compiled from, now with the muscles' parameters
    orthosis: Orthosis  # that it wears, as described
    found: Found  # the leg that it is on
    bodies: dict[Segment, str]  # that carry the device, the proximal one first
    joints: tuple[str, ...]  # that its muscles cross
    prefix: str  # of all names that were added
    supply: float  # gauge pressure before the inlet valves [Pa]
    circuit: native.Circuit  # muscles, valves and air as the callbacks compute them
    ids: native.CircuitIds  # of what was added to the model
    userdata: int = 0  # first place that is this orthosis'
    notices: tuple[str, ...] = ()  # what was changed in the model, what is doubtful
    legs: dict[str, "Attached"] = field(default_factory=dict)  # every orthosis by its prefix, this one too

    def __repr__(self) -> str:
        return f"<{self.orthosis.name or 'orthosis'} on {' and '.join(self.bodies.values())}>"

    @property
    def told(self) -> tuple[str, ...]:
        """As `notices`; the name of former versions."""
        return self.notices

    @property
    def muscles(self) -> dict[str, int]:
        """Actuator of every single muscle, by its name ("dorsiflexor_1", …)."""
        return self.ids.muscles

    @property
    def chambers(self) -> dict[str, int]:
        """Actuator of every chamber, by its name; its `ctrl` is the gauge pressure of the supply [Pa]."""
        return self.ids.chambers

    @property
    def valves(self) -> dict[str, int]:
        """Actuator of every valve ("dorsiflexor_inlet", …); its `ctrl` is 1 with current, else 0."""
        return self.ids.valves

    @property
    def own_controls(self) -> slice:
        """Places in `ctrl` of the model's own actuators; a controller of the model writes no others."""
        return slice(0, min(network for leg in self.legs.values() for network in leg.ids.networks.values()))

    def callbacks(self) -> Hold:
        """The muscle callbacks, for a `with` block, or to be kept and closed; else muscles are limp."""
        return Hold()

    def data(self, qpos: np.ndarray | None = None) -> mujoco.MjData:
        """A state at rest, as `reset` makes it."""
        data = mujoco.MjData(self.model)
        self.reset(data, qpos)
        return data

    def reset(self, data: mujoco.MjData, qpos: np.ndarray | None = None) -> None:
        """Set a state at rest (qpos (nq,)): chambers at ambient pressure, valves shut, full supply."""
        mujoco.mj_resetData(self.model, data)
        if qpos is not None:
            posture = np.asarray(qpos, dtype=float)
            fits = posture.shape == data.qpos.shape
            if not fits or not np.isfinite(posture).all():
                problem = "holds NaN" if fits else f"has the shape {posture.shape}"
                raise InputError(problem, field="qpos", allowed=f"{self.model.nq} finite numbers")
            data.qpos[:] = posture
        self.fill(data)

    def fill(self, data: mujoco.MjData, pressures: Mapping[str, str | float] | None = None) -> None:
        """Set chambers to gauge pressures [Pa] at ambient temperature, muscles at rest with them."""
        gauge: dict[int, float] = {}
        for leg in self.legs.values():
            if pressures is not None and leg.prefix != self.prefix:  # whose air stays, if it has any
                air, pressure = leg.air(data), leg.pressure(data)
                gauge |= {leg.chambers[name]: pressure[name] for name, mass in air.items() if mass > 0.0}
        for name, value in (pressures or {}).items():
            if name not in self.chambers:
                raise unknown(name, self.chambers, field="pressures", problem="is not a valid chamber")
            gauge[self.chambers[name]] = pressure_of(value, f"pressures.{name}")
        with Hold():
            native.fill_chambers(self.model, data, gauge)
            for leg in self.legs.values():
                for chamber in leg.chambers.values():
                    data.ctrl[chamber] = data.ctrl[chamber] or leg.supply  # 0 after mj_resetData
            mujoco.mj_forward(self.model, data)

    def set_valves(
        self, data: mujoco.MjData, commands: Mapping[str, Command] | None = None, /, **more: Command
    ) -> None:
        """Put current on valves: `set_valves(data, dorsiflexor="inlet", plantarflexor="outlet")`."""
        for name, command in {**(commands or {}), **more}.items():
            if name not in self.chambers:
                raise unknown(name, self.chambers, field="set_valves", problem="is not a valid chamber")
            if command not in COMMANDS:
                raise unknown(command, ["inlet", "outlet", "None"], field=f"set_valves.{name}")
            for side, current in zip(native.SIDES, COMMANDS[command], strict=True):
                data.ctrl[self.valves[f"{name}_{side}"]] = current

    def set_supply(self, data: mujoco.MjData, pressure: str | float) -> None:
        """Set the gauge pressure before this orthosis' inlet valves, "3 bar" or [Pa]."""
        data.ctrl[list(self.chambers.values())] = pressure_of(pressure, "pressure")

    def angle(self, data: mujoco.MjData) -> float:
        """Angle of the joint, dorsiflexion or flexion positive, from the posture taken as zero [rad]."""
        place = int(self.model.joint(self.found.ankle).qposadr[0])
        return self.found.sign * (float(data.qpos[place]) - self.found.zero)

    def pressure(self, data: mujoco.MjData) -> dict[str, float]:
        """Gauge pressure of each chamber [Pa]."""
        return {name: air.absolute_pressure - AMBIENT_PRESSURE for name, air in self._air(data).items()}

    def air(self, data: mujoco.MjData) -> dict[str, float]:
        """Air in each chamber [kg]."""
        return {name: air.mass for name, air in self._air(data).items()}

    def volume(self, data: mujoco.MjData) -> dict[str, float]:
        """Volume of each chamber, its tubes included [m³]."""
        return {name: air.volume for name, air in self._air(data).items()}

    def flow(self, data: mujoco.MjData) -> dict[str, float]:
        """Air through each valve and restriction in the step last computed [kg/s], downstream positive."""
        found = {}
        for name, chamber in self.chambers.items():
            flows = native.read_flows(self.model, data.userdata, chamber)
            found[f"{name}_inlet"], found[f"{name}_outlet"] = float(flows.inlet), float(flows.outlet)
        for name, edge in (self.valves | self.ids.restrictions).items():
            if name not in found:
                found[name] = float(native.read_flow(self.model, data.userdata, edge))
        return found

    def volume_pressure(self, data: mujoco.MjData) -> dict[str, float]:
        """Gauge pressure of each rigid volume, ends of tubes too, at the start of the last step [Pa]."""
        read = {k: native.read_volume(self.model, data.userdata, v) for k, v in self.ids.volumes.items()}
        return {name: float(pressure) - AMBIENT_PRESSURE for name, pressure in read.items()}

    def force(self, data: mujoco.MjData) -> dict[str, float]:
        """Pull of every single muscle [N]."""
        return {name: float(self._own(data, muscle).tension) for name, muscle in self.muscles.items()}

    def contraction(self, data: mujoco.MjData) -> dict[str, float]:
        """Own contraction ratio of every single muscle [-]."""
        return {name: float(self._own(data, muscle).contraction) for name, muscle in self.muscles.items()}

    def cuff_force(self, data: mujoco.MjData) -> dict[Segment, float]:
        """Pull of all muscles on what is worn on each segment, summed along their paths [N]."""
        pull, anchors = sum(self.force(data).values()), self._anchors(data)
        return {each: float(anchors[each].force) if each in anchors else pull for each in self.bodies}

    def displacement(self, data: mujoco.MjData) -> dict[Segment, float]:
        """Displacement of cuff and plate under that pull [m]; 0 where they are rigid."""
        anchors = self._anchors(data)
        return {each: float(anchors[each].displacement) if each in anchors else 0.0 for each in self.bodies}

    gives = displacement  # the name of former versions

    def _air(self, data: mujoco.MjData) -> dict[str, native.Air]:
        read = {k: native.read_air(self.model, data.act, data.userdata, c) for k, c in self.chambers.items()}
        return {name: native.Air(*map(float, air)) for name, air in read.items()}

    def _anchors(self, data: mujoco.MjData) -> dict[str, native.Yielding]:
        places = self.ids.anchors.items()
        return {each: native.read_anchor(self.model, data.userdata, *place) for each, place in places}

    def _own(self, data: mujoco.MjData, muscle: int) -> native.Own:
        return native.read_own(self.model, data.userdata, muscle)


def pressure_of(value: str | float, field: str) -> float:
    """A gauge pressure given as text with a unit, or as [Pa]; from vacuum's to 20 bar."""
    return number_of(gauge(value, field), field, "Pa", (-AMBIENT_PRESSURE, 2e6), "-1 bar to 20 bar")


def number_of(value: str | float, field: str, unit: str, span: tuple[float, float], allowed: str) -> float:
    """A quantity given as text with a unit, or as an SI number, between two numbers."""
    found = si(value, unit, field, allowed)
    if not span[0] < found <= span[1]:
        raise InputError("is out of range", field=field, value=value, allowed=allowed)
    return found
