"""A wafer rests on the blade's pads by its weight alone: how close a motion comes to making it slip."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, degrees, pi, sqrt, tan

import numpy as np

from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.controller.trajectory import Positions
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import MotionLimits
from wafer_handler.scara.dynamics import GRAVITY
from wafer_handler.scara.geometry import Geometry
from wafer_handler.scara.tool_motion import tool_acceleration


@dataclass(frozen=True)
class Wafer:
    """A wafer centred on the tool point, on `pads` pads evenly spread on a circle, the first towards the blade's tip.

    `radius` and `pad_radius` [m]; `friction` is the coefficient of static friction on the pads, and 0.2 an assumption, not a
    measurement; `tilt` [rad] is how far the blade may lean, any way. Its mass does not matter.
    Raises UserError where there are fewer than three pads, or where the wafer would slide off a blade at rest.
    """

    radius: float = 0.150
    pad_radius: float = 0.100
    pads: int = 3
    friction: float = 0.2
    tilt: float = 0.0

    def __post_init__(self) -> None:
        if self.pads < 3:
            raise UserError(f"a wafer rests on three pads or more; this blade has {self.pads}")
        if self.tilt >= atan(self.friction):
            raise UserError(
                f"a blade tilted by {degrees(self.tilt):.3g} deg does not hold a wafer with a coefficient of friction of "
                f"{self.friction:g}: it slides from {degrees(atan(self.friction)):.3g} deg on"
            )

    @property
    def level_friction(self) -> float:
        """The coefficient of friction that on a level blade is worth what `friction` is on one that leans the worst way.

        |a| cos b + (g + a_z) sin b <= mu ((g + a_z) cos b - |a| sin b) is |a| <= tan(atan mu - b) (g + a_z).
        """
        return tan(atan(self.friction) - self.tilt)


@dataclass(frozen=True)
class BladeMotion:
    """How the blade under a wafer moves: the tool point's acceleration (n, 3) [m/s²], the blade's direction (n,) [rad], and the
    acceleration of its turning (n,) [rad/s²]."""

    acceleration: Rows
    yaw: Positions
    turning: Positions


def blade_motion(geometry: Geometry, path: JointPath) -> BladeMotion:
    """What the blade does on a path of the joints (n, 3)."""
    return BladeMotion(tool_acceleration(geometry, path), path.position[:, 1] + 0.5 * pi, path.acceleration[:, 1])


def slip_margin(wafer: Wafer, motion: BladeMotion) -> Positions:
    """Friction that the pads give over friction that the motion takes (n,): below 1 the wafer may slip; infinite at rest.

    |a| <= mu (g + a_z) of the wafer's centre (for a_z = 0: Lucas, US patent 5,655,060, 1997), and each pad carries its share of
    turning the wafer besides; the worst pad counts. While no pad has to give more than it can, the wafer stays (static theorem
    of limit analysis). Below 1 it slides where it is not turned, and may still stay where it is. The 0.2 % of its weight that a
    thin wafer shifts from pad to pad is left out.
    """
    taken = _taken(wafer, motion)
    given = wafer.level_friction * np.maximum(GRAVITY + motion.acceleration[:, 2], 0.0)
    return np.divide(given, taken, out=np.where(given > 0.0, np.inf, 0.0), where=taken > 0.0)


def wafer_stretch(wafer: Wafer, geometry: Geometry, path: JointPath, safety: float) -> float:
    """The factor by which the time of `path` has to grow until its slip margin is `safety` all along.

    k times the time divides every acceleration by k²: mu (g + a_z / k²) >= safety a / k².
    """
    motion = blade_motion(geometry, path)
    needed = safety * _taken(wafer, motion) / wafer.level_friction - motion.acceleration[:, 2]
    return sqrt(max(float(needed.max(initial=0.0)), 0.0) / GRAVITY)


def line_limits(limits: MotionLimits, wafer: Wafer, safety: float) -> MotionLimits:
    """Limits of a level stretch move with the wafer on: no more acceleration than friction gives, jerk in proportion."""
    return _gentler(limits, limits.speed, wafer.level_friction * GRAVITY / safety)


def turn_limits(limits: MotionLimits, wafer: Wafer, reach: float, safety: float) -> MotionLimits:
    """Limits of rotate with the wafer on at `reach` [m]: speed by the centripetal acceleration, acceleration by the pads.

    Each alone; where both come together it takes `wafer_stretch` besides.
    """
    most = wafer.level_friction * GRAVITY / safety
    return _gentler(limits, sqrt(most / reach), most / (reach + _turning_lever(wafer)))


def _taken(wafer: Wafer, motion: BladeMotion) -> Positions:
    """Friction that the worst pad gives over the mass it bears [m/s²] (n,): for the centre's acceleration and for the turning.

    Turning the wafer takes its share of each pad along the circle that they are on.
    """
    centre = motion.acceleration[:, None, :2]
    pad = motion.yaw[:, None] + 2.0 * pi * np.arange(wafer.pads) / wafer.pads
    along_circle = np.stack([-np.sin(pad), np.cos(pad)], axis=2)
    turning = motion.turning * _turning_lever(wafer)
    return np.asarray(np.linalg.norm(centre + turning[:, None, None] * along_circle, axis=2).max(axis=1))


def _turning_lever(wafer: Wafer) -> float:
    """Friction per mass and angular acceleration at each pad [m]: a disk's moment of inertia is m R²/2, on pads at Rp."""
    return wafer.radius**2 / (2.0 * wafer.pad_radius)


def _gentler(limits: MotionLimits, speed: float, acceleration: float) -> MotionLimits:
    """`limits` with no more than `speed` and `acceleration`, jerk in proportion to the acceleration."""
    share = min(1.0, acceleration / limits.acceleration)
    return MotionLimits(min(limits.speed, speed), share * limits.acceleration, share * limits.jerk)
