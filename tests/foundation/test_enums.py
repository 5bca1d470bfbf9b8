"""An enumeration that is quick to ask stays an enumeration."""

from __future__ import annotations

import pickle
from enum import IntEnum

import pytest

from drivetwin.foundation.enums import quick


@quick
class Level(IntEnum):
    """Two of them."""

    LOW = 1
    HIGH = 2


def test_its_members_are_attributes_of_the_class_itself() -> None:
    assert vars(Level)["LOW"] is Level.LOW is Level(1) is Level["LOW"]


def test_it_is_walked_compared_and_carried_as_any_other() -> None:
    assert list(Level) == [Level.LOW, Level.HIGH]
    assert Level.LOW < Level.HIGH
    assert pickle.loads(pickle.dumps(Level.HIGH)) is Level.HIGH


def test_its_members_stay_what_they_are() -> None:
    with pytest.raises(AttributeError, match="cannot reassign"):
        Level.LOW = 3  # type: ignore[misc]
