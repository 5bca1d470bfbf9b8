"""How a diagnosis says what it does, and how far it is (0 to 1)."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
