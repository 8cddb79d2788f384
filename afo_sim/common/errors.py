"""What can go wrong, in words for the person who can mend it."""

import itertools
import math
import operator
import re
from collections.abc import Callable, Iterable

from afo_sim.common.open_types import Mixed

Rename = Callable[[str], str]
_LONGEST = 100  # letters of a name that is compared with others
_MOST_NAMES = 2000  # that one is compared with
MOST_FAULTS = 100  # of one input that are told


class AfoSimError(Exception):
    """Root of this package's errors; `exit_code` is what the command line returns.

    Examples
    --------
    >>> issubclass(InputError, AfoSimError), InputError("is wrong").exit_code
    (True, 2)
    """

    exit_code = 2


class InputError(AfoSimError):
    """The user's input is wrong: which file, which field, which value, what is allowed.

    The facts are also attributes, so callers need not parse the message. A field without a file is an
    argument of the called function; texts name other arguments in backquotes, with or without a value:
    `like=seated`.

    problem : what is wrong, in words
    file : that contains it, or None
    field : its dotted key there, or an argument's name
    value : what was given
    allowed : what would be right, in words
    nearest : the valid name that was probably meant, or None
    others : further faults of the same input

    Examples
    --------
    >>> try:
    ...     run("seatd")
    ... except InputError as error:
    ...     print(error.value, error.nearest)
    seatd seated
    """

    others: tuple["InputError", ...] = ()

    def __init__(
        self,
        problem: str,
        *,
        file: object = None,
        field: str = "",
        value: object = None,
        allowed: str = "",
        nearest: str | None = None,
    ):
        self.problem, self.file, self.field, self.value = problem, file, field, value
        self.allowed, self.nearest = allowed, nearest
        named = field if len(field) <= 80 else f"{field[:77]}..."
        place = ": ".join(str(part) for part in (file, named) if part)
        if value is not None:
            place += f" = {_shown(value)}" if field else f"{': ' if place else ''}{_shown(value)}"
        message = f"{place}: {problem}" if place else problem
        if allowed:
            message += f"; allowed: {allowed}"
        if nearest:
            message += f"; did you mean {nearest!r}?"
        super().__init__(message)

    def replaced(self, **other: Mixed) -> "InputError":
        """The same error with other facts, by the names of the constructor's arguments."""
        names = ("problem", "file", "field", "value", "allowed", "nearest")
        return InputError(**{name: getattr(self, name) for name in names} | other)

    def renamed(self, field: Rename, text: Rename) -> "InputError":
        """The same error, and its others, with other names in fields, but not a file's, and in its texts."""
        name = self.field if self.file is not None else field(self.field)
        found = self.replaced(problem=text(self.problem), field=name, allowed=text(self.allowed))
        found.others = tuple(other.renamed(field, text) for other in self.others)
        return found

    def __str__(self) -> str:
        """Every problem on a line of its own, the first with how many more follow."""
        more = f" ({len(self.others)} more below)" if self.others else ""
        return "\n".join([super().__str__() + more, *map(str, self.others)])


class SimulationError(AfoSimError):
    """A simulation became unstable.

    reason : in words
    simulation : its number, from 0
    time : of the simulation [s]; NaN if unknown

    `run` does not raise it: it returns what was computed, and `status` states why it stopped.

    Examples
    --------
    >>> print(SimulationError("a velocity is too large", time=0.5))
    simulation 0 stopped at t = 0.5 s: a velocity is too large
    """

    exit_code = 3

    def __init__(self, reason: str, *, simulation: int = 0, time: float = float("nan")):
        self.reason, self.simulation, self.time = reason, simulation, time
        where = f"simulation {simulation} stopped at t = {time:.6g} s: " if math.isfinite(time) else ""
        super().__init__(f"{where}{reason}")


class ControllerError(SimulationError):
    """A controller failed, or commanded what is not allowed: the simulation ends there."""

    def __init__(self, reason: str, *, simulation: int = 0, time: float = float("nan")):
        super().__init__(reason, simulation=simulation, time=time)
        self.args = (f"t = {time:.6g} s: {reason}" if math.isfinite(time) else reason,)


class CallbackError(AfoSimError):
    """The muscle callbacks cannot be installed, or are not the ones that ran."""

    exit_code = 3


