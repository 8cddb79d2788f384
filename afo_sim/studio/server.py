"""The studio's page on this machine alone: files by HTTP, changes and answers by one web socket a tab."""

import asyncio
import contextlib
import json
import pathlib
import re
import secrets
import shutil
import socket
import webbrowser
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from afo_sim.common import InputError, Json, JsonDict, write_text
from afo_sim.gait import write
from afo_sim.gait_lab import import_gait, read_options, ten_lines, verdict
from afo_sim.show import draw_gait
from afo_sim.studio.answers import compared
from afo_sim.studio.controls import read
from afo_sim.studio.design import Document, opened, save
from afo_sim.studio.engine import Engine, Wish

PAGE = pathlib.Path(__file__).parent / "page"
_MOST = 300_000_000  # of the files that are dropped on the page [bytes]
_WHOSE = {"healthy": "a healthy walker's", "patient": "a patient's"}
_LOOPBACK = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d+)?")
_HEADERS = {
    "content-security-policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cache-control": "no-store",
}
_REPORT = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; font-src data:"
)


class Studio:
    """One document, the tabs that show it, and the thread that answers it."""

    def __init__(self, document: Document, saved: pathlib.Path) -> None:
        self.document, self.saved = document, saved
        self.token = secrets.token_urlsafe(24)
        self.serial = 0
        self._tabs: dict[WebSocket, asyncio.Queue[JsonDict]] = {}
        self.last: dict[str, JsonDict] = {}  # by kind: what a new tab is told
        self._kept: dict[str, JsonDict] = {}  # by slot: answers of the variants
        self._loop: asyncio.AbstractEventLoop | None = None
        self.engine = Engine(self._from_thread)
        inside = [
            Route("/", self._file),
            Route("/files/{name}", self._upload, methods=["PUT"]),
            Route("/{name:path}", self._file, methods=["GET"]),
            WebSocketRoute("/socket", self._socket),
        ]
        routes = [Mount(f"/{self.token}", routes=inside)]  # all of it below the token
        self.app = Starlette(routes=routes, lifespan=self._lifespan)
        self.app.add_middleware(Guard)

    @contextlib.asynccontextmanager
    async def _lifespan(self, app: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        self._ask()
        yield
        self.engine.close()
        shutil.rmtree(self.engine.folder, ignore_errors=True)

    async def _file(self, request: Request) -> Response:
        name = request.path_params.get("name") or "index.html"
        for folder in (PAGE, self.engine.folder):
            with contextlib.suppress(OSError, ValueError):  # of a name that no system has
                path = (folder / name).resolve()
                if path.is_relative_to(folder.resolve()) and path.is_file():
                    headers = {"content-security-policy": _REPORT} if name == "report.html" else {}
                    return FileResponse(path, headers=headers)
        return PlainTextResponse("there is no such page", status_code=404)

    async def _upload(self, request: Request) -> Response:
        """A file of a trial, by its plain name."""
        name = pathlib.PurePath(request.path_params["name"]).name
        folder, size = self.engine.folder / "trial", 0
        folder.mkdir(exist_ok=True)
        most = _MOST - sum(file.stat().st_size for file in folder.iterdir() if file.name != name)
        try:
            with (folder / name).open("wb") as file:
                async for part in request.stream():
                    size += len(part)
                    if size > most:
                        file.truncate(0)
                        problem = f"{name}: the files of a trial have up to {_MOST // 10**6} MB together"
                        return JSONResponse({"problem": problem}, status_code=413)
                    file.write(part)
        except (OSError, ValueError) as error:
            return JSONResponse({"problem": f"cannot be written: {error}"}, status_code=400)
        return JSONResponse({"name": name, "bytes": size})

    async def _socket(self, tab: WebSocket) -> None:
        await tab.accept()
        queue: asyncio.Queue[JsonDict] = asyncio.Queue()
        self._tabs[tab] = queue
        for message in (self._document(), *self._kept.values(), *self.last.values()):
            queue.put_nowait(message)
        sender = asyncio.create_task(_send(tab, queue))
        try:
            while True:
                await self._take(await _message(tab), queue)
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            sender.cancel()
            del self._tabs[tab]

    async def _take(self, message: Json, queue: asyncio.Queue[JsonDict]) -> None:
        """Do what a tab asks for; what is wrong with it goes back to that tab."""
        asked = message if isinstance(message, dict) else {}
        before = self.document.design
        try:
            does = self._does().get(str(asked.get("op")))
            if does is None:
                raise InputError("is not known to this studio", field="op", value=asked.get("op"))
            if (waited := does(asked)) is not None:
                await waited
        except (InputError, OSError, AttributeError, TypeError, ValueError, KeyError) as error:
            queue.put_nowait(
                {"kind": "problem", "text": str(error), "key": asked.get("key", ""), "serial": self.serial}
            )
            return
        if self.document.design != before:
            self._ask()
        else:
            self._tell(self._document())
            self._compare()

    def _does(self) -> dict[str, Callable[[JsonDict], Awaitable[None] | None]]:
        document = self.document
        return {
            "change": self._change,
            "undo": lambda m: document.undo(),
            "redo": lambda m: document.redo(),
            "keep": lambda m: document.keep(),
            "rename": lambda m: document.rename(str(m["slot"]), str(m["name"])),
            "remove": lambda m: document.remove(str(m["slot"])),
            "show": lambda m: document.show(str(m["slot"])),
            "save": self._save,
            "import": self._import,
            "bands": lambda m: self._want("bands"),
            "report": lambda m: self._want("report"),
            "search": self._search,
            "stop": lambda m: self._want(""),
        }

    def _change(self, asked: JsonDict) -> None:
        sets = {str(key): read(str(key), value) for key, value in asked["sets"].items()}
        self.document.change(sets, follow=asked.get("follow", True) is True, join=asked.get("join") is True)

    def _save(self, asked: JsonDict) -> None:
        self.saved = save(self.document, str(asked.get("folder") or self.saved)).parent
        self._tell({"kind": "saved", "folder": str(self.saved), "serial": self.serial})

    async def _import(self, asked: JsonDict) -> None:
        files = [self.engine.folder / "trial" / pathlib.PurePath(str(name)).name for name in asked["files"]]
        whose = str(asked.get("walker")), str(asked.get("side", "right"))
        found = await asyncio.to_thread(imported, files, *whose, self.engine.folder)
        self.document.change(found.pop("sets"))
        self._tell({"kind": "trial", "serial": self.serial, **found})

    def _search(self, asked: JsonDict) -> None:
        over = {str(key): tuple(read(str(key), end) for end in ends) for key, ends in asked["keys"].items()}
        self._want("search", {"over": over, "objective": asked.get("objective", "air_per_stride")})

    def _want(self, what: str, options: JsonDict | None = None) -> None:
        design, variants = self.document.design, self.document.variants.items()
        kept = {s: one.design for s, one in variants if s not in self._kept and one.design != design}
        self.engine.want(Wish(self.serial, design, what, options or {}, kept))

    def _compare(self) -> None:
        """A variant that is the present design has its answers, as soon as they are there."""
        variants, design = self.document.variants, self.document.design
        self._kept = {slot: answer for slot, answer in self._kept.items() if slot in variants}
        told = {kind: each for kind, each in self.last.items() if each.get("serial") == self.serial}
        for slot, kept in variants.items():
            there = kept.design == design and told.keys() >= {"state", "settled", "run"}
            if there and slot not in self._kept:
                self._kept[slot] = compared(slot, told)
                self._tell(self._kept[slot])

    def _ask(self) -> None:
        """Answer the design as it is now."""
        self.serial += 1
        self.last = {
            kind: told for kind, told in self.last.items() if kind in ("state", "reference", "trial")
        }
        self._tell(self._document())
        self._want("")

    def _document(self) -> JsonDict:
        back, forth = self.document.steps
        design, variants = self.document.design, self.document.variants.items()
        return {
            "kind": "document",
            "serial": self.serial,
            "undo": back,
            "redo": forth,
            "variants": [
                {"slot": slot, "name": one.name, "shown": one.design == design} for slot, one in variants
            ],
            "folder": str(self.saved),
            "sets": {key: str(value) for key, value in design.sets.items()},
        }

    def _from_thread(self, message: JsonDict) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._told, message)

    def _told(self, message: JsonDict) -> None:
        if message["kind"] == "variant":  # of a design of its own, whichever is the present one
            kept, design = self.document.variants.get(message["slot"]), message.pop("design")
            if kept is not None and kept.design == design:
                self._kept[message["slot"]] = message
                self._tell(message)
            return
        if message["serial"] != self.serial:
            return
        if message["kind"] != "progress":
            self.last[message["kind"]] = message
        self._tell(message)
        self._compare()

    def _tell(self, message: JsonDict) -> None:
        for queue in self._tabs.values():
            queue.put_nowait(message)


