"""One driven axis between motor torque and encoder: a typed record a part, and compiled code that acts by it each period."""

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.friction import FrictionLaw
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.emulator.dynamics.motor import Ripple

__all__ = ["AxisDynamics", "FrictionLaw", "Motion", "Ripple"]
