"""The three pressure drives follow steps of pressure on S1's device: picture and table of docs/drives.md.

    python scripts/drives_picture.py

The device sits (scenario seated-antagonist); its dorsiflexor's drive is asked for STEPS by a controller.
"""

import itertools
import pathlib
import tempfile
from collections.abc import Iterator
from typing import Any

import numpy as np
from PIL import Image
from small_png import save

import afo_sim
from afo_sim.common.units import STANDARD_DENSITY
from afo_sim.show.style import GREY, RUN_STYLES, RUNS, write_figure

ROOT = pathlib.Path(__file__).parents[1]
PAGE, PICTURE = ROOT / "docs/drives.md", ROOT / "models/scenarios/pictures/drives.png"
BEGIN, END = "<!-- drives: begin -->\n", "<!-- drives: end -->"
STEPS = ((0.1, 2.0), (1.6, 1.2), (3.1, 1.6), (4.1, None))  # from [s], gauge [bar]; the end
BAND = 0.1  # within which a step is taken for followed [bar]
LAST = 0.3  # of each step, over which the error is averaged [s]
DRIVES: dict[str, dict[str, Any]] = {
    "bang_bang": {"dead_band": "50 mbar", "least_on": "5 ms"},
    "pwm": {"full_at": "0.3 bar", "integral_time": "0.5 s", "period": "20 ms", "least_on": "5 ms"},
    "regulator": {"full_at": "0.3 bar", "integral_time": "0.5 s", "bandwidth": "20 Hz"},
}


def wanted(time: float) -> float:
    """The pressure that is asked for [Pa]."""
    return 1e5 * next((p for start, p in reversed(STEPS[:-1]) if time >= start - 1e-9), 0.0)


def followed(kind: str) -> afo_sim.Recording:
    """The run of one kind."""
    sets: dict[str, Any] = {"duration": f"{STEPS[-1][0]} s", "timestep": "1 ms"}
    sets["drive.dorsiflexor"] = {"kind": kind, **DRIVES[kind]}
    run = afo_sim.run(
        "seated-antagonist", sets, controller=lambda seen: {"dorsiflexor": wanted(seen.time)}, rate=100
    )
    assert run.ok, run.status
    return run


def draw(runs: dict[str, afo_sim.Recording], path: pathlib.Path) -> None:
    """Pressures above, the two coils of each kind below."""

    def fill(figure: Any) -> None:
        axes = figure.subplots(1 + len(runs), sharex=True, height_ratios=[3.0] + [1.0] * len(runs))
        first = next(iter(runs.values()))
        axes[0].step(
            first["time"], 1e-5 * first["chamber/dorsiflexor/target"], color=GREY, lw=0.9, label="asked for"
        )
        for number, (kind, run) in enumerate(runs.items()):
            look = {"color": RUNS[number], "ls": RUN_STYLES[number]}
            axes[0].plot(run["time"], 1e-5 * run["chamber/dorsiflexor/pressure"], label=kind, **look)
            below = axes[1 + number]
            for side, sign in (("inlet", 1.0), ("outlet", -1.0)):
                coil = sign * run[f"valve/dorsiflexor_{side}/coil"]
                below.fill_between(run["time"], coil, step="post", color=RUNS[number], lw=0.0)
            counts = [run[f"valve/dorsiflexor_{side}/switches"][-1] for side in ("inlet", "outlet")]
            below.set_title(f"{kind}: switched {counts[0]:.0f} and {counts[1]:.0f} times", loc="left", pad=2)
            below.set_ylim(-1.1, 1.1)
            below.set_yticks([-1.0, 1.0], ["outlet", "inlet"])
            below.axhline(0.0, color=GREY, lw=0.4)
        axes[0].set_ylabel("pressure [bar, gauge]")
        axes[0].legend(ncols=4, loc="lower right")
        axes[-1].set_xlabel("time [s]")

    write_figure(path, (6.6, 5.4), fill)


def rows(runs: dict[str, afo_sim.Recording]) -> Iterator[str]:
    """The table, one row a kind."""
    yield "| drive | error at the end [bar] | time to within 0.1 bar [s] | switched | air [l] |"
    yield "|---|---|---|---|---|"
    for kind, run in runs.items():
        time, pressure = run["time"], 1e-5 * run["chamber/dorsiflexor/pressure"]
        errors, times = [], []
        for (start, target), (end, _) in itertools.pairwise(STEPS):
            assert target is not None
            late = (time >= end - LAST) & (time < end)
            errors.append(f"{pressure[late].mean() - target:+.3f}".replace("-", "−"))
            inside = (time >= start) & (time < end) & (np.abs(pressure - target) <= BAND)
            times.append(f"{time[np.argmax(inside)] - start:.2f}" if inside.any() else "never")
        counts = [f"{run[f'valve/dorsiflexor_{side}/switches'][-1]:.0f}" for side in ("inlet", "outlet")]
        flow = np.maximum(run["valve/dorsiflexor_inlet/mass_flow"], 0.0)
        litres = 1e3 * float(flow.sum()) * float(time[1]) / STANDARD_DENSITY
        cells = kind, ", ".join(errors), ", ".join(times), " + ".join(counts), f"{litres:.3f}"
        yield f"| {' | '.join(cells)} |"


def main() -> None:
    """Run, draw, and write the table into the page."""
    runs = {kind: followed(kind) for kind in DRIVES}
    with tempfile.TemporaryDirectory() as name:
        draw(runs, pathlib.Path(name) / "drives.png")
        save(Image.open(pathlib.Path(name) / "drives.png"), PICTURE)
    table = "\n".join(rows(runs))
    print(table)
    for kind, run in runs.items():
        print(kind, *(warning for warning in run.warnings if "drive" in warning))
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}{table}\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
