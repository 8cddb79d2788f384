"""The table of controllers in docs/environments.md: scores on training and held-out patients, by parts.

    python scripts/leaderboard.py            # evaluate what leaderboard.json holds, and print the table
    python scripts/leaderboard.py --write    # write it into docs/environments.md and leaderboard.json
    python scripts/leaderboard.py --tune learnt --seconds 400    # tune one anew; also pid, constant, oracle

Every number follows from the seeds here. A held-out patient is looked at by nobody but the oracle.
"""

import argparse
import json
import math
import pathlib
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import cma
import numpy as np

from afo_sim.control import FootSwitch, Machine, Transition
from afo_sim.control.state_machine import advance
from afo_sim.rl.environments.day import Day
from afo_sim.rl.environments.day_episodes import DaySetting
from afo_sim.rl.environments.episodes import Episodes
from afo_sim.rl.environments.patients import POOLS
from afo_sim.rl.environments.reward import PARTS
from afo_sim.rl.environments.tasks import setting_of

HERE = pathlib.Path(__file__)
KEPT, PAGE = HERE.with_suffix(".json"), HERE.parents[1] / "docs" / "environments.md"
BEGIN, END = "<!-- leaderboard: begin -->", "<!-- leaderboard: end -->"
ANGLE, RATE, HEEL, TOE, PRESSURE = range(5)  # of the observation
BAR, PERIOD = 1e5, 0.01
FILL, VENT, SHUT = 1.0, -1.0, 0.0
Controller = Callable[[np.ndarray, int], np.ndarray]  # (n, n_observed), number of the period → (n, n_chamber)


def rolled(made: DaySetting, numbers: Sequence[int], controller: Controller) -> np.ndarray:
    """Parts of the score of the days of patients (5, n); noise is drawn by the patient's number."""
    drawn = []
    for number in numbers:
        day = made.start_of(number)
        normal = np.random.default_rng([number, 3]).standard_normal((len(day.table), len(made.task.observed)))
        drawn.append((day, normal * day.sensors.noise))
    ids = range(len(numbers))
    episodes = Episodes(made, len(numbers))
    try:
        seen, total = episodes.begin_drawn(ids, drawn), np.zeros((len(PARTS), len(numbers)))
        for period in range(made.task.periods):
            outcome = episodes.step(ids, controller(seen, period))
            seen, total = outcome.observation, total + np.array(list(outcome.parts.values()))
        assert not episodes.stepped.failures, episodes.stepped.failures
    finally:
        episodes.close()
    return total / np.array([day.strikes for day, _ in drawn])


# --- controllers: each is given the number of simulations, and its parameters; the heel muscles are vented


def both(dorsiflexor: np.ndarray, plantarflexor: float = VENT) -> np.ndarray:
    """An action of both chambers (n, 2)."""
    return np.stack([dorsiflexor, np.full(len(dorsiflexor), plantarflexor)], axis=1)


def constant(n: int, values: Sequence[float]) -> Controller:
    """The same action always."""
    return lambda seen, period: both(np.full(n, values[0]), values[1])


def timer(n: int, values: Sequence[float]) -> Controller:
    """A clock of the scenario's own intervals and mean stride, which runs on in a stop."""
    stride, fill, filled, vent, vented = values

    def act(seen: np.ndarray, period: int) -> np.ndarray:
        share = period * PERIOD / stride % 1.0
        on = FILL if fill <= share < filled else VENT if vent <= share < vented else SHUT
        return both(np.full(n, on))

    return act


SWING, STANCE, STANDING = range(3)
MACHINE = Machine(
    states=("swing", "stance", "standing"),
    start=STANDING,
    commands=({}, {}, {}),
    transitions=(
        Transition(SWING, STANCE, "heel", True, 0.5, 0.15),
        Transition(
            STANCE, SWING, "rate", True, math.radians(60.0), 0.3
        ),  # the shank falls forward: heel rise
        Transition(STANCE, STANDING, "state_time", True, 1.5, 0.0),
        Transition(SWING, STANDING, "state_time", True, 1.5, 0.0),
        Transition(STANDING, SWING, "rate", True, math.radians(60.0), 0.0),
    ),
)


