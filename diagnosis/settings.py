"""Every number that steers a diagnosis: one record, printed in report.json, with the source of each."""

from __future__ import annotations

from dataclasses import dataclass

LEAST_OFF = 0.005
"""Standard deviation of a parameter that a model has not, as the share of the axis's torque that it costs."""


@dataclass(frozen=True)
class Settings:
    """Settings of a diagnosis; the defaults serve every machine. docs/diagnosis.md has a table of them.

    cutoff_hz: -3 dB frequency of one pass of the zero-phase low-pass [Hz]; None: chosen from the recordings.
    seed: of the Bayesian bootstrap and of the resampled blocks behind the intervals.
    nominal_spread: standard deviation of a nominal parameter about the true one, as a share: what a data sheet and a weighed
        part usually give.
    nominal_freedom: degrees of freedom of the t distribution of that: most parameters are off by little, some by much.
    timing_spread, timing_share: standard deviation of the time by which torque and position of a sample differ [s]: half a bus
        cycle, and a share of the sample period.
    misfit: rms of each component of the smooth unknown, as a share of the axis's torque: the discrepancy of a calibrated
        simulator (Kennedy and O'Hagan, J. R. Stat. Soc. B 63(3), 2001). A gap that is no larger is none,
        whatever explains it.
    misfit_waves: number of waves that a component of the unknown may have over its range.
    colour_order: order of the autoregression that describes the noise.
    model_error: share of the torque less the weight by which the comparison itself errs (filters, derivatives, resampling),
        with what a model is expected to miss: what is no larger and has no name is no gap.
    least_share: share of an axis's gap energy that an effect must take to be named; `model_error` of the torque is enough.
    askew: probability that a hinge that is vertical in the model feels a weight: a tilted base, an unbalanced load.
    reversal: time around a reversal within which no gap is counted [s] of a torque that nobody recorded: the drive's loops ask
        for friction the other way round for some milliseconds, and how soon hangs on every step of the encoder. It is fitted.
    blocks: intervals of contiguous time in which motion is held out.
    widening: factor of every parameter's standard deviation, counted on 45 machines of the wide blind test: within what blocks
        of time tell, its error is in 75 %; within 2.5 times that, in 86 %.
    folds: parts of which each is held out in turn (Geisser 1975).
    rounds: largest number of effects added per axis.

    What follows is a choice; the table of sensitivity (docs/sensitivity.md) says what hangs on it.

    large: of what the largest effect on an axis takes of its gap, that another must take to be added before it.
    levels_tried: levels of friction, the best, that are tried with friction that yields before it slides.
    off: standard deviations by which a nominal parameter is off for more than chance.
    as_good: share of the draws in which another effect predicts no worse, from which the two are not distinguished: the usual
        level of a test.
    as_close: another effect is not distinguished from the chosen one if it leaves at most this share of what that takes, and at
        most `least_share` of the gap, more.
    substitutes: of the share that the chosen effect takes, that another must take to stand in its place: what takes less is
        one beside it.
    imitated: share of a torque without a name that some effect of the library usually takes by chance: 8 machines of an
        independent simulator.
    wide_step: of a parameter's own size, for differences where a joint or a bristle slips: each sample begins to slip at
        another value, and a narrow difference sees the steps and not the slope.
    """

    cutoff_hz: float | None = None
    seed: int = 0
    nominal_spread: float = 0.04
    nominal_freedom: float = 4.0
    timing_spread: float = 5e-4
    timing_share: float = 0.2
    misfit: float = 0.01
    misfit_waves: float = 8.0
    colour_order: int = 8
    model_error: float = 0.012
    least_share: float = 0.01
    askew: float = 0.01
    reversal: float = 0.015
    blocks: int = 40
    widening: float = 2.5
    folds: int = 5
    rounds: int = 6
    large: float = 0.5
    levels_tried: int = 4
    off: float = 2.5
    as_good: float = 0.05
    as_close: float = 0.05
    substitutes: float = 0.5
    imitated: float = 0.1
    wide_step: float = 0.05
