"""A muscle's own curves: against the law's kernel, the compiled muscle, virtual work, and their inverses."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim import load
from afo_sim.common import InputError, names
from afo_sim.description import Muscle
from afo_sim.lab import stand_plan as rest
from afo_sim.metrics import Metric
from afo_sim.physics import LAWS
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
    muscle = load("muscle", name, {"tube": None})  # whose force stands beside the law's
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


def test_contraction_is_where_the_stands_load_hangs(muscle: Muscle) -> None:
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
    beyond, before = (muscle.force("3 bar", contraction=slack + x) for x in (1e-9, -0.01))
    assert beyond == 0.0 < before
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
    ("wrong", "says"),
    [
        ({"pressure": "3 N"}, "pressure = '3 N'"),
        ({"pressure": "3"}, "has no unit"),
        ({"contraction": None}, "neither"),
        ({"length": "2 cm"}, "both"),
        ({"contraction": "a tenth"}, "contraction"),
        ({"pressure": object()}, "is not a number"),
        ({"pressure": Metric(3.0, "mm")}, "does not convert"),
        ({"pressure": [2e5, 3e5], "contraction": [0.0, 0.1, 0.2]}, "do not broadcast"),
        ({"series_stiffness": "0 N/m"}, "series_stiffness .*above 0"),
        ({"series_stiffness": -1.0}, "series_stiffness .*above 0"),
        ({"series_stiffness": math.nan}, "series_stiffness .*above 0"),
        ({"series_stiffness": "3 mm"}, "series_stiffness"),
        ({"offset": "-1 mm"}, "offset .*0 m or more"),
        ({"offset": math.inf}, "offset .*0 m or more"),
    ],
)
def test_a_wrong_quantity_is_refused(muscle: Muscle, wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        muscle.force(**{"pressure": "3 bar", "contraction": 0.1} | wrong)


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


# --- with what gives way in series


def independent(muscle: Muscle, path: float, gauge: float, stiffness: float, offset: float) -> float:
    """Tension at which muscle, spring and offset together are as long as the path, by scipy's root."""
    length = muscle.nominal_length

    def too_long(pull: float) -> float:
        own = muscle.contraction(gauge, force=pull)
        return length * (1.0 - own) + pull / stiffness + offset - length * (1.0 - path)

    most = muscle.force(gauge, contraction=path + offset / length)
    return float(brentq(too_long, 0.0, most, xtol=1e-11)) if most > 1e-9 else 0.0


def test_force_in_series_is_where_the_lengths_add_up(muscle: Muscle) -> None:
    path = np.linspace(-0.01, 0.2, 8)
    for stiffness, offset in ((5e3, 0.0), (20e3, 2e-3), (200e3, 8e-3)):
        found = muscle.force("3 bar", contraction=path, series_stiffness=stiffness, offset=offset)
        expected = [independent(muscle, float(x), 3e5, stiffness, offset) for x in path]
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_force_in_series_takes_texts_arrays_and_lengths(muscle: Muscle) -> None:
    one = muscle.force("3 bar", contraction=0.05, series_stiffness="20 kN/m", offset="2 mm")
    assert isinstance(one, float)
    length = (1.0 - 0.05) * muscle.nominal_length
    assert muscle.force(3e5, length=length, series_stiffness=20e3, offset=2e-3) == pytest.approx(one)
    table = muscle.force(
        [[2e5], [3e5]], contraction=0.05, series_stiffness=["20 kN/m", "50 kN/m"], offset="2 mm"
    )
    assert table.shape == (2, 2) and table[1, 0] == pytest.approx(one)


def test_force_in_series_ends_in_the_muscles_own(muscle: Muscle) -> None:
    own = muscle.force(GAUGE[:, None], contraction=KAPPA)
    rigid = muscle.force(GAUGE[:, None], contraction=KAPPA, series_stiffness=math.inf, offset="0 mm")
    assert np.array_equal(rigid, own)
    stiff = muscle.force(GAUGE[:, None], contraction=KAPPA, series_stiffness="1e9 N/m")
    assert stiff == pytest.approx(own, rel=1e-4)
    shift = 3e-3 / muscle.nominal_length
    gained = muscle.force(GAUGE[:, None], contraction=KAPPA, offset="3 mm")
    assert np.array_equal(gained, muscle.force(GAUGE[:, None], contraction=KAPPA + shift))
