"""One answer of a verdict: its question, status and words, and how a number becomes one of these.

Each answer has a number, what it is held against, and a status that is stated by a word and a mark as well as
by a colour.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from afo_sim.metrics.facts import Limits as Limits
from afo_sim.metrics.metric import Metric

Status = Literal["good", "doubtful", "bad", "unknown"]
WORST: tuple[Status, ...] = ("good", "doubtful", "bad")  # the later, the worse

HELP, LIFT, HEEL = "help", "lift", "heel"
PUSH_OFF, AIR, SKIN = "push_off", "air", "skin"
ADDS = "air_adds"
QUESTIONS = {
    HELP: "Does it help?", LIFT: "Does it lift the toe?", HEEL: "Does it land on the heel?",
    PUSH_OFF: "Does it hinder push-off?", ADDS: "What does the air add?", AIR: "How much air does it use?",
    SKIN: "Can the skin tolerate it?",
}  # fmt: skip
# {metric of push-off: the limits that it is held against}
AGAINST = {
    "torque_against_push_off_per_mass": "torque_against_push_off",
    "work_against_push_off": "work_against_push_off",
}
CHANGED = 0.5  # toe clearances that differ by less are the same to a person [mm]
UNCOMPENSATED = ("uncompensated_reference_toe_clearance", "uncompensated_toe_clearance")

Numbers = Mapping[str, Metric]


@dataclass(frozen=True)
class Feed:
    """The source that a scenario names, in words."""

    words: str
    runs: bool = False


@dataclass(frozen=True)
class Answer:
    """One line of a verdict: question, answer, numbers in words, and their limits."""

    name: str  # of the question, such as "lift"
    question: str  # in words
    status: Status  # "good", "doubtful", "bad" or "unknown"
    text: str  # the numbers, in words
    limit: str  # what they are held against, in words
    brief: str = ""  # the same for a table's cell
    kept: float | None = None
    """Share of draws of what is not known that keep a good answer; None where nothing was drawn."""

    def __str__(self) -> str:
        return f"{self.word}: {self.question} {self.text} Limit: {self.limit}."

    @property
    def word(self) -> str:
        """The status for people; a good one that was not tried on draws is marked."""
        return self.status.upper() + ("*" if self.status == "good" and self.kept is None else "")


def at_least(value: float, limit: tuple[float, float]) -> Status:
    """Good from the first limit on, bad below the second."""
    if not math.isfinite(value):
        return "unknown"
    return "good" if value >= limit[0] else "bad" if value < limit[1] else "doubtful"


def at_most(value: float, limit: tuple[float, float]) -> Status:
    """Good up to the first limit, bad beyond the second."""
    return at_least(-value, (-limit[0], -limit[1]))


def worst(statuses: Sequence[Status]) -> Status:
    """The worst of some; what is unknown hides what is good, and nothing hides what is bad."""
    if "bad" in statuses or "unknown" not in statuses:
        return max((each for each in statuses if each != "unknown"), key=WORST.index, default="unknown")
    return "unknown"


def has(metrics: Numbers, name: str) -> bool:
    """Whether a metric is there and finite."""
    return name in metrics and math.isfinite(metrics[name].value)


def lasting(seconds: float) -> str:
    """A time [s] in seconds, minutes or hours."""
    if seconds < 60.0:
        return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.1f} s"
    if seconds >= 6000.0:
        return f"{seconds / 3600.0:.1f} h"
    return f"{seconds / 60.0:.0f} min" if seconds >= 600.0 else f"{seconds / 60.0:.1f} min"


def three(value: float) -> str:
    """Whole from 100 on, three digits below."""
    return f"{value:.0f}" if value >= 99.95 else f"{value:.3g}"


def numbered(keys: Sequence[int]) -> str:
    """Strides counted from the start: "stride 3", "strides 1 to 3 and 7"; key 0 is the first."""
    numbers = sorted(k + 1 for k in keys)
    groups = itertools.groupby(enumerate(numbers), lambda pair: pair[1] - pair[0])
    runs = [[each[0][1], each[-1][1]] for each in (list(group) for _, group in groups)]
    stated = [f"{a}" if a == b else f"{a} {'and' if b == a + 1 else 'to'} {b}" for a, b in runs]
    return f"stride{'s' if len(numbers) > 1 else ''} {listed(stated)}"


def listed(parts: Sequence[str]) -> str:
    """Parts with commas, and "and" before the last."""
    return " and ".join(filter(None, [", ".join(parts[:-1]), *parts[-1:]]))


def capital(text: str) -> str:
    """A text that begins with a capital letter; it may not be empty."""
    return text[0].upper() + text[1:]


def millimetres(height: float) -> str:
    """A height [mm] to a tenth, with its unit and a true minus sign."""
    return f"{in_digits(round(height, 1) + 0.0, '.1f')} mm"


def in_digits(value: float, form: str = "g") -> str:
    """A number in a format, with a true minus sign."""
    return f"{value:{form}}".replace("-", "−")


def clean(value: float) -> float:
    """A limit without the last digits of its conversion."""
    return round(value, 9) + 0.0


def passes(height: float) -> str:
    """A toe clearance [mm] in words, to the digit of the answer about the toe."""
    return f"{millimetres(abs(height))} {'above' if height >= 0.0 else 'below'} the floor"


def unknown(name: str, reason: str, limit: str) -> Answer:
    """The answer where a number is missing."""
    return Answer(name, QUESTIONS[name], "unknown", f"Not known: {reason}.", limit)
