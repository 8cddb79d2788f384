"""Cases of a study in which patients of a condition respond to the device, instead of a recorded walk."""

import pathlib
from collections.abc import Mapping

import numpy as np

from afo_sim.common import Given, InputError, Keywords, Notice, parse_quantity
from afo_sim.metrics import Metric, walkers_metrics

_MEDIANS = {"toe_clearance": ("right/clearance", 1e3), "ankle_swing": ("right/ankle_swing", 1.0)}
_MEDIANS |= {"air_per_stride": ("air_per_stride", 1e3), "speed": ("speed", 1.0)}
_MEDIANS |= {"cost_of_transport": ("cost_of_transport", 1.0)}


def decided_by(condition: str) -> list[pathlib.Path]:
    """Files that decide how the patients of a condition walk; raises as `read_condition`."""
    from afo_sim.walker.population import read_condition  # slow to import

    found = read_condition(condition)
    files = (found.file, pathlib.Path(found.patient), found.file.with_suffix(".csv"))
    return [path for path in files if path.is_file()]


def responding(
    scenario: Given, sets: Mapping[str, object], condition: str, threads: int
) -> tuple[dict[str, Metric], tuple[str, ...]]:
    """Metrics and warnings of a case: its patients walk without the device, and with it."""
    from afo_sim.walker import populate
    from afo_sim.walker.patients import DEVICE, WEEKS, WITHOUT
    from afo_sim.walker.patients_answer import outcomes

    # a scenario's own duration is the recorded walk's
    how: Keywords = {"duration": parse_quantity(sets["duration"], "s")} if "duration" in sets else {}
    found, of = populate(scenario, sets, patients=condition, threads=threads, **how), dict[str, float]()
    if DEVICE not in found.cases:
        raise InputError("no device with muscles is worn", field="orthosis", allowed="one with muscles")
    for case, ending in ((DEVICE, ""), (DEVICE + WEEKS, "_adapted"), (WITHOUT, "_without")):
        if case in found.cases:
            for word, sign in (("gain", 1), ("lose", -1)):
                of[f"walkers_{word}{ending}"] = float(np.mean(outcomes(found, case) == sign))
            of[f"walkers_falls{ending}"] = 100.0 * float(found.values(case, "falls").mean())
            for name, (theirs, factor) in _MEDIANS.items():
                known = [x for x in found.values(case, theirs) if np.isfinite(x)]
                of[f"walkers_{name}{ending}"] = factor * float(np.median(known)) if known else np.nan
    told = Notice("walkers-unadapted", "nobody has adapted: without a device all walk by the healthy gait")
    return walkers_metrics(of), (told,) if found.asked["unadapted"] else ()
