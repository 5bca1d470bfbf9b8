"""A CANopen device: its services put together, and which of them work in which NMT state (CiA 301, 7.3.2.2.5)."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen import nmt
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.emergency import BUS_OFF_RECOVERED, COMMUNICATION, ERROR_PASSIVE, Emergency, ErrorRegister
from drivetwin.emulator.canopen.error_behaviour import ErrorBehaviour
from drivetwin.emulator.canopen.heartbeat import Heartbeat
from drivetwin.emulator.canopen.heartbeat_consumer import HeartbeatConsumer
from drivetwin.emulator.canopen.lss import REQUEST_COB_ID as LSS_COB_ID
from drivetwin.emulator.canopen.lss import UNCONFIGURED, LssSlave
from drivetwin.emulator.canopen.nmt import Nmt, NmtState
from drivetwin.emulator.canopen.nmt_startup import NmtStartup
from drivetwin.emulator.canopen.node_guarding import NodeGuarding
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.canopen.parameter_store import Group, ParameterStore
from drivetwin.emulator.canopen.producer import Produce
from drivetwin.emulator.canopen.rpdo import Rpdo
from drivetwin.emulator.canopen.sdo_server import REQUEST_COB_ID, SdoServer
from drivetwin.emulator.canopen.storage import Storage
from drivetwin.emulator.canopen.sync import Sync
from drivetwin.emulator.canopen.sync_timeout import SyncTimeout
from drivetwin.emulator.canopen.time_stamp import TimeStamp
from drivetwin.emulator.canopen.tpdo import Tpdo

PDO_COUNT = 4

_Handler = Callable[[bytes], None]


class Device:
    """One node on the bus.

    `transmit` gets CAN-ID and data of every frame it sends, `now` tells the simulated time [s], `store` is what it keeps
    while it has no power: its values are in the dictionary once the device is made. Who owns the bus calls
    `receive` for each frame but SYNC, `sync` for SYNC, and `tick` after time has moved; `synchronisation` knows which frame
    is its SYNC. `rewired` is called whenever another service than before, or none, takes some frame.
    """

    def __init__(
        self,
        node_id: int,
        dictionary: ObjectDictionary,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
        store: ParameterStore | None = None,
    ) -> None:
        self.od = dictionary
        self.rewired: Callable[[], None] = _nothing
        self._now = now
        self._handlers: dict[int, _Handler] = {}
        self._remote_handlers: dict[int, Callable[[], None]] = {}
        self._event_driven: tuple[Callable[[float], None], ...] = ()
        self.rpdos: tuple[Rpdo, ...] = ()
        self.tpdos: tuple[Tpdo, ...] = ()
        self.on_reset_application: list[Callable[[], None]] = []
        self._transmit = transmit
        self._store = store
        self.lss: LssSlave | None = None
        self._sync_timeout: SyncTimeout | None = None
        self._storage = Storage(dictionary, store)
        for group in Group:
            self._storage.apply(group)
        dictionary.power_on()
        self._alarms = alarms = Alarms()
        self.nmt = nmt = Nmt(node_id)
        self._startup = NmtStartup(dictionary)
        self.emergency = emergency = Emergency(dictionary, nmt, transmit, now, alarms)
        self.sdo = SdoServer(dictionary, nmt, transmit, now, alarms)
        self.time_stamp = TimeStamp(dictionary, now, self._connect)
        self.error_behaviour = behaviour = ErrorBehaviour(dictionary, nmt)
        self.heartbeat = Heartbeat(dictionary, nmt, transmit, now, alarms)
        self.heartbeat_consumer = HeartbeatConsumer(dictionary, emergency, behaviour, now, alarms, self._connect)
        self.node_guarding = NodeGuarding(dictionary, nmt, self.heartbeat, emergency, behaviour, transmit, now, alarms)
        self.synchronisation = sync = Sync(dictionary, emergency, now, self._connect)
        numbers = range(1, PDO_COUNT + 1)
        self.rpdos = tuple(Rpdo(dictionary, number, emergency, sync, now, alarms, self._connect) for number in numbers)
        self.tpdos = tuple(Tpdo(dictionary, number, transmit, now, sync, self._connect) for number in numbers)
        self.nmt.on_change.append(self._enter)
        self.nmt.on_reset_node.append(self._reset_node)
        self.nmt.on_reset_communication.append(self._reset_communication)

    @property
    def node_id(self) -> int:
        """The node-ID that the device has now."""
        return self.nmt.node_id

    @property
    def sync_cob_id(self) -> int:
        """CAN-ID of SYNC (1005h)."""
        return self.synchronisation.cob_id

    def add_lss(self) -> None:
        """Make it an LSS slave (CiA 305), with the node-ID that LSS stored; a device with node-ID 255 does nothing but LSS."""
        self.lss = LssSlave(self.od, self.nmt, self._store, self._transmit, self._reset_communication)
        self.nmt.node_id = self.lss.node_id

    def add_producers(self, produce: Produce) -> None:
        """Let it produce SYNC and TIME where 1005h and 1012h say so; `produce` gets each frame, for this node as well."""
        self.synchronisation.add_producer(self.nmt, produce, self._alarms)
        self.time_stamp.add_producer(self.nmt, produce, self._alarms)

    def add_sync_timeout(self, kind: Variable, time: Variable, lost: Callable[[int], None]) -> None:
        """Supervise SYNC by two objects of the drive type; `lost` gets the error code when it stays away."""
        self._sync_timeout = SyncTimeout(kind, time, self._now, self._alarms, lost)
        self._connect()

    def power_on(self) -> None:
        """Boot: boot-up message, then pre-operational."""
        self._reset_communication()

    def receive(self, cob_id: int, data: bytes, remote: bool = False) -> None:
        """Handle one frame of the bus; what is not addressed to this node, or not allowed now, is ignored."""
        if remote:
            request = self._remote_handlers.get(cob_id)
            if request is not None:
                request()
            return
        handler = self._handlers.get(cob_id)
        if handler is not None:
            handler(data)

    def taker(self, cob_id: int) -> Callable[[bytes], None] | None:
        """What takes the data of frames with this identifier, SYNC included; None where nothing does; until `rewired`."""
        return self.synchronisation.take if cob_id == self.synchronisation.cob_id else self._handlers.get(cob_id)

    def sync(self, data: bytes = b"") -> None:
        """A SYNC came, perhaps with a counter."""
        self.synchronisation.take(data)

    def tick(self, now: float) -> None:
        """Simulated time has moved to `now` [s]: send what is due by time or by a change of value."""
        if now >= self._alarms.due:
            self._alarms.tick(now)
        for tick in self._event_driven:
            tick(now)

    def bus_off(self) -> None:
        """The CAN controller is off the bus: the node reacts as by 1029h (CiA 301, 7.5.2.32)."""
        self.error_behaviour.communication_error(COMMUNICATION)

    def bus_recovered(self) -> None:
        """The CAN controller is back: EMCY 8140h, which is over as soon as it is told."""
        self.emergency.raise_error(BUS_OFF_RECOVERED, ErrorRegister.COMMUNICATION)
        self.emergency.clear_error(BUS_OFF_RECOVERED)

    def error_passive(self) -> None:
        """The CAN controller is in error passive mode: EMCY 8120h."""
        self.emergency.raise_error(ERROR_PASSIVE, ErrorRegister.COMMUNICATION)

    def error_active(self) -> None:
        """The CAN controller is out of error passive mode."""
        self.emergency.clear_error(ERROR_PASSIVE)

    def _reset_node(self) -> None:
        self.nmt.enter(NmtState.INITIALISING)
        self._storage.withdraw(Group.APPLICATION)
        self._storage.apply(Group.APPLICATION)
        self.od.reset_application()
        self.emergency.reset()
        for callback in self.on_reset_application:
            callback()
        self._reset_communication()

    def _reset_communication(self) -> None:
        self.nmt.enter(NmtState.INITIALISING)
        self._take_node_id()
        self._storage.withdraw(Group.COMMUNICATION)
        self.od.assign_node_id(self.nmt.node_id)
        self._storage.apply(Group.COMMUNICATION)
        self.od.reset_communication()
        self._begin_anew()
        if self.nmt.node_id == UNCONFIGURED:
            self.heartbeat.stop()
            self._connect()
            return
        self.heartbeat.boot_up()
        self.nmt.enter(NmtState.PRE_OPERATIONAL)
        if self._startup.self_starting:
            self.nmt.enter(NmtState.OPERATIONAL)

    def _take_node_id(self) -> None:
        if self.lss is not None:
            self.lss.reset()
            self.nmt.node_id = self.lss.node_id

    def _begin_anew(self) -> None:
        """Every service takes its parameters as they stand, and forgets what was under way."""
        self.sdo.reset()
        self.emergency.forget_waiting()
        self.synchronisation.load()
        self.time_stamp.load()
        self.heartbeat_consumer.load()
        self.node_guarding.reset()
        if self._sync_timeout is not None:
            self._sync_timeout.reset()
        for pdo in self._pdos:
            pdo.parameters.load()

    def _enter(self, state: NmtState) -> None:
        if state is NmtState.OPERATIONAL:
            for pdo in self._pdos:
                pdo.start()
        else:
            for rpdo in self.rpdos:
                rpdo.stop()
        self._connect()

    @property
    def _pdos(self) -> tuple[Rpdo | Tpdo, ...]:
        return (*self.rpdos, *self.tpdos)

    def _connect(self) -> None:
        """Join the CAN-IDs to the services that may work in this state (CiA 301, 7.3.2.2.5)."""
        self._handlers, self._remote_handlers = {}, {}
        state = self.nmt.state
        if self.lss is not None:
            self._handlers[LSS_COB_ID] = self.lss.receive
        if state is not NmtState.INITIALISING:
            self._handlers |= {nmt.COB_ID: self.nmt.receive, **self.heartbeat_consumer.handlers}
            if self.node_guarding.present:
                self._remote_handlers[self.node_guarding.cob_id] = self.node_guarding.request
        if self.nmt.communicating:
            self._handlers |= {REQUEST_COB_ID + self.nmt.node_id: self.sdo.receive, **self.time_stamp.handlers}
        operational = state is NmtState.OPERATIONAL
        rpdos = [rpdo for rpdo in self.rpdos if operational and rpdo.parameters.active]
        tpdos = [tpdo for tpdo in self.tpdos if operational and tpdo.parameters.active]
        self._connect_rpdos(rpdos)
        self._connect_tpdos(tpdos)
        self.synchronisation.acts = self._at_sync(rpdos, tpdos)
        self.rewired()

    def _connect_rpdos(self, rpdos: list[Rpdo]) -> None:
        for rpdo in rpdos:
            cob_id = rpdo.parameters.cob_id
            earlier = self._handlers.get(cob_id)
            self._handlers[cob_id] = rpdo.receive if earlier is None else _both(earlier, rpdo.receive)

    def _connect_tpdos(self, tpdos: list[Tpdo]) -> None:
        self._event_driven = tuple(tpdo.tick for tpdo in tpdos if tpdo.at_tick)
        for tpdo in tpdos:
            if tpdo.parameters.remote_allowed:
                self._remote_handlers[tpdo.parameters.cob_id] = tpdo.request

    def _at_sync(self, rpdos: list[Rpdo], tpdos: list[Tpdo]) -> tuple[Callable[[], None], ...]:
        """Synchronous TPDOs are sampled and sent, then synchronous RPDOs take effect (CiA 301, 7.2.2.2)."""
        sample = [tpdo.on_sync for tpdo in tpdos if tpdo.at_sync]
        actuate = [rpdo.take_effect for rpdo in rpdos if rpdo.parameters.synchronous]
        watch = [] if self._sync_timeout is None else [self._sync_timeout.came]
        return (*sample, *actuate, *watch)


def _nothing() -> None:
    """Nobody asks who takes what."""


def _both(first: _Handler, second: _Handler) -> _Handler:
    """Two PDOs that listen to the same CAN-ID."""

    def handle(data: bytes) -> None:
        first(data)
        second(data)

    return handle
