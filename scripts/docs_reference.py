"""Reference pages of the documentation, made from the code."""

import ast
import inspect
import itertools
import pathlib
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from typer.main import get_command

import afo_sim
from afo_sim.cli import app
from afo_sim.description import SETS, fields_of, of_chambers, schema, tables
from afo_sim.description.schema import KINDS
from afo_sim.metrics import GROUPS, METRICS, UNITS
from afo_sim.metrics.metric import RENAMED, MetricEntry, load_all
from afo_sim.metrics.peak import MEANING
from afo_sim.simulation.columns import DESCRIBED

CODE = re.compile(r"[a-z0-9]{2,}(-[a-z]{2,})+")  # of a notice
TABLES = {"named": "tables by name: below", "list": "a list of tables: below"}
SCHULZ = "Schulz 2011"
PERRY = "phases: Perry & Burnfield 2010"
BAKER = "Baker et al. 2009"
STRIKE = "bounds: Altman & Davis 2012"
# Of the metrics whose definition was taken from elsewhere, by the beginning of their name.
SOURCES = {
    "toe_clearance": SCHULZ,
    "lowest_toe_clearance": SCHULZ,
    "ball_clearance": f"as {SCHULZ}",
    "lowest_ball_clearance": f"as {SCHULZ}",
    "swings_without_": SCHULZ,
    "contacts_with_": STRIKE,
    "gvs_": BAKER,
    "needed_swing_torque": PERRY,
    "needed_terminal_swing_torque": PERRY,
    "needed_loading_torque": PERRY,
    "orthosis_swing_torque": PERRY,
    "free_air_": "ISO 8778",
    "normal_litres_": "DIN 1343",
}
# Of the metrics that kept their name and changed their meaning, what they were before.
OF_AN_INSTANT = "of an instant"  # the peaks that are means over 10 ms now
BEFORE = {
    "toe_clearance": "minimum between two peaks of a rigid toe",
    "ball_clearance": "minimum between two peaks",
    "swings_with_toe_contact": "clearance below zero",
    "swings_with_ball_contact": "clearance below zero",
    "needed_swing_torque": "to heel strike, with the tight calf, of an instant",
    "free_air_per_stride": "called normal litres",
    "toe_drag_force": "mean while it drags",
}


def pages(tell: Callable[[str], None] = print) -> Iterator[tuple[str, str]]:
    """(name, Markdown) of each page."""
    for make in (commands, keys, metrics, columns, notices):
        tell(f"makes reference/{make.__name__}.md")
        yield make.__name__, make()


