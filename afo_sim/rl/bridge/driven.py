"""What entities share whose actuators are the callbacks': their rows, their hold, the solved present."""

import weakref
from collections.abc import Iterator
from typing import Any

import mujoco

from afo_sim import native
from afo_sim.common.errors import CallbackError, InputError
from afo_sim.rl.bridge.dm import composer
from afo_sim.rl.bridge.present import Present

INTEGRATOR = "implicitfast"
IMPLICITFAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


class Driven(composer.Entity):
    """An entity of this package in a Composer environment.

    The callbacks are held from the first compilation on, until the environment's physics is freed
    (`environment.close()`), the entity is garbage, or `close`.
    """

    _hold: native.Hold | None = None
    _present: Present | None = None
    userdata = 0  # numbers of `userdata` that its callbacks need

    def _write_rows(self, model: mujoco.MjModel, userdata: int) -> None:
        """Write its actuators' exact parameters; `userdata` is the first place that is its own."""
        raise NotImplementedError

    def _write_inputs(self, physics: Any) -> None:
        """Write the inputs of its actuators."""

    def after_compile(self, physics: Any, random_state: Any) -> None:
        """Hold the callbacks; the first of this package's entities fills the rows of all, then the air."""
        model, data = physics.model.ptr, physics.data.ptr
        family = list(_family(self))
        if family[0] is self:
            _fill(family, model)
        self.close()
        self._hold = native.Hold()
        weakref.finalize(physics.data, self._hold.close)
        self._present = Present(model)
        if family[-1] is self:
            native.fill_chambers(model, data, 0.0)

    def before_substep(self, physics: Any, action: Any, random_state: Any = None) -> None:
        """Check the callbacks, and write the inputs over those of the action."""
        self._check()
        self._write_inputs(physics)

    def close(self) -> None:
        """Give the callbacks back; stepping on is refused. A second call does nothing."""
        if self._hold is not None:
            self._hold.close()

    def _check(self) -> None:
        if self._hold is None or self._hold.closed:
            raise CallbackError(
                f"the entity {self.mjcf_model.model!r} is closed, or its model was never compiled by an "
                "Environment: its muscles would be limp"
            )
        self._hold.check()

    def _solved(self, physics: Any) -> mujoco.MjData:
        self._check()
        assert self._present is not None
        return self._present.of(physics.data.ptr)


def _family(entity: composer.Entity) -> Iterator[Driven]:
    """All of this package's entities in an entity's environment."""
    while entity.parent is not None:
        entity = entity.parent
    return (each for each in entity.iter_entities() if isinstance(each, Driven))


def _fill(family: list[Driven], model: mujoco.MjModel) -> None:
    """Check the model that was compiled, and write the rows of all entities into it."""
    if model.opt.integrator != IMPLICITFAST:
        raise wrong_integrator(mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_"))
    needed = sum(each.userdata for each in family)
    if model.nuserdata < needed:
        raise InputError(
            f"the model keeps {model.nuserdata} numbers for the callbacks and its orthoses need {needed}",
            field="size.nuserdata",
            allowed="attach legs to the arena first and orthoses to the legs then; or "
            f"arena.mjcf_model.size.nuserdata = {needed}",
        )
    first = 0
    for each in family:
        each._write_rows(model, first)
        first += each.userdata


def wrong_integrator(chosen: str) -> InputError:
    """An error for a model that somebody has given another integrator."""
    return InputError(
        "the muscles' steps are stable with one integrator of MuJoCo's only",
        field="option.integrator",
        value=chosen,
        allowed=f'mjcf_model.option.integrator = "{INTEGRATOR}"',
    )
