"""The interface by which a procedure reports its progress."""

from __future__ import annotations


class Progress:
    """What the procedures tell; this one is silent."""

    def phase(self, name: str, seconds: float) -> None:
        """A phase of about `seconds` of motion begins."""

    def advance(self, seconds: float) -> None:
        """So much of it is done."""
