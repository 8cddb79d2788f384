"""The last sample of a simulation, or of several side by side, as the formulas of a task see it."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Reader = Callable[["Sample"], Any]


class Sample:
    """Columns of the last step, each computed once; `sample["ankle/angle"]` is a number, or (n,).

    Units: step (n,).
    """

    __slots__ = ("found", "readers", "rows", "script", "step")

    def __init__(
        self,
        readers: Mapping[str, Reader],
        rows: Mapping[str, np.ndarray],
        step: Any,
        script: np.ndarray,
    ):
        self.readers, self.rows, self.step, self.script = readers, rows, step, script
        self.found: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self.found:
            self.found[name] = self.readers[name](self)
        return self.found[name]
