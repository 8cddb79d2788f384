"""Warnings of a run: limits left, laws asked beyond their range, muscles that never pull, pressed skin."""

from collections.abc import Iterator, Mapping

import numpy as np

from afo_sim.common.units import LEAST_NUMBER
from afo_sim.description.muscle import Muscle
from afo_sim.description.quantity import provenance_note
from afo_sim.model.build import Built
from afo_sim.model.mounting import ANKLE, SUBTALAR, chamber_of, muscle_names
from afo_sim.physics.laws import LAWS
from afo_sim.physics.static_force import braid_force, static_force
from afo_sim.simulation.safety import skin_warnings

NEGLIGIBLE = 0.01  # share of a muscle's force limit below which its law's range does not matter
GIVES = 0.1  # stretch of a cable that takes up all that a muscle can shorten [m]
SLIGHTLY = 0.01  # of a range's upper end, by which a law may be asked beyond it


def limit_warnings(
    built: Built, columns: dict[str, np.ndarray], static: Mapping[str, np.ndarray] | None = None
) -> Iterator[str]:
    """Warnings of muscles beyond their limits of pressure, force or contraction, and of pressure on the skin.

    Units: static [N].
    """
    yield from _target_warnings(built, columns)
    time = columns["time"]
    groups = muscle_names(built.scenario.orthosis)
    for name, group in groups.items():
        limits = group.type.limits
        chamber = chamber_of(name, group)
        pressure = columns[f"chamber/{chamber}/pressure"]
        force = columns[f"muscle/{name}/force"]
        contraction = columns[f"muscle/{name}/contraction"]
        for word, key, values, limit, unit in (
            ("gauge pressure", "pressure", pressure * 1e-5, limits.pressure * 1e-5, " bar"),
            ("force", "force", force, limits.force, " N"),
            ("contraction", "contraction_max", contraction, limits.contraction_max, ""),
            ("stretch", "contraction_min", -contraction, -limits.contraction_min, ""),
        ):
            worst = int(np.argmax(values))
            if values[worst] > limit:
                yield (
                    f"{name}: {word} reaches {values[worst]:.3g}{unit} at {time[worst]:.3f} s, "
                    f"beyond its limit of {limit:.3g}{unit}{provenance_note(limits, key)}"
                )
        if name.endswith("_1"):  # its neighbours say the same
            given = (static or {}).get(name, force)
            n = len(given)
            yield from _law_warnings(name, group.type, time[:n], pressure[:n], contraction[:n], given)
            if group.type.length_warning:
                yield f"{name.rsplit('_', 1)[0]}: {group.type.length_warning}"
        filled = float(pressure.max())
        if filled > 1e5 and force.max() < 1.0:
            strongest = static_force(
                LAWS[group.type.law].native_id, 0.0, filled, [*group.type.coefficients], 0
            )
            gives = group.cable.stiffness * GIVES < strongest
            reason = (
                f"its law, {group.type.law}, gives no force at that pressure"
                if strongest <= 1.0
                else "its cable gives way; raise cable.stiffness"
                if gives
                else "its cable hangs through; shorten link_length or slack, or stiffen cuff and plate"
            )
            yield f"{name} never pulls, although its chamber reaches {filled * 1e-5:.2g} bar: {reason}"
    lower, upper = built.model.joint(ANKLE).range
    angle = columns["ankle/angle"]
    if angle.min() <= lower or angle.max() >= upper:
        yield "the ankle reaches a stop of the joint"
    if (turned := columns.get("subtalar/angle")) is not None:
        lower, upper = built.model.joint(SUBTALAR).range
        if turned.min() <= lower or turned.max() >= upper:
            yield "the foot reaches a stop of the subtalar joint (leg.subtalar.range)"
    yield from skin_warnings(built, columns)


def _target_warnings(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[str]:
    """Warnings of pressures that a drive is asked for and that can hardly be meant."""
    supply = built.scenario.supply.pressure
    for chamber in built.scenario.drive:
        asked = columns.get(f"chamber/{chamber}/target", np.zeros(0))
        most = float(np.nanmax(asked, initial=0.0))  # not a number: the drive is off
        if len(asked) and np.isnan(asked).all():
            yield (
                f"drive of chamber {chamber!r}: is never asked for a pressure, and changes nothing but the "
                "valves of a regulator: a controller asks it"
            )
        elif 0.0 < most < LEAST_NUMBER:
            yield (
                f"drive of chamber {chamber!r}: is never asked for more than {most:.3g} Pa; "
                "a command is a number of Pa: was it meant in bar?"
            )
        elif most > supply * (1.0 + SLIGHTLY):
            yield (
                f"drive of chamber {chamber!r}: is asked for up to {1e-5 * most:.3g} bar, "
                f"above the supply's {1e-5 * supply:.3g} bar, which it cannot reach"
            )


def _law_warnings(
    name: str,
    muscle: Muscle,
    time: np.ndarray,
    pressure: np.ndarray,
    contraction: np.ndarray,
    force: np.ndarray,
) -> Iterator[str]:
    """Warnings of a muscle whose law gave a force outside its range of validity."""
    law = muscle.law_set
    # stretched, the braid carries; the law is asked at zero contraction
    braid = np.zeros_like(force)
    for k in np.flatnonzero(contraction < 0.0):
        braid[k] = braid_force(contraction[k], muscle.braid_stiffness)
    pulling = force - braid > NEGLIGIBLE * muscle.limits.force
    for word, values, (lower, upper), unit in (
        ("gauge pressure", pressure * 1e-5, np.multiply(law.pressure_range, 1e-5), " bar"),
        ("contraction", np.maximum(contraction, 0.0), law.contraction_range, ""),
    ):
        beyond = np.where(pulling, np.maximum(lower - values, values - upper), -np.inf)
        worst = int(np.argmax(beyond))
        if beyond[worst] > SLIGHTLY * upper:
            yield (
                f"{name.rsplit('_', 1)[0]}: the law {muscle.law} was asked at a {word} of "
                f"{values[worst]:.3g}{unit} at {time[worst]:.3f} s, outside its range of "
                f"{lower:g} to {upper:g}{unit}"
            )
