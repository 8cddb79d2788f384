"""Pictures that no other script keeps up: `python scripts/pictures.py PART …`, all parts by default.

drives   the three pressure drives follow steps of pressure on S1's device (scenario seated-antagonist), whose
         dorsiflexor's drive is asked for STEPS by a controller: picture and table of docs/drives.md
elsewhere  which exported file goes where: docs/elsewhere.png
ledger   predicted over measured, with bands, of the ledger's devices: docs/ledger.png, and the table of
         docs/accuracy.md
muscles  force over contraction of the fluidic muscles of 10, 20 and 40 mm, with their limits
patients twenty patients with a drop foot without a device, with S1 and with a spring: docs/patients.png
runs     the seated scenarios and the arms, as the viewer shows them, and their figures; needs what
         `afo-sim view --screenshot` needs
walks    the README's film and a still of it, the report's figures of four walkers, where clearance is
         taken, how the foot lands, and the viewer's moments; needs what `runs` needs, and OpenGL
wiring   the wiring of an exported board
"""

import argparse
import itertools
import pathlib
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from small_png import draw, save

import afo_sim
from afo_sim.common import STANDARD_DENSITY
from afo_sim.description import Muscle
from afo_sim.lab.ledger import VERDICTS, LedgerRow, ledger
from afo_sim.show import BLUE, GREY, RED, RUN_STYLES, RUNS, RunView, panels, report_figures
from afo_sim.show.patients_figure import draw_patients
from afo_sim.show.rerun import screenshot, write_comparison
from afo_sim.show.run_view import alone
from afo_sim.show.video import Painter
from afo_sim.show.walking_figure import WalkingFigure, reference_view
from afo_sim.walker import populate

ROOT = pathlib.Path(__file__).resolve().parents[1]
MODELS = ROOT / "models"
PICTURES = MODELS / "scenarios/pictures"
PAGE = ROOT / "docs/drives.md"
BEGIN, END = "<!-- drives: begin -->\n", "<!-- drives: end -->"
STEPS = ((0.1, 2.0), (1.6, 1.2), (3.1, 1.6), (4.1, None))  # from [s], gauge [bar]; the end
BAND = 0.1  # within which a step is taken for followed [bar]
LAST = 0.3  # of each step, over which the error is averaged [s]
DRIVES: dict[str, dict[str, Any]] = {
    "bang_bang": {"dead_band": "50 mbar", "least_on": "5 ms"},
    "pwm": {"full_at": "0.3 bar", "integral_time": "0.5 s", "period": "20 ms", "least_on": "5 ms"},
    "regulator": {"full_at": "0.3 bar", "integral_time": "0.5 s", "bandwidth": "20 Hz"},
}
MUSCLES = {"dmsp_10": "maker's curve", "dmsp_20": "maker's curve", "dmsp_40": "20 mm × 4, not measured"}
LOW = 3e5  # gauge pressure of the second curve [Pa]
SHORT = 0.112  # shortest length at which the 10 mm muscle's force was measured [m]
HIGHEST = 1.6  # of a panel, over the limit of force
TIMES = (1.0, 3.5, 6.0)  # of the seated scenarios [s]
SIZE = (960, 540)  # of each picture in a row [pixel]
SCENARIOS = ("seated", "seated-antagonist", "arm", "arm-s1")
VALVES = [f"{group} {side}" for group in ("dorsiflexor", "plantarflexor") for side in ("inlet", "outlet")]


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


def fill_drives(runs: dict[str, afo_sim.Recording], figure: Any) -> None:
    """Pressures above, the two coils of each kind below."""
    axes = figure.subplots(1 + len(runs), sharex=True, height_ratios=[3.0] + [1.0] * len(runs))
    first = next(iter(runs.values()))
    target = 1e-5 * first["chamber/dorsiflexor/target"]
    axes[0].step(first["time"], target, color=GREY, lw=0.9, label="asked for")
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


