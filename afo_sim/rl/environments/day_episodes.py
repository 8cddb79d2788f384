"""Days of many patients: every simulation a patient of its own, seen through its own sensors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.model import ACTIVE, GROUND, JOINTS, SPASTIC, STIFFNESS
from afo_sim.rl.environments.day import AHEAD, STRIDE, UPWARD, Day, day_of
from afo_sim.rl.environments.episodes import Drawn, Random, Remembering, Rows, Seen, Setting, rows_of
from afo_sim.rl.environments.patients import DELAYS, USUAL
from afo_sim.rl.environments.reward import PARTS, Events, Strides
from afo_sim.simulation import NARROWEST

CLOSES, OPENS = 35.0, 25.0  # load of a foot switch: 30 N parted by 10, as of `sensors/fsr_footswitch` [N]


@dataclass(frozen=True, eq=False)
class DaySetting(Setting):
    """A task of days: its patients, compiled when first drawn."""

    start: Day
    sets: Mapping[str, Any]
    numbers: Sequence[int]
    days: dict[int, Day] = field(default_factory=dict)

    def start_of(self, number: int) -> Day:
        """The day of a patient, compiled once."""
        if number == USUAL:
            return self.start
        if number not in self.days:
            self.days[number] = day_of(number, self.task, self.sets)
        return self.days[number]

    def draw(self, random: Random) -> Drawn:
        """A patient's day, and the noise of its sensors at every sample (periods + 1, n_observed)."""
        chosen, seed = random.uniform(0.0, 1.0, size=2)
        day = self.start_of(self.numbers[int(chosen * len(self.numbers))])
        shape = len(day.table), self.ranges.shape[1]
        return day, np.random.default_rng(int(seed * 2**53)).normal(0.0, day.sensors.noise, shape)

    def view(self, count: int) -> "Watch":
        """What sees some simulations."""
        return Watch(self, count)


