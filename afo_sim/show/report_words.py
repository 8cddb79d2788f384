"""Words of a report: notes and warnings with a head that tells at a glance what each is about."""

import re

LONGEST = 90  # letters of a head
END = re.compile(r"[,;:.]\s")  # of a first clause


def headed(text: str) -> tuple[str, str]:
    """A note or warning as (head, rest): its first clause, and all else with the mark between them.

    Nothing is left out: head and rest together are the text, but for the head's first letter in capitals.
    Of a clause that is longer than LONGEST letters, what stands before its first bracket is the head; where
    that is too long, too, there is none.
    """
    depth, cut = 0, len(text)
    for place, letter in enumerate(text):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth <= 0 and END.match(text, place):
            cut = place
            break
    if cut > LONGEST:
        cut = text.find(" (")
    if not 0 < cut <= LONGEST:
        return "", _begun(text)
    return _begun(text[:cut]), text[cut:]


def _begun(text: str) -> str:
    return text[:1].upper() + text[1:]