def drives() -> None:
    """Run, draw, and write the table into the page."""
    runs = {kind: followed(kind) for kind in DRIVES}
    draw(PICTURES / "drives.png", (6.6, 5.4), lambda figure: fill_drives(runs, figure))
    table = "\n".join(rows(runs))
    print(table)
    for kind, run in runs.items():
        print(kind, *(warning for warning in run.warnings if "drive" in warning))
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}{table}\n{END}{rest.partition(END)[2]}", encoding="utf-8")


def panel(axis: Any, muscle: Muscle, grade: str) -> None:
    """One muscle: curves at its highest pressure and at LOW, its limits as lines."""
    limits, top = muscle.limits, f"{muscle.limits.pressure * 1e-5:g} bar"
    kappa = np.linspace(-0.01, 0.30, 311)
    percent, length = 100.0 * kappa, f"{100.0 * muscle.nominal_length:g} cm"
    axis.plot(percent, muscle.force(limits.pressure, contraction=kappa), color=BLUE, label=f"{top}, {length}")
    low, label = muscle.force(LOW, contraction=kappa), f"{LOW * 1e-5:g} bar, {length}"
    axis.plot(percent, low, color=RED, ls=RUN_STYLES[1], label=label)
    if muscle.lengths is not None and muscle.lengths.force is not None:
        short = muscle.with_values(total_length=SHORT).force(limits.pressure, contraction=kappa)
        axis.plot(percent, short, color=BLUE, ls=RUN_STYLES[3], label=f"{top}, {100.0 * SHORT:g} cm")
    axis.axhline(limits.force, color=GREY, lw=0.8)
    axis.text(24.5, 1.02 * limits.force, f"at most {limits.force:g} N", ha="right", va="bottom", color=GREY)
    for limit in (limits.contraction_min, limits.contraction_max):
        axis.axvline(100.0 * limit, ymax=1.0 / HIGHEST, color=GREY, lw=0.8, ls=":")
    axis.set(
        title=f"{1e3 * muscle.bore:g} mm: {grade}",
        xlabel="contraction [%]",
        xlim=(-4.0, 30.0),
        ylim=(0.0, HIGHEST * limits.force),
    )
    axis.legend(loc="upper right")


def fill_muscles(figure: Any) -> None:
    """A panel for each muscle."""
    axes = figure.subplots(1, len(MUSCLES))
    for axis, (name, grade) in zip(axes, MUSCLES.items(), strict=True):
        panel(axis, afo_sim.load("muscle", name), grade)
    axes[0].set_ylabel("force at rest [N]")


def muscles() -> None:
    """Draw the fluidic muscles."""
    draw(MODELS / "muscles/pictures/fluidic.png", (9.5, 3.4), fill_muscles)


def taken(folder: pathlib.Path, at: float, size: tuple[int, int]) -> Image.Image:
    """The viewer's picture of a run at an instant."""
    place = folder / "taken.png"
    screenshot(folder / "recording.rrd", place, at)
    return Image.open(place).convert("RGB").resize(size, Image.Resampling.LANCZOS)


def in_a_row(folder: pathlib.Path) -> Image.Image:
    """The run at each of TIMES, side by side."""
    row = Image.new("RGB", (len(TIMES) * SIZE[0], SIZE[1]))
    for column, at in enumerate(TIMES):
        row.paste(taken(folder, at, SIZE), (column * SIZE[0], 0))
    return row


def overview(run: afo_sim.Recording, place: pathlib.Path) -> Image.Image:
    """The run's own overview figure."""
    afo_sim.figure(run, place, kind="overview")
    return Image.open(place).convert("RGB")


