"""How hard cuff and plate press on the skin, against what discomforts and pains.

A cuff holds along the limb by friction alone. So it must press with its pull along the limb over the
coefficient of friction. A strap is drawn tight once and for the strongest pull: what it presses with then, it
presses with all the time.
"""

import numpy as np

from afo_sim.metrics.facts import Columns, Facts, Run
from afo_sim.metrics.metric import SAFETY, Found, Metric, Of, all_measured, reported

HOLDS = "least total force on the skin that prevents sliding: peak pull along the shank divided by friction"


@reported(
    SAFETY,
    ("cuff_pull_along", "N", "Pull on the cuff along the shank, peak", "friction on the skin carries it"),
    ("cuff_pull_across", "N", "Pull on the cuff across the shank, peak", "presses it against the limb"),
    ("cuff_holding_force", "N", "Force that keeps the cuff from sliding", HOLDS),
    (
        "cuff_skin_pressure",
        "kPa",
        "Pressure under the cuff, peak",
        "mean over its area: the force that keeps it from sliding, and the pull across",
    ),
    (
        "cuff_skin_pressure_sustained",
        "kPa",
        "Pressure under the cuff, sustained",
        "from the force that prevents sliding alone: the strap stays as tight as the peak requires",
    ),
    (
        "cuff_share_of_discomfort",
        "percent",
        "Cuff pressure as a share of the discomfort limit",
        "peak; discomfort from 100 %",
    ),
    ("cuff_share_of_pain", "percent", "Cuff pressure as a share of the pain limit", "peak; pain from 100 %"),
    (
        "cuff_share_of_blood_flow",
        "percent",
        "Cuff pressure as a share of the blood-flow limit",
        "sustained; above 100 % blood flow may be hindered",
    ),
    of=Of.RUN,
)
def cuff(run: Run) -> Found:
    """Pressure of a shank's cuff on the skin."""
    return _skin(run, "cuff")


def cuff_metrics(
    pull: np.ndarray,
    area: float,
    friction: float,
    skin_pressure: tuple[float, float] | None = None,
    blood_flow: float | None = None,
) -> dict[str, Metric]:
    """Pressure of a shank's cuff on the skin."""
    along = float(np.abs(pull[:, 2]).max())
    across = float(np.hypot(pull[:, 0], pull[:, 1]).max())
    holding = along / friction
    sustained, peak = holding / area, (holding + across) / area
    values = {
        "cuff_pull_along": along,
        "cuff_pull_across": across,
        "cuff_holding_force": holding,
        "cuff_skin_pressure": 1e-3 * peak,
        "cuff_skin_pressure_sustained": 1e-3 * sustained,
    }
    values |= _shares("cuff", peak, sustained, skin_pressure, blood_flow)
    return all_measured(values.items())


@reported(
    SAFETY,
    ("plate_pull_along", "N", "Pull on the plate along the sole, peak", "friction on the foot carries it"),
    (
        "plate_pull_across",
        "N",
        "Pull of the plate against the sole, peak",
        "not a margin: standing loads the sole many times as much",
    ),
    (
        "plate_holding_force",
        "N",
        "Force of the strap that keeps the plate from sliding",
        "over the instep: peak pull along the sole divided by friction, minus the pull against the sole",
    ),
    (
        "plate_skin_pressure",
        "kPa",
        "Pressure under the plate's strap",
        "mean over its area, all the time; 0 where friction on the sole is enough",
    ),
    (
        "plate_share_of_discomfort",
        "percent",
        "Strap pressure as a share of the discomfort limit",
        "discomfort from 100 %",
    ),
    ("plate_share_of_pain", "percent", "Strap pressure as a share of the pain limit", "pain from 100 %"),
    (
        "plate_share_of_blood_flow",
        "percent",
        "Strap pressure as a share of the blood-flow limit",
        "sustained; above 100 % blood flow may be hindered",
    ),
    of=Of.RUN,
)
def plate(run: Run) -> Found:
    """Pressure of the strap that holds a foot's plate."""
    return _skin(run, "plate")


def plate_metrics(
    pull: np.ndarray,
    area: float,
    friction: float,
    skin_pressure: tuple[float, float] | None = None,
    blood_flow: float | None = None,
) -> dict[str, Metric]:
    """Pressure of the strap that holds a foot's plate."""
    along = np.hypot(pull[:, 0], pull[:, 1])
    holding = max(0.0, float((along / friction - pull[:, 2]).max()))
    pressure = holding / area
    values = {
        "plate_pull_along": float(along.max()),
        "plate_pull_across": max(0.0, float(pull[:, 2].max())),
        "plate_holding_force": holding,
        "plate_skin_pressure": 1e-3 * pressure,
    }
    values |= _shares("plate", pressure, pressure, skin_pressure, blood_flow)
    return all_measured(values.items())


def _skin(run: Run, part: str) -> Found:
    """What a part presses with in the rows that count; nothing where there is no such part."""
    if run.rows and part in (run.facts.skins or {}):
        yield from skin_metrics(run.facts, part, run.rows).items()


def skin_metrics(facts: Facts, part: str, columns: Columns) -> dict[str, Metric]:
    """Pressure of the cuff or the plate on the skin over all rows."""
    assert facts.skins is not None
    skin, limits = facts.skins[part], facts.limits
    of = cuff_metrics if part == "cuff" else plate_metrics
    bounds = (None, None) if limits is None else (limits.skin_pressure, limits.blood_flow_pressure)
    return of(skin.pull(columns), skin.area, skin.friction, *bounds)


def _shares(
    part: str,
    peak: float,
    sustained: float,
    skin_pressure: tuple[float, float] | None,
    blood_flow: float | None,
) -> dict[str, float]:
    """Pressures [Pa] by their limits [percent]; without a limit there is no share."""
    found = {}
    if skin_pressure is not None:
        found[f"{part}_share_of_discomfort"] = 100.0 * peak / skin_pressure[0]
        found[f"{part}_share_of_pain"] = 100.0 * peak / skin_pressure[1]
    if blood_flow is not None:
        found[f"{part}_share_of_blood_flow"] = 100.0 * sustained / blood_flow
    return found
