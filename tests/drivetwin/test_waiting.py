"""What a command waits for is said, and the wait ends in one line."""

from __future__ import annotations

import signal
import socket
import time

import pytest

from drivetwin.cli import panel, waiting
from drivetwin.foundation.errors import UserError


def test_what_is_done_in_time_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    before = signal.getsignal(signal.SIGALRM)
    with waiting.waiting("the tide"):
        pass
    assert capsys.readouterr().err == ""
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_a_wait_is_said_and_ends_in_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(waiting, "FIRST", 0.01)
    monkeypatch.setattr(waiting, "EVERY", 0.01)
    with pytest.raises(UserError, match=r"^gave up after 0 s of waiting for the tide$"), waiting.waiting("the tide", 0.1):
        time.sleep(100.0)
    said = capsys.readouterr().err.splitlines()
    assert len(said) > 2
    assert set(said) == {"drivetwin: waiting for the tide (0 s)"}


def test_a_bus_whose_host_was_stopped_keeps_no_panel_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes the connection, as the kernel does in its place, and never answers."""
    monkeypatch.setattr(panel, "ANSWER", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as host:
        bus = f"ws://127.0.0.1:{host.getsockname()[1]}"
        with pytest.raises(UserError, match=f"waiting for an answer of {bus}"), panel._joined_by(bus):
            pass