def refuse(problems: Iterable[InputError]) -> None:
    """Raise the first problem, with the others beside it; nothing where there is none."""
    if found := list(itertools.islice(problems, MOST_FAULTS)):
        found[0].others = tuple(found[1:])
        raise found[0]


def unknown(
    value: object, allowed: Iterable[str], *, field: str = "", file: object = None,
    problem: str = "is not a valid choice",
) -> InputError:  # fmt: skip
    """An error for a name that is not among those allowed: it lists them, and the nearest one."""
    names = list(allowed)
    nearest = nearest_name(value, names) if isinstance(value, str) else None
    return InputError(problem, file=file, field=field, value=value, allowed=", ".join(names), nearest=nearest)


def nearest_name(name: str, names: Iterable[str]) -> str | None:
    """The valid name that `name` most likely means, or None where none is near."""
    found = {other: likeness(name, other) for other in itertools.islice(names, _MOST_NAMES)}
    best = max(found, key=lambda other: found[other], default=None)
    return best if best is not None and found[best] > 0.0 else None


def likeness(name: str, other: str) -> float:
    """How alike a mistyped name and a valid one are: 1 but for case and separators, 0 where they are not.

    Of what is not the same word in both, one letter or a third of all may be wrong. A name may also be some
    of the other's words in any order, by their beginnings or with a letter wrong; numbers are all alike.
    """
    if max(len(name), len(other)) > _LONGEST:
        return float(name == other)
    words, others = (re.findall(r"[^\W_]+", each.lower()) for each in (name, other))
    length = max(sum(map(len, words)), sum(map(len, others)), 1)
    if "".join(words) == "".join(others):
        return 1.0
    own, valid = ("".join(w for w in a if w not in b) for a, b in ((words, others), (others, words)))
    differing = max(len(own), len(valid))
    most = max(differing // 3, int(differing > 1))
    if (wrong := _mistypings(own, valid, most)) <= most:
        return 1.0 - (wrong + 0.1) / length
    if len(own) > 1 and 3 * len(own) >= len(valid) and valid.startswith(own):
        return 0.6 * len(own) / length
    few, many = sorted((words, others), key=lambda each: sum(map(len, each)))
    found = [max(_meant(word, each) for each in many) for word in few]
    telling = all(found) and any(len(word) > 1 and not word.isdigit() for word in few)
    share = sum(map(operator.mul, found, map(len, few))) / length
    return 0.6 * share if telling else 0.0


def _meant(word: str, other: str) -> float:
    """How far a word stands for another: 1 of the same, less of its beginning, one letter wrong, a number."""
    begun = len(word) > 3 and other.startswith(word)
    mistyped = len(word) > 4 and _mistypings(word, other, 1) < 2
    number = word.isdigit() and other.isdigit()
    return 1.0 if word == other else 0.5 * (begun or mistyped) or 0.4 * number


def _mistypings(name: str, other: str, most: int) -> int:
    """Letters left out, added, exchanged, or swapped with the next (Damerau 1964); above `most` of more."""
    if abs(len(name) - len(other)) > most:
        return most + 1
    last: list[int] = []
    row = [*range(len(other) + 1)]
    for i, letter in enumerate(name):
        before, last, row = last, row, [i + 1]
        for j, its in enumerate(other):
            least = min(last[j + 1] + 1, row[j] + 1, last[j] + (letter != its))
            if i and j and (letter, its) == (other[j - 1], name[i - 1]):
                least = min(least, before[j - 1] + 1)
            row.append(least)
        if min(*last, *row) > most:
            return most + 1
    return row[-1]


def no_attribute(thing: object, name: str) -> AttributeError:
    """An error for an attribute that a thing lacks, with the nearest one that it has."""
    own = [each for each in dir(thing) if not each.startswith("_") and each != name]
    nearest = None if name.startswith("_") else nearest_name(name, own)
    told = f"; did you mean {nearest!r}?" if nearest else ""
    text = f"{type(thing).__name__!r} object has no attribute {name!r}{told}"
    return AttributeError(text, name=name, obj=None)  # of an `obj` some Pythons tell the nearest again


def _shown(value: object) -> str:
    try:
        text = repr(value) if isinstance(value, str) else str(value)
    except (ValueError, RecursionError):  # a whole number too long for Python to write
        text = f"a {type(value).__name__} too long to show"
    return text if len(text) <= 80 else text[:77] + "..."
