"""What the reference least squares fits in each case: the columns that the README of the measured data found to matter."""

from __future__ import annotations

from dataclasses import dataclass

from measured.columns import (
    COULOMB,
    GRAVITY,
    INERTIA,
    OFFSET,
    VISCOUS,
    VISCOUS_ASYMMETRY,
    Choice,
    Column,
    gap_choices,
    load_friction,
    stribeck_choices,
    waves,
)
from measured.motion import Band

NO_CHOICE = (Choice("", ()),)


@dataclass(frozen=True)
class Recipe:
    """Columns of one case; of `choices` the one that fits the training recordings best is taken.

    within_file: columns fitted in each validation recording itself, where what they depend on begins anew in every one.
    at_mean_speed: the recordings are steady, and the model is one of friction over their mean speed.
    band: where there is no report whose band could be taken.
    """

    band: Band
    columns: tuple[Column, ...]
    choices: tuple[Choice, ...] = NO_CHOICE
    within_file: tuple[Column, ...] = ()
    at_mean_speed: bool = False


FRICTION = (COULOMB, VISCOUS)
RIGID = (INERTIA, *FRICTION)

_STEADY = Band(cutoff_hz=10.0, standstill_velocity=0.0)
_COGGING = Recipe(Band(150.0, 0.1), (*RIGID, *waves(12, 18, 24, 36, 72, 144)))
_TURN = Recipe(_STEADY, (COULOMB, *waves(1, 2)))
_SINE = Recipe(Band(30.0, 5.0), RIGID)
_GAP = Recipe(Band(20.0, 0.002), (INERTIA, VISCOUS), gap_choices())

_PENDULUM_MASS, _PENDULUM_LENGTH = 0.722588, 0.0678118247  # kg, m: the known weight, as in nominal.xml
_PENDULUM = load_friction(_PENDULUM_MASS * 9.81 * _PENDULUM_LENGTH, _PENDULUM_MASS * _PENDULUM_LENGTH**2)

RECIPES = {
    "epos2": Recipe(_STEADY, (*FRICTION, OFFSET), within_file=waves(1, 2), at_mean_speed=True),
    "epos2_turn_a": _TURN,
    "epos2_turn_b": _TURN,
    "epos3_up": Recipe(_STEADY, FRICTION, stribeck_choices(0.05, 10.0), at_mean_speed=True),
    "epos3": Recipe(_STEADY, (*FRICTION, OFFSET), stribeck_choices(0.05, 10.0), at_mean_speed=True),
    "bam_xl330": Recipe(Band(10.0, 0.1), (*RIGID, *GRAVITY, _PENDULUM)),
    "laas_cogging_comp": _COGGING,
    "laas_cogging_off": _COGGING,
    "laas_inertia_seeded": _SINE,
    "laas_no_gap": _SINE,
    "arts_backlash_30lb": _GAP,
    "arts_backlash_36lb": Recipe(_GAP.band, _GAP.columns, gap_choices(asymmetric=True)),
    "arts_tension_backlash": _GAP,
    "kinova_joint_5": Recipe(Band(120.0, 0.05), (*RIGID, *waves(1200, 1400))),
    "kinova_joint_6": Recipe(Band(120.0, 0.05), (*RIGID, *GRAVITY, *waves(1200, 1400, 2400, 2800))),
    "kinova_joint_7": Recipe(Band(120.0, 0.05), (*RIGID, *waves(1200))),
    "emps": Recipe(Band(48.0, 0.004), (*RIGID, OFFSET, VISCOUS_ASYMMETRY)),
    "epos_screw": Recipe(_STEADY, (*FRICTION, OFFSET), stribeck_choices(0.05, 10.0), at_mean_speed=True),
}
"""By case."""
