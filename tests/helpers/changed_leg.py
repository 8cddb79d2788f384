"""The shipped adult leg with its files changed, in a folder of its own."""

import pathlib
from collections.abc import Callable

from afo_sim.common import assets


def changed_leg(folder: pathlib.Path, change: Callable[[str], str]) -> dict[str, str]:
    """What names it in a scenario; `change` takes the text of each of its files."""
    for file in assets.find("leg", "adult_75kg").parent.iterdir():
        (folder / file.name).write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8")
    return {"leg": str(folder / "leg.toml")}
