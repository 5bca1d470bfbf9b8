"""Quantities for a reader: the unit fits the size, the digits fit the interval, and the value stays what it is."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.foundation.quantities import decimals_for, quantity, scale_of, with_interval

UNITS = ("N·m", "N", "m", "rad", "m/s", "rad/s", "s", "kg", "kg·m²", "N·m·s/rad", "N·s/m")
IN_SI = {"m": 1e-3, "µ": 1e-6}


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.00231, "N·m", "mN·m"),
        (-0.00231, "N·m", "mN·m"),
        (2.31, "N·m", "N·m"),
        (2e-6, "N·m", "µN·m"),
        (0.0061, "m/s", "mm/s"),
        (0.0003, "kg·m²", "kg·cm²"),
        (0.0, "N·m", "N·m"),
        (2.0, "1", ""),
        (0.0004, "furlong", "furlong"),
    ],
)
def test_the_unit_fits_the_size(value: float, unit: str, shown: str) -> None:
    assert scale_of(unit, value).unit == shown


@given(st.floats(1e-5, 1e6), st.sampled_from(UNITS))
def test_no_digit_is_hidden_behind_zeros(value: float, unit: str) -> None:
    scale = scale_of(unit, value)
    assert scale.factor * value >= 0.1 or scale.factor == max(1e3, scale.factor)


@given(st.floats(1e-3, 1e4), st.floats(1e-4, 0.5))
def test_the_text_is_the_value_to_a_tenth_of_its_interval(value: float, share: float) -> None:
    half = value * share
    (shown, low, high), unit = with_interval(value, (value - half, value + half), "N·m")
    factor = {"N·m": 1.0, "mN·m": 1e-3, "µN·m": 1e-6}[unit]
    for text, true in ((shown, value), (low, value - half), (high, value + half)):
        assert float(text) * factor == pytest.approx(true, abs=0.1 * half)


def test_two_digits_of_the_interval_are_shown() -> None:
    assert with_interval(28.32812, (28.2634, 28.3928), "kg", 28.3041) == (["28.328", "28.263", "28.393", "28.304"], "kg")
    assert decimals_for(0.0, 123.456) == 2
    assert decimals_for(50.0, 1000.0) == 0


@pytest.mark.parametrize(
    ("value", "unit", "digits", "shown"),
    [
        (0.00201, "m", 3, "2.01 mm"),
        (8.3e-6, "m", 3, "8.3 µm"),
        (0.010796, "m/s", 4, "10.8 mm/s"),
        (123456.0, "N", 3, "123000 N"),
        (0.25, "1", 4, "0.25"),
        (0.0, "m", 4, "0 m"),
    ],
)
def test_a_quantity_is_written_with_its_unit(value: float, unit: str, digits: int, shown: str) -> None:
    assert quantity(value, unit, digits) == shown
