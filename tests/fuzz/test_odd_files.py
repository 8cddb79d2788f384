"""Pipes, devices, sockets, folders and links without an end as any argument of any command: a sentence."""

import pathlib
import random

import pytest
from campaign import NIGHTLY, SEED
from fuzz import odd
from fuzz.test_fuzz import ended, require_well
from test_hostile_folder import COMMANDS


def cases(kinds: tuple[str, ...] = odd.KINDS) -> list[list[str]]:
    """Each text that a command takes, with each kind of odd file; the ending of its name is drawn."""
    dice, found = random.Random(SEED), list[list[str]]()
    for _, words in odd.lines(COMMANDS):
        for kind in kinds:
            name = f"odd/{kind}{dice.choice(odd.SUFFIXES)}"
            found.append(["$", ".", *(word.replace("{}", name) for word in words)])
    return found


@pytest.mark.slow
def test_what_is_no_file_is_refused_in_words(tmp_path: pathlib.Path) -> None:
    drawn = cases() if NIGHTLY else random.Random(SEED).sample(cases(), 12)
    require_well(ended(drawn, tmp_path))
