"""The catalogue of valves as docs/valves.md shows it: `python scripts/valves_table.py` prints it."""

from afo_sim.common import STANDARD_DENSITY, assets
from afo_sim.description import Rated, Valve, load
from afo_sim.physics import nominal_flow

HEADER = (
    "name",
    "C in, out",
    "b in, out",
    "l/min",
    "on, off",
    "assumed",
)
SHORT = {"critical_ratio": "b", "conductance": "C", "opening_delay": "on", "closing_delay": "off"}
LITRES = 6e4  # m³/s in l/min


def markdown() -> str:
    """The table, one row a valve."""
    rows = [HEADER, ("---",) * len(HEADER), *(row(load("valve", name)) for name in assets.names("valve"))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows) + "\n"


def row(valve: Valve) -> tuple[str, ...]:
    """The cells of one valve; its flow is from 6 to 5 bar gauge."""
    paths: list[Rated] = [valve] if valve.exhaust is None else [valve, valve.exhaust]
    flow = LITRES * nominal_flow(valve.conductance, valve.critical_ratio, 6e5, 5e5, STANDARD_DENSITY)
    if valve.bandwidth is not None:
        speed = f"{valve.bandwidth:g} Hz"
    else:
        speed = _alike([f"{1e3 * delay:g}" for delay in (valve.opening_delay, valve.closing_delay)]) + " ms"
    return (
        f"`{valve.name}`",
        _alike([f"{path.conductance * 1e8:.3g}" for path in paths]),
        _alike([f"{path.critical_ratio:g}" for path in paths]),
        f"{flow:.0f}" if flow >= 100.0 else f"{flow:.3g}",
        speed,
        ", ".join(assumed(valve)),
    )


def assumed(valve: Valve) -> list[str]:
    """What of a valve is assumed, on its own path and on its exhaust's."""
    found = _assumed(valve)
    if valve.exhaust is not None:
        out = _assumed(valve.exhaust)
        found += ["exhaust"] if len(out) > 1 else [f"{name} out" for name in out]
    return found


def _assumed(path: Rated) -> list[str]:
    tables = [path.provenance, *([path.nominal_flow.provenance] if path.nominal_flow else [])]
    names = [name for table in tables for name, told in table.items() if told.kind == "assumed"]
    if {"upstream", "downstream"} <= set(names):
        names = [name for name in names if name not in ("upstream", "downstream")] + ["pressures"]
    return [SHORT.get(name, name) for name in names]


def _alike(texts: list[str]) -> str:
    return ", ".join(dict.fromkeys(texts))


if __name__ == "__main__":
    print(markdown(), end="")
