"""How well the gait phase is estimated: drawn people, and every shipped walker, through events and noise.

python scripts/phase_table.py people
python scripts/phase_table.py shipped
python scripts/phase_table.py people --noise 2 --rate 50
python scripts/phase_table.py picture FILE
python scripts/phase_table.py c docs/phase.h
"""

import argparse
import concurrent.futures
import functools
import pathlib
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import phase_events

from afo_sim.common import assets
from afo_sim.control import PhaseEstimate, heel_strike, phase_estimate, swings
from afo_sim.description import load
from afo_sim.gait import GaitCycle
from afo_sim.model import persons_stride

STEPPAGE = {"gait.steppage_hip": "10 deg", "gait.steppage_knee": "25 deg"}
FIRST, PEOPLE, SEEDS = 1000, 200, 10  # numbers of drawn people; walks of each shipped walker
TITLES = (
    "a U-turn in small strides, and a stop (green: ready)",
    "the first strides: the heel strike is learned",
)
READY = {"cmap": "Greens", "vmin": 0.0, "vmax": 4.0}
LONG, LATE = 0.1, 5.0  # of an error over a tenth while ready [s]; of an error two strides later [%]


def walkers() -> dict[str, Mapping[str, str]]:
    """Every shipped walker by name, and what is set for it; the last walks as people do whose foot hangs."""
    names = (name for name in assets.gait_names() if name != "norm_adult")  # which has no shank
    found: dict[str, Mapping[str, str]] = {name: {} for name in names}
    return found | {"bovi2011_natural, steppage": STEPPAGE}


def followed(
    angles: np.ndarray,
    struck: np.ndarray | None = None,
    *,
    period: float = 1.0 / phase_events.RATE,
    estimate: PhaseEstimate | None = None,
) -> np.ndarray:
    """Phase, whether it is ready, whether he stands, and stride time [s], after each sample (4, n)."""
    estimate, found = estimate or PhaseEstimate(), np.empty((4, len(angles)))
    for k, angle in enumerate(angles):
        estimate.update(float(angle), period, struck is not None and bool(struck[k]))
        found[:, k] = estimate.phase, estimate.ready, estimate.stopped, estimate.stride_time
    return found


@functools.cache
def cycle(walker: str) -> GaitCycle:
    """The stride of one of `walkers`."""
    sets = {"gait.cycle": walker.split(",")[0], **walkers()[walker]}
    return persons_stride(load("scenario", "walk-dropfoot", sets))


def shipped(walker: str) -> phase_events.Person:
    """One of `walkers`; his recorded curve holds nothing as fast as what a heel strike does."""
    stride = cycle(walker)
    return phase_events.Person(
        lambda phase: np.degrees(stride.signal("shank_angle", phase)), stride.stride_time
    )


def through_events(
    person: phase_events.Person,
    names: tuple[str, ...],
    *,
    switch: bool,
    seed: int,
    rate: float = phase_events.RATE,
    noise: float = phase_events.NOISE,
) -> phase_events.Judged:
    """Walk through events, and judge the estimate."""
    walk = phase_events.walk(person, names, seed, rate=rate, noise=noise)
    phase, ready, *_ = followed(walk.angle, walk.struck if switch else None, period=1.0 / rate)
    return phase_events.judged(walk, phase, ready > 0.0)


def _judged(
    who: str | int, seed: int, switch: bool, rate: float, noise: float
) -> tuple[tuple[str, ...], phase_events.Judged]:
    """All events in an order of their own."""
    names = tuple(np.random.default_rng(seed).permutation(list(phase_events.EVENTS)))
    person = shipped(who) if isinstance(who, str) else phase_events.drawn(who)
    return names, through_events(person, names, switch=switch, seed=seed, rate=rate, noise=noise)


class Table:
    """Many walks, alone and with a foot switch."""

    def __init__(
        self,
        people: Sequence[tuple[str | int, int]],
        *,
        rate: float = phase_events.RATE,
        noise: float = phase_events.NOISE,
    ) -> None:
        jobs = [(*person, switch, rate, noise) for person in people for switch in (False, True)]
        with concurrent.futures.ProcessPoolExecutor(2) as pool:
            found = list(pool.map(_judged, *zip(*jobs, strict=True), chunksize=4))
        self.walks = [[judged for _, judged in found[switch::2]] for switch in (0, 1)]
        self.names = [names for names, _ in found[::2]]

    def of(self, what: str, event: str = "") -> np.ndarray:
        """`lies` [s] or `late` [%] of one event or of all, alone and with a switch (2, n)."""
        return np.array(
            [
                [
                    value
                    for names, judged in zip(self.names, walks, strict=True)
                    for name, value in zip(names, getattr(judged, what), strict=False)
                    if event in ("", name)
                ]
                for walks in self.walks
            ]
        )

    def row(self, event: str = "") -> str:
        """Cells in Markdown: the worst, and the share within bounds, alone and with a switch."""
        lies, late = self.of("lies", event), self.of("late", event)
        cells = (
            [f"{1e3 * lies[k].max():.0f} ({100.0 * np.mean(lies[k] <= LONG + 1e-9):.1f} %)" for k in (0, 1)],
            [f"{late[k].max():.1f} ({100.0 * np.mean(late[k] <= LATE):.1f} %)" for k in (0, 1)],
        )
        return " | ".join(", ".join(pair) for pair in cells)

    def shares(self) -> str:
        """Shares of time with `ready`: steady walking, its worst, and all; and where the heel strikes."""
        told = []
        for walks in self.walks:
            steady, defined = (
                100.0 * np.array([getattr(w, key) for w in walks]) for key in ("steady", "defined")
            )
            bias = np.array([walk.bias for walk in walks])
            told.append(
                f"{steady.mean():.1f}, {steady.min():.1f}, {defined.mean():.0f} % "
                f"(bias {np.nanmean(bias):+.1f} ± {np.nanstd(bias):.1f} %)"
            )
        return "; ".join(told)


