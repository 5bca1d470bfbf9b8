"""Profile position mode (1): the drive plans the motion to 607Ah (CiA 402-2, clause 'Profile position mode')."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, inf
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.limits import PositionLimits, speed_limit
from drivetwin.emulator.drive.mode import Axis, Mode
from drivetwin.emulator.drive.objects import number, optional
from drivetwin.emulator.drive.position_range import Rotary
from drivetwin.emulator.drive.profile_generator import Bounds, Motion, Profile, change_speed, come_to_rest, move_to
from drivetwin.emulator.drive.profile_jerk import profile_jerk
from drivetwin.emulator.drive.servo import POSITION, TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop
from drivetwin.emulator.drive.state_machine import Controlword, Statusword
from drivetwin.emulator.drive.windows import Window

NEW_SETPOINT, CHANGE_IMMEDIATELY, RELATIVE = Controlword.MODE_BIT_4, Controlword.MODE_BIT_5, Controlword.MODE_BIT_6
CHANGE_ON_SETPOINT = 1 << 9
NO_WINDOW = 0xFFFFFFFF


@dataclass(frozen=True)
class SetPoint:
    """A target [rad] with the profile that the objects said when it was accepted; `flying`: reached at speed."""

    target: float
    bounds: Bounds
    flying: bool = False


class ProfilePosition(Mode):
    """The set-point handshake of bits 4 (new set-point) and 12 (acknowledge), with room for one set-point more.

    Bit 5 changes at once, bit 6 makes the target relative (to what 60F2h says), bit 9 passes the present target at speed. A
    set-point with 6081h = 0 is acknowledged and warns (bit 7) until a 6081h that is written later starts it.
    """

    code: ClassVar[int] = 1

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._limits = PositionLimits(axis)
        self._window = Window()
        self._active: SetPoint | None = None
        self._next: SetPoint | None = None
        self._waits_for_speed = False
        self._profile: Profile | None = None
        self._target = 0.0
        self._acknowledged = False
        self._bit_4: bool | None = None
        self._beyond_limit = False

    def enter(self) -> None:
        self._bit_4 = None
        self._acknowledged = False
        self._active = self._next = None
        self._beyond_limit = self._waits_for_speed = False
        self._profile = come_to_rest(self._measured(), self._bounds())
        self._target = self._profile.at(self._profile.duration).position
        self._window.restart()

    def resume(self) -> None:
        active = self._active
        if active is None:
            self.enter()
            return
        self._start(active, self._measured())
        self._window.restart()

    def notice(self, controlword: int) -> None:
        bit_4 = bool(controlword & NEW_SETPOINT)
        if bit_4 and self._bit_4 is False:
            self._take(controlword)
        self._bit_4 = bit_4
        self._end_handshake()

    def plan(self, controlword: int) -> Loop:
        self.notice(controlword)
        if self._waits_for_speed and self._active is not None and (bounds := self._bounds()).speed > 0.0:
            self._start(replace(self._active, bounds=bounds), self._now())
        demand = self.axis.servo.demand
        self._sample(demand)
        if self._next is not None:
            self._go_on(self._next, demand)
        demand[:, VELOCITY_OFFSET] = self.axis.velocity_offset()
        demand[:, TORQUE_OFFSET] = self.axis.torque_offset()
        if self._beyond_limit:
            self.axis.limit_active = True
        return Loop.POSITION

    def after(self) -> None:
        axis = self.axis
        error = abs(self._target - float(axis.servo.state["position"]))
        ended = (self._profile is None or self._profile.ended) and not self._waits_for_speed
        size, time = self._window_size()
        self._window.look(ended and self._next is None and error <= size, time, axis.cycle)

    def status_bits(self) -> int:
        acknowledge = Statusword.MODE_BIT_12 if self._acknowledged else 0
        warning = Statusword.WARNING if self._waits_for_speed else 0
        return acknowledge | warning | (Statusword.TARGET_REACHED if self._window.held else 0)

    def following_error_bits(self) -> int:
        return Statusword.MODE_BIT_13

    # -- the handshake ------------------------------------------------------------------------------------------------

    def _take(self, controlword: int) -> None:
        """A rising edge of bit 4: accept the set-point, unless the buffer is full."""
        if self._active is not None and self._moving() and not controlword & CHANGE_IMMEDIATELY:
            if self._next is not None:
                return
            self._next = self._setpoint(controlword)
            if self._next.flying:
                self._fly(self._active)
        else:
            self._next = None
            self._start(self._setpoint(controlword), self._now())
        self._acknowledged = True
        self._window.restart()

    def _end_handshake(self) -> None:
        """Bit 12 falls when bit 4 has, and there is room for another set-point."""
        if not self._bit_4 and self._next is None:
            self._acknowledged = False

    def _setpoint(self, controlword: int) -> SetPoint:
        raw, scaling = float(self.axis.dictionary[0x607A].value), self.axis.scaling
        if controlword & RELATIVE:
            target = self._base() + scaling.angular_distance(raw)
        else:
            target = scaling.target(raw, self._departure(controlword), Rotary(self._option() >> 6 & 3))
        return SetPoint(target, self._bounds(), bool(controlword & CHANGE_ON_SETPOINT))

    def _base(self) -> float:
        """What a relative target is relative to, by bits 0 and 1 of 60F2h: preceding target, demand, or actual position."""
        option = self._option() & 3
        if option == 1:
            return self._now().position
        if option == 2:
            return float(self.axis.servo.state["position"])
        return self._next.target if self._next is not None else self._target

    def _departure(self, controlword: int) -> float:
        """Where a set-point begins that is accepted now [rad]: at the present target, where it waits for that, else here."""
        waits = self._moving() and not controlword & CHANGE_IMMEDIATELY
        return self._target if waits else self._now().position

    def _moving(self) -> bool:
        on_its_way = self._profile is not None and not self._profile.ended and not self._waits_for_speed
        return on_its_way and self._active is not None

    def _option(self) -> int:
        """60F2h."""
        return int(number(optional(self.axis.dictionary, 0x60F2), 0.0))

    # -- the motion ---------------------------------------------------------------------------------------------------

    def _start(self, setpoint: SetPoint, start: Motion) -> None:
        self._active = setpoint
        self._target = self._limits.clamp(setpoint.target)
        self._beyond_limit = self._target != setpoint.target
        still = self._waits_for_speed = setpoint.bounds.speed == 0.0
        self._profile = come_to_rest(start, setpoint.bounds) if still else move_to(start, self._target, setpoint.bounds)

    def _fly(self, active: SetPoint) -> None:
        """Do not slow down for the present target."""
        now = self._now()
        speed = copysign(active.bounds.speed, self._target - now.position)
        self._profile = change_speed(now, speed, active.bounds)

    def _sample(self, demand: NDArray[np.float64]) -> None:
        if self._profile is not None:
            self._profile.sample(demand)

    def _go_on(self, following: SetPoint, demand: NDArray[np.float64]) -> None:
        """Begin the buffered set-point in the servo period in which the present one is done."""
        row = self._row_of_arrival(following, demand)
        if row is None:
            return
        start = Motion(float(demand[row, POSITION]), float(demand[row, VELOCITY]))
        self._next = None
        self._start(following, start)
        if row + 1 < len(demand):
            self._sample(demand[row + 1 :])
        self._end_handshake()

    def _row_of_arrival(self, following: SetPoint, demand: NDArray[np.float64]) -> int | None:
        if not following.flying:
            return len(demand) - 1 if self._profile is None or self._profile.ended else None
        passed = (demand[:, POSITION] - self._target) * np.sign(demand[:, VELOCITY]) >= 0.0
        return int(np.argmax(passed)) if passed.any() else None

    def _now(self) -> Motion:
        return self._measured() if self._profile is None else self._profile.now()

    def _measured(self) -> Motion:
        state = self.axis.servo.state
        return Motion(float(state["position"]), float(state["velocity"]))

    # -- the objects --------------------------------------------------------------------------------------------------

    def _bounds(self) -> Bounds:
        """6081h, 6083h, 6084h and the jerk, within 607Fh, 6080h, 60C5h, 60C6h."""
        axis = self.axis
        speed = abs(axis.scaling.angular(float(axis.dictionary[0x6081].value)))
        up, down = axis.ramp(0x6083), axis.ramp(0x6084)
        return Bounds(min(speed, speed_limit(axis)), up, down, profile_jerk(axis, up))

    def _window_size(self) -> tuple[float, float]:
        """Position window [rad], infinite where it is switched off, and its time [s]: 6067h, 6068h."""
        raw = number(self.axis.role("position_window") or optional(self.axis.dictionary, 0x6067), NO_WINDOW)
        time = number(optional(self.axis.dictionary, 0x6068), 0.0) / 1000.0
        if raw >= NO_WINDOW:
            return inf, 0.0
        return abs(self.axis.scaling.angular_distance(raw)), time
