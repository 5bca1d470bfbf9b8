"""What the server shows: a bus with its drives, a command that runs, or both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from starlette.routing import Route

from drivetwin.panel.access import Pen

Told = dict[str, object]


@dataclass(frozen=True)
class Asked:
    """What a page asks for. `writes`: it needs the pen; `of_a_drive`: it only reads from one, which may be slow to answer.

    `answer` raises UserError for what cannot be done.
    """

    writes: bool
    answer: Callable[[], object]
    of_a_drive: bool = False


class Shown(Protocol):
    """What pages see and may ask."""

    @property
    def pen(self) -> Pen:
        """Who may write."""

    @property
    def views(self) -> Mapping[str, Callable[[], Told]]:
        """What a page that watches a view is told, as JSON's types; the first is opened where nobody chooses."""

    def head(self) -> Told:
        """What every view is told: `bus`, why it is `lost`, and what moves the machine (`motion`)."""

    def asked(self, question: dict[str, Any]) -> Asked:
        """Raises UserError for what is no question."""

    def files(self) -> list[Route]:
        """What can be fetched beside the pages."""
