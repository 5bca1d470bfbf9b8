"""One virtual servo drive: a CANopen device whose state machine and modes command the loops of one axis."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import floor

from drivetwin.drive_profiles import DriveProfile
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.device import Device
from drivetwin.emulator.canopen.parameter_store import ParameterStore
from drivetwin.emulator.drive import faults, objects, readings
from drivetwin.emulator.drive.abort_connection import ENABLED, AbortConnection
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.digital_io import DigitalOutputs
from drivetwin.emulator.drive.faults import Fault, fault_of
from drivetwin.emulator.drive.hardware import Hardware
from drivetwin.emulator.drive.homing import Homing
from drivetwin.emulator.drive.interpolation import Interpolation
from drivetwin.emulator.drive.interpolation_time import InterpolationTime
from drivetwin.emulator.drive.mode import Mode
from drivetwin.emulator.drive.modes import modes
from drivetwin.emulator.drive.parameters import LoopParameters, set_hardware
from drivetwin.emulator.drive.power_on import commissioned_dictionary
from drivetwin.emulator.drive.scaling import FACTOR_GROUP, Scaling, default_increments_per_radian
from drivetwin.emulator.drive.servo import Loop, Servo, encoder_quantum
from drivetwin.emulator.drive.state_machine import Controlword, State, StateMachine, Statusword, Stop
from drivetwin.emulator.drive.stops import Stops, Way
from drivetwin.emulator.drive.supervision import CREEP, Supervision
from drivetwin.emulator.drive.torque_precontrol import TorquePrecontrol
from drivetwin.emulator.drive.touch_probe import TouchProbe
from drivetwin.emulator.drive.velocity import Velocity
from drivetwin.emulator.machine import Axis as MachineAxis

POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)
SUPERVISED = (*POWERED, State.SWITCHED_ON)
"""States in which high voltage is on, so that a fault of the hardware is one of the drive."""

UNSEEN = 8
"""Controlwords that differ and are kept for a mode until the coming cycle enters it."""


class Drive:
    """A drive of a type, on one axis of a machine.

    `plan` and `after` are called once a communication cycle, before and after the plant has run it. A bench disturbs
    `hardware`.
    """

    def __init__(
        self,
        profile: DriveProfile,
        axis: MachineAxis,
        servo: Servo,
        power_on_angle: float,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
        store: ParameterStore | None = None,
        hardware: Hardware | None = None,
    ) -> None:
        """`hardware` is what stands around it already, where it takes the place of another drive."""
        self.profile = profile
        self.dictionary = commissioned_dictionary(profile, axis)
        self.machine = StateMachine()
        self.device = Device(axis.node_id, self.dictionary, transmit, now, store)
        if profile.lss:
            self.device.add_lss()
        self.hardware = Hardware.of(axis) if hardware is None else hardware
        self._increments_per_radian = default_increments_per_radian(axis.encoder.increments_per_revolution)
        quantum = encoder_quantum(axis.encoder.increments_per_revolution)
        angle = floor(power_on_angle / quantum) * quantum
        scaling = Scaling(1.0, 1.0, 1.0, angle)
        time = InterpolationTime(self.dictionary)
        self.axis = Axis(profile, self.dictionary, servo, self.hardware, scaling, Interpolation.LINEAR, time)
        set_hardware(self.axis, axis, angle)
        self._modes = {code: mode(self.axis) for code, mode in modes().items() if code in profile.modes}
        homing = self._modes.get(Homing.code)
        self._homing = homing if isinstance(homing, Homing) else None
        self._wanted_mode = self.dictionary[0x6060]
        self._mode: Mode | None = None
        self._halted: Mode | None = None
        self._scaling_is_old = True
        self._revision = -1
        self._is_limited = servo.state.cell("limited")
        self._controlword = 0
        self._unseen: deque[int] = deque(maxlen=UNSEEN)
        self._fault_bits = 0
        self._stops = Stops(self.axis)
        self._supervision = Supervision(self.axis, axis.motor)
        self._probe = TouchProbe(self.axis)
        self._outputs = DigitalOutputs(self.axis)
        self._parameters = LoopParameters(self.axis, axis)
        self._precontrol = TorquePrecontrol(self.axis)
        self.machine.may_reset = self._supervision.may_reset
        readings.install(self.axis, self._scaling, angle, self._increments_per_radian)
        self._install_commands()
        self._supervise_connection()
        self._parameters.load()
        self.device.on_reset_application.append(self._reset)

    def power_on(self) -> None:
        """Self-test, boot-up message, pre-operational."""
        self.machine.power_on()
        self.device.power_on()

    def plan(self) -> None:
        """Decide the demand and the loops of the coming cycle."""
        if self._scaling_is_old:
            self._refresh_scaling()
        if self.dictionary.revision.number != self._revision:
            self._take_parameters()
        self._supervision.sense()
        self.axis.limit_active = False
        machine = self.machine
        if machine.state not in POWERED:
            self._mode = self._halted = None
            self._stops.coast()
            return
        if machine.stop is not None:
            self._stop(machine.stop)
        elif machine.state is State.QUICK_STOP_ACTIVE:
            self._run(Way.QUICK_STOP_RAMP)
        elif self._controlword & Controlword.HALT:
            self._halt()
        else:
            self._plan_mode()
        self._precontrol.add()
        if self._outputs.sets_brake():
            self.axis.servo.brake = True

    def after(self) -> None:
        """Look at what the cycle brought: mode progress, probes, faults."""
        if self._mode is not None:
            self._mode.after()
        if self.machine.state in POWERED:
            self._stops.after()
        self._probe.after()
        if not self.hardware.encoder_alive:
            self._lose_reference()
        self._supervise()

    def _take_parameters(self) -> None:
        """Some object has changed since the last cycle: what the loops have of the dictionary's parameters."""
        self._revision = self.dictionary.revision.number
        self._parameters.torque_limits.refresh()
        self._supervision.refresh()
        self._precontrol.refresh()

    # -- motion -------------------------------------------------------------------------------------------------------

    def _plan_mode(self) -> None:
        mode = self._mode
        if mode is None or mode.code != self._wanted_mode.value:
            self._mode = mode = self._enter_wanted_mode()
        self._halted = None
        if self._unseen:
            self._unseen.clear()
        if mode is None:
            self._run(Way.SLOW_DOWN_RAMP)
        else:
            self.axis.servo.loop = loop = mode.plan(self._controlword)
            self._stops.note(mode, loop)

    def _enter_wanted_mode(self) -> Mode | None:
        wanted = self._modes.get(int(self._wanted_mode.value))
        if wanted is not None:
            (wanted.resume if wanted is self._halted else wanted.enter)()
            for controlword in self._unseen:
                wanted.notice(controlword)
        return wanted

    def _halt(self) -> None:
        self._unseen.clear()
        self._halted = self._mode or self._halted
        way = self._stops.halt_way()
        loop = self._halted.halt() if self._halted is not None and way is Way.SLOW_DOWN_RAMP else None
        if self._halted is None or loop is None:
            self._run(way)
            return
        self._mode = None
        self.axis.servo.loop = loop
        self._stops.note(self._halted, loop)

    def _stop(self, stop: Stop) -> None:
        self._halted = None
        if self._run(self._stops.way(stop)):
            self.machine.stopped()
            if stop is Stop.QUICK_STOP and not self._stops.stays():
                self.machine.release_quick_stop()

    def _run(self, way: Way) -> bool:
        self._mode = None
        return self._stops.run(way)

    # -- faults -------------------------------------------------------------------------------------------------------

    def _supervise(self) -> None:
        alarms = self._supervision.alarms()
        state = self.machine.state
        if state not in SUPERVISED:
            return
        found = self._supervision.hardware_faults()
        if state is State.OPERATION_ENABLED:
            found += alarms
            if self._mode is None or self._mode is not self._homing:
                self._look_at_limit_switches(found)
        if state is State.FAULT_REACTION_ACTIVE:
            found = [fault for fault in (*found, *alarms) if fault.coasts]
        for fault in found:
            self._enter(fault)

    def _look_at_limit_switches(self, found: list[Fault]) -> None:
        """Add the fault of one that the axis moves into."""
        speed = self._stops.velocity
        if speed == 0.0 or self._supervision.is_between_limits():
            return
        if abs(speed) < CREEP and self.axis.servo.loop is Loop.TORQUE:
            return
        fault = self._supervision.limit_switch_fault(speed)
        if fault is not None:
            found.append(fault)

    def fault(self, code: int) -> None:
        """Enter the fault reaction with an EMCY of `code` (CiA 402-2, table 'Error codes')."""
        self._enter(fault_of(code))

    def _enter(self, fault: Fault) -> None:
        """The ramp of the reaction starts from what the axis does, not from a demand that may be what went wrong."""
        self._stops.measure()
        if 0x603F in self.dictionary:
            self.dictionary[0x603F].value = fault.code
        self.machine.fault()
        if fault is faults.FOLLOWING_ERROR and self._mode is not None:
            self._fault_bits = self._mode.following_error_bits()
        if fault.coasts:
            self.axis.servo.loop = Loop.OFF
            if self.machine.state is State.FAULT_REACTION_ACTIVE:
                self.machine.stopped()
        if not self.device.emergency.tells(fault.code):
            self.device.emergency.raise_error(fault.code, fault.register)

    def _supervise_connection(self) -> None:
        """By 6007h, or by what a drive type has for it of its own, whose only reaction is a fault."""
        option = objects.optional(self.dictionary, 0x6007)
        if option is not None:
            AbortConnection(option, self.device, self.machine, self.fault)
        kind, time = self.axis.role("bus_timeout_type"), self.axis.role("bus_timeout")
        if kind is not None and time is not None:
            self.device.add_sync_timeout(kind, time, self._fault_if_enabled)

    def _fault_if_enabled(self, code: int) -> None:
        if self.machine.state in ENABLED:
            self.fault(code)

    def _lose_reference(self) -> None:
        if self._homing is not None:
            self._homing.lose_reference()

    def _reset(self) -> None:
        self.machine.power_on()
        self._lose_reference()
        self.axis.servo.loop = Loop.OFF
        self._mode = self._halted = None
        self._controlword = self._fault_bits = 0
        self._unseen.clear()
        self._scaling_is_old = True
        self._probe.reset()
        self._parameters.load()

    # -- the dictionary -----------------------------------------------------------------------------------------------

    def statusword(self) -> int:
        """6041h."""
        word = self.machine.statusword()
        if not self._supervision.voltage_enabled():
            word &= ~Statusword.VOLTAGE_ENABLED
        if self.axis.limit_active or self._is_limited[0]:
            word |= Statusword.INTERNAL_LIMIT_ACTIVE
        if self._mode is not None:
            word |= self._mode.status_bits()
        elif self._stands_by_halt():
            word |= Statusword.TARGET_REACHED
        return word | self._fault_bits

    def _stands_by_halt(self) -> bool:
        halting = self.machine.state is State.OPERATION_ENABLED and self._controlword & Controlword.HALT
        return bool(halting) and self._stops.at_rest

    def _install_commands(self) -> None:
        dictionary = self.dictionary
        dictionary[0x6041].on_read = self.statusword
        dictionary[0x6061].on_read = self._mode_display
        dictionary[0x6040].on_write = self._write_controlword
        dictionary[0x6040].is_command = True
        dictionary[0x6060].on_write = lambda value: self._check_mode(int(value))
        for index, sub in FACTOR_GROUP:
            objects.before_change(objects.optional(dictionary, index, sub), self._mark_scaling)
        velocity = self._modes.get(Velocity.code)
        if isinstance(velocity, Velocity):
            state = self.axis.servo.state
            objects.on_read(dictionary, 0x6043, lambda: velocity.speed_value(float(state["velocity_demand"])))
            objects.on_read(dictionary, 0x6044, lambda: velocity.speed_value(float(state["velocity"])))

    def _mode_display(self) -> int:
        return self._mode.code if self._mode is not None else self._wanted_mode.number

    def _write_controlword(self, value: Value) -> None:
        controlword, machine = int(value), self.machine
        before, was = self._controlword, machine.state
        self._controlword = controlword
        machine.write_controlword(controlword)
        if machine.state is State.OPERATION_ENABLED:
            self._notice(before if was is State.OPERATION_ENABLED else controlword, controlword)
        else:
            self._unseen.clear()
        if was is State.FAULT and machine.state is not State.FAULT:
            self._fault_bits = 0
            self.device.emergency.clear()
            if 0x603F in self.dictionary:
                self.dictionary[0x603F].value = 0

    def _notice(self, before: int, controlword: int) -> None:
        """Show the mode a controlword; one that the coming cycle enters then sees all since it was chosen, edges included."""
        mode = self._mode
        if mode is not None and mode.code == self._wanted_mode.value:
            mode.notice(controlword)
            return
        if not self._unseen:
            self._unseen.append(before)
        if self._unseen[-1] != controlword:
            self._unseen.append(controlword)

    def _check_mode(self, mode: int) -> None:
        if mode != 0 and mode not in self._modes:
            raise SdoAbort(AbortCode.INVALID_VALUE)

    def _mark_scaling(self) -> None:
        self._scaling_is_old = True

    def _refresh_scaling(self) -> None:
        origin = self.axis.scaling.origin
        self.axis.scaling = Scaling.of(self.dictionary, self._increments_per_radian, origin)
        self._scaling_is_old = False

    def _scaling(self) -> Scaling:
        if self._scaling_is_old:
            self._refresh_scaling()
        return self.axis.scaling
