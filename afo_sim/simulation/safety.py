"""Safety margins of a run: pressure on the skin, muscles against their limits, life."""

from collections.abc import Callable, Collection, Iterator, Mapping

import numpy as np

from afo_sim.description.orthosis import Orthosis
from afo_sim.description.quantity import Described
from afo_sim.metrics.metric import TOLD, Metric
from afo_sim.metrics.safety import cuff_metrics, cycles, life_metrics, muscle_metrics, plate_metrics
from afo_sim.metrics.strides import settled, stance, strides
from afo_sim.model.build import Built
from afo_sim.model.mounting import chamber_of, muscle_names
from afo_sim.simulation.pull import pull_on

SKIN = {"shank": cuff_metrics, "foot": plate_metrics}
PARTS = {"shank": "cuff", "foot": "plate"}
WHO = {"shank": "it", "foot": "its strap"}
# none of them is made of another metric
NEEDED: dict[str, frozenset[str]] = {
    row.name: frozenset()
    for tell in (cuff_metrics, plate_metrics, muscle_metrics, life_metrics)
    for row in TOLD[tell]
}


def safety_metrics(
    built: Built,
    columns: Mapping[str, np.ndarray],
    *,
    solved: bool = False,
    wanted: Collection[str] | None = None,
) -> dict[str, Metric]:
    """Safety margins, as metrics: of the strides that count, of a run without a gait over all of it."""
    scenario = built.scenario
    asked = NEEDED if wanted is None else NEEDED.keys() & set(wanted)
    if not scenario.orthosis.muscle or not asked:
        return {}
    rows, number = slice(None), 0
    if built.walk is not None:
        whole = strides(columns, scenario.timestep, built.body_mass)
        counted = whole[-1:] if solved else settled(columns, whole)
        if not counted:
            return {}
        rows, number = slice(counted[0].rows.start, counted[-1].rows.stop), len(counted)
    part = {
        name: values[rows]
        for name, values in columns.items()
        if name == "ankle/angle" or name.startswith(("muscle/", "chamber/"))
    }
    found = skin_metrics(built, part, wanted)
    if _asks(muscle_metrics, wanted):
        found |= muscle_metrics(_shares(scenario.orthosis, part))
    limits = scenario.limits
    if number and limits is not None and _asks(life_metrics, wanted):
        most = max(cycles(part[f"chamber/{name}/pressure"], number) for name in scenario.orthosis.chamber)
        found |= life_metrics(most, limits.muscle_life, limits.strides_per_day)
    return found


def _asks(tell: Callable[..., dict[str, Metric]], wanted: Collection[str] | None) -> bool:
    """Whether a metric is wanted that a function tells; None asks for all."""
    return wanted is None or any(row.name in wanted for row in TOLD[tell])


def skin_metrics(
    built: Built, columns: Mapping[str, np.ndarray], wanted: Collection[str] | None = None
) -> dict[str, Metric]:
    """Pressure of cuff and plate on the skin over all rows; of those that `orthosis.interface` describes."""
    orthosis, limits = built.scenario.orthosis, built.scenario.limits
    found: dict[str, Metric] = {}
    if not orthosis.anchored:
        return found
    bounds = (None, None) if limits is None else (limits.skin_pressure, limits.blood_flow_pressure)
    for segment, interface in orthosis.interface.items():
        if not _asks(SKIN[segment], wanted):
            continue
        pull = pull_on(orthosis, columns, segment)
        found |= SKIN[segment](pull, interface.area, interface.friction, *bounds)
    return found


def _shares(orthosis: Orthosis, columns: Mapping[str, np.ndarray]) -> dict[str, list[float]]:
    """Peak of each muscle over its limit [-]; a braid that may not be stretched at all has no share of it."""
    found: dict[str, list[float]] = {"pressure": [], "force": [], "contraction": [], "stretch": []}
    for name, group in muscle_names(orthosis).items():
        limits, contraction = group.type.limits, columns[f"muscle/{name}/contraction"]
        pressure = columns[f"chamber/{chamber_of(name, group)}/pressure"]
        found["pressure"].append(float(pressure.max()) / limits.pressure)
        found["force"].append(float(columns[f"muscle/{name}/force"].max()) / limits.force)
        found["contraction"].append(float(contraction.max()) / limits.contraction_max)
        if limits.contraction_min < 0.0:
            found["stretch"].append(float(contraction.min()) / limits.contraction_min)
    return found


def skin_warnings(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[str]:
    """Warnings of a cuff or strap that presses beyond discomfort, at any time of these rows.

    Blood flow is no warning: nearly every cuff that holds by friction hinders it while it is drawn tight.
    """
    limits, found = built.scenario.limits, skin_metrics(built, columns)
    for segment, interface in built.scenario.orthosis.interface.items():
        part = PARTS[segment]
        if limits is None or f"{part}_skin_pressure" not in found:
            continue
        pressure = found[f"{part}_skin_pressure"].value
        discomfort, pain = (1e-3 * limit for limit in limits.skin_pressure)
        if pressure > discomfort:
            worse = (
                f"{discomfort:g} kPa at which discomfort begins (pain from {pain:g} kPa"
                if pressure <= pain
                else f"{pain:g} kPa at which pain begins (discomfort from {discomfort:g} kPa"
            )
            yield (
                f"{part}: {WHO[segment]} must press with {pressure:.3g} kPa on the skin so as not to slide "
                f"under {found[f'{part}_pull_along'].value:.0f} N, more than the {worse}"
                f"{_kinds(limits, 'skin_pressure', mark='; ')}); over {1e4 * interface.area:g} cm², "
                f"at a friction of {interface.friction:g}{_kinds(interface, 'area', 'friction', mark=': ')}"
                f"{_in_swing(built, columns, f'{part}_skin_pressure', discomfort)}"
            )


def _in_swing(built: Built, columns: Mapping[str, np.ndarray], name: str, limit: float) -> str:
    """A word where the limit [kPa] is kept in swing: on the recorded ground a foot may slap in stance."""
    if built.walk is None or built.contact is not None:
        return ""
    swing = ~stance(columns, built.body_mass)
    if not swing.any():
        return ""
    pressure = skin_metrics(built, {key: values[swing] for key, values in columns.items()})[name].value
    if pressure > limit:
        return ""
    return f"; in swing it is {pressure:.3g} kPa: look at stance with --set ground.mode=contact"


def _kinds(described: Described, *keys: str, mark: str) -> str:
    """What kinds of numbers some keys of a description hold, behind `mark`; nothing where none is told."""
    kinds = {described.provenance[key].kind for key in keys if key in described.provenance}
    return mark + " and ".join(sorted(kinds)) if kinds else ""