def runs() -> None:
    """Run the scenarios, and take their pictures."""
    with tempfile.TemporaryDirectory() as name:
        made = {scenario: afo_sim.run(scenario) for scenario in SCENARIOS}
        folders = {scenario: run.save(pathlib.Path(name) / scenario) for scenario, run in made.items()}
        scratch = pathlib.Path(name) / "figure.png"
        pictures = {
            "scenarios/pictures/seated": in_a_row(folders["seated"]),
            "scenarios/pictures/seated-antagonist": in_a_row(folders["seated-antagonist"]),
            "orthoses/s1/seated": taken(folders["seated"], 3.5, (1280, 720)),
            "scenarios/pictures/arm": taken(folders["arm"], 4.0, (1280, 720)),
            "scenarios/pictures/overview": overview(made["seated-antagonist"], scratch),
            "orthoses/arm_s1/arm-s1": overview(made["arm-s1"], scratch),
        }
    for title, picture in pictures.items():
        save(picture, MODELS / f"{title}.png")


WALKS = {"healthy": "healthy", "dropfoot": "drop foot", "dropfoot-afo": "with S1's orthosis"}
WALKS |= {"dropfoot-afo-short": "on shorter links"}
FILM = {"without": "without the device", "with": "with S1's device"}
STILLS, MOMENTS = (0.58, 0.83), (0.05, 0.3, 0.55, 0.83)  # of the stride [-]


def film(views: dict[str, RunView], place: pathlib.Path) -> None:
    """The settled stride of each, beside one another, slowly, as the package's films have it."""
    with ExitStack() as stack:
        painters = [
            stack.enter_context(Painter(view.recording, 660, 690, WalkingFigure.of(view), title))
            for title, view in views.items()
        ]
        beside = (np.hstack([each.picture(phase) for each in painters]) for phase in np.arange(96) / 96.0)
        first, *others = (Image.fromarray(frame).resize((880, 460), Image.Resampling.BOX) for frame in beside)
    first.save(place, save_all=True, append_images=others, duration=60, loop=0, quality=60, method=6)


def still(views: dict[str, RunView]) -> Image.Image:
    """The film's pictures at push-off and in mid-swing."""
    row = Image.new("RGB", (1280, 360))
    for number, (phase, (title, view)) in enumerate(itertools.product(STILLS, views.items())):
        with Painter(view.recording, 640, 720, WalkingFigure.of(view), title) as painter:
            row.paste(Image.fromarray(painter.picture(phase)).reduce(2), (320 * number, 0))
    return row


def fill_clearance(view: RunView, figure: Any) -> None:
    """Heights of the outsole's points in swing, and where the lowest of them counts."""
    axis, stride, found = figure.subplots(), view.strides[-1], view.recording.metrics
    percent = 100.0 * stride.phase
    for name, label, colour in (("heel/height", "heel", BLUE), ("ball/height", "ball", "#F57C1F")):
        axis.plot(percent, 1e3 * stride[name], color=colour, label=label)
    axis.plot(percent, 1e3 * stride["toe/height"], color="#C44FC4", label="toe: the lower of pulp and tip")
    axis.plot(percent, 1e3 * stride["sole/height_without_floor"], "k", lw=2.2, label="lowest of the outsole")
    counts = 100.0 * stride.phase[stride.fast & stride.passing][[0, -1]]
    axis.axvspan(*counts, color="#D6EBFC", lw=0.0, label="where the minimum counts")
    height, when = found["toe_clearance"], found["toe_clearance_phase"]
    axis.plot(when, height, "o", color=RED, label=f"toe clearance {height:.1f} mm")
    for at, what in ((100.0 * stride.toe_off, "toe-off"), (100.0 * stride.upright, "shank upright")):
        axis.axvline(at, color=GREY, lw=0.8, ls=":")
        axis.annotate(what, (at, -18.0), xytext=(4.0, 0.0), textcoords="offset points")
    axis.axhline(0.0, color=GREY, lw=0.8)
    axis.set(xlim=(55, 100), ylim=(-25, 150), xlabel="gait cycle [%]", ylabel="above the floor [mm]")
    figure.legend(loc="outside upper center", ncols=3)


