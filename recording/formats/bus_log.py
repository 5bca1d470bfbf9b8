"""Bus logs as signals: the contents of PDOs, on the grid of SYNC.

The mapping is what the EDS or DCF says and what the log's own SDO transfers set (`bus_node.py`).
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.bus_node import Node, Pdo, follow_sdo, node_from_eds, object_name, unconfirmed, with_constants
from drivetwin.recording.checks import GAP_FACTOR, TOLERANCE
from drivetwin.recording.formats.base import ImportFormat, Signals
from drivetwin.recording.import_map import AxisMap, BusLayout, ColumnMap, ImportMap, ObjectKey
from drivetwin.recording.in_child import UnreadableError, read_in_child
from drivetwin.recording.recording import Samples
from drivetwin.recording.to_joint import to_joint_side

logger = logging.getLogger(__name__)

_CODES = {
    "int8": "b",
    "int16": "h",
    "int32": "i",
    "uint8": "B",
    "uint16": "H",
    "uint32": "I",
    "float32": "f",
    "float64": "d",
}
# CiA 402-2 objects that a recording is made of, for logs that come without an EDS.
_STANDARD_TYPES = {
    0x6062: "int32",
    0x6064: "int32",
    0x606B: "int32",
    0x606C: "int32",
    0x6071: "int16",
    0x6077: "int16",
    0x607A: "int32",
    0x60B0: "int32",
    0x60B1: "int32",
    0x60B2: "int16",
    0x60C1: "int32",
    0x60FF: "int32",
}

_SYNC_PERIOD = (0x1006, 0)


@dataclass
class _Signal:
    """Where one column is taken from, and the values seen: (cycle in which it holds, value)."""

    axis: str
    column: str
    key: ObjectKey
    node: Node
    type_: str
    cycles: list[int] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    hold: int = 1


@dataclass(frozen=True)
class BusSignals:
    """`time` is (n,) [s] on the SYNC grid, `raw[axis][column]` is (n,) as on the bus, `axes` with what the log said.

    `unconfirmed[axis]`: of the factors that the map leaves out, the objects for which there is an EDS default only.
    """

    time: Samples
    raw: dict[str, dict[str, Samples]]
    axes: dict[str, AxisMap]
    unconfirmed: dict[str, tuple[str, ...]]
    files: tuple[Path, ...]


class BusLog(ImportFormat):
    """Bus logs; what the map says of their reading is under `bus`."""

    name: ClassVar[str] = "bus"
    endings: ClassVar[tuple[str, ...]] = (".log", ".asc", ".blf", ".trc")

    def signals(self, file: Path, import_map: ImportMap, *, mend: bool) -> Signals:
        return _bus_signals(file, import_map)


def _bus_signals(file: Path, import_map: ImportMap) -> Signals:
    if import_map.time is not None:
        logger.warning("%s: `time` is not used for a bus log, its rows are SYNC cycles", import_map.path)
    bus = read_bus_log(file, import_map)
    columns = {
        axis: {name: _bus_column(file, axis, name, values, bus) for name, values in named.items()}
        for axis, named in bus.raw.items()
    }
    return Signals(bus.time, columns, bus.axes, (file, import_map.path, *bus.files))


def _bus_column(file: Path, axis: str, name: str, raw: Samples, bus: BusSignals) -> Samples:
    entry = bus.axes[axis]
    column = entry.columns[name]
    if column.unit is None:
        raise UserError(
            f"{file}: {axis}.{name}: an object has no unit of its own; give `unit:` in the map (inc, permille ...)"
        )
    try:
        return to_joint_side(f"{file}: {axis}.{name}", name, raw, column, entry)
    except UserError as error:
        if not bus.unconfirmed[axis]:
            raise
        raise UserError(
            f"{error}; the EDS has only defaults of {', '.join(bus.unconfirmed[axis])}, which the log does not confirm, and "
            "the drive may be set otherwise: give the constant in the map, the DCF as `eds`, or a log of reading the object"
        ) from None


def read_bus_log(file: Path, import_map: ImportMap) -> BusSignals:
    """Reconstruct every column of the map from the log.

    A row is a SYNC. A synchronous TPDO that follows SYNC k carries the values of row k; a set-point is in row k if
    it was the last one sent before SYNC k, with which it took effect. Raises UserError where the log cannot be read,
    has no SYNC, or an object of the map is in no PDO.
    """
    eds_files = {axis: _eds_file(import_map, entry) for axis, entry in import_map.axes.items()}
    nodes = _nodes(import_map, eds_files)
    signals = [
        _Signal(
            axis, name, _object(file, axis, name, column), nodes[axis], _type(file, axis, name, column, nodes[axis])
        )
        for axis, entry in import_map.axes.items()
        for name, column in entry.columns.items()
    ]
    layout = import_map.bus
    syncs = _follow(file, layout, list(nodes.values()), signals)
    cycles, period = _grid(file, layout, syncs, list(nodes.values()))
    raw: dict[str, dict[str, Samples]] = {axis: {} for axis in import_map.axes}
    for signal in signals:
        column = import_map.axes[signal.axis].columns[signal.column]
        if signal.cycles:
            raw[signal.axis][signal.column] = _on_grid(signal, len(syncs))
        elif not column.optional:
            raise UserError(_absent(file, signal))
    kept = _complete(file, raw, import_map)
    axes = {axis: with_constants(entry, nodes[axis]) for axis, entry in import_map.axes.items()}
    used = tuple(dict.fromkeys(path for path in eds_files.values() if path is not None))
    trimmed = {axis: {name: values[kept] for name, values in named.items()} for axis, named in raw.items()}
    unconfirmed_of = {axis: unconfirmed(entry, nodes[axis]) for axis, entry in import_map.axes.items()}
    return BusSignals(cycles[kept] * period, trimmed, axes, unconfirmed_of, used)


def _object(file: Path, axis: str, name: str, column: ColumnMap) -> ObjectKey:
    if column.object_ is None:
        raise UserError(
            f"{file}: axes.{axis}.columns.{name}: a bus log has objects, not columns; give `object: 0x....`"
        )
    return column.object_


def _type(file: Path, axis: str, name: str, column: ColumnMap, node: Node) -> str:
    key = _object(file, axis, name, column)
    found = column.type_ or node.types.get(key) or _STANDARD_TYPES.get(key[0])
    if found is None:
        raise UserError(
            f"{file}: axes.{axis}.columns.{name}: the type of object {object_name(key)} is not known; give its EDS (`eds:`) "
            "or `type: int32` (int8 to uint32, float32, float64) in the map"
        )
    return found


def _eds_file(import_map: ImportMap, axis: AxisMap) -> Path | None:
    name = axis.eds or import_map.bus.eds
    return import_map.beside(name) if name is not None else None


def _nodes(import_map: ImportMap, eds_files: dict[str, Path | None]) -> dict[str, Node]:
    by_number: dict[int, Node] = {}
    nodes: dict[str, Node] = {}
    for axis, entry in import_map.axes.items():
        if entry.node is None:
            raise UserError(
                f"{import_map.path}: axes.{axis}.node is missing; a bus log needs the axis' node ID (1 to 127)"
            )
        if entry.node not in by_number:
            by_number[entry.node] = node_from_eds(eds_files[axis], entry.node)
        nodes[axis] = by_number[entry.node]
    return nodes


@dataclass(frozen=True)
class _Frame:
    """A data frame: `time` [s], 11-bit `identifier`, and its bytes."""

    time: float
    identifier: int
    data: bytes


def _frames(file: Path, layout: BusLayout) -> Iterator[_Frame]:
    """The log's data frames with 11-bit identifiers, of one channel where the map names it."""
    try:
        log = read_in_child("bus", file)
    except FileNotFoundError:
        raise UserError(f"{file} does not exist; give the bus log to import") from None
    except (OSError, UnreadableError) as error:
        raise UserError(
            f"{file} cannot be read as a bus log: {error}; candump logs are written with `candump -L` (or -l), "
            "others as .asc, .blf or .trc"
        ) from error
    names, data = log["channels"].tolist(), log["data"].tobytes()
    channel = None if layout.channel is None else names.index(str(layout.channel)) if str(layout.channel) in names else -1
    end = 0
    for time, identifier, length, on in zip(*(log[name] for name in ("time", "identifier", "length", "channel")), strict=True):
        end += int(length)
        if channel is None or on == channel:
            yield _Frame(float(time), int(identifier), data[end - int(length) : end])


