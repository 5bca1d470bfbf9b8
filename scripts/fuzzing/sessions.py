"""What masters really send: sessions recorded from the reference controller and from `canopen`'s SDO client, and the services
that neither of them uses, written out. They are what the fuzz mutates, and how it brings drives into every state.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import can
import numpy as np
from canopen.sdo.exceptions import SdoError
from numpy.typing import NDArray

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.link import Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import ENABLE_OPERATION, MODE_BIT_4, enable, enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from fuzzing.target import Event

STREAMED = 40
"""Cycles of a recorded motion."""

HOMED = 200
"""Last cycles of a recorded homing: the switch, the way back and the zero position."""


TORQUE_MODES = (4, 10)
"""Modes in which the first axis, the lift, would fall."""


@dataclass(frozen=True)
class Sessions:
    """Events by what they are about; `bring_up` and `enable` bring drives to operation enabled."""

    by_name: dict[str, tuple[Event, ...]]

    @property
    def bring_up(self) -> tuple[Event, ...]:
        """From power-on to operational, all drives."""
        return self.by_name["bring up"]

    @property
    def enable(self) -> tuple[Event, ...]:
        """From operational to operation enabled, holding a position."""
        return self.by_name["enable"]


class _Recorder:
    """A controller at a fresh machine; `session` is what it sent since the last call."""

    def __init__(self, profile: DriveProfile) -> None:
        self._sent: list[Event] = []
        self.known = load_machine("scara")
        self.bus = InprocBus(lambda transmit: self._machine(profile, transmit))
        self.link = Link(self.bus)
        self.drives = connect(self.link, self.known, profile)
        self.cycle = Cycle(self.link, self.drives, Lockstep())

    def session(self) -> tuple[Event, ...]:
        sent, self._sent = tuple(self._sent), []
        return sent

    def _machine(self, profile: DriveProfile, transmit: Callable[[can.Message], None]) -> VirtualMachine:
        described = load_virtual_machine("scara")
        machine = VirtualMachine(described, profile, read_effects(described.effects_path), SyncClock(), 0, transmit)
        machine.power_on()
        receive = machine.receive

        def recorded(message: can.Message) -> None:
            self._sent.append(message)
            receive(message)

        machine.receive = recorded  # type: ignore[method-assign]
        return machine


def record_sessions(profile_name: str) -> Sessions:
    """Let masters talk to a fresh machine of that drive type and keep what they said."""
    profile = load_profile(profile_name)
    recorder = _Recorder(profile)
    link, drives, cycle = recorder.link, recorder.drives, recorder.cycle
    found: dict[str, tuple[Event, ...]] = {}
    bring_up(link, drives, cycle.period)
    found["bring up"] = recorder.session()
    cycle.start()
    enable_streaming(cycle, drives)
    found["enable"] = recorder.session()
    home(cycle, drives)
    homing = recorder.session()
    found["homing"] = (*homing[:HOMED], *homing[-HOMED * (len(drives) + 1) :])
    enable_streaming(cycle, drives)
    stream(cycle, drives, _to_the_middle(recorder))
    found["streaming"] = recorder.session()[-STREAMED * (len(drives) + 1) :]
    for mode in profile.modes:
        found[f"mode {mode}"] = _in_mode(recorder, mode)
    found["uploads"] = _uploads(recorder)
    found["block transfers"] = _block_transfers(recorder)
    found["services"] = services(profile)
    recorder.bus.shutdown()
    return Sessions(found)


def _to_the_middle(recorder: _Recorder) -> NDArray[np.float64]:
    """Set-points from where the axes stand, away from their switches."""
    starts, axes = positions_now(recorder.drives), recorder.known.axes.values()
    middles = [0.5 * sum(axis.travel) for axis in axes]
    ways = [move(start, middle, 0.5, 2.0, recorder.cycle.period) for start, middle in zip(starts, middles, strict=True)]
    return side_by_side(ways)


def _in_mode(recorder: _Recorder, mode: int) -> tuple[Event, ...]:
    """Targets of every kind, set-point handshake, halt and resume."""
    cycle = recorder.cycle
    drives = recorder.drives[1:] if mode in TORQUE_MODES else recorder.drives
    enable(cycle, drives, mode)
    for drive in drives:
        known = {entry.index for entry in drive.profile.objects}
        targets = {
            0x607A: drive.position + 5000,
            0x60C1: drive.position + 50,
            0x60FF: drive.in_units(0.02),
            0x6081: drive.in_units(0.05),
        }
        carried = drive.profile.roles["position_setpoint"].index
        drive.setpoint = targets[carried]  # cycles run between an SDO write and its read-back: RPDO 1 has to say the same
        for index in targets.keys() & known:
            drive.write(targets[index], index, 1 if index == 0x60C1 else 0)
    for word in (ENABLE_OPERATION | MODE_BIT_4, ENABLE_OPERATION, 0x10F, ENABLE_OPERATION | MODE_BIT_4):
        for drive in drives:
            drive.controlword = word
        cycle.run_for(0.008)
    for drive in drives:
        drive.controlword = ENABLE_OPERATION
    return recorder.session()


def _uploads(recorder: _Recorder) -> tuple[Event, ...]:
    """Every object of the first drive, expedited or in segments, and what it aborts."""
    drive = recorder.drives[0]
    for entry in drive.profile.objects:
        with suppress(SdoError):
            _client(recorder.link, drive).upload(entry.index, entry.subindex)
    return recorder.session()


def _block_transfers(recorder: _Recorder) -> tuple[Event, ...]:
    """Block uploads of text, and block and segmented downloads of parameters."""
    for drive in recorder.drives:
        client = _client(recorder.link, drive)
        for index, subindex in ((0x1008, 0), (0x1018, 1)):
            with client.open(index, subindex, mode="rb", block_transfer=True) as transfer:
                transfer.read()
        for index, subindex, size in ((0x6085, 0, 4), (0x60C2, 1, 1), (0x1017, 0, 2), (0x6092, 1, 4)):
            value = client.upload(index, subindex)
            with client.open(index, subindex, mode="wb", size=size, block_transfer=True) as transfer:
                transfer.write(value)
            client.download(index, subindex, value, force_segment=True)
    return recorder.session()


def _client(link: Link, drive: DriveNode) -> Any:  # canopen leaves the client's methods untyped
    """canopen's SDO client of a drive."""
    return link[drive.node_id].sdo


