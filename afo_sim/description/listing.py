"""Shipped products, one line each."""

from collections.abc import Mapping
from typing import Any

from afo_sim.common import assets, read_header
from afo_sim.physics import FRICTIONS, LAWS


def entries(kind: str) -> list[tuple[str, str]]:
    """(name, description) of everything of a kind, named in the plural."""
    if kind in ("laws", "frictions"):
        known: Mapping[str, Any] = LAWS if kind == "laws" else FRICTIONS
        return [(law.name, f"{law.formula} — {law.source}; {law.validity}") for law in known.values()]
    if kind == "gaits":
        headers = {name: read_header(assets.find_gait(name)) for name in assets.gait_names()}
        return [(name, header.get("description", "")) for name, header in headers.items()]
    singular = next(one for one, plural in assets.KINDS.items() if plural == kind)
    tables = {name: assets.read_toml(assets.find(singular, name)) for name in assets.names(singular)}
    return [(name, _line(table)) for name, table in tables.items()]


def _line(table: dict[str, Any]) -> str:
    line = str(table.get("description", ""))
    if "laws" in table:
        line += f" (grade {table.get('grade', 'D')}; {', '.join(table['laws'])})"
    return line
