"""All foreign formats, one file each in this folder and those of packages; and which of them fits a file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.plugins import Plugins
from drivetwin.recording.formats.base import ImportFormat
from drivetwin.recording.import_map import ImportMap


def _flaw(kind: type[ImportFormat]) -> str | None:
    endings = getattr(kind, "endings", ())
    if isinstance(endings, tuple) and all(isinstance(one, str) and one[:1] == "." and one == one.lower() for one in endings):
        return None
    return f"endings: {endings!r}; expected a tuple of endings in lower case, each with its dot"


FORMATS: Plugins[ImportFormat] = Plugins(
    "format", ImportFormat, "drivetwin.recording.formats", "drivetwin.formats", "docs/import.md", flaw=_flaw
)


@cache
def formats() -> Mapping[str, type[ImportFormat]]:
    """Every format by its name."""
    return FORMATS.found()


def format_of(file: Path, import_map: ImportMap) -> ImportFormat:
    """The format that the map says, else one that recognises the file, else the one whose files end as this one does.

    Raises UserError for a format that is unknown, and for an ending that none has, or several have.
    """
    named = ", ".join(formats())
    if import_map.format is not None:
        if import_map.format not in formats():
            raise UserError(f"{import_map.path}: format: {import_map.format!r} is unknown; there are {named}")
        return formats()[import_map.format]()
    ending = file.suffix.lower()
    told = {kind: kind.recognises(file) for kind in formats().values() if ending in kind.endings}
    found = [kind for kind, told_so in told.items() if told_so] or [kind for kind, told_so in told.items() if told_so is None]
    if len(found) == 1:
        return found[0]()
    what = ending or "a file without an ending"
    if found:
        several = ", ".join(kind.name for kind in found)
        raise UserError(f"{file}: {what} may be {several}; say one of them as `format:` in the map")
    raise UserError(f"{file}: what {what} holds is not known; say `format:` in the map, one of {named}")
