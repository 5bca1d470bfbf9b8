"""One page of the panel's server: a question that takes long holds up neither the view nor a page's leaving."""

from __future__ import annotations

import asyncio
import gc
import json
import threading
from collections.abc import Callable
from typing import Any, cast

import pytest
from processes import PATIENCE
from starlette.routing import Route
from starlette.websockets import WebSocket, WebSocketDisconnect

from drivetwin.foundation.errors import UserError
from drivetwin.panel.access import Pen, RefusedError
from drivetwin.panel.server import MOST_WAITING, Page
from drivetwin.panel.shown import Asked


class Wire:
    """What the server does with a WebSocket, played by a test."""

    def __init__(self) -> None:
        self._told: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._asked: asyncio.Queue[str | None] = asyncio.Queue()

    async def accept(self) -> None:
        """Every page is."""

    async def receive_text(self) -> str:
        text = await self._asked.get()
        if text is None:
            raise WebSocketDisconnect
        return text

    async def send_text(self, text: str) -> None:
        self._told.put_nowait(json.loads(text))

    def ask(self, number: int, what: str, **more: object) -> None:
        self._asked.put_nowait(json.dumps({"id": number, "ask": what, **more}))

    def has_seen(self) -> None:
        self._asked.put_nowait('{"ask": "seen"}')

    def leave(self) -> None:
        self._asked.put_nowait(None)

    async def next(self) -> dict[str, Any]:
        return await asyncio.wait_for(self._told.get(), PATIENCE)


class Slow:
    """Shows one view that never changes; "read" and "write" are answered once `answered` is set, others at once.

    `failed`: so is a write, in one line.
    """

    def __init__(self) -> None:
        self.pen = Pen(allowed=True)
        self.views: dict[str, Callable[[], dict[str, object]]] = {"still": dict}
        self.answered = threading.Event()
        self.failed = ""

    def head(self) -> dict[str, object]:
        return {}

    def asked(self, question: dict[str, Any]) -> Asked:
        slow = question["ask"] in ("read", "write")
        return Asked(question["ask"] == "write", self._slow if slow else lambda: True, question["ask"] == "read")

    def _slow(self) -> bool:
        there = self.answered.wait(PATIENCE)
        if self.failed:
            raise UserError(self.failed)
        return there

    def files(self) -> list[Route]:
        return []


async def opened(shown: Slow) -> tuple[Wire, asyncio.Task[None]]:
    wire = Wire()
    return wire, asyncio.create_task(Page(shown, cast("WebSocket", wire)).serve())


def test_a_read_that_takes_long_holds_up_nothing_else() -> None:
    async def looked() -> None:
        shown = Slow()
        wire, page = await opened(shown)
        wire.ask(1, "read")
        wire.ask(2, "watch", view="still")
        assert await wire.next() == {"id": 2, "answer": None}
        assert (await wire.next())["view"] == "still"
        wire.ask(3, "scope set")
        assert await wire.next() == {"id": 3, "answer": True}
        wire.ask(4, "release")
        assert await wire.next() == {"id": 4, "answer": None}
        shown.answered.set()
        assert await wire.next() == {"id": 1, "answer": True}
        wire.leave()
        await page

    asyncio.run(looked())


def test_a_view_that_is_opened_again_is_told_though_nothing_has_changed() -> None:
    async def looked() -> None:
        wire, page = await opened(Slow())
        for number in (1, 2):
            wire.ask(number, "watch", view="still")
            assert await wire.next() == {"id": number, "answer": None}
            assert (await wire.next())["view"] == "still"
            wire.has_seen()
        wire.leave()
        await page

    asyncio.run(looked())


@pytest.mark.parametrize("failed", ["", "the drive refused"])
def test_what_a_page_has_begun_to_write_keeps_the_pen_when_it_leaves(failed: str, caplog: pytest.LogCaptureFixture) -> None:
    async def looked() -> None:
        shown = Slow()
        shown.failed = failed
        wire, page = await opened(shown)
        wire.ask(1, "write")
        async with asyncio.timeout(PATIENCE):
            while shown.pen.told(None)["writer"] == "nobody":
                await asyncio.sleep(0)
        wire.leave()
        await page
        another = object()
        with pytest.raises(RefusedError, match="another page writes"):
            shown.pen.take(another)
        shown.answered.set()
        async with asyncio.timeout(PATIENCE):
            while shown.pen.told(None)["writer"] != "nobody":
                await asyncio.sleep(0)
        shown.pen.take(another)

    asyncio.run(looked())
    gc.collect()
    assert [record.name for record in caplog.records if record.levelname == "ERROR"] == []


def test_what_changes_the_scope_comes_before_what_is_asked_after_it() -> None:
    """The trigger is armed before the motion that is to fire it, however long a read takes."""

    async def looked() -> None:
        shown = Slow()
        wire, page = await opened(shown)
        for number, what in enumerate(("read", "scope set", "motion")):
            wire.ask(number, what)
        assert [(await wire.next())["id"] for _ in range(2)] == [1, 2]
        shown.answered.set()
        assert (await wire.next())["id"] == 0
        wire.leave()
        await page

    asyncio.run(looked())


def test_a_page_that_asks_without_end_is_refused() -> None:
    async def looked() -> None:
        shown = Slow()
        wire, page = await opened(shown)
        for number in range(MOST_WAITING + 2):
            wire.ask(number, "read")
        assert "wait for an answer" in (await wire.next())["refused"]
        shown.answered.set()
        wire.leave()
        await page

    asyncio.run(looked())
