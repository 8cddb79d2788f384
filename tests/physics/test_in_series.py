"""A muscle behind what gives way: against scipy's root, in its limits, compiled and not."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim.common.assets import names
from afo_sim.description.muscle import Muscle
from afo_sim.description.reader import load
from afo_sim.description.rest_curves import at_rest
from afo_sim.physics.in_series import row, tension, tensions

CUFF, STIFFENING = (4e3, 0.0, 0.0), (0.0, 33.0, 0.017)
CASES = [
    (20e3, 1.0, ()),
    (20e3, 3.0, (CUFF,)),
    (5e3, 2.0, (CUFF, STIFFENING)),
    (math.inf, 3.0, (STIFFENING,)),
]
PATH = np.linspace(-0.04, 0.3, 12)


def gives(pull: float, anchor: tuple[float, float, float]) -> float:
    """What an anchor gives, from its formula."""
    stiffness, force, length = anchor
    return pull / stiffness if stiffness else length * math.log(1.0 + pull / force)


def balanced(muscle: Muscle, path: float, gauge: float, k: float, count: float, anchors: tuple) -> float:  # type: ignore[type-arg]
    """Tension by a root in the tension, not in the contraction."""
    bare, length = at_rest(muscle), muscle.nominal_length

    def left(pull: float) -> float:
        given = pull / k + sum(gives(count * pull, anchor) for anchor in anchors)
        return bare.force(path + given / length, gauge) - pull

    most = bare.force(path, gauge)
    return float(brentq(left, 0.0, most, xtol=1e-12, rtol=1e-14)) if most > 0.0 else 0.0


@pytest.mark.parametrize("name", sorted(names("muscle")))
def test_tension_is_the_root_of_the_balance(name: str) -> None:
    muscle = load("muscle", name)
    for (k, count, anchors), gauge in itertools.product(CASES, (0.0, 0.6 * muscle.limits.pressure)):
        u = row(at_rest(muscle), k, count, anchors)
        found = tensions(PATH, np.full(len(PATH), gauge), u)
        expected = [balanced(muscle, float(x), gauge, k, count, anchors) for x in PATH]
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert found == pytest.approx([tension(float(x), gauge, u) for x in PATH], rel=1e-12, abs=1e-12)


def test_what_gives_way_lessens_the_tension_and_none_leaves_the_laws() -> None:
    muscle = load("muscle", "dmsp_20")
    bare = at_rest(muscle)
    own = np.array([bare.force(float(x), 3e5) for x in PATH])
    before = own
    for k in (1e9, 1e5, 1e4, 1e3):
        found = tensions(PATH, np.full(len(PATH), 3e5), row(bare, k))
        pulls = own > 1.0
        assert (found[pulls] < before[pulls]).all() and (found[~pulls] <= before[~pulls]).all()
        before = found
    rigid = tensions(PATH, np.full(len(PATH), 3e5), row(bare))
    assert rigid == pytest.approx(own, rel=1e-12)


def test_a_path_beyond_all_stroke_leaves_the_muscle_slack() -> None:
    u = row(at_rest(load("muscle", "dmsp_20")), 1e4)
    assert (tensions(np.array([0.5, 0.95, 3.0]), np.full(3, 3e5), u) == 0.0).all()


def test_what_is_not_a_number_comes_out() -> None:
    u = row(at_rest(load("muscle", "dmsp_20")), 1e4)
    assert np.isnan(tensions(np.array([np.nan]), np.array([3e5]), u)).all()
