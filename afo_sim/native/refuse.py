"""A gate before the kernels: an actuator that asks for a callback and is not this project's is refused.

While this project's callbacks are installed nobody else's are, so such an actuator would carry no force and
say nothing: most often it is a muscle of an older version's MJCF, which keeps no parameters.

One step stays allowed. MuJoCo tries every model that it compiles, before anybody can write parameters into
it, or air into its chambers; the model has no signature then, and its time is zero.
"""

from collections.abc import Callable
from typing import Any

from afo_sim.native.error_codes import NO_MARK
from afo_sim.native.slots import N_USER, kind_of
from afo_sim.physics import register_jitable

Kernel = Callable[[Any, Any, int], float]


@register_jitable
def tried(m: Any, d: Any) -> bool:
    """Whether MuJoCo compiles the model (or it is the first step of one that was read from a binary)."""
    return bool(m.signature == 0 and d.time == 0.0)


def marked_only(kernel: Kernel, fail: Callable[[int, int], None]) -> Kernel:
    """A callback that refuses an actuator without this project's mark, and is the kernel for all others."""
    known = register_jitable(kernel)

    def callback(m: Any, d: Any, i: int) -> float:
        if m.nuser_actuator < N_USER or not kind_of(m.actuator_user, m.nuser_actuator * i):
            if not tried(m, d):
                fail(NO_MARK, i)
            return 0.0
        return known(m, d, i)

    return callback
