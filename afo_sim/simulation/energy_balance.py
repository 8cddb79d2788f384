"""Energy balance of an orthosis over any stretch of recorded rows, and its metrics.

    air_work + law_mismatch
        = skeleton_work + damper_loss + friction_loss + wrap_loss + spring_change + bladder_change

It is each muscle's F_static(κ, p) = T + c κ̇ + F_friction over its way L0 dκ, what is in series with it up to
the path, and what the path's guides take of T. What is found nowhere is `residual`. The integrals are
trapezoidal over the rows: rows that are further apart than the time step close less well.
"""

import itertools
import math
import operator
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, fields

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.description import Mounting, Muscle, MuscleGroup, Orthosis, at_rest
from afo_sim.metrics import Metric, Window, cut, energy_metrics, increments, settled, whole_cycles
from afo_sim.metrics.strides import strides
from afo_sim.model import Built, chamber_of, muscle_names
from afo_sim.physics import RETURN_PRESSURE, SLACK_BLEND, anchor_energy, three_element_damping
from afo_sim.simulation.rollout import Rollout

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)  # of a smooth piece of the bladder's force

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
    muscles = _muscles(orthosis, columns, static or {})
    parts = [*_chambers(orthosis, columns), *muscles, *_anchors(orthosis, columns)]
    return Energy(*map(sum, zip(*map(astuple, parts), strict=True)))


def _chambers(orthosis: Orthosis, columns: Columns) -> Iterator[Energy]:
    for name in orthosis.chamber:
        steps = increments(columns[f"chamber/{name}/pressure"], columns[f"chamber/{name}/volume"])
        work = float(steps.sum())
        # the mismatch is what the laws give beyond this work
        yield Energy(air_work=work, law_mismatch=-work, turnover=float(np.abs(steps).sum()))


def _muscles(orthosis: Orthosis, columns: Columns, known: Columns) -> Iterator[Energy]:
    for name, group in orthosis.muscle.items():
        pressure = columns[f"chamber/{group.chamber or name}/pressure"]
        # of alike muscles the first tells of all
        alike = 1 if group.alike else group.count
        for k in range(1, alike + 1):
            muscle = f"muscle/{name}_{k}"
            force, contraction = columns[f"{muscle}/force"], columns[f"{muscle}/contraction"]
            static = known.get(f"{name}_{k}")
            if static is None:
                static = law_forces(group.type, contraction, pressure)
            own = {"force": force, "contraction": contraction, "static": static, "pressure": pressure}
            # without friction at its guides a muscle has no tension but its own
            own["felt"] = columns.get(f"{muscle}/joint_force", force)
            own |= {"path_length": columns[f"{muscle}/path_length"], "time": columns["time"]}
            yield _muscle(group, own, group.count if alike == 1 else 1)