def state_machine(n: int, values: Sequence[float]) -> Controller:
    """The product's machine on gyro and heel switch: fills from heel rise to heel strike, vents in stance."""
    state, ticks = [MACHINE.start] * n, [0] * n
    commands = np.array([FILL, VENT, VENT])

    def act(seen: np.ndarray, period: int) -> np.ndarray:
        for k in range(n):
            known = {"heel": seen[k, HEEL], "rate": seen[k, RATE]}
            new = advance(MACHINE, state[k], round(ticks[k] * PERIOD, 9), known)
            ticks[k] = 1 if new != state[k] else ticks[k] + 1
            state[k] = new
        return both(commands[state])

    return act


def gait_phase(n: int, values: Sequence[float]) -> Controller:
    """The product's estimate of the phase by the heel switch, the scenario's intervals; vents in doubt."""
    fill, filled, vent, vented = values
    switches = [FootSwitch(0.5) for _ in range(n)]

    def act(seen: np.ndarray, period: int) -> np.ndarray:
        found = np.full(n, VENT)
        for k, switch in enumerate(switches):
            switch.update(seen[k, HEEL], PERIOD)
            if switch.ready:
                phase = switch.phase % 1.0
                found[k] = FILL if fill <= phase < filled else VENT if vent <= phase < vented else SHUT
        return both(found)

    return act


def pid(n: int, values: Sequence[float]) -> Controller:
    """PID on the pressure, about one set point [bar]; the coils' dead zone switches."""
    wanted, proportional, integral, differential = values
    memory, last = np.zeros(n), np.zeros(n)

    def act(seen: np.ndarray, period: int) -> np.ndarray:
        error = wanted - seen[:, PRESSURE] / BAR
        memory[:] = np.clip(memory + error * PERIOD, -1.0, 1.0)
        rate = (error - last) / PERIOD if period else np.zeros(n)
        last[:] = error
        return both(np.clip(proportional * error + integral * memory + differential * rate, -1.0, 1.0))

    return act


def features(seen: np.ndarray) -> np.ndarray:
    """Of the linear policy (n, 6)."""
    scaled = seen[:, :5] * np.array([2.0, 0.3, 1.0, 1.0, 1.0 / (3.0 * BAR)])
    return np.concatenate([np.ones((len(seen), 1)), scaled], axis=1)


def linear(n: int, values: Any) -> Controller:
    """tanh of weights on what the sensors see, or one row of weights for each simulation."""
    weights = np.broadcast_to(np.asarray(values, float), (n, 6))
    return lambda seen, period: both(np.tanh((features(seen) * weights).sum(axis=1)))


def oracle(days: Sequence[Day], values: np.ndarray) -> Controller:
    """Told the true phase and the patient's own best numbers: see `ORACLE_LOW`."""
    begin, high, vent, low, stands = np.asarray(values, float).T
    high = high * BAR
    low, stands = np.minimum(low * BAR, high - 0.15 * BAR), np.minimum(stands * BAR, high)
    walks = [day.built.walk for day in days]
    steps = round(PERIOD / days[0].built.scenario.timestep)
    at = np.maximum(np.arange(len(days[0].table)) * steps - 1, 0) + 1
    phase = np.array([walk.phase[at] % 1.0 for walk in walks])  # type: ignore[union-attr]
    walking = np.array([walk.walking[at] > 0.0 for walk in walks])  # type: ignore[union-attr]

    def act(seen: np.ndarray, period: int) -> np.ndarray:
        now, walk, pressure = phase[:, period], walking[:, period], seen[:, PRESSURE]
        fill = np.where(walk, (now >= begin) & (pressure < high), pressure < stands)
        empty = np.where(
            walk, (now >= vent) & (now < begin) & (pressure > low), pressure > stands + 0.2 * BAR
        )
        return both(1.0 * fill - 1.0 * empty)

    return act


# phase of filling, to what pressure [bar], phase of venting, to what [bar], pressure in standing [bar]
ORACLE_LOW, ORACLE_HIGH = np.array([0.3, 0.5, 0.0, 0.0, 0.0]), np.array([0.75, 5.0, 0.45, 4.0, 4.0])
ORACLE_START = np.array([0.5, 2.5, 0.15, 1.8, 2.0])
INTERVALS = (0.50, 0.95, 0.15, 0.45)  # of walk-dropfoot-afo
FIXED: dict[str, tuple[Callable[[int, Any], Controller], Any]] = {
    "shut": (constant, (SHUT, SHUT)),
    "fixed timer": (timer, (1.2, *INTERVALS)),
    "state machine": (state_machine, ()),
    "gait phase": (gait_phase, INTERVALS),
}
TUNED: dict[str, Callable[[int, Any], Controller]] = {"constant": constant, "pid": pid, "learnt": linear}


