"""The numbers of a search for a settled stride, out of its scenario, for `between_strides`."""

import functools
import math
from itertools import accumulate

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_TEMPERATURE, Mixed
from afo_sim.model import ANKLE, OFF, SINK, Built, beyond_chambers
from afo_sim.native.air_slopes import GIVING
from afo_sim.native.stride_numbers import (
    AT,
    FIRST_NODE,
    JOINT,
    NODE,
    STORE,
    TABLES,
    WAY_NUMBERS,
    node_rows,
    store_rows,
    way_rows,
)
from afo_sim.physics import FRICTIONS
from afo_sim.simulation.simulate import PLAY

LEVER = 0.1  # between ankle and sole, roughly: at its end an angle is a height [m]
TRUSTED = 3  # strides for which slopes of longer steps are taken
NOTHING = 1e-3  # share of a network's node that flows in over a stride, at which its slopes are known [-]
COARSE = 12e-3  # between the rows that the slopes are taken from [s]


def numbers_of(built: Built, control: np.ndarray, steps: int) -> np.ndarray:
    """Numbers of a search that has not begun, as `stride_numbers` has them; inputs are of two strides."""
    model, index, scenario = built.model, built.index, built.scenario
    chambers, stores = list(index.chambers.values()), list(index.stores.values())
    nodes, toes = [*chambers, *index.volumes.values()], scenario.leg.toes
    scales = {ANKLE: 1.0} | ({toes.joint: 1.0} if toes else {}) | ({SINK: LEVER} if built.contact else {})
    joints = []  # what moves by itself, as `JOINT` has it
    for name, scale in scales.items():
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        joints.append((1 + model.jnt_qposadr[joint], 1 + model.nq + model.jnt_dofadr[joint], scale))
    paired, ways = remembers(built, control), way_rows(model, [*nodes, *stores]) if nodes else []
    rows = 1 + math.ceil(1.5 * steps * scenario.timestep / COARSE)  # of any step
    counts = len(joints), len(nodes), len(chambers), len(ways), len(stores)
    found = _blank(*counts, rows, steps * paired).copy()
    tables: list[tuple[int, Mixed]] = [(AT.joint, joints), (AT.way, ways)]
    if nodes:
        tables += [(AT.node, node_rows(model, nodes))]
    if stores:
        tables += [(AT.store, store_rows(model, stores))]
    for at, values in tables:
        flat = np.ravel(values)
        found[int(found[at]) :][: flat.size] = flat
    lower, upper = model.jnt_range[model.dof_jntid[index.ankle_dof]]
    found[[AT.ankle, AT.lowest, AT.highest]] = index.ankle_qpos, lower - PLAY, upper + PLAY
    found[[AT.paired, AT.sticks, AT.frictions]] = paired, sticks(built), bool(index.frictions)
    widths = model.nq, model.na, model.nuserdata, model.nu, 1 + model.nq + model.nv
    found[[AT.qpos, AT.act, AT.userdata, AT.control, AT.activations]] = widths
    found[AT.nothing] = NOTHING if beyond_chambers(scenario) else 0.0
    found[[AT.gas, AT.gamma]] = native.gas_of(model, nodes[0]) if nodes else native.GasOf()
    return in_steps(found, steps, scenario.timestep)


@functools.lru_cache(maxsize=16)
def _blank(
    joints: int, nodes: int, chambers: int, ways: int, stores: int, rows: int, angles: int
) -> np.ndarray:
    """Numbers of searches of so many parts, rows and angles that are kept, before those of a scenario."""
    n, known = 2 * nodes, FIRST_NODE + nodes + stores
    sizes = dict.fromkeys(TABLES, n) | dict.fromkeys(("own", "slopes", "told", "other"), n * n)
    sizes |= {"joint": len(JOINT) * joints, "node": len(NODE) * nodes, "way": WAY_NUMBERS * ways}
    sizes |= {"store": len(STORE) * stores, "pressures": known, "warm": known, "flowing": nodes}
    sizes |= {"giving": rows * nodes, "past": 2 * rows * nodes, "angles_before": angles}
    sizes |= {"side": max(n, ways), "matrix": max(n * n, known)}
    ends = list(accumulate(sizes.values(), initial=len(AT)))
    found, places = np.zeros(ends[-1]), dict(zip(TABLES, ends, strict=False))
    found[[getattr(AT, name) for name in TABLES]] = ends[:-1]
    found[[AT.joints, AT.nodes, AT.chambers, AT.ways, AT.stores]] = joints, nodes, chambers, ways, stores
    found[places["warm"] : places["giving"]] = AMBIENT_TEMPERATURE
    # a rigid volume does not give
    found[places["giving"] : places["past"]].reshape(rows, nodes)[:, :chambers] = GIVING
    return found


def in_steps(numbers: np.ndarray, steps: int, timestep: float, within: float = 1.0) -> np.ndarray:
    """The same in so many steps of a stride [s], within so many times the distances of a settled one."""
    found, every = numbers.copy(), max(round(COARSE / timestep), 1)
    found[[AT.steps, AT.every, AT.interval, AT.within]] = steps, every, every * timestep, within
    return found


def with_slopes(numbers: np.ndarray, of: np.ndarray) -> np.ndarray:
    """The same with the slopes that a search in longer steps has ended with."""
    found = numbers.copy()
    found[AT.trusted] = TRUSTED if found[AT.nodes] else 0
    found[int(found[AT.own]) : int(found[AT.slopes])] = of[int(of[AT.slopes]) : int(of[AT.told])]
    return found


def sticks(built: Built) -> bool:
    """Whether friction keeps the past: then only that of walking from rest is one, and no air may jump."""
    frictions = {group.type.friction for group in built.scenario.orthosis.muscle.values()} - {"none"}
    return any(FRICTIONS[friction].sticks for friction in frictions)


def remembers(built: Built, control: np.ndarray) -> bool:
    """Whether strides pass on more than chambers' air and ankle, with these inputs (n_step, nu)."""
    driven = any((control[:, drive] != OFF).any() for drive in built.index.drives.values())
    slow = sticks(built) or bool(built.index.frictions)
    return beyond_chambers(built.scenario) or slow or driven
