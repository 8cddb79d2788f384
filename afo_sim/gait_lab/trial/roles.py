"""Which marker sits on which landmark: by its name in the usual sets, or by a file that a person edits."""

import difflib
import itertools
import pathlib
import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import tomli_w

from afo_sim.common import InputError, Notice, read_toml, unknown, write_sealed
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial.choices import SIDES
from afo_sim.gait_lab.trial.marker_sets import GENERAL, LANDMARKS, SETS, MarkerSet

_Reading = tuple[str, str]  # side, or "" for none; the rest of the name
_Read = Mapping[str, Sequence[_Reading]]  # by name
_Found = dict[str, dict[str, str]]  # by side and landmark
# Computed signals that a C3D keeps among its points.
_COMPUTED = re.compile(r"(angle|moment|force|power|grf|scale|score)s?\d*$")

_BETWEEN = re.compile(r"[\W_]+|(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")  # words of a name
_VIRTUAL = re.compile(r"^([Vv](irtual)?[._\- ]|[pj](?=Left|Right))")  # before the name of a computed point
# Words for right and left, English first
_SIDES = "right left, r l, rt lt, re li, rechts links, dx sx, d g, droit gauche, droite gauche, der izq, d i"
_PAIRS = [tuple(pair.split()) for pair in _SIDES.split(",")]

Names = Mapping[str, tuple[str, ...]]  # landmark → markers; the midpoint of several counts
_CANDIDATES = 3  # names that a message offers for a missing landmark
_RECOGNISED = 4  # landmarks with its names, from which on a set is recognised
_CLUSTER = re.compile(r"(th|thi|thl|thigh|sh|shk|shank|tib|tb|leg)[a-z]?[a-z]?\d*$")
_LIKENESS = 0.6  # of two names, from which on one is offered for the other
_GROUPS = (*SIDES, "middle")
_TABLES = {"r": ("right",), "l": ("left",), "both": SIDES}  # further titles in a map
_HEAD = """\
# Which marker sits on which landmark of the body.
# What stands here counts; other landmarks are found by their names. ["A", "B"]: their midpoint; "A or B": the
# first that a trial holds. [both] is for both sides: "{S}HEE" is RHEE and LHEE. # begins what does not count.
# A leg needs: hip_centre, or both asis (with psis or sacrum), or trochanter; knee_centre, knee_lateral or
# knee_medial; ankle_centre, ankle_lateral or ankle_medial; heel; a metatarsal or toe_tip.
# Lateral and medial marker together place knee and ankle better than one of them.
"""


@dataclass(frozen=True)
class Roles(Noted):
    """The landmarks of both legs that a file's names show."""

    sides: Mapping[str, Names]  # "right" and "left"; the sacrum is in both
    notices: tuple[Notice, ...] = ()


def find_roles(markers: Markers) -> Roles:
    """The landmarks that a file's names show."""
    read = readings(list(markers.positions))
    ranked = sorted(SETS, key=lambda known: _fit(known, read), reverse=True)
    best, (sure, hits) = ranked[0], _fit(ranked[0], read)
    found: _Found = {side: {} for side in SIDES}
    for known in (best, GENERAL) if sure >= _RECOGNISED else (GENERAL,):
        _add(found, read, known)
    served = {side: {LANDMARKS[landmark][0] for landmark in found[side]} for side in SIDES}
    for known in ranked:
        _add(found, read, known, served)
    notices = []
    if sure >= _RECOGNISED:
        text = "marker set: {name}, by {hits} of {count} names"
        notices.append(note("marker-set", text, name=best.name, hits=hits, count=len(read)))
    if best.meaning_of("toe") == "metatarsal_2":
        forefeet = [side["metatarsal_2"] for side in found.values() if "metatarsal_2" in side]
        named = [name for name in forefeet if any(rest == "toe" for _, rest in read[name])]
        if named:
            text = "{markers} on the second metatarsal head, as in that set"
            notices.append(note("toe-on-metatarsal", text, markers=" and ".join(named)))
    for name in dict.fromkeys(name for names in found.values() for name in names.values()):
        twins = (other for other in markers.positions if re.fullmatch(re.escape(name) + r"\.\d+", other))
        notices += [_duplicate(markers, name, twin) for twin in twins]
    sides = {side: {landmark: (name,) for landmark, name in found[side].items()} for side in SIDES}
    return Roles(sides, tuple(notices))


