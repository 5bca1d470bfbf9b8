"""canopen's object dictionary of a drive type, from the drive type's data."""

from __future__ import annotations

import canopen
from canopen import objectdictionary as od

from drivetwin.drive_profiles import DriveProfile, ObjectEntry


def object_dictionary(profile: DriveProfile) -> canopen.ObjectDictionary:
    """What canopen needs to know of a drive to talk to it by SDO and to map its PDOs."""
    dictionary = canopen.ObjectDictionary()
    records: dict[int, list[ObjectEntry]] = {}
    for entry in profile.objects:
        records.setdefault(entry.index, []).append(entry)
    for index, entries in records.items():
        if len(entries) == 1 and entries[0].subindex == 0:
            dictionary.add_object(_variable(entries[0]))
            continue
        record = od.ODRecord(entries[0].name.partition(".")[0], index)
        for entry in entries:
            record.add_member(_variable(entry))
        dictionary.add_object(record)
    return dictionary


def _variable(entry: ObjectEntry) -> od.ODVariable:
    variable = od.ODVariable(entry.name.rpartition(".")[2], entry.index, entry.subindex)
    variable.data_type = int(entry.data_type)
    variable.access_type = entry.access.value
    variable.pdo_mappable = entry.rpdo or entry.tpdo
    return variable
