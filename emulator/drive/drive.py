"""One virtual servo drive: a CANopen device whose state machine and modes command the loops of one axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import floor, inf

from drive_profiles import DriveProfile
from emulator.canopen.abort_codes import AbortCode, SdoAbort
from emulator.canopen.device import Device
from emulator.canopen.object_dictionary import ObjectDictionary
from emulator.drive import objects
from emulator.drive.cyclic_synchronous_position import CyclicSynchronousPosition
from emulator.drive.homing import Homing
from emulator.drive.interpolated_position import InterpolatedPosition
from emulator.drive.interpolation import Interpolation
from emulator.drive.mode import Axis, Mode
from emulator.drive.profile_velocity import ProfileVelocity
from emulator.drive.ramp import ramp_cycle
from emulator.drive.scaling import FACTOR_GROUP, Scaling, default_increments_per_radian, to_int32
from emulator.drive.servo import (
    POSITION,
    SERVO_PERIOD,
    TORQUE_OFFSET,
    VELOCITY,
    VELOCITY_OFFSET,
    Loop,
    Servo,
    encoder_quantum,
    filter_share,
)
from emulator.drive.state_machine import Controlword, State, StateMachine, Statusword, Stop
from emulator.machine import Axis as MachineAxis

MODES: tuple[type[Mode], ...] = (ProfileVelocity, Homing, InterpolatedPosition, CyclicSynchronousPosition)

POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)

FOLLOWING_ERROR = 0x8611
ERROR_REGISTER_MOTION = 0x21
"""1001h: generic error, and the bit of the device profile."""

COAST = 0
SLOW_DOWN_RAMP = 1
SLOW_DOWN_RAMP_AND_STAY = 5
STAY_IN_QUICK_STOP = (5, 6, 7, 8)
"""Values of the option codes 605Ah..605Eh; the other ramps are all 6085h here."""


@dataclass(frozen=True)
class _Switches:
    """Limit switches of a machine's axis, in motor angle [rad]."""

    low: float
    high: float

    def negative(self, angle: float) -> bool:
        return angle <= self.low

    def positive(self, angle: float) -> bool:
        return angle >= self.high