def table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    lines = [list(header), *([cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows)]
    lines.insert(1, ["---"] * len(lines[0]))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def plain(text: str) -> str:
    """Text whose stars and angle brackets mean themselves, outside of code."""
    parts = text.split("`")
    parts[::2] = [part.replace("*", r"\*").replace("<", "&lt;") for part in parts[::2]]
    return "`".join(parts)


def code(text: str) -> str:
    """Text as code, "" of none."""
    return f"`{text}`" if text else ""


def commands() -> str:
    """Every command with its arguments and options."""
    lines = ["# Commands and options", "What `afo-sim COMMAND -h` says."]
    return "\n\n".join([*lines, *_commands(get_command(app), "afo-sim")]) + "\n"


def _commands(command: Any, name: str) -> Iterator[str]:
    for inner, below in sorted(getattr(command, "commands", {}).items()):
        yield from _commands(below, f"{name} {inner}")
    if hasattr(command, "commands"):
        return
    yield f"## {name}"
    yield plain(inspect.cleandoc(command.help or ""))
    rows = [_option(one) for one in command.params if not one.hidden and one.name != "help"]
    if rows:
        yield table(("argument or option", "default", "meaning"), rows)


def _option(one: Any) -> tuple[str, str, str]:
    option = one.opts[0].startswith("-")
    words = ", ".join((*one.opts, *one.secondary_opts)) if option else one.metavar or one.name.upper()
    value = "" if not option or one.is_flag else one.metavar or one.name.upper()
    default = "" if one.default in (None, False, (), "") or callable(one.default) else str(one.default)
    default = "needed" if one.required else plain(default)
    return code(f"{words} {value}".strip()), default, plain(one.help or "")


def keys() -> str:
    """Every key of every description."""
    lines = [
        "# Keys of descriptions",
        "The tables of every file that you may write, with their keys. A quantity is a text with any unit "
        "of its SI unit's dimension. `afo-sim new` writes such a file with all of this as comments. NAME is "
        "a name of your own, CHAMBER the name of a chamber of the orthosis.",
    ]
    for kind, spec in schema.SPECS.items():
        lines += [f"## {kind} file", *_tables(spec, (), set())]
    return "\n\n".join(lines) + "\n"


def _tables(kind: Any, path: tuple[str, ...], seen: set[Any], law: str = "") -> Iterator[str]:
    """A table with its keys, then the tables in it; each class is explained once."""
    if path:
        yield f"### `[{'.'.join(path)}]`"
    yield plain(inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0])
    if (kind, law) in seen:
        yield "Its keys stand above."
        return
    seen.add((kind, law))
    fields = fields_of(kind, law)
    rows = [_key(key, leaf) for key, leaf in fields.items() if tables(leaf.annotation)[1] != "one"]
    rows += [_key(key, leaf) for key, leaf in fields.items() if tables(leaf.annotation)[0] in KINDS]
    chamber = of_chambers(kind)
    if chamber is not None and not schema.is_table(chamber):
        rows.append(_key("CHAMBER", schema.Leaf((), chamber, False, about="Of this chamber.")))
    if rows:
        yield table(("key", "SI unit", "allowed", "default", "meaning"), rows)
    for key, leaf in fields.items():
        below, many = tables(leaf.annotation)
        if many and below in SETS:
            for name in SETS[below]:
                yield from _tables(below, (*path, key, name), seen, name)
        elif many and below not in KINDS:
            entry = "|".join(schema.table_names(leaf.annotation, ["NAME"])) if many == "named" else ""
            yield from _tables(below, tuple(filter(None, (*path, key, entry))), seen)
    if schema.is_table(chamber):
        yield from _tables(chamber, (*path, "CHAMBER"), seen)


def _key(key: str, leaf: schema.Leaf) -> tuple[str, ...]:
    """A row of a table of keys."""
    below, many = tables(leaf.annotation)
    kind = KINDS.get(below)
    default = "needed" if leaf.required else plain(_default(leaf))
    if many in TABLES:
        return code(key), "", TABLES[many], "needed" if leaf.required else "none", plain(leaf.meaning)
    may = f"a [{kind}](#{kind}-file), by name or path" if kind else plain(schema.allowed(leaf.annotation))
    return code(key), plain(schema.unit_of(leaf.annotation)), may, default, plain(leaf.meaning)


def _default(leaf: schema.Leaf) -> str:
    if leaf.default is None or leaf.default in ("", ()):
        return "none"
    text = schema.shown(leaf.default, leaf.annotation)
    return f'"{text}"' if isinstance(leaf.default, str) or schema.unit_of(leaf.annotation) else text


def metrics() -> str:
    """The registered metrics, one table for each group."""
    lines = [
        "# Every metric",
        "`run.metrics` and a run's `summary.json` have them by these names, and so do sweeps, searches and "
        "checks. … stands for the name of a chamber, muscle or valve. Where no definition is named it is "
        "this project's own.",
    ]
    load_all()
    for group in GROUPS:
        rows = sorted((row for row in METRICS.values() if row.group == group), key=lambda row: row.name)
        if rows:
            header = ("metric", "unit", "what it is")
            lines += [f"## {group}", table(header, map(_metric, rows))]
    return "\n\n".join(lines) + "\n"


