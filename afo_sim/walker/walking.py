"""A responding walk: reflexes and air in MuJoCo's step, the device's board and pushes between steps."""

import copy
import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError, JsonDict, JsonMapping, SimulationError
from afo_sim.control import Controller, FootSwitch, checked, make
from afo_sim.description import Scenario
from afo_sim.model import ANKLE, POINTS, SOLE, valves_at
from afo_sim.physics import LEG_MUSCLES, TIBIALIS
from afo_sim.walker.body import JOINTS, PITCH, ROOT, SIDES, UP, Body, wearing
from afo_sim.walker.gait import Vector, start

TICK = 0.01  # between rows, commands of the board, and looks at whether the walker has fallen [s]
FALLEN = 0.8  # height of the trunk over its first from which on down it has fallen [-]
PUSHED = 0.1  # duration of a push [s]
Engine = Literal["planar", "mujoco"]  # whose steps: this project's, where the body allows them, or MuJoCo's
HEEL_LOAD = 30.0  # from which on the switch under the device's foot is closed [N]


@dataclass(frozen=True)
class Push:
    """A horizontal force on the trunk, forward positive, for 0.1 s: when it begins [s], force [N]."""

    time: float
    force: float


@dataclass(frozen=True, eq=False)
class Walked:
    """A walk as it was recorded, a row each 10 ms."""

    body: Body
    columns: Mapping[str, np.ndarray]  # SI, (n,); "left/…" of the leg without the device, "right/…" with it
    fell: float | None  # when [s]; None where it did not
    pushes: tuple[Push, ...] = ()

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column]


@dataclass(eq=False)
class _Board:
    """What switches a leg's device's valves: timer, gait phase by its foot's switch, or controller."""

    scenario: Scenario
    body: Body
    leg: int = 0
    switch: FootSwitch = field(default_factory=lambda: FootSwitch(HEEL_LOAD))
    controller: Controller | None = None
    commands: JsonDict = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.scenario.controller is not None:
            self.controller = make(self.scenario.controller, self.scenario)

    @functools.cached_property
    def chambers(self) -> dict[str, int]:
        """The leg's own."""
        ids = self.body.ids.chambers if self.body.ids is not None else {}
        return {name: ids[f"{SIDES[self.leg]}{name}"] for name in self.scenario.orthosis.chamber if ids}

    def __call__(self, recorder: "_Recorder", data: mujoco.MjData) -> Mapping[str, float]:
        """Coils by valve; the others are off."""
        scenario, now = self.scenario, float(data.time)
        self.switch.update(float(data.actuator_force[self.body.pads[self.leg, 0]]), TICK)
        if self.controller is not None:
            self.commands |= checked(
                self.controller(recorder.seen(data, self)),
                self.chambers,
                {},
                [name for name, chamber in scenario.orthosis.chamber.items() if chamber.three_way],
            )
            return {
                f"{SIDES[self.leg]}{chamber}_{side}": coil
                for chamber, coils in self.commands.items()
                if isinstance(coils, tuple)
                for side, coil in zip(native.SIDES, coils, strict=True)
            }
        if scenario.timer is not None:
            return self._at(scenario.timer.chambers, now % scenario.timer.period)
        if scenario.phases is not None:
            if not self.switch.ready:
                return {}
            return self._at(scenario.phases.chambers, self.switch.phase % 1.0)
        return {}

    def _at(self, tables: JsonMapping, place: float) -> dict[str, float]:
        """Coils at a time or phase of the valves that tables of intervals name; one that wraps is whole."""
        return {
            f"{SIDES[self.leg]}{valve}": float(
                any(a <= place < b if a < b else place >= a or place < b for a, b in intervals)
            )
            for name, times in tables.items()
            for valve, intervals in valves_at(name, times, self.chambers)
        }


@dataclass(frozen=True)
class _Seen:
    """What a controller sees: the columns of a recorded walk's leg that a walker has too."""

    time: float
    values: Mapping[str, float]
    period: float = TICK

    def __getitem__(self, column: str) -> float:
        if column not in self.values:
            problem = "is not a column that a responding walker gives a controller"
            raise InputError(problem, field="column", value=column, allowed=", ".join(self.values))
        return self.values[column]

    def rows(self, column: str) -> np.ndarray:
        """The last sample."""
        return np.array([self[column]])


def own_copy(body: Body) -> Body:
    """The same body with a model of its own, so that threads can write gains."""
    return dataclasses.replace(body, model=copy.copy(body.model))


