"""Observes plant and drives from inside: the truth after every cycle, and each change of state."""

from __future__ import annotations

import numpy as np

from drivetwin.emulator.canopen.nmt import NmtState
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.drive.objects import number, optional
from drivetwin.emulator.drive.servo import Loop
from drivetwin.emulator.drive.state_machine import State, Statusword
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.hil_tests.evidence import Configuration, StateChange, Truth
from drivetwin.hil_tests.stand.configuration import configuration

HOMING = 6
"""Mode of operation 6060h (CiA 402-2)."""


class Observer:
    """Notes what is true of a virtual machine. `look` after each frame and each cycle; it sees whether time has moved.
    `look_at_network` besides, where a node may have been reset or started since and the next frame change what it is.

    What a condition can see: `time` [s], `syncs`, speeds, states, and which axes have homed since they were switched on.
    """

    def __init__(self, virtual: VirtualMachine) -> None:
        self.time = virtual.now()
        self.syncs = 0
        self.changes: list[StateChange] = []
        self.configured: dict[str, Configuration] = {}
        self._virtual = virtual
        self._names = list(virtual.machine.axes)
        self._gears = np.array([axis.gear_ratio for axis in virtual.machine.axes.values()])
        self._states = [drive.machine.state for drive in virtual.drives]
        self._operational = [False] * len(self._names)
        self._homed = [False] * len(self._names)
        self._speeds = [0.0] * len(self._names)
        self._times: list[float] = []
        self._plant: list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = []
        self._drives: list[tuple[float, ...]] = []

    def look(self) -> None:
        """See what has changed."""
        for place, drive in enumerate(self._virtual.drives):
            if drive.machine.state is not self._states[place]:
                self._note_state(place, drive)
        self.look_at_network()
        if self._virtual.now() > self.time:
            self.time = self._virtual.now()
            self._sample()

    def look_at_network(self) -> None:
        """Note how the nodes are configured that have become operational."""
        for place, drive in enumerate(self._virtual.drives):
            operational = drive.device.nmt.state is NmtState.OPERATIONAL
            if operational and not self._operational[place]:
                self.configured[self._names[place]] = configuration_of(drive, self._virtual.now())
            self._operational[place] = operational

    def speed(self, axis: str) -> float:
        """True speed of an axis, a magnitude [m/s or rad/s]."""
        return self._speeds[self._names.index(axis)]

    def state(self, axis: str) -> State:
        """State of the axis's drive."""
        return self._states[self._names.index(axis)]

    def homed(self, axis: str) -> bool:
        """Whether the axis has homed."""
        return self._homed[self._names.index(axis)]

    def operational(self) -> frozenset[str]:
        """Axes whose nodes are operational now."""
        drives = zip(self._names, self._virtual.drives, strict=True)
        return frozenset(name for name, drive in drives if drive.device.nmt.state is NmtState.OPERATIONAL)

    def truth(self) -> Truth:
        """All samples."""
        axes = len(self._names)
        plant = np.array(self._plant).reshape(-1, 3, axes)
        drives = np.array(self._drives).reshape(-1, axes, _FIELDS)
        return Truth(
            time=np.array(self._times),
            position=plant[:, 0],
            velocity=plant[:, 1],
            torque=plant[:, 2] * self._gears,
            demand=drives[..., 0] / self._gears,
            zero=drives[..., 1] / self._gears,
            offset=drives[..., 2],
            enabled=drives[..., 3] > 0.0,
            positioning=drives[..., 4] > 0.0,
            mode=drives[..., 5].astype(np.int64),
        )

    def _note_state(self, place: int, drive: Drive) -> None:
        before, after = self._states[place], drive.machine.state
        self._states[place] = after
        self.changes.append(StateChange(self._virtual.now(), self._names[place], before, after))
        if after is State.NOT_READY_TO_SWITCH_ON:
            self._homed[place] = False

    def _sample(self) -> None:
        plant = self._virtual.plant
        velocities = plant.joint_velocities()
        self._speeds = [abs(speed) for speed in velocities.tolist()]
        self._times.append(self.time)
        self._plant.append(np.concatenate([plant.joint_positions(), velocities, plant.motor_torque]))
        row: list[float] = []
        for place, drive in enumerate(self._virtual.drives):
            row += _fields(drive)
            self._homed[place] = self._homed[place] or _has_homed(drive)
        self._drives.append(tuple(row))


_FIELDS = 6


def _fields(drive: Drive) -> tuple[float, ...]:
    """Position demand and zero [rad of the motor], 60B2h, enabled, positioning, 6060h."""
    servo = drive.axis.servo
    return (
        float(servo.state["position_demand"]),
        drive.axis.scaling.origin,
        number(optional(drive.dictionary, 0x60B2), 0.0),
        float(drive.machine.state is State.OPERATION_ENABLED),
        float(servo.loop is Loop.POSITION),
        number(optional(drive.dictionary, 0x6060), 0.0),
    )


def _has_homed(drive: Drive) -> bool:
    """Homing attained and at rest in homing mode (CiA 402-2, table 'Statusword of homing mode')."""
    if drive.machine.state is not State.OPERATION_ENABLED or drive.dictionary[0x6060].value != HOMING:
        return False
    attained = Statusword.MODE_BIT_12 | Statusword.TARGET_REACHED
    return drive.statusword() & attained == attained


def configuration_of(drive: Drive, time: float) -> Configuration:
    """How a node is configured now, of its own dictionary."""

    def read(index: int, subindex: int) -> float | None:
        variable = optional(drive.dictionary, index, subindex)
        return None if variable is None else number(variable, 0.0)

    return configuration(drive.profile, read, time)
