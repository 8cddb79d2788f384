"""What is shipped, one line each."""

from afo_sim import assets
from afo_sim.phase_table import read_header
from afo_sim.physics.static_force import LAWS

PLURALS = {
    "muscles": "muscle",
    "scenarios": "scenario",
    "legs": "leg",
    "orthoses": "orthosis",
    "valves": "valve",
}


def entries(kind: str) -> list[tuple[str, str]]:
    """(name, description) of everything of a kind, named in the plural."""
    if kind == "laws":
        return [(law.name, f"{law.formula} — {law.source}; {law.validity}") for law in LAWS.values()]
    if kind == "gaits":
        headers = {name: read_header(assets.find_gait(name)) for name in assets.gait_names()}
        return [(name, header.get("description", "")) for name, header in headers.items()]
    singular = PLURALS[kind]
    return [
        (name, assets.read_toml(assets.find(singular, name)).get("description", ""))
        for name in assets.names(singular)
    ]
