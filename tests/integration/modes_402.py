"""What `canopen`'s BaseNode402, a CiA 402 master, does with a drive of the stage in each mode that it knows.

Whatever the bus: an emulator with the clock `sync` is on it, and each SYNC moves it by CYCLE. Positions in um, speeds in um/s
of the carriage. Expected values are closed forms of the stage's own figures (emulator/machines/stage).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import cast

import canopen
import numpy as np
import pytest
from canopen.profiles.p402 import BaseNode402, Homing, OperationMode
from processes import PATIENCE

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.drive_profiles import DriveProfile, load_profile

CYCLE = 0.004
"""Communication cycle, written to 1006h [s]."""

UM_PER_TURN = 10_000
INCREMENTS_PER_UM = 2**20 / UM_PER_TURN
POWER_ON, NEGATIVE_SWITCH = -100_000, -150_000
"""Where the carriage stands at power-on, and its limit switch [um]."""

MASS, COULOMB, VISCOUS = 95.0, 20.4, 203.5 - 36.0
"""As the drive feels it forwards [kg], [N], [N·s/m]."""
POSITION_GAIN, VELOCITY_GAIN = 100.0, 8500.0
"""[1/s], [N·s/m]; neither an integral nor a feed-forward, so that a speed stays short of its target by force over gain."""
TORQUE_CONSTANT = 0.4 * 628.3185 / 1000.0
"""Force of the carriage for a thousandth of rated torque [N]."""
TORQUE_NOISE = 10.0
"""Standard deviation of 6077h [thousandths]."""

SPEED, RAMP, WAY = 50_000, 500_000, 20_000
"""Of the moves [um/s], [um/s²], [um]."""

REACHED, BIT_12 = 1 << 10, 1 << 12
"""Bits of the statusword: target reached; set-point acknowledged, homing attained, following."""
ENABLE, ENABLE_WITH_BIT_4, RUN_RAMP = 0x0F, 0x1F, 0x7F


@dataclass(frozen=True)
class Told:
    """What the drive said at one SYNC."""

    statusword: int
    torque: int
    position: int
    velocity: int


@dataclass
class Master:
    """A BaseNode402 and what its drive told at each SYNC."""

    network: canopen.Network
    node: BaseNode402
    profile: DriveProfile
    told: list[Told] = field(default_factory=list)

    def boot(self, mode: str, set_point: tuple[int, int]) -> None:
        """Reset, scale, map the mode's set-point into RPDO 2, start, and enable in that mode."""
        node = self.node
        reset_node(node)
        for index, subindex, value in (
            (0x1006, 0, round(CYCLE * 1e6)),
            (0x6092, 1, UM_PER_TURN),
            (0x6081, 0, SPEED),
            (0x6083, 0, RAMP),
            (0x6084, 0, RAMP),
            (0x6085, 0, RAMP),
        ):
            (node.sdo[index][subindex] if subindex else node.sdo[index]).raw = value
        node.tpdo.read()
        node.rpdo.read()
        map_pdo(node.tpdo[1], [(0x6041, 0), (0x6061, 0), (0x6077, 0)], 1)
        map_pdo(node.tpdo[2], [(0x6064, 0), (0x606C, 0)], 1)
        map_pdo(node.rpdo[1], [(0x6040, 0), (0x6060, 0)], 255)
        map_pdo(node.rpdo[2], [set_point], 1)
        node.setup_402_state_machine()
        node.tpdo[2].add_callback(self._listen)
        node.nmt.state = "OPERATIONAL"
        with self.time_running():
            node.op_mode = mode
            assert node.op_mode == mode
            self.aim(self.told[-1].position if set_point[0] in (0x607A, 0x60C1) else 0)
            node.state = "OPERATION ENABLED"

    def aim(self, set_point: int) -> None:
        """RPDO 2, which the drive takes at the next SYNC."""
        self.node.rpdo[2][0].raw = set_point
        self.node.rpdo[2].transmit()

    def cycle(self, count: int = 1) -> Told:
        """SYNCs, each answered by TPDO 2; what the drive said at the last."""
        for _ in range(count):
            seen = len(self.told)
            self.network.sync.transmit()
            self.await_true(self._told_after(seen))
        return self.told[-1]

    def cycle_until(self, mask: int, bits: int) -> int:
        """SYNCs until the statusword says so; how many."""
        for count in range(1, 10_000):
            if self.cycle().statusword & mask == bits:
                return count
        raise AssertionError(hex(self.told[-1].statusword))

    def stream(self, set_points: list[int]) -> list[Told]:
        """A set-point a cycle; row k is what the drive said when it took set-point k."""
        rows = []
        for set_point in set_points:
            self.aim(set_point)
            rows.append(self.cycle())
        return rows

    @contextmanager
    def time_running(self) -> Iterator[None]:
        """SYNCs from a thread, as BaseNode402 needs them where it waits for a statusword; each waits for its answer."""
        over = threading.Event()

        def run() -> None:
            while not over.is_set():
                self.cycle()

        thread = threading.Thread(target=run)
        self.cycle()
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _told_after(self, seen: int) -> Callable[[], bool]:
        return lambda: len(self.told) > seen

    def await_true(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            self.node.tpdo[2].wait_for_reception(timeout=0.05)
            assert time.monotonic() < deadline, self.told[-3:]

    def _listen(self, pdo: canopen.pdo.PdoMap) -> None:
        first = self.node.tpdo[1]
        self.told.append(Told(first[0].raw, first[2].raw, cast(int, pdo[0].raw), cast(int, pdo[1].raw)))


@contextmanager
def master_on(interface: str, channel: str, profile: str) -> Iterator[Master]:
    """A master on a bus where node 1 is a drive of that type."""
    network = canopen.Network()
    network.connect(interface=interface, channel=channel, ignore_config=True)
    drive_type = load_profile(profile)
    node = BaseNode402(1, object_dictionary(drive_type))
    for timeout in ("SWITCH_OP_MODE", "SWITCH_STATE_FINAL", "SWITCH_STATE_SINGLE", "CHECK_TPDO", "HOMING_DEFAULT"):
        setattr(node, f"TIMEOUT_{timeout}", PATIENCE)
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    network.add_node(node)
    try:
        yield Master(network, node, drive_type)
    finally:
        network.disconnect()


def reset_node(node: canopen.RemoteNode) -> None:
    """Reset and boot-up; `wait_for_bootup` would miss a boot-up message that comes before it is called."""
    booted = threading.Event()
    node.nmt.add_heartbeat_callback(lambda state: None if state else booted.set())
    node.nmt.state = "RESET"
    assert booted.wait(PATIENCE)


def map_pdo(pdo: canopen.pdo.PdoMap, objects: list[tuple[int, int]], transmission_type: int) -> None:
    """Disable, write, enable."""
    pdo.clear()
    for index, subindex in objects:
        pdo.add_variable(index, subindex)
    pdo.trans_type = transmission_type
    pdo.enabled = True
    pdo.save()


# -- the modes ---------------------------------------------------------------------------------------------------------


def profile_position(master: Master) -> None:
    """The handshake of bits 4 and 12; there in the time of the trapezoid, and what the position loop needs to settle."""
    window = master.profile.roles["position_window"]
    master.boot("PROFILED POSITION", (0x607A, 0))
    master.node.sdo[window.index].raw = WAY // 100
    begin = master.cycle().position
    master.aim(begin + WAY)
    master.cycle()
    master.node.controlword = ENABLE_WITH_BIT_4
    master.cycle_until(BIT_12 | REACHED, BIT_12)
    master.node.controlword = ENABLE
    cycles = master.cycle_until(BIT_12 | REACHED, REACHED)
    duration = WAY / SPEED + SPEED / RAMP
    assert duration - 2 * CYCLE <= cycles * CYCLE <= duration + 5 / POSITION_GAIN
    assert master.told[-1].position == pytest.approx(begin + WAY, abs=WAY // 100)


def velocity(master: Master) -> None:
    """6042h in rpm by the ramp 6048h: a tenth of a second to 300 rpm, which 6044h tells as well."""
    rpm, ramp_time = 300, 0.1
    master.boot("VELOCITY", (0x6042, 0))
    for index in (0x6048, 0x6049):
        master.node.sdo[index][1].raw = round(rpm / ramp_time)
        master.node.sdo[index][2].raw = 1
    master.node.controlword = RUN_RAMP
    speed = rpm / 60 * UM_PER_TURN
    master.aim(rpm)
    rows = [master.cycle() for _ in range(75)]
    assert ramp_duration(rows, speed) == pytest.approx(ramp_time, abs=2 * CYCLE)
    assert cruise(rows) == pytest.approx(short_of(speed), rel=0.01)
    assert master.node.sdo[0x6044].raw == pytest.approx(short_of(speed) / UM_PER_TURN * 60, abs=3)
    master.aim(0)
    assert abs(master.cycle(75).velocity) < 0.02 * speed


def profile_velocity(master: Master) -> None:
    """60FFh by the ramps 6083h and 6084h."""
    master.boot("PROFILED VELOCITY", (0x60FF, 0))
    master.aim(SPEED)
    rows = [master.cycle() for _ in range(75)]
    assert ramp_duration(rows, SPEED) == pytest.approx(SPEED / RAMP, abs=2 * CYCLE)
    assert cruise(rows) == pytest.approx(short_of(SPEED), rel=0.01)
    way = rows[-1].position - rows[-51].position
    assert way / (50 * CYCLE) == pytest.approx(short_of(SPEED), rel=0.01)
    master.aim(0)
    assert abs(master.cycle(75).velocity) < 0.02 * SPEED


def profile_torque(master: Master) -> None:
    """6071h by the slope 6087h; then what the torque leaves beside friction accelerates the carriage."""
    torque, slope = 150, 1000
    master.boot("PROFILED TORQUE", (0x6071, 0))
    master.node.sdo[0x6087].raw = slope
    master.aim(torque)
    rows = [master.cycle() for _ in range(90)]
    told = np.array([row.torque for row in rows])
    expected = np.minimum(slope * CYCLE * np.arange(-0.5, 89.5), torque)
    assert np.abs(told - expected).max() < 5 * TORQUE_NOISE + slope * CYCLE
    assert np.abs(np.mean(told[-40:]) - torque) < TORQUE_NOISE
    first, last = (rows[k].velocity * 1e-6 for k in (-41, -1))
    force = torque * TORQUE_CONSTANT - COULOMB - VISCOUS * (first + last) / 2
    assert (last - first) / (40 * CYCLE) == pytest.approx(force / MASS, rel=0.05)
    assert rows[-1].statusword & REACHED
    master.aim(0)
    assert abs(master.cycle(200).velocity) < SPEED / 50


def homing(master: Master) -> None:
    """Method 17, by BaseNode402's own procedure: the zero is the edge of the switch, of which 6063h knows nothing."""
    master.boot("HOMING", (0x607A, 0))
    sdo = master.node.sdo
    for index, subindex, value in ((0x6099, 1, 2 * SPEED), (0x6099, 2, SPEED // 10)):
        sdo[index][subindex].raw = value
    sdo[0x609A].raw = RAMP
    sdo[0x6098].raw = Homing.HM_ON_THE_NEGATIVE_LIMIT_SWITCH
    with master.time_running():
        assert not master.node.is_homed()
        assert master.node.homing()
        assert master.node.is_homed()
    carriage = POWER_ON + sdo[0x6063].raw / INCREMENTS_PER_UM
    assert sdo[0x6064].raw == pytest.approx(carriage - NEGATIVE_SWITCH, abs=CYCLE * SPEED / 10)


def interpolated_position(master: Master) -> None:
    """60C1h while bit 4 is set; two cycles later the drive has it, by v / gain late."""
    master.boot("INTERPOLATED POSITION", (0x60C1, 1))
    begin = master.cycle().position
    master.aim(begin)
    master.node.controlword = ENABLE_WITH_BIT_4
    master.cycle_until(BIT_12, BIT_12)
    follows(master, begin)


def cyclic_position(master: Master) -> None:
    master.boot("CYCLIC SYNCHRONOUS POSITION", (0x607A, 0))
    follows(master, master.cycle().position)


def follows(master: Master, begin: int) -> None:
    """A smooth way to begin + WAY in half a second: the position is behind it by the lag of the loop, and then there."""
    u = np.linspace(0.0, 1.0, round(0.5 / CYCLE))
    path = begin + WAY * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    rows = master.stream([round(x) for x in path] + [begin + WAY] * 50)
    position = np.array([row.position for row in rows])
    speed = np.gradient(path, CYCLE)
    late = 2 * CYCLE + 1 / POSITION_GAIN
    behind = np.interp(np.arange(len(path)) * CYCLE - late, np.arange(len(path)) * CYCLE, path)
    assert np.abs(position[: len(path)] - behind).max() < CYCLE * np.abs(speed).max()
    friction = (COULOMB / VELOCITY_GAIN) / POSITION_GAIN * 1e6
    assert position[-1] == pytest.approx(begin + WAY, abs=2 * friction)


def cyclic_velocity(master: Master) -> None:
    """60FFh each cycle: a ramp up, a cruise, a ramp down."""
    master.boot("CYCLIC SYNCHRONOUS VELOCITY", (0x60FF, 0))
    up = np.linspace(0.0, SPEED, 26)
    rows = master.stream([round(v) for v in (*up, *[SPEED] * 50, *up[::-1], *[0.0] * 25)])
    assert cruise(rows[26:76]) == pytest.approx(short_of(SPEED), rel=0.01)
    assert ramp_duration(rows, SPEED) == pytest.approx(25 * CYCLE, abs=3 * CYCLE)
    assert abs(rows[-1].velocity) < 0.02 * SPEED


def cyclic_torque(master: Master) -> None:
    """6071h each cycle: what is sent before one SYNC acts after it and is told at the next."""
    master.boot("CYCLIC SYNCHRONOUS TORQUE", (0x6071, 0))
    wanted = [200, -200, 100, -100, 50, 0] * 5
    rows = master.stream([*wanted, 0])
    told = np.array([row.torque for row in rows])
    assert np.abs(told[1:] - wanted).max() < 5 * TORQUE_NOISE
    assert all(row.statusword & BIT_12 for row in rows)


def cruise(rows: list[Told]) -> float:
    """Mean speed of the last 25 rows [um/s]."""
    return float(np.mean([row.velocity for row in rows[-25:]]))


def short_of(speed: float) -> float:
    """Where a P velocity loop against friction ends up [um/s]: gain * (target - v) = coulomb + viscous * v."""
    return (VELOCITY_GAIN * speed - COULOMB * 1e6) / (VELOCITY_GAIN + VISCOUS)


def ramp_duration(rows: list[Told], speed: float) -> float:
    """Time of a straight ramp from 0 to `speed`, from when it has passed 20 % and 80 % of it [s]."""
    velocities = np.array([row.velocity for row in rows])
    early, late = (int(np.argmax(velocities > part * speed)) for part in (0.2, 0.8))
    return (late - early) / 0.6 * CYCLE


MODES: dict[str, Callable[[Master], None]] = {
    "PROFILED POSITION": profile_position,
    "VELOCITY": velocity,
    "PROFILED VELOCITY": profile_velocity,
    "PROFILED TORQUE": profile_torque,
    "HOMING": homing,
    "INTERPOLATED POSITION": interpolated_position,
    "CYCLIC SYNCHRONOUS POSITION": cyclic_position,
    "CYCLIC SYNCHRONOUS VELOCITY": cyclic_velocity,
    "CYCLIC SYNCHRONOUS TORQUE": cyclic_torque,
}
"""By BaseNode402's names."""


def modes_of(profile: str) -> set[str]:
    """Names of the modes that a drive type has and BaseNode402 knows."""
    return {OperationMode.CODE2NAME[code] for code in load_profile(profile).modes}


def run_mode(master: Master, mode: str) -> None:
    """The mode's function above; where the drive type does not have it, 6502h tells BaseNode402, which refuses."""
    if mode in modes_of(master.profile.name):
        MODES[mode](master)
        return
    with pytest.raises(TypeError, match="not suppported"):
        master.node.op_mode = mode
