"""The wire between a drive and its bus: sound, bus off, error passive, lossy, silent; on a whole virtual machine."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen import NmtState
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.faults.frames_lost import FramesLost
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

HEARTBEAT, EMCY, SDO = 0x700, 0x80, 0x580
READ_DEVICE_TYPE = bytes.fromhex("40 00 10 00 00 00 00 00")


class Bench:
    """The three drives of the SCARA, and what they sent; the first one is the one with the faults."""

    def __init__(self, profile: str = "cia402-full", store: Path | None = None) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.machine = VirtualMachine(load_machine("scara"), load_profile(profile), (), SyncClock(), 0, self._note, store)
        self.machine.power_on()
        self.wire = self.machine.wires[0]
        self.node, self.other = (drive.device.node_id for drive in self.machine.drives[:2])
        self.take()

    def send(self, cob_id: int, data: bytes = b"") -> None:
        self.machine.receive(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))

    def sync(self, count: int) -> None:
        for _ in range(count):
            self.send(0x80)

    def answers(self, node: int) -> bool:
        """Whether a node answers an SDO request."""
        self.take()
        self.send(0x600 + node, READ_DEVICE_TYPE)
        return SDO + node in [cob_id for cob_id, _ in self.take()]

    def beats(self, count: int) -> list[int]:
        """Heartbeats of the two nodes in `count` cycles."""
        self.take()
        self.sync(count)
        ids = [cob_id for cob_id, _ in self.take()]
        return [ids.count(HEARTBEAT + self.node), ids.count(HEARTBEAT + self.other)]

    def take(self) -> list[tuple[int, bytes]]:
        frames, self.sent = self.sent, []
        return frames

    def _note(self, message: can.Message) -> None:
        self.sent.append((message.arbitration_id, bytes(message.data)))


def beating(period: int = 1) -> Bench:
    bench = Bench()
    for drive in bench.machine.drives:
        drive.dictionary[0x1017].write(period)
    return bench


def test_a_sound_wire_is_the_device_itself() -> None:
    bench = Bench()
    loss = FramesLost(bench.node, direction="received")
    loss.strike(bench.machine)
    assert bench.wire.receive != bench.wire.device.receive
    loss.end(bench.machine)
    assert bench.wire.receive == bench.wire.device.receive
    assert bench.wire.taker(0x600 + bench.node) == bench.wire.device.taker(0x600 + bench.node)


def test_bus_off_is_silent_until_recovery_and_the_others_are_not() -> None:
    bench = beating()
    bench.wire.bus_off()
    assert bench.beats(10) == [0, 10]
    assert (bench.answers(bench.node), bench.answers(bench.other)) == (False, True)
    bench.wire.recover()
    told = [data for cob_id, data in bench.take() if cob_id == EMCY + bench.node]
    assert told == [bytes.fromhex("40 81 11 00 00 00 00 00"), bytes(8)]
    assert bench.beats(10) == [10, 10]
    assert bench.answers(bench.node)


@pytest.mark.parametrize(
    ("reaction", "state"), [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)]
)
def test_bus_off_acts_by_1029h(reaction: int, state: NmtState) -> None:
    bench = Bench()
    bench.wire.device.od[0x1029, 1].write(reaction)
    bench.send(0, bytes((1, bench.node)))
    bench.wire.bus_off()
    assert bench.wire.device.nmt.state is state


def test_recovery_of_what_was_not_off_tells_nothing() -> None:
    bench = Bench()
    bench.wire.recover()
    assert bench.take() == []


def test_error_passive_is_told_and_frames_still_go() -> None:
    bench = Bench()
    bench.wire.error_passive()
    assert bench.take() == [(EMCY + bench.node, bytes.fromhex("20 81 11 00 00 00 00 00"))]
    assert bench.answers(bench.node)
    bench.wire.error_active()
    assert bench.take() == [(EMCY + bench.node, bytes(8))]


def test_every_nth_sent_frame_is_lost() -> None:
    bench = beating()
    loss = FramesLost(bench.node, every=4)
    loss.strike(bench.machine)
    assert bench.beats(20) == [15, 20]
    loss.end(bench.machine)
    assert bench.beats(20) == [20, 20]


def test_sent_frames_are_lost_with_a_probability_and_a_seed_repeats_it() -> None:
    kept = []
    for _ in range(2):
        bench = beating()
        FramesLost(bench.node, probability=0.25, seed=3).strike(bench.machine)
        kept.append(bench.beats(400)[0])
    assert kept[0] == kept[1]
    assert 260 < kept[0] < 340  # 300 expected, standard deviation 8.7


def test_received_frames_are_lost() -> None:
    bench = Bench()
    FramesLost(bench.node, direction="received", every=2).strike(bench.machine)
    assert [bench.answers(bench.node) for _ in range(4)] == [True, False, True, False]
    assert bench.answers(bench.other)


def test_a_lost_sync_is_a_cycle_without_a_tpdo() -> None:
    bench = Bench()
    for drive in bench.machine.drives:
        od = drive.dictionary
        od[0x1800, 1].write(od[0x1800, 1].number | 1 << 31)
        od[0x1800, 2].write(1)
        od[0x1800, 1].write(od[0x1800, 1].number & ~(1 << 31))
    bench.send(0, bytes((1, 0)))
    bench.take()
    FramesLost(bench.node, direction="received", every=2).strike(bench.machine)
    bench.sync(10)
    ids = [cob_id for cob_id, _ in bench.take()]
    assert [ids.count(0x180 + node) for node in (bench.node, bench.other)] == [5, 10]


def test_a_change_of_the_bit_rate_is_silent_for_two_delays() -> None:
    bench = beating()
    bench.send(0x7E5, b"\x04\x01" + bytes(6))
    bench.send(0x7E5, b"\x15\x05\x00" + bytes(5))
    assert bench.beats(30)[0] == 21  # not while 10 ms are not over


def test_a_silence_that_a_stray_frame_asks_for_is_said(caplog: pytest.LogCaptureFixture) -> None:
    """A switch delay has 16 bits of ms (CiA 305, 'activate bit timing'): a drive is deaf for up to 131 s, to resets as well."""
    bench = Bench()
    bench.send(0x7E5, b"\x04\x01" + bytes(6))
    bench.send(0x7E5, b"\x15\xe8\x03" + bytes(5))
    said = [record.getMessage() for record in caplog.records]
    assert f"node {bench.node}: LSS changes the bit rate, no frame goes or comes for 2 s" in said
    bench.send(0, b"\x81\x00")
    assert not bench.answers(bench.node)
    bench.sync(2001)
    assert bench.answers(bench.node)


def test_stored_parameters_of_a_machine_survive_its_power_cycle(tmp_path: Path) -> None:
    bench = Bench(store=tmp_path)
    dictionary = bench.machine.drives[0].dictionary
    gain = dictionary[0x60FB, 1]
    commissioned = float(gain.value)
    gain.write(commissioned * 0.5)
    dictionary[0x1010, 1].write(0x65766173)
    assert [path.name for path in tmp_path.iterdir()] == ["lift.json"]
    again = Bench(store=tmp_path).machine.drives
    assert again[0].dictionary[0x60FB, 1].value == commissioned * 0.5
    assert again[0].axis.servo.parameters["position_gain"] == commissioned * 0.5
    again[0].dictionary[0x1011, 1].write(0x64616F6C)
    assert Bench(store=tmp_path).machine.drives[0].dictionary[0x60FB, 1].value == commissioned
