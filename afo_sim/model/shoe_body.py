"""The shoe as a body on the foot, and the shapes by which it and an outsole's toe are drawn.

Shapes weigh nothing and touch nothing. They are dropped from the model that runs.
"""

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from afo_sim.description.leg import Outsole
from afo_sim.description.scenario import Scenario
from afo_sim.model.outsole import places_of, worn

SHOE = "shoe"  # name of the body
SLENDER = 0.2  # inertia about the shoe's long axis over that in the sagittal plane (assumed) [-]
WIDTH = 0.092  # of a sole [m]
THIN = 0.004  # the least thickness that is drawn [m]
OVERLAP = 0.15  # by which the toe's sole reaches back behind the ball, over its length [-]
HEEL = 0.3  # length of the heel over the distance from heel to ball [-]
RUBBER, LEATHER = (0.13, 0.13, 0.15, 1.0), (0.24, 0.30, 0.42, 1.0)
Point = tuple[float, float]
Places = Mapping[str, tuple[mujoco.MjsBody, np.ndarray]]


def add_shoe(spec: mujoco.MjSpec, scenario: Scenario, taller: float) -> None:
    """Put the worn shoe on the foot; of an orthosis with an outsole of its own only the toe is drawn."""
    outsole, shoe = worn(scenario), worn(scenario) is scenario.shoe
    if outsole is None:
        return
    if shoe:
        _add_body(spec, scenario, taller)
    if places := places_of(spec, scenario, taller):
        if shoe:
            _draw_foot_part(spec, outsole, places, taller)
        _draw_toe_part(spec, scenario, outsole, places, taller)


def _add_body(spec: mujoco.MjSpec, scenario: Scenario, taller: float) -> None:
    shoe, foot, ankle = scenario.shoe, spec.body(scenario.leg.foot), spec.joint("ankle")
    assert shoe is not None
    body = foot.add_body(name=SHOE, pos=ankle.pos)
    body.explicitinertial = True
    body.mass = shoe.mass
    body.ipos = [taller * shoe.centre[0], 0.0, taller * shoe.centre[1]]
    body.inertia = np.array([SLENDER, 1.0, 1.0]) * shoe.inertia * taller**2


def _draw_foot_part(spec: mujoco.MjSpec, shoe: Outsole, places: Places, taller: float) -> None:
    """Sole, heel and upper from heel to ball, in the shoe's body."""
    body = spec.body(SHOE)
    heel, ball = (_flat(places[name][1] - np.array(body.pos)) for name in ("heel", "ball"))
    under_heel, under_ball = taller * shoe.heel_stack, taller * shoe.ball_stack
    width, thin = taller * WIDTH, taller * THIN
    _add_slab(body, "sole", heel, ball, max(min(under_heel, under_ball), thin), width)
    front = heel[0] + HEEL * (ball[0] - heel[0]), heel[1] + HEEL * (ball[1] - heel[1])
    _add_slab(body, "heel", heel, front, max(under_heel, thin), width)
    length, top = ball[0] - heel[0], heel[1] + under_heel
    ellipsoid = mujoco.mjtGeom.mjGEOM_ELLIPSOID
    for name, x, z, size in (
        ("counter", heel[0] + 0.16 * length, top + 0.030 * taller, (0.036, 0.040, 0.040)),
        ("vamp", heel[0] + 0.66 * length, top + 0.014 * taller, (0.088, 0.048, 0.042)),
    ):
        body.add_geom(
            name=f"{SHOE}_{name}",
            type=ellipsoid,
            pos=[x, 0.0, z],
            size=taller * np.array(size),
            **_look(LEATHER),
        )


def _draw_toe_part(
    spec: mujoco.MjSpec, scenario: Scenario, outsole: Outsole, places: Places, taller: float
) -> None:
    """The sole from the ball to its tip, and a shoe's cap over it, on the toes, with which they bend."""
    carrier, body = places["ball"][0], places["pulp"][0]
    origin = np.zeros(3) if body.name == carrier.name else np.array(body.pos)
    ball, pulp, tip = _flat(places["ball"][1] - origin), _flat(places["pulp"][1]), _flat(places["tip"][1])
    thickness, width = max(0.7 * taller * outsole.ball_stack, taller * THIN), taller * WIDTH
    back = ball[0] - OVERLAP * (pulp[0] - ball[0]), ball[1] - OVERLAP * (pulp[1] - ball[1])
    _add_slab(body, "tread", back, pulp, thickness, width)
    _add_slab(body, "tip", pulp, tip, thickness, width)
    if outsole is scenario.shoe:
        body.add_geom(
            name=f"{SHOE}_cap",
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
            pos=[0.5 * (ball[0] + pulp[0]), 0.0, pulp[1] + taller * (outsole.ball_stack + 0.004)],
            size=[0.68 * (tip[0] - ball[0]), 0.52 * width, 0.032 * taller],
            **_look(LEATHER),
        )


def _add_slab(
    body: mujoco.MjsBody, name: str, start: Point, end: Point, thickness: float, width: float
) -> None:
    """A box whose underside runs from one point (x, z) to another [m]."""
    along = np.subtract(end, start)
    length, slope = float(np.hypot(*along)), math.atan2(along[1], along[0])
    middle = 0.5 * np.add(start, end) + 0.5 * thickness * np.array([-math.sin(slope), math.cos(slope)])
    body.add_geom(
        name=f"{SHOE}_{name}",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[middle[0], 0.0, middle[1]],
        quat=[math.cos(0.5 * slope), 0.0, -math.sin(0.5 * slope), 0.0],  # about y, which points left
        size=[0.5 * length, 0.5 * width, 0.5 * thickness],
        **_look(RUBBER),
    )


def _look(colour: tuple[float, float, float, float]) -> dict[str, Any]:
    return {"rgba": colour, "contype": 0, "conaffinity": 0, "mass": 0.0}


def _flat(place: object) -> Point:
    x, _, z = np.asarray(place, dtype=float)
    return float(x), float(z)
