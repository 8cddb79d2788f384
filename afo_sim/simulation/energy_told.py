"""The energy balance of a run at every step, as metrics: cheap, since the run knows its muscles' forces."""

import math
from dataclasses import fields

from afo_sim import native
from afo_sim.metrics.energy import energy_metrics
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.strides import settled, strides
from afo_sim.model.build import Built
from afo_sim.model.inversion import free
from afo_sim.model.mounting import chamber_of, muscle_names
from afo_sim.simulation.energy import Columns, Energy, balance, law_forces
from afo_sim.simulation.rollout import Rollout

SHORT, LOCKED = 0.89, 0.99  # contraction, and share of the lock, beyond which the solve clips a muscle


def with_static_forces(built: Built, rollout: Rollout, columns: Columns) -> tuple[Columns, Columns]:
    """Rows of a run for its balance: (columns, signed static force of each leading muscle [N]).

    The state after a step holds what the law gave in it beyond the tension. So the last row is left out.
    """
    rows = {name: values[:-1] for name, values in columns.items()}
    found, inverts = {}, free(built.scenario)
    for name, group in muscle_names(built.scenario.orthosis).items():
        if group.alike and not inverts and not name.endswith("_1"):
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


def told_energy(
    built: Built, columns: Columns, static: Columns, whole: Energy, period: float
) -> dict[str, Metric]:
    """Metrics of a run's balance; none where it does not walk a stride that counts, or is not finite.

    Units: period [s].
    """
    part, number = whole, 1
    if built.walk is not None:
        counted = settled(columns, strides(columns, built.scenario.timestep, built.body_mass))
        if not counted:
            return {}
        number = len(counted)
        rows = slice(counted[0].rows.start, counted[-1].rows.stop + 1)  # both ends of the cycles
        part = balance(built, _cut(columns, rows), _cut(static, rows))
    else:
        number = max(math.ceil((columns["time"][-1] + built.scenario.timestep) / period - 1e-9), 1)
    guided = any(group.path for group in built.scenario.orthosis.muscle.values())
    left_out = {"turnover"} if guided else {"turnover", "wrap_loss"}
    terms = {field.name: getattr(part, field.name) for field in fields(part) if field.name not in left_out}
    told = energy_metrics(terms, number, whole.error)
    return told if all(map(math.isfinite, told.values())) else {}


def _cut(columns: Columns, rows: slice) -> Columns:
    return {name: values[rows] for name, values in columns.items()}
