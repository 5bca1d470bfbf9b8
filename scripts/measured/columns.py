"""The regressors of the reference least squares: what a unit of each parameter costs in torque on a measured motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from drivetwin.foundation.compiled import compiled
from measured.motion import Array, Motion

FADED = 0.05
"""Of the height of a Stribeck curve: at the slowest speed of a fit, less is left of it than can be told."""


@dataclass(frozen=True)
class Column:
    """One regressor: `of` gives its samples (n,) on a motion, `least` is the least that its parameter can be.

    Columns of one name are parts of one thing, as a sine and a cosine are. `shown`: the largest sample that a choice needs on
    the motion that it is fitted on, or its parameter is an extrapolation.
    """

    name: str
    of: Callable[[Motion], Array]
    least: float = -np.inf
    shown: float = 0.0


@dataclass(frozen=True)
class Choice:
    """Columns that depend on a number in which the torque is not linear; `name` says the number."""

    name: str
    columns: tuple[Column, ...]


INERTIA = Column("inertia", lambda motion: motion.acceleration, 0.0)
COULOMB = Column("coulomb", lambda motion: motion.smooth(np.sign(motion.velocity)), 0.0)
VISCOUS = Column("viscous", lambda motion: motion.velocity, 0.0)
OFFSET = Column("offset", lambda motion: np.ones_like(motion.velocity))
VISCOUS_ASYMMETRY = Column("viscous asymmetry", lambda motion: motion.smooth(np.abs(motion.velocity)))
GRAVITY = (
    Column("gravity", lambda motion: motion.smooth(np.sin(motion.raw))),
    Column("gravity", lambda motion: motion.smooth(np.cos(motion.raw))),
)


def waves(*orders: float) -> tuple[Column, ...]:
    """A sine and a cosine of the position for each number of waves a turn of the joint."""

    def wave(of: Callable[[Array], Array], order: float) -> Column:
        return Column(f"order {order:g}", lambda motion: motion.smooth(of(order * motion.raw)))

    return tuple(wave(of, order) for order in orders for of in (np.sin, np.cos))


def load_friction(weight: float, inertia: float) -> Column:
    """Friction per torque on the gear, of a pendulum with `weight` m g l [N·m] and `inertia` [kg·m²] behind it."""

    def of(motion: Motion) -> Array:
        load = weight * np.sin(motion.position) + inertia * motion.acceleration
        return motion.smooth(np.abs(load) * np.sign(motion.velocity))

    return Column("load friction", of, 0.0)


def stribeck_choices(slowest: float, fastest: float) -> tuple[Choice, ...]:
    """exp(-(|v| / v_s)^d) sgn(v) (Armstrong-Helouvry 1991) for v_s [rad/s] from slowest to fastest, d of 1/2, 1 and 2."""

    def choice(velocity: float, exponent: float) -> Choice:
        def of(motion: Motion) -> Array:
            return motion.smooth(np.exp(-((np.abs(motion.velocity) / velocity) ** exponent)) * np.sign(motion.velocity))

        return Choice(f"v_s {velocity:.3g} rad/s, exponent {exponent:g}", (Column("stribeck", of, 0.0, FADED),))

    return tuple(choice(float(v), d) for v, d in product(np.geomspace(slowest, fastest, 25), (0.5, 1.0, 2.0)))


def gap_choices(*, asymmetric: bool = False) -> tuple[Choice, ...]:
    """Coulomb friction behind a gap with elastic flanks, for gaps of 0 to 6 mm and flanks of 0.5 to 8 mm."""
    steps = product(np.arange(0.0, 6.01, 0.5), np.arange(0.5, 8.01, 0.5))
    return tuple(_gap_choice(1e-3 * float(gap), 1e-3 * float(flank), asymmetric) for gap, flank in steps)


def _gap_choice(gap: float, flank: float, asymmetric: bool) -> Choice:
    column = Column("coulomb behind a gap", lambda motion: motion.smooth(gap_share(motion.position, gap, flank)), 0.0)
    other = Column("its asymmetry", lambda motion: motion.smooth(np.abs(gap_share(motion.position, gap, flank))))
    columns = (column, other) if asymmetric else (column,)
    return Choice(f"gap {1e3 * gap:g} mm, flanks {1e3 * flank:g} mm", columns)


def gap_share(position: Array, gap: float, flank: float) -> Array:
    """Share -1..1 of the Coulomb force that passes a gap [m] with elastic flanks [m each], (n,) over position (n,) [m].

    Friction holds the far side until the flank is pressed all the way; it begins in the middle of the gap.
    """
    strain = _strain(position, 0.5 * gap + flank)
    return np.asarray(np.sign(strain) * np.maximum(np.abs(strain) - 0.5 * gap, 0.0) / flank)


@compiled
def _strain(position, most):  # type: ignore[no-untyped-def]
    """How far the near side is ahead of the far side: the play operator (Krejci 1996), (n,)."""
    strain = np.zeros(len(position))
    for k in range(1, len(position)):
        ahead = strain[k - 1] + position[k] - position[k - 1]
        strain[k] = min(max(ahead, -most), most)
    return strain
