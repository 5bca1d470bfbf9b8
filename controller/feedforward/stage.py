"""What is fed forward to the drives: nothing, velocity, or velocity and torque."""

from __future__ import annotations

from enum import Enum

from drivetwin.controller.session import Session


class Stage(Enum):
    """A stage of the experiment (Zhao et al. 2016, Figs 5 to 7)."""

    NONE = "none"
    VELOCITY = "velocity"
    TORQUE = "velocity and torque"

    @property
    def velocity(self) -> bool:
        """Whether the velocity is fed forward."""
        return self is not Stage.NONE


def feed_velocity(session: Session, on: bool) -> None:
    """From now on every drive adds the speed of its own position demand to its velocity demand, or does not.

    On a ServoOne that is P375 at 100 % or 0 %; a drive that is sent a velocity offset (60B1h) has it at 0 and adds that. The
    session puts back what was set before. Raises UserError as `Session.set_parameter`.
    """
    own = on and not any(drive.takes_velocity_offset for drive in session.drives)
    session.set_parameter("velocity_feedforward", 1.0 if own else 0.0)
