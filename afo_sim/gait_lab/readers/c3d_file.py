"""A C3D file, as the format's user guide has it (c3d.org); where it contradicts itself its size decides."""

import itertools
import math
import pathlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from afo_sim.common import InputError, Notice, plausible, read_bytes
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.signals import stretches

_BLOCK = 512  # bytes; C3D counts in them
_PROCESSORS = {84: "<", 85: "<", 86: ">"}  # Intel, DEC, MIPS: how their whole numbers lie
_DEC = 85
_TYPES = {-1: "u1", 1: "i1", 2: "i2", 4: "f4"}  # of a parameter's numbers; -1 is letters
_NEEDED = ("POINT", "ANALOG", "FORCE_PLATFORM", "TRIAL")  # groups in which letters are no numbers
_LONG = 255 * _BLOCK  # of all parameters
_MANY = 65535  # frames of which the header says as much, and of more as well
_SAME = 1e-4  # share by which two statements of one number may differ: a float's rounding
_NEAR = 0.01  # by which two rates differ of which one is a name: 59.94 and 60 Hz
_FEW = 8  # blocks of a disk that are lost together; assumed
_FILLED = 0.1  # share of numbers beside such a hole that are not 0; assumed: points, no empty plate
_HEADER = "its header"


class _Parameter(NamedTuple):
    kind: int  # of `_TYPES`
    shape: tuple[int, ...]
    values: np.ndarray | list[str]  # in the file's order


class _Layout(NamedTuple):
    """How the frames lie in the file, and what they are."""

    points: int
    channels: int
    samples_a_frame: int  # of a channel
    first_block: int  # of the frames, from 1
    first_frame: int  # from 1
    frames: int
    scale: float  # of a point's whole numbers; negative where all numbers are floating
    frame_rate: float  # [Hz]

    def places(self) -> tuple[int, int]:
        """The first byte of the frames, and the one behind them."""
        numbers = self.frames * (4 * self.points + self.channels * self.samples_a_frame)
        start = _BLOCK * (self.first_block - 1)
        return start, start + (4 if self.scale < 0.0 else 2) * numbers

    def facts(self) -> dict[str, float]:
        """All that a file states of it."""
        rate = self.frame_rate * self.samples_a_frame
        return self._asdict() | {"analog_numbers": self.channels * self.samples_a_frame, "analog_rate": rate}


@dataclass(frozen=True, eq=False)
class Parameters:
    """Parameters of a C3D file, in the file's own units."""

    file: pathlib.Path
    groups: dict[str, dict[str, _Parameter]]  # by names in capitals

    def numbers(self, group: str, name: str) -> np.ndarray:
        """A parameter's numbers in the file's order, NaN where infinite; none if it is not there."""
        try:
            found = np.array([n for part in self._parts(group, name) for n in part.values], dtype=float)
        except ValueError:
            if group not in _NEEDED:
                return np.empty(0)
            raise _refused(self.file, f"is damaged: its {group}:{name} holds letters, no numbers") from None
        finite = np.where(np.isinf(found), np.nan, found)
        return plausible(finite, file=self.file, field=f"{group}:{name}", missing=True)

    def number(self, group: str, name: str) -> float:
        """A parameter's first number, of words of 16 bits the first two, without a sign; NaN if none."""
        found = self.numbers(group, name)[:2]
        if len(found) and next(self._parts(group, name)).kind == 2:
            return float(sum((int(word) & 0xFFFF) << 16 * k for k, word in enumerate(found)))
        return float(found[0]) if len(found) else math.nan

    def texts(self, group: str, name: str) -> list[str]:
        """A parameter's texts; none if it is not there."""
        return [str(text) for part in self._parts(group, name) for text in part.values]

    def _parts(self, group: str, name: str) -> Iterator[_Parameter]:
        there, name = self.groups.get(group.upper(), {}), name.upper()
        names = itertools.chain([name], (f"{name}{number}" for number in itertools.count(2)))
        return (there[each] for each in itertools.takewhile(there.__contains__, names))


