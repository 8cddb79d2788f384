"""What a computation reports beside its numbers: text for people, with a code and data for programs."""

from collections.abc import Iterable
from typing import Literal, Self

from afo_sim.common.open_types import Json, JsonDict, JsonMapping

Severity = Literal["note", "warning", "error"]


class Notice(str):
    """A sentence for people that a program recognises by its code and subject, never by its words."""

    __slots__ = ("_text", "code", "data", "severity", "subject")
    code: str  # its kind, such as "tube-long"; it stays
    _text: str
    subject: str  # what it is about, such as a chamber's name; ""
    severity: Severity  # "note", "warning" or "error"
    data: JsonMapping  # the numbers and names of its sentence [SI]

    def __new__(
        cls, code: str, text: str, /, *, subject: str = "", severity: Severity = "warning", **data: Json
    ) -> Self:
        """Format the sentence."""
        made = super().__new__(cls, text.format(subject=subject, **data))
        made.code, made.subject, made.severity, made.data, made._text = code, subject, severity, data, text
        return made

    def __getnewargs_ex__(self) -> tuple[tuple[str, str], JsonDict]:
        return (self.code, self._text), {"subject": self.subject, "severity": self.severity, **self.data}

    def after(self, words: str) -> Self:
        """The same notice with words before its sentence."""
        text = words.replace("{", "{{").replace("}", "}}") + self._text
        return type(self)(self.code, text, subject=self.subject, severity=self.severity, **self.data)

    def repeats(self, other: "Notice") -> bool:
        """Whether it is about what another is about, and beyond its limit by no more, but for 2 %."""
        ours, theirs = self.data.get("beyond", 0.0), other.data.get("beyond", 0.0)
        return (self.code, self.subject) == (other.code, other.subject) and ours <= 1.02 * theirs

    def without_key(self) -> Self:
        """The same for who reads and types nothing: without what the data name as its `key`."""
        data = dict(self.data) | {"key": ""} if "key" in self.data else self.data
        return type(self)(self.code, self._text, subject=self.subject, severity=self.severity, **data)

    def with_severity(self, severity: Severity) -> Self:
        """The same notice, taken more or less seriously."""
        return type(self)(self.code, self._text, subject=self.subject, severity=severity, **self.data)

    @classmethod
    def from_json(cls, read: JsonMapping) -> Self:
        """The notice that `as_json` wrote."""
        text = read["text"].replace("{", "{{").replace("}", "}}")
        return cls(read["code"], text, subject=read["subject"], severity=read["severity"], **read["data"])

    def as_json(self) -> JsonDict:
        """Code, subject, severity, data and text, for a file."""
        return {
            "code": self.code,
            "subject": self.subject,
            "severity": self.severity,
            "data": dict(self.data),
            "text": str(self),
        }


def unique(notices: Iterable[str]) -> list[str]:
    """Notices in their order, each code once a subject; plain texts each once."""
    first: dict[tuple[str, str], str] = {}
    for one in notices:
        first.setdefault(identity(one), one)
    return list(first.values())


def with_code(notices: Iterable[str], code: str) -> list[Notice]:
    """The notices that have a code."""
    return [one for one in notices if isinstance(one, Notice) and one.code == code]


def identity(one: str) -> tuple[str, str]:
    """What a notice is about: its code and subject; "" and the text itself of a plain text."""
    return (one.code, one.subject) if isinstance(one, Notice) else ("", one)
