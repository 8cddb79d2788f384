"""Air by the minute, the strides and hours that a source lasts, and a compressor's duty."""

from afo_sim.metrics.metric import AIR, Metric, measured, tells

ANR = "ANR: at 20 °C, 1 bar, 65 % humidity (ISO 8778)"
SOURCE = (
    "on what the scenario's source gives as it cools, or without one a full bottle of its limits, down to "
    "the supply's pressure"
)
BEFORE = "air before the first step is out of a source, not of the limits' bottle"


@tells(
    AIR,
    ("free_air_per_minute", "l/min", "Free air per minute of walking", f"litres {ANR}"),
    ("strides_per_bottle", "", "Strides of one bottle", f"walked without a stop, {SOURCE}; {BEFORE}"),
    ("hours_per_bottle", "h", "Hours of one bottle", f"without a stop, {SOURCE}; {BEFORE}"),
)
def bottle_metrics(free_air: float, stride_time: float, bottle: float | None) -> dict[str, Metric]:
    """What walking takes from a bottle of air.

    Parameters
    ----------
    free_air : of one stride [l] (ANR)
    stride_time : [s]
    bottle : free air that the bottle gives [l] (ANR); None of a source that does not run empty

    Returns
    -------
    dict of Metric by name; without strides and hours where they take no air or the source does not run empty
    """
    found = {"free_air_per_minute": measured("free_air_per_minute", free_air * 60.0 / stride_time)}
    if free_air > 0.0 and bottle is not None:
        strides = bottle / free_air
        found["strides_per_bottle"] = measured("strides_per_bottle", strides)
        found["hours_per_bottle"] = measured("hours_per_bottle", strides * stride_time / 3600.0)
    return found


@tells(AIR, ("cycles_per_bottle", "", "Cycles of one bottle", f"seated, {SOURCE}"))
def cycle_metrics(free_air: float, minutes: float, bottle: float) -> dict[str, Metric]:
    """What seated cycles take from a bottle of air.

    Parameters
    ----------
    free_air : of one cycle [l] (ANR)
    minutes : that a cycle takes [min]
    bottle : free air that the bottle gives [l] (ANR)

    Returns
    -------
    dict of Metric by name; empty where cycles take no air
    """
    if free_air <= 0.0:
        return {}
    cycles = bottle / free_air
    return {
        "cycles_per_bottle": measured("cycles_per_bottle", cycles),
        "hours_per_bottle": measured("hours_per_bottle", cycles * minutes / 60.0),
    }


@tells(
    AIR,
    (
        "source_share",
        "percent",
        "Mean flow of what the compressor gives",
        "of its delivery against the set pressure; beyond 100 it cannot keep up",
    ),
    (
        "source_share_peak",
        "percent",
        "Peak flow of what the compressor gives",
        "of its delivery against the set pressure; what is beyond 100 comes out of its tank",
    ),
    (
        "compressor_duty",
        "percent",
        "Duty of the compressor",
        "by the mean flow, filling its tank from one switching pressure to the other; bursts that pull the "
        "tank lower make it less: the run's own is the mean of supply/running",
    ),
    (
        "compressor_power",
        "W",
        "Mean electric power of the compressor",
        "while it runs, times its duty",
    ),
)
def compressor_metrics(
    mean_flow: float, peak_flow: float, delivery: float, duty: float, power: float | None
) -> dict[str, Metric]:
    """What is asked of a compressor.

    Parameters
    ----------
    mean_flow, peak_flow : from the supply [l/min] (ANR)
    delivery : against the set pressure [l/min] (ANR)
    duty : share of the time that it runs [-]
    power : electric, while it runs [W]; None where it is not known
    """
    found = {"compressor_duty": 100.0 * duty}
    if delivery > 0.0:
        found |= {
            "source_share": 100.0 * mean_flow / delivery,
            "source_share_peak": 100.0 * peak_flow / delivery,
        }
    if power is not None:
        found["compressor_power"] = duty * power
    return {name: measured(name, value) for name, value in found.items()}