def _metric(row: MetricEntry) -> tuple[str, ...]:
    name, label = (text.replace("{}", "…") for text in (row.name, row.label))
    sentence = f"{label}: {row.meaning}." if row.meaning else f"{label}."
    source = next((source for start, source in SOURCES.items() if row.name.startswith(start)), "")
    before = [f"`{old}`" for old, (new, _) in RENAMED.items() if new == row.name]
    before += filter(None, [BEFORE.get(row.name), OF_AN_INSTANT * (MEANING in row.meaning)])
    notes = {"Definition": source, "Before": "; ".join(before)}
    text = " ".join([sentence, *(f"{about}: {note}." for about, note in notes.items() if note)])
    return code(name), UNITS.get(row.unit, row.unit) or "–", plain(text)


def columns() -> str:
    """Every column of a recording."""
    lines = [
        "# Columns of a recording",
        '`run["ankle/angle"]` is one of them, in SI units. A star stands for the name of a muscle, chamber, '
        "valve or joint. A run has those that its scenario calls for. The reading of a sensor is "
        "`sensor/NAME`, in the unit of what it reads.",
    ]
    described = sorted(DESCRIBED.items(), key=lambda item: item[0].split("/")[0])
    for group, found in itertools.groupby(described, lambda item: item[0].split("/")[0]):
        rows = [(code(name), plain(unit) or "–", plain(sign)) for name, (unit, sign) in found]
        lines += [f"## {group}", table(("column", "unit", "sign and meaning"), rows)]
    return "\n\n".join(lines) + "\n"


def notices() -> str:
    """Every code of a notice with its sentence, as the sources have them."""
    lines = [
        "# Warnings and notes",
        "Sentences under a run's numbers, in `run.warnings` and in `summary.json`. A program asks for the "
        "code, which stays, never for words: `[each.code for each in run.warnings]`. Braces hold what is of "
        "your case; … are words that depend on it.",
    ]
    found: dict[str, str] = {}
    others: set[str] = set()  # codes that their file computes, or has in a table
    sources = [
        path.read_text(encoding="utf-8") for path in pathlib.Path(afo_sim.__file__).parent.rglob("*.py")
    ]
    for tree in (ast.parse(text) for text in sources if "Notice(" in text):
        known, told = _texts(tree.body, {}), {}
        for scope in (tree, *(each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef))):
            lines_of = sorted(filter(lambda node: hasattr(node, "lineno"), ast.walk(scope)), key=_line)
            for call in (each for each in lines_of if isinstance(each, ast.Call) and len(each.args) > 1):
                if ast.unparse(call.func).rpartition(".")[2] == "Notice":
                    names = _texts((each for each in lines_of if _line(each) < _line(call)), known)
                    told[call] = [_text(each, names) for each in call.args[:2]]  # the inner scope's is kept
        for name, text in told.values():
            if "…" not in name:
                found[name] = max(text, found.get(name, ""), key=len)
            else:
                constants = (each.value for each in ast.walk(tree) if isinstance(each, ast.Constant))
                others |= set(filter(CODE.fullmatch, map(str, constants)))
    found = dict.fromkeys(others, "…") | found
    rows = [(code(name), plain(text)) for name, text in sorted(found.items())]
    return "\n\n".join([*lines, table(("code", "sentence"), rows)])


def _line(node: Any) -> int:
    return int(node.lineno)


def _texts(nodes: Iterable[ast.AST], known: dict[str, str]) -> dict[str, str]:
    """{name: text that is assigned to it}, also in parts."""
    found = dict(known)
    for node in nodes:
        if isinstance(node, ast.Assign):
            found |= {
                each.id: _text(node.value, found) for each in node.targets if isinstance(each, ast.Name)
            }
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            found[node.target.id] = found.get(node.target.id, "") + _text(node.value, found)
    return found


def _text(node: ast.AST, known: dict[str, str]) -> str:
    """A text as its expression has it; … for what is computed."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(each, known) for each in node.values)
    if isinstance(node, ast.BinOp):
        return _text(node.left, known) + _text(node.right, known)
    return known.get(node.id, "…") if isinstance(node, ast.Name) else "…"
