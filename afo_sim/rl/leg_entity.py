"""A leg of this package as a Composer entity: shank, foot, ankle and its relaxed tissue."""

import os
import weakref
from collections.abc import Iterator
from typing import Any

import mujoco

from afo_sim import native
from afo_sim.common import CallbackError, InputError
from afo_sim.description import Leg, Side, load
from afo_sim.model import ANKLE, PASSIVE, Size, leg_spec, own_tissue
from afo_sim.rl.dm import Present, composer
from afo_sim.rl.pymjcf import Copied, new_model

INTEGRATOR = "implicitfast"
IMPLICITFAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


class Driven(composer.Entity):
    """An entity of this package in a Composer environment."""

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


STILL = {"duration": "1 s", "timestep": "1 ms", "supply": {"pressure": "1 bar"}}  # what a leg does not need


class LegEntity(Driven):
    """A leg whose shank is fixed to what it is attached to, toes stiff, as a seated scenario has it."""

    def _build(
        self,
        leg: str | os.PathLike[str] | Leg = "adult_75kg",
        *,
        knee_angle: float = 0.0,
        tissue: bool = True,
        side: Side | None = None,
        name: str = "leg",
    ) -> None:
        shank = {"pose": "fixed", "knee_angle": f"{knee_angle!r} rad"}
        given = {**STILL, "leg": leg, "orthosis": "none", "shank": shank}
        self.scenario = load("scenario", given if side is None else {**given, "side": side})
        self.knee_angle = knee_angle
        spec = leg_spec(self.scenario, Size.of(self.scenario))
        if not tissue:
            spec.joint(ANKLE).damping = [self.scenario.leg.damping, 0.0, 0.0]
        model = spec.compile()
        self._root = new_model(name)
        self._root.compiler.angle = "radian"
        self._root.option.integrator = INTEGRATOR
        copied = Copied(model)
        for body in range(1, model.nbody):
            if model.body_parentid[body] == 0:
                copied.body(self._root.worldbody, body)
        self._ankle = copied.joints[model.joint(ANKLE).id]
        self._tissue = self._add_tissue() if tissue else None

    def _add_tissue(self) -> Any:
        """The actuator of the tissue's moment, in a model of its own that can be put behind others."""
        self._tissue_model = new_model("tissue")
        made = self._tissue_model.actuator.add(
            "general",
            name=PASSIVE,
            joint=self._ankle,
            gaintype="fixed",
            gainprm=[0.0] * 10,
            biastype="user",
            user=[0.0] * native.N_USER,
        )
        self._root.attach(self._tissue_model)
        return made

    @property
    def mjcf_model(self) -> Any:
        """Its PyMJCF model; bodies and joint are named as in the leg's file, the joint "ankle"."""
        return self._root

    @property
    def side(self) -> Side:
        """Leg that is simulated."""
        return self.scenario.simulated_side

    @property
    def ankle(self) -> Any:
        """PyMJCF's joint, dorsiflexion positive [rad]."""
        return self._ankle

    @property
    def shank(self) -> Any:
        """PyMJCF's body."""
        return self._root.find("body", self.scenario.leg.shank)

    @property
    def foot(self) -> Any:
        """PyMJCF's body."""
        return self._root.find("body", self.scenario.leg.foot)

    def attach(self, entity: Any, attach_site: Any = None) -> Any:
        """Attach an entity; the tissue's moment stays the last to be added up, as in a run."""
        frame = super().attach(entity, attach_site)
        if self._tissue is not None:
            self._tissue_model.detach()
            self._root.attach(self._tissue_model)
        return frame

    def _write_rows(self, model: mujoco.MjModel, userdata: int) -> None:
        if self._tissue is None:
            return
        tissue = own_tissue(self.scenario)
        model.actuator_user[model.actuator(self._tissue.full_identifier).id] = native.passive_row(
            scale=tissue.scale, offset=tissue.offset, load=0.0, damping=0.5 * tissue.damping
        )

    def _write_inputs(self, physics: Any) -> None:
        if self._tissue is not None:
            physics.bind(self._tissue).ctrl = self.knee_angle

    def initialize_episode(self, physics: Any, random_state: Any) -> None:
        """Write the knee's angle, on which the rest position depends."""
        self._check()
        self._write_inputs(physics)
