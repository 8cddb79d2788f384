"""A switch with two thresholds."""


def switched(on: bool, value: float, low: float, high: float) -> bool:
    """Whether it is on: from `high` on, off below `low`, as it was between them."""
    return value >= high or (on and value >= low)
