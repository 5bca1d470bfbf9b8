"""A CANopen device: its services put together, and which of them work in which NMT state (CiA 301, 7.3.2.2.5)."""

from __future__ import annotations

from collections.abc import Callable

from emulator.canopen import nmt
from emulator.canopen.emergency import Emergency
from emulator.canopen.heartbeat import Heartbeat
from emulator.canopen.nmt import Nmt, NmtState
from emulator.canopen.object_dictionary import ObjectDictionary
from emulator.canopen.rpdo import Rpdo
from emulator.canopen.sdo_server import REQUEST_COB_ID, SdoServer
from emulator.canopen.sync import Sync
from emulator.canopen.tpdo import Tpdo

PDO_COUNT = 4

_Handler = Callable[[bytes], None]


class Device:
    """One node on the bus.

    `transmit` gets CAN-ID and data of every frame it sends, `now` tells the simulated time [s]. Who owns the bus calls
    `receive` for each frame but SYNC, `sync` for SYNC, and `tick` after time has moved.
    """

    def __init__(
        self,
        node_id: int,
        dictionary: ObjectDictionary,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
    ) -> None:
        self.node_id = node_id
        self.od = dictionary
        self._now = now
        self._handlers: dict[int, _Handler] = {}
        self._remote_handlers: dict[int, Callable[[], None]] = {}
        self._event_driven: tuple[Callable[[float], None], ...] = ()
        self.rpdos: tuple[Rpdo, ...] = ()
        self.tpdos: tuple[Tpdo, ...] = ()
        self.on_reset_application: list[Callable[[], None]] = []
        self.nmt = Nmt(node_id)
        self.emergency = Emergency(dictionary, self.nmt, transmit)
        self.heartbeat = Heartbeat(node_id, dictionary, self.nmt, transmit, now)
        self.sdo = SdoServer(node_id, dictionary, transmit)
        self._sync = Sync(dictionary)
        numbers = range(1, PDO_COUNT + 1)
        self.rpdos = tuple(Rpdo(dictionary, number, self.emergency, self._connect) for number in numbers)
        self.tpdos = tuple(Tpdo(dictionary, number, transmit, now, self._connect) for number in numbers)
        self.nmt.on_change.append(self._enter)
        self.nmt.on_reset_node.append(self._reset_node)
        self.nmt.on_reset_communication.append(self._reset_communication)

    @property
    def sync_cob_id(self) -> int:
        """CAN-ID of SYNC (1005h)."""
        return self._sync.cob_id

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

    def sync(self, counter: int | None = None) -> None:  # 1019h is not there yet
        """A SYNC came: synchronous TPDOs are sampled and sent, then what synchronous RPDOs brought takes effect."""
        self._sync.run()

    def tick(self) -> None:
        """Simulated time has moved: send what is due by time or by a change of value."""
        now = self._now()
        self.heartbeat.tick(now)
        for tick in self._event_driven:
            tick(now)

    def _reset_node(self) -> None:
        self.nmt.enter(NmtState.INITIALISING)
        self.od.reset_application()
        self.emergency.reset()
        for callback in self.on_reset_application:
            callback()
        self._reset_communication()

    def _reset_communication(self) -> None:
        self.nmt.enter(NmtState.INITIALISING)
        self.od.reset_communication()
        self.sdo.reset()
        for pdo in self._pdos:
            pdo.parameters.load()
        self.heartbeat.boot_up()
        self.nmt.enter(NmtState.PRE_OPERATIONAL)

    def _enter(self, state: NmtState) -> None:
        if state is NmtState.OPERATIONAL:
            for pdo in self._pdos:
                pdo.start()
        self._connect()

    @property
    def _pdos(self) -> tuple[Rpdo | Tpdo, ...]:
        return (*self.rpdos, *self.tpdos)

    def _connect(self) -> None:
        """Join the CAN-IDs to the services that may work in this state."""
        self._handlers = {}
        state = self.nmt.state
        if state is not NmtState.INITIALISING:
            self._handlers[nmt.COB_ID] = self.nmt.receive
        if state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            self._handlers[REQUEST_COB_ID + self.node_id] = self.sdo.receive
        operational = state is NmtState.OPERATIONAL
        self._connect_rpdos([rpdo for rpdo in self.rpdos if operational and rpdo.parameters.active])
        self._connect_tpdos([tpdo for tpdo in self.tpdos if operational and tpdo.parameters.active])

    def _connect_rpdos(self, rpdos: list[Rpdo]) -> None:
        for rpdo in rpdos:
            cob_id = rpdo.parameters.cob_id
            earlier = self._handlers.get(cob_id)
            self._handlers[cob_id] = rpdo.receive if earlier is None else _both(earlier, rpdo.receive)
        self._sync.actuate = tuple(rpdo.take_effect for rpdo in rpdos if rpdo.parameters.synchronous)

    def _connect_tpdos(self, tpdos: list[Tpdo]) -> None:
        self._sync.sample = tuple(tpdo.on_sync for tpdo in tpdos if tpdo.at_sync)
        self._event_driven = tuple(tpdo.tick for tpdo in tpdos if tpdo.at_tick)
        self._remote_handlers = {
            tpdo.parameters.cob_id: tpdo.request for tpdo in tpdos if tpdo.parameters.remote_allowed
        }


def _both(first: _Handler, second: _Handler) -> _Handler:
    """Two PDOs that listen to the same CAN-ID."""

    def handle(data: bytes) -> None:
        first(data)
        second(data)

    return handle
