"""Muscles over knee and hip, by hand computation: on a whole model and as scenarios; what is refused."""

import dataclasses
import math
import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest
from person import person
from scipy.optimize import brentq

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import Orthosis
from afo_sim.lab import knee_tests, validation_knee
from afo_sim.legs import Attached, write_attached
from afo_sim.legs import read_attached as attached
from afo_sim.model import torque_map as tm
from afo_sim.model.build import build

ARM, HAND = ("shoulder", "elbow"), ("wrist", "finger", "thumb")
MUSCLE = {"knee": "dmsp_10", **dict.fromkeys(("hip", *ARM), "dmsp_20"), **dict.fromkeys(HAND, "dmsp_10")}
LAW = "tondu_lopez_2000"
ENDS = {  # origin and insertion from the joint, forward and up [m]; spacing of each [m]
    "knee": ((-0.06, 0.33), (-0.05, -0.06), (0.02, 0.03)),
    "hip": ((0.07, 0.20), (0.05, -0.26), (0.03, 0.01)),
}
ENDS |= dict.fromkeys(ARM, ENDS["hip"]) | dict.fromkeys(HAND, ((0.03, 0.345), (0.02, -0.045), (0.02, 0.01)))
TWICE = {"segment": "proximal"} | {key: ["0 m", "0 m", "9 cm"] for key in ("from_joint", "from_ankle")}
PLACES = ("origin", "insertion"), ("proximal", "distal")
LINK = {joint: "17 cm" if MUSCLE[joint] == "dmsp_20" else "14.5 cm" for joint in MUSCLE}
CABLE, CUFF = 40e3, 8e3  # [N/m]
RANGE = {
    "knee": (0.0, 38.0),
    **dict.fromkeys(("hip", *ARM), (-5.0, 32.0)),
    **dict.fromkeys(HAND, (-10.0, 30.0)),
}
TURN = dict.fromkeys(MUSCLE, 1.0) | {"knee": -1.0}  # flexion moves the distal segment forward, a knee's back
BAR, BRACKETS = 1e5, 12.9e3  # [Pa], of the shipped knee [N/m]
HIP = """<mujoco><compiler angle="degree"/><worldbody><body name="trunk"><inertial pos="0 0 0" mass="9"
  diaginertia="1 1 1"/><body name="thigh"><inertial pos="0 0 -0.2" mass="6" diaginertia="0.2 0.2 0.02"/>
  <joint name="hip" axis="0 -1 0" range="-30 100" limited="true" stiffness="10" springref="5"/>
  </body></body></worldbody></mujoco>"""


def device(joint: str) -> dict[str, Any]:
    """Two muscles that flex a joint, on a cuff that gives."""
    group: dict[str, Any] = {"count": 2, "type": MUSCLE[joint], "link_length": LINK[joint]}
    for end, segment, (x, z), apart in zip(*PLACES, ENDS[joint][:2], ENDS[joint][2], strict=True):
        group[end] = {"segment": segment, "from_joint": [f"{x} m", "0 m", f"{z} m"], "spacing": f"{apart} m"}
    group["cable"] = {"stiffness": f"{CABLE} N/m"}
    air = {"inlet": "mh1", "outlet": "mh1", "tube_volume": "4 ml", "wall_conductance": "0.4 W/K"}
    return {
        "joint": joint,
        "range_of_motion": [f"{end} deg" for end in RANGE[joint]],
        "anchor": {"proximal": {"stiffness": f"{CUFF} N/m"}},
        "muscle": {"flexor": group},
        "chamber": {"flexor": air},
    }


def geometry(joint: str, angle: float) -> tuple[float, float]:
    """Length and moment arm of one of the two muscles: a straight line to a point that turns [m]."""
    (ox, oz), (ix, iz), spacing = ENDS[joint]
    cos, sin = np.cos(angle), TURN[joint] * np.sin(angle)
    line = np.array([ix * cos - iz * sin - ox, (spacing[1] - spacing[0]) / 2.0, ix * sin + iz * cos - oz])
    moves = TURN[joint] * np.array([-ix * sin - iz * cos, 0.0, ix * cos - iz * sin])
    return float(np.linalg.norm(line)), float(-line @ moves / np.linalg.norm(line))


