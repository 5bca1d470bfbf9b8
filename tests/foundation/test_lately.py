"""What is kept of what was made lately."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.foundation.lately import Lately, OfSame


def test_only_what_was_asked_for_last_is_kept() -> None:
    lately: Lately[str, float] = Lately()
    made: list[str] = []

    def asked(name: str) -> float:
        def value() -> float:
            made.append(name)
            return float(len(made))

        return lately.get(name, value, 2)

    assert [asked(name) for name in ("a", "b", "a", "c", "a", "b")] == [1.0, 2.0, 1.0, 3.0, 1.0, 4.0]
    assert made == ["a", "b", "c", "b"]


def test_what_could_not_be_made_is_asked_for_again() -> None:
    lately: Lately[str, float] = Lately()

    def fails() -> float:
        raise ValueError("nothing can follow it")

    with pytest.raises(ValueError, match="nothing can follow it"):
        lately.get("a", fails, 2)
    assert lately.get("a", lambda: 1.0, 2) == 1.0


def test_what_was_made_of_the_same_objects_is_not_made_again() -> None:
    rows, other, made = np.zeros(3), np.zeros(3), OfSame()
    first = made.get((rows, 1), lambda: rows + 1.0, 2)
    assert made.get((rows, 1), lambda: rows + 2.0, 2) is first
    assert made.get((other, 1), lambda: other + 2.0, 2)[0] == 2.0, "equal, and not the same"
    made.get((rows, 2), lambda: rows, 2)
    assert made.get((rows, 1), lambda: rows + 3.0, 2)[0] == 3.0, "only the last are kept"