def walk_body(
    body: Body,
    vector: Vector,
    duration: float,
    pushes: Sequence[Push] = (),
    noise: Sequence[float] | np.ndarray = (),
    rows: bool = True,
    engine: Engine = "planar",
) -> Walked:
    """Let a walker walk until it falls or the time is over; without `rows` no column is kept."""
    data = start(body, vector, noise)
    model, ticks = body.model, round(duration / TICK)
    recorder = _Recorder(body, ticks if rows else 1)
    boards = [_Board(body.scenario, body, leg) for leg in range(len(wearing(body.scenario)))]
    fallen = FALLEN * float(data.qpos[recorder.up])
    pushed = np.zeros(ticks)
    for push in pushes:
        first, last = (math.ceil(time / TICK - 1e-6) for time in (push.time, push.time + PUSHED))
        pushed[first:last] += push.force
    take = _planar_ticks if engine == "planar" and body.plan is not None else _mujoco_tick
    tick, height = 0, math.inf
    with native.installed():
        _fill(body, data)
        mujoco.mj_forward(model, data)
        # MuJoCo's velocities stand half a step before positions
        data.qvel -= 0.5 * model.opt.timestep * data.qacc
        while tick < ticks:
            if body.ids is not None:
                coils = {name: coil for board in boards for name, coil in board(recorder, data).items()}
                for valve, number in body.ids.valves.items():
                    data.ctrl[number] = coils.get(valve, 0.0)
            tick += take(recorder, data, pushed[tick : tick + 1 if body.ids is not None else ticks], fallen)
            height = float(data.qpos[recorder.up]) - recorder.floor(data)
            if not math.isfinite(height):
                raise SimulationError("the responding walk is not finite", time=tick * TICK)
            if height < fallen:
                break
    fell = float(data.time) if height < fallen else None
    return Walked(body, recorder.columns(tick) if rows else {}, fell, tuple(pushes))


def _mujoco_tick(recorder: "_Recorder", data: mujoco.MjData, pushes: np.ndarray, fallen: float) -> int:
    model = recorder.model
    data.xfrc_applied[recorder.trunk, 0] = pushes[0]
    try:
        mujoco.mj_step(model, data, nstep=round(TICK / model.opt.timestep))
    except mujoco.FatalError as error:
        raise SimulationError(f"the responding walk stops: {error}", time=data.time) from None
    recorder.take(data)
    return 1


def _planar_ticks(recorder: "_Recorder", data: mujoco.MjData, pushes: np.ndarray, fallen: float) -> int:
    """As many ticks as there are pushes, or until it falls, by the planar steps; how many."""
    model, plan, rows = recorder.model, recorder.plan, recorder.rows
    assert plan is not None
    plan[native.HEAD.fallen] = fallen
    row = rows[recorder.count % len(rows) :]
    width = rows.shape[1] if len(row) >= len(pushes) else 0
    taken = native.planar_steps()(
        model._address, data._address, plan.ctypes.data, pushes.ctypes.data, row.ctypes.data, len(pushes),
        round(TICK / model.opt.timestep), width,
    )  # fmt: skip
    if taken < 0:
        problem = native.COMPLAINTS[-2 - taken].partition(" in actuator")[0]
        raise SimulationError(f"the responding walk stops: {problem}", time=data.time)
    recorder.count += taken
    return int(taken)


def _fill(body: Body, data: mujoco.MjData) -> None:
    """Air of the start: ambient, or what the scenario's start states, at the supply's pressure at most."""
    if body.ids is None:
        return
    scenario, gauge = body.scenario, {}
    supply = scenario.supply.fixed
    for name, begun in (scenario.start.chambers if scenario.start else {}).items():
        for side in wearing(scenario):
            gauge[body.ids.chambers[f"{side}{name}"]] = supply if begun.pressure is None else begun.pressure
    act, ctrl = data.act.copy(), data.ctrl.copy()
    native.fill_chambers(body.model, data, gauge)
    first = min(body.ids.networks.values())
    data.act[: body.model.actuator_actadr[first]] = act[: body.model.actuator_actadr[first]]
    data.ctrl[:] = ctrl
    data.ctrl[list(body.ids.chambers.values())] = supply
    native.step_back(body.model, data)


