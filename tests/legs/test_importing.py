"""An imported leg loads and runs; nothing is written of one that does not."""

import pathlib

import mujoco
import numpy as np
import pytest
from turned_leg import in_a_body, shipped, told_otherwise, turned_round, with_ankle
from urdf_texts import inertial, two

import afo_sim as afo
from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import InputError
from afo_sim.common import find as asset
from afo_sim.legs import LegNumbers, export_leg, import_leg, read_tree
from afo_sim.legs.leg_description import RELAXED
from afo_sim.legs.mjcf_out import write_leg_file
from afo_sim.model.build import build
from afo_sim.physics.passive_ankle import riener_edrich_1999
from afo_sim.show import draw_leg

LEG = asset("leg", "adult_75kg").parent / "leg.xml"


def test_the_shipped_leg_runs_as_it_does_itself(tmp_path: pathlib.Path) -> None:
    """Out of a body, in other axes, with its sign and zero turned: the same run, to rounding."""
    tree = told_otherwise(in_a_body(turned_round(shipped(), 0.4)), np.random.default_rng(5))
    write_leg_file(tree, tmp_path / "body.xml", "body")
    imported = import_leg(tmp_path / "body.xml", tmp_path / "leg", zero=0.4, toes="toe", side="right")
    assert imported.folder == tmp_path / "leg"
    ours = afo.run(afo.load("scenario", "seated", {"leg": str(tmp_path / "leg"), "duration": "2 s"}))
    theirs = afo.run(afo.load("scenario", "seated", {"duration": "2 s"}))
    assert ours.status == "ok" and np.ptp(theirs["ankle/angle"]) > 0.1
    np.testing.assert_allclose(ours["ankle/angle"], theirs["ankle/angle"], atol=1e-9)


def test_it_walks_as_it_does_itself(tmp_path: pathlib.Path) -> None:
    tree = told_otherwise(in_a_body(shipped()), np.random.default_rng(6))
    write_leg_file(tree, tmp_path / "body.xml", "body")
    import_leg(tmp_path / "body.xml", tmp_path / "leg", toes="toe")
    ours, theirs = (
        build(afo.load("scenario", "walk-dropfoot", sets)).foot
        for sets in ({"leg": str(tmp_path / "leg")}, {})
    )
    assert ours is not None and theirs is not None
    assert ours.inertia == pytest.approx(theirs.inertia, abs=1e-12)
    for name, place in theirs.points.items():
        np.testing.assert_allclose(ours.points[name], place, atol=1e-12)
    assert ours.toes is not None and theirs.toes is not None
    assert ours.toes.inertia == pytest.approx(theirs.toes.inertia, abs=1e-12)


def test_derived_points_of_the_sole_are_near_the_real_ones(tmp_path: pathlib.Path) -> None:
    """Without its sites the shipped foot's are found again from its shapes, within a thumb's breadth."""
    text = "\n".join(line for line in LEG.read_text(encoding="utf-8").splitlines() if "<site" not in line)
    (tmp_path / "bare.xml").write_text(text, encoding="utf-8")
    imported = import_leg(tmp_path / "bare.xml")
    assert "derived" in imported.sole
    for name, x in (("heel", -0.060), ("ball", 0.120), ("pulp", 0.175), ("tip", 0.190)):
        place = imported.leg.parts["foot"].points[name]
        assert place[0] == pytest.approx(x, abs=0.012)
        assert place[2] == pytest.approx(-0.068, abs=0.012)


def test_a_humanoid_of_dm_control_runs(tmp_path: pathlib.Path) -> None:
    package = pytest.importorskip("dm_control")
    file = pathlib.Path(package.__file__).parent / "suite" / "humanoid.xml"
    imported = import_leg(file, tmp_path / "leg", side="left")
    leg = afo.load("leg", str(tmp_path / "leg"))
    assert (leg.side, leg.damping, leg.passive.scale) == ("left", 0.2, 0.0)
    model = mujoco.MjModel.from_xml_path(str(leg.file))
    assert model.jnt_stiffness[0] == 6.0 and model.nq == 1
    assert len(imported.left_behind["joints"]) == 20
    assert (
        afo.run(afo.load("scenario", "seated", {"leg": str(tmp_path / "leg"), "duration": "1 s"})).status
        == "ok"
    )


