"""Points of the outsole on which the foot stands: of the bare foot, a shoe, or an orthosis' plate."""

from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim.description.leg import Outsole
from afo_sim.description.scenario import Scenario

POINTS = ("heel", "ball", "pulp", "tip")  # of the outsole
BEARING = POINTS[:3]  # points among which a recorded force is shared
SOLE = "sole_"  # before a point's name, its site in the model
OLD = "toe"  # a leg's one site for pulp and tip, where it has not both
Point = tuple[float, float]


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
    """Points of an outsole, in the axes of the flat foot from the ankle [m].

    The outsole is flat from heel to ball. From there it rises to its tip, as the square of the distance.

    Units: taller [-].
    """
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
    """Sites at the outsole's points, on the bodies that carry the foot's own; none where the foot lacks some.

    The foot is refused as soon as it is looked at.
    """
    for name, (body, at) in places_of(spec, scenario, taller).items():
        body.add_site(name=f"{SOLE}{name}", pos=at, size=[0.006, 0.0, 0.0])


def places_of(
    spec: mujoco.MjSpec, scenario: Scenario, taller: float
) -> dict[str, tuple[mujoco.MjsBody, np.ndarray]]:
    """Of each of the outsole's points the body that carries it, and its place there [m] (3,).

    Units: taller [-].
    """
    foot = spec.body(scenario.leg.foot)
    sites = {site.name: site for site in spec.sites if site.name}
    found = {name: sites.get(name, sites.get(OLD)) for name in POINTS}
    own = {name: site for name, site in found.items() if site is not None}
    if len(own) < len(POINTS):
        return {}
    ankle = np.array(spec.joint("ankle").pos)
    bodies = {name: site.parent for name, site in own.items()}
    origins = {name: _from_foot(body, foot) - ankle for name, body in bodies.items()}
    places = {name: np.array(site.pos) + origins[name] for name, site in own.items()}
    bare = {name: (float(place[0]), float(place[2])) for name, place in places.items()}
    return {
        name: (bodies[name], np.array([x, places[name][1], z]) - origins[name])
        for name, (x, z) in outsole_points(bare, worn(scenario), grown(scenario, taller)).items()
    }


def _from_foot(body: mujoco.MjsBody, foot: mujoco.MjsBody) -> np.ndarray:
    """Origin of the foot's body, or of one in it, in the foot's axes, which both share [m]."""
    place = np.zeros(3)
    while body.name != foot.name:
        place += np.array(body.pos)
        body = body.parent
    return place
