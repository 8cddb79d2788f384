"""The facts of a muscle's mounting as text: for the design picture's table and for `afo-sim check`."""

import numpy as np

from afo_sim.common import Notice
from afo_sim.model.path_facts import NAMED, PathFacts, Span

Row = tuple[str, str]  # what, and its words
_SLACK = 1e-3  # by which a muscle may hang without a word [m]


def rows(facts: PathFacts) -> list[Row]:
    """Everything about a group of alike muscles, a line a subject."""
    name, bar = facts.name, pressure(facts)
    low, high = (degrees(angle) for angle in facts.range)
    of = "rest of its cable" if facts.group.pulley is not None else "path"
    lengths = f"{of} {span(facts.length, facts, 1e3)} mm over {low} to {high} deg"
    found = [
        (name, f"{len(facts.muscles)} × {facts.group.type.name}, {lengths}"),
        (f"{name}, no air", f"taut {taut(facts, 0)}; own contraction {own(facts, 0)}"),
        (f"{name}, {bar}", f"taut {taut(facts, 1)}; own contraction {own(facts, 1)}"),
        (f"{name}, moment arm", arm(facts)),
        (f"{name}, torque at {bar}", f"{torques(facts)}; at most {peak(facts)}"),
    ]
    found += [
        (f"{name}, {what}", f"{in_words(spans, facts.angles)} ({why})")
        for what, spans, why in (
            ("locks", facts.locked, f"a contraction of {_minus(f'{facts.group.type.braid.lock:.3f}')}"),
            ("stretched too far", facts.stretched, _limit(facts, "contraction_min")),
            ("too short to follow", facts.short, _limit(facts, "contraction_max")),
        )
        if spans
    ]
    return found


def slack_everywhere(facts: PathFacts) -> Notice | None:
    """A warning where muscles without air are slack at every angle of the range of motion."""
    hangs = (facts.chain_length[:, 0] - facts.length)[facts.inside]
    if facts.group.pulley is not None or hangs.min() < _SLACK:
        return None
    words = "{subject} muscles without air are slack at every angle, by {least:.0f} to {most:.0f} mm: they "
    words += (
        "must shorten by as much before they pull; a link_length shorter by {least:.0f} mm makes them taut "
    )
    words += "at one angle"
    least, most = (1e3 * float(by) for by in (hangs.min(), hangs.max()))
    return Notice("slack-everywhere", words, subject=facts.name, least=least, most=most)


def pressure(facts: PathFacts) -> str:
    """The full pressure."""
    return f"{facts.pressures[-1] * 1e-5:g} bar"


def taut(facts: PathFacts, which: int) -> str:
    """The angles at which the muscle is taut: 0 without air, 1 at full pressure."""
    first, last = float(facts.angles[0]), float(facts.angles[-1])
    # What ranges leave of a whole one
    edges = [first, *(edge for span in facts.slack[which] for edge in span), last]
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return in_words(tuple((low, high) for low, high in pairs if high > low), facts.angles)


def own(facts: PathFacts, which: int) -> str:
    """A muscle's own contraction over the range of motion: 0 without air, 1 at full pressure."""
    return span(facts.own[:, -which], facts, 1.0, 3)


def arm(facts: PathFacts) -> str:
    """Smallest and largest moment arm over the range of motion, with their angles [mm]."""
    inside = np.flatnonzero(facts.inside)
    amounts = np.abs(facts.arm[inside])
    rows = inside[amounts.argmin()], inside[amounts.argmax()]
    ends = [f"{_minus(f'{1e3 * facts.arm[row]:.0f}')} mm at {degrees(facts.angles[row])} deg" for row in rows]
    if np.ptp(amounts) < 5e-4:
        return f"{_minus(f'{1e3 * facts.arm[rows[0]]:.0f}')} mm at every angle"
    return " to ".join(ends)


def torques(facts: PathFacts) -> str:
    """Torque at full pressure at the angles that are named, within the ankle's stops."""
    named = [angle for angle in NAMED if facts.angles[0] - 1e-9 <= angle <= facts.angles[-1] + 1e-9]
    values = ", ".join(_number(facts.torque[facts.at(angle), -1]) for angle in named)
    return f"{values} N·m at {', '.join(_minus(f'{np.degrees(angle):.0f}') for angle in named)} deg"


def peak(facts: PathFacts) -> str:
    """Largest torque at full pressure within the range of motion, and where."""
    torque, angle = facts.peak()
    return f"{_number(torque)} N·m at {degrees(angle)} deg"


def span(values: np.ndarray, facts: PathFacts, factor: float, digits: int = 0) -> str:
    """Lowest to highest over the range of motion."""
    within = factor * values[facts.inside]
    low, high = (_number(value, digits) for value in (within.min(), within.max()))
    return low if low == high else f"{low} to {high}"


def _number(value: float, digits: int = 1) -> str:
    """A number with so many decimals, without a negative zero."""
    shown = f"{value:.{digits}f}"
    return _minus(shown if float(shown) else f"{0.0:.{digits}f}")


def _limit(facts: PathFacts, key: str) -> str:
    limit = getattr(facts.group.type.limits, key)
    return f"its limit is a contraction of {_minus(f'{limit:g}')}"


def _minus(text: str) -> str:
    return text.replace("-", "−")


def in_words(spans: tuple[Span, ...], angles: np.ndarray) -> str:
    """Ranges in words: "below −15.5 deg", "above 3 deg", "nowhere", "everywhere"."""
    if not spans:
        return "nowhere"
    found, (first, last) = [], (float(angles[0]), float(angles[-1]))
    for span in spans:
        low, high = (f"{degrees(angle)} deg" for angle in span)
        words = f"above {low}" if span[1] == last else f"{low} to {high}"
        words = f"below {high}" if span[0] == first else words
        found.append("everywhere" if span == (first, last) else words)
    return " and ".join(found)


def degrees(angle: float) -> str:
    """An angle [rad] in degrees with at most one decimal, and a minus sign of the width of a plus."""
    shown = f"{np.degrees(angle):.1f}".removesuffix(".0")
    return ("0" if shown == "-0" else shown).replace("-", "−")
