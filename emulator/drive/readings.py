"""Objects that return what the drive measures or demands at this moment, in user units."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from operator import itemgetter

from drivetwin.emulator.drive import objects
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.digital_io import digital_inputs
from drivetwin.emulator.drive.scaling import Scaling, to_int32


def install(axis: Axis, scaling: Callable[[], Scaling], power_on_angle: float, increments_per_radian: float) -> None:
    """Bind the actual and demand values; `scaling` is asked at each read, as a master may have just written it."""
    state = axis.servo.state
    position = state.cell("position")

    def inputs() -> int:
        scaling()
        return digital_inputs(axis)

    reads: dict[int, Callable[[], int | float]] = {
        0x6062: lambda: scaling().position(float(state["position_demand"])),
        0x6063: lambda: to_int32((float(state["position"]) - power_on_angle) * increments_per_radian),
        0x6064: lambda: scaling().position(position[0]),
        0x6069: lambda: scaling().velocity(float(state["velocity"])),
        0x606B: lambda: scaling().velocity(float(state["velocity_demand"])),
        0x606C: lambda: scaling().velocity(float(state["velocity"])),
        0x60F4: lambda: scaling().distance(float(state["following_error"])),
        0x6074: lambda: objects.per_mille(float(state["torque_demand"]), axis.rated_torque()),
        0x6077: lambda: objects.per_mille(float(state["torque_actual"]), axis.rated_torque()),
        0x6078: lambda: objects.per_mille(float(state["torque_actual"]), axis.rated_torque()),
        0x6079: lambda: round(1000.0 * axis.hardware.dc_link_voltage),
        0x60FD: inputs,
    }
    for index, read in reads.items():
        objects.on_read(axis.dictionary, index, read)
    for name, field in (("torque_actual", "torque_actual"), ("torque_reference", "torque_demand")):
        variable = axis.role(name)
        if variable is not None:
            variable.on_read = partial(itemgetter(0), state.cell(field))
