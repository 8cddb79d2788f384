"""The stand's tests by their names, each with what its plan takes and with `progress` as of `run`."""

import functools
from collections.abc import Callable
from typing import Any

from afo_sim.description import Muscle, load
from afo_sim.lab import Trial
from afo_sim.lab.stand_plan import StandPlan
from afo_sim.lab.stand_trial import PLANS, run


def _test(plan: Callable[..., StandPlan]) -> Callable[..., Trial]:
    """The test of a plan: of a muscle's description or name."""

    @functools.wraps(plan)
    def test(muscle: Muscle | str, *given: Any, progress: Any = None, **others: Any) -> Trial:
        known = muscle if isinstance(muscle, Muscle) else load("muscle", muscle)
        return run(plan(known, *given, **others), progress)

    test.__name__ = plan.__name__.removeprefix("plan_")
    return test


isobaric, isotonic, isometric, auxotonic, sealed, step, release = map(_test, PLANS.values())
