"""A muscle at rest: its force and what inverts it, and its tension behind what gives way.

    κ = κ_path + [F/k + Σ z(n F)]/L0,    F = max(F_static(κ, p), 0)

κ_path is the contraction ratio that the path leaves it, k its cable, z what cuff and plate give under the
pull of n such muscles. F falls with κ, so the right side less the left falls, too: there is one κ, and
bisection finds it. The tension is the law's at that κ. A muscle without tension is slack, and κ = κ_path.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.physics.curves import CONTRACTED, HALVINGS, crossing
from afo_sim.physics.jitable import kernels, register_jitable
from afo_sim.physics.law import MAX_COEFFICIENTS, Braid
from afo_sim.physics.series import anchor_displacement
from afo_sim.physics.static_force import signed_force


@dataclass(frozen=True)
class AtRest:
    """Force law, braid stiffness and return force as the compiled muscle computes them, in tension only.

    `law` is the native id, whose `coefficients` follow; `lowest_pressure` [Pa] is that of the law's range,
    `braid_stiffness` [N] acts when the braid is stretched, `return_stiffness` [N] without air.
    `contraction_scale` [-] takes the muscle's contraction to its law's. `rubber` is the stiffness [N], the
    bore and the turn [-] of a tube, as `rubber_force` takes them.
    """

    law: float
    coefficients: Sequence[float]
    lowest_pressure: float
    braid_stiffness: float
    return_stiffness: float
    braid: Braid
    braids: float
    contraction_scale: float = 1.0
    rubber: tuple[float, float, float] = (0.0, 1.0, 0.0)

    def force(self, contraction: float, pressure: float) -> float:
        """Tension [N], ≥ 0, at a contraction ratio [-] and a gauge pressure [Pa]."""
        signed = self.signed(contraction, pressure)
        return 0.0 if signed < 0.0 else signed  # a NaN comes out here

    def signed(self, contraction: float, pressure: float) -> float:
        """Force [N], negative where the muscle is slack, at a contraction ratio and a gauge pressure [Pa]."""
        return signed_force(
            self.law, contraction, pressure, self.lowest_pressure, self.return_stiffness,
            self.braid_stiffness, self.braid.nominal_radius, self.braid.b, self.braids,
            self.contraction_scale, *self.rubber, self.coefficients, 0,
        )[0]  # fmt: skip

    def contraction(self, pressure: float, force: float, most_stretched: float) -> float:
        """Contraction ratio [-] at which a force [N] is carried at a gauge pressure [Pa].

        Between `most_stretched` and 0.7; of no force, where the muscle goes slack; NaN when none carries it.
        """
        if not (0.0 <= force <= self.force(most_stretched, pressure)):
            return float("nan")
        return crossing(
            lambda kappa: self.force(kappa, pressure) - force, (), most_stretched, CONTRACTED, HALVINGS
        )

    def pressure(self, force: float, contraction: float, highest: float) -> float:
        """Lowest gauge pressure [Pa], up to `highest`, that carries a force [N]; NaN when none does."""
        if not (0.0 <= force <= self.force(contraction, highest)):
            return float("nan")
        if self.force(contraction, 0.0) >= force:
            return 0.0
        return crossing(lambda gauge: force - self.force(contraction, gauge), (), 0.0, highest, HALVINGS)


_COEFFICIENTS = 20  # place of a row's first coefficient of the law
OF_ROW = _COEFFICIENTS + MAX_COEFFICIENTS  # numbers of a row
_SHORTEST = 0.9  # contraction ratio that no muscle reaches
_RIGID = (math.inf, 0.0, 0.0)  # stiffness, force and length of an anchor that does not give


def row(
    bare: AtRest, cable: float = math.inf, count: float = 1.0, anchors: Sequence[tuple[float, ...]] = ()
) -> np.ndarray:
    """Numbers of a muscle behind its cable and at most two anchors, for the functions below.

    Parameters
    ----------
    bare : the muscle
    cable : k [N/m]; infinite for one that does not give
    count : n, alike muscles that pull on the anchors together
    anchors : of each its stiffness [N/m], or 0 and then force a [N] and length x0 [m] of a (e^(z/x0) − 1)

    Returns
    -------
    (OF_ROW,) [SI]: law, lowest pressure, return and braid stiffness, radius, b and
    braids of the muscle; nominal length, k, n; three numbers of each anchor; contraction_scale; three of the
    rubber; the law's coefficients
    """
    found = np.zeros(OF_ROW)
    found[:7] = (
        bare.law, bare.lowest_pressure, bare.return_stiffness, bare.braid_stiffness,
        bare.braid.nominal_radius, bare.braid.b, bare.braids,
    )  # fmt: skip
    found[7:10] = bare.braid.nominal_length, cable, count
    found[10:16] = np.ravel([*anchors, _RIGID, _RIGID][:2])
    found[16:_COEFFICIENTS] = bare.contraction_scale, *bare.rubber
    found[_COEFFICIENTS : _COEFFICIENTS + len(bare.coefficients)] = bare.coefficients
    return found


def on_anchors(u: np.ndarray, anchors: Sequence[tuple[float, ...]]) -> np.ndarray:
    """A copy of a row whose muscle pulls on other anchors, as `row` takes them."""
    found = u.copy()
    found[10:16] = np.ravel([*anchors, _RIGID, _RIGID][:2])
    return found


@register_jitable
def signed_at(kappa: float, pressure: float, u: Any, m: int) -> float:
    """Signed force of the muscle whose row starts at u[m], at its own κ and a gauge pressure [Pa] [N]."""
    of_braid = u[m + 2], u[m + 3], u[m + 4], u[m + 5], u[m + 6], u[m + 16], u[m + 17], u[m + 18], u[m + 19]
    return signed_force(u[m], kappa, pressure, u[m + 1], *of_braid, u, m + _COEFFICIENTS)[0]


@register_jitable
def _tension_at(kappa: float, pressure: float, u: Any) -> float:
    """Tension of the muscle of a row at its own contraction ratio and a gauge pressure [Pa], ≥ 0 [N]."""
    force = signed_at(kappa, pressure, u, 0)
    return 0.0 if force < 0.0 else force  # a NaN comes out here


@register_jitable
def _excess(kappa: float, path: float, pressure: float, u: Any) -> float:
    """κ_path + [F/k + Σ z(n F)]/L0 − κ at an own contraction ratio κ [-]; it falls as κ rises."""
    force = _tension_at(kappa, pressure, u)
    pull, given = u[9] * force, force / u[8]
    given += anchor_displacement(pull, u[10], u[11], u[12], 0.0, 0.0, 0.0, 1.0)[0]
    given += anchor_displacement(pull, u[13], u[14], u[15], 0.0, 0.0, 0.0, 1.0)[0]
    return path + given / u[7] - kappa


@register_jitable
def _balanced(path: float, pressure: float, u: Any) -> float:
    """Own contraction ratio [-] of the muscle of a row, from that of its path and a gauge pressure [Pa]."""
    if not path < _SHORTEST:
        return path  # slack, or not a number
    return crossing(_excess, (path, pressure, u), path, _SHORTEST, HALVINGS)


def tension(path: float, pressure: float, u: np.ndarray) -> float:
    """Tension [N] at rest of the muscle of a row; uncompiled, for a few points."""
    return _tension_at(_balanced(path, pressure, u), pressure, u)


def tensions(path: np.ndarray, pressure: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Tension at rest of the muscle of a row, compiled.

    Parameters
    ----------
    path : contraction ratio that the path leaves muscle and series elements together [-] (n,)
    pressure : gauge [Pa] (n,)
    u : from `row`

    Returns
    -------
    [N] (n,), ≥ 0
    """
    return _over(0, path, pressure, u)


def signed_forces(contraction: np.ndarray, pressure: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Signed force [N] (n,) of the muscle of a row; arguments as in `tensions`, contraction its own."""
    return _over(1, contraction, pressure, u)


def _over(which: int, *arguments: np.ndarray) -> np.ndarray:
    path, pressure, u = (np.ascontiguousarray(values, dtype=float) for values in arguments)
    out = np.empty(len(path))
    compiled_tensions()[which](0.0, *(array.ctypes.data for array in (u, path, pressure, out)), out.size)
    return out


def _tension_curve(unused: float, u: Any, path: Any, pressure: Any, out: Any, size: int) -> float:
    for k in range(size):
        out[k] = _tension_at(_balanced(path[k], pressure[k], u), pressure[k], u)
    return unused


def _signed_curve(unused: float, u: Any, contraction: Any, pressure: Any, out: Any, size: int) -> float:
    for k in range(size):
        out[k] = signed_at(contraction[k], pressure[k], u, 0)
    return unused


compiled_tensions = kernels("in_series", _tension_curve, _signed_curve)
