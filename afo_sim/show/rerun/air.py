"""Plotted lines of the air path: volumes beside the chambers, flow into it and out of it."""

import itertools

import afo_sim.show.rerun.colours as colours
from afo_sim.model.air_path import OUTLET, SOURCE, TUBE_END, VALVE_END
from afo_sim.physics.gas import AIR, Gas
from afo_sim.show.rerun.curve import THIN, Curve
from afo_sim.show.rerun.source import Source

FLOWS = {
    "supply/mass_flow": ("from the supply", colours.SKY),
    "exhaust/mass_flow": ("to the ambient air", colours.ORANGE),
}
SET_PRESSURE = "supply/set_pressure"
PER_MINUTE = 6e4  # l/min in a m³/s


def air_curves(source: Source) -> list[Curve]:
    """Lines of a run's air path; none where its valves hang on endless air and the ambient air alone."""
    if not any(source.named(kind) for kind in ("volume", "store", "restriction")):
        return []
    found = [Curve("pressure/chambers", "supply", colours.GREY, "supply/pressure", 1e-5, width=THIN)]
    free = itertools.cycle(colours.VOLUMES)
    ends = {VALVE_END.format(chamber): chamber for chamber in source.named("chamber")}
    far = {TUBE_END.format(chamber): f"{chamber}, tube end" for chamber in source.named("chamber")}
    for name in source.named("volume"):
        if name == SOURCE or (name == OUTLET and SET_PRESSURE in source.columns):
            continue
        label, shade = ({OUTLET: "regulator"} | far).get(name, name), list(next(free))
        if name in ends:
            label, shade = f"{ends[name]}, valve end", colours.of_path(f"{ends[name]}_1", True)
        found.append(Curve("pressure/chambers", label, shade, f"volume/{name}/pressure", 1e-5, width=THIN))
    litres = PER_MINUTE / gas_of(source).free_density
    for column, (name, colour) in FLOWS.items():
        if column in source.columns:
            found.append(Curve("air/flow", name, colour, column, litres))
    return found


def gas_of(source: Source) -> Gas:
    """The gas that drives a run."""
    described = source.scenario.supply.source
    return AIR if described is None else described.real_gas
