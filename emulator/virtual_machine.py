"""A machine's drives and plant on one CAN bus: frames in, frames out, time advanced by the clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from pathlib import Path

import can

from drivetwin.bus.frame import DataFrame
from drivetwin.drive_profiles import DriveProfile
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.parameter_store import ParameterStore
from drivetwin.emulator.clock import Clock, Cycle
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.drive.hardware import Hardware
from drivetwin.emulator.drive.rehearsal import rehearse
from drivetwin.emulator.drive.servo import SERVO_PERIOD, Servo, ServoBank
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.machine import Machine
from drivetwin.emulator.plant import Plant
from drivetwin.emulator.sync_period import MILLISECOND
from drivetwin.emulator.wire.faulty_wire import FaultyWire

LONGEST_CYCLE = 10.0
"""A larger 1006h counts as this [s]."""

REQUEST_WAIT = 0.001
"""Longest that a request of another interface waits for `poll` [s]."""

TICK = 0.001
"""How often the drives' timers are looked at while no cycle runs [s]."""


class VirtualMachine:
    """Drives of one type on a machine's axes, joined to a bus by `receive` (frames in) and `transmit` (frames out).

    `wires` are the lines of the drives, in the order of the axes: bus faults are injected there. `alarms` ring at the end of
    the first cycle in which they are due. After a loss of power, `drives` contains a new drive.

    Once it is made, all that a cycle calls is compiled, so that no frame waits for that.

    Single-threaded: whoever owns the bus calls `receive` for each frame and `poll` when none comes.
    """

    def __init__(
        self,
        machine: Machine,
        profile: DriveProfile,
        effects: tuple[PlacedEffect, ...],
        clock: Clock,
        seed: int,
        transmit: Callable[[can.Message], None],
        store: Path | None = None,
        plant: Plant | None = None,
    ) -> None:
        """`store` is the directory in which the drives keep their stored parameters, a file an axis; None: they have none.

        `plant` stands in the place of the machine's own with its `effects`.
        """
        self.machine = machine
        self.plant = Plant(machine, effects) if plant is None else plant
        self.alarms = Alarms()
        self._profile = profile
        self._store = store
        self._servos = ServoBank(len(machine.axes), seed)
        self._clock = clock
        self._transmit = transmit
        self._time = 0.0
        self._ticked = clock.timers(0.0)
        self._requests: list[Callable[[], None]] = []
        self._produced: list[can.Message] = []
        self.wires = [FaultyWire(self._send, self.now) for _ in machine.axes]
        self._takers: dict[int, list[Callable[[bytes], None]]] = {}
        """By COB-ID, but of SYNC, which does more than what takes it."""
        self._sync_takers: list[Callable[[bytes], None]] | None = None
        self.drives = [self._drive(number) for number in range(len(machine.axes))]
        self.plant.equip(self._servos)
        self._nodes = [(wire, drive.device) for wire, drive in zip(self.wires, self.drives, strict=True)]
        for wire, device in self._nodes:
            wire.join(device)
            wire.rewired = self._rewired
        self.plant.rehearse(self._servos)
        rehearse(self._servos.demands[0])

    def power_on(self) -> None:
        """Every drive boots and sends its boot-up message."""
        for drive in self.drives:
            drive.power_on()

    def switch_off(self, axis: int) -> None:
        """Switch off the drive of an axis, by its number: no torque, brake engaged, nothing on the bus."""
        self._exchange(axis, None)

    def switch_on(self, axis: int, node_id: int | None = None) -> None:
        """Switch it on again: the drive boots and knows only what it has stored. `node_id` replaces the machine's own."""
        self._exchange(axis, node_id)
        self.drives[axis].power_on()

    def now(self) -> float:
        """Simulated time [s]."""
        return self._time

    def receive(self, message: can.Message) -> None:
        """Handle one frame of the bus. Error frames, extended and FD frames are not CANopen's.

        Each drive obeys SYNC by its own 1005h; that of the first drive advances time.
        """
        self._hear(message)
        if self._produced:
            self._hear_own()

    def _hear(self, message: can.Message) -> None:
        """Who takes a data frame is looked up once, and anew after any of the drives was rewired."""
        if message.is_error_frame or message.is_extended_id or message.is_fd:
            return
        cob_id = message.arbitration_id
        takers = None if message.is_remote_frame else self._takers.get(cob_id)
        if takers is not None:
            data = bytes(message.data)
            for take in takers:
                take(data)
        elif message.is_remote_frame:
            for wire in self.wires:
                wire.receive(cob_id, b"", True)
        elif cob_id == self._nodes[0][1].synchronisation.cob_id:
            self._run(self._clock.before_sync())
            self._take_sync(cob_id, bytes(message.data))
            self._run(self._clock.at_sync(self._told()))
        else:
            self._takers[cob_id] = self._who_takes(cob_id)
            self._hear(message)
            return
        if self._clock.runs_alone:
            self._look_at_timers()

    def _take_sync(self, cob_id: int, data: bytes) -> None:
        takers = self._sync_takers
        if takers is None:
            self._sync_takers = takers = self._who_takes(cob_id)
        for take in takers:
            take(data)

    def _who_takes(self, cob_id: int) -> list[Callable[[bytes], None]]:
        found = [wire.taker(cob_id) for wire in self.wires]
        return [taker for taker in found if taker is not None]

    def _rewired(self) -> None:
        self._takers.clear()
        self._sync_takers = None

    def attach(self, answer_requests: Callable[[], None]) -> None:
        """Let `poll` answer what another interface (Modbus) asks of the drives: between two frames, in the owner's thread."""
        self._requests.append(answer_requests)

    def poll(self) -> None:
        """Run the cycles that are due without a SYNC, and answer other interfaces; call it often."""
        for answer in self._requests:
            answer()
        self._run(self._clock.due(self._told()))
        if self._clock.runs_alone:
            self._look_at_timers()
        if self._produced:
            self._hear_own()

    def wait(self) -> float | None:
        """Seconds until `poll` is to be called again, None if it need not be."""
        pause = self._clock.wait()
        if not self._requests:
            return pause
        return REQUEST_WAIT if pause is None else min(pause, REQUEST_WAIT)

    def hurry(self, hurries: bool) -> None:
        """Skip the plant's time while frames wait too long (`Backlog`)."""
        self._clock.hurry(hurries)

    def cycle(self) -> float:
        """Communication cycle [s]: 1006h of the first drive that has one, or 1 ms; in whole servo periods, 10 s at most."""
        return (self._told() or MILLISECOND) * SERVO_PERIOD

    def _drive(self, number: int, node_id: int | None = None, hardware: Hardware | None = None) -> Drive:
        """The drive of an axis as it leaves the factory, with what it has stored, not yet switched on."""
        name, axis = list(self.machine.axes.items())[number]
        drive = Drive(
            self._profile,
            axis if node_id is None else axis.model_copy(update={"node_id": node_id}),
            Servo(self._servos, number),
            float(self.plant.motor_position[number]),
            self.wires[number].transmit,
            self._timers,
            ParameterStore(self._store / f"{name}.json") if self._store is not None else None,
            hardware,
        )
        if node_id is not None and drive.device.lss is not None:
            drive.device.lss.node_id = node_id
        if self._clock.runs_alone:
            drive.device.add_producers(partial(self._produce, number))
        return drive

    def _exchange(self, number: int, node_id: int | None) -> None:
        self._servos.reset(number)
        drive = self._drive(number, node_id, self.drives[number].hardware)
        self.plant.equip(self._servos)
        self.drives[number] = drive
        self._nodes[number] = (self.wires[number], drive.device)
        self.wires[number].join(drive.device)

    def _timers(self) -> float:
        """Time of the drives' timers [s]."""
        return self._clock.timers(self._time)

    def _told(self) -> int:
        """1006h of the first drive that has one, in servo periods; 0 where none has."""
        for _, device in self._nodes:
            cycle = device.synchronisation.cycle
            if cycle > 0.0:
                return _whole_periods(cycle)
        return 0

    def _run(self, cycles: Iterable[Cycle]) -> None:
        for cycle in cycles:
            self._run_cycle(cycle)

    def _run_cycle(self, cycle: Cycle) -> None:
        self._servos.start_cycle(cycle.periods, cycle.interval, cycle.first)
        for drive in self.drives:
            drive.plan()
        self.plant.advance(self._servos)
        self._time += self._servos.periods * SERVO_PERIOD
        for drive in self.drives:
            drive.after()
        self._tick()
        if self._time >= self.alarms.due:
            self.alarms.tick(self._time)

    def _produce(self, number: int, cob_id: int, data: bytes) -> None:
        """A drive sends SYNC or TIME: on the bus, and for the drives of this machine."""
        self.wires[number].transmit(cob_id, data)
        self._produced.append(DataFrame(cob_id, data))

    def _hear_own(self) -> None:
        produced, self._produced = self._produced, []
        for message in produced:
            self._hear(message)

    def _look_at_timers(self) -> None:
        if self._timers() >= self._ticked + TICK:
            self._tick()

    def _tick(self) -> None:
        self._ticked = now = self._timers()
        for _, device in self._nodes:
            device.tick(now)

    def _send(self, cob_id: int, data: bytes) -> None:
        self._transmit(DataFrame(cob_id, data, self._time))


@lru_cache(maxsize=8)
def _whole_periods(cycle: float) -> int:
    """A cycle [s] in servo periods, one at least."""
    return max(1, round(min(cycle, LONGEST_CYCLE) / SERVO_PERIOD))