# -- services that neither master uses --------------------------------------------------------------------------------


def frame(cob_id: int, data: str) -> can.Message:
    """A data frame, its data in hex."""
    return can.Message(arbitration_id=cob_id, data=bytes.fromhex(data), is_extended_id=False)


def remote(cob_id: int) -> can.Message:
    """A remote frame."""
    return can.Message(arbitration_id=cob_id, is_remote_frame=True, is_extended_id=False)


def download(node: int, index: int, subindex: int, value: bytes) -> can.Message:
    """An expedited SDO download."""
    head = bytes((0x23 | (4 - len(value)) << 2,)) + index.to_bytes(2, "little") + bytes((subindex,))
    return can.Message(arbitration_id=0x600 + node, data=head + value.ljust(4, b"\0"), is_extended_id=False)


SYNC = frame(0x80, "")


def services(profile: DriveProfile) -> tuple[Event, ...]:
    """NMT, error control, SYNC counter, TIME, EMCY, store and restore, PDO transmission types, LSS."""
    known = {(entry.index, entry.subindex): entry for entry in profile.objects}
    events: list[Event] = []

    def write(node: int, index: int, subindex: int, value: int, size: int) -> None:
        if (index, subindex) in known:
            events.append(download(node, index, subindex, value.to_bytes(size, "little")))

    for node in (1, 2, 3):
        write(node, 0x1017, 0, 20, 2)
        write(node, 0x1016, 1, 0x7D << 16 | 50, 4)
        events.extend((frame(0x77D, "05"), *[None] * 60, frame(0x77D, "05"), frame(0, f"01 0{node}")))
        write(node, 0x1017, 0, 0, 2)
        write(node, 0x100C, 0, 20, 2)
        write(node, 0x100D, 0, 3, 1)
        events.extend((remote(0x700 + node), None, remote(0x700 + node), *[None] * 70, frame(0, f"01 0{node}")))
        write(node, 0x1029, 1, 2, 1)
        write(node, 0x1012, 0, 0x80000100, 4)
        events.extend((frame(0x100, "00000001 8E3D"), frame(0, f"80 0{node}")))
        write(node, 0x1006, 0, 0, 4)
        write(node, 0x1019, 0, 10, 1)
        events.extend((frame(0x80, "01"), frame(0x80, "02"), SYNC))
        write(node, 0x1019, 0, 0, 1)
        write(node, 0x1006, 0, 1000, 4)
        write(node, 0x1007, 0, 2000, 4)
        events.extend((frame(0x200 + node, "0F00 00000000 0000"), SYNC, None, None, frame(0x200 + node, "0600")))
        write(node, 0x1007, 0, 0, 4)
        events.extend(_transmission_types(node))
        events.append(frame(0, f"01 0{node}"))
        events.extend((remote(0x180 + node), remote(0x280 + node), SYNC, SYNC, remote(0x380 + node)))
        write(node, 0x1010, 1, int.from_bytes(b"save", "little"), 4)
        write(node, 0x1011, 1, int.from_bytes(b"load", "little"), 4)
        events.append(frame(0, f"82 0{node}"))
    if profile.lss:
        events.extend(frame(0x7E5, text) for text in LSS)
    events.extend((frame(0, "02 00"), SYNC, frame(0, "01 00"), SYNC, frame(0, "80 00"), frame(0, "81 00"), frame(0, "01 00")))
    return tuple(events)


