"""Safety margins: how hard cuff and plate press on the skin, and how close the muscles come to their limits.

A cuff holds along the limb by friction alone. So it must press with its pull along the limb over the
coefficient of friction. A strap is drawn tight once and for the strongest pull: what it presses with then, it
presses with all the time.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from afo_sim.metrics.facts import Columns, Facts, MuscleLimits, Run, cut
from afo_sim.metrics.metric import SAFETY, Found, Metric, Of, measured, reported
from afo_sim.metrics.strides import RECORDED_FORCE, chambers, stance

SWING = 0.1  # of a chamber's highest pressure, by which it must rise and fall for that to be a cycle [-]
FILLED = 1e4  # gauge pressure that a chamber which is filled exceeds [Pa]
BAND = 0.25  # half the height of the band about the middle that a cycle crosses, of the swing [-]

HOLDS = "least total force on the skin that prevents sliding: peak pull along the shank divided by friction"
SLAP = "on the recorded ground no floor stops a slap: the loading response is left out if it has the peak"
LOADING = 0.3  # of the stride: the first half of stance, in which a foot slaps; assumed [-]
SLAPS = np.radians(5.0)  # below the recorded ankle, from which on the recorded force is another's; assumed
USED = "100 % is the limit; for the muscle that comes closest"
CYCLES = "a cycle is a filling and venting, however partial; a filled muscle has one a stride at least"


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
        "cuff_skin_pressure_without_slap",
        "kPa",
        "Pressure under the cuff without a slap, peak",
        SLAP,
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
    return {name: measured(name, value) for name, value in values.items()}


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
        "plate_skin_pressure_without_slap",
        "kPa",
        "Pressure under the plate's strap without a slap",
        SLAP,
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
    return {name: measured(name, value) for name, value in values.items()}


def _skin(run: Run, part: str) -> Found:
    """What a part presses with in the rows that count; nothing where there is no such part."""
    if run.rows and part in (run.facts.skins or {}):
        yield from skin_metrics(run.facts, part, run.rows).items()
        if (landed := pressure_without_slap(run.facts, part, run.rows)) is not None:
            yield f"{part}_skin_pressure_without_slap", landed


def skin_metrics(facts: Facts, part: str, columns: Columns) -> dict[str, Metric]:
    """Pressure of the cuff or the plate on the skin over all rows."""
    assert facts.skins is not None
    skin, limits = facts.skins[part], facts.limits
    of = cuff_metrics if part == "cuff" else plate_metrics
    bounds = (None, None) if limits is None else (limits.skin_pressure, limits.blood_flow_pressure)
    return of(skin.pull(columns), skin.area, skin.friction, *bounds)


def pressure_without_slap(facts: Facts, part: str, columns: Columns) -> float | None:
    """Peak pressure on the recorded ground [kPa], outside the loading response if its slap is the highest."""
    if not facts.walks or part not in (facts.skins or {}) or RECORDED_FORCE in columns:
        return None
    assert facts.skins is not None
    landing = stance(columns, facts.body_mass) & (columns["gait/phase"] < LOADING)
    peak = int(np.argmax(np.linalg.norm(facts.skins[part].pull(columns), axis=1)))
    dives = columns["ankle/angle"][peak] < columns["gait/ankle_angle"][peak] - SLAPS
    slaps = bool(landing[peak] and dives and not landing.all())
    rows = cut(columns, lambda values: values[~landing]) if slaps else columns
    return skin_metrics(facts, part, rows)[f"{part}_skin_pressure"].value


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


@reported(
    SAFETY,
    ("muscle_share_of_pressure", "percent", "Highest muscle pressure as a share of its limit", USED),
    ("muscle_share_of_force", "percent", "Highest muscle force as a share of its limit", USED),
    ("muscle_share_of_contraction", "percent", "Greatest contraction as a share of its limit", USED),
    ("muscle_share_of_stretch", "percent", "Greatest stretch as a share of its limit", USED),
    of=Of.RUN,
)
def muscles(run: Run) -> Found:
    """How close muscles come to their limits."""
    if not run.rows:
        return
    yield from muscle_metrics(_muscle_shares(run.facts.muscles or {}, run.rows)).items()


def _muscle_shares(limits: Mapping[str, MuscleLimits], columns: Columns) -> dict[str, list[float]]:
    """Peak of each muscle over its limit [-]; a braid that may not be stretched at all has no share of it."""
    found: dict[str, list[float]] = {"pressure": [], "force": [], "contraction": [], "stretch": []}
    for name, own in limits.items():
        contraction = columns[f"muscle/{name}/contraction"]
        pressure = columns[f"chamber/{own.chamber}/pressure"]
        found["pressure"].append(float(pressure.max()) / own.pressure)
        found["force"].append(float(columns[f"muscle/{name}/force"].max()) / own.force)
        found["contraction"].append(float(contraction.max()) / own.contraction_max)
        if own.contraction_min < 0.0:
            found["stretch"].append(float(contraction.min()) / own.contraction_min)
    return found


def muscle_metrics(shares: Mapping[str, Iterable[float]]) -> dict[str, Metric]:
    """How close muscles come to their limits."""
    found = {}
    for what, each in shares.items():
        known = list(each)
        if known:
            name = f"muscle_share_of_{what}"
            found[name] = measured(name, 100.0 * max(0.0, *known))
    return found


@reported(
    SAFETY,
    ("muscle_cycles_per_stride", "", "Cycles of the muscles per stride", CYCLES),
    ("strides_until_muscle_life", "", "Strides until the muscles' stated life", CYCLES),
    (
        "days_until_muscle_life",
        "d",
        "Days until the muscles' stated life",
        "at as many strides a day as the limits say",
    ),
    of=Of.RUN,
)
def muscle_life(run: Run) -> Found:
    """How long muscles last that are stated to last some number of cycles; of walking alone."""
    limits, number = run.facts.limits, len(run.counted)
    if limits is None or not number or not run.facts.muscles:
        return
    most = max(cycles(run.rows[f"chamber/{name}/pressure"], number) for name in chambers(run.rows))
    yield from life_metrics(most, limits.muscle_life, limits.strides_per_day).items()


def life_metrics(cycles: float, life: float, strides_per_day: float) -> dict[str, Metric]:
    """How long muscles last that are stated to last some number of cycles."""
    values = {"muscle_cycles_per_stride": cycles}
    if cycles > 0.0:
        values["strides_until_muscle_life"] = life / cycles
        if strides_per_day > 0.0:
            values["days_until_muscle_life"] = life / cycles / strides_per_day
    return {name: measured(name, value) for name, value in values.items()}


def cycles(pressure: np.ndarray, strides: int) -> float:
    """How often the muscles of a chamber are filled and vented in a stride."""
    lowest, highest = float(pressure.min()), float(pressure.max())
    if highest <= FILLED:
        return 0.0
    swing, middle = highest - lowest, 0.5 * (lowest + highest)
    if swing < SWING * highest:
        return 1.0
    high = pressure[np.abs(pressure - middle) >= BAND * swing] > middle
    risen = int(np.count_nonzero(high & ~np.roll(high, 1)))  # the last row comes before the first
    return max(1.0, risen / strides)
