"""One walker whose cadence changes, under every walking controller: table and figure of docs/controllers.md.

Patient, device, supply and the air before the first step are the same in all rows. Clocks, gait phase and
state machine are set so that they switch as the scenario's `[phases]` do at the walker's own cadence; none is
tuned further. All whole strides count, the first ones too.

    python scripts/controllers_table.py [--write] [--cost]
"""

import argparse
import pathlib
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

import afo_sim as afo
from afo_sim.common import STANDARD_DENSITY

ROOT = pathlib.Path(__file__).parents[1]
PAGE = ROOT / "docs" / "controllers.md"
PICTURE = ROOT / "models" / "scenarios" / "pictures" / "controllers.png"
BEGIN, END = "<!-- controllers: begin {} -->\n", "<!-- controllers: end -->"
SCENARIO, RATE = "walk-dropfoot-afo", "1 kHz"
WALK = {"duration": "20 s", "gait.pace": [["6 s", 1.25], ["12 s", 0.75]], "reference": None}
MINUS, FAR = "−", 0.5  # of a coil's step that counts as switched
WINDOWS: dict[str, Any] = {
    "dorsiflexor": {"inlet": [[0.5, 0.95]], "outlet": [[0.15, 0.45]]},
    "plantarflexor": {"outlet": [[0.0, 1.0]]},
}
CLOCK = {"inlet": [["0.5465 s", "1.0383 s"]], "outlet": [["0.1639 s", "0.4918 s"]]}
ALWAYS = {"outlet": [["0 s", "1.0929 s"]]}
MACHINE: dict[str, Any] = {
    "start": "swing",
    "state": {
        "swing": {"dorsiflexor": "shut", "plantarflexor": "outlet"},
        "contact": {"dorsiflexor": "shut"},
        "stance": {"dorsiflexor": "outlet"},
        "fill": {"dorsiflexor": "inlet"},
    },
    "transition": [
        {"state": "swing", "to": "contact", "column": "foot/heel_load", "above": "50 N"},
        {"state": "fill", "to": "contact", "column": "foot/heel_load", "above": "50 N", "after": "0.2 s"},
        {"state": "contact", "to": "stance", "column": "state_time", "above": "0.16 s"},
        {"state": "stance", "to": "fill", "column": "ankle/velocity", "below": "-60 deg/s", "after": "0.2 s"},
        {"state": "fill", "to": "swing", "column": "state_time", "above": "0.49 s"},
    ],
}
CONTROLLERS: dict[str, dict[str, Any] | None] = {
    "true phase (`[phases]`)": None,
    "fixed clock": {"timer": {"period": "1.0929 s", "dorsiflexor": CLOCK, "plantarflexor": ALWAYS}},
    "clock, restarted at heel strike": {
        "timer": {"period": "2 s", "restart": {}, "dorsiflexor": CLOCK, "plantarflexor": ALWAYS}
    },
    "gait phase, oscillator": {"gait_phase": WINDOWS},
    "gait phase, foot switch": {"gait_phase": WINDOWS | {"estimator": "foot_switch"}},
    "state machine": {"state_machine": MACHINE},
    "toe load": {"toe_load": {}},
    "toe load, vented all through stance": {"toe_load": {"unloaded": 0.03, "loaded": 0.09}},
}
LEFT_OUT = ("toe load, vented all through stance",)  # of the figure: far below the others
WIDER = 5.0  # factor on the conductance of S1's valves
CONDUCTANCE = f"{WIDER * 0.055:g} dm^3/(s*bar)"
VALVE = "orthosis.chamber.dorsiflexor.{}.conductance"
DEVICES: dict[str, dict[str, Any]] = {
    "S1's valves": {},
    "valves five times as wide": {VALVE.format(side): CONDUCTANCE for side in ("inlet", "outlet")},
}


@dataclass(frozen=True, eq=False)
class Row:
    """What a controller does, stride by stride (n,).

    duration [s]; clearance, of the toe [mm]; torque, against push-off, over 10 ms [N·m]; air, taken in [g];
    switched, how often a coil got current
    """

    name: str
    duration: np.ndarray
    clearance: np.ndarray
    torque: np.ndarray
    air: np.ndarray
    switched: np.ndarray

    @classmethod
    def of(cls, name: str, run: afo.Recording) -> "Row":
        """Of a run, in which every stride from the first on counts."""
        if not run.ok:
            raise SystemExit(f"{name}: {run.status}")

        def told(metric: str) -> np.ndarray:
            return np.array([float(metrics[metric]) for metrics in run.strides.values()])

        return cls(
            name,
            duration=told("stride_time"),
            clearance=told("toe_clearance"),
            torque=told("torque_against_push_off_10ms"),
            air=told("air_per_stride"),
            switched=switched(run),
        )

    @property
    def litres_a_minute(self) -> float:
        """Free air, ANR [l/min]."""
        return float(60.0 * self.air.sum() / STANDARD_DENSITY / self.duration.sum())


