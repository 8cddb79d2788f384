"""How well the gait phase is estimated: every shipped walker, even and uneven, noisy, through a stop.

python scripts/phase_table.py
python scripts/phase_table.py events
python scripts/phase_table.py --c docs/phase.h
"""

import argparse
import concurrent.futures
import functools
import pathlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import phase_events

from afo_sim.common import assets
from afo_sim.control import PhaseEstimate, phase_estimate
from afo_sim.description import Gait, load
from afo_sim.gait import GaitCycle
from afo_sim.model import persons_stride, phase_at

PERIOD, STEP = 0.01, 0.001  # of the controller; age of a sample [s]
STRIDES, LEARNT = 14.0, 2.0  # that are walked; after which it counts
NOISE = np.radians(0.5)
STOPS, STANDS = 4.3, 3.0  # stride in which the walker stops [-], and for how long [s]
STANCE_FORCE = 0.05  # upward force at which a switch under the heel closes [body weights]
STEPPAGE = {"gait.steppage_hip": "10 deg", "gait.steppage_knee": "25 deg"}
ALONE, CALIBRATED, ALWAYS = 0.0, 4.0, np.inf  # strides in which there is a foot switch
SWITCHES = {
    ALONE: "The shank alone",
    CALIBRATED: "A foot switch in the first four strides, which do not count",
    ALWAYS: "A foot switch in every stride",
}
CONDITIONS = ("even", "5 % varied", "a stop", "cadence × 1.2, × 0.8")


