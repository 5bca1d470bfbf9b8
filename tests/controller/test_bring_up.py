"""Bring-up: what reaches the drives is what was asked, and what a drive refuses is told with axis and object."""

from __future__ import annotations

import time
from collections.abc import Callable

import can
import pytest
from canopen.sdo.client import SdoClient
from virtual_bench import VirtualBench

from drivetwin.bus.channel import InprocBus
from drivetwin.controller import bring_up as bring_up_module
from drivetwin.controller import link as link_module
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.link import Link
from drivetwin.controller.machine import POSITION_UNIT, load_machine
from drivetwin.controller.motion import enable_streaming
from drivetwin.controller.trouble import TroubleError
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen import NmtState
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError


@pytest.fixture(params=["servoone", "cia402-full"])
def scara(request: pytest.FixtureRequest) -> VirtualBench:
    return VirtualBench("scara", request.param).up()


def test_every_drive_is_operational_and_mapped_as_three_axes_fit_a_millisecond(scara: VirtualBench) -> None:
    setpoint = 0x60C1_0120 if scara.profile.name == "servoone" else 0x607A_0020
    for drive in scara.virtual.drives:
        od = drive.dictionary
        assert drive.device.nmt.state is NmtState.OPERATIONAL
        assert [od[0x1600, sub].value for sub in range(4)] == [3, 0x6040_0010, setpoint, 0x60B2_0010]
        assert [od[0x1A01, sub].value for sub in range(3)] == [2, 0x6064_0020, 0x21A3_0020]
        assert [od[0x1A00, sub].value for sub in range(2)] == [1, 0x6041_0010]
        assert (od[0x1400, 2].value, od[0x1801, 2].value) == (1, 1)
        valid = [index for index in (*range(0x1400, 0x1404), *range(0x1800, 0x1804)) if not od[index, 1].number >> 31]
        assert valid == [0x1400, 0x1800, 0x1801]
        assert od[0x1006].value == 1000
        assert (od[0x605A].value, od[0x605E].value) == (2, 2)


class Stalled:
    """The stage, which stalls for `STALL` [s] when it is asked for its serial number: all that it says then comes late."""

    STALL = 4.0 * bring_up_module.SECOND_ANSWER

    def __init__(self, transmit: Callable[[can.Message], None]) -> None:
        self._transmit = transmit
        self._held: list[can.Message] = []
        self._until: float | None = None
        described = load_virtual_machine("stage")
        effects = read_effects(described.effects_path)
        self._machine = VirtualMachine(described, load_profile("servoone"), effects, SyncClock(), 0, self._say)
        self._machine.power_on()

    def receive(self, message: can.Message) -> None:
        self._machine.receive(message)

    def poll(self) -> None:
        self._machine.poll()
        if not self._stalls:
            for message in self._held:
                self._transmit(message)
            self._held.clear()

    def wait(self) -> float | None:
        return 0.001 if self._held else None

    @property
    def _stalls(self) -> bool:
        return self._until is not None and time.monotonic() < self._until

    def _say(self, message: can.Message) -> None:
        if self._until is None and message.arbitration_id == 0x581 and message.data[1:4] == bytes((0x18, 0x10, 4)):
            self._until = time.monotonic() + self.STALL
        if self._stalls or self._held:
            self._held.append(message)
        else:
            self._transmit(message)


def test_an_answer_that_comes_late_is_not_taken_for_that_of_the_next_request() -> None:
    bus = InprocBus(Stalled)
    bus.shutdown()
    link = Link(bus)
    drives = connect(link, load_machine("stage"), load_profile("servoone"))
    bring_up(link, drives, 0.001)
    assert drives[0].read(0x1006) == 1000


def test_three_axes_take_less_than_a_millisecond_of_a_real_bus(scara: VirtualBench) -> None:
    """Bits on 1 Mbit/s with worst-case stuffing: 47 + 8 n, and a stuff bit per 4 after the first of 34 + 8 n bits."""
    enable_streaming(scara.cycle, scara.drives)
    for _ in range(3):
        scara.cycle.run()
    received: list[int] = []
    scara.link.log = lambda message: received.append(len(message.data))
    scara.cycle.run()
    bits = sum(47 + 8 * size + (34 + 8 * size - 1) // 4 for size in received)
    assert len(received) == 7
    assert bits == 865


def test_positions_go_through_the_drives_scaling_and_come_back(scara: VirtualBench) -> None:
    scara.cycle.run()
    for known, drive in zip(scara.drives, scara.virtual.drives, strict=True):
        motor = drive.axis.scaling
        for joint in (-0.3, 0.0, 0.123456789, 1.0):
            raw = known.in_units(joint)
            assert raw * known.unit == pytest.approx(joint, abs=0.5 * POSITION_UNIT * 1.001)
            turned = motor.angle(float(raw)) - motor.angle(0.0)
            assert turned == pytest.approx(joint * known.axis.gear_ratio, abs=known.axis.gear_ratio * POSITION_UNIT)


def test_an_acceleration_beyond_what_an_object_holds_is_the_largest_that_it_holds() -> None:
    """In 10 nrad/s² an UNSIGNED32 ends at 42.9 rad/s²; twice 30 rad/s² is more."""
    bench = VirtualBench("scara", "servoone")
    for known in bench.drives:
        known.axis = known.axis.model_copy(update={"max_acceleration": 30.0})
    bench.up()
    for drive in bench.virtual.drives:
        assert drive.dictionary[0x6085].value == 0xFFFF_FFFF
        assert drive.dictionary[0x6083].value == pytest.approx(3e9, abs=2)


def test_gears_of_controller_and_machine_are_one(scara: VirtualBench) -> None:
    for known, axis in zip(scara.drives, scara.virtual.machine.axes.values(), strict=True):
        assert known.axis.gear_ratio == pytest.approx(axis.gear_ratio, rel=1e-9)


def test_a_missing_node_is_named_with_those_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bring_up_module, "BOOT_TIMEOUT", 0.05)
    bench = VirtualBench("scara")
    bench.silent = {2}
    with pytest.raises(UserError, match=r"axis rotate \(node 2\) sent no boot-up.*nodes that did: 1, 3.*is 2 its node-ID"):
        bring_up(bench.link, bench.drives, 0.001)