def fill_landing(views: dict[str, RunView], figure: Any) -> None:
    """Pitch of the outsole and plantarflexion velocity in the first fifth of the stride."""
    axes = figure.subplots(1, 2)
    for (label, view), colour in zip(views.items(), (RED, BLUE), strict=True):
        stride = view.strides[-1]
        for axis, values in zip(axes, (stride["sole/pitch"], -stride["ankle/velocity"]), strict=True):
            axis.plot(100.0 * stride.phase, np.degrees(values), color=colour, label=label)
    for limit, what, side in ((8.0, "heel from here on", "bottom"), (-1.6, "forefoot below", "top")):
        axes[0].axhline(limit, color=GREY, lw=0.8, ls="--")
        axes[0].text(19.5, limit, what, ha="right", va=side, color=GREY)
    axes[0].set(ylim=(-8.0, 20.0), ylabel="outsole to the floor [deg], toe up +")
    axes[1].set_ylabel("plantarflexion velocity [deg/s]")
    axes[1].axvspan(0.0, 12.0, color="#D6EBFC", lw=0.0, zorder=0)
    for axis in axes:
        axis.set(xlim=(0, 20), xlabel="gait cycle [%]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)


def viewed(made: dict[str, afo_sim.Recording]) -> None:
    """The viewer's walking leg of three walks at MOMENTS, and two of them beside one another."""
    kept = Image.new("RGB", (404 * len(MOMENTS), 320 * 3))
    with tempfile.TemporaryDirectory() as name:
        walked = [made[walk].save(pathlib.Path(name) / walk) for walk in tuple(WALKS)[1:]]
        for row, (folder, walk) in enumerate(zip(walked, tuple(WALKS)[1:], strict=True)):
            stride = alone(made[walk]).strides[-1]
            # without valves the leg has more of the viewer
            box = (150, 65, 680, 485) if made[walk].scenario["orthosis"]["muscle"] else (20, 80, 777, 680)
            for column, phase in enumerate(MOMENTS):
                whole = taken(folder, float(stride.at("time", phase)), (1600, 900))
                kept.paste(whole.crop(box).resize((404, 320)), (404 * column, 320 * row))
        write_comparison([walked[2], walked[0]], pathlib.Path(name) / "recording.rrd")
        at = float(alone(made["dropfoot-afo-short"]).whole_strides[5].at("time", 0.8))
        save(taken(pathlib.Path(name), at, (1200, 675)), PICTURES / "walk-compared.png")
    save(kept, PICTURES / "walk-moments.png")


def fill_report(views: list[RunView], figure: Any) -> None:
    """Clearance and angle, moment and ball of several walks."""
    above, below = figure.subfigures(2, 2)
    report_figures.draw_walk(above, views)
    report_figures.draw_moment(below, views)
    axes = [axis for part in (*above, *below) for axis in part.axes]
    found = panels.keys(axes)
    figure.legend(found.values(), found.keys(), loc="outside upper center", ncols=3)


def walks() -> None:
    """Walk, and take the pictures."""
    made = {name: afo_sim.run(f"walk-{name}") for name in WALKS}
    viewed(made)
    views = [RunView(WALKS[name], RUNS[k], run, RUN_STYLES[k]) for k, (name, run) in enumerate(made.items())]
    bare, worn = reference_view(made["dropfoot-afo"], "without", RED), alone(made["dropfoot-afo"])
    assert bare is not None
    beside = dict(zip(FILM.values(), (bare, worn), strict=True))
    film(beside, ROOT / "docs" / "drop_foot.webp")
    save(still(beside), PICTURES / "film.png")
    draw(PICTURES / "report.png", (7.4, 6.8), lambda figure: fill_report(views, figure))
    draw(PICTURES / "metrics-clearance.png", (7.0, 4.0), lambda figure: fill_clearance(worn, figure))
    landings = {"drop foot": bare, "with the orthosis": worn}
    draw(PICTURES / "metrics-contact.png", (7.0, 2.9), lambda figure: fill_landing(landings, figure))


def box(axes: Any, x: float, y: float, width: float, height: float, text: str, colour: str = "white") -> None:
    axes.add_patch(plt.Rectangle((x, y), width, height, facecolor=colour, edgecolor="black"))
    axes.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=8)