def candidates(names: Sequence[str], side: str, landmarks: Iterable[str]) -> list[str]:
    """Names that look most like those of some landmarks, the likeliest first."""
    marks = list(landmarks)
    usual = {word for known in (GENERAL, *SETS) for mark in marks for word in known.names.get(mark, ())}
    likely = []
    for name, ways in readings(names).items():
        # a side's letter may be any word's first one: the longest reading of another side is that side's
        rests = [rest for letter, rest in ways if letter in (side, "")]
        if any(letter not in (side, "") for letter, _ in ways) and not any(s == side for s, _ in ways):
            continue
        if any(_CLUSTER.match(rest) for rest in rests):
            continue  # on the middle of a segment
        ratios = [difflib.SequenceMatcher(None, rest, word).ratio() for rest in rests for word in usual]
        if max(ratios, default=0.0) >= _LIKENESS:
            likely.append((-max(ratios), name))
    return [name for _, name in sorted(likely, key=lambda entry: entry[0])[:_CANDIDATES]]


def missing_roles(
    markers: Markers, side: str, missing: Mapping[str, Sequence[str]], known: Collection[str],
    standing: Mapping[str, str],
) -> InputError:  # fmt: skip
    """One refusal for all points of a leg that have no marker; `standing` has those of a standing trial."""
    free = [name for name in markers.positions if name not in known]
    parts, empty, never = [], [], readings(list(markers.unseen))
    meant = {name: {_meaning(known, ways) for known in (GENERAL, *SETS)} for name, ways in never.items()}
    for role, landmarks in missing.items():
        near = candidates(free, side, landmarks)
        unseen = [name for name, means in meant.items() if means & {(side, mark) for mark in landmarks}]
        if unseen:
            empty.append(f"{' and '.join(unseen)} of the {side} {role}")
            continue
        hint = f"perhaps {' or '.join(near)}" if near else "no name is like it"
        if role in standing:
            hint += f"; the standing trial has {standing[role]}, and the walk too little to carry it"
        parts.append(f"{role} ({hint})")
    options = ", ".join(f"`marker={role}=NAME`" for role in missing)
    nameable = not all(any(_CLUSTER.match(rest) for _, rest in ways) for ways in readings(free).values())
    said = [f"no marker of the {side} {', '.join(parts)} is known by its name"] if parts else []
    said += [f"the file holds {', '.join(empty)} without a single place"] if empty else []
    return InputError(
        "; ".join(said),
        file=markers.file,
        field="markers",
        allowed=f"{options}, or NAME,NAME for the midpoint of two, or a file of roles, `map`; "
        f"the file's names are {', '.join(markers.positions)}"
        if nameable
        else "a trial in which they are marked; of this one's names none is left",
    )


def plain(name: str) -> str:
    """A name in lower case without `subject:`, accents and punctuation."""
    bare = unicodedata.normalize("NFKD", name.split(":")[-1].lower())
    return re.sub("[^a-z0-9]", "", bare.replace("ß", "ss"))


