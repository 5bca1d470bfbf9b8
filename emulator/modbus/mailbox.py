"""Passes requests from the threads of the ports to the thread that owns the machine, and answers back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from threading import Lock

Question = Callable[[], bytes | None]
"""Asks the machine; called by the thread that owns it."""


class Mailbox:
    """`ask` is for the ports, `work` for the owner of the machine.

    A port waits for each answer before it asks again, so as many requests wait as there are connections.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._waiting: deque[tuple[Question, Future[bytes | None]]] = deque()
        self._closed = False

    def ask(self, question: Question) -> Future[bytes | None]:
        """The answer to come; None for no answer, as after `close`."""
        future: Future[bytes | None] = Future()
        with self._lock:
            if not self._closed:
                self._waiting.append((question, future))
                return future
        future.set_result(None)
        return future

    def work(self) -> None:
        """Answer what is waiting now."""
        for _ in range(len(self._waiting)):
            with self._lock:
                question, future = self._waiting.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(question())
            except BaseException as error:
                future.set_exception(error)
                raise

    def close(self) -> None:
        """Nobody will answer any more."""
        with self._lock:
            self._closed = True
            left, self._waiting = self._waiting, deque()
        for _, future in left:
            future.set_result(None)
