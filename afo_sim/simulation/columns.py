"""Every column of a recording: name, unit, sign and formula. A new column is a new row of COLUMNS."""

import functools
import itertools
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError, JsonMapping, is_si, nearest_name, unknown
from afo_sim.control import CONTROLLER_COLUMNS
from afo_sim.metrics import SOLVED, LazyColumns
from afo_sim.model import JOINTS, SINK, Index
from afo_sim.simulation.frame import Column, Frame, edge_flow, volume_pressure
from afo_sim.simulation.own_column import OWN, OwnColumn
from afo_sim.simulation.rollout import Rollout
from afo_sim.simulation.supply_columns import SUPPLY_COLUMNS
from afo_sim.simulation.walk_columns import WALKING, WalkFrame

if TYPE_CHECKING:
    from afo_sim.model import Built

INTERNAL = "internal, dorsiflexion positive"
SIDES = ("inlet", "outlet")


def _nominal(f: Frame, muscle: int) -> float:
    return float(f.built.model.actuator_user[muscle, native.MUSCLE_NOMINAL_LENGTH])


def _own(f: Frame, muscle: int) -> native.Own:
    return native.read_own(f.built.model, f.rows["userdata"], muscle)


def _rubbed(built: "Built") -> bool:
    """Whether a path rubs at its guides: then the joint feels another force than the muscle has."""
    return any(group.wrap_friction > 0.0 for group in built.scenario.orthosis.muscle.values())


def _anchor(f: Frame, number: int) -> native.Yielding:
    network, place = list(f.built.index.anchors.values())[number]
    return native.read_anchor(f.built.model, f.rows["userdata"], network, place)


def _moment_arm(f: Frame, muscle: int) -> np.ndarray:
    model = f.built.model
    tendon = int(model.actuator_trnid[muscle, 0])
    at = int(model.ten_J_rowadr[tendon])
    dofs = list(model.ten_J_colind[at : at + model.ten_J_rownnz[tendon]])
    return -f.rows["ten_J"][:, at + dofs.index(f.built.index.ankle_dof)]


def _air(f: Frame, chamber: int) -> native.Air:
    return native.read_air(f.built.model, f.rows["act"], f.rows["userdata"], chamber)


def _mass_flow(f: Frame, node: int, direction: float) -> np.ndarray:
    """Sum of all flows in one direction: 1 into a node, −1 out of it."""
    total = np.zeros(f.n)
    for edge, sign in native.touching(f.built.model, node):
        total = total + np.maximum(direction * sign * edge_flow(f, edge), 0.0)
    return total


def _held(f: Frame, node: int, place: int) -> np.ndarray:
    return f.rows["act"][:, f.built.model.actuator_actadr[node] + place]


def _temperature(f: Frame, node: int) -> np.ndarray:
    air = native.read_node(f.built.model, f.rows["act"], f.rows["userdata"], node)
    gas = native.gas_of(f.built.model, node)
    return air.absolute_pressure * air.volume / (air.mass * gas.constant)


def _target(f: Frame, chamber: int) -> np.ndarray:
    asked = f.control[:, _drives(f.built.index)[chamber]]
    return np.where(asked < 0.0, np.nan, asked)


def _drives(index: Index) -> dict[int, int]:
    """The drives by their chambers' actuators."""
    return {index.chambers[name]: drive for name, drive in index.drives.items()}


def _coil(f: Frame, valve: int) -> np.ndarray:
    first = native.first_way(f.built.model, valve)
    if first is not None:  # it is open while the one coil of a 3/2 valve has no current
        return 1.0 - _coil(f, first)
    if native.is_driven(f.built.model, valve):
        return native.read_coil(f.built.model, f.rows["userdata"], valve)
    return f.control[:, valve]


def _switches(f: Frame, valve: int) -> np.ndarray:
    index = f.built.index
    chamber, side = {i: name for name, i in index.valves.items()}[valve].rsplit("_", 1)
    return native.read_switches(f.built.model, f.rows["act"], index.drives[chamber], side == "outlet")