def lines_of(table: Table) -> Iterator[str]:
    """Lines of a table in Markdown."""
    yield "| event | error over 10 % while `ready` [ms] | error two strides later [%] |\n|---|---|---|"
    for event in phase_events.EVENTS:
        yield f"| {event} | {table.row(event)} |"
    yield f"| all | {table.row()} |\n\n`ready`, alone; with a switch: {table.shares()}"


def written_c(text: str) -> str:
    """A header with this project's constants and templates between its marks."""
    estimate, constants = phase_estimate, dict[str, float]()
    for module in (phase_estimate, swings, heel_strike):
        constants |= {
            name: value
            for name, value in vars(module).items()
            if name.isupper() and isinstance(value, int | float) and re.search(rf"\b{name}\b", text)
        }
    spans = {"WINDOW": estimate.WINDOW, "STRIDE": estimate.STRIDES, "HALF": heel_strike.HALVES}
    for name, (shortest, longest) in spans.items():
        constants |= {f"SHORTEST_{name}": shortest, f"LONGEST_{name}": longest}
    constants |= dict(zip(("WAKING_RATE", "WAKING_PHASE"), estimate.WAKING, strict=True))
    lines = [
        f"#define {name} {value if isinstance(value, int) else f'R({value!r})'}"
        for name, value in sorted(constants.items())
    ]
    turn = np.cos(2.0 * np.pi * np.arange(estimate.EXTREMES) / estimate.EXTREMES)
    for name, values in {"WEIGHTS": heel_strike.WEIGHTS, "COSINES": turn}.items():
        written = ", ".join(f"R({value:.17g})" for value in values)
        lines.append(f"#define {name} {{ {written} }}")
    rows = []
    for t in estimate.templates():
        scalars, series = (
            ", ".join(f"R({value:.17g})" for value in values)
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


def picture(file: pathlib.Path) -> None:
    """A drawn person through a U-turn and a stop, and how the heel strike is learned."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 2, figsize=(10, 6), sharex="col", layout="constrained")
    shown = ("U-turn, small strides", "stop"), ()
    for column, (names, who) in enumerate(zip(shown, (1003, 1017), strict=True)):
        person = phase_events.drawn(who)
        walk = phase_events.walk(person, names, who)
        time = np.arange(len(walk.angle)) / walk.rate
        phase, ready, *_ = followed(walk.angle)
        upper, middle, lower = axes[:, column]
        upper.plot(time, np.degrees(walk.angle), "0.35", lw=1)
        middle.plot(time, walk.phase % 1.0, "0.65", lw=3, label="true")
        middle.plot(time, phase, "C0", lw=1, label="estimated")
        lower.plot(time, 100.0 * phase_events.apart(phase, walk.phase), "C0", lw=1)
        lower.axhline(0.0, color="0.5", lw=0.5)
        lower.set(ylim=(-15.0, 15.0), xlabel="time [s]")
        for axis in (upper, middle, lower):
            axis.pcolorfast(time[[0, -1]], axis.get_ylim(), np.ma.masked_less(ready[None, :], 1.0), **READY)
        upper.set_title(TITLES[column])
    for axis, label in zip(axes[:, 0], ("shank [°]", "phase [-]", "error [% of the stride]"), strict=True):
        axis.set_ylabel(label)
    axes[1, 0].legend(loc="upper right", fontsize=8)
    figure.savefig(file, dpi=100)


def main() -> None:
    """Print a table, draw the picture, or write the constants of the C header."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("what", choices=("people", "shipped", "picture", "c"))
    parser.add_argument("file", nargs="?", type=pathlib.Path)
    parser.add_argument("--people", type=int, default=PEOPLE, help="how many are drawn")
    parser.add_argument("--noise", type=float, default=phase_events.NOISE, help="of the angle [deg]")
    parser.add_argument("--rate", type=float, default=phase_events.RATE, help="of samples [1/s]")
    arguments = parser.parse_args()
    if arguments.what == "c":
        arguments.file.write_text(written_c(arguments.file.read_text(encoding="utf-8")), encoding="utf-8")
    elif arguments.what == "picture":
        picture(arguments.file)
    else:
        people: list[tuple[str | int, int]] = [(FIRST + k, FIRST + k) for k in range(arguments.people)]
        if arguments.what == "shipped":
            people = [(name, seed) for name in walkers() for seed in range(SEEDS)]
        print("\n".join(lines_of(Table(people, rate=arguments.rate, noise=arguments.noise))))


if __name__ == "__main__":
    main()
