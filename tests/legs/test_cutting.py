"""A leg comes back as it was, in whatever axes and out of whatever body; remarks on impossible numbers."""

import dataclasses

import mujoco
import numpy as np
import pytest
from turned_leg import hinge, in_a_body, shipped, told_otherwise, turned_round, with_ankle

from afo_sim.common import InputError
from afo_sim.legs import LegNumbers, Part, Shape, Tree, cut, doubtful_notes, find
from afo_sim.legs.cutting import left_behind
from afo_sim.legs.mjcf_out import leg_text

SHIFT = 0.4


def compiled_numbers() -> tuple[float, np.ndarray, float]:
    """Of the shipped leg by MuJoCo: the foot's mass, its centre from the ankle, inertia about the ankle."""
    tree = shipped()
    assert tree.file is not None
    model = mujoco.MjModel.from_xml_path(str(tree.file))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    foot, ankle = model.body("foot").id, model.joint("ankle")
    centre = data.subtree_com[foot] - data.xanchor[ankle.id]
    return float(model.body_subtreemass[foot]), centre, float(full[ankle.dofadr[0], ankle.dofadr[0]])


def swing(text: str) -> np.ndarray:
    """Angle of a leg's ankle that is let go at 20 deg, without toes' motion [rad]."""
    spec = mujoco.MjSpec.from_string(text)
    for joint in list(spec.joints):
        if joint.name != "ankle":
            spec.delete(joint)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = np.radians(20.0)
    found = []
    for _ in range(500):
        mujoco.mj_step(model, data)
        found.append(data.qpos[0])
    return np.array(found)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("whole", [False, True])
def test_a_leg_comes_back_whatever_it_is_told_in(seed: int, whole: bool) -> None:
    random = np.random.default_rng(seed)
    tree = turned_round(shipped(), SHIFT)
    tree = told_otherwise(in_a_body(tree) if whole else tree, random)
    found = find(tree, zero=SHIFT, side="right")
    leg = cut(tree, found)
    numbers, (mass, centre, inertia) = LegNumbers.of(leg), compiled_numbers()
    assert found.sign == -1.0 and found.tilt < 1e-7
    assert numbers.foot.mass == pytest.approx(mass, rel=1e-14)
    np.testing.assert_allclose(numbers.foot.centre, centre, atol=1e-12)
    assert numbers.about_ankle == pytest.approx(inertia, abs=1e-12)
    np.testing.assert_allclose(numbers.shank.centre, [0.0, 0.0, 0.2444], atol=1e-12)
    np.testing.assert_allclose(numbers.range, np.radians([-50.0, 30.0]), atol=1e-12)
    ours = leg.parts["foot"]
    np.testing.assert_allclose(ours.joints[0].axis, [0.0, -1.0, 0.0])
    np.testing.assert_allclose(ours.inertia, np.diag([0.0018, 0.00423392, 0.00423392]), atol=1e-12)
    for name, at in shipped().parts["foot"].points.items():
        np.testing.assert_allclose(ours.points[name], at, atol=1e-12)
    if whole:
        assert found.shank_length == pytest.approx(0.43, abs=1e-12)
        assert left_behind(tree, found) == {
            "parts": ("pelvis", "thigh"),
            "joints": ("knee", "root", "hip"),
            "actuators": ("soleus",),
        }


def test_a_leg_that_comes_back_swings_as_it_did() -> None:
    tree = told_otherwise(in_a_body(turned_round(shipped(), SHIFT)), np.random.default_rng(11))
    back = leg_text(cut(tree, find(tree, zero=SHIFT)), "leg")
    file = shipped().file
    assert file is not None
    there = swing(file.read_text(encoding="utf-8"))
    assert np.ptp(there) > 0.5
    np.testing.assert_allclose(swing(back), there, atol=1e-9)


