"""From recordings to what causes are compared on: the motion of each axis, its torque, and which samples count."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from drivetwin.diagnosis.prepare.asked_torque import AskedTorque
from drivetwin.diagnosis.prepare.channel import earlier, step_of, torque_of, unchanged
from drivetwin.diagnosis.prepare.cutoff import HIGHEST_SHARE_OF_RATE
from drivetwin.diagnosis.prepare.deflection import deflection
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.positions import moved
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects import AxisEffect
from drivetwin.emulator.effects.base import Strays
from drivetwin.motion.axis_motion import (
    STANDSTILL_REACH,
    AxisMotion,
    measured_position,
    select,
    standstill_velocities,
    velocity_noise,
    widen,
)
from drivetwin.motion.filtering import effective_cutoff, fine_derivative, reach, zero_phase
from drivetwin.recording.recording import Recording

NOTHING_ASKED: Mapping[str, AskedTorque] = MappingProxyType({})

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WIDE = 2.5
"""The motion that effects see is filtered this many times wider than what is compared: their torque is filtered once more."""
RIGID_RATE = 3.0
"""The rigid model is evaluated at so many samples a period of the motion's own cut-off, and joined by a cubic spline."""
SAMPLED = (
    *("position", "velocity", "acceleration", "torque", "time", "rigid_torque", "inertia"),
    *("from_others", "weight_slope", "deflection"),
)
"""Fields of a motion that are samples, where it has them."""
TURNED = 0.5
"""Of a sample period before and after a reversal, in which friction may have turned round or not."""
HARDLY_COUPLED = 1e-3
"""Of the inertias of two axes, that the one between them must be to count."""
ENOUGH_FITTED = 0.25
"""Of the samples in motion, that must be far from a standstill to be fitted alone; an axis may dwell everywhere."""
REVERSAL = 0.015
"""Around a reversal, within which no gap is measured [s]: it would show at what instant friction changed its sign, and that it
yields by some micrometres before it slides, as any real one does. It is fitted."""
PREDICTED_RATE = 8.0
"""Samples from which effects are predicted while they are searched, a period of the cut-off of the comparison, or of the motion
where that is lower: derivatives of them err by 0.2 %."""
FOLLOWED_RATE = 4.0
"""The same, a period of the motion's own cut-off: what of it is above that of the comparison only bends friction and joints."""
COMPARED_RATE = 2.5
"""Samples that are compared, a period of the cut-off: no more is in them."""


@dataclass(frozen=True)
class Coupling:
    """What one axis feels of another, (n,) each: d torque / d acceleration and d weight / d position of that."""

    inertia: Array
    weight_slope: Array

    def part(self, span: slice) -> Coupling:
        """Some samples of it, at equal steps."""
        return Coupling(self.inertia[span], self.weight_slope[span])

    def torque(self, strays: Strays) -> Array:
        """Torque (n,) that it feels of a joint that strays."""
        return np.asarray(self.inertia * strays.acceleration + self.weight_slope * strays.position)


