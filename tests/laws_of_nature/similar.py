"""A description and its recording at another size: every number goes by its dimension."""

import pathlib
import re
from typing import Any

import mujoco
import numpy as np

from afo_sim.simulation import describe

ROUNDING, OF_PRESSURE = 1e-9, 1e-3  # spans that are nothing but rounding; gauge pressures round at 1 bar [Pa]
AIR = re.compile(r"/mass(_flow.*)?$")
QUANTITY = re.compile(r"(-?\d[\d.]*(?:e[-+]?\d+)?) ([A-Za-z].*)")


class Similar:
    """Factors of all units where lengths go with l, masses with μ, angles not, and gravity stays: T = √l."""

    def __init__(self, taller: float, heavier: float) -> None:
        slower, force = np.sqrt(taller), heavier
        moment = force * taller
        self.units = {"m": taller, "kg": heavier, "s": slower, "N": force, "Pa": force / taller**2}
        self.units |= {"J": moment, "W": moment / slower, "Hz": 1.0 / slower, "K": 1.0, "rad": 1.0}

    def factor(self, unit: str) -> float:
        """Of a unit such as "N*m*s/rad"; 1 of a bare number."""
        plain = unit.replace("^", "**").replace("·", "*").replace("²", "**2").replace("³", "**3")
        return float(eval(plain, {"__builtins__": {}}, self.units)) if plain not in ("", "-", "1") else 1.0

    def air(self, unit: str) -> float:
        """Factor of a mass of air or of its flow: its density is that of all air, so its mass is a volume."""
        return self.factor(unit.replace("kg", "m**3"))

    def table(self, value: Any) -> Any:
        """A description's table: each text with a unit, at that size."""
        if isinstance(value, dict):
            return {key: item if key == "provenance" else self.table(item) for key, item in value.items()}
        if isinstance(value, list):
            return [self.table(item) for item in value]
        found = QUANTITY.fullmatch(value) if isinstance(value, str) else None
        return f"{float(found[1]) * self.factor(found[2])!r} {found[2]}" if found else value

    def part(self, file: str, folder: pathlib.Path) -> str:
        """A cuff or plate, written at that size."""
        spec = mujoco.MjSpec.from_file(file)
        for geom in spec.geoms:
            geom.pos, geom.size = (np.array(a) * self.units["m"] for a in (geom.pos, geom.size))
            geom.mass *= self.units["kg"]
        for body in spec.bodies:  # of an inertial that is stated
            body.ipos = np.array(body.ipos) * self.units["m"]
            body.mass *= self.units["kg"]
            for inertia in ("inertia", "fullinertia"):
                setattr(body, inertia, np.array(getattr(body, inertia)) * self.factor("kg*m^2"))
        spec.compile()
        place = folder / pathlib.Path(file).name
        place.write_text(spec.to_xml(), encoding="utf-8")
        return str(place)

    def departure(self, base: Any, run: Any) -> dict[str, float]:
        """Largest distance of each column from the base's at that size, as a share of its range.

        Coordinates of the model are left out, which have no unit, and what is only rounding.
        """
        found = {}
        for name, values in base.columns.items():
            unit = describe(name)[0]
            expected = values * (self.air(unit) if AIR.search(name) else self.factor(unit))
            span = float(np.ptp(expected))
            least = OF_PRESSURE if unit == "Pa" else ROUNDING
            if not name.startswith("qpos/") and span > least:
                found[name] = float(np.abs(run[name] - expected).max()) / span
        return found
