"""Keerthana et al. (S1): bench and simulation tables, two models, and 37 %.

The bench's masses hang side by side, each on a muscle with a chamber and valves of its own.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import GRAVITY, assets
from afo_sim.description import Muscle, reader
from afo_sim.lab.identifiability import rms
from afo_sim.lab.law_fit import fit_law, held_out
from afo_sim.lab.law_problem import pose
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.lab.validation_row import Row, rows
from afo_sim.model import get_state
from afo_sim.physics import LAWS, Braid, contractions, forces
from afo_sim.simulation import Case, Recipe, fixed, roll_out

CM = 100.0  # per metre
# Table → the muscle it is about. I and II were measured, III and IV simulated by S1.
TABLES = {1: "s1_215mm", 2: "s1_120mm", 3: "s1_215mm", 4: "s1_120mm"}
PRINT, MODEL = (
    0.05,
    0.03,
)  # half of the last printed digit; what an angle and a radius in whole numbers leave [cm]
OWN, STILL = "S1's own simulation", "a muscle that never moves"
MISPRINT = 8  # row of table IV: 2 kg, 4 bar
S1_ANGLE, S1_RADIUS = math.radians(37.0), 5e-3  # what S1 must have simulated with, derived here [rad, m]
FIT_BOUND = 0.15  # RMS over tables I and II together [cm]
DAMPER = 200.0  # of the slides [N·s/m]: brings the masses to rest, and is nothing at rest
TUBE_VOLUME, WALL_CONDUCTANCE = 4e-6, 0.5  # of each chamber [m³, W/K]
CONDUCTANCE, CRITICAL_RATIO, DELAY = 5.5e-10, 0.3, 4e-3  # of each valve [m³/(s·Pa), -, s]
HANGER = 1e6  # stiffness of what the mass hangs on the muscle by [N/m]: 0.1 mm under 10 kg
TIMESTEP, DURATION = 1e-3, 10.0  # [s]; twice as long moves no mass of S1 by 1e-8 cm


def table(number: int) -> Measured:
    """One of S1's tables I to IV, as it is printed."""
    return read_measured(assets.folder("models") / "muscles" / TABLES[number] / f"table_{number}.csv")


