"""Parts without mass or inertia, as MuJoCo can move them."""

import mujoco
import numpy as np
import pytest
from urdf_texts import BODY, INERTIA, joint, link, robot

from afo_sim.legs.massless import movable
from afo_sim.legs.mjcf_out import spec_of
from afo_sim.legs.urdf import read_urdf

NOTHING = '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>'


def test_a_joint_that_moves_nothing_is_stiff_and_others_keep_their_inertia(tmp_path) -> None:
    """Of a point of 2 kg on a massless gimbal, 0.1 m beside one axis and 0.2 m beside the other."""
    links = (
        link("pelvis") + link("gimbal", "") + link("foot", BODY.replace(INERTIA, NOTHING)) + link("tip", "")
    )
    joints = joint("continuous", '<axis xyz="0 0 1"/>', name="z", parent="pelvis", child="gimbal")
    joints += joint("continuous", '<axis xyz="1 0 0"/>', name="x", parent="gimbal", child="foot")
    joints += joint("continuous", name="idle", parent="foot", child="tip")
    file = tmp_path / "hip.urdf"
    file.write_text(robot(links + joints))
    tree = movable(read_urdf(file))
    assert [note.code for note in tree.notes[-2:]] == ["joints-idle", "inertias-raised"]
    model = spec_of(tree).compile()
    assert [model.joint(k).name for k in range(model.njnt)] == ["z", "x"]
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, full)
    assert full[0, 0] == pytest.approx(2 * 0.1**2, rel=1e-9)
    assert full[1, 1] == pytest.approx(2 * 0.2**2, rel=1e-9)
