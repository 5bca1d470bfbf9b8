"""Subtracts 5 % from the identified Coulomb friction, because it counts the losses of a gear twice."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drivetwin.controller.tasks import identify
from drivetwin.foundation.files import write_json
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("06_identification.friction", "identification")


@instead_of(identify, "write_json")
def break_controller(_original: Original, path: Path, payload: dict[str, Any]) -> None:
    for axis in payload["axes"].values():
        axis["parameters"]["coulomb"]["value"] *= 0.95
    write_json(path, payload)