def _follow(file: Path, layout: BusLayout, nodes: list[Node], signals: list[_Signal]) -> list[float]:
    """Walk through the log; the time stamps of the SYNCs. Fills `signals` and what the SDO transfers say of `nodes`."""
    follower = _Follower(nodes, signals, layout.sync_id)
    for frame in _frames(file, layout):
        follower.take(frame)
    if len(follower.syncs) < 2:
        raise UserError(
            f"{file}: {len(follower.syncs)} SYNC frames (identifier {layout.sync_id:X}h); the rows of a recording are "
            "SYNC cycles: log with the SYNC, or correct bus.sync_id or bus.channel in the map"
        )
    return follower.syncs


class _Follower:
    """The state of the bus while the log is walked through."""

    def __init__(self, nodes: list[Node], signals: list[_Signal], sync_id: int) -> None:
        self.syncs: list[float] = []
        self._nodes = {node.number: node for node in nodes}
        self._signals = signals
        self._sync_id = sync_id
        self._decoders: dict[int, list[Callable[[bytes, int], None]]] = {}
        self._map()

    def take(self, frame: _Frame) -> None:
        identifier, data = frame.identifier, frame.data
        if identifier == self._sync_id:
            self.syncs.append(frame.time)
        elif identifier & ~0x7F in (0x580, 0x600) and identifier & 0x7F in self._nodes:
            if follow_sdo(self._nodes[identifier & 0x7F], data, from_server=identifier < 0x600):
                self._map()
        else:
            for decode in self._decoders.get(identifier, ()):
                decode(data, len(self.syncs) - 1)

    def _map(self) -> None:
        """Which identifier carries what, as the nodes stand now."""
        self._decoders = {}
        for signal in self._signals:
            for pdo in signal.node.pdos():
                cob_id = signal.node.cob_id(pdo)
                for key, start, bits in signal.node.fields(pdo):
                    if key == signal.key and cob_id is not None:
                        self._decoders.setdefault(cob_id, []).append(_decoder(signal, pdo, start, bits))


