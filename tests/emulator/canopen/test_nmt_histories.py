"""The NMT slave under any history of commands, resets, SDOs and time: CiA 301, 7.3.2, figure of the states and table 38."""

from __future__ import annotations

from canopen_bench import NODE, Bench
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from drivetwin.emulator.canopen import NmtState

STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x04, 0x05, 0x7F
"""As heartbeat tells them (7.2.8.3.2.2)."""

GOES_TO = {0x01: OPERATIONAL, 0x02: STOPPED, 0x80: PRE_OPERATIONAL, 0x81: PRE_OPERATIONAL, 0x82: PRE_OPERATIONAL}
RESETS = (0x81, 0x82)
HEARTBEAT = 0x700 + NODE
BOOT_UP = (HEARTBEAT, b"\x00")


class Histories(RuleBasedStateMachine):
    """`state` and `period` [s] of heartbeat are the reference's."""

    def __init__(self) -> None:
        super().__init__()
        self.bench = Bench()
        self.state, self.period = 0x00, 0.0

    @initialize()
    def power_on(self) -> None:
        self.bench.device.power_on()
        assert self.bench.take() == [BOOT_UP]
        self.state = PRE_OPERATIONAL

    @rule(
        command=st.one_of(st.sampled_from(sorted(GOES_TO)), st.integers(0, 0xFF)),
        node=st.sampled_from([0, NODE, NODE + 1, 0x7F, 0xFF]),
        more=st.sampled_from([b"", b"", b"", b"\x00"]),
    )
    def a_command_of_the_master(self, command: int, node: int, more: bytes) -> None:
        self.bench.device.receive(0x000, bytes((command, node)) + more)
        sent = self.bench.take()
        if more or node not in (0, NODE) or command not in GOES_TO:
            assert sent == []
            return
        self.state = GOES_TO[command]
        if command in RESETS:
            self.period = 0.0  # 1017h has its value at power-on again
            assert sent == [BOOT_UP]
        else:
            assert sent == []

    @rule()
    def an_sdo_is_answered_where_sdo_works(self) -> None:
        self.bench.device.receive(0x600 + NODE, bytes.fromhex("40 17 10 00 00 00 00 00"))
        milliseconds = round(1000.0 * self.period)
        answer = (0x580 + NODE, bytes.fromhex("4B 17 10 00") + milliseconds.to_bytes(4, "little"))
        assert self.bench.take() == ([] if self.state == STOPPED else [answer])

    @precondition(lambda self: self.state != STOPPED)
    @rule(milliseconds=st.sampled_from([0, 10, 100]))
    def heartbeat_is_configured(self, milliseconds: int) -> None:
        self.bench.device.receive(0x600 + NODE, bytes.fromhex("2B 17 10 00") + milliseconds.to_bytes(4, "little"))
        sent = [frame for frame in self.bench.take() if frame[0] != HEARTBEAT]
        assert sent == [(0x580 + NODE, bytes.fromhex("60 17 10 00 00 00 00 00"))]
        self.period = milliseconds / 1000.0

    @rule(seconds=st.sampled_from([0.005, 0.05, 0.25]))
    def time_passes(self, seconds: float) -> None:
        """Heartbeats tell the state, at their period, and no other frame comes by itself outside of operational."""
        frames = self.bench.run_to(self.bench.time + seconds)
        beats = [data for _, cob_id, data in frames if cob_id == HEARTBEAT]
        assert all(data == bytes((self.state,)) for data in beats)
        expected = seconds / self.period if self.period else 0.0
        assert abs(len(beats) - expected) <= (1.0 if self.period else 0.0)
        assert self.state == OPERATIONAL or len(frames) == len(beats)

    @rule()
    def a_sync_brings_pdos_in_operational_alone(self) -> None:
        self.bench.device.sync()
        assert self.state == OPERATIONAL or self.bench.take() == []
        self.bench.take()

    @rule()
    def an_lss_question_is_heard_in_every_state(self) -> None:
        """CiA 305: LSS works whatever the NMT state; identify non-configured is not for a node that has a node-ID."""
        self.bench.device.receive(0x7E5, b"\x4c" + bytes(7))
        assert self.bench.take() == []

    @invariant()
    def the_state_is_the_standard_s(self) -> None:
        assert self.bench.device.nmt.state is NmtState(self.state)


TestHistories = Histories.TestCase
TestHistories.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
