"""The columns of the regression: what each parameter's torque looks like in the recorded motion.

    tau - tau_rest = inertia a + coulomb H[sign v] + viscous v + offset
                     (+ viscous_difference |v|) (+ static_rise H[sign v exp(-(|v| / stribeck_velocity)^e)])

a and v come from the filtered position and carry the filter already; functions of them that bend sharply (the sign, the
Stribeck decay) are formed from the filtered velocity and filtered once, H[.], as the torque was. tau_rest is the
model's torque less that of the inertia at qpos0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from drivetwin.identification.friction_law import stribeck_decay
from drivetwin.motion.axis_motion import AxisMotion
from drivetwin.motion.moving import AxisSamples
from drivetwin.recording.recording import Samples

Indices = NDArray[np.int64]


class Term(Enum):
    """A linear parameter of the regression."""

    COULOMB = "coulomb"
    VISCOUS = "viscous"
    INERTIA = "inertia"
    OFFSET = "offset"
    VISCOUS_DIFFERENCE = "viscous_difference"
    STATIC_RISE = "static_rise"
    MODEL_SCALE = "model_scale"
    DELAY = "delay"


Label = Term | str
"""What a column of a regression is called: a term of the friction law, or the name of another model's parameter."""

_TINY = 1e-12

SYMMETRIC = (Term.COULOMB, Term.VISCOUS, Term.INERTIA, Term.OFFSET)


@dataclass(frozen=True)
class Stribeck:
    """The non-linear parameters of the Stribeck term: speed [rad/s or m/s] and exponent."""

    velocity: float
    exponent: float


def column(motion: AxisMotion, term: Term, stribeck: Stribeck | None = None) -> Samples:
    """d tau / d term along a motion, (n,)."""
    velocity = motion.velocity
    match term:
        case Term.COULOMB:
            return motion.smooth(np.sign(velocity))
        case Term.VISCOUS:
            return velocity
        case Term.INERTIA:
            return motion.acceleration
        case Term.OFFSET:
            return np.ones_like(velocity)
        case Term.VISCOUS_DIFFERENCE:
            return np.abs(velocity)
        case Term.STATIC_RISE:
            assert stribeck is not None
            decay = stribeck_decay(np.abs(velocity), stribeck.velocity, stribeck.exponent)
            return motion.smooth(np.sign(velocity) * decay)
        case Term.MODEL_SCALE | Term.DELAY:
            raise ValueError(f"the column of {term.value} needs more than the motion: see {term.value}.py")


def stribeck_velocity_column(motion: AxisMotion, static_rise: float, stribeck: Stribeck) -> Samples:
    """d tau / d stribeck_velocity, (n,): static_rise sign(v) exp(-x) exponent x / stribeck_velocity, x = (|v|/vs)^e."""
    speed = np.abs(motion.velocity)
    power = (speed / stribeck.velocity) ** stribeck.exponent
    slope = static_rise * np.exp(-power) * stribeck.exponent * power / stribeck.velocity
    return motion.smooth(np.sign(motion.velocity) * slope)


def stribeck_exponent_column(motion: AxisMotion, static_rise: float, stribeck: Stribeck) -> Samples:
    """d tau / d exponent, (n,): -static_rise sign(v) exp(-x) x ln(|v| / vs), x = (|v| / vs)^e."""
    ratio = np.maximum(np.abs(motion.velocity) / stribeck.velocity, _TINY)
    power = ratio**stribeck.exponent
    return motion.smooth(-static_rise * np.sign(motion.velocity) * np.exp(-power) * power * np.log(ratio))


@dataclass(frozen=True)
class Design:
    """The regression of one axis over all its recordings, rows in order of recording and time, unfitted rows included.

    `matrix` (n, p) with a column for each of `terms`, `target` (n,), `weight` (n,) with 0 on rows that are not fitted,
    `piece` (n,) the number of the recording, `seconds` (n,) the time within it, `block` (n,) the number of the filter's
    correlation time within it.
    """

    terms: tuple[Label, ...]
    matrix: Samples
    target: Samples
    weight: Samples
    piece: Indices
    seconds: Samples
    block: Indices

    def pick(self, terms: Sequence[Label]) -> Design:
        """The same regression with fewer or reordered columns."""
        at = [self.terms.index(term) for term in terms]
        return replace(self, terms=tuple(terms), matrix=self.matrix[:, at])

    def extend(self, term: Label, values: Samples) -> Design:
        """The same regression with one more column (n,)."""
        return replace(self, terms=(*self.terms, term), matrix=np.column_stack([self.matrix, values]))


def build_design(samples: Sequence[AxisSamples], terms: Sequence[Term], inertia: float) -> Design:
    """Stack the recordings. `inertia` [kg·m² or kg] is the model's at qpos0: its torque is taken off the model's.

    Rows are weighted by their sample period, so that a recording counts by its duration.
    """
    motions = [entry.motion for entry in samples]
    matrix = np.vstack([np.column_stack([column(motion, term) for term in terms]) for motion in motions])
    target = np.concatenate([motion.torque - (motion.model_torque - inertia * motion.acceleration) for motion in motions])
    weight = np.concatenate([entry.fitted * entry.motion.period for entry in samples])
    piece = np.repeat(np.arange(len(motions)), [len(motion.time) for motion in motions])
    seconds = [np.arange(len(motion.time)) * motion.period for motion in motions]
    block = [np.floor(s * m.cutoff_hz + 1e-9).astype(np.int64) for s, m in zip(seconds, motions, strict=True)]
    return Design(tuple(terms), matrix, target, weight, piece, np.concatenate(seconds), np.concatenate(block))