class Drive:
    """A drive of a type, on one axis of a machine.

    `plan` and `after` are called once a communication cycle, before and after the plant has run it.
    """

    def __init__(
        self,
        profile: DriveProfile,
        axis: MachineAxis,
        servo: Servo,
        power_on_angle: float,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
    ) -> None:
        self.profile = profile
        self.dictionary = ObjectDictionary.from_profile(profile, axis.node_id)
        objects.commission(self.dictionary, profile, axis)
        self.machine = StateMachine()
        self.device = Device(axis.node_id, self.dictionary, transmit, now)
        self._increments_per_radian = default_increments_per_radian(axis.encoder.increments_per_revolution)
        quantum = encoder_quantum(axis.encoder.increments_per_revolution)
        self._power_on_angle = floor(power_on_angle / quantum) * quantum
        gear, switches = axis.gear_ratio, axis.limit_switches
        self.axis = Axis(
            dictionary=self.dictionary,
            servo=servo,
            switches=_Switches(switches.negative * gear, switches.positive * gear),
            scaling=Scaling(1.0, 1.0, self._power_on_angle),
            interpolation=Interpolation.LINEAR,
        )
        self._modes = {mode.code: mode(self.axis) for mode in MODES if mode.code in profile.modes}
        self._mode: Mode | None = None
        self._scaling_is_old = True
        self._torque_limit_is_old = True
        self._controlword = 0
        self._at = (self._power_on_angle, 0.0)
        self._beyond_window = 0.0
        self._peak_torque = axis.motor.peak_torque
        self._set_hardware(axis)
        self._install_reads()
        self._install_writes()
        self._load_parameters()
        self.device.on_reset_application.append(self._reset)

    def power_on(self) -> None:
        """Self-test, boot-up message, pre-operational."""
        self.machine.power_on()
        self.device.power_on()

    def plan(self) -> None:
        """Decide the demand and the loops of the coming cycle."""
        self._refresh_scaling()
        self._refresh_torque_limit()
        if self.machine.state not in POWERED:
            self._coast()
            return
        if self.machine.stop is not None:
            self._plan_stop(self.machine.stop)
        elif self.machine.state is State.QUICK_STOP_ACTIVE:
            self._ramp_down(0x6085)
        elif self._controlword & Controlword.HALT:
            gentle = int(self.dictionary[0x605D].value) == SLOW_DOWN_RAMP
            self._ramp_down(0x6084 if gentle else 0x6085)
        else:
            self._plan_mode()
        servo = self.axis.servo
        if servo.loop is not Loop.OFF:
            self._at = (float(servo.demand[-1, POSITION]), float(servo.demand[-1, VELOCITY]))

    def after(self) -> None:
        """Look at what the cycle brought: mode progress, following error."""
        if self._mode is not None:
            self._mode.after()
        self._watch_following_error()

    # -- stops --------------------------------------------------------------------------------------------------------

    def _plan_mode(self) -> None:
        wanted = self._modes.get(int(self.dictionary[0x6060].value))
        if wanted is not self._mode:
            self._mode = wanted
            if wanted is not None:
                wanted.enter()
        if self._mode is None:
            self._ramp_down(0x6084)
        else:
            self.axis.servo.loop = self._mode.plan(self._controlword)

    def _plan_stop(self, stop: Stop) -> None:
        option = int(self.dictionary[stop.value].value)
        if option == COAST:
            self._coast()
            self._end_stop(stop, option)
            return
        gentle = option in (SLOW_DOWN_RAMP, SLOW_DOWN_RAMP_AND_STAY)
        self._ramp_down(0x6084 if gentle else 0x6085)
        if self.axis.servo.demand[-1, VELOCITY] == 0.0:
            self._end_stop(stop, option)

    def _end_stop(self, stop: Stop, option: int) -> None:
        self.machine.stopped()
        if stop is Stop.QUICK_STOP and option not in STAY_IN_QUICK_STOP:
            self.machine.release_quick_stop()

    def _coast(self) -> None:
        """No torque. A ramp that follows starts from what the axis does then."""
        servo = self.axis.servo
        self._mode = None
        servo.loop = Loop.OFF
        self._at = self._measured()

    def _ramp_down(self, index: int) -> None:
        """Slow down on the position loop by the deceleration of an object, and hold; the mode starts anew afterwards."""
        self._mode = None
        servo = self.axis.servo
        position, velocity = self._at
        if servo.loop is not Loop.POSITION:
            position = float(servo.state["position"])
        deceleration = self.axis.ramp(index)
        ramp_cycle(position, velocity, 0.0, deceleration, deceleration, servo.demand)
        servo.demand[:, VELOCITY_OFFSET] = 0.0
        servo.demand[:, TORQUE_OFFSET] = 0.0
        servo.loop = Loop.POSITION

    def _measured(self) -> tuple[float, float]:
        state = self.axis.servo.state
        return float(state["position"]), float(state["velocity"])

    # -- supervision --------------------------------------------------------------------------------------------------

    def _watch_following_error(self) -> None:
        """A fault when the following error has been beyond its limit for longer than 6066h (at once where there is none)."""
        servo = self.axis.servo
        watched = servo.loop is Loop.POSITION and self.machine.state is State.OPERATION_ENABLED
        error = abs(self.axis.scaling.distance(float(servo.state["following_error"])))
        if not watched or error <= self._following_error_limit():
            self._beyond_window = 0.0
            return
        self._beyond_window += len(servo.demand) * SERVO_PERIOD
        timeout = float(self.dictionary[0x6066].value) / 1000.0 if 0x6066 in self.dictionary else 0.0
        if self._beyond_window > timeout:
            self.fault(FOLLOWING_ERROR)

    def _following_error_limit(self) -> float:
        """In user units; 0 and FFFFFFFFh switch the supervision off."""
        variable = objects.role(self.dictionary, self.profile, "following_error_limit")
        limit = float(variable.value) if variable is not None else 0.0
        return limit if 0.0 < limit < 0xFFFFFFFF else inf

    def fault(self, code: int) -> None:
        """Enter the fault reaction with an EMCY of `code` (CiA 402-2, table 'Error codes').

        Its ramp starts from what the axis does, not from a demand that may be what went wrong.
        """
        self._at = self._measured()
        if 0x603F in self.dictionary:
            self.dictionary[0x603F].value = code
        self.machine.fault()
        self.device.emergency.raise_error(code, ERROR_REGISTER_MOTION)

    def _reset(self) -> None:
        self.machine.power_on()
        self.axis.servo.loop = Loop.OFF
        self._mode = None
        self._controlword = 0
        self._scaling_is_old = True
        self._load_parameters()

    # -- the dictionary -----------------------------------------------------------------------------------------------

    def statusword(self) -> int:
        """6041h."""
        word = self.machine.statusword()
        if self._mode is not None:
            word |= self._mode.status_bits()
        elif self._halted():
            word |= Statusword.TARGET_REACHED
        return word

    def _halted(self) -> bool:
        halting = self.machine.state is State.OPERATION_ENABLED and self._controlword & Controlword.HALT
        return bool(halting) and self._at[1] == 0.0

    def _install_reads(self) -> None:
        dictionary, servo = self.dictionary, self.axis.servo
        state = servo.state
        rated = self.axis.rated_torque
        reads: dict[int, Callable[[], int | float]] = {
            0x6041: self.statusword,
            0x6061: lambda: self._mode.code if self._mode is not None else int(dictionary[0x6060].value),
            0x6062: lambda: self._scaling().position(float(state["position_demand"])),
            0x6063: lambda: to_int32((float(state["position"]) - self._power_on_angle) * self._increments_per_radian),
            0x6064: lambda: self._scaling().position(float(state["position"])),
            0x606B: lambda: self._scaling().velocity(float(state["velocity_demand"])),
            0x606C: lambda: self._scaling().velocity(float(state["velocity"])),
            0x60F4: lambda: self._scaling().distance(float(state["following_error"])),
            0x6074: lambda: objects.per_mille(float(state["torque_demand"]), rated()),
            0x6077: lambda: objects.per_mille(float(state["torque_actual"]), rated()),
            0x6078: lambda: objects.per_mille(float(state["torque_actual"]), rated()),
            0x60FD: self._digital_inputs,
        }
        for index, read in reads.items():
            objects.on_read(dictionary, index, read)
        torque = objects.role(dictionary, self.profile, "torque_actual")
        if torque is not None:
            torque.on_read = lambda: float(state["torque_actual"])

    def _install_writes(self) -> None:
        dictionary, profile = self.dictionary, self.profile
        dictionary[0x6040].on_write = lambda value: self._write_controlword(int(value))
        dictionary[0x6060].on_write = lambda value: self._check_mode(int(value))
        for index, sub in (*FACTOR_GROUP, (0x607E, 0)):
            objects.before_change(dictionary[index, sub], self._mark_scaling)
        for name, (field, convert) in self._loop_parameters().items():
            variable = objects.role(dictionary, self.profile, name)
            objects.on_change(variable, self._setter(name, field, convert))
        objects.link_rated_torque(dictionary, profile)
        for variable in (dictionary[0x6072], dictionary[0x6076], objects.role(dictionary, profile, "torque_limit")):
            objects.before_change(variable, self._mark_torque_limit)
        objects.on_change(
            objects.role(dictionary, profile, "interpolation_type"),
            lambda raw: setattr(self.axis, "interpolation", objects.interpolation_of(profile, int(raw))),
        )

    def _loop_parameters(self) -> dict[str, tuple[str, Callable[[float], float]]]:
        """Role -> field of the loops' parameters, and how an SI value becomes it."""
        return {
            "position_gain": ("position_gain", float),
            "velocity_gain": ("velocity_gain", float),
            "integral_time": ("integral_rate", lambda time: 1.0 / time if time > 0.0 else 0.0),
            "velocity_feedforward": ("velocity_feedforward", float),
            "velocity_filter_time": ("velocity_filter", filter_share),
        }

    def _setter(self, name: str, field: str, convert: Callable[[float], float]) -> Callable[[float], None]:
        scale = self.profile.roles[name].si_per_unit if name in self.profile.roles else 1.0

        def act(raw: float) -> None:
            self.axis.servo.parameters[field] = convert(raw * scale)

        return act

    def _load_parameters(self) -> None:
        """Take over what the dictionary holds: after power-on and after a reset."""
        for name, (field, convert) in self._loop_parameters().items():
            variable = objects.role(self.dictionary, self.profile, name)
            if variable is not None:
                self._setter(name, field, convert)(float(variable.value))
        self._torque_limit_is_old = True
        kind = objects.role(self.dictionary, self.profile, "interpolation_type")
        self.axis.interpolation = objects.interpolation_of(self.profile, int(kind.value) if kind is not None else 0)

    def _mark_torque_limit(self) -> None:
        self._torque_limit_is_old = True

    def _refresh_torque_limit(self) -> None:
        """The smallest of 6072h (thousandths of rated torque), the drive's own limit and the motor's peak torque [N·m]."""
        if not self._torque_limit_is_old:
            return
        limit = float(self.dictionary[0x6072].value) * self.axis.rated_torque() / 1000.0
        own = objects.role(self.dictionary, self.profile, "torque_limit")
        if own is not None:
            limit = min(limit, float(own.value))
        limit = min(limit, self._peak_torque)
        self.axis.servo.parameters["torque_limit"] = limit
        self._torque_limit_is_old = False

    def _set_hardware(self, axis: MachineAxis) -> None:
        """What no bus can change: encoder, current sensor, current loop."""
        parameters, rated = self.axis.servo.parameters, axis.motor.rated_torque
        parameters["encoder_quantum"] = encoder_quantum(axis.encoder.increments_per_revolution)
        parameters["current_filter"] = filter_share(axis.current_loop_time_constant)
        parameters["torque_noise"] = axis.current_sensor.noise * rated
        parameters["torque_quantum"] = axis.current_sensor.resolution * rated
        self.axis.servo.state["position"] = self._power_on_angle

    def _write_controlword(self, controlword: int) -> None:
        was_fault = self.machine.state is State.FAULT
        self._controlword = controlword
        self.machine.write_controlword(controlword)
        if was_fault and self.machine.state is not State.FAULT:
            self.device.emergency.clear()
            if 0x603F in self.dictionary:
                self.dictionary[0x603F].value = 0

    def _check_mode(self, mode: int) -> None:
        if mode != 0 and mode not in self._modes:
            raise SdoAbort(AbortCode.INVALID_VALUE)

    def _mark_scaling(self) -> None:
        self._scaling_is_old = True

    def _refresh_scaling(self) -> None:
        if self._scaling_is_old:
            origin = self.axis.scaling.origin
            self.axis.scaling = Scaling.of(self.dictionary, self._increments_per_radian, origin)
            self._scaling_is_old = False

    def _scaling(self) -> Scaling:
        self._refresh_scaling()
        return self.axis.scaling

    def _digital_inputs(self) -> int:
        """60FDh: bit 0 negative limit switch, bit 1 positive limit switch."""
        angle = float(self.axis.servo.state["position"])
        return int(self.axis.switches.negative(angle)) | int(self.axis.switches.positive(angle)) << 1
