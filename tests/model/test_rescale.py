"""An orthosis on a leg of another size: the same leg, a similar one, and back again."""

import math
import pathlib

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim.common import InputError
from afo_sim.description import Orthosis, load
from afo_sim.model import Ratio, fits, lengths_of, paths_of, write_rescaled
from afo_sim.model.leg import lengthen
from afo_sim.model.rescale import refit

ROLLER = {"segment": "shank", "from_joint": ["4.5 cm", "0 cm", "5 cm"], "surface": {"radius": "2 cm"}}


def s1(**sets: object) -> Orthosis:
    return load("orthosis", "s1", {key.replace("__", "."): value for key, value in sets.items()})


def guided() -> Orthosis:
    return load("orthosis", "s1", {"muscle.dorsiflexor.path": [ROLLER]})


def lengthened(orthosis: Orthosis, taller: float) -> mujoco.MjModel:
    """Shank, foot and the muscles' ends as sites of a leg, which the simulator's own similarity scales."""
    spec = mujoco.MjSpec()
    shank = spec.worldbody.add_body(name="shank")
    foot = shank.add_body(name="foot", mass=1.0, inertia=[1.0, 1.0, 1.0])
    foot.explicitinertial = True
    foot.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, -1.0, 0.0])
    for name, group in orthosis.anchored.items():
        tendon = spec.add_tendon(name=name)
        for anchor in (group.origin, group.insertion):
            body = shank if anchor.segment == "shank" else foot
            site = body.add_site(name=f"{name}_{anchor.segment}", pos=list(anchor.from_joint))
            tendon.wrap_site(site.name)
    lengthen(spec, taller)
    return spec.compile()


@pytest.mark.parametrize("name", ["s1", "s1_short_links", "arm"])
def test_the_same_leg_has_the_same_orthosis(name: str) -> None:
    orthosis = load("orthosis", name)
    assert refit(orthosis, 1.0, 1.0) == orthosis


@pytest.mark.parametrize("taller", [0.8, 1.15])
@pytest.mark.parametrize("angle", [-0.3, 0.0, 0.3])
def test_on_a_similar_leg_moment_arms_go_with_its_length(taller: float, angle: float) -> None:
    """Against the simulator's own similarity of bodies (`lengthen`), computed by MuJoCo here."""
    orthosis = s1()
    model = lengthened(orthosis, taller)
    data = mujoco.MjData(model)
    data.qpos[0] = angle
    mujoco.mj_fwdPosition(model, data)
    dense = np.zeros((model.ntendon, 1))
    mujoco.mju_sparse2dense(
        dense, data.ten_J.reshape(-1), model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind.reshape(-1)
    )
    paths = paths_of(refit(orthosis, taller, taller))
    arms = dict(zip(paths.tendons, paths.moment_arms(np.array([angle]))[0], strict=True))
    before = paths_of(orthosis)
    own = dict(zip(before.tendons, before.moment_arms(np.array([angle]))[0], strict=True))
    for k, name in enumerate(orthosis.anchored):
        assert arms[f"{name}_1"] == pytest.approx(-dense[k, 0], rel=1e-12)
        assert arms[f"{name}_1"] == pytest.approx(taller * own[f"{name}_1"], rel=1e-12)


@pytest.mark.parametrize("made", [s1, guided])
@pytest.mark.parametrize("ratios", [(0.8, 0.8), (0.9, 1.1), (1.2, 1.0)])
def test_at_angle_zero_contraction_stays(made: type, ratios: tuple[float, float]) -> None:
    """κ = 1 − (L − l)/L0 of each muscle, from the paths that MuJoCo lays, before and after."""
    orthosis = made()
    after = refit(orthosis, *ratios)

    def contraction(of: Orthosis) -> np.ndarray:
        paths = paths_of(of)
        groups = [of.muscle[name.rsplit("_", 1)[0]] for name in paths.tendons]
        hardware = np.array([group.series_length for group in groups])
        nominal = np.array([group.type.nominal_length for group in groups])
        return 1.0 - (paths.lengths(np.zeros(1))[0] - hardware) / nominal

    assert contraction(after) == pytest.approx(contraction(orthosis), abs=1e-9)
    assert after.muscle["dorsiflexor"].type == orthosis.muscle["dorsiflexor"].type


def test_there_and_back_again() -> None:
    """Coordinates come back; what is scaled says that it is derived."""
    there = refit(guided(), 0.8, 0.7)
    back = refit(there, 1.0 / 0.8, 1.0 / 0.7)
    for name, group in guided().anchored.items():
        found = back.muscle[name]
        assert found.link_length == pytest.approx(group.link_length, abs=1e-12)
        for end in ("origin", "insertion"):
            assert getattr(found, end).from_joint == pytest.approx(getattr(group, end).from_joint, abs=1e-15)
            assert getattr(found, end).provenance["from_joint"].kind == "derived"
            assert getattr(found, end).spacing == getattr(group, end).spacing
    roller = there.muscle["dorsiflexor"].path[0]
    assert roller.surface is not None and roller.surface.radius == pytest.approx(0.8 * 0.02)


def test_a_pulley_stays() -> None:
    assert refit(load("orthosis", "arm"), 0.8, 0.8).muscle == load("orthosis", "arm").muscle


def test_a_muscle_longer_than_its_path_is_refused() -> None:
    """At half the size the path is 15.5 cm, the muscle alone 21.5 cm."""
    with pytest.raises(InputError, match=r"path is 15.5 cm.*a shorter muscle"):
        refit(s1(), 0.5, 0.5)


