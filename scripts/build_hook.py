"""Wheel hook: models/ and gait_data/ travel inside the package; an editable install reads the checkout."""

import pathlib
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class DataFolders(BuildHookInterface):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "standard":
            for name in ("models", "gait_data"):
                build_data["force_include"][str(pathlib.Path(self.root, name))] = f"afo_sim/{name}"