def ours(muscle: Muscle, force: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Change of length of a muscle at forces [N] and gauge pressures [Pa], statically [m]."""
    kappa = contractions(LAWS[muscle.law].native_id, muscle.coefficients, force, pressure)
    return muscle.nominal_length * kappa


def as_s1(length: float, force: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """The same of the ideal braid that S1 must have simulated: 37°, 5 mm, no bladder, no ends [m]."""
    law = LAWS["tondu_lopez_2000"]
    coefficients = law.coefficients(Braid(length, S1_RADIUS, S1_ANGLE), {"k": 1.0})
    return length * contractions(law.native_id, coefficients, force, pressure)


def _change(data: Measured) -> np.ndarray:
    assert data.change is not None
    return CM * data.change


def _cell(data: Measured, k: int, simulated: np.ndarray, **more: Any) -> dict[str, Any]:
    """A cell of a table, its load [kg] and pressure [bar]."""
    mass, bar = data.force[k] / GRAVITY - data.facts.get("hanger", 0.0), data.pressure[k] * 1e-5
    return {"mass": mass, "bar": bar, "published": float(_change(data)[k]), "simulated": simulated[k], **more}


def scatter(data: Measured) -> float:
    """Deviation of a table's cells from the means of its loads and pressures [cm]: S1 repeats no cell."""
    at = [np.unique(values, return_inverse=True)[1] for values in (data.force, data.pressure)]
    ways = np.concatenate([np.eye(each.max() + 1)[each] for each in at], axis=1)
    left = _change(data) - ways @ np.linalg.lstsq(ways, _change(data), rcond=None)[0]
    return float(np.sqrt((left**2).sum() / (len(data) - np.linalg.matrix_rank(ways))))


def _judged(
    data: Measured, keep: np.ndarray, simulated: np.ndarray, foils: dict[str, np.ndarray], tolerance: float
) -> list[Any]:
    """Of a table: its cells, how many are within the tolerance, the relative error, the bias by pressure."""
    printed = _change(data)
    errors = {name: (each - printed)[keep] for name, each in {"": simulated, **foils}.items()}
    within = {name: int((abs(each) <= tolerance).sum()) for name, each in errors.items()}
    share = {name: 100.0 * float(np.mean(abs(each) / printed[keep])) for name, each in errors.items()}
    cells = [_cell(data, k, simulated, tolerance=tolerance) for k in np.flatnonzero(keep).tolist()]
    count = {"simulated": within.pop(""), "expected": int(keep.sum()), "foils": within, "limit": tolerance}
    mean = {"simulated": share.pop(""), "foils": share, "tolerance": None}
    biases = []
    for pressure in np.unique(data.pressure):
        here = (data.pressure == pressure)[keep]
        mean_tolerance = tolerance / math.sqrt(here.sum())
        error = {"simulated": float(errors[""][here].mean()), "tolerance": mean_tolerance}
        biases.append({"bar": pressure * 1e-5} | error)
    return [cells, count, mean, biases]


def _bench() -> list[Row]:
    """Tables I and II: statically, cell by cell and through MuJoCo."""
    tables = {k: table(k) for k in (1, 2)}
    found, errors, static, hung = list[Any](), [], [], list[Hung]()
    for k, data in tables.items():
        muscle = reader.load("muscle", TABLES[k])
        static.append(CM * ours(muscle, data.force, data.pressure))
        errors.append(static[-1] - _change(data))
        foils = {OWN: _change(table(k + 2)), STILL: np.zeros(len(data))}
        tolerance, every = math.hypot(PRINT, 2.0 * scatter(data)), np.ones(len(data), dtype=bool)
        found += [errors[-1], *_judged(data, every, static[-1], foils, tolerance)]
        loads = zip(data.force / GRAVITY, data.pressure, strict=True)
        hung += [Hung(muscle, float(mass), float(pressure)) for mass, pressure in loads]
    joint = {"simulated": np.concatenate(errors), "tolerance": FIT_BOUND, "held_out": _held_out(tables)}
    return rows("s1", "bench", *found, joint, CM * settled(hung) - np.concatenate(static))


def _held_out(tables: dict[int, Measured]) -> dict[str, float]:
    problem = pose("tondu_lopez_2000_bladder", [tables[1], tables[2]])
    result = held_out(fit_law(problem, starts=4))
    found = {kind: CM * result.held_out[kind].rms for kind in ("load", "pressure")}
    for left_out, errors in result.held_out["muscle"].errors.items():
        length = "12 cm" if "120" in left_out else "21.5 cm"
        found[f"the {length} muscle"] = CM * rms(errors)
    return found


def _own_simulation() -> list[Row]:
    """Tables III and IV, and how far S1's own simulation lies from S1's bench."""
    tables, found = {k: table(k) for k in TABLES}, list[Any]()
    for k in (3, 4):
        data = tables[k]
        printed, bench = _change(data), _change(tables[k - 2])
        simulated = CM * as_s1(data.facts["total_length"], data.force, data.pressure)
        good = np.arange(len(data)) != (MISPRINT if k == 4 else -1)
        fitted = CM * ours(reader.load("muscle", TABLES[k]), data.force, data.pressure)
        foils = {"the muscle fitted to the bench": fitted, STILL: np.zeros(len(data))}
        cells, count, share, _ = _judged(data, good, simulated, foils, PRINT + MODEL)
        found += [(simulated - printed)[good], cells, count, share]
        if k == 4:
            ratio = data.facts["total_length"] / tables[3].facts["total_length"]
            expected = float(ratio * _change(tables[3])[MISPRINT])
            found.append(_cell(data, MISPRINT, simulated, expected=expected))
        theirs, own = (rms((each - bench)[good]) for each in (printed, simulated))
        found.append({"simulated": own, "expected": theirs, "cells": good.sum()})
    return rows("s1", "own_simulation", *found)


def _models() -> list[Row]:
    """S1's geometric and Hill models are one, and its force rises with pressure."""
    braid = Braid(0.215, S1_RADIUS, S1_ANGLE)
    kappa, pressure = (x.ravel() for x in np.meshgrid(np.linspace(-0.05, 0.5, 23), np.linspace(0.0, 6e5, 13)))
    geometric, hill = (
        forces(LAWS[name].native_id, LAWS[name].coefficients(braid, values), kappa, pressure)
        for name, values in (
            ("chou_hannaford_1996", {"wall_thickness": 0.0}),
            ("tondu_lopez_2000", {"k": 1.0}),
        )
    )
    slope = np.diff(geometric[np.isclose(kappa, 0.0)][[0, -1]])[0] / 6.0
    return rows("s1", "models", geometric - hill, slope)


def _contraction() -> list[Row]:
    """S1's 37 %: which of three readings gives it."""
    muscle, law = reader.load("muscle", "s1_215mm"), LAWS["tondu_lopez_2000"]
    no_load, pressure, limits = np.zeros(1), np.array([4e5]), []
    for angle in (muscle.braid_angle, S1_ANGLE):
        braid = Braid(muscle.nominal_length, muscle.bore / 2.0, angle)
        coefficients = law.coefficients(braid, {"k": 1.0})
        limits.append(100.0 * float(contractions(law.native_id, coefficients, no_load, pressure)[0]))
    free = contractions(LAWS[muscle.law].native_id, muscle.coefficients, no_load, pressure)[0]
    reached = float(100.0 * free * muscle.nominal_length / muscle.total_length)
    largest = 100.0 * float(_change(table(1)).max() / (CM * muscle.total_length))
    own = 100.0 * (1.0 - 1.0 / (math.sqrt(3.0) * math.cos(S1_ANGLE)))
    return rows(
        "s1",
        "contraction",
        {"simulated": limits[0], "degrees": math.degrees(muscle.braid_angle)},
        {"simulated": limits[1], "expected": own},
        {"simulated": reached, "expected": largest, "allowed": 100.0 * 3.0 * FIT_BOUND / 21.5},
    )


@dataclass(frozen=True)
class Hung:
    """A mass [kg] on a muscle that is filled to a gauge pressure [Pa]."""

    muscle: Muscle
    mass: float
    pressure: float


def settled(hung: Sequence[Hung]) -> np.ndarray:
    """Let masses hang until they rest: how much each muscle has shortened."""
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


PARTS = {
    "bench": _bench,
    "own_simulation": _own_simulation,
    "models": _models,
    "contraction": _contraction,
}
