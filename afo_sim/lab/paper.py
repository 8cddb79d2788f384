"""A paper, claim by claim: its statement, the simulation, their agreement, and the command that shows it.

Each file of `models/papers` is a paper. A `row` is a system, formula, table, experiment, figure or claim:
    says     what stands there
    value    numbers beside each other: a table for each, with the keys of `afo_sim/lab/validation_row.py` and
             of `afo_sim/lab/paper_values.py`
    outcome  where no number decides: "shown" by its command, "lost" with the text, or "outside"; its `why`
"""

from collections.abc import Collection
from dataclasses import dataclass

from afo_sim.common import JsonDict, Shown, assets, unknown
from afo_sim.lab import paper_values
from afo_sim.lab.validation import brief, published
from afo_sim.lab.validation_row import Report, Row, counted

# The worst outcome of a row's numbers is the row's.
ORDER = (
    "FAILED", "disagrees", "cannot tell", "erratum", "agrees", "compared", "as set", "shown", "lost",
    "outside",
)  # fmt: skip
OUTCOMES = (
    "Agrees: within what print and scatter allow, or as the row says. Cannot tell: a deliberately wrong "
    "model passes as well, or it depends on what the paper does not print. Compared: side by side, no "
    "pass or fail. As set: an input of the program, or an identity; no evidence. Shown: by the command; "
    "the paper has no number. Lost: not in the text that can be read. In brackets: implied by the paper, "
    "not printed. ✗: outside the tolerance."
)
KINDS = {kind: f"{kind.title()}s" for kind in ("claim", "table", "figure", "formula", "system", "experiment")}


@dataclass(frozen=True)
class Claim:
    """A row of a paper: its statement and place, what is computed for it, and the command that shows it."""

    number: int  # in the paper's list
    kind: str  # such as "formula" or "figure"
    place: str  # in the paper, such as "Fig. 7"
    says: str  # what it says there
    command: str  # that shows it
    outcome: str  # how it came out
    why: str  # of the outcome, in words
    rows: tuple[Row, ...]  # published beside simulated numbers

    @property
    def numbers(self) -> list[str]:
        """Each number as text; for a table, a line for each load with all pressures."""
        told = [brief(row, row) for row in self.rows if not row.cell]
        loads: dict[str, list[str]] = {}
        for row in (row for row in self.rows if row.cell):
            *_, load, pressure = row.quantity.split(", ")
            mark = "" if row.outcome == "agrees" else " ✗"
            loads.setdefault(load, []).append(f"{pressure} {published(row)} → {row.simulated:.2f}{mark}")
        return [f"{load}: {', '.join(cells)} [{self.rows[0].unit}]" for load, cells in loads.items()] + told


@dataclass(frozen=True, repr=False)
class Paper(Shown):
    """A paper with its claims, in the order of their numbers.

    name : "S1"
    title : of the publication
    source : authors, year, journal
    reading : how it was read
    claims : in the order of their numbers
    """

    name: str
    title: str
    source: str
    reading: str
    claims: tuple[Claim, ...]

    def __repr__(self) -> str:
        return f"<Paper {self.name}: {self.verdict}>"

    @property
    def verdict(self) -> str:
        """How many claims came out how."""
        found = [claim.outcome for claim in self.claims]
        return ", ".join(f"{outcome} {found.count(outcome)}" for outcome in ORDER if outcome in found)

    def of(self, kind: str) -> list[Claim]:
        """The claims of one kind."""
        return [claim for claim in self.claims if claim.kind == kind]


def paper(name: str, progress: Report = None, *, numbers: Collection[int] | None = None) -> Paper:
    """Compare one of the four papers with the simulator.

    Parameters
    ----------
    name : "S0", "S1", "S2" or "S3"
    progress : called with (claims done, claims in all)
    numbers : of the claims to compute; all by default

    Returns
    -------
    Paper : its `claims`, each with what the paper says, the `rows` of numbers (published, simulated, error,
        tolerance), the `outcome` and the `command` that shows it; `markdown(it)` is the page

    Raises
    ------
    InputError
        There is no such paper, or no such claim in it.

    Examples
    --------
    >>> paper("S1", numbers=[22]).claims[0].outcome
    'agrees'
    """
    files = {file.stem: file for file in (assets.folder("models") / "papers").glob("*.toml")}
    if name not in files:
        raise unknown(name, sorted(files), field="paper", problem="is no paper of this program")
    told = assets.read_toml(files[name])
    rows = {row["number"]: row for row in told["row"]}
    asked = rows.keys() if numbers is None else numbers
    for number in set(asked) - rows.keys():
        raise unknown(number, map(str, rows), field="numbers", problem=f"is no claim of {name}")
    claims = tuple(map(_claim, counted([rows[number] for number in asked], progress)))
    return Paper(name, told["title"], told["source"], told["reading"], claims)


def _claim(told: JsonDict) -> Claim:
    same = {"source": told["place"], "why": told.get("why", ""), "quantity": ""}
    rows = tuple(row for value in told.get("value", ()) for row in paper_values.rows_of(same | value))
    outcome = min((row.outcome for row in rows), key=ORDER.index, default=told.get("outcome", ""))
    outcome = told.get("outcome", outcome) if outcome != "FAILED" else outcome
    texts = {key: told.get(key, "") for key in ("kind", "place", "says", "command", "why")}
    return Claim(told["number"], **texts, outcome=outcome, rows=rows)


def markdown(of: Paper) -> str:
    """The page of a paper, as the command prints it and the documentation shows it."""
    lines = [f"{of.title}. {of.source}.", "", of.reading, ""]
    lines.append(f"Outcomes of {len(of.claims)} rows: {of.verdict}. {OUTCOMES}")
    for kind, title in KINDS.items():
        if claims := of.of(kind):
            lines += ["", f"## {title}", ""]
        for claim in claims:
            lines.append(f"- **{claim.number} · {claim.place}: {claim.outcome}.** {claim.says}.")
            if text := " ".join(f"{part}." for part in ("; ".join(claim.numbers), claim.why) if part):
                lines.append(f"  {text}")
            if claim.command:
                lines.append(f"  `{claim.command}`")
    return "\n".join(lines) + "\n"
