"""LSS slave: switch, configure, store, inquire, identify, fastscan (CiA 305), by canopen's LssMaster and byte by byte."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from canopen.lss import LssError, LssMaster
from canopen_bench import NODE, RESET_COMMUNICATION, RESET_NODE, START, STOP, Bench, Master

from drivetwin.drive_profiles import available_profiles, load_profile
from drivetwin.emulator.canopen import NmtState, ParameterStore
from drivetwin.emulator.canopen.lss import UNCONFIGURED, LssState

PROFILE = load_profile("cia402-full")
IDENTITY = (PROFILE.vendor_id, PROFILE.product_code, PROFILE.revision_number, NODE)
WAITING, CONFIGURATION = LssMaster.WAITING_STATE, LssMaster.CONFIGURATION_STATE


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """The master waits for slow devices and for answers that do not come; here an answer is there at once."""
    monkeypatch.setattr("canopen.lss.time.sleep", lambda _seconds: None)
    monkeypatch.setattr(LssMaster, "RESPONSE_TIMEOUT", 0.001)


def connect(node_id: int = NODE, store: ParameterStore | None = None) -> tuple[Bench, LssMaster]:
    bench = Bench(PROFILE, store, node_id)
    master = Master(bench)
    bench.device.power_on()
    return bench, master.lss


def configuring(store: ParameterStore | None = None) -> tuple[Bench, LssMaster]:
    bench, lss = connect(store=store)
    bench.take()
    lss.send_switch_state_global(CONFIGURATION)
    return bench, lss


def state(bench: Bench) -> LssState:
    assert bench.device.lss is not None
    return bench.device.lss.state


def test_switch_global() -> None:
    bench, lss = connect()
    assert state(bench) is LssState.WAITING
    lss.send_switch_state_global(CONFIGURATION)
    assert state(bench) is LssState.CONFIGURATION
    lss.send_switch_state_global(WAITING)
    assert state(bench) is LssState.WAITING


def test_switch_selective() -> None:
    bench, lss = connect()
    assert lss.send_switch_state_selective(*IDENTITY)
    assert state(bench) is LssState.CONFIGURATION


@pytest.mark.parametrize("part", range(4))
def test_another_address_is_not_selected(part: int) -> None:
    bench, lss = connect()
    other = [number + (place == part) for place, number in enumerate(IDENTITY)]
    with pytest.raises(LssError):
        lss.send_switch_state_selective(*other)
    assert state(bench) is LssState.WAITING


def test_inquire_address_and_node_id() -> None:
    _, lss = configuring()
    assert tuple(lss.inquire_lss_address(command) for command in range(0x5A, 0x5E)) == IDENTITY
    assert lss.inquire_node_id() == NODE


def test_nothing_is_configured_while_waiting() -> None:
    bench, lss = connect()
    bench.take()
    configure: Callable[[], object] = partial(lss.configure_node_id, 9)
    for request in (configure, lss.inquire_node_id, lss.store_configuration):
        with pytest.raises(LssError):
            request()
    assert bench.take() == []


def test_a_new_node_id_is_taken_at_reset_communication() -> None:
    bench, lss = configuring()
    lss.configure_node_id(9)
    lss.send_switch_state_global(WAITING)
    assert bench.device.node_id == NODE
    bench.nmt(RESET_COMMUNICATION)
    assert (bench.device.node_id, state(bench)) == (9, LssState.WAITING)
    assert bench.take()[-1] == (0x709, b"\x00")
    bench.device.receive(0x609, bytes.fromhex("40 00 18 01 00 00 00 00"))
    assert bench.take() == [(0x589, bytes.fromhex("43 00 18 01 89 01 00 00"))]
    assert bench.od[0x1014].value == 0x89
    assert bench.od[0x1018, 4].value == NODE  # the identity stays
    bench.nmt(START)
    passed = [bench.device.nmt.state]
    bench.nmt(START, node=9)
    passed.append(bench.device.nmt.state)
    assert passed == [NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL]


@pytest.mark.parametrize("node_id", [0, 128, 200, 254])
def test_a_node_id_out_of_range_is_refused(node_id: int) -> None:
    bench, lss = configuring()
    with pytest.raises(LssError, match="LSS Error: 1"):
        lss.configure_node_id(node_id)
    bench.nmt(RESET_COMMUNICATION)
    assert bench.device.node_id == NODE


@pytest.mark.parametrize("index", [0, 1, 2, 3, 4, 6, 7, 8])
def test_bit_timing_of_the_standard_table(index: int) -> None:
    bench, lss = configuring()
    lss.configure_bit_timing(index)
    assert bench.device.lss is not None
    assert bench.device.lss.bit_timing == index


@pytest.mark.parametrize("frame", ["13 00 05", "13 00 09", "13 00 0A", "13 01 00"])
def test_other_bit_timings_are_refused(frame: str) -> None:
    bench, _ = configuring()
    bench.device.receive(0x7E5, bytes.fromhex(frame) + bytes(5))
    assert bench.take() == [(0x7E4, bytes.fromhex("13 01 00 00 00 00 00 00"))]


def test_activating_a_bit_timing_asks_for_silence_of_two_delays() -> None:
    bench, lss = configuring()
    silent: list[float] = []
    assert bench.device.lss is not None
    bench.device.lss.on_bit_timing.append(silent.append)
    lss.activate_bit_timing(100)
    assert silent == [pytest.approx(0.2)]


def test_stored_configuration_survives_a_power_cycle(tmp_path: Path) -> None:
    _, lss = configuring(ParameterStore(tmp_path / "drive.json"))
    lss.configure_node_id(9)
    lss.configure_bit_timing(2)
    lss.store_configuration()
    again, _ = connect(store=ParameterStore(tmp_path / "drive.json"))
    assert again.take() == [(0x709, b"\x00")]
    assert again.device.lss is not None
    assert again.device.lss.bit_timing == 2


def test_without_a_store_storing_is_not_supported() -> None:
    _, lss = configuring()
    with pytest.raises(LssError, match="LSS Error: 1"):
        lss.store_configuration()


def test_a_store_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    _, lss = configuring(ParameterStore(tmp_path / "drive.json"))
    (tmp_path / ".drive.json.part").mkdir()
    with pytest.raises(LssError, match="LSS Error: 2"):
        lss.store_configuration()


IDENTIFIED = [(0x7E4, b"\x4f" + bytes(7))]


def in_range(bench: Bench, lss: LssMaster, revision: tuple[int, int], serial: tuple[int, int]) -> bool:
    bench.take()
    lss.send_identify_remote_slave(*IDENTITY[:2], *revision, *serial)
    told = bench.take()
    assert told in ([], IDENTIFIED)
    return told == IDENTIFIED


def test_identify_remote_slave() -> None:
    bench, lss = connect()
    revision = IDENTITY[2]
    assert in_range(bench, lss, (revision, revision), (NODE, NODE))
    assert in_range(bench, lss, (0, 2**32 - 1), (0, 2**32 - 1))
    assert not in_range(bench, lss, (revision + 1, revision + 2), (NODE, NODE))
    assert not in_range(bench, lss, (revision, revision), (0, NODE - 1))


def test_a_series_out_of_turn_is_nothing() -> None:
    bench, _ = connect()
    bench.take()
    for command, number in ((0x40, IDENTITY[0]), (0x42, IDENTITY[2]), (0x43, IDENTITY[3])):
        bench.device.receive(0x7E5, bytes((command,)) + number.to_bytes(4, "little") + bytes(3))
    assert bench.take() == []
    assert state(bench) is LssState.WAITING


def test_only_a_node_without_node_id_says_so() -> None:
    bench, lss = connect()
    bench.take()
    lss.send_identify_non_configured_remote_slave()
    assert bench.take() == []
    bench, lss = connect(UNCONFIGURED)
    lss.send_identify_non_configured_remote_slave()
    assert bench.take() == [(0x7E4, b"\x50" + bytes(7))]


def test_a_node_without_node_id_does_nothing_but_lss() -> None:
    bench, _ = connect(UNCONFIGURED)
    for node in (0, NODE, 0xFF):
        bench.nmt(START, node=node)
    for cob_id in (0x600 + NODE, 0x6FF, 0x200 + NODE, 0x100):
        bench.device.receive(cob_id, bytes.fromhex("40 00 10 00 00 00 00 00"))
    bench.device.receive(0x700 + NODE, b"", remote=True)
    bench.device.sync()
    bench.device.emergency.raise_error(0x1000, 0)
    assert bench.run_to(1.0) == []
    assert bench.take() == []
    assert bench.device.nmt.state is NmtState.INITIALISING


def test_fastscan_finds_it_and_it_boots_with_its_new_node_id() -> None:
    bench, lss = connect(UNCONFIGURED)
    assert lss.fast_scan() == (True, list(IDENTITY))
    assert state(bench) is LssState.CONFIGURATION
    assert lss.inquire_node_id() == UNCONFIGURED
    lss.configure_node_id(42)
    bench.take()
    lss.send_switch_state_global(WAITING)
    assert bench.take() == [(0x700 + 42, b"\x00")]
    assert bench.device.nmt.state is NmtState.PRE_OPERATIONAL
    bench.nmt(RESET_NODE, node=42)
    assert bench.take() == [(0x700 + 42, b"\x00")]


def test_fastscan_does_not_find_a_configured_node() -> None:
    assert connect()[1].fast_scan() == (False, None)


class TwoDevices(Master):
    """A master of two devices on one wire."""

    def __init__(self, benches: tuple[Bench, Bench]) -> None:
        super().__init__(benches[0])
        benches[1].master = self
        self._both = benches

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        for bench in self._both:
            bench.device.receive(can_id, bytes(data), remote)


def test_fastscan_tells_two_nodes_apart() -> None:
    benches = (Bench(PROFILE, None, UNCONFIGURED), Bench(PROFILE, None, UNCONFIGURED))
    benches[1].od[0x1018, 4].commission(NODE + 0x0102_0000)
    benches[1].device.add_lss()
    lss = TwoDevices(benches).lss
    for bench in benches:
        bench.device.power_on()
    for bench, node_id in zip(benches, (21, 22), strict=True):
        found, identity = lss.fast_scan()
        assert (found, identity[3]) == (True, bench.od[0x1018, 4].value)
        lss.configure_node_id(node_id)
        lss.send_switch_state_global(WAITING)
    assert [bench.device.node_id for bench in benches] == [21, 22]
    assert lss.fast_scan() == (False, None)


def test_taking_the_node_id_away() -> None:
    bench, lss = configuring()
    lss.configure_node_id(UNCONFIGURED)
    bench.take()
    bench.nmt(RESET_COMMUNICATION)
    assert bench.take() == []
    assert lss.fast_scan()[0]


@pytest.mark.parametrize("command", [STOP, START])
def test_lss_works_in_every_nmt_state(command: bytes) -> None:
    bench, lss = connect()
    bench.nmt(command)
    lss.send_switch_state_global(CONFIGURATION)
    assert lss.inquire_node_id() == NODE


@pytest.mark.parametrize("data", [b"", b"\x04\x01", bytes(7), b"\xff" + bytes(7)])
def test_other_frames_are_ignored(data: bytes) -> None:
    bench, _ = connect()
    bench.take()
    bench.device.receive(0x7E5, data)
    assert bench.take() == []
    assert state(bench) is LssState.WAITING


@pytest.mark.parametrize("name", available_profiles())
def test_only_drive_types_that_have_lss_answer(name: str) -> None:
    profile = load_profile(name)
    bench = Bench(profile).boot()
    bench.device.receive(0x7E5, b"\x04\x01" + bytes(6))
    bench.device.receive(0x7E5, b"\x5e" + bytes(7))
    assert bool(bench.take()) is profile.lss
    assert not load_profile("servoone").lss
