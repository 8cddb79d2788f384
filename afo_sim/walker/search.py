"""Gains by search: a gait that walks at a speed, and how a patient would walk, by CMA-ES on a stated cost."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import GRAVITY, SimulationError, optional
from afo_sim.physics import GAINS, LEG_MUSCLES
from afo_sim.walker.body import Body
from afo_sim.walker.gait import OFFSETS, Vector
from afo_sim.walker.strides import norm_at, off_norm, strides_of
from afo_sim.walker.walking import Push, Walked, own_copy, walk

POPULATION = 16
SIGMA, LEAST_SIGMA = 0.08, 0.02  # first standard deviation over the value, and at least
ADAPTING = 0.06  # the same of a patient, who begins at a gait that is known
PUSH, PUSHES_FROM, PUSHES_EVERY = 50.0, 3.6, 1.3  # [N], [s]
WALKED, WEAK = 10.0, 5.0  # of a walk, and of one of another body [s]
NOISE = 0.02  # standard deviation of each angle of a start [rad]
LOAD = 0.1  # spread between people of the vertical force (assumed) [body weights]
# Gains that a patient changes: of swing, and of what holds the trunk and the knee.
SWING = (
    "iliopsoas_lift", "glutei_lift", "iliopsoas_length", "iliopsoas_offset", "lean_offset", "lean", "stretch",
    "stretch_offset", "hamstrings_force", "glutei_force", "tibialis_swing", "hamstrings_swing", "vasti_swing",
)  # fmt: skip
STANCE = tuple(name for name in GAINS if name not in SWING)
LEAST_GENERATIONS = 30  # of a search that can have converged
SUBSETS = {"swing": SWING, "stance": STANCE, "all": GAINS}
# How much stronger than the patient the first ones are, through whom their gait is searched for.
STRONGER = (0.3, 0.15, 0.07)


@dataclass(frozen=True)
class Cost:
    """What a gait is searched for: the sum of these, each a stated weight times a number."""

    target: float  # speed [m/s]
    fall: float = 150.0  # of the share of the time that is lost by a fall
    speed: float = 60.0  # of the distance from the speed beyond 0.02 m/s [1/(m/s)]
    effort: float = 0.5  # of the muscles' energy per mass and way [J/(kg·m)]
    activation: float = 20.0  # of the mean cube of all activations
    force: float = 200.0  # of the mean load beyond 1.25 body weights
    knee: float = 250.0  # of the mean extension beyond 4° of flexion [1/rad]
    lean: float = 60.0  # of the mean lean of the trunk beyond 3° backward and 7° forward [1/rad]
    norm: float = 0.0  # of the distance from the norm's angles, over 6°, and load, over 0.1 weights
    cadence: float = 0.0  # of the distance of the stride's time from the norm's beyond 4 %
    pushed: bool = True  # ±50 N push the trunk about every 1.3 s, from a drawn start

    def of(self, walked: Walked, duration: float) -> dict[str, float]:
        """The parts of the cost of a walk."""
        time, mass = walked["time"], walked.body.weight / GRAVITY
        late = time > min(1.0, 0.5 * time[-1])
        way = walked["trunk/forward"]
        speed = np.ptp(way[late]) / max(np.ptp(time[late]), 0.1)
        sides = ("right", "left")
        energy = sum(walked[f"{s}/{m}/energy"][-1] for s in sides for m in LEG_MUSCLES)
        activation = np.mean([walked[f"{s}/{m}/activation"] ** 3 for s in sides for m in LEG_MUSCLES])
        lean = np.abs(walked["trunk/pitch"][late] + 0.03) - 0.09
        load = np.array([walked[f"{s}/load"][late] for s in sides]) / walked.body.weight
        straight = np.array([walked[f"{s}/knee"][late] for s in sides]) + math.radians(4.0)
        found = {
            "fall": 0.0 if walked.fell is None else self.fall * (1.0 - time[-1] / duration),
            "speed": self.speed * max(abs(speed - self.target) - 0.02, 0.0),
            "effort": self.effort * energy / (mass * max(way[-1], 1.0)),
            "activation": self.activation * activation,
            "force": self.force * np.mean(np.maximum(load - 1.25, 0.0)),
            "knee": self.knee * np.mean(np.maximum(straight, 0.0)),
            "lean": self.lean * np.mean(np.maximum(lean, 0.0)),
        }
        if self.norm or self.cadence:
            off = np.array([_off(walked, side, self.target) for side in sides]).mean(axis=0)
            found |= {"norm": self.norm * off[0], "cadence": self.cadence * off[1]}
        return {name: float(value) for name, value in found.items()}


def _off(walked: Walked, side: str, speed: float) -> tuple[float, float]:
    """Mean distance of a leg from the norm at a speed, and of its stride's time beyond 4 % [-]."""
    strides, norm = strides_of(walked, side), norm_at(speed)
    if len(strides.duration) < 2:
        return 5.0, 0.3
    load = float(np.sqrt(np.mean((strides.mean("load") - norm["load"]) ** 2))) / LOAD
    time = abs(float(strides.duration.mean() / norm["duration"]) - 1.0)
    return float(np.mean([*off_norm(strides, speed).values(), load])), max(time - 0.04, 0.0)


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found."""

    vector: Vector  # mean of the last population
    history: np.ndarray  # of each generation, the cost of its best and its median
    evaluations: int  # walks
    parts: dict[str, float]  # of the vector's cost, in a walk whose pushes no generation had
    walked: Walked  # that walk

    @property
    def converged(self) -> bool:
        """Whether it walks to the end, and the last third of at least 30 generations gained less than 2 %."""
        best = np.minimum.accumulate(self.history[:, 1])
        if len(best) < LEAST_GENERATIONS or self.walked.fell is not None:
            return False
        before = best[-len(best) // 3]
        return bool(before - best[-1] < 0.02 * before)


@dataclass(frozen=True)
class Free:
    """Which numbers of a gait a search changes: gains of each leg by name, and the first pose."""

    names: tuple[str, ...] = GAINS
    pose: bool = True
    alike: bool = False

    def pack(self, vector: Vector) -> np.ndarray:
        """The free numbers of a gait (n,)."""
        columns = [GAINS.index(name) for name in self.names]
        legs = vector.gains[:1] if self.alike else vector.gains
        return np.concatenate([vector.offsets if self.pose else [], legs[:, columns].ravel()])

    def unpack(self, vector: Vector, values: np.ndarray) -> Vector:
        """The gait with other free numbers."""
        columns, count = [GAINS.index(name) for name in self.names], len(OFFSETS) if self.pose else 0
        gains = vector.gains.copy()
        gains[:, columns] = values[count:].reshape(1 if self.alike else 2, -1)
        return dataclasses.replace(vector, gains=gains, offsets=values[:count] if count else vector.offsets)


def pushes_at(duration: float, seed: int) -> tuple[Push, ...]:
    """As many forward as backward pushes, at drawn moments."""
    draw = np.random.default_rng(seed)
    times = np.arange(PUSHES_FROM, duration - 0.5, PUSHES_EVERY)
    times = times + draw.uniform(-0.5, 0.5, len(times))
    forces = draw.permutation(np.resize([PUSH, -PUSH], len(times)))
    return tuple(Push(float(t), float(force)) for t, force in zip(times, forces, strict=True))


def adapt(
    stages: Sequence[Body],
    vector: Vector,
    cost: Cost,
    free: Free,
    *,
    generations: int,
    seed: int = 1,
    threads: int = 2,
    progress: Callable[[int, int, float], None] | None = None,
) -> Found:
    """Search gains of a body by way of stronger ones, since a gait that falls at once teaches nothing."""
    quarter = max(generations // 4, 1)
    all_of, before, found = quarter * (len(stages) - 1) + generations, 0, None
    for body in stages:
        count = generations if body is stages[-1] else quarter

        def told(k: int, _: int, best: float, before: int = before) -> None:
            if progress is not None:
                progress(before + k, all_of, best)

        found = search(
            [body],
            vector if found is None else found.vector,
            cost,
            free,
            generations=count,
            seed=seed,
            threads=threads,
            spread=ADAPTING,
            progress=told,
        )
        before += count
    assert found is not None
    return dataclasses.replace(found, evaluations=POPULATION * all_of)


def search(
    bodies: Sequence[Body],
    vector: Vector,
    cost: Cost,
    free: Free,
    *,
    generations: int,
    duration: float = WALKED,
    seed: int = 1,
    threads: int = 2,
    spread: float = SIGMA,
    progress: Callable[[int, int, float], None] | None = None,
) -> Found:
    """Search the free numbers of a gait for the least cost."""
    cma = optional("cma")
    first = free.pack(vector)
    scale = np.maximum(np.abs(first) * spread, LEAST_SIGMA * spread / SIGMA)
    options = {"popsize": POPULATION, "seed": seed, "verbose": -9, "verb_log": 0}
    evolution = cma.CMAEvolutionStrategy(np.zeros(len(first)), 1.0, options)
    history = []

    def parts(values: np.ndarray, draw: int) -> tuple[dict[str, float], Walked]:
        gait = free.unpack(vector, values)
        pushed = pushes_at(duration, draw) if cost.pushed else ()
        noises = np.random.default_rng([draw, 1]).normal(0.0, NOISE, (len(bodies), len(OFFSETS)))
        noises *= float(cost.pushed)
        walked = walk(own_copy(bodies[0]), gait, duration, pushed, noises[0])
        found = cost.of(walked, duration)
        for other, noise in zip(bodies[1:], noises[1:], strict=True):
            lost = 1.0
            if walked.fell is None:
                lost -= walk(own_copy(other), gait, WEAK, (), noise)["time"][-1] / WEAK
            found["weak"] = found.get("weak", 0.0) + 20.0 * float(lost)
        return found, walked

    def safe(task: tuple[np.ndarray, int]) -> float:
        try:
            return sum(parts(*task)[0].values())
        except SimulationError:
            return 2.0 * cost.fall

    with ThreadPoolExecutor(threads) as pool:
        for generation in range(generations):
            asked = evolution.ask()
            costs = list(pool.map(safe, [(first + scale * values, generation) for values in asked]))
            evolution.tell(asked, costs)
            history.append((min(costs), float(np.median(costs))))
            if progress is not None:
                progress(generation + 1, generations, min(costs))
    mean: Any = first + scale * evolution.mean
    found, walked = parts(mean, -1 % 2**31)
    return Found(free.unpack(vector, mean), np.array(history), POPULATION * generations, found, walked)
