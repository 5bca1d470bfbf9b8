"""The one error meant for the person at the bench: what was expected, what came, where, and what to do."""


class UserError(Exception):
    """An input or a bus that cannot be used as it is.

    The command line prints the message as one line on stderr and exits with 2.
    """

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))
