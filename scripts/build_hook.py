"""Wheel hook: models/ and gait_data/ travel inside the package; an editable install reads the checkout."""

import pathlib
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class DataFolders(BuildHookInterface):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version != "standard":
            return
        root = pathlib.Path(self.root)
        for name in ("models", "gait_data"):
            for path in sorted((root / name).rglob("*")):
                if path.is_file() and path.suffix != ".png":  # pictures are the documents'
                    build_data["force_include"][str(path)] = f"afo_sim/{path.relative_to(root).as_posix()}"
