"""The documentation as a site that needs no network: pages of docs/, notebooks with their output, reference.

    python scripts/docs.py [--out site]

Pages and pictures are copied beside pages that are made from the code (`docs_reference.py`). Zensical makes
the site of them. A warning, a broken link or a request to an outside address fails the build.
"""

import argparse
import concurrent.futures
import os
import pathlib
import posixpath
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse
from collections.abc import Callable, Iterator
from functools import partial
from html.parser import HTMLParser
from typing import Any

import docs_python
import docs_reference
import jinja2
import jupytext
import nbclient
import nbconvert
import tomli_w
from traitlets.config import Config

ROOT = pathlib.Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
NOTEBOOKS = DOCS / "notebooks"
LINK = re.compile(r"(\]\()([^)\s#:]+)(#[^)\s]*)?(\))")
FENCED = re.compile(r"^( *```.*?^ *```)$", re.S | re.M)
TERM = re.compile(r"^- \*\*([^*]+)\*\*(.*)$", re.M)
TABLE = re.compile(r"^(?!\|)(.*\S.*)\n(?=\|.*\|\n\|[-|: ]+\|$)", re.M)
EMPTY = re.compile(r"<th(?: [^>]*)?></th>")
FETCHED = {"img": "src", "script": "src", "link": "href", "iframe": "src", "source": "src", "video": "src"}
STYLE = """.md-typeset table:not([class]) { font-size: 0.65rem; }
.md-typeset table:not([class]) :is(td, th) { min-width: 0; padding: 0.5em 0.8em; }
.md-typeset table:not([class]) td:first-child { min-width: 6em; overflow-wrap: anywhere; }
.md-typeset table:not([class]) td:first-child:has(code) { min-width: 9em; }
.md-typeset thead:not(:has(th)) { display: none; }
.md-typeset img { background: white; }
.md-nav__link--active .md-ellipsis { color: var(--md-default-fg-color); }
@media (min-width: 60em) { .md-typeset td:first-child code { white-space: nowrap; } }
"""
# A page that is opened from a folder may start no worker: the search then runs in a frame of the page.
SCRIPT = """if (location.protocol === "file:") window.Worker = class {
  constructor(url) {
    const frame = document.createElement("iframe");
    frame.hidden = true;
    document.body.append(frame);
    const inside = frame.contentWindow, script = inside.document.createElement("script");
    inside.postMessage = data => this.onmessage?.({ data: structuredClone(data) });
    const ready = new Promise(loaded => script.onload = loaded);
    this.postMessage = data => ready.then(() => inside.onmessage({ data: inside.structuredClone(data) }));
    this.terminate = () => frame.remove();
    script.src = url;
    inside.document.body.append(script);
  }
};
// For a keyboard and a screen reader: wide tables and code scroll, and a copy button is no landmark.
new MutationObserver(() => {
  document.querySelectorAll(".md-code__nav").forEach(nav => nav.setAttribute("role", "none"));
  for (const part of document.querySelectorAll(".md-typeset__scrollwrap, pre > code"))
    if (part.scrollWidth > part.clientWidth && !part.hasAttribute("tabindex")) part.tabIndex = 0;
}).observe(document.documentElement, { childList: true, subtree: true, attributeFilter: ["tabindex"] });
"""
# Words that say nothing of what is asked: they part the words that the search ranks by and a page marks.
FILLERS = (
    "a am an and are at be by can do does for from have how i if in is it me much my of on or should that "
    "the this to what when which will with"
)
SEPARATOR = r"""[\s\-_,:;!?=\[\]()\\"`/]+|\.(?!\d)|\b(?:{})\b""".format(
    "|".join(f"[{word[0]}{word[0].upper()}]{word[1:]}" for word in FILLERS.split())
)
# Of a notebook's page: a picture's text and half of its pixels, as its cell and the kernel say.
TEMPLATE = """{% extends "markdown/index.md.j2" %}
{% block data_png %}
<img alt="{{ cell.metadata.alt | e }}" src="{{ output.metadata.filenames["image/png"] | path2url }}"
{%- if output.metadata["image/png"] %} width="{{ output.metadata["image/png"].width }}"{% endif %}>
{% endblock data_png %}
"""
Nav = list[dict[str, Any]]


def place(file: pathlib.Path) -> str:
    """Where a file of the tree stands in the site: pages of docs/ at its top, all else by its path."""
    return (file.relative_to(DOCS) if file.is_relative_to(DOCS) else file.relative_to(ROOT)).as_posix()


