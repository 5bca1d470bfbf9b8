"""Ctrl-C, SIGTERM and a closed terminal during motion: noted at once, raised where nothing is left half done."""

from __future__ import annotations

import signal
import threading
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interruption:
    """A request to stop, that has come once it is `requested`.

    It is raised once, so that impatience does not interrupt the stopping itself.
    """

    def __init__(self) -> None:
        self.requested = False
        self._raised = False
        self._former: dict[signal.Signals, signal._HANDLER] = {}

    def watch(self) -> None:
        """Take the signals over; in a thread that cannot, they stay with whoever has them."""
        if threading.current_thread() is threading.main_thread():
            self._former = {number: signal.signal(number, self._note) for number in SIGNALS}

    def release(self) -> None:
        """Give the signals back."""
        for number, handler in self._former.items():
            signal.signal(number, handler)
        self._former = {}

    def raise_once(self) -> None:
        """Raise KeyboardInterrupt if a signal has come and was not raised before."""
        if self.requested and not self._raised:
            self._raised = True
            raise KeyboardInterrupt

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.requested = True
