"""The gait cycle that a scenario names, read once for all cases that share it."""

import functools
import pathlib

from afo_sim.common import assets
from afo_sim.description.walking import Gait
from afo_sim.gait import family
from afo_sim.gait import file as gait_file
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.variants import scaled


def recorded_stride(gait: Gait, taller: float = 1.0) -> GaitCycle:
    """The recorded stride as a person walks it who is by a factor taller than the recorded walker.

    Parameters
    ----------
    gait : names the cycle; its speed is the person's own
    taller : than the recorded walker [-]

    Returns
    -------
    GaitCycle, the same object for the same stride

    Raises
    ------
    InputError
        The gait cannot be found or read, or it has no such speed.
    """
    file = assets.find_gait(gait.cycle)
    return _similar(file, file.stat().st_mtime_ns, gait.speed, taller)


# Cases of a sweep share most of this; a changed file has another time of change.
@functools.lru_cache(maxsize=8)
def _read(file: pathlib.Path, when: int, speed: float | None, taller: float) -> GaitCycle:
    return gait_file.read(file) if speed is None else family.at_speed(file, speed, taller)


@functools.lru_cache(maxsize=8)
def _similar(file: pathlib.Path, when: int, speed: float | None, taller: float) -> GaitCycle:
    return scaled(_read(file, when, speed, 1.0 if speed is None else taller), taller)
