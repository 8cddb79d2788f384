"""What a muscle's mounting does over the ankle's angle, against geometry and balances computed here."""

import functools
import math
import pathlib
import re
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from changed_leg import changed_leg
from scipy.optimize import brentq

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import Orthosis
from afo_sim.model import Design, PathFacts, along, path_points, rows, support, taut
from afo_sim.model.design import design
from afo_sim.model.leg_shapes import DEEP, LegShapes, _knee_height, leg_shapes, through_leg, winding_number
from afo_sim.model.path_facts import _alike, path_facts, spans_above
from afo_sim.model.path_words import in_words
from afo_sim.model.torque_map import torque_map

FRONT, BACK = "orthosis.muscle.dorsiflexor", "orthosis.muscle.plantarflexor"
RIGID: dict[str, Any] = {"orthosis.anchor": {}}


@functools.cache
def facts(pressure: float | None = None) -> dict[str, PathFacts]:
    return {entry.name: entry for entry in path_facts(afo.build("seated"), pressure)}


@functools.cache
def s1() -> Orthosis:
    return afo.load("orthosis", "s1")


def distance(name: str, angle: float) -> float:
    """Distance between S1's anchors of the middle of a group, the foot turned about the ankle [m]."""
    group = s1().muscle[name]
    x, _, z = group.insertion.from_joint  # toe up: x sin θ goes up
    turned = x * math.cos(angle) - z * math.sin(angle), x * math.sin(angle) + z * math.cos(angle)
    return math.hypot(turned[0] - group.origin.from_joint[0], turned[1] - group.origin.from_joint[2])


def free_contraction(kind: Any, pressure: float) -> float:
    """Contraction at which a muscle without load comes to rest."""
    if pressure == 0.0:
        return 0.0
    found = brentq(lambda kappa: kind.force(pressure, contraction=kappa) - 1e-9, 0.01, 0.4, xtol=1e-13)
    return float(found)


@pytest.mark.parametrize("name", ["dorsiflexor", "plantarflexor"])
def test_lengths_and_moment_arms_are_those_of_the_geometry(name: str) -> None:
    found = facts()[name]
    lengths = np.array([distance(name, angle) for angle in found.angles])
    assert np.abs(found.length - lengths).max() < 1e-9
    step = 1e-5
    slope = [distance(name, a + step) - distance(name, a - step) for a in found.angles]
    assert np.abs(found.arm + np.array(slope) / (2.0 * step)).max() < 1e-8


def test_taut_angle_is_where_the_path_is_as_long_as_muscle_and_link() -> None:
    found = facts()["dorsiflexor"]
    group = found.group
    whole = group.type.total_length + group.link_length + group.slack
    root = brentq(lambda angle: distance("dorsiflexor", angle) - whole, -0.5, 0.2, xtol=1e-12)
    ((low, high),) = found.slack[0]
    assert low == pytest.approx(root, abs=1e-8)
    assert high == pytest.approx(np.radians(30.0))
    assert facts()["plantarflexor"].slack[0] == ((found.angles[0], found.angles[-1]),)


@pytest.mark.parametrize("pressure", [2e5, 4e5])
def test_angle_of_slack_at_pressure_is_where_the_free_muscle_is_as_long(pressure: float) -> None:
    found = facts(pressure)["dorsiflexor"]
    kind = found.group.type
    free = free_contraction(kind, pressure)
    whole = found.group.series_length + kind.nominal_length * (1.0 - free)
    root = brentq(lambda angle: distance("dorsiflexor", angle) - whole, -0.5, 0.5, xtol=1e-12)
    ((low, _),) = found.slack[1]
    assert low == pytest.approx(root, abs=1e-6)