def test_the_damping_of_the_file_counts_once(tmp_path: pathlib.Path) -> None:
    """The compiled joint has half of it, the passive ankle the other half."""
    text = LEG.read_text(encoding="utf-8").replace('name="ankle" type', 'damping="0.8" name="ankle" type')
    (tmp_path / "leg.xml").write_text(text, encoding="utf-8")
    import_leg(tmp_path / "leg.xml", tmp_path / "out")
    built = build(afo.load("scenario", "seated", {"leg": str(tmp_path / "out")}))
    assert built.scenario.leg.damping == 0.8
    assert built.model.dof_damping[built.index.ankle_dof] == pytest.approx(0.4)


@pytest.mark.slow
def test_meshes_come_along(tmp_path: pathlib.Path) -> None:
    import trimesh

    trimesh.creation.capsule(height=0.3, radius=0.04).export(tmp_path / "bone.stl")
    text = LEG.read_text(encoding="utf-8").replace(
        "<worldbody>", '<asset><mesh name="bone" file="bone.stl"/></asset><worldbody>'
    )
    text = text.replace('<geom name="shank"', '<geom type="mesh" mesh="bone"/><geom name="shank"')
    (tmp_path / "leg.xml").write_text(text, encoding="utf-8")
    imported = import_leg(tmp_path / "leg.xml", tmp_path / "out")
    assert [file.suffix for file in (tmp_path / "out" / "meshes").iterdir()] == [".stl"]
    draw_leg(imported.leg, "a $mesh", tmp_path / "leg.png")
    from matplotlib import image

    assert image.imread(tmp_path / "leg.png").std() > 0.05
    import_leg(LEG, tmp_path / "out", force=True)
    assert not (tmp_path / "out" / "meshes").exists()  # nothing of the older leg stays


def test_the_folder_tells_its_source_and_only_known_kinds(tmp_path: pathlib.Path) -> None:
    import_leg(LEG, tmp_path / "leg", body_mass=72.0, body_height=1.7)
    leg = afo.load("leg", str(tmp_path / "leg"))
    assert (leg.body_mass, leg.body_height) == (72.0, 1.7)
    assert leg.foot_length == pytest.approx(0.263, abs=1e-6)
    assert "user" in (tmp_path / "leg" / "leg.toml").read_text(encoding="utf-8")
    readme = (tmp_path / "leg" / "README.md").read_text(encoding="utf-8")
    assert "leg.xml" in readme and str(LEG.parent) not in readme


def test_a_leg_in_millimetres_is_refused(tmp_path: pathlib.Path) -> None:
    """A CAD program's mesh without scale: a foot of 240 m, on which nobody walks."""
    import trimesh

    foot = trimesh.creation.box((240.0, 80.0, 60.0)).apply_translation((60.0, 0.0, -50.0))
    foot.export(tmp_path / "foot.stl")
    seen = '<visual><geometry><mesh filename="foot.stl" SCALE/></geometry></visual>'
    more = '<origin xyz="0 0 -.4"/><axis xyz="0 1 0"/><limit lower="-.5" upper=".8" effort="1" velocity="1"/>'
    shank, sole = inertial(3, "0 0 -.2", ".01 .01 .01"), inertial(1, ".05 0 -.04", ".01 .01 .01")
    text = two("revolute", more, shank=shank, foot=sole + seen)
    urdf = tmp_path / "leg.urdf"
    urdf.write_text(text.replace("SCALE", ""), encoding="utf-8")
    with pytest.raises(InputError, match=r"foot.*is 240 m long.*millimetres"):
        import_leg(urdf, tmp_path / "leg")
    assert not (tmp_path / "leg").exists()
    assert any(what == "leg" and "240 m long" in found for what, found in check_file(urdf))
    urdf.write_text(text.replace("SCALE", 'scale="0.001 0.001 0.001"'), encoding="utf-8")
    assert import_leg(urdf).found.foot_length == pytest.approx(0.24)


