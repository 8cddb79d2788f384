"""The names of what is shipped."""

from collections.abc import Iterable, Sequence
from typing import overload

from afo_sim.common import assets, unknown
from afo_sim.metrics import METRICS
from afo_sim.metrics.metric import load_all
from afo_sim.physics import FRICTIONS, LAWS


@overload
def list(kind: None = None) -> dict[str, Sequence[str]]: ...
@overload
def list(kind: str) -> Sequence[str]: ...
def list(kind: str | None = None) -> Sequence[str] | dict[str, Sequence[str]]:
    """The names of all shipped descriptions, as in `afo-sim list`; `load` takes them.

    Parameters
    ----------
    kind : "muscles", "laws", "scenarios", …, or the singular that `load` takes; all by default

    Returns
    -------
    the names of a kind, or {kind: names} of all

    Raises
    ------
    InputError
        There is no such kind.

    Examples
    --------
    >>> "seated" in afo_sim.list("scenarios"), "dmsp_20" in afo_sim.list()["muscles"]
    (True, True)
    """
    if kind is None:
        return {each: list(each) for each in assets.LISTS}
    plural = assets.KINDS.get(kind, kind)
    if plural not in assets.LISTS:
        raise unknown(kind, assets.LISTS, field="kind", problem="is no kind of what is shipped")
    if plural == "metrics":
        load_all()
    metrics = (name.replace("{}", "…") for name in METRICS)
    registry: dict[str, Iterable[str]] = {"laws": LAWS, "frictions": FRICTIONS, "metrics": metrics}
    if plural in registry:
        return [*registry[plural]]
    if plural == "gaits":
        return assets.gait_names()
    return assets.names(next(one for one, several in assets.KINDS.items() if several == plural))
