"""A threshold on a column as it is described: a text in the column's unit."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Annotated, Any

from pydantic_core import CoreSchema, core_schema

from afo_sim.common.units import read_any_quantity
from afo_sim.description.quantity import refusal


@dataclass(frozen=True)
class _Threshold:
    """Marks a text such as "20 N", or a bare number of a column without unit; the column decides which."""

    def read(self, value: object) -> str:
        """The text, if it is a quantity."""
        if isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value):
            return repr(float(value))
        if not isinstance(value, str):
            raise refusal("is no threshold", 'a text in the column\'s unit, such as "20 N"')
        try:
            found = in_si(value)
        except ValueError as error:
            raise refusal(str(error), "a quantity in the column's unit") from None
        if not math.isfinite(found):
            raise refusal("is not finite", "a quantity in the column's unit")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)


def in_si(text: str) -> float:
    """A threshold in SI; ValueError where it is no quantity."""
    try:
        return float(text)
    except ValueError:
        return read_any_quantity(text)[0]


Threshold = Annotated[str, _Threshold()]