def _decoder(signal: _Signal, pdo: Pdo, start: int, bits: int) -> Callable[[bytes, int], None]:
    """Take the value out of a frame and note the cycle from which it holds."""
    code = "<" + _CODES[signal.type_]
    size = struct.calcsize(code)
    transmission = signal.node.value((pdo.communication, 2), 1)
    synchronous = transmission <= 240
    # What the drive sends after SYNC k was sampled at SYNC k; what it is sent acts, and what it sends by event is
    # known, from the next SYNC on.
    delay = 0 if pdo.transmit and synchronous else 1
    hold = max(1, transmission) if pdo.transmit and synchronous and transmission > 0 else _FOREVER

    def decode(data: bytes, cycle: int) -> None:
        raw = data[start // 8 : (start + bits) // 8]
        if start % 8 or len(raw) < size or 8 * size != bits:
            return
        signal.hold = hold
        signal.cycles.append(cycle + delay)
        signal.values.append(float(struct.unpack(code, raw)[0]))

    return decode


_FOREVER = 1 << 62


def _grid(file: Path, layout: BusLayout, syncs: list[float], nodes: list[Node]) -> tuple[np.ndarray[Any, Any], float]:
    """Number of each SYNC on the grid, counting those that were lost, and the grid's step [s].

    Raises UserError where the time stamps do not go with the period.
    """
    stamps = np.asarray(syncs)
    told = next((node.values[_SYNC_PERIOD] for node in nodes if node.values.get(_SYNC_PERIOD)), None)
    period = layout.sync_period or (told * 1e-6 if told else _round(float(np.median(np.diff(stamps)))))
    if layout.grid == "count":
        numbers = np.arange(len(stamps))
    else:
        span = float(stamps[-1] - stamps[0])
        if not abs(span) < _MOST_CYCLES * period:
            raise UserError(
                f"{file}: the time stamps of the SYNCs go from {stamps[0]:g} to {stamps[-1]:g} s with a period of "
                f"{period:g} s; cut the log where they jump, or give bus.sync_period in the map"
            )
        steps = np.diff(stamps) / period
        # Time stamps of a host jitter, the producer does not: a step is as many cycles as fit best, at least one.
        lost = np.where(steps > GAP_FACTOR, np.round(steps), 1).astype(np.int64)
        numbers = np.concatenate(([0], np.cumsum(lost)))
        if abs(numbers[-1] * period - span) > max(TOLERANCE * span, period):
            raise UserError(
                f"{file}: {len(stamps)} SYNCs in {span:g} s do not go with a period of {period:g} s; "
                "give bus.sync_period, or `bus.grid: count` in the map where the time stamps are not those of the "
                "cycle (a lockstep run)"
            )
    return numbers, period


_MOST_CYCLES = 1e9
"""Of a log, lost ones counted: eleven days at 1 kHz."""


def _round(period: float) -> float:
    """A measured period as the round number of microseconds that the producer was set to, if it is within 1 %."""
    for unit in (1e-3, 1e-4, 1e-5, 1e-6):
        rounded = round(period / unit) * unit
        if rounded and abs(rounded - period) < TOLERANCE * period:
            return float(f"{rounded:.6g}")
    return period


def _on_grid(signal: _Signal, count: int) -> Samples:
    """The value that holds in each of `count` cycles, NaN where none is known."""
    values = np.full(count, np.nan)
    cycles = np.asarray(signal.cycles)
    last = np.searchsorted(cycles, np.arange(count), side="right") - 1
    known = (last >= 0) & (np.arange(count) - cycles[last] < signal.hold)
    values[known] = np.asarray(signal.values)[last[known]]
    return values


def _complete(file: Path, raw: dict[str, dict[str, Samples]], import_map: ImportMap) -> np.ndarray[Any, Any]:
    """Indices of the cycles in which every required column is known; what is missing at the ends is left out."""
    required = [
        values
        for axis, named in raw.items()
        for name, values in named.items()
        if not import_map.axes[axis].columns[name].optional
    ]
    kept = np.flatnonzero(np.all(np.isfinite(required), axis=0))
    if len(kept) < 2:
        raise UserError(
            f"{file}: there are not two SYNC cycles in which every column of the map is known; log them together"
        )
    return kept


def _absent(file: Path, signal: _Signal) -> str:
    mapped = sorted({object_name(key) for pdo in signal.node.pdos() for key, _, _ in signal.node.fields(pdo)})
    return (
        f"{file}: no object {object_name(signal.key)} of node {signal.node.number} for {signal.axis}.{signal.column}; "
        f"the PDOs of that node carry: {', '.join(mapped) or 'nothing that the log or an EDS states'}; give the "
        "EDS or DCF that says the mapping (`eds:`), correct `object`, or log the start of the bus"
    )


