"""A printed human-size knee that one fluidic muscle flexes: five tests by B. Bolen, their path and statics.

The knee turns about a pin. The muscle's path is one straight line from femur to tibia. The joint was held
at an angle, the muscle filled, and the torque read: 185 points with angle, torque, the muscle's own length
and the moment arm on the bent bracket.

Source
------
B. Bolen, dissertation, and its public repository (named in `pin_knee.csv`); the law is that of Bolen, Elzein,
Pang & Hunt, Actuators 2026.
"""

import functools
from dataclasses import dataclass

import numpy as np

from afo_sim.common import assets
from afo_sim.common.csv_table import number, read_table, scale_of, split_title
from afo_sim.description import reader
from afo_sim.description.muscle import Muscle
from afo_sim.physics.curves import forces
from afo_sim.physics.laws import LAWS

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
COLUMNS = {"angle": "rad", "torque": "N*m", "length": "m", "moment arm": "m", "pressure": "Pa"}
EXAMPLE = "test, angle [deg], torque [N*m], length [mm], moment arm [mm], pressure [kPa]"
LOCKED, EMPTY = -0.3, 0.6  # contraction ratios between which every balance lies
HALVINGS = 50  # of that interval: to 1e-15


@dataclass(frozen=True, eq=False)
class KneeTest:
    """One test: its muscle and what was read, SI, one number a point.

    `angle` is positive in extension and `torque` negative in flexion. `length` and `moment_arm` are the
    measured ones. `pressure` is gauge. `tendon` is the length of cable between muscle and bracket.
    """

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
    """The path between the brackets, as it would be if they did not bend.

    Units: angle [rad], returns [m].
    """
    cos, sin = np.cos(angle), np.sin(angle)
    tibia = np.array(
        [cos * TIBIA_ANCHOR[0] - sin * TIBIA_ANCHOR[1], sin * TIBIA_ANCHOR[0] + cos * TIBIA_ANCHOR[1]]
    )
    line = tibia + np.reshape(np.subtract(PIN, FEMUR_ANCHOR), (2, *np.ndim(angle) * (1,)))
    length = np.hypot(*line)
    return length, (line[1] * tibia[0] - line[0] * tibia[1]) / length


@functools.cache
def knee_tests() -> dict[str, KneeTest]:
    """The five tests by name, in the order of their file."""
    table = read_table(assets.folder("models") / "muscles" / "dmsp_10" / "pin_knee.csv", EXAMPLE)
    of_test = np.array([cells[0] for _, cells in table.rows])
    columns = {}
    for k, title in enumerate(table.titles[1:], 1):
        name = split_title(title)[0]
        scale, _ = scale_of(table.file, name, title, (COLUMNS[name],), EXAMPLE)
        values = [number(table.file, line, name, cells[k]) for line, cells in table.rows]
        columns[name.replace(" ", "_")] = scale * np.array(values)
    return {
        name: KneeTest(
            name, _muscle(*lengths), tendon, **{key: x[of_test == name] for key, x in columns.items()}
        )
        for name, (*lengths, tendon) in MUSCLES.items()
    }


def contraction_on_path(test: KneeTest) -> np.ndarray:
    """Contraction ratio that the path asks of the muscle when nothing gives way [-]; stretched below zero."""
    return 1.0 - _room(test) / test.muscle.nominal_length


def law_force(test: KneeTest, contraction: np.ndarray) -> np.ndarray:
    """Tension by the law at the test's pressures, as it is printed for every contraction [N].

    The law here leaves e^(−c2 ε²) out below κ = 0, so that a stretched muscle is not weaker; the printed
    formula has it there too.
    """
    f620, kappa620, _, _, c2 = test.muscle.coefficients
    signed = forces(LAWS[LAW].native_id, test.muscle.coefficients, contraction, test.pressure)
    stretch = np.minimum(contraction, 0.0) / kappa620
    return np.maximum(signed - f620 * test.pressure / 620e3 * (1.0 - np.exp(-c2 * stretch**2)), 0.0)


def rigid_torque(test: KneeTest) -> np.ndarray:
    """Torque when nothing gives way: contraction and arm are the path's [N·m]."""
    return -law_force(test, contraction_on_path(test)) * path(test.angle)[1]


def torque_as_measured(test: KneeTest) -> np.ndarray:
    """Torque by the law from the measured length and the measured arm: no path, nothing fitted [N·m]."""
    return -law_force(test, 1.0 - test.length / test.muscle.nominal_length) * test.moment_arm


def torque(test: KneeTest, stiffness: float, offset: float = 0.0) -> np.ndarray:
    """Torque when a spring stands between muscle and bracket; the arm stays the path's.

    The muscle is as long as its law and the spring agree on: F(κ, p) = k max(room − L0 (1 − κ), 0), where
    room is the path less fittings, tendon and offset.

    Units: stiffness [N/m], offset [m], returns [N·m].
    """
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


def _muscle(nominal_length: float, length_620: float) -> Muscle:
    """The 10 mm muscle with a test's length and its contraction at 620 kPa."""
    muscle = reader.load("muscle", "dmsp_10").using(law=LAW)
    own = {"contraction_620": (nominal_length - length_620) / nominal_length}
    law_set = muscle.law_set.with_values(parameters=muscle.law_set.parameters | own)
    return muscle.with_values(total_length=nominal_length, end_length=0.0, laws=muscle.laws | {LAW: law_set})
