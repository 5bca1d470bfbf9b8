"""What the diagnosing process may look at: not the code that draws the truth, and no other process."""

from __future__ import annotations

import os
import re
import sys
from typing import NoReturn

_TRUTH = re.compile(r"(drivetwin\.)?(blind|controller)(\.|$)")
_OF_A_PROCESS = re.compile(r"/proc/(\d+)(/|$)")


def restrict_sight() -> None:
    """From now on, Python code of this process cannot import what draws the truth, nor open files of another process in /proc.

    By an audit hook (PEP 578), which cannot be taken off again. What is loaded already stays usable.
    """
    sys.addaudithook(_audit)


def _audit(event: str, arguments: tuple[object, ...]) -> None:
    if event == "import" and _TRUTH.match(str(arguments[0])):
        _refuse(f"import of {arguments[0]}")
    if event in {"open", "os.listdir", "os.scandir"} and isinstance(arguments[0], str | bytes):
        process = _OF_A_PROCESS.match(os.fsdecode(arguments[0]))
        if process and int(process[1]) != os.getpid():
            _refuse(f"reading {os.fsdecode(arguments[0])}")


def _refuse(what: str) -> NoReturn:
    raise PermissionError(f"{what}: the truth of a blind test is withheld from the process that diagnoses")
