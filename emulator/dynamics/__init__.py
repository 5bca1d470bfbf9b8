"""One driven axis between motor torque and encoder: a typed record a part, and compiled code that acts by it each period."""

from emulator.dynamics.axis import AxisDynamics
from emulator.dynamics.friction import FrictionLaw
from emulator.dynamics.motion import Motion
from emulator.dynamics.motor import Ripple

__all__ = ["AxisDynamics", "FrictionLaw", "Motion", "Ripple"]
