"""bode.json: what commissioning found, and the proposed gains as the drive's own objects take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from drivetwin.controller.commissioning import Attempt
from drivetwin.controller.drive_node import DriveNode, place
from drivetwin.controller.session import Session
from drivetwin.foundation.files import provenance
from drivetwin.identification.frequency.cascade import Cascade
from drivetwin.identification.frequency.result import AxisResponse
from drivetwin.identification.frequency.wording import rows

SCHEMA = "bode/1"


def responses_to_json(attempts: Sequence[Attempt], session: Session, seed: int) -> dict[str, Any]:
    """The whole file; `objects` of an axis are the proposed gains in its drive's units, `summary` is what a person reads.

    `failed` says why an axis is not among the others.
    """
    drives = {drive.name: drive for drive in session.drives}
    machine = session.machine
    return {
        "schema": SCHEMA,
        "machine": machine.machine,
        **provenance(seed, [machine.model_path, machine.axes_path]),
        "axes": {each.axis: _axis(each.found, drives[each.axis]) for each in attempts if each.found is not None},
        "failed": {each.axis: each.failure for each in attempts if each.found is None},
    }


def _axis(found: AxisResponse, drive: DriveNode) -> dict[str, Any]:
    return {**found.to_json(), "objects": _objects(found, drive), "summary": [asdict(row) for row in rows(found)]}


def _objects(found: AxisResponse, drive: DriveNode) -> list[dict[str, Any]]:
    """Object, unit, present and proposed raw value of each gain that the drive type keeps."""
    if found.proposal is None:
        return []
    now, proposed = _motor_side(found.bode.cascade, drive), _motor_side(found.proposal.cascade, drive)
    objects = []
    for name in now:
        role = drive.role(name)
        if role is not None:
            raw = {"now": now[name] / role.si_per_unit, "proposed": proposed[name] / role.si_per_unit}
            objects.append({"quantity": name, "object": place(role.index, role.subindex), "unit": role.unit, **raw})
    return objects


def _motor_side(cascade: Cascade, drive: DriveNode) -> dict[str, float]:
    """SI values as `Role` has them; an integral time of 0 is a P loop."""
    return {
        "position_gain": cascade.position_gain,
        "velocity_gain": cascade.velocity_gain / drive.axis.gear_ratio**2,
        "integral_time": cascade.integral_time or 0.0,
    }
