"""Torques measured on a human-size pin knee: rigid anchors, one stiffness for all, what others reached.

Source: B. Bolen, dissertation, and its public repository (named in `pin_knee.csv`), 185 points; the law is
that of Bolen, Elzein, Pang & Hunt, Actuators 2026.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from afo_sim.common import JsonDict, JsonMapping, assets, read_table
from afo_sim.description import Muscle, reader
from afo_sim.lab.identifiability import rms
from afo_sim.lab.measured import Known, columns_of
from afo_sim.physics import LAWS, forces

LAW = "bolen_2026"
FEMUR_ANCHOR = (-0.075, 0.100)  # forward and up from the hip, in the femur [m]
TIBIA_ANCHOR = (-0.05011, -0.045)  # from the pin, in the tibia [m]
PIN = (0.0045, -0.3958)  # in the femur [m]
FITTINGS = 2 * 0.0254  # both ends of the muscle [m]
# Test → nominal length, length at 620 kPa without load, tendon [m].
MUSCLES = {
    "48": (0.485, 0.398, 0.0),
    "46": (0.457, 0.380, 0.0),
    "47": (0.479, 0.403, 0.0),
    "40t": (0.406, 0.338, 0.035),
    "41": (0.410, 0.335, 0.0),
}
LENGTHS = {"length": ("m",), "moment arm": ("m",)}
COLUMNS: Known = {"test": None, "angle": ("rad",), "torque": ("N*m",), "pressure": ("Pa",), **LENGTHS}
EXAMPLE = "test, angle [deg], torque [N*m], length [mm], moment arm [mm], pressure [kPa]"
LOCKED, EMPTY = -0.3, 0.6  # contraction ratios between which every balance lies
HALVINGS = 50  # of that interval: to 1e-15
START_STIFFNESS, START_OFFSET = 13e3, 5e-3  # of the fits [N/m], [m]


@dataclass(frozen=True, eq=False)
class KneeTest:
    """One test: its muscle and what was read, SI, one number a point."""

    name: str
    muscle: Muscle
    tendon: float
    angle: np.ndarray
    torque: np.ndarray
    length: np.ndarray
    moment_arm: np.ndarray
    pressure: np.ndarray

    def __len__(self) -> int:
        return len(self.angle)


def path(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The path between the brackets, as it would be if they did not bend."""
    cos, sin, (x, z) = np.cos(angle), np.sin(angle), TIBIA_ANCHOR
    tibia = np.array([cos * x - sin * z, sin * x + cos * z])
    line = tibia + np.reshape(np.subtract(PIN, FEMUR_ANCHOR), (2, *np.ndim(angle) * (1,)))
    length = np.hypot(*line)
    return length, (line[1] * tibia[0] - line[0] * tibia[1]) / length


@functools.cache
def knee_tests() -> dict[str, KneeTest]:
    """The five tests by name, in the order of their file."""
    table = read_table(assets.folder("models") / "muscles" / "dmsp_10" / "pin_knee.csv", EXAMPLE)
    columns, _ = columns_of(table, COLUMNS, EXAMPLE)
    of_test, found = columns.pop("test"), {}
    muscle = reader.load("muscle", "dmsp_10").using(law=LAW)
    for name, (length, shortest, tendon) in MUSCLES.items():
        parameters = muscle.law_set.parameters | {"contraction_620": (length - shortest) / length}
        laws = muscle.laws | {LAW: muscle.law_set.with_values(parameters=parameters)}
        own = muscle.with_values(total_length=length, end_length=0.0, laws=laws)
        read = {key.replace(" ", "_"): x[of_test == name] for key, x in columns.items()}
        found[name] = KneeTest(name, own, tendon, **read)
    return found