def wire(axes: Any, *points: tuple[float, float], colour: str = "black") -> None:
    axes.plot(*zip(*points, strict=True), color=colour, linewidth=1.2)


def valve(axes: Any, y: float, name: str, pin: int) -> None:
    """Pin → gate resistor → MOSFET on the coil's ground side; a diode across the coil; a pull-down."""
    wire(axes, (2.2, y), (2.7, y))
    axes.text(2.15, y, f"pin {pin}", ha="right", va="center", fontsize=8)
    box(axes, 2.7, y - 0.13, 0.8, 0.26, "220 Ω")
    wire(axes, (3.5, y), (4.7, y))
    wire(axes, (3.9, y), (3.9, y - 0.42))
    box(axes, 3.55, y - 0.68, 0.7, 0.26, "10 kΩ")
    axes.text(4.3, y - 0.6, "to ground", va="center", fontsize=7)
    box(axes, 4.7, y - 0.28, 1.2, 0.56, "n-MOSFET\nsource to ground")
    wire(axes, (5.9, y), (6.5, y))
    box(axes, 6.5, y - 0.2, 1.7, 0.4, f"coil: {name}", "#e8f0fa")
    wire(axes, (8.2, y), (9.2, y), colour="tab:red")
    wire(axes, (6.2, y), (6.2, y - 0.5), (7.0, y - 0.5))
    box(axes, 7.0, y - 0.63, 0.9, 0.26, "▶| diode")
    wire(axes, (7.9, y - 0.5), (8.6, y - 0.5), (8.6, y), colour="tab:red")


def wiring() -> None:
    """Draw a board, the driver of each coil, and what else stands at its pins."""
    figure, axes = plt.subplots(figsize=(10, 6.2))
    box(axes, 0.2, 0.1, 2.0, 6.5, "", "#f4f4f4")
    axes.text(0.3, 6.35, "board", fontsize=10, weight="bold")
    for k, name in enumerate(VALVES):
        valve(axes, 5.9 - 1.1 * k, name, 2 + k)
    wire(axes, (9.2, 2.6), (9.2, 6.4), colour="tab:red")
    axes.text(9.2, 6.5, "+ of the coils' supply", ha="right", fontsize=8, color="tab:red")
    for height, label, text in (
        (1.5, "pin 6", "run switch, to ground: open is off"),
        (0.9, "A0", "foot switch or sensor, 0 to 5 V"),
    ):
        axes.text(2.15, height, label, ha="right", va="center", fontsize=8)
        wire(axes, (2.2, height), (4.7, height))
        box(axes, 4.7, height - 0.2, 3.5, 0.4, text)
    axes.text(2.15, 0.35, "GND", ha="right", va="center", fontsize=8)
    wire(axes, (2.2, 0.35), (4.7, 0.35))
    ground = "ground of the supply, sources, switches and sensors: one point"
    axes.text(4.8, 0.35, ground, va="center", fontsize=8)
    axes.set(xlim=(0, 9.6), ylim=(0, 6.8))
    axes.axis("off")
    figure.savefig(ROOT / "docs/electronics.png", dpi=110, bbox_inches="tight")


ELSEWHERE = {  # what is written: where it runs
    "--to plugin: NAME_plugin/\nmodel.xml, inputs.bin,\nafo_sim.so": "MuJoCo alone: Python,\nits viewer, C",
    "--to c: NAME_c/\nthe same, afo_sim.h, host.c,\nlibmujoco.so, …": "your own loop:\nC, C++, ROS 2",
    "--to fmu: NAME.fmu\nall of it in one file": "FMI 2.0, co-simulation:\nSimulink, OMSimulator,\nfmpy",
}