# --- tuning, on training patients


def tune_constant(made: DaySetting, seconds: float) -> dict[str, Any]:
    """The best of all nine."""
    pairs = [(a, b) for a in (VENT, SHUT, FILL) for b in (VENT, SHUT, FILL)]
    scores = [rolled(made, POOLS["training"][:16], constant(16, pair)).sum(axis=0).mean() for pair in pairs]
    return {
        "values": pairs[int(np.argmax(scores))],
        "all": [[*p, float(s)] for p, s in zip(pairs, scores, strict=True)],
    }


def tune_pid(made: DaySetting, seconds: float) -> dict[str, Any]:
    """The best of a grid of set points and gains on 16 patients."""
    gains = ((2.0, 0.0, 0.0), (5.0, 1.0, 0.1))
    grid = [(wanted, *gain) for wanted in (1.6, 1.9, 2.2, 2.5, 2.8, 3.1) for gain in gains]
    parts = [pid(16, values) for values in grid]

    def act(seen: np.ndarray, period: int) -> np.ndarray:
        return np.concatenate([one(seen[16 * k : 16 * k + 16], period) for k, one in enumerate(parts)])

    scores = rolled(made, list(range(16)) * len(grid), act).sum(axis=0).reshape(-1, 16).mean(axis=1)
    return {
        "values": grid[int(np.argmax(scores))],
        "all": [[*g, round(float(s), 4)] for g, s in zip(grid, scores, strict=True)],
    }


def tune(
    made: DaySetting,
    seconds: float,
    kind: Callable[[int, Any], Controller],
    start: Sequence[float],
    spread: float,
) -> dict[str, Any]:
    """CMA-ES, each generation of 10 on 12 patients drawn anew, until the processor's time is up."""
    search = cma.CMAEvolutionStrategy(list(start), spread, {"seed": 1, "popsize": 10, "verbose": -9})
    random, begun, curve = np.random.default_rng(1), time.process_time(), []
    while time.process_time() - begun < seconds:
        asked, chosen = search.ask(), random.choice(POOLS["training"], 12, replace=False).tolist()
        parts = [kind(12, values) for values in asked]

        def act(seen: np.ndarray, period: int) -> np.ndarray:
            return np.concatenate([one(seen[12 * k : 12 * k + 12], period) for k, one in enumerate(parts)])  # noqa: B023

        scores = rolled(made, chosen * 10, act).sum(axis=0).reshape(10, 12).mean(axis=1)
        search.tell(asked, (-scores).tolist())
        curve.append(
            [
                round(time.process_time() - begun, 1),
                round(float(scores.mean()), 4),
                round(float(scores.max()), 4),
            ]
        )
        print(len(curve), *curve[-1], np.round(search.mean, 3).tolist(), flush=True)
    days = 120 * len(curve)
    return {
        "values": search.mean.tolist(), "curve": curve, "days": days, "periods": days * made.task.periods,
        "cpu_seconds": round(time.process_time() - begun),
    }  # fmt: skip


def tune_oracle(made: DaySetting, seconds: float) -> dict[str, Any]:
    """A search on each patient: the best of three generations of 16 by the cross-entropy method."""
    found: dict[str, list[float]] = {}
    random, begun, size = np.random.default_rng(2), time.process_time(), 16
    span = ORACLE_HIGH - ORACLE_LOW
    pool = [*POOLS["held-out"], *POOLS["training"][:16]]
    for first in range(0, len(pool), 16):
        group = pool[first : first + 16]
        mean, spread = np.tile(ORACLE_START, (16, 1)), np.tile(0.3 * span, (16, 1))
        best, value = np.full(16, -np.inf), np.zeros((16, 5))
        numbers = [number for number in group for _ in range(size)]
        days = [made.start_of(number) for number in numbers]
        for _ in range(3):
            tried = mean[:, None] + spread[:, None] * random.standard_normal((16, size, 5))
            tried = np.clip(tried, ORACLE_LOW, ORACLE_HIGH)
            scores = rolled(made, numbers, oracle(days, tried.reshape(-1, 5))).sum(axis=0).reshape(16, size)
            for k in range(16):
                order = np.argsort(-scores[k])
                if scores[k, order[0]] > best[k]:
                    best[k], value[k] = scores[k, order[0]], tried[k, order[0]]
                mean[k], spread[k] = (
                    tried[k, order[:5]].mean(axis=0),
                    tried[k, order[:5]].std(axis=0) + 0.02 * span,
                )
        found |= {str(number): value[k].round(4).tolist() for k, number in enumerate(group)}
        print("oracle", first, best.mean(), round(time.process_time() - begun), flush=True)
    return {"values": found, "cpu_seconds": round(time.process_time() - begun)}


