"""Pressure of cuff and plate on the skin, against limits of discomfort and pain.

A cuff holds along the limb by friction alone. So it must press with its pull along the limb over the
coefficient of friction. A strap is drawn tight once and for the strongest pull: what it presses with then, it
presses with all the time.
"""

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.facts import Columns, Facts, Run
from afo_sim.metrics.metric import SAFETY, Found, Metric, Of, all_measured, reported

HOLDS = "least total force on the skin that prevents sliding: peak pull along the shank divided by friction"


def _share_rows(part: str, what: str, when: str) -> tuple[tuple[str, ...], ...]:
    """Rows of the registry for a part's pressure by its limits."""
    of, blood = f"{what} pressure as a share of the", "sustained; above 100 % blood flow may be hindered"
    return (
        (f"{part}_share_of_discomfort", "percent", f"{of} discomfort limit", f"{when}discomfort from 100 %"),
        (f"{part}_share_of_pain", "percent", f"{of} pain limit", f"{when}pain from 100 %"),
        (f"{part}_share_of_blood_flow", "percent", f"{of} blood-flow limit", blood),
    )


@reported(
    SAFETY,
    ("cuff_pull_along", "N", "Pull on the cuff along the shank, peak", "friction on the skin carries it"),
    ("cuff_pull_across", "N", "Pull on the cuff across the shank, peak", "presses it against the limb"),
    ("cuff_holding_force", "N", "Force that keeps the cuff from sliding", HOLDS),
    ("cuff_skin_pressure", "kPa", "Pressure under the cuff, peak",
     "mean over its area: the force that keeps it from sliding, and the pull across"),
    ("cuff_skin_pressure_sustained", "kPa", "Pressure under the cuff, sustained",
     "from the force that prevents sliding alone: the strap stays as tight as the peak requires"),
    *_share_rows("cuff", "Cuff", "peak; "),
    ("plate_pull_along", "N", "Pull on the plate along the sole, peak", "friction on the foot carries it"),
    ("plate_pull_across", "N", "Pull of the plate against the sole, peak",
     "not a margin: standing loads the sole many times as much"),
    ("plate_holding_force", "N", "Force of the strap that keeps the plate from sliding",
     "over the instep: peak pull along the sole divided by friction, minus the pull against the sole"),
    ("plate_skin_pressure", "kPa", "Pressure under the plate's strap",
     "mean over its area, all the time; 0 where friction on the sole is enough"),
    *_share_rows("plate", "Strap", ""),
    of=Of.RUN,
)  # fmt: skip
def skin(run: Run) -> Found:
    """What the cuff and the strap of a foot's plate press with in the rows that count."""
    for part in ("cuff", "plate"):
        if run.rows and part in (run.facts.skins or {}):
            yield from skin_metrics(run.facts, part, run.rows).items()


def skin_metrics(facts: Facts, part: str, columns: Columns) -> dict[str, Metric]:
    """Pressure of the cuff or the plate on the skin over all rows."""
    assert facts.skins is not None
    skin, limits = facts.skins[part], facts.limits
    bounds = (None, None) if limits is None else (limits.skin_pressure, limits.blood_flow_pressure)
    pull = skin.pull(columns)
    return all_measured(pressures(part, pull, facts.timestep, skin.area, skin.friction, *bounds))


def pressures(
    part: str, pull: np.ndarray, timestep: float, area: float, friction: float,
    skin_pressure: tuple[float, float] | None = None, blood_flow: float | None = None,
) -> Found:  # fmt: skip
    """Pressure of a part under a pull on it (n, 3), peaks over 10 ms; no share [percent] without a limit."""
    in_plane = np.hypot(pull[:, 0], pull[:, 1])
    # the strap of a cuff is as tight all the time as its strongest pull along the limb requires, so what
    # presses across at another instant comes on top of that
    if part == "cuff":
        along, across = peak.highest_mean(np.abs(pull[:, 2]), timestep), peak.highest_mean(in_plane, timestep)
        holding = along / friction
        sustained, highest = holding / area, (holding + across) / area
    else:
        along, across = peak.highest_mean(in_plane, timestep), peak.highest_mean(pull[:, 2], timestep)
        holding = peak.highest_mean(in_plane / friction - pull[:, 2], timestep)
        sustained = highest = holding / area
    yield f"{part}_pull_along", along
    yield f"{part}_pull_across", across
    yield f"{part}_holding_force", holding
    yield f"{part}_skin_pressure", 1e-3 * highest
    if part == "cuff":
        yield "cuff_skin_pressure_sustained", 1e-3 * sustained
    if skin_pressure is not None:
        yield f"{part}_share_of_discomfort", 100.0 * highest / skin_pressure[0]
        yield f"{part}_share_of_pain", 100.0 * highest / skin_pressure[1]
    if blood_flow is not None:
        yield f"{part}_share_of_blood_flow", 100.0 * sustained / blood_flow
