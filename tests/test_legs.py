"""S1's orthosis on five legs: what is equal stays equal, and what differs follows from masses and stops."""

import pathlib
import re
from typing import Any

import mujoco
import numpy as np
import other_legs as table
import pytest

import afo_sim as afo
from afo_sim import native
from afo_sim.common import GRAVITY
from afo_sim.model.build import build

# From plate.xml and the muscle s1_215mm: the plate, and halves of five muscles of 80 g at their insertions.
PLATE = (0.55, 0.037272727, -0.067090909)


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return table.worn("shipped", "adult_75kg", table.shipped(), tmp_path_factory.mktemp("shipped"))


OTHERS = (
    "out to URDF and in again",
    "dm_control's humanoid",
    "musculoskeletal (MuscleMimic)",
    "a robot's, URDF",
)


@pytest.fixture(scope="module", params=OTHERS)
def row(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("leg")
    imported = table.LEGS[request.param](folder)
    if imported is None:
        pytest.skip(f"the package of {request.param} is not installed")
    table.with_same_tissue(imported.folder / "leg.xml")
    return table.worn(request.param, imported.folder, imported.numbers, folder)


@pytest.mark.slow
def test_anchors_are_the_same_on_every_leg(row: Any, shipped: Any) -> None:
    """They are measured from the ankle: so all moment arms are those of the shipped leg."""
    assert len(row.arms) == 5
    assert row.arms == pytest.approx(shipped.arms, abs=1e-6)
    x = np.array([0.06, 0.30]), np.array([0.065, -0.01])  # S1's origin and insertion in front
    along = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
    assert row.arms[0] == pytest.approx(abs(x[1][0] * along[1] - x[1][1] * along[0]), abs=1e-6)


def test_angles_differ_by_what_mass_and_stops_explain(row: Any, shipped: Any) -> None:
    """The shipped leg with this leg's foot and stops runs alike: nothing else of the file matters."""
    assert row.apart < 1e-6
    assert shipped.apart < 1e-6


def test_the_weight_at_rest_is_that_of_foot_plate_and_muscles(row: Any) -> None:
    """M = −g Σ m (x cos θ − z sin θ), by hand."""
    angle = float(row.run["ankle/angle"][0])
    foot, orthosis = row.numbers.foot, afo.load("orthosis", "s1")
    parts = [(foot.mass, foot.centre[0], foot.centre[2]), PLATE]
    for group in orthosis.muscle.values():
        assert group.insertion is not None
        x, _, z = group.insertion.from_joint
        parts.append((group.count * group.type.mass / 2.0, x, z))
    by_hand = -GRAVITY * sum(m * (x * np.cos(angle) - z * np.sin(angle)) for m, x, z in parts)
    assert row.run["ankle/moment/gravity"][0] == pytest.approx(by_hand, rel=1e-6)


def test_a_heavier_foot_hangs_lower(row: Any, shipped: Any) -> None:
    """The foot's weight ahead of the ankle holds against the same tissue: with less the foot rests higher."""

    def ahead(found: Any) -> float:
        return float(found.numbers.foot.mass * found.numbers.foot.centre[0])

    rests = [float(each.run["ankle/angle"][0]) for each in (row, shipped)]
    if ahead(row) == pytest.approx(ahead(shipped), rel=1e-6):
        assert rests[0] == pytest.approx(rests[1], abs=1e-6)
    else:
        assert (rests[0] > rests[1]) == (ahead(row) < ahead(shipped))


def swing(leg: str | pathlib.Path, same: dict[str, Any]) -> np.ndarray:
    """Angle of a bare foot let go at 0.2 rad, over a second."""
    bare = {"duration": "1 s", "timestep": "2 ms", "leg": str(leg), "orthosis": "none"}
    fixed = {"supply": {"pressure": "4 bar"}, "shank": {"pose": "fixed", "knee_angle": "90 deg"}}
    built = build(afo.load("scenario", bare | fixed, same))
    model, data = built.full_model, mujoco.MjData(built.full_model)
    data.qpos[built.index.ankle_qpos] = 0.2
    found = []
    with native.installed():
        for _ in range(500):
            mujoco.mj_step(model, data)
            found.append(float(data.qpos[built.index.ankle_qpos]))
    return np.array(found)


def test_out_to_urdf_and_in_again_is_the_same_leg(tmp_path: pathlib.Path) -> None:
    own, again = table.shipped(), table.out_and_in(tmp_path)
    for segment in ("shank", "foot"):
        one, other = getattr(again.numbers, segment), getattr(own, segment)
        assert one.mass == pytest.approx(other.mass, rel=1e-6)
        assert one.centre == pytest.approx(other.centre, abs=1e-6)
        assert one.inertia == pytest.approx(other.inertia, rel=1e-6, abs=1e-9)
    before, after = (swing(leg, table.SAME) for leg in ("adult_75kg", again.folder))
    assert np.ptp(before) > 0.1  # it does swing
    assert after == pytest.approx(before, abs=1e-6)


def test_the_same_leg_gives_the_same_run(shipped: Any, tmp_path: pathlib.Path) -> None:
    """Whatever an imported leg's file says of inertia, the muscles' ends keep their mass."""
    again = table.out_and_in(tmp_path)
    run = table.seated(again.folder)
    assert run["ankle/angle"] == pytest.approx(shipped.run["ankle/angle"], abs=1e-6)


@pytest.mark.parametrize("rule", ["true", "false", "auto"])
def test_a_legs_rule_for_inertia_does_not_reach_the_orthosis(rule: str, tmp_path: pathlib.Path) -> None:
    text = (pathlib.Path(str(afo.load("leg", "adult_75kg").file))).read_text(encoding="utf-8")
    text = text.replace("<compiler ", f'<compiler inertiafromgeom="{rule}" ')
    text = re.sub(r'<joint name="toe".*?/>', "", text)
    (tmp_path / "leg.xml").write_text(text, encoding="utf-8")
    (tmp_path / "leg.toml").write_text('file = "leg.xml"\ndamping = "0.5 N*m*s/rad"\n', encoding="utf-8")
    model = build(afo.load("scenario", "seated", {"leg": str(tmp_path)})).full_model
    own = build(afo.load("scenario", "seated")).full_model
    bare = mujoco.MjModel.from_xml_string(text)
    for name in ("plate_plate", "cuff_cuff", "foot_anchors", "shank_anchors"):
        assert model.body(name).mass == pytest.approx(own.body(name).mass, rel=1e-12)
        assert model.body(name).inertia == pytest.approx(own.body(name).inertia, rel=1e-12)
    for name in ("shank", "foot", "toes"):  # and of the leg's own bodies the file's rule holds
        assert model.body(name).mass == pytest.approx(bare.body(name).mass, rel=1e-12)