TUNERS: dict[str, Callable[[DaySetting, float], dict[str, Any]]] = {
    "constant": tune_constant,
    "pid": tune_pid,
    "learnt": lambda made, seconds: tune(made, seconds, linear, (1.5, 0.0, 0.0, 0.0, 0.0, -2.0), 0.5),
    "oracle": tune_oracle,
}


# --- the table


def interval(values: np.ndarray) -> list[float]:
    """Mean, and its 95 % interval by 10,000 bootstraps over patients."""
    draws = np.random.default_rng(0).integers(len(values), size=(10_000, len(values)))
    low, high = np.quantile(values[draws].mean(axis=1), (0.025, 0.975))
    return [round(float(one), 3) for one in (values.mean(), low, high)]


def evaluate(made: DaySetting, kept: Mapping[str, Any]) -> dict[str, Any]:
    """Scores of all controllers by pool."""
    found: dict[str, Any] = {}
    for pool, all_numbers in POOLS.items():
        numbers = list(all_numbers) if pool == "held-out" else list(all_numbers)[:16]
        count, parts = len(numbers), {}
        for name, (kind, values) in FIXED.items():
            parts[name] = rolled(made, numbers, kind(count, values))
        for name, kind in TUNED.items():
            if name in kept:
                parts[name] = rolled(made, numbers, kind(count, kept[name]["values"]))
        if "oracle" in kept:
            values = np.array([kept["oracle"]["values"][str(number)] for number in numbers])
            parts["oracle"] = rolled(
                made, numbers, oracle([made.start_of(number) for number in numbers], values)
            )
        found[pool] = {
            name: {
                "score": interval(p.sum(axis=0)),
                "parts": dict(zip(PARTS, p.mean(axis=1).round(3).tolist(), strict=True)),
            }
            for name, p in parts.items()
        }
        if {"oracle", "constant"} <= parts.keys():
            found[pool]["oracle minus constant"] = interval((parts["oracle"] - parts["constant"]).sum(axis=0))
    return found


def table(found: Mapping[str, Any]) -> str:
    """As Markdown."""
    lines = [
        "| controller | training | held out, 95 % | " + " | ".join(PARTS) + " |",
        "|---" * (3 + len(PARTS)) + "|",
    ]
    names = [name for name in found["held-out"] if name != "oracle minus constant"]
    for name in sorted(names, key=lambda name: float(found["held-out"][name]["score"][0])):
        held, trained = found["held-out"][name], found["training"][name]
        mean, low, high = held["score"]
        parts = " | ".join(f"{value:.2f}" for value in held["parts"].values())
        lines.append(
            f"| {name} | {trained['score'][0]:.2f} | {mean:.2f} ({low:.2f} to {high:.2f}) | {parts} |"
        )
    if "oracle minus constant" in found["held-out"]:
        (t, *_), (mean, low, high) = (
            found[pool]["oracle minus constant"] for pool in ("training", "held-out")
        )
        lines.append(
            f"| oracle minus constant | {t:.2f} | {mean:.2f} ({low:.2f} to {high:.2f}) |" + " |" * len(PARTS)
        )
    return "\n".join(lines).replace("-0.00", "0.00").replace("-", "−").replace("|−−−", "|---")


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="the table into docs/environments.md")
    parser.add_argument("--tune", choices=TUNERS, nargs="*", default=[], help="anew, instead of evaluating")
    parser.add_argument("--seconds", type=float, default=600.0, help="of the processor, for pid and learnt")
    parser.add_argument(
        "--kept", type=pathlib.Path, default=KEPT, help="where parameters and curves are kept"
    )
    given = parser.parse_args()
    made: Any = setting_of("dropfoot_day")
    kept = json.loads(given.kept.read_text()) if given.kept.exists() else {}
    if given.tune:
        kept |= {name: TUNERS[name](made, given.seconds) for name in given.tune}
    else:
        found = kept["found"] = evaluate(made, kept)
        print(table(found))
        if given.write:
            before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
            PAGE.write_text(f"{before}{BEGIN}\n{table(found)}\n{END}{rest.split(END)[1]}", encoding="utf-8")
    if given.tune or given.write:
        given.kept.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
