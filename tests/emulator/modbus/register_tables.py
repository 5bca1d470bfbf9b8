"""The register tables of docs/modbus.md, made from the data. Run this file to renew them."""

from __future__ import annotations

from pathlib import Path

from drivetwin.drive_profiles import Access, available_profiles
from drivetwin.drive_profiles.modbus_map import Register, load_modbus_map

DOCS = Path(__file__).parents[3] / "docs" / "modbus.md"

BEGIN, END = "<!-- registers of {} -->", "<!-- end of {} -->"

TYPES = {"R32": "float32"}
ACCESS = {Access.RW: "read, write", Access.WO: "write"}


def table(name: str) -> str:
    """Markdown table of a drive type's registers."""
    rows = "\n".join(_row(register) for register in load_modbus_map(name).registers)
    return f"| address | object | name | type | access |\n| --- | --- | --- | --- | --- |\n{rows}"


def documented(text: str, name: str) -> str:
    """What the documentation has between the marks of a drive type."""
    return text.partition(BEGIN.format(name))[2].partition(END.format(name))[0].strip()


def renewed(text: str, name: str) -> str:
    """The documentation with that table renewed."""
    begin, end = BEGIN.format(name), END.format(name)
    if begin not in text:
        return text
    return f"{text.partition(begin)[0]}{begin}\n{table(name)}\n{end}{text.partition(end)[2]}"


def _row(register: Register) -> str:
    entry = register.entry
    first, last = register.address, register.address + register.count - 1
    address = f"{first:04X}h" if first == last else f"{first:04X}h, {last:04X}h"
    place = f"{entry.index:04X}h" + (f":{entry.subindex:02X}" if entry.subindex else "")
    data_type = TYPES.get(entry.data_type.name, entry.data_type.name)
    return f"| {address} | {place} | {entry.name.replace('.', ', ')} | {data_type} | {ACCESS.get(entry.access, 'read')} |"


if __name__ == "__main__":
    content = DOCS.read_text(encoding="utf-8")
    for drive_type in available_profiles():
        content = renewed(content, drive_type)
    DOCS.write_text(content, encoding="utf-8")
