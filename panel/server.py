"""The panel's server: pages, and one WebSocket a page, over which it asks and is told what it watches."""

from __future__ import annotations

import asyncio
import json
import logging
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from drivetwin.foundation.errors import UserError
from drivetwin.panel.access import COOKIE, Access, RefusedError
from drivetwin.panel.shown import Asked, Shown

logger = logging.getLogger(__name__)

PAGES = Path(__file__).with_name("pages")

FRAMES = 20
"""How often a page is told what it watches, at most [1/s]."""

MOST_WAITING = 1000
"""Questions of a page that wait in each of its queues, at most: a tree of parameters has some hundreds."""

LONGEST_QUESTION = 4_000_000
"""[byte]; the EDS of a drive with thousands of objects is one."""

_HEADERS = (
    (b"content-security-policy", b"default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cache-control", b"no-cache"),
)
"""A page loads nothing but from its own server, and nobody frames it."""


@dataclass(frozen=True)
class _Waiting:
    """What a page has asked under a number; `asked`: None where it lets the pen go."""

    number: object
    asked: Asked | None


class Guard:
    """Lets nobody through who may not (`Access`), and says on each answer what a page may load."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        asked = HTTPConnection(scope)
        offered = asked.query_params.get("token")
        try:
            self._access.check(asked.headers.get("host"), asked.headers.get("origin"), offered or asked.cookies.get(COOKIE))
        except RefusedError as error:
            logger.warning("refused: %s", error)
            await self._refuse(error, scope, receive, send)
            return
        if scope["type"] == "http" and offered is not None:
            await self._remember(offered)(scope, receive, send)
            return
        await self._app(scope, receive, self._with_headers(send))

    async def _refuse(self, error: RefusedError, scope: Scope, receive: Receive, send: Send) -> None:
        answer = PlainTextResponse(f"{error}\n", error.status)
        if scope["type"] == "websocket":
            await WebSocket(scope, receive, send).send_denial_response(answer)
        else:
            await answer(scope, receive, send)

    def _remember(self, token: str) -> Response:
        """To the page itself, whose address no longer shows the token."""
        answer = RedirectResponse("/", 303)
        answer.set_cookie(COOKIE, token, httponly=True, samesite="strict")
        return answer

    def _with_headers(self, send: Send) -> Send:
        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = list(message.get("headers", ()))
                said = {name for name, _ in own}
                message["headers"] = own + [header for header in _HEADERS if header[0] not in said]
            await send(message)

        return sending


class Page:
    """One open page. What it watches is sent by a task of its own: one that stops reading makes nobody else wait.

    Its questions are answered by two more, in order: what only reads from a drive, which may be slow to answer, and the rest.
    """

    def __init__(self, shown: Shown, wire: WebSocket) -> None:
        self._shown = shown
        self._wire = wire
        self._view: str | None = None
        self._told = ""
        self._seen = asyncio.Event()
        self._of_drives: asyncio.Queue[_Waiting] = asyncio.Queue()
        self._others: asyncio.Queue[_Waiting] = asyncio.Queue()
        self._writing: asyncio.Future[object] | None = None

    async def serve(self) -> None:
        """Answer the page until it leaves; then the pen is free again."""
        await self._wire.accept()
        work = (self._listen(), self._tell(), self._answer_each(self._of_drives), self._answer_each(self._others))
        tasks = {asyncio.create_task(each) for each in work}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                with suppress(WebSocketDisconnect):
                    task.result()
        finally:
            for task in tasks:
                task.cancel()
            if self._writing is None:
                self._shown.pen.release(self)
            else:
                self._writing.add_done_callback(self._has_written)

    def _has_written(self, writing: asyncio.Future[object]) -> None:
        """The page has left while it wrote: nobody is told how that went."""
        if not writing.cancelled() and writing.exception() is not None:
            logger.info("what a page wrote before it left: %s", writing.exception())
        self._shown.pen.release(self)

    async def _listen(self) -> None:
        """Raises WebSocketDisconnect when the page leaves."""
        while True:
            await self._hear(await self._wire.receive_text())

    async def _hear(self, text: str) -> None:
        number = None
        try:
            question = _question(text)
            if question == {"ask": "seen"}:
                self._seen.set()
                return
            number = question.pop("id", None)
            await self._take(number, question)
        except UserError as error:
            await self._send({"id": number, "refused": str(error)})

    async def _take(self, number: object, question: dict[str, Any]) -> None:
        """Answer at once what needs neither a drive nor the pen; queue the rest. A view that is opened again is sent whole."""
        match question:
            case {"ask": "views"}:
                await self._send({"id": number, "answer": list(self._shown.views)})
            case {"ask": "watch", "view": str(view)} if view in self._shown.views:
                self._view, self._told = view, ""
                await self._send({"id": number, "answer": None})
            case {"ask": "release"}:
                self._queue(self._others, _Waiting(number, None))
            case _:
                asked = self._shown.asked(question)
                self._queue(self._of_drives if asked.of_a_drive else self._others, _Waiting(number, asked))

    def _queue(self, queue: asyncio.Queue[_Waiting], one: _Waiting) -> None:
        if queue.qsize() >= MOST_WAITING:
            raise UserError(f"{MOST_WAITING} questions of this page wait for an answer: ask fewer at a time")
        queue.put_nowait(one)

    async def _answer_each(self, queue: asyncio.Queue[_Waiting]) -> None:
        while True:
            one = await queue.get()
            try:
                answer = await self._answer(one.asked)
            except UserError as error:
                await self._send({"id": one.number, "refused": str(error)})
            else:
                await self._send({"id": one.number, "answer": answer})

    async def _answer(self, asked: Asked | None) -> object:
        """None: the pen is let go. What has begun to write ends, though the page may have left."""
        if asked is None:
            self._shown.pen.release(self)
            return None
        if not asked.writes:
            return await asyncio.to_thread(asked.answer)
        self._shown.pen.take(self)
        self._writing = asyncio.ensure_future(asyncio.to_thread(asked.answer))
        return await asyncio.shield(self._writing)

    async def _tell(self) -> None:
        """What it watches, once it has seen what it was told last: a slow page is told less often, and nothing piles up."""
        while True:
            await asyncio.sleep(1.0 / FRAMES)
            if self._view is None:
                continue
            head = {"view": self._view, **self._shown.head(), "pen": self._shown.pen.told(self)}
            told = json.dumps({**head, **self._shown.views[self._view]()})
            if told != self._told:
                self._told = told
                self._seen.clear()
                await self._wire.send_text(told)
                await self._seen.wait()

    async def _send(self, told: dict[str, object]) -> None:
        await self._wire.send_text(json.dumps(told))


def _question(text: str) -> dict[str, Any]:
    try:
        told = json.loads(text)
    except ValueError:
        raise UserError("expected a question as JSON") from None
    if not isinstance(told, dict):
        raise UserError('expected {"id": NUMBER, "ask": WHAT, ...}')
    return told


def application(shown: Shown, access: Access) -> ASGIApp:
    """What is shown as an ASGI application."""

    async def live(wire: WebSocket) -> None:
        await Page(shown, wire).serve()

    pages = StaticFiles(directory=PAGES, html=True)
    return Guard(Starlette(routes=[WebSocketRoute("/live", live), *shown.files(), Mount("/", pages)]), access)


class _Server(uvicorn.Server):
    """uvicorn, which ends on Ctrl-C and SIGTERM without raising them again."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        former = {number: signal.signal(number, self._end) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)

    def _end(self, _number: int, _frame: object) -> None:
        self.should_exit = True


def listen(host: str, port: int) -> socket.socket:
    """A socket for the server. Raises UserError where the address is not to be had."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise UserError(
            f"cannot listen on {host}:{port} ({error.strerror}); choose another --port, or 0 for a free one"
        ) from None


def serve(shown: Shown, access: Access, where: socket.socket) -> None:
    """Serve what is shown until Ctrl-C or SIGTERM."""
    config = uvicorn.Config(
        application(shown, access), log_level="error", access_log=False, ws="websockets-sansio", ws_max_size=LONGEST_QUESTION,
        ws_per_message_deflate=False,  # to a page on the same computer it saves nothing
        timeout_graceful_shutdown=2, lifespan="off",
    )  # fmt: skip
    _Server(config).run(sockets=[where])
