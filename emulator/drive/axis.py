"""What a mode of operation works with, for one axis: object dictionary, loops, factor group, hardware."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

from drivetwin.drive_profiles import DriveProfile
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.drive.hardware import Hardware, LimitSwitches
from drivetwin.emulator.drive.interpolation import Interpolation
from drivetwin.emulator.drive.interpolation_time import InterpolationTime
from drivetwin.emulator.drive.objects import number, optional, role
from drivetwin.emulator.drive.scaling import Scaling
from drivetwin.emulator.drive.servo import SERVO_PERIOD, Servo

MOST_OF = {0x6083: 0x60C5, 0x6084: 0x60C6, 0x6085: 0x60C6, 0x609A: 0x60C5}
"""Object with the limit (max acceleration, max deceleration) of each object with a ramp."""

NO_LIMIT = 0xFFFFFFFF
"""Greatest UNSIGNED32: an acceleration of this value, or 0, is no limit."""


@dataclass
class Axis:
    """One axis of a drive. `limit_active` is set by whoever cuts a demand, and shows as bit 11 of the statusword."""

    profile: DriveProfile
    dictionary: ObjectDictionary
    servo: Servo
    hardware: Hardware
    scaling: Scaling
    interpolation: Interpolation
    interpolation_time: InterpolationTime
    limit_active: bool = False

    def __post_init__(self) -> None:
        """Look up once what every cycle asks for."""
        self._rated_torque = self.dictionary[0x6076]
        self._velocity_offset = self.dictionary[0x60B1]
        self._torque_offset = self.dictionary[0x60B2]

    @property
    def switches(self) -> LimitSwitches:
        """The limit switches."""
        return self.hardware.switches

    @property
    def cycle(self) -> float:
        """Length of the coming communication cycle [s]."""
        return self.servo.periods * SERVO_PERIOD

    @property
    def set_point_interval(self) -> int:
        """Servo periods from one streamed position to the next: 60C2h, or from a SYNC to the next where that is more."""
        interval, told = self.servo.interval, self.interpolation_time.periods()
        return interval if interval > told else told

    def role(self, name: str) -> Variable | None:
        """The variable that plays a role on this drive type, None where the type has none."""
        return role(self.dictionary, self.profile, name)

    def limit_switch(self, direction: int, angle: float) -> bool:
        """Whether the switch in a direction of user units (-1: the negative one) is actuated at a motor angle [rad]."""
        turned = self.scaling.position_per_radian < 0.0
        switches = self.hardware.switches
        return switches.negative(angle) if (direction < 0) is not turned else switches.positive(angle)

    def move_origin(self, angle: float) -> None:
        """Make motor angle `angle` [rad] the zero of positions."""
        self.scaling = replace(self.scaling, origin=angle)

    def ramp(self, index: int) -> float:
        """Motor acceleration [rad/s²] that an object gives, limited by 60C5h or 60C6h where the drive has them.

        One that is 0 is no limit: the speed changes within a period.
        """
        return min(self._acceleration(index), self._acceleration(MOST_OF.get(index, 0)))

    def offsets(self) -> tuple[float, float]:
        """60B1h [rad/s] and 60B2h [N·m]."""
        velocity = float(self._velocity_offset.value) / self.scaling.velocity_per_radian
        return velocity, int(self._torque_offset.value) * (int(self._rated_torque.value) / 1000.0) / 1000.0

    def torque_offset(self) -> float:
        """60B2h [N·m]."""
        return self.offsets()[1]

    def velocity_offset(self) -> float:
        """60B1h [rad/s]."""
        return self.offsets()[0]

    def rated_torque(self) -> float:
        """6076h [N·m]."""
        return self._rated_torque.number / 1000.0

    def _acceleration(self, index: int) -> float:
        raw = number(optional(self.dictionary, index), 0.0)
        return self.scaling.angular_acceleration(raw) if 0.0 < raw < NO_LIMIT else inf