@pytest.mark.parametrize("angle", [-20.0, -10.0, 0.0, 10.0])
def test_own_contraction_is_the_balance_of_muscle_cable_cuff_and_plate(angle: float) -> None:
    found = facts()["dorsiflexor"]
    row = found.at(np.radians(angle))
    orthosis, group = afo.load("orthosis", "s1"), found.group
    kind = group.type
    for column, pressure in enumerate(found.pressures):

        def excess(kappa: float, pressure: float = float(pressure)) -> float:
            force = kind.force(pressure, contraction=kappa)
            gives = force / group.cable.stiffness
            gives += sum(3.0 * force / orthosis.anchor[part].stiffness for part in ("shank", "foot"))
            chain = group.series_length + kind.nominal_length * (1.0 - kappa) + gives
            return chain - distance("dorsiflexor", np.radians(angle))

        free = free_contraction(kind, float(pressure))
        if excess(free) > 0.0:  # it hangs through
            assert found.own[row, column] == pytest.approx(free, abs=1e-6)
            assert found.force[row, column] == 0.0
            continue
        kappa = brentq(excess, -0.05, free, xtol=1e-13)
        assert found.own[row, column] == pytest.approx(kappa, abs=1e-6)
        expected = kind.force(float(pressure), contraction=kappa)
        assert found.force[row, column] == pytest.approx(expected, abs=0.02)
        assert found.torque[row, column] == pytest.approx(3.0 * expected * found.arm[row], abs=0.005)


def test_torques_are_those_of_the_torque_map() -> None:
    built = afo.build("seated")
    for entry in path_facts(built):
        inside = entry.angles[entry.inside]
        (other,) = (m for m in torque_map(built, inside, entry.pressures) if m.chamber == entry.chamber)
        assert np.abs(entry.torque[entry.inside] - other.torque).max() < 1e-9


def test_chain_is_as_long_as_a_path_that_nothing_shortens() -> None:
    """On a rigid mounting with a stiff cable, a taut muscle with its link fills the path."""
    stiff = {f"{FRONT}.cable.stiffness": "1e6 kN/m", f"{BACK}.cable.stiffness": "1e6 kN/m"}
    for entry in path_facts(afo.build("seated", RIGID | stiff)):
        for column in range(3):
            taut = entry.inside & (entry.force[:, column] > 0.0)
            assert np.abs(entry.chain_length[taut, column] - entry.length[taut]).max(initial=0.0) < 1e-6
        for column, spans in ((0, entry.slack[0]), (2, entry.slack[1])):
            for low, high in spans:
                hangs = (entry.angles > low) & (entry.angles < high)
                assert (entry.chain_length[hangs, column] > entry.length[hangs]).all()
                assert not entry.force[hangs, column].any()


def test_muscles_that_differ_are_told_apart() -> None:
    built = afo.build("seated", {f"{FRONT}.insertion.spacing": "5 cm"})
    names = [entry.name for entry in path_facts(built)]
    assert names == ["dorsiflexor 1, 3", "dorsiflexor 2", "plantarflexor"]
    assert [len(entry.muscles) for entry in path_facts(built)] == [2, 1, 2]


def test_stretch_limits_are_found_at_their_contraction() -> None:
    """Over a wheel the path is linear in the angle, κ = κ0 ± r φ/L0, and nothing gives."""
    built = afo.build("arm-s1")
    entry = path_facts(built)[0]
    pulley, kind = entry.group.pulley, entry.group.type
    for spans, level in ((entry.locked, kind.braid.lock), (entry.stretched, kind.limits.contraction_min)):
        gives = kind.force(0.0, contraction=level) / entry.group.cable.stiffness / kind.nominal_length
        angle = (level - gives - pulley.initial_contraction) * kind.nominal_length / pulley.radius
        ((low, high),) = spans
        assert low == entry.angles[0]
        assert high == pytest.approx(angle, abs=1e-6)


