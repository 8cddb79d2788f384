"""The covariance of a muscle's fit: read, checked, kept, drawn from."""

import math
import pathlib
from typing import Any

import numpy as np
import pytest

from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import InputError
from afo_sim.description import load, product, toml_text
from afo_sim.description.keys import keys
from afo_sim.description.new import new
from afo_sim.description.portable import portable

LAW = "tondu_lopez_2000_bladder"
FORCE, STIFFNESS = f"laws.{LAW}.bladder_force", f"laws.{LAW}.bladder_stiffness"
TABLE: dict[str, Any] = {
    "law": LAW,
    "parameters": ["braid_angle", FORCE, STIFFNESS],
    "standard_errors": ["2 deg", "40 N", "0.1 kN"],
    "correlation": [[1.0, -0.99, 0.2], [-0.99, 1.0, -0.25], [0.2, -0.25, 1.0]],
    "freedom": 20,
}


def muscle(**changed: Any) -> Any:
    """S1's muscle with this covariance."""
    return load("muscle", "s1_215mm", {"covariance": TABLE | changed})


def test_draws_have_the_covariance_exactly() -> None:
    """With z the rows of the unit matrix, Σ (θ − θ0)(θ − θ0)ᵀ = S √R √R S = C."""
    own = muscle()
    drawn = own.drawn(np.eye(3))
    steps = np.array(
        [drawn["braid_angle"] - own.braid_angle]
        + [drawn[k] - own.laws[LAW].parameters[k.rpartition(".")[2]] for k in (FORCE, STIFFNESS)]
    )
    errors = np.array([np.radians(2.0), 40.0, 100.0])  # SI, by hand
    expected = np.outer(errors, errors) * np.array(TABLE["correlation"])
    np.testing.assert_allclose(steps @ steps.T, expected, rtol=1e-9)
    np.testing.assert_allclose(own.covariance.matrix, expected, rtol=1e-12)


def test_a_scale_is_on_the_standard_errors_of_matrix_and_draws() -> None:
    plain, wide = muscle(), muscle(scale=1.7)
    np.testing.assert_allclose(wide.covariance.matrix, 1.7**2 * plain.covariance.matrix, rtol=1e-12)
    normals = np.random.default_rng(2).standard_normal((9, 3))
    narrow, found = plain.drawn(1.7 * normals), wide.drawn(normals)
    for key, values in found.items():
        np.testing.assert_allclose(values, narrow[key], rtol=1e-12)
    assert wide.covariance.block([FORCE]).matrix[0, 0] == pytest.approx((1.7 * 40.0) ** 2)
    assert not muscle(scale=0.0).covariance.matrix.any()
    with pytest.raises(InputError, match="is out of range"):
        muscle(scale=11.0)


def test_singular_correlation_draws_along_a_line() -> None:
    own = muscle(
        parameters=["braid_angle", FORCE], standard_errors=["2 deg", "40 N"], correlation=[[1, -1], [-1, 1]]
    )
    drawn = own.drawn(np.random.default_rng(0).standard_normal((50, 2)))
    angle, force = (drawn["braid_angle"] - own.braid_angle) / np.radians(2.0), (drawn[FORCE] - 136.0) / 40.0
    np.testing.assert_allclose(angle, -force, atol=1e-6)
    assert angle.std() > 0.5


def test_draws_that_are_no_muscles_are_told() -> None:
    own = muscle(
        parameters=[FORCE, "end_length"], standard_errors=["40 N", "1 cm"], correlation=[[1, 0], [0, 1]]
    )
    normals = np.array([[0, 0], [-4, 0], [0, -6], [0, 17]])  # F0 < 0, ends < 0, ends longer than the whole
    assert own.legal(own.drawn(normals)).tolist() == [True, False, False, False]
    shares = own.legal(own.drawn(np.random.default_rng(1).standard_normal((20000, 2))))
    below = 0.5 * (1.0 + math.erf(3.4 / math.sqrt(2.0)))  # P(F0 > 0), 136/40 = 3.4
    assert abs(shares.mean() - below) < 1e-3


def test_other_law_in_use_leaves_the_covariance_out_and_says_so() -> None:
    own = load("muscle", "dmsp_20", {"covariance": TABLE | {"law": "tondu_lopez_2000"} | OTHER})
    assert own.drawn(np.zeros((1, 3))) == {}
    assert own.without_draws == "the covariance is of tondu_lopez_2000, and sarosi_2012 is in use"
    used = own.using(law="tondu_lopez_2000")
    assert used.without_draws == "" and len(used.drawn(np.zeros((1, 3)))) == 3
    assert used.using(law="sarosi_2012") == own
    with pytest.raises(InputError, match=r"of shape \(n, 3\)"):
        used.drawn(np.zeros((1, 2)))


