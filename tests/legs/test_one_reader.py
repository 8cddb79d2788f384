"""What `leg import`, `attach` and `check` find in one file, and which joints are no ankles."""

import dataclasses
import pathlib

import mujoco
import numpy as np
import pytest
from urdf_texts import inertial, joint, link, robot

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.legs import Part, Shape, Tree, find
from afo_sim.legs.tree import Joint, pose_of

LIMIT = '<limit lower="-0.8" upper="0.4" effort="9" velocity="9"/><axis xyz="0 1 0"/>'
IMPOSSIBLE = inertial(1, inertia="0 1 3")
MESH = '<geometry><mesh filename="package://lab/foot.stl"/></geometry>'


def body(foot: str = inertial(1, "0.05 0 -0.05"), file: str = "package://lab/foot.stl") -> str:
    """A pelvis, an arm that no body has, with a finger that follows another, and a leg on a massless hip."""
    shown = f"<visual>{MESH}</visual><collision>{MESH}</collision>".replace("package://lab/foot.stl", file)
    links = link("pelvis", inertial(9)) + link("arm", IMPOSSIBLE) + link("finger", inertial(0.1, "0.1 0 0"))
    links += (
        link("thumb", inertial(0.1, "0.1 0 0")) + link("hip", "") + link("thigh", inertial(5, "0 0 -0.2"))
    )
    links += (
        link("right_shank", inertial(3, "0 0 -0.2")) + link("right_foot", foot + shown) + link("lens", "")
    )
    joints = joint("continuous", name="shoulder", parent="pelvis", child="arm")
    joints += joint("continuous", name="thumb", parent="arm", child="thumb")
    follow = '<mimic joint="thumb" multiplier="2" offset="0.1"/>'
    joints += joint("continuous", follow, name="finger", parent="arm", child="finger")
    joints += joint("continuous", '<axis xyz="0 1 0"/>', name="hip_y", parent="pelvis", child="hip")
    joints += joint("continuous", '<axis xyz="1 0 0"/>', name="hip_x", parent="hip", child="thigh")
    joints += joint(
        "revolute", f'<origin xyz="0 0 -0.4"/>{LIMIT}', name="bend", parent="thigh", child="right_shank"
    )
    joints += joint("revolute", f'<origin xyz="0 0 -0.4"/>{LIMIT}', parent="right_shank", child="right_foot")
    return robot(links + joints + joint("continuous", name="pan", parent="right_foot", child="lens"))


def box_foot(folder: pathlib.Path) -> None:
    import trimesh

    (folder / "lab").mkdir(parents=True)
    box = trimesh.creation.box((0.25, 0.1, 0.04), transform=pose_of(np.array([0.06, 0.0, -0.06])))
    box.export(str(folder / "lab" / "foot.stl"))


@pytest.mark.parametrize("meshes", [True, False])
def test_import_and_attach_find_the_same_leg(meshes: bool, tmp_path: pathlib.Path) -> None:
    """With meshes in a package, and without them by the foot's mass; MuJoCo judges signs and masses."""
    (tmp_path / "urdf").mkdir()
    file = tmp_path / "urdf" / "body.urdf"
    file.write_text(body())
    if meshes:
        box_foot(tmp_path / "meshes")
    packages = [tmp_path / "meshes"]
    cut = afo.import_leg(file, packages=packages)
    worn = afo.attach(file, "s1", packages=packages, timestep="1 ms")
    for name in ("shank", "foot", "ankle", "side", "sign", "zero", "how"):
        assert getattr(cut.found, name) == getattr(worn.found, name), name
    assert np.allclose(worn.found.axes, cut.found.axes) and np.allclose(worn.found.centre, cut.found.centre)
    assert ("meshes-missing" in [note.code for note in cut.notes]) != meshes
    model, data = worn.model, mujoco.MjData(worn.model)
    added = sum(model.body(k).mass[0] for k in range(model.nbody) if model.body(k).name.startswith("afo_"))
    assert model.body_subtreemass[0] - added == pytest.approx(9 + 1 + 0.2 + 5 + 3 + 1, rel=1e-9)
    assert cut.numbers.shank.mass + cut.numbers.foot.mass == pytest.approx(4)
    assert "pan" not in [model.joint(k).name for k in range(model.njnt)]  # which moves no mass
    data.qpos[model.joint("ankle").qposadr[0]] = 0.1 * worn.found.sign
    mujoco.mj_forward(model, data)
    turn = data.body("right_foot").xmat.reshape(3, 3)
    assert (turn @ worn.found.axes[:, 0]) @ worn.found.axes[:, 2] == pytest.approx(np.sin(0.1))  # toes lift
    assert (model.neq, list(model.eq_data[0][:2])) == (1, pytest.approx([0.1, 2.0]))
    assert sum(model.geom_contype[:] > 0) == meshes  # the collision mesh; the visual one touches nothing


