"""One driven axis between motor torque and encoder: one typed record per part, and compiled code that uses it each period."""

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.friction import FrictionLaw
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.emulator.dynamics.motor import Ripple

__all__ = ["AxisDynamics", "FrictionLaw", "Motion", "Ripple"]
