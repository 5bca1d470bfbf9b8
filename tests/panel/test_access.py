"""Who may look and who may write; each refusal says why."""

from __future__ import annotations

import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.panel.access import Access, Pen, RefusedError

LOCAL = Access("127.0.0.1")
OUTSIDE = Access("192.0.2.7", "a token")
HOST = "192.0.2.7:8402"


@pytest.mark.parametrize("host", ["127.0.0.1:8402", "localhost:8402", "[::1]:8402", "127.0.0.1"])
def test_this_machine_needs_nothing(host: str) -> None:
    LOCAL.check(host, None, None)
    LOCAL.check(host, f"http://{host}", None)


@pytest.mark.parametrize(
    "origin", ["http://example.org", "http://127.0.0.1:8403", "https://127.0.0.1:8402", "null", "http://[::1]:8402"]
)
def test_a_page_of_another_origin_is_refused(origin: str) -> None:
    with pytest.raises(RefusedError, match=r"a page of .* may not ask this panel"):
        LOCAL.check("127.0.0.1:8402", origin, None)


@pytest.mark.parametrize("host", ["example.org:8402", "192.0.2.7:8402", "", None])
def test_a_name_that_somebody_else_gave_this_machine_is_refused(host: str | None) -> None:
    with pytest.raises(RefusedError, match="open it by the address that it printed"):
        LOCAL.check(host, None, None)


@pytest.mark.parametrize("token", [None, "", "another", "a tokeN", "ä"])
def test_from_outside_the_token_is_needed(token: str | None) -> None:
    with pytest.raises(RefusedError, match="asks for its token") as refused:
        OUTSIDE.check(HOST, f"http://{HOST}", token)
    assert refused.value.status == 401


def test_with_the_token_one_may_look_from_outside() -> None:
    OUTSIDE.check(HOST, f"http://{HOST}", "a token")


def test_no_panel_is_reached_from_outside_without_a_token() -> None:
    with pytest.raises(UserError, match="needs a token"):
        Access("0.0.0.0")


def test_a_panel_that_only_reads_gives_nobody_the_pen() -> None:
    with pytest.raises(RefusedError, match="--allow-writes"):
        Pen(allowed=False).take("page")


def test_one_page_writes_until_it_lets_go() -> None:
    pen = Pen(allowed=True)
    pen.take("first")
    pen.take("first")
    with pytest.raises(RefusedError, match="another page writes since"):
        pen.take("second")
    pen.release("second")
    assert pen.told("second")["writer"] == "another page"
    pen.release("first")
    pen.take("second")
    assert pen.told("second") == {"allowed": True, "writer": "this page"}
