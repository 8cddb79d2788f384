"""Description of a friction model, which acts beside any static force law.

    F = F_static − F_friction

F_friction is positive while the muscle contracts (κ rises), so that it pulls with less force while
contracting than while extending. Some models follow from the motion alone. Others have a dead band Q of
pressure, and yield at the force W = F_static(p) − F_static(p − Q): a muscle that slides pulls as at p − Q.
Q is never more than p. The models with a memory say how far κ must travel to turn the friction over,
those without only how fast it must travel.

None gives energy that it was not given: without a memory it is against the motion, with one its springs
do not know the pressure, which only says when they slip.

Each kernel also gives the derivative by what moves, for whoever integrates friction implicitly: a friction
that turns over within a few micrometres is far too stiff to be integrated explicitly. For the same reason a
model with a memory gives its force at the *end* of the step: taken at its start, the elastic part of
friction would feed energy into the joint at every step.

Symbols in this folder: κ contraction ratio [-], κ̇ contraction rate [1/s], p gauge pressure [Pa], h time
step [s], L0, r0 nominal length and radius [m], α0 braid angle at rest [rad], b = 1/sin²α0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from afo_sim.common import takes
from afo_sim.physics.law import Braid, Entry, LawParameter, Values

MAX_FRICTION_COEFFICIENTS = 7  # slots of a friction's coefficients in an actuator's row
# what a kernel of a unit takes first; what moves is κ̇ [1/s], of a model with a memory Δκ of the step [-]
MOTION = {"N": ("contraction", "rate", "pressure"), "Pa": ("yields", "moved")}


DEAD_BAND = LawParameter(
    "dead_band", "Q", "Pa", 0.0, 2e5, "half the hysteresis loop's width in pressure", (1e4, 3e4)
)


def no_fall(braid: Braid, parameters: Values, pressure: float) -> float:
    """The steepest fall of a friction that never falls with speed [N·s/m]."""
    return 0.0


@dataclass(frozen=True)
class Friction(Entry):
    """A friction model and its kernels.

    unit : "N", from the motion alone; "Pa", with a dead band of pressure, its first coefficient
    native_id : from 1, by which compiled code knows it; 0 is no friction
    n_state : states of its memory; 0 for none
    kernel : (κ, κ̇, p, *coefficients) → (friction [N], its derivative by κ̇ [N·s]); with a dead band
        (W, κ̇, *coefficients), with a memory (W, Δκ, *states, *coefficients) and the derivative by Δκ [N]
    rate_kernel : (W, Δκ, *states, *coefficients, h) → rates of the states [N/s], a number where there is one
    sticks : its elements stick and keep what they had, so that a cycle's past is never forgotten
    steepest_fall : (braid, parameters, p) → most by which the force falls with the shortening velocity
        [N·s/m]: damping of the wrong sign, which a time step must be short enough for
    """

    unit: Literal["N", "Pa"] = "N"
    n_state: int = 0
    rate_kernel: Callable[..., Any] | None = None
    sticks: bool = False
    steepest_fall: Callable[[Braid, Values, float], float] = no_fall

    @property
    def n_arguments(self) -> int:
        """Number of the kernel's arguments beside the coefficients."""
        return len(MOTION[self.unit]) + self.n_state


takes(Friction, "afo_sim.physics.friction")


def check(friction: Friction) -> None:
    """Refuse the native id of no friction, and states without their rates or the reverse (ValueError)."""
    if friction.native_id < 1:
        raise ValueError(f"{friction.name!r} has the native id {friction.native_id}; 0 is no friction")
    if bool(friction.n_state) != (friction.rate_kernel is not None):
        raise ValueError(
            f"{friction.name!r} has {friction.n_state} states and "
            f"{'no' if friction.rate_kernel is None else 'a'} rate_kernel"
        )
    if friction.n_state and friction.unit != "Pa":
        raise ValueError(f"{friction.name!r} has states, and no dead band of pressure at which they yield")