def torque(joint: str, angle: float, pressure: float, muscle: Any) -> float:
    """Static torque of both muscles: F(κ, p) of the printed law, cable and cuff in series [N·m]."""
    length, arm = geometry(joint, angle)
    alpha, nominal = muscle.braid_angle, muscle.nominal_length
    a, b = 3.0 / np.tan(alpha) ** 2, 1.0 / np.sin(alpha) ** 2
    k = muscle.laws[LAW].parameters["k"]
    room = length - muscle.end_length - float(LINK[joint].removesuffix(" cm")) / 100.0

    def force(kappa: float) -> float:
        return float(np.pi * (muscle.bore / 2.0) ** 2 * pressure * (a * (1.0 - k * kappa) ** 2 - b))

    def gap(kappa: float) -> float:  # two muscles pull on the cuff
        return room - nominal * (1.0 - kappa) - force(kappa) / CABLE - 2.0 * force(kappa) / CUFF

    kappa = brentq(gap, 0.0, (1.0 - np.sqrt(b / a)) / k, xtol=1e-16, rtol=1e-15)
    return 2.0 * arm * force(kappa)


def walker(turned: bool = False) -> str:
    """Two legs; `turned` has all hinges' own coordinates the other way round."""
    way = -1 if turned else 1

    def part(name: str, place: str, mass: float, hinge: str, sign: int, stops: tuple[int, int]) -> str:
        low, high = sorted(way * stop for stop in stops)
        return (
            f'<body name="{name}" pos="{place}"><inertial pos="0.01 0 -0.18" mass="{mass}" '
            f'diaginertia="0.05 0.05 0.01"/><joint name="{hinge}" axis="0 {-sign * way} 0" '
            f'range="{low} {high}" damping="0.6"/>'
        )

    legs = "".join(
        part(f"thigh_{side}", f"0 {y} 0", 7.5, f"hip_{side}", 1, (-30, 110))
        + part(f"shank_{side}", "0 0 -0.43", 3.5, f"knee_{side}", -1, (-5, 130))
        + part(f"foot_{side}", "0 0 -0.42", 1.0, f"ankle_{side}", 1, (-45, 35))
        + '<geom type="box" size="0.12 0.04 0.03" pos="0.05 0 -0.05" contype="0" conaffinity="0"/>'
        + 3 * "</body>"
        for side, y in (("right", -0.09), ("left", 0.09))
    )
    return f"""<mujoco><compiler angle="degree" autolimits="true"/><option timestep="0.001"/><worldbody>
      <body name="pelvis" pos="0 0 1"><inertial pos="0 0 0.1" mass="30" diaginertia="1 1 1"/>{legs}</body>
      </worldbody></mujoco>"""


def worn(joint: str) -> Orthosis:
    found: Orthosis = afo.load("orthosis", device(joint), {"muscle.flexor.type.law": LAW})
    return found


def spec(turned: bool = False) -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(walker(turned))


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("joint", ["knee", "hip"])
def test_torque_over_angle_is_that_of_a_straight_line_and_the_printed_law(joint: str, turned: bool) -> None:
    """1e-9 of the largest torque: own geometry, own force, own root; cable and cuff give."""
    leg = afo.attach(spec(turned), worn(joint), joint=f"{joint}_right")
    assert leg.found.sign == (-1.0 if turned else 1.0) and leg.joints == (f"{joint}_right",)
    check_torque(leg, joint)


