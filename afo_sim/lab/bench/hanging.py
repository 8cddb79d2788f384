"""Masses that hang on muscles side by side, each muscle on a chamber and valves of its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.units import GRAVITY
from afo_sim.description.muscle import Muscle
from afo_sim.model.start import get_state
from afo_sim.simulation.rollout import Case, Recipe, roll_out
from afo_sim.simulation.stepping import fixed

DAMPER = 200.0  # of the slides [N·s/m]: brings the masses to rest, and is nothing at rest
TUBE_VOLUME, WALL_CONDUCTANCE = 4e-6, 0.5  # of each chamber [m³, W/K]
CONDUCTANCE, CRITICAL_RATIO, DELAY = 5.5e-10, 0.3, 4e-3  # of each valve [m³/(s·Pa), -, s]
HANGER = 1e6  # stiffness of what the mass hangs on the muscle by [N/m]: 0.1 mm under 10 kg
TIMESTEP, DURATION = 1e-3, 10.0  # [s]; twice as long moves no mass of S1 by 1e-8 cm


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

    Units: returns [m].
    """
    spec, circuit = _spec(hung), _circuit(hung)
    native.add_circuit(spec, circuit)
    model = spec.compile()
    ids = native.fill_circuit(model, circuit)
    n_step = round(DURATION / TIMESTEP)
    control = np.zeros(model.nu)
    control[list(ids.chambers.values())] = [h.pressure for h in hung]
    control[[ids.valves[f"{chamber}_inlet"] for chamber in ids.chambers]] = 1.0
    with native.installed():
        data = mujoco.MjData(model)
        native.fill_chambers(model, data, 0.0)
        case = Case(model, get_state(model, data), fixed(np.broadcast_to(control, (n_step, model.nu))))
        (rollout,) = roll_out([case], n_step, Recipe(fields=(), stride=n_step))
    if rollout.failure is not None:
        raise rollout.failure
    stretch = np.array([h.mass * GRAVITY / HANGER for h in hung])
    shortening: np.ndarray = rollout.final["qpos"] + stretch
    return shortening


def _spec(hung: Sequence[Hung]) -> mujoco.MjSpec:
    """A tendon between a site above and a mass on a slide, for each; slides are named like their chamber."""
    worldbody, tendons = [], []
    for k, h in enumerate(hung):
        place = f'pos="{0.1 * k:.1f} 0'
        worldbody.append(
            f'<site name="top{k}" {place} {h.muscle.total_length!r}"/><body {place} 0">'
            f'<joint name="{k}" type="slide" axis="0 0 1" damping="{DAMPER}"/>'
            f'<geom size=".01" mass="{h.mass!r}"/><site name="hook{k}"/></body>'
        )
        tendons.append(f'<spatial name="{k}"><site site="top{k}"/><site site="hook{k}"/></spatial>')
    return mujoco.MjSpec.from_string(
        f'<mujoco><option timestep="{TIMESTEP}" integrator="implicitfast" gravity="0 0 {-GRAVITY}">'
        '<flag autoreset="disable" contact="disable"/></option>'
        f"<worldbody>{''.join(worldbody)}</worldbody><tendon>{''.join(tendons)}</tendon></mujoco>"
    )


def _circuit(hung: Sequence[Hung]) -> native.Circuit:
    """Each muscle with a chamber and valves of its own, all called by its number."""
    valve = native.CircuitValve(CONDUCTANCE, CRITICAL_RATIO, DELAY, DELAY)
    names = [str(k) for k in range(len(hung))]
    return native.Circuit(
        tuple(
            native.CircuitMuscle(name, (name,), h.muscle.row, h.muscle.end_length, name, HANGER)
            for name, h in zip(names, hung, strict=True)
        ),
        tuple(
            native.CircuitChamber(name, name, TUBE_VOLUME, WALL_CONDUCTANCE, valve, valve) for name in names
        ),
    )
