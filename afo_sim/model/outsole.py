"""The outsole that is walked on, of bare foot, shoe or orthosis' plate: its points, and the shoe as a body.

Shapes by which shoe and toe are drawn weigh nothing and touch nothing. They are dropped from the model that
runs.
"""

import math
from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim.description import Outsole, Scenario
from afo_sim.model.mounting import drawn

POINTS = ("heel", "ball", "pulp", "tip")  # of the outsole
BEARING = POINTS[:3]  # points among which a recorded force is shared
SOLE = "sole_"  # before a point's name, its site in the model
OLD_TOE = "toe"  # a leg's one site for pulp and tip, where it has not both
Point = tuple[float, float]
SHOE = "shoe"  # name of the body
Places = Mapping[str, tuple[mujoco.MjsBody, np.ndarray]]


def padded(toes: object | None) -> tuple[str, ...]:
    """Points under which there is a pad, where the foot meets a floor: a rigid foot's tip has none."""
    return BEARING if toes is None else POINTS


def worn(scenario: Scenario) -> Outsole | None:
    """The outsole that is walked on; None barefoot."""
    return scenario.orthosis.outsole or scenario.shoe


def grown(scenario: Scenario, taller: float) -> float:
    """Factor on the worn outsole's lengths: a shoe grows with its wearer, an orthosis does not [-]."""
    return 1.0 if scenario.orthosis.outsole else taller


def outsole_points(
    bare: Mapping[str, Point], outsole: Outsole | None, taller: float = 1.0
) -> dict[str, Point]:
    """Points of an outsole, in the axes of the flat foot from the ankle [m]."""
    if outsole is None:
        return dict(bare)
    heel = bare["heel"][0] - taller * outsole.heel_behind, bare["heel"][1] - taller * outsole.heel_stack
    ball = bare["ball"][0], bare["ball"][1] - taller * outsole.ball_stack
    slope = (ball[1] - heel[1]) / (ball[0] - heel[0])
    length = bare["tip"][0] + taller * outsole.tip_ahead - ball[0]

    def ahead(x: float) -> Point:
        rise = taller * outsole.toe_spring * ((x - ball[0]) / length) ** 2
        return x, ball[1] + slope * (x - ball[0]) + rise

    return {"heel": heel, "ball": ball, "pulp": ahead(bare["pulp"][0]), "tip": ahead(ball[0] + length)}


def add_outsole(spec: mujoco.MjSpec, scenario: Scenario, taller: float) -> None:
    """Sites at the outsole's points on the bodies that carry the foot's; none where it lacks some."""
    for name, (body, at) in _places_of(spec, scenario, taller).items():
        body.add_site(name=f"{SOLE}{name}", pos=at, size=[0.006, 0.0, 0.0])


def _places_of(
    spec: mujoco.MjSpec, scenario: Scenario, taller: float
) -> dict[str, tuple[mujoco.MjsBody, np.ndarray]]:
    """Of each of the outsole's points the body that carries it, and its place there [m] (3,)."""
    foot = spec.body(scenario.leg.foot)
    sites = {site.name: site for site in spec.sites if site.name}
    found = {name: sites.get(name, sites.get(OLD_TOE)) for name in POINTS}
    own = {name: site for name, site in found.items() if site is not None}
    if len(own) < len(POINTS):
        return {}
    bodies, origins = {name: site.parent for name, site in own.items()}, {}
    for name, body in bodies.items():  # its origin in the foot's axes, which both share
        origins[name] = np.zeros(3)
        while body.name != foot.name:
            origins[name] += np.array(body.pos)
            body = body.parent
    places = {name: np.array(site.pos) + origins[name] for name, site in own.items()}
    bare = {name: (float(place[0]), float(place[2])) for name, place in places.items()}
    return {
        name: (bodies[name], np.array([x, places[name][1], z]) - origins[name])
        for name, (x, z) in outsole_points(bare, worn(scenario), grown(scenario, taller)).items()
    }


SLENDER = 0.2  # inertia about the shoe's long axis over that in the sagittal plane (assumed) [-]
WIDTH = 0.092  # of a sole [m]
THIN = 0.004  # the least thickness that is drawn [m]
OVERLAP = 0.15  # by which the toe's sole reaches back behind the ball, over its length [-]
HEEL = 0.3  # length of the heel over the distance from heel to ball [-]
RUBBER, LEATHER = (0.13, 0.13, 0.15, 1.0), (0.24, 0.30, 0.42, 1.0)


def add_shoe(spec: mujoco.MjSpec, scenario: Scenario, taller: float) -> None:
    """Put the worn shoe on the foot; of an orthosis with an outsole of its own only the toe is drawn."""
    outsole, shoe = worn(scenario), None if scenario.orthosis.outsole else scenario.shoe
    if outsole is None:
        return
    if shoe is not None:
        body = spec.body(scenario.leg.foot).add_body(name=SHOE, pos=spec.joint("ankle").pos)
        body.explicitinertial = True
        body.mass = shoe.mass
        body.ipos = [taller * shoe.centre[0], 0.0, taller * shoe.centre[1]]
        body.inertia = np.array([SLENDER, 1.0, 1.0]) * shoe.inertia * taller**2
    if places := _places_of(spec, scenario, taller):
        if shoe is not None:
            _draw_foot_part(spec, shoe, places, taller)
        _draw_toe_part(spec, scenario, outsole, places, taller)


def _draw_foot_part(spec: mujoco.MjSpec, shoe: Outsole, places: Places, taller: float) -> None:
    """Sole, heel and upper from heel to ball, in the shoe's body."""
    body = spec.body(SHOE)
    heel, ball = _flat(places["heel"][1] - body.pos), _flat(places["ball"][1] - body.pos)
    under_heel, under_ball = taller * shoe.heel_stack, taller * shoe.ball_stack
    width, thin = taller * WIDTH, taller * THIN
    _add_slab(body, "sole", heel, ball, max(min(under_heel, under_ball), thin), width)
    front = heel[0] + HEEL * (ball[0] - heel[0]), heel[1] + HEEL * (ball[1] - heel[1])
    _add_slab(body, "heel", heel, front, max(under_heel, thin), width)
    length, top = ball[0] - heel[0], heel[1] + under_heel
    for name, x, z, size in (
        ("counter", heel[0] + 0.16 * length, top + 0.030 * taller, (0.036, 0.040, 0.040)),
        ("vamp", heel[0] + 0.66 * length, top + 0.014 * taller, (0.088, 0.048, 0.042)),
    ):
        body.add_geom(
            name=f"{SHOE}_{name}",
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
            pos=[x, 0.0, z],
            size=taller * np.array(size),
            **drawn(LEATHER),
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
            **drawn(LEATHER),
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
        **drawn(RUBBER),
    )


def _flat(place: object) -> Point:
    x, _, z = np.asarray(place, dtype=float)
    return float(x), float(z)
