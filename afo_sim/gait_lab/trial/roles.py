"""Which marker sits where: landmarks of both legs, by the markers' names."""

import difflib
import pathlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError, unknown
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.marker_names import Reading, readings
from afo_sim.gait_lab.trial.marker_sets import GENERAL, LANDMARKS, SETS, MarkerSet

Names = Mapping[str, tuple[str, ...]]  # landmark → markers; the midpoint of several counts
CANDIDATES = 3  # names that a message offers for a missing landmark
RECOGNISED = 4  # names from which on a set is recognised
CLUSTER = re.compile(r"(th|thi|thl|thigh|sh|shk|shank|tib|tb|leg)[a-z]?[a-z]?\d*$")
LIKENESS = 0.6  # of two names, from which on one is offered for the other


@dataclass(frozen=True)
class Roles:
    """The landmarks of both legs that a file's names tell."""

    sides: Mapping[str, Names]  # "right" and "left"; the sacrum is in both
    remarks: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def find_roles(markers: Markers) -> Roles:
    """The landmarks that a file's names tell.

    A name that two sets use differently has the meaning of the set that fits most of the file's names.
    Names that mean the same in every set complete it, and names of other sets do so where a point of the
    leg has none.
    """
    read = readings(list(markers.positions))
    ranked = sorted(SETS, key=lambda known: _fit(known, read), reverse=True)
    best, hits = ranked[0], _fit(ranked[0], read)[0]
    found: dict[str, dict[str, str]] = {side: {} for side in SIDES}
    for known in (best, GENERAL) if hits >= RECOGNISED else (GENERAL,):
        _add(found, read, known)
    served = {side: {LANDMARKS[landmark][0] for landmark in found[side]} for side in SIDES}
    for known in ranked:
        _add(found, read, known, served)
    remarks = []
    if hits >= RECOGNISED:
        remarks.append(f"marker set: {best.name}, by {hits} of {len(read)} names")
    if best.meaning_of("toe") == "metatarsal_2":
        forefeet = [side["metatarsal_2"] for side in found.values() if "metatarsal_2" in side]
        named = [name for name in forefeet if any(rest == "toe" for _, rest in read[name])]
        if named:
            remarks.append(f"{' and '.join(named)} on the second metatarsal head, as in that set")
    used = dict.fromkeys(name for names in found.values() for name in names.values())
    warnings = [_duplicate(markers, name, twin) for name in used for twin in _twins(name, markers.positions)]
    sides = {side: {landmark: (name,) for landmark, name in found[side].items()} for side in SIDES}
    return Roles(sides, tuple(remarks), tuple(warnings))


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
        if any(CLUSTER.match(rest) for rest in rests):
            continue  # on the middle of a segment
        ratios = [difflib.SequenceMatcher(None, rest, word).ratio() for rest in rests for word in usual]
        if max(ratios, default=0.0) >= LIKENESS:
            likely.append((-max(ratios), name))
    return [name for _, name in sorted(likely, key=lambda entry: entry[0])[:CANDIDATES]]


def named_points(markers: Markers, choices: Choices) -> dict[str, tuple[str, ...]]:
    """The points of the leg that a person named."""
    for role, names in choices.markers.items():
        for name in names:
            if name not in markers.positions:
                problem = f"there is no such marker in {markers.file}"
                raise unknown(name, markers.positions, field=f"marker.{role}", problem=problem)
    return dict(choices.markers)


def missing_roles(
    markers: Markers,
    side: str,
    missing: Mapping[str, Sequence[str]],
    known: Collection[str],
    map_file: pathlib.Path | None = None,
) -> InputError:
    """One refusal for all points of a leg that have no marker."""
    if map_file is not None:
        return InputError(
            f"names no marker for the {side} {', '.join(missing)}",
            file=map_file,
            field=side,
            allowed="; ".join(f"{role}: {' or '.join(marks)}" for role, marks in missing.items()),
        )
    free = [name for name in markers.positions if name not in known]
    parts = []
    for role, landmarks in missing.items():
        near = candidates(free, side, landmarks)
        parts.append(f"{role} (perhaps {' or '.join(near)})" if near else f"{role} (no name is like it)")
    options = ", ".join(f"`marker={role}=NAME`" for role in missing)
    return InputError(
        f"no marker of the {side} {', '.join(parts)} is known by its name",
        file=markers.file,
        field="markers",
        allowed=f"{options}, or NAME,NAME for the midpoint of two, or a file of roles, `map`; "
        f"the file's names are {', '.join(markers.positions)}",
    )


def _add(
    found: dict[str, dict[str, str]],
    read: Mapping[str, Sequence[Reading]],
    known: MarkerSet,
    served: Mapping[str, Collection[str]] | None = None,
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


def _fit(known: MarkerSet, read: Mapping[str, Sequence[Reading]]) -> tuple[int, int]:
    """How many names a set has meanings for; of equals the one with fewer names of its own is better."""
    hits = sum(_meaning(known, ways) is not None for ways in read.values())
    return hits, -sum(map(len, known.names.values()))


def _meaning(known: MarkerSet, ways: Sequence[Reading]) -> Reading | None:
    """Side and landmark that a name stands for in a set."""
    for side, rest in ways:
        landmark = known.meaning_of(rest)
        if landmark is not None and (landmark == "sacrum") == (side == ""):
            return side, landmark
    return None


def _twins(name: str, names: Iterable[str]) -> list[str]:
    """Further columns of the same label: "RHEE.2"."""
    return [other for other in names if re.fullmatch(re.escape(name) + r"\.\d+", other)]


def _duplicate(markers: Markers, name: str, twin: str) -> str:
    apart = np.linalg.norm(markers.positions[name] - markers.positions[twin], axis=1)
    if not np.isfinite(apart).any():
        return f"the label {name} occurs twice, never seen at both places at once; the first is taken"
    return f"the label {name} occurs twice, up to {1e3 * np.nanmax(apart):.0f} mm apart; the first is taken"
