"""Model files that MuJoCo would take without end, or whose numbers are none: one message, and no waiting."""

import pathlib
import shutil

import pytest

from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import InputError, assets
from afo_sim.legs import read_tree
from afo_sim.model import examine

LEG = assets.find("leg", "adult_75kg").with_name("leg.xml").read_text("utf-8")
BODY = '<body name="a"><geom size="1"/><joint/></body>'
GRID = '<flexcomp name="f" type="grid" count="100 100 1" spacing="1 1 1"/>'


def copies(*counts: int) -> str:
    """A body in replicates of replicates."""
    return "".join(f'<replicate count="{n}">' for n in counts) + BODY + "</replicate>" * len(counts)


def model(text: str) -> str:
    return f"<mujoco><worldbody>{text}</worldbody></mujoco>"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (model(copies(3000, 3000)), "replicate: has too many elements"),
        (model(copies(80, 80)), "body: has too many bodies; allowed: at most 3000"),
        (model(GRID), "flexcomp: has too many bodies"),
        (model("<geom/>" * 30_001), "geom: has too many elements"),
        (model("<body>" * 300 + "</body>" * 300), "body: has too many elements in each other"),
        ('<mujoco><asset><hfield nrow="100000"/></asset></mujoco>', "hfield> nrow = '100000': is too many"),
        ('<mujoco><size nuser_body="99999999"/></mujoco>', "is too many; allowed: at most 1000"),
        (
            '<mujoco><include file="/dev/zero"/></mujoco>',
            "/dev/zero: cannot be read: it is a pipe or a device",
        ),
        ('<mujoco><asset><mesh file="/dev/zero"/></asset></mujoco>', "/dev/zero: cannot be read"),
        ('<mujoco><include file="."/></mujoco>', "it is a folder"),
        (LEG.replace('pos="0 0 0.2444"', 'pos="0 0 inf"'), "<inertial> pos = inf: is not a finite number"),
        (LEG.replace('mass="0.929"', 'mass="1e308"'), r"mass = 1e\+308: is not a magnitude"),
        (LEG.replace('fromto="0 0 0.02', 'fromto="0 0 nan'), "fromto = nan: is not a finite number"),
    ],
    ids=range(13),
)
def test_what_mujoco_would_take_without_end_is_one_message(
    text: str, words: str, tmp_path: pathlib.Path
) -> None:
    file = tmp_path / "leg.xml"
    file.write_text(text)
    for read in (examine, read_tree, check_file):
        with pytest.raises(InputError, match=words):
            read(file)


def test_a_leg_that_a_description_names_is_examined_too(tmp_path: pathlib.Path) -> None:
    shutil.copy(assets.find("leg", "adult_75kg"), tmp_path / "leg.toml")
    (tmp_path / "leg.xml").write_text(LEG.replace('pos="0 0 0.2444"', 'pos="0 0 inf"'))
    with pytest.raises(InputError, match=r"leg.xml: <inertial> pos = inf: is not a finite number"):
        check_file(tmp_path / "leg.toml")


def test_a_model_may_include_what_lies_elsewhere(tmp_path: pathlib.Path) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "piece.xml").write_text(f"<mujocoinclude>{BODY}</mujocoinclude>")
    file = tmp_path / "below" / "leg.xml"
    file.write_text(model('<include file="../piece.xml"/>'))
    assert list(read_tree(file).parts) == ["a"]
    (tmp_path / "piece.xml").write_text(f"<mujocoinclude>{copies(80, 80)}</mujocoinclude>")
    with pytest.raises(InputError, match=r"piece.xml: body: has too many bodies"):
        examine(file)