def test_nothing_is_written_of_a_leg_that_is_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError):
        import_leg(LEG, tmp_path / "leg", shank="femur")

    def fails(*_: object) -> None:
        raise InputError("cannot be drawn")

    with pytest.raises(InputError, match="cannot be drawn"):
        import_leg(LEG, tmp_path / "leg", picture=fails)
    assert list(tmp_path.iterdir()) == []
    import_leg(LEG, tmp_path / "leg")
    before = (tmp_path / "leg" / "leg.xml").read_bytes()
    with pytest.raises(InputError, match=r"holds leg\.toml"):
        import_leg(LEG, tmp_path / "leg")
    with pytest.raises(InputError, match="is the file that is read"):
        import_leg(tmp_path / "leg" / "leg.xml", tmp_path / "leg", force=True)
    assert (tmp_path / "leg" / "leg.xml").read_bytes() == before


@pytest.mark.parametrize("source", ["seated", "adult_75kg", "walk-dropfoot-afo"])
def test_an_exported_urdf_weighs_what_the_model_does(tmp_path: pathlib.Path, source: str) -> None:
    export_leg(source, tmp_path / "leg.urdf")
    tree = read_tree(tmp_path / "leg.urdf")
    scenario = "seated" if source == "adult_75kg" else source
    sets = {"orthosis.cuff": None} if source == "adult_75kg" else {}
    if source == "adult_75kg":
        model = mujoco.MjModel.from_xml_path(str(LEG))
    else:
        model = build(afo.load("scenario", scenario, sets)).full_model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    dof, foot, shank = (int(model.joint("ankle").dofadr[0]), model.body("foot").id, model.body("shank").id)
    total = sum(part.mass for part in tree.parts.values())
    assert total == pytest.approx(model.body_subtreemass[shank], rel=1e-6)
    numbers = LegNumbers.of(tree)
    assert numbers.foot.mass == pytest.approx(model.body_subtreemass[foot], rel=1e-6)
    assert numbers.about_ankle == pytest.approx(full[dof, dof] - model.dof_armature[dof], rel=1e-6)
    ankle = tree.joints()["ankle"][1]
    assert ankle.damping == pytest.approx(0.5 if source == "adult_75kg" else 2.0 * model.dof_damping[dof])
    np.testing.assert_allclose(ankle.axis, [0, -1, 0])


def test_an_exported_leg_comes_back(tmp_path: pathlib.Path) -> None:
    export_leg("adult_75kg", tmp_path / "leg.urdf")
    back = import_leg(tmp_path / "leg.urdf", tmp_path / "leg").numbers
    there = import_leg(LEG).numbers
    assert back.about_ankle == pytest.approx(there.about_ankle, rel=1e-9)
    np.testing.assert_allclose(back.foot.centre, there.foot.centre, atol=1e-9)
    np.testing.assert_allclose(back.range, there.range, atol=1e-9)


def test_export_refuses_with_names(tmp_path: pathlib.Path) -> None:
    for arguments, words in (
        (("seatd", tmp_path / "a.urdf"), "did you mean 'seated'"),
        (("seated", tmp_path / "a.stl"), "is not a URDF file"),
    ):
        with pytest.raises(InputError, match=words):
            export_leg(*arguments)
    export_leg("adult_75kg", tmp_path / "a.urdf")
    with pytest.raises(InputError, match="is there already"):
        export_leg("adult_75kg", tmp_path / "a.urdf")


@pytest.mark.parametrize("stiffness", [0.0, 0.01])
def test_a_spring_in_the_place_of_tissue_is_told(tmp_path: pathlib.Path, stiffness: float) -> None:
    """A solver's spring of 0.01 N·m/rad leaves the ankle without the tissue's 8 to 40."""
    tree = with_ankle(shipped(), {"stiffness": stiffness})
    write_leg_file(tree, tmp_path / "leg.xml", "leg")
    imported = import_leg(tmp_path / "leg.xml", tmp_path / "out", side="right")
    told = [note for note in imported.notes if note.code == "ankle-spring"]
    assert len(told) == (stiffness > 0.0)
    assert afo.load("leg", str(tmp_path / "out")).passive.scale == (0.0 if stiffness else 1.0)
    bent, straight = (
        (riener_edrich_1999(-0.01, knee) - riener_edrich_1999(0.01, knee)) / 0.02
        for knee in (np.pi / 2.0, 0.0)
    )
    assert (round(bent), round(straight)) == RELAXED  # which the notice names


