"""Intervals never shrink to nothing."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.identification.covariance import Covariance, hac_covariance
from drivetwin.identification.regressors import Design, Term


@pytest.mark.parametrize("rows", [100, 200, 800])
def test_variance_of_a_mean_is_positive_whatever_the_frequency_of_the_residual(rows: int) -> None:
    """A kernel that is cut off at some lag has a spectrum with negative lobes, which a sine finds."""
    column = np.ones((rows, 1))
    for frequency in np.linspace(0.05, 3.0, 120):
        ripple = np.sin(frequency * np.arange(rows) + 0.3)
        ripple -= ripple.mean()
        assert hac_covariance(_design(column, ripple), column, ripple).matrix[0, 0] > 0.0


def test_a_variance_that_is_not_positive_is_refused() -> None:
    with pytest.raises(UserError, match="no scatter to take an interval from"):
        Covariance(np.array([[-1e-9]]), 10.0).standard_error(0)
    with pytest.raises(UserError, match="no scatter"):
        Covariance(np.zeros((1, 1)), 10.0).p_value(1.0, 0)


def _design(matrix: np.ndarray, target: np.ndarray) -> Design:
    rows = np.arange(len(target))
    return Design(
        terms=(Term.OFFSET,),
        matrix=matrix,
        target=target,
        weight=np.ones(len(target)),
        piece=np.zeros(len(target), dtype=np.int64),
        seconds=np.asarray(rows * 0.01, dtype=np.float64),
        block=rows,
    )