def test_spans_are_found_with_their_ends() -> None:
    angles = np.linspace(-1.0, 1.0, 21)

    def of(angle: float) -> float:
        return math.cos(7.0 * angle)

    found = spans_above(angles, np.cos(7.0 * angles), of)
    quarter = math.pi / 14.0
    assert np.allclose(found, [(-1.0, -3 * quarter), (-quarter, quarter), (3 * quarter, 1.0)], atol=1e-8)
    assert in_words((), angles) == "nowhere"
    assert in_words(((-1.0, 1.0),), angles) == "everywhere"
    assert in_words(((-1.0, 0.0),), angles) == "below 0 deg"
    assert in_words(((np.radians(-15.46), 1.0),), angles) == "above −15.5 deg"


# --- through the limb


def test_depths_are_the_analytic_distances() -> None:
    shapes = leg_shapes(afo.build("seated"))
    draw = np.random.default_rng(3)
    names = {shapes.model.geom(g).name: g for g in shapes.geoms}
    assert set(names) == {"shank", "knee", "heel", "malleoli", "midfoot", "forefoot", "toes"}
    ankle = shapes.data.xanchor[0]

    def spread(middle: tuple[float, float, float], reach: float) -> np.ndarray:
        return np.array(middle) + draw.uniform(-reach, reach, (200, 3))

    points = spread((0.0, 0.0, 0.431), 0.06)  # the sphere of the knee
    expected = 0.055 - np.linalg.norm(points - [0.0, 0.0, 0.431], axis=1)
    near = expected > -0.04
    assert np.abs(shapes.depths(names["knee"], points + ankle) - expected)[near].max() < 1e-7

    points = spread((0.0, 0.0, 0.03), 0.06)  # the capsule of the shank, from 20 to 400 mm
    height = np.clip(points[:, 2], 0.02, 0.40)
    away = np.linalg.norm(points - np.column_stack([0 * height, 0 * height, height]), axis=1)
    near = 0.045 - away > -0.04
    assert np.abs(shapes.depths(names["shank"], points + ankle) - (0.045 - away))[near].max() < 1e-7

    half = np.array([0.015, 0.042, 0.012])  # the box of the forefoot: inside, the nearest face
    points = np.array([0.105, 0.0, -0.053]) + draw.uniform(-1.0, 1.0, (200, 3)) * half
    expected = (half - np.abs(points - [0.105, 0.0, -0.053])).min(axis=1)
    assert np.abs(shapes.depths(names["forefoot"], points + ankle) - expected).max() < 1e-7


def box_leg(folder: pathlib.Path) -> dict[str, Any]:
    """The shipped leg with a shank of a mesh: a channel, open ahead, whose hull is a box."""
    outer = [(-0.05, -0.05), (0.05, -0.05), (0.05, -0.04), (-0.04, -0.04)]
    outer += [(-0.04, 0.04), (0.05, 0.04), (0.05, 0.05), (-0.05, 0.05)]
    count = len(outer)
    corners = [(x, y, z) for z in (0.02, 0.40) for x, y in outer]
    faces = []
    for k in range(count):
        other = (k + 1) % count
        faces += [(k, other, count + other), (k, count + other, count + k)]
    lid = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 7), (4, 5, 6), (4, 6, 7)]
    faces += [(c, b, a) for a, b, c in lid] + [(count + a, count + b, count + c) for a, b, c in lid]
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    text += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    (folder / "channel.obj").write_text(text)
    asset = '<asset><mesh name="channel" file="channel.obj"/></asset>'
    mesh = '<geom name="shank" type="mesh" mesh="channel" contype="0" conaffinity="0"/>'

    def channelled(text: str) -> str:
        text = re.sub(r'<geom name="shank"[^>]*/>', mesh, text)
        return text.replace("<worldbody>", f"{asset}<worldbody>")

    return changed_leg(folder, channelled)


def test_a_mesh_is_asked_itself_and_not_its_hull(tmp_path: pathlib.Path) -> None:
    shapes = leg_shapes(afo.build("seated", box_leg(tmp_path)))
    (geom,) = (g for g in shapes.geoms if shapes.model.geom(g).name == "shank")
    ankle = shapes.data.xanchor[0]
    points = np.array([[0.02, 0.0, 0.2], [-0.045, 0.0, 0.2], [-0.0435, 0.01, 0.2], [0.0, 0.043, 0.2]]) + ankle
    depths = shapes.depths(geom, points)
    assert depths[0] < 0.0  # in the channel
    assert depths[1:] == pytest.approx([0.005, 0.0035, 0.003], abs=1e-6)


