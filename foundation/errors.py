"""The errors meant for the person at the bench: what was expected, what came, where, and what to do."""

from typing import ClassVar

LONGEST = 1500
"""Characters of a message; of a longer one the middle is left out, for it ends with what to do."""


def one_line(message: str) -> str:
    """`message` as one line that a terminal shows as it is: no control characters, no lone surrogates, not too long."""
    shown = " ".join(message.split())
    if len(shown) > LONGEST:
        shown = f"{shown[: LONGEST - 505]} ... {shown[-500:]}"
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode("ascii") for each in shown)


class UserError(Exception):
    """An input or a bus that cannot be used as it is.

    The command line prints the message as one line on stderr and exits with `exit_status`.
    """

    exit_status: ClassVar[int] = 2

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class InterruptedByUserError(UserError):
    """Ctrl-C or SIGTERM, after the machine has been stopped; the shell's status for it."""

    exit_status = 130