def test_a_foot_that_stands_bent_is_straightened() -> None:
    """The tree stands at 30 deg of the file's coordinate; the leg is cut at its zero all the same."""
    straight = shipped()
    foot = straight.parts["foot"]
    turn = np.eye(4)
    angle = 0.5
    turn[:3, :3] = [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    bent = with_ankle(straight, {"zero": angle})
    parts = bent.parts | {"foot": dataclasses.replace(bent.parts["foot"], pose=foot.pose @ turn)}
    tree = dataclasses.replace(bent, parts=parts)
    numbers = LegNumbers.of(cut(tree, find(tree)))
    np.testing.assert_allclose(numbers.foot.centre, compiled_numbers()[1], atol=1e-12)
    np.testing.assert_allclose(numbers.range, np.radians([-50.0, 30.0]), atol=1e-12)


def test_springs_rest_where_they_did() -> None:
    """k (q − r) of the file's coordinate q = δ − θ is −k (θ − (δ − r)) of ours."""
    tree = with_ankle(turned_round(shipped(), SHIFT), {"stiffness": 6.0, "spring_reference": 0.1})
    joint = cut(tree, find(tree, zero=SHIFT)).joints()["ankle"][1]
    assert joint.stiffness == 6.0
    assert joint.spring_reference == pytest.approx(SHIFT - 0.1)


def test_toes_are_kept_on_their_hinge() -> None:
    tree = told_otherwise(shipped(), np.random.default_rng(3))
    leg = cut(tree, find(tree), toes="toe")
    toes = leg.parts["toes"]
    np.testing.assert_allclose(toes.pose[:3, 3], [0.115, 0.0, -0.05], atol=1e-12)
    np.testing.assert_allclose(toes.pose[:3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(toes.joints[0].axis, [0, -1, 0])
    np.testing.assert_allclose(toes.joints[0].range, np.radians([-28.6, 60.2]), atol=1e-12)
    np.testing.assert_allclose(toes.points["tip"], [0.075, 0.0, -0.010], atol=1e-12)
    assert LegNumbers.of(leg).about_ankle == pytest.approx(compiled_numbers()[2], abs=1e-12)


def changed(part: str, **change: object) -> Tree:
    tree = shipped()
    parts = dict(tree.parts)
    parts[part] = dataclasses.replace(parts[part], **change)  # type: ignore[arg-type]
    return dataclasses.replace(tree, parts=parts)


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        (with_ankle(shipped(), {"range": None}), ["no stops", "range", "-50 deg"]),
        (with_ankle(shipped(), {"range": (-np.inf, np.inf)}), ["no stops"]),
        (changed("shank", mass=0.0), ["no mass", "shank"]),
        (changed("foot", inertia=np.diag([1e-3, 1e-3, 5e-3])), ["principal moments", "foot"]),
        (changed("foot", inertia=np.diag([-1e-3, 1e-3, 1e-3])), ["principal moments", "foot"]),
        (changed("foot", mass=float("nan")), ["is not a number", "foot"]),
    ],
)
def test_impossible_legs_are_refused(tree: Tree, words: list[str]) -> None:
    found = find(shipped())
    with pytest.raises(InputError) as caught:
        cut(tree, found)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_stops_that_are_given_stand_for_missing_ones() -> None:
    tree = with_ankle(shipped(), {"range": None})
    leg = cut(tree, find(tree), range=(-0.8, 0.5))
    assert LegNumbers.of(leg).range == (-0.8, 0.5)


def test_the_hinge_kept_as_toes_is_named_wrongly() -> None:
    tree = shipped()
    with pytest.raises(InputError, match=r"is not a hinge below the foot.*allowed: toe"):
        cut(tree, find(tree), toes="mtp")


def test_fixed_parts_without_mass_are_points() -> None:
    tree = shipped()
    marker = dataclasses.replace(
        tree.parts["foot"], name="lateral_point", parent="foot", mass=0.0, shapes=(), joints=(), points={}
    )
    pose = np.eye(4)
    pose[:3, 3] = [0.0, -0.04, 0.0]
    parts = tree.parts | {"lateral_point": dataclasses.replace(marker, pose=pose)}
    leg = cut(dataclasses.replace(tree, parts=parts), find(tree))
    assert "lateral_point" not in leg.parts
    np.testing.assert_allclose(leg.parts["foot"].points["lateral"], [0.0, -0.04, 0.0])


def doubts(tree: Tree) -> list[str]:
    leg = cut(tree, find(tree))
    return doubtful_notes(leg, LegNumbers.of(leg))


def foot_times(factor: float, shapes: bool = True) -> Tree:
    """A foot that is a box of 26 × 9 × 4 cm and 1 kg, its inertia in another unit, below a shank."""
    half = np.array([0.13, 0.045, 0.02])
    inertia = np.diag(half @ half - half * half) / 3.0
    middle = np.eye(4)
    middle[:3, 3] = 0.05, 0.0, -0.05
    box = (Shape("box", "box", middle, half),) if shapes else ()
    shank = Part("shank", None, np.eye(4), 3.0, np.array([0.0, 0.0, 0.2]), np.diag([0.04, 0.04, 0.005]))
    ankle = (hinge("ankle", (0, -1, 0)),)
    foot = Part("foot", "shank", np.eye(4), 1.0, middle[:3, 3], factor * inertia, ankle, box)
    return Tree(None, {"shank": shank, "foot": foot})


def test_the_shipped_leg_is_not_doubted() -> None:
    assert doubts(shipped()) == []
    assert doubts(foot_times(1.0)) == doubts(foot_times(1.0, shapes=False)) == []


@pytest.mark.parametrize("factor", [1e6, 1e3, 1e-3, 1e-6])
def test_an_inertia_in_another_unit_is_told(factor: float) -> None:
    """The radius of gyration grows with the root of the unit's factor, and that of the foot is told."""
    assert [(note.code, note.subject) for note in doubts(foot_times(factor))] == [
        ("inertia-doubtful", "foot")
    ]


def test_without_shapes_a_huge_inertia_is_told() -> None:
    doubt = {note.subject: note for note in doubts(foot_times(1e6, shapes=False))}["foot"]
    assert doubt.code == "inertia-doubtful" and doubt.data["gyration"] > doubt.data["reach"] == 0.3


def test_degrees_that_were_read_as_radians_are_refused() -> None:
    with pytest.raises(InputError, match="from -2292 to 1719 deg, which is not an ankle's range: degrees"):
        doubts(with_ankle(shipped(), {"range": (-40.0, 30.0)}))


def test_stops_that_leave_no_motion_are_told() -> None:
    stops = float(np.radians(-2.0)), float(np.radians(1.2))
    (doubt,) = doubts(with_ankle(shipped(), {"range": stops}))
    assert (doubt.code, doubt.data["low"], doubt.data["high"]) == ("range-narrow", *stops)