def readings(names: Sequence[str]) -> dict[str, list[_Reading]]:
    """Ways to read each of a file's names, the likeliest first; computed signals are left out."""
    bare = {name: name.strip().split(":")[-1] for name in names if not _COMPUTED.search(plain(name))}
    pairs = zip(min(bare.values()), max(bare.values()), strict=False) if len(bare) > 3 else ()
    same = itertools.takewhile(lambda pair: pair[0] == pair[1], pairs)  # what all names begin with
    # to a separator; never a side's letter or word
    found = re.match(r".*[_.\- ]", "".join(letter for letter, _ in same))
    start = found[0] if found and plain(found[0]) not in ("r", "l", *SIDES) else ""
    bare = {name: _VIRTUAL.sub("", each.removeprefix(start)) for name, each in bare.items()}
    whole = {plain(each) for each in bare.values()}
    return {name: list(_readings(each, whole)) for name, each in bare.items()}


def _readings(bare: str, names: Collection[str]) -> Iterator[_Reading]:
    """Side and rest of a name; a word for a side that may be none counts by its twin of the other side."""
    words = [plain(word) for word in _BETWEEN.split(bare)]
    whole = "".join(words)
    yield "", whole
    for pair in _PAIRS:
        for side, word, other in zip(SIDES, pair, pair[::-1], strict=True):
            splits = [(words[:k], words[k + 1 :], True) for k, each in enumerate(words) if each == word]
            if whole.startswith(word):
                splits.append(([], [whole.removeprefix(word)], True))
            if whole.endswith(word):
                splits.append(([whole.removesuffix(word)], [], len(word) > 1))
            for before, after, sure in splits:
                if (sure and pair in _PAIRS[:2]) or "".join((*before, other, *after)) in names:
                    yield side, "".join((*before, *after))


def _add(
    found: _Found, read: _Read, known: MarkerSet, served: Mapping[str, Collection[str]] | None = None
) -> None:
    """Add a set's landmarks that are not there yet, and serve no point of the leg that is served."""
    for name, ways in read.items():
        meaning = _meaning(known, ways)
        if meaning is None:
            continue
        side, landmark = meaning
        for each in SIDES if not side else (side,):
            served_already = served is not None and LANDMARKS[landmark][0] in served[each]
            if not served_already and name not in found[each].values():
                found[each].setdefault(landmark, name)


def _fit(known: MarkerSet, read: _Read) -> tuple[int, int]:
    """Of how many landmarks a set knows the names, and of how many markers."""
    meant = [meaning[1] for ways in read.values() if (meaning := _meaning(known, ways))]
    return len(set(meant)), len(meant)


def _meaning(known: MarkerSet, ways: Sequence[_Reading]) -> _Reading | None:
    for side, rest in ways:
        landmark = known.meaning_of(rest)
        if landmark is not None and (landmark == "sacrum") == (side == ""):
            return side, landmark
    return None


def _duplicate(markers: Markers, name: str, twin: str) -> Notice:
    apart = np.linalg.norm(markers.positions[name] - markers.positions[twin], axis=1)
    if not np.isfinite(apart).any():
        text = "the label {subject} occurs twice, never seen at both places at once; the first is taken"
        return Notice("label-doubled", text, subject=name)
    text = "the label {subject} occurs twice, up to {apart_mm:.0f} mm apart; the first is taken"
    return Notice("label-doubled", text, subject=name, apart_mm=1e3 * float(np.nanmax(apart)))


def read_role_map(path: pathlib.Path) -> dict[str, dict[str, tuple[str, ...]]]:
    """Read a map of roles: by right, left and middle, each landmark's names; `A or B` are alternatives."""
    found: dict[str, dict[str, tuple[str, ...]]] = {group: {} for group in _GROUPS}
    for title, table in read_toml(path).items():
        groups = _TABLES.get(title, (title,))
        if groups[0] not in _GROUPS:
            raise unknown(title, (*_GROUPS, *_TABLES), file=path, field=title, problem="is an unknown table")
        if not isinstance(table, dict):
            problem, allowed = "is not a valid table", f"[{title}]"
            raise InputError(problem, file=path, field=title, value=table, allowed=allowed)
        for landmark, value in table.items():
            field = f"{title}.{landmark}"
            if landmark not in _landmarks(groups[0]):
                problem = "is an unknown landmark"
                raise unknown(landmark, _landmarks(groups[0]), file=path, field=field, problem=problem)
            names = [value] if isinstance(value, str) else value
            if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
                allowed = '"NAME", "NAME or NAME" or ["NAME", "NAME"]'
                problem = "is not a valid marker"
                raise InputError(problem, file=path, field=field, value=value, allowed=allowed)
            for group in groups:
                letter = group[0]
                named = (n.replace("{S}", letter.upper()).replace("{s}", letter) for n in names)
                found[group][landmark] = tuple(named)
    return found


