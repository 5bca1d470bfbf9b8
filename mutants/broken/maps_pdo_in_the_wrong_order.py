"""Maps the torque offset before the set-point, but packs its frames in the opposite order."""

from __future__ import annotations

import canopen

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("01_boot.configured", "pdo_mapping")


@instead_of(DriveNode, "_map")
def break_controller(
    map_pdo: Original, self: DriveNode, pdo: canopen.pdo.base.PdoMap, objects: list[tuple[int, int]], kind: int
) -> None:
    map_pdo(self, pdo, [objects[0], *objects[:0:-1]], kind)
