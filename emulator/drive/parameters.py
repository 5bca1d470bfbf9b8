"""The loops' parameters in the dictionary: what a master writes takes effect in the loops, by the drive type's roles."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.drive import objects
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.limits import TorqueLimits
from drivetwin.emulator.drive.servo import encoder_quantum, filter_share
from drivetwin.emulator.machine import Axis as MachineAxis

LOOP_PARAMETERS: dict[str, tuple[str, Callable[[float], float]]] = {
    "position_gain": ("position_gain", float),
    "velocity_gain": ("velocity_gain", float),
    "integral_time": ("integral_rate", lambda time: 1.0 / time if time > 0.0 else 0.0),
    "velocity_feedforward": ("velocity_feedforward", float),
    "velocity_filter_time": ("velocity_filter", filter_share),
}
"""Role -> field of the loops' parameters, and how an SI value becomes it."""


class LoopParameters:
    """Binds the roles of gains, torque limits and interpolation to the loops of an axis."""

    def __init__(self, axis: Axis, machine: MachineAxis) -> None:
        self._axis = axis
        for name, (field, convert) in LOOP_PARAMETERS.items():
            objects.on_change(axis.role(name), self._setter(name, field, convert))
        self._machine_values = objects.commissioned(machine)
        objects.link_rated_torque(axis.dictionary, axis.profile)
        self.torque_limits = TorqueLimits(axis, machine.motor)
        objects.on_change(axis.role("interpolation_type"), self._set_interpolation)

    def load(self) -> None:
        """Take over what the dictionary holds, after power-on and after a reset; the rest stays as commissioned."""
        for name, (field, convert) in LOOP_PARAMETERS.items():
            variable = self._axis.role(name)
            if variable is None:
                self._axis.servo.parameters[field] = convert(self._machine_values[name])
            else:
                self._setter(name, field, convert)(float(variable.value))
        kind = self._axis.role("interpolation_type")
        self._set_interpolation(float(kind.value) if kind is not None else 0.0)

    def _set_interpolation(self, raw: float) -> None:
        self._axis.interpolation = objects.interpolation_of(self._axis.profile, int(raw))

    def _setter(self, name: str, field: str, convert: Callable[[float], float]) -> Callable[[float], None]:
        roles = self._axis.profile.roles
        scale = roles[name].si_per_unit if name in roles else 1.0

        def act(raw: float) -> None:
            self._axis.servo.parameters[field] = convert(raw * scale)

        return act


def set_hardware(axis: Axis, machine: MachineAxis, power_on_angle: float) -> None:
    """What no bus can change: encoder, current sensor, current loop."""
    parameters, rated = axis.servo.parameters, machine.motor.rated_torque
    parameters["encoder_quantum"] = encoder_quantum(machine.encoder.increments_per_revolution)
    parameters["current_filter"] = filter_share(machine.current_loop_time_constant)
    parameters["torque_noise"] = machine.current_sensor.noise * rated
    parameters["torque_quantum"] = machine.current_sensor.resolution * rated
    axis.servo.state["position"] = power_on_angle
