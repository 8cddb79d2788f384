"""A muscle's own curves: against the law's kernel, the compiled muscle, virtual work, and their inverses."""

import math

import numpy as np
import pytest

from afo_sim import load
from afo_sim.bench import rest
from afo_sim.common.assets import names
from afo_sim.common.errors import InputError
from afo_sim.description.muscle import Muscle
from afo_sim.metrics.metric import Metric
from afo_sim.physics.laws import LAWS
from afo_sim.physics.static_force import static_force

KAPPA = np.linspace(0.0, 0.25, 11)
GAUGE = np.array([1e5, 2.5e5, 4e5])


@pytest.fixture(scope="module")
def muscle() -> Muscle:
    return load("muscle", "dmsp_20")


def ideal(muscle: Muscle) -> Muscle:
    """The muscle with nothing but the braid's geometry."""
    return load("muscle", muscle.model_dump(mode="json") | {"law": "tondu_lopez_2000", "laws": {
        "tondu_lopez_2000": {"k": 1.0}}})  # fmt: skip


@pytest.mark.parametrize("name", sorted(names("muscle")))
def test_force_is_the_laws_where_it_pulls(name: str) -> None:
    muscle = load("muscle", name)
    low, high = muscle.law_set.pressure_range
    pressure = np.linspace(max(low, 1e5), min(high, muscle.limits.pressure), 5)[:, None]
    found = muscle.force(pressure, contraction=KAPPA)
    law, row = float(LAWS[muscle.law].native_id), list(muscle.coefficients)
    bare = [[static_force(law, x, p, row, 0) for x in KAPPA] for p in pressure[:, 0]]
    assert found.shape == (5, 11)
    pulls = np.array(bare) > 1.0  # below, tension sets in smoothly
    assert pulls.any()
    assert np.array_equal(found[pulls], np.array(bare)[pulls])
    assert (found >= 0.0).all() and (found[~pulls] <= 1.0).all()


def test_force_is_what_the_stands_formula_says(muscle: Muscle) -> None:
    kappa = np.linspace(-0.05, 0.4, 10)
    assert np.array_equal(rest.rest_force(muscle, kappa, np.array(3e5)), muscle.force(3e5, contraction=kappa))
    hung = rest.hanging(muscle, 150.0, 3e5)
    assert muscle.contraction(3e5, force=150.0) == pytest.approx(hung, abs=1e-12)


def test_the_ideal_braids_force_is_virtual_work(muscle: Muscle) -> None:
    """F = −p dV/dL, of two methods that share nothing but the geometry."""
    braid, pressure, step = ideal(muscle), 3e5, 1e-5
    length = braid.nominal_length * (1.0 - np.linspace(0.02, 0.25, 9))
    slope = (braid.volume(length=length + step) - braid.volume(length=length - step)) / (2.0 * step)
    assert braid.force(pressure, length=length) == pytest.approx(-pressure * slope, rel=1e-6)


@pytest.mark.parametrize("law", ["sarosi_2012", "kerscher_2006", "tondu_lopez_2000", "polynomial"])
def test_contraction_and_pressure_invert_the_force(muscle: Muscle, law: str) -> None:
    used = muscle.using(law=law)
    force = used.force(GAUGE[:, None], contraction=KAPPA)
    pulls = force > 1.0
    pressure, kappa = np.broadcast_to(GAUGE[:, None], force.shape)[pulls], np.tile(KAPPA, (3, 1))[pulls]
    assert used.contraction(pressure, force=force[pulls]) == pytest.approx(kappa, abs=1e-9)
    assert used.pressure(force[pulls], contraction=kappa) == pytest.approx(pressure, rel=1e-9)


def test_what_a_muscle_cannot_carry_is_not_a_number(muscle: Muscle) -> None:
    assert math.isnan(muscle.contraction("3 bar", force="100 kN"))
    assert math.isnan(muscle.contraction("3 bar", force=-1.0))
    assert math.isnan(muscle.pressure("5 kN", contraction=0.1))
    assert muscle.pressure(0.0, contraction=0.1) == 0.0
    slack = muscle.contraction("3 bar", force=0.0)
    assert (
        muscle.force("3 bar", contraction=slack + 1e-9)
        == 0.0
        < muscle.force("3 bar", contraction=slack - 0.01)
    )
    assert math.isnan(muscle.force(math.nan, contraction=0.1))


def test_volume_grows_until_the_braids_angle_is_54_7_degrees(muscle: Muscle) -> None:
    fattest = 1.0 - 1.0 / (math.sqrt(3.0) * math.cos(muscle.braid_angle))
    volume = muscle.volume(contraction=np.linspace(0.0, fattest, 20))
    assert (np.diff(volume) > 0.0).all()
    assert volume[0] > muscle.dead_volume
    cylinder = math.pi * (muscle.bore / 2.0) ** 2 * muscle.nominal_length
    assert volume[0] == pytest.approx(cylinder, rel=0.05)


def test_texts_numbers_lists_and_metrics_mean_the_same(muscle: Muscle) -> None:
    wanted = muscle.force(3e5, contraction=0.1)
    assert type(wanted) is float
    for pressure in ("3 bar", "300 kPa", np.float64(3e5), Metric(3.0, "bar"), 300000):
        assert muscle.force(pressure, contraction=0.1) == wanted
    assert muscle.force(["3 bar", 3e5], contraction=0.1).tolist() == [wanted, wanted]
    assert muscle.force("3 bar", length=0.9 * muscle.nominal_length) == pytest.approx(wanted, rel=1e-12)
    assert muscle.force("3 bar", length="27 cm") == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"pressure": "3 N", "contraction": 0.1}, "pressure = '3 N'"),
        ({"pressure": "3", "contraction": 0.1}, "has no unit"),
        ({"pressure": "3 bar"}, "neither"),
        ({"pressure": "3 bar", "contraction": 0.1, "length": "2 cm"}, "both"),
        ({"pressure": "3 bar", "contraction": "a tenth"}, "contraction"),
        ({"pressure": object(), "contraction": 0.1}, "is no number"),
        ({"pressure": Metric(3.0, "mm"), "contraction": 0.1}, "does not convert"),
        ({"pressure": [2e5, 3e5], "contraction": [0.0, 0.1, 0.2]}, "do not broadcast"),
    ],
)
def test_a_wrong_quantity_is_refused(muscle: Muscle, arguments: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        muscle.force(**arguments)  # type: ignore[arg-type]


def test_using_takes_another_of_its_laws_and_refuses_what_it_lacks(muscle: Muscle) -> None:
    other = muscle.using(law="tondu_lopez_2000")
    assert (other.law, muscle.law) == ("tondu_lopez_2000", "sarosi_2012")
    assert other.force("3 bar", contraction=0.1) != muscle.force("3 bar", contraction=0.1)
    assert muscle.using() == muscle
    with pytest.raises(InputError, match=r"did you mean 'kerscher_2006'") as refused:
        muscle.using(law="kerscher")
    assert refused.value.allowed.split(", ") == list(muscle.laws)
    with pytest.raises(InputError, match="friction = 'coulomb'"):
        muscle.using(friction="coulomb")
    rubbing = load("muscle", "s1_215mm")
    for friction in (*rubbing.frictions, "none"):
        assert rubbing.using(friction=friction).friction == friction
