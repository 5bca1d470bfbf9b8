"""A broken controller as a program: `python -m drivetwin.mutants NAME TASK_FILE --bus BUS --out DIR`."""

from __future__ import annotations

import sys

from drivetwin.controller.__main__ import main as control
from drivetwin.foundation.errors import UserError
from drivetwin.mutants.library import mutant


def main() -> None:
    """Break the controller as the first argument says, and let it do what the others say."""
    name = sys.argv.pop(1) if len(sys.argv) > 1 else ""
    try:
        broken = mutant(name)
    except UserError as error:
        print(f"mutants: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
    broken.break_controller()
    control()


if __name__ == "__main__":
    main()
