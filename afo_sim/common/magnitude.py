"""The one gate that every number of a file passes: finite, and of a magnitude that something can have."""

from typing import TYPE_CHECKING

from afo_sim.common.errors import InputError
from afo_sim.common.open_types import Given

if TYPE_CHECKING:
    import numpy as np

LARGEST = 1e12  # in any unit that people record in (mm, N·mm, ms, Pa): beyond it products overflow
LEAST = 1e-30  # in such a unit: below it a number is a filter's rest of 0, and its inverse overflows
# {SI unit: an example, shown when a quantity is refused; least magnitude that is not 0; largest magnitude};
# any other unit has the two above
UNITS = {
    "m": ("21.5 cm", 1e-10, 1e6),  # an atom; a week's walk
    "m^2*s": ("2e-4 m^2*s", 1e-12, 1e3),  # damping of a muscle's area
    "m^3": ("3 ml", 1e-12, 1e3),  # a thousandth of a cubic millimetre; a hall
    "m^3/(s*Pa)": ("0.055 dm^3/(s*bar)", 1e-15, 1e-3),  # a leak of 8 ml a day at 1 bar; a nozzle of a metre
    "m^3/s": ("100 l/min", 1e-12, 1e3),  # four millilitres of leakage in fifty days; a river
    "rad": ("22 deg", 1e-9, 1e6),  # a hundredth of what an encoder resolves; a day of turns
    "s": ("4 s", 1e-9, 1e9),  # a thousandth of the shortest time step; thirty years
    "Hz": ("100 Hz", 1e-6, 1e9),  # once in twelve days; a processor's clock
    "Pa": ("4 bar", 1e-3, 1e10),  # a hundred-millionth of the air's; a hundred times what breaks steel
    "N": ("136 N", 1e-9, 1e9),  # weight of a grain of dust; of a ship
    "N/Pa": ("254.7 N/bar", 1e-14, 1e4),  # areas
    "N/m": ("5.71 N/mm", 1e-6, 1e12),  # a cobweb; no spring
    "N/(m*Pa)": ("0.0307 N/(mm*kPa)", 1e-12, 1e3),  # lengths of a muscle's law
    "m^-1": ("19 m^-1", 1e-6, 1e9),  # slope of an exponential: over 1000 km; within a nanometre
    "m/s": ("0.15 m/s", 1e-9, 1e4),  # creep of a centimetre in four months; a bullet
    "s^-1": ("1e-3 s^-1", 1e-9, 1e9),  # as times
    "s/m": ("1 s/m", 1e-9, 1e3),  # damping of a ground by its stiffness
    "N*m/rad": ("25 N*m/rad", 1e-9, 1e9),  # such a moment by one radian
    "N*s/m": ("1.01 N*s/mm", 1e-9, 1e9),  # air about a fibre; no damper
    "N*s/(m*Pa)": ("0.00691 N*s/(mm*kPa)", 1e-15, 1e3),  # such a damper's, by pressure
    "kg": ("80 g", 1e-9, 1e6),  # a microgram; a train
    "kg/m": ("1 kg/m", 1e-9, 1e6),  # a microgram by metre
    "W/K": ("0.5 W/K", 1e-9, 1e6),  # heat through a vacuum flask; through a house
    "W": ("1 W", 1e-9, 1e9),  # a watch's sleep; a power station
    "N*m": ("1 N*m", 1e-9, 1e7),  # a grain of dust on a foot's length; a ship's shaft
    "N*m/kg": ("0.07 N*m/kg", 1e-9, 1e6),  # such a moment by a person's mass
    "J/kg": ("0.016 J/kg", 1e-9, 1e6),  # work of such a moment
    "J/(kg*K)": ("200 J/(kg*K)", 1e-6, 1e9),  # no stirring; isothermal
    "J/K": ("8 J/K", 1e-9, 1e6),  # a microgram of steel; a ton of it
    "m^2": ("150 cm^2", 1e-14, 1e4),  # a hole of a tenth of a micrometre; a field
    "N*m*s/rad": ("0.5 N*m*s/rad", 1e-9, 1e9),  # such a moment by one radian a second
    "kg*m^2": ("0.002 kg*m^2", 1e-15, 1e6),  # a microgram a millimetre off; a carousel
    "": ("0.3", 1e-12, 1e12),  # a share that no measurement resolves; switchings that no valve lives through
}


def magnitudes(unit: str | None) -> tuple[float, float]:
    """The least magnitude in an SI unit that is not 0, and the largest one."""
    return (LEAST, LARGEST) if unit not in UNITS else UNITS[unit][1:]


def plausible(values: Given, *, file: object = None, field: str = "", missing: bool = False) -> "np.ndarray":
    """Numbers that were read, as floats that can be calculated with."""
    import numpy as np  # large: whoever only lists what is shipped does without

    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError("is not a number", file=file, field=field, value=values) from None
    beyond = ~(np.abs(found) <= LARGEST)
    if missing:
        beyond &= ~np.isnan(found)
    if beyond.any():
        first = float(found[beyond].flat[0])
        problem = "is not a magnitude that this can have" if np.isfinite(first) else "is not a finite number"
        raise InputError(problem, file=file, field=field, value=first, allowed=f"up to ±{LARGEST:g}")
    found[np.abs(found) < LEAST] = 0.0
    return found
