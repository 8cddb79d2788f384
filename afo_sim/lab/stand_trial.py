"""The virtual muscle test stand: the tests of one muscle, run in the rig or by the formula.

Source: the tests but sealed, step and release after Takosoglu et al. 2016 (S3); open loop and static load
after S0.
At rest L = F_ce(p) − K(p) x: at each pressure the stand's isobaric curve is a straight line over the
shortening x, whose start is F_ce and whose slope is −K. S0 draws F_ce over pressure with its line.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, InputError, Notice, Shown
from afo_sim.description import provenance_note
from afo_sim.lab.stand_plan import StandPlan, force_at, hanging
from afo_sim.lab.stand_rig import Progress, Rows, roll
from afo_sim.metrics import Metric, highest_mean

# Unit and meaning of every column.
COLUMNS = {
    "time": ("s", "from the start of the test"),
    "branch": ("", "0 is the first way up, 1 down, and so on"),
    "pressure": ("Pa", "gauge, in the muscle; where a line leads to it, at the line's other end"),
    "contraction": ("", "(L0 - L)/L0, shorter is positive"),
    "length": ("m", "active braid length"),
    "velocity": ("m/s", "lengthening positive"),
    "force": ("N", "tension of the muscle"),
    "static_force": ("N", "the formula at this contraction and pressure, without friction and damping"),
    "load": ("N", "weight and spring on the carriage; not a number where the length is prescribed"),
    "air_mass": ("kg", "air in muscle and tube"),
    "volume": ("m^3", "muscle and tube"),
    "inflow": ("kg/s", "into the muscle, through either valve"),
    "outflow": ("kg/s", "out of the muscle, through either valve"),
}
NEGLIGIBLE = 0.01  # share of a muscle's force limit below which its law's range does not matter
BEGUN, REACHED = 0.01, 1.0 - math.exp(-1.0)  # shares of a change: dead time, time constant
# Axes of a plot: (abscissa, its unit, ordinate, its unit)
AXES = {
    "isobaric": ("contraction", "", "force", "N"),
    "isotonic": ("pressure", "Pa", "contraction", ""),
    "isometric": ("pressure", "Pa", "force", "N"),
    "auxotonic": ("pressure", "Pa", "contraction", ""),
    "sealed": ("contraction", "", "force", "N"),
}
LOOP_AREA = {"isobaric": "N", "sealed": "J"}  # units
FURTHER = {"auxotonic": ("force", "N"), "sealed": ("pressure", "Pa")}  # what is drawn below: (ordinate, unit)
PULLING = 0.02  # of F_ce: below it the muscle goes slack and its curve is no line


@dataclass(frozen=True, repr=False)
class Trial(Shown):
    """A finished test of one muscle."""

    plan: StandPlan  # what is tested and how
    curves: tuple[Rows, ...]  # columns of each curve [SI] (n,)
    metrics: tuple[dict[str, Metric], ...]  # of each curve, with their units
    static: bool = False  # computed by the law alone, without simulation
    warnings: tuple[Notice, ...] = ()  # where a law is beyond its range
    wall_seconds: float = field(default=0.0, compare=False)  # that it took [s]

    @property
    def name(self) -> str:
        """Muscle, law, and friction where there is one."""
        muscle = self.plan.muscle
        many = f" ({muscle.pieces} in series)" if muscle.pieces > 1 else ""
        parts = [muscle.name + many, muscle.law] + ([muscle.friction] if muscle.friction != "none" else [])
        return " · ".join(dict.fromkeys(parts))

    def loop(self, curve: int) -> Rows:
        """The rows of a curve's last way up and down; what came before ran the friction in."""
        columns = self.curves[curve]
        last = columns["branch"] >= columns["branch"].max() - (columns["branch"].max() % 2)
        return {name: values[last] for name, values in columns.items()}


def run(plan: StandPlan, progress: Progress | None = None) -> Trial:
    """Run a plan in the rig; `progress` is called with (steps done, steps in all)."""
    start = time.perf_counter()
    curves = tuple(complete(plan, k, rows) for k, rows in enumerate(roll(plan, progress)))
    return _trial(plan, curves, static=False, wall=time.perf_counter() - start)


