"""What is predicted of a device of the ledger, by the name that its file gives under `predict`.

A prediction is a function of what the file names (`of`), what is published (`given`), where (`at`), and one
draw of what is not known, all numbers SI; it returns SI. A new kind is an entry of PREDICTIONS.
"""

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from afo_sim.common import assets, parse_quantity, read_any_quantity
from afo_sim.description import Muscle, load
from afo_sim.lab import validation_knee
from afo_sim.lab.law_result import fit
from afo_sim.physics import passive_moment
from afo_sim.simulation import run

Table = Mapping[str, Any]
Prediction = Callable[[str, Table, Mapping[str, str], Table], float]
SLOPE_STEP = math.radians(0.1)
BRIEF = {"duration": "2.6 s"}  # hardly more than the settled strides
_OTHER = ("draw", "specimen", "pressure", "rest_length")  # that are drawn, and no key of a muscle
FITTED = "tondu_lopez_2000_bladder"  # law of a muscle that is fitted to another one's table


def _plain(given: Table) -> dict[str, Any]:
    return {key: x["value"] if isinstance(x, Mapping) else x for key, x in given.items()}


def _muscle(of: str, given: Table, drawn: Table) -> Muscle:
    """A shipped muscle, or one fitted to a table of another, with what is published and drawn."""
    if not of.endswith(".csv"):
        return load("muscle", of, _plain(given) | {k: x for k, x in drawn.items() if k not in _OTHER})
    fitted, rng = _fitted(of), np.random.default_rng(drawn["draw"])
    assert fitted.covariance is not None
    while True:  # draws that are no muscle are drawn anew
        values = fitted.drawn(rng.standard_normal((1, len(fitted.covariance.parameters))))
        if fitted.legal(values)[0]:
            break
    one = {key: float(x[0]) for key, x in values.items()}
    law = {key.rpartition(".")[2]: x for key, x in one.items() if key.startswith("laws.")}
    own = {key: x for key, x in one.items() if not key.startswith("laws.")}
    used = fitted.law_set.with_values(parameters=fitted.law_set.parameters | law)
    length = parse_quantity(_plain(given)["total_length"], "m")
    return fitted.with_values(total_length=length, laws=fitted.laws | {FITTED: used}, **own)


@functools.cache
def _fitted(table: str) -> Muscle:
    return fit(assets.folder("models") / "muscles" / table, law=FITTED, hold_out="none").muscle


def _pressure(at: Mapping[str, str], drawn: Table) -> float:
    return parse_quantity(at["pressure"], "Pa") * float(drawn.get("pressure", 1.0))


def force(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """Force of a muscle at rest [N], at a contraction ratio or a length."""
    if "length" in at:
        contraction = 1.0 - parse_quantity(at["length"], "m") / parse_quantity(drawn["rest_length"], "m")
    else:
        contraction = parse_quantity(at["contraction"], "")
    muscle = _muscle(of, given, drawn)
    return float(muscle.force(_pressure(at, drawn), contraction=contraction)) * drawn.get("specimen", 1.0)


def contraction(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """Contraction ratio of a muscle under a load at rest [-]."""
    load_ = parse_quantity(at["load"], "N") / float(drawn.get("specimen", 1.0))
    return float(_muscle(of, given, drawn).contraction(_pressure(at, drawn), force=load_))


def change(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """Change of length of a muscle under a load at rest [m]."""
    return contraction(of, given, at, drawn) * _muscle(of, given, drawn).nominal_length


def knee_torque(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """Mean torque of a test on the pin knee [N·m], with a spring between muscle and brackets."""
    test, stiffness = validation_knee.knee_tests()[at["test"]], parse_quantity(drawn["stiffness"], "N/m")
    return -float(validation_knee.torque(test, stiffness).mean())


def tissue_torque(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """Torque with which a relaxed ankle resists dorsiflexion [N·m]."""
    return _resistance(parse_quantity(at["angle"], "rad"), drawn)


def tissue_stiffness(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """Slope of that torque over the ankle's angle [N·m/rad]."""
    angle = parse_quantity(drawn.get("angle") or at["angle"], "rad")
    rise = _resistance(angle + SLOPE_STEP, drawn) - _resistance(angle - SLOPE_STEP, drawn)
    return rise / (2.0 * SLOPE_STEP)


def _resistance(angle: float, drawn: Table) -> float:
    knee, zero = (parse_quantity(drawn[key], "rad") for key in ("knee", "zero"))
    return -float(passive_moment(angle, knee, drawn["scale"], zero))


def scenario(of: str, given: Table, at: Mapping[str, str], drawn: Table) -> float:
    """A metric of a scenario's run; a drawn `shift` is added to it."""
    sets = {key: x for key, x in drawn.items() if key not in ("draw", "shift")}
    metric = run(of, BRIEF | _plain(given) | sets).metrics[at["metric"]]
    shift = read_any_quantity(drawn["shift"])[0] if "shift" in drawn else 0.0
    return read_any_quantity(f"{float(metric)!r} {metric.unit}")[0] + shift


PREDICTIONS: dict[str, Prediction] = {
    "force": force,
    "contraction": contraction,
    "change": change,
    "knee torque": knee_torque,
    "tissue torque": tissue_torque,
    "tissue stiffness": tissue_stiffness,
    "scenario": scenario,
}