@pytest.mark.parametrize("ratio", [0.0, -1.0, float("nan"), float("inf"), 100.0])
def test_an_impossible_ratio_is_refused(ratio: float) -> None:
    with pytest.raises(InputError, match=r"foot = .*out of range"):
        refit(s1(), 1.0, ratio)


def test_lengths_are_the_legs_own_or_winters() -> None:
    """Winter 2009, fig. 4.1: shank 0.285 − 0.039 = 0.246 H, foot 0.152 H."""
    assert lengths_of(load("leg", "adult_75kg")) == pytest.approx((0.246 * 1.75, 0.152 * 1.75))
    own = load("leg", "adult_75kg", {"shank_length": "35 cm", "foot_length": "22 cm"})
    assert lengths_of(own) == pytest.approx((0.35, 0.22))


@pytest.mark.parametrize("taller", [1.0, 1.2])
def test_a_fit_is_that_of_straight_lines_between_the_anchors(taller: float) -> None:
    """S1's paths have no points: L(θ) = |R(θ) b − a|, κ(θ) = 1 − (L − l)/L0, taut where κ = 0.

    At its own size its links are taut at −15.5 and 30 deg, as its file's comments derive.
    """
    orthosis = refit(s1(muscle__dorsiflexor__count=1), taller, taller)
    group, found = orthosis.muscle["dorsiflexor"], fits(orthosis)["dorsiflexor"]
    (x1, _, z1), (x2, _, z2) = group.origin.from_joint, group.insertion.from_joint

    def contraction(angle: float) -> float:
        c, s = math.cos(angle), math.sin(angle)  # toe up turns forward to upward
        length = math.hypot(c * x2 - s * z2 - x1, s * x2 + c * z2 - z1)
        return 1.0 - (length - group.series_length) / group.type.nominal_length

    low, high = orthosis.range_of_motion
    assert found.contraction == pytest.approx((contraction(low), contraction(high)), rel=1e-9)
    assert found.taut == pytest.approx(brentq(contraction, -1.0, 1.0), abs=1e-6)
    slope = (contraction(1e-5) - contraction(-1e-5)) / 2e-5
    assert found.arm == pytest.approx(slope * group.type.nominal_length, rel=1e-6)
    if taller == 1.0:
        told = [np.degrees(each.taut) for each in fits(orthosis).values()]
        assert told[0] == pytest.approx(-15.5, abs=0.1)
        assert told[1] == pytest.approx(30.0, abs=0.5)


def test_a_file_says_the_same_and_keeps_its_comments(tmp_path: pathlib.Path) -> None:
    by = Ratio(0.8, 0.9, "from one leg to another")
    found = write_rescaled("s1", by, tmp_path / "mine")
    text = (tmp_path / "mine/orthosis.toml").read_text(encoding="utf-8")
    assert "# S1: three in front of the shin" in text and 'kind = "derived"' in text
    read = load("orthosis", tmp_path / "mine")
    for name, group in found.muscle.items():
        assert read.muscle[name].link_length == pytest.approx(group.link_length, abs=1e-12)
        for end in ("origin", "insertion"):
            one, other = getattr(read.muscle[name], end), getattr(group, end)
            assert one.from_joint == pytest.approx(other.from_joint, abs=1e-12)
            assert one.provenance == other.provenance
    assert read.cuff is not None and read.cuff.is_file()
    with pytest.raises(InputError, match="--force"):
        write_rescaled("s1", by, tmp_path / "mine")
    with pytest.raises(InputError, match="another folder"):
        write_rescaled(tmp_path / "mine", by, tmp_path / "mine", force=True)
    write_rescaled(pathlib.Path(__file__).parents[1] / "former/0.1/own/my-orthosis", by, tmp_path / "now")
    assert "from_ankle" not in (tmp_path / "now/orthosis.toml").read_text(encoding="utf-8")


def test_own_cuff_muscle_and_valve_are_found_from_the_new_folder(tmp_path: pathlib.Path) -> None:
    own = tmp_path / "own"
    (own / "valves").mkdir(parents=True)
    shipped = pathlib.Path(str(load("orthosis", "s1").cuff))
    for name in ("cuff.xml", "plate.xml"):
        (own / name).write_bytes((shipped.parent / name).read_bytes())
    valve = (shipped.parents[2] / "valves/mh1/valve.toml").read_text(encoding="utf-8")
    (own / "valves/valve.toml").write_text(valve, encoding="utf-8")
    text = (shipped.parent / "orthosis.toml").read_text(encoding="utf-8")
    (own / "orthosis.toml").write_text(
        text.replace('outlet = "mh1"', 'outlet = "./valves"'), encoding="utf-8"
    )
    write_rescaled(own, Ratio(0.9, 0.9), tmp_path / "a/b/mine")
    read = load("orthosis", tmp_path / "a/b/mine")
    assert read.cuff is not None and read.cuff.is_relative_to((tmp_path / "a/b/mine").resolve())
    assert read.chamber["dorsiflexor"].outlet.conductance == load("valve", "mh1").conductance


def test_the_same_leg_is_the_same_file(tmp_path: pathlib.Path) -> None:
    write_rescaled("s1_short_links", Ratio(), tmp_path / "mine")
    read, own = load("orthosis", tmp_path / "mine"), load("orthosis", "s1_short_links")
    assert read.model_copy(update={"name": own.name}) == own
