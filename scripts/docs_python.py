"""Reference of the Python names by topic, and of every class of ours that they return."""

import ast
import functools
import importlib
import inspect
import re
import typing
from collections.abc import Callable, Iterator
from types import NoneType, UnionType
from typing import Any

from docs_reference import code, plain, table

import afo_sim
from afo_sim.description import fields_of, schema

TOPICS = {
    "Run and record": "run both read_recording Recording Metric expect torque_map",
    "Describe": "list load Scenario Muscle build refit import_leg export_leg attach install",
    "Study": "sweep span optimise size effects uncertainty walk",
    "Evidence": "stand fit validate paper credibility",
    "Show": "figure report draw view",
    "Step it yourself": "Simulator Simulators",
    "Extend": "register metric column controller",
    "Errors": "AfoSimError InputError SimulationError",
}
INTRODUCTION = """# Python names

All functions stand in `afo_sim`, with the classes that you make or catch; what else they return is a class of
a room. `help(afo_sim.run)` says the same.
"""
PUBLIC = [name for names in TOPICS.values() for name in names.split()]
WIDTH = 80  # of a signature on one line
MET = ("__getitem__", "__iter__", "__call__")  # what these return is met, too
ENTRY = re.compile(r"(?P<name>[\w*, ]+)(?: : |\n +)(?P<meaning>.+)", re.S)
LISTED = re.compile(r"^(\w+(?:, \w+)*) : (.+(?:\n +.+)*)\n?", re.M)  # attributes, in a class's docstring
SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.M)
COMMENT = re.compile(r"[^#]*# (.+)")


def pages(tell: Callable[[str], None] = print) -> Iterator[tuple[str, str]]:
    """(name, Markdown) of a page for all names, and of one for each topic."""
    tell("makes the pages of Python names")
    names = sorted(topics(), key=lambda one: one.__name__.lower())
    rows = [(f"[{heading(one)}]({address(one)})", plain(first(one))) for one in names]
    yield "python", f"{INTRODUCTION}\n{table(('name', 'what it is'), rows)}"
    for topic in TOPICS:
        parts = [part for one, its in topics().items() if its == topic for part in entry(one)]
        yield page_of(topic), "\n\n".join([f"# Python: {topic.lower()}", *parts]) + "\n"


def page_of(topic: str) -> str:
    """A page's name."""
    return f"python_{topic.lower().replace(' ', '_')}"


def order(page: str) -> tuple[int, str]:
    """Where a page stands in the reference: these last, by topic."""
    own = ["", "python", *map(page_of, TOPICS)]
    return own.index(page) if page in own else 0, page


@functools.cache
def topics() -> dict[Any, str]:
    """{function or class: its topic}: each public name, followed by the classes that are met through it."""
    public = {getattr(afo_sim, name): topic for topic, names in TOPICS.items() for name in names.split()}
    found: dict[Any, str] = {}
    for one, topic in public.items():
        waiting = [one]
        while waiting:
            each = waiting.pop(0)
            if each not in found and (each is one or each not in public):
                found[each] = topic
                waiting += filter(ours, met(each))
    return found


def met(one: Any) -> Iterator[type]:
    """The classes that a function returns; of a class those of its rows, methods and properties."""
    if not inspect.isclass(one):
        yield from (each for kind in returned(one) for each in classes(kind))
        return
    for base in filter(ours, one.__mro__):
        for kind in () if is_description(base) else hints(base).values():  # whose keys have a page
            yield from classes(kind, rows=True)
        for name, member in dict(vars(base)).items():
            if not name.startswith("_") or name in MET:
                call = function_of(member)
                yield from classes(hints(call).get("return")) if call else ()


def ours(kind: type) -> bool:
    """Whether a class is this project's."""
    return kind.__module__.startswith("afo_sim.")


def is_description(kind: type) -> bool:
    """Whether its attributes are keys of a file."""
    return hasattr(kind, "model_fields")


