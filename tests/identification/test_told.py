"""Which columns of a regression are told from all others: directions whose angle is known."""

from __future__ import annotations

from itertools import permutations
from math import asin, cos, sin

import numpy as np
import pytest

from drivetwin.identification.least_squares import identifiable, told
from drivetwin.identification.regressors import Design

LIMIT = asin(0.02)
"""The angle between two columns at which each keeps 2 % of its norm beside the other [rad]."""


def design(angle: float, order: tuple[str, ...] = ("one", "near", "apart", "none")) -> Design:
    """`near` is turned from `one` by an angle, `apart` stands square to both, `none` is zero; units far from each other."""
    random = np.random.default_rng(0)
    square, _ = np.linalg.qr(random.standard_normal((200, 3)))
    weight = random.uniform(0.5, 2.0, 200)
    columns = {
        "one": 1e3 * square[:, 0],
        "near": 1e-3 * (cos(angle) * square[:, 0] + sin(angle) * square[:, 1]),
        "apart": square[:, 2],
        "none": np.zeros(200),
    }
    matrix = np.column_stack([columns[term] for term in order]) / np.sqrt(weight)[:, None]
    count = np.zeros(200, dtype=np.int64)
    return Design(order, matrix, np.zeros(200), weight, count, np.arange(200.0), count)


@pytest.mark.parametrize("order", list(permutations(("one", "near", "apart", "none"))))
def test_of_a_pair_that_is_alike_neither_is_told_in_any_order(order: tuple[str, ...]) -> None:
    assert told(design(0.0, order)) == ("apart",)
    assert told(design(0.99 * LIMIT, order)) == ("apart",)
    assert set(told(design(1.01 * LIMIT, order))) == {"one", "near", "apart"}


def test_first_come_first_served_keeps_one_of_them() -> None:
    assert identifiable(design(0.0)) == ("one", "apart")