KNEE_ASIDE = """<mujoco><worldbody><body name="thigh" pos="0 0 1"><freejoint/><geom size=".1" mass="5"/>
<body name="right_shin" pos=".05 0 -.4"><joint name="right_knee" axis="0 1 0" pos=".04 0 0"/>
<inertial pos="0 0 -.2" mass="3" diaginertia=".05 .05 .005"/>
<body name="right_foot" pos="0 0 -.4"><joint name="right_ankle" axis="0 -1 0" range="-50 30"/>
<inertial pos=".05 0 -.03" mass="1" diaginertia=".001 .004 .004"/>
<geom type="box" size=".12 .04 .02" pos=".05 0 -.05" mass="0"/></body></body></body></worldbody></mujoco>"""


def test_a_leg_that_is_written_and_read_again_keeps_its_axes(tmp_path: pathlib.Path) -> None:
    """Its knee lies 40 mm ahead of the shank's own axis, and stays behind: a point tells where it was."""
    (tmp_path / "body.xml").write_text(KNEE_ASIDE, encoding="utf-8")
    first = import_leg(tmp_path / "body.xml", tmp_path / "leg", side="right")
    lean = np.arctan2(0.04, 0.4)
    assert first.leg.parts["shank"].centre == pytest.approx([-0.2 * np.sin(lean), 0.0, 0.2 * np.cos(lean)])
    export_leg(str(tmp_path / "leg"), tmp_path / "leg.urdf")
    for file in (tmp_path / "leg" / "leg.xml", tmp_path / "leg.urdf"):
        again = import_leg(file, side="right")
        for name in ("shank", "foot"):
            assert again.leg.parts[name].centre == pytest.approx(first.leg.parts[name].centre, abs=1e-9)
        assert again.found.shank_length == pytest.approx(first.found.shank_length, abs=1e-9)
        assert again.found.foot_length == pytest.approx(first.found.foot_length, abs=1e-9)


@pytest.mark.parametrize(
    ("shank", "foot", "length", "codes"),
    [
        (1.0, 1.0, 1.0, set()),
        (1.1, 0.9, 0.9, set()),
        (1.2, 1.0, 1.1, {"mass-unlike"}),
        (0.8, 1.0, 1.0, {"mass-unlike"}),
        (1.0, 1.2, 1.0, {"mass-unlike"}),
        (1.0, 0.8, 1.0, {"mass-unlike"}),
        (1.0, 1.0, 1.2, {"height-unlike"}),
        (1.0, 1.0, 0.8, {"height-unlike"}),
    ],
)
def test_a_leg_is_held_against_the_person_by_winters_shares(
    tmp_path: pathlib.Path, shank: float, foot: float, length: float, codes: set[str]
) -> None:
    """Of a person's mass the shank has 0.0465, the foot 0.0145; the shank is 0.246 of the height."""
    long = 0.246 * 1.8 * length
    text = f"""<mujoco><worldbody><body name="thigh" pos="0 0 1"><freejoint/><geom size=".1" mass="5"/>
    <body name="right_shin" pos="0 0 -.4"><joint name="right_knee" axis="0 1 0"/>
    <inertial pos="0 0 -.2" mass="{0.0465 * 80.0 * shank}" diaginertia=".05 .05 .005"/>
    <body name="right_foot" pos="0 0 {-long}"><joint name="right_ankle" axis="0 -1 0" range="-50 30"/>
    <inertial pos=".05 0 -.03" mass="{0.0145 * 80.0 * foot}" diaginertia=".001 .004 .004"/>
    <geom type="box" size=".12 .04 .02" pos=".05 0 -.05" mass="0"/></body></body></body></worldbody>
    </mujoco>"""
    (tmp_path / "body.xml").write_text(text, encoding="utf-8")
    notes = import_leg(tmp_path / "body.xml", body_mass=80.0, body_height=1.8).notes
    told = {note.code: note.data for note in notes if note.code.endswith("-unlike")}
    assert told.keys() == codes
    if "mass-unlike" in told:
        assert told["mass-unlike"]["shank"] == pytest.approx(80.0 * shank)
        assert told["mass-unlike"]["foot"] == pytest.approx(80.0 * foot)
    if "height-unlike" in told:
        assert told["height-unlike"]["shank"] == pytest.approx(1.8 * length)