def test_a_drive_that_falls_silent_during_configuration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(link_module.PumpedSdoClient, "RESPONSE_TIMEOUT", 0.05)
    bench = VirtualBench("scara")
    silence = bench.virtual.drives[1].dictionary[0x6085]
    silence.on_write = lambda _: bench.silent.add(2)
    with pytest.raises(UserError, match=r"axis rotate \(node 2\) does not answer on inproc \(writing \d+ to 6085h\)"):
        bring_up(bench.link, bench.drives, 0.001)


def refuse(_value: object) -> None:
    raise SdoAbort(AbortCode.VALUE_TOO_HIGH)


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
@pytest.mark.parametrize(
    ("index", "subindex", "expected"),
    [
        (0x6091, 1, r"writing 50 to 6091h:01 was aborted by the drive: Code 0x06090031, Value of parameter written too high"),
        (0x607F, 0, r"writing \d+ to 607Fh was aborted by the drive"),
        (0x1600, 1, r"mapping RxPDO1_node2 failed: Code 0x06090031"),
    ],
)
def test_an_abort_names_axis_object_and_reason(profile: str, index: int, subindex: int, expected: str) -> None:
    bench = VirtualBench("scara", profile)
    bench.virtual.drives[1].dictionary[index, subindex].on_write = refuse
    with pytest.raises(UserError, match=rf"axis rotate \(node 2\): {expected}"):
        bring_up(bench.link, bench.drives, 0.001)


def test_an_answer_of_a_wrong_length_is_trouble_of_that_node(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a bus with wrong bits makes it: three bytes for a statusword."""
    bench = VirtualBench("scara")
    monkeypatch.setattr(SdoClient, "upload", lambda *_: bytes(3))
    with pytest.raises(TroubleError, match=r"axis rotate \(node 2\): reading 6041h: the answer does not fit it") as trouble:
        bench.drives[1].read(0x6041)
    assert trouble.value.node == 2


def test_a_value_that_is_changed_silently_is_noticed() -> None:
    bench = VirtualBench("scara")
    bench.virtual.drives[2].dictionary[0x6092, 1].on_read = lambda: 4711
    with pytest.raises(UserError, match=r"axis stretch \(node 3\): wrote 628318531 to 6092h:01 and read back 4711"):
        bring_up(bench.link, bench.drives, 0.001)


def test_a_mapping_that_reads_back_different_is_noticed() -> None:
    bench = VirtualBench("scara")
    bench.virtual.drives[0].dictionary[0x1A01, 2].on_read = lambda: 0x6077_0010
    with pytest.raises(UserError, match=r"axis lift \(node 1\): TxPDO2_node1 was mapped to .* and reads back 6064h, 6077h"):
        bring_up(bench.link, bench.drives, 0.001)


def as_device(index: int, value: int) -> Callable[[VirtualBench], None]:
    def change(bench: VirtualBench) -> None:
        bench.virtual.drives[0].dictionary[index].on_read = lambda: value

    return change


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (as_device(0x1000, 0x00030191), r"is not a servo drive: device type 1000h is 00030191h"),
        (as_device(0x6502, 0x4), r"does not support mode 7 \(6502h is 00000004h\); choose the --profile"),
    ],
)
def test_another_device_is_not_configured(change: Callable[[VirtualBench], None], expected: str) -> None:
    bench = VirtualBench()
    change(bench)
    before = bench.virtual.drives[0].dictionary[0x6092, 1].value
    with pytest.raises(UserError, match=expected):
        bring_up(bench.link, bench.drives, 0.001)
    assert bench.virtual.drives[0].dictionary[0x6092, 1].value == before


def test_a_refused_write_leaves_the_old_value_and_the_transfer_closed() -> None:
    bench = VirtualBench().up()
    drive: DriveNode = bench.drives[0]
    bench.virtual.drives[0].dictionary[0x6085].on_write = refuse
    old = drive.read(0x6085)
    with pytest.raises(UserError, match="6085h was aborted"):
        drive.write(1, 0x6085)
    assert drive.read(0x6085) == old
