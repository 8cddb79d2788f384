"""A joint like an ankle, with one or two groups of muscles over constant arms, put together by hand."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from rig import BRAID, muscle_row

from afo_sim import native
from afo_sim.native import slots
from afo_sim.physics import Braid

INERTIA, STIFFNESS, ARM = 0.03, 10.0, 0.05  # [kg·m²], [N·m/rad], [m]
SIDES = (1.0, -1.0)  # of the first and the second group: positive angles shorten the first
STIFFENING = (0.0, 33.0, 0.017)  # of a cuff on soft tissue: no linear stiffness, a [N], x0 [m]


@dataclass(frozen=True)
class Ankle:
    """What a rig is made of.

    anchors : (stiffness [N/m], or 0; a [N] and x0 [m] of the stiffening law; damping [N·s/m]) of each
    initial_contraction : of every muscle's path where the joint stands at zero [-]
    friction : of the muscles, (native id, its coefficients)
    """

    timestep: float = 2e-3
    groups: int = 1
    count: int = 1
    cable_stiffness: float = 1e6
    anchors: tuple[tuple[float, ...], ...] = ()
    damping: float = 2e-4
    friction: tuple[int, Sequence[float]] = (0, ())
    friction_states: int = 0
    wall_conductance: float = 0.5
    return_stiffness: float = 20.0
    initial_contraction: float = 0.02
    tube_volume: float = 4e-6
    one_chamber: bool = False
    conductance: float = 2e-9
    braid: Braid = BRAID

    @property
    def names(self) -> tuple[str, ...]:
        """Of the groups, as of their chambers."""
        return ("front", "back")[: self.groups]

    def circuit(self) -> native.Circuit:
        """Muscles, chambers and anchors."""
        friction = dict(zip(("friction", "friction_coefficients"), self.friction, strict=True))
        own = {"damping": self.damping, "return_stiffness": self.return_stiffness} | friction
        row = muscle_row(braid=self.braid, **own)
        anchors = tuple(
            native.CircuitAnchor(f"anchor{k}", *numbers) for k, numbers in enumerate(self.anchors)
        )
        around = -self.braid.nominal_length * (1.0 - self.initial_contraction)
        muscles = tuple(
            native.CircuitMuscle(
                name,
                tuple(f"{name}_{k}" for k in range(self.count)),
                row,
                around,
                self.names[0] if self.one_chamber else name,
                self.cable_stiffness,
                tuple(anchor.name for anchor in anchors),
            )
            for name in self.names
        )
        valve = native.CircuitValve(self.conductance, 0.3, 4e-3, 4e-3)
        chambers = tuple(
            native.CircuitChamber(name, "ankle", self.tube_volume, self.wall_conductance, valve, valve)
            for name in (self.names[:1] if self.one_chamber else self.names)
        )
        return native.Circuit(muscles, chambers, anchors)

    def model(self) -> mujoco.MjModel:
        """The compiled model, with its rows."""
        tendons = "".join(
            f'<fixed name="{name}_{k}"><joint joint="ankle" coef="{-side * ARM!r}"/></fixed>'
            for name, side in zip(self.names, SIDES, strict=False)
            for k in range(self.count)
        )
        spec = mujoco.MjSpec.from_string(f"""<mujoco>
        <option timestep="{self.timestep!r}" integrator="implicitfast" gravity="0 0 0">
        <flag autoreset="disable" contact="disable"/></option>
        <worldbody><body><joint name="ankle" type="hinge" axis="0 1 0" stiffness="{STIFFNESS!r}"/>
        <inertial pos="0 0 0" mass="1" diaginertia="{INERTIA!r} {INERTIA!r} {INERTIA!r}"/></body></worldbody>
        <tendon>{tendons}</tendon></mujoco>""")
        circuit = self.circuit()
        native.add_circuit(spec, circuit)
        model = spec.compile()
        native.fill_circuit(model, circuit)
        return model

    def started(
        self, model: mujoco.MjModel, pressure: float | Sequence[float], angle: float | None = None
    ) -> mujoco.MjData:
        """At rest with gauge pressures in the chambers; at the angle where everything balances, or at one.

        The callbacks must be installed.
        """
        data = mujoco.MjData(model)
        chambers = [model.actuator(f"chamber_{c.name}").id for c in self.circuit().chambers]
        gauge = dict(zip(chambers, np.broadcast_to(pressure, len(chambers)).tolist(), strict=True))

        def acceleration(at: float) -> float:
            data.qpos[0] = at
            native.fill_chambers(model, data, gauge)
            mujoco.mj_forward(model, data)
            return float(data.qacc[0])

        if angle is not None:
            acceleration(angle)
            return data
        low, high = -1.0, 1.0
        for _ in range(60):  # its own bisection: accelerations fall with the angle
            middle = 0.5 * (low + high)
            low, high = (middle, high) if acceleration(middle) > 0.0 else (low, middle)
        acceleration(0.5 * (low + high))
        data.time, data.qvel[0] = 0.0, 0.0
        return data


def pulses(model: mujoco.MjModel, supply: float = 4e5, vented: float = 0.3) -> Callable[[float], np.ndarray]:
    """Inputs over time: each chamber filled for 0.2 s and vented in turn, the second half a period later."""
    control = np.zeros(model.nu)
    chambers = [i for i in range(model.nu) if model.actuator(i).name.startswith("chamber_")]
    control[chambers] = supply
    names = [model.actuator(i).name.removeprefix("chamber_") for i in chambers]
    places = [[model.actuator(f"valve_{n}_{side}").id for side in ("inlet", "outlet")] for n in names]

    def at(time: float) -> np.ndarray:
        for k, (inlet, outlet) in enumerate(places):
            phase = (time - 0.5 * k + 1e-9) % 1.0
            control[inlet], control[outlet] = float(0.1 <= phase < 0.3), float(0.5 <= phase < 0.5 + vented)
        return control

    return at


@dataclass(frozen=True)
class Trace:
    """Row by row, before its step: time [s], angle [rad], velocity [rad/s], act and userdata."""

    time: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    act: np.ndarray
    data: np.ndarray

    def every(self, step: float) -> "Trace":
        """The rows at multiples of a coarser step."""
        n = round(step / (self.time[1] - self.time[0]))
        return Trace(*(getattr(self, name)[::n] for name in ("time", "angle", "velocity", "act", "data")))


def rolled(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    duration: float,
    inputs: Callable[[float], np.ndarray] | None = None,
) -> Trace:
    """Step a started rig, with its inputs; the callbacks must be installed."""
    rows: list[tuple[float, float, float, np.ndarray, np.ndarray]] = []
    for n in range(round(duration / model.opt.timestep)):
        time = n * model.opt.timestep
        if inputs is not None:
            data.ctrl[:] = inputs(time)
        angle, velocity, act = float(data.qpos[0]), float(data.qvel[0]), data.act.copy()
        mujoco.mj_step(model, data)
        rows.append((time, angle, velocity, act, data.userdata.copy()))
    return Trace(*(np.array(column) for column in zip(*rows, strict=True)))


def own(model: mujoco.MjModel, trace: Trace, name: str) -> native.Own:
    """Own length of a group."""
    return native.read_own(model, trace.data, model.actuator(f"{name}_0").id)


def air(model: mujoco.MjModel, trace: Trace, name: str) -> native.Air:
    """Air of a chamber."""
    return native.read_air(model, trace.act, trace.data, model.actuator(f"chamber_{name}").id)


def sigma(model: mujoco.MjModel, trace: Trace, name: str) -> np.ndarray:
    """The state σ of a chamber."""
    at = model.actuator_actadr[model.actuator(f"chamber_{name}").id] + slots.CHAMBER_ACT.sigma
    return trace.act[:, at]
