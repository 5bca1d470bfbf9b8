"""The three drives of the SCARA in lockstep, commanded by frames as any master does; what they sent, and the plant's truth."""

from __future__ import annotations

from pathlib import Path

import can

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import PlacedEffect, read_effects
from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.library import read_fault
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

EMCY, TPDO_1, SDO_ANSWER, SDO_REQUEST, HEARTBEAT = 0x080, 0x180, 0x580, 0x600, 0x700
LIFT, ROTATE, STRETCH = 1, 2, 3
NODES = (LIFT, ROTATE, STRETCH)
SIZES = {0x6040: 2, 0x6060: 1, 0x1017: 2, 0x605E: 2, 0x6085: 4, 0x6083: 4, 0x6084: 4, 0x60FF: 4, 0x1029: 1, 0x1006: 4}
PROFILE_VELOCITY = 3
SHUTDOWN, SWITCH_ON, ENABLE, FAULT_RESET = 0x06, 0x07, 0x0F, 0x80
STATE_MASK = 0x6F
SWITCH_ON_DISABLED, READY, ENABLED, FAULT = 0x40, 0x21, 0x27, 0x08
TURN = 1 << 20
"""Encoder increments a motor turn, the units of a drive that is not scaled."""
SPEED, RAMP = 4 * TURN, 40 * TURN
"""Four motor turns a second: 0.5 rad/s of the axes with a gear of 50; reached within 0.1 s."""


class FaultBench:
    """Powered on, pre-operational. `sent` has every frame of the drives since the last `take`."""

    def __init__(
        self, profile: str = "servoone", store: Path | None = None, more: tuple[PlacedEffect, ...] = ()
    ) -> None:
        """`more` are effects beside the machine's own."""
        machine = load_machine("scara")
        effects = (*read_effects(machine.effects_path), *more)
        self.sent: list[can.Message] = []
        self.virtual = VirtualMachine(machine, load_profile(profile), effects, SyncClock(), 0, self.sent.append, store)
        self.virtual.power_on()
        self.take()

    # -- the master's side --------------------------------------------------------------------------------------------

    def send(self, cob_id: int, data: bytes = b"") -> None:
        self.virtual.receive(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))

    def sync(self, count: int = 1) -> None:
        for _ in range(count):
            self.send(0x80)

    def take(self, cob_id: int | None = None) -> list[bytes]:
        """Data of the frames since the last call, of one COB-ID or of all."""
        frames = [bytes(frame.data) for frame in self.sent if cob_id in (None, frame.arbitration_id)]
        self.sent.clear()
        return frames

    def write(self, node: int, index: int, value: int, subindex: int = 0) -> None:
        """SDO download."""
        size = SIZES[index]
        command = 0x23 | (4 - size) << 2
        address = index.to_bytes(2, "little") + bytes((subindex,))
        self.send(SDO_REQUEST + node, bytes((command,)) + address + value.to_bytes(4, "little", signed=value < 0))
        answer = self._answer(node)
        assert answer is not None, f"node {node} does not answer"
        assert answer[0] == 0x60, answer.hex(" ")

    def read(self, node: int, index: int, subindex: int = 0, signed: bool = False) -> int | None:
        """SDO upload; None where no answer comes."""
        self.send(SDO_REQUEST + node, b"\x40" + index.to_bytes(2, "little") + bytes((subindex,)) + bytes(4))
        answer = self._answer(node)
        if answer is None:
            return None
        assert answer[0] & 0xE3 == 0x43, answer.hex(" ")
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little", signed=signed)

    def _answer(self, node: int) -> bytes | None:
        """Of an SDO server; the other frames stay."""
        for frame in self.sent:
            if frame.arbitration_id == SDO_ANSWER + node:
                self.sent.remove(frame)
                return bytes(frame.data)
        return None

    def start(self) -> None:
        """NMT start of all nodes."""
        self.send(0x000, b"\x01\x00")

    def position_at_every_sync(self, profile_tpdo: int = 0x1802) -> None:
        """TPDO 3 of the CiA 402-2 defaults (statusword and position, at every SYNC), as the master enables it."""
        for drive in self.virtual.drives:
            cob_id = drive.dictionary[profile_tpdo, 1]
            cob_id.write(cob_id.number & 0x7FF)

    def state(self, node: int) -> int:
        """State bits of the statusword."""
        word = self.read(node, 0x6041)
        assert word is not None
        return word & (0x4F if word & 0x4F in (0x00, 0x40, 0x0F, 0x08) else STATE_MASK)

    def enable(self, *nodes: int) -> None:
        """Enable at standstill in profile velocity mode, with ramps."""
        for node in nodes:
            for index, value in ((0x6060, PROFILE_VELOCITY), (0x6083, RAMP), (0x6084, RAMP), (0x6085, RAMP), (0x60FF, 0)):
                self.write(node, index, value)
            for controlword in (SHUTDOWN, SWITCH_ON, ENABLE):
                self.write(node, 0x6040, controlword)
                self.sync()
            assert self.state(node) == ENABLED

    def move(self, *nodes: int) -> None:
        """Bring enabled axes to SPEED."""
        for node in nodes:
            self.write(node, 0x60FF, SPEED)
        self.sync(200)
        self.take()

    def emergencies(self, node: int) -> list[int]:
        """EMCY codes since the last call; other frames are forgotten."""
        return [int.from_bytes(data[:2], "little") for data in self.take(EMCY + node)]

    # -- faults and truth ---------------------------------------------------------------------------------------------

    def strike(self, fault: str, **parameters: object) -> Fault:
        """Strike a fault by its name."""
        struck = read_fault({"fault": fault, **parameters})
        struck.strike(self.virtual)
        return struck

    def end(self, fault: Fault) -> None:
        fault.end(self.virtual)

    def speed(self, node: int) -> float:
        """True joint speed [rad/s or m/s]."""
        return float(self.virtual.plant.joint_velocities()[node - 1])

    def position(self, node: int) -> float:
        """True joint position [rad or m]."""
        return float(self.virtual.plant.joint_positions()[node - 1])

    def torque(self, node: int) -> float:
        """True motor torque [N·m]."""
        return float(self.virtual.plant.motor_torque[node - 1])


def moving(profile: str = "servoone", *nodes: int) -> FaultBench:
    """A bench whose axes (rotate and stretch, unless told) move at SPEED."""
    bench = FaultBench(profile)
    bench.start()
    bench.enable(*(nodes or (ROTATE, STRETCH)))
    bench.move(*(nodes or (ROTATE, STRETCH)))
    return bench
