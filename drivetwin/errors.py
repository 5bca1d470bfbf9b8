"""The errors meant for the person at the bench: what was expected, what came, where, and what to do."""

from typing import ClassVar


class UserError(Exception):
    """An input or a bus that cannot be used as it is.

    The command line prints the message as one line on stderr and exits with `exit_status`.
    """

    exit_status: ClassVar[int] = 2

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


class InterruptedByUserError(UserError):
    """Ctrl-C or SIGTERM, after the machine has been stopped; the shell's status for it."""

    exit_status = 130