def static(plan: StandPlan, rows: int = 200) -> Trial:
    """The formula along a plan's first way up: no rig, no friction, no damping."""
    if plan.kind in ("step", "release"):
        raise InputError("has no static formula", field="kind", value=plan.kind, allowed=", ".join(AXES))
    start = time.perf_counter()
    times = np.linspace(0.0, plan.duration, rows + 1)
    wave = plan.wave(times)[:, None]
    pressure = (plan.pressure[:, 0] + (plan.pressure[:, 1] - plan.pressure[:, 0]) * wave).T
    contraction = (plan.contraction[:, 0] + (plan.contraction[:, 1] - plan.contraction[:, 0]) * wave).T
    curves = []
    for k, (p, kappa) in enumerate(zip(pressure, contraction, strict=True)):
        if not plan.held:
            load = float(plan.load[k])
            kappa = np.array([hanging(plan.muscle, load, float(x), float(plan.spring[k])) for x in p])
        volume = plan.laboratory.tube_volume + plan.muscle.volume(contraction=kappa, pressure=p)
        shut_in = (p[0] + AMBIENT_PRESSURE) * volume[0]
        for _ in range(20 if plan.kind == "sealed" else 0):  # isothermal; the volume hardly depends on p
            p = shut_in / volume - AMBIENT_PRESSURE
            volume = plan.laboratory.tube_volume + plan.muscle.volume(contraction=kappa, pressure=p)
        columns = {
            "time": times,
            "pressure": p,
            "contraction": kappa,
            "contraction_rate": np.zeros_like(p),
            "force": plan.muscle.force(p, contraction=kappa),
            "air_mass": (p + AMBIENT_PRESSURE) * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE),
            "volume": volume,
            "inflow": np.zeros_like(p),
            "outflow": np.zeros_like(p),
        }
        curves.append(complete(plan, k, columns))
    return _trial(plan, tuple(curves), static=True, wall=time.perf_counter() - start)


def complete(plan: StandPlan, k: int, rows: Rows) -> Rows:
    """A curve's columns, in the order of COLUMNS."""
    length, kappa = plan.muscle.nominal_length, rows["contraction"]
    columns = rows | {
        "branch": plan.branch(rows["time"]),
        "length": length * (1.0 - kappa),
        "velocity": -length * rows["contraction_rate"],
        "static_force": plan.muscle.force(rows.get("muscle_pressure", rows["pressure"]), contraction=kappa),
        "load": plan.carried(k, kappa),
    }
    return {name: columns[name] for name in COLUMNS}


def _trial(plan: StandPlan, curves: tuple[Rows, ...], *, static: bool, wall: float) -> Trial:
    loops = enumerate(map(Trial(plan, curves, (), static).loop, range(len(curves))))
    if plan.kind in AXES:
        found = tuple(_sweep(plan, k, loop) for k, loop in loops)
    else:
        found = tuple((_step if plan.kind == "step" else _release)(plan, loop) for _, loop in loops)
    return Trial(plan, curves, found, static, tuple(limits_left(plan, curves)), wall)


def limits_left(plan: StandPlan, curves: tuple[Rows, ...]) -> Iterator[Notice]:
    """Warnings of a muscle beyond its limits, or beyond its law's range of validity."""
    muscle = plan.muscle
    limits, law = muscle.limits, muscle.law_set
    names = ("pressure", "contraction", "force")
    pressure, contraction, force = (np.concatenate([columns[n] for columns in curves]) for n in names)
    least, most = limits.contraction_min, max(limits.contraction_max, muscle.contraction_range[1])
    low, high = law.pressure_range
    strong, stretched = (provenance_note(limits, key) for key in ("force", "contraction_min"))
    law_pressure = f"range of {low * 1e-5:g} to {high * 1e-5:g} bar"
    asked = f"the law {muscle.law} is asked at {{:.3g}} bar"
    from_contraction, most_pressure = law.contraction_range[0], f"limit of {limits.pressure * 1e-5:g} bar"
    shortened = np.maximum(contraction, 0.0)  # stretched, the law is asked at zero
    law_contraction, too_long = f"range from {from_contraction:g} on", from_contraction - shortened
    asked_at = f"the law {muscle.law} is asked at a contraction of {{:.3f}}"
    outside = np.maximum(low - pressure, pressure - high)
    most_force = f"limit of {limits.force:g} N{strong}"
    longest, shortest = f"limit of {least:g}{stretched}", f"limit of {most:g}"
    compared = (  # code, text, values, excess over the limit, tolerated excess, limit
        ("force", "force reaches {:.4g} N", force, force - limits.force, 1.0, most_force),
        ("contraction", "contraction reaches {:.3f}", contraction, contraction - most, 1e-3, shortest),
        ("stretched", "is stretched to {:.3f}", contraction, least - contraction, 1e-3, longest),
        ("law-pressure", asked, pressure * 1e-5, outside, 1e3, law_pressure),
        ("law-contraction", asked_at, shortened, too_long, 1e-3, law_contraction),
        ("pressure", "holds {:.3g} bar", pressure * 1e-5, pressure - limits.pressure, 1e3, most_pressure),
    )
    for code, text, values, beyond, tolerance, limit in compared:
        worst = int(np.argmax(np.where(force > NEGLIGIBLE * limits.force, beyond, -np.inf)))
        if beyond[worst] > tolerance and force[worst] > NEGLIGIBLE * limits.force:
            shown = text.format(round(float(values[worst]), 6) + 0.0)
            said = "{subject}: {reached}, beyond its {limit}"
            yield Notice(code, said, subject=muscle.name, reached=shown, limit=limit)
    if plan.kind in ("step", "release") and not plan.held and "assumed" in provenance_note(muscle, "mass"):
        yield Notice("mass", "{subject}: its mass is assumed, and so is power per mass", subject=muscle.name)
    if muscle.length_warning:
        text = "{subject}: {problem}"
        yield Notice("length", text, subject=muscle.name, problem=muscle.length_warning)


