"""Cases for the foot with toes under the recorded force: a scenario's stride and outsole, computed apart."""

from dataclasses import dataclass

import numpy as np
from laws_of_nature.own_length_case import device_of, ground_moment, size_of, start_at, state_at, walked
from laws_of_nature.own_length_reference import Solution, solve
from laws_of_nature.toe_reference import GRAVITY, Point, Sole, series, shod, smoothed

import afo_sim
from afo_sim.common import assets
from afo_sim.gait import GaitCycle
from afo_sim.gait import file as gait_file
from afo_sim.model import Built, person_of
from afo_sim.simulation import Recording

STACKS = ("heel_stack", "ball_stack", "heel_behind", "tip_ahead", "toe_spring")


@dataclass(frozen=True, eq=False)
class Compared:
    """One stride of a run, `rows` of it, and the separate solution of that stride."""

    built: Built
    run: Recording
    rows: slice
    found: Solution

    def __getitem__(self, column: str) -> np.ndarray:
        """A column of the run over the stride (n,)."""
        return self.run[column][self.rows]

    @property
    def heights(self) -> dict[str, np.ndarray]:
        """Of the outsole's points over the stride, from the separate angles and the recorded walking [m]."""
        return heights(self.built, self.found.time, self.found.angle, self.found.extension)


def compared(scenario: str, sets: dict[str, object], strides: int) -> Compared:
    """Run a scenario, and solve the stride after so many strides from its recorded state."""
    described = afo_sim.load("scenario", scenario).set({"reference": None, "ground.mode": "recorded"} | sets)
    built, run = afo_sim.build(described), afo_sim.run(described)
    assert run.ok
    time, stride = run["time"], Stride.of(built).time
    first = int(np.searchsorted(time, strides * stride)) + 2  # the rate's four neighbours are this stride's
    rows = slice(first, min(first + round(stride / (time[1] - time[0])) + 1, len(time)))
    assert time[rows][-1] - time[rows][0] > 0.99 * stride
    device, drive = device_of(built), walked(built, time[rows][0], time[rows][-1])
    return Compared(built, run, rows, solve(device, drive, state_at(built, run, first), time[rows]))


@dataclass(frozen=True, eq=False)
class Stride:
    """The recorded stride as it was read, not yet on this leg, and what makes it the person's.

    A person who is `taller` by a factor walks by it longer in all places and by its root longer in time.
    """

    recorded: GaitCycle
    taller: float
    time: float  # of a stride [s]

    @classmethod
    def of(cls, built: Built) -> "Stride":
        """Of a built scenario."""
        scenario = built.scenario
        recorded = gait_file.read(assets.find_gait(scenario.gait.cycle))
        height = recorded.body_height or scenario.leg.body_height
        taller = person_of(scenario).body_height / height
        return cls(recorded, taller, scenario.gait.stride_time or recorded.stride_time * taller**0.5)

    def signal(self, name: str, time: np.ndarray) -> np.ndarray:
        """A recorded angle [rad] or place [m] at times [s] from a heel strike (n,)."""
        return self.recorded.signal(name, time / self.time) * (self.taller if "angle" not in name else 1.0)

    def ankle_height(self, built: Built, time: np.ndarray) -> np.ndarray:
        """Height of the person's ankle over time [m] (n,).

        The body is higher by what is worn under the ankle, vertically. What then lacks for the outsole to
        stand on the floor with the foot flat is along the shank. The samples so moved are smoothed by the
        recording's harmonics, a drift taken out. The phases at which the foot is flat are the program's.
        """
        sole, gait, flat = sole_of(built), built.scenario.gait, built.walk.cycle.flat
        phase = self.recorded.phase
        stands = (phase >= flat.start - 1e-9) & (phase <= flat.end + 1e-9)
        shank = self.recorded.shank_angle[stands]
        pitch = self.recorded.ankle_angle[stands] - shank + gait.ankle_offset + sole.level
        bent = sole.heights(np.zeros_like(pitch), pitch, np.zeros_like(pitch))
        lowest = np.minimum(bent["heel"], bent["ball"])  # toes give way
        recorded_sole = gait.sole_thickness or self.recorded.sole_thickness or 0.0
        thicker = stack_of(built) - self.taller * recorded_sole
        lacking = np.mean(-lowest - self.taller * self.recorded.ankle_z[stands]) - thicker
        further = lacking / np.mean(np.cos(shank))
        moved = self.taller * self.recorded.ankle_z + thicker + further * np.cos(self.recorded.shank_angle)
        assert np.ptp(np.diff(phase)) < 1e-6
        moved = moved - (moved[-1] - moved[0]) * (phase - 0.5)
        return series(smoothed(moved[:-1], self.recorded.harmonics), time / self.time)


def stack_of(built: Built) -> float:
    """Thickness of what is worn, under the ankle, between those under heel and ball [m]."""
    outsole = built.scenario.orthosis.outsole or built.scenario.shoe
    if outsole is None:
        return 0.0
    taller = 1.0 if built.scenario.orthosis.outsole else size_of(built)[1]
    sole = sole_of(built)
    stacks = [taller * outsole.heel_stack, taller * outsole.ball_stack]
    return float(np.interp(0.0, [sole.heel[0], sole.ball[0]], stacks))


