"""The studio's page on this machine alone: files by HTTP, changes and answers by one web socket a tab."""

import asyncio
import contextlib
import pathlib
import re
import secrets
import socket
import webbrowser
from collections.abc import AsyncIterator, Callable, Sequence

import uvicorn
from pydantic_core import from_json
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from afo_sim.common import AfoSimError, Foreign, InputError, Json, JsonDict, reason, write_text
from afo_sim.studio.controls import read
from afo_sim.studio.design import opened, save
from afo_sim.studio.engine import Engine, Wish, compared
from afo_sim.studio.messages import MOST_FILES, NAME, read_message

PAGE = pathlib.Path(__file__).parent / "page"
_MOST = 300_000_000  # of the files that are dropped on the page [bytes]
_PATIENCE = 600.0  # with a file that is put here [s]
_TABS = 16  # at once
_PAUSE = 0.01  # after a message of a tab [s]
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
    """One document, the tabs that show it, and the process that answers it."""

    def __init__(self, source: str, saved: pathlib.Path) -> None:
        self.engine = Engine(self._told)  # begins, while the document is read
        self.document, self.saved = opened(source), saved
        self.token = secrets.token_urlsafe(24)
        self.serial = 0
        self._tabs: list[Tab] = []
        self.last: dict[str, JsonDict] = {}  # by kind: what a new tab is told
        self._kept: dict[str, JsonDict] = {}  # by slot: answers of the variants
        files = StaticFiles(directory=PAGE, html=True)
        files.all_directories.append(self.engine.folder)
        inside = [
            Route("/files/{name}", self._upload, methods=["PUT"]),
            WebSocketRoute("/socket", self._socket),
            Mount("/", files),
        ]
        routes = [Mount(f"/{self.token}", routes=inside)]  # all of it below the token
        self.app = Starlette(routes=routes, lifespan=self._lifespan)
        self.app.add_middleware(Guard)

    @contextlib.asynccontextmanager
    async def _lifespan(self, app: Starlette) -> AsyncIterator[None]:
        hearing = asyncio.create_task(self.engine.run())
        self._ask()
        yield
        hearing.cancel()
        self.engine.child.close()

    async def _upload(self, request: Request) -> Response:
        """A file of a trial, by its plain name, whole or not at all."""
        name, folder = request.path_params["name"], self.engine.folder / "trial"
        part = folder / f".{secrets.token_hex(8)}"
        try:
            if not re.fullmatch(NAME, name):
                raise InputError("is not a valid name of a file", field="name", value=name)
            folder.mkdir(exist_ok=True)
            async with asyncio.timeout(_PATIENCE):
                with part.open("xb", buffering=0) as file:
                    async for content in request.stream():
                        file.write(content)
                        there = [each.stat().st_size for each in folder.iterdir() if each.name != name]
                        if sum(there) > _MOST or len(there) > MOST_FILES:
                            allowed = f"{MOST_FILES} files of a trial, {_MOST // 10**6} MB together"
                            return JSONResponse({"problem": f"{name}: too much; allowed: {allowed}"}, 413)
            part.replace(folder / name)
        except (OSError, InputError, ClientDisconnect) as error:  # a TimeoutError is an OSError
            return JSONResponse({"problem": _sentence(error)}, status_code=400)
        finally:
            part.unlink(missing_ok=True)
        return JSONResponse({"name": name, "bytes": (folder / name).stat().st_size})

    async def _socket(self, socket: WebSocket) -> None:
        await socket.accept()
        if len(self._tabs) == _TABS:
            await socket.send_json({"kind": "problem", "text": f"{_TABS} tabs are open: close one of them"})
            return await socket.close(1013)
        tab = Tab()
        self._tabs.append(tab)
        for message in (self._document(), *self._kept.values(), *self.last.values()):
            tab.tell(message)
        sender = asyncio.create_task(tab.send_to(socket))
        try:
            while (heard := await socket.receive())["type"] == "websocket.receive":
                await self._take(heard.get("text"), tab)
                await asyncio.sleep(_PAUSE)  # for the others
        finally:
            sender.cancel()
            self._tabs.remove(tab)

    async def _take(self, text: str | None, tab: "Tab") -> None:
        """Do what a tab asks for; whatever is wrong with it goes back to that tab alone."""
        before, sent = self.document.design, None
        try:
            sent = _json(text)
            await self._do(read_message(sent))
        except Exception as error:  # of ours, too: no message ends a tab
            key = sent.get("key") if isinstance(sent, dict) else None
            told = {"key": key if isinstance(key, str) else "", "serial": self.serial}
            return tab.tell({"kind": "problem", "text": _sentence(error), **told})
        if self.document.design != before:
            self._ask()
        else:
            self._tell(self._document())
            self._compare()

    async def _do(self, asked: Foreign) -> None:
        document = self.document
        match asked.op:
            case "undo" | "redo" | "keep":
                getattr(document, asked.op)()
            case "show" | "remove":
                getattr(document, asked.op)(asked.slot)
            case "rename":
                document.rename(asked.slot, asked.name)
            case "change":
                sets = {key: read(key, value) for key, value in asked.sets.items()}
                document.change(sets, follow=asked.follow, join=asked.join)
            case "save":
                self.saved = save(document, asked.folder or self.saved).parent
                self._tell({"kind": "saved", "folder": str(self.saved), "serial": self.serial})
            case "import":
                files = [self.engine.folder / "trial" / name for name in asked.files]
                found = await self.engine.read_trial(files, asked.walker, asked.side)
                document.change(found.pop("sets"))
                self._tell({"kind": "trial", "serial": self.serial, **found})
            case "search":
                over = {key: tuple(read(key, end) for end in ends) for key, ends in asked.keys.items()}
                self._want("search", {"over": over, "objective": asked.objective})
            case further:
                self._want("" if further == "stop" else further)

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
        for tab in self._tabs:
            tab.tell(message)