def _sweep(plan: StandPlan, curve: int, columns: Rows) -> dict[str, Metric]:
    abscissa, _, ordinate, unit = AXES[plan.kind]
    x, y = columns["length" if plan.kind == "sealed" else abscissa], columns[ordinate]  # rises on the way up
    carried = columns["force"] if plan.held else columns["load"]
    off = float(np.abs(carried - columns["static_force"]).max(where=columns["force"] > 0.0, initial=0.0))
    strongest = force_at(plan.muscle, 0.0, float(plan.pressure.max()))
    # what the dampers and friction took: the formula alone gives back all that it takes
    lost = np.trapezoid(columns["static_force"] - columns["force"], -columns["length"])
    found = {
        f"greatest_{ordinate}": Metric(float(y.max()), unit),
        "off_formula": Metric(off, "N"),
        "off_formula_share": Metric(100.0 * off / strongest, "%"),
    }
    if plan.kind in FURTHER:
        other, its_unit = FURTHER[plan.kind]
        found[f"greatest_{other}"] = Metric(float(columns[other].max()), its_unit)
    if plan.kind == "sealed":
        turn = int(np.argmax(columns["branch"] % 2 == 1)) - 1
        risen, longer = (columns[name][turn] - columns[name][0] for name in ("force", "length"))
        found["mean_stiffness"] = Metric(float(risen / longer), "N/m")
    if plan.kind == "isobaric":
        wanted = plan.set_points[curve]
        found["pressure_off"] = Metric(100.0 * float(np.abs(columns["pressure"] / wanted - 1.0).max()), "%")
    down = columns["branch"] % 2 == 1
    if not down.any() or plan.kind == "isometric":  # nothing moves, so nothing rubs
        return found
    return found | {
        "loop_height": Metric(loop_height(x, y, down), unit),
        "loop_area": Metric(abs(float(np.trapezoid(y, x))), LOOP_AREA.get(plan.kind, "Pa")),
        "work_lost_per_cycle": Metric(float(lost), "J"),
    }


def loop_height(x: np.ndarray, y: np.ndarray, down: np.ndarray) -> float:
    """Greatest difference of y between the ways up and down at equal x."""
    if np.ptp(x) == 0.0:
        return 0.0
    up_x, up_y, down_x, down_y = x[~down], y[~down], x[down][::-1], y[down][::-1]
    grid = np.linspace(max(up_x[0], down_x[0]), min(up_x[-1], down_x[-1]), 400)
    return float(np.abs(np.interp(grid, up_x, up_y) - np.interp(grid, down_x, down_y)).max())