def classes(kind: Any, rows: bool = False) -> Iterator[type]:
    """The classes that a type is made of; of `rows` those that a collection holds."""
    parts = typing.get_args(kind)
    if inspect.isclass(kind) and not parts and not rows:
        yield kind
    for part in parts:
        yield from classes(part, rows and typing.get_origin(kind) in (typing.Union, UnionType))


def function_of(member: Any) -> Any:
    """The function of a method or property, None of what is neither."""
    found = (getattr(member, name, None) for name in ("fget", "func", "__func__"))
    call = next(filter(None, found), member)
    return call if inspect.isfunction(call) else None


@functools.cache
def hints(one: Any) -> dict[str, Any]:
    """Types by name; what a module imports for its types alone is imported."""
    known: dict[str, Any] = {}
    while True:
        try:
            return typing.get_type_hints(one, localns=known)
        except NameError as error:
            known[str(error.name)] = importlib.import_module(str(error.name))


def returned(function: Any) -> list[Any]:
    """What a function may return, of overloads each."""
    found = [hints(each).get("return") for each in typing.get_overloads(function) or [function]]
    return [kind for kind in dict.fromkeys(found) if kind not in (None, NoneType)]


def heading(one: Any) -> str:
    """Of its entry."""
    return f"class {one.__name__}" if inspect.isclass(one) else one.__name__


def address(one: Any) -> str:
    """Where its entry stands, from a page beside it."""
    return f"{page_of(topics()[one])}.md#{heading(one).lower().replace(' ', '-')}"


def linked(kind: Any) -> str:
    """A type in Markdown, its classes with a link to their entries."""
    parts, origin = typing.get_args(kind), typing.get_origin(kind)
    if origin in (typing.Union, UnionType):
        return " or ".join(dict.fromkeys(map(linked, parts)))
    if origin is typing.Literal:
        return " or ".join(code(repr(part)) for part in parts)
    if origin is typing.Annotated or getattr(origin, "__name__", "") == "Callable":
        return linked(parts[0]) if origin is typing.Annotated else "function"
    if kind in topics():
        return f"[{kind.__name__}]({address(kind)})"
    known = {NoneType: "None", None: "", ...: "…", typing.Self: "the same"}
    name = known[kind] if kind in known else getattr(origin or kind, "__name__", str(kind))
    return f"{name}\\[{', '.join(map(linked, parts))}\\]" if parts and name != "ndarray" else name


def entry(one: Any) -> Iterator[str]:
    """The entry of a function or class."""
    yield f"## {heading(one)}"
    yield from described(one, one.__name__)
    if not inspect.isclass(one):
        return
    rows = [(code(name), linked(kind), plain(text)) for name, (kind, text) in attributes(one).items()]
    if rows:
        yield table(("attribute", "type", "meaning"), rows)
    if one.__name__ in PUBLIC:
        for name, call in methods(one):
            yield f"### {one.__name__}.{name}"
            yield from described(call, f"{one.__name__.lower()}.{name}")
    elif calls := methods(one):
        rows = [(code(call_of(f, n)), linked(hints(f).get("return")), plain(first(f))) for n, f in calls]
        yield table(("method", "returns", "what it does"), rows)
    if above := [linked(base) for base in one.__mro__[1:] if base in topics()]:
        yield f"It also has what {' and '.join(above)} has."


def attributes(one: type) -> dict[str, tuple[Any, str]]:
    """{public attribute or property: (type, meaning)} of a class, but for what a base with an entry has."""
    found: dict[str, tuple[Any, str]] = {}
    for base in own_bases(one):
        kinds, told = hints(base), meanings(base)
        found |= {name: (kinds.get(name), text) for name, text in told.items() if not is_shared(kinds, name)}
        for name, member in dict(vars(base)).items():
            if (call := function_of(member)) and not name.startswith("_") and not inspect.isroutine(member):
                found[name] = hints(call).get("return"), first(call)
    return found


def is_shared(kinds: dict[str, Any], name: str) -> bool:
    """Whether an attribute is the class's, and no instance's."""
    return typing.get_origin(kinds.get(name)) is typing.ClassVar