@dataclass(frozen=True)
class AxisRun:
    """One axis over one recording, (n,) each; torque filtered [N·m or N]. `used` counts in gaps, `fitted` in fits.

    `asked`: how its torque is known where it was not recorded.

    `unchanged`: how long the torque stays as recorded there [s]; `step`: the least by which it changes [N·m or N].
    `base` is the torque of the simulation as it stands; where `sticks`, for a moment in the middle of a motion, the measured
    one, for stiction holds any. `weight`: what the simulation's axis needs to stand where it is.
    """

    axis: str
    motion: Motion
    torque: Array
    base: Array
    weight: Array
    sticks: Mask
    used: Mask
    fitted: Mask
    unchanged: Array
    step: float
    asked: AskedTorque | None = None

    def part(self, span: slice) -> AxisRun:
        """Some samples of it, at equal steps."""
        own: dict[str, Any] = {name: samples[span] for name, samples in sampled(self.motion).items()}
        return replace(
            self,
            motion=replace(self.motion, **own),
            torque=self.torque[span],
            base=self.base[span],
            weight=self.weight[span],
            sticks=self.sticks[span],
            used=self.used[span],
            fitted=self.fitted[span],
            unchanged=self.unchanged[span],
        )

    @property
    def of_motion(self) -> Array:
        """The torque (n,) less the weight: of this a comparison errs by a share. The weight at a position is as the model has
        it, or the model is wrong; a torque that was not recorded errs as a whole.
        """
        return np.asarray(self.torque - self.weight) if self.asked is None else self.torque

    def counting(self, used: Mask, fitted: Mask) -> AxisRun:
        """The same, of which no more than some samples (n,) count, and are fitted."""
        return replace(self, used=self.used & used, fitted=self.fitted & fitted)

    def without_edges(self, edge: int) -> AxisRun:
        """The same, of which `edge` samples at both ends are not fitted."""
        fitted = self.fitted.copy()
        fitted[:edge] = fitted[-edge:] = False
        return replace(self, fitted=fitted)


