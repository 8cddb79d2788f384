"""What is shipped, one line each."""

from typing import Any

from afo_sim.common import assets
from afo_sim.common.phase_table import read_header
from afo_sim.physics.laws import LAWS

PLURALS = {
    "muscles": "muscle",
    "scenarios": "scenario",
    "legs": "leg",
    "orthoses": "orthosis",
    "valves": "valve",
    "patients": "patient",
    "sweeps": "sweep",
    "searches": "search",
}


def entries(kind: str) -> list[tuple[str, str]]:
    """(name, description) of everything of a kind, named in the plural."""
    if kind == "laws":
        return [(law.name, f"{law.formula} — {law.source}; {law.validity}") for law in LAWS.values()]
    if kind == "gaits":
        headers = {name: read_header(assets.find_gait(name)) for name in assets.gait_names()}
        return [(name, header.get("description", "")) for name, header in headers.items()]
    singular = PLURALS[kind]
    tables = {name: assets.read_toml(assets.find(singular, name)) for name in assets.names(singular)}
    return [(name, _line(table)) for name, table in tables.items()]


def _line(table: dict[str, Any]) -> str:
    line = str(table.get("description", ""))
    if "laws" in table:
        line += f" (grade {table.get('grade', 'D')}; {', '.join(table['laws'])})"
    return line
