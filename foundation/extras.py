"""Libraries that few commands need come with an extra of the package; if one is missing, the error names its extra."""

from __future__ import annotations

from drivetwin.foundation.errors import UserError

EXTRA_OF = {"distributed": "fleet", "mcap": "formats", "starlette": "panel", "uvicorn": "panel", "websockets": "panel"}
"""The extra that brings a library, by the module that is imported."""


def missing_extra(error: ModuleNotFoundError) -> UserError | None:
    """The error for the user where a library of an extra is missing; None where another module is."""
    module = (error.name or "").partition(".")[0]
    if module not in EXTRA_OF:
        return None
    extra = EXTRA_OF[module]
    return UserError(f"this command needs {module}, which is not installed: pip install 'drivetwin[{extra}]'")