async def _message(tab: WebSocket) -> Json:
    """What a tab sends; None of what is no JSON, or has half a character, which no tab could be told."""
    try:
        found = await tab.receive_json()
        json.dumps(found, ensure_ascii=False).encode()
        return found
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


async def _send(tab: WebSocket, queue: asyncio.Queue[JsonDict]) -> None:
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while True:
            await tab.send_json(await queue.get())


class Guard:
    """Refuses whoever does not ask this machine by its own name, and a page of another origin."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        if not _LOOPBACK.fullmatch(host) or origin not in (None, f"http://{host}"):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
            else:
                await PlainTextResponse("not for this address", status_code=403)(scope, receive, send)
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                sent = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    sent.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, guarded)


def imported(files: Sequence[pathlib.Path], walker: str, side: str, folder: pathlib.Path) -> JsonDict:
    """A stride of a trial in a folder, and what is to be said of it."""
    found = import_gait(list(files), read_options({"walker": walker, "side": side}))
    number = 1 + len(list(folder.glob("walk_*.csv")))  # an earlier one is gone back to by undoing
    path = folder / f"walk_{number}.csv"
    write(path, found.cycle)
    draw_gait(found.cycle, path.with_suffix(".png"), found)
    return {
        "sets": {
            "description": f"{_WHOSE[walker]} own recorded walk, with the device",
            "gait.cycle": str(path),
            **dict.fromkeys(("gait.walker", "patient.body_mass", "patient.body_height")),
        },
        "picture": path.with_suffix(".png").name,
        "text": verdict(found),
        "rows": [list(row) for row in ten_lines(found)],
        "checks": [[check.fault, check.found, check.limit, check.verdict] for check in found.checks],
        "warnings": [str(warning) for warning in found.warnings],
    }


def serve(
    scenario: str, trial: Sequence[pathlib.Path], out: pathlib.Path, *, side: str = "right", port: int = 0
) -> Callable[[bool], None]:
    """A studio that is ready; the function that is returned serves it until it is stopped by Ctrl-C."""
    studio = Studio(opened(scenario), out)
    if trial:
        found = imported(trial, "patient", side, studio.engine.folder)
        studio.document.change(found.pop("sets"))
        studio.last["trial"] = {"kind": "trial", **found}
    if not 0 <= port <= 65535:
        raise InputError("is not a valid port", field="port", value=port, allowed="0 to 65535")
    try:
        listening = socket.create_server(("127.0.0.1", port))
    except OSError as error:
        allowed = "0 for any free one"
        raise InputError(f"cannot be used ({error})", field="port", value=port, allowed=allowed) from error
    address = f"http://127.0.0.1:{listening.getsockname()[1]}/{studio.token}/"

    def run(browser: bool) -> None:
        print(f"the studio is at {address}\nit is for this machine alone; stop it with Ctrl-C", flush=True)
        if browser:  # by a file of the user's own: others see an address among a program's arguments
            file = studio.engine.folder / "open.html"
            file.touch(mode=0o600)  # it names the address with its token
            write_text(file, f'<meta http-equiv="refresh" content="0;url={address}">')
            webbrowser.open(file.as_uri())
        config = uvicorn.Config(
            studio.app,
            log_level="error",
            lifespan="on",
            ws="websockets-sansio",
            ws_max_size=1_000_000,
            timeout_graceful_shutdown=2,
        )
        uvicorn.Server(config).run([listening])

    return run
