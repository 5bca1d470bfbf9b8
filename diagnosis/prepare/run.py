"""A prepared recording: motion and torque of each axis, which samples count, and how a torque is felt through the filter."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.asked_torque import AskedTorque
from drivetwin.diagnosis.prepare.cutoff import HIGHEST_SHARE_OF_RATE
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.positions import moved
from drivetwin.diagnosis.prepare.shaking import shaken
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.motion import Wave
from drivetwin.emulator.effects import AxisEffect
from drivetwin.emulator.effects.base import Look, Need, Strays
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.lately import Lately, OfSame
from drivetwin.motion.earlier import earlier
from drivetwin.motion.filtering import reach, zero_phase
from drivetwin.motion.moving import widen
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Shares = Lately[tuple[bool, float, float, float], dict[str, NDArray[np.complex128]]]
"""What a wave costs each axis, (n,), by how it acts on its own and how late it is read."""

SAMPLED = (
    *("position", "velocity", "acceleration", "torque", "time", "rigid_torque", "inertia"),
    *("from_others", "weight_slope", "deflection"),
)
"""Fields of a motion that are samples, where it has them."""
PREDICTED_RATE = 8.0
"""Samples from which effects are predicted while they are searched, a period of the cut-off of the comparison, or of the motion
where that is lower: derivatives of them err by 0.2 %."""
FOLLOWED_RATE = 4.0
"""The same, a period of the motion's own cut-off: what of it is above that of the comparison only bends friction and joints."""
SHAKEN = 8
"""Waves of which it is kept what they cost other axes: a search asks for the same few again."""
AT_ONCE = 20_000
"""Samples at which the loops of all axes are solved at once: more take memory and no less time."""
WHOLE = 0.02
"""Of a period, that a number of them may differ from a whole one."""
OF_POSITION = frozenset({Need.ABSOLUTE_POSITION, Need.MOTOR_ANGLE})
"""What an effect of the position needs."""
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
    `coupling`, by two axes: what the second feels of the first, where it feels any. `unplaced`: axes of which nothing tells
    where they are, as springs and weights need it; `waves_within`: by axis, the way within which waves know its place
    [rad or m], 0 where they do not at all; everywhere, if not told.
    """

    recording: Recording
    period: float
    cutoff_hz: float
    motion_hz: float
    stride: int
    kinematics: Kinematics
    axes: Mapping[str, AxisRun]
    coupling: Mapping[tuple[str, str], Coupling]
    unplaced: frozenset[str] = frozenset()
    waves_within: Mapping[str, float] = field(default_factory=dict)
    _shaken: OfSame = field(init=False, repr=False, compare=False, default_factory=OfSame)
    _kept: dict[Hashable, Array] = field(init=False, repr=False, compare=False, default_factory=dict)

    def kept(self, key: Hashable, made: Callable[[], Array]) -> Array:
        """What is made of this recording for a key, made once: torque of changed rigid bodies, say, which takes its time."""
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
        """Torque (n,), filtered, that an effect costs its axis, and those that feel the joint move otherwise than measured.

        Zero where it is hidden.
        """
        motion = self.axes[axis].motion
        if self._hides(axis, effect, dynamics):
            return {axis: np.zeros(len(motion.position))}
        if not any(of == axis for of, _ in self.coupling):
            return {axis: self.felt(self.axes[axis], effect.predict(motion, dynamics))}
        torque, strays = effect.predict_with_joint(motion, dynamics)
        found = {axis: self.felt(self.axes[axis], torque)}
        if strays is not None:
            for (of, other), felt in self.coupling.items():
                if of == axis:
                    shaken_by = sum(self._shaken_by(axis, other, wave) for wave in strays.unseen)
                    found[other] = self.felt(self.axes[other], felt.torque(strays) + shaken_by)
        return found

    def _shaken_by(self, axis: str, other: str, wave: Wave) -> Array:
        """Torque (n,) that another axis gives for a wave that passes an axis; 0 where its loops are unknown."""
        of_frequency: Shares = self._shaken.get((wave.frequency,), Lately, SHAKEN)
        acts = wave.followed, wave.pushes, wave.late, wave.heavier
        shares = of_frequency.get(acts, lambda: self._shares(axis, wave), SHAKEN)
        return np.imag(wave.rotating * shares[other]) if other in shares else np.zeros(len(wave.rotating))

    def _shares(self, axis: str, wave: Wave) -> dict[str, NDArray[np.complex128]]:
        """For such a wave of size 1, by axis (n,), as their torques were read."""
        loops = {name: own.motion.sampling for name, own in self.axes.items() if own.motion.sampling is not None}
        there = loops[axis].unseen(wave.frequency, self.period) > 0.0
        torque = np.zeros((len(there), len(self.axes)), dtype=np.complex128)
        for rows in np.array_split(np.flatnonzero(there), there.sum() // AT_ONCE + 1):
            torque[rows] = shaken(loops, list(self.axes), self._inertia[rows], axis, wave, rows)
        torque *= np.exp(2j * np.pi * wave.late * wave.frequency)[:, None]
        columns = dict(zip(self.axes, torque.T, strict=True))
        return {name: columns[name] * each.turned(wave.frequency) for name, each in loops.items()}

    @cached_property
    def _inertia(self) -> Array:
        """Between all axes, (n, k, k)."""
        found = np.zeros((len(self.recording.time), len(self.axes), len(self.axes)))
        for k, (of, own) in enumerate(self.axes.items()):
            found[:, k, k] = own.motion.inertia
            for j, on in enumerate(self.axes):
                if (of, on) in self.coupling:
                    found[:, j, k] = self.coupling[of, on].inertia
        return found

    def deflected(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> Array | None:
        """How much further (n,), filtered, an effect has the joint ahead of its motor [rad or m]; None: no further."""
        ahead = None if self._hides(axis, effect, dynamics) else effect.deflect(self.axes[axis].motion, dynamics)
        return self.smooth(ahead) if ahead is not None else None

    def _hides(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> bool:
        """Whether an effect needs to know where an axis is, and nothing tells: of a wave, but for whole periods."""
        if not effect.needs & OF_POSITION:
            return False
        if Look.WAVE not in effect.looks:
            return axis in self.unplaced
        periods = self.waves_within.get(axis, inf) / effect.repeats(dynamics)
        return axis in self.waves_within and not (periods > 0.5 and abs(periods - round(periods)) < WHOLE)

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

    def with_weight_moved(self, axis: str, zero: float) -> Run:
        """The recording with the weight of an axis as it is so far from where it was prepared [rad or m]; near by."""
        own = self.axes[axis]
        moved_base = own.base + self.felt(own, np.asarray(zero * own.motion.weight_slope))
        return replace(self, axes={**self.axes, axis: replace(own, base=moved_base)})

    def later(self, began: float) -> Run:
        """The recording with its time counted from `began` [s] before: since when the machine was switched on."""
        axes = {name: replace(own, motion=replace(own.motion, time=own.motion.time + began)) for name, own in self.axes.items()}
        return replace(self, axes=axes)

    def within(self, unique: Mapping[str, float]) -> Run:
        """The recording with the length within which the position of some axes means the same as in others [rad or m]."""
        axes = {
            name: replace(own, motion=replace(own.motion, unique=unique.get(name, own.motion.unique)))
            for name, own in self.axes.items()
        }
        return replace(self, axes=axes)

    def of_unknown_loops(self, axes: Collection[str]) -> Run:
        """The recording without what the drives of some axes would give against a wave."""
        unknown = {axis: replace(self.axes[axis], motion=replace(self.axes[axis].motion, sampling=None)) for axis in axes}
        return replace(self, axes={**self.axes, **unknown}) if unknown else self

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


def stride_of(period: float, cutoff_hz: float) -> int:
    """Samples, one of which is compared: no more is in what passed the filter."""
    return max(1, int(1.0 / (COMPARED_RATE * cutoff_hz * period)))
