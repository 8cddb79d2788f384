"""The catalogue of valves as docs/valves.md shows it: `python scripts/valves_table.py` prints it."""

from afo_sim.common import assets
from afo_sim.description import Rated, Valve, load

HEADER = ("name", "C in, out", "b in, out", "on, off")


def markdown() -> str:
    """The table, one row a valve; a star marks what is not published."""
    rows = [HEADER, ("---",) * len(HEADER), *(row(load("valve", name)) for name in assets.names("valve"))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows) + "\n"


def row(valve: Valve) -> tuple[str, ...]:
    """The cells of one valve. An exhaust that is taken equal to the inlet adds no number."""
    paths: list[Rated] = [valve]
    if valve.exhaust is not None and valve.exhaust.provenance["conductance"].kind == "published":
        paths.append(valve.exhaust)
    c = [f"{path.conductance * 1e8:.3g}{_star(path, 'conductance')}" for path in paths]
    b = [f"{path.critical_ratio:g}{_star(path, 'critical_ratio')}" for path in paths]
    if valve.bandwidth is not None:
        speed = f"{valve.bandwidth:g}{_star(valve, 'bandwidth')} Hz"
    else:
        keys = ("opening_delay", "closing_delay")
        speed = _alike([f"{1e3 * getattr(valve, key):g}{_star(valve, key)}" for key in keys]) + " ms"
    return f"`{valve.name}`", _alike(c), _alike(b), speed


def _star(path: Rated, key: str) -> str:
    return "" if path.provenance[key].kind == "published" else "*"


def _alike(texts: list[str]) -> str:
    return ", ".join(dict.fromkeys(texts))


if __name__ == "__main__":
    print(markdown(), end="")
