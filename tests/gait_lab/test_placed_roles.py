"""Markers whose names say nothing: every role is right, or it is refused; none is wrong."""

import pathlib

import numpy as np
import pytest
from gait_lab.laboratory import Laboratory
from gait_lab.marker_sets import SETS, placed
from gait_lab.trial_files import write_trial

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, Markers, import_gait
from afo_sim.gait_lab.trial.placed_roles import place_roles
from afo_sim.gait_lab.trial.roles import find_roles

BODIES = 20
NAMED = [name for name in SETS if name != "rajagopal, joint centres"]


def drawn(seed: int, name: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and a set's markers on a drawn body in a drawn laboratory: sizes, places, noise, arms, belt."""
    draw = np.random.default_rng([seed, sorted(SETS).index(name)])
    forward, up = [("x", "y"), ("-y", "z"), ("y", "z"), ("-x", "y")][draw.integers(4)]
    lab = Laboratory(forward=forward, up=up, turn=draw.uniform(-0.2, 0.2), belt=draw.choice([0.0, 1.0]))
    time = lab.time
    segments = lab.walker.segments(time)
    size = draw.uniform(0.75, 1.2) * np.array([1.0, 1.0, draw.uniform(0.9, 1.15)])
    world = {}
    for label, (segment, place) in placed(name).items():
        rotation, origin = segments[segment]
        world[label] = rotation @ (place + draw.uniform(-0.008, 0.008, 3)) + origin
    if draw.random() < 0.5:  # arms, which swing against the legs, and a head
        ahead, above, out = (np.eye(3)[k] for k in range(3))
        chest = segments["pelvis"][1] - 0.05 * ahead
        swing = np.outer(0.2 * np.sin(lab.walker.phase("right", time) * 2.0 * np.pi), ahead)
        for side, sign in (("R", 1.0), ("L", -1.0)):
            world[f"{side}WRI"] = chest + sign * swing - 0.1 * above + 0.28 * sign * out
            world[f"{side}ELB"] = chest + 0.5 * sign * swing + 0.1 * above + 0.25 * sign * out
            world[f"{side}FHD"] = chest + 0.16 * ahead + 0.65 * above + 0.08 * sign * out
            world[f"{side}BHD"] = chest - 0.02 * ahead + 0.65 * above + 0.08 * sign * out
    noisy = {n: lab.seen(size * p, time) + draw.normal(0.0, 0.002, p.shape) for n, p in world.items()}
    return time, noisy


def shuffled(positions: dict[str, np.ndarray], seed: int) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """The same paths as M1, M2, … or with other names that say nothing, and what each was called."""
    order = np.random.default_rng(seed).permutation(list(positions))
    called = {("M{}", "*{}", "C_{:03}", "{}")[seed % 4].format(k): str(n) for k, n in enumerate(order, 1)}
    return {marker: positions[name] for marker, name in called.items()}, called


@pytest.mark.parametrize("name", SETS)
def test_no_role_is_wrong(name: str) -> None:
    """A forefoot's marker counts as the toe's, whichever it is; joint centres are no markers of a side."""
    legs = 0
    for seed in range(BODIES):
        time, positions = drawn(seed, name)
        known = find_roles(Markers(pathlib.Path("x.trc"), time, positions)).sides
        markers, called = shuffled(positions, seed)
        assert not any(find_roles(Markers(pathlib.Path("x.trc"), time, markers)).sides.values())
        found = place_roles(Markers(pathlib.Path("x.trc"), time, markers)).sides
        for side in ("right", "left"):
            true = {names[0]: mark for mark, names in known[side].items()}
            for mark, (marker,) in found[side].items():
                meant = true.get(called[marker], called[marker])
                forefoot = mark == "toe_tip" and meant.startswith(("metatarsal", "toe"))
                assert forefoot or meant == mark, (seed, side, marker, called[marker])
            legs += "knee_lateral" in found[side]
    assert legs >= (1.2 * BODIES if name in NAMED else 0), legs


@pytest.mark.parametrize("name", SETS)
def test_shoulders_are_no_pelvis(name: str) -> None:
    """A set without a marker on the pelvis is left to its names."""
    for seed in range(BODIES):
        time, positions = drawn(seed, name)
        pelvis = ("ASI", "PSI", "SACR", "IAS", "IPS", "S2")
        rest = {n: path for n, path in positions.items() if not any(word in n.upper() for word in pelvis)}
        markers, _ = shuffled(rest, seed)
        assert not any(place_roles(Markers(pathlib.Path("x.trc"), time, markers)).sides.values())


def test_a_trial_without_names_is_imported(tmp_path: pathlib.Path) -> None:
    """As with its names, and each role is told; without a pelvis it is refused with the way out."""
    laboratory = Laboratory()
    positions = laboratory.markers("plug-in gait")
    named = import_gait(write_trial(tmp_path, laboratory, "plug-in gait"), Choices(walker="healthy"))
    markers, called = shuffled(positions, 3)
    files = write_trial(tmp_path, laboratory, "plug-in gait", points=markers)
    found = import_gait(files, Choices(walker="healthy"))
    assert np.abs(found.cycle.ankle_moment - named.cycle.ankle_moment)[1:-1].max() < 1e-6
    told = [str(warning) for warning in found.warnings if warning.code == "roles-placed"]
    heel = next(marker for marker, name in called.items() if name == "RHEE")
    assert len(told) == 2 and f"heel {heel}" in told[0]
    without = {marker: path for marker, path in markers.items() if "PSI" not in called[marker]}
    files = write_trial(tmp_path, laboratory, "plug-in gait", points=without)
    with pytest.raises(InputError) as caught:
        import_gait(files, Choices(walker="healthy"))
    assert "`marker=heel=NAME`" in caught.value.allowed and "`map`" in caught.value.allowed