@dataclass(frozen=True, eq=False)
class C3dFile(Parameters):
    """Its frames."""

    layout: _Layout
    points: np.ndarray  # NaN where not seen (frames, points, 3)
    words: np.ndarray  # analog, as they are in the file (frames, samples, channels)
    notices: tuple[Notice, ...]  # where it contradicts itself

    def analogs(self, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Channels in their units (frames · samples, len(index)), and how many one in the file is."""
        words, general = self.words, np.nan_to_num(self.number("ANALOG", "GEN_SCALE"), nan=1.0)
        gains, offsets = (
            np.append(self.numbers("ANALOG", name), np.full(self.layout.channels, default))[index]
            for name, default in (("SCALE", 1.0), ("OFFSET", 0.0))
        )
        if "UNSIGNED" in self.texts("ANALOG", "FORMAT") and words.itemsize == 2:
            words, offsets = words.view(words.dtype.str.replace("i", "u")), offsets % 65536.0
        found = (words[:, :, index].astype(float) - offsets) * (gains * general)
        return found.reshape(len(words) * words.shape[1], len(index)), gains * general


def read_c3d_file(path: pathlib.Path) -> C3dFile:
    """Read a C3D file."""
    raw = read_bytes(path)
    section = _BLOCK * (raw[0] - 1) if raw else -1
    if len(raw) < max(_BLOCK, section + 4) or raw[1] != 0x50 or section < 0:
        raise _refused(path, "is not a whole C3D file")
    if (processor := raw[section + 3]) not in _PROCESSORS:
        raise _refused(path, f"is of no known processor: its code is {processor}, not 84, 85 or 86")
    said = Parameters(path, _parameters(path, raw, section + 4, processor))
    layout, notices = _layout(said, raw, processor)
    frames, count, floating = layout.frames, layout.points, layout.scale < 0.0
    words = _numbers(memoryview(raw)[slice(*layout.places())], "f4" if floating else "i2", processor)
    notices += _holes(layout, words)
    words = words.reshape(frames, -1)
    points = words[:, : 4 * count].reshape(frames, count, 4)
    places = points[..., :3] if floating else points[..., :3] * np.float32(layout.scale)
    seen = np.where(points[..., 3:] < 0, np.float32("nan"), places)
    analog = words[:, 4 * count :].reshape(frames, layout.samples_a_frame, layout.channels)
    return C3dFile(path, said.groups, layout, seen, analog, tuple(notices))


def _holes(layout: _Layout, words: np.ndarray) -> list[Notice]:
    """A warning of blocks of zeros where the frames before and after have numbers, as a disk leaves them."""
    width, block, found = len(words) // layout.frames, _BLOCK // words.itemsize, []
    bits = words.view(f"u{words.itemsize}")
    empty = np.logical_not(bits[: len(bits) // block * block].reshape(-1, block).any(axis=1))
    for start, end in ((a * block, b * block) for a, b in stretches(empty) if b - a <= _FEW):
        away = ((end - start) // width + 1) * width
        sides = [bits[max(start + by, 0) : max(end + by, 0)] for by in (-away, away)]
        if min(map(np.count_nonzero, sides)) > _FILLED * (end - start):
            found.append((layout.first_frame - 1 + start // width) / layout.frame_rate)
    text = "holes of zeros in its frames: {count}, the first at {time:.2f} s; is it damaged?"
    return [Notice("c3d-zeros", text, count=len(found), time=found[0])] if found else []


def _layout(said: Parameters, raw: bytes, processor: int) -> tuple[_Layout, list[Notice]]:
    """The layout that fits the file's size best, of those the one that contradicts the fewest statements."""
    header = _numbers(raw[:24], "u2", processor).tolist()
    (points, measured, first, last), block, samples = header[1:5], header[8], header[9]
    scale, rate = _numbers(raw[12:16] + raw[20:24], "f4", processor).tolist()
    number, used, fast = said.number, said.number("ANALOG", "USED"), said.number("ANALOG", "RATE")
    begin, end = (number("TRIAL", f"ACTUAL_{which}_FIELD") or math.nan for which in ("START", "END"))
    frames = {_HEADER: last - first + 1.0, "TRIAL:ACTUAL_END_FIELD": end - begin + 1.0}
    frames |= {f"POINT:{name}": number("POINT", name) for name in ("LONG_FRAMES", "FRAMES")}
    if last == _MANY:  # or more, which the others may say
        frames = {where: n for where, n in frames.items() if n > _MANY} or {_HEADER: frames[_HEADER]}
    stated: dict[str, dict[str, float]] = {  # by a layout's fields; NaN where nothing is stated
        "points": {_HEADER: points, "POINT:USED": number("POINT", "USED")},
        "channels": {"ANALOG:USED": used},
        "samples_a_frame": {_HEADER: samples},
        "first_block": {_HEADER: block, "POINT:DATA_START": number("POINT", "DATA_START") or math.nan},
        "first_frame": {"TRIAL:ACTUAL_START_FIELD": begin, _HEADER: first},
        "frames": frames,
        "scale": {"POINT:SCALE": number("POINT", "SCALE"), _HEADER: scale},
        "frame_rate": {"POINT:RATE": number("POINT", "RATE") or math.nan, _HEADER: rate},
    }
    options = [list(of.values()) for of in stated.values()]
    options[1].append(_over(measured, samples))
    options[2] += [_over(measured, used), *(np.round(fast / rate) for rate in options[-1] if rate > 0.0)]
    stated["analog_numbers"] = {_HEADER: measured}
    stated["analog_rate"] = {"ANALOG:RATE": fast if measured else math.nan}
    tail = raw[-2 * _BLOCK :]
    written = len(raw) - len(tail) + len(tail.rstrip(b"\0"))  # without the zeros that fill the last block up

    def misfit(taken: _Layout) -> tuple[bool, bool, int]:
        behind, facts = len(raw) - taken.places()[1], taken.facts()
        untrue = [n for what, of in stated.items() for n in of.values() if not _same(n, facts[what])]
        return behind < 0, behind > _BLOCK, len(untrue)

    found = []
    finite = ([n for n in dict.fromkeys(of) if abs(n) < 2**31] or [0.0] for of in options)
    for each in itertools.product(*finite):
        layout = _Layout(*map(int, each[:6]), *each[6:])
        start, after = layout._replace(frames=1).places()
        room = -((start - written) // max(after - start, 1))
        if min(*each[:3], start - _BLOCK) >= 0 and after > start and 1.0 <= layout.frame_rate <= 1e5:
            found += [layout._replace(frames=n) for n in (layout.frames, room * (room > _MANY)) if n > 0]
    if not found:
        raise _refused(said.file, "is damaged: it holds no frames, or none of its rates is 1 to 100000 Hz")
    taken = min(found, key=misfit)
    if (end := taken.places()[1]) > len(raw):
        raise _refused(said.file, f"is cut short or damaged: it has {len(raw)} bytes of {end}")
    notices, facts = [], taken.facts()
    for what, of in stated.items():
        there = [(n, where) for where, n in of.items() if not math.isnan(n)]
        if not all(_same(n, facts[what]) for n, _ in there):
            text = "its {subject}: {stated}; {taken:g} was taken, by its size and what else it states"
            listed, name = ", ".join(f"{n:g} in {where}" for n, where in there), what.replace("_", " ")
            one = Notice("c3d-contradicts", text, subject=name, stated=listed, taken=facts[what])
            near = "rate" in what and all(math.isclose(n, facts[what], rel_tol=_NEAR) for n, _ in there)
            notices.append(one.with_severity("note") if near else one)
    if len(raw) - end > _BLOCK and raw[end:].strip(b"\0"):
        text = "{count} bytes behind its last frame are not read"
        notices.append(note("c3d-more", text, count=len(raw) - end))
    return taken, notices


def _same(stated: float, taken: float) -> bool:
    """Whether a statement is what was taken, or none; of a scale below 0 only its sign says anything."""
    return math.isnan(stated) or max(stated, taken) < 0.0 or math.isclose(stated, taken, rel_tol=_SAME)


def _over(whole: float, by: float) -> float:
    return whole / by if by and not whole % by else math.nan if whole else 0.0


def _parameters(path: pathlib.Path, raw: bytes, at: int, processor: int) -> dict[str, dict[str, _Parameter]]:
    """The groups of a section whose first name lies at a byte of the file."""
    names, first = dict[int, str](), at
    found: dict[int, dict[str, _Parameter]] = {}
    while at < len(raw) and raw[at]:
        length, group, *_ = np.frombuffer(raw[at : at + 2] + b"\0", "i1").tolist()
        start = at + 2 + abs(length)  # a negative one locks the parameter
        name, head = _text(raw[at + 2 : start]).upper(), raw[start : start + 4] + bytes(4)
        step, shape = int(_numbers(head[:2], "u2", processor)[0]), tuple(raw[start + 4 : start + 4 + head[3]])
        kind, begin = int.from_bytes(head[2:3], signed=True), start + 4 + head[3]
        if group < 0:
            names[-group], end = name, start
        elif kind not in _TYPES or not name.isprintable() or math.prod(n or 1 for n in shape) > 0xFFFF:
            raise _refused(path, f"is damaged: what should be a parameter at its byte {at} is none")
        else:
            end, width = begin + math.prod(shape) * int(_TYPES[kind][1]), math.prod(shape[:1])
            spans = [slice(begin + k * width, begin + (k + 1) * width) for k in range(math.prod(shape[1:]))]
            whole = kind > 0 and end <= len(raw)
            values = (
                _numbers(raw[begin:end], _TYPES[kind], processor) if whole else [_text(raw[k]) for k in spans]
            )
            found.setdefault(group, {})[name] = _Parameter(kind, shape, values)
        at = start + step if step else len(raw)
        if at < end or end > len(raw):
            raise _refused(path, f"is damaged: its parameter {name} does not fit into its record")
    if lost := [name for group in found.keys() - names for name in found[group]]:
        raise _refused(path, f"is damaged: its parameter {lost[0]} belongs to no group")
    for name in _NEEDED:  # a group that a broken chain of records does not lead to
        called = rb"[%c%c][\x80-\xff]%s" % (len(name), 256 - len(name), name.encode())
        known = re.search(called, raw[first:][:_LONG])
        if known and name not in names.values():
            raise _refused(path, f"is damaged: its parameters break off before their group {name}")
    return {names[group]: parts for group, parts in found.items()}


def _numbers(data: bytes | memoryview, code: str, processor: int) -> np.ndarray:
    if code != "f4" or processor != _DEC:
        return np.frombuffer(data, _PROCESSORS[processor] + code)
    halves = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1]  # and the exponent counts from 2 less
    return halves.copy().view("<f4").ravel() * np.float32(0.25)


def _text(data: bytes) -> str:
    return data.decode("latin-1").strip("\0 ")


def _refused(path: pathlib.Path, problem: str) -> InputError:
    return InputError(problem, file=path, allowed="a sound C3D file: copy it again, or export it anew")
