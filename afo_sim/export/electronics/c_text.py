"""A board as C: header, Arduino sketch and host program, out of the files in `templates`."""

import pathlib
import re

from afo_sim.export.electronics.board import Board, Clock, Rule, States

_TEMPLATES = pathlib.Path(__file__).with_name("templates")
_FIRST_PIN = 2  # 0 and 1 are the serial port of most boards
_PLACE = re.compile(r"@([A-Z_]+)@")
_NO_INPUTS = """
static bool read_inputs(VALVES_REAL *inputs) {
  (void)inputs;
  return true;
}
"""
_CALIBRATED = """\
  for (uint8_t k = 0; k < VALVES_INPUTS; k++)
    if (CHANNELS[k].scale == 0.0f) stop("an input has no calibration line");
"""


def header(board: Board) -> str:
    """The text of valves.h."""
    logic, chambers = board.logic, board.chambers
    names = ", ".join(_string(read.column) for read in board.inputs)
    inputs = f"static const char *const valves_input_names[VALVES_INPUTS] = {{ {names} }};\n"
    return _filled(
        "valves.h",
        NAME=_comment(board.name),
        NOTES="".join(f" * {_comment(note)}\n" for note in notes(board)),
        WHEN=f"every {board.step} ticks" if board.step else "as often as the loop comes round",
        TICK=board.tick,
        STEP=board.step,
        CHAMBERS=len(chambers),
        INPUTS=len(board.inputs),
        CHAMBER_ENUM=_enum("CHAMBER", chambers),
        CHAMBER_NAMES=", ".join(map(_string, chambers)),
        INPUT_NAMES=inputs if board.inputs else "",
        LOGIC=_clock(logic, chambers) if isinstance(logic, Clock) else _states(logic, chambers),
    )


def sketch(board: Board) -> str:
    """The text of valves.ino."""
    return _filled(
        "valves.ino",
        NAME=_comment(board.name),
        PINS="\n".join(
            f"  {{ {_FIRST_PIN + 2 * k}, {_FIRST_PIN + 2 * k + 1} }},  // {name}"
            for k, name in enumerate(board.chambers)
        ),
        RUN_PIN=_FIRST_PIN + 2 * len(board.chambers),
        CHANNELS=_channels(board),
        READ=_template("read_inputs.ino") if board.inputs else _NO_INPUTS,
        CALIBRATED=_CALIBRATED if board.inputs else "",
    )


def host(board: Board) -> str:
    """The text of host.c."""
    usage = "inputs.csv" if board.inputs or isinstance(board.logic, States) else "SECONDS"
    main = _template("host_clock.c" if usage == "SECONDS" else "host_inputs.c")
    columns = "".join(f",{name.column}" for name in board.inputs)
    main = main.replace("@COLUMNS@", _string(columns)[1:-1])
    return _filled("host.c", NAME=_comment(board.name), USAGE=usage, MAIN=main.rstrip("\n") + "\n")


def notes(board: Board) -> list[str]:
    """What rounding does, in sentences."""
    unit = "millisecond" if board.tick == 1000 else "microsecond"
    if isinstance(board.logic, States) or board.step:
        return [f"It switches only when it looks, every {board.step * board.tick / 1000:g} ms."]
    if board.logic.rounding < 1e-9 and abs(board.logic.drift) < 1e-12:
        return [f"All times are whole {unit}s: none is rounded."]
    late = "long" if board.logic.drift > 0.0 else "short"
    return [
        f"Times are rounded to the nearest {unit}, by {1e6 * board.logic.rounding:.2g} us at most.",
        f"The period is {1e6 * abs(board.logic.drift):.2g} us too {late}: "
        f"{3.6e6 * abs(board.logic.drift) / (board.logic.period * board.tick * 1e-6):.2g} ms an hour.",
    ]


def _channels(board: Board) -> str:
    if not board.inputs:
        return ""
    rows = []
    for k, read in enumerate(board.inputs):
        known = read.scale is not None and read.offset is not None
        line = f"{read.scale!r}f, {read.offset!r}f" if known else "0.0f, 0.0f"
        missing = "" if known else "; scale 0: not calibrated, to be filled in"
        rows.append(f"  {{ A{k}, {line}, 0, 1023 }},  // {_comment(read.column)} [{read.unit}]{missing}")
    return _template("channels.ino").replace("@ROWS@", "\n".join(rows)).rstrip("\n")


def _clock(clock: Clock, chambers: tuple[str, ...]) -> str:
    return _filled(
        "clock.h",
        "repeating.h" if clock.restart is None else "restarted.h",
        PERIOD=clock.period,
        PLACE=clock.place,
        COUNT=len(clock.changes),
        CHANGES="\n".join(
            f"    {{ {at}u, 0x{coils:x}u }}, /* {_open(coils, chambers)} */" for at, coils in clock.changes
        ),
        THRESHOLD="" if clock.restart is None else repr(clock.restart.threshold),
        AFTER=0 if clock.restart is None else clock.restart.after,
    )


def _states(states: States, chambers: tuple[str, ...]) -> str:
    return _filled(
        "states.h",
        COUNT=len(states.names),
        STATE_ENUM=_enum("STATE", states.names),
        STATE_NAMES=", ".join(_string(name) for name in states.names),
        NAMED=", ".join(f"0x{bits:x}u" for bits in states.named),
        COILS="\n".join(
            f"    0x{bits:x}u, /* {name}: {_open(bits, chambers)} */"
            for name, bits in zip(states.names, states.coils, strict=True)
        ),
        RULES="\n".join(_rule(rule, states.names) for rule in states.rules),
        START=f"STATE_{states.names[states.start]}",
    )


def _rule(rule: Rule, names: tuple[str, ...]) -> str:
    source, to, above = f"STATE_{names[rule.source]}", f"STATE_{names[rule.to]}", int(rule.above)
    compared = f"VALVES_STATE_TIME, {above}, 0, {rule.threshold:.0f}u"
    if rule.input is not None:
        compared = f"{rule.input}, {above}, (VALVES_REAL){rule.threshold!r}, 0u"
    return f"    {{ {source}, {to}, {compared}, {rule.after}u }},"


def _open(coils: int, chambers: tuple[str, ...]) -> str:
    sides = [f"{name} {side}" for name in chambers for side in ("inlet", "outlet")]
    return ", ".join(name for k, name in enumerate(sides) if coils >> k & 1) or "none"


def _enum(kind: str, names: tuple[str, ...]) -> str:
    return ", ".join(f"{kind}_{name} = {k}" for k, name in enumerate(names))


def _string(text: str) -> str:
    """A C string: what is not plain ASCII, and what C would read otherwise, as octal."""
    letters = (
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    )
    return f'"{"".join(letters)}"'


def _comment(text: str) -> str:
    return " ".join(text.replace("*/", "* /").replace("/*", "/ *").replace("\\", "/").split())


def _template(name: str) -> str:
    return (_TEMPLATES / name).read_text(encoding="utf-8")


def _filled(*templates: str, **places: object) -> str:
    return _PLACE.sub(lambda found: str(places[found[1]]), "".join(map(_template, templates)))
