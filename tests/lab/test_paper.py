"""The papers' pages: every row is answered, every command is one, what is told follows from the numbers."""

import functools
import re
import shlex

import pytest
from command import Call
from documents import PAGES
from typer.main import get_command

from afo_sim.cli import app
from afo_sim.common import InputError, assets
from afo_sim.lab import KINDS, Claim, Paper, markdown, paper

NAMES = ("S0", "S1", "S2", "S3")
OPEN = ("lost", "outside")  # of rows that need no command


@functools.cache
def told(name: str) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = assets.read_toml(assets.folder("models") / "papers" / f"{name}.toml")[
        "row"
    ]
    return rows


@pytest.fixture(scope="module")
def read() -> dict[str, Paper]:
    return {name: paper(name) for name in NAMES}


def test_every_row_is_there_once_and_answered() -> None:
    """94 systems, formulas, tables, experiments, figures and claims were counted in the papers."""
    rows = [row for name in NAMES for row in told(name)]
    assert sorted(row["number"] for row in rows) == list(range(1, 95))  # type: ignore[type-var]
    for row in rows:
        assert row["kind"] in KINDS
        assert row.get("command") or (row.get("outcome") in OPEN and row["why"]), row["number"]
        assert row.get("value") or row.get("outcome"), row["number"]
        assert "TODO" not in str(row)


@pytest.mark.parametrize("name", NAMES)
def test_every_command_is_understood(name: str) -> None:
    group = get_command(app)
    for row in told(name):
        for command in re.findall(r"afo-sim ([^;]+)", str(row.get("command", ""))):
            words = shlex.split(command)
            depth = 2 if words[0] in ("gait", "leg") else 1
            found = group
            for word in words[:depth]:
                found = found.commands[word]  # type: ignore[attr-defined]
            found.make_context(words[0], words[depth:])  # a wrong option or a missing argument raises


def test_an_unknown_paper_is_refused(call: Call) -> None:
    with pytest.raises(InputError) as caught:
        paper("S4")
    assert caught.value.field == "paper"
    assert call("paper", "S4", "--json")[0] == 2


def claim(read: dict[str, Paper], number: int) -> Claim:
    (found,) = (each for of in read.values() for each in of.claims if each.number == number)
    return found


def numbers(read: dict[str, Paper], number: int) -> list[float]:
    return [row.simulated for row in claim(read, number).rows if row.simulated is not None]


@pytest.mark.slow
def test_told_outcomes_follow_from_the_numbers(read: dict[str, Paper]) -> None:
    """What a row's file tells as its outcome, by the inequality that its sentence is."""
    alike, analytic, polynomial, share = (numbers(read, k) for k in (46, 47, 48, 49))
    assert max(a / b for a, b in zip(alike, analytic, strict=True)) < 0.2
    assert max(a / b for a, b in zip(polynomial, analytic, strict=True)) < 0.2
    assert share[1] > share[0]
    assert max(row.simulated for row in claim(read, 13).rows if row.unit == "%") < 100.0  # type: ignore[type-var]
    needed, given = numbers(read, 14)[1:3]
    assert needed > 10.0 * given > 0.0
    longer, shipped = numbers(read, 23)
    assert longer > shipped
    angle, bore, length, stiffness = numbers(read, 26)
    assert angle < -10.0 and bore > 10.0 and abs(length) < 1e-6 and stiffness < -5.0
    assert max(numbers(read, 28)) < 75.0
    long, short = numbers(read, 22)
    assert long > short > 0.0
    theirs, ours = (claim(read, 19).rows[k] for k in (0, 1))
    assert min(theirs.expected or 0.0, ours.expected or 0.0) > 1.0  # [cm], of tables printed to 0.1


@pytest.mark.slow
def test_no_number_fails(read: dict[str, Paper]) -> None:
    assert [c.number for of in read.values() for c in of.claims if c.outcome == "FAILED"] == []
    assert {c.outcome for of in read.values() for c in of.claims} >= {"agrees", "disagrees", "lost"}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_page_is_what_the_command_prints(name: str, read: dict[str, Paper]) -> None:
    page = f"paper_{name.lower()}"
    how = f"afo-sim paper {name} > docs/{page}.md, below its title"
    assert PAGES[page].split("\n", 2)[2].strip() == markdown(read[name]).strip(), how
