"""Paths through points and around surfaces: lengths, moment arms and pulls against geometry done by hand."""

import itertools
import math
import re
from typing import Any

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError, assets
from afo_sim.description import Orthosis, load
from afo_sim.model import Built, mean_length, paths_of, sweep_ankle
from afo_sim.model.build import build
from afo_sim.model.paths import route_of
from afo_sim.simulation.facts import pull_on

ANGLES = np.radians(np.linspace(-20.0, 20.0, 17))
GROUP = "muscle.dorsiflexor"
HIGH, LOW = np.array([0.06, 0.30]), np.array([0.065, -0.01])  # S1's anchors, forward and up [m]


def point(segment: str, x: float, z: float, **more: Any) -> dict[str, Any]:
    """In the plane of each muscle, which are 2.5 cm apart."""
    place = {"segment": segment, "from_joint": [f"{x} m", "0 m", f"{z} m"], "spacing": "2.5 cm"}
    return place | more


def roller(segment: str, x: float, z: float, radius: float, **more: Any) -> dict[str, Any]:
    return point(segment, x, z, surface={"radius": f"{radius} m", **more})


def guided(*path: dict[str, Any], **more: Any) -> Orthosis:
    sets = {f"{GROUP}.{key}": value for key, value in more.items()}
    return load("orthosis", "s1", {f"{GROUP}.path": list(path)} | sets)


def length_and_arm(orthosis: Orthosis, muscle: str = "dorsiflexor_1") -> tuple[np.ndarray, np.ndarray]:
    paths = paths_of(orthosis)
    column = list(paths.tendons).index(muscle)
    return paths.lengths(ANGLES)[:, column], paths.moment_arms(ANGLES)[:, column]


