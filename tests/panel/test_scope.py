"""The scope keeps what the bus says, triggers where it should, loses no peak, and needs no more memory after ten minutes."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from frame_bench import frames

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.profile import DataType
from drivetwin.foundation.errors import UserError
from drivetwin.panel.bus_time import BusTime
from drivetwin.panel.frames import Frames
from drivetwin.panel.node_watch import Axis, NodeWatch
from drivetwin.panel.pdo_reading import Field, Pdo
from drivetwin.panel.scope.picture import COLUMNS, Span, envelope, pairs
from drivetwin.panel.scope.ring import Ring
from drivetwin.panel.scope.save import csv_of, recording_of, zipped
from drivetwin.panel.scope.scope import MOST_CHANNELS, Scope
from drivetwin.panel.scope.trigger import Trigger
from drivetwin.recording.reader import read_recording

SERVOONE = load_profile("servoone")
POSITION, STATUSWORD, TORQUE = "1:6064:00", "1:6041:00", "1:21A3:00"
UNIT = 1e-6
"""rad a position unit."""


class Bench:
    """One drive whose TPDO brings position and torque at each SYNC of a millisecond, and a scope that looks."""

    def __init__(self) -> None:
        self.node = NodeWatch(None, 1, SERVOONE, Axis("lift", "lift", 50.0, "rad"))  # type: ignore[arg-type]  # nobody to ask
        self.node.unit = UNIT
        fields = (Field((0x6064, 0), DataType.I32, 0, 4), Field((0x21A3, 0), DataType.R32, 4, 8))
        self.node.pdos = {0x281: Pdo(0x281, True, fields), 0x181: Pdo(0x181, True, (Field((0x6041, 0), DataType.U16, 0, 2),))}
        self.time = BusTime(1)
        self.scope = Scope({1: self.node}, self.time, None)

    def cycle(self, position: float, torque: float = 0.0, statusword: int = 0x27) -> None:
        """A SYNC and what answers it; position [rad], torque of the motor [N·m]."""
        data = round(position / UNIT).to_bytes(4, "little", signed=True) + np.float32(torque).tobytes()
        self.pass_on(frames((0x80, b""), (0x281, data), (0x181, statusword.to_bytes(2, "little"))))

    def pass_on(self, passed: Frames) -> None:
        """What the panel does with frames."""
        timed = replace(passed, times=self.time.of(passed))
        self.node.take(timed)
        self.scope.settle()


def show(bench: Bench, *keys: str, trigger: Trigger | None = None, pre: float = 0.2) -> None:
    bench.scope.set(list(keys), 0.5, pre, trigger, None)


def test_a_ring_keeps_the_last_and_no_more() -> None:
    ring = Ring(capacity=100)
    for number in range(0, 1234, 2):
        ring.extend(np.array([number, number + 1.0]), np.array([-number, -number - 1.0]))
    times, values = ring.between(1134, 2000)
    assert times.tolist() == list(range(1134, 1234))
    assert (values == -times).all()


def test_each_column_has_its_smallest_and_its_largest() -> None:
    """By a plain loop over the samples; a single wrong sample among 100,000 is still seen."""
    random = np.random.default_rng(7)
    times = np.sort(random.uniform(-1.0, 3.0, 100_000))
    values = random.normal(size=times.size)
    values[54_321] = 100.0
    span = Span(0.0, 2.0)
    drawn = envelope(times, values, span).reshape(-1, 2)
    edges = np.linspace(0.0, 2.0, COLUMNS + 1)
    for column in range(COLUMNS):
        inside = values[(times >= edges[column]) & (times < edges[column + 1])]
        assert drawn[column].tolist() == sorted([inside.min(), inside.max()], reverse=bool(inside[0] > inside[-1]))
    assert np.nanmax(drawn) == 100.0


def test_a_column_without_a_sample_is_empty() -> None:
    drawn = envelope(np.array([0.5]), np.array([3.0]), Span(0.0, 1.0))
    assert np.flatnonzero(~np.isnan(drawn)).tolist() == [COLUMNS, COLUMNS + 1]


def test_pairs_are_of_one_instant() -> None:
    slow = np.array([0.0, 1.0, 2.0]), np.array([10.0, 11.0, 12.0])
    x, y = pairs(slow, (np.array([-0.5, 0.5, 2.5]), np.array([1.0, 2.0, 3.0])))
    assert (x.tolist(), y.tolist()) == ([10.0, 12.0], [2.0, 3.0])


def test_a_level_triggers_with_what_was_before_it() -> None:
    """A ramp of 1 rad/s from 0: it passes 0.7 rad at 0.7 s."""
    bench = Bench()
    show(bench, POSITION, trigger=Trigger(POSITION, "rises", 0.7), pre=0.8)
    for number in range(1500):
        bench.cycle(0.001 * (number + 1))
    held = bench.scope.held
    assert held is not None
    assert held.fired == pytest.approx(0.7, abs=1e-9)
    assert (held.span.start, held.span.end) == pytest.approx((0.3, 0.8))
    times, values = held.traces[POSITION]
    assert np.allclose(values, times, atol=1e-6)
    assert (times[0], times[-1]) == pytest.approx((0.3, 0.8), abs=0.0011)
    assert bench.scope.state == "triggered"


def test_a_falling_level_is_not_a_rising_one() -> None:
    bench = Bench()
    show(bench, POSITION, trigger=Trigger(POSITION, "falls", 0.1))
    for number in range(700):
        bench.cycle(0.001 * number)
    assert bench.scope.state == "waits for the trigger"
    for number in range(700, 0, -1):
        bench.cycle(0.001 * number)
    assert bench.scope.held is None
    for _ in range(500):
        bench.cycle(0.0)
    assert bench.scope.held is not None


def test_entering_a_state_triggers() -> None:
    bench = Bench()
    show(bench, STATUSWORD, POSITION, trigger=Trigger(STATUSWORD, "state", state="Fault"))
    for word, cycles in ((0x27, 300), (0x0F, 10), (0x08, 600)):
        for _ in range(cycles):
            bench.cycle(0.0, statusword=word)
    assert bench.scope.held is not None
    assert bench.scope.held.fired == pytest.approx(0.311)


@pytest.mark.parametrize(
    ("keys", "trigger", "why"),
    [
        ([POSITION, "2:6064:00"], None, "there is no node 2"),
        (["1:5000:00"], None, "have no 5000h:00"),
        (["1:1008:00"], None, "is no number"),
        (["truth:lift:position"], None, "can read the truth"),
        (["position"], None, "expected NODE:INDEX:SUBINDEX"),
        ([POSITION], Trigger(TORQUE, "rises"), "not among the channels"),
        ([POSITION], Trigger(POSITION, "state", state="Fault"), "has no states"),
        ([STATUSWORD], Trigger(STATUSWORD, "state", state="Broken"), "unknown state"),
        ([f"1:60{number:02X}:00" for number in range(MOST_CHANNELS + 1)], None, "a scope has 12 at most"),
    ],
)
def test_what_cannot_be_shown_is_refused(keys: list[str], trigger: Trigger | None, why: str) -> None:
    bench = Bench()
    with pytest.raises(UserError, match=why):
        show(bench, *keys, trigger=trigger)
    assert [channel.key for channel in bench.scope.settings.channels] == [POSITION]


def test_a_recording_is_read_back_in_si_of_the_joint(tmp_path: Path) -> None:
    bench = Bench()
    show(bench, POSITION, TORQUE)
    for number in range(600):
        bench.cycle(0.5 * np.sin(0.01 * number), torque=0.25)
    bench.scope.run(False)
    recording = recording_of(bench.scope.settings.channels, bench.scope.shown(), "scara")
    with zipfile.ZipFile(io.BytesIO(zipped(recording))) as archive:
        archive.extractall(tmp_path)
    (read,) = read_recording(tmp_path / "scope")
    assert read.info.sample_period == pytest.approx(0.001)
    assert np.allclose(read.columns["lift"]["torque"], 0.25 * 50.0)
    position = read.columns["lift"]["position"]
    assert np.allclose(np.diff(position, 2), -(0.01**2) * position[1:-1], atol=5e-6)


@pytest.mark.parametrize(
    ("keys", "machine", "why"),
    [
        ([POSITION, TORQUE], None, "joined a bus without a machine"),
        ([TORQUE], "scara", "no position actual value"),
        ([POSITION], "scara", "without its torque; add 21A3h:00"),
        ([POSITION, TORQUE, "1:606C:00"], "scara", "comes by SDO"),
    ],
)
def test_what_makes_no_recording_is_said(keys: list[str], machine: str | None, why: str) -> None:
    bench = Bench()
    show(bench, *keys)
    for _ in range(600):
        bench.cycle(0.0)
    with pytest.raises(UserError, match=why):
        recording_of(bench.scope.settings.channels, bench.scope.shown(), machine)


def test_a_lost_frame_makes_no_recording() -> None:
    bench = Bench()
    show(bench, POSITION, TORQUE)
    for number in range(600):
        bench.pass_on(frames((0x80, b""))) if number == 400 else bench.cycle(0.0)
    with pytest.raises(UserError, match="in unequal steps"):
        recording_of(bench.scope.settings.channels, bench.scope.shown(), "scara")


def test_csv_has_a_row_an_instant() -> None:
    bench = Bench()
    show(bench, POSITION, STATUSWORD)
    for number in range(100):
        bench.cycle(0.001 * number)
    head, *rows = csv.reader(io.StringIO(csv_of(bench.scope.settings.channels, bench.scope.shown())))
    assert head[0] == "time [s]"
    assert head[1].endswith("(1:6064:00) [rad]")
    assert len(rows) == 100
    assert rows[-1] == ["0.100000", "0.099", "39"]


def test_the_time_of_an_emulated_machine_is_that_of_its_syncs() -> None:
    time = BusTime(1)
    sync, four = (0x80, b""), (0x601, bytes((0x23, 0x06, 0x10, 0x00)) + (4000).to_bytes(4, "little"))
    assert time.of(frames(sync, four, sync, sync)) == pytest.approx([0.001, 0.001, 0.005, 0.009])
    assert time.of(frames(sync, (0x701, b"\0"), sync)) == pytest.approx([0.013, 0.013, 0.014])
    time.written((0x1006, 0), (2000).to_bytes(4, "little"))
    assert time.of(frames(sync)) == pytest.approx([0.016])


def test_twelve_channels_of_a_kilohertz_for_ten_minutes_need_no_more_memory() -> None:
    """Once every ring is full. In a process of its own: the pages of this one also hold what other tests left."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as processes:
        peaks, samples = processes.submit(_ten_minutes).result()
    came = 16 * 1000 * 20 * (len(peaks) - 7) * MOST_CHANNELS  # bytes: an instant and a value a sample
    assert peaks[-1] - peaks[6] < 0.1 * came / 1024
    assert samples == pytest.approx(60_000, abs=2)


def _ten_minutes() -> tuple[list[int], int]:
    """Peak memory of this process every 20 s [kB], and the samples that a channel shows at the end."""
    bench = Bench()
    numbers = [entry for entry in SERVOONE.objects if entry.data_type is DataType.U16 and entry.access.readable]
    keys = [f"1:{entry.index:04X}:{entry.subindex:02X}" for entry in numbers[:MOST_CHANNELS]]
    bench.scope.set(keys, 60.0, 0.2, None, None)
    peaks = []
    for second in range(600):
        for _ in range(40):
            times = np.asarray(bench.time.now + 0.001 * np.arange(1, 26))
            bench.time.now = times[-1]
            for key in keys:
                bench.scope.keep(key, times, np.full(25, float(second)))
        if second % 20 == 19:
            assert len(bench.scope.shown().traces) == MOST_CHANNELS
            peaks.append(_peak())
    return peaks, bench.scope.shown().traces[keys[-1]][0].size


def _peak() -> int:
    """[kB] of this program's pages alone: `ru_maxrss` begins with those of the process that started it."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    assert found is not None
    return int(found[1])