def posture(test: KneeTest, *, measured: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Contraction ratio, stretched below zero, and arm without compliance: by the path, or as measured."""
    length, arm = (test.length, test.moment_arm) if measured else (_room(test), path(test.angle)[1])
    return 1.0 - length / test.muscle.nominal_length, arm


def law_force(test: KneeTest, contraction: np.ndarray) -> np.ndarray:
    """Tension by the law at the test's pressures, as it is printed for every contraction [N]."""
    f620, kappa620, _, _, c2 = test.muscle.coefficients
    signed = forces(LAWS[LAW].native_id, test.muscle.coefficients, contraction, test.pressure)
    stretch = np.minimum(contraction, 0.0) / kappa620
    return np.maximum(signed - f620 * test.pressure / 620e3 * (1.0 - np.exp(-c2 * stretch**2)), 0.0)


def rigid_torque(test: KneeTest, *, measured: bool = False) -> np.ndarray:
    """Torque without compliance [N·m]: on the path; or as measured, nothing fitted."""
    kappa, arm = posture(test, measured=measured)
    return -law_force(test, kappa) * arm


def torque(test: KneeTest, stiffness: float, offset: float = 0.0) -> np.ndarray:
    """Torque with a spring between muscle and bracket; the arm stays the path's."""
    room, law, coefficients = _room(test) - offset, LAWS[LAW].native_id, test.muscle.coefficients

    def pull(kappa: np.ndarray) -> np.ndarray:
        return stiffness * np.maximum(room - test.muscle.nominal_length * (1.0 - kappa), 0.0)

    low, high = np.full(len(test), LOCKED), np.full(len(test), EMPTY)
    for _ in range(HALVINGS):  # the law falls with κ and the pull rises
        middle = 0.5 * (low + high)
        shortens = forces(law, coefficients, middle, test.pressure) > pull(middle)
        low, high = np.where(shortens, middle, low), np.where(shortens, high, middle)
    return -pull(0.5 * (low + high)) * path(test.angle)[1]


def _room(test: KneeTest) -> np.ndarray:
    return path(test.angle)[0] - FITTINGS - test.tendon


@functools.cache
def fit(tests: tuple[KneeTest, ...], offset: bool = False) -> tuple[float, float]:
    """Stiffness, and on request offset, that fit the tests best; all points weigh the same."""

    def errors(x: np.ndarray) -> np.ndarray:
        stiffness, gives = START_STIFFNESS * math.exp(x[0]), START_OFFSET * x[1] if offset else 0.0
        return np.concatenate([torque(test, stiffness, gives) - test.torque for test in tests])

    x = least_squares(errors, (0.0, 1.0) if offset else (0.0,), xtol=1e-10, ftol=1e-10).x
    return START_STIFFNESS * math.exp(x[0]), START_OFFSET * float(x[1]) if offset else 0.0


def of_test(told: JsonMapping) -> JsonDict:
    """A test's torque: "rigid", "measured" (length, arm), or the others' "stiffness" (and "offset")."""
    test, how = knee_tests()[told["test"]], told["torque"]
    known: JsonDict = {"count": len(test)}
    if how in ("rigid", "measured"):
        found = rigid_torque(test, measured=how == "measured")
    else:
        others = tuple(each for each in knee_tests().values() if each is not test)
        stiffness, offset = fit(others, "offset" in how)
        found = torque(test, stiffness, offset)
        known |= {"stiffness": 1e-3 * stiffness, "offset": 1e3 * offset}
    known |= {"errors": found - test.torque, "rms": rms(found - test.torque)}
    known["excess"] = 100.0 * (np.abs(found).mean() / np.abs(test.torque).mean() - 1.0)
    return known | {"simulated": known[told["take"]]}


def muscles(told: JsonMapping) -> np.ndarray:
    """Errors of all torques by a law, through the simulator's own muscle at rest [N·m]."""
    errors = []
    for test in knee_tests().values():
        kappa, arm = posture(test, measured=told.get("measured", False))
        force = test.muscle.using(law=told["law"]).force(test.pressure, contraction=kappa)
        errors.append(-force * arm - test.torque)
    return np.concatenate(errors)
