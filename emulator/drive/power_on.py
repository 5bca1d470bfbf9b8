"""The dictionary at power-on: the profile's values, and those that follow from the axis that the drive controls."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.drive_profiles import DriveProfile
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.drive import motion_defaults, objects
from drivetwin.emulator.machine import Axis, available_machines, load_machine


def commissioned_dictionary(profile: DriveProfile, axis: Axis) -> ObjectDictionary:
    """The dictionary of a drive of that type as it leaves the factory for an axis."""
    dictionary = ObjectDictionary.from_profile(profile, axis.node_id)
    objects.commission(dictionary, profile, axis)
    motion_defaults.commission(dictionary, axis)
    return dictionary


def commissioned(profile: DriveProfile, axis: Axis) -> DriveProfile:
    """The drive type with the values of power-on of the drive of one axis."""
    decided = {(variable.index, variable.subindex): variable.default for variable in _decided(profile, axis)}
    entries = (replace(entry, default=decided.get((entry.index, entry.subindex), entry.default)) for entry in profile.objects)
    return replace(profile, objects=tuple(entries))


def undecided(profile: DriveProfile) -> DriveProfile:
    """The drive type without the values that depend on the axis."""
    axes = [axis for machine in available_machines() for axis in load_machine(machine).axes.values()]
    decided = {(variable.index, variable.subindex) for axis in axes for variable in _decided(profile, axis)}
    entries = (replace(entry, default=None) if (entry.index, entry.subindex) in decided else entry for entry in profile.objects)
    return replace(profile, objects=tuple(entries))


def _decided(profile: DriveProfile, axis: Axis) -> list[Variable]:
    """The variables whose value at power-on is not the profile's."""
    plain = ObjectDictionary.from_profile(profile, axis.node_id)
    return [
        variable
        for variable in commissioned_dictionary(profile, axis)
        if variable.default != plain[variable.index, variable.subindex].default
    ]