def _inversion(f: Frame) -> np.ndarray:
    """Moment of all muscles on the foot about the talus' forward axis, Σ T (−dL/dφ)."""
    arms = f.built.side_arms
    assert arms is not None
    ankle = f.rows["qpos"][:, f.built.index.ankle_qpos]
    tension = 0.0 - f.rows["actuator_force"][:, [f.built.index.muscles[name] for name in arms.names]]
    return np.einsum("nm,nm->n", tension, arms.at(ankle))


COLUMNS = (
    Column("time", "s", "start of the step",
        lambda f: (f.first_step + np.arange(f.n)) * f.built.scenario.timestep),
    Column("ankle/angle", "rad", "dorsiflexion positive",
        lambda f: f.rows["qpos"][:, f.built.index.ankle_qpos]),
    Column("ankle/velocity", "rad/s", "dorsiflexion positive", lambda f: f.dof("qvel")),
    Column("ankle/moment/orthosis", "N*m", f"{INTERNAL}; all muscles of the orthosis, instantaneous",
        lambda f: f.dof("qfrc_actuator") - f.force(f.built.index.passive)),
    Column("ankle/acceleration", "rad/s^2", "dorsiflexion positive; instantaneous, not the step's mean",
        lambda f: f.dof("qacc"), whole=True),
    Column("ankle/moment/passive", "N*m", f"{INTERNAL}; tissue, damping, friction and stops",
        lambda f: f.force(f.built.index.passive)
        + (f.built.scenario.load_moment + f.dof("qfrc_passive") + f.dof("qfrc_constraint")), whole=True),
    Column("ankle/moment/gravity", "N*m", "dorsiflexion positive; weight of what turns",
        lambda f: 0.0 - f.dof("qfrc_bias"), whole=True),
    Column("ankle/moment/inversion", "N*m",
        "internal, inversion positive; all muscles of the orthosis on the foot, about the talus' forward "
        "axis through the ankle joint, instantaneous", _inversion,
        where=lambda built: built.side_arms is not None),
    Column("ankle/moment/load", "N*m", "dorsiflexion positive; the scenario's constant load moment",
        lambda f: np.full(f.n, -f.built.scenario.load_moment),
        where=lambda built: built.scenario.load_moment),
    *WALKING,
    Column("muscle/*/force", "N", "tension positive",
        lambda f, i: _own(f, i).tension if _rubbed(f.built) else 0.0 - f.force(i)),  # and never −0.0
    Column("muscle/*/joint_force", "N",
        "tension beyond the path's guides, which the joint feels; force is the muscle's own",
        lambda f, i: 0.0 - f.force(i), where=_rubbed),
    Column("muscle/*/length", "m", "active braid length, the muscle's own",
        lambda f, i: _nominal(f, i) * (1.0 - _own(f, i).contraction)),
    Column("muscle/*/velocity", "m/s", "of its own length, lengthening positive; mean of the step before",
        lambda f, i: -_nominal(f, i) * _own(f, i).rate),
    Column("muscle/*/contraction", "", "(L0 - L)/L0 of its own length, shorter is positive",
        lambda f, i: _own(f, i).contraction),
    Column("muscle/*/path_length", "m",
        "from anchor to anchor: muscle, ends, link, and what cable, cuff and plate give",
        lambda f, i: f.rows["actuator_length"][:, i]),
    Column("muscle/*/moment_arm", "m", "-dL/dtheta of the path; dorsiflexion positive", _moment_arm,
        whole=True),
    Column("cuff/*/force", "N", "pull of all muscles on it", lambda f, i: _anchor(f, i).force),
    Column("cuff/*/displacement", "m", "along the pull", lambda f, i: _anchor(f, i).displacement),
    Column("chamber/*/pressure", "Pa", "gauge", lambda f, i: _air(f, i).absolute_pressure - AMBIENT_PRESSURE),
    Column("chamber/*/mass", "kg", "air in the chamber", lambda f, i: _air(f, i).mass),
    Column("chamber/*/volume", "m^3", "muscles and tube",
        lambda f, i: native.read_flows(f.built.model, f.rows["userdata"], i).volume),
    Column("chamber/*/temperature", "K", "absolute", _temperature),
    Column("chamber/*/mass_flow_in", "kg/s", "into the chamber, wherever from",
        lambda f, i: _mass_flow(f, i, 1.0)),
    Column("chamber/*/mass_flow_out", "kg/s", "out of the chamber, wherever to",
        lambda f, i: _mass_flow(f, i, -1.0)),
    Column("chamber/*/target", "Pa",
        "gauge; what its pressure drive is asked for, not a number where that is off", _target,
        of=lambda index, i: i in _drives(index)),
    Column("valve/*/coil", "", "command, 0 to 1; of a 3/2 valve's way out 1 less its coil", _coil),
    Column("valve/*/switches", "", "how often its pressure drive has switched the coil on since the start",
        _switches,
        of=lambda index, i: any(i == index.valves[f"{c}_{side}"] for c in index.drives for side in SIDES)),
    Column("valve/*/opening", "", "seat, 0 to 1: mean of the step from here",
        lambda f, i: native.read_opening(f.built.model, f.rows["userdata"], i)),
    Column("valve/*/mass_flow", "kg/s", "supply to chamber to ambient positive", edge_flow),
    Column("restriction/*/mass_flow", "kg/s", "upstream to downstream positive", edge_flow),
    Column("volume/*/pressure", "Pa", "gauge", volume_pressure),
    Column("volume/*/mass", "kg", "gas in the volume", lambda f, i: _held(f, i, 0)),
    Column("volume/*/temperature", "K", "absolute", _temperature),
    Column("store/*/pressure", "Pa", "gauge", volume_pressure),
    Column("store/*/mass", "kg", "gas and liquid in it", lambda f, i: _held(f, i, 0)),
    Column("store/*/temperature", "K", "absolute", lambda f, i: _held(f, i, 1)),
    *SUPPLY_COLUMNS,
    Column("qpos/*", "rad", "MuJoCo coordinate", lambda f, address: f.rows["qpos"][:, address]),
)  # fmt: skip


