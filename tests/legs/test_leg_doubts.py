"""Inertias and stops in other units are told."""

import numpy as np
import pytest
from turned_leg import hinge, shipped, with_ankle

from afo_sim.common.errors import InputError
from afo_sim.legs.cutting import cut
from afo_sim.legs.finding import find
from afo_sim.legs.leg_numbers import LegNumbers, doubtful_notes
from afo_sim.legs.tree import Part, Shape, Tree


def doubts(tree: Tree) -> list[str]:
    leg = cut(tree, find(tree))
    return doubtful_notes(leg, LegNumbers.of(leg))


def foot_times(factor: float, shapes: bool = True) -> Tree:
    """A foot that is a box of 26 × 9 × 4 cm and 1 kg, its inertia in another unit, below a shank."""
    half = np.array([0.13, 0.045, 0.02])
    inertia = np.diag(half @ half - half * half) / 3.0
    middle = np.eye(4)
    middle[:3, 3] = 0.05, 0.0, -0.05
    box = (Shape("box", "box", middle, half),) if shapes else ()
    shank = Part("shank", None, np.eye(4), 3.0, np.array([0.0, 0.0, 0.2]), np.diag([0.04, 0.04, 0.005]))
    ankle = (hinge("ankle", (0, -1, 0)),)
    foot = Part("foot", "shank", np.eye(4), 1.0, middle[:3, 3], factor * inertia, ankle, box)
    return Tree(None, {"shank": shank, "foot": foot})


def test_the_shipped_leg_is_not_doubted() -> None:
    assert doubts(shipped()) == []
    assert doubts(foot_times(1.0)) == doubts(foot_times(1.0, shapes=False)) == []


@pytest.mark.parametrize("factor", [1e6, 1e3, 1e-3, 1e-6])
def test_an_inertia_in_another_unit_is_told(factor: float) -> None:
    """The radius of gyration grows with the root of the unit's factor, and that of the foot is told."""
    assert any("the foot's inertia gives a radius of gyration" in note for note in doubts(foot_times(factor)))


def test_without_shapes_a_huge_inertia_is_told() -> None:
    assert any("no shank or foot has that" in note for note in doubts(foot_times(1e6, shapes=False)))


def test_degrees_that_were_read_as_radians_are_refused() -> None:
    with pytest.raises(InputError, match="from -2292 to 1719 deg: are its stops degrees"):
        doubts(with_ankle(shipped(), {"range": (-40.0, 30.0)}))


def test_stops_that_leave_no_motion_are_told() -> None:
    stops = float(np.radians(-2.0)), float(np.radians(1.2))
    assert any("moves by 3.2 deg only" in note for note in doubts(with_ankle(shipped(), {"range": stops})))
