"""Bit rates as people write them: 1M, 500k, 125k."""

from __future__ import annotations

import re

from drivetwin.foundation.errors import UserError

BIT_RATES = range(10_000, 1_000_001)
"""What CANopen runs at (CiA 301) [bit/s]."""

FACTORS = {"": 1, "k": 1_000, "M": 1_000_000}


def read_bit_rate(text: str) -> int:
    """A bit rate [bit/s] from what `--bit-rate` was given.

    Raises UserError for what is no bit rate of a classic CAN bus.
    """
    found = re.fullmatch(r"(\d+(?:\.\d+)?)([kM]?)", text)
    rate = round(float(found[1]) * FACTORS[found[2]]) if found else 0
    if rate not in BIT_RATES:
        raise UserError(f"--bit-rate {text} is not a bit rate of a classic CAN bus; write 1M, 500k, 250k or 125k (10k to 1M)")
    return rate
