"""Degrees or radians, by how far a knee bends in walking."""

from collections.abc import Sequence

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable

# A walking knee's range is some 60 deg, 1.05 rad (norm of 42 adults, Fukuchi 2018); the limits are derived.
HALF_TURN = 3.2  # angle that no knee reaches in radians, a little over π
LEAST_RANGE = 0.35  # of a knee that walks, stiff or not [rad], 20 deg; 0.35 deg is a knee that is locked


def angle_unit(
    table: OpenSimTable, knee_columns: Sequence[str], told: bool | None
) -> tuple[bool, tuple[str, ...]]:
    """Whether the table's rotations are in degrees, whatever its header says."""
    name, size, span = _knee(table, knee_columns)
    looks: bool | None = None
    if size > HALF_TURN:
        looks = True
    elif span >= LEAST_RANGE:
        looks = False
    says = table.degrees if told is None else told
    if told is not None:
        if looks is True and not told:
            raise InputError(
                f"the knee reaches {size:.4g}, which cannot be radians",
                file=table.file,
                field=name,
                allowed="`angles=deg`",
            )
        doubtful = looks is False and told
        seen = f"{name} has a range of {span:.3g} only: were its angles in radians, the knee would bend by "
        return told, (f"{seen}{np.degrees(span):.0f} deg",) if doubtful else ()
    if looks is None:
        if says is not None:
            return says, ()
        raise InputError(
            "does not say whether its angles are in degrees, and its knee does not tell",
            file=table.file,
            field=name,
            value=f"a range of {span:.3g}",
            allowed="`angles=deg` or `angles=rad`",
        )
    if looks is says:
        return looks, ()
    word = "degrees" if looks else "radians"
    header = "does not say the unit" if says is None else f"says {'degrees' if says else 'radians'}"
    bends = span if looks else np.degrees(span)
    return looks, (
        f"{table.file.name}: {name} has a range of {span:.3g}, so its angles are in {word} "
        f"(a knee that bends by {bends:.0f} deg); its header {header}",
    )


def _knee(table: OpenSimTable, names: Sequence[str]) -> tuple[str, float, float]:
    """The knee that moves most: its name, largest amount and range, in the file's unit."""
    found = ("", 0.0, 0.0)
    for name in names:
        values = table.columns.get(name, np.empty(0))
        known = values[np.isfinite(values)]
        if len(known) and (span := float(np.ptp(known))) >= found[2]:
            found = (name, float(np.abs(known).max()), span)
    return found