@dataclass(frozen=True, eq=False)
class Estimated:
    """A walk and its estimate at every command (n,).

    time [s]; walked and phase, true (with whole strides) and estimated; shank [rad], as sampled; stopped, as
    found; counts, what is judged.
    """

    time: np.ndarray
    walked: np.ndarray
    phase: np.ndarray
    shank: np.ndarray
    stopped: np.ndarray
    counts: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Estimated less true phase, of the cycle (n,)."""
        return phase_events.apart(self.phase, self.walked)


def walkers() -> dict[str, Mapping[str, str]]:
    """Every shipped walker by name, and what is set for it; the last walks as people do whose foot hangs."""
    names = (name for name in assets.gait_names() if name != "norm_adult")  # which has no shank
    found: dict[str, Mapping[str, str]] = {name: {} for name in names}
    return found | {"bovi2011_natural, steppage": STEPPAGE}


def followed(
    angles: np.ndarray,
    struck: np.ndarray | None = None,
    *,
    period: float = PERIOD,
    estimate: PhaseEstimate | None = None,
) -> np.ndarray:
    """Phase, whether it is ready, whether he stands, and stride time [s], after each sample (4, n)."""
    estimate, found = estimate or PhaseEstimate(), np.empty((4, len(angles)))
    for k, angle in enumerate(angles):
        estimate.update(float(angle), period, struck is not None and bool(struck[k]))
        found[:, k] = estimate.phase, estimate.ready, estimate.stopped, estimate.stride_time
    return found


def estimated(
    walker: str,
    condition: str = "even",
    *,
    switch: float = ALONE,
    noise: float = 0.0,
    seed: int = 0,
    period: float = PERIOD,
    age: float = STEP,
    lead: float = 0.0,
) -> Estimated:
    """Walk, and estimate the phase from the shank's angle.

    Parameters
    ----------
    walker : of `walkers`
    condition : of `CONDITIONS`
    switch : strides in which a foot switch tells the heel strikes
    noise : standard deviation of the angle's samples [rad]
    seed : of the stride times and of the noise
    period : of the samples [s]
    age : of a sample when it is used [s]
    lead : that the estimator is told [s]
    """
    cycle = _cycle(walker)
    gait = Gait.model_validate({"cycle": walker} | _set(condition, seed, cycle.stride_time))
    stands = STANDS if condition == "a stop" else 0.0
    time = np.arange(0.0, STRIDES * cycle.stride_time + stands, period)
    walked = phase_at(gait, cycle.stride_time, time)
    sampled = phase_at(gait, cycle.stride_time, time - age)
    shank = cycle.signal("shank_angle", sampled)
    shank = shank + noise * np.random.default_rng(1000 + seed).standard_normal(len(time))
    loaded = cycle.ground(sampled)[1] > STANCE_FORCE
    struck = np.append(False, loaded[1:] & ~loaded[:-1]) & (walked < switch)
    phase, _, stopped, _ = followed(shank, struck, period=period, estimate=PhaseEstimate(lead))
    counts = walked >= (CALIBRATED if switch == CALIBRATED else LEARNT)
    if stands:  # and two strides from where the walker goes on
        onward = walked[np.searchsorted(time, STOPS * cycle.stride_time + stands)]
        counts &= (walked < STOPS) | (walked >= onward + LEARNT)
    return Estimated(time, walked, phase, shank, stopped > 0.0, counts)


@functools.cache
def _cycle(walker: str) -> GaitCycle:
    """The stride of one of `walkers`."""
    sets = {"gait.cycle": walker.split(",")[0], **walkers()[walker]}
    return persons_stride(load("scenario", "walk-dropfoot", sets))


def _set(condition: str, seed: int, stride: float) -> dict[str, object]:
    """What a condition sets, of strides of a duration [s]."""
    if condition == "5 % varied":
        return {"variability": 0.05, "seed": seed}
    if condition == "a stop":
        return {"pace": [[f"{STOPS * stride} s", 0.0], [f"{STOPS * stride + STANDS} s", 1.0]]}
    if condition == CONDITIONS[3]:
        return {"pace": [[f"{3.0 * stride} s", 1.2], [f"{7.0 * stride} s", 0.8]]}
    return {}


def worst(walker: str, condition: str, *, switch: float, noise: float, seeds: int = 3) -> tuple[float, float]:
    """The largest and the root mean square error [% of the cycle] of what counts, the worst of the seeds."""
    random = noise > 0.0 or condition == "5 % varied"
    found = []
    for seed in range(seeds if random else 1):
        trial = estimated(walker, condition, switch=switch, noise=noise, seed=seed)
        error = 100.0 * np.abs(trial.error[trial.counts])
        found.append((float(error.max()), float(np.sqrt(np.mean(error**2)))))
    return max(most for most, _ in found), max(rms for _, rms in found)


def table(*, switch: float, noise: float, seeds: int = 3) -> Iterator[str]:
    """Lines of a table in Markdown: largest error, and in brackets the root mean square."""
    yield f"| walker | {' | '.join(CONDITIONS)} |"
    yield "|---" * (len(CONDITIONS) + 1) + "|"
    for walker in walkers():
        cells = (worst(walker, told, switch=switch, noise=noise, seeds=seeds) for told in CONDITIONS)
        yield f"| `{walker}` | {' | '.join(f'{most:.1f} ({rms:.1f})' for most, rms in cells)} |".replace(
            ", steppage`", "`, steppage"
        )


def curve(walker: str) -> phase_events.Curve:
    """The shank of one of `walkers` over the phase [deg]."""
    return lambda phase: np.degrees(_cycle(walker).signal("shank_angle", phase))


def through_events(
    walker: str, names: tuple[str, ...], *, switch: bool, seed: int
) -> tuple[phase_events.Walk, phase_events.Judged]:
    """Walk through events, and judge the estimate."""
    walk = phase_events.walk(curve(walker), _cycle(walker).stride_time, names, seed)
    phase, ready, *_ = followed(walk.angle, walk.struck if switch else None, period=1.0 / phase_events.RATE)
    return walk, phase_events.judged(walk, phase, ready > 0.0)


def _of_seed(walker: str, switch: bool, seed: int) -> tuple[tuple[str, ...], phase_events.Judged]:
    """All events in an order of their own."""
    names = tuple(np.random.default_rng(seed).permutation(list(phase_events.EVENTS)))
    return names, through_events(walker, names, switch=switch, seed=seed)[1]


def events_table(seeds: int) -> Iterator[str]:
    """Lines of a table in Markdown: the worst walker and seed of each event, alone and with a foot switch."""
    yield "| event | error over 10 % while `ready` [ms] | error two strides later [%] |\n|---|---|---|"
    worst: dict[str, list[tuple[float, float, float, float]]] = {name: [] for name in phase_events.EVENTS}
    shares: list[tuple[float, ...]] = []
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        for walker in walkers():
            for seed in range(seeds):
                (names, alone), (_, struck) = pool.map(_of_seed, [walker] * 2, (False, True), [seed] * 2)
                for name, *found in zip(
                    names, alone.lies, struck.lies, alone.late, struck.late, strict=False
                ):
                    worst[name].append((1e3 * found[0], 1e3 * found[1], found[2], found[3]))
                shares.append((alone.steady, struck.steady, alone.defined, struck.defined))
    yield from _rows(worst)
    least = 100.0 * np.min(shares, axis=0)
    yield f"\n`ready` in steady walking {least[0]:.1f}, {least[1]:.1f} % of the time at least"
    yield f"`ready` of all time with a defined phase {least[2]:.1f}, {least[3]:.1f} % at least"


def _rows(worst: Mapping[str, list[tuple[float, float, float, float]]]) -> Iterator[str]:
    for name, rows in worst.items():
        most, late = np.max(rows, axis=0), np.array(rows)[:, 2:]
        over = " and ".join(f"{np.sum(late[:, k] > 5.0)}" for k in range(2))
        yield (
            f"| {name} | {most[0]:.0f}, {most[1]:.0f} | {most[2]:.1f}, {most[3]:.1f} "
            f"(above 5 %: {over} of {len(rows)}) |"
        )


def written_c(text: str) -> str:
    """A header with this project's constants and templates between its marks."""
    estimate = phase_estimate
    constants: dict[str, float] = {
        name: value
        for name, value in vars(estimate).items()
        if name.isupper() and isinstance(value, float) and re.search(rf"\b{name}\b", text)
    }
    for name, (shortest, longest) in {"WINDOW": estimate.WINDOW, "STRIDE": estimate.STRIDES}.items():
        constants |= {f"SHORTEST_{name}": shortest, f"LONGEST_{name}": longest}
    constants |= dict(zip(("WAKING_RATE", "WAKING_PHASE"), estimate.WAKING, strict=True))
    lines = [f"#define {name} R({value!r})" for name, value in sorted(constants.items())]
    lines += [f"#define {name} {getattr(estimate, name)}" for name in ("HARMONICS", "LOOKS", "EXTREMES")]
    rows = []
    for t in estimate.templates():
        scalars, series = (
            ", ".join(f"R({value:.9g})" for value in values)
            for values in ((t.stride_time, t.lowest, t.highest, t.low, t.high), t.series)
        )
        rows.append(f"    {{{scalars},\n      {{{series}}}}},")
    head = f"#define TEMPLATES {len(rows)}", "static const template_t templates[TEMPLATES] = {"
    rows = [*head, *rows, "};"]
    for mark, block in (("constants", lines), ("templates", rows)):
        begin = text.index("\n", text.index(f"/* begin {mark}")) + 1
        end = text.index(f"/* end {mark} */")
        text = text[:begin] + "".join(f"{line}\n" for line in block) + text[end:]
    return text


def main() -> None:
    """Print the tables, or write the constants of the C header."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("table", nargs="?", default="errors", choices=("errors", "events"))
    parser.add_argument("--seeds", type=int, help="of stride times and noise; 5 by default, of events 10")
    parser.add_argument("--c", type=pathlib.Path, help="write constants and templates into this header")
    arguments = parser.parse_args()
    if arguments.c is not None:
        arguments.c.write_text(written_c(arguments.c.read_text(encoding="utf-8")), encoding="utf-8")
        return
    if arguments.table == "events":
        print("\n".join(events_table(arguments.seeds or 10)))
        return
    for switch, words in SWITCHES.items():
        for noise in (0.0, NOISE):
            print(f"\n{words}, noise of {np.degrees(noise):g}°:\n")
            print("\n".join(table(switch=switch, noise=noise, seeds=arguments.seeds or 5)))


if __name__ == "__main__":
    main()