@dataclass(frozen=True)
class Run:
    """One recording, prepared: every `stride`-th sample is compared; `kinematics` (n, k) of all axes through that filter.

    `period` [s]: between samples; `cutoff_hz`, `motion_hz` [Hz]: of the filters of the comparison, and of the motion.
    `coupling`, by two axes: what the second feels of the first, where it feels any.
    """

    recording: Recording
    period: float
    cutoff_hz: float
    motion_hz: float
    stride: int
    kinematics: Kinematics
    axes: Mapping[str, AxisRun]
    coupling: Mapping[tuple[str, str], Coupling]
    _kept: dict[Hashable, Array] = field(init=False, repr=False, compare=False, default_factory=dict)

    def kept(self, key: Hashable, made: Callable[[], Array]) -> Array:
        """What is made of this recording for a key, made once: torque of changed rigid bodies, which takes its time."""
        if key not in self._kept:
            self._kept[key] = made()
        return self._kept[key]

    def piece(self, span: slice) -> Run:
        """A stretch of it; what the filter cannot know at the two cuts is not fitted."""
        edge = reach(self.period, self.cutoff_hz)
        stretch = self._part(span)
        return replace(stretch, axes={name: axis.without_edges(edge) for name, axis in stretch.axes.items()})

    def only(self, held: Mask) -> Run:
        """The same, of which only some samples (n,) count."""
        return replace(self, axes={name: axis.counting(held, held) for name, axis in self.axes.items()})

    def without(self, held: Mask) -> Run:
        """The same, of which some samples (n,) do not count, nor those that the filter has them in are fitted."""
        near = widen(held, reach(self.period, self.cutoff_hz))
        return replace(self, axes={name: axis.counting(~held, ~near) for name, axis in self.axes.items()})

    def thinned(self) -> Run:
        """No more samples than effects need to be predicted from, and the comparison to be filtered: those of a torque are not
        in what is filtered.
        """
        predicted = max(PREDICTED_RATE * min(self.motion_hz, self.cutoff_hz), FOLLOWED_RATE * self.motion_hz)
        needed = max(predicted, self.cutoff_hz / HIGHEST_SHARE_OF_RATE)
        step = max(1, int(1.0 / (needed * self.period)))
        if step == 1:
            return self
        period = step * self.period
        return replace(self._part(slice(None, None, step)), period=period, stride=stride_of(period, self.cutoff_hz))

    def _part(self, span: slice) -> Run:
        axes = {name: axis.part(span) for name, axis in self.axes.items()}
        recording = replace(self.recording, time=self.recording.time[span])
        coupling = {pair: felt.part(span) for pair, felt in self.coupling.items()}
        return replace(self, recording=recording, kinematics=self.kinematics.part(span), axes=axes, coupling=coupling)

    def cost(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> dict[str, Array]:
        """Torque (n,), filtered, that an effect costs its axis, and those that feel the joint move otherwise than measured."""
        motion = self.axes[axis].motion
        torque, strays = effect.predict_with_joint(motion, dynamics)
        found = {axis: self.felt(self.axes[axis], torque)}
        if strays is not None:
            for (of, other), felt in self.coupling.items():
                if of == axis:
                    found[other] = self.felt(self.axes[other], felt.torque(strays))
        return found

    def deflected(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> Array | None:
        """How much further (n,), filtered, an effect has the joint ahead of its motor [rad or m]; None: no further."""
        ahead = effect.deflect(self.axes[axis].motion, dynamics)
        return self.smooth(ahead) if ahead is not None else None

    def earlier(self, own: AxisRun, late: float) -> Array:
        """How what is compared of the measured torque changes (n,), where it is read `late` [s] earlier."""
        change = earlier(own.torque, late, self.period) - own.torque
        return np.asarray(change - self._held_change(own, late))

    def placed(self, zeros: Mapping[str, float]) -> Run:
        """The recording with the position of some axes counted from other zeros [rad or m], which the model does not feel."""
        axes = {
            name: replace(own, motion=replace(own.motion, position=own.motion.position + zeros.get(name, 0.0)))
            for name, own in self.axes.items()
        }
        position = self.kinematics.position + [zeros.get(name, 0.0) for name in self.axes]
        kinematics = replace(self.kinematics, position=position)
        return replace(self, recording=moved(self.recording, zeros), kinematics=kinematics, axes=axes)

    def aligned(self, late: Mapping[str, float]) -> Run:
        """The recording with the torque of some axes read `late` [s] earlier."""
        return replace(self, axes={name: self._aligned(axis, late.get(name, 0.0)) for name, axis in self.axes.items()})

    def _aligned(self, own: AxisRun, late: float) -> AxisRun:
        if late == 0.0:
            return own
        return replace(
            own,
            motion=replace(own.motion, torque=earlier(own.motion.torque, late, self.period)),
            torque=earlier(own.torque, late, self.period),
            base=own.base + self._held_change(own, late),
        )

    def _held_change(self, own: AxisRun, late: float) -> Array:
        """The same of what stiction holds (n,), which the simulation takes from the torque as recorded: it is not filtered."""
        held = earlier(own.motion.torque, late, self.period) - own.motion.torque
        return self.smooth(np.where(own.sticks, held, 0.0))

    def smooth(self, torque: Array) -> Array:
        """The filter that measured torque went through."""
        return zero_phase(torque, self.period, self.cutoff_hz)

    def felt(self, own: AxisRun, torque: Array) -> Array:
        """What is compared of a torque (n,) beside the simulation's: nothing while the axis sticks, and through the filter."""
        return self.smooth(np.where(own.sticks, 0.0, torque))

    def moves(self, own: AxisRun) -> Array:
        """`felt` of a torque 1: what is left of one (n,) that changes little while the axis sticks, and is filtered already."""
        return self.felt(own, np.ones(len(own.torque)))


def sampled(motion: Motion) -> dict[str, Array]:
    """The samples (n,) of a motion, by field."""
    return {name: samples for name in SAMPLED if (samples := getattr(motion, name)) is not None}


def standstill_of(simulation: Simulation, recordings: Sequence[Recording], cutoff_hz: float) -> list[dict[str, float]]:
    """Speed [rad/s or m/s] above which each axis counts as moving, recording by recording; infinite where it never moves.

    0.2 % of its highest speed in all recordings, and five times the noise of this recording's velocity at the cut-off.
    """
    pieces = [_narrow(simulation, recording, cutoff_hz) for recording in recordings]
    found: list[dict[str, float]] = [{} for _ in pieces]
    for axis in simulation.axes:
        speeds = standstill_velocities([piece[axis] for piece in pieces])
        for each, speed in zip(found, speeds, strict=True):
            each[axis] = speed
    return found


def begins(recordings: Sequence[Recording]) -> list[float]:
    """When each recording's time was 0 [s] since the machine was switched on; by the clock, since the first; else 0."""
    clocks = [start.timestamp() for one in recordings if isinstance(start := one.info.start_time, datetime)]
    found = []
    for one in recordings:
        start = one.info.start_time
        found.append(start.timestamp() - min(clocks) if isinstance(start, datetime) else float(start or 0.0))
    return found


def prepare(
    simulation: Simulation,
    recording: Recording,
    cutoff_hz: float,
    motion_hz: float,
    standstill: Mapping[str, float],
    began: float,
    asked: Mapping[str, AskedTorque] = NOTHING_ASKED,
) -> Run:
    """Filter a recording and evaluate the simulation as it stands on its motion.

    `cutoff_hz` is that of the comparison, `motion_hz` up to where the position tells more than noise; `began`: when the
    recording's time was 0 [s] since the machine was switched on; `asked`: of the axes whose torque was not recorded.
    """
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    wide = effective_cutoff(period, min(WIDE * cutoff, motion_hz))
    kinematics = Kinematics.of(recording, simulation.axes, wide)
    compared = Kinematics.of(recording, simulation.axes, min(cutoff, wide))
    rigid = _rigid(simulation, kinematics, max(1, int(1.0 / (RIGID_RATE * wide * period))))
    inertia = _inertia(simulation, kinematics, max(1, int(0.02 / period)))
    weight = _weight(simulation, compared, max(1, int(0.02 / period)))
    slope = _weight_slope(simulation, kinematics, max(1, int(0.02 / period)))
    dynamics, narrow = simulation.dynamics(), _narrow(simulation, recording, min(cutoff, wide))
    axes = {}
    for k, axis in enumerate(simulation.axes):
        motion = Motion(
            position=kinematics.position[:, k].copy(),
            velocity=kinematics.velocity[:, k].copy(),
            acceleration=kinematics.acceleration[:, k].copy(),
            torque=torque_of(recording, axis),
            time=recording.time + began,
            rigid_torque=rigid[:, k].copy(),
            inertia=inertia[:, k, k].copy(),
            rotor_inertia=float(simulation.model.dof_armature[simulation.dof(axis)]),
            from_others=_from_others(inertia[:, k], kinematics.acceleration, k),
            band=cutoff,
            deflection=deflection(recording, axis, measured_position(recording.columns[axis], period), period, cutoff),
            weight_slope=slope[:, k, k].copy(),
        )
        chosen = select(narrow[axis], standstill[axis], 0.0)
        fitted = chosen.fitted if chosen.fitted.sum() >= ENOUGH_FITTED * chosen.moving.sum() else chosen.moving
        apart = fitted & select(narrow[axis], standstill[axis], REVERSAL).fitted
        used = apart if apart.sum() >= ENOUGH_FITTED * fitted.sum() else fitted
        sticks = _sticks(motion, standstill[axis], chosen.moving, round(STANDSTILL_REACH * reach(period, cutoff)))
        simulated = rigid[:, k] + dynamics[axis].friction.resistance(motion)
        base = zero_phase(np.where(sticks, motion.torque, simulated), period, cutoff)
        torque = zero_phase(motion.torque, period, cutoff)
        recorded = recording.columns[axis]["torque"]
        step = recording.info.axes[axis].torque_resolution or step_of(recorded)
        axes[axis] = AxisRun(
            axis,
            motion,
            torque,
            base,
            weight[:, k].copy(),
            sticks,
            used,
            fitted,
            unchanged(recorded, period),
            step,
            asked.get(axis),
        )
    coupling = _coupling(simulation.axes, inertia, slope)
    return Run(recording, period, cutoff, wide, stride_of(period, cutoff), compared, axes, coupling)


def stride_of(period: float, cutoff_hz: float) -> int:
    """Samples, one of which is compared: no more is in what passed the filter."""
    return max(1, int(1.0 / (COMPARED_RATE * cutoff_hz * period)))


def _sticks(motion: Motion, threshold: float, moving: Mask, near: int) -> Mask:
    """Where an axis stands within so many samples of some that count, into which the filter smears what it holds then.

    Before and after a rest, and as it reverses: for the milliseconds in which friction turns round, any torque between its two
    levels holds. Within half a sample of a reversal, position and torque of a sample do not tell on which side of it they were
    taken.
    """
    speed, turned = np.abs(motion.velocity), TURNED * motion.period * np.abs(motion.acceleration)
    return np.asarray((speed <= np.maximum(threshold, turned)) & widen(moving, near))


def _narrow(simulation: Simulation, recording: Recording, cutoff_hz: float) -> dict[str, AxisMotion]:
    """The motion through the filter of the comparison, by which motion and standstill are distinguished."""
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    found = {}
    for axis in simulation.axes:
        raw = measured_position(recording.columns[axis], period)
        position = zero_phase(raw, period, cutoff)
        velocity = fine_derivative(position, period)
        found[axis] = AxisMotion(
            recording=recording.name,
            axis=axis,
            period=period,
            cutoff_hz=cutoff,
            time=recording.time,
            position=position,
            velocity=velocity,
            acceleration=velocity,
            torque=velocity,
            model_torque=velocity,
            velocity_noise=velocity_noise(recording, axis, raw, position, cutoff),
        )
    return found


def _rigid(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    return between(simulation.torques(kinematics.every(stride)), len(kinematics.position), stride)


def _inertia(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    """d torque / d acceleration along the motion, (n, k, k): of each axis, by each axis."""
    few = kinematics.every(stride)
    rest = np.zeros_like(few.position)
    still = simulation.torques(Kinematics(few.position, rest, rest))
    columns = []
    for k in range(few.position.shape[1]):
        unit = rest.copy()
        unit[:, k] = 1.0
        columns.append(simulation.torques(Kinematics(few.position, rest, unit)) - still)
    whole = [between(column, len(kinematics.position), stride) for column in columns]
    return np.stack(whole, axis=2)


def _weight(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    """What each axis needs to stand where it is, (n, k)."""
    few = kinematics.every(stride)
    rest = np.zeros_like(few.position)
    return between(simulation.torques(Kinematics(few.position, rest, rest)), len(kinematics.position), stride)


def _weight_slope(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    """d weight / d position along the motion, (n, k, k): of each axis, by each axis; by central differences."""
    few = kinematics.every(stride)
    rest = np.zeros_like(few.position)
    columns = [simulation.slopes(Kinematics(few.position, rest, rest), axis) for axis in simulation.axes]
    whole = [between(column, len(kinematics.position), stride) for column in columns]
    return np.stack(whole, axis=2)


def _from_others(inertia: Array, acceleration: Array, k: int) -> Array:
    """Torque (n,) of axis k that the others' accelerations cost; both (n, axes)."""
    return np.asarray(np.einsum("nj,nj->n", inertia, acceleration) - inertia[:, k] * acceleration[:, k])


def _coupling(axes: Sequence[str], inertia: Array, slope: Array) -> dict[tuple[str, str], Coupling]:
    """What each axis feels of another, where its acceleration is felt; both (n, axes, axes)."""
    own = np.abs(np.diagonal(inertia, axis1=1, axis2=2)).max(axis=0)
    found = {}
    for k, of in enumerate(axes):
        for j, on in enumerate(axes):
            if j != k and np.abs(inertia[:, j, k]).max() > HARDLY_COUPLED * np.sqrt(own[j] * own[k]):
                found[of, on] = Coupling(inertia[:, j, k].copy(), slope[:, j, k].copy())
    return found


def between(values: Array, count: int, stride: int) -> Array:
    """Values (m, k) at every stride-th of `count` samples, joined by a cubic spline."""
    if stride == 1 or len(values) < 4:
        return np.repeat(values, stride, axis=0)[:count]
    at = np.arange(len(values)) * float(stride)
    return np.asarray(CubicSpline(at, values)(np.arange(count, dtype=np.float64)))
