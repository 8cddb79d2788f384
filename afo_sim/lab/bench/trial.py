"""The virtual muscle test stand: isobaric, isotonic, isometric, step and release tests of one muscle.

Each runs the compiled muscle in its rig, through valve and chamber (`stand_rig`); `static` gives the
formula over the same lengths and pressures.

Source: the three characteristics after Takosoglu et al. 2016 (S3); open loop and static load after S0.
"""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.description.muscle import Muscle
from afo_sim.description.quantity import provenance_note
from afo_sim.description.reader import load as load_description
from afo_sim.lab.bench.measures import measures
from afo_sim.lab.bench.plan import (
    Laboratory,
    StandPlan,
    plan_isobaric,
    plan_isometric,
    plan_isotonic,
    plan_release,
    plan_step,
)
from afo_sim.lab.bench.rest import force_at, hanging, rest_force
from afo_sim.lab.bench.rig import Progress, Rows, roll
from afo_sim.metrics.metric import Metric
from afo_sim.physics.pneumatics import muscle_volume

NEGLIGIBLE = 0.01  # share of a muscle's force limit below which its law's range does not matter

# Unit and meaning of every column.
COLUMNS = {
    "time": ("s", "from the start of the test"),
    "branch": ("", "0 is the first way up, 1 down, and so on"),
    "pressure": ("Pa", "gauge, in the muscle"),
    "contraction": ("", "(L0 - L)/L0, shorter is positive"),
    "length": ("m", "active braid length"),
    "velocity": ("m/s", "lengthening positive"),
    "force": ("N", "tension of the muscle"),
    "static_force": ("N", "the formula at this contraction and pressure, without friction and damping"),
    "load": ("N", "weight on the carriage; not a number where the length is prescribed"),
    "air_mass": ("kg", "air in muscle and tube"),
    "volume": ("m^3", "muscle and tube"),
    "inflow": ("kg/s", "into the muscle, through either valve"),
    "outflow": ("kg/s", "out of the muscle, through either valve"),
}


@dataclass(frozen=True)
class Trial:
    """A finished test of one muscle.

    plan : what was set
    curves : per set point {column: values}, SI, as in COLUMNS
    metrics : per set point, as `stand_measures.measures` names them
    static : the formula instead of the rig
    warnings : limits that were left
    wall_seconds : what it took
    """

    plan: StandPlan
    curves: tuple[Rows, ...]
    metrics: tuple[dict[str, Metric], ...]
    static: bool = False
    warnings: tuple[str, ...] = ()
    wall_seconds: float = field(default=0.0, compare=False)

    @property
    def name(self) -> str:
        """Muscle, law, and friction where there is one."""
        muscle = self.plan.muscle
        parts = [muscle.name, muscle.law] + ([muscle.friction] if muscle.friction != "none" else [])
        return " · ".join(dict.fromkeys(parts))

    def loop(self, curve: int) -> Rows:
        """The rows of a curve's last way up and down; what came before ran the friction in."""
        columns = self.curves[curve]
        last = columns["branch"] >= columns["branch"].max() - (columns["branch"].max() % 2)
        return {name: values[last] for name, values in columns.items()}


