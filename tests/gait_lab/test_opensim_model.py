"""OpenSim models: small ones that the test wrote, against kinematics that it works out itself."""

import numpy as np
import pytest
from osim_text import LAYOUTS, Part, document, linear, version_3, version_4, walker, write
from scipy.spatial.transform import Rotation

from afo_sim.common import InputError
from afo_sim.gait_lab.readers import opensim_model
from afo_sim.gait_lab.readers.opensim_model import read_opensim_model

ANY = (0.0, -3.0, 3.0)
X = "-2.0944 -1.2 -0.5 -0.3 -0.1 0.16 2.09"
Y = "-0.48 -0.46 -0.45 -0.44 -0.47 -0.45 -0.4"
KNOTS, HEIGHTS = np.array(X.split(), float), np.array(Y.split(), float)


def one_joint(tmp_path, function: str, kind: str = "rotation1", layout=version_4):
    """A body that one function of q turns or moves."""
    part = Part(
        "b", "ground", "CustomJoint", coordinates={"q": ANY}, axes={kind: ("q", (0.0, 0.0, 2.0), function)}
    )
    return read_opensim_model(write(tmp_path / "small.osim", layout([part], {})))


def values_of(tmp_path, function: str, q: np.ndarray, layout=version_4) -> np.ndarray:
    """A function as the reader evaluates it, seen as a way along z."""
    return one_joint(tmp_path, function, "translation1", layout).pose("ground", "b", {"q": q}).position[:, 2]


def curve(kind: str, x: str = X, y: str = Y) -> str:
    return f"<{kind}><x>{x}</x><y>{y}</y></{kind}>"


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_bodies_mass_and_markers(tmp_path, layout):
    model = read_opensim_model(write(tmp_path / "walker.osim", layout(*walker())))
    assert model.name == "small"
    assert model.mass == pytest.approx(10.0 + 2 * 5.0)
    body, place = model.markers["L.Knee.Lat"]
    assert body == "femur_l"
    np.testing.assert_array_equal(place, [0.0, -0.42, -0.06])


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_offset_frames_on_both_sides_of_a_joint(tmp_path, layout):
    """One after the other: the frame on the parent, a turn about z, the frame on the child backward."""
    at, turned, on, back = (0.1, 0.2, -0.1), (0.3, -0.2, 0.5), (0.05, -0.02, 0.1), (-0.4, 0.1, 0.2)
    part = Part("b", "ground", at=at, turned=turned, on_child=on, child_turned=back, coordinates={"q": ANY})
    model = read_opensim_model(write(tmp_path / "pin.osim", layout([part], {})))
    angles = np.linspace(-2.0, 2.0, 5)
    found = model.pose("ground", "b", {"q": angles})
    for k, angle in enumerate(angles):
        turn = Rotation.from_euler("XYZ", turned) * Rotation.from_euler("z", angle)
        turn = turn * Rotation.from_euler("XYZ", back).inv()
        np.testing.assert_allclose(found.rotation[k], turn.as_matrix(), atol=1e-14)
        np.testing.assert_allclose(found.position[k], np.array(at) - turn.apply(on), atol=1e-14)


@pytest.mark.parametrize(
    ("kind", "turns", "ways"),
    [
        ("WeldJoint", "", ""),
        ("PinJoint", "Z", ""),
        ("SliderJoint", "", "X"),
        ("UniversalJoint", "XY", ""),
        ("BallJoint", "XYZ", ""),
        ("GimbalJoint", "XYZ", ""),
        ("PlanarJoint", "Z", "XY"),
        ("FreeJoint", "XYZ", "XYZ"),
    ],
)
def test_joints_of_fixed_kinds(tmp_path, kind, turns, ways):
    """Axes as the documentation of each joint names them."""
    rng = np.random.default_rng(1)
    q = rng.uniform(-2.0, 2.0, len(turns) + len(ways))
    part = Part("b", "ground", kind, coordinates={f"q{k}": ANY for k in range(len(q))})
    model = read_opensim_model(write(tmp_path / "joint.osim", version_4([part], {})))
    found = model.pose("ground", "b", {f"q{k}": np.array([value]) for k, value in enumerate(q)})
    turn = Rotation.from_euler(turns, q[: len(turns)]).as_matrix() if turns else np.eye(3)
    way = sum(
        (value * np.eye(3)["XYZ".index(a)] for value, a in zip(q[len(turns) :], ways, strict=True)),
        np.zeros(3),
    )
    np.testing.assert_allclose(found.rotation[0], turn.reshape(3, 3), atol=1e-14)
    np.testing.assert_allclose(found.position[0], way, atol=1e-14)


