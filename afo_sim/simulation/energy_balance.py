"""Energy balance of an orthosis over any stretch of recorded rows, and its metrics.

    air_work + law_mismatch
        = skeleton_work + damper_loss + friction_loss + wrap_loss + spring_change + bladder_change

It is each muscle's F_static(κ, p) = T + c κ̇ + F_friction over its way L0 dκ, what is in series with it up to
the path, and what the path's guides take of T. What is found nowhere is `residual`. The integrals are
trapezoidal over the rows: rows that are further apart than the time step close less well.
"""

import functools
import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim import native
from afo_sim.description import Muscle, MuscleGroup, Orthosis, at_rest
from afo_sim.metrics import Metric, Window, cut, energy_metrics, settled, whole_cycles
from afo_sim.metrics.strides import strides
from afo_sim.model import Built, chamber_of, muscle_names
from afo_sim.physics import DAMPER_COEFFICIENTS, AtRest, energies, row, signed_forces
from afo_sim.simulation.rollout import Rollout

Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Energy:
    """Works and energies of a stretch [J]."""

    air_work: float = 0.0
    skeleton_work: float = 0.0
    damper_loss: float = 0.0
    friction_loss: float = 0.0
    spring_change: float = 0.0
    bladder_change: float = 0.0
    law_mismatch: float = 0.0
    turnover: float = 0.0
    wrap_loss: float = 0.0

    @property
    def residual(self) -> float:
        """Work of air and law that is found nowhere [J]."""
        given = self.air_work + self.law_mismatch
        taken = self.skeleton_work + self.damper_loss + self.friction_loss + self.wrap_loss
        return given - taken - self.spring_change - self.bladder_change

    @property
    def error(self) -> float:
        """Residual as a share of the air's turnover [-]; not a number where the air does not work."""
        return self.residual / self.turnover if self.turnover > 0.0 else float("nan")


def balance(built: Built, columns: Columns, static: Columns | None = None) -> Energy:
    """Energy balance of a run, or of a part of it."""
    return balance_of(built.scenario.orthosis, columns, static)


def balance_of(orthosis: Orthosis, columns: Columns, static: Columns | None = None) -> Energy:
    """As `balance`, from the description of the orthosis alone."""
    return balances(orthosis, columns, static or {}, [Window(0.0, len(columns["time"]) - 1)])[0]


def balances(
    orthosis: Orthosis, columns: Columns, static: Columns, windows: Sequence[Window]
) -> list[Energy]:
    """Energy balance of each of some stretches, which may begin and end between two rows."""
    leading, numbers = _numbers(orthosis)
    rows = [columns["time"]]
    if not len(rows[0]):
        return [Energy()] * len(windows)
    for name in orthosis.chamber:
        rows += [columns[f"chamber/{name}/pressure"], columns[f"chamber/{name}/volume"]]
    for name, group in leading.items():
        contraction, force = columns[f"muscle/{name}/contraction"], columns[f"muscle/{name}/force"]
        law = static.get(name)
        if law is None:
            law = law_forces(group.type, contraction, columns[f"chamber/{chamber_of(name, group)}/pressure"])
        # without friction at its guides a muscle has no tension but its own
        felt = columns.get(f"muscle/{name}/joint_force", force)
        rows += [contraction, force, felt, columns[f"muscle/{name}/path_length"], law]
    rows += [columns[f"cuff/{name}/displacement"] for name in orthosis.anchor]
    parts, counts = [(part.start, part.end) for part in windows], (len(orthosis.chamber), len(leading))
    found = energies(numbers, np.array(rows), np.array(parts, dtype=float), *counts, len(orthosis.anchor))
    return [Energy(*terms) for terms in found.tolist()]


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _numbers(orthosis: Orthosis) -> tuple[dict[str, MuscleGroup], np.ndarray]:
    """Muscles that are balanced, of alike ones the first; and the numbers of these and the anchors."""
    leading: dict[str, MuscleGroup] = {}
    found, chambers = np.zeros(0), [*orthosis.chamber]
    for name, group in muscle_names(orthosis).items():
        if group.alike and not name.endswith("_1"):
            continue
        leading[name], (rest, own) = group, _own(group.type)
        like = group.count if group.alike else 1
        pressure = 1 + 2 * chambers.index(chamber_of(name, group))  # its column
        found = np.r_[found, row(rest, group.cable.stiffness, like), pressure, own]
    for mounting in orthosis.anchor.values():
        law = mounting.stiffening
        force, length = (0.0, 0.0) if law is None else (law.force, law.length)
        found = np.r_[found, mounting.stiffness or 0.0, force, length, mounting.damping]
    return leading, found


@functools.lru_cache(maxsize=32)
def _own(muscle: Muscle) -> tuple[AtRest, tuple[float, ...]]:
    """A muscle at rest, and what `energies` asks beside that."""
    damper = (0.0,) * DAMPER_COEFFICIENTS if muscle.damper is None else muscle.damper.coefficients
    own = float(muscle.friction != "none"), muscle.damping, muscle.returning, muscle.rubber_volume
    return at_rest(muscle), (*own, *damper, *muscle.law_volume.numbers)


def law_forces(muscle: Muscle, contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Signed static force of a muscle in each row [N]."""
    return signed_forces(contraction, pressure, row(_own(muscle)[0]))


SHORT, LOCKED = 0.89, 0.99  # contraction, and share of the lock, beyond which the solve clips a muscle


def with_static_forces(built: Built, rollout: Rollout, columns: Columns) -> tuple[Columns, Columns]:
    """Rows of a run for its balance: (columns, signed static force of each leading muscle [N])."""
    rows = cut(columns, operator.itemgetter(slice(-1)))
    found = {}
    for name, group in _numbers(built.scenario.orthosis)[0].items():
        carried = native.read_carried(built.model, rollout.rows["act"][1:], built.index.muscles[name])
        contraction, static = rows[f"muscle/{name}/contraction"], rows[f"muscle/{name}/force"] + carried
        clipped = (contraction > SHORT) | (contraction < LOCKED * group.type.braid.lock)
        if clipped.any():
            pressure = rows[f"chamber/{chamber_of(name, group)}/pressure"][clipped]
            static[clipped] = law_forces(group.type, contraction[clipped], pressure)
        found[name] = static
    return rows, found


def balance_metrics(
    built: Built, columns: Columns, static: Columns, period: float
) -> tuple[Energy, dict[str, Metric]]:
    """Energy balance of a run, and its metrics: none where no stride counts, or one is not finite."""
    last, timestep = len(columns["time"]) - 1, built.scenario.timestep
    number, parts = 0, [Window(0.0, last)]
    if built.walk is None:
        number, part = whole_cycles(last + 2, timestep, period)  # the run's last row is left out
        parts += [Window(part.start, min(part.end, last))]
    elif counted := settled(columns, strides(columns, timestep, built.body_mass)):
        number, end = len(counted), min(counted[-1].whole.end, last)
        parts += [Window(counted[0].whole.start, end)]
    whole, *counts = balances(built.scenario.orthosis, columns, static, parts)
    guided = any(group.path for group in built.scenario.orthosis.muscle.values())
    left_out = {"turnover"} if guided else {"turnover", "wrap_loss"}
    found: dict[str, Metric] = {}
    for energy in counts:
        terms = {name: value for name, value in vars(energy).items() if name not in left_out}
        found = energy_metrics(terms, number, whole.error)
    return whole, found if all(map(math.isfinite, found.values())) else {}