def test_a_surface_winds_once_around_what_is_inside() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    triangles = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    assert winding_number(triangles, np.array([0.1, 0.1, 0.1])) == pytest.approx(1.0)
    assert winding_number(triangles, np.array([0.5, 0.5, 0.5])) == pytest.approx(0.0, abs=1e-12)


def test_a_muscle_through_the_shin_is_found_with_depth_and_angle() -> None:
    """Its path leans in front of a vertical capsule of 45 mm: depth is 45 mm less the path's distance."""
    sets = {
        f"{FRONT}.count": 1,
        f"{FRONT}.origin.from_joint": ["3 cm", "0 cm", "30 cm"],
        f"{FRONT}.link_length": "12 cm",
    }
    built = afo.build("seated", sets)
    (found,) = (entry for entry in through_leg(built) if entry.role == "dorsiflexor" and not entry.bone)
    angles = np.linspace(*np.radians([-20.0, 20.0]), 21)
    worst = []
    for angle in angles:
        x, z = 0.065, -0.01
        low = np.array([x * math.cos(angle) - z * math.sin(angle), x * math.sin(angle) + z * math.cos(angle)])
        high = np.array([0.03, 0.30])
        way = np.linspace(0.0, 1.0, 2001)[:, None]
        points = high + way * (low - high)
        length = float(np.linalg.norm(low - high))
        inside = (way[:, 0] * length > 0.015) & (points[:, 1] > 0.02)
        worst.append(0.045 - np.abs(points[inside, 0]).min())
    assert found.part == "shank"
    assert found.depth == pytest.approx(max(worst), abs=6e-4)  # points stand 4 mm apart
    assert found.angle == pytest.approx(angles[int(np.argmax(worst))], abs=1e-9)
    assert (found.end, found.move > 0.0) == ("origin", True)
    assert "14 mm under the skin of the shank at" in found.notice
    assert "move origin.from_joint forward" in found.notice


def test_the_fix_that_is_told_takes_the_muscle_out() -> None:
    sets = {f"{FRONT}.count": 1, f"{FRONT}.origin.from_joint": ["3 cm", "0 cm", "30 cm"]}
    sets |= {f"{FRONT}.link_length": "12 cm"}
    (found,) = (entry for entry in through_leg(afo.build("seated", sets)) if entry.role == "dorsiflexor")
    further = 3.0 + 100.0 * found.move
    mended = sets | {f"{FRONT}.origin.from_joint": [f"{further} cm", "0 cm", "30 cm"]}
    assert not [e for e in through_leg(afo.build("seated", mended)) if e.role == "dorsiflexor"]


def test_a_muscle_clear_of_the_limb_is_not_told() -> None:
    clear = {f"{BACK}.insertion.from_joint": ["-9 cm", "0 cm", "-3 cm"], f"{BACK}.link_length": "12 cm"}
    assert through_leg(afo.build("seated", clear)) == []
    assert through_leg(afo.build("arm-s1")) == []


def test_a_path_along_the_bone_is_told() -> None:
    """From behind the shin to the instep, above the ankle: it crosses the line ankle–knee."""
    across = {
        f"{FRONT}.count": 1,
        f"{FRONT}.origin.from_joint": ["-3 cm", "0 cm", "30 cm"],
        f"{FRONT}.insertion.from_joint": ["9 cm", "0 cm", "-1 cm"],
        f"{FRONT}.link_length": "13 cm",
    }
    found = [entry for entry in through_leg(afo.build("seated", across)) if entry.bone]
    assert [entry.muscle for entry in found] == ["dorsiflexor_1"]
    assert found[0].depth < 0.0025  # between two points, 4 mm apart, on the line
    assert "through bone" in found[0].notice


