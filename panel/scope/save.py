"""What a scope holds, as files: CSV of every channel, or a recording of the axes for the identification and the diagnosis."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from drivetwin.drive_profiles.profile import Role
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import scratch
from drivetwin.panel.node_watch import POSITION, NodeWatch
from drivetwin.panel.pdo_reading import Address
from drivetwin.panel.scope.channel import AnyChannel, ObjectChannel
from drivetwin.panel.scope.ring import Samples
from drivetwin.panel.scope.scope import Held, Trace
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_into

STEP_TOLERANCE = 0.01
"""Of the equal steps of a recording (contract recording/2)."""

FEWEST_SAMPLES = 2


def csv_of(channels: tuple[AnyChannel, ...], held: Held) -> str:
    """A row an instant at which a channel has a sample; empty where it has none. The truth says so in its name."""
    times = np.unique(np.concatenate([held.traces[channel.key][0] for channel in channels] or [np.empty(0)]))
    columns = [_at(times, held.traces[channel.key]) for channel in channels]
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["time [s]", *(f"{channel.label} ({channel.key}) [{channel.unit}]" for channel in channels)])
    for place, time in enumerate(times):
        rows.writerow([f"{time:.6f}", *("" if np.isnan(column[place]) else f"{column[place]:.9g}" for column in columns)])
    return text.getvalue()


def _at(times: Samples, trace: Trace) -> Samples:
    column = np.full(len(times), np.nan)
    column[np.searchsorted(times, trace[0])] = trace[1]
    return column


def recording_of(channels: tuple[AnyChannel, ...], held: Held, machine: str | None) -> Recording:
    """The axes that are shown with position and torque, joint side, SI. Raises UserError for what makes no recording."""
    if machine is None:
        raise UserError("a recording needs gears and joints, and this panel has joined a bus without a machine; save as CSV")
    shown = {(one.node.node_id, one.address): one for one in channels if isinstance(one, ObjectChannel)}
    nodes = {one.node.node_id: one.node for one in shown.values() if one.node.axis is not None}
    axes = {node.name: _columns(node, shown, held) for node in nodes.values() if (node.node_id, POSITION) in shown}
    if not axes:
        raise UserError("no position actual value (6064h) is shown; add it and the torque of an axis, or save as CSV")
    times = _common(axes)
    columns = {name: {quantity: trace[1] for quantity, trace in axis.items()} for name, axis in axes.items()}
    each = (node.axis for node in nodes.values() if node.axis is not None)
    known = {axis.name: AxisInfo(joint=axis.joint, gear_ratio=axis.gear_ratio) for axis in each}
    period = float(np.mean(np.diff(times)))
    info = RecordingInfo(machine=machine, sample_period=period, axes={name: known[name] for name in axes})
    even = times[0] + period * np.arange(len(times))
    return Recording("scope", info, even - times[0], columns)


def _columns(node: NodeWatch, shown: Mapping[tuple[int, Address], ObjectChannel], held: Held) -> dict[str, Trace]:
    """Contract columns of one axis, of the objects that are shown."""
    found: dict[str, Trace] = {}
    for column, address, factor in _meanings(node):
        channel = shown.get((node.node_id, address))
        if channel is None:
            continue
        if channel.source != "PDO":
            raise UserError(f"{channel.label} ({channel.key}) comes by SDO, at uneven times; take it away, or save as CSV")
        times, values = held.traces[channel.key]
        found[column] = times, values * factor
    if "torque" not in found:
        raise UserError(f"{node.name} is shown without its torque; add {_torque_name(node)}, or save as CSV")
    return found


def _meanings(node: NodeWatch) -> list[tuple[str, Address, float]]:
    """Column, object, and joint-side SI value of a shown one."""
    told: list[tuple[str, Address, float]] = [
        ("position", POSITION, 1.0),
        ("velocity", (0x606C, 0), 1.0),
        ("position_demand", (0x6062, 0), 1.0),
        ("velocity_demand", (0x606B, 0), 1.0),
    ]
    role = _torque_role(node)
    if role is not None and node.axis is not None:
        told.append(("torque", (role.index, role.subindex), role.si_per_unit * node.axis.gear_ratio))
    return told


def _torque_role(node: NodeWatch) -> Role | None:
    return next((role for name, role in node.profile.roles.items() if name == "torque_actual"), None)


def _torque_name(node: NodeWatch) -> str:
    role = _torque_role(node)
    return "its torque (this drive type has none in N·m)" if role is None else f"{role.index:04X}h:{role.subindex:02X}"


def _common(axes: Mapping[str, Mapping[str, Trace]]) -> Samples:
    """The instants of every column. Raises UserError where they are not the same, or not in equal steps."""
    each = [(f"{name}.{column}", trace[0]) for name, axis in axes.items() for column, trace in axis.items()]
    first, times = each[0]
    for name, others in each:
        if len(others) != len(times) or not np.allclose(others, times):
            raise UserError(f"{name} has other instants than {first}: their PDOs come at different times; save as CSV")
    steps = np.diff(times)
    if len(times) < FEWEST_SAMPLES or not np.allclose(steps, np.mean(steps), rtol=STEP_TOLERANCE, atol=0.0):
        raise UserError(f"{first} has {len(times)} samples in unequal steps; a recording needs equal ones; save as CSV")
    return times


def zipped(recording: Recording) -> bytes:
    """The folder of a recording as a zip file."""
    packed = io.BytesIO()
    with scratch() as folder, zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        write_into(recording, Path(folder))
        for file in sorted(Path(folder).iterdir()):
            archive.write(file, f"{recording.name}/{file.name}")
    return packed.getvalue()