def copy(source: pathlib.Path) -> None:
    """All pages of docs/, and what they link to, also out of docs/."""
    waiting = sorted(DOCS.rglob("*.md"))
    done = set(waiting)
    while waiting:
        file = waiting.pop()
        target = source / place(file)
        target.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix != ".md":
            shutil.copyfile(file, target)
            continue
        text = file.read_text(encoding="utf-8")
        links = {link: (file.parent / link).resolve() for _, link, _, _ in LINK.findall(_prose(text))}
        linked = {path for path in links.values() if path.is_file() and path.is_relative_to(ROOT)}
        waiting += sorted(linked - done)
        done |= linked
        text = page(text, file, links)
        if file.stem == "glossary":  # a term is a heading, so that the search leads to it
            text = TERM.sub(lambda term: f"### {term[1]}\n\n{term[2].lstrip(': ')}\n", text)
        target.write_text(text, encoding="utf-8")


def page(text: str, file: pathlib.Path, links: dict[str, pathlib.Path]) -> str:
    """A page's Markdown for the site: its links follow what moved, and tables stand apart from text."""

    def moved(found: re.Match[str]) -> str:
        begin, link, anchor, end = found.groups()
        path = links[link]
        if path.is_file() and path.is_relative_to(ROOT):
            link = posixpath.relpath(place(path), posixpath.dirname(place(file)) or ".")
        if path.parent == NOTEBOOKS:
            link = link.removesuffix(".py") + ".md"  # the page that is made of it
        return f"{begin}{link}{anchor or ''}{end}"

    parts = FENCED.split(text)
    parts[::2] = [TABLE.sub(r"\1\n\n", LINK.sub(moved, part)) for part in parts[::2]]
    return "".join(parts)


def _prose(text: str) -> str:
    return "".join(FENCED.split(text)[::2])


def title(file: pathlib.Path) -> str:
    """A page's first heading."""
    found = re.search(r"^# (.+)$", file.read_text(encoding="utf-8"), re.M)
    return found[1] if found else file.stem


def navigation(source: pathlib.Path) -> Nav:
    """The ways in as docs/index.md has them, then notebooks, reference and glossary."""
    nav: Nav = [{"Home": "index.md"}]
    sections = re.split(r"^## ", (source / "index.md").read_text(encoding="utf-8"), flags=re.M)[1:]
    for section in sections:
        pages = re.findall(r"^- \[([^\]]+)\]\((\w+\.md)\)", section, re.M)
        if pages:
            nav.append({re.split(r"[:\n]", section)[0]: [{name: file} for name, file in pages]})
    for name in (NOTEBOOKS.name, "reference"):
        files = sorted((source / name).glob("*.md"), key=lambda file: docs_python.order(file.stem))
        nav.append({name.capitalize(): [{title(file): f"{name}/{file.name}"} for file in files]})
    return [*nav, {"Glossary": "glossary.md"}]


def notebook(file: pathlib.Path, folder: pathlib.Path) -> str:
    """Run a notebook; its page shows what it prints and draws, and has it beside, to take along."""
    cells = jupytext.read(file)
    with tempfile.TemporaryDirectory() as scratch:
        client = nbclient.NotebookClient(
            cells,
            config=Config(KernelManager={"transport": "ipc", "ip": f"{scratch}/kernel"}),  # no port is opened
            timeout=300,
            coalesce_streams=True,  # a cell that prints for a while prints one text
            extra_arguments=["--InlineBackend.figure_formats=retina"],
            resources={"metadata": {"path": scratch}},
        )
        try:
            client.execute()
        except (nbclient.exceptions.CellExecutionError, nbclient.exceptions.CellTimeoutError) as error:
            raise SystemExit(f"{place(file)}: {error}") from None
    for cell in cells.cells:
        for shown in cell.get("outputs", []):
            if shown.get("name") == "stderr":
                raise SystemExit(f"{place(file)}: a cell warns: {shown['text']}")
            if "image/png" in shown.get("data", {}) and not cell.metadata.get("alt"):
                raise SystemExit(f'{place(file)}: a picture has no text alternative: write # %% alt="..."')
    exporter = nbconvert.MarkdownExporter(
        extra_loaders=[jinja2.DictLoader({"page.md.j2": TEMPLATE})], template_file="page.md.j2"
    )
    text, made = exporter.from_notebook_node(cells, {"unique_key": file.stem, "output_files_dir": file.stem})
    heading, rest = text.strip().split("\n", 1)
    taken = f"Take it along: [notebook]({file.stem}.ipynb), [script]({file.name})."
    (folder / file.stem).mkdir(parents=True)
    for name, picture in made["outputs"].items():
        (folder / name).write_bytes(picture)
    (folder / f"{file.stem}.md").write_text(f"{heading}\n\n{taken}\n{rest}\n", encoding="utf-8")
    jupytext.write(cells, folder / f"{file.stem}.ipynb")
    shutil.copyfile(file, folder / file.name)
    return place(file)


