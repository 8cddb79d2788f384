"""Files that show whether they are as this program wrote them: a digest over every byte of each.

A text has it in its first line, which whoever edits the file deletes; JSON as its last value; Parquet before
its footer, where readers look for nothing. A file without a digest is read as before: it is of an older
version, or its owner's. One damaged bit makes no such file of a sealed one: two marks show each seal.
"""

import functools
import hashlib
import itertools
import json
import pathlib
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import IO

from afo_sim.common.errors import InputError
from afo_sim.common.open_types import Foreign, Json, JsonMapping
from afo_sim.common.reading import check_regular, read_text
from afo_sim.common.writing import json_text, replacing, write_text

# Kinds of files that this program writes, and it or another reads again: each is written sealed.
WRITTEN = (
    "recording", "summary", "both legs", "scenario", "stride", "orthosis", "muscle", "leg", "worn model",
    "chunk", "results", "manifest", "generation", "designs", "best design", "answer", "time step",
    "stand", "stand summary", "law fit", "torque fit", "run fit",
    "adapted gait", "walk", "walked columns", "wearers", "role map", "electronics", "commands",
    "sensor",
)  # fmt: skip
SEALED = "(delete this line when you edit the file)"
_LINE = re.compile(r"# digest: ([0-9a-f]{32}) " + re.escape(SEALED))
_BESIDE = re.compile(r"# digest of (.+): ([0-9a-f]{32})")
_LAST = re.compile(r',\n  "digest": "([0-9a-f]{32})"\n}\n\Z')
_MARKS = re.compile("# digest:|" + re.escape(SEALED))  # one bit spoils one of them
_JSON_MARKS = re.compile(r'"digest"|[0-9a-f]{32}"\n}\n\Z')
_OWN = (".toml", ".json", ".parquet")  # sealed themselves; a TOML has the digests of other files beside it
_SEAL = b"afo-sim\1"  # before the digest in a Parquet file
_SIZE = hashlib.sha256().digest_size
_SEALED = b"afo_sim_sealed"  # of a Parquet file's metadata, the second mark
_DAMAGED = "is damaged: it is not as this program wrote it (its digest does not match)"
_RECOVER = "`afo-sim recover` of its folder, which saves what is whole of a run or a sweep"
_BLOCK = 2**20  # that is read at a time [bytes]
MOST_GROUPS = 1000  # of rows, and of columns: each pair takes 700 bytes of memory, and 3 of the file
_LIMITS = {"thrift_container_size_limit": MOST_GROUPS, "thrift_string_size_limit": 2**26}
_LARGE, _UNPACKED = 2**30, 200  # rows may take so much memory, or so many times their file's size [bytes]


def digest(content: bytes) -> str:
    """The digest of a content, as it stands in a file."""
    return _digest(content).hexdigest()


def file_digest(path: pathlib.Path) -> str:
    """The digest of a file's content; OSError where it cannot be read."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, _digest).hexdigest()


_digest = functools.partial(hashlib.blake2b, digest_size=16)


def sealed_text(text: str, folder: pathlib.Path | None = None) -> str:
    """A TOML or CSV text below a line with its digest."""
    for path in sorted(folder.rglob("*")) if folder else ():
        if folder and path.is_file() and path.suffix not in _OWN:
            text = f"# digest of {path.relative_to(folder).as_posix()}: {file_digest(path)}\n{text}"
    return f"# digest: {_of_text(text)} {SEALED}\n{text}"


def write_sealed(path: pathlib.Path, text: str, kind: str, folder: pathlib.Path | None = None) -> None:
    """Write a TOML or CSV text with its digest, and those of the files in a folder that it names."""
    assert kind in WRITTEN
    write_text(path, sealed_text(text, folder))


def without_digests(text: str) -> str:
    """A text without the lines that `sealed_text` has put above it."""
    return "".join(itertools.dropwhile(lambda line: line.startswith("# digest"), text.splitlines(True)))


def check_text(text: str, file: pathlib.Path) -> str:
    """A text without the line of its digest, which was checked, as were those of the files beside it."""
    line, _, rest = text.partition("\n")
    if not _MARKS.search(line):
        return text
    found = _LINE.fullmatch(line.rstrip("\r"))
    changed = file if found is None or found[1] != _of_text(rest) else _changed_beside(rest, file)
    if changed is not None:
        allowed = "the file as it was written; whoever has changed it, as a spreadsheet does that saves it, "
        allowed += f"deletes the first line of {file.name}"
        problem = "has changed since this program wrote it, or is damaged (its digest does not match)"
        raise InputError(problem, file=changed, allowed=allowed)
    return "\n" + rest


def _changed_beside(text: str, file: pathlib.Path) -> pathlib.Path | None:
    """The first file beside a sealed text that is not as the text says."""
    for line in itertools.takewhile(lambda line: line.startswith("#"), text.splitlines()):
        named = _BESIDE.fullmatch(line)
        path = file.parent / named[1] if named else file
        if not named:
            continue
        check_regular(path)
        if file_digest(path) != named[2]:
            return path
    return None


def _of_text(text: str) -> str:
    """The digest of a text, whatever system ends its lines."""
    return digest(text.replace("\r\n", "\n").encode("utf-8", "surrogatepass"))


def read_json(path: pathlib.Path) -> Json:
    """What a JSON file holds, without its digest."""
    path.stat()  # OSError where it is not there
    text = read_text(path)
    found = _LAST.search(text)
    if found is None and _JSON_MARKS.search(text[-64:]):
        raise ValueError("its digest is damaged")
    if found is not None and _of_text(text[: found.start()] + "\n}\n") != found[1]:
        raise ValueError("its digest does not match")
    try:
        value = json.loads(text, parse_int=lambda digits: int(digits) if len(digits) < 20 else float(digits))
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    if found is not None:
        del value["digest"]
    return value


def write_json(
    path: pathlib.Path,
    value: JsonMapping,
    kind: str = "answer",
    place: Callable[[pathlib.Path], AbstractContextManager[pathlib.Path]] = replacing,
) -> None:
    """Write a table as JSON whose last value is the digest of the rest; errors as `place`."""
    assert kind in WRITTEN
    with place(path) as temporary:
        text = json_text(value)
        sealed = f'{text[:-3]},\n  "digest": "{_of_text(text)}"\n}}\n'
        temporary.write_text(sealed, encoding="utf-8")


@contextmanager
def parquet_writer(path: pathlib.Path, schema: Foreign, kind: str = "results") -> Iterator[Foreign]:
    """pyarrow's ParquetWriter of a file that is sealed when the block ends well; each page has a checksum."""
    import pyarrow.parquet as pq

    assert kind in WRITTEN

    marked = schema.with_metadata((schema.metadata or {}) | {_SEALED: b"1"})
    with pq.ParquetWriter(path, marked, write_page_checksum=True) as writer:
        yield writer
    with path.open("r+b") as file:
        start = _footer(file)
        footer = file.read()
        found = _hash(file, start, footer)
        file.seek(start)
        file.write(_SEAL + found + footer)


