"""Looks at the plant and the drives from inside: their truth after every cycle, and each change of state."""

from __future__ import annotations

import numpy as np

from emulator.canopen.nmt import NmtState
from emulator.drive.drive import Drive
from emulator.drive.objects import number, optional
from emulator.drive.servo import Loop
from emulator.drive.state_machine import State, Statusword
from emulator.drive.supervision import OFF
from emulator.virtual_machine import VirtualMachine
from hil_tests.evidence import Configuration, StateChange, Truth

HOMING = 6
"""Mode of operation 6060h (CiA 402-2)."""

PDO_INVALID = 1 << 31
"""Bit 31 of 1400h:01 and 1800h:01 (CiA 301, 7.5.2.35)."""


class Observer:
    """Notes what is true of a virtual machine. `look` after each frame and each cycle; it sees whether time has moved.

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
        if self._virtual.now() > self.time:
            self.time = self._virtual.now()
            self._sample()

    def look_at_network(self) -> None:
        """A network management frame has come: note how the nodes that it made operational are configured."""
        for place, drive in enumerate(self._virtual.drives):
            operational = drive.device.nmt.state is NmtState.OPERATIONAL
            if operational and not self._operational[place]:
                self.configured[self._names[place]] = configuration(drive, self._virtual.now())
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


def configuration(drive: Drive, time: float) -> Configuration:
    """How a node is configured now, of its own dictionary."""
    dictionary = drive.dictionary
    pdos = {}
    for name, communication in (("rpdo", 0x1400), ("tpdo", 0x1800)):
        for place in range(4):
            if (communication + place, 1) in dictionary:
                pdos[f"{name} {place + 1}"] = _pdo(drive, communication + place)
    return Configuration(
        time=time,
        pdos=pdos,
        heartbeat=number(optional(dictionary, 0x1017), 0.0) * 1e-3,
        supervises=tuple(_supervision(drive)),
        limits_following_error=_limits_following_error(drive),
    )


def _limits_following_error(drive: Drive) -> bool | None:
    """Whether the drive's own limit is set; None where its type has none."""
    limit = drive.axis.role("following_error_limit")
    return None if limit is None else 0 < limit.number < OFF


def _pdo(drive: Drive, communication: int) -> tuple[int, int, tuple[int, ...]]:
    dictionary, mapping = drive.dictionary, communication + 0x200
    count = int(number(optional(dictionary, mapping), 0.0))
    entries = tuple(int(number(optional(dictionary, mapping, place + 1), 0.0)) for place in range(count))
    cob_id, kind = (int(number(optional(dictionary, communication, sub), 0.0)) for sub in (1, 2))
    return cob_id, kind, entries


def _supervision(drive: Drive) -> list[str]:
    """By what the drive notices that its master has gone."""
    dictionary = drive.dictionary
    found = []
    consumers = int(number(optional(dictionary, 0x1016), 0.0))
    entries = [int(number(optional(dictionary, 0x1016, place + 1), 0.0)) for place in range(consumers)]
    if any(entry & 0xFFFF and entry >> 16 & 0x7F for entry in entries):
        found.append("heartbeat consumer (1016h)")
    if number(optional(dictionary, 0x100C), 0.0) * number(optional(dictionary, 0x100D), 0.0) > 0.0:
        found.append("life guarding (100Ch, 100Dh)")
    timeout = drive.axis.role("bus_timeout")
    if timeout is not None and timeout.number > 0:
        found.append("SYNC time-out of the drive type")
    return found