def law_forces(muscle: Muscle, contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Signed static force of a muscle in each row [N]."""
    law, rows = at_rest(muscle), zip(contraction.tolist(), pressure.tolist(), strict=True)
    return np.array([law.signed(kappa, gauge) for kappa, gauge in rows])


def _muscle(group: MuscleGroup, own: Columns, count: int) -> Energy:
    """Terms of `count` muscles that are alike."""
    muscle, contraction, tension, static = group.type, own["contraction"], own["force"], own["static"]
    nominal, first, last = muscle.nominal_length, float(contraction[0]), float(contraction[-1])
    # ∫ F(κ, p = 0) dκ from the first to the last contraction [N], whatever lies between
    low, high = min(first, last), max(first, last)
    ends = [low, *(kink for kink in (-SLACK_BLEND, 0.0) if low < kink < high), high]
    law, total = at_rest(muscle), 0.0
    for start, end in itertools.pairwise(ends):
        half, middle = 0.5 * (end - start), 0.5 * (end + start)
        forces = [law.signed(kappa, 0.0) for kappa in (middle + half * NODES).tolist()]
        total += half * float(WEIGHTS @ forces)
    stored = nominal * (total if first < last else -total)
    for at, sign in ((0, 1.0), (-1, -1.0)):  # and ∫ p ∂V/∂p dp to either end's pressure
        end = float(own["pressure"][at])
        gauges = np.sort([*np.linspace(0.0, end, 41), min(end, RETURN_PRESSURE)])  # where the slope jumps
        stored += sign * _integral(gauges, muscle.volume(contraction=float(contraction[at]), pressure=gauges))
    damper = nominal * _damped(muscle, own["time"], own["pressure"], contraction)
    rubbed = 0.0
    if muscle.friction != "none":
        rubbed = nominal * _integral(static - tension, contraction) - damper
    return Energy(
        skeleton_work=-count * _integral(own["felt"], own["path_length"]),
        wrap_loss=count * float(wrap_heat(tension, own["felt"], own["path_length"]).sum()),
        damper_loss=count * damper,
        friction_loss=count * rubbed,
        spring_change=count * 0.5 * float(tension[-1] ** 2 - tension[0] ** 2) / group.cable.stiffness,
        bladder_change=-count * stored,
        law_mismatch=count * (nominal * _integral(static, contraction) - stored),
    )


def wrap_heat(tension: np.ndarray, felt: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Heat of friction at a path's guides in each step from row to row [J] (n − 1,), never negative."""
    found: np.ndarray = (felt - tension)[1:] * (path[1:] - path[:-1])
    return found


def _damped(muscle: Muscle, time: np.ndarray, pressure: np.ndarray, contraction: np.ndarray) -> float:
    """∫ c κ̇ dκ of a muscle's dampers [N], from the mean pressure and rate between two rows."""
    moved, gauge = contraction[1:] - contraction[:-1], 0.5 * (pressure[1:] + pressure[:-1])
    rate = moved / (time[1:] - time[:-1])
    coefficient = muscle.damping * (gauge + AMBIENT_PRESSURE)
    if muscle.damper is not None:
        further = [
            three_element_damping(p, v, *muscle.damper.coefficients) for p, v in zip(gauge, rate, strict=True)
        ]
        coefficient = coefficient + muscle.nominal_length * np.array(further)
    return float(np.sum(coefficient * rate * moved))


def _anchors(orthosis: Orthosis, columns: Columns) -> Iterator[Energy]:
    for name, mounting in orthosis.anchor.items():
        moved = columns[f"cuff/{name}/displacement"]
        steps = np.diff(moved)
        yield Energy(
            spring_change=_held(mounting, float(moved[-1])) - _held(mounting, float(moved[0])),
            damper_loss=float(np.sum(mounting.damping * steps**2 / np.diff(columns["time"]))),
        )


def _held(mounting: Mounting, displacement: float) -> float:
    """Energy in a cuff or plate [J]."""
    law = mounting.stiffening
    force, length = (0.0, 0.0) if law is None else (law.force, law.length)
    return anchor_energy(displacement, mounting.stiffness or 0.0, force, length)


def _integral(values: np.ndarray, over: np.ndarray) -> float:
    return float(increments(values, over).sum())


SHORT, LOCKED = 0.89, 0.99  # contraction, and share of the lock, beyond which the solve clips a muscle


def with_static_forces(built: Built, rollout: Rollout, columns: Columns) -> tuple[Columns, Columns]:
    """Rows of a run for its balance: (columns, signed static force of each leading muscle [N])."""
    rows = cut(columns, operator.itemgetter(slice(-1)))
    found = {}
    for name, group in muscle_names(built.scenario.orthosis).items():
        if group.alike and not name.endswith("_1"):
            continue
        muscle = built.index.muscles[name]
        carried = native.read_carried(built.model, rollout.rows["act"][1:], muscle)
        contraction, static = rows[f"muscle/{name}/contraction"], rows[f"muscle/{name}/force"] + carried
        clipped = (contraction > SHORT) | (contraction < LOCKED * group.type.braid.lock)
        if clipped.any():
            pressure = rows[f"chamber/{chamber_of(name, group)}/pressure"][clipped]
            static[clipped] = law_forces(group.type, contraction[clipped], pressure)
        found[name] = static
    return rows, found


def balance_metrics(
    built: Built, columns: Columns, static: Columns, whole: Energy, period: float
) -> dict[str, Metric]:
    """Metrics of a run's balance; none where it does not walk a stride that counts, or is not finite."""
    last, timestep = len(columns["time"]) - 1, built.scenario.timestep
    if built.walk is not None:
        counted = settled(columns, strides(columns, timestep, built.body_mass))
        if not counted:
            return {}
        number, part = len(counted), Window(counted[0].whole.start, counted[-1].whole.end)
    else:
        number, part = whole_cycles(last + 2, timestep, period)  # the run's last row is left out
    part = Window(part.start, min(part.end, last))
    counts = whole
    if part != Window(0.0, last):
        counts = balance(built, cut(columns, part.of), cut(static, part.of))
    guided = any(group.path for group in built.scenario.orthosis.muscle.values())
    left_out = {"turnover"} if guided else {"turnover", "wrap_loss"}
    terms = {field.name: getattr(counts, field.name) for field in fields(whole) if field.name not in left_out}
    reported = energy_metrics(terms, number, whole.error)
    return reported if all(map(math.isfinite, reported.values())) else {}
