"""Mistakes a node that boots with another node-ID for the one that it has lost, and continues with it."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller import recovery
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.node_changes_id", "no_stranger")


@instead_of(recovery, "_await")
def break_controller(wait: Original, cycle: Cycle, lost: Sequence[DriveNode]) -> None:
    link = cycle._link
    known = [drive.node_id for drive in cycle._drives]
    strangers = [node for node in link.scanner.nodes if node not in known]
    for drive, stranger in zip(lost, strangers, strict=False):
        axis = drive.axis.model_copy(update={"node_id": stranger})
        vars(drive).update(vars(DriveNode(link, drive.name, axis, drive.profile)))
    wait(cycle, lost)