def configuration(nav: Nav) -> dict[str, Any]:
    """What Zensical reads. Fonts are the reader's own, so that none is fetched."""
    palette = [
        {"media": f"(prefers-color-scheme: {name})", "scheme": scheme, "primary": "indigo", "toggle": toggle}
        for name, scheme, toggle in (
            ("light", "default", {"icon": "lucide/sun", "name": "Dark colours"}),
            ("dark", "slate", {"icon": "lucide/moon", "name": "Light colours"}),
        )
    ]
    features = ["navigation.tabs", "navigation.top", "navigation.footer", "search.highlight"]
    slugs = {"object": "pymdownx.slugs.slugify", "kwds": {"case": "lower"}}
    project = {
        "site_name": "afo-sim",
        "site_description": "Simulator of ankle-foot orthoses driven by pneumatic artificial muscles",
        "docs_dir": "source",
        "use_directory_urls": False,  # so that it opens from a folder, too
        "nav": nav,
        "extra_css": ["style.css"],
        "extra": {"generator": False, "polyfills": [{"path": "iframe-worker.js", "type": "text/javascript"}]},
        "plugins": {"search": {"separator": SEPARATOR}, "offline": {}},
        "theme": {"font": False, "features": [*features, "content.code.copy"], "palette": palette},
        "markdown_extensions": {
            "tables": {},
            "sane_lists": {},
            "toc": {"permalink": True, "slugify": slugs},
            "pymdownx": {"superfences": {}, "highlight": {}, "betterem": {}},
        },
    }
    return {"project": project}


class Page(HTMLParser):
    """Anchors of a page, where it links to, and what it fetches."""

    def __init__(self, text: str):
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.anchors |= {found[name] for name in ("id", "name") if name in found}
        if tag in FETCHED and FETCHED[tag] in found:
            self.fetched.append(found[FETCHED[tag]])
        elif tag == "a" and "href" in found:
            self.links.append(found["href"])


def faults(site: pathlib.Path) -> Iterator[str]:
    """Broken links and anchors, and what a page or style sheet would fetch from outside."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    for path, read in pages.items():
        for link in {*read.links, *read.fetched}:
            url = urllib.parse.urlsplit(link)
            if url.scheme or url.netloc:
                if link in read.fetched and url.scheme != "data":
                    yield f"{path.name}: fetches {link}"
                continue
            target = (path.parent / urllib.parse.unquote(url.path)).resolve() if url.path else path
            anchor = urllib.parse.unquote(url.fragment)
            if not target.is_file():
                yield f"{path.name}: {link} leads nowhere"
            elif anchor and target in pages and anchor not in pages[target].anchors:
                yield f"{path.name}: {link} has no such anchor"
    for style in site.rglob("*.css"):
        for address in re.findall(r"(?:url\(|@import)\s*[\"']?(https?:[^)\"']+)", style.read_text()):
            yield f"{style.name}: fetches {address}"


def build(out: pathlib.Path, tell: Callable[[str], None] = print) -> int:
    """Build the site; the number of its pages. SystemExit with what is wrong, and no site is written."""
    if out.exists() and not (out / "search.json").is_file():
        raise SystemExit(f"--out: {out} is there and is not a site; allowed: a new folder, or a site")
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch).resolve()
        source = root / "source"
        copy(source)
        (source / "style.css").write_text(STYLE)
        (source / "iframe-worker.js").write_text(SCRIPT)  # of this name, or Zensical fetches one
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            run = partial(notebook, folder=source / NOTEBOOKS.name)
            ran = pool.map(run, sorted(NOTEBOOKS.glob("*.py")))  # in processes of their own
            for name, text in (*docs_reference.pages(tell), *docs_python.pages()):
                target = source / "reference" / f"{name}.md"
                target.parent.mkdir(exist_ok=True)
                target.write_text(text, encoding="utf-8")
            for name in ran:
                tell(f"has run {name}")
        (root / "zensical.toml").write_text(tomli_w.dumps(configuration(navigation(source))))
        done = subprocess.run(
            [sys.executable, "-m", "zensical", "build", "--strict"],
            cwd=root,
            env=os.environ | {"NO_COLOR": "1"},
            capture_output=True,
            text=True,
        )
        said = done.stdout + done.stderr
        if done.returncode or "warning" in said.lower():
            raise SystemExit(said)
        (root / "site" / "404.html").unlink()  # it would have to know the site's address
        for file in (root / "site").rglob("*.html"):  # an empty cell heads nothing
            file.write_text(EMPTY.sub("<td></td>", file.read_text(encoding="utf-8")), encoding="utf-8")
        for worker in (root / "site" / "assets").rglob("workers/search.*.js"):
            shutil.copyfile(ROOT / "scripts" / "search.js", worker)
        if found := list(faults(root / "site")):
            raise SystemExit("\n".join(found))
        shutil.rmtree(out, ignore_errors=True)
        shutil.move(root / "site", out)
    return sum(1 for _ in out.rglob("*.html"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("site"))
    out = parser.parse_args().out.resolve()
    print(f"{build(out)} pages in {out}: open {out / 'index.html'}")


if __name__ == "__main__":
    main()
