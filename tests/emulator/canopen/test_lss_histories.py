"""The LSS slave under any history of services (CiA 305): its state, its node-ID now and to come, and every answer."""

from __future__ import annotations

from canopen_bench import NODE, Bench
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen.lss import LssState

PROFILE = load_profile("cia402-full")
IDENTITY = (PROFILE.vendor_id, PROFILE.product_code, PROFILE.revision_number, NODE)
NONE = 0xFF
"""The node-ID of a node that has none."""


def answer(command: int, number: int = 0) -> tuple[int, bytes]:
    """A frame of the slave."""
    return (0x7E4, bytes((command,)) + number.to_bytes(4, "little") + bytes(3))


class Histories(RuleBasedStateMachine):
    """`configuring`, `active` and `pending` node-ID are the reference's."""

    configuring: bool
    active: int
    pending: int

    @initialize(node_id=st.sampled_from([NODE, NONE]))
    def power_on(self, node_id: int) -> None:
        self.bench = Bench(PROFILE, None, node_id)
        self.bench.device.power_on()
        self.configuring, self.active, self.pending = False, node_id, node_id
        assert self.bench.take() == self._boot_up()

    def _boot_up(self) -> list[tuple[int, bytes]]:
        return [] if self.active == NONE else [(0x700 + self.active, b"\x00")]

    def _said(self, *frame: int) -> list[tuple[int, bytes]]:
        self.bench.device.receive(0x7E5, bytes(frame) + bytes(8 - len(frame)))
        return self.bench.take()

    @rule()
    def switch_global_to_configuration(self) -> None:
        assert self._said(0x04, 1) == []
        self.configuring = True

    @rule()
    def switch_global_to_waiting(self) -> None:
        """A node without node-ID that has been given one boots with it."""
        said = self._said(0x04, 0)
        self.configuring = False
        boots = self.active == NONE and self.pending != NONE
        self.active = self.pending if boots else self.active
        assert said == (self._boot_up() if boots else [])

    @rule(mode=st.integers(2, 255))
    def switch_global_to_no_mode(self, mode: int) -> None:
        assert self._said(0x04, mode) == []

    @rule(wrong=st.sampled_from([None, None, 0, 1, 2, 3]), frames=st.integers(1, 4))
    def switch_selective(self, wrong: int | None, frames: int) -> None:
        """Four frames in turn, or fewer; one number may be another node's."""
        said: list[tuple[int, bytes]] = []
        for place in range(frames):
            number = IDENTITY[place] ^ (place == wrong)
            said += self._said(0x40 + place, *number.to_bytes(4, "little"))
        selected = not self.configuring and frames == 4 and wrong is None
        assert said == ([answer(0x44)] if selected else [])
        self.configuring |= selected

    @rule(node_id=st.integers(0, 255))
    def configure_node_id(self, node_id: int) -> None:
        said = self._said(0x11, node_id)
        if not self.configuring:
            assert said == []
            return
        valid = 1 <= node_id <= 127 or node_id == NONE
        assert said == [answer(0x11, 0 if valid else 1)]
        self.pending = node_id if valid else self.pending

    @rule(table=st.integers(0, 2), index=st.integers(0, 12))
    def configure_bit_timing(self, table: int, index: int) -> None:
        valid = table == 0 and index <= 8 and index != 5
        assert self._said(0x13, table, index) == ([answer(0x13, 0 if valid else 1)] if self.configuring else [])

    @rule()
    def store_without_a_place_to_store(self) -> None:
        assert self._said(0x17) == ([answer(0x17, 1)] if self.configuring else [])

    @rule(place=st.integers(0, 3))
    def inquire_the_address(self, place: int) -> None:
        assert self._said(0x5A + place) == ([answer(0x5A + place, IDENTITY[place])] if self.configuring else [])

    @rule()
    def inquire_the_node_id(self) -> None:
        """The one that it has, not the one to come."""
        assert self._said(0x5E) == ([answer(0x5E, self.active)] if self.configuring else [])

    @rule()
    def identify_non_configured(self) -> None:
        assert self._said(0x4C) == ([answer(0x50)] if self.active == NONE else [])

    @rule(low=st.integers(-1, 1), high=st.integers(-1, 1))
    def identify_a_range(self, low: int, high: int) -> None:
        """Of serial numbers about its own."""
        limits = (*IDENTITY[:2], IDENTITY[2], IDENTITY[2], NODE + low, NODE + high)
        frames = [(0x46 + place, *number.to_bytes(4, "little")) for place, number in enumerate(limits)]
        said = [answered for frame in frames for answered in self._said(*frame)]
        assert said == ([answer(0x4F)] if low <= 0 <= high else [])

    @rule()
    def fastscan(self) -> None:
        """Bit by bit from the top: a bit that nobody confirms as 0 is 1."""
        if not self._scanned(0, 0x80, 0, 0):
            assert self.active != NONE or self.configuring
            return
        assert self.active == NONE
        found = []
        for part in range(4):
            number = 0
            for bit in range(31, -1, -1):
                number |= 0 if self._scanned(number, bit, part, part) else 1 << bit
            assert self._scanned(number, 0, part, (part + 1) % 4)
            found.append(number)
        assert tuple(found) == IDENTITY
        self.configuring = True

    def _scanned(self, number: int, bit: int, part: int, following: int) -> bool:
        said = self._said(0x51, *number.to_bytes(4, "little"), bit, part, following)
        assert said in ([], [answer(0x4F)])
        return said != []

    @precondition(lambda self: self.active != NONE)
    @rule(command=st.sampled_from([0x81, 0x82]), to_all=st.booleans())
    def reset(self, command: int, to_all: bool) -> None:
        """Reset node or communication: the node takes the node-ID that it was given, and waits."""
        self.bench.device.receive(0x000, bytes((command, 0 if to_all else self.active)))
        self.active, self.configuring = self.pending, False
        assert self.bench.take() == self._boot_up()

    @invariant()
    def state_and_node_id_are_the_standard_s(self) -> None:
        device = self.bench.device
        assert device.lss is not None
        assert (device.lss.state is LssState.CONFIGURATION, device.node_id) == (self.configuring, self.active)


TestHistories = Histories.TestCase
TestHistories.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