def own_bases(one: type) -> list[type]:
    """Those of its bases that have no entry, and the class."""
    return [base for base in reversed(one.__mro__) if ours(base) and (base is one or base not in topics())]


def methods(one: type) -> list[tuple[str, Any]]:
    """(name, function) of the public methods that say what they do."""
    found = {
        name: function_of(member)
        for base in own_bases(one)
        for name, member in vars(base).items()
        if not name.startswith(("_", "model_")) and inspect.isroutine(member) and function_of(member)
    }
    return sorted((name, call) for name, call in found.items() if inspect.getdoc(call))


@functools.cache
def source(module: str) -> tuple[list[str], dict[str, ast.ClassDef]]:
    """A module's lines and its classes."""
    text = inspect.getsource(importlib.import_module(module))
    nodes = [each for each in ast.parse(text).body if isinstance(each, ast.ClassDef)]
    return text.splitlines(), {each.name: each for each in nodes}


def meanings(kind: type) -> dict[str, str]:
    """{public attribute: meaning}: of the docstring's list, of a key, of a comment or text at the field."""
    found: dict[str, str] = {}
    lines, nodes = source(kind.__module__)
    body = nodes[kind.__name__].body
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            comment = COMMENT.fullmatch(lines[(node.end_lineno or 0) - 1])
            text = ast.literal_eval(after.value) if isinstance(after, ast.Expr) else ""
            found[node.target.id] = comment[1] if comment else text
        elif isinstance(node, ast.FunctionDef) and node.name == "__init__":
            stored = (each for each in ast.walk(node) if isinstance(each, ast.Attribute))
            found |= {each.attr: "" for each in stored if isinstance(each.ctx, ast.Store)}
    for name, leaf in fields_of(kind, "").items() if is_description(kind) else ():
        unit = schema.unit_of(leaf.annotation)
        found[name] = f"{leaf.meaning.rstrip('.')} [{unit}]" if unit else leaf.meaning
    for names, text in LISTED.findall(SECTION.split(inspect.cleandoc(kind.__doc__ or ""))[0]):
        found |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    return {name: text for name, text in found.items() if not name.startswith("_")}


def first(one: Any) -> str:
    """The first paragraph of its docstring, on one line."""
    return " ".join((inspect.getdoc(one) or "").partition("\n\n")[0].split())


def call_of(call: Any, name: str) -> str:
    """A call without types."""
    parameters = inspect.signature(call).parameters.values()
    bare = [each.replace(annotation=each.empty) for each in parameters if each.name not in ("self", "cls")]
    return f"{name}{inspect.Signature(bare)}"


def described(one: Any, name: str) -> Iterator[str]:
    """Signature, what it returns, docstring; of a class that nobody makes himself without the first."""
    text, is_class = inspect.getdoc(one) or "", inspect.isclass(one)
    if not is_class or ("Parameters\n" in text and one.__name__ in PUBLIC):
        call = call_of(one, name)
        if len(call) > WIDTH:
            call = call.replace("(", "(\n    ", 1).replace(", ", ",\n    ").removesuffix(")") + ",\n)"
        yield f"```python\n{call}\n```"
    if not is_class and (gives := returned(one)):
        yield f"Returns {' or '.join(map(linked, gives))}."
    about, *sections = SECTION.split(text)
    yield plain((LISTED.sub("", about) if is_class else about).strip())
    for title, inside in zip(sections[::2], sections[1::2], strict=True):
        yield f"**{title}**"
        yield f"```pycon\n{inside.strip()}\n```" if title == "Examples" else plain(entries(inside.strip()))


def entries(text: str) -> str:
    """The entries of a section as a list: "name : meaning", or the meaning indented below; else the text."""
    found = [ENTRY.fullmatch(entry) for entry in re.split(r"\n(?=\S)", text)]
    if not all(found):
        return text
    return "\n".join(f"- `{each['name']}`: {' '.join(each['meaning'].split())}" for each in found if each)
