"""What a timer or gait phases may switch: the two valves of a chamber, or a valve between other nodes."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from afo_sim.description.air.supplied import NO_COIL
from afo_sim.description.quantity import refusal


class Switched(Protocol):
    """An orthosis, as far as its valves go."""

    @property
    def chamber(self) -> Mapping[str, Any]: ...
    @property
    def restriction(self) -> Mapping[str, Any]: ...


def check_switched(orthosis: Switched, named: Sequence[tuple[str, Mapping[str, Any]]]) -> None:
    """Refuse times of a valve that is not there."""
    for key, tables in named:
        if key == "start":
            continue
        for name, times in tables.items():
            each = orthosis.restriction.get(name)
            if each is not None and each.valve is None:
                coils = [other for other, one in orthosis.restriction.items() if one.valve is not None]
                allowed = ", ".join([*orthosis.chamber, *coils])
                problem = f"has no coil: the kind of this restriction is {each.kind!r}"
                raise refusal(problem, allowed, f"{key}.{name}")
            sides = [side for side in ("inlet", "outlet") if getattr(times, side)]
            if name in orthosis.restriction and sides:
                problem = "is of a chamber; a valve between other nodes has one way"
                raise refusal(problem, "open", f"{key}.{name}.{sides[0]}")
            if name not in orthosis.chamber:
                continue
            if times.open:
                raise refusal("is of a valve between other nodes", "inlet, outlet", f"{key}.{name}.open")
            if times.outlet and orthosis.chamber[name].three_way:
                raise refusal(NO_COIL, "inlet alone, or an outlet valve", f"{key}.{name}.outlet")
