"""One device on a wire of this process, with a simulated clock; a foreign master may sit on the other end."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

import canopen
from canopen.objectdictionary import ODRecord, ODVariable

from drivetwin.drive_profiles import DriveProfile, ObjectEntry, load_profile
from drivetwin.emulator.canopen import Device, NmtState, ObjectDictionary, ParameterStore

NODE = 5
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = b"\x01", b"\x02", b"\x80", b"\x81", b"\x82"


class Bench:
    """A device, its clock `time` [s], and every frame it sent as (CAN-ID, data)."""

    def __init__(
        self, profile: str | DriveProfile = "cia402-full", store: ParameterStore | None = None, node_id: int = NODE
    ) -> None:
        self.profile = load_profile(profile) if isinstance(profile, str) else profile
        self.time = 0.0
        self.sent: list[tuple[int, bytes]] = []
        self.master: Master | None = None
        self.od = ObjectDictionary.from_profile(self.profile, NODE)
        self.device = Device(node_id, self.od, self._transmit, lambda: self.time, store)
        if self.profile.lss:
            self.device.add_lss()

    def boot(self) -> Bench:
        """Power on; the boot-up frame is taken from the list."""
        self.device.power_on()
        self.take()
        return self

    def operational(self) -> Bench:
        """Boot and start."""
        self.boot().nmt(START)
        assert self.device.nmt.state is NmtState.OPERATIONAL
        return self

    def nmt(self, command: bytes, node: int = NODE) -> None:
        """An NMT command on the bus."""
        self.device.receive(0, command + bytes((node,)))

    def take(self) -> list[tuple[int, bytes]]:
        """Frames sent since the last call."""
        frames, self.sent = self.sent, []
        return frames

    def sdo(self, request: str) -> str:
        """The answer to an SDO request, both in hex; one frame exactly."""
        self.device.receive(0x600 + NODE, bytes.fromhex(request))
        ((cob_id, data),) = self.take()
        assert cob_id == 0x580 + NODE
        return data.hex(" ").upper()

    def write(self, index: int, subindex: int, value: int) -> None:
        """Write as an SDO does; raises SdoAbort."""
        self.od.find(index, subindex).write(value)

    def map_pdo(self, communication: int, mapped: Iterable[int], transmission_type: int, **times: int) -> None:
        """Configure a PDO by disable, write, enable. `times` are `inhibit` [100 us] and `event` [ms]."""
        mapping = communication + 0x200
        cob_id = self.od[communication, 1].number & 0x7FF
        self.write(communication, 1, cob_id | 1 << 31)
        self.write(communication, 2, transmission_type)
        for subindex, name in ((3, "inhibit"), (5, "event")):
            if name in times:
                self.write(communication, subindex, times[name])
        self.write(mapping, 0, 0)
        entries = list(mapped)
        for subindex, entry in enumerate(entries, start=1):
            self.write(mapping, subindex, entry)
        self.write(mapping, 0, len(entries))
        self.write(communication, 1, cob_id)

    def run_to(self, time: float, step: float = 1e-3) -> list[tuple[float, int, bytes]]:
        """Move time in steps as the emulator does; frames with the time of the tick that sent them [s]."""
        frames = []
        while self.time < time - step / 2:
            self.time += step
            self.device.tick(self.time)
            frames += [(round(self.time, 9), *frame) for frame in self.take()]
        return frames

    def _transmit(self, cob_id: int, data: bytes) -> None:
        self.sent.append((cob_id, data))
        if self.master is not None:
            self.master.notify(cob_id, bytearray(data), self.time)


class Master(canopen.Network):
    """`canopen` as the master of a bench: what it sends reaches the device at once."""

    def __init__(self, bench: Bench) -> None:
        super().__init__()
        self._bench = bench
        bench.master = self

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Deliver a frame of the master."""
        device = self._bench.device
        if can_id == device.sync_cob_id:
            device.sync()
        else:
            device.receive(can_id, bytes(data), remote)


def foreign_dictionary(profile: DriveProfile) -> canopen.ObjectDictionary:
    """The profile as `canopen` has an object dictionary."""
    dictionary = canopen.ObjectDictionary()
    dictionary.node_id = NODE
    for index, group in groupby(profile.objects, key=lambda entry: entry.index):
        entries = list(group)
        if "." not in entries[0].name:
            dictionary.add_object(_foreign_variable(entries[0], entries[0].name))
            continue
        record = ODRecord(entries[0].name.partition(".")[0], index)
        for entry in entries:
            record.add_member(_foreign_variable(entry, entry.name.partition(".")[2]))
        dictionary.add_object(record)
    return dictionary


def _foreign_variable(entry: ObjectEntry, name: str) -> ODVariable:
    variable = ODVariable(name, entry.index, entry.subindex)
    variable.data_type = int(entry.data_type)
    variable.access_type = str(entry.access)
    variable.pdo_mappable = entry.rpdo or entry.tpdo
    return variable