def isobaric(
    muscle: Muscle | str,
    pressures: Sequence[float] | None = None,
    span: tuple[float, float | None] | None = None,
    *,
    laboratory: Laboratory | None = None,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Trial:
    """Force over contraction at constant pressure: the carriage is driven up and down.

    Units: pressures [Pa], span [-], duration [s], progress (steps done, steps in all).
    """
    return run(plan_isobaric(_muscle(muscle), pressures, span, laboratory, duration), progress)


def isotonic(
    muscle: Muscle | str,
    loads: Sequence[float] | None = None,
    span: tuple[float | None, float] | None = None,
    *,
    laboratory: Laboratory | None = None,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Trial:
    """Contraction over pressure under constant loads [N]: weights hang on the carriage.

    `span` is the pressure from, to [Pa]; from None, each load begins where it stretches the muscle no further
    than its limit. The other parameters, result and errors as in `isobaric`.
    """
    return run(plan_isotonic(_muscle(muscle), loads, span, laboratory, duration), progress)


def isometric(
    muscle: Muscle | str,
    contractions: Sequence[float] | None = None,
    span: tuple[float, float] | None = None,
    *,
    laboratory: Laboratory | None = None,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Trial:
    """Force over pressure at constant contractions [-]: the carriage is held.

    `span` is the pressure from, to [Pa]; the other parameters, result and errors as in `isobaric`. Nothing
    moves, so friction does not show.
    """
    return run(plan_isometric(_muscle(muscle), contractions, span, laboratory, duration), progress)


def step(
    muscle: Muscle | str,
    pressures: Sequence[float] | None = None,
    *,
    load: float | None = None,
    contraction: float | None = None,
    laboratory: Laboratory | None = None,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Trial:
    """Open loop: the inlet valve opens to a supply at each pressure [Pa], then the outlet to ambient.

    Units: load [N], contraction [-], duration [s].
    """
    return run(plan_step(_muscle(muscle), pressures, load, contraction, laboratory, duration), progress)


def release(
    muscle: Muscle | str,
    pressures: Sequence[float] | None = None,
    *,
    load: float | None = None,
    contraction: float = 0.0,
    laboratory: Laboratory | None = None,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Trial:
    """Quick release: held at a contraction [-] under each pressure [Pa], then let go against a load [N].

    The other parameters, result and errors as in `step`.
    """
    return run(plan_release(_muscle(muscle), pressures, load, contraction, laboratory, duration), progress)


PLANS: dict[str, Callable[..., StandPlan]] = {
    "isobaric": plan_isobaric,
    "isotonic": plan_isotonic,
    "isometric": plan_isometric,
    "step": plan_step,
    "release": plan_release,
}


def run(plan: StandPlan, progress: Progress | None = None) -> Trial:
    """Run a plan in the rig."""
    start = time.perf_counter()
    curves = tuple(_complete(plan, k, rows) for k, rows in enumerate(roll(plan, progress)))
    return _trial(plan, curves, static=False, wall=time.perf_counter() - start)


def static(plan: StandPlan, rows: int = 200) -> Trial:
    """The formula along a plan's first way up: no rig, no friction, no damping.

    Raises
    ------
    InputError
        Steps and releases are no states of rest.
    """
    if plan.kind in ("step", "release"):
        raise InputError(
            "has no static formula", field="kind", value=plan.kind, allowed="isobaric, isotonic, isometric"
        )
    start = time.perf_counter()
    times = np.linspace(0.0, plan.duration, rows + 1)
    wave = plan.wave(times)[:, None]
    pressure = (plan.pressure[:, 0] + (plan.pressure[:, 1] - plan.pressure[:, 0]) * wave).T
    contraction = (plan.contraction[:, 0] + (plan.contraction[:, 1] - plan.contraction[:, 0]) * wave).T
    curves = []
    for k, (p, kappa) in enumerate(zip(pressure, contraction, strict=True)):
        if not plan.held:
            load = float(plan.load[k])
            kappa = np.array([hanging(plan.muscle, load, float(x)) for x in p])
        braid, dead = plan.muscle.braid, plan.muscle.dead_volume
        volume = plan.laboratory.tube_volume + np.array(
            [muscle_volume(x, braid.nominal_length, braid.nominal_radius, braid.b, dead)[0] for x in kappa]
        )
        columns = {
            "time": times,
            "pressure": p,
            "contraction": kappa,
            "contraction_rate": np.zeros_like(p),
            "force": rest_force(plan.muscle, kappa, p),
            "air_mass": (p + AMBIENT_PRESSURE) * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE),
            "volume": volume,
            "inflow": np.zeros_like(p),
            "outflow": np.zeros_like(p),
        }
        curves.append(_complete(plan, k, columns))
    return _trial(plan, tuple(curves), static=True, wall=time.perf_counter() - start)


def _muscle(muscle: Muscle | str | os.PathLike[str]) -> Any:
    return muscle if isinstance(muscle, Muscle) else load_description("muscle", muscle)


def _complete(plan: StandPlan, k: int, rows: Rows) -> Rows:
    """A curve's columns, in the order of COLUMNS."""
    length = plan.muscle.nominal_length
    columns = rows | {
        "branch": plan.branch(rows["time"]),
        "length": length * (1.0 - rows["contraction"]),
        "velocity": -length * rows["contraction_rate"],
        "static_force": rest_force(plan.muscle, rows["contraction"], rows["pressure"]),
        "load": np.full(len(rows["time"]), plan.load[k]),
    }
    return {name: columns[name] for name in COLUMNS}


def _trial(plan: StandPlan, curves: tuple[Rows, ...], *, static: bool, wall: float) -> Trial:
    strongest = force_at(plan.muscle, 0.0, float(plan.pressure.max()))
    bare = Trial(plan, curves, (), static)
    found = tuple(measures(plan, k, bare.loop(k), strongest) for k in range(len(curves)))
    return Trial(plan, curves, found, static, tuple(_warnings(plan, curves)), wall)


def _warnings(plan: StandPlan, curves: tuple[Rows, ...]) -> Iterator[str]:
    """Warnings of a muscle beyond its limits, or beyond its law's range of validity."""
    muscle = plan.muscle
    limits, law = muscle.limits, muscle.law_set
    pressure, contraction, force = (
        np.concatenate([columns[name] for columns in curves]) for name in ("pressure", "contraction", "force")
    )
    least, most = limits.contraction_min, max(limits.contraction_max, law.contraction_range[1])
    low, high = law.pressure_range
    strong, stretched = (provenance_note(limits, key) for key in ("force", "contraction_min"))
    compared = (  # text, values, excess over the limit, tolerated excess, limit
        (
            "force reaches {:.4g} N",
            force,
            force - limits.force,
            1.0,
            f"limit of {limits.force:g} N{strong}",
        ),
        ("contraction reaches {:.3f}", contraction, contraction - most, 1e-3, f"limit of {most:g}"),
        (
            "is stretched to {:.3f}",
            contraction,
            least - contraction,
            1e-3,
            f"limit of {least:g}{stretched}",
        ),
        (
            f"the law {muscle.law} is asked at {{:.3g}} bar",
            pressure * 1e-5,
            np.maximum(low - pressure, pressure - high),
            1e3,
            f"range of {low * 1e-5:g} to {high * 1e-5:g} bar",
        ),
    )
    for text, values, beyond, tolerance, limit in compared:
        worst = int(np.argmax(np.where(force > NEGLIGIBLE * limits.force, beyond, -np.inf)))
        if beyond[worst] > tolerance and force[worst] > NEGLIGIBLE * limits.force:
            shown = text.format(round(float(values[worst]), 6) + 0.0)
            yield f"{muscle.name}: {shown}, beyond its {limit}"
    if muscle.length_warning:
        yield f"{muscle.name}: {muscle.length_warning}"
