"""What a warning does to an answer: no answer is good whose numbers a warning doubts.

Each answer rests on columns of the recording. A warning doubts columns, and caps the answers that rest on
them: at doubtful where the number may be off, at unknown where it means nothing, at bad where the device
would not survive.
"""

import dataclasses
import math
from collections.abc import Iterable, Sequence

from afo_sim.common import Notice
from afo_sim.metrics.answer import Answer, Status, worst
from afo_sim.metrics.verdict import ENOUGH

FORCE, MOTION, FLOW, SWING = "muscle/force", "ankle/angle", "supply/mass_flow", "toe/height"
MOMENT = "ankle/moment/orthosis"
RESTS_ON = {  # {answer: the columns that it is made of; all follow from the muscles' force}
    "help": (FORCE, MOTION, SWING),
    "lift": (FORCE, MOTION, SWING),
    "heel": (FORCE, MOTION),
    "push_off": (FORCE, MOMENT),
    "air": (FORCE, FLOW),
    "air_adds": (FORCE, MOTION, SWING, MOMENT),
    "skin": (FORCE, MOMENT),
    "move": (FORCE, MOTION),
}
_ALL = (FORCE, MOTION, MOMENT, FLOW, SWING)
# a cap, the columns, the warnings that doubt them
CAPPED: tuple[tuple[Status, tuple[str, ...], str], ...] = (
    ("bad", (SWING,), "muscle-pressure muscle-force"),  # what bursts lifts nothing
    ("bad", (FLOW,), "source-short"),
    ("unknown", (FORCE,), "muscle-contraction muscle-stretch"),
    ("unknown", (FLOW,), "source-freezes"),
    ("unknown", _ALL, "recovered phase-never-known"),
    ("doubtful", (FORCE,), "law-outside-its-pressure law-outside-its-contraction law-mismatch"),
    ("doubtful", (FORCE,), "path-jumps-below-range path-jumps-above-range path-through-bone"),
    ("doubtful", (FORCE,), "muscle-length muscle-bends surface-not-touched law-of-your-own"),
    ("doubtful", (FLOW,), "law-volume"),
    ("doubtful", (MOTION,), "passive-ankle-extrapolated walker-not-usual trial-looks-healthy side-assumed"),
    ("doubtful", (MOTION,), "stop-reached stop-in-the-air"),
    ("doubtful", (MOMENT,), "ground-recorded"),
    ("doubtful", (MOTION, MOMENT), "trial-doubted"),
    ("doubtful", (MOTION, MOMENT), "sole-off-floor"),
    ("doubtful", (SWING,), "plate-without-outsole"),
    ("doubtful", _ALL, "valve-pressure-low valve-pressure-high pulse-short tube-long air-coarse"),
    ("doubtful", _ALL, "timer-drifts too-few-strides strides-differ strides-unsettled step-matters"),
    ("doubtful", _ALL, "energy-lost energy-from-friction design-implausible phase-seldom-known"),
)
CAPS = {code: (cap, columns) for cap, columns, codes in CAPPED for code in codes.split()}

# Told by help, in numbers; that what was set is not simulated.
_TOLD = {"steppage", "hip-rises-in-swing", "ankle-low-in-swing", "compensation-unknown"}
_TOLD |= {"strength-not-applied"}
IF_SO = "enough, if these numbers hold"
LITTLE = 0.02  # of a limit, by which a muscle may pass it and survive; assumed [-]


def decides(warning: str) -> bool:
    """Whether an answer depends on a warning, so that no list of them may leave it out."""
    return isinstance(warning, Notice) and warning.code in CAPS.keys() | _TOLD


def capped(answers: Sequence[Answer], warnings: Iterable[str]) -> tuple[Answer, ...]:
    """The answers, none better than what the warnings leave of the columns that it rests on."""
    found = [one for one in warnings if isinstance(one, Notice) and one.code in CAPS]
    return tuple(_capped(answer, found) for answer in answers) if found else tuple(answers)


def _cap(one: Notice, answer: str) -> Status:
    """The best that a warning leaves of an answer; a limit that is passed by little is in doubt alone."""
    cap, columns = CAPS[one.code]
    if set(columns) & set(RESTS_ON[answer]):
        little = one.data.get("beyond", math.inf) <= LITTLE * abs(one.data.get("limit", 0.0))
        return "doubtful" if cap == "bad" and little else cap
    return "doubtful" if cap == "bad" else "good"


def _capped(answer: Answer, warnings: Sequence[Notice]) -> Answer:
    caps = [_cap(one, answer.name) for one in warnings]
    status = worst([answer.status, *caps])
    if status == answer.status:
        return answer
    # of several the one that decides; of those the first
    why = next(o for o, cap in zip(warnings, caps, strict=True) if worst([answer.status, cap]) == status)
    text, brief = (each.replace(ENOUGH, IF_SO) for each in (answer.text, answer.brief))
    text = f"{text} {status.upper()}, since {why}."
    passed = {"value", "limit", "unit"} <= why.data.keys()
    most = "{value:.3g}, limit {limit:.3g}{unit}".format(**why.data) if passed else ""
    brief = f"{brief}; {why.code.replace('-', ' ')} {most}".rstrip() if brief else ""
    return dataclasses.replace(answer, status=status, text=text, brief=brief)