def check_torque(leg: Attached, joint: str) -> None:
    """1e-9 of the largest torque, by own geometry, own force and own root."""
    muscle, data = afo.load("muscle", MUSCLE[joint]), leg.data()
    dof = int(leg.model.joint(leg.found.ankle).dofadr[0])
    found, expected = [], []
    for angle in np.radians(np.linspace(*RANGE[joint], 6)):
        for pressure in (2.0 * BAR, 4.0 * BAR):
            data.qpos[leg.model.joint(leg.found.ankle).qposadr[0]] = leg.found.sign * angle
            leg.fill(data, {"flexor": pressure})
            found.append(leg.found.sign * data.qfrc_actuator[dof])
            expected.append(torque(joint, float(angle), pressure, muscle))
    assert min(expected) > 1.0 and np.ptp(expected) > 3.0
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(
    ("joint", "hinge", "crossed"),
    [
        ("hip", "right_hip_pitch", ("right_hip_pitch", "right_hip_roll", "right_hip_yaw")),
        (
            "shoulder",
            "left_shoulder_pitch",
            ("left_shoulder_pitch", "left_shoulder_roll", "left_shoulder_yaw"),
        ),
        ("elbow", "right_elbow", ("right_elbow",)),
        ("wrist", "left_wrist", ("left_wrist_deviation", "left_wrist")),
        ("finger", "right_index_mcp", ("right_index_mcp",)),
        ("thumb", "left_thumb_pip", ("left_thumb_pip",)),
    ],
)
def test_torque_is_the_same_over_arm_and_hand_and_through_three_hinges(
    joint: str, hinge: str, crossed: tuple[str, ...], way: int
) -> None:
    """The same straight line on a person, from the body above all hinges of a joint to that below them."""
    leg = afo.attach(mujoco.MjSpec.from_string(person(way=way)), worn(joint), joint=hinge)
    assert (leg.found.sign, leg.joints) == (way, crossed)
    check_torque(leg, joint)


def test_a_valve_moves_its_own_joint_and_keeps_the_air() -> None:
    """Hip, knee and ankle of the right leg, and the left knee, on one model; m(t) − m(0) = ∫ ṁ dt of each."""
    model: mujoco.MjSpec | Attached = spec()
    for joint, side in (("hip", "right"), ("knee", "right"), ("knee", "left"), ("ankle", "right")):
        orthosis = "s1" if joint == "ankle" else worn(joint)
        model = afo.attach(model, orthosis, joint=f"{joint}_{side}", prefix=f"{joint}_{side}_")
    legs = model.legs  # type: ignore[union-attr]
    assert len(legs) == 4 and {leg.model for leg in legs.values()} == {legs["hip_right_"].model}
    data = legs["hip_right_"].data()
    start = {prefix: leg.air(data) for prefix, leg in legs.items()}
    legs["hip_right_"].set_valves(data, flexor="inlet")
    legs["knee_left_"].set_valves(data, flexor="inlet")
    taken = dict.fromkeys(("hip_right_", "knee_left_"), 0.0)
    with legs["hip_right_"].callbacks():
        for _ in range(1500):
            mujoco.mj_step(legs["hip_right_"].model, data)
            for prefix in taken:
                flow = legs[prefix].flow(data)
                taken[prefix] += (flow["flexor_inlet"] - flow["flexor_outlet"]) * 1e-3
    for prefix, leg in legs.items():
        gained = sum(leg.air(data).values()) - sum(start[prefix].values())
        assert gained == pytest.approx(taken.get(prefix, 0.0), rel=1e-9, abs=1e-15)
        assert (max(leg.pressure(data).values()) > 0.2 * BAR) == (prefix in taken)
    assert legs["hip_right_"].angle(data) > 0.1 and legs["knee_left_"].angle(data) > 0.1
    assert legs["knee_left_"].cuff_force(data)["proximal"] > 50.0
    assert legs["knee_left_"].displacement(data)["proximal"] > 5e-3


def test_the_shipped_knee_moves_as_in_its_scenario() -> None:
    """The same valves on `attach` and on a run; damping of MuJoCo's alone."""
    run = afo.run("knee", {"leg.damping": "0 N*m*s/rad", "duration": "2 s"})
    leg = afo.attach("pin_knee", "pin_knee", supply="6.05 bar", timestep="1 ms")
    leg.model.opt.gravity[2] = afo.build("knee").model.opt.gravity[2]
    data, angles = leg.data(run["knee/angle"][:1]), []
    leg.set_valves(data, flexor="inlet")
    with leg.callbacks():
        for _ in run["time"]:
            angles.append(leg.angle(data))
            mujoco.mj_step(leg.model, data)
    assert np.ptp(angles) > 0.5
    assert angles == pytest.approx(list(run["knee/angle"]), abs=1e-9)


