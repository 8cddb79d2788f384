"""Notes and warnings that a file, a leg or a stride carries beside its numbers."""

from afo_sim.common import Json, Notice


def note(code: str, text: str, /, *, subject: str = "", **data: Json) -> Notice:
    """A notice that explains what was read or done, and doubts nothing; arguments as of `Notice`."""
    return Notice(code, text, subject=subject, severity="note", **data)


class Noted:
    """What has notices: their notes and their warnings."""

    notices: tuple[Notice, ...]

    @property
    def remarks(self) -> tuple[Notice, ...]:
        """What was understood, one sentence each."""
        return tuple(each for each in self.notices if each.severity == "note")

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What a person should look at, one sentence each."""
        return tuple(each for each in self.notices if each.severity == "warning")
