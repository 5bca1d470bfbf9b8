"""The FSA of CiA 402-2 under any history of controlwords, faults and ramps, against the standard's numbered transitions."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from drivetwin.emulator.drive.state_machine import State, StateMachine, Stop

OFF, READY, ON, RUN = State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.SWITCHED_ON, State.OPERATION_ENABLED
QUICK, REACTION, FAULT = State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE, State.FAULT

COMMANDS = {
    "disable voltage": (0b0010, 0b0000),
    "quick stop": (0b0110, 0b0010),
    "shutdown": (0b0111, 0b0110),
    "switch on": (0b1111, 0b0111),
    "enable operation": (0b1111, 0b1111),
}
"""Table 'Command coding': the bits of 6040h that decide, and their values."""

TRANSITIONS = {
    2: (OFF, "shutdown", READY),
    3: (READY, "switch on", ON),
    4: (ON, "enable operation", RUN),
    5: (RUN, "switch on", ON),
    6: (ON, "shutdown", READY),
    7: (READY, "disable voltage or quick stop", OFF),
    8: (RUN, "shutdown", READY),
    9: (RUN, "disable voltage", OFF),
    10: (ON, "disable voltage or quick stop", OFF),
    11: (RUN, "quick stop", QUICK),
    12: (QUICK, "disable voltage", OFF),
    16: (QUICK, "enable operation", RUN),
}
"""Figure 'FSA'. 13, 14 and 15 are of faults; 3 and 4 may be one (table 'Transition events and actions', note)."""

RAMPS = {5: Stop.DISABLE_OPERATION, 8: Stop.SHUTDOWN, 11: Stop.QUICK_STOP}
"""Option codes 605Ch, 605Bh, 605Ah; 5 and 8 are over only when the ramp is."""


def commanded(controlword: int) -> str:
    """The command of a controlword."""
    (found,) = [name for name, (mask, value) in COMMANDS.items() if controlword & mask == value]
    return found


def transition(state: State, command: str) -> int | None:
    """The number of the transition that a command asks for in a state."""
    return next((n for n, (begin, event, _) in TRANSITIONS.items() if begin is state and command in event), None)


class Histories(RuleBasedStateMachine):
    """`state` and `ramp` are the reference's: the state, and the transition or "fault" whose ramp is running."""

    def __init__(self) -> None:
        super().__init__()
        self.machine = StateMachine()
        self.cause_is_gone = True
        self.machine.may_reset = lambda: self.cause_is_gone
        self.state, self.ramp = State.NOT_READY_TO_SWITCH_ON, None
        self.controlword = 0
        self.last_reset_bit = False

    state: State
    ramp: int | str | None

    @initialize()
    def power_on(self) -> None:
        self.machine.power_on()
        self.state = OFF

    @rule(
        controlword=st.one_of(
            st.sampled_from([0x00, 0x02, 0x06, 0x07, 0x0F, 0x1F, 0x80, 0x86, 0x10F]), st.integers(0, 0xFFFF)
        )
    )
    def a_controlword_is_written(self, controlword: int) -> None:
        self.machine.write_controlword(controlword)
        reset = bool(controlword & 0x80)
        rising, self.last_reset_bit = reset and not self.last_reset_bit, reset
        if self.state is FAULT:
            if rising and self.cause_is_gone:  # 15
                self.state = OFF
        elif self.state is not REACTION:
            self._obey(commanded(controlword))

    def _obey(self, command: str) -> None:
        if (self.state, command) == (READY, "enable operation"):  # 3 and 4 in one
            self.state = RUN
            return
        if (self.state, command) == (RUN, "enable operation"):  # a ramp that has begun is given up
            self.ramp = None
            return
        number = transition(self.state, command)
        if number is None or (number == 16 and self.ramp is not None):
            return
        self.ramp = number if number in RAMPS else None
        if number not in (5, 8):
            self.state = TRANSITIONS[number][2]

    @rule()
    def a_fault_occurs(self) -> None:
        self.machine.fault()
        if self.state in (FAULT, REACTION):
            return
        moving = self.state in (RUN, QUICK)
        self.state, self.ramp = (REACTION, "fault") if moving else (FAULT, None)  # 13; 14 at once where nothing moves

    @rule(gone=st.booleans())
    def the_cause_of_faults_comes_or_goes(self, gone: bool) -> None:
        self.cause_is_gone = gone

    @precondition(lambda self: self.ramp is not None)
    @rule()
    def a_ramp_ends(self) -> None:
        self.machine.stopped()
        if self.ramp == "fault":  # 14
            self.state = FAULT
        elif self.ramp in (5, 8):
            self.state = TRANSITIONS[int(self.ramp)][2]
        self.ramp = None

    @precondition(lambda self: self.state is QUICK and self.ramp is None)
    @rule()
    def the_drive_leaves_a_quick_stop(self) -> None:
        """12, by option codes 1 to 4."""
        self.machine.release_quick_stop()
        self.state = OFF

    @invariant()
    def state_and_ramp_are_the_standard_s(self) -> None:
        expected = None if self.ramp is None else Stop.FAULT_REACTION if isinstance(self.ramp, str) else RAMPS[self.ramp]
        assert (self.machine.state, self.machine.stop) == (self.state, expected)

    @invariant()
    def the_statusword_tells_the_state_alone(self) -> None:
        """Table 'State coding': under 006Fh, or 004Fh where quick stop does not count, one state and no other."""
        mask = 0x4F if self.state in (State.NOT_READY_TO_SWITCH_ON, OFF, REACTION, FAULT) else 0x6F
        codes = {OFF: 0x40, READY: 0x21, ON: 0x23, RUN: 0x27, QUICK: 0x07, REACTION: 0x0F, FAULT: 0x08}
        if self.state is not State.NOT_READY_TO_SWITCH_ON:
            assert self.machine.statusword() & mask == codes[self.state]


TestHistories = Histories.TestCase
TestHistories.settings = settings(max_examples=200, stateful_step_count=40, deadline=None)
