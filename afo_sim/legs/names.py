"""Names of their own for what a file leaves unnamed."""

from collections.abc import Iterable


def own_names(given: Iterable[str], fallback: Iterable[str]) -> list[str]:
    """Each given name, or its fallback where it is empty; no two are the same.

    A name that stands twice, and a fallback that is taken, gets a number: `foot`, `foot_2`.
    """
    given = list(given)
    taken = set(filter(None, given))
    used: set[str] = set()
    found = []
    for name, other in zip(given, fallback, strict=True):
        chosen = name if name and name not in used else free_name(name or other, taken)
        used.add(chosen)
        taken.add(chosen)
        found.append(chosen)
    return found


def free_name(wanted: str, taken: Iterable[str]) -> str:
    """A name that is not taken: the wanted one, or that with a number."""
    taken = set(taken)
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted}_{number}"
    return name


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names in a sentence; of many the first ones and how many more there are."""
    names = list(names)
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")