def test_a_path_with_points_is_followed() -> None:
    """Its corners are the points that the file names; a point takes the muscle out of the shin."""
    inside = {f"{FRONT}.origin.from_joint": ["4 cm", "0 cm", "30 cm"], f"{FRONT}.link_length": "12 cm"}
    told = [
        e for e in through_leg(afo.build("seated", inside | {f"{FRONT}.count": 1})) if e.role == "dorsiflexor"
    ]
    assert told == [] or told[0].depth < 0.007
    point = {"segment": "shank", "from_joint": ["7 cm", "0 cm", "12 cm"]}
    built = afo.build(
        "seated", {f"{FRONT}.count": 1, f"{FRONT}.path": [point], f"{FRONT}.link_length": "12 cm"}
    )
    model = built.full_model
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    corners = path_points(model, data, "dorsiflexor_1") - data.xanchor[model.joint("ankle").id]
    assert corners == pytest.approx(np.array([[0.06, 0, 0.3], [0.07, 0, 0.12], [0.065, 0, -0.01]]), abs=1e-9)
    assert along(corners)[-1] == pytest.approx(data.ten_length[model.tendon("dorsiflexor_1").id])


def test_an_arc_around_a_surface_is_as_long_as_mujoco_says() -> None:
    surface = {"shape": "cylinder", "radius": "22 mm"}
    place = {"segment": "shank", "from_joint": ["-4 cm", "0 cm", "5 cm"], "surface": surface}
    built = afo.build(
        "seated", {f"{BACK}.path": [place], f"{BACK}.insertion.from_joint": ["-5.5 cm", "0 cm", "-4 cm"]}
    )
    model = built.full_model
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    corners = path_points(model, data, "plantarflexor_1")
    straight = data.ten_wrapnum[model.tendon("plantarflexor_1").id]
    assert len(corners) > straight
    length = float(data.ten_length[model.tendon("plantarflexor_1").id])
    assert along(corners)[-1] == pytest.approx(length, abs=1e-6)
    assert along(corners)[-1] <= length


# --- refusals


def test_a_moment_arm_that_changes_its_sign_is_refused() -> None:
    """The path passes over the ankle: at the angle told, the ankle lies on the line between the anchors."""
    through = {
        f"{FRONT}.origin.from_joint": ["1 cm", "0 cm", "30 cm"],
        f"{FRONT}.insertion.from_joint": ["-0.3 cm", "0 cm", "-3 cm"],
        f"{FRONT}.link_length": "14 cm",
    }
    with pytest.raises(InputError, match="passes through the ankle") as refused:
        afo.build("seated", through)
    error = refused.value
    assert error.field == "orthosis.muscle.dorsiflexor.origin.from_joint"
    assert error.file == "s1"
    assert "further" in error.allowed and "range_of_motion" in error.allowed

    def beside(angle: float) -> float:
        x, z = -0.003, -0.03
        low = x * math.cos(angle) - z * math.sin(angle), x * math.sin(angle) + z * math.cos(angle)
        return low[0] * 0.30 - low[1] * 0.01

    root = np.degrees(brentq(beside, -0.34, 0.34))
    told = float(str(error.problem).split(" at ")[1].split(" deg")[0])
    assert told == pytest.approx(root, abs=1.5)  # angles stand 1 deg apart


def test_a_muscle_that_does_not_fit_between_its_anchors_is_refused() -> None:
    with pytest.raises(InputError, match="does not fit on its path") as refused:
        afo.build(
            "seated", {f"{FRONT}.type": "dmsp_20", f"{FRONT}.origin.from_joint": ["6 cm", "0 cm", "15 cm"]}
        )
    assert refused.value.field == "orthosis.muscle.dorsiflexor.origin.from_joint"


