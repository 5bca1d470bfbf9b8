"""Two devices with one node-ID: on the bus, where bring-up and cycle name the node, and in the controller's machine file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can
import pytest
import yaml
from virtual_bench import VirtualBench

from drivetwin.bus.channel import InprocBus
from drivetwin.controller import machine as machine_module
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.link import Link
from drivetwin.controller.machine import MACHINES, load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError


class TwoMachines:
    """The SCARA, nodes 1, 2 and 3, and the stage, node 1, on one bus; the second answers once `joined`."""

    def __init__(self, transmit: Callable[[can.Message], None]) -> None:
        self.joined = True
        self._transmit = transmit
        self._first, self._second = self._machine("scara", transmit), self._machine("stage", self._if_joined)

    def receive(self, message: can.Message) -> None:
        self._first.receive(message)
        self._second.receive(message)

    def poll(self) -> None:
        self._first.poll()

    def wait(self) -> float | None:
        return None

    def _if_joined(self, message: can.Message) -> None:
        if self.joined:
            self._transmit(message)

    @staticmethod
    def _machine(name: str, transmit: Callable[[can.Message], None]) -> VirtualMachine:
        described = load_virtual_machine(name)
        effects = read_effects(described.effects_path)
        virtual = VirtualMachine(described, load_profile("servoone"), effects, SyncClock(), 0, transmit)
        virtual.power_on()
        return virtual


class Bench:
    """A controller that expects the SCARA alone."""

    def __init__(self) -> None:
        made: list[TwoMachines] = []

        def connected(transmit: Callable[[can.Message], None]) -> TwoMachines:
            made.append(TwoMachines(transmit))
            return made[0]

        bus = InprocBus(connected)
        bus.shutdown()
        self.machines = made[0]
        self.link = Link(bus)
        self.drives = connect(self.link, load_machine("scara"), load_profile("servoone"))


def test_doubled_sdo_answers() -> None:
    bench = Bench()
    expected = r"axis lift \(node 1\): one SDO request had 2 answers; is a second device set to node-ID 1"
    with pytest.raises(UserError, match=expected):
        bring_up(bench.link, bench.drives, 0.001)


@pytest.mark.parametrize("when", ["at once", "while the drives are configured"])
def test_doubled_boot_up(when: str) -> None:
    """Of a device that boots only, or so late that its answers are missed."""
    bench = VirtualBench("scara")
    second = bench.virtual.drives[1]

    def boot_again() -> None:
        second.device.heartbeat.boot_up()

    if when == "at once":
        second.device.nmt.on_reset_communication.append(boot_again)
    else:
        second.dictionary[0x6085].on_write = lambda _: boot_again()
    with pytest.raises(UserError, match=r"axis rotate \(node 2\): one reset brought 2 boot-up messages; is a second device"):
        bring_up(bench.link, bench.drives, 0.001)


def test_doubled_pdos() -> None:
    """A second device that joins after the bring-up."""
    bench = Bench()
    bench.machines.joined = False
    cycle = Cycle(bench.link, bench.drives, Lockstep())
    bring_up(bench.link, bench.drives, cycle.period)
    cycle.start()
    cycle.run()
    bench.machines.joined = True
    with pytest.raises(UserError, match=r"axis lift \(node 1\) sent 2 PDOs for one SYNC: .* second device with node-ID 1\?"):
        cycle.run_for(0.003)


def test_a_node_id_twice_in_the_machine_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = yaml.safe_load((MACHINES / "scara" / "axes.yaml").read_text(encoding="utf-8"))
    content["axes"]["stretch"]["node_id"] = 2
    (tmp_path / "bent").mkdir()
    (tmp_path / "bent" / "axes.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    monkeypatch.setattr(machine_module, "MACHINES", tmp_path)
    with pytest.raises(UserError, match=r"axes\.yaml: axes: rotate and stretch both have node_id 2; give each its own"):
        load_machine("bent")
