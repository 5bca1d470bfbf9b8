"""What is compiled on a first call says nothing to whoever made the call."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
import numba
import drivetwin.foundation.compiled

def total(several, x):
    found = 0.0
    for one in several:
        found += one(x)
    return found

ways = tuple(numba.njit("f8(f8)")(way) for way in (lambda x: x + 1.0, lambda x: x - 1.0))
print(numba.njit(cache=False)(total)(ways, 1.0))
"""


def test_functions_handed_to_a_compiled_one_are_no_warning() -> None:
    """Numba calls that experimental, in four lines, whenever nothing is in its cache."""
    told = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    assert (told.stdout.strip(), told.stderr) == ("2.0", "")
