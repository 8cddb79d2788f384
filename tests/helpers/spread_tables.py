"""Files of spreads, as tests write them."""

import json
import pathlib
from typing import Any


def spread(name: str, distribution: str = "", **options: Any) -> str:
    """The table of one thing that is not known; `options` as the file has them."""
    stated = {"distribution": distribution} if distribution else {}
    stated |= options | {"kind": "assumed", "source": "a test"}
    return f"[parameters.{name}]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in stated.items())


def spreads_file(folder: pathlib.Path, text: str) -> str:
    """A file with such tables."""
    file = folder / "spreads.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)
