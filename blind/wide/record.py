"""Writes a case: the nominal model and what its axes recorded, and nothing of the truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Case, Cause
from drivetwin.blind.wide.case import WideCase
from drivetwin.blind.wide.channel import bandwidth, late, passed, quantised, sample_times, sampled
from drivetwin.blind.wide.draw import world_of
from drivetwin.blind.wide.drives import told
from drivetwin.blind.wide.machines import off
from drivetwin.blind.wide.motion import SETTLE, Plan
from drivetwin.blind.wide.simulator import Run
from drivetwin.blind.wide.truth import Axes
from drivetwin.blind.wide.world import World
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

MODEL, MODEL_OFF = "model.xml", "model_off.xml"

Columns = dict[str, NDArray[np.float64]]


def record_wide(case: Case, directory: Path, robots: Path | None = None, *, second_encoder: bool = False) -> None:
    """Write DIRECTORY/model.xml (nominal, exact), model_off.xml (some 4 % off), train_*/ and validate_*/.

    `second_encoder`: with the joints' own positions.
    """
    assert isinstance(case, WideCase)
    world = world_of(case, robots)
    directory.mkdir(parents=True, exist_ok=True)
    (directory / MODEL).write_text(world.machine.xml(), encoding="utf-8")
    (directory / MODEL_OFF).write_text(off(world.machine, np.random.default_rng([case.seed, 5])), encoding="utf-8")
    axes = world.axes(case.items)
    for number, plan in enumerate(world.plans):
        run = world.moved(case.items, plan)
        recording = _recording(world, case.items, axes, number, plan, run)
        if second_encoder:
            recording = _with_joints(recording, world, number, run)
        write_recording(recording, directory / plan.name)


def _recording(world: World, items: tuple[Cause, ...], axes: Axes, number: int, plan: Plan, run: Run) -> Recording:
    draw = np.random.default_rng([world.seed, 6, number])
    rate = world.rates[number]
    times = sample_times(len(run.position), rate)
    columns, infos = {}, {}
    for k, name in enumerate(world.names):
        own = tuple(item for item in items if item.axis == name)
        columns[name] = _columns(world, own, k, number, run, plan, times, draw)
        infos[name] = AxisInfo.model_validate(_info(world, own, axes, k, number))
    begun = {"start_time": round(plan.start_time + 0.6 * SETTLE, 6) if world.tells_start else None}
    info = RecordingInfo.model_validate({"machine": "machine", "sample_period": 1.0 / rate, "axes": infos, **begun})
    return Recording(plan.name, info, times - times[0], columns)


def _with_joints(recording: Recording, world: World, number: int, run: Run) -> Recording:
    """With an encoder behind each transmission, as fine as that of the motor, its zero that of the recording's position."""
    times = sample_times(len(run.position), world.rates[number])
    columns = {}
    for k, name in enumerate(world.names):
        start = float(sampled(run.reading[:, k], times)[0]) if world.relative[number] else 0.0
        joint = quantised(sampled(run.joint[:, k], times) - start, world.channels[k].position_quantum)
        columns[name] = {**recording.columns[name], "joint_position": joint}
    return replace(recording, columns=columns)


def _columns(
    world: World, items: tuple[Cause, ...], k: int, number: int, run: Run, plan: Plan, times: NDArray[np.float64],
    draw: np.random.Generator,
) -> Columns:
    """The columns of one axis."""
    channel, drive = world.channels[k], world.drives[k]
    torque = sampled(passed(run.given[:, k], items), times)
    position = sampled(run.reading[:, k], times)
    start = position[0] if world.relative[number] else 0.0
    columns = {
        "torque": quantised(torque + channel.torque_noise * draw.standard_normal(len(times)), channel.torque_quantum),
        "position": quantised(position - start, channel.position_quantum),
    }
    if channel.velocity:
        columns["velocity"] = sampled(_filtered(run.velocity[:, k], drive.velocity_lag), times)
    if drive.demand_is_recorded:
        columns["position_demand"] = sampled(plan.position[:, k], times) - start
        if drive.inertia_feedforward > 0.0:
            ahead = drive.inertia_feedforward * (world.links[k] + world.machine.nominal[k].rotor)
            acceleration = np.gradient(np.gradient(plan.position[:, k], 0.00025), 0.00025)
            columns["torque_offset"] = sampled(ahead * acceleration, times)
    return columns


def _filtered(velocity: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    return passed(velocity, (Cause("torque_lowpass", "", {"bandwidth": 1.0 / (2.0 * np.pi * lag)}),))


def _info(world: World, items: tuple[Cause, ...], axes: Axes, k: int, number: int) -> dict[str, Any]:
    """The entry of one axis in recording.json; timing of the torque channel only where it is known."""
    channel, known = world.channels[k], world.machine.nominal[k]
    delay = late(items)
    return {
        "joint": world.names[k],
        "actuator": world.names[k],
        "rated_torque": known.rated_torque,
        "torque_resolution": channel.torque_quantum,
        "position_resolution": channel.position_quantum,
        "gear_ratio": world.machine.limits[k].gear_ratio,
        "torque_bandwidth_hz": bandwidth(items) if channel.tells_timing else None,
        "torque_delay": delay if channel.tells_timing and delay > 0.0 else None,
        "position_relative": world.relative[number],
        "drive": told(axes[k], world.drives[k]),
    }