def _step(plan: StandPlan, columns: Rows) -> dict[str, Metric]:
    found = {}
    response, unit = ("force", "N") if plan.held else ("contraction", "")
    turn = int(np.searchsorted(columns["time"], plan.duration - 1e-9))
    for word, rows in (("fill", slice(0, turn + 1)), ("vent", slice(turn, None))):
        time = columns["time"][rows] - columns["time"][rows][0]
        for name in ("pressure", response):
            values = columns[name][rows]
            found[f"{word}_{name}_dead_time"] = Metric(time_to(BEGUN, time, values), "s")
            found[f"{word}_{name}_time_constant"] = Metric(time_to(REACHED, time, values), "s")
    filled = {name: float(columns[name][turn]) for name in ("pressure", response, "air_mass")}
    found["filled_pressure"] = Metric(filled["pressure"], "Pa")
    found[f"filled_{response}"] = Metric(filled[response], unit)
    found["air_per_fill"] = Metric(1e3 * (filled["air_mass"] - float(columns["air_mass"][0])), "g")
    if not plan.held:
        found |= _power(plan, columns)
    before = int(np.searchsorted(columns["time"], 0.95 * plan.duration))
    moved = abs(filled[response] - float(columns[response][before]))
    found["still_moving"] = Metric(100.0 * moved / max(abs(filled[response]), 1e-12), "%")
    return found


def time_to(share: float, time: np.ndarray, values: np.ndarray) -> float:
    """First time at which a change from the first to the last value has gone a share of its way [s]."""
    change = values[-1] - values[0]
    if change == 0.0:
        return math.nan
    gone = (values - values[0]) / change
    k = int(np.argmax(gone >= share))
    if k == 0:
        return 0.0
    part = (share - gone[k - 1]) / (gone[k] - gone[k - 1])
    return float(time[k - 1] + part * (time[k] - time[k - 1]))


def _release(plan: StandPlan, columns: Rows) -> dict[str, Metric]:
    speed, contraction = -columns["velocity"], columns["contraction"]
    fastest = int(np.argmax(speed))
    way = contraction[-1] - contraction[0]
    return {
        "peak_speed": Metric(float(speed[fastest]), "m/s"),
        "time_of_peak_speed": Metric(float(columns["time"][fastest]), "s"),
        "time_constant": Metric(time_to(REACHED, columns["time"], contraction), "s"),
        "final_contraction": Metric(float(contraction[-1]), ""),
        "overshoot": Metric(100.0 * float(contraction.max() - contraction[-1]) / way if way else 0.0, "%"),
        "lowest_pressure": Metric(float(columns["pressure"].min()), "Pa"),
    } | _power(plan, columns)


def _power(plan: StandPlan, columns: Rows) -> dict[str, Metric]:
    """Peak of tension × shortening speed over 10 ms; per mass, and per air of the muscle at rest length."""
    peak = highest_mean(-columns["force"] * columns["velocity"], plan.timestep)
    mass, volume = plan.muscle.whole_mass, float(plan.muscle.volume(contraction=0.0))
    return {
        "peak_power": Metric(peak, "W"),
        "power_per_mass": Metric(1e-3 * peak / mass if mass else math.nan, "W/g"),
        "power_per_volume": Metric(1e-6 * peak / volume, "W/cm^3"),
    }


@dataclass(frozen=True)
class StaticLoad:
    """F_ce and K at each pressure, and the straight line F_ce = start + slope p."""

    pressure: np.ndarray  # gauge [Pa] (n,)
    contractile_force: np.ndarray  # F_ce [N] (n,)
    stiffness: np.ndarray  # K [N/m] (n,)
    start: float  # [N]
    slope: float  # [N/Pa]
    worst: float  # greatest distance of F_ce from its line [N]

    @property
    def text(self) -> str:
        """The line, for people."""
        low, high = self.stiffness.min() * 1e-3, self.stiffness.max() * 1e-3
        return (
            f"F_ce = {self.start:.1f} N + {self.slope * 1e3:.3f} N/kPa p (worst {self.worst:.2g} N off), "
            f"K {low:.2f} to {high:.2f} N/mm"
        )


def static_load(trial: Trial) -> StaticLoad:
    """F_ce and K from an isobaric test, as S0 takes them from hung loads."""
    force, stiffness = [], []
    for k in range(len(trial.curves)):
        loop = trial.loop(k)
        pulls = loop["force"] > PULLING * loop["force"].max()
        shortening = trial.plan.muscle.nominal_length * loop["contraction"][pulls]
        slope, start = np.polyfit(shortening, loop["force"][pulls], 1)
        force.append(start)
        stiffness.append(-slope)
    pressure, contractile = trial.plan.set_points, np.array(force)
    slope, start = np.polyfit(pressure, contractile, 1) if len(pressure) > 1 else (0.0, contractile[0])
    worst = float(np.abs(start + slope * pressure - contractile).max())
    return StaticLoad(pressure, contractile, np.array(stiffness), float(start), float(slope), worst)
