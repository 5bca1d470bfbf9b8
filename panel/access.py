"""Who may look at the panel, and who may write: the origin, the token, `--allow-writes`, and one writer at a time."""

from __future__ import annotations

import hmac
import ipaddress
import time
from dataclasses import dataclass
from urllib.parse import urlsplit

from drivetwin.foundation.errors import UserError

COOKIE = "drivetwin_panel"
"""Holds the token once an address with ?token= has been opened."""


class RefusedError(UserError):
    """A page asked for what it may not have; `status` is HTTP's."""

    def __init__(self, message: str, status: int = 403) -> None:
        super().__init__(message)
        self.status = status


def is_loopback(host: str) -> bool:
    """Whether an address or name is this machine's own, which nobody outside reaches."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Access:
    """What a request has to bring. `token` is None where only this machine reaches the panel."""

    host: str
    token: str | None = None

    def __post_init__(self) -> None:
        """Raises UserError for an address that others reach, without a token."""
        if self.token is None and not is_loopback(self.host):
            raise UserError(f"{self.host} is reached from outside: the panel needs a token there")

    def check(self, host: str | None, origin: str | None, token: str | None) -> None:
        """`host` and `origin` are the request's headers, `token` what it brought. Raises RefusedError."""
        asked = urlsplit(f"//{host or ''}")
        if self.token is None and not is_loopback(asked.hostname or ""):
            raise RefusedError(f"this panel is {self.host} and no {host!r}; open it by the address that it printed")
        if origin is not None and (urlsplit(origin).scheme != "http" or urlsplit(origin).netloc != asked.netloc):
            raise RefusedError(f"a page of {origin} may not ask this panel; open http://{host}/ itself")
        if self.token is not None and not hmac.compare_digest(self.token.encode(), (token or "").encode()):
            raise RefusedError(
                "this panel is reached from outside and asks for its token; open the address with ?token= that it printed", 401
            )


class Pen:
    """The right to write, which one page has at a time, from its first write until it lets go or leaves."""

    def __init__(self, *, allowed: bool) -> None:
        self.allowed = allowed
        self._holder: object | None = None
        self._since = ""

    def take(self, page: object) -> None:
        """Called before each write. Raises RefusedError where the panel only reads, or another page writes."""
        if not self.allowed:
            raise RefusedError("this panel only reads; start it with --allow-writes to write")
        if self._holder not in (None, page):
            raise RefusedError(f"another page writes since {self._since}; close it, or press 'release' there", 409)
        if self._holder is None:
            self._holder, self._since = page, time.strftime("%H:%M:%S")

    def release(self, page: object) -> None:
        """The page writes no more; nothing happens where it did not."""
        if self._holder is page:
            self._holder = None

    def told(self, page: object) -> dict[str, object]:
        """For the page: whether writing is allowed, and who does."""
        holder = "nobody" if self._holder is None else "this page" if self._holder is page else "another page"
        return {"allowed": self.allowed, "writer": holder}