def test_a_spatial_transform_turns_one_axis_after_the_other(tmp_path):
    """Translations stay along the parent's axes; an axis counts by its direction only."""
    axes = {
        "rotation1": ("q", (0.0, 0.0, 1.0), linear()),
        "rotation2": ("q", (1.0, 0.0, 0.0), linear(0.5)),
        "rotation3": ("p", (0.0, 3.0, 0.0), linear()),
        "translation2": ("p", (0.0, 2.0, 0.0), linear(0.1)),
    }
    part = Part("b", "ground", "CustomJoint", coordinates={"q": ANY, "p": ANY}, axes=axes)
    model = read_opensim_model(write(tmp_path / "custom.osim", version_3([part], {})))
    found = model.pose("ground", "b", {"q": np.array([0.7]), "p": np.array([-0.4])})
    turn = Rotation.from_euler("ZXY", [0.7, 0.35, -0.4])
    np.testing.assert_allclose(found.rotation[0], turn.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(found.position[0], [0.0, -0.04, 0.0], atol=1e-14)


@pytest.mark.parametrize("version", ["10901", "20302", "30000", "40500"])
def test_document_versions(tmp_path, version):
    """Up to 3 the layout is one, and so it is from 4 on."""
    layout, written = (version_4, "40000") if version >= "40000" else (version_3, "30000")
    text = layout(*walker()).replace(f'Version="{written}"', f'Version="{version}"')
    model = read_opensim_model(write(tmp_path / "old.osim", text))
    assert {joint.name for joint in model.joints} == {
        f"{body}_joint" for body in model.bodies if body != "ground"
    }


def test_what_is_left_out_is_opensims_default(tmp_path):
    """Axis x, slope 1, factor 1, place 0."""
    text = "<MultiplierFunction><function><LinearFunction/></function></MultiplierFunction>"
    part = Part(
        "b", "ground", "CustomJoint", coordinates={"q": ANY}, axes={"rotation1": ("q", (1, 0, 0), text)}
    )
    written = version_3([part], {}).replace("<axis>1.0 0.0 0.0</axis>", "")
    model = read_opensim_model(write(tmp_path / "short.osim", written))
    expected = Rotation.from_euler("x", 0.4).as_matrix()
    np.testing.assert_allclose(
        model.pose("ground", "b", {"q": np.array([0.4])}).rotation[0], expected, atol=1e-14
    )


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_functions_with_a_formula(tmp_path, layout):
    q = np.linspace(-2.5, 2.5, 21)
    cases = {
        "<Constant><value>0.3</value></Constant>": np.full(21, 0.3),
        "<LinearFunction><coefficients>2 0.5</coefficients></LinearFunction>": 2.0 * q + 0.5,
        "<PolynomialFunction><coefficients>1 0 -2 3</coefficients></PolynomialFunction>": q**3
        - 2.0 * q
        + 3.0,
        f"<MultiplierFunction><function>{linear(2.0)}</function><scale>1.5</scale></MultiplierFunction>": 3.0
        * q,
    }
    for text, expected in cases.items():
        np.testing.assert_allclose(values_of(tmp_path, text, q, layout), expected, atol=1e-14)


def test_piecewise_linear_goes_on_straight(tmp_path):
    q = np.array([-3.0, -1.2, -0.4, 0.0, 3.0])
    first, last = (HEIGHTS[1] - HEIGHTS[0]) / (KNOTS[1] - KNOTS[0]), 0.05 / (2.09 - 0.16)
    expected = np.interp(q, KNOTS, HEIGHTS)
    expected[[0, -1]] += first * (-3.0 - KNOTS[0]), last * (3.0 - KNOTS[-1])
    np.testing.assert_allclose(values_of(tmp_path, curve("PiecewiseLinearFunction"), q), expected, atol=1e-14)


@pytest.mark.parametrize("name", ["SimmSpline", "NaturalCubicSpline", "natCubicSpline"])
def test_the_spline_is_forsythes(tmp_path, name):
    """Its own equations, solved here as one linear system for cubics a + b t + c t² + d t³ on each piece."""
    n, h = len(KNOTS), np.diff(KNOTS)
    rows, right = [], []

    def equation(value: float, *terms: tuple[int, list[float]]) -> None:
        row = np.zeros(4 * (n - 1))
        for piece, factors in terms:
            row[4 * piece : 4 * piece + 4] += factors
        rows.append(row)
        right.append(value)

    for k in range(n - 1):
        equation(HEIGHTS[k], (k, [1, 0, 0, 0]))
        equation(HEIGHTS[k + 1], (k, [1, h[k], h[k] ** 2, h[k] ** 3]))
    for k in range(n - 2):
        equation(0.0, (k, [0, 1, 2 * h[k], 3 * h[k] ** 2]), (k + 1, [0, -1, 0, 0]))
        equation(0.0, (k, [0, 0, 2, 6 * h[k]]), (k + 1, [0, 0, -2, 0]))
    equation(np.polyfit(KNOTS[:4], HEIGHTS[:4], 3)[0], (0, [0, 0, 0, 1]))
    equation(np.polyfit(KNOTS[-4:], HEIGHTS[-4:], 3)[0], (n - 2, [0, 0, 0, 1]))
    pieces = np.linalg.solve(np.array(rows), np.array(right)).reshape(-1, 4)

    q = np.linspace(KNOTS[0], KNOTS[-1], 200)
    piece = np.clip(np.searchsorted(KNOTS, q) - 1, 0, n - 2)
    expected = sum(pieces[piece, p] * (q - KNOTS[piece]) ** p for p in range(4))
    np.testing.assert_allclose(values_of(tmp_path, curve(name), q), expected, atol=1e-12)
    outside = values_of(tmp_path, curve(name), np.array([KNOTS[0] - 0.5]))
    np.testing.assert_allclose(outside, HEIGHTS[0] - 0.5 * pieces[0, 1], atol=1e-12)


def test_a_spline_through_three_points_is_their_parabola(tmp_path):
    q = np.linspace(-2.0, 2.0, 9)
    expected = np.polyval(np.polyfit([-2.0, -0.5, 2.0], [0.1, 0.3, -0.2], 2), q)
    found = values_of(tmp_path, curve("SimmSpline", "-2 -0.5 2", "0.1 0.3 -0.2"), q)
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_defaults_and_gaps(tmp_path):
    part = Part("b", "ground", "SliderJoint", coordinates={"q": (0.93, -1, 2)})
    model = read_opensim_model(write(tmp_path / "slider.osim", version_4([part], {})))
    assert model.pose("ground", "b", {}).position[0, 0] == 0.93
    turning = one_joint(tmp_path, linear()).pose("ground", "b", {"q": np.array([0.1, np.nan])})
    assert np.isfinite(turning.rotation[0]).all() and np.isnan(turning.rotation[1]).all()


def test_a_joint_may_be_passed_from_child_to_parent(tmp_path):
    parts = [
        Part("a", "ground", coordinates={"q": ANY}),
        Part("b", "a", at=(0.0, -1.0, 0.0), coordinates={"p": ANY}),
    ]
    model = read_opensim_model(write(tmp_path / "two.osim", version_4(parts, {})))
    values = {"q": np.array([0.3]), "p": np.array([0.5])}
    there, back = model.pose("ground", "b", values), model.pose("b", "ground", values)
    np.testing.assert_allclose((there @ back).rotation[0], np.eye(3), atol=1e-14)
    np.testing.assert_allclose((there @ back).position[0], 0.0, atol=1e-14)


def test_only_a_joint_that_is_needed_is_refused(tmp_path):
    parts = [
        Part("a", "ground", coordinates={"q": ANY}),
        Part("b", "a", "EllipsoidJoint", coordinates={"p": ANY}),
    ]
    model = read_opensim_model(write(tmp_path / "arm.osim", version_3(parts, {})))
    assert model.pose("ground", "a", {}).position.shape == (1, 3)
    with pytest.raises(InputError, match=r"arm\.osim: joint b_joint = 'EllipsoidJoint': is a kind"):
        model.pose("ground", "b", {})


def test_only_a_function_that_is_needed_is_refused(tmp_path):
    model = one_joint(tmp_path, "<Sine><amplitude>1</amplitude></Sine>")
    with pytest.raises(InputError, match="joint b_joint = 'Sine': is a function that is not read"):
        model.pose("ground", "b", {})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<OpenSimDocument", "is not XML"),
        ("", "is not XML"),
        ('<?xml version="1.0" encoding="nonsense"?><a/>', "is not XML"),
        ('<!DOCTYPE a [<!ENTITY b "bbb">]><a>&b;</a>', "declares a DOCTYPE"),
        ("<robot><link/></robot>", "is not an OpenSim model"),
        ('<OpenSimDocument Version="30000"><MarkerSet/></OpenSimDocument>', "is not an OpenSim model"),
        (document(50000, "", "", ""), "is not a known document version"),
        (document(30000, "", "", ""), "has no bodies, or no joints"),
        (version_3(*walker()).replace("meters", "millimeters"), "is another unit"),
        (version_3(*walker()).replace("<mass>10.0", "<mass>ten"), "mass = .*: is not a number"),
        (version_3(*walker()).replace("<mass>10.0", "<mass>-10.0"), "mass of .* is negative"),
        (version_3(*walker()).replace("<mass>10.0", "<mass>1e308"), "mass = 1e.308: is not a magnitude"),
        (version_4(*walker()).replace("0.02 0.03 0.13", "0.02 0.03"), "is not 3 numbers"),
        (
            version_4(*walker()).replace("<coefficients>1.0 0", "<coefficients>one 0"),
            "coefficients = .*: is not a number",
        ),
        (
            version_4(*walker()).replace("<coefficients>1.0 0", "<coefficients>nan 0"),
            "is not a finite number",
        ),
    ],
)
def test_a_wrong_file_is_told_in_a_sentence(tmp_path, text, words):
    path = write(tmp_path / "wrong.osim", text)
    with pytest.raises(InputError, match=words) as caught:
        read_opensim_model(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ("<Constant><value>1e308</value></Constant>", "Constant: value = .*: is not a magnitude"),
        ("<Constant><value>x</value></Constant>", "Constant: value = .*: is not a number"),
        (curve("SimmSpline", y="0 nan 1"), "SimmSpline: y = nan: is not a finite number"),
        ("<MultiplierFunction>" * 3000 + "</MultiplierFunction>" * 3000, "is nested too deeply"),
    ],
)
def test_a_wrong_function_is_told_in_a_sentence(tmp_path, function, words):
    with pytest.raises(InputError, match=rf"small\.osim: .*{words}"):
        one_joint(tmp_path, function)


def test_an_axis_of_almost_no_length_has_no_direction(tmp_path):
    text = one_joint(tmp_path, "<Constant/>").file.read_text().replace("0.0 0.0 2.0", "0 5e-324 0")
    with pytest.raises(InputError, match="has an axis without direction"):
        read_opensim_model(write(tmp_path / "thin.osim", text))


def test_a_model_too_large_for_memory_is_not_read(tmp_path, monkeypatch):
    path = write(tmp_path / "walker.osim", version_4(*walker()))
    monkeypatch.setattr(opensim_model, "_LARGEST", path.stat().st_size - 1)
    with pytest.raises(InputError, match="is too large"):
        read_opensim_model(path)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_opensim_model(tmp_path / "none.osim")