class _Recorder:
    """Rows of a walk while it runs, as `native.ROW` names their numbers; its columns when it is over."""

    def __init__(self, body: Body, rows: int):
        model = body.model
        self.body, self.model, self.count = body, model, 0
        self.plan = None if body.plan is None else body.plan.copy()
        self.up = int(model.joint(UP).qposadr[0])
        row = model.actuator_user[body.reflexes[0]]
        self.slope, self.heights = row[native.REFLEX_ROW.slope], int(row[native.REFLEX_ROW.floor])
        self.trunk = model.body("trunk").id
        self.ankles = [model.joint(f"{side}{ANKLE}") for side in SIDES]
        first = model.actuator_actadr[body.muscles[:, TIBIALIS]]
        self.tibialis = first + native.LEG_MUSCLE_ACT.activation  # of each leg
        self.sites = [model.site(f"{side}{SOLE}{point}").id for side in SIDES for point in POINTS]
        self.device = sorted(body.ids.muscles.values()) if body.ids is not None else []
        floor = np.isin(model.actuator_user[:, native.KIND], (native.Kind.PAD, native.Kind.GRIP))
        self.inner = np.flatnonzero(~floor | (model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT))
        self.rows = np.zeros((rows, native.ROW.act + model.na + model.nu))

    def floor(self, data: mujoco.MjData) -> float:
        """Height of the floor under the trunk [m]."""
        return float(native.floor_at(data.userdata, self.heights, float(data.qpos[0])))

    def seen(self, data: mujoco.MjData, board: _Board) -> _Seen:
        """What a board sees now."""
        leg, pads, row = board.leg, self.body.pads[board.leg], native.ROW.torque + 2 * board.leg + 1
        place, dof = int(self.ankles[leg].qposadr[0]), int(self.ankles[leg].dofadr[0])
        heel, *front = (float(data.actuator_force[pad]) for pad in pads)
        values = {
            "time": float(data.time),
            "ankle/angle": float(data.qpos[place]),
            "ankle/velocity": float(data.qvel[dof]),
            "shank/angle": -float(data.qpos[2] + data.qpos[place - 2] + data.qpos[place - 1] + self.slope),
            "ground/force_z": float(data.actuator_force[pads].sum()),
            "foot/heel_load": heel,
            "foot/toe_load": sum(front),  # of ball and toes
            # of the wearer's own muscles, dorsiflexion positive [N·m]
            "ankle/moment/biological": self.rows[(self.count - 1) % len(self.rows), row],
            "tibialis/activation": float(data.act[self.tibialis[board.leg]]),
        }
        for name, chamber in board.chambers.items():
            air = native.read_air(self.model, data.act, data.userdata, chamber)
            values[f"chamber/{name}/pressure"] = float(air.absolute_pressure) - AMBIENT_PRESSURE
        return _Seen(float(data.time), values)

    def take(self, data: mujoco.MjData) -> None:
        """Keep a row of MuJoCo's step."""
        # what the body and the device do at the joints, without the floor, which is actuators too
        moment, force = native.jacobian(self.model, data), data.actuator_force
        pairs = (
            (int(self.ankles[k].dofadr[0]), i) for k in (0, 1) for i in (self.device, self.body.muscles[k])
        )
        torques = [moment[i, ankle] @ force[i] for ankle, i in pairs]
        joint, points = moment[self.inner].T @ force[self.inner], data.site_xpos[self.sites][:, [0, 2]]
        points[:, 1] -= data.ctrl[self.body.pads.ravel()]  # the floor's heights
        numbers = (data.qpos, data.qvel, joint, points.ravel(), torques, data.act, force)
        self.rows[self.count % len(self.rows)] = np.concatenate([[data.time], *numbers])
        self.count += 1

    def columns(self, count: int) -> dict[str, np.ndarray]:
        """All columns of so many rows, SI."""
        model, body, row = self.model, self.body, native.ROW
        ends = (row.qpos, row.qvel, row.joint, row.points, row.torque, row.act, row.act + model.na)
        time, *parts = np.split(self.rows[:count], ends, axis=1)
        names = ("qpos", "qvel", "joint", "site", "torque", "act", "actuator_force")
        kept = dict(zip(names, parts, strict=True))
        found = {"time": time[:, 0].copy()}
        for name in ROOT:
            found[f"trunk/{name}"] = kept["qpos"][:, int(model.joint(name).qposadr[0])]
        found[f"trunk/{PITCH}"] = found[f"trunk/{PITCH}"] + self.slope  # to the vertical
        act = native.LEG_MUSCLE_ACT
        for k, (prefix, side) in enumerate(zip(SIDES, ("right", "left"), strict=True)):
            for name in JOINTS:
                joint = model.joint(f"{prefix}{name}")
                found[f"{side}/{name}"] = kept["qpos"][:, int(joint.qposadr[0])]
                found[f"{side}/{name}_velocity"] = kept["qvel"][:, int(joint.dofadr[0])]
                found[f"{side}/{name}_moment"] = kept["joint"][:, int(joint.dofadr[0])]
            points = kept["site"].reshape(count, -1, 2)[:, len(POINTS) * k : len(POINTS) * (k + 1)]
            found[f"{side}/clearance"] = points[:, :, 1].min(axis=1)
            found[f"{side}/forefoot_clearance"] = points[:, 1:, 1].min(axis=1)  # of ball, pulp and tip
            found[f"{side}/toe_clearance"] = points[:, 2:, 1].min(axis=1)
            found[f"{side}/foot"] = points[:, :2, 0].mean(axis=1)
            found[f"{side}/load"] = kept["actuator_force"][:, body.pads[k]].sum(axis=1)
            at = int(model.actuator_actadr[body.reflexes[k]])
            found[f"{side}/phase"] = np.round(kept["act"][:, at])
            for i, muscle in zip(body.muscles[k], LEG_MUSCLES, strict=True):
                first = int(model.actuator_actadr[i])
                found[f"{side}/{muscle}/activation"] = kept["act"][:, first + act.activation]
                found[f"{side}/{muscle}/length"] = kept["act"][:, first + act.length]
                found[f"{side}/{muscle}/force"] = -kept["actuator_force"][:, i]
                found[f"{side}/{muscle}/energy"] = kept["act"][:, first + act.energy]
        found["device/torque"] = kept["torque"][:, 0]
        if body.scenario.worn_on == "both":
            found["device/left_torque"] = kept["torque"][:, 2]
        if body.ids is not None:
            for name, chamber in body.ids.chambers.items():
                found[f"chamber/{name}/mass"] = kept["act"][:, int(model.actuator_actadr[chamber])]
        return found
