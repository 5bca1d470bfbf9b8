"""Waves that pass an axis faster than its motion was recorded: what they cost other axes depends on the drives of all."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from math import pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.motion import Motion, Wave

Array = NDArray[np.float64]
Passing = Callable[[Motion, Motion], Wave | None]
"""Of a motion as it is read, and of the true one."""


def unseen_change(motion: Motion, changed: AxisDynamics, axis: AxisDynamics) -> list[Wave]:
    """What passes a changed axis, faster than the motion was recorded, and not the axis as it was, which is taken off."""
    if motion.sampling is None:
        return []
    after, before = _passing(changed), _passing(axis)
    come = [(_on(motion, changed, of), 1.0) for key, of in after.items() if key not in before]
    gone = [(_on(motion, axis, of), -1.0) for key, of in before.items() if key not in after]
    return [wave.times(sign) for wave, sign in (*come, *gone) if wave is not None]


def _passing(axis: AxisDynamics) -> dict[Hashable, Passing]:
    """The waves of an axis by all that each depends on."""
    if not axis.has_waves:
        return {}
    encoder = axis.encoder
    found: dict[Hashable, Passing] = {
        "encoder": partial(encoder.unseen, gear=axis.gear_ratio),
        ("gear", axis.transmission): partial(_of_gear, axis=axis),
        ("friction", axis.friction.of_position): axis.friction.unseen,
    }
    for number, ripple in enumerate(axis.ripples):
        found["ripple", number, ripple] = partial(ripple.unseen, gear_ratio=axis.gear_ratio)
    return {(key, encoder, axis.joint.inertia, axis.transmission.stiffness): passing for key, passing in found.items()}


def _on(motion: Motion, axis: AxisDynamics, of: Passing) -> Wave | None:
    """A wave as it passes the joint of an axis; None where no wave is unseen."""
    wave = of(motion, axis.encoder.truth(motion, axis.gear_ratio))
    if wave is None:
        return None
    wave = replace(wave, late=axis.encoder.delay, heavier=axis.joint.inertia)
    return wave.times(_follows(motion, axis, wave)) if axis.transmission.elastic else wave


def _of_gear(motion: Motion, truth: Motion, axis: AxisDynamics) -> Wave | None:
    gear, number = axis.transmission, axis.transmission.error_order * axis.gear_ratio
    wave = motion.unseen_wave(number * truth.position + gear.error_phase, number) if gear.error_amplitude != 0.0 else None
    if wave is None:
        return None
    height = -gear.error_amplitude * number**2 * truth.velocity**2
    return replace(wave.times(height), pushes=motion.rotor_inertia + axis.joint.inertia)


def _follows(motion: Motion, axis: AxisDynamics, wave: Wave) -> Array:
    """Share (n,) with which a link follows its motor through a spring: all far below its resonance, none far above. In between
    it swings by a damping that is hardly known, and is taken to follow no more than that.
    """
    below = (2.0 * pi * wave.frequency) ** 2 * float(np.median(motion.link)) / axis.transmission.stiffness
    return np.asarray(1.0 / (1.0 + below**2))