def test_files_keep_the_joint(tmp_path: pathlib.Path) -> None:
    leg = afo.attach(spec(True), worn("knee"), joint="knee_left", distal="foot_left")
    assert leg.joints == ("knee_left", "ankle_left")  # one hangs on another body's hinge too
    write_attached(leg, tmp_path / "worn.xml")
    again = attached(tmp_path / "worn.xml")
    assert again.bodies == {"proximal": "thigh_left", "distal": "foot_left"}
    assert again.found.sign == leg.found.sign and again.orthosis.joint == "knee"


@pytest.mark.parametrize(
    ("orthosis", "how", "field", "words"),
    [
        ("s1", {"joint": "knee_right"}, "orthosis", "'s1'.* is for an ankle, .* is a knee by its name"),
        ("knee", {"joint": "hip_right"}, "orthosis", "is for a knee, .* is a hip by its name"),
        ("knee", {}, "joint", "is needed: the orthosis is for a knee; allowed: knee_right, knee_left"),
        ("knee", {"joint": "knee"}, "joint", "there is no such hinge.*knee_right"),
        ("knee", {"joint": "knee_right", "proximal": "foot_right"}, "proximal", "not above the hinge"),
        ("knee", {"joint": "knee_right", "distal": "pelvis"}, "distal", "does not hang on 'shank_right'"),
        ("knee", {"joint": "knee_right", "zero": 7.0}, "zero", "within a turn"),
        ("knee", {"joint": "knee_right", "sign": 2.0}, "sign", "1 or -1"),
        ("knee", {"joint": "knee_right", "side": "rigth"}, "side", "right, left"),
        ("s1", {"joint": "ankle_right", "sign": 1.0}, "sign", "follows from the foot"),
    ],
)
def test_a_wrong_joint_is_refused_by_name(orthosis: str, how: dict, field: str, words: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match=words) as error:
        afo.attach(spec(), orthosis if orthosis == "s1" else worn(orthosis), **how)
    assert error.value.field == field


def test_a_side_finds_the_one_knee_and_a_sign_against_the_body_is_noticed() -> None:
    assert afo.attach(spec(), worn("knee"), side="left").found.ankle == "knee_left"
    notices = afo.attach(spec(), worn("knee"), joint="knee_left", sign=-1).notices
    (against,) = [notice for notice in notices if notice.code == "sign-contradicted"]
    assert against.data["against"] == "left and right of the body and its own fold"
    notices = afo.attach(spec(), worn("knee"), joint="knee_left", side="right").notices
    (other,) = [notice for notice in notices if notice.code == "side-contradicted"]
    assert (other.data["named"], other.data["given"]) == ("left", "right")


def hip(folder: pathlib.Path, **sets: Any) -> Any:
    """A scenario of a hip with a spring and two muscles."""
    (folder / "leg.xml").write_text(HIP)
    leg = {"file": str(folder / "leg.xml"), "joint": "hip", "proximal": "trunk", "distal": "thigh"}
    table = {"name": "hip", "duration": "4 s", "leg": leg | {"hinge": "hip", "damping": "0.5 N*m*s/rad"}}
    table |= {"orthosis": device("hip"), "supply": {"pressure": "4 bar"}}
    timer = {"period": "4 s", "flexor": {"inlet": [["0 s", "2 s"]], "outlet": [["2 s", "4 s"]]}}
    return afo.load("scenario", table | {"timer": timer}, sets)


def test_a_knee_that_is_bent_at_the_angle_zero_is_reported() -> None:
    def bent(zero: float) -> list[float]:
        notices = afo.attach(spec(), worn("knee"), joint="knee_left", zero=math.radians(zero)).notices
        return [notice.data["bent"] for notice in notices if notice.code == "limb-bent"]

    # the centre of mass of the thigh lies 10 mm ahead of the line from hip to knee
    assert bent(0.0) == [] and bent(45.0) == pytest.approx([45.0], abs=3.0)


def test_the_maps_torque_is_that_of_a_second_geometry() -> None:
    angles, pressures = np.radians(np.linspace(10.0, 60.0, 6)), np.array([5e5, 6e5])
    (found,) = tm.torque_map(build("knee"), angles, pressures)
    at: dict[str, Any] = {"angle": -np.repeat(angles, 2), "pressure": np.tile(pressures, 6)}
    knee = dataclasses.replace(knee_tests()["48"], **at)  # extension is positive there
    expected = -validation_knee.torque(knee, BRACKETS).reshape(6, 2)
    assert expected.min() > 1.0
    assert found.torque == pytest.approx(expected, rel=1e-9)
    assert found.joint == "knee"


