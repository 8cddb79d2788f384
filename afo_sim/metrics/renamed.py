"""Names that metrics had before, and what took their place."""

from collections.abc import Iterable

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.metrics.metric import Metric

EVENT = "the minimum is looked for while the foot is fast"
# Old name: the new one, and why.
RENAMED = {
    "swings_without_toe_dip": ("swings_without_toe_event", EVENT),
    "swings_without_ball_dip": ("swings_without_ball_event", EVENT),
    "share_of_dorsiflexion_moment": (
        "orthosis_swing_torque_mean",
        "its peak stood at push-off; needed_swing_torque_mean is what to hold it against",
    ),
    "share_of_plantarflexion_moment": (
        "orthosis_peak_plantarflexion_torque",
        "a share of one peak in another that stands elsewhere in the stride says nothing",
    ),
}


def instead(name: str, names: Iterable[str]) -> str | None:
    """The metric meant by a name that is none of `names`: its new name, or the most similar one."""
    return RENAMED[name][0] if name in RENAMED else nearest_name(name, names)


def told(problem: str, name: str) -> str:
    """A problem with an unknown metric; of one that has another name now, why."""
    return f"{problem} any more ({RENAMED[name][1]})" if name in RENAMED else problem


class Metrics(dict[str, Metric]):
    """Metrics by name; one that is not there is refused, an old one with its new name."""

    def __missing__(self, name: str) -> Metric:
        problem = told("the run has no such metric", name)
        raise InputError(problem, field="metric", value=name, nearest=instead(name, self))
