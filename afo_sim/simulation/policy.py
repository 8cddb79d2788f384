"""Inputs of a simulation: known beforehand, or chosen as it goes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

Rows = dict[str, np.ndarray]


class Moment(Protocol):
    """The view from which a policy chooses the inputs of the next steps."""

    @property
    def steps(self) -> range:
        """The steps whose inputs are wanted."""
        ...

    @property
    def now(self) -> Rows:
        """The state that the first of these steps starts from: {"time", "qpos", "qvel", "act": (width,)}."""
        ...

    @property
    def last(self) -> Rows:
        """Aligned rows of the steps since the last choice (n, width); none at first."""
        ...


@dataclass(frozen=True)
class Policy:
    """Inputs that are chosen block by block.

    choose : inputs (n, n_input) of the n steps of a Moment
    period : steps from one choice to the next; None lets the roll-out decide, for inputs that follow from the
        steps alone
    told : of the steps first…stop, what the policy tells beside its inputs, as columns (n,); nothing by
        default

    `choose` raises `PolicyFault` where a simulation has to end.
    """

    choose: Callable[[Moment], np.ndarray]
    period: int | None = None
    told: Callable[[int, int], Rows] | None = None


class PolicyFault(Exception):
    """A policy cannot choose: the simulation ends here, with this sentence; what came before is kept."""


def fixed(inputs: np.ndarray) -> Policy:
    """The policy of inputs (n_step, n_input) that are known beforehand."""
    return Policy(lambda moment: inputs[moment.steps.start : moment.steps.stop])
