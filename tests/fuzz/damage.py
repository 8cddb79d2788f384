"""Damage to a file: an extreme number in one of its numeric fields, or bytes, lines and pieces of it."""

import functools
import json
import math
import random
import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass

NUMBERS = (
    "1e308", "-1e308", "5e-324", "nan", "inf", "-inf", "1e-30", "0", "-1", "1e15", str(2**63), "1e999",
    "9" * 400,
)  # fmt: skip
PIECES = (
    "true", "''", "'\u202e'", "'x y'", "[]", "[[]]", "[1, 'a', []]", "{}", "{ value = 1 }", "1979-05-27",
    "{ value = {}, source = 1 }", "'nan bar'", "'1e999 m'", "'1 m**m**m'", "'½ bar'", "'/'", "'..'", "&b;",
    "{ value = '1 m', kind = 'x' }", "['1 m', '2 m']", "<!DOCTYPE a [<!ENTITY b 'c'>]>", '"', "'''", "\0",
    "ü", "\n", "#", ",", "\t", ";", "=", "-", ".", "e9", "[" * 500, "a" + " " * 3000 + "[", "{a=" * 5000,
    "<a>" * 5000, "'" + "a" * 10_000 + "'",
)  # fmt: skip
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_JSON = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}
_VALUE = re.compile(r"\"[^\"]*\"|(?<==)[^=,\n]+|(?<![\w.])[-+]?\d[\d.eE+-]*")


@dataclass(frozen=True)
class Damage:
    """What is done to a base; its four texts are a row of the table of found cases."""

    base: str
    operator: str  # "number", "none", or a name of OPERATORS
    field: str  # a number's name and which of those so called, "*" for all; else the seed of the dice
    value: str = ""

    def of(self, raw: bytes) -> bytes:
        """The damaged file."""
        if self.operator == "none":
            return raw
        if self.operator == "number" and _is_parquet(raw):
            value = _JSON.get(self.value, self.value)
            return _as_parquet(_with_number(_as_json(raw), self.field, value), raw)
        if self.operator == "number":
            return _with_number(raw, self.field, self.value)
        return OPERATORS[self.operator](raw, random.Random(self.field))


def drawn(base: str, raw: bytes, seed: str) -> Damage:
    """Half of all damage is a number's."""
    dice = random.Random(seed)
    spans = _spans(_as_json(raw) if _is_parquet(raw) else raw)
    if dice.random() < 0.5 and spans:
        name = dice.choice(tuple(spans))
        which = "*" if dice.random() < 0.2 else str(dice.randrange(len(spans[name])))
        return Damage(base, "number", f"{name}@{which}", dice.choice(NUMBERS))
    return Damage(base, dice.choice(tuple(OPERATORS)), seed)


def _flipped(raw: bytes, dice: random.Random) -> bytes:
    found = bytearray(raw)
    for _ in range(dice.choice((1, 1, 3, 30))):
        at = dice.randrange(dice.choice((len(found), min(len(found), 4096))))
        found[at] = dice.choice((found[at] ^ 1 << dice.randrange(8), *b"\t\n ,;.-e9#"))
    return bytes(found)


def _cut(raw: bytes, dice: random.Random) -> bytes:
    return raw[: dice.randrange(len(raw))]


def _pieces(raw: bytes, dice: random.Random) -> bytes:
    """A piece is left out, stands twice, or two change places."""
    a, b, c = sorted(dice.randrange(len(raw) + 1) for _ in range(3))
    return dice.choice((raw[:a] + raw[b:], raw[:b] + raw[a:], raw[:a] + raw[b:c] + raw[a:b] + raw[c:]))


def _lines(raw: bytes, dice: random.Random) -> bytes:
    lines = raw.split(b"\n")
    a, b = dice.randrange(len(lines)), dice.randrange(len(lines))
    how = dice.randrange(5)
    if how == 0:
        lines[a], lines[b] = lines[b], lines[a]
    elif how == 1:
        del lines[a]
    elif how == 2:
        lines[a:a] = [lines[b]] * dice.choice((1, 1, 1000))
    elif how == 3:
        dice.shuffle(lines)
    else:
        lines[a] = re.sub(rb"[A-Za-z]+", dice.choice((b"x", b"law", b"''", b"")), lines[a], count=1)
    return b"\n".join(lines)


