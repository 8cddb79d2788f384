"""A chamber's command as it is described: a word, two coils, or a pressure for its drive."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Annotated, Any

from pydantic import ValidationInfo
from pydantic_core import CoreSchema, core_schema

from afo_sim.common.units import format_quantity, parse_quantity
from afo_sim.description.quantity import refusal

WORDS = ("inlet", "outlet", "both", "shut")  # whose valve's coil has current
HIGHEST = 2e6  # pressure that may be asked for, gauge [Pa]
ALLOWED = f'{", ".join(WORDS)}, two coils such as [1.0, 0.0], or a pressure such as "3 bar" for a drive'


@dataclass(frozen=True)
class _Command:
    """Marks a field that holds a word, two coils (inlet, outlet) from 0 to 1, or a gauge pressure [Pa]."""

    def read(self, value: object, info: ValidationInfo) -> str | tuple[float, float] | float:
        """Text, or a list of two coils; SI itself from `with_values`."""
        if isinstance(value, str) and value in WORDS:
            return value
        if isinstance(value, Sequence) and not isinstance(value, str):
            return _coils(value)
        plain = (
            f"{float(value)!r} Pa" if isinstance(value, Real) and (info.context or {}).get("si") else value
        )
        try:
            pressure = parse_quantity(plain, "Pa")
        except ValueError:
            raise refusal("is no command", ALLOWED) from None
        if not 0.0 <= pressure <= HIGHEST:
            raise refusal("is out of range", f"a gauge pressure from 0 to {1e-5 * HIGHEST:g} bar")
        return pressure

    def write(self, value: Any) -> Any:
        """As a file says it."""
        if isinstance(value, float):
            return format_quantity(value, "Pa")
        return value if isinstance(value, str) else list(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        writer = core_schema.plain_serializer_function_ser_schema(self.write)
        return core_schema.with_info_plain_validator_function(self.read, serialization=writer)


def _coils(value: Sequence[object]) -> tuple[float, float]:
    numbers = [float(x) for x in value if isinstance(x, Real) and not isinstance(x, bool)]
    if not len(value) == len(numbers) == 2 or not all(0.0 <= x <= 1.0 for x in numbers):
        raise refusal("is no command", ALLOWED)
    return numbers[0], numbers[1]


ChamberCommand = Annotated[str | tuple[float, float] | float, _Command()]