def sole_of(built: Built) -> Sole:
    """Of what the foot stands on: the leg's own sites, the outsole as described, a shoe the person's size."""
    model, leg = built.model, built.scenario.leg
    ankle, toes = model.joint("ankle").pos, model.body(leg.toes.body)

    def at(name: str) -> tuple[float, float]:
        site = model.site(name)
        place = site.pos - ankle + (toes.pos if site.bodyid[0] == toes.id else 0.0)
        return float(place[0]), float(place[2])

    hinge = toes.pos + model.joint(leg.toes.joint).pos - ankle
    bare = Sole(at("heel"), at("ball"), at("pulp"), at("tip"), (float(hinge[0]), float(hinge[2])))
    outsole = built.scenario.orthosis.outsole or built.scenario.shoe
    if outsole is None:
        return bare
    taller = 1.0 if built.scenario.orthosis.outsole else size_of(built)[1]
    return shod(bare, {name: taller * getattr(outsole, name) for name in STACKS})


def heights(
    built: Built, time: np.ndarray, angle: np.ndarray, extension: np.ndarray
) -> dict[str, np.ndarray]:
    """Of the outsole's points above the floor [m] (n,), and of the lowest of all as "sole"."""
    stride, sole = Stride.of(built), sole_of(built)
    ankle = stride.ankle_height(built, time)
    found = sole.heights(ankle, angle - stride.signal("shank_angle", time), extension)
    return found | {
        "toe": np.minimum(found["pulp"], found["tip"]),
        "sole": np.minimum.reduce(list(found.values())),
    }


def from_the_start(built: Built, time: np.ndarray) -> Solution:
    """A bare or shod foot from heel strike: ankle as recorded, toes where they rest."""
    drive = walked(built, time[0], time[-1])
    return solve(device_of(built), drive, start_at(built, drive, sole_of(built).level), time)


def healthy_angle(built: Built, time: np.ndarray) -> np.ndarray:
    """The recorded ankle angle, turned by the drop of the outsole [rad] (n,)."""
    return Stride.of(built).signal("ankle_angle", time) + sole_of(built).level


def needed_moment(built: Built, time: np.ndarray) -> np.ndarray:
    """Ankle moment that the recorded motion needs, with the toes where they rest [N·m] (n,).

    Angles and places are tables at even times, of which the momentum takes second differences.
    """
    cycle, step = built.walk.cycle, time[1] - time[0]
    fine = np.concatenate([[time[0] - step], time, [time[-1] + step]])
    phase, drive = fine / Stride.of(built).time, walked(built, fine[0], fine[-1])
    toes = device_of(built).foot.toes
    share = toes.stiffness / (toes.stiffness + toes.sole_stiffness)
    motion = Motion(
        healthy_angle(built, fine) - cycle.signal("shank_angle", phase),
        share * np.array([drive.around(at).toe_rest for at in fine]),
        (cycle.signal("ankle_x", phase), cycle.signal("ankle_z", phase)),
    )
    ground = ground_moment(cycle, phase[1:-1] % 1.0) * built.body_mass
    return motion.turned_by(built, step) - ground


@dataclass(frozen=True, eq=False)
class Motion:
    """Pitch of the foot and extension of its toes [rad] (n,), place of the ankle, forward and up [m] (n,)."""

    pitch: np.ndarray
    extension: np.ndarray
    ankle: tuple[np.ndarray, np.ndarray]

    @classmethod
    def of(cls, run: Recording) -> "Motion":
        """Of a run, at its rows."""
        pitch = run["ankle/angle"] - run["shank/angle"]
        return cls(pitch, run["toe/extension"], (run["ankle/position/x"], run["ankle/position/z"]))

    def turned_by(self, built: Built, step: float) -> np.ndarray:
        """Moment about the ankle that moves the foot so, its weight borne, by second differences (n − 2,)."""
        foot = device_of(built).foot
        toes = foot.toes
        bent = self.pitch + self.extension
        hind, hinge, centre = (
            along(point, angle)
            for point, angle in ((foot.centre, self.pitch), (toes.hinge, self.pitch), (toes.centre, bent))
        )
        own = foot.inertia - foot.mass * (foot.centre[0] ** 2 + foot.centre[1] ** 2)
        moment = (own * np.diff(self.pitch, 2) + toes.inertia * np.diff(bent, 2)) / step**2
        for mass, (x, z) in ((foot.mass, hind), (toes.mass, (hinge[0] + centre[0], hinge[1] + centre[1]))):
            ahead, upward = (np.diff(a + b, 2) / step**2 for a, b in zip(self.ankle, (x, z), strict=True))
            moment += mass * (x[1:-1] * (upward + GRAVITY) - z[1:-1] * ahead)
        return moment


def along(point: Point, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point turned toe up by angles [rad] (n,)."""
    return (
        point[0] * np.cos(angle) - point[1] * np.sin(angle),
        point[0] * np.sin(angle) + point[1] * np.cos(angle),
    )