class Watch(Remembering):
    """What sensors and the verdict see of some simulations of days, sample after sample."""

    _memory = (
        *("strides", "tables", "noise", "shapes", "offset", "delay"),
        *("taken", "past", "mass", "closed", "coils"),
    )

    def __init__(self, setting: DaySetting, count: int = 1):
        built, samples, width = setting.built, len(setting.start.table), setting.ranges.shape[1]
        model, index, toes = built.model, built.index, built.scenario.leg.toes
        names = [*JOINTS[1:], *([] if toes is None else [toes.joint])]
        self.places = [int(model.joint(name).qposadr[0]) for name in names]
        self.turns = int(model.joint(JOINTS[2]).dofadr[0])
        numbers = np.arange(model.na), np.arange(model.nuserdata)
        air = [native.read_air(model, *numbers, k) for k in index.chambers.values()]
        self.masses, self.pressures = [int(a.mass) for a in air], [int(a.absolute_pressure) for a in air]
        self.others = [index.passive, *(index.walking[name] for name in (ACTIVE, STIFFNESS, SPASTIC, GROUND))]
        self.ankle, self.dof = index.ankle_qpos, index.ankle_dof
        self.ranges, self.strides = setting.ranges, Strides(count)
        self.tables, self.noise = np.zeros((count, samples, 5)), np.zeros((count, samples, width))
        self.shapes, self.offset = np.zeros((12, count)), np.zeros((count, width))
        self.delay, self.taken = np.zeros(count, int), np.zeros(count, int)
        self.past, self.mass = np.zeros((DELAYS, count, width)), np.zeros((len(air), count))
        self.closed, self.coils = np.zeros((count, 2), bool), np.zeros((count, 2 * len(air)))

    def begin(self, ids: np.ndarray, drawn: Sequence[Drawn]) -> np.ndarray:
        """Begin episodes; what is seen of their starts (n, n_observed)."""
        days: list[Day] = [day for day, _ in drawn]  # type: ignore[misc]
        self.tables[ids], self.noise[ids] = [day.table for day in days], [noise for _, noise in drawn]
        self.shapes[:, ids] = np.stack([day.shape for day in days], axis=1)
        self.offset[ids], self.delay[ids] = [d.sensors.offset for d in days], [d.sensors.delay for d in days]
        self.taken[ids], self.closed[ids], self.coils[ids] = 0, False, 0.0
        rows = rows_of(drawn)
        self.mass[:, ids] = rows["act"][self.masses]
        self.strides.begin(
            ids, np.array([day.scale for day in days]), self.events(ids, rows, np.zeros(len(ids)))
        )
        self.past[:, ids] = self._felt(ids, rows)
        return self._reported(ids)

    def see(self, ids: np.ndarray, rows: Rows, coils: np.ndarray) -> Seen:
        """The next samples, and the weighted parts of the reward."""
        self.taken[ids] += 1
        switched = (coils > self.coils[ids]).sum(axis=1)
        self.coils[ids] = coils
        parts = self.strides.pay(ids, self.events(ids, rows, switched))
        self.past[1:, ids] = self.past[:-1, ids]
        self.past[0, ids] = self._felt(ids, rows)
        return self._reported(ids), parts.sum(axis=0), dict(zip(PARTS, parts, strict=True))

    def _at(self, ids: np.ndarray, of: np.ndarray) -> np.ndarray:
        """What belongs to the present samples (width, n)."""
        return np.asarray(of[ids, np.minimum(self.taken[ids], of.shape[1] - 1)].T)

    def events(self, ids: np.ndarray, rows: Rows, switched: np.ndarray) -> Events:
        """What the present samples say of the strides."""
        table, qpos, shape = self._at(ids, self.tables), rows["qpos"], self.shapes[:, ids]
        pitch = qpos[self.ankle] - qpos[self.places[1]]
        toes = pitch if len(self.places) < 3 else pitch + qpos[self.places[2]]
        (ball, hinge), (pulp, tip) = (
            [shape[k] * np.sin(angle) + shape[k + 1] * np.cos(angle) for k in pair]
            for angle, pair in ((pitch, (2, 4)), (toes, (6, 8)))
        )
        torque = rows["qfrc_actuator"][self.dof] - np.add.reduce(rows["actuator_force"][self.others])
        mass = rows["act"][self.masses]
        gained = np.add.reduce(np.maximum(mass - self.mass[:, ids], 0.0))
        self.mass[:, ids] = mass
        height = qpos[self.places[0]] + np.minimum(ball, hinge + np.minimum(pulp, tip))
        facts = (qpos[self.ankle], height, pitch - shape[10], torque / shape[11], gained, switched)
        return Events._make((*table[: STRIDE + 1], *facts))

    def _felt(self, ids: np.ndarray, rows: Rows) -> np.ndarray:
        """What the sensors' elements have now, without delay and noise (n, n_observed)."""
        table, qpos, shape = self._at(ids, self.tables), rows["qpos"], self.shapes[:, ids]
        pitch = qpos[self.ankle] - qpos[self.places[1]]
        heel, ball = (shape[k] * np.cos(pitch) - shape[k + 1] * np.sin(pitch) for k in (0, 2))
        share = (table[AHEAD] - heel) / np.maximum(ball - heel, NARROWEST)
        toe = table[UPWARD] * np.minimum(np.maximum(share, 0.0), 1.0)
        load = np.stack([table[UPWARD] - toe, toe], axis=1)
        self.closed[ids] = load > np.where(self.closed[ids], OPENS, CLOSES)
        gauge = rows["userdata"][self.pressures] - AMBIENT_PRESSURE
        felt = [qpos[self.places[1]], rows["qvel"][self.turns], *self.closed[ids].T, *gauge]
        return np.stack(felt, axis=1) + self.offset[ids]

    def _reported(self, ids: np.ndarray) -> np.ndarray:
        found = self.past[self.delay[ids], ids] + self._at(ids, self.noise).T
        return np.clip(found, *self.ranges)