class Tab:
    """What a tab is still to be told: the newest of each kind, however slowly it reads."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, str], JsonDict] = {}
        self._more = asyncio.Event()

    def tell(self, message: JsonDict) -> None:
        """Tell it when it has read what waits."""
        kind = message["kind"], message.get("slot", "")
        self._waiting.pop(kind, None)
        self._waiting[kind] = message
        self._more.set()

    async def send_to(self, socket: WebSocket) -> None:
        """Tell what there is and what comes, until the tab is closed."""
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while await self._more.wait():
                await socket.send_json(self._waiting.pop(next(iter(self._waiting))))
                if not self._waiting:
                    self._more.clear()


def _json(text: str | None) -> Json:
    """What a tab sends, which is a text."""
    try:
        return from_json(text or "", allow_inf_nan=False)
    except ValueError:
        raise InputError("is not JSON", field="message", allowed="an object with its `op`") from None


def _sentence(error: Exception) -> str:
    """What went wrong, in words for whoever uses the page."""
    if isinstance(error, AfoSimError):
        return str(error)
    if isinstance(error, OSError):
        return f"cannot be written or read: {reason(error) or 'it took too long'}"
    return "the program met a fault of its own with this; the design is as it was"


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
                own = {"content-security-policy": _REPORT} if scope["path"].endswith("/report.html") else {}
                for name, value in (_HEADERS | own).items():
                    sent.setdefault(name, value)
            await send(message)

        try:
            await self.app(scope, receive, guarded)
        except Exception as error:  # of ours: it ends this answer alone
            with contextlib.suppress(RuntimeError):  # that has begun
                await PlainTextResponse(_sentence(error), status_code=500)(scope, receive, guarded)


def serve(
    scenario: str, trial: Sequence[pathlib.Path], out: pathlib.Path, *, side: str = "right", port: int = 0
) -> Callable[[bool], None]:
    """A studio that is ready; the function that is returned serves it until it is stopped by Ctrl-C."""
    if not 0 <= port <= 65535:
        raise InputError("is not a valid port", field="port", value=port, allowed="0 to 65535")
    try:
        listening = socket.create_server(("127.0.0.1", port))
    except OSError as error:
        problem, allowed = f"cannot be used ({reason(error)})", "0 for any free one"
        raise InputError(problem, field="port", value=port, allowed=allowed) from error
    studio = Studio(scenario, out)
    if trial:
        from afo_sim.studio.trial import imported

        found = imported(trial, "patient", side, studio.engine.folder)
        studio.document.change(found.pop("sets"))
        studio.last["trial"] = {"kind": "trial", **found}
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
            log_level="critical",
            lifespan="on",
            ws="websockets-sansio",
            ws_max_size=200_000,
            timeout_graceful_shutdown=1,
        )
        uvicorn.Server(config).run([listening])

    return run
