"""Air by the minute, and the strides that a bottle of compressed air lasts."""

from afo_sim.metrics.metric import AIR, Metric, measured, tells

ANR = "ANR: at 20 °C, 1 bar, 65 % humidity (ISO 8778)"
BOTTLE = (
    "walked without a stop, on what a full bottle of the scenario's limits gives down to the supply's "
    "pressure; air before the first step is not in it"
)


@tells(
    AIR,
    ("free_air_per_minute", "l/min", "Free air per minute of walking", f"litres {ANR}"),
    ("strides_per_bottle", "", "Strides of one bottle", BOTTLE),
)
def bottle_metrics(free_air: float, stride_time: float, bottle: float) -> dict[str, Metric]:
    """What walking takes from a bottle of air.

    Parameters
    ----------
    free_air : of one stride [l] (ANR)
    stride_time : [s]
    bottle : free air that the bottle gives [l] (ANR)

    Returns
    -------
    dict of Metric by name; without the strides where they take no air
    """
    found = {"free_air_per_minute": measured("free_air_per_minute", free_air * 60.0 / stride_time)}
    if free_air > 0.0:
        found["strides_per_bottle"] = measured("strides_per_bottle", bottle / free_air)
    return found
