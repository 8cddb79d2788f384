"""Volume of a muscle by its static law: where air does work, force and volume are not free of each other.

    ∂V/∂κ|p = L0 ∂F/∂p|κ        V = π r0² L0 + L0 ∫₀^κ ∂F/∂p dκ

is Maxwell's relation of a muscle that stores what it does not pass on, dU = p dV − F L0 dκ. A law with
another volume gives or takes work that nothing pays for. ∂F/∂p becomes a polynomial over contraction and
pressure, made once a muscle from the law's own forces. Where the braid's geometry speaks against the volume
that follows, the law's numbers are at fault, and the geometric volume stands.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, HEAT_CAPACITY_RATIO
from afo_sim.physics.curves import CONTRACTED, HALVINGS, crossing
from afo_sim.physics.guards import BAR
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Braid
from afo_sim.physics.laws import LAWS
from afo_sim.physics.pneumatics import braid_volume
from afo_sim.physics.static_force import RETURN_PRESSURE

TERMS, POWERS = 9, 5  # coefficients of ∂F/∂p by contraction, and by pressure: S2's eq. 11 has p⁵
_FIRST = 3  # place of the first of them
LAW_VOLUME = _FIRST + TERMS * POWERS  # numbers of a volume by its law
GEOMETRIC = (0.0,) * LAW_VOLUME  # of the braid's own volume
PLAUSIBLE = (0.8, 1.25)  # volume over the braid's, within which a law's is used [-]
FIT = 5e-3  # of the blocked force, by which the polynomial's forces may miss the law's [-]
STEADY = 1e-3  # share of ∂F/∂p below which its change by pressure is left out [-]
CONTRACTIONS, PRESSURES = 25, 8  # at which the law is asked
YIELDS = 0.5  # share of d ln σ/d ln p that a volume that falls with the pressure may take [-]
EQUAL = 1e-9  # share of ∂F/∂p by which it may differ from the braid's and be the same [-]


class LawVolume(NamedTuple):
    """A muscle's volume for `muscle_volume`.

    numbers : of the law's volume, or GEOMETRIC
    reason : why the law's is not used; "" where it is, or where it is the braid's own
    """

    numbers: tuple[float, ...]
    reason: str = ""


@register_jitable
def muscle_volume(
    contraction: float, pressure: float, nominal_length: float, nominal_radius: float, b: float,
    braids: float, dead_volume: float, rubber_volume: float, return_stiffness: float, u: Sequence[float],
    c: int,
) -> tuple[float, float, float]:  # fmt: skip
    """Air volume of a muscle by its law, or by its braid's geometry, and its slopes.

    Beyond the last contraction of the law's volume it goes on in a straight line; beyond the law's range of
    pressure it stays. Stretched, it follows the force there, which is the braid's or that of κ = 0. As the
    braid locks it falls smoothly to the dead volume, and stays there.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_length, nominal_radius, b : L0, r0 [m], 1/sin²α0 [-]
    braids : 1 for a law that is the braid's own formula, else 0
    dead_volume : air that never leaves [m³]
    rubber_volume : of a tube inside the braid, which does not change and is no air [m³]
    return_stiffness : k_r of the return force below 1 bar, as far as it has a volume (`returning`) [N]
    u, c : numbers of `LawVolume` start at u[c]

    Returns
    -------
    (V [m³], ∂V/∂κ [m³], ∂V/∂p [m³/Pa]), V ≥ dead_volume

    Source
    ------
    Maxwell's relation; derived by this project.
    """
    full = math.pi * nominal_radius * nominal_radius * nominal_length
    by_pressure, unknown = 0.0, 0.0 * (pressure + braids + return_stiffness)  # a NaN stays one
    if u[c] == 0.0 or (contraction < 0.0 and braids != 0.0):
        volume, slope = braid_volume(contraction, nominal_length, nominal_radius, b)
    else:
        volume, slope, by_pressure = _law_volume(contraction, pressure, nominal_length, u, c)
        volume += full
    if pressure < RETURN_PRESSURE and return_stiffness > 0.0:
        left = 1.0 - pressure / RETURN_PRESSURE if pressure > 0.0 else 1.0
        grown = nominal_length * return_stiffness * contraction / RETURN_PRESSURE  # by L0 ∂F/∂p of that force
        volume += grown * contraction * left
        slope += 2.0 * grown * left
        if pressure > 0.0:
            by_pressure -= grown * contraction / RETURN_PRESSURE
    volume, factor = _bounded(volume - rubber_volume, 0.1 * (full - rubber_volume))
    return dead_volume + volume + unknown, factor * slope, factor * by_pressure


@register_jitable
def _law_volume(
    contraction: float, pressure: float, nominal_length: float, u: Sequence[float], c: int
) -> tuple[float, float, float]:
    """L0 ∫ ∂F/∂p dκ from κ = 0 [m³], and its slopes by κ and p: (m³, m³, m³/Pa)."""
    end, per_pressure = u[c], u[c + 2]
    x = contraction / end
    x = 1.0 if x > 1.0 else 0.0 if x < 0.0 else x
    volume, slope, beyond = 0.0, 0.0, contraction - x * end
    if per_pressure == 0.0:
        for k in range(TERMS, 0, -1):
            term = u[c + _FIRST + POWERS * (k - 1)]
            slope, volume = slope * x + term, volume * x + term / k
        return nominal_length * (end * x * volume + beyond * slope), nominal_length * slope, 0.0
    y, inside = (pressure - u[c + 1]) * per_pressure, 1.0
    if y > 1.0 or y < -1.0:
        y, inside = math.copysign(1.0, y), 0.0
    volume_by, slope_by = 0.0, 0.0
    for k in range(TERMS, 0, -1):
        at = c + _FIRST + POWERS * (k - 1)
        by = u[at + 1] + (2.0 * u[at + 2] + (3.0 * u[at + 3] + 4.0 * u[at + 4] * y) * y) * y
        term = u[at] + (u[at + 1] + (u[at + 2] + (u[at + 3] + u[at + 4] * y) * y) * y) * y
        slope, volume = slope * x + term, volume * x + term / k
        slope_by, volume_by = slope_by * x + by, volume_by * x + by / k
    volume = nominal_length * (end * x * volume + beyond * slope)
    by_pressure = nominal_length * (end * x * volume_by + beyond * slope_by) * per_pressure * inside
    return volume, nominal_length * slope, by_pressure


@register_jitable
def _bounded(volume: float, blend: float) -> tuple[float, float]:
    """A volume that falls smoothly to zero and stays there, and the factor on its slopes: (m³, -).

    Units: blend, below which it leaves the given one [m³].
    """
    if volume <= 0.0:
        return 0.0, 0.0
    if volume < blend:
        x = volume / blend
        return volume * x * (2.0 - x), x * (4.0 - 3.0 * x)
    return volume, 1.0


@functools.lru_cache(maxsize=256)
def law_volume(
    law: str, coefficients: tuple[float, ...], braid: Braid, pressures: tuple[float, float],
    contractions: tuple[float, float], contraction_scale: float = 1.0, force_factor: float = 1.0,
) -> LawVolume:  # fmt: skip
    """The volume that follows from a static law, where the braid's geometry does not speak against it.

    It is used where it grows up to where the muscle goes slack, and stays within `PLAUSIBLE` of the braid's
    over the law's range. A `pleated` muscle has no braid.

    Parameters
    ----------
    law, coefficients, braid : of the muscle
    pressures, contractions : the law's range, gauge [Pa] and [-]; below 1 bar V is that at 1 bar
    contraction_scale : contraction at which the law is asked over the muscle's, whose volume this is [-]
    force_factor : of the coefficients' force over the law's, whose volume is to be plausible [-]

    Returns
    -------
    LawVolume
    """
    bare = LAWS[law].kernel
    low, high = max(pressures[0], BAR), pressures[1]
    if not low < high:
        return LawVolume(GEOMETRIC, f"its range of pressure ends at {high / BAR:.3g} bar")
    if not contractions[1] > 0.0:
        return LawVolume(GEOMETRIC, f"its range of contraction ends at {contractions[1]:.2g}")

    def kernel(kappa: float, pressure: float, *coefficients: float) -> float:
        return bare(contraction_scale * kappa, pressure, *coefficients)

    def added(kappa: float) -> float:
        """Force that the range of pressure adds [N]."""
        return kernel(kappa, high, *coefficients) - kernel(kappa, low, *coefficients)

    if _is_the_braids(added, braid, high - low, contractions):
        return LawVolume(GEOMETRIC)
    slack = crossing(lambda kappa: kernel(kappa, high, *coefficients), (), 0.0, CONTRACTED, HALVINGS)
    top, gauges = max(contractions[1], slack), np.linspace(low, high, PRESSURES)
    for _ in range(2):  # again up to where the volume would fall
        kappas = np.linspace(0.0, top, CONTRACTIONS)
        forces = np.array([[kernel(a, p, *coefficients) for p in gauges.tolist()] for a in kappas.tolist()])
        if not np.isfinite(forces).all():
            return LawVolume(GEOMETRIC, "its force is not a number everywhere in its range")
        terms, slopes = _fitted(forces, high - low)
        falls = np.flatnonzero(slopes.min(axis=1) <= 0.0)
        top = float(kappas[falls[0]]) if falls.size else top
        if not falls.size or top == 0.0:
            break
    used, end = min(contractions[1], slack), float(kappas[-1])  # of this fit
    if top < used - 2.0 * used / CONTRACTIONS:
        return LawVolume(GEOMETRIC, f"its volume would fall from a contraction ratio of {top:.2g} on")
    if not LAWS[law].pleated and (
        reason := _implausible(braid, forces / force_factor, slopes / force_factor, kappas, gauges, used)
    ):
        return LawVolume(GEOMETRIC, reason)
    per_pressure = 2.0 / (high - low) if terms[:, 1:].any() else 0.0
    return LawVolume((end, 0.5 * (high + low), per_pressure, *terms.ravel().tolist()))


def returning(return_stiffness: float, braid: Braid, contraction: float, rubber_volume: float = 0.0) -> float:
    """The part of a return force that has a volume: all of it, or nothing [N].

    That volume falls as the pressure rises. Where σ = p V^γ would hardly rise with the pressure, up to a
    contraction ratio, no pressure could be found, and the force stays without a volume.

    Units: return_stiffness [N], contraction [-], rubber_volume [m³].
    """
    volume = braid_volume(contraction, braid.nominal_length, braid.nominal_radius, braid.b)[0] - rubber_volume
    absolute = RETURN_PRESSURE + AMBIENT_PRESSURE
    given = return_stiffness * braid.nominal_length * (contraction / RETURN_PRESSURE) ** 2
    return return_stiffness if HEAT_CAPACITY_RATIO * absolute * given <= YIELDS * volume else 0.0


def _is_the_braids(
    force: Callable[[float], float], braid: Braid, span: float, contractions: tuple[float, float]
) -> bool:
    """Whether the force that a span of pressure [Pa] adds is that of the braid's geometry, as of S1's law."""
    for kappa in np.linspace(0.0, max(contractions[1], 0.1), 5).tolist():
        slope = braid_volume(kappa, braid.nominal_length, braid.nominal_radius, braid.b)[1] * span
        if not abs(braid.nominal_length * force(kappa) - slope) <= EQUAL * abs(slope):
            return False
    return True


def _fitted(forces: np.ndarray, span: float) -> tuple[np.ndarray, np.ndarray]:
    """∂F/∂p [N/Pa]: terms by powers of κ over its end and of p, −1…1 (TERMS, POWERS); at each κ and p."""
    x, y = np.linspace(0.0, 1.0, CONTRACTIONS), np.linspace(-1.0, 1.0, PRESSURES)
    by_pressure = np.polynomial.polynomial.polyfit(y, forces.T, POWERS)
    rates = np.arange(1.0, POWERS + 1.0)[:, None] * by_pressure[1:] * 2.0 / span
    if np.abs(rates[1:]).max() < STEADY * np.abs(rates[0]).max():
        rates[0], rates[1:] = (forces[:, -1] - forces[:, 0]) / span, 0.0
    terms = np.polynomial.polynomial.polyfit(x, rates.T, TERMS - 1)
    return terms, np.polynomial.polynomial.polygrid2d(x, y, terms)


def _implausible(
    braid: Braid, forces: np.ndarray, slopes: np.ndarray, kappas: np.ndarray, gauges: np.ndarray, used: float
) -> str:
    """Why the braid's geometry speaks against the volume of a law, up to the contraction `used`; or ""."""
    step, span = kappas[1], np.diff(gauges)
    between = np.cumsum(0.5 * (slopes[:, 1:] + slopes[:, :-1]) * span, axis=1)
    missed = np.abs(between - (forces[:, 1:] - forces[:, :1])).max()
    if missed > FIT * forces.max():
        return f"∂F/∂p is not a smooth function: its forces are missed by {missed:.2g} N"
    full = math.pi * braid.nominal_radius**2 * braid.nominal_length
    grown = np.cumsum(0.5 * (slopes[1:] + slopes[:-1]) * step, axis=0)
    volume = full + braid.nominal_length * np.vstack([np.zeros(PRESSURES), grown])
    geometric = [braid_volume(k, braid.nominal_length, braid.nominal_radius, braid.b)[0] for k in kappas]
    ratio = (volume / np.array(geometric)[:, None])[kappas <= used + 1e-9]
    off = np.maximum(ratio / PLAUSIBLE[1], PLAUSIBLE[0] / ratio)
    shrinks = -np.diff(np.log(np.maximum(volume, 1e-12)), axis=1) / np.diff(np.log(gauges + AMBIENT_PRESSURE))
    if off.max() <= 1.0 and HEAT_CAPACITY_RATIO * shrinks.max() > YIELDS:
        return "its volume would shrink as the pressure rises"
    k, p = np.unravel_index(np.argmax(off), off.shape)
    if off[k, p] <= 1.0:
        return ""
    return (
        f"its volume would be {ratio[k, p]:.2f} of the braid's at a contraction ratio of {kappas[k]:.2g} and "
        f"{gauges[p] / BAR:.3g} bar"
    )
