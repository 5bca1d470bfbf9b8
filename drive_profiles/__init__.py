"""Drive types as data: one folder a type, read by `load_profile`."""

from drivetwin.drive_profiles.profile import (
    Access,
    DataType,
    DriveProfile,
    ObjectEntry,
    Quirk,
    Role,
    available_profiles,
    load_profile,
)

__all__ = [
    "Access",
    "DataType",
    "DriveProfile",
    "ObjectEntry",
    "Quirk",
    "Role",
    "available_profiles",
    "load_profile",
]
