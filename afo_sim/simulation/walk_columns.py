"""Columns of walking beside the ankle: phase, pose, sole, and all moments about the ankle.

The rows of WALKING replace those of a fixed shank that have the same name.
"""

import dataclasses
import functools
from collections.abc import Callable
from operator import attrgetter

import numpy as np

from afo_sim.common import GRAVITY
from afo_sim.model import (
    ACTIVE,
    GROUND,
    JOINTS,
    PADS,
    SINK,
    SPASTIC,
    STIFFNESS,
    Active,
    Built,
    Foot,
    Turn,
    Walk,
    own_tissue,
    padded,
    passive_along,
)
from afo_sim.simulation.frame import Column, Frame
from afo_sim.simulation.free_swing import free_swing

WORN = "of this outsole above the floor, were the ankle as recorded"
LOWEST = {"heel": slice(0, 1), "ball": slice(1, 2), "toe": slice(2, None), "sole": slice(None)}  # of POINTS
HEIGHTS = {
    "heel": "of the outsole above the floor",
    "ball": "of the outsole above the floor",
    "toe": "of the lower of pulp and tip above the floor",
    "sole": "of the outsole's lowest point above the floor",
}
NARROWEST = 1e-3  # distance of heel and ball along the floor that loads are shared over [m]


class WalkFrame(Frame):
    """A stretch of walking, with the quantities that several columns share; n rows."""

    def steps(self, values: np.ndarray) -> np.ndarray:
        """The part for these rows of `values` at every step of the run (n_step, …)."""
        return values[self.first_step : self.first_step + self.n]

    def instants(self, values: np.ndarray) -> np.ndarray:
        """The part for these rows of `values` at n_step + 2 instants, the first a step before the run."""
        return values[self.first_step + 1 : self.first_step + 1 + self.n]

    @property
    def walk(self) -> Walk:
        """The recorded walking that drives the shank."""
        assert self.built.walk is not None
        return self.built.walk

    @property
    def active(self) -> Active:
        """The patient's own ankle muscles."""
        assert self.built.active is not None
        return self.built.active

    @property
    def foot(self) -> Foot:
        """The compiled foot, with all that it carries."""
        assert self.built.foot is not None
        return self.built.foot

    def joint(self, name: str) -> np.ndarray:
        """Coordinate of a joint [m] or [rad] (n,)."""
        return self.rows["qpos"][:, self.built.index.joints[name][0]]

    def moment(self, name: str) -> np.ndarray:
        """Force of one of the actuators that walking adds [N·m], of a pad [N] (n,)."""
        return self.force(self.built.index.walking[name])

    @property
    def way(self) -> np.ndarray:
        """Strides walked [-] (n,)."""
        return self.instants(self.walk.phase)

    @functools.cached_property
    def shank(self) -> np.ndarray:
        """Angle of the shank, knee ahead of the ankle positive [rad] (n,)."""
        return self.joint(JOINTS[2])

    @functools.cached_property
    def pitch(self) -> np.ndarray:
        """Pitch of the sole, toe up positive [rad] (n,): ankle less shank."""
        return self.rows["qpos"][:, self.built.index.ankle_qpos] - self.shank

    @functools.cached_property
    def ankle_height(self) -> np.ndarray:
        """Height of the ankle above the floor [m] (n,)."""
        z = self.joint(JOINTS[1])
        return z if self.built.contact is None else z + self.joint(SINK)

    @functools.cached_property
    def extension(self) -> np.ndarray:
        """Extension of the toes against the foot [rad] (n,); 0 of a rigid foot."""
        toes = self.built.scenario.leg.toes
        return np.zeros(self.n) if toes is None else self.joint(toes.joint)

    @functools.cached_property
    def resting(self) -> np.ndarray:
        """Rest extension of the toes [rad] (n,); 0 of a rigid foot."""
        return np.zeros(self.n) if self.walk.toe is None else self.instants(self.walk.toe)

    @functools.cached_property
    def turn(self) -> Turn:
        """Of the foot (n,)."""
        return Turn.by(self.pitch)

    @functools.cached_property
    def toes_turn(self) -> Turn:
        """Of the toes (n,)."""
        return self.turn.further(self.extension)

    @functools.cached_property
    def forward(self) -> np.ndarray:
        """The outsole's points ahead of the ankle [m] (n_point, n)."""
        return self.foot.places(0, self.turn, self.toes_turn)

    @functools.cached_property
    def upward(self) -> np.ndarray:
        """The same above the ankle [m] (n_point, n)."""
        return self.foot.places(1, self.turn, self.toes_turn)

    @functools.cached_property
    def recorded_upward(self) -> np.ndarray:
        """The same at the recorded ankle angle, the toes at rest."""
        turn = Turn.by(self.instants(self.walk.ankle) - self.shank)
        return self.foot.places(1, turn, turn.further(self.resting))

    @functools.cached_property
    def free(self) -> "WalkFrame":
        """The same, with the swings as they are without a floor."""
        if self.built.contact is None:
            return self
        qpos = free_swing(self.built, self.rows, self.control, self.first_step)
        own = qpos is self.rows["qpos"]
        return self if own else dataclasses.replace(self, rows=self.rows | {"qpos": qpos})

    @functools.cached_property
    def pads(self) -> np.ndarray:
        """Forces of the pads [N] (n_point, n)."""
        index = self.built.index.walking
        return self.rows["actuator_force"].T[[index[name] for name in PADS if name in index]]

    @functools.cached_property
    def ahead(self) -> np.ndarray:
        """Distance of the sole's points with pads ahead of the ankle [m] (n_point, n)."""
        return self.forward[: len(padded(self.foot.toes))]

    @functools.cached_property
    def recorded_ground(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Recorded force over body weight, forward and upward [-]; its place ahead of the ankle [m] (n,)."""
        forward, upward, place = map(self.instants, self.walk.ground)
        return forward, upward, place

    @functools.cached_property
    def weight(self) -> float:
        """Body weight [N]."""
        return self.built.body_mass * GRAVITY

    @functools.cached_property
    def biological(self) -> np.ndarray:
        """Moment of the patient's own muscles, dorsiflexion positive [N·m] (n,)."""
        return self.moment(ACTIVE) + self.moment(STIFFNESS) + self.moment(SPASTIC)

    @functools.cached_property
    def ground_moment(self) -> np.ndarray:
        """Moment of the ground about the ankle, dorsiflexion positive [N·m] (n,)."""
        moment = self.moment(GROUND)
        if self.built.contact is None:
            return moment
        return moment + np.sum(self.pads * self.ahead, axis=0)

    @functools.cached_property
    def pressing(self) -> np.ndarray:
        """Upward force of the ground [N]."""
        if self.built.contact is None:
            return self.weight * self.recorded_ground[1]
        return self.pads.sum(axis=0)

    @functools.cached_property
    def toe_load(self) -> np.ndarray:
        """Vertical load under the ball and the toes [N] (n,)."""
        if self.built.contact is not None:
            return self.pads[1:].sum(axis=0)
        heel, ball = self.forward[:2]
        share = (self.recorded_ground[2] - heel) / np.maximum(ball - heel, NARROWEST)
        return self.pressing * np.clip(share, 0.0, 1.0)

    @functools.cached_property
    def driven(self) -> np.ndarray:
        """Accelerations of the driven shank (n, 3)."""
        model = self.built.model
        driven = np.stack([self.rows["qacc"][:, model.joint(name).dofadr[0]] for name in JOINTS], axis=1)
        if self.built.contact is not None:
            driven[:, 1] += self.rows["qacc"][:, model.joint(SINK).dofadr[0]]
        return driven


@functools.lru_cache(maxsize=4)  # cases of a sweep share it
def _resting(walk: Walk, swing: float) -> np.ndarray:
    """Rest extension of a walk's toes, were it another one in swing [rad] (n_step + 2,)."""
    assert walk.resting is not None
    return dataclasses.replace(walk.resting, swing=swing).at(walk.wave)


def _pressure_centre(f: WalkFrame) -> np.ndarray:
    place = f.recorded_ground[2]
    contact = f.built.contact
    if contact is not None:
        centre = np.sum(f.pads * f.ahead, axis=0) / np.maximum(f.pressing, contact.loaded)
        place = np.where(f.pressing > contact.loaded, centre + f.steps(contact.shift), place)
    return f.joint(JOINTS[0]) + place


def _toes_moment(f: WalkFrame) -> np.ndarray:
    """What bent toes do about the ankle beyond straight ones: weight and inertia."""
    toes, described = f.foot.toes, f.built.scenario.leg.toes
    assert toes is not None and described is not None
    joint = f.built.model.joint(described.joint).dofadr[0]
    speed = f.dof("qvel") - f.rows["qvel"][:, f.built.model.joint(JOINTS[2]).dofadr[0]]
    angular = f.dof("qacc") - f.driven[:, 2]
    straight = toes.moment(f.driven[:, :2], [(f.turn, speed, angular)] * 2)
    bent = (f.toes_turn, speed + f.rows["qvel"][:, joint], angular + f.rows["qacc"][:, joint])
    return straight - toes.moment(f.driven[:, :2], [(f.turn, speed, angular), bent])


def _column(
    name: str, unit: str, sign: str, formula: Callable[[WalkFrame], np.ndarray], *, whole: bool = False,
    contact: bool = False, toes: bool = False, needed: bool = False,
) -> Column:  # fmt: skip
    """A column of walking, or only of walking in contact, of a foot whose toes bend, of a known need."""
    return Column(name, unit, sign, formula, whole=whole, where=_walks(contact, toes, needed))


@functools.cache
def _walks(contact: bool, toes: bool, needed: bool) -> Callable[[Built], bool]:
    return lambda built: (
        built.walk is not None
        and (built.contact is not None or not contact)
        and (built.walk.toe is not None or not toes)
        and (not needed or (built.active is not None and built.active.needed is not None))
    )


def _needed(f: WalkFrame) -> np.ndarray:
    assert f.active.needed is not None
    return f.steps(f.active.needed)


def _height(what: str, f: WalkFrame, upward: np.ndarray | None = None) -> np.ndarray:
    """Height of the lowest of some of the outsole's points above the floor [m] (n,)."""
    among = (f.upward if upward is None else upward)[LOWEST[what]]
    return f.ankle_height + (among[0] if len(among) == 1 else among.min(axis=0))


def _height_extended(f: WalkFrame, which: int) -> np.ndarray:
    """Height of the sole at the simulated pitch, were the toes to rest at another extension in swing."""
    toes = f.built.scenario.leg.toes
    assert toes is not None
    other = f.instants(_resting(f.walk, toes.swing_extension_range[which]))
    return _height("sole", f, f.foot.places(1, f.turn, f.turn.further(f.extension + other - f.resting)))


MOMENT = "internal, dorsiflexion positive"
WALKING = (
    _column("gait/phase", "", "0 = heel strike, up to 1", lambda f: f.way - np.floor(f.way)),
    _column("gait/stride", "", "number of the stride, from 0", lambda f: np.floor(f.way)),
    _column("gait/ankle_angle", "rad", "as recorded, dorsiflexion positive",
        lambda f: f.instants(f.walk.ankle)),
    _column("gait/ankle_moment", "N*m", f"{MOMENT}; what the recorded walking takes in all",
        lambda f: f.steps(f.active.recorded)),
    _column("gait/needed_moment", "N*m",
        f"{MOMENT}; active moment of the recorded walking less what the patient gives", _needed, needed=True),
    _column("gait/passive_moment", "N*m", f"{MOMENT}; this ankle's tissue at the recorded angles",
        lambda f: f.steps(passive_along(f.walk, own_tissue(f.built.scenario)))),
    _column("gait/ball_height", "m", WORN, lambda f: _height("ball", f, f.recorded_upward)),
    _column("gait/toe_height", "m", WORN, lambda f: _height("toe", f, f.recorded_upward)),
    _column("gait/sole_height", "m", WORN, lambda f: _height("sole", f, f.recorded_upward)),
    _column("gait/toe_extension", "rad", "at which the toes rest", attrgetter("resting"), toes=True),
    _column("ankle/moment/orthosis", "N*m", f"{MOMENT}; all muscles of the orthosis, instantaneous",
        lambda f: f.dof("qfrc_actuator") - f.force(f.built.index.passive) - f.biological - f.ground_moment),
    _column("ankle/moment/biological", "N*m", f"{MOMENT}; the patient's own muscles",
        attrgetter("biological")),
    _column("ankle/moment/ground", "N*m", "dorsiflexion positive; ground force about the ankle",
        attrgetter("ground_moment")),
    _column("sole/pitch", "rad", "of the outsole to the floor, toe up positive",
        lambda f: f.pitch - f.foot.level),
    _column("shank/angle", "rad", "from the vertical, knee ahead of ankle positive", attrgetter("shank")),
    _column("shank/velocity", "rad/s", "as shank/angle; mean of the step before, as every velocity",
        lambda f: f.rows["qvel"][:, f.built.model.joint(JOINTS[2]).dofadr[0]]),
    _column("ankle/position/x", "m", "forward", lambda f: f.joint(JOINTS[0])),
    _column("ankle/position/z", "m", "up, the floor at 0", attrgetter("ankle_height")),
    _column("ground/force/x", "N", "on the foot, forward positive",
        lambda f: f.weight * f.recorded_ground[0]),
    _column("ground/force/z", "N", "on the foot, upward positive", attrgetter("pressing")),
    _column("foot/heel_load", "N", "under the heel, upward on the foot",
        lambda f: f.pressing - f.toe_load if f.built.contact is None else f.pads[0]),
    _column("foot/toe_load", "N", "under ball and toes, upward on the foot", attrgetter("toe_load")),
    _column("ground/position/x", "m", "centre of pressure, forward", _pressure_centre),
    *(_column(f"{point}/height", "m", sign, functools.partial(_height, point))
        for point, sign in HEIGHTS.items()),
    *(_column(f"{point}/height_without_floor", "m", f"{sign}, with the swing as it is without a floor",
        functools.partial(lambda of, f: _height(of, f.free), point))
        for point, sign in HEIGHTS.items() if point != "heel"),
    _column("sole/height_less_extended", "m",
        "the same, were the toes extended in swing by the least of swing_extension_range",
        lambda f: _height_extended(f.free, 0), toes=True),
    _column("sole/height_more_extended", "m",
        "the same, were the toes extended in swing by the greatest of swing_extension_range",
        lambda f: _height_extended(f.free, 1), toes=True),
    _column("toe/extension", "rad", "of the toes against the foot", attrgetter("extension"), toes=True),
    _column("gait/ground_force_z", "N",
        "upward positive, as recorded; in contact ground/force/z is this foot's own",
        lambda f: f.weight * f.recorded_ground[1], contact=True),
    _column("shank/sink", "m", "of the leg from where it was recorded, upward positive",
        lambda f: f.joint(SINK), contact=True),
    _column("ankle/moment/gravity", "N*m", "dorsiflexion positive; weight of what turns",
        lambda f: f.foot.gravity_moment(f.pitch), whole=True),
    _column("ankle/moment/toes", "N*m",
        "dorsiflexion positive; weight and inertia of bent toes beyond those of straight ones", _toes_moment,
        whole=True, toes=True),
    _column("ankle/moment/frame", "N*m", "dorsiflexion positive; inertia of the foot on the driven shank",
        lambda f: f.foot.frame_moment(f.pitch, f.driven[:, :2], f.driven[:, 2]), whole=True),
)  # fmt: skip