def turned(place: np.ndarray, angle: float) -> np.ndarray:
    """A place on the foot, forward and up, toe up by an angle."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * place[0] - s * place[1], s * place[0] + c * place[1]])


def around(a: np.ndarray, b: np.ndarray, centre: np.ndarray, radius: float) -> float:
    """Length of the shortest line from a to b outside a circle, by tangents: √(d²−r²) and r times the arc."""
    u, v = a - centre, b - centre
    p, q = float(np.hypot(*u)), float(np.hypot(*v))
    between = math.acos(float(u @ v) / (p * q))
    arc = between - math.acos(radius / p) - math.acos(radius / q)
    if arc <= 0.0:
        return float(np.hypot(*(a - b)))
    return math.sqrt(p * p - radius**2) + math.sqrt(q * q - radius**2) + radius * arc


def differences(of: Any, angle: float, step: float = 1e-6) -> float:
    return float((of(angle - step) - of(angle + step)) / (2.0 * step))


@pytest.mark.parametrize("segment", ["shank", "foot"])
@pytest.mark.parametrize(("x", "z", "radius"), [(0.045, 0.05, 0.03), (0.02, 0.04, 0.05), (0.03, 0.01, 0.02)])
def test_path_around_a_cylinder_is_two_tangents_and_an_arc(
    segment: str, x: float, z: float, radius: float
) -> None:
    length, arm = length_and_arm(guided(roller(segment, x, z, radius)))
    centre = np.array([x, z])

    def of(angle: float) -> float:
        middle = turned(centre, angle) if segment == "foot" else centre
        return around(HIGH, turned(LOW, angle), middle, radius)

    assert length == pytest.approx([of(angle) for angle in ANGLES], rel=1e-9)
    assert arm == pytest.approx([differences(of, angle) for angle in ANGLES], abs=1e-8)


def test_a_path_touches_a_surface_only_where_the_straight_line_would_pass_through_it() -> None:
    centre, radius = np.array([0.03, 0.01]), 0.034
    length, _ = length_and_arm(guided(roller("shank", *centre, radius)))
    straight = np.array([np.hypot(*(HIGH - turned(LOW, angle))) for angle in ANGLES])
    expected = [around(HIGH, turned(LOW, angle), centre, radius) for angle in ANGLES]
    touching = np.array(expected) > straight + 1e-9
    assert touching.any() and not touching.all()
    assert np.abs(length - straight)[~touching] == pytest.approx(0.0, abs=1e-12)
    assert length == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("segment", ["shank", "foot"])
def test_a_cable_over_a_cylinder_about_the_ankle_has_its_radius_for_moment_arm(segment: str) -> None:
    radius, low = 0.045, {"insertion.from_joint": ["2 cm", "0 cm", "-5 cm"]}
    orthosis = guided(roller(segment, 0.0, 0.0, radius), **low)
    paths = paths_of(orthosis)
    data = mujoco.MjData(paths.model)
    for angle in ANGLES:
        data.qpos[0] = angle
        mujoco.mj_fwdPosition(paths.model, data)
        assert data.ten_wrapnum[0] == 4  # touching all along
    _, arm = length_and_arm(orthosis)
    assert arm == pytest.approx(np.full(len(ANGLES), radius), rel=1e-9)


@pytest.mark.parametrize(
    "places",
    [(("shank", 0.08, 0.05),), (("foot", 0.03, 0.04),), (("shank", 0.07, 0.1), ("foot", 0.08, 0.01))],
)
def test_path_through_points_is_their_polyline(places: tuple[tuple[str, float, float], ...]) -> None:
    orthosis = guided(*(point(*place) for place in places))

    def of(angle: float) -> float:
        line = [
            HIGH,
            *(np.array(p[1:]) if p[0] == "shank" else turned(np.array(p[1:]), angle) for p in places),
        ]
        return float(sum(np.hypot(*(a - b)) for a, b in itertools.pairwise([*line, turned(LOW, angle)])))

    length, arm = length_and_arm(orthosis)
    assert length == pytest.approx([of(angle) for angle in ANGLES], rel=1e-12)
    assert arm == pytest.approx([differences(of, angle) for angle in ANGLES], abs=1e-8)
    assert orthosis.muscle["dorsiflexor"].path_lengths == pytest.approx([of(0.0)] * 3, rel=1e-12)


def test_sphere_off_the_middle_is_passed_on_a_great_circle() -> None:
    """The plane through both ends and the centre cuts it in a circle: the planar formula holds in that."""
    centre, radius = np.array([0.045, 0.004, 0.05]), 0.03
    place = {"segment": "shank", "from_joint": [f"{x} m" for x in centre]}
    paths = paths_of(guided(place | {"surface": {"shape": "sphere", "radius": f"{radius} m"}}, count=1))
    for angle, length in zip(ANGLES, paths.lengths(ANGLES)[:, 0], strict=True):
        low = turned(LOW, angle)
        ends = [np.array([p[0], 0.0, p[1]]) - centre for p in (HIGH, low)]
        p, q = (float(np.linalg.norm(end)) for end in ends)
        cosine = float(ends[0] @ ends[1]) / (p * q)
        flat = [np.array([p, 0.0]), q * np.array([cosine, math.sqrt(1.0 - cosine**2)])]
        assert length == pytest.approx(around(*flat, np.zeros(2), radius), rel=1e-9)


def test_the_compiled_scenario_has_the_same_paths_without_its_pictures() -> None:
    """The model that runs drops shapes; surfaces of paths stay."""
    built = build(load("scenario", "seated", {"orthosis": "guided"}))
    names = {built.model.geom(k).name for k in range(built.model.ngeom)}
    assert {"dorsiflexor_1_path0", "plantarflexor_1_path0"} <= names
    assert "plantarflexor_2_path0" not in names  # its path is the first one's
    assert not any(name.startswith("cuff") for name in names)
    paths = paths_of(built.scenario.orthosis)
    _, arm, _ = sweep_ankle(built.model, built.index, ANGLES)
    assert arm == pytest.approx(paths.moment_arms(ANGLES), rel=1e-12)
    assert built.full_model.ngeom > built.model.ngeom
    assert sum(built.model.body_mass) == pytest.approx(sum(built.full_model.body_mass), rel=1e-12)


def test_points_and_surfaces_weigh_nothing_and_touch_nothing() -> None:
    plain = build(load("scenario", "seated"))
    path = [roller("shank", 0.045, 0.05, 0.03), point("shank", 0.07, 0.02)]
    bent = build(load("scenario", "seated", {"orthosis.muscle.dorsiflexor.path": path, LINK: "12 cm"}))
    assert bent.model.body_mass == pytest.approx(plain.model.body_mass, rel=1e-15)
    assert bent.model.body_inertia == pytest.approx(plain.model.body_inertia, rel=1e-15)
    for name in ("dorsiflexor_1_path0",):
        geom = bent.model.geom(name)
        assert (geom.contype[0], geom.conaffinity[0]) == (0, 0)


def test_the_shipped_page_tells_the_moment_arms() -> None:
    """models/orthoses/guided/README.md, in cm at -20, 0 and 20 deg."""
    text = (assets.folder("models") / "orthoses" / "guided" / "README.md").read_text()
    told = re.findall(r"\| `(\w+)` \| ([\d.]+) cm \| ([\d.]+) cm \| ([\d.]+) cm \|", text)
    paths = paths_of(load("orthosis", "guided"))
    arms = 100.0 * np.abs(paths.moment_arms(np.radians([-20.0, 0.0, 20.0])))
    assert len(told) == 4
    for name, *cells in told:
        column = list(paths.tendons).index(f"{name}_1")
        assert [f"{arm:.1f}" for arm in arms[:, column]] == cells, name


def test_nothing_shipped_on_guides_warns() -> None:
    found = build(load("scenario", "seated-antagonist", {"orthosis": "guided"})).warnings
    assert [warning for warning in found if "extrapolated" not in warning] == []


LINK = "orthosis.muscle.dorsiflexor.link_length"


def same_lengths(orthosis: Orthosis) -> bool:
    """Whether all muscles of the group have one path length at every angle, as MuJoCo has them."""
    paths = paths_of(orthosis)
    columns = [k for k, name in enumerate(paths.tendons) if name.startswith("dorsiflexor")]
    return bool(np.ptp(paths.lengths(ANGLES)[:, columns], axis=1).max() < 1e-9)


AXES = ([0.0, 1.0, 0.0], [0.0, 1.0, 0.4], [1.0, 0.0, 0.2])


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize(
    "spacings", [(0.02, 0.02, 0.02), (0.03, 0.01, 0.03), (0.03, 0.02, 0.01), (0.0, 0.02, 0.0)]
)
@pytest.mark.parametrize("aside", [0.0, 0.01])
@pytest.mark.parametrize("surface", ["none", "sphere", 0, 1, 2])
def test_muscles_are_alike_only_where_their_paths_are_of_one_length(
    count: int, spacings: tuple[float, float, float], aside: float, surface: Any
) -> None:
    """Called alike they must be so; called different they may be alike by chance, but no shifted ones."""
    place: dict[str, Any] = {"segment": "shank", "from_joint": ["0.045 m", f"{aside} m", "0.05 m"]}
    if surface == "none":
        place["from_joint"][0] = "0.08 m"
    elif surface == "sphere":
        place["surface"] = {"shape": "sphere", "radius": "3 cm"}
    else:
        place["surface"] = {"radius": "3 cm", "axis": AXES[surface]}
    place["spacing"] = f"{spacings[1]} m"
    ends = {"origin.spacing": f"{spacings[0]} m", "insertion.spacing": f"{spacings[2]} m"}
    orthosis = guided(place, count=count, **ends)
    group = orthosis.muscle["dorsiflexor"]
    if group.alike:
        assert same_lengths(orthosis)
    elif surface == "none" or (surface == 0):
        assert not same_lengths(orthosis)
    if len(set(spacings)) == 1 or count == 1:
        assert group.alike


def test_mean_length_is_that_of_the_bent_path() -> None:
    group = guided(roller("shank", 0.045, 0.05, 0.03)).muscle["dorsiflexor"]
    expected = around(HIGH, LOW, np.array([0.045, 0.05]), 0.03)
    assert mean_length(group) == pytest.approx(expected, rel=1e-9)
    assert max(group.path_lengths) < expected  # the description alone knows a lower bound


# -- what is refused, and what is warned of


def build_of(*path: dict[str, Any], **sets: Any) -> Built:
    more = {f"orthosis.{GROUP}.{key}": value for key, value in sets.items()}
    return build(load("scenario", "seated", {f"orthosis.{GROUP}.path": list(path)} | more))


def refused(*path: dict[str, Any], **sets: Any) -> InputError:
    with pytest.raises(InputError) as caught:
        build_of(*path, **sets)
    return caught.value


def test_a_path_that_would_jump_through_its_surface_is_refused_with_the_angle() -> None:
    """The straight line passes the axis within the range: MuJoCo would put the cable on the other side."""
    centre = np.array([0.063, 0.02])
    error = refused(roller("shank", *centre, 0.015))
    degrees = np.linspace(-20.0, 20.0, 4001)
    lines = [(HIGH - centre, turned(LOW, angle) - centre) for angle in np.radians(degrees)]
    sides = [u[0] * v[1] - u[1] * v[0] for u, v in lines]
    passing = float(degrees[np.flatnonzero(np.diff(np.sign(sides)))[0]])
    told = float(error.problem.split(" deg")[0].split()[-1])
    assert abs(told - passing) <= 1.0
    assert error.field == "orthosis.muscle.dorsiflexor.path[0].surface"


def test_a_point_that_comes_to_lie_inside_a_surface_of_the_other_segment_is_refused() -> None:
    error = refused(roller("shank", 0.05, 0.03, 0.035))  # the insertion comes up to it
    assert "inside it" in error.problem and error.field.endswith("path[0].surface")


def test_a_jump_beyond_the_range_of_motion_is_warned_of() -> None:
    sets = {"orthosis": "guided", "orthosis.muscle.dorsiflexor.path[0].from_joint[0]": "5.5 cm"}
    found = build(load("scenario", "seated", sets)).warnings
    assert any("would jump through it" in warning and "beyond that angle" in warning for warning in found)


def test_a_surface_that_is_never_touched_is_told() -> None:
    sets = {f"orthosis.{GROUP}.path": [roller("shank", -0.05, 0.1, 0.01)]}
    found = build(load("scenario", "seated", sets)).warnings
    assert any("never touches the surface path[0]" in warning for warning in found)


def test_a_muscle_that_reaches_its_first_guide_is_told() -> None:
    sets = {f"orthosis.{GROUP}.path": [point("shank", 0.07, 0.2)], LINK: "11.5 cm"}
    assert any("does not fit" in warning for warning in build(load("scenario", "seated", sets)).warnings)


def test_offset_is_held_against_the_bent_path() -> None:
    """Longer than the straight line, shorter than around the roller: only the compiled model can tell."""
    centre, radius = np.array([0.02, 0.1]), 0.09
    straight, bent = float(np.hypot(*(HIGH - LOW))), around(HIGH, LOW, centre, radius)
    offset = {"cable.offset": f"{0.5 * (straight + bent)} m"}
    assert build_of(roller("shank", *centre, radius), **offset)
    error = refused(roller("shank", *centre, radius), **{"cable.offset": f"{bent + 1e-3} m"})
    assert error.field == "orthosis.muscle.dorsiflexor.cable.offset"
    assert f"{100.0 * bent:.3g} cm" in error.problem


# -- what hangs on the path


def built(sets: dict[str, Any] | None = None) -> Built:
    return build(load("scenario", "seated", {"orthosis": "guided"} | (sets or {})))


def test_pull_on_a_segment_turns_the_ankle_by_what_the_muscles_do() -> None:
    """Moment of the pull on the foot about the ankle, at the place where the free piece leaves it."""
    run = afo_sim.run("seated-antagonist", {"orthosis": "guided", "duration": "8 s"})
    orthosis = load("orthosis", "guided")
    paths = paths_of(orthosis)
    rows = slice(None, None, 250)
    columns = {name: values[rows] for name, values in run.columns.items()}
    data, total = mujoco.MjData(paths.model), []
    for k, angle in enumerate(columns["ankle/angle"]):
        data.qpos[0] = angle
        mujoco.mj_fwdPosition(paths.model, data)
        moment = 0.0
        for name, tendon in paths.tendons.items():
            route = route_of(paths.model, data, tendon)
            (piece,) = route.crossings
            along = route.points[piece] - route.points[piece + 1]
            force = columns[f"muscle/{name}/joint_force"][k] * along / np.linalg.norm(along)
            moment -= float(np.cross(route.points[piece + 1], force)[1])  # toe up about −y
        total.append(moment)
    assert total == pytest.approx(columns["ankle/moment/orthosis"], abs=1e-6)
    on_foot, on_shank = (pull_on(orthosis, segment, columns) for segment in ("foot", "shank"))
    c, s = np.cos(columns["ankle/angle"]), np.sin(columns["ankle/angle"])
    forward = c * on_foot[:, 0] - s * on_foot[:, 2]
    up = s * on_foot[:, 0] + c * on_foot[:, 2]
    assert forward == pytest.approx(-on_shank[:, 0], abs=1e-6)
    assert up == pytest.approx(-on_shank[:, 2], abs=1e-6)


def test_a_straight_path_pulls_along_the_line_between_its_anchors() -> None:
    for segment, own, other in (("foot", LOW, HIGH), ("shank", HIGH, LOW)):
        found = paths_of(load("orthosis", "s1")).directions(ANGLES, segment)[:, 0]
        for angle, direction in zip(ANGLES, found, strict=True):
            line = turned(other, -angle if segment == "foot" else angle) - own
            assert direction[[0, 2]] == pytest.approx(line / np.hypot(*line), abs=1e-9)


def test_the_compiled_model_is_shared_by_cases_that_differ_in_friction_alone() -> None:
    one, two = built(), built({"orthosis.muscle.dorsiflexor.wrap_friction": 0.3})
    moved = built({"orthosis.muscle.dorsiflexor.path[0].surface.radius": "3.2 cm"})
    assert np.array_equal(one.model.geom_size, two.model.geom_size)
    assert not np.array_equal(one.model.geom_size, moved.model.geom_size)
    assert not np.array_equal(one.model.actuator_user, two.model.actuator_user)
