"""Reading a page of HTML back."""

import html.parser


class Page(html.parser.HTMLParser):
    """Words of a page, its tags with their attributes and those that are open about each, and its balance."""

    VOID = ("meta", "col", "br")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.open: list[tuple[str, dict[str, str]]] = []
        self.seen: list[tuple[str, dict[str, str], list[tuple[str, dict[str, str]]]]] = []
        self.feed(text)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, {name: value or "" for name, value in attrs}, list(self.open)))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in self.VOID:
            self.open.append((tag, self.seen[-1][1]))

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open[-1][0] in ("tr", "td", "th", "li", "p") and self.open[-1][0] != tag:
            self.open.pop()
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    @property
    def attributes(self) -> list[tuple[str, str, str]]:
        """Tag, name and value of each."""
        return [(tag, name, value) for tag, found, _ in self.seen for name, value in found.items()]
