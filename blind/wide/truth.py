"""What an axis truly is: one record of numbers an axis, which compiled code reads and effects change."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

LUGRE, GMS, DAHL, MAXWELL, COULOMB = range(5)
LAWS = ("lugre", "gms", "dahl", "maxwell_slip", "coulomb")
"""Names of the friction laws, by their number."""

CASCADE, PI_P, PID, TORQUE = range(4)
DRIVES = ("cascade", "pi_p", "pid", "torque")
"""Names of the drives' laws, by their number: with feed-forward, without, one PID on position, torque told from outside."""

NO_FOREIGN, COUNTERBALANCE, SLOSH, TETHER, WANDERING_COGGING, EDDY_BRAKE, SOFT_STOP = range(7)
"""What acts from outside the library by the axis's state; what acts by time alone comes as series."""

NEVER = 1e12
"""Of a limit [N·m or N]."""

_REALS = (
    # friction; `stiffness` before it slides, `micro_damping` of what sticks
    *("coulomb", "viscous", "asymmetry", "viscous_asymmetry", "static", "stribeck_velocity", "exponent"),
    *("quadratic", "cubic", "load_coefficient", "wave", "wave_period", "wave_phase", "cold", "warming_time"),
    *("stiffness", "micro_damping", "dahl_exponent", "attraction"),
    # rigid body
    *("moment", "moment_angle", "spring", "spring_rest", "shared_inertia", "shared_ratio"),
    # transmission: motor inertia on the joint's side, springs in series, share of friction before them, error of the ratio
    *("rotor", "gear_ratio", "elasticity", "elasticity_damping", "gap", "flank", "flank_damping", "motor_friction"),
    *("error_amplitude", "error_order", "error_phase"),
    # motor
    *("constant_error", "saturates_at", "offset"),
    *("ripple", "ripple_order", "ripple_phase", "ripple_2", "ripple_2_order", "ripple_2_phase"),
    *("torque_limit", "current_lag"),
    # encoder
    *("eccentricity", "eccentricity_phase", "delay", "quantum"),
    # drive
    *("position_gain", "velocity_gain", "integral_gain", "velocity_feedforward", "inertia_feedforward", "drive_limit"),
    "velocity_lag",
    # foreign
    *("foreign_1", "foreign_2", "foreign_3"),
)
_WHOLES = ("law", "slide", "shared_with", "drive", "foreign")

AXIS = np.dtype([*((name, np.float64) for name in _REALS), *((name, np.int64) for name in _WHOLES)])
"""One axis."""

Axes = NDArray[Any]
"""Records (n,) of `AXIS`."""


class Record(Protocol):
    """One record of `AXIS`, as compiled code reads it."""

    def __getattr__(self, name: str) -> float:
        """A field."""
        ...


def blank(count: int) -> Axes:
    """`count` axes without any effect; numbers that divide are 1, limits far away."""
    axes = np.zeros(count, AXIS)
    for name in ("stribeck_velocity", "wave_period", "warming_time", "exponent", "dahl_exponent", "gear_ratio"):
        axes[name] = 1.0
    for name in ("torque_limit", "drive_limit", "saturates_at"):
        axes[name] = NEVER
    axes["shared_with"] = -1
    return axes
