"""What is fed forward to the drives: nothing, the velocity, or the velocity and the torque."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import Enum

from controller.drive_node import DriveNode


class Stage(Enum):
    """A stage of the experiment (Zhao et al. 2016, Figs 5 to 7)."""

    NONE = "none"
    VELOCITY = "velocity"
    TORQUE = "velocity and torque"

    @property
    def velocity(self) -> bool:
        """Whether the velocity is fed forward."""
        return self is not Stage.NONE


@contextmanager
def velocity_fed_forward(drives: Sequence[DriveNode], on: bool) -> Iterator[None]:
    """Within the block every drive adds the speed of its own position demand to its velocity demand, or does not.

    On a ServoOne that is P375 at 100 % or 0 %; a drive that is sent a velocity offset (60B1h) has it at 0 and adds that. What
    was set before is set again afterwards. Raises UserError as `DriveNode.write`. A drive type without such a parameter is left
    as it is.
    """
    roles = [(drive, role) for drive in drives if (role := drive.role("velocity_feedforward")) is not None]
    before = [float(drive.read(role.index, role.subindex)) for drive, role in roles]
    for drive, role in roles:
        drive.write((1.0 if on and drive.velocity_offset is None else 0.0) / role.si_per_unit, role.index, role.subindex)
    try:
        yield
    finally:
        for (drive, role), raw in zip(roles, before, strict=True):
            drive.write(raw, role.index, role.subindex)