def switched(run: afo.Recording) -> np.ndarray:
    """How often any coil got current in each whole stride (n,)."""
    stride = run["gait/stride"]
    found = np.zeros(len(run.strides))
    for name in run.columns:
        if name.startswith("valve/") and name.endswith("/coil"):
            risen = np.flatnonzero((run[name][1:] >= FAR) & (run[name][:-1] < FAR)) + 1
            for number, whole in enumerate(run.strides):
                found[number] += np.count_nonzero(stride[risen] == whole)
    return found


def walked(controller: dict[str, Any] | None, rate: str = RATE, **sets: Any) -> afo.Recording:
    """A run of the walk under a controller, or by the true phase."""
    told: dict[str, Any] = {**WALK, **sets}
    if controller is not None:
        told |= {"phases": None, "controller": {"rate": rate} | controller}
    return afo.run(SCENARIO, told)


def shown(value: float, digits: int = 1) -> str:
    """A number with a true minus sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", MINUS)


def table(rows: list[Row]) -> str:
    """Rows as markdown."""
    head = (
        "controller, at 1 kHz",
        "toe, lowest [mm]",
        "toe, lowest of the first three [mm]",
        "toe, mean [mm]",
        "against push-off, most [N·m]",
        "air per stride [mg]",
        "air [l/min ANR]",
        "switched on per stride",
    )
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for row in rows:
        cells = (
            row.name,
            shown(row.clearance.min()),
            shown(row.clearance[:3].min()),
            shown(row.clearance.mean()),
            shown(row.torque.max()),
            shown(1e3 * row.air.mean(), 0),
            shown(row.litres_a_minute, 2),
            shown(row.switched.mean()),
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def draw(tables: dict[str, list[Row]], path: pathlib.Path) -> None:
    """Cadence on top, clearance stride by stride below, for each device."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    from afo_sim.show import COLOURS, RUN_STYLES, STYLE

    with plt.rc_context(STYLE):
        figure, (top, *panels) = plt.subplots(
            3, figsize=(7.0, 6.0), height_ratios=(1, 2, 3), sharex=True, layout="constrained"
        )
        first = next(iter(tables.values()))[0]
        number = np.arange(1, len(first.duration) + 1)
        top.step(number, 60.0 / first.duration, where="mid", color="black")
        top.set(ylabel="cadence\n[strides/min]", ylim=(0.0, None))
        for panel, (device, rows) in zip(panels, tables.items(), strict=True):
            panel.axhline(0.0, color="0.6", lw=0.6)
            for k, row in enumerate(row for row in rows if row.name not in LEFT_OUT):
                style: dict[str, Any] = {"color": "black", "lw": 2.0}
                if k > 0:
                    style = {"color": COLOURS[k - 1], "ls": RUN_STYLES[k - 1], "marker": "."}
                label = row.name.replace("`", "") if panel is panels[0] else None
                panel.plot(number, row.clearance, label=label, **style)
            panel.set(ylabel="toe clearance [mm]", title=device)
        panels[-1].set(xlabel="stride", xticks=number[::2])
        figure.legend(loc="outside right center", frameon=False)
        figure.savefig(path, dpi=120)
        plt.close(figure)
    print(f"written to {path}")


def cost(repeats: int = 5) -> str:
    """Time of a run under each controller over that of the same walk by the true phase, as markdown."""
    sets = {"duration": "6.6 s", "gait.pace": (), "gait.settled": "walked"}
    names = [name for name, told in CONTROLLERS.items() if told is not None]
    cases = {("", ""): None} | {(n, rate): CONTROLLERS[n] for n in names for rate in ("100 Hz", "1 kHz")}
    best = dict.fromkeys(cases, np.inf)
    for _ in range(repeats):
        for (name, rate), told in cases.items():
            begun = time.perf_counter()
            walked(told, rate or RATE, **sets)
            best[name, rate] = min(best[name, rate], time.perf_counter() - begun)
    plain = best["", ""]
    lines = [
        f"plain: {plain:.2f} s for {sets['duration']}",
        "| controller | at 100 Hz | at 1 kHz |",
        "|---|---|---|",
    ]
    lines += [
        f"| {name} | {best[name, '100 Hz'] / plain:.1f} | {best[name, '1 kHz'] / plain:.1f} |"
        for name in names
    ]
    return "\n".join(lines)


def main() -> None:
    """Print the table, or write it and the figure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="into docs/controllers.md, with the figure")
    parser.add_argument("--cost", action="store_true", help="measure the time that controllers take")
    asked = parser.parse_args()
    if asked.cost:
        print(cost())
        return
    tables = {}
    for device, sets in DEVICES.items():
        tables[device] = [Row.of(name, walked(told, **sets)) for name, told in CONTROLLERS.items()]
        text = table(tables[device])
        print(f"{device}\n\n{text}\n")
        if asked.write:
            page = PAGE.read_text(encoding="utf-8")
            before, _, rest = page.partition(BEGIN.format(device))
            _, end, after = rest.partition(END)
            PAGE.write_text(f"{before}{BEGIN.format(device)}{text}\n{end}{after}", encoding="utf-8")
    if asked.write:
        draw(tables, PICTURE)


if __name__ == "__main__":
    main()
