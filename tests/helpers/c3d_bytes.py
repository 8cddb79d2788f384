"""C3D files byte by byte, as the format's user guide (c3d.org) has them, of three kinds of processor."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

INTEL, DEC, MIPS = 84, 85, 86
BLOCK = 512
EMPTY = np.zeros((0, 0))


def encoded(numbers: Any, code: str, processor: int) -> bytes:
    """Numbers as a processor writes them; a whole one that does not fit is wrapped."""
    order = ">" if processor == MIPS else "<"
    if code != "f4":
        return np.asarray(numbers, dtype=np.int64).astype(np.int16).astype(f"{order}{code}").tobytes()
    if processor != DEC:
        return np.asarray(numbers).astype(f"{order}f4").tobytes()
    halves = (4.0 * np.asarray(numbers, dtype="<f4")).view("<u2").reshape(-1, 2)  # F_floating: 2 more in its
    return halves[:, ::-1].astype("<u2").tobytes()  # exponent, the high half first


@dataclass
class C3dBytes:
    """A file's content; a parameter of whole numbers is stored in 16 bits, one that is None left out."""

    rate: float = 100.0  # [Hz]
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3)))  # (frames, n, 3)
    residuals: np.ndarray | None = None  # (frames, n); negative where not seen
    analogs: np.ndarray = field(default_factory=lambda: EMPTY)  # in their units (frames · samples, channels)
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict)
    first: int = 1
    processor: int = INTEL
    floating: bool = True
    scale: float = 0.1  # of a point's whole numbers
    header: dict[int, int] = field(default_factory=dict)  # words, from 1, that say something else
    parameter_block: int = 2

    def add_parameter(self, group: str, name: str, value: Any) -> None:
        """Texts and counts as they are, numbers as floats unless they are whole by their type."""
        self.parameters.setdefault(group, {})[name] = value

    def add_event(self, time: Sequence[float], context: str, label: str) -> None:
        """An event at minutes and seconds."""
        group = self.parameters.setdefault("EVENT", {"TIMES": np.zeros((2, 0)), "CONTEXTS": [], "LABELS": []})
        group["TIMES"] = np.column_stack([group["TIMES"], time])
        group["CONTEXTS"].append(context)
        group["LABELS"].append(label)
        group["USED"] = [len(group["LABELS"])]

    def write(self, path: pathlib.Path) -> pathlib.Path:
        """Write the file."""
        path.write_bytes(self.content())
        return path

    def content(self) -> bytes:
        """The file's bytes."""
        frames = len(self.points) if self.points.size else len(self.analogs)
        frames = len(self.points) or frames
        points, channels = self.points.shape[1], self.analogs.shape[1]
        samples = len(self.analogs) // frames if channels else 0
        last = min(self.first + frames - 1, 65535)
        scale = -self.scale if self.floating else self.scale
        said = {
            "POINT": {
                "USED": [points], "SCALE": [scale], "RATE": [self.rate], "FRAMES": [min(frames, 65535)],
                "DATA_START": [0], "UNITS": ["mm"], "LABELS": [f"P{k}" for k in range(points)],
            },
            "ANALOG": {
                "USED": [channels], "RATE": [self.rate * samples], "GEN_SCALE": [1.0],
                "SCALE": np.ones(channels), "OFFSET": np.zeros(channels, int),
                "LABELS": [f"C{k}" for k in range(channels)], "UNITS": [""] * channels,
            },
        }  # fmt: skip
        groups = {
            group: said.get(group, {}) | self.parameters.get(group, {}) for group in said | self.parameters
        }
        frames_block = self.parameter_block + -(-len(self._section(groups)) // BLOCK)
        if groups["POINT"].get("DATA_START") == [0]:
            groups["POINT"]["DATA_START"] = [frames_block]
        section = self._section(groups)
        words = {
            2: points, 3: channels * samples, 4: self.first, 5: last, 6: 10,
            9: frames_block, 10: samples, **self.header,
        }  # fmt: skip
        head = bytearray(encoded([words.get(k, 0) for k in range(1, 257)], "i2", self.processor))
        head[:2] = self.parameter_block, 0x50
        head[12:16], head[20:24] = (encoded([n], "f4", self.processor) for n in (scale, self.rate))
        head += bytes(BLOCK * (self.parameter_block - 2))
        body = self._frames(frames, samples, groups["ANALOG"])
        return bytes(head) + _filled(section) + _filled(body)

    def _frames(self, frames: int, samples: int, analog: dict[str, Any]) -> bytes:
        count, channels = self.points.shape[1], self.analogs.shape[1]
        numbers = np.zeros((frames, 4 * count + channels * samples))
        quads = np.zeros((frames, count, 4))
        quads[..., :3] = self.points if self.floating else np.round(self.points / self.scale)
        quads[..., 3] = 0.0 if self.residuals is None else self.residuals
        numbers[:, : 4 * count] = quads.reshape(frames, -1)
        gains = (
            np.asarray(analog["SCALE"] if analog.get("SCALE") is not None else 1.0) * analog["GEN_SCALE"][0]
        )
        raw = self.analogs / gains + np.asarray(analog["OFFSET"])
        numbers[:, 4 * count :] = (raw if self.floating else np.round(raw)).reshape(frames, -1)
        return encoded(numbers.ravel(), "f4" if self.floating else "i2", self.processor)

    def _section(self, groups: dict[str, dict[str, Any]]) -> bytes:
        found = b""
        for number, (group, parts) in enumerate(groups.items(), start=1):
            found += _record(group, -number, b"\0", self.processor)
            for name, value in parts.items():
                if value is None:
                    continue
                array = np.asarray(value, dtype=object if isinstance(value, list) and not value else None)
                for k in range(0, max(array.shape[-1] if array.ndim else 1, 1), 255):
                    part = array[..., k : k + 255] if array.ndim else array
                    title = name if not k else f"{name}{k // 255 + 1}"
                    found += _record(title, number, self._value(part) + b"\0", self.processor)
        blocks = -(-(len(found) + 6) // BLOCK)
        return bytes([1, 0x50, blocks & 0xFF, self.processor]) + found + bytes(2)

    def _value(self, array: np.ndarray) -> bytes:
        """Type, dimensions and data of a parameter."""
        if array.dtype.kind in "OU":
            texts = [str(text).encode() for text in array.ravel()]
            width = max(map(len, texts), default=0)
            return _shaped(-1, (width, len(texts)), b"".join(text.ljust(width) for text in texts))
        kind, code = {"i": (2, "i2"), "f": (4, "f4")}[array.dtype.kind]
        return _shaped(kind, array.shape, encoded(array.ravel(order="F"), code, self.processor))


def _shaped(kind: int, shape: Sequence[int], data: bytes) -> bytes:
    return bytes([kind & 0xFF, len(shape), *shape]) + data


def _record(name: str, group: int, rest: bytes, processor: int) -> bytes:
    head = bytes([len(name), group & 0xFF]) + name.encode()
    return head + encoded([len(rest) + 2], "i2", processor) + rest


def _filled(data: bytes) -> bytes:
    return data + bytes(-len(data) % BLOCK)
