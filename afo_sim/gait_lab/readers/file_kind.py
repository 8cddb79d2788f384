"""What a laboratory's file is, by its first lines."""

import pathlib
import re

from afo_sim.common.errors import InputError

SUFFIXES = ".mot, .sto, .trc, .c3d, .csv, .osim"
READ_AS = {".mot": "table", ".sto": "table", ".trc": "trc", ".c3d": "c3d", ".csv": "csv", ".osim": "model"}


def kind_of(file: pathlib.Path) -> str:
    """What a file is, by its first lines, and by its name if they do not tell."""
    if file.is_dir():
        raise InputError("is a folder", file=file, allowed=f"the files of one trial: {SUFFIXES}")
    by_name = READ_AS.get(file.suffix.lower(), "")
    try:
        with file.open("rb") as stream:
            head = stream.read(20_000)
    except OSError as error:
        if by_name or not file.exists():
            raise InputError(f"cannot be read: {error.strerror or error}", file=file) from None
        raise
    if head[1:2] == b"\x50" and by_name in ("c3d", ""):
        return "c3d"
    text = head.replace(b"\0", b"").decode("latin-1").lower()
    if "<opensimdocument" in text or text.lstrip("ï»¿ \r\n\t").startswith("<?xml"):
        return "model" if re.search(r"<model[ >]", text) else by_name or "setup"
    if re.search(r"^[ \t;,]*endheader", text, re.MULTILINE):
        return "table"
    if re.match(r"[^\n]*pathfiletype", text) or re.search(r"^ *frame ?#?\s+time\s", text, re.MULTILINE):
        return "trc"
    if by_name:
        return by_name
    if re.search(r"^[^#\n]*\btime ?[\[(]", text, re.MULTILINE):
        return "csv"
    raise InputError("is not a kind of file that can be imported", file=file, allowed=SUFFIXES)
