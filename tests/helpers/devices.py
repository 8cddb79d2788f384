"""Devices whose static torques a fit is given: what stands in place of an orthosis' own values."""


def device(
    series_stiffness: float | None = None, offset: float | None = None, **others: float
) -> dict[str, float]:
    """Values by what a fit calls them [SI]."""
    known = {"series_stiffness": series_stiffness, "offset": offset}
    return {name: value for name, value in known.items() if value is not None} | others
