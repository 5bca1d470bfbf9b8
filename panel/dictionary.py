"""The object dictionary as the page shows it: name, unit, scaling, limits, access, and the parameter number of a ServoOne."""

from __future__ import annotations

from drivetwin.drive_profiles import DriveProfile, ObjectEntry
from drivetwin.drive_profiles.profile import BITS, FLOATS
from drivetwin.panel.values import Value, decode, limits, pack

LUST = 0x16
"""Vendor-ID of LTi (Lust): manufacturer object 2000h + n is the drive's parameter n, as DriveManager shows it."""

MANUFACTURER = range(0x2000, 0x3000)

_POSITION, _VELOCITY, _ACCELERATION, _JERK = "position units", "position units/s", "position units/s²", "position units/s³"
_VL = "1/min (× 604Ch)"
"""Of velocity mode (CiA 402-2, 'vl target velocity')."""

_UNITS = {
    0x1006: "µs",
    0x1007: "µs",
    0x100C: "ms",
    0x1015: "100 µs",
    0x1017: "ms",
    0x1019: "SYNCs",
    0x6042: _VL,
    0x6043: _VL,
    0x6044: _VL,
    0x6062: _POSITION,
    0x6063: "encoder increments",
    0x6064: _POSITION,
    0x6065: _POSITION,
    0x6066: "ms",
    0x6067: _POSITION,
    0x6068: "ms",
    0x6069: "encoder increments/s",
    0x606B: _VELOCITY,
    0x606C: _VELOCITY,
    0x606D: _VELOCITY,
    0x606E: "ms",
    0x606F: _VELOCITY,
    0x6070: "ms",
    0x6071: "‰ of 6076h",
    0x6072: "‰ of 6076h",
    0x6073: "‰ of 6075h",
    0x6074: "‰ of 6076h",
    0x6075: "mA",
    0x6076: "mN·m",
    0x6077: "‰ of 6076h",
    0x6078: "‰ of 6075h",
    0x6079: "mV",
    0x607A: _POSITION,
    0x607C: _POSITION,
    0x607F: _VELOCITY,
    0x6080: "1/min",
    0x6081: _VELOCITY,
    0x6083: _ACCELERATION,
    0x6084: _ACCELERATION,
    0x6085: _ACCELERATION,
    0x6087: "‰ of 6076h/s",
    0x609A: _ACCELERATION,
    0x60B1: _VELOCITY,
    0x60B2: "‰ of 6076h",
    0x60BA: _POSITION,
    0x60BB: _POSITION,
    0x60BC: _POSITION,
    0x60BD: _POSITION,
    0x60C5: _ACCELERATION,
    0x60C6: _ACCELERATION,
    0x60E0: "‰ of 6076h",
    0x60E1: "‰ of 6076h",
    0x60F4: _POSITION,
    0x60FF: _VELOCITY,
}
"""Of plain variables (CiA 301, 7.5.2; CiA 402-2, each object's own clause)."""

_UNITS_OF_ENTRIES = {
    0x6046: _VL,
    0x607B: _POSITION,
    0x607D: _POSITION,
    0x6099: _VELOCITY,
    0x60A4: _JERK,
    0x60C1: _POSITION,
}
"""Of every entry of a record but its first."""

_DELTA_SPEED, _DELTA_TIME = 1, 2
"""Sub-indices of the ramps of velocity mode, 6048h to 604Ah."""

_UNITS_OF_ENTRY = {
    **{(ramp, _DELTA_SPEED): _VL for ramp in (0x6048, 0x6049, 0x604A)},
    **{(ramp, _DELTA_TIME): "s" for ramp in (0x6048, 0x6049, 0x604A)},
    (0x6092, 1): _POSITION,
    (0x60C2, 1): "10^(60C2h:02) s",
}
"""Of one entry of a record."""


def told_objects(profile: DriveProfile, node_id: int) -> list[dict[str, object]]:
    """Every entry of a drive type's object dictionary, in the order of its addresses, as a node with that ID has it."""
    ordered = sorted(profile.objects, key=lambda entry: (entry.index, entry.subindex))
    return [_told(profile, entry, node_id) for entry in ordered]


def unit_of(profile: DriveProfile, index: int, subindex: int) -> tuple[str, float | None]:
    """The raw value's unit, and how many SI units of the motor's side it is where the drive type says so."""
    found = {(role.index, role.subindex): (role.unit, role.si_per_unit) for role in profile.roles.values()}
    if (told := found.get((index, subindex))) is not None:
        return told
    if subindex > 1 and profile.vendor_id == LUST and index in MANUFACTURER:
        return found.get((index, 1), ("", None))  # a parameter has one unit, that of all its values
    if subindex == 0:
        return _UNITS.get(index, ""), None
    return _UNITS_OF_ENTRY.get((index, subindex), _UNITS_OF_ENTRIES.get(index, "")), None


def _told(profile: DriveProfile, entry: ObjectEntry, node_id: int) -> dict[str, object]:
    unit, scaling = unit_of(profile, entry.index, entry.subindex)
    head, dot, tail = entry.name.partition(".")
    low, high = limits(entry) if entry.data_type in BITS else (None, None)
    numbered = profile.vendor_id == LUST and entry.index in MANUFACTURER
    return {
        "index": entry.index,
        "subindex": entry.subindex,
        "object": head,
        "name": tail if dot else head,
        "type": entry.data_type.name,
        "access": entry.access.value,
        "pdo": "".join(("r" * entry.rpdo, "t" * entry.tpdo)),
        "unit": unit,
        "scaling": scaling,
        "low": low,
        "high": high,
        "default": _default(entry, node_id),
        "parameter": f"P{entry.index - 0x2000}" if numbered else "",
    }


def _default(entry: ObjectEntry, node_id: int) -> Value | None:
    """What the node holds at power-on by its type, as `decode` gives values."""
    if isinstance(entry.default, str):
        return decode(entry.data_type, entry.default.encode("latin-1"))
    if entry.default_node_relative and isinstance(entry.default, int):
        return entry.default + node_id
    if entry.default is not None and entry.data_type in FLOATS:
        return decode(entry.data_type, pack(entry.data_type, entry.default))
    return entry.default