def fill_elsewhere(figure: Any) -> None:
    """Files on the left; on the right the run, whose steps tests/export/elsewhere compares bit by bit."""
    axes, curve = figure.subplots(1, 2, width_ratios=(2.6, 1))
    box(axes, 0, 2.1, 2.1, 0.8, "scenario, or a run\nwith its commands", "#e8f0fa")
    for y, (files, host) in zip((4.0, 2.5, 1.0), ELSEWHERE.items(), strict=True):
        box(axes, 3.3, y - 0.55, 3.1, 1.1, files)
        box(axes, 7, y - 0.55, 2.6, 1.1, host, "#e8f0fa")
        for begin, end in (((2.1, 2.5), (3.3, y)), ((6.4, y), (7, y))):
            axes.annotate("", end, begin, arrowprops={"arrowstyle": "->"})
    axes.set(xlim=(-0.05, 9.65), ylim=(0.3, 4.7))
    axes.axis("off")
    run, words = afo_sim.run("seated"), "run, plugin, C and FMU:\n0 of 8000 steps differ"
    curve.plot(run["time"], np.degrees(run["ankle/angle"]), color=BLUE)
    curve.set(xlabel="time [s]", ylabel="ankle angle [deg]", title=words)


VERDICT_LOOKS = dict(zip(VERDICTS, ((BLUE, "o"), (RED, "X"), (GREY, "s")), strict=True))


def draw_ledger(rows: list[LedgerRow], figure: Any) -> None:
    """A line for each row: its band and middle over the measured value; the measured error in grey."""
    axes = figure.subplots()
    labels = []
    for y, row in enumerate(reversed(rows)):
        assert row.band
        assert row.measured
        low, middle, high = (x / row.measured for x in row.band)
        error = (row.error or 0.0) / row.measured
        colour, marker = VERDICT_LOOKS[row.verdict]
        axes.plot([1.0 - error, 1.0 + error], [y, y], color="0.82", linewidth=6.5, solid_capstyle="butt")
        axes.plot([low, high], [y, y], color=colour, linewidth=1.6)
        axes.plot(middle, y, marker, color=colour, markersize=4.5)
        labels.append(f"{row.device}: {row.quantity}")
    axes.axvline(1.0, color="black", linewidth=0.8)
    axes.set(xscale="log", xlim=(0.15, 5.5), xlabel="predicted over measured", ylim=(-0.7, len(rows) - 0.3))
    ticks = (0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_yticks(range(len(rows)), labels, fontsize=6.5)
    axes.grid(axis="x", color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    for verdict, (colour, marker) in VERDICT_LOOKS.items():
        axes.plot([], [], f"{marker}-", color=colour, markersize=4.5, label=verdict)
    axes.plot([], [], color="0.82", linewidth=6.5, label="measured ± error")
    figure.legend(loc="outside lower center", ncols=4)


def draw_ledgers() -> None:
    """Draw the ledger's rows that are both predicted and measured."""
    rows = [row for row in ledger() if row.band and row.measured]
    draw(ROOT / "docs/ledger.png", (8.6, 7.4), lambda figure: draw_ledger(rows, figure))


def patients() -> None:
    """Draw twenty patients without, with S1 and with a spring."""
    place = ROOT / "docs/patients.png"
    draw_patients(populate("walk-dropfoot-afo", patients="drop-foot", spring=60.0), place)
    picture = Image.open(place).convert("RGB")
    save(picture.resize((picture.width * 2 // 3, picture.height * 2 // 3)), place)


PARTS = {"drives": drives, "ledger": draw_ledgers, "muscles": muscles, "patients": patients, "runs": runs}
PARTS |= {"walks": walks, "wiring": wiring}
PARTS["elsewhere"] = lambda: draw(ROOT / "docs/elsewhere.png", (7.8, 2.9), fill_elsewhere)

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART")
    for part in parser.parse_args().parts or PARTS:
        PARTS[part]()