def frame_of(built: "Built", rows: dict[str, np.ndarray], control: np.ndarray, first_step: int) -> Frame:
    """A stretch as the columns of this scenario take it."""
    return (Frame if built.walk is None else WalkFrame)(built, rows, control, first_step)


def columns_of(built: "Built", rollout: Rollout) -> LazyColumns:
    """All columns of a roll-out, with those that were reported."""
    frame = frame_of(built, rollout.rows, rollout.control, rollout.first_step)
    found = formulas(built, whole="qacc" in rollout.rows)  # or only what metrics need was recorded
    # in one piece, since most are read more than once
    return LazyColumns(found, lambda name: np.ascontiguousarray(found[name](frame)), rollout.reported)


CONDITIONS = tuple(dict.fromkeys(column.where for column in COLUMNS))


def formulas(built: "Built", whole: bool = True) -> Mapping[str, Callable[[Frame], np.ndarray]]:
    """The formula of every column of a run, by name; of a frame it gives (n,)."""
    holds = tuple(bool(where(built)) for where in CONDITIONS)
    return _formulas(built.index, whole, holds, tuple(OWN.values()))


@functools.lru_cache(maxsize=16)  # cases of a sweep share it
def _formulas(
    index: Index, whole: bool, holds: tuple[bool, ...], own: tuple[OwnColumn, ...]
) -> dict[str, Callable[[Frame], np.ndarray]]:
    # Names and ids of what a "*" stands for, by kind; one without a name where there is no "*"
    owners: dict[str, Mapping[str, int]] = {
        "": {"": 0},
        "muscle": index.muscles,
        "cuff": {name: number for number, name in enumerate(index.anchors)},
        "chamber": index.chambers,
        "valve": index.valves,
        "restriction": index.restrictions,
        "volume": index.volumes,
        "store": index.stores,
        "qpos": {name: place for name, (place, _) in index.joints.items()},
    }
    there = {where for where, held in zip(CONDITIONS, holds, strict=True) if held}
    present = [c for c in COLUMNS if (whole or not c.whole) and c.where in there]
    found: dict[str, Callable[[Frame], np.ndarray]] = {}
    for kind, group in itertools.groupby(present, lambda c: c.name.split("/")[0] if "*" in c.name else ""):
        columns = list(group)
        for owner, number in owners[kind].items():
            for column in columns:
                if not kind:
                    found[column.name] = column.formula
                elif column.of(index, number):
                    name = column.name.replace("*", owner)
                    found[name] = functools.partial(lambda of, k, frame: of(frame, k), column.formula, number)
    for one in own:
        if not [describe(name) for name in one.lacks(found)]:  # refused, where no run has it
            found[one.name] = functools.partial(_of_frame, one, dict(found))
    return found


