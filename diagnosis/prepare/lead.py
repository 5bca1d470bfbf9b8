"""How early a velocity loop takes the rate of its demand, where a recording without torque does not tell it."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.diagnosis.prepare.slow_motion import SlowMotion
from drivetwin.diagnosis.settings import LEAST_OFF, Settings
from drivetwin.twin.asked import asked
from drivetwin.twin.course import grid_of

Array = NDArray[np.float64]

LEADS = {0.0: 0.25, 0.5: 0.5, 1.0: 0.25}
"""Leads of the demand's rate that are tried, in servo periods, with their prior probability: its backward difference, the rate
of the moment, that of the next period."""
BLOCK = 1.0
"""Length of motion that counts as one independent value [s]."""
ROUNDS = 30
"""Iterations of the reweighted least squares."""
TINY = 1e-12
"""Torque, speed, acceleration or share of an energy that is none."""


def lead_of(simulation: Simulation, slow: Sequence[SlowMotion], axis: str, settings: Settings) -> float:
    """The most probable lead of the demand's rate [s], friction and inertia of the model off as they usually are.

    Little else distinguishes the leads: half a servo period looks like some per cent of inertia, and through a cascade's
    integral also like viscous friction.
    """
    if not any(one.laws[axis].velocity_feedforward * one.laws[axis].velocity_gain for one in slow):
        return 0.0
    period = float(np.median([grid_of(one.recording).period for one in slow]))
    worth = {share: _worth(simulation, slow, axis, share * period, settings) + log(prior) for share, prior in LEADS.items()}
    return period * max(worth, key=worth.__getitem__)


def _worth(simulation: Simulation, slow: Sequence[SlowMotion], axis: str, lead: float, settings: Settings) -> float:
    """Log density [nats] of what the model leaves of the asked torque, in independent values, and of its parameters.

    A model without any friction does not say that there is none: as in propose/nominal.py it may be as large as the torque.
    """
    k, inertia = simulation.axes.index(axis), simulation.home_inertia()[axis]
    friction = simulation.dynamics()[axis].friction
    values = np.array([friction.coulomb, friction.viscous, inertia])
    asked_for, rows, columns, seconds = [], [], [], 0.0
    for one in slow:
        loops, moving, velocity = one.law(axis, lead), one.moving(k), one.kinematics.velocity[:, k]
        own = np.column_stack([np.sign(velocity), velocity, one.kinematics.acceleration[:, k]])
        torque = one.filtered(asked(one.recording, axis, loops))
        left = torque - one.rigid[:, k] - own[:, :2] @ values[:2]
        level = float(loops.integrates)
        asked_for.append(torque[moving] - level * np.mean(torque[moving]))
        rows.append(left[moving] - level * np.mean(left[moving]))
        columns.append(own[moving] - level * np.mean(own[moving], axis=0))
        seconds += np.count_nonzero(moving) * one.period
    whole = np.vstack(columns)
    costs = _rms(np.concatenate(asked_for)) / np.maximum(np.sqrt(np.mean(whole**2, axis=0)), TINY)
    spreads = np.hypot(settings.nominal_spread * values, LEAST_OFF * costs)
    if not values[:2].any():
        spreads[:2] = costs[:2]
    return likeliest(whole * spreads, np.concatenate(rows), seconds / BLOCK, settings.nominal_freedom)


def likeliest(columns: Array, rows: Array, independent: float, freedom: float) -> float:
    """The highest log density [nats] of rows (m,) that hold so many independent values, less multiples of columns (m, p).

    The multiples have t distributions of scale 1: reweighted least squares (Lange, Little and Taylor, Journal of the American
    Statistical Association 84(408), 1989). Started from 0 and from plain least squares: either may lead to the higher maximum.
    """
    floor = max(TINY, TINY * float(np.sum(rows**2)))
    begun = (np.zeros(columns.shape[1]), np.linalg.lstsq(columns, rows, rcond=None)[0])
    return max(_climbed(np.asarray(times), columns, rows, independent, freedom, floor) for times in begun)


def _climbed(times: Array, columns: Array, rows: Array, independent: float, freedom: float, floor: float) -> float:
    """The same from where the multiples (p,) are, uphill; at least an energy `floor` is left."""
    products, wanted = columns.T @ columns, columns.T @ rows

    def left() -> float:
        return max(float(np.sum((rows - columns @ times) ** 2)), floor)

    for _ in range(ROUNDS):
        weights, share = np.diag((freedom + 1.0) / (freedom + times**2)), independent / left()
        times = np.asarray(np.linalg.solve(share * products + weights, share * wanted))
    return -0.5 * independent * log(left()) - 0.5 * (freedom + 1.0) * float(np.sum(np.log1p(times**2 / freedom)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
