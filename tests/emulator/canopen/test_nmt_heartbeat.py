"""NMT states, what works in them, boot-up and heartbeat (CiA 301, 7.2.8 and 7.3.2)."""

import pytest
from canopen_bench import (
    NODE,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    START,
    STOP,
    Bench,
)

from drivetwin.emulator.canopen import NmtState

READ_DEVICE_TYPE = bytes.fromhex("40 00 10 00 00 00 00 00")
HEARTBEAT = 0x700 + NODE


def test_boot_up_then_pre_operational() -> None:
    bench = Bench()
    bench.device.receive(0x600 + NODE, READ_DEVICE_TYPE)
    assert bench.take() == []
    bench.device.power_on()
    assert bench.take() == [(HEARTBEAT, b"\x00")]
    assert bench.device.nmt.state is NmtState.PRE_OPERATIONAL


COMMANDS = [(START, NmtState.OPERATIONAL), (STOP, NmtState.STOPPED), (PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL)]


@pytest.mark.parametrize(("first", "between"), COMMANDS)
@pytest.mark.parametrize(("second", "after"), COMMANDS)
def test_every_state_reaches_every_other(first: bytes, between: NmtState, second: bytes, after: NmtState) -> None:
    bench = Bench().boot()
    bench.nmt(first)
    assert bench.device.nmt.state is between
    bench.nmt(second, node=0)
    assert bench.device.nmt.state is after


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x01\x06", b"\x03\x05", b"\x01\x05\x00"])
def test_what_is_not_a_command_to_this_node_is_ignored(data: bytes) -> None:
    bench = Bench().boot()
    bench.device.receive(0, data)
    assert bench.device.nmt.state is NmtState.PRE_OPERATIONAL


def test_stopped_answers_no_sdo_and_sends_no_pdo_nor_emergency() -> None:
    bench = Bench().operational()
    bench.nmt(STOP)
    bench.device.receive(0x600 + NODE, READ_DEVICE_TYPE)
    bench.device.receive(0x200 + NODE, b"\x06\x00")
    bench.device.emergency.raise_error(0x1000, 0)
    bench.device.sync()
    bench.run_to(0.1)
    assert bench.take() == []
    assert bench.od[0x6040].value == 0


def test_pre_operational_has_no_pdo() -> None:
    bench = Bench().boot()
    bench.device.receive(0x200 + NODE, b"\x06\x00")
    assert bench.od[0x6040].value == 0
    assert bench.run_to(0.01) == []


@pytest.mark.parametrize("command", [RESET_NODE, RESET_COMMUNICATION])
def test_reset_boots_again_with_power_on_communication(command: bytes) -> None:
    bench = Bench().operational()
    bench.write(0x1017, 0, 50)
    bench.write(0x1800, 1, 0x8000_0185)
    bench.nmt(command)
    assert bench.take() == [(HEARTBEAT, b"\x00")]
    assert bench.device.nmt.state is NmtState.PRE_OPERATIONAL
    assert bench.od[0x1017].value == 0
    assert bench.od[0x1800, 1].value == 0x180 + NODE
    bench.nmt(START)
    assert [frame[1:] for frame in bench.run_to(0.2)] == [(0x180 + NODE, b"\x00\x00")]


def test_only_reset_node_resets_the_application() -> None:
    bench = Bench().boot()
    told: list[str] = []
    bench.device.on_reset_application.append(lambda: told.append("reset"))
    bench.od[0x60F9, 1].commission(2.5)
    bench.write(0x60F9, 1, 4)
    bench.nmt(RESET_COMMUNICATION)
    assert (bench.od[0x60F9, 1].value, told) == (4, [])
    bench.nmt(RESET_NODE)
    assert (bench.od[0x60F9, 1].value, told) == (2.5, ["reset"])


def test_state_changes_are_told_in_order() -> None:
    bench = Bench()
    states: list[NmtState] = []
    bench.device.nmt.on_change.append(states.append)
    bench.operational()
    bench.nmt(START)
    bench.nmt(RESET_COMMUNICATION)
    assert states == [
        NmtState.PRE_OPERATIONAL,
        NmtState.OPERATIONAL,
        NmtState.INITIALISING,
        NmtState.PRE_OPERATIONAL,
    ]


def test_heartbeat_on_the_simulated_clock() -> None:
    bench = Bench().boot()
    bench.run_to(0.005)
    bench.sdo("2B 17 10 00 0A 00 00 00")
    assert bench.run_to(0.036, step=125e-6) == [(t, HEARTBEAT, b"\x7f") for t in (0.015, 0.025, 0.035)]
    bench.nmt(START)
    assert (0.045, HEARTBEAT, b"\x05") in bench.run_to(0.046)
    bench.nmt(STOP)
    assert bench.run_to(0.056) == [(0.055, HEARTBEAT, b"\x04")]


def test_heartbeat_does_not_drift_in_a_long_run() -> None:
    bench = Bench().boot()
    bench.write(0x1017, 0, 7)
    frames = bench.run_to(7.0005)
    assert len(frames) == 1000
    assert frames[-1][0] == pytest.approx(7.0, abs=1e-6)


def test_heartbeat_stops_with_0() -> None:
    bench = Bench().boot()
    bench.write(0x1017, 0, 10)
    bench.write(0x1017, 0, 0)
    assert bench.run_to(0.1) == []
