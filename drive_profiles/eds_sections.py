"""EDS and DCF files as sections of keys and values (CiA 306-1, 4.2), read tolerantly."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

_HEADER = re.compile(r"\[([^\]]*)\]")
_COMMENT = re.compile(r"\s;.*$")

SHOWN = 8
"""How many of the places with the same fault a warning names."""


@dataclass
class Complaints:
    """What is wrong with a file and does not stop it from being used: one warning a kind, with its places."""

    path: Path
    _places: dict[str, list[str]] = field(default_factory=dict)

    def note(self, what: str, where: str) -> None:
        """Remember that `what`, whose {} stands for the places, is so at `where`."""
        self._places.setdefault(what, []).append(where)

    def tell(self) -> None:
        """Warn of all that was noted, and forget it."""
        for what, places in self._places.items():
            more = f" and {len(places) - SHOWN} more" if len(places) > SHOWN else ""
            logger.warning("%s: %s", self.path, what.format(", ".join(places[:SHOWN]) + more))
        self._places.clear()


@dataclass
class Section:
    """One section: its name as written, and its values by key in lower case."""

    name: str
    values: dict[str, str] = field(default_factory=dict)

    def get(self, key: str) -> str:
        """The value of a key, whatever its case; empty where it is missing or empty."""
        return self.values.get(key.lower(), "")


def read_sections(text: str, complaints: Complaints) -> dict[str, Section]:
    """Sections by name in lower case. Raises UserError where the text is no EDS at all."""
    sections: dict[str, Section] = {}
    current: Section | None = None
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip().strip("\x00\x1a")
        if not line or line[0] in ";#":
            continue
        header = _HEADER.match(line)
        if header:
            current = _open(sections, header.group(1).strip(), complaints)
            continue
        key, equals, value = line.partition("=")
        if current is None or not equals or not key.strip():
            complaints.note("line {} is neither [section] nor key=value; skipped", str(number))
            continue
        current.values[key.strip().lower()] = _COMMENT.sub("", f" {value}").strip()
    _refuse_foreign(complaints.path, text, sections)
    return sections


def _open(sections: dict[str, Section], name: str, complaints: Complaints) -> Section:
    if name.lower() in sections:
        complaints.note("{} stands there twice; the later values count", f"[{name}]")
    return sections.setdefault(name.lower(), Section(name))


def text_of(path: Path) -> str:
    """The text of an EDS or DCF. Raises UserError where the file cannot be read."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise UserError(f"{path} does not exist; expected the drive's EDS or DCF") from None
    except OSError as error:
        raise UserError(f"{path} cannot be read as an EDS or DCF: {error.strerror}; expected the drive's own file") from None
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _refuse_foreign(path: Path, text: str, sections: dict[str, Section]) -> None:
    if not {"fileinfo", "deviceinfo"} & set(sections) and not any(re.fullmatch("[0-9a-f]{4}", name) for name in sections):
        hint = "; it looks like XML: an XDD has to be exported as EDS" if text.lstrip().startswith("<") else ""
        raise UserError(
            f"{path} is not an EDS or DCF (CiA 306): expected sections such as [FileInfo], [DeviceInfo] and [1000], "
            f"found {', '.join(f'[{section.name}]' for section in list(sections.values())[:4]) or 'none'}{hint}"
        )