def _of_frame(own: OwnColumn, known: Mapping[str, Callable[[Frame], np.ndarray]], frame: Frame) -> np.ndarray:
    return own.of(LazyColumns(known, lambda name: known[name](frame)))


def column_at(
    built: "Built", name: str, rows: dict[str, np.ndarray], control: np.ndarray, step: int
) -> np.ndarray:
    """One column of a stretch (n,), by its name; InputError where a run of this scenario has none of it."""
    found = formulas(built)
    if name not in found:
        raise unknown(name, found, field="column", problem="a run of this scenario has no such column")
    return found[name](frame_of(built, rows, control, step))


DESCRIBED = {column.name: (column.unit, column.sign) for column in COLUMNS}
DESCRIBED |= {f"qpos/{name}": ("m", "MuJoCo coordinate") for name in (*JOINTS[:2], SINK)}  # those that slide
DESCRIBED[SOLVED] = ("", "1 in settled strides, whose air was solved for; 0 in those walked from the start")
DESCRIBED |= {f"controller/{name}": entry for name, entry in CONTROLLER_COLUMNS.items()}
SENSOR, POSITIVE = "sensor/", "dorsiflexion"


def describe(column: str, scenario: JsonMapping | None = None) -> tuple[str, str]:
    """(unit, sign) of a column; a sensor's are those of the column that it reads."""
    if column.startswith(SENSOR):
        return _of_sensor(column, scenario or {})
    pattern = _pattern(column)
    if column in OWN:
        unit, sign = OWN[column].unit, OWN[column].sign
    elif pattern in DESCRIBED:
        unit, sign = DESCRIBED[pattern]
    else:
        problem, nearest = "is not a column of this version of the program", nearest_name(column, DESCRIBED)
        raise InputError(problem, field="column", value=column, nearest=nearest)
    directions = ((scenario or {}).get("leg") or {}).get("directions", [POSITIVE])
    return unit, sign.replace(POSITIVE, directions[0])


def _pattern(column: str) -> str:
    """The name in DESCRIBED of a column of the package: with "*" for a muscle, chamber, valve or joint."""
    kind, *name_and_rest = column.split("/")
    return column if column in DESCRIBED else "/".join([kind, "*", *name_and_rest[1:]])


def _of_sensor(column: str, scenario: JsonMapping) -> tuple[str, str]:
    sensors = scenario.get("sensor") or {}
    name, _, output = column.removeprefix(SENSOR).partition("/")
    if name not in sensors:
        problem = "is not a sensor of the scenario, which gives its unit"
        raise unknown(column, [f"{SENSOR}{known}" for known in sensors], field="column", problem=problem)
    if output:
        return "V", "physical output"
    sensor = sensors[name]
    bought = sensor.get("type") or {}
    if any(table.get("threshold") is not None for table in (sensor, bought)):
        return "", "1 above the threshold, 0 below"
    unit, sign = describe(sensor["column"], scenario)
    return unit, f"reading of {sensor['column']}: {sign}"


def add(own: OwnColumn) -> None:
    """Put a column of a user's own among those of the package, in the place of an older one of its name."""
    if not re.fullmatch(r"[\w-]+(/[\w-]+)+", own.name):
        raise InputError("is no name of a column", field="name", value=own.name, allowed='"strap/force"')
    if own.unit and not is_si(own.unit):
        problem, allowed = "is no unit of SI's own", 'such as "rad", "N", "N*m", "Pa"; "" of a bare number'
        raise InputError(problem, field="unit", value=own.unit, allowed=allowed)
    if own.name not in OWN and (own.name.startswith(SENSOR) or _pattern(own.name) in DESCRIBED):
        problem, allowed = "is the name of a column of the package", f"another, such as my/{own.name}"
        raise InputError(problem, field="name", value=own.name, allowed=allowed)
    OWN[own.name] = own