def mapped_roles(path: pathlib.Path, markers: Markers, side: str, others: Collection[str] = ()) -> Roles:
    """The landmarks of a map, and by their names those of which it does not speak.

    A landmark of `side` that neither the trial nor `others` hold is refused, unless the map has another for
    the same point.
    """
    table, usual, sides, absent = read_role_map(path), find_roles(markers), {}, []
    for each in SIDES:
        stated, found = table[each] | table["middle"], {}
        lost: dict[str, str] = {}  # landmark → name
        for landmark, texts in stated.items():
            ways = [text.split(" or ") for text in texts]
            held = [next((name for name in way if name in markers.positions), "") for way in ways]
            if all(held):
                found[landmark] = tuple(held)
            elif not all({*way} & {*others, *markers.positions} for way in ways):
                lost[landmark] = ways[held.index("")][0]
        served = {LANDMARKS[landmark][0] for landmark in found}
        for landmark, name in lost.items():
            absent.append(name)
            if each == side and LANDMARKS[landmark][0] not in served:
                field = f"{'middle' if landmark in table['middle'] else each}.{landmark}"
                problem = f"there is no such marker in {markers.file}"
                raise unknown(name, markers.positions, file=path, field=field, problem=problem)
        taken = {names[0] for names in found.values() if len(names) == 1}
        for landmark, names in usual.sides[each].items():
            beside = LANDMARKS[landmark][0] not in served - {"pelvis"} or landmark[-2:] == "al"
            if landmark not in stated and beside and not taken & {*names}:
                found[landmark] = names
        sides[each] = found
    text = "markers as {file} says" + ("; it names {absent}, which the trial lacks" if absent else "")
    told = note("markers-mapped", text, file=path.name, absent=", ".join(dict.fromkeys(absent)))
    return Roles(sides, (*usual.notices, told))


def write_role_map(path: pathlib.Path, markers: Markers, roles: Roles | None = None) -> None:
    """Write a map of roles, whole or not at all: what is known, and names that look like what is missing."""
    roles = find_roles(markers) if roles is None else roles
    used = {name for side in roles.sides.values() for names in side.values() for name in names}
    free = [name for name in markers.positions if name not in used]
    lines = [_HEAD, f"# The markers of {markers.file.name}:", *(f"# {_quoted(n)}" for n in markers.positions)]
    for group in _GROUPS:
        known = roles.sides[SIDES[0] if group == "middle" else group]
        lines += ["", f"[{group}]", *(_line(group, landmark, known, free) for landmark in _landmarks(group))]
    write_sealed(path, "\n".join(lines) + "\n", "role map")


def _line(group: str, landmark: str, known: Mapping[str, tuple[str, ...]], free: Sequence[str]) -> str:
    place = LANDMARKS[landmark][1]
    if landmark in known:
        return f"{landmark} = [{', '.join(map(_quoted, known[landmark]))}]  # {place}"
    near = candidates(free, "" if group == "middle" else group, [landmark])
    hint = f"; perhaps {', '.join(map(_quoted, near))}" if near else ""
    return f'# {landmark} = ["NAME"]  # {place}{hint}'


def _landmarks(group: str) -> list[str]:
    return [name for name in LANDMARKS if (name == "sacrum") == (group == "middle")]


def _quoted(name: str) -> str:
    return tomli_w.dumps({"x": name}).removeprefix("x = ").strip()