def write_parquet(path: pathlib.Path, table: Foreign, kind: str = "results") -> None:
    """Write a pyarrow Table into a sealed file."""
    with parquet_writer(path, table.schema, kind) as writer:
        writer.write_table(table)


def parquet_column(values: Foreign) -> Foreign:
    """Numbers, truths or texts (n,) as a pyarrow Array; its own way imports pandas to look for its Series."""
    import numpy as np
    import pyarrow as pa

    given = np.ascontiguousarray(values)
    if given.dtype.kind in "UO":
        texts = [text.encode() for text in values]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
        kind, parts = pa.string(), [ends, b"".join(texts)]
    else:
        kind = pa.from_numpy_dtype(given.dtype)
        parts = [np.packbits(given, bitorder="little") if kind == pa.bool_() else given]
    return pa.Array.from_buffers(kind, len(given), [None, *map(pa.py_buffer, parts)], null_count=0)


def open_parquet(path: pathlib.Path, *, damaged: bool = False) -> Foreign:
    """A pyarrow ParquetFile whose every byte was checked; its rows are not read."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        sealed = damaged or _is_sealed(path)
        opened = pq.ParquetFile(path, pre_buffer=False, page_checksum_verification=damaged, **_LIMITS)
        schema, size = opened.schema_arrow, 8 * opened.metadata.num_rows * len(opened.schema_arrow)
        if size > max(_LARGE, _UNPACKED * path.stat().st_size):
            raise ValueError(f"it would unpack to {size / 2**30:.3g} GB")
    except (pa.ArrowException, OSError, ValueError) as error:
        raise InputError(f"is not a valid Parquet file: {error}", file=path) from None
    if not sealed and _SEALED in (schema.metadata or {}):
        raise InputError(_DAMAGED, file=path, allowed=_RECOVER)
    return opened


def read_parquet(path: pathlib.Path) -> Foreign:
    """A whole Parquet file as a pyarrow Table; errors as of `open_parquet`."""
    import pyarrow as pa

    try:
        return open_parquet(path).read()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise InputError(f"is not a valid Parquet file: {error}", file=path) from None


def _is_sealed(path: pathlib.Path) -> bool:
    """Whether a file has a seal, which is then the right one."""
    with path.open("rb") as file:
        start = _footer(file)
        footer = file.read()
        file.seek(max(start - len(_SEAL) - _SIZE, 0))
        place, seal = file.tell(), file.read(len(_SEAL) + _SIZE)
        if not seal.startswith(_SEAL):
            return False
        if seal != _SEAL + _hash(file, place, footer):
            raise InputError(_DAMAGED, file=path, allowed=_RECOVER)
    return True


def _footer(file: IO[bytes]) -> int:
    """Where a Parquet file's footer begins; the file stands there then."""
    size = file.seek(0, 2)
    file.seek(max(size - 8, 0))
    start = size - 8 - int.from_bytes(file.read(4), "little")
    if start < 0:
        raise ValueError("its footer is damaged")
    return file.seek(start)


def _hash(file: IO[bytes], end: int, footer: bytes) -> bytes:
    """SHA-256 of a file's first `end` bytes and its footer."""
    found = hashlib.sha256()
    file.seek(0)
    while block := file.read(min(end, _BLOCK)):
        found.update(block)
        end -= len(block)
    found.update(footer)
    return found.digest()
