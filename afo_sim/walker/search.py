"""Gains by search: a gait that walks at a speed, and how a patient would walk, by CMA-ES on a stated cost."""

import contextlib
import dataclasses
import functools
import json
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import SimulationError, as_stored, digest, optional
from afo_sim.common.versions import PACKAGE
from afo_sim.physics import GAINS
from afo_sim.simulation import kept
from afo_sim.walker.body import Body
from afo_sim.walker.bounds import LEAST, MOST
from afo_sim.walker.cost import Cost
from afo_sim.walker.gait import OFFSETS, Vector
from afo_sim.walker.walking import Push, Walked, own_copy, walk_body

POPULATION = 16
SIGMA, LEAST_SIGMA = 0.08, 0.02  # first standard deviation over the value, and at least
ADAPTING = 0.06  # the same of a patient, who begins at a gait that is known
PUSH, PUSHES_FROM, PUSHES_EVERY = 50.0, 3.6, 1.3  # [N], [s]
WALKED, WEAK = 10.0, 8.0  # of a walk, and of one of a drawn body, which is pushed once [s]
HELD_OUT = 12  # walks by which a search is judged at its end
NOISE = 0.02  # standard deviation of each angle of a start [rad]
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


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found."""

    vector: Vector  # mean of the last population
    history: np.ndarray  # of each generation, the cost of its best and its median
    evaluations: int  # gaits that were tried
    parts: dict[str, float]  # of the vector's mean cost, in walks whose pushes no generation had
    walked: Walked  # the first of them that fell, or the first; of the first body
    seconds: float = 0.0  # of a processor, walking

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


def identity(body: Body) -> str:
    """A digest of all that a body is, whatever gait it has walked with."""
    model = own_copy(body).model
    model.actuator_user[body.reflexes, native.REFLEX_ROW.gains :] = 0.0
    content = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    described = json.dumps(as_stored(body.scenario.resolved(), PACKAGE), sort_keys=True)
    return digest(content.tobytes() + described.encode())


def adapt(
    stages: Sequence[Sequence[Body]],
    vector: Vector,
    cost: Cost,
    free: Free,
    *,
    generations: int,
    seed: int = 1,
    threads: int = 2,
    progress: Callable[[int, int, float], None] | None = None,
    drawn: Sequence[Body] = (),
) -> Found:
    """Search gains of bodies by way of stronger ones, since a gait that falls at once teaches nothing."""
    quarter, seconds, first = max(generations // 4, 1), 0.0, vector
    counts = [quarter] * (len(stages) - 1) + [generations]
    one = functools.partial(search, cost=cost, free=free, seed=seed, threads=threads, spread=ADAPTING)
    for k, (bodies, count) in enumerate(zip(stages, counts, strict=True)):

        def told(at: int, _: int, best: float, before: int = quarter * k) -> None:
            if progress is not None:
                progress(before + at, sum(counts), best)

        last = drawn if k == len(stages) - 1 else ()
        found = one(bodies, vector, generations=count, progress=told, drawn=last)
        vector, seconds = found.vector, seconds + found.seconds
    as_first = one(stages[-1], first, generations=0, drawn=drawn)  # whom the first gait carries keeps it
    if sum(as_first.parts.values()) < sum(found.parts.values()):
        found = dataclasses.replace(as_first, history=found.history)
    return dataclasses.replace(found, evaluations=POPULATION * sum(counts), seconds=seconds)


def search(
    bodies: Sequence[Body],
    vector: Vector,
    cost: Cost,
    free: Free,
    *,
    drawn: Sequence[Body] = (),
    generations: int,
    duration: float = WALKED,
    seed: int = 1,
    threads: int = 2,
    spread: float = SIGMA,
    progress: Callable[[int, int, float], None] | None = None,
) -> Found:
    """Search the free numbers of a gait for the least mean cost of bodies, and a drawn one's survival."""
    cma, generator = optional("cma"), np.random.default_rng(seed)
    lower, upper = free.pack(LEAST), free.pack(MOST)
    first = np.clip(free.pack(vector), lower, upper)
    scale = np.maximum(np.abs(first) * spread, LEAST_SIGMA * spread / SIGMA)
    options = {"popsize": POPULATION, "bounds": [(lower - first) / scale, (upper - first) / scale]}
    options |= {"randn": lambda *shape: generator.standard_normal(shape), "seed": math.nan}  # NumPy's stays
    options |= {"verbose": -9, "verb_log": 0, "signals_filename": ""}  # no options from a file that lies here
    evolution = cma.CMAEvolutionStrategy(np.zeros(len(first)), 1.0, options)
    bodies_of = functools.cache(lambda: [[identity(body) for body in each] for each in (bodies, drawn)])
    history, used = list[tuple[float, float]](), 0.0

    def parts(values: np.ndarray, draw: int) -> tuple[dict[str, float], Walked]:
        gait = free.unpack(vector, values)
        pushed = pushes_at(duration, draw) if cost.pushed else ()
        noises = np.random.default_rng([draw, 1]).normal(0.0, NOISE, (2, len(OFFSETS))) * float(cost.pushed)
        walks = [walk_body(own_copy(body), gait, duration, pushed, noises[0]) for body in bodies]
        each = [cost.of(walked, duration) for walked in walks]
        costs = {name: float(np.mean([one[name] for one in each])) for name in each[0]}
        if drawn:
            other, lost = int(np.random.default_rng([draw, 2]).integers(len(drawn))), 1.0
            if walks[0].fell is None:
                fell = walk_body(own_copy(drawn[other]), gait, WEAK, pushed[:1], noises[1], rows=False).fell
                lost -= (fell or WEAK) / WEAK
            costs["weak"] = cost.weak * lost
        return costs, walks[0]

    def safe(task: tuple[np.ndarray, int]) -> tuple[float, float]:
        begun, total = time.thread_time(), math.nan
        with contextlib.suppress(SimulationError):
            total = sum(parts(*task)[0].values())
        return total if math.isfinite(total) else cost.most, time.thread_time() - begun

    def walk_all(tasks: list[tuple[np.ndarray, int]]) -> np.ndarray:
        return kept(
            lambda: (tasks, vector, cost, free, duration, bodies_of()),
            lambda: np.array(list(pool.map(safe, tasks))).T,
        )

    with ThreadPoolExecutor(threads) as pool:
        for generation in range(generations):
            asked = evolution.ask()
            gaits = np.clip(first + scale * np.array(asked), lower, upper)
            costs, seconds = walk_all([(each, generation) for each in gaits])
            evolution.tell(asked, costs.tolist())
            history.append((float(min(costs)), float(np.median(costs))))
            used += float(seconds.sum())
            if progress is not None:
                progress(generation + 1, generations, history[-1][0])
    mean = np.clip(first + scale * np.array(evolution.result.xfavorite), lower, upper)
    judged = []
    for values in (mean, first) if generations else (mean,):  # it never ends worse than it began
        with ThreadPoolExecutor(threads) as pool:  # pushes that no generation had
            draws = [-k % 2**31 for k in range(1, HELD_OUT + 1)]
            held = list(pool.map(functools.partial(parts, values), draws))
        found = {name: float(np.mean([each[name] for each, _ in held])) for name in held[0][0]}
        walked = next((walked for _, walked in held if walked.fell is not None), held[0][1])
        judged.append((sum(found.values()), values, found, walked))
    _, mean, found, walked = min(judged, key=lambda each: each[0])
    return Found(free.unpack(vector, mean), np.array(history), POPULATION * generations, found, walked, used)
