"""`drivetwin` in this process: what a command line says and how it ends, without the start of a process."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable

import pytest
from processes import Ended

from drivetwin.cli import main

Command = Callable[..., Ended]
"""The fixture `command`: its arguments are words, or lines of words with blanks between them."""


def exit_status(*lines: object) -> int:
    """Run a command line to its end, with nobody at the keyboard."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["drivetwin", *(word for line in lines for word in str(line).split())])
        patch.setattr(sys, "stdin", io.StringIO())
        try:
            main()
        except SystemExit as ended:
            return int(ended.code or 0)
    return 0
