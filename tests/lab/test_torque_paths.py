"""A torque fit on a joint whose centre moves, a circle on a circle: paths as measured, table of centres."""

import pathlib
from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError, with_code
from afo_sim.description import Orthosis, reader
from afo_sim.lab import TorqueFit, fit_torque, paths, torque_report

STIFFNESS, LINK = 20e3, 0.12
FIXED, ROLLING = 0.04, 0.03  # radii of the shank's circle, and of the foot's that rolls on it [m]
ORIGIN, INSERTION = 0.055 + 0.32j, 0.07 - 0.01j  # forward + i up of the circles' contact at angle zero [m]
ANGLE = np.tile(np.radians(np.linspace(-24.0, 15.0, 14)), 3)
GAUGE = np.repeat([2e5, 3e5, 4e5], 14)
CENTRES = np.radians(np.linspace(-30.0, 20.0, 11))


def contact(angle: np.ndarray) -> np.ndarray:
    """Where the circles touch, forward + i up: the foot turns by 1 + R/r times what the contact does."""
    roll = angle * ROLLING / (FIXED + ROLLING)
    return np.asarray(1j * FIXED * (1.0 - np.exp(1j * roll)))


def rolled(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Path length and moment arm −dL/dφ by the motion of the foot's circle [m]."""
    middle = 1j * FIXED - 1j * (FIXED + ROLLING) * np.exp(1j * angle * ROLLING / (FIXED + ROLLING))
    line = middle + np.exp(1j * angle) * (INSERTION + 1j * ROLLING) - ORIGIN
    speed = ROLLING * np.exp(1j * angle * ROLLING / (FIXED + ROLLING)) + 1j * np.exp(1j * angle) * (
        INSERTION + 1j * ROLLING
    )
    length = np.abs(line)
    return length, -np.real(np.conj(line) * speed) / length


def device(**more: Any) -> Orthosis:
    """One muscle ahead of the joint, on rigid anchors."""
    ends = {
        name: {"segment": segment, "from_joint": [f"{at.real} m", "0 m", f"{at.imag} m"]}
        for name, segment, at in (("origin", "shank", ORIGIN), ("insertion", "foot", INSERTION))
    }
    group = {"count": 1, "type": "s1_215mm", "link_length": f"{LINK} m", **ends}
    air = {"inlet": "mh1", "outlet": "mh1", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"}
    table = {"range_of_motion": ["-25 deg", "16 deg"], "muscle": {"front": group}, "chamber": {"front": air}}
    found: Orthosis = reader.load("orthosis", table | more)
    return found


def centres() -> dict[str, Any]:
    rows = zip(CENTRES, contact(CENTRES), strict=True)
    return {"joint_centre": [[f"{a} rad", f"{c.real} m", f"{c.imag} m"] for a, c in rows]}


def readings() -> dict[str, np.ndarray]:
    """Torques by the muscle's own statics behind a spring, over the analytic path."""
    muscle, (length, arm) = device().muscle["front"].type, rolled(ANGLE)
    left = (muscle.end_length + LINK + muscle.nominal_length - length) / muscle.nominal_length
    force = muscle.force(GAUGE, contraction=left, series_stiffness=STIFFNESS)
    assert np.mean(force > 1.0) > 0.9
    return {"angle [rad]": ANGLE, "pressure [Pa]": GAUGE, "torque [N*m]": arm * force}


def columns(name: str = "") -> dict[str, np.ndarray]:
    length, arm = rolled(ANGLE)
    return readings() | {f"path length{name} [mm]": 1e3 * length, f"moment arm{name} [mm]": 1e3 * arm}


def fitted(data: Any, orthosis: Orthosis, **options: Any) -> TorqueFit:
    return fit_torque(data, orthosis, ("series_stiffness",), **{"hold_out": "none"} | options)


def test_the_circles_path_is_that_of_the_table_of_centres() -> None:
    (path,) = paths(device(**centres()), ANGLE)
    length, arm = rolled(ANGLE)
    slope = (rolled(ANGLE + 1e-6)[0] - rolled(ANGLE - 1e-6)[0]) / 2e-6
    assert arm == pytest.approx(-slope, abs=1e-8)
    assert path.length == pytest.approx(length, abs=1e-8) and path.arm == pytest.approx(arm, abs=2e-7)
    (still,) = paths(device(), ANGLE)
    assert np.abs(still.arm - arm).max() > 2e-3


def test_a_centre_that_rests_elsewhere_is_a_turn_about_it() -> None:
    """As if every coordinate were told from there."""
    at = 0.01 - 0.02j
    rows = {"joint_centre": [[f"{a} deg", "1 cm", "-2 cm"] for a in (-30, 0, 30)]}
    (path,) = paths(device(**rows), ANGLE)
    line = at + np.exp(1j * ANGLE) * (INSERTION - at) - ORIGIN
    assert path.length == pytest.approx(np.abs(line), abs=1e-12)


def test_the_stiffness_comes_back_by_columns_and_by_the_table_and_not_by_a_fixed_centre() -> None:
    for data, orthosis in (
        (columns(), device()),
        (columns(" Front"), device()),
        (readings(), device(**centres())),
    ):
        found = fitted(data, orthosis)
        assert found.parameters["series_stiffness"] == pytest.approx(STIFFNESS, rel=1e-3)
        assert found.rms < 1e-3 and not with_code(found.warnings, "arm-off")
    fixed = fitted(readings(), device())
    assert abs(fixed.parameters["series_stiffness"] / STIFFNESS - 1.0) > 0.1 and fixed.rms > 0.1


def test_the_written_orthosis_keeps_its_centres(tmp_path: pathlib.Path) -> None:
    found = fitted(readings(), device(**centres()))
    torque_report.write(found, tmp_path, tmp_path)
    kept = reader.load("orthosis", tmp_path)
    assert np.array(kept.joint_centre) == pytest.approx(np.array(device(**centres()).joint_centre), abs=1e-12)
    assert kept.muscle["front"].cable.stiffness == pytest.approx(STIFFNESS, rel=1e-3)


def test_columns_predict_readings_that_were_left_out_and_a_log_keeps_them() -> None:
    found = fitted(columns(), device(), hold_out="angle")
    assert found.held_out["angle"].rms < 1e-3
    data = {title: np.repeat(values, 50) for title, values in columns().items()}
    log = fitted(data | {"time [s]": 0.02 * np.arange(len(data["angle [rad]"]))}, device())
    assert log.parameters["series_stiffness"] == pytest.approx(STIFFNESS, rel=0.02)


def test_a_moment_arm_that_is_not_the_paths_slope_is_warned_of() -> None:
    length, arm = rolled(ANGLE)
    found = fitted(columns() | {"moment arm [mm]": 800.0 * arm}, device())
    (off,) = with_code(found.warnings, "arm-off")
    order = np.argsort(ANGLE[:14])
    integral = np.trapezoid(1e3 * arm[:14][order], ANGLE[:14][order])
    assert off.data["length"] == pytest.approx(1e3 * np.ptp(length))
    assert off.data["turn"] == pytest.approx(0.8 * integral, rel=1e-6)


@pytest.mark.parametrize(
    ("data", "orthosis", "says"),
    [
        (columns(), device(**centres()), "path length: is given in addition to the orthosis' joint_centre"),
        (columns(" back"), device(), "path length: is of back; .* filled: front"),
        (
            columns() | {"moment arm [mm]": -1e3 * rolled(ANGLE)[1]},
            device(),
            "moment arm .*has the wrong sign",
        ),
        (columns() | {"path length [mm]": rolled(ANGLE)[0]}, device(), "leaves front a contraction ratio of"),
        (readings(), device(joint_centre=centres()["joint_centre"][3:]), "ends within the readings"),
    ],
)
def test_paths_that_contradict_are_refused(data: Any, orthosis: Orthosis, says: str) -> None:
    with pytest.raises(InputError, match=says):
        fitted(data, orthosis)


@pytest.mark.parametrize("angles", [(0,), (5, 9), (5, -5)])
def test_centres_that_do_not_rise_about_0_are_refused(angles: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="rising angles about 0; allowed: two rows or more"):
        device(joint_centre=[[f"{angle} deg", "0 m", "0 m"] for angle in angles])


def test_a_moving_centre_is_refused_over_pulleys_and_in_a_run() -> None:
    with pytest.raises(InputError, match="straight between two anchors"):
        reader.load("orthosis", "arm", centres())
    with pytest.raises(InputError, match="ankle is a hinge"):
        reader.load("scenario", "seated", {"orthosis.joint_centre": centres()["joint_centre"]})