def test_a_link_that_leaves_no_room_is_refused_with_the_longest_that_does() -> None:
    with pytest.raises(InputError, match="even where it is longest") as refused:
        afo.build("seated", {f"{FRONT}.link_length": "30 cm"})
    assert refused.value.field == "orthosis.muscle.dorsiflexor.link_length"
    longest = int(refused.value.allowed.split("at most ")[1].split(" mm")[0])
    afo.build("seated", {f"{FRONT}.link_length": f"{longest} mm"})
    with pytest.raises(InputError, match="does not fit"):
        afo.build("seated", {f"{FRONT}.link_length": f"{longest + 1} mm"})


@pytest.mark.parametrize("name", ["s1", "s1_short_links", "arm", "arm_s1"])
def test_every_shipped_orthosis_has_its_facts(name: str) -> None:
    found: Design = design(name)
    for entry in found.facts:
        for what, words in rows(entry):
            assert what.startswith(entry.name)
            assert "nan" not in words and len(words) < 110
        assert np.isfinite(entry.own).all() and np.isfinite(entry.torque).all()
    assert all(entry.depth > DEEP for entry in found.through if not entry.bone)


def test_wrong_pressures_are_refused() -> None:
    for pressure in ("4 m", "-1 bar", 0.0, 3e6):
        with pytest.raises(InputError) as refused:
            design("s1", pressure=pressure)
        assert refused.value.field == "pressure"
    with pytest.raises(InputError, match="did you mean 's1'"):
        design("s_1")


def test_a_muscle_is_taut_where_it_is_not_slack() -> None:
    angles = np.radians([-20.0, 0.0, 10.0, 30.0])
    found: Any = SimpleNamespace(angles=angles, slack=(((angles[0], angles[2]),), ()))
    assert [taut(found, which) for which in (0, 1)] == ["above 10 deg", "everywhere"]
    assert taut(facts()["dorsiflexor"], 0) == "below −15.5 deg"
    assert taut(facts()["plantarflexor"], 0) == "nowhere"


def test_muscles_of_a_group_are_alike_whichever_path_is_longer() -> None:
    group: Any = SimpleNamespace(type=SimpleNamespace(nominal_length=0.2))
    contraction = np.array([[0.0, -0.1, 1e-12, 0.1]] * 2)
    names = ["a", "b", "c", "d"]
    found = _alike(names, dict.fromkeys(names, group), contraction, {name: k for k, name in enumerate(names)})
    assert found == [("a", "c"), ("b",), ("d",)]


EXTENTS: dict[str, Any] = {  # support functions: of a direction in the shape's axes and its sizes [m]
    "sphere": lambda d, s: s[0],
    "capsule": lambda d, s: s[0] + s[1] * abs(d[2]),
    "cylinder": lambda d, s: s[0] * math.hypot(d[0], d[1]) + s[1] * abs(d[2]),
    "box": lambda d, s: s @ abs(d),
    "ellipsoid": lambda d, s: np.linalg.norm(s * d),
}


def test_outermost_points_are_those_of_the_support_functions() -> None:
    shapes = "".join(
        f'<geom type="{kind}" size=".03 .1 .05" pos=".1 0 {0.1 * k}" euler="20 {30 * k} 50"/>'
        for k, kind in enumerate(EXTENTS)
    )
    joint = '<joint name="ankle" type="hinge" pos="0 0 .02"/>'
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody><body>{joint}{shapes}</body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    directions = np.random.default_rng(2).normal(size=(9, 3))
    directions[0] = (0.0, 0.0, 1.0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    tops = []
    for geom, extent in enumerate(EXTENTS.values()):
        local = directions @ data.geom_xmat[geom].reshape(3, 3)
        expected = directions @ data.geom_xpos[geom] + [extent(d, model.geom_size[geom]) for d in local]
        found = support(model, data, geom, directions)
        assert (found * directions).sum(axis=1) == pytest.approx(expected, abs=1e-12)
        tops.append(expected[0])
    leg = LegShapes(model, data, dict.fromkeys(range(len(EXTENTS)), "shank"))
    assert _knee_height(leg) == pytest.approx(max(tops) - 0.02)