@pytest.mark.slow
def test_the_knee_is_told_as_a_knee(tmp_path: pathlib.Path) -> None:
    run = afo.run("knee")
    assert run.ok and run.warnings == ()
    assert not any("dorsi" in name or "plantar" in name for name in run.metrics)
    assert run["knee/angle"] is run["joint/angle"] is run["ankle/angle"]
    signs = {name: run.describe(name)[1] for name in run.columns}
    assert signs["ankle/angle"] == run.describe("knee/angle")[1] == "flexion positive"
    assert not any("dorsiflexion" in sign or "foot" in sign for sign in signs.values())
    afo.report(run, tmp_path / "knee.html")
    text = (tmp_path / "knee.html").read_text(encoding="utf-8")
    assert "thigh fixed" in text and "knee angle" in text and "dorsiflexion" not in text


@pytest.mark.parametrize("joint", ["knee", "hip"])
def test_air_and_energy_balance_and_half_the_step_gives_the_same(joint: str, tmp_path: pathlib.Path) -> None:
    scenario = afo.load("scenario", "knee") if joint == "knee" else hip(tmp_path)
    run, fine = afo.run(scenario), afo.run(scenario.set({"timestep": "0.5 ms"}))
    left, of_fine = (abs(each.metrics["energy_error"].value) for each in (run, fine))
    assert 3.0 * of_fine < left < 5e-5  # [%], of second order; an ankle's, seated at 1 ms, is 2e-5
    flow = run["valve/flexor_inlet/mass_flow"] - run["valve/flexor_outlet/mass_flow"]
    mass = run["chamber/flexor/mass"]
    assert mass[1:] - mass[0] == pytest.approx(np.cumsum(flow[:-1]) * scenario.timestep, abs=1e-12)
    rows = np.interp(run["time"], fine["time"], fine["joint/angle"])
    assert np.degrees(np.abs(run["joint/angle"] - rows)).max() < 0.01
    assert np.degrees(np.ptp(rows)) > 8.0
    if joint == "hip":  # its file's spring, and its damping at the middle of a step
        expected = -10.0 * (run["joint/angle"] - math.radians(5.0)) - 0.5 * run["joint/velocity"]
        slow = np.abs(run["joint/velocity"]) < 0.5
        assert run["joint/moment/passive"][slow] == pytest.approx(expected[slow], abs=0.02)


def test_a_pid_holds_the_knee() -> None:
    """A valve fills as an integral does, so that a proportional part alone leaves no error."""
    pid = {"raises": "flexor", "angle": {"proportional_band": "60 deg", "reference": {"mean": "25 deg"}}}
    run = afo.run("knee", {"timer": None, "controller": {"rate": "100 Hz", "pid": pid}})
    assert np.degrees(run["knee/angle"][run["time"] > 12.0]) == pytest.approx(25.0, abs=0.5)


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ({"orthosis": "s1"}, "joint: is for an ankle, and the leg's joint is a knee"),
        (
            {"leg": "adult_75kg", "shank.knee_angle": "0 deg"},
            "is for a knee, and the leg's joint is an ankle",
        ),
        ({"orthosis.muscle.flexor.origin.segment": "shank"}, "'shank' is not a segment of a knee.*proximal"),
        ({"orthosis.joint": "ankle"}, "'proximal' is not a segment of an ankle.*shank or foot"),
        ({"leg.passive.scale": 1.0}, "leg.passive.scale.*tissue of an ankle, and this is a knee"),
        ({"leg.joint": "kneee"}, r"^leg.joint = 'kneee': is not a valid choice; .*mean 'knee'\?$"),
        ({"orthosis.muscle.flexor.origin": TWICE}, "from_ankle.*is a synonym of from_joint, which"),
        ({"leg.directions": ["up"]}, r"^leg.directions.1: is missing$"),
        ({"leg.joint": "hip", "orthosis.joint": "hip"}, 'axis is not axis="0 -1 0", about which flexion'),
    ],
)
def test_what_does_not_go_with_a_knee_is_refused(sets: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        build(afo.load("scenario", "knee", sets))