K = "laws.tondu_lopez_2000.k"
OTHER = {"parameters": ["braid_angle", "end_length", K], "standard_errors": ["1 deg", "1 cm", 0.1]}
IMPOSSIBLE = [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]


@pytest.mark.parametrize(
    ("changed", "field", "expected", "nearest"),
    [
        ({"law": "tondu_lopez_2000_blader"}, "law", "unknown law", LAW),
        ({"law": "tondu_lopez_2000", **OTHER}, "law", "no parameters of this law", LAW),
        ({"parameters": ["braid_angle"] * 3}, "parameters", "named once", None),
        ({"parameters": ["bladder_forse"]}, "parameters", "'bladder_forse' is not a number", FORCE),
        ({"parameters": ["braid_angle", "damping"]}, "parameters", "'damping' is not a number", None),
        ({"parameters": ["braid_angle", K]}, "parameters", "is not a number", f"laws.{LAW}.k"),
        ({"standard_errors": ["2 deg", "40 N"]}, "standard_errors", "3 parameters", None),
        ({"standard_errors": ["2 N", "4 N", "1 N"]}, "standard_errors.0", "not convert to rad", None),
        ({"standard_errors": ["2 deg", "0 N", "1 N"]}, "standard_errors.1", "out of range", None),
        ({"correlation": [[1, 0], [0, 1]]}, "correlation", "not go with the parameters", None),
        ({"correlation": [[1, 0, 0], [0.1, 1, 0], [0, 0, 1]]}, "correlation", "not symmetric", None),
        ({"correlation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}, "correlation.0.0", "out of range", None),
        ({"correlation": [[0.9, 0, 0], [0, 1, 0], [0, 0, 1]]}, "correlation", "on the diagonal", None),
        ({"correlation": IMPOSSIBLE}, "correlation", "eigenvalue is -0.8", None),
        ({"freedom": 0}, "freedom", "at least 1", None),
        ({"fredom": 3}, "fredom", "unknown key", "freedom"),
    ],
)
def test_what_is_no_covariance_is_refused(
    changed: dict[str, Any], field: str, expected: str, nearest: str | None
) -> None:
    with pytest.raises(InputError, match=expected) as refused:
        muscle(**changed)
    assert (refused.value.field, refused.value.nearest) == (f"covariance.{field}", nearest)


def test_covariance_survives_every_copy(tmp_path: pathlib.Path) -> None:
    own = muscle()
    assert own.with_values(mass=0.1).covariance == own.covariance
    name = "orthosis.muscle.dorsiflexor.type"
    scenario = load("scenario", "seated", {f"{name}.covariance": TABLE})
    turned = scenario.set({f"{name}.braid_angle": "23 deg"}).orthosis.muscle["dorsiflexor"].type
    assert turned.covariance == own.covariance
    file = tmp_path / "moved.toml"
    file.write_text(toml_text(portable(scenario.resolved(), tmp_path)))
    again = load("scenario", file).orthosis.muscle["dorsiflexor"].type
    assert again.covariance == own.covariance
    assert again.drawn(np.eye(3)).keys() == own.drawn(np.eye(3)).keys()
    assert load("scenario", "seated", {name: own}).orthosis.muscle["dorsiflexor"].type == own


def test_lists_are_listed_and_are_no_keys() -> None:
    """A matrix item by item would be 16 keys that nobody can set one by one."""
    (_, _, rows), *_ = product("s1_215mm")
    listed = {row[0]: row[1] for row in rows if row[0].startswith("covariance")}
    assert listed["covariance.standard_errors"] == "[3.31 deg, 55.6 N, 127 N, 5.47 mm]"
    assert set(listed) == {f"covariance.{name}" for name in (*TABLE, "scale")}
    found = {key.key for key in keys("s1_215mm", "covariance", kind="muscle")}
    assert found == {"covariance.law", "covariance.freedom", "covariance.scale"}


def test_new_muscle_does_not_take_over_another_ones_covariance(tmp_path: pathlib.Path) -> None:
    file = new("muscle", "mine", tmp_path, like="s1_215mm")
    assert load("muscle", "s1_215mm").covariance is not None
    assert load("muscle", file).covariance is None
    assert "# [covariance]" in new("muscle", "other", tmp_path, whole=True).read_text()


@pytest.mark.parametrize(
    ("scale", "errors"),
    [
        (1.0, "braid_angle ± 2 deg, bladder_force ± 40 N, bladder_stiffness ± 100 N"),
        (1.5, "braid_angle ± 3 deg, bladder_force ± 60 N, bladder_stiffness ± 150 N"),
    ],
)
def test_check_tells_the_covariance_in_one_line(scale: float, errors: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "muscle.toml"
    file.write_text(toml_text(muscle(scale=scale).model_dump(mode="json")))
    told = dict(check_file(file))["covariance of the fit"]
    assert errors in told
    assert "strongest correlation -0.990, braid_angle with bladder_force; 20 degrees" in told
