"""The stand's tests by their names, each with what its plan takes and with `progress` as of `run`."""

from collections.abc import Callable
from typing import Any

from afo_sim.description import Muscle, load
from afo_sim.lab import Trial
from afo_sim.lab.stand_plan import KINDS, Kind, plan
from afo_sim.lab.stand_trial import run


def _test(kind: Kind) -> Callable[..., Trial]:
    """The test of a kind: of a muscle's description or name."""

    def test(muscle: Muscle | str, *given: Any, progress: Any = None, **others: Any) -> Trial:
        known = muscle if isinstance(muscle, Muscle) else load("muscle", muscle)
        return run(plan(kind, known, *given, **others), progress)

    test.__name__ = kind
    return test


isobaric, isotonic, isometric, auxotonic, sealed, step, release = map(_test, KINDS)