def _pasted(raw: bytes, dice: random.Random) -> bytes:
    """An odd text anywhere, or instead of a value."""
    text, piece = raw.decode("latin-1"), dice.choice(PIECES).encode().decode("latin-1")
    values = [found.span() for found in _VALUE.finditer(text)]
    at = dice.randrange(len(text) + 1)
    start, end = dice.choice(values) if values and dice.random() < 0.7 else (at, at)
    return (text[:start] + piece + text[end:]).encode("latin-1")


OPERATORS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "flipped": _flipped, "cut": _cut, "pieces": _pieces, "lines": _lines, "pasted": _pasted,
}  # fmt: skip


def _is_parquet(raw: bytes) -> bool:
    """Of a run, whose header is JSON."""
    return raw[:4] == b"PAR1" and b"model_xml" in raw


def _is_c3d(raw: bytes) -> bool:
    return raw[1:2] == b"\x50" and b"\0" in raw[:512]


@functools.lru_cache(maxsize=64)
def _spans(raw: bytes) -> dict[str, list[tuple[int, int]]]:
    """Where numbers stand: of a text by their line's own text and their place in it, as a table's columns."""
    found: dict[str, list[tuple[int, int]]] = {}
    if _is_c3d(raw):
        for name, start in _c3d_numbers(raw):
            found.setdefault(name, []).append((start, start + struct.calcsize(name[-1])))
        return found
    at = 0
    for line in raw.decode("latin-1").split("\n"):
        shape = _NUMBER.sub("#", line.strip())[:60]
        for k, number in enumerate(_NUMBER.finditer(line)):
            found.setdefault(f"{k} of {shape}", []).append((at + number.start(), at + number.end()))
        at += len(line) + 1
    return found


def _with_number(raw: bytes, field: str, value: str) -> bytes:
    name, _, which = field.rpartition("@")
    spans, new = _spans(raw)[name], _packed(name[-1], float(value)) if _is_c3d(raw) else value.encode()
    for start, end in reversed(spans if which == "*" else [spans[int(which)]]):
        raw = raw[:start] + new + raw[end:]
    return raw


def _c3d_numbers(raw: bytes) -> Iterator[tuple[str, int]]:
    """Name, which ends in struct's letter, and place of the header's words and each parameter's numbers."""
    yield from ((f"word {k} h", 2 * k) for k in (0, 1, 2, 3, 4, 5, 8, 9))
    yield from (("scale f", 12), ("rate f", 20))
    at = 512 * (raw[0] - 1) + 4
    while at + 2 < len(raw) and raw[at]:
        length, group = struct.unpack_from("bb", raw, at)
        name, at = raw[at + 2 : at + 2 + abs(length)].decode("latin-1"), at + 2 + abs(length)
        if group > 0:
            kind, dimensions = struct.unpack_from("bB", raw, at + 2)
            count = math.prod(raw[at + 4 : at + 4 + dimensions])
            if letter := {1: "b", 2: "h", 4: "f"}.get(kind):
                start = at + 4 + dimensions
                size = struct.calcsize(letter)
                yield from ((f"{group} {name} {letter}", start + k * size) for k in range(count))
        (step,) = struct.unpack_from("<h", raw, at)
        at = at + step if step else len(raw)


def _packed(letter: str, number: float) -> bytes:
    """A number as C3D has it; a whole one is the nearest that fits."""
    if letter == "f":
        return struct.pack("<f", math.copysign(math.inf, number) if abs(number) > 3e38 else number)
    most = 2 ** (8 * struct.calcsize(letter) - 1)
    return struct.pack(f"<{letter}", -1 if math.isnan(number) else int(min(max(number, -most), most - 1)))


@functools.lru_cache(maxsize=8)
def _as_json(raw: bytes) -> bytes:
    """A recording's rows and header, a number a line."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(pa.BufferReader(raw))
    header = json.loads(table.schema.metadata[b"afo_sim"])
    return json.dumps({"rows": table.to_pylist(), "run": header | {"model_xml": ""}}, indent=0).encode()


def _as_parquet(text: bytes, raw: bytes) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows, header = json.loads(text, parse_int=float)["rows"], json.loads(text)["run"]
    schema, sink = pq.read_schema(pa.BufferReader(raw)), pa.BufferOutputStream()
    header["model_xml"] = json.loads(schema.metadata[b"afo_sim"])["model_xml"]
    schema = schema.with_metadata(schema.metadata | {b"afo_sim": json.dumps(header).encode()})
    pq.write_table(pa.Table.from_pylist(rows, schema), sink)
    return bytes(sink.getvalue())