def test_only_the_leg_is_judged(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "body.urdf"
    file.write_text(body(inertial(1, "0.05 0 0", "0 1 3")))
    for command in (afo.import_leg, lambda file: afo.attach(file, "s1", timestep="1 ms")):
        with pytest.raises(InputError, match=r"foot = 'right_foot': no body has the mass 1 kg .* 0, 1, 3 kg"):
            command(file)


def test_a_mesh_is_not_needed_where_the_mass_is_given(tmp_path: pathlib.Path) -> None:
    """Of MJCF; without a mass of its own a body needs the file, which is named."""
    text = afo.load("leg", "adult_75kg").file.read_text()
    mesh = '<geom type="mesh" mesh="lost" contype="0" conaffinity="0"/>'
    text = text.replace('<body name="foot">', f'<body name="foot">{mesh}', 1)
    text = text.replace("<worldbody>", '<asset><mesh name="lost" file="lost.stl"/></asset><worldbody>', 1)
    file = tmp_path / "leg.xml"
    file.write_text(text)
    found, plain = (afo.import_leg(one) for one in (file, afo.load("leg", "adult_75kg").file))
    assert [note.data["all"] for note in found.notes if note.code == "meshes-missing"] == [["lost"]]
    assert found.numbers.about_ankle == pytest.approx(plain.numbers.about_ankle, rel=1e-12)
    assert afo.attach(file, "s1").found.ankle == "ankle"


def leg(foot: tuple[float, float], names: tuple[str, str] = ("foot", "ankle"), **changes: object) -> Tree:
    """A shank above a box from `back` to `front` [m], 6 to 10 cm below its hinge."""
    back, front = foot
    half = np.array([0.5 * (front - back), 0.05, 0.02])
    box = Shape("box", "box", pose_of(np.array([0.5 * (front + back), 0.0, -0.08])), half)
    hinge = Joint(names[1], "hinge", np.array([0.0, 1.0, 0.0]), np.zeros(3), (-0.8, 0.8))
    unit = 0.01 * np.eye(3)
    shank = Part("shank", None, np.eye(4), 3.0, np.array([0.0, 0.0, 0.2]), unit)
    plain = Part(names[0], "shank", np.eye(4), 1.0, np.zeros(3), unit, (hinge,), (box,))
    return Tree(None, {"shank": shank, names[0]: dataclasses.replace(plain, **changes)})  # type: ignore[arg-type]


def test_forward_is_where_the_foot_reaches_or_as_given() -> None:
    near = find(leg((-0.102, 0.123)))
    assert near.axes[0, 0] == 1.0 and "123 mm" in near.notes[0] and "102 mm" in near.notes[0]
    back = find(leg((-0.123, 0.102)))  # the same foot turned round
    assert (back.axes[0, 0], back.sign, len(back.notes)) == (-1.0, -near.sign, len(near.notes))
    for given in ("-x", "-1 0.2 0", (-2.0, 0.0, 0.0)):
        turned = find(leg((-0.102, 0.123)), forward=given)
        assert (turned.axes[0, 0], turned.sign, turned.how["forward"]) == (-1.0, -near.sign, "given")
    said = [find(leg((-0.05, 0.2)), forward=given).notes[0] for given in ("-x", "x")]
    assert ["50 mm the given way and 200 the other" in note for note in said] == [True, False]
    with pytest.raises(InputError, match=r"112 mm to one side .* and 113 mm to the other.*--forward x"):
        find(leg((-0.113, 0.112)))
    for wrong in ("y", "forward", "1 0", (0.0, 0.0, 0.0)):
        with pytest.raises(InputError, match=r"^forward = "):
            find(leg((-0.102, 0.123)), forward=wrong)


def test_a_knee_shows_forward_where_the_foot_does_not() -> None:
    """It bends the shank backward, whatever the sense of its axis."""
    for sense in (1.0, -1.0):
        axis = np.array([0.0, sense, 0.0])
        stops = (0.0, 2.0) if sense > 0.0 else (-2.0, 0.0)  # a turn about +y moves what is below to −x
        bend = Joint("bend", "hinge", axis, np.array([0.0, 0.0, 0.4]), stops)
        parts = leg((-0.1, 0.1)).parts
        thigh = Part("thigh", None, np.eye(4), 5.0, np.array([0.0, 0.0, 0.6]), 0.1 * np.eye(3))
        shank = dataclasses.replace(parts["shank"], parent="thigh", joints=(bend,))
        assert find(Tree(None, {"thigh": thigh, "shank": shank, "foot": parts["foot"]})).axes[0, 0] == 1.0


WHEEL = Shape("wheel", "sphere", np.eye(4), np.array([0.1, 0.0, 0.0]))
SHIN = Shape("shin", "box", pose_of(np.array([0.02, 0.0, -0.2])), np.array([0.07, 0.05, 0.2]))
NO_ANKLES = {
    "an elbow": (leg((-0.05, 0.2), ("hand", "r_elbow_flex")), "'r_elbow_flex': is no human ankle: .*'elbow'"),
    "a hock": (leg((-0.05, 0.2), ("tarsus_R", "hinge")), "'tarsus_R': is no human ankle: .*'tarsus'"),
    "a wheel": (leg((0, 0.1), shapes=(WHEEL,)), "round about it, 100 to 100 mm"),
    "a knee": (leg((0, 0.1), shapes=(SHIN,)), "reaches 400 mm down and is 140 mm long"),
}


@pytest.mark.parametrize("case", NO_ANKLES)
def test_what_is_no_ankle_is_refused_by_name_and_reason(case: str) -> None:
    tree, words = NO_ANKLES[case]
    with pytest.raises(InputError, match=words):
        find(tree, shank="shank", foot=list(tree.parts)[1], forward="x")


def test_an_animal_on_its_toes_is_refused() -> None:
    """A tarsus 60 deg down from its hinge, on toes that turn as it does."""
    turn = np.eye(4)
    turn[:3, :3] = [[0.5, 0, np.sqrt(0.75)], [0, 1, 0], [-np.sqrt(0.75), 0, 0.5]]
    parts = leg((-0.05, 0.2)).parts
    hinge = dataclasses.replace(parts["foot"].joints[0], name="toe", position=np.array([0.2, 0.0, -0.08]))
    tarsus = dataclasses.replace(parts["foot"], pose=turn)
    for weight, words in ((0.2, "60 deg toe down.*as of an animal"), (2.0, "'toe'.*carries 67 %")):
        toe = Part("digit", "foot", np.eye(4), weight, np.array([0.2, 0, -0.08]), 0.01 * np.eye(3), (hinge,))
        animal = Tree(None, {"shank": parts["shank"], "foot": tarsus, "digit": toe})
        with pytest.raises(InputError, match=words):
            find(animal, forward="x")


def test_legs_whose_links_are_numbered_are_found_by_their_chains() -> None:
    """Six hinges a leg, the last two in one place: the fifth, which is lateral, is the ankle."""
    parts = {"base": Part("base", None, np.eye(4), 20.0, np.zeros(3), np.eye(3))}
    for side, y in (("left", 0.1), ("right", -0.1)):
        above = "base"
        for k, (axis, down) in enumerate(((2, 0), (0, 0), (1, 0), (1, 0.4), (1, 0.4), (0, 0)), 1):
            name, pose = f"leg_{side}_{k}_link", pose_of(np.array([0.0, y if k == 1 else 0.0, -down]))
            hinge = Joint(f"leg_{side}_{k}_joint", "hinge", np.eye(3)[axis], np.zeros(3), (-0.9, 0.9))
            shapes = leg((-0.05, 0.2)).parts["foot"].shapes if k == 6 else ()
            parts[name] = Part(name, above, pose, 1.0, np.zeros(3), 0.01 * np.eye(3), (hinge,), shapes)
            above = name
    found = find(Tree(None, parts), side="right")
    assert [found.shank, found.foot] == ["leg_right_4_link", "leg_right_5_link"]
    assert found.ankle == "leg_right_5_joint"
    assert found.shank_length == pytest.approx(0.4) and found.axes == pytest.approx(np.eye(3))
