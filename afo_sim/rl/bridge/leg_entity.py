"""A leg of this package as a Composer entity: shank, foot, ankle and its relaxed tissue."""

import os
from typing import Any

import mujoco

from afo_sim import native
from afo_sim.description.attachment import Side
from afo_sim.description.leg import Leg
from afo_sim.description.reader import load
from afo_sim.model.assemble import PASSIVE
from afo_sim.model.leg import leg_spec
from afo_sim.model.mounting import ANKLE
from afo_sim.model.person import Size
from afo_sim.model.tissue import own_tissue
from afo_sim.rl.bridge.driven import INTEGRATOR, Driven
from afo_sim.rl.bridge.pymjcf import Copied, new_model

STILL = {"duration": "1 s", "timestep": "1 ms", "supply": {"pressure": "1 bar"}}  # what a leg does not need


class LegEntity(Driven):
    """A leg whose shank is fixed to what it is attached to, toes stiff, as a seated scenario has it.

    Units: knee_angle [rad].
    """

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
