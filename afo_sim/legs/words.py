"""Words by which parts and joints of a leg are called in models of bodies and robots."""

import re

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.description.attachment import Side
from afo_sim.legs.names import listed

SHANK = re.compile(r"shank|shin|calf|tibia|lower[ _-]?leg|leg[ _-]?lower|(?<![a-z])[rl][ _-]?lleg|crus|knee")
FOOT = re.compile(r"foot|ankle|talus|calcn|calcaneus|hindfoot")
ANKLE = re.compile(r"ankle|talocrural|foot|_ak[xyz]$")
THIGH = re.compile(r"thigh|femur|upper[ _-]?leg|hip")
# Joints and parts of a foot that are not the ankle.
BEYOND = re.compile(r"subtalar|roll|invers|evers|mtp|toe|forefoot|hallux|phalan")
WORDS = r"foot|ankle|talus|calcn|calcaneus|shank|shin|calf|tibia|knee|leg|toe|thigh|femur|hip"
LETTERS: dict[Side, str] = {"right": "r", "left": "l"}
SIDES: dict[Side, re.Pattern[str]] = {
    side: re.compile(rf"{side}|(?:^|[^a-z]){letter}t?(?:[^a-z]|$)|(?:^|[^a-z]){letter}[ _-]?(?:{WORDS})")
    for side, letter in LETTERS.items()
}
MOST_NAMES = 24  # that an error lists


def plain(name: str) -> str:
    """A name in small letters, with camelCase broken up: RightFoot → right_foot."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def has(words: re.Pattern[str], name: str) -> bool:
    """Whether a name holds one of the words."""
    return words.search(plain(name)) is not None


def side_of(*names: str) -> Side | None:
    """The side that the first name that tells any tells; None where none does, or one tells both."""
    for name in names:
        told: list[Side] = [side for side, words in SIDES.items() if has(words, name)]
        if len(told) == 1:
            return told[0]
    return None


def no_such(kind: str, field: str, name: str, names: list[str], file: object) -> InputError:
    """An error for a name that a file lacks: the names that it has, and the nearest one."""
    return InputError(
        f"there is no such {kind} in {file or 'the model'}",
        field=field,
        value=name,
        allowed=listed(sorted(names), MOST_NAMES),
        nearest=nearest_name(name, names),
    )