def rescue() -> tuple[Event, ...]:
    """Back to operation enabled by NMT and SDO, whatever the PDOs are mapped to by now."""
    events: list[Event] = [frame(0, "01 00")]
    for word in (0x00, 0x80, 0x06, 0x07, 0x0F):
        events += [*(download(node, 0x6040, 0, word.to_bytes(2, "little")) for node in (1, 2, 3)), SYNC]
    return tuple(events)


def cycle_of(microseconds: int) -> tuple[Event, ...]:
    """The communication cycle of all drives (1006h)."""
    return tuple(download(node, 0x1006, 0, microseconds.to_bytes(4, "little")) for node in (1, 2, 3))


def held_reset() -> tuple[Event, ...]:
    """Enable operation with bit 7 held: a fault that comes now must not be reset before the bit was 0."""
    return tuple(download(node, 0x6040, 0, b"\x8F\0") for node in (1, 2, 3))


LSS = (
    "04 01 000000000000",
    "5E 00 000000000000",
    "11 05 000000000000",
    "13 00 02 0000000000",
    "15 05 00 0000000000",
    "17 00 000000000000",
    "04 00 000000000000",
    "11 FF 000000000000",
    "4C 00 000000000000",
    "51 00000000 80 00 00 00",
    "51 00000000 1F 00 00 00",
)


def _transmission_types(node: int) -> list[Event]:
    """TPDO 3 carries statusword and position by every kind of transmission type."""
    invalid, valid = (0x380 + node | 1 << 31).to_bytes(4, "little"), (0x380 + node).to_bytes(4, "little")
    events: list[Event] = [
        download(node, 0x1802, 1, invalid),
        download(node, 0x1A02, 0, b"\0"),
        download(node, 0x1A02, 1, (0x6041_0010).to_bytes(4, "little")),
        download(node, 0x1A02, 2, (0x6064_0020).to_bytes(4, "little")),
        download(node, 0x1A02, 0, b"\2"),
        download(node, 0x1802, 3, (20).to_bytes(2, "little")),
        download(node, 0x1802, 5, (5).to_bytes(2, "little")),
        download(node, 0x1802, 1, valid),
        frame(0, f"01 0{node}"),
    ]
    for kind in (0, 1, 3, 240, 252, 253, 254, 255):
        events += [download(node, 0x1802, 2, bytes((kind,))), SYNC, remote(0x380 + node), None]
    return events


def restoring(drives: list[Drive], profile: DriveProfile) -> tuple[Event, ...]:
    """What brings drives back whose node-IDs and stored parameters may be anything: LSS by identity, load, reset."""
    events: list[Event] = []
    nodes = [node for node, _ in enumerate(drives, start=1)]
    if profile.lss:
        events.append(frame(0x7E5, "04 00 000000000000"))
        for node, drive in zip(nodes, drives, strict=True):
            identity = [drive.dictionary[0x1018, subindex].number for subindex in range(1, 5)]
            for command, number in enumerate(identity, start=0x40):
                events.append(frame(0x7E5, f"{command:02X}{number.to_bytes(4, 'little').hex()}000000"))
            events.append(frame(0x7E5, f"11 {node:02X} 000000000000"))
            events.append(frame(0x7E5, "17 00 000000000000"))
            events.append(frame(0x7E5, "04 00 000000000000"))
    events.append(frame(0, "82 00"))
    events.extend(download(node, 0x1011, 1, b"load") for node in nodes)
    events.append(frame(0, "81 00"))
    return tuple(events)
