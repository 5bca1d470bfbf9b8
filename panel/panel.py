"""What the panel sees: the drives of one bus, kept up to date while it is open."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType

from drivetwin.drive_profiles import DriveProfile
from drivetwin.foundation.errors import UserError
from drivetwin.panel.access import Pen
from drivetwin.panel.bus_time import SYNC, BusTime
from drivetwin.panel.bus_watch import BusWatch
from drivetwin.panel.commissioning import Commissioning
from drivetwin.panel.door import SdoChannel, ServicePort
from drivetwin.panel.fault_desk import FaultDesk
from drivetwin.panel.frames import Frames
from drivetwin.panel.happenings import Happenings
from drivetwin.panel.link import Link
from drivetwin.panel.machine_model import MachineModel
from drivetwin.panel.motion import CYCLE, Motion
from drivetwin.panel.node_watch import Axis, NodeWatch
from drivetwin.panel.scope.scope import ASK_EVERY, Scope

logger = logging.getLogger(__name__)

REFRESH_EVERY = 0.25
"""Pause between two rounds of questions [s]."""

LISTEN = 1.5
"""How long drives may take to be heard before they are asked who is there [s]; a heartbeat comes within a second."""

SEARCH = 0.5
"""How long they may take to answer [s]."""


def find_nodes(link: Link) -> list[int]:
    """Node-IDs on a bus: of whoever is heard; where nobody is, of whoever answers a question for 1000h.

    Raises UserError where nobody does.
    """
    time.sleep(LISTEN)
    if not link.scanner.nodes:
        link.scanner.search()
        time.sleep(SEARCH)
    if not (found := sorted(node for node in link.scanner.nodes if 1 <= node <= 127)):
        raise UserError(f"no drive on {link.name}: none was heard within {LISTEN:g} s, and none answers; are they powered?")
    return found


class Panel:
    """The nodes of a bus, the pen, and the motion that the panel itself started, if it did."""

    def __init__(
        self,
        link: Link,
        node_ids: Sequence[int],
        profile: DriveProfile,
        axes: Mapping[int, Axis],
        pen: Pen,
        motion: Motion | None = None,
        control: Path | None = None,
        machine: str | None = None,
        model: Path | None = None,
        commissioning: Commissioning | None = None,
        *,
        paced: bool = False,
    ) -> None:
        """`control` is the control socket of the emulator, `machine` what it emulates and `model` its MJCF file.

        `commissioning` measures its axes. None on a bus of somebody else. `paced`: SYNC moves the time of its machine.
        """
        self.link = link
        self.pen = pen
        self.motion = motion
        self.commissioning = commissioning
        self.profile = profile
        self.time = BusTime(min(node_ids) if paced else None)
        door = SdoChannel(link) if control is None else ServicePort(link, control)
        self.nodes = {
            node_id: NodeWatch(door, node_id, profile, axes.get(node_id), lambda: self.time.now) for node_id in node_ids
        }
        self.nodes[min(node_ids)].writers.append(self.time.written)
        self.control = control
        self.machine = machine
        self.model = None if model is None else MachineModel(model)
        self.scope = Scope(self.nodes, self.time, control)
        self.bus = BusWatch(self.nodes)
        self.happenings = Happenings(self.nodes, self.time)
        link.hearers.append(self._take)
        self.faults = FaultDesk(control, self.time, self.happenings)
        self._ended = threading.Event()
        self._threads = [
            threading.Thread(target=self._refresh, name="panel questions", daemon=True),
            threading.Thread(target=self._keep_time, name="panel time", daemon=True),
            threading.Thread(target=self._ask_for_scope, name="panel scope", daemon=True),
        ]

    def __enter__(self) -> Panel:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._ended.set()
        for thread in self._threads:
            thread.join()

    def node(self, node_id: int) -> NodeWatch:
        """Raises UserError for a node that is not there."""
        if node_id not in self.nodes:
            raise UserError(f"there is no node {node_id} on {self.link.name}; there are {', '.join(map(str, self.nodes))}")
        return self.nodes[node_id]

    def _take(self, frames: Frames) -> None:
        """What has passed on the bus, by the machine's time."""
        passed = replace(frames, times=self.time.of(frames))
        self.bus.take(passed)
        for node in self.nodes.values():
            node.take(passed)
        self.happenings.take(passed)
        self.scope.settle()

    @property
    def _driven(self) -> bool:
        """Whether a controller that the panel started is on the bus, and sends SYNC."""
        return any(each is not None and each.runs for each in (self.motion, self.commissioning))

    def _refresh(self) -> None:
        while not self._ended.wait(REFRESH_EVERY):
            for node in self.nodes.values():
                if not self._ended.is_set() and self.link.lost is None:
                    node.refresh()

    def _ask_for_scope(self) -> None:
        while not self._ended.wait(ASK_EVERY) and self.link.lost is None:
            self.scope.ask_round()

    def _keep_time(self) -> None:
        """SYNC for the machine that the panel itself has emulated, while nothing moves it: else its time would stand still."""
        while self.motion is not None and not self._ended.wait(CYCLE) and self.link.lost is None:
            if not self._driven:
                with suppress(UserError):  # the bus has gone, and `lost` says so
                    self.link.send_message(SYNC, b"")
