"""Predictions of the ledger, by the name that a device's file gives under `predict`."""

import functools
import math
from collections.abc import Callable

import numpy as np

from afo_sim.common import RATIOS, JsonMapping, assets, parse_quantity, read_any_quantity
from afo_sim.description import Muscle, load
from afo_sim.lab.law_result import fit_laws
from afo_sim.lab.validation_knee import knee_tests, torque
from afo_sim.physics import passive_moment
from afo_sim.simulation.run import run

Table = JsonMapping
STEP = math.radians(0.1)
BRIEF = {"duration": "2.6 s"}  # hardly more than the settled strides
FITTED = "tondu_lopez_2000_bladder"  # law of a muscle that is fitted to another one's table
_OTHER = ("draw", "pressure", "rest_length")  # that are no key of a muscle


def si(text: str) -> float:
    """A quantity of whatever unit in SI; a ratio may be in per cent."""
    number, _, unit = text.partition(" ")
    return float(number) * RATIOS[unit] if unit in RATIOS else read_any_quantity(text)[0]


def muscle(of: str, drawn: Table) -> Muscle:
    """A shipped muscle, or one fitted to a table of another, with what is published and drawn."""
    own = {key: x for key, x in drawn.items() if key not in _OTHER}
    own |= {"lengths.force": None} if "end_loss" in own else {}  # measured by the bench that is predicted
    if not of.endswith(".csv"):
        return load("muscle", of, own)
    fitted, rng = _fitted(of), np.random.default_rng(drawn["draw"])
    assert fitted.covariance is not None
    values = fitted.drawn(rng.standard_normal((100, len(fitted.covariance.parameters))))
    first = int(np.argmax(fitted.legal(values)))  # of the draws that are muscles
    own |= {key.rpartition(".")[2]: float(x[first]) for key, x in values.items()}
    law = {key: own.pop(key) for key in fitted.law_set.parameters if key in own}
    used = fitted.law_set.with_values(parameters=fitted.law_set.parameters | law)
    own["total_length"] = parse_quantity(own["total_length"], "m")
    return fitted.with_values(laws=fitted.laws | {FITTED: used}, **own)


@functools.cache
def _fitted(table: str) -> Muscle:
    return fit_laws(assets.folder("models") / "muscles" / table, law=FITTED, hold_out="none").muscle


def force(of: str, at: Table, drawn: Table) -> float:
    """Force of a muscle at rest [N], at a contraction ratio or a length."""
    pressure = si(at["pressure"]) * drawn["pressure"]
    length = {key: at[key] for key in ("total_length",) if key in at}
    return float(muscle(of, {**drawn, **length}).force(pressure, contraction=contracted(at, drawn)))


def contracted(at: Table, drawn: Table) -> float:
    """The contraction ratio of a requested force [-]."""
    return 1.0 - si(at["length"]) / si(drawn["rest_length"]) if "length" in at else si(at["contraction"])


def contraction(of: str, at: Table, drawn: Table) -> float:
    """Contraction ratio of a muscle under a load at rest [-]."""
    return float(muscle(of, drawn).contraction(si(at["pressure"]), force=si(at["load"])))


def change(of: str, at: Table, drawn: Table) -> float:
    """Change of length of a muscle under a load at rest [m]."""
    return contraction(of, at, drawn) * muscle(of, drawn).nominal_length


def knee_torque(of: str, at: Table, drawn: Table) -> float:
    """Mean torque of a test on the pin knee [N·m], with a spring between muscle and brackets."""
    return -float(torque(knee_tests()[at["test"]], si(drawn["stiffness"])).mean())


def tissue(of: str, at: Table, drawn: Table) -> float:
    """Torque with which a relaxed ankle resists dorsiflexion [N·m]; of a drawn angle its slope [N·m/rad]."""
    if "angle" in drawn:
        angle, rest = si(drawn["angle"]), {key: x for key, x in drawn.items() if key != "angle"}
        ends = [tissue(of, {"angle": f"{angle + step!r} rad"}, rest) for step in (-STEP, STEP)]
        return (ends[1] - ends[0]) / (2.0 * STEP)
    return -float(passive_moment(si(at["angle"]), si(drawn["knee"]), drawn["scale"], si(drawn["zero"])))


def scenario(of: str, at: Table, drawn: Table) -> float:
    """A metric of a scenario's run; a drawn `shift` is added to it."""
    sets = {key: x for key, x in drawn.items() if key not in ("draw", "shift")}
    metric = run(of, BRIEF | sets, step="fixed").metrics[at["metric"]]
    return si(f"{float(metric)!r} {metric.unit}") + (si(drawn["shift"]) if "shift" in drawn else 0.0)


PREDICTIONS: dict[str, Callable[[str, Table, Table], float]] = {
    each.__name__.replace("_", " "): each
    for each in (force, contraction, change, knee_torque, tissue, scenario)
}
