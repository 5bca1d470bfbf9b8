"""What a fit leaves, recording by recording, and its size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.identification.delay import delay_column
from drivetwin.identification.fit import Fit
from drivetwin.identification.least_squares import relative_error
from drivetwin.identification.model_scale import rest_torque
from drivetwin.identification.regressors import Term, build_design
from drivetwin.identification.result import Trace
from drivetwin.identification.stribeck import with_stribeck
from drivetwin.motion.moving import AxisSamples


def traces_of(samples: Sequence[AxisSamples], fit: Fit, offered: float, validation: bool) -> tuple[Trace, ...]:
    """The residual of each recording under `fit`; `offered` is the inertia that was taken off the model's torque."""
    later = (Term.STATIC_RISE, Term.MODEL_SCALE, Term.DELAY)
    at_once = [term for term in fit.design.terms if isinstance(term, Term) and term not in later]
    scale, delay = fit.solution.value(Term.MODEL_SCALE), fit.solution.value(Term.DELAY)
    traces = []
    for entry in samples:
        design = build_design([entry], at_once, offered)
        if fit.stribeck:
            design = with_stribeck(design, [entry], fit.stribeck)
        values = np.array([fit.solution.value(term) for term in design.terms])
        residual = design.target - design.matrix @ values
        residual = residual - scale * rest_torque(entry.motion, offered)
        residual = residual - delay * delay_column(entry.motion, residual)
        traces.append(Trace(entry, residual, validation))
    return tuple(traces)


def error_of_fit(traces: Sequence[Trace]) -> float:
    """Relative error over the samples in motion. Raises UserError where there are none: no data is no perfect fit."""
    error = error_if_moving(traces)
    if error is None:
        raise UserError("no sample in motion to judge the fit by: record a motion, or lower the threshold with --standstill")
    return error


def error_if_moving(traces: Sequence[Trace]) -> float | None:
    """The same; None where nothing moves, as may be in recordings to validate on."""
    moving = [trace for trace in traces if trace.samples.moving.any()]
    if not moving:
        return None
    return relative_error(
        [trace.samples.motion.torque[trace.samples.moving] for trace in moving],
        [trace.residual[trace.samples.moving] for trace in moving],
        [trace.samples.motion.period for trace in moving],
    )
